"""A kernel's instructions as LLVM IR: blocks, angles and checks as values of the lanes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from math import inf, sqrt

import casadi as ca

from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations, Operand
from planar.batch.march.prediction import (
    LEAST_KERNEL_REGULARITY,
    LEAST_START_REGULARITY,
    PREDICTOR_ORDER,
    TABLE_COLUMNS,
)
from planar.batch.march.stops import NUMBERS_PER_STOP, are_periodic, stop_rooms
from planar.codegen.instructions import CosSin, InvariantHoister, check_length, expand_angle_sums
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.llvm_linear import LinearSystems
from planar.equations.casadi_functions import inline_function
from planar.equations.closed_form import ClosedForm
from planar.equations.linear import solve_by_determinants, solve_with_volume
from planar.equations.rates import block_jacobian, first_and_second_rates
from planar.equations.residuals import input_positions, scalars
from planar.foundation.geometry import Vector
from planar.foundation.instruction_list import InstructionList, required_values
from planar.model.mechanism import links_counting_turns
from planar.model.pairs import MeasureKind
from planar.solving.checks import EPS, NEGLIGIBLE_ERROR

OperandNames = dict[Operand, str]
"""The names under which numbers stand in the text."""
HISTORY_LENGTH = 8
"""Steps before for which there is room: a power of two, more than `PREDICTOR_ORDER`."""
LEAST_CANDIDATE_REGULARITY = 1e-3
"""Of a position that may stand as it is once it is known that there is no dead point before it."""


class KernelWriter:
    """The text of one function, written front to back, and its instructions, all in one list: blocks, checks, and
    points on links with their rates.

    `links` are those of the points, none of which is the frame. The values of instructions that depend on `invariant`
    kinds of operands alone are `hoister.invariants`; `carried` are the angles whose values stand beside their cos and
    sin.
    """

    regularity_slot: str
    "of the least regular block that Newton's method solves, at a step"

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        rates: bool,
        lanes: int,
        invariant: frozenset[str] = frozenset(),
        carried: frozenset[Operand] = frozenset(),
    ):
        self.equations, self.links, self.rates, self.carried = equations, links, rates, carried
        self.solves_rates_apart = equations.has_large_blocks
        "whether the unknowns' rates are solved block after block, so that they are symbols to what is made of them"
        e = equations.equations
        self.symbols: dict[str, ca.SX] = {
            "z": e.z,
            "u": e.u,
            "p": e.p,
            "q": ca.SX.sym("q", 2 * len(links)),
            "u1": ca.SX.sym("u1", e.u.numel()),
            "u2": ca.SX.sym("u2", e.u.numel()),
            "z1": ca.SX.sym("z1", e.z.numel()),
            "z2": ca.SX.sym("z2", e.z.numel()),
            "sign": ca.vertcat(ca.SX(0, 1), *(form.sign for form in equations.closed_forms)),
            "scale": ca.SX.sym("scale"),
            "stop": ca.SX.sym("stop", NUMBERS_PER_STOP * len(equations.stop_pairs)),
        }
        self.hoister = InvariantHoister[Operand](lambda operand: operand[0] in invariant)
        with_signs = [part for part in equations.blocks if part.closed_form and part.closed_form.sign.numel()]
        self.sign_index = {part.block.block_index: k for k, part in enumerate(with_signs)}
        self.ir = IRWriter(lanes)
        self.lane = "0"
        "the first design of the block of designs that is computed"
        self.hoisted_names: dict[int, str] = {}
        "of what does not vary"
        self.linear_systems: LinearSystems | None = None

    def state_operands(self) -> tuple[Operand, ...]:
        """What stands for all unknowns: a length, or the cos and sin of an angle, and its value where it is carried."""
        operands: list[Operand] = []
        for k, is_angle in enumerate(self.equations.is_angle):
            operands += [("zc", k), ("zs", k)] if is_angle else []
            operands += [("z", k)] if not is_angle or ("z", k) in self.carried else []
        return tuple(operands)

    def list_values(self, outputs: Sequence[ca.SX], written: int | None = None) -> list[int]:
        """The numbers, in `hoister.result`, of the values of expressions. Raises UnsupportedOperation.

        `written`: the count of earlier instructions, see `check_length`; None without a limit.
        """
        return self.hoister.rebuild(*self._list_expressions(outputs, written))

    def _list_expressions(
        self, outputs: Sequence[ca.SX], written: int | None
    ) -> tuple[InstructionList[Operand], list[int]]:
        """The instructions of expressions, and the numbers of their values. Raises UnsupportedOperation."""
        function = ca.Function("part", list(self.symbols.values()), [ca.densify(ca.vertcat(*outputs))], {"cse": True})
        if written is not None:
            check_length(written + function.n_instructions())
        listing: InstructionList[Operand] = InstructionList()
        angles: dict[int, CosSin] = {}
        equations = self.equations
        are_angles = {"z": equations.is_angle, "u": equations.input_is_angle, "p": equations.number_is_angle}
        arguments = []
        for name, symbol in self.symbols.items():
            numbers = [
                listing.add_constant(0.0) if (name, k) in equations.zeros else listing.add_input((name, k))
                for k in range(symbol.numel())
            ]
            arguments.append(numbers)
            for k, is_angle in enumerate(are_angles.get(name, ())):
                if is_angle:
                    angles[numbers[k]] = CosSin(*(listing.add_input((name + part, k)) for part in "cs"))
        (values,) = inline_function(listing, function, arguments)
        return expand_angle_sums(listing, values, angles)

    def closed_form_operands(self, part: KernelBlock) -> list[Operand]:
        """What stands for the unknowns of a block in closed form, in the order of `closed_form_outputs`."""
        assert part.closed_form is not None
        return [
            operand
            for k, values in zip(part.unknowns, part.closed_form.values, strict=True)
            for operand in ([("zc", k), ("zs", k)] if len(values) == 2 else [("z", k)])
        ]

    def coalescence(self, form: ClosedForm) -> ca.SX:
        """How near the two assemblies of a closed form are to where they meet.

        An arm that shrinks to `LEAST_START_REGULARITY` counts as that too: what turns on it is not determined.
        """
        if form.squared_arm is None:
            return form.coalescence
        return form.coalescence + LEAST_START_REGULARITY**2 * (1.0 / form.squared_arm)  # the form divides by it too

    def point_coordinates(self, points: Sequence[int]) -> ca.SX:
        """x and y of some of the points."""
        q = self.symbols["q"]
        frames = self.equations.frames
        positions = [frames[self.links[k]].to_world(Vector(q[2 * k], q[2 * k + 1])) for k in points]
        return ca.vertcat(ca.SX(0, 1), *(part for position in positions for part in position))

    def counted_angles(self) -> ca.SX:
        """Angles of links that wheels or racks tie: they may turn much farther in a step than the inputs do."""
        e, links = self.equations.equations, links_counting_turns(self.equations.mechanism)
        unknown = {column: k for k, column in enumerate(e.unknowns)}
        columns = [
            column
            for column, coordinate in enumerate(e.coordinates)
            if coordinate.owner in links and coordinate.of_link and coordinate.kind is MeasureKind.ANGLE
        ]
        # what nothing is made of but cos and sin is as fast as the block that it is in
        counted = [e.w[k] for k in columns if k not in unknown or ("z", unknown[k]) in self.carried]
        return ca.vertcat(ca.SX(0, 1), *counted)

    def output_expressions(self) -> list[ca.SX]:
        """The points' positions, and rates."""
        e, s = self.equations.equations, self.symbols
        positions = self.point_coordinates(range(len(self.links)))
        if not self.rates:
            return [positions]
        u1, u2 = s["u1"], s["u2"]
        z1, z2 = (s["z1"], s["z2"]) if self.solves_rates_apart else self.equations.rates(u1, u2)
        return [positions, *first_and_second_rates(positions, e.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))]

    def entry_pointer(self, base: str, row: int) -> str:
        """Where a row has the entries of the block of designs; rows are `%width` apart."""
        return self.ir.row_pointer(base, "%width", row, self.lane)

    def load_entry(self, base: str, row: int) -> str:
        """The entries of a row."""
        return self.ir.load(self.entry_pointer(base, row))

    def write_values(self, outputs: Sequence[ca.SX], names: Mapping[Operand, str]) -> list[str]:
        """The values of expressions where numbers stand under these names. Raises BareAngle, UnsupportedOperation."""
        return self._write_listed(self.list_values(outputs, self.ir.count), names)

    def _write_listed(self, results: list[int], names: Mapping[Operand, str]) -> list[str]:
        """Write the values with these numbers of `hoister.result`. Raises BareAngle, UnsupportedOperation."""
        made, invariants = self.hoister.result, self.hoister.invariants
        order = required_values(made, results)
        written = {}
        for k in order:
            operand = made.instructions[k].key
            if operand is not None:
                if operand not in names:
                    raise BareAngle(operand)
                written[k] = names[operand]
        ahead = [k for k in order if k in invariants and k not in self.hoisted_names]
        with self.ir.hoisted():
            self.ir.write_values(made, ahead, self.hoisted_names, written)
        written |= {k: self.hoisted_names[k] for k in order if k in invariants}
        self.ir.write_values(made, [k for k in order if k not in invariants], written, written)
        check_length(self.ir.count)
        return [written[k] for k in results]

    def write_separately(self, outputs: Sequence[ca.SX], names: Mapping[Operand, str]) -> list[list[str]]:
        """The same, of each expression by itself."""
        values = iter(self.write_values(outputs, names))
        return [[next(values) for _ in range(output.numel())] for output in outputs]

    def write_closed_form(self, part: KernelBlock, names: OperandNames) -> str:
        """A block in closed form: its unknowns put into `names`, and how near its two assemblies are."""
        form = part.closed_form
        assert form is not None
        outputs = [*(value for values in form.values for value in values), self.coalescence(form)]
        *values, coalescence = self.write_values(outputs, names)
        names.update(zip(self.closed_form_operands(part), values, strict=True))
        return coalescence

    def allocate_newton_state(self, state: Sequence[Operand]) -> None:
        """Allocate, where the function begins, the state and what Newton's blocks keep from step to step."""
        t, parts = self.ir, [part for part in self.equations.blocks if part.closed_form is None]
        unknowns = {k for part in parts for k in part.unknowns}
        self.state_slots = {leaf: t.allocate() for leaf in state}
        self.history_slots = {leaf: t.allocate(HISTORY_LENGTH) for leaf in state if leaf[1] in unknowns}
        self.correction_slot = t.allocate()
        self.block_correction_slots = {part.block.block_index: t.allocate() for part in parts}

    def allocate_linear_systems(self) -> None:
        """Allocate, where the function begins, what the systems of large blocks need."""
        large = [len(part.unknowns) for part in self.equations.blocks if part.is_large]
        self.linear_systems = LinearSystems(self.ir, max(large)) if large else None

    def store_start(self, state: OperandNames) -> None:
        """Store the state at the start, before which there is no history."""
        t = self.ir
        for leaf, value in state.items():
            t.store(value, self.state_slots[leaf])
        for leaf, ring in self.history_slots.items():
            for k in range(HISTORY_LENGTH - 1):
                t.store("zeroinitializer", t.element_pointer(ring, str(k)))
            t.store(state[leaf], t.element_pointer(ring, str(HISTORY_LENGTH - 1)))

    def begin_newton_step(self, row: str) -> None:
        """Begin step %k: load its row of the `step_table`; nothing is corrected yet."""
        t = self.ir
        *weights, count, limit = (
            t.add_instruction(f"load double, ptr {t.double_pointer(row, str(k))}") for k in range(TABLE_COLUMNS)
        )
        self.predictor_weights = [t.broadcast(weight) for weight in weights]
        self.correction_count = t.add_instruction(f"fptosi double {count} to i64")
        self.correction_limit = t.broadcast(limit)
        t.store("zeroinitializer", self.correction_slot)
        self.history_indices = [
            t.add_instruction(f"and i64 {t.add_instruction(f'sub i64 %k, {j + 1}')}, {HISTORY_LENGTH - 1}")
            for j in range(PREDICTOR_ORDER)
        ]

    def write_newton_block(self, part: KernelBlock, names: OperandNames) -> None:
        """Predict the state of a block from the steps before, then correct it by Newton's method."""
        self._write_prediction(part)
        self._write_corrections(part, names)

    def write_is_as_predicted(self) -> str:
        """A flag: all corrections of a step together are at most the limit of its row of the `step_table`."""
        return self.ir.compare("ole", self.ir.load(self.correction_slot), self.correction_limit)

    def _write_prediction(self, part: KernelBlock) -> None:
        """Predict the state of a block from the steps before, by `predictor_weights`."""
        t, slots = self.ir, self._block_slots(part)
        ahead = {
            leaf: t.add_all(
                [
                    t.binary("mul", w, t.load(t.element_pointer(self.history_slots[leaf], index)))
                    for w, index in zip(self.predictor_weights, self.history_indices, strict=True)
                ]
            )
            for leaf in slots
        }
        for k in part.unknowns:
            if self.equations.is_angle[k]:
                ahead["zc", k], ahead["zs", k] = write_normalised(t, ahead["zc", k], ahead["zs", k])
        for leaf, slot in slots.items():
            t.store(ahead[leaf], slot)

    def _block_slots(self, part: KernelBlock) -> OperandNames:
        return {leaf: slot for leaf, slot in self.state_slots.items() if leaf[1] in part.unknowns}

    def _write_corrections(self, part: KernelBlock, have: OperandNames) -> None:
        """Correct the predicted state of a block by `correction_count` steps of Newton's method."""
        t, level, slots = self.ir, part.block.block_index, self._block_slots(part)
        regularity, correction = t.load(self.regularity_slot), t.load(self.correction_slot)
        block_correction = self.block_correction_slots[level]
        t.store("zeroinitializer", block_correction)
        t.write_line(f"br label %from{level}")
        t.write_label(f"from{level}")
        t.write_line(f"br label %newton{level}")
        t.write_label(f"newton{level}")
        t.write_line(f"%n{level} = phi i64 [0, %from{level}], [%n{level}next, %newton{level}]")
        unknowns = {leaf: t.load(slot) for leaf, slot in slots.items()}
        *steps, volume, lengths, squared_arm = self._write_newton_step(part, have | unknowns)
        magnitudes = []
        for k, step in zip(part.unknowns, steps, strict=True):
            magnitudes.append(t.call_intrinsic("fabs", step))
            back = t.add_instruction(f"fneg {t.vector} {step}")
            if ("z", k) in unknowns:
                unknowns["z", k] = t.binary("add", unknowns["z", k], back)
            if ("z", k) in self.carried:
                angle = unknowns["z", k]
                unknowns["zc", k], unknowns["zs", k] = t.call_per_lane("cos", angle), t.call_per_lane("sin", angle)
            elif self.equations.is_angle[k]:
                c, s = unknowns["zc", k], unknowns["zs", k]
                unknowns["zc", k], unknowns["zs", k] = self.write_rotation(c, s, back)
        for leaf, slot in slots.items():
            t.store(unknowns[leaf], slot)
        t.store(t.add_all([t.load(block_correction), *magnitudes]), block_correction)
        t.close_loop(f"n{level}", self.correction_count.lstrip("%"), f"newton{level}", f"solved{level}")
        t.write_label(f"solved{level}")
        have.update({leaf: t.load(slot) for leaf, slot in slots.items()})
        block_regularity = self.write_regularity(volume, lengths, squared_arm, len(part.unknowns))
        t.store(t.call_intrinsic("minnum", regularity, block_regularity), self.regularity_slot)
        t.store(t.binary("add", correction, t.load(block_correction)), self.correction_slot)
        position = t.add_instruction(f"and i64 %k, {HISTORY_LENGTH - 1}")
        for leaf in slots:
            t.store(have[leaf], t.element_pointer(self.history_slots[leaf], position))

    def write_rotation(self, cos: str, sin: str, angle: str) -> tuple[str, str]:
        """The cos and sin of an angle that Newton's method turns."""
        return write_small_rotation(self.ir, cos, sin, angle)

    def write_regularity(self, volume: str, lengths: str, squared_arm: str, count: int) -> str:
        """How regular the Jacobian of a block of `count` unknowns is."""
        return self.ir.binary("div", volume, lengths)

    def _write_newton_step(self, part: KernelBlock, names: OperandNames) -> list[str]:
        """Newton's step of a block, the square of the volume that the columns of its Jacobian span, the product of the
        squares of their lengths, and the square of the shortest column.

        Where a column vanishes, as with the arm of a slide on which a link turns, an unknown is not determined, however
        large the angles between the columns. All functions of the equations have the listing in common.
        """
        index, listings = part.block.block_index, self.equations.newton_steps
        if index not in listings:
            e, block = self.equations.equations, part.block
            residual, jacobian = e.F[block.rows], block_jacobian(e, block.rows, block.unknowns)
            squared_arm = reduce(ca.fmin, (ca.sumsqr(column) for column in ca.horzsplit(jacobian)), ca.SX(1.0))
            solved = [residual, ca.vec(jacobian)] if part.is_large else solve_with_volume(jacobian, residual)
            listings[index] = self._list_expressions([*solved, squared_arm], self.ir.count)
        values, count = self._write_listed(self.hoister.rebuild(*listings[index]), names), len(part.unknowns)
        if not part.is_large:
            return values
        assert self.linear_systems is not None
        volume = self.linear_systems.factorise(values[count:-1], count)
        return [*self.linear_systems.solve(values[:count]), volume, self.ir.constant(1.0), values[-1]]

    def factorise_block(self, part: KernelBlock, names: OperandNames) -> None:
        """Factorise the Jacobian of a large block, whose systems `solve_block` solves in numbers."""
        if part.is_large:
            assert self.linear_systems is not None
            jacobian = block_jacobian(self.equations.equations, part.block.rows, part.block.unknowns)
            self.linear_systems.factorise(self.write_values([ca.vec(jacobian)], names), len(part.unknowns))

    def solve_block(self, part: KernelBlock, right_sides: Sequence[ca.SX], names: OperandNames) -> list[list[str]]:
        """Minus the inverse of a block's Jacobian times right sides, as of rates."""
        t = self.ir
        if part.is_large:
            assert self.linear_systems is not None
            solutions = [self.linear_systems.solve(side) for side in self.write_separately(right_sides, names)]
        else:
            jacobian = block_jacobian(self.equations.equations, part.block.rows, part.block.unknowns)
            solutions = self.write_separately([solve_by_determinants(jacobian, side) for side in right_sides], names)
        return [[t.add_instruction(f"fneg {t.vector} {value}") for value in solution] for solution in solutions]

    def load_numbers(self) -> OperandNames:
        """Load the numbers of pairs and of stops, which follow in the rows of p, and of points, from q."""
        count = self.symbols["p"].numel()
        rows = [("p", k, "%p", k) for k in range(count)]
        rows += [("stop", k, "%p", count + k) for k in range(self.symbols["stop"].numel())]
        rows += [("q", k, "%q", k) for k in range(2 * len(self.links))]
        return {(kind, k): self.load_entry(base, row) for kind, k, base, row in rows}

    def write_stops(self, names: OperandNames) -> list[str]:
        """For each pair with stops what reaches one where it meets one of them, see `StopLimits`."""
        e = self.equations
        if not e.stop_pairs:
            return []
        positions = input_positions(e.stop_pairs, e.frames, {}, e.pair_coordinates)
        rooms = stop_rooms(positions, are_periodic(e.stop_pairs, e.mechanism), scalars(self.symbols["stop"]), ca)
        return self.write_values([1.0 - room for room in rooms], names)

    def write_slow_nearness(self, part: KernelBlock, names: OperandNames) -> str:
        """What varies as slowly as the links that hold a block in closed form, and reaches one, as a cosine minus one
        too, where its two assemblies meet."""
        form = part.closed_form
        assert form is not None
        near = form.cosine
        if near is None:
            assert form.margin is not None
            near = 1.0 - form.margin
        return self.write_values([near], names)[0]

    def write_apart_here(self, part: KernelBlock, coalescence: str, names: OperandNames) -> str:
        """A flag: the two assemblies of a block are apart enough for a position, independent of what lies before it.

        Where no arm changes by what of its digits is lost, else as far as everywhere, less by more than rounding: where
        assemblies keep apart between steps too, this flag is up.
        """
        t, form = self.ir, part.closed_form
        assert form is not None
        margin = 0.99 * LEAST_KERNEL_REGULARITY**2
        maximum = t.constant(1.0 - margin)
        if form.squared_arm is None:
            arm = ca.sqrt(ca.mmin(form.squared_lengths))
            arm_margin = ca.fmax(LEAST_CANDIDATE_REGULARITY**2, EPS / NEGLIGIBLE_ERROR / arm)
            (maximum,) = self.write_values([1.0 - ca.fmin(margin, arm_margin)], names)
        return t.compare("ole", coalescence, maximum)

    def write_passed(self, flags: Sequence[str], slot: str) -> tuple[str, str]:
        """Two flags: all steps before passed, and this one by its own flags too, which is kept."""
        previous = self.ir.load_flags(slot)
        passed = reduce(self.ir.and_flags, flags, previous)
        self.ir.store_flags(passed, slot)
        return previous, passed

    def write_circle_residuals(self, have: OperandNames) -> list[str]:
        """How far the square of every unknown angle's cos and sin is from one."""
        t = self.ir

        def residual(cos: str, sin: str) -> str:
            return t.binary(
                "add", t.binary("sub", t.binary("mul", cos, cos), t.constant(1.0)), t.binary("mul", sin, sin)
            )

        return [residual(have["zc", k], have["zs", k]) for k, turns in enumerate(self.equations.is_angle) if turns]


