"""The stages of a run: of a linkage whose blocks are all in closed form, or with blocks that Newton's method solves.

In closed form, at the start both assemblies of every block are computed, all combinations in the lanes, and the sketch
chooses the combination whose sketched points lie nearest to where it shows them. Beyond `ENUMERATED_BLOCKS` every block
takes the nearer of its two; what its other one, or a block that is neither clearly joined nor clearly open, might yet
give bounds from below what other assemblies there are, since squared distances never fall as blocks are added. Then the
positions are in the lanes.

Blocks that Newton's method solves are solved by two kernels of the march of many designs. The lanes are one design:
first from each assembly of the file's design, then each lane solves a piece of the run.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, inf, log2, log10
from typing import Any

import numpy as np

from planar.batch.closed_form.joined_blocks import BlockJoinWriter
from planar.batch.initial_assembly import CORRECTIONS, MAX_BLOCK_UNKNOWNS, NEAR_SKETCH, find_assemblies
from planar.batch.march.designs_writer import (
    MARCH_ARGUMENTS,
    MARCH_FUNCTION,
    DesignsKernelLayout,
    KernelRequest,
    write_designs_kernel,
)
from planar.batch.march.kernel import KernelBlock, KernelEquations, Operand, operand_rows
from planar.batch.march.kernel_writer import (
    KernelWriter,
    OperandNames,
    write_keeps_apart,
    write_residual_sum,
    write_squared_distance,
)
from planar.batch.march.prediction import (
    CLEAR_REGULARITY,
    CORRECTIONS_COLUMN,
    LEAST_COSINE,
    LEAST_KERNEL_REGULARITY,
    MAX_TURN_PER_STEP,
    PREDICTOR_ORDER,
    correction_limit,
    least_regularity,
    longest_step,
)
from planar.batch.march.runs import run_designs, run_table, unknowns_at_steps
from planar.batch.prepare.compiled_runs import (
    ALL_SOLVED,
    CANNOT_BE_ASSEMBLED,
    CLEARLY_OPEN,
    DEAD_POINT,
    LANES,
    STAGE_ARGUMENTS,
    STOP,
    UNSURE,
    CompiledRun,
    CompiledRuns,
    MakeNumbers,
    RunPositions,
    RunStages,
    end_run,
    input_rows,
    load_constant,
    load_number,
    load_numbers,
    padded_width,
    prepare_runs,
    write_shifted_inputs,
)
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import allocate_aligned, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.tape import LinkDirection, write_turn_flags
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember
from planar.solving.assembly.block_assemblies import (
    CLEAR_SKETCH_DISTANCE,
    MEETING_COSINE_SQUARED,
    SAME_ASSEMBLY_TOLERANCE,
)
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE

START_STAGE, POSITIONS_STAGE = "start", "positions"
ENUMERATED_BLOCKS = 4
"""Blocks of whose assemblies all combinations are tried."""
LEAST_STEPS_TO_DEAD_POINT = 3
"""Positions that show how a block comes to its dead point."""
NEWTON_STAGE = "newton"
LEAST_PIECE = PREDICTOR_ORDER + 2
"""Minimum steps of a piece: from fewer too little is predicted."""
START_CORRECTIONS = 8
"""Newton's steps from where the file's design is at the same inputs."""
DIGITS = 16.0
"""Decimals of what is solved."""


def prepare_point_runs(
    reference: ReferenceDesign, points: tuple[str, ...], rates: bool, positions: Array, may_shift: bool
) -> CompiledRuns | None:
    """The compiled runs over points."""
    members = [reference.point_member(name) for name in points]

    def compile_run(make_numbers: MakeNumbers, grid: RunPositions) -> CompiledRun:
        design = make_numbers(members)
        return CompiledRun(design, run_stages(reference, design, members, rates, grid), grid.wanted)

    return prepare_runs(reference, positions, may_shift, compile_run)


def run_stages(
    reference: ReferenceDesign,
    design: DesignNumbers,
    members: Sequence[PointMember] | None,
    rates: bool,
    grid: RunPositions,
) -> RunStages:
    """The stages of a run over all these positions, for points on links, or, without them, for the states.

    Raises UnsupportedOperation.
    """
    equations = design.equations("q")
    if set(design.sketched_blocks) < {part.block.block_index for part in equations.blocks}:
        raise UnsupportedOperation("the sketch does not show every group")
    if not equations.has_newton_blocks:
        links = None if members is None else tuple(link for link, _ in members)
        return closed_form_stages(design, links, rates, grid.u)
    if reference.mechanism.stops:
        raise UnsupportedOperation("stops are looked for where all groups are in closed form")
    if grid.lead or reference.candidates.counts_turns:
        raise UnsupportedOperation("a group that is not in closed form starts where the file has it, turns or not")
    return newton_stages(reference, design, members or (), rates, grid.u)


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
                coalescence, distance = self.write_closed_form(part, have), self.write_distance(part, have)
            else:
                _, distance, other_distance, coalescence = self.write_block(part, have)
                farther = t.binary("add", self.total, other_distance)
                is_joined = t.compare("olt", coalescence, t.constant(MEETING_COSINE_SQUARED))
                farther = t.select(is_joined, farther, t.constant(inf))
                self.otherwise = t.call_intrinsic("minnum", self.otherwise, farther)
            self._add_block(k, coalescence, distance)
        self._write_choice(have)
        t.end_function()
        return t

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
        super().__init__(design.equations("q"), links or (), rates, LANES, invariant)
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
        residual = write_residual_sum(t, [*residuals, *self.write_circle_residuals(have)])
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
        t.end_function()
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
            coalescence = None
            if form is not None and form.margin is not None:
                coalescence = self._load_before(row, 0)
                row += 1
            keeps_apart = write_keeps_apart(t, earlier, before, current, None, form, coalescence)
            # after a block that is open itself there is no number
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


def newton_stages(
    reference: ReferenceDesign, design: DesignNumbers, members: Sequence[PointMember], rates: bool, u: Array
) -> RunStages:
    """The stage over positions u (positions, inputs) of the file's design; behind the results its rows are the states.

    Raises UnsupportedOperation.
    """
    links, equations = tuple(link for link, _ in members), design.equations("q")
    # pieces of as many steps each, one for each lane, which may overlap
    steps = ceil((len(u) - 1) / LANES)
    if steps < LEAST_PIECE:
        raise UnsupportedOperation("so few steps do not show where the lanes go")
    firsts = np.round(np.arange(LANES) * ((len(u) - 1 - steps) / (LANES - 1))).astype(int)
    corrector = write_designs_kernel(
        KernelRequest(
            design.equations("at"), design.sketched_links, False, LANES, design.sketched_blocks, streams=False
        )
    )
    march = write_designs_kernel(KernelRequest(equations, links, rates, LANES, (-1,) * len(links), streams=False))
    starts, assembly_counts, lanes = _assembly_lanes(reference, equations)
    kernels = [compile_function(kernel.ir, MARCH_FUNCTION, *MARCH_ARGUMENTS) for kernel in (corrector, march)]
    start_table = run_table(np.zeros((1, u.shape[1])))
    start_table[:, CORRECTIONS_COLUMN] = CORRECTIONS
    # the place of each position in the rows of the march; the last one is repeated
    position = np.minimum(np.arange(padded_width(len(u))), len(u) - 1)
    lane = np.searchsorted(firsts, position, side="right") - 1
    constants = {
        "own values": design.own_values,
        "blocks": len(position) // LANES,
        "positions": len(u),
        "corrector": kernels[0],
        "starts": operand_rows(corrector.state, starts),
        "start inputs": operand_rows(corrector.inputs, np.repeat(u[:1].T, LANES, axis=1)),
        "start table": start_table,
        "march": kernels[1],
        "states": operand_rows(march.state, _own_unknowns(reference, u, members, firsts)),
        "inputs": operand_rows(march.inputs, u[firsts].T),
        "table": _piece_table(u, steps),
        "steps": steps + 1,
        "places": (position - firsts[lane]) * march.output_row_count * LANES + lane,
        "correction limit": correction_limit(longest_step(u)),
    }
    writer = _NewtonWriter(equations, design, (corrector, march), (assembly_counts, lanes), constants)
    writer.result_count = 2 * len(links) * (3 if rates else 1)
    writer.write_stage()
    marched = (steps + 1) * march.output_row_count * LANES
    return RunStages(
        (NEWTON_STAGE,),
        (writer.ir,),
        writer.order,
        constants,
        writer.result_count,
        writer.result_count + len(march.state),
        writer.scratch_size + marched,
    )


class _NewtonWriter:
    """Writes the stage: `kernels` correct the sketched points, and march.

    `assemblies`: how many assemblies every block of the file's design has, and the lanes that begin in another one.
    """

    result_count = 0

    def __init__(
        self,
        equations: KernelEquations,
        design: DesignNumbers,
        kernels: tuple[DesignsKernelLayout, DesignsKernelLayout],
        assemblies: tuple[list[int], list[range]],
        constants: Mapping[str, Any],
    ):
        self.equations, self.design, self.assemblies, self.constants = equations, design, assemblies, constants
        self.corrector, self.march = kernels
        self.order = design.order
        self.first_state = 4 * len(design.sketched_links)
        "row of the state among those of the corrector"
        self.ir = IRWriter(LANES)
        self.scratch_size = 0

    def write_stage(self) -> None:
        """The whole function."""
        t = self.ir
        t.write_line(f"define internal void @{NEWTON_STAGE}({STAGE_ARGUMENTS}) {{")
        t.write_label("entry")
        t.write_line(f"store double {UNSURE}, ptr %out")
        self.blocks = self._constant("blocks")
        t.write_line(f"%width = mul i64 {self.blocks}, {LANES}")
        self.last = t.add_instruction(f"insertelement <{LANES} x i64> poison, i64 {self._constant('positions')}, i64 0")
        self.limit = self._constant("correction limit")
        rows = {kind: self._write_spread(kind) for kind in ("p", "q", "at", "u1", "u2")}
        corrected = self._write_correction(rows)
        self._go_on_if(self._write_is_nearest(*corrected), "begins")
        self._write_gather(*self._write_march(rows))
        self._write_is_one_run(corrected[1])
        t.write_line(f"store double {ALL_SOLVED}, ptr %out")
        end_run(t)
        vector, pointers, flags = t.vector, f"<{LANES} x ptr>", f"<{LANES} x i1>"
        t.write_line(f"declare {vector} @llvm.masked.gather.v{LANES}f64.v{LANES}p0({pointers}, i32, {flags}, {vector})")

    def _constant(self, name: str) -> str:
        return load_constant(self.ir, self.constants, name)

    def _number(self, kind: str) -> str:
        return load_number(self.ir, self.order, (kind, 0))

    def _take_scratch(self, count: int) -> str:
        """Memory for `count` vectors."""
        first, self.scratch_size = self.scratch_size, self.scratch_size + count * LANES
        return self.ir.double_pointer("%scratch", str(first))

    def _row(self, base: str, k: int) -> str:
        return self.ir.load(self.ir.double_pointer(base, str(k * LANES)))

    def _out_row(self, row: int, first: str) -> str:
        """A pointer to a row behind the first one of `out`."""
        return self.ir.row_pointer("%out", "%width", row + 1, first)

    def _go_on_if(self, flag: str, label: str) -> None:
        self.ir.write_line(f"br i1 {flag}, label %{label}, label %leave")
        self.ir.write_label(label)

    def _write_spread(self, kind: str) -> str:
        """The numbers of a kind in all lanes, row by row."""
        t = self.ir
        numbers = load_numbers(t, self.order, kind)
        # the first and the second rates stand together
        base = self._take_scratch(len(numbers))
        for k, number in enumerate(numbers.values()):
            t.store(number, t.double_pointer(base, str(k * LANES)))
        return base

    def _write_inputs(self, name: str) -> str:
        """The inputs of the design in each lane, from those of the file's design."""
        t, operands, rows = self.ir, self.march.inputs, self._constant(name)
        base = self._take_scratch(len(operands))
        inputs = {operand: self._row(rows, k) for k, operand in enumerate(operands)}
        shifted = write_shifted_inputs(t, self.equations, inputs, load_numbers(t, self.order, "d", "dc", "ds"))
        for k, operand in enumerate(operands):
            t.store(shifted[operand], t.double_pointer(base, str(k * LANES)))
        return base

    def _write_kernel_call(
        self, function: str, arrays: Sequence[str], steps: str, row_count: int, scale: str, out: str
    ) -> str:
        """Call a kernel; the pointer to how many steps of each lane are good."""
        good = self._take_scratch(1)
        pointers = ", ".join(f"ptr {array}" for array in arrays)
        numbers = f"double {self._number('tolerance')}, double {scale}"
        self.ir.write_line(
            f"call void {self._constant(function)}(i64 1, i64 {steps}, i64 {LANES}, i64 {LANES}, "
            f"i64 {row_count * LANES}, {pointers}, {numbers}, ptr {out}, ptr {good}, ptr null)"
        )  # kernels with the blocks of points count no candidates
        return good

    def _write_correction(self, rows: dict[str, str]) -> tuple[str, str]:
        """The design from each of the file's assemblies: which lanes converge, and the rows of the kernel."""
        count = self.corrector.output_row_count
        out = self._take_scratch(count)
        arrays = [rows["p"], rows["at"], self._constant("starts"), self._write_inputs("start inputs"), rows["u1"]]
        arrays.append(self._constant("start table"))
        return self._write_kernel_call("corrector", arrays, "1", count, "1.0", out), out

    def _lane(self, value: str, lane: int = 0) -> str:
        """The number of one lane in every lane."""
        t, mask = self.ir, ", ".join([f"i32 {lane}"] * LANES)
        return t.add_instruction(f"shufflevector {t.vector} {value}, {t.vector} poison, <{LANES} x i32> <{mask}>")

    def _write_is_nearest(self, good: str, out: str) -> str:
        """Whether the first lane is surely the assembly nearest to the sketch, as `find_assemblies` has it."""
        t, blocks = self.ir, self.design.sketched_blocks
        sketch = [*load_numbers(t, self.order, "sketch").values()]
        costs, other_costs = (
            [
                write_squared_distance(t, [self._row(out, first + k + axis) for axis in range(2)], sketch[k : k + 2])
                for k in range(0, len(sketch), 2)
            ]
            for first in (0, len(sketch))
        )
        converged = t.compare("ogt", t.load(good), t.constant(0.0))
        regularity = self._row(out, self.first_state + len(self.corrector.state))
        is_regular = t.compare("ogt", regularity, t.constant(CLEAR_REGULARITY**2))
        is_nearest, earlier_cost = converged, t.constant(0.0)
        points = [
            [k for k, block in enumerate(blocks) if block == part.block.block_index] for part in self.equations.blocks
        ]
        total = self._lane(t.add_all([costs[k] for indices in points for k in indices]))

        def is_farther(other: str) -> str:
            distance = t.binary("add", total, t.constant(EQUAL_DISTANCE_TOLERANCE))
            return t.compare("ogt", t.binary("add", earlier_cost, other), distance)

        for part, indices, count, lanes in zip(self.equations.blocks, points, *self.assemblies, strict=True):
            cost = t.add_all([costs[k] for k in indices])
            first_cost = self._lane(cost)
            if part.closed_form is not None:
                other = self._lane(t.add_all([other_costs[k] for k in indices]))
                is_nearest = t.and_flags(is_nearest, is_farther(other))
            else:
                is_small = len(part.unknowns) <= MAX_BLOCK_UNKNOWNS
                is_near, is_at_sketch = (
                    t.compare("ole", first_cost, t.constant(len(indices) * distance**2))
                    for distance in (NEAR_SKETCH if is_small else CLEAR_SKETCH_DISTANCE, CLEAR_SKETCH_DISTANCE)
                )
                other = self._write_least_other(part, out, converged, (count, lanes), cost)
                is_first = t.and_flags(is_near, t.or_flags(is_at_sketch, is_farther(other)))
                is_nearest = t.and_flags(t.and_flags(is_nearest, is_regular), is_first)
            earlier_cost = t.add_instruction(f"fadd {t.vector} {earlier_cost}, {first_cost}")
        return t.add_instruction(f"extractelement <{LANES} x i1> {is_nearest}, i64 0")

    def _write_least_other(
        self, part: KernelBlock, out: str, converged: str, assemblies: tuple[int, range], cost: str
    ) -> str:
        """The least cost of a block's other assemblies; -inf where fewer converge than the file's design has."""
        t = self.ir
        assembly_count, lanes = assemblies
        leaves = [k for k, leaf in enumerate(self.corrector.state) if leaf[1] in part.unknowns]
        state = [self._row(out, self.first_state + k) for k in leaves]

        def flags(chosen: Sequence[int]) -> str:
            return f"<{', '.join(f'i1 {str(k in chosen).lower()}' for k in range(LANES))}>"

        is_new = t.and_flags(converged, flags(lanes))
        for k, lane in enumerate((0, *lanes)):
            # apart from the assembly of an earlier lane
            gap = t.constant(0.0)
            for value in state:
                difference = t.call_intrinsic("fabs", t.binary("sub", value, self._lane(value, lane)))
                gap = t.call_intrinsic("maxnum", gap, difference)
            is_apart = t.compare("ogt", gap, t.constant(SAME_ASSEMBLY_TOLERANCE))
            is_earlier = flags([other for other in range(LANES) if other not in lanes[k:]])
            is_new = t.and_flags(is_new, t.or_flags(is_apart, is_earlier))
        count = t.broadcast(t.reduce("fadd", t.select_or_zero(is_new, t.constant(1.0))))
        least = t.broadcast(t.reduce("fmin", t.select(is_new, cost, t.constant(inf))))
        return t.select(t.compare("oeq", count, t.constant(assembly_count - 1.0)), least, t.constant(-inf))

    def _write_march(self, rows: dict[str, str]) -> tuple[str, str]:
        """The run, a piece in each lane: how many steps went well, and the rows of the kernel at all steps."""
        arrays = [rows["p"], rows["q"], self._constant("states"), self._write_inputs("inputs"), rows["u1"]]
        arrays.append(self._constant("table"))
        # the rows stand at the end of the memory, where there is room for as many steps as there are
        out, count = self.ir.double_pointer("%scratch", str(self.scratch_size + LANES)), self.march.output_row_count
        scale = self._number("unit")
        return self._write_kernel_call("march", arrays, self._constant("steps"), count, scale, out), out

    def _write_gather(self, good: str, out: str) -> None:
        """Write the results and the states of all positions in their order, if all of them are solved and regular."""
        t = self.ir
        steps = t.broadcast(t.add_instruction(f"sitofp i64 {self._constant('steps')} to double"))
        self._go_on_if(t.all_flags(t.compare("oeq", t.load(good), steps)), "marched")
        # behind the results the kernel has as many points in the other assembly of their blocks, which is unknown
        first_state = self.march.output_row_count - len(self.march.state) - 1
        rows = [*range(self.result_count), *range(first_state, first_state + len(self.march.state))]
        worst, places = t.allocate(), self._constant("places")
        t.store(t.constant(inf), worst)
        t.write_line("br label %gather")
        t.write_label("gather")
        t.write_line("%g = phi i64 [0, %marched], [%gnext, %gather]")
        first = t.add_instruction(f"mul i64 %g, {LANES}")
        place = t.add_instruction(f"getelementptr i64, ptr {places}, i64 {first}")
        index = t.add_instruction(f"load <{LANES} x i64>, ptr {place}, align 8")

        def gather(row: int) -> str:
            base = t.double_pointer(out, str(row * LANES))
            pointers = t.add_instruction(f"getelementptr double, ptr {base}, <{LANES} x i64> {index}")
            return t.add_instruction(
                f"call {t.vector} @llvm.masked.gather.v{LANES}f64.v{LANES}p0(<{LANES} x ptr> {pointers}, i32 8, "
                f"<{LANES} x i1> splat (i1 true), {t.vector} poison)"
            )

        for k, row in enumerate(rows):
            t.store(gather(row), self._out_row(k, first))
        t.store(t.call_intrinsic("minnum", t.load(worst), gather(self.march.output_row_count - 1)), worst)
        t.close_loop("g", self.blocks.lstrip("%"), "gather", "gathered")
        t.write_label("gathered")
        # one limit for all blocks: that of the smallest
        minimum = max(
            least_regularity(LEAST_KERNEL_REGULARITY**2, len(part.unknowns))
            for part in self.equations.blocks
            if part.closed_form is None
        )
        self._go_on_if(t.all_flags(t.compare("oge", t.load(worst), t.constant(minimum))), "regular")

    def _write_is_one_run(self, corrected: str) -> None:
        """Leave unless the pieces are one run from where the design begins: from position to position everything goes
        on as the three before predict, by as little as may be corrected."""
        t = self.ir
        rows = range(self.result_count, self.result_count + len(self.march.state))
        distance = t.constant(0.0)
        for k, row in enumerate(rows):
            start = self._lane(self._row(corrected, self.first_state + k))
            gap = t.binary("sub", self._lane(t.load(self._out_row(row, "0"))), start)
            distance = t.binary("add", distance, t.call_intrinsic("fabs", gap))
        is_start = t.compare("ole", distance, t.constant(SAME_ASSEMBLY_TOLERANCE))
        self._go_on_if(t.all_flags(is_start), "compare")
        t.write_line("br label %difference")
        t.write_label("difference")
        t.write_line("%d = phi i64 [0, %compare], [%dnext, %smooth]")
        first = t.add_instruction(f"mul i64 %d, {LANES}")
        total = t.constant(0.0)
        for row in rows:
            current = self._out_row(row, first)
            values = [t.load(t.double_pointer(current, str(back))) for back in (-3, -2, -1, 0)]
            inner = t.binary("mul", t.constant(3.0), t.binary("sub", values[1], values[2]))
            third = t.binary("add", t.binary("sub", values[3], values[0]), inner)
            total = t.binary("add", total, t.call_intrinsic("fabs", third))
        has_three = t.lanes_from(first, "splat (i64 3)")
        is_early = t.add_instruction(f"xor <{LANES} x i1> {has_three}, splat (i1 true)")
        is_smooth = t.compare("ole", total, t.broadcast(self.limit))
        is_smooth = t.or_flags(t.or_flags(is_smooth, is_early), t.lanes_from(first, self.last))
        self._go_on_if(t.all_flags(is_smooth), "smooth")
        t.close_loop("d", self.blocks.lstrip("%"), "difference", "compared")
        t.write_label("compared")


