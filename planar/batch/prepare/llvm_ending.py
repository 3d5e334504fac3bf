"""Where and why a run over positions ends before its end, as an LLVM function over the rows that were written."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from planar.batch.march.kernel import KernelEquations
from planar.batch.march.kernel_writer import write_keeps_apart
from planar.batch.march.prediction import MAX_TURN_PER_STEP
from planar.batch.prepare.run_endings import CLEARLY_OPEN, DEAD_POINT, STOP, UNSURE
from planar.codegen.llvm_ir import IRWriter

FUNCTION_NAME = "ending"
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
        f"define internal void @{FUNCTION_NAME}(i64 %positions, i64 %width, double %tolerance, "
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
        place = t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 %width, {row}')}, {at}")
        return t.load(t.double_pointer("%out", place))

    return load


def _write_not(t: IRWriter, flag: str) -> str:
    return t.add_instruction(f"xor <1 x i1> {flag}, splat (i1 true)")