def write_squared_distance(t: IRWriter, coordinates: Sequence[str], targets: Sequence[str]) -> str:
    """The squared distance of coordinates from their targets."""
    gaps = [t.binary("sub", *both) for both in zip(coordinates, targets, strict=True)]
    return t.add_all([t.constant(0.0), *(t.binary("mul", gap, gap) for gap in gaps)])


def write_nearest(t: IRWriter, options: Sequence[tuple[Sequence[str], str]]) -> tuple[list[str], str, str]:
    """Of options, each with its values and its squared distance to the sketch, the values and the distance of the
    nearest, and the distance of the next one, infinite without any."""
    first, nearest = options[0]
    values, second = list(first), t.constant(inf)
    for other, distance in options[1:]:
        is_nearer = t.compare("olt", distance, nearest)
        values = [t.select(is_nearer, *both) for both in zip(other, values, strict=True)]
        second = t.call_intrinsic("minnum", second, t.call_intrinsic("maxnum", nearest, distance))
        nearest = t.call_intrinsic("minnum", nearest, distance)
    return values, nearest, second


def write_angle_sum(t: IRWriter, cos: str, sin: str, c: str, s: str) -> tuple[str, str]:
    """The cos and sin of a sum of two angles."""
    return (
        t.binary("sub", t.binary("mul", cos, c), t.binary("mul", sin, s)),
        t.binary("add", t.binary("mul", sin, c), t.binary("mul", cos, s)),
    )