def _own_unknowns(reference: ReferenceDesign, u: Array, members: Sequence[PointMember], positions: Array) -> Array:
    """The unknowns (unknowns, lanes) of the file's design at positions (lanes,) of its run.

    Raises UnsupportedOperation where its assembly is not sure, or does not come to the end.
    """
    rows = reference.design_rows({}, 1)
    start = find_assemblies(reference, rows)
    batch = reference.design_batch(rows, members)._replace(z0=start.z, input_offsets=u - u[0])
    good = run_designs(batch, allocate_aligned(len(u), batch.output_row_count, 1))
    if not start.is_sure[0] or good[0] < len(u):
        raise UnsupportedOperation("the file's own design does not run to the end")
    return unknowns_at_steps(batch.select(np.zeros(len(positions), dtype=int)), positions)


def _assembly_lanes(reference: ReferenceDesign, equations: KernelEquations) -> tuple[Array, list[int], list[range]]:
    """The assemblies of the file's design (unknowns, lanes): the first nearest to the sketch, then others of one block
    after the other, while there are lanes; how many assemblies each block has, and the lanes of its other ones."""
    blocks = reference.functions.equations.blocks
    lists = {block.block_index: each for block, each in zip(blocks, reference.block_assemblies, strict=True)}
    start = np.concatenate([np.zeros(0), *(roots[0] for roots, _ in lists.values() if len(roots))])
    starts, lanes = [start], []
    for part in equations.blocks:
        roots = lists[part.block.block_index][0]
        others = roots[1:] if part.closed_form is None else roots[:0]
        first = len(starts)
        for root in others[: LANES - first]:
            starts.append(start.copy())
            starts[-1][part.block.unknowns] = root
        lanes.append(range(first, len(starts)))
    starts += [start] * (LANES - len(starts))
    return np.array(starts).T, [lists[part.block.block_index][1] for part in equations.blocks], lanes


def _piece_table(u: Array, steps: int) -> Array:
    """The `run_table` of a piece of `steps` steps."""
    table = run_table(u[: steps + 1] - u[0])
    counts = table[:, CORRECTIONS_COLUMN]
    # a prediction by k positions has an error of order k in the step; a correction doubles the digits
    digits = max(-log10(longest_step(u)), 0.3)
    for step in range(1, PREDICTOR_ORDER + 1):
        counts[step] = max(counts[-1], ceil(log2(max(DIGITS / (step * digits), 1.0))) + 1)
    counts[0] = START_CORRECTIONS
    return table
