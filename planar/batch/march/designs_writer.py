"""The march of many designs, lane by lane, as one LLVM function: predict, correct, check, write.

What Newton's method solves is predicted by the polynomial through the steps before.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from math import inf, nan
from typing import NamedTuple

import casadi as ca

from planar.batch.march.design_batch import ResultRows
from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations, Operand
from planar.batch.march.kernel_writer import (
    KernelWriter,
    OperandNames,
    write_angle_sum,
    write_keeps_apart,
    write_residual_sum,
)
from planar.batch.march.prediction import (
    LEAST_COSINE,
    LEAST_KERNEL_REGULARITY,
    LEAST_START_REGULARITY,
    MAX_TURN_PER_STEP,
    TABLE_COLUMNS,
    least_regularity,
)
from planar.codegen.tape import LinkDirection, write_turn_flags
from planar.equations.closed_form import ClosedForm
from planar.equations.rates import UnknownRates
from planar.foundation.instruction_list import UnsupportedOperation

MARCH_FUNCTION, _READ_ARRAYS = "march", ("p", "q", "state", "drive", "rate", "table")
MARCH_ARGUMENTS = (*("int",) * 5, *("array",) * 6, *("float",) * 2, *("array",) * 3)
"""Of the function's arguments: blocks, steps, width of the arrays that are read, how far a row and a step of `out` are
from the next; p, q, state, drives, rates, table; tolerance, scale; out, good, candidates."""
INVARIANT_KINDS = frozenset({"p", "q", "u1", "u2", "scale", "stop", "number"})
"""Of operands that are the same at all steps of a design."""


class KernelRequest(NamedTuple):
    """What the function of `write_designs_kernel` does for points on `links`, none of which is the frame.

    Every step writes x and y of every point, then with `rates` all first and second rates: NaN from the first step on
    that does not pass the checks; `good` counts those that do. With `counts_candidates`, where all blocks are in closed
    form, the steps are written up to the first that does not pass the checks of a single position, which `candidates`
    counts. With `point_blocks`, the block that places each point, a step has further rows: x and y of every point in
    the other assembly of its block (infinite where that is not known), the state, and the regularity of the least
    regular block that Newton's method solves. Rows bypass the caches where it `streams`; where it `is_single`, they are
    rounded. `results` are written in place of the points. The function starts with `has_signs`, where all blocks are in
    closed form, from the signs of their assemblies in place of the state; with `has_common_inputs` too, all designs
    have the same inputs, which stand in the table.
    """

    equations: KernelEquations
    links: tuple[str, ...]
    rates: bool
    lanes: int
    point_blocks: tuple[int, ...] | None = None
    has_signs: bool = False
    has_common_inputs: bool = False
    streams: bool = True
    is_single: bool = False
    counts_candidates: bool = False
    results: ResultRows | None = None


class DesignsKernelLayout(NamedTuple):
    """The function of a request, and the rows that it takes and writes, each with an entry for every design.

    `state`: cos and sin of an angle, or a length, and an angle that is carried; `inputs`: the same of the inputs;
    `output_row_count`: of the rows of a step.
    """

    request: KernelRequest
    state: tuple[Operand, ...]
    inputs: tuple[Operand, ...]
    output_row_count: int
    ir: str


def write_designs_kernel(request: KernelRequest) -> DesignsKernelLayout:
    """Write the function of a request. Raises UnsupportedOperation."""
    carried: frozenset[Operand] = frozenset()
    while True:
        try:
            return _DesignsKernelWriter(request, carried).write()
        except BareAngle as angle:
            if angle.operand in carried:  # its value is wanted before its own block is solved
                raise UnsupportedOperation(f"a group stands in an angle of a later one: {angle.operand}") from None
            carried |= {angle.operand}
            request = request._replace(has_signs=False, has_common_inputs=False)


class _DesignsKernelWriter(KernelWriter):
    def __init__(self, request: KernelRequest, carried: frozenset[Operand]):
        equations = request.equations
        super().__init__(equations, request.links, request.rates, request.lanes, INVARIANT_KINDS, carried)
        self.request, self.results = request, request.results
        self.other_points: dict[int, list[str]] = {}
        self.apart_here: list[str] = []
        "flags of blocks in closed form whose assemblies are apart at a step"
        self.state = self.state_operands()
        if request.has_signs:
            self.state = tuple(("sign", k) for k in range(len(equations.closed_forms)))
        self.input_count = len(equations.input_is_angle)
        self.newton_unknowns = [k for part in equations.blocks if part.closed_form is None for k in part.unknowns]
        if self.results is not None:
            self.solves_rates_apart = True
            self.symbols["number"] = self.results.numbers

    def write(self) -> DesignsKernelLayout:
        """The whole function: blocks of designs, in each the steps."""
        t = self.ir
        rows = 2 * len(self.links) * (3 if self.rates else 1) if self.results is None else self.results.row_count
        rows += 0 if self.request.point_blocks is None else 2 * len(self.links) + len(self.state) + 1
        arrays = ", ".join(f"ptr noalias readonly %{name}" for name in _READ_ARRAYS)
        numbers = ", ".join(f"double %{name}" for name in ("tolerance", "scale"))
        written = ", ".join(f"ptr noalias %{name}" for name in ("out", "good", "candidates"))
        sizes = ", ".join(f"i64 %{name}" for name in ("blocks", "steps", "width", "row", "time"))
        t.write_line(f"define void @{MARCH_FUNCTION}({sizes}, {arrays}, {numbers}, {written}) {{")
        t.write_label("entry")
        self.allocate_newton_state(self.state)
        watched = (*self.equations.closed_forms, *self.equations.stop_pairs)
        self.bend_slots = [[t.allocate() for _ in range(2)] for _ in watched]
        self.turn_slots = {k: (t.allocate(), t.allocate()) for k in self.equations.carrying_angles}
        self.regularity_slot, self.good_count_slot, self.candidate_count_slot = (t.allocate() for _ in range(3))
        self.passed_slot, self.candidate_slot = (t.allocate_flags() for _ in range(2))
        self.counted_angle_slots = [t.allocate() for _ in range(self.counted_angles().numel())]
        self.allocate_linear_systems()
        scale = t.broadcast("%scale")
        t.write_line("br label %block")
        have, at_start = self._write_lanes_start()
        have["scale", 0] = scale
        self._write_step_start(have, at_start)
        flags = []
        for part in self.equations.blocks:
            if part.closed_form is None:
                self.write_newton_block(part, have)
            else:
                flags.append(self._write_closed_form_block(part, have))
        flags += self._write_stops(have)
        flags += self._write_turns(have)
        t.write_line("br label %checks")
        t.write_label("checks")
        self._write_step_end(have, flags)
        t.close_loop("k", "steps", "step", "blockend")
        t.write_label("blockend")
        steps = t.broadcast(t.add_instruction("sitofp i64 %steps to double"))
        for passed_slot, count_slot, counts in self._counted():
            count = t.select(t.load_flags(passed_slot), steps, t.load(count_slot))
            t.store(count, t.double_pointer(counts, self.lane))
        t.close_loop("b", "blocks", "block", "done")
        t.write_label("done")
        t.end_function()
        if self.linear_systems is not None:
            t.write_line(self.linear_systems.function_text)
        return DesignsKernelLayout(self.request, self.state, self.equations.input_operands, rows, t.module_text())

    def _write_lanes_start(self) -> tuple[OperandNames, OperandNames]:
        """A block of designs begins: its numbers, and the inputs at the start."""
        t, count = self.ir, self.input_count
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %blockend]")
        self.lane = t.add_instruction(f"mul i64 %b, {t.lanes}")
        have = self.load_numbers()
        if self.results is not None:
            first = 2 * len(self.links)
            have |= {("number", k): self.load_entry("%q", first + k) for k in range(self.results.numbers.numel())}
        if self.rates:
            have |= {(f"u{1 + k // count}", k % count): self.load_entry("%rate", k) for k in range(2 * count)}
        t.mark_hoist_point()
        at_start = {leaf: self.load_entry("%drive", k) for k, leaf in enumerate(self.equations.input_operands)}
        state = {leaf: self.load_entry("%state", k) for k, leaf in enumerate(self.state)}
        if self.request.has_signs:
            have |= state
        elif self.equations.closed_forms:
            sides = self.write_values([self.equations.sides], have | at_start | state)
            for k, side in enumerate(sides):
                have["sign", k] = t.call_intrinsic("copysign", t.constant(1.0), side)
        self.store_start(state)
        t.store_flags("splat (i1 true)", self.passed_slot)
        t.store_flags("splat (i1 true)", self.candidate_slot)
        for slot in (self.good_count_slot, self.candidate_count_slot, *chain.from_iterable(self.bend_slots)):
            t.store("zeroinitializer", slot)
        for slot in (slot for both in self.turn_slots.values() for slot in both):
            t.store(t.constant(nan), slot)
        t.write_line("br label %step")
        return have, at_start

    def _write_step_start(self, have: OperandNames, at_start: OperandNames) -> None:
        """A step begins: where the inputs are."""
        t = self.ir
        t.write_label("step")
        t.write_line("%k = phi i64 [0, %block], [%knext, %stepend]")
        begin = t.add_instruction(f"mul i64 %k, {TABLE_COLUMNS + 3 * self.input_count}")
        row = t.double_pointer("%table", begin)
        for k, turns in enumerate(self.equations.input_is_angle):
            places = [t.double_pointer(row, str(TABLE_COLUMNS + 3 * k + j)) for j in range(3)]
            by, cos, sin = (t.broadcast(t.add_instruction(f"load double, ptr {place}")) for place in places)
            if self.request.has_common_inputs:
                have |= {("u", k): by, ("uc", k): cos, ("us", k): sin}
                continue
            have["u", k] = t.binary("add", at_start["u", k], by)
            if turns:
                have["uc", k], have["us", k] = write_angle_sum(t, at_start["uc", k], at_start["us", k], cos, sin)
        t.store(t.constant(1.0), self.regularity_slot)
        if self.newton_unknowns:
            self.begin_newton_step(row)

    def _write_closed_form_block(self, part: KernelBlock, have: OperandNames) -> str:
        """A block in closed form; a flag that says where its two assemblies keep apart."""
        if self.request.point_blocks is not None:
            self._write_other_assembly(part, have)
        form, coalescence = part.closed_form, self.write_closed_form(part, have)
        assert form is not None
        for k in part.unknowns:
            if ("z", k) in self.carried:
                self._write_carried_angle(k, have)
        if self.request.counts_candidates:
            self.apart_here.append(self.write_apart_here(part, coalescence, have))
        slots = self.bend_slots[self.sign_index[part.block.block_index]]
        return self._write_keeps_below(self.write_slow_nearness(part, have), slots, form, coalescence)

    def _write_keeps_below(
        self, value: str, slots: Sequence[str], form: ClosedForm | None = None, coalescence: str | None = None
    ) -> str:
        """A flag: what reaches one at a dead point or a stop (a cosine: one or minus one) keeps below it, between steps
        too.

        By as much as it bends over the last three steps. So it may be the step before at which it had come too near.
        """
        t = self.ir
        previous, earlier = (t.load(slot) for slot in slots)
        for slot, new in zip(slots, (value, previous), strict=True):
            t.store(new, slot)
        return write_keeps_apart(
            t, earlier, previous, value, t.broadcast_counter_test("%k", "sgt", 1), form, coalescence
        )

    def _write_turns(self, have: OperandNames) -> list[str]:
        """A flag that says where no link that carries other blocks has turned far since the step before: farther apart,
        steps do not show what these blocks do between them."""
        if not self.turn_slots:
            return []
        directions = [LinkDirection(have["zc", k], have["zs", k], None) for k in self.turn_slots]
        slots = [slot for both in self.turn_slots.values() for slot in both]
        earlier = [self.ir.load(slot) for slot in slots]
        is_good = write_turn_flags(self.ir, "splat (i1 true)", directions, earlier, LEAST_COSINE)
        for value, slot in zip((part for direction in directions for part in direction[:2]), slots, strict=True):
            self.ir.store(value, slot)
        return [is_good]

    def _write_stops(self, have: OperandNames) -> list[str]:
        """Flags that say which pairs keep off their stops."""
        t, values = self.ir, self.write_stops(have)
        if self.request.counts_candidates:
            self.apart_here += [t.compare("ole", value, t.constant(1.0)) for value in values]
        slots = self.bend_slots[len(self.equations.closed_forms) :]
        return [self._write_keeps_below(*both) for both in zip(values, slots, strict=True)]

    def _write_other_assembly(self, part: KernelBlock, have: OperandNames) -> None:
        """Where the block places its points in its other assembly."""
        assert self.request.point_blocks is not None
        level, other = part.block.block_index, dict(have)
        other["sign", self.sign_index[level]] = self.ir.add_instruction(
            f"fneg {self.ir.vector} {have['sign', self.sign_index[level]]}"
        )
        self.write_closed_form(part, other)
        points = [k for k, block in enumerate(self.request.point_blocks) if block == level]
        places = self.write_values([self.point_coordinates(points)], other)
        self.other_points |= {k: places[2 * n : 2 * n + 2] for n, k in enumerate(points)}

    def _write_carried_angle(self, k: int, have: OperandNames) -> None:
        """Move an angle's own value on to where its new cos and sin are."""
        t = self.ir
        c, s = (t.load(self.state_slots[leaf, k]) for leaf in ("zc", "zs"))
        cos, sin = write_angle_sum(t, have["zc", k], have["zs", k], c, t.add_instruction(f"fneg {t.vector} {s}"))
        half = t.call_per_lane("atan", t.binary("div", sin, t.binary("add", t.constant(1.0), cos)))
        have["z", k] = t.binary("add", t.load(self.state_slots["z", k]), t.binary("add", half, half))
        for leaf in ("zc", "zs", "z"):
            t.store(have[leaf, k], self.state_slots[leaf, k])

    def _write_rates(self, have: OperandNames) -> None:
        """The rates of the unknowns put into `have`, block after block, where large blocks' are solved in numbers.

        They are minus the Jacobian's inverse times right sides in symbols for the rates that are known before: the
        first ones of earlier blocks for the first, all the first ones and the second ones of earlier blocks for the
        second.
        """
        if not (self.rates and self.solves_rates_apart):
            return
        e, s = self.equations.equations, self.symbols
        rates, y1, y2 = UnknownRates(e), ca.vertcat(s["z1"], s["u1"]), ca.vertcat(s["z2"], s["u2"])
        right_sides = zip(rates.right_sides(y1), rates.right_sides(y1, y2), strict=True)
        for part, (first, second) in zip(self.equations.blocks, right_sides, strict=True):
            self.factorise_block(part, have)
            for name, right_side in (("z1", first), ("z2", second)):
                (solution,) = self.solve_block(part, [right_side], have)
                have |= {(name, k): value for k, value in zip(part.unknowns, solution, strict=True)}

    def write_regularity(self, volume: str, lengths: str, squared_arm: str, count: int) -> str:
        """How regular a Jacobian is, if the kernel returns that; else below zero if it is not regular enough."""
        t = self.ir
        if self.request.point_blocks is not None:
            return super().write_regularity(volume, lengths, squared_arm, count)
        minimum = least_regularity(LEAST_KERNEL_REGULARITY**2, count)
        room = t.binary("sub", volume, t.binary("mul", lengths, t.constant(minimum)))
        return t.call_intrinsic("minnum", room, t.binary("sub", squared_arm, t.constant(LEAST_START_REGULARITY**2)))

    def _write_step_end(self, have: OperandNames, flags: list[str]) -> None:
        """The step ends: its results are written, and judged; `flags` judge what lies before it."""
        t, results, between_count, flags = self.ir, self.results, len(flags), [*flags]
        scale, expressions = self.symbols["scale"], self.output_expressions() if results is None else []
        self._write_rates(have)
        judged = [self.equations.residuals(), self.counted_angles()]
        residuals, counted, *columns = self.write_separately([*judged, *(row * scale for row in expressions)], have)
        for angle, slot in zip(counted, self.counted_angle_slots, strict=True):
            turn = t.call_intrinsic("fabs", t.binary("sub", angle, t.load(slot)))
            t.store(angle, slot)
            is_near = t.compare("ole", turn, t.constant(MAX_TURN_PER_STEP))
            flags.append(t.or_flags(is_near, t.broadcast_counter_test("%k", "sle", 0)))
        outputs = [value for column in columns for value in column]
        if results is not None:
            outputs = results.write_rows(self, have)
        if self.request.point_blocks is not None:
            nowhere = [t.constant(inf)] * 2
            outputs += [part for k in range(len(self.links)) for part in self.other_points.get(k, nowhere)]
            outputs += [*(have[leaf] for leaf in self.state), t.load(self.regularity_slot)]
        residual = write_residual_sum(t, [*residuals, *self.write_circle_residuals(have)])
        flags.append(t.compare("ole", residual, t.broadcast("%tolerance")))
        if self.newton_unknowns:
            minimum = LEAST_KERNEL_REGULARITY**3 if self.request.point_blocks is not None else 0.0
            flags.append(t.compare("oge", t.load(self.regularity_slot), t.constant(minimum)))
            flags.append(self.write_is_as_predicted())
        passed = [self.write_passed(flags, self.passed_slot)]
        first = t.add_instruction(f"add i64 {t.add_instruction('mul i64 %k, %time')}, {self.lane}")
        rows = [t.add_instruction(f"mul i64 %row, {k}") for k in range(len(outputs))]
        pointer, store = t.double_pointer, t.store_streaming if self.request.streams else t.store
        if self.request.is_single:
            pointer, store = t.single_pointer, t.store_streaming_rounded
        pointers = [pointer("%out", t.add_instruction(f"add i64 {first}, {row}")) for row in rows]
        # mostly all designs pass, and are candidates too: then nothing of theirs is erased or counted
        t.write_line(f"br i1 {t.all_flags(passed[0][1])}, label %passed, label %judged")
        t.write_label("passed")
        for value, place in zip(outputs, pointers, strict=True):
            store(value, place)
        t.write_line("br label %stepend")
        t.write_label("judged")
        if self.request.counts_candidates:
            candidate_flags = [*self.apart_here, *flags[between_count:]]
            passed.append(self.write_passed(candidate_flags, self.candidate_slot))
        if self.request.point_blocks is None:
            outputs = [t.select(passed[-1][1], value, t.constant(nan)) for value in outputs]
        for value, place in zip(outputs, pointers, strict=True):
            store(value, place)
        step = t.broadcast(t.add_instruction("sitofp i64 %k to double"))
        for (_, slot, _), (previous, current) in zip(self._counted(), passed, strict=True):
            t.store(t.select(current, t.load(slot), t.select(previous, step, t.load(slot))), slot)
        t.write_line("br label %stepend")
        t.write_label("stepend")

    def _counted(self) -> list[tuple[str, str, str]]:
        """Of the steps that pass all checks, and of candidates: slots of the flags and of the count, and its array."""
        good = self.passed_slot, self.good_count_slot, "%good"
        candidates = self.candidate_slot, self.candidate_count_slot, "%candidates"
        return [good, candidates] if self.request.counts_candidates else [good]
