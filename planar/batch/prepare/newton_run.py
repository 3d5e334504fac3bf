"""The stage of a linkage with blocks that Newton's method solves, around two kernels of the march of many designs.

The lanes are one design: first from each assembly of the file's design, then at inputs over the total run, so that each
lane solves a piece of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, inf, log2, log10
from typing import Any

import numpy as np

from planar.batch.initial_assembly import CORRECTIONS, MAX_BLOCK_UNKNOWNS, NEAR_SKETCH, find_assemblies
from planar.batch.march.designs_writer import (
    MARCH_ARGUMENTS,
    MARCH_FUNCTION,
    DesignsKernelLayout,
    KernelRequest,
    write_designs_kernel,
)
from planar.batch.march.kernel import KernelBlock, KernelEquations, operand_rows
from planar.batch.march.prediction import (
    CLEAR_REGULARITY,
    LEAST_KERNEL_REGULARITY,
    PREDICTOR_ORDER,
    correction_limit,
    least_regularity,
    longest_step,
)
from planar.batch.march.runs import run_designs, step_table, unknowns_at_steps
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.run_code import (
    ALL_SOLVED,
    LANES,
    STAGE_ARGUMENTS,
    UNSURE,
    RunStages,
    end_function,
    load_constant,
    load_number,
    load_numbers,
    padded_width,
    write_shifted_inputs,
)
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import allocate_aligned, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember
from planar.solving.assembly.block_assemblies import CLEAR_SKETCH_DISTANCE, SAME_ASSEMBLY_TOLERANCE
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE

NEWTON_STAGE = "newton"
LEAST_PIECE = PREDICTOR_ORDER + 2
"""Minimum steps of a piece: from fewer too little is predicted."""
START_CORRECTIONS = 8
"""Newton's steps from where the file's design is at the same inputs."""
DIGITS = 16.0
"""Decimals of what is solved."""


def newton_stages(
    reference: ReferenceDesign, design: DesignNumbers, members: Sequence[PointMember], rates: bool, u: Array
) -> RunStages:
    """The stage over positions u (positions, inputs) of the file's design; behind the results its rows are the states.

    Raises UnsupportedOperation.
    """
    links, equations = tuple(link for link, _ in members), design.equations("q")
    pieces = _Pieces(len(u))
    corrector = write_designs_kernel(
        KernelRequest(
            design.equations("at"), design.sketched_links, False, LANES, design.sketched_blocks, streams=False
        )
    )
    march = write_designs_kernel(KernelRequest(equations, links, rates, LANES, (-1,) * len(links), streams=False))
    starts, assembly_counts, lanes = _assembly_lanes(reference, equations)
    kernels = [compile_function(kernel.ir, MARCH_FUNCTION, *MARCH_ARGUMENTS) for kernel in (corrector, march)]
    table, counts = _step_table(u, pieces.steps)
    start_table, start_counts = step_table(np.zeros((1, u.shape[1])))
    start_counts[:] = CORRECTIONS
    constants = {
        "own values": design.own_values,
        "blocks": pieces.width // LANES,
        "positions": len(u),
        "corrector": kernels[0],
        "starts": operand_rows(corrector.state, starts),
        "start inputs": operand_rows(corrector.inputs, np.repeat(u[:1].T, LANES, axis=1)),
        "start table": start_table,
        "start counts": start_counts,
        "march": kernels[1],
        "states": operand_rows(march.state, _own_unknowns(reference, u, members, pieces.firsts)),
        "inputs": operand_rows(march.inputs, u[pieces.firsts].T),
        "table": table,
        "counts": counts,
        "steps": pieces.steps + 1,
        "places": pieces.places(march.output_row_count * LANES),
        "correction limit": correction_limit(longest_step(u)),
    }
    writer = _NewtonWriter(equations, design, (corrector, march), (assembly_counts, lanes), constants)
    writer.result_count = 2 * len(links) * (3 if rates else 1)
    writer.write_stage()
    marched = (pieces.steps + 1) * march.output_row_count * LANES
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
        t.write_line("br label %leave")
        t.write_label("leave")
        end_function(t)
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
        self, function: str, arrays: Sequence[str], steps: str, row_count: int, limits: Sequence[str], out: str
    ) -> str:
        """Call a kernel; the pointer to how many steps of each lane are good."""
        good = self._take_scratch(1)
        pointers = ", ".join(f"ptr {array}" for array in arrays)
        numbers = ", ".join(f"double {limit}" for limit in limits)
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
        arrays += [self._constant("start table"), self._constant("start counts")]
        limits = (self._number("tolerance"), "0x7FF0000000000000", "1.0")
        return self._write_kernel_call("corrector", arrays, "1", count, limits, out), out

    def _lane(self, value: str, lane: int = 0) -> str:
        """The number of one lane in every lane."""
        t, mask = self.ir, ", ".join([f"i32 {lane}"] * LANES)
        return t.add_instruction(f"shufflevector {t.vector} {value}, {t.vector} poison, <{LANES} x i32> <{mask}>")

    def _write_is_nearest(self, good: str, out: str) -> str:
        """Whether the first lane is surely the assembly nearest to the sketch, as `find_assemblies` has it."""
        t, blocks = self.ir, self.design.sketched_blocks
        sketch = [*load_numbers(t, self.order, "sketch").values()]
        costs, other_costs = (
            [self._write_squared_distance(out, first + 2 * k, sketch[2 * k : 2 * k + 2]) for k in range(len(blocks))]
            for first in (0, 2 * len(blocks))
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

    def _write_squared_distance(self, out: str, row: int, target: Sequence[str]) -> str:
        t = self.ir
        gaps = [t.binary("sub", self._row(out, row + axis), target[axis]) for axis in range(2)]
        return t.add_all([t.binary("mul", gap, gap) for gap in gaps])

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
        arrays += [self._constant("table"), self._constant("counts")]
        limits = (self._number("tolerance"), self.limit, self._number("unit"))
        # the rows stand at the end of the memory, where there is room for as many steps as there are
        out, count = self.ir.double_pointer("%scratch", str(self.scratch_size + LANES)), self.march.output_row_count
        return self._write_kernel_call("march", arrays, self._constant("steps"), count, limits, out), out

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


class _Pieces:
    """A run of so many positions in pieces of as many steps each, one for each lane; they may overlap.

    Raises UnsupportedOperation where they are too short.
    """

    def __init__(self, positions: int):
        self.positions, self.steps = positions, ceil((positions - 1) / LANES)
        if self.steps < LEAST_PIECE:
            raise UnsupportedOperation("so few steps do not show where the lanes go")
        self.width = padded_width(positions)
        self.firsts = np.round(np.arange(LANES) * ((positions - 1 - self.steps) / (LANES - 1))).astype(int)

    def places(self, stride: int) -> Array:
        """The place of each position in the rows of the march, so far from step to step; the last one is repeated."""
        position = np.minimum(np.arange(self.width), self.positions - 1)
        lane = np.searchsorted(self.firsts, position, side="right") - 1
        return ((position - self.firsts[lane]) * stride + lane).astype(np.int64)


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


def _step_table(u: Array, steps: int) -> tuple[Array, Array]:
    """The table of a piece of `steps` steps, and the corrections of each."""
    table, counts = step_table(u[: steps + 1] - u[0])
    # what is predicted from so few steps is off by as many powers of a step; each correction doubles the digits
    digits = max(-log10(longest_step(u)), 0.3)
    for step in range(1, PREDICTOR_ORDER + 1):
        counts[step] = max(counts[-1], ceil(log2(max(DIGITS / (step * digits), 1.0))) + 1)
    counts[0] = START_CORRECTIONS
    return table, counts
