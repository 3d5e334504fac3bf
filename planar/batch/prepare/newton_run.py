"""One call for a linkage with blocks that Newton's method solves, as LLVM IR around two kernels of many designs.

The lanes are one design: first from each assembly of the file's own, then at inputs over the whole run, so that each
lane goes over a piece of it.
"""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from math import ceil, inf, log2, log10
from typing import Any, NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import MAX_BLOCK_UNKNOWNS, NEAR_SKETCH
from planar.batch.initial_assembly import CORRECTIONS, find_assemblies
from planar.batch.march.designs_writer import MARCH_ARGUMENTS, MARCH_FUNCTION, KernelRequest, write_designs_kernel
from planar.batch.march.kernel import KernelEquations, Operand, operand_rows
from planar.batch.march.kernel_writer import DesignsKernelLayout, write_angle_sum
from planar.batch.march.prediction import (
    CLEAR_REGULARITY,
    LEAST_KERNEL_REGULARITY,
    PREDICTOR_ORDER,
    correction_limit,
    least_regularity,
    longest_step,
)
from planar.batch.march.runs import run_designs, step_table, unknowns_at_steps
from planar.batch.prepare.design_numbers import NUMBERS_FUNCTION, SAID, DesignNumbers, write_numbers
from planar.batch.prepare.run_calls import ALL_SOLVED, UNSURE, RunCall, ValueBinder, address_of
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import WIDEST_VECTOR_BYTES, allocate_aligned, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember
from planar.solving.assembly.block_assemblies import CLEAR_SKETCH_DISTANCE, SAME_ASSEMBLY_TOLERANCE
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE

FUNCTION_NAME = "run"
ARGUMENT_TYPES = ("array",) * 5
"""Of the function's arguments: what does not change from call to call; places of values that are given, these; scratch;
out."""
LANES = 16
CONTEXT = (
    "own values",
    "corrector",
    "starts",
    "start inputs",
    "start table",
    "start counts",
    "march",
    "states",
    "inputs",
    "table",
    "counts",
    "steps",
    "places",
    "blocks",
    "positions",
    "correction limit",
)
"""What does not change, each of eight bytes: addresses, whole numbers, and the limit of what may be corrected."""


class AssemblyLanes(NamedTuple):
    """Of every block: how many assemblies the file's own design has, and the lanes that begin in another one of it."""

    counts: tuple[int, ...]
    lanes: tuple[tuple[int, ...], ...]


class NewtonLayout(NamedTuple):
    """The text of `run`, the rows that are told, and how many numbers of scratch it takes beside what it gathers."""

    ir: str
    told: int
    scratch: int


def write_newton_run(
    equations: KernelEquations,
    design: DesignNumbers,
    kernels: tuple[DesignsKernelLayout, DesignsKernelLayout],
    points: int,
    rates: bool,
    lanes: AssemblyLanes,
) -> NewtonLayout:
    """The function: `kernels` are those that correct the sketched points and that march. Raises
    UnsupportedOperation."""
    return _NewtonRunWriter(equations, design, kernels, (points, rates), lanes).write()


