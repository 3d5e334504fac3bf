"""One linkage at many positions of its inputs, these in the lanes, as LLVM functions: rows, and how it ends."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from planar.batch.march.kernel import BareAngle, KernelEquations, Operand
from planar.batch.march.kernel_writer import KernelWriter, OperandNames, write_keeps_apart
from planar.batch.march.prediction import MAX_TURN_PER_STEP
from planar.batch.prepare.run_calls import ALL_SOLVED, CLEARLY_OPEN, DEAD_POINT, STOP, UNSURE
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.instruction_list import UnsupportedOperation

ENDING_FUNCTION = "ending"
LEAST_STEPS_TO_DEAD_POINT = 3
"""Positions that show how a block comes to its dead point."""


class PositionRows(NamedTuple):
    """The rows that are written for all positions: what is told, then counted angles, the blocks' coalescences with
    what reaches one where a pair meets its stop, and what the worst constraint leaves open."""

    told: int
    angles: range
    bends: range

    @property
    def worst(self) -> int:
        return self.bends.stop

    @property
    def row_count(self) -> int:
        return self.worst + 1


def write_ending(equations: KernelEquations, rows: PositionRows) -> IRWriter:
    """The function that looks for the first position that is not solved, and says why.

    It is a dead point where a block that was joined is clearly open, all others are as they were, and each position
    before was in order; likewise a stop, where a pair is clearly beyond it.
    """
    t = IRWriter(1)
    t.write_line(
        f"define internal void @{ENDING_FUNCTION}(i64 %positions, i64 %width, double %tolerance, "
        "ptr noalias %out, ptr noalias %said) {"
    )
    t.write_label("entry")
    t.write_line("br label %position")
    t.write_label("position")
    t.write_line("%k = phi i64 [0, %entry], [%knext, %next]")
    is_unsure, is_open, is_beyond = _write_state(t, equations, rows)
    t.write_line(f"%meets = or i1 {is_open}, {is_beyond}")
    t.write_line(f"%stops = or i1 {is_unsure}, %meets")
    t.write_line("br i1 %stops, label %stop, label %next")
    t.write_label("next")
    t.close_loop("k", "positions", "position", "lost")
    t.write_label("lost")
    t.write_line(f"store double {UNSURE}, ptr %said")
    t.write_line("ret void")
    t.write_label("stop")
    early = t.add_instruction(f"icmp slt i64 %k, {LEAST_STEPS_TO_DEAD_POINT}")
    undecided = t.add_instruction(f"or i1 {is_unsure}, {early}")
    met = t.add_instruction(f"select i1 {is_beyond}, double {STOP}, double {DEAD_POINT}")
    said = t.add_instruction(f"select i1 {undecided}, double {UNSURE}, double {met}")
    t.write_line(f"store double {said}, ptr %said")
    t.write_line(f"store double {t.add_instruction('sitofp i64 %k to double')}, ptr {t.double_pointer('%said', '1')}")
    t.write_line("ret void")
    t.write_line("}")
    t.write_line("declare i64 @llvm.smax.i64(i64, i64)")
    return t


def _write_state(t: IRWriter, equations: KernelEquations, rows: PositionRows) -> tuple[str, str, str]:
    """Of position %k: is it not known how it is, is a block clearly open, and a pair clearly beyond its stop?"""
    before, earlier = (
        t.add_instruction(f"call i64 @llvm.smax.i64(i64 {t.add_instruction(f'sub i64 %k, {back}')}, i64 0)")
        for back in (1, 2)
    )
    load = _row_loader(t)
    is_open = is_beyond = is_unsure = "zeroinitializer"
    for row, part in zip(rows.bends, equations.blocks, strict=False):
        assert part.closed_form is not None
        one, two, three = (load(row, at) for at in (earlier, before, "%k"))
        # after a block that is open itself there is no number
        known = t.or_flags(write_keeps_apart(t, one, two, three), t.compare("uno", three, three))
        if part.closed_form.squared_arm is None:
            here = t.compare("oge", three, t.constant(CLEARLY_OPEN))
            is_open, known = t.or_flags(is_open, here), t.or_flags(known, here)
        is_unsure = t.or_flags(is_unsure, _write_not(t, known))
    for row in rows.bends[len(equations.blocks) :]:
        one, two, three = (load(row, at) for at in (earlier, before, "%k"))
        here = t.compare("oge", three, t.constant(CLEARLY_OPEN))
        known = t.or_flags(t.or_flags(write_keeps_apart(t, one, two, three), here), t.compare("uno", three, three))
        is_beyond, is_unsure = t.or_flags(is_beyond, here), t.or_flags(is_unsure, _write_not(t, known))
    if equations.stop_pairs:  # before a dead point a stop may be met
        is_unsure = t.or_flags(is_unsure, is_open)
    for row in rows.angles:
        far = t.call_intrinsic("fabs", t.binary("sub", load(row, "%k"), load(row, before)))
        is_unsure = t.or_flags(is_unsure, t.compare("ogt", far, t.constant(MAX_TURN_PER_STEP)))
    is_wrong = t.compare("ugt", load(rows.worst, "%k"), t.broadcast("%tolerance"))
    is_unsure = t.or_flags(is_unsure, t.and_flags(is_wrong, _write_not(t, is_open)))
    flags = is_unsure, is_open, is_beyond
    unsure, opened, beyond = (t.add_instruction(f"extractelement <1 x i1> {each}, i64 0") for each in flags)
    return unsure, opened, beyond


def _row_loader(t: IRWriter) -> Callable[[int, str], str]:
    """What loads the number of a row at a position."""

    def load(row: int, at: str) -> str:
        return t.load(t.row_pointer("%out", "%width", row, at))

    return load


def _write_not(t: IRWriter, flag: str) -> str:
    return t.add_instruction(f"xor <1 x i1> {flag}, splat (i1 true)")


LANES = 16
POSITIONS_FUNCTION = "positions"


class PositionFunctions(NamedTuple):
    """The writers of both functions, what the rows are, and of what the rows of given inputs are cos, sin and value."""

    writers: tuple[IRWriter, IRWriter]
    rows: PositionRows
    inputs: tuple[Operand, ...]


def write_positions(
    equations: KernelEquations, links: tuple[str, ...], rates: bool, order: Sequence[Operand], states: bool = False
) -> PositionFunctions:
    """The functions of a structure for points on these links, which read a design's numbers in this order.

    With `states` what is told is what stands for the unknowns, see `KernelInstructions.unknown_operands`, and no point.

    `positions` writes the rows, and how the run ends; where that is not well, it asks `ending`. Raises
    UnsupportedOperation.
    """
    try:
        writer = _PositionsWriter(equations, () if states else links, rates and not states, order)
        writer.tells_states = states
        rows = writer.write()
    except BareAngle as angle:
        raise UnsupportedOperation(f"an angle counts its turns: {angle.operand}") from None
    return PositionFunctions((write_ending(equations, rows), writer.ir), rows, writer.input_operands)


class _PositionsWriter(KernelWriter):
    def __init__(self, equations: KernelEquations, links: tuple[str, ...], rates: bool, order: Sequence[Operand]):
        super().__init__(equations, links, rates, LANES, frozenset({"p", "q", "u1", "u2", "sign", "stop"}), frozenset())
        if any(part.closed_form is None for part in equations.blocks):
            raise UnsupportedOperation("a group is not in closed form")
        self.order = order
        self.tells_states = False

    def write(self) -> PositionRows:
        """The whole function: blocks of positions, then whether the blocks keep clear of their dead points."""
        t, of = self.ir, self.equations
        t.write_line(
            f"define internal void @{POSITIONS_FUNCTION}(i64 %blocks, i64 %positions, ptr noalias readonly %numbers, "
            "ptr noalias readonly %drive, ptr noalias %out, ptr noalias %said) {"
        )
        t.write_label("entry")
        self.passed_slot = t.allocate()
        t.store(t.constant(1.0), self.passed_slot)
        self.width = t.add_instruction(f"mul i64 %blocks, {t.lanes}")
        have: OperandNames = {
            operand: t.broadcast(t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(k))}"))
            for k, operand in enumerate(self.order)
            if operand[0] in ("p", "q", "u1", "u2", "sign", "stop", "d", "dc", "ds", "tolerance", "unit")
        }
        t.mark_hoist_point()
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        first = t.add_instruction(f"mul i64 %b, {t.lanes}")
        self._write_inputs(first, have)
        bends = [self.write_closed_form(part, have) for part in of.blocks]
        bends += self.write_stops(have)
        left, counted, *values = self.write_separately(
            [of.residuals(), self.counted_angles(), *self.output_expressions()], have
        )
        worst = t.add_all(
            [t.constant(0.0), *(t.call_intrinsic("fabs", each) for each in (*left, *self.write_circle_residuals(have)))]
        )
        self._write_condition(t.compare("ole", worst, have["tolerance", 0]))
        told = [t.binary("mul", have["unit", 0], each) for part in values for each in part]
        if self.tells_states:
            told = [have[operand] for operand in self.state_operands()]
        for k, each in enumerate((*told, *counted, *bends, worst)):
            t.store(each, self._row_pointer("%out", k, first))
        t.close_loop("b", "blocks", "block", "after")
        t.write_label("after")
        last = len(told) + len(counted)
        rows = PositionRows(len(told), range(len(told), last), range(last, last + len(bends)))
        self._write_between_checks(rows)
        self._write_end()
        return rows

    def _write_inputs(self, first: str, have: OperandNames) -> None:
        """Where the inputs are: where the file has them, and farther by as much as the design has them elsewhere."""
        t = self.ir
        given = {leaf: t.load(self._row_pointer("%drive", k, first)) for k, leaf in enumerate(self.input_operands)}
        for k, is_angle in enumerate(self.equations.input_is_angle):
            have["u", k] = t.binary("add", given["u", k], have["d", k])
            if is_angle:
                have["uc", k], have["us", k] = self.write_angle_sum(
                    given["uc", k], given["us", k], have["dc", k], have["ds", k]
                )

    def _row_pointer(self, base: str, k: int, first: str) -> str:
        t = self.ir
        return t.double_pointer(
            base, t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 {self.width}, {k}')}, {first}")
        )

    def _write_condition(self, flag: str) -> None:
        t = self.ir
        t.store(t.select_or_zero(flag, t.load(self.passed_slot)), self.passed_slot)

    def _write_between_checks(self, rows: PositionRows) -> None:
        """Between positions too no bend reaches one, by as much as it bends over three of them; no counted angle goes
        far."""
        t = self.ir
        t.write_line("br label %judge")
        t.write_label("judge")
        t.write_line("%j = phi i64 [0, %after], [%jnext, %judge]")
        first = t.add_instruction(f"mul i64 %j, {t.lanes}")
        places = t.add_instruction(
            f"insertelement <{t.lanes} x i64> poison, i64 {t.add_instruction('sub i64 %positions, 2')}, i64 0"
        )
        for k in rows.angles:
            one, two, three = self._load_three(k, first)
            for before, after in ((one, two), (two, three)):
                far = t.call_intrinsic("fabs", t.binary("sub", after, before))
                self._write_condition(
                    t.or_flags(t.compare("ole", far, t.constant(MAX_TURN_PER_STEP)), t.lanes_from(first, places))
                )
        for k in rows.bends:
            flag = write_keeps_apart(t, *self._load_three(k, first))
            self._write_condition(t.or_flags(flag, t.lanes_from(first, places)))
        t.close_loop("j", "blocks", "judge", "done")

    def _load_three(self, k: int, first: str) -> tuple[str, str, str]:
        """A row at three positions on end."""
        t = self.ir
        one, two, three = (
            t.load(self._row_pointer("%out", k, t.add_instruction(f"add i64 {first}, {ahead}"))) for ahead in range(3)
        )
        return one, two, three

    def _write_end(self) -> None:
        """How the run ends."""
        t = self.ir
        t.write_label("done")
        least = t.reduce("fmin", t.load(self.passed_slot))
        t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {least}, 1.0')}, label %solved, label %unsolved")
        t.write_label("solved")
        t.write_line(f"store double {ALL_SOLVED}, ptr %said")
        t.write_line("ret void")
        t.write_label("unsolved")
        tolerance = t.add_instruction(
            f"load double, ptr {t.double_pointer('%numbers', str(self.order.index(('tolerance', 0))))}"
        )
        t.write_line(
            f"call void @{ENDING_FUNCTION}(i64 %positions, i64 {self.width}, double {tolerance}, ptr %out, ptr %said)"
        )
        t.write_line("ret void")
        t.write_line("}")
