"""Runs of one linkage with blocks that Newton's method solves: a piece of the run in each lane, in one call."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping, Sequence
from math import ceil, log2, log10
from typing import Any

import numpy as np

from planar.batch.assembly.nearest_assemblies import CORRECTIONS
from planar.batch.initial_assembly import find_assemblies
from planar.batch.march.designs_writer import ARGUMENT_TYPES as KERNEL_ARGUMENTS
from planar.batch.march.designs_writer import FUNCTION_NAME as KERNEL_FUNCTION
from planar.batch.march.designs_writer import write_designs_kernel
from planar.batch.march.kernel import KernelEquations, operand_rows
from planar.batch.march.prediction import (
    PREDICTOR_ORDER,
    correction_limit,
    longest_step,
)
from planar.batch.march.runs import run_designs, step_table, unknowns_at_steps
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.llvm_newton import (
    ARGUMENT_TYPES,
    CONTEXT,
    FUNCTION_NAME,
    LANES,
    AssemblyLanes,
    write_newton_run,
)
from planar.batch.prepare.value_binder import RunCall, ValueBinder, address_of
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.aligned_arrays import WIDEST_VECTOR_BYTES, allocate_aligned
from planar.codegen.llvm_compile import compile_function
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember

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
            write_designs_kernel(design.equations("at"), shown, False, LANES, blocks, streams=False),
            write_designs_kernel(equations, links, rates, LANES, (-1,) * len(links), streams=False),
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
        self._kernels = [compile_function(each.ir, KERNEL_FUNCTION, *KERNEL_ARGUMENTS) for each in kernels]
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
    shapes = reference.shapes(reference.mechanism)
    p, inputs = reference.pair_numbers(shapes, 1, reference.mechanism), reference.inputs(reference.mechanism, 1)
    start = find_assemblies(reference, shapes, p, inputs[0])
    batch = reference.design_batch(shapes, p, inputs, members)._replace(z0=start.z, input_offsets=u - u[0])
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