class _NewtonRunWriter:
    def __init__(
        self,
        equations: KernelEquations,
        design: DesignNumbers,
        kernels: tuple[DesignsKernelLayout, DesignsKernelLayout],
        results: tuple[int, bool],
        lanes: AssemblyLanes,
    ):
        self.equations, self.design, self.lanes = equations, design, lanes
        self.corrector, self.march = kernels
        points, self.rates = results
        self.told = 2 * points * (3 if self.rates else 1)
        self.state_first = self.told + 2 * points
        self.order: list[Operand] = [*design.numbers, SAID]
        self.ir = IRWriter(LANES)
        self.scratch_size = 0

    def write(self) -> NewtonLayout:
        """The whole function."""
        t = self.ir
        numbers = write_numbers(self.design, self.order)
        t.write_line(f"define void @{FUNCTION_NAME}(ptr %context, ptr %places, ptr %given, ptr %scratch, ptr %out) {{")
        t.write_label("entry")
        t.write_line(f"%numbers = alloca [{len(self.order)} x double], align 64")
        own = self._context("own values")
        t.write_line(f"call void @{NUMBERS_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %numbers)")
        t.write_line(f"store double {self._number(SAID)}, ptr %out")
        self._write_leave(self.ir.add_instruction(f"fcmp oeq double {self._number(SAID)}, {ALL_SOLVED}"), "fits")
        t.write_line(f"store double {UNSURE}, ptr %out")
        rows = {name: self._write_spread(name) for name in ("p", "q", "at", "u1", "u2")}
        found = self._write_correction(rows)
        self._write_leave(self._write_is_nearest(found), "begins")
        good, out = self._write_march(rows)
        state = self._write_gather(good, out)
        self._write_leave(self._write_is_one_run(state, found), "follows")
        t.write_line(f"store double {ALL_SOLVED}, ptr %out")
        t.write_line("ret void")
        t.write_label("leave")
        t.write_line("ret void")
        t.write_line("}")
        v, pointers = t.vector, f"<{LANES} x ptr>"
        t.write_line(f"declare i1 @llvm.vector.reduce.and.v{LANES}i1(<{LANES} x i1>)")
        t.write_line(f"declare {v} @llvm.masked.gather.v{LANES}f64.v{LANES}p0({pointers}, i32, <{LANES} x i1>, {v})")
        return NewtonLayout(t.module_text(numbers), self.told, self.scratch_size)

    def _context(self, name: str, kind: str = "ptr") -> str:
        """One of `CONTEXT`."""
        t = self.ir
        place = t.add_instruction(f"getelementptr i64, ptr %context, i64 {CONTEXT.index(name)}")
        return t.add_instruction(f"load {kind}, ptr {place}")

    def _take_scratch(self, many: int) -> str:
        """Room for so many vectors."""
        first, self.scratch_size = self.scratch_size, self.scratch_size + many * LANES
        return self.ir.double_pointer("%scratch", str(first))

    def _row(self, base: str, k: int) -> str:
        return self.ir.load(self.ir.double_pointer(base, str(k * LANES)))

    def _write_leave(self, flag: str, on: str) -> None:
        """Go on where a flag is up."""
        self.ir.write_line(f"br i1 {flag}, label %{on}, label %leave")
        self.ir.write_label(on)

    def _all(self, flag: str) -> str:
        return self.ir.add_instruction(f"call i1 @llvm.vector.reduce.and.v{LANES}i1(<{LANES} x i1> {flag})")

    def _number(self, operand: Operand) -> str:
        t = self.ir
        return t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(self.order.index(operand)))}")

    def _write_spread(self, kind: str) -> str:
        """The numbers of a kind in all lanes, row by row."""
        t = self.ir
        operands = [operand for operand in self.order if operand[0] == kind]
        # rates stand together, the first and the second
        base = self._take_scratch(len(operands))
        for k, operand in enumerate(operands):
            t.store(t.broadcast(self._number(operand)), t.double_pointer(base, str(k * LANES)))
        return base

    def _write_inputs(self, name: str) -> str:
        """Where the inputs are in each lane: where the file's design has them, and as much farther as this one."""
        t, given, rows = self.ir, self._context(name), {operand: k for k, operand in enumerate(self.march.inputs)}
        base = self._take_scratch(len(rows))
        for k, is_angle in enumerate(self.equations.input_is_angle):
            moved = {("u", k): t.binary("add", self._row(given, rows["u", k]), t.broadcast(self._number(("d", k))))}
            if is_angle:
                cos, sin = (self._row(given, rows[part, k]) for part in ("uc", "us"))
                by = [t.broadcast(self._number((part, k))) for part in ("dc", "ds")]
                moved["uc", k], moved["us", k] = write_angle_sum(t, cos, sin, by[0], by[1])
            for operand, value in moved.items():
                t.store(value, t.double_pointer(base, str(rows[operand] * LANES)))
        return base

    def _write_kernel_call(self, function: str, arrays: Sequence[str], steps: str, row_count: int, ends: str) -> None:
        t = self.ir
        given = ", ".join(f"ptr {each}" for each in arrays)
        t.write_line(
            f"call void {function}(i64 1, i64 {steps}, i64 {LANES}, i64 {LANES}, i64 {row_count * LANES}, "
            f"{given}, {ends}, ptr null)"  # kernels with the blocks of points count no candidates
        )

    def _write_correction(self, rows: dict[str, str]) -> tuple[str, str]:
        """The design from each of the file's assemblies: which lanes converged, and what the kernel gives of them."""
        good, out = self._take_scratch(1), self._take_scratch(self.corrector.output_row_count)
        arrays = [rows["p"], rows["at"], self._context("starts"), self._write_inputs("start inputs")]
        arrays += [rows["u1"], self._context("start table"), self._context("start counts")]
        ends = f"double {self._number(('tolerance', 0))}, double 0x7FF0000000000000, double 1.0, ptr {out}, ptr {good}"
        self._write_kernel_call(self._context("corrector"), arrays, "1", self.corrector.output_row_count, ends)
        return good, out

    def _first(self, value: str) -> str:
        """What stands in the first lane, in every lane."""
        return self._lane(value, 0)

    def _lane(self, value: str, lane: int) -> str:
        """What stands in one of the lanes, in every lane."""
        t, mask = self.ir, ", ".join([f"i32 {lane}"] * LANES)
        return t.add_instruction(f"shufflevector {t.vector} {value}, {t.vector} poison, <{LANES} x i32> <{mask}>")

    def _write_is_nearest(self, found: tuple[str, str]) -> str:
        """Whether the first lane is surely the assembly nearest to the sketch, as `find_assemblies` has it."""
        t = self.ir
        good, out = found
        blocks = [block for block, *_ in self.design.sketched]
        count = len(blocks)
        shown = [t.broadcast(self._number(("sketch", k))) for k in range(2 * count)]
        costs, others = (
            [self._write_squared_distance(out, first + 2 * k, shown[2 * k : 2 * k + 2]) for k in range(count)]
            for first in (0, 2 * count)
        )
        converged = t.compare("ogt", t.load(good), t.constant(0.0))
        regularity = self._row(out, 4 * count + len(self.corrector.state))
        regular = t.compare("ogt", regularity, t.constant(CLEAR_REGULARITY**2))
        flag, before = converged, t.constant(0.0)
        of_blocks = [
            [k for k, block in enumerate(blocks) if block == part.block.block_index] for part in self.equations.blocks
        ]
        total = self._first(t.add_all([costs[k] for own in of_blocks for k in own]))
        for part, own, most, lanes in zip(self.equations.blocks, of_blocks, *self.lanes, strict=True):
            cost = t.add_all([costs[k] for k in own])
            here = self._first(cost)
            if part.closed_form is not None:
                least = self._first(t.add_all([others[k] for k in own]))
                flag = t.and_flags(flag, self._write_is_farther(before, least, total))
            else:
                is_small = len(part.unknowns) <= MAX_BLOCK_UNKNOWNS
                reach = NEAR_SKETCH if is_small else CLEAR_SKETCH_DISTANCE
                near, at_sketch = (
                    t.compare("ole", here, t.constant(len(own) * each**2)) for each in (reach, CLEAR_SKETCH_DISTANCE)
                )
                least = self._write_least_other(part.unknowns, out, converged, (most, lanes), cost)
                nearest = t.or_flags(at_sketch, self._write_is_farther(before, least, total))
                flag = t.and_flags(t.and_flags(flag, regular), t.and_flags(near, nearest))
            before = t.add_instruction(f"fadd {t.vector} {before}, {here}")
        return self.ir.add_instruction(f"extractelement <{LANES} x i1> {flag}, i64 0")

    def _write_is_farther(self, before: str, other: str, total: str) -> str:
        t = self.ir
        return t.compare(
            "ogt", t.binary("add", before, other), t.binary("add", total, t.constant(EQUAL_DISTANCE_TOLERANCE))
        )

    def _write_squared_distance(self, out: str, row: int, shown: Sequence[str]) -> str:
        t = self.ir
        gaps = [t.binary("sub", self._row(out, row + axis), shown[axis]) for axis in range(2)]
        return t.add_all([t.binary("mul", gap, gap) for gap in gaps])

    def _write_least_other(
        self, unknowns: range, out: str, converged: str, other: tuple[int, tuple[int, ...]], cost: str
    ) -> str:
        """The least cost of a block's other assemblies; less than nothing where not as many are found as it has."""
        t = self.ir
        most, lanes = other
        places = 4 * len(self.design.sketched)
        state = [self._row(out, places + k) for k, leaf in enumerate(self.corrector.state) if leaf[1] in unknowns]
        mine = f"<{', '.join(f'i1 {str(k in lanes).lower()}' for k in range(LANES))}>"
        new = t.and_flags(converged, mine)
        for back, at in enumerate((0, *lanes)):
            # apart from the assembly of an earlier lane
            gap = t.constant(0.0)
            for each in state:
                off = t.binary("sub", each, self._lane(each, at))
                gap = t.call_intrinsic("maxnum", gap, t.call_intrinsic("fabs", off))
            apart = t.compare("ogt", gap, t.constant(SAME_ASSEMBLY_TOLERANCE))
            earlier = f"<{', '.join(f'i1 {str(k not in lanes[back:]).lower()}' for k in range(LANES))}>"
            new = t.and_flags(new, t.or_flags(apart, earlier))
        count = t.broadcast(t.reduce("fadd", t.select_or_zero(new, t.constant(1.0))))
        least = t.broadcast(t.reduce("fmin", t.select(new, cost, t.constant(inf))))
        return t.select(t.compare("oeq", count, t.constant(most - 1.0)), least, t.constant(-inf))

    def _write_march(self, rows: dict[str, str]) -> tuple[str, str]:
        """The run, a piece in each lane: how many steps went well, and what the kernel gives of all steps."""
        t = self.ir
        good = self._take_scratch(1)
        arrays = [rows["p"], rows["q"], self._context("states"), self._write_inputs("inputs")]
        arrays += [rows["u1"], self._context("table"), self._context("counts")]
        limit, steps = self._context("correction limit", "double"), self._context("steps", "i64")
        # what the march gives stands at the end of the scratch, where there is room for as many steps as there are
        self.gathered_rows = len(self.march.state)
        out = "%pieces"
        state_room = t.add_instruction(f"mul i64 {self._context('blocks', 'i64')}, {LANES * self.gathered_rows}")
        first = t.add_instruction(f"add i64 {state_room}, {self.scratch_size + LANES}")
        t.write_line(f"{out} = getelementptr double, ptr %scratch, i64 {first}")
        ends = (
            f"double {self._number(('tolerance', 0))}, double {limit}, double {self._number(('unit', 0))}, "
            f"ptr {out}, ptr {good}"
        )
        self._write_kernel_call(self._context("march"), arrays, steps, self.march.output_row_count, ends)
        return good, out

    def _write_gather(self, good: str, out: str) -> str:
        """What is told of all positions in their order, and the state beside it: where the state's rows begin."""
        t = self.ir
        steps = t.broadcast(t.add_instruction(f"sitofp i64 {self._context('steps', 'i64')} to double"))
        self._write_leave(self._all(t.compare("oeq", t.load(good), steps)), "marched")
        regularity = self.state_first + len(self.march.state)
        worst = t.allocate()
        t.store(t.constant(inf), worst)
        state = t.double_pointer("%scratch", str(self.scratch_size))
        blocks, places = self._context("blocks", "i64"), self._context("places")
        width = t.add_instruction(f"mul i64 {blocks}, {LANES}")
        told = t.double_pointer("%out", "8")
        t.write_line("br label %gather")
        t.write_label("gather")
        t.write_line("%g = phi i64 [0, %marched], [%gnext, %gather]")
        first = t.add_instruction(f"mul i64 %g, {LANES}")
        index = t.add_instruction(
            f"load <{LANES} x i64>, ptr {t.add_instruction(f'getelementptr i64, ptr {places}, i64 {first}')}, align 8"
        )

        def gather(row: int) -> str:
            base = t.double_pointer(out, str(row * LANES))
            at = t.add_instruction(f"getelementptr double, ptr {base}, <{LANES} x i64> {index}")
            return t.add_instruction(
                f"call {t.vector} @llvm.masked.gather.v{LANES}f64.v{LANES}p0(<{LANES} x ptr> {at}, i32 8, "
                f"<{LANES} x i1> splat (i1 true), {t.vector} poison)"
            )

        targets = [(told, k, k) for k in range(self.told)]
        targets += [(state, k, self.state_first + k) for k in range(len(self.march.state))]
        for base, k, row in targets:
            place = t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 {width}, {k}')}, {first}")
            t.store(gather(row), t.double_pointer(base, place))
        t.store(t.call_intrinsic("minnum", t.load(worst), gather(regularity)), worst)
        t.close_loop("g", blocks.lstrip("%"), "gather", "gathered")
        t.write_label("gathered")
        # one limit for all blocks: that of the smallest
        least = max(
            least_regularity(LEAST_KERNEL_REGULARITY**2, len(part.unknowns))
            for part in self.equations.blocks
            if part.closed_form is None
        )
        enough = t.compare("oge", t.load(worst), t.constant(least))
        self._write_leave(self._all(enough), "regular")
        return state

    def _write_is_one_run(self, state: str, found: tuple[str, str]) -> str:
        """Whether the pieces are one run from where the design begins: from position to position everything goes on as
        the three before say, by as little as may be corrected."""
        t = self.ir
        places = 4 * len(self.design.sketched)
        off_start = t.constant(0.0)
        blocks = self._context("blocks", "i64")
        width = t.add_instruction(f"mul i64 {blocks}, {LANES}")
        for k in range(len(self.march.state)):
            here = t.load(t.double_pointer(state, t.add_instruction(f"mul i64 {width}, {k}")))
            off = t.binary("sub", self._first(here), self._first(self._row(found[1], places + k)))
            off_start = t.binary("add", off_start, t.call_intrinsic("fabs", off))
        begins = t.compare("ole", off_start, t.constant(SAME_ASSEMBLY_TOLERANCE))
        self._write_leave(self._all(begins), "compare")
        most = t.allocate()
        t.store(t.constant(0.0), most)
        last = t.add_instruction(f"sub i64 {self._context('positions', 'i64')}, 3")
        lanes_last = t.add_instruction(f"insertelement <{LANES} x i64> poison, i64 {last}, i64 0")
        t.write_line("br label %difference")
        t.write_label("difference")
        t.write_line("%d = phi i64 [0, %compare], [%dnext, %difference]")
        first = t.add_instruction(f"mul i64 %d, {LANES}")
        sums = t.constant(0.0)
        for k in range(len(self.march.state)):
            at = t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 {width}, {k}')}, {first}")
            four = [t.load(t.double_pointer(state, t.add_instruction(f"add i64 {at}, {ahead}"))) for ahead in range(4)]
            inner = t.binary("mul", t.constant(3.0), t.binary("sub", four[1], four[2]))
            third = t.binary("add", t.binary("sub", four[3], four[0]), inner)
            sums = t.binary("add", sums, t.call_intrinsic("fabs", third))
        beyond = t.lanes_from(first, lanes_last)
        limit = t.broadcast(self._context("correction limit", "double"))
        fine = t.or_flags(t.compare("ole", sums, limit), beyond)
        t.store(t.binary("add", t.load(most), t.select(fine, t.constant(0.0), t.constant(1.0))), most)
        t.close_loop("d", blocks.lstrip("%"), "difference", "compared")
        t.write_label("compared")
        return self._all(t.compare("oeq", t.load(most), t.constant(0.0)))


