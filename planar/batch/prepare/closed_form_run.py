"""The stages of a linkage whose blocks are all in closed form: its assembly at the start, then its positions.

At the start both assemblies of every block are computed, all combinations in the lanes, and the sketch chooses: the
combination whose sketched points lie nearest to where it shows them. Beyond `ENUMERATED_BLOCKS` every block takes the
nearer of its two; what its other one, or a block that is neither clearly joined nor clearly open, might yet give bounds
what else there may be from below, since squared distances never fall as blocks are added.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import Any

from planar.batch.closed_form.joined_blocks import BlockJoinWriter
from planar.batch.march.kernel import KernelBlock, Operand
from planar.batch.march.kernel_writer import KernelWriter, OperandNames, write_keeps_apart
from planar.batch.march.prediction import LEAST_COSINE, LEAST_KERNEL_REGULARITY, MAX_TURN_PER_STEP
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.run_code import (
    ALL_SOLVED,
    CANNOT_BE_ASSEMBLED,
    CLEARLY_OPEN,
    DEAD_POINT,
    LANES,
    STAGE_ARGUMENTS,
    STOP,
    UNSURE,
    RunStages,
    end_function,
    input_rows,
    load_constant,
    load_numbers,
    write_shifted_inputs,
)
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.tape import LinkDirection, write_turn_flags
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import UnsupportedOperation
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE

START_STAGE, POSITIONS_STAGE = "start", "positions"
ENUMERATED_BLOCKS = 4
"""Blocks of whose assemblies all combinations are tried."""
LEAST_STEPS_TO_DEAD_POINT = 3
"""Positions that show how a block comes to its dead point."""


def closed_form_stages(design: DesignNumbers, links: tuple[str, ...] | None, rates: bool, u: Array) -> RunStages:
    """The stages over positions u (positions, inputs) of the file's design, for points on these links.

    Without links the results are what stands for the unknowns. Raises UnsupportedOperation, BareAngle.
    """
    if len(u) < 3:
        raise UnsupportedOperation("two positions do not show what lies between them")
    equations = design.equations("q")
    order = (*design.order, *(("sign", k) for k in range(len(equations.closed_forms))))
    inputs = input_rows(equations.input_operands, u)
    blocks = inputs.shape[1] // LANES
    constants = {"own values": design.own_values, "blocks": blocks, "positions": len(u), "inputs": inputs}
    start = _StartWriter(design, order).write_stage()
    writer = _PositionsWriter(design, links, rates, order)
    result_count, row_count = writer.write_stage(constants)
    writers, names = (start, writer.ir), (START_STAGE, POSITIONS_STAGE)
    return RunStages(names, writers, order, constants, result_count, row_count)


class _StartWriter(BlockJoinWriter):
    """The first stage writes the signs of the assembly to the numbers of the design."""

    def __init__(self, design: DesignNumbers, order: tuple[Operand, ...]):
        equations = design.equations("at")
        self.enumerated = min(len(equations.blocks), ENUMERATED_BLOCKS)
        super().__init__(equations, design.sketched_links, design.sketched_blocks, 2**self.enumerated)
        self.order = order

    def write_stage(self) -> IRWriter:
        """The whole function."""
        t = self.ir
        t.write_line(f"define internal void @{START_STAGE}({STAGE_ARGUMENTS}) {{")
        t.write_label("entry")
        have = load_numbers(t, self.order, "p", "u", "uc", "us", "at", "sketch")
        have |= {("q", k): name for (kind, k), name in have.items() if kind == "at"}
        self.total, self.otherwise = t.constant(0.0), t.constant(inf)
        for k, part in enumerate(self.equations.blocks):
            if k < self.enumerated:
                have["sign", k] = t.constants([1.0 if lane >> k & 1 else -1.0 for lane in range(t.lanes)])
                coalescence = self.write_closed_form(part, have)
                self._add_block(k, coalescence, self._write_distance(part, have))
            else:
                self._write_nearer(part, k, have)
        self._write_choice(have)
        end_function(t)
        return t

    def _write_nearer(self, part: KernelBlock, k: int, have: OperandNames) -> None:
        """A block in the nearer of its assemblies."""
        t = self.ir
        block = self.write_block(part, have, "zeroinitializer")
        have["sign", k] = block.sign
        farther = t.binary("add", self.total, block.other_distance)
        is_joined = t.compare("olt", block.coalescence, t.constant(MEETING_COSINE_SQUARED))
        self.otherwise = t.call_intrinsic("minnum", self.otherwise, t.select(is_joined, farther, t.constant(inf)))
        self._add_block(k, block.coalescence, block.distance)

    def _add_block(self, k: int, coalescence: str, distance: str) -> None:
        """Add a block: to lanes in which it is joined, in which it may be, and in which it cannot be."""
        t = self.ir
        never = t.constant(inf)
        is_known = is_joined = t.compare("olt", coalescence, t.constant(MEETING_COSINE_SQUARED))
        if self.equations.closed_forms[k].squared_arm is None:
            is_known = t.or_flags(is_joined, t.compare("oge", coalescence, t.constant(CLEARLY_OPEN)))
        # the total of a lane that has ended is infinite already
        self.otherwise = t.call_intrinsic("minnum", self.otherwise, t.select(is_known, never, self.total))
        self.total = t.select(is_joined, t.binary("add", self.total, distance), never)

    def _write_choice(self, have: OperandNames) -> None:
        """Choose the nearest of all lanes if no other assembly may be as near."""
        t = self.ir
        count = len(self.equations.blocks)
        best = t.broadcast(t.reduce("fmin", self.total))
        is_nearest = t.compare("ole", self.total, best)
        rest = t.call_intrinsic("minnum", self.total, self.otherwise)
        other = t.broadcast(t.reduce("fmin", t.select(is_nearest, self.otherwise, rest)))
        nearest_count = t.broadcast(t.reduce("fadd", t.select_or_zero(is_nearest, t.constant(1.0))))
        beyond = t.binary("add", best, t.constant((count + 1) * EQUAL_DISTANCE_TOLERANCE))
        is_sure = t.and_flags(
            t.compare("olt", best, t.constant(inf)),
            t.and_flags(t.compare("oeq", nearest_count, t.constant(1.0)), t.compare("ogt", other, beyond)),
        )
        is_open = t.compare("oeq", t.call_intrinsic("minnum", best, other), t.constant(inf))
        refusal = t.select(is_open, t.constant(CANNOT_BE_ASSEMBLED), t.constant(UNSURE))
        ending = t.select(is_sure, t.constant(ALL_SOLVED), refusal)
        first = t.add_instruction(f"extractelement {t.vector} {ending}, i64 0")
        t.write_line(f"store double {first}, ptr %out")
        for k in range(count):
            sign = t.reduce("fadd", t.select_or_zero(is_nearest, have["sign", k]))
            t.write_line(f"store double {sign}, ptr {t.double_pointer('%numbers', str(self.order.index(('sign', k))))}")


class _PositionsWriter(KernelWriter):
    """The second stage writes rows at all positions, these in the lanes, then looks for where the run ends.

    The rows are the results, then counted angles, cosines and sines of links that carry other blocks, how near blocks
    are to dead points and pairs to their stops, and the residual.
    """

    def __init__(self, design: DesignNumbers, links: tuple[str, ...] | None, rates: bool, order: tuple[Operand, ...]):
        invariant = frozenset({"p", "q", "u1", "u2", "sign", "stop"})
        rates = rates and links is not None
        super().__init__(design.equations("q"), links or (), rates, LANES, invariant, frozenset())
        self.order, self.tells_states = order, links is None

    def write_stage(self, constants: Mapping[str, Any]) -> tuple[int, int]:
        """Write the whole function; return how many rows are results, and how many there are."""
        t, equations = self.ir, self.equations
        t.write_line(f"define internal void @{POSITIONS_STAGE}({STAGE_ARGUMENTS}) {{")
        t.write_label("entry")
        blocks, positions, rows_of_inputs = (
            load_constant(t, constants, name) for name in ("blocks", "positions", "inputs")
        )
        last = t.add_instruction(f"insertelement <{LANES} x i64> poison, i64 {positions}, i64 0")
        t.write_line(f"%width = mul i64 {blocks}, {LANES}")
        have = load_numbers(t, self.order, "p", "q", "u1", "u2", "sign", "stop", "d", "dc", "ds", "tolerance", "unit")
        t.mark_hoist_point()
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        self.lane = t.add_instruction(f"mul i64 %b, {LANES}")
        inputs = {
            operand: self.load_entry(rows_of_inputs, k) for k, operand in enumerate(self.equations.input_operands)
        }
        have |= write_shifted_inputs(t, equations, inputs, have)
        near: list[str] = []
        for part, form in zip(equations.blocks, equations.closed_forms, strict=True):
            coalescence = self.write_closed_form(part, have)
            near += [self.write_slow_nearness(part, have), *([] if form.margin is None else [coalescence])]
        near += self.write_stops(have)
        turns = [have[part, k] for k in equations.carrying_angles for part in ("zc", "zs")]
        residuals, angles, *orders = self.write_separately(
            [equations.residuals(), self.counted_angles(), *self.output_expressions()], have
        )
        magnitudes = [t.call_intrinsic("fabs", each) for each in (*residuals, *self.write_circle_residuals(have))]
        residual = t.add_all([t.constant(0.0), *magnitudes])
        results = [t.binary("mul", have["unit", 0], value) for order in orders for value in order]
        if self.tells_states:
            results = [have[operand] for operand in self.state_operands()]
        rows = (*results, *angles, *turns, *near, residual)
        for k, value in enumerate(rows):
            t.store(value, self.entry_pointer("%out", k + 1))
        t.close_loop("b", blocks.lstrip("%"), "block", "check")
        angle_rows = range(1 + len(results), 1 + len(results) + len(angles))
        self._write_end(blocks, last, angle_rows, have["tolerance", 0])
        return len(results), len(rows)

    def _write_end(self, blocks: str, last: str, angle_rows: range, tolerance: str) -> None:
        """Write the first position that is not solved, and why: all positions before it are in order.

        It is a dead point where a block that was joined is clearly open and all others are as they were, and a stop
        where a pair is clearly beyond it.
        """
        t = self.ir
        t.write_label("check")
        t.write_line("%c = phi i64 [0, %block], [%cnext, %checked]")
        self.lane = t.add_instruction(f"mul i64 %c, {LANES}")
        is_sure, is_open, is_beyond = self._write_checks(angle_rows, tolerance)
        goes_on = t.and_flags(is_sure, self._negate(t.or_flags(is_open, is_beyond)))
        goes_on = t.or_flags(goes_on, t.lanes_from(self.lane, last))
        t.write_line(f"br i1 {t.all_flags(goes_on)}, label %checked, label %ending")
        t.write_label("checked")
        t.close_loop("c", blocks.lstrip("%"), "check", "solved")
        t.write_label("solved")
        t.write_line(f"store double {ALL_SOLVED}, ptr %out")
        t.write_line("ret void")
        t.write_label("ending")
        bits = f"i{LANES}"
        ends = t.add_instruction(f"bitcast <{LANES} x i1> {self._negate(goes_on)} to {bits}")
        lane = t.add_instruction(f"call {bits} @llvm.cttz.{bits}({bits} {ends}, i1 true)")
        sure, beyond = (
            t.add_instruction(f"extractelement <{LANES} x i1> {flags}, {bits} {lane}") for flags in (is_sure, is_beyond)
        )
        position = t.add_instruction(f"add i64 {self.lane}, {t.add_instruction(f'zext {bits} {lane} to i64')}")
        is_late = t.add_instruction(f"icmp sge i64 {position}, {LEAST_STEPS_TO_DEAD_POINT}")
        is_decided = t.add_instruction(f"and i1 {sure}, {is_late}")
        reason = t.add_instruction(f"select i1 {beyond}, double {STOP}, double {DEAD_POINT}")
        ending = t.add_instruction(f"select i1 {is_decided}, double {reason}, double {UNSURE}")
        t.write_line(f"store double {ending}, ptr %out")
        number = t.add_instruction(f"sitofp i64 {position} to double")
        t.write_line(f"store double {number}, ptr {t.double_pointer('%out', '1')}")
        end_function(t)
        t.write_line(f"declare {bits} @llvm.cttz.{bits}({bits}, i1)")

    def _write_checks(self, angle_rows: range, tolerance: str) -> tuple[str, str, str]:
        """Flags of positions: it is known how all is, a block is clearly open, a pair clearly beyond its stop.

        Between positions too no coalescence reaches one, by half as much as it bends over three of them, and no counted
        angle, and no link that carries other blocks, goes far.
        """
        t = self.ir
        is_first, is_early = (self._negate(t.lanes_from(self.lane, f"splat (i64 {k})")) for k in (1, 2))
        is_open = is_beyond = "zeroinitializer"
        is_sure = "splat (i1 true)"
        turn_rows = range(angle_rows.stop, angle_rows.stop + 2 * len(self.equations.carrying_angles))
        row = turn_rows.stop
        for form in (*self.equations.closed_forms, *(None for _ in self.equations.stop_pairs)):
            earlier, before, current = (self._load_before(row, back) for back in (2, 1, 0))
            row += 1
            # after a block that is open itself there is no number
            keeps_apart = write_keeps_apart(t, earlier, before, current, form=form)
            if form is not None and form.margin is not None:
                regular = t.constant(1.0 - LEAST_KERNEL_REGULARITY**2)
                keeps_apart = t.and_flags(keeps_apart, t.compare("ole", self._load_before(row, 0), regular))
                row += 1
            is_known = t.or_flags(keeps_apart, t.compare("uno", current, current))
            is_known = t.or_flags(is_known, is_early)
            if form is None or form.squared_arm is None:
                reached = current if form is None else t.binary("mul", current, current)
                is_reached = t.compare("oge", reached, t.constant(CLEARLY_OPEN))
                is_known = t.or_flags(is_known, is_reached)
                is_beyond = t.or_flags(is_beyond, is_reached) if form is None else is_beyond
                is_open = is_open if form is None else t.or_flags(is_open, is_reached)
            is_sure = t.and_flags(is_sure, is_known)
        if self.equations.stop_pairs:  # before a dead point a stop may be met
            is_sure = t.and_flags(is_sure, self._negate(is_open))
        for angle_row in angle_rows:
            turn = t.binary("sub", self._load_before(angle_row, 0), self._load_before(angle_row, 1))
            is_near = t.compare("ule", t.call_intrinsic("fabs", turn), t.constant(MAX_TURN_PER_STEP))
            is_sure = t.and_flags(is_sure, t.or_flags(is_near, is_first))
        if turn_rows:
            directions = [
                LinkDirection(self._load_before(k, 0), self._load_before(k + 1, 0), None) for k in turn_rows[::2]
            ]
            directions_before = [self._load_before(k, 1) for k in turn_rows]
            is_near = write_turn_flags(t, "splat (i1 true)", directions, directions_before, LEAST_COSINE)
            is_sure = t.and_flags(is_sure, t.or_flags(is_near, is_first))
        is_closed = t.compare("ole", self._load_before(row, 0), tolerance)
        return t.and_flags(is_sure, t.or_flags(is_closed, is_open)), is_open, is_beyond

    def _load_before(self, row: int, back: int) -> str:
        """A row at the positions that lie `back` before those of the lanes."""
        t = self.ir
        return t.load(t.double_pointer(self.entry_pointer("%out", row), str(-back)))

    def _negate(self, flags: str) -> str:
        return self.ir.add_instruction(f"xor <{LANES} x i1> {flags}, splat (i1 true)")
