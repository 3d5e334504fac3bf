"""A kernel's instructions as LLVM IR: blocks, angles and checks as values of the lanes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from math import inf, sqrt

import casadi as ca

from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations, KernelInstructions, Operand
from planar.batch.march.prediction import (
    LEAST_KERNEL_REGULARITY,
    LEAST_START_REGULARITY,
    MAX_TURN_PER_STEP,
    PREDICTOR_ORDER,
    TABLE_COLUMNS,
)
from planar.codegen.instructions import check_length
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.llvm_linear import LinearSystems
from planar.equations.closed_form import ClosedForm
from planar.foundation.instruction_list import required_values
from planar.solving.checks.residual_check import EPS, NEGLIGIBLE_ERROR

OperandNames = dict[Operand, str]
"""The names under which numbers stand in the text."""
HISTORY_LENGTH = 8
"""Steps before for which there is room: a power of two, more than `PREDICTOR_ORDER`."""
LEAST_CANDIDATE_REGULARITY = 1e-3
"""Of a position that may stand as it is once it is known that there is no dead point before it."""


class KernelWriter(KernelInstructions):
    """The text of one function, written front to back."""

    regularity_slot: str
    "of the least regular block that Newton's method solves, at a step"

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        rates: bool,
        lanes: int,
        invariant: frozenset[str],
        carried: frozenset[Operand],
    ):
        super().__init__(equations, links, rates, invariant, carried)
        self.ir = IRWriter(lanes)
        self.lane = "0"
        "the first design of the block of designs that is computed"
        self.hoisted_names: dict[int, str] = {}
        "of what does not vary"
        self.linear_systems: LinearSystems | None = None

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
        *values, coalescence = self.write_values(self.closed_form_outputs(part), names)
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
        """Newton's step of a block and what tells how regular it is, see `list_newton_step`."""
        values = self._write_listed(self.list_newton_step(part, self.ir.count), names)
        if not part.is_large:
            return values
        assert self.linear_systems is not None
        count = len(part.unknowns)
        volume = self.linear_systems.factorise(values[count:-1], count)
        return [*self.linear_systems.solve(values[:count]), volume, self.ir.constant(1.0), values[-1]]

    def load_numbers(self) -> OperandNames:
        """Load the numbers of pairs and of stops, which follow in the rows of p, and of points, from q."""
        count = self.symbols["p"].numel()
        rows = [("p", k, "%p", k) for k in range(count)]
        rows += [("stop", k, "%p", count + k) for k in range(self.symbols["stop"].numel())]
        rows += [("q", k, "%q", k) for k in range(2 * len(self.links))]
        return {(kind, k): self.load_entry(base, row) for kind, k, base, row in rows}

    def write_stops(self, names: OperandNames) -> list[str]:
        """What reaches one where a pair meets its stop, of each pair with stops."""
        if not self.equations.stop_pairs:
            return []
        return self.write_values([self.equations.stop_coalescences(self.symbols["stop"])], names)

    def write_slow_nearness(self, part: KernelBlock, names: OperandNames) -> str:
        """See `slow_nearness`."""
        (near,) = self.write_values([self.slow_nearness(part)], names)
        return near

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


def result_pointers(t: IRWriter, lane: str, row_count: int, is_single: bool) -> list[str]:
    """Where the rows of a step's results stand, for the designs from a lane on."""
    first = t.add_instruction(f"add i64 {t.add_instruction('mul i64 %k, %time')}, {lane}")
    rows = [t.add_instruction(f"add i64 {first}, {t.add_instruction(f'mul i64 %row, {k}')}") for k in range(row_count)]
    return [(t.single_pointer if is_single else t.double_pointer)("%out", row) for row in rows]


def store_results(t: IRWriter, values: Sequence[str], pointers: Sequence[str], streams: bool, is_single: bool) -> None:
    """Write the results of a step: past the caches where it `streams`, rounded where it `is_single`."""
    store = t.store_streaming_rounded if is_single else t.store_streaming if streams else t.store
    for value, pointer in zip(values, pointers, strict=True):
        store(value, pointer)


def write_closes(t: IRWriter, residuals: Sequence[str], tolerance: str) -> str:
    """A flag: what the constraints leave open is in sum not above the tolerance, a number.

    What is not a number stays so in sums, and is not below anything.
    """
    zero = t.constant(0.0)
    total = t.add_all([t.call_intrinsic("fabs", value) for value in residuals if value != zero] or [zero])
    return t.compare("ole", total, t.broadcast(tolerance))


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
    where they meet: of a closed form its `slow_nearness`.

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


def write_turns_little(t: IRWriter, angles: Sequence[str], slots: Sequence[str]) -> list[str]:
    """Flags that say of angles that they are not far from where they were a step before, as their slots have it."""
    flags = []
    for angle, slot in zip(angles, slots, strict=True):
        far = t.call_intrinsic("fabs", t.binary("sub", angle, t.load(slot)))
        t.store(angle, slot)
        is_near = t.compare("ole", far, t.constant(MAX_TURN_PER_STEP))
        flags.append(t.or_flags(is_near, t.broadcast_counter_test("%k", "sle", 0)))
    return flags