Array = np.ndarray

HEADER = 8
"""Numbers at the head of what is given: how the run ended."""
LEAST_PIECE = PREDICTOR_ORDER + 2
"""Steps of a piece, at least: before, too little is predicted."""
START_CORRECTIONS = 8
"""Newton's steps from where the file's own design is at the same inputs."""
DIGITS = 16.0
"""Decimals of what is solved."""


class NewtonRun:
    """See `native_run.NativeRun`. Raises UnsupportedOperation."""

    def __init__(
        self,
        reference: ReferenceDesign,
        design: DesignNumbers,
        members: Sequence[PointMember],
        rates: bool,
        u: Array,
    ):
        """u (positions, inputs): where the inputs are."""
        links, shown = tuple(link for link, _ in members), [link for *_, link, _ in design.sketched]
        blocks, equations = tuple(block for block, *_ in design.sketched), design.equations("q")
        if set(blocks) < {part.block.block_index for part in equations.blocks}:
            raise UnsupportedOperation("the sketch does not show every group")
        pieces = _Pieces(len(u))
        kernels = (
            write_designs_kernel(
                KernelRequest(design.equations("at"), tuple(shown), False, LANES, blocks, streams=False)
            ),
            write_designs_kernel(KernelRequest(equations, links, rates, LANES, (-1,) * len(links), streams=False)),
        )
        starts, lanes = _assembly_lanes(reference, equations)
        layout = write_newton_run(equations, design, kernels, len(links), rates, lanes)
        self._held = {
            "own values": design.own_values,
            "starts": operand_rows(kernels[0].state, starts),
            "start inputs": operand_rows(kernels[0].inputs, np.repeat(u[:1].T, LANES, axis=1)),
            "states": operand_rows(kernels[1].state, _own_unknowns(reference, u, members, pieces.firsts)),
            "inputs": operand_rows(kernels[1].inputs, np.ascontiguousarray(u[pieces.firsts].T)),
            "places": pieces.places(kernels[1].output_row_count * LANES),
            **_step_tables(u, pieces.steps),
        }
        self._kernels = [compile_function(each.ir, MARCH_FUNCTION, *MARCH_ARGUMENTS) for each in kernels]
        numbers: dict[str, int] = {name: array.ctypes.data for name, array in self._held.items()}
        for name, function in zip(("corrector", "march"), self._kernels, strict=True):
            numbers[name] = ctypes.cast(function, ctypes.c_void_p).value or 0
        numbers |= {"steps": pieces.steps + 1, "blocks": pieces.blocks, "positions": len(u)}
        numbers["correction limit"] = int(np.array(correction_limit(longest_step(u))).view(np.int64))
        self._context = np.array([numbers[name] for name in CONTEXT], dtype=np.int64)
        self._context_pointer = self._context.ctypes.data
        self._function: Any = compile_function(layout.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        self._shape, self._positions = (layout.told, pieces.width), len(u)
        marched = (pieces.steps + 1) * kernels[1].output_row_count * LANES
        self._scratch = (
            layout.scratch + len(kernels[1].state) * pieces.width + LANES + marched + WIDEST_VECTOR_BYTES // 8
        )
        self._size = HEADER + layout.told * pieces.width
        self._state_first = layout.scratch
        binder = ValueBinder(design.index)
        self.bind, self.bound = binder.bind, binder.bound

    def __call__(self, values: Mapping[str, float]) -> tuple[Array, float, int]:
        """See `native_run.NativeRun`."""
        names = tuple(values)
        pack, _, places = self.bound.get(names) or self.bind(names)
        out, scratch = np.empty(self._size), np.empty(self._scratch)
        first = address_of(scratch)
        # where whole vectors begin
        first += -first % (WIDEST_VECTOR_BYTES)
        self._function(self._context_pointer, places, pack(*values.values()), first, address_of(out))
        rows = out[HEADER:].reshape(self._shape)[:, : self._positions]
        return rows, out.item(0), 0

    def run_call(self) -> RunCall:
        """How other compiled code runs it for its states."""
        room, second = self._scratch + self._size, self._scratch
        width = self._shape[1]
        return RunCall(self._function, self._context_pointer, room, second, second, self._state_first, width)


class _Pieces:
    """A run of so many positions in pieces of as many steps each, one for each lane; they may overlap.

    Raises UnsupportedOperation where they are too short.
    """

    def __init__(self, positions: int):
        self.positions, self.steps = positions, ceil((positions - 1) / LANES)
        if self.steps < LEAST_PIECE:
            raise UnsupportedOperation("so few steps do not show where the lanes go")
        self.blocks = ceil(positions / LANES)
        self.width = self.blocks * LANES
        self.firsts = np.round(np.arange(LANES) * ((positions - 1 - self.steps) / (LANES - 1))).astype(int)

    def places(self, stride: int) -> Array:
        """Where each position (width,) stands in what the lanes give, so far from step to step; after the last, that
        again."""
        which = np.minimum(np.arange(self.width), self.positions - 1)
        lane = np.searchsorted(self.firsts, which, side="right") - 1
        return ((which - self.firsts[lane]) * stride + lane).astype(np.int64)


def _own_unknowns(reference: ReferenceDesign, u: Array, members: Sequence[PointMember], at: Array) -> Array:
    """The unknowns (unknowns, lanes) of the file's own design at positions (lanes,) of its run.

    Raises UnsupportedOperation where its assembly is not sure, or does not come to the end.
    """
    rows = reference.design_rows({}, 1)
    start = find_assemblies(reference, rows.shapes, rows.p, rows.u)
    inputs = rows.u, rows.u1, rows.u2
    batch = reference.design_batch(rows.shapes, rows.p, inputs, members)._replace(z0=start.z, input_offsets=u - u[0])
    good = run_designs(batch, allocate_aligned(len(u), batch.output_row_count, 1))
    if not start.is_sure[0] or good[0] < len(u):
        raise UnsupportedOperation("the file's own design does not run to the end")
    return unknowns_at_steps(batch.select(np.zeros(len(at), dtype=int)), at)


def _assembly_lanes(reference: ReferenceDesign, equations: KernelEquations) -> tuple[Array, AssemblyLanes]:
    """The assemblies of the file's own design (unknowns, lanes): the first nearest to the sketch, then others of one
    block after the other, as far as there are lanes."""
    blocks = reference.functions.equations.blocks
    roots = {block.block_index: each for block, each in zip(blocks, reference.block_assemblies(), strict=True)}
    start = np.concatenate([np.zeros(0), *(found[0] for found, _ in roots.values() if len(found))])
    starts, own = [start], []
    for part in equations.blocks:
        found, _ = roots[part.block.block_index]
        others = found[1:] if part.closed_form is None else found[:0]
        first = len(starts)
        for root in others[: LANES - first]:
            starts.append(start.copy())
            starts[-1][part.block.unknowns] = root
        own.append(tuple(range(first, len(starts))))
    starts += [start] * (LANES - len(starts))
    return np.array(starts).T, AssemblyLanes(
        tuple(roots[part.block.block_index][1] for part in equations.blocks), tuple(own)
    )


def _step_tables(u: Array, steps: int) -> dict[str, Array]:
    """What the kernels need to know of their steps: at the start, and over a piece of so many."""
    table, counts = step_table(u[: steps + 1] - u[0])
    # what is predicted from so few steps is off by as many powers of a step; each correction doubles the digits
    digits = max(-log10(longest_step(u)), 0.3)
    for step in range(1, PREDICTOR_ORDER + 1):
        counts[step] = max(counts[-1], ceil(log2(max(DIGITS / (step * digits), 1.0))) + 1)
    counts[0] = START_CORRECTIONS
    start_table, start_counts = step_table(np.zeros((1, u.shape[1])))
    start_counts[:] = CORRECTIONS
    return {"table": table, "counts": counts, "start table": start_table, "start counts": start_counts}