def write_rational_rotation(t: IRWriter, c: str, s: str, angle: str) -> tuple[str, str]:
    """The cos and sin of an angle turned by another one, however large: by the rational rotation, the same to third
    order."""
    half = t.binary("mul", t.constant(0.5), angle)
    square = t.binary("mul", half, half)
    scale = t.binary("div", t.constant(1.0), t.binary("add", t.constant(1.0), square))
    cos, sin = t.binary("mul", t.binary("sub", t.constant(1.0), square), scale), t.binary("mul", angle, scale)
    return write_angle_sum(t, c, s, cos, sin)


def write_normalised(t: IRWriter, c: str, s: str) -> tuple[str, str]:
    """What is nearly of length one, nearer to it: the inverse root by its first terms."""
    square = t.binary("add", t.binary("mul", c, c), t.binary("mul", s, s))
    scale = t.binary("sub", t.constant(1.5), t.binary("mul", square, t.constant(0.5)))
    return t.binary("mul", c, scale), t.binary("mul", s, scale)


def write_small_rotation(t: IRWriter, c: str, s: str, angle: str) -> tuple[str, str]:
    """The cos and sin of an angle turned by a little."""
    square = t.binary("mul", angle, angle)
    cos = t.binary("sub", t.constant(1.0), t.binary("mul", square, t.constant(0.5)))
    sin = t.binary("mul", angle, t.binary("sub", t.constant(1.0), t.binary("mul", square, t.constant(1.0 / 6.0))))
    return write_normalised(t, *write_angle_sum(t, c, s, cos, sin))


