"""Runs of many designs through the compiled function."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np

from planar.batch.march.backend import CorrectedAssemblies, DesignBatch, ResultRows, erase_between
from planar.batch.march.kernel import KernelEquations, batch_equations
from planar.batch.march.llvm.designs_writer import (
    ARGUMENT_TYPES,
    FUNCTION_NAME,
    write_designs_kernel,
)
from planar.batch.march.llvm.kernel_writer import STATE_GIVEN, DesignsKernelLayout, KernelStart
from planar.batch.march.prediction import (
    LONGEST_STEP,
    PREDICTOR_ORDER,
    correction_counts,
    correction_limit,
    extrapolation_weights,
    longest_step,
)
from planar.codegen.aligned_arrays import allocate_aligned, is_aligned
from planar.codegen.llvm_compile import compile_function
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.turns import leave_turn

Array = np.ndarray

LONG_CALL_POSITIONS = 2**13
"""Positions from which on other threads go on while they are solved."""
LANES = 16
"""Designs at once: two vectors of the widest machines, so that one waits while the other works."""


def designs_kernel(
    equations: KernelEquations,
    links: tuple[str, ...],
    rates: bool,
    point_blocks: tuple[int, ...] | None = None,
    is_single: bool = False,
    start: KernelStart = STATE_GIVEN,
    counts_candidates: bool = False,
    results: ResultRows | None = None,
) -> DesignsKernelLayout:
    """The function for points on links of a structure, see `march`. Raises UnsupportedOperation."""
    found = _designs_kernel_or_reason(
        equations, links, rates, point_blocks, is_single, start, counts_candidates, results
    )
    if isinstance(found, str):
        raise UnsupportedOperation(found)
    return found


@lru_cache(maxsize=256)
def _designs_kernel_or_reason(
    equations: KernelEquations,
    links: tuple[str, ...],
    rates: bool,
    point_blocks: tuple[int, ...] | None,
    is_single: bool,
    start: KernelStart,
    counts_candidates: bool,
    results: ResultRows | None,
) -> DesignsKernelLayout | str:
    """The same, or why there is none: every block of a sweep would find that out again."""
    try:
        more = {"is_single": is_single, "counts_candidates": counts_candidates}
        return write_designs_kernel(equations, links, rates, LANES, point_blocks, start=start, results=results, **more)
    except UnsupportedOperation as why:
        return str(why)


def run_designs_kernel(
    batch: DesignBatch, extra_corrections: int = 0, out: Array | None = None, candidates: Array | None = None
) -> tuple[Array, Array]:
    """The points of a batch over its steps, and how many of its first steps every design did well (designs,).

    `extra_corrections` are made at every step for designs that are less well predicted. The points are out (steps + 1,
    rows, designs), as for `DesignRunner`, with `candidates`, in single precision where `out` is. Raises
    UnsupportedOperation where the structure is not for machine code.
    """
    longest = _longest_step(batch)
    is_single = out is not None and out.dtype == np.float32
    equations = batch_equations(batch)
    signs, common = _known_signs(batch, equations), _common_inputs(batch.u0)
    start = KernelStart(signs is not None, signs is not None and common is not None)
    counts = candidates is not None and not equations.has_newton_blocks
    kernel = designs_kernel(equations, tuple(batch.links), batch.rates, None, is_single, start, counts, batch.results)
    table, corrections = step_table(batch.input_offsets, common if kernel.start.has_common_inputs else None)
    tolerances = batch.tolerance, correction_limit(longest), batch.unit
    out, good, found = _run_kernel(
        kernel, batch._replace(signs=signs), batch.rates, (table, corrections + extra_corrections), tolerances, out
    )
    written = found if counts else good.copy()
    # what is told of a step only at the next one condemns the step too
    good -= (good > 1) & (good < len(table))
    if candidates is None:
        erase_between(out, good, written)
    else:
        candidates[:] = written
    return out, good


def unknowns_at_steps(batch: DesignBatch, extra_corrections: int, steps: Array) -> Array:
    """The unknowns (unknowns, designs) of a run that came to these steps, at (designs,), of each design to one."""
    batch = batch._replace(stops=None)
    kernel = designs_kernel(batch_equations(batch), (), False, ())
    table, counts = step_table(batch.input_offsets)
    tolerances = batch.tolerance, correction_limit(_longest_step(batch)), 1.0
    found = _run_kernel(kernel, batch, False, (table, counts + extra_corrections), tolerances, None)[0]
    return _unknowns_from_state(kernel, found[steps, :, np.arange(len(steps))].T, len(batch.z0))


def correct_designs(batch: DesignBatch, point_blocks: Sequence[int], corrections: int) -> CorrectedAssemblies:
    """Designs corrected from unknowns near by, at the inputs where they start. Raises UnsupportedOperation."""
    kernel = designs_kernel(batch_equations(batch), tuple(batch.links), False, tuple(point_blocks))
    table, counts = step_table(np.zeros((1, len(batch.u0))))
    counts[:] = corrections
    out, good, _ = _run_kernel(kernel, batch, False, (table, counts), (batch.tolerance, np.inf, 1.0), None)
    rows, places = out[0], 2 * len(batch.links)
    z = _unknowns_from_state(kernel, rows[2 * places :], len(batch.z0))
    both = rows[: 2 * places].reshape(2, len(batch.links), 2, rows.shape[1])
    return CorrectedAssemblies(good > 0, np.sqrt(np.maximum(rows[-1], 0.0)), z, *both)


def _known_signs(batch: DesignBatch, equations: KernelEquations) -> Array | None:
    """The signs (blocks, designs) of a batch's assemblies, not numbers of a design that starts nowhere; None where not
    all blocks are in closed form, or nothing is known of them."""
    if batch.signs is None or equations.has_newton_blocks:
        return None
    signs = batch.signs
    if not np.isfinite(batch.u0.sum()):  # as where a design is not to run
        signs = np.where(np.isfinite(batch.u0).all(axis=0), signs, np.nan)
    if signs.all():
        return signs
    unknown, signs = np.flatnonzero((signs == 0.0).any(axis=0)), signs.copy()
    signs[:, unknown] = equations.assembly_signs(*(rows[:, unknown] for rows in (batch.z0, batch.u0, batch.p)))
    return signs


def _common_inputs(u0: Array) -> Array | None:
    """The inputs (inputs,) at which all designs start that start anywhere; None where they differ."""
    first = u0[:, 0]
    if (u0 == first[:, None]).all():
        return first
    least, most = (np.array([of(row) for row in u0]) for of in (np.fmin.reduce, np.fmax.reduce))
    return least if np.array_equal(least, most) else None


def _longest_step(batch: DesignBatch) -> float:
    """How far an input goes in a step at most. Raises UnsupportedOperation where that is too far."""
    longest = longest_step(batch.input_offsets)
    if longest > LONGEST_STEP or len(batch.input_offsets) == 2:
        raise UnsupportedOperation("steps so long do not show what lies between them")
    return longest


def _unknowns_from_state(kernel: DesignsKernelLayout, rows: Array, count: int) -> Array:
    """The unknowns (unknowns, designs) of a state (rows, designs)."""
    state = dict(zip(kernel.state, rows, strict=False))
    z = np.empty((count, rows.shape[1]))
    for k in range(count):
        z[k] = state["z", k] if ("z", k) in state else np.arctan2(state["zs", k], state["zc", k])
    return z


def _run_kernel(
    kernel: DesignsKernelLayout,
    batch: DesignBatch,
    rates: bool,
    tables: tuple[Array, Array],
    tolerances: tuple[float, float, float],
    out: Array | None,
) -> tuple[Array, Array, Array]:
    """What the kernel gives: out, good, candidates."""
    function = compile_function(kernel.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
    many, steps, lanes = batch.p.shape[1], len(tables[0]), kernel.lanes
    rows = (
        batch.numbers,
        batch.q,
        batch.signs if kernel.start.has_signs and batch.signs is not None else operand_rows(kernel.state, batch.z0),
        operand_rows(kernel.inputs, batch.u0) if not kernel.start.has_common_inputs else np.zeros((0, many)),
        np.concatenate([batch.u1, batch.u2]) if rates else np.zeros((0, many)),
    )
    given = out
    dtype = np.dtype(np.float64) if out is None else out.dtype
    if out is None or not is_aligned(out):
        out = allocate_aligned(steps, kernel.output_row_count, many, dtype)
    counted = np.zeros((2, -(-many // lanes) * lanes))
    whole = many // lanes * lanes
    if whole:
        _call_function(function, kernel, rows, whole, tables, tolerances, out, counted)
    if whole < many:
        # those that do not fill the lanes, with copies of the last beside them
        which = np.minimum(np.arange(whole, whole + lanes), many - 1)
        last = allocate_aligned(steps, kernel.output_row_count, lanes, dtype)
        own = [row[:, which] for row in rows]
        _call_function(function, kernel, own, lanes, tables, tolerances, last, counted[:, whole:])
        out[:, :, whole:] = last[:, :, : many - whole]
    if given is not None and given is not out:
        given[...] = out
    good, candidates = counted[:, :many].astype(int)
    return out, good, candidates


def _call_function(
    function: Any,
    kernel: DesignsKernelLayout,
    rows: Sequence[Array],
    design_count: int,
    tables: tuple[Array, Array],
    tolerances: tuple[float, float, float],
    out: Array,
    counted: Array,
) -> None:
    arrays = [np.ascontiguousarray(row) for row in (*rows, *tables)]
    width = rows[0].shape[1]
    strides = (out.strides[1] // out.itemsize, out.strides[0] // out.itemsize)
    with leave_turn(design_count * len(tables[0]) >= LONG_CALL_POSITIONS):
        function(
            design_count // kernel.lanes,
            len(tables[0]),
            width,
            *strides,
            *(each.ctypes.data for each in arrays),
            *tolerances,
            out.ctypes.data,
            *(each.ctypes.data for each in counted),
        )


def operand_rows(operands: Sequence[tuple[str, int]], values: Array) -> Array:
    """Cosines, sines and values of rows, as leaves say."""
    found = np.empty((len(operands), values.shape[1]))
    for row, (part, k) in zip(found, operands, strict=True):
        of = values[k]
        # designs mostly start at one input
        alike = of.size and of[0] == of[-1] and np.all(of == of[0])
        row[:] = {"c": np.cos, "s": np.sin}.get(part[1:], np.positive)(of[:1] if alike else of)
    return found


def step_table(offsets: Array, start: Array | None = None) -> tuple[Array, Array]:
    """What every step needs to know: the weights of the steps before, and how far each input has gone, or where it is
    if all designs `start` (inputs,) at one position."""
    offsets = np.ascontiguousarray(offsets if start is None else offsets + start)
    table, counts = _step_table(offsets.tobytes(), offsets.shape)
    return table, counts.copy()


@lru_cache(maxsize=64)
def _step_table(content: bytes, shape: tuple[int, int]) -> tuple[Array, Array]:
    """The same of offsets (steps + 1, inputs) as bytes: the blocks of a sweep have them in common."""
    steps, inputs = shape
    offsets = np.frombuffer(content).reshape(shape)
    table = np.zeros((steps, PREDICTOR_ORDER + 3 * inputs))
    for step in range(min(steps, PREDICTOR_ORDER)):
        # ahead of the first there is its start
        table[step, : max(step, 1)] = extrapolation_weights(max(step, 1))
    table[PREDICTOR_ORDER:, :PREDICTOR_ORDER] = extrapolation_weights(PREDICTOR_ORDER)
    for k in range(inputs):
        table[:, PREDICTOR_ORDER + 3 * k : PREDICTOR_ORDER + 3 * k + 3] = np.stack(
            [offsets[:, k], np.cos(offsets[:, k]), np.sin(offsets[:, k])], axis=1
        )
    table.flags.writeable = False
    return table, correction_counts(steps, longest_step(offsets))
