"""All designs of a block through the same steps by compiled code, each position judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import ceil
from typing import Any

import numpy as np

from planar.batch.design_arrays import split_into_blocks
from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import (
    CorrectedAssemblies,
    DesignBatch,
    erase_between,
    erase_from_steps,
)
from planar.batch.march.designs_writer import (
    MARCH_ARGUMENTS,
    MARCH_FUNCTION,
    KernelRequest,
    write_designs_kernel,
)
from planar.batch.march.kernel import KernelEquations, batch_equations, operand_rows, unknowns_from_state
from planar.batch.march.kernel_writer import DesignsKernelLayout, KernelStart
from planar.batch.march.prediction import (
    LONGEST_STEP,
    PREDICTOR_ORDER,
    correction_counts,
    correction_limit,
    longest_step,
    prediction_weights,
)
from planar.codegen.llvm_compile import allocate_aligned, compile_function, is_aligned
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.turns import leave_turn

Array = np.ndarray

LONG_CALL_POSITIONS = 2**13
"""Positions from which on other threads go on while they are solved."""
REFINED_STEP = 0.12
"""rad or sizes to which steps are divided that are too long."""
MAX_DIVIDED_NUMBERS = 2**23
"""Numbers of divided steps that are kept at once."""
EXTRA_CORRECTIONS = 2
"""Further corrections at every step for designs that the usual ones leave open."""
LANES = 16
"""Designs at once: two vectors of the widest machines, so that one waits while the other works."""


def designs_kernel(request: KernelRequest) -> DesignsKernelLayout:
    """The function of a request, kept. Raises UnsupportedOperation."""
    layout = _designs_kernel_or_reason(request)
    if isinstance(layout, str):
        raise UnsupportedOperation(layout)
    return layout


@lru_cache(maxsize=256)
def _designs_kernel_or_reason(request: KernelRequest) -> DesignsKernelLayout | str:
    """The same, or why there is none: every block of a sweep would find that out again."""
    try:
        return write_designs_kernel(request)
    except UnsupportedOperation as why:
        return str(why)


def run_designs(batch: DesignBatch, out: Array, candidates: Array | None = None) -> Array:
    """Fill out (steps + 1, rows, designs): x and y of each point, then their first, then second rates (m, s); what is
    no number from the first step on that did not pass.

    Where `out` is in single precision, each number is rounded when it is written. `candidates` (designs,) takes how
    many of the first steps stand in `out`, where that is more than passed: those that follow pass the checks of one
    position, but there may be a dead point before them.

    Designs that do not come to the end run once more with more corrections, where Newton's method solves a block; of
    those that do not begin it is looked whether they can start nearer to where two assemblies meet.

    Returns how many of the first steps passed residual and branch check (designs,). Raises UnsupportedOperation.
    """
    good, step_count, runs = np.zeros(out.shape[2], dtype=int), len(batch.input_offsets), 0
    attempts: list[tuple[Callable[[DesignBatch, Array, Array | None], Array], int]] = [(run_compiled, step_count)]
    if batch_equations(batch).has_newton_blocks:
        attempts.append((partial(run_compiled, extra_corrections=EXTRA_CORRECTIONS), step_count))
    if batch.results is None:
        attempts.append((_run_start, 1))
    for run, wanted in attempts:
        left = np.flatnonzero(good < wanted)
        if runs:  # what has nowhere to start is given once
            left = left[np.isfinite(batch.z0[:, left]).all(axis=0) & np.isfinite(batch.u0[:, left]).all(axis=0)]
        if not left.size:
            continue
        try:
            if left.size == len(good):
                good = run(batch, out, candidates)
            else:
                own = allocate_aligned(out.shape[0], out.shape[1], left.size, out.dtype)
                good[left] = run(batch.select(left), own, None)
                out[:, :, left] = own
                if candidates is not None:
                    candidates[left] = good[left]
        except UnsupportedOperation:
            continue
        runs += 1
    if not runs:
        raise UnsupportedOperation("the structure is too long to be compiled")
    return good


def _run_start(batch: DesignBatch, out: Array, candidates: Array | None) -> Array:
    """The first position alone, of designs of any structure."""
    evaluation = DesignEvaluation(batch)
    with np.errstate(all="ignore"):
        positions = evaluation.positions(evaluation.correct(batch.z0.T, batch.u0.T), batch.u0)
        good: Array = (evaluation.write_points(out[0], positions) & evaluation.accepts(positions)).astype(int)
    erase_from_steps(out, good)
    if candidates is not None:
        candidates[:] = good
    return good


def _divide_steps(offsets: Array) -> tuple[int, Array]:
    """Into how many parts steps are divided where they do not show what lies between, by offsets (steps + 1, inputs),
    and the offsets of these (parts + 1, inputs)."""
    steps, longest = len(offsets), longest_step(offsets)
    count = ceil(longest / REFINED_STEP) if longest > LONGEST_STEP or steps == 2 else 1
    count = max(count, 2) if steps == 2 else count
    if count == 1:
        return 1, offsets
    knots = np.arange(count * (steps - 1) + 1) / count
    return count, np.array([np.interp(knots, np.arange(steps), column) for column in offsets.T]).T


def run_compiled(batch: DesignBatch, out: Array, candidates: Array | None = None, extra_corrections: int = 0) -> Array:
    """As `run_designs`, once, by compiled code alone, with so many corrections more at every step than usual."""
    parts, offsets = _divide_steps(batch.input_offsets)
    if parts == 1:
        return _run_steps(batch, out, candidates, extra_corrections)
    good = np.empty(out.shape[2], dtype=int)
    batch = batch._replace(input_offsets=offsets)
    for some in split_into_blocks(len(good), max(LANES, MAX_DIVIDED_NUMBERS // (len(offsets) * out.shape[1] + 1))):
        own = allocate_aligned(len(offsets), out.shape[1], some.stop - some.start)
        good[some] = _run_steps(batch.select(some), own, None, extra_corrections)
        out[:, :, some] = own[::parts]
    good = np.where(good > 0, (good - 1) // parts + 1, 0)
    erase_from_steps(out, good)
    if candidates is not None:
        candidates[:] = good
    return good


def _run_steps(batch: DesignBatch, out: Array, candidates: Array | None, extra_corrections: int) -> Array:
    """As `run_compiled`, of steps that are short enough."""
    equations = batch_equations(batch)
    signs, common = _known_signs(batch, equations), _common_inputs(batch.u0)
    start = KernelStart(signs is not None, signs is not None and common is not None)
    counts = candidates is not None and not equations.has_newton_blocks
    request = KernelRequest(equations, tuple(batch.links), batch.rates, LANES, start=start, results=batch.results)
    kernel = designs_kernel(request._replace(is_single=out.dtype == np.float32, counts_candidates=counts))
    table, corrections = step_table(batch.input_offsets, common if kernel.start.has_common_inputs else None)
    tolerances = batch.tolerance, correction_limit(longest_step(batch.input_offsets)), batch.unit
    _, good, found = _run_kernel(
        kernel, batch._replace(signs=signs), batch.rates, (table, corrections + extra_corrections), tolerances, out
    )
    written = found if counts else good.copy()
    # what is told of a step only at the next one condemns the step too
    good -= (good > 1) & (good < len(table))
    if candidates is None:
        erase_between(out, good, written)
    else:
        candidates[:] = written
    return good


def last_good_unknowns(batch: DesignBatch, good: Array) -> Array:
    """The unknowns (unknowns, designs) at the last of so many good steps (designs,), one at least."""
    try:
        return unknowns_at_steps(batch, np.maximum(good - 1, 0))
    except UnsupportedOperation:  # none has gone beyond its start
        with np.errstate(all="ignore"):
            return DesignEvaluation(batch).correct(batch.z0.T, batch.u0.T).T


def unknowns_at_steps(batch: DesignBatch, steps: Array) -> Array:
    """The unknowns (unknowns, designs) of a run that came to these steps, at (designs,), of each design to one."""
    parts, offsets = _divide_steps(batch.input_offsets)
    batch = batch._replace(stops=None, input_offsets=offsets)
    kernel = designs_kernel(KernelRequest(batch_equations(batch), (), False, LANES, ()))
    table, counts = step_table(offsets)
    tolerances = batch.tolerance, correction_limit(longest_step(offsets)), 1.0
    found = _run_kernel(kernel, batch, False, (table, counts + EXTRA_CORRECTIONS), tolerances, None)[0]
    rows = found[parts * steps, : len(kernel.state), np.arange(len(steps))].T
    return unknowns_from_state(kernel.state, rows, len(batch.z0))


def lead_designs(batch: DesignBatch, index: int, span: Array, step: float) -> tuple[Array, Array]:
    """Designs led on from where they start, their input `index` by its span (designs,), in steps of so much.

    The unknowns there (unknowns, designs), and which designs passed all checks on the way (designs,).
    """
    z, passed = batch.z0.copy(), np.zeros(len(span), dtype=bool)
    for length in np.unique(span[np.isfinite(span)]):
        some = np.flatnonzero(span == length)
        offsets = np.zeros((ceil(abs(length) / step) + 2, len(batch.u0)))
        offsets[:, index] = np.linspace(0.0, length, len(offsets))
        own = batch.select(some)._replace(input_offsets=offsets, links=(), q=batch.q[:0, some], rates=False)
        good = run_designs(own, allocate_aligned(len(offsets), 0, len(some)))
        passed[some] = good == len(offsets)
        z[:, some] = last_good_unknowns(own, good)
    return z, passed


def correct_designs(batch: DesignBatch, point_blocks: Sequence[int], corrections: int) -> CorrectedAssemblies:
    """Designs corrected from unknowns near by, at the inputs where they start. Raises UnsupportedOperation."""
    kernel = designs_kernel(
        KernelRequest(batch_equations(batch), tuple(batch.links), False, LANES, tuple(point_blocks))
    )
    table, counts = step_table(np.zeros((1, len(batch.u0))))
    counts[:] = corrections
    out, good, _ = _run_kernel(kernel, batch, False, (table, counts), (batch.tolerance, np.inf, 1.0), None)
    rows, places = out[0], 2 * len(batch.links)
    z = unknowns_from_state(kernel.state, rows[2 * places : -1], len(batch.z0))
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


def _run_kernel(
    kernel: DesignsKernelLayout,
    batch: DesignBatch,
    rates: bool,
    tables: tuple[Array, Array],
    tolerances: tuple[float, float, float],
    out: Array | None,
) -> tuple[Array, Array, Array]:
    """What the kernel gives: out, good, candidates."""
    function = compile_function(kernel.ir, MARCH_FUNCTION, *MARCH_ARGUMENTS)
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
    table[:, :PREDICTOR_ORDER] = prediction_weights(steps, PREDICTOR_ORDER, 1)
    table[:1, 0] = 1.0  # ahead of the first step there is its start
    for k in range(inputs):
        table[:, PREDICTOR_ORDER + 3 * k : PREDICTOR_ORDER + 3 * k + 3] = np.stack(
            [offsets[:, k], np.cos(offsets[:, k]), np.sin(offsets[:, k])], axis=1
        )
    table.flags.writeable = False
    return table, correction_counts(steps, longest_step(offsets))