def write_residual_sum(t: IRWriter, residuals: Sequence[str]) -> str:
    """The sum of the sizes of residuals, NaN if one is."""
    zero = t.constant(0.0)
    return t.add_all([t.call_intrinsic("fabs", value) for value in residuals if value != zero] or [zero])


def write_keeps_apart(
    t: IRWriter,
    earlier: str,
    previous: str,
    current: str,
    is_known: str | None = None,
    form: ClosedForm | None = None,
    coalescence: str | None = None,
) -> str:
    """A flag: over three positions, and between them, the two assemblies of a block keep apart, by what reaches one
    where they meet: of a closed form its `write_slow_nearness`.

    Between them it does not reach one, by half as much as it bends over all three. So it may be the position before at
    which a block had come too near, and the middle of its change may lie there, as where a run starts just before a
    dead point. `is_known`: flags of whether there are three positions already. `coalescence`: of a form with a margin,
    which says nothing of how regular a position is, at the last one.
    """
    maximum = 1.0 - LEAST_KERNEL_REGULARITY**2
    change = t.binary("sub", t.binary("add", current, earlier), t.binary("add", previous, previous))
    change = t.call_intrinsic("fabs", change)
    half = t.constant(0.5)
    if is_known is not None:
        half = t.select_or_zero(is_known, half)
    if form is not None and form.cosine is not None:
        earlier, previous, current = (t.call_intrinsic("fabs", value) for value in (earlier, previous, current))
        maximum = sqrt(maximum)
    elif form is not None:
        maximum = 1.0 - LEAST_START_REGULARITY**2
    greatest = t.greater(earlier, t.greater(previous, current))  # NaN in `current` stays
    reached = t.binary("add", greatest, t.binary("mul", change, half))
    keeps_apart = t.compare("ole", reached, t.constant(maximum))
    if form is None or form.margin is None or coalescence is None:
        return keeps_apart
    is_regular = t.compare("ole", coalescence, t.constant(1.0 - LEAST_KERNEL_REGULARITY**2))
    return t.and_flags(keeps_apart, is_regular)
