"""Many designs through their steps by numpy: the kernel's instructions over arrays (steps, designs), and its checks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.backend import DesignBatch
from planar.batch.march.kernel import (
    BareAngle,
    KernelBlock,
    KernelEquations,
    KernelInstructions,
    Operand,
)
from planar.batch.march.numpy.systems import newton_step, stack_values
from planar.batch.march.prediction import MAX_TURN_PER_STEP, PREDICTOR_ORDER, extrapolation_weights
from planar.batch.march.regularity import LEAST_KERNEL_REGULARITY, LEAST_START_REGULARITY, least_regularity
from planar.codegen.printed_formula import PrintedFunction, compile_numpy
from planar.equations.linear import solve_vectors
from planar.foundation.instruction_list import UnsupportedOperation, required_values

Array = np.ndarray
OperandArrays = dict[Operand, Any]


class _KernelPart(NamedTuple):
    """A function of operands, then of values by number that do not vary."""

    function: PrintedFunction
    operands: tuple[Operand, ...]
    invariants: tuple[int, ...]


class NumpyKernel(KernelInstructions):
    """The functions of a structure for points on links: where it starts, its blocks, and what a step ends with.

    `point_blocks`, of the block that places each point: with it the points in the other assembly of it are told too.
    """

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        rates: bool,
        point_blocks: tuple[int, ...] | None,
        carried: frozenset[Operand],
    ):
        super().__init__(equations, links, rates, frozenset({"p", "q", "u1", "u2", "stop"}), carried)
        self.point_blocks = point_blocks
        self.has_newton_blocks = equations.has_newton_blocks
        self.is_sequential = self.has_newton_blocks or bool(carried)
        "whether a step needs the one before"
        known: set[Operand] = set(self.input_operands)
        self.start_operands = tuple(known | {("u", k) for k in range(len(equations.input_is_angle))})
        known |= set(self.start_operands)
        known |= {("sign", k) for k in range(len(equations.closed_forms))}
        at_start = known | {each for k in range(len(equations.is_angle)) for each in self.unknown_operands(k)}
        self.sides = self._make_part([equations.sides], at_start)
        self.blocks: list[tuple[KernelBlock, _KernelPart]] = []
        self.block_points: dict[int, tuple[list[int], _KernelPart]] = {}
        for part in equations.blocks:
            index, unknowns = part.block.block_index, {each for k in part.unknowns for each in self.unknown_operands(k)}
            if part.closed_form is None:
                known |= unknowns
                self.blocks.append((part, self._make_part(self._newton_outputs(part), known)))
                continue
            self.blocks.append((part, self._make_part(self.closed_form_outputs(part), known)))
            known |= unknowns
            points = [k for k, each in enumerate(point_blocks or ()) if each == index]
            if points:
                self.block_points[index] = points, self._make_part([self.point_coordinates(points)], known)
        self.stops = self._make_part(self.stop_outputs(), known) if equations.stop_pairs else None
        self.rate_parts: list[tuple[KernelBlock, list[_KernelPart]]] = []
        "of each block the Jacobian's rows, then what its first and its second rates make up for"
        known |= {(name, k) for name in ("u1", "u2") for k in range(len(equations.input_is_angle))}
        for part, system in zip(equations.blocks, self.rate_systems(), strict=False):
            steps = []
            for output, own in ((ca.vec(system.jacobian.T), ""), (system.first, "z1"), (system.second, "z2")):
                steps.append(self._make_part([output], known))
                known |= {(own, k) for k in part.unknowns} if own else set()
            self.rate_parts.append((part, steps))
        ends = [equations.residuals(), self.counted_angles(), *self.output_expressions()]
        self.residual_count, self.counted_angle_count = (each.numel() for each in ends[:2])
        self.end = self._make_part(ends, known)
        self._compile_invariants()

    def _newton_outputs(self, part: KernelBlock) -> list[ca.SX]:
        """Newton's step with how regular the Jacobian is; of large blocks the residuals and the Jacobian's columns."""
        return self.newton_system(part) if part.is_large else self.equations.newton_step(part.block)

    def _make_part(self, outputs: Sequence[ca.SX], known: Iterable[Operand]) -> _KernelPart:
        """Raises BareAngle for an operand that is not known."""
        made, invariants = self.hoister.result, self.hoister.invariants
        wanted = self.list_values(outputs)
        operands: list[int] = []
        keys: list[Operand] = []
        held: list[int] = []
        for number in required_values(made, wanted, invariants):
            operation, _, _, operand = made.instructions[number]
            if number in invariants:
                held += [number] if operation != "const" else []
            elif operand is not None:
                if operand not in known:
                    raise BareAngle(operand)
                operands.append(number)
                keys.append(operand)
        function = compile_numpy(made, wanted, (*operands, *held))
        return _KernelPart(function, tuple(keys), tuple(held))

    def _compile_invariants(self) -> None:
        """What does not vary, for all parts at once."""
        parts = (
            self.sides,
            self.end,
            *([] if self.stops is None else [self.stops]),
            *(own for _, own in self.blocks),
            *(own for _, own in self.block_points.values()),
            *(own for _, steps in self.rate_parts for own in steps),
        )
        self.invariant_numbers = tuple(dict.fromkeys(number for part in parts for number in part.invariants))
        made = self.hoister.result
        required = required_values(made, self.invariant_numbers)
        inputs = {each: key for each in required if (key := made.instructions[each].key) is not None}
        self.invariant_operands: tuple[Operand, ...] = tuple(inputs.values())
        self.invariant_function = compile_numpy(made, self.invariant_numbers, tuple(inputs))


def make_numpy_kernel(
    equations: KernelEquations, links: tuple[str, ...], rates: bool, point_blocks: tuple[int, ...] | None
) -> NumpyKernel:
    """The kernel, with those angles carried whose own values are needed. Raises UnsupportedOperation."""
    carried: frozenset[Operand] = frozenset()
    while True:
        try:
            return NumpyKernel(equations, links, rates, point_blocks, carried)
        except BareAngle as angle:
            if angle.operand in carried:  # its value is wanted before its own block is solved
                raise UnsupportedOperation(f"a block stands in an angle of a later one: {angle.operand}") from None
            carried |= {angle.operand}


class MarchedSteps(NamedTuple):
    """Some steps of all designs: everything by operand, points and rates in rows, in sizes, the points in the other
    assembly of their blocks by number, and how regular the least regular block is that Newton's method solved, each an
    array that may be spread over (steps, designs); `passed` (steps, designs): all checks at these steps and before."""

    values: OperandArrays
    outputs: Sequence[Any]
    other_points: dict[int, Sequence[Any]]
    squared_regularity: Any
    passed: Array

    def unknowns(self, count: int, step: int = -1) -> Array:
        """The unknowns (unknowns, designs) at one of the steps."""
        z = np.empty((count, self.passed.shape[1]))
        for k in range(count):
            own = self.values.get(("z", k))
            if own is None:
                own = np.arctan2(self.values["zs", k], self.values["zc", k])
            z[k] = np.broadcast_to(own, self.passed.shape)[step]
        return z


class DesignMarch:
    """Designs of a batch on their way: where the inputs start, and what is known of the steps before.

    The sum of the residuals may be `batch.tolerance` at most, and what is corrected `correction_limit` (rad or sizes).
    """

    def __init__(self, kernel: NumpyKernel, batch: DesignBatch, counts: Array, correction_limit: float):
        self.kernel, self.counts, self.correction_limit = kernel, counts, correction_limit
        self.tolerance = batch.tolerance
        rows = {"p": batch.p, "q": batch.q, "u1": batch.u1, "u2": batch.u2}
        rows |= {} if batch.stops is None else {"stop": batch.stops.numbers}
        given = [rows[name][k] for name, k in kernel.invariant_operands]
        held = kernel.invariant_function(*given)
        self.invariants = dict(zip(kernel.invariant_numbers, held, strict=True))
        self.start = {each: _operand(each, batch.u0) for each in kernel.start_operands}
        unknowns = range(len(kernel.equations.is_angle))
        state = {each: _operand(each, batch.z0) for k in unknowns for each in kernel.unknown_operands(k)}
        sides = self._evaluate(kernel.sides, self.start | state)
        self.signs = {("sign", k): np.copysign(1.0, side) for k, side in enumerate(sides)}
        kept = [
            k
            for part, _ in kernel.blocks
            for k in part.unknowns
            if part.closed_form is None or kernel.is_carried(("z", k))
        ]
        self.state = {each: state[each] for k in kept for each in kernel.unknown_operands(k)}
        self.history: list[OperandArrays] = [self.state]
        designs = batch.p.shape[1]
        watched = (*kernel.equations.closed_forms, *kernel.equations.stop_pairs)
        self.coalescences = [np.zeros((2, designs)) for _ in watched]
        self.counted_angles = [np.zeros(designs) for _ in range(kernel.counted_angle_count)]
        self.passed, self.step = np.ones(designs, dtype=bool), 0

    def select(self, which: Array) -> None:
        """Go on with some of the designs only."""
        count = len(self.passed)

        def own(value: Any) -> Any:
            return value[..., which] if np.ndim(value) and np.shape(value)[-1] == count else value

        def each_of(values: dict[Any, Any]) -> dict[Any, Any]:
            return {key: own(value) for key, value in values.items()}

        self.invariants, self.start = each_of(self.invariants), each_of(self.start)
        self.signs = each_of(self.signs)
        self.state, self.history = each_of(self.state), [each_of(state) for state in self.history]
        self.coalescences = [own(each) for each in self.coalescences]
        self.counted_angles, self.passed = [own(each) for each in self.counted_angles], self.passed[which]

    def _evaluate(self, part: _KernelPart, values: OperandArrays) -> tuple[Any, ...]:
        given = (values[each] for each in part.operands)
        return part.function(*given, *(self.invariants[number] for number in part.invariants))

    def advance(self, offsets: Array) -> MarchedSteps:
        """The next steps, at which inputs are so far from where they start (inputs, steps, designs or 1).

        Of kernels that are sequential one at a time.
        """
        kernel, shape = self.kernel, (offsets.shape[1], len(self.passed))
        steps = self.step + np.arange(shape[0])[:, None]
        values = self._inputs(offsets)
        fine, regularity, corrected = np.ones(shape, dtype=bool), 1.0, 0.0
        other_points: dict[int, Sequence[Any]] = {}
        for part, own in kernel.blocks:
            if part.closed_form is None:
                own_regularity, squared_arm, moved = self._correct_block(part, own, values)
                regularity, corrected = np.minimum(regularity, own_regularity), corrected + moved
                if kernel.point_blocks is None:
                    fine &= own_regularity >= least_regularity(LEAST_KERNEL_REGULARITY**2, len(part.unknowns))
                    fine &= squared_arm >= LEAST_START_REGULARITY**2
            else:
                if part.block.block_index in kernel.block_points:
                    other_points |= self._other_points(part, own, values)
                index = kernel.sign_index[part.block.block_index]
                fine &= self._keeps_below(index, self._solve_closed_form(part, own, values), steps, shape)
        if kernel.stops is not None:
            for k, value in enumerate(self._evaluate(kernel.stops, values), len(kernel.equations.closed_forms)):
                fine &= self._keeps_below(k, value, steps, shape)
        self._add_rates(values, shape)
        found = self._evaluate(kernel.end, values)
        first = kernel.residual_count + kernel.counted_angle_count
        for k, angle in enumerate(found[kernel.residual_count : first]):
            fine &= self._turns_little(k, angle, shape)
        fine &= self._residual_sum(found[: kernel.residual_count], values) <= self.tolerance
        if kernel.has_newton_blocks:
            if kernel.point_blocks is not None:
                fine &= regularity >= LEAST_KERNEL_REGULARITY**3
            fine &= (corrected <= self.correction_limit) | (steps <= PREDICTOR_ORDER)
            newton = [k for part, _ in kernel.blocks if part.closed_form is None for k in part.unknowns]
            newest = {each: values[each] for k in newton for each in kernel.unknown_operands(k)}
            # ahead of the first step there is its start
            self.history = [newest, *(self.history[: PREDICTOR_ORDER - 1] if self.step else ())]
        passed = np.logical_and.accumulate(fine, axis=0) & self.passed
        self.passed, self.step = passed[-1], self.step + shape[0]
        return MarchedSteps(values, found[first:], other_points, regularity, passed)

    def _add_rates(self, values: OperandArrays, shape: tuple[int, int]) -> None:
        """The rates of the unknowns put into `values`, where they are solved in numbers."""
        for part, (jacobian, *right_sides) in self.kernel.rate_parts:
            matrices = stack_values(self._evaluate(jacobian, values), shape)
            matrices = matrices.reshape(*shape, len(part.unknowns), len(part.unknowns))
            for name, own in zip(("z1", "z2"), right_sides, strict=True):
                found = solve_vectors(matrices, stack_values(self._evaluate(own, values), shape))
                values |= {(name, k): -found[..., n] for n, k in enumerate(part.unknowns)}

    def _inputs(self, offsets: Array) -> OperandArrays:
        """Where the inputs are, with the signs of the blocks."""
        values: OperandArrays = dict(self.signs)
        for k, is_angle in enumerate(self.kernel.equations.input_is_angle):
            values["u", k] = self.start["u", k] + offsets[k]
            if is_angle:
                cos, sin = np.cos(offsets[k]), np.sin(offsets[k])
                values["uc", k], values["us", k] = _rotate(self.start["uc", k], self.start["us", k], cos, sin)
        return values

    def _residual_sum(self, residuals: Sequence[Any], values: OperandArrays) -> Any:
        """What all constraints leave open; a sum, in which what is not a number stays so, and is not below anything."""
        total: Any = 0.0
        for each in residuals:
            total = total + np.abs(each)
        for k, is_angle in enumerate(self.kernel.equations.is_angle):
            if is_angle:
                total = total + np.abs(values["zc", k] ** 2 + values["zs", k] ** 2 - 1.0)
        return total

    def _solve_closed_form(self, part: KernelBlock, own: _KernelPart, values: OperandArrays) -> Any:
        """A block's unknowns put into `values`; how near its two assemblies are to where they meet."""
        *unknowns, coalescence = self._evaluate(own, values)
        values.update(zip(self.kernel.closed_form_operands(part), unknowns, strict=True))
        for k in part.unknowns:
            if self.kernel.is_carried(("z", k)):
                self._carry_angle(k, values)
        return coalescence

    def _keeps_below(self, index: int, coalescence: Any, steps: Array, shape: tuple[int, int]) -> Array:
        """Where two assemblies of a block keep apart, or a pair from its stops, between steps too: `coalescence` does
        not reach one.

        By as much as it bends over the last three steps. So it may be the step before at which it had come too near.
        """
        rows = np.concatenate([self.coalescences[index], np.broadcast_to(coalescence, shape)])
        self.coalescences[index] = rows[-2:]
        earlier, before, here = rows[:-2], rows[1:-1], rows[2:]
        most = np.maximum(np.maximum(here, before), earlier)
        bend = 0.5 * np.abs((here + earlier) - (before + before))
        return 1.0 - most - np.where(steps > 1, bend, 0.0) >= LEAST_KERNEL_REGULARITY**2

    def _other_points(self, part: KernelBlock, own: _KernelPart, values: OperandArrays) -> dict[int, Sequence[Any]]:
        """Where a block places its points in its other assembly."""
        sign = "sign", self.kernel.sign_index[part.block.block_index]
        there = values | {sign: -values[sign]}
        there.update(zip(self.kernel.closed_form_operands(part), self._evaluate(own, there)[:-1], strict=True))
        points, places = self.kernel.block_points[part.block.block_index]
        flat = self._evaluate(places, there)
        return {k: flat[2 * n : 2 * n + 2] for n, k in enumerate(points)}

    def _carry_angle(self, k: int, values: OperandArrays) -> None:
        """Move an angle's own value on to where its new cos and sin are."""
        c, s = self.state["zc", k], self.state["zs", k]
        cos, sin = _rotate(values["zc", k], values["zs", k], c, -s)
        values["z", k] = self.state["z", k] + 2.0 * np.arctan(sin / (1.0 + cos))
        self.state = self.state | {(name, k): values[name, k] for name in ("zc", "zs", "z")}

    def _turns_little(self, index: int, angle: Any, shape: tuple[int, int]) -> Array:
        """Where a counted angle is not far from where it was a step before."""
        rows = np.concatenate([self.counted_angles[index][None], np.broadcast_to(angle, shape)])
        near = np.abs(np.diff(rows, axis=0)) <= MAX_TURN_PER_STEP
        near[: 1 if self.step == 0 else 0] = True
        self.counted_angles[index] = rows[-1]
        return near

    def _correct_block(self, part: KernelBlock, own: _KernelPart, values: OperandArrays) -> tuple[Any, Any, Any]:
        """Newton's method from where the block would be if it went on as before: how regular, how short the shortest
        arm (squared), how far corrected."""
        kernel, is_angle = self.kernel, self.kernel.equations.is_angle
        weights = extrapolation_weights(min(max(self.step, 1), PREDICTOR_ORDER))
        for each in (operand for k in part.unknowns for operand in kernel.unknown_operands(k)):
            values[each] = sum(weight * past[each] for weight, past in zip(weights, self.history, strict=False))
        for k in part.unknowns:
            if is_angle[k]:
                values["zc", k], values["zs", k] = _normalise(values["zc", k], values["zs", k])
        regularity, squared_arm, corrected = np.inf, 1.0, np.zeros(1)
        for _ in range(int(self.counts[self.step])):
            step, regularity, squared_arm = newton_step(part, self._evaluate(own, values))
            for k, each in zip(part.unknowns, step, strict=True):
                corrected = corrected + np.abs(each)
                if ("z", k) in values:
                    values["z", k] = values["z", k] - each
                if kernel.is_carried(("z", k)):
                    values["zc", k], values["zs", k] = np.cos(values["z", k]), np.sin(values["z", k])
                elif is_angle[k]:
                    values["zc", k], values["zs", k] = _rotate_little(values["zc", k], values["zs", k], -each)
        return regularity, squared_arm, corrected


def _operand(operand: Operand, rows: Array) -> Array:
    """Cosines, sines or values of a row, as an operand says."""
    name, k = operand
    return {"c": np.cos, "s": np.sin}.get(name[1:], np.positive)(rows[k])


def _rotate(cos: Any, sin: Any, c: Any, s: Any) -> tuple[Any, Any]:
    """The cos and sin of a sum of two angles."""
    return cos * c - sin * s, sin * c + cos * s


def _rotate_little(cos: Any, sin: Any, angle: Any) -> tuple[Any, Any]:
    """The cos and sin of an angle turned by a little."""
    square = angle * angle
    return _normalise(*_rotate(cos, sin, 1.0 - 0.5 * square, angle * (1.0 - square * (1.0 / 6.0))))


def _normalise(cos: Any, sin: Any) -> tuple[Any, Any]:
    """What is nearly of length one, nearer to it: the inverse root by its first terms."""
    scale = 1.5 - 0.5 * (cos * cos + sin * sin)
    return cos * scale, sin * scale
