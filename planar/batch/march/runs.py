"""All designs of a block through the same steps by compiled code, each position judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from math import ceil, inf

import numpy as np

from planar.batch.design_arrays import split_into_blocks
from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import (
    DesignBatch,
    erase_between,
    erase_from_steps,
)
from planar.batch.march.designs_writer import (
    MARCH_ARGUMENTS,
    MARCH_FUNCTION,
    DesignsKernelLayout,
    KernelRequest,
    write_designs_kernel,
)
from planar.batch.march.kernel import batch_equations, operand_rows, unknowns_from_state
from planar.batch.march.prediction import (
    COARSE_STEP,
    CORRECTIONS_COLUMN,
    LIMIT_COLUMN,
    LONGEST_STEP,
    PREDICTOR_ORDER,
    longest_step,
    step_table,
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
RUN_CORRECTIONS, FIRST_RUN_CORRECTIONS = 1, 6
"""Steps of Newton's method where there are enough earlier positions for a prediction, and before."""
COARSE_STEPS = (COARSE_STEP, 0.12)
"""rad or sizes: from each of these steps of the inputs on, the prediction takes one more step of Newton's method."""
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
    for run, target in attempts:
        designs = np.flatnonzero(good < target)
        if runs:  # designs that have nowhere to start are tried once
            starts = np.concatenate([batch.z0[:, designs], batch.u0[:, designs]])
            designs = designs[np.isfinite(starts).all(axis=0)]
        if not designs.size:
            continue
        try:
            if designs.size == len(good):
                good = run(batch, out, candidates)
            else:
                part = allocate_aligned(out.shape[0], out.shape[1], designs.size, out.dtype)
                good[designs] = run(batch.select(designs), part, None)
                out[:, :, designs] = part
                if candidates is not None:
                    candidates[designs] = good[designs]
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
    size = max(LANES, MAX_DIVIDED_NUMBERS // (len(offsets) * out.shape[1] + 1))
    for designs in split_into_blocks(len(good), size):
        divided = allocate_aligned(len(offsets), out.shape[1], designs.stop - designs.start)
        good[designs] = _run_steps(batch.select(designs), divided, None, extra_corrections)
        out[:, :, designs] = divided[::parts]
    good = np.where(good > 0, (good - 1) // parts + 1, 0)
    erase_from_steps(out, good)
    if candidates is not None:
        candidates[:] = good
    return good


def _run_steps(batch: DesignBatch, out: Array, candidates: Array | None, extra_corrections: int) -> Array:
    """As `run_compiled`, of steps that are short enough."""
    equations, common = batch_equations(batch), _common_inputs(batch.u0)
    signs = None if equations.has_newton_blocks else batch.signs
    if signs is not None and not np.isfinite(batch.u0.sum()):  # as of a design that is not to run
        signs = np.where(np.isfinite(batch.u0).all(axis=0), signs, np.nan)
    has_signs, has_common_inputs = signs is not None, signs is not None and common is not None
    counts = candidates is not None and not equations.has_newton_blocks
    request = KernelRequest(equations, tuple(batch.links), batch.rates, LANES, results=batch.results)
    request = request._replace(has_signs=has_signs, has_common_inputs=has_common_inputs)
    kernel = designs_kernel(request._replace(is_single=out.dtype == np.float32, counts_candidates=counts))
    start = common if kernel.request.has_common_inputs else None
    table = run_table(batch.input_offsets, start, extra_corrections)
    _, good, candidate_counts = _run_kernel(kernel, batch._replace(signs=signs), table, batch.unit, out)
    written = candidate_counts if counts else good.copy()
    # a failure that shows only at the next step condemns the step too
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
    out, _, _ = _run_kernel(kernel, batch, run_table(offsets, extra_corrections=EXTRA_CORRECTIONS), 1.0, None)
    rows = out[parts * steps, : len(kernel.state), np.arange(len(steps))].T
    return unknowns_from_state(kernel.state, rows, len(batch.z0))


def lead_designs(batch: DesignBatch, index: int, span: Array, step: float) -> tuple[Array, Array]:
    """Designs led on from where they start, their input `index` by its span (designs,), in steps of so much.

    The unknowns there (unknowns, designs), and which designs passed all checks on the way (designs,).
    """
    z, passed = batch.z0.copy(), np.zeros(len(span), dtype=bool)
    for length in np.unique(span[np.isfinite(span)]):
        designs = np.flatnonzero(span == length)
        offsets = np.zeros((ceil(abs(length) / step) + 2, len(batch.u0)))
        offsets[:, index] = np.linspace(0.0, length, len(offsets))
        part = batch.select(designs)._replace(input_offsets=offsets, links=(), q=batch.q[:0, designs], rates=False)
        good = run_designs(part, allocate_aligned(len(offsets), 0, len(designs)))
        passed[designs] = good == len(offsets)
        z[:, designs] = last_good_unknowns(part, good)
    return z, passed


def correct_designs(
    batch: DesignBatch, point_blocks: Sequence[int], corrections: int
) -> tuple[Array, Array, Array, Array, Array]:
    """Correct designs from unknowns near by, at the inputs where they start. Raises UnsupportedOperation.

    Return which designs converge, the regularity of the least regular block that Newton's method solves (the volume
    that the columns of its Jacobian span) (designs,), the unknowns (unknowns, designs), the points of the batch, and
    the same in the other assembly of their block, infinite where that is not known (points, 2, designs), in sizes.
    """
    kernel = designs_kernel(
        KernelRequest(batch_equations(batch), tuple(batch.links), False, LANES, tuple(point_blocks))
    )
    table = run_table(np.zeros((1, len(batch.u0))))
    table[:, CORRECTIONS_COLUMN] = corrections
    out, good, _ = _run_kernel(kernel, batch, table, 1.0, None)
    rows, places = out[0], 2 * len(batch.links)
    z = unknowns_from_state(kernel.state, rows[2 * places : -1], len(batch.z0))
    both = rows[: 2 * places].reshape(2, len(batch.links), 2, rows.shape[1])
    return good > 0, np.sqrt(np.maximum(rows[-1], 0.0)), z, *both


def _common_inputs(u0: Array) -> Array | None:
    """The inputs (inputs,) at which all designs start that start anywhere; None where they differ."""
    first = u0[:, 0]
    if (u0 == first[:, None]).all():
        return first
    lowest, highest = np.fmin.reduce(u0, axis=1), np.fmax.reduce(u0, axis=1)
    return lowest if np.array_equal(lowest, highest) else None


def _run_kernel(
    kernel: DesignsKernelLayout,
    batch: DesignBatch,
    table: Array,
    scale: float,
    out: Array | None,
) -> tuple[Array, Array, Array]:
    """The results of a kernel, with lengths times a scale: out, good, candidates."""
    request = kernel.request
    design_count, step_count, lanes = batch.p.shape[1], len(table), request.lanes
    function, no_rows = compile_function(kernel.ir, MARCH_FUNCTION, *MARCH_ARGUMENTS), np.zeros((0, design_count))
    rows = (
        batch.numbers,
        batch.q,
        batch.signs if request.has_signs and batch.signs is not None else operand_rows(kernel.state, batch.z0),
        no_rows if request.has_common_inputs else operand_rows(kernel.inputs, batch.u0),
        np.concatenate([batch.u1, batch.u2]) if request.rates else no_rows,
    )

    def call(rows: Sequence[Array], design_count: int, out: Array, counted: Array) -> None:
        arrays = [np.ascontiguousarray(row) for row in (*rows, table)]
        row_stride, step_stride = out.strides[1] // out.itemsize, out.strides[0] // out.itemsize
        sizes = design_count // lanes, step_count, rows[0].shape[1], row_stride, step_stride
        addresses = [array.ctypes.data for array in (*arrays, out, *counted)]
        with leave_turn(design_count * step_count >= LONG_CALL_POSITIONS):
            function(*sizes, *addresses[: len(arrays)], batch.tolerance, scale, *addresses[len(arrays) :])

    target = out
    dtype = np.dtype(np.float64) if out is None else out.dtype
    if out is None or not is_aligned(out):
        out = allocate_aligned(step_count, kernel.output_row_count, design_count, dtype)
    counted = np.zeros((2, -(-design_count // lanes) * lanes))
    in_full_blocks = design_count // lanes * lanes
    if in_full_blocks:
        call(rows, in_full_blocks, out, counted)
    if in_full_blocks < design_count:
        # those that do not fill the lanes, with copies of the last beside them
        columns = np.minimum(np.arange(in_full_blocks, in_full_blocks + lanes), design_count - 1)
        last_block = allocate_aligned(step_count, kernel.output_row_count, lanes, dtype)
        call([row[:, columns] for row in rows], lanes, last_block, counted[:, in_full_blocks:])
        out[:, :, in_full_blocks:] = last_block[:, :, : design_count - in_full_blocks]
    if target is not None and target is not out:
        target[...] = out
    good, candidates = counted[:, :design_count].astype(int)
    return out, good, candidates


def run_table(offsets: Array, start: Array | None = None, extra_corrections: int = 0) -> Array:
    """The `step_table` of offsets of the inputs (steps + 1, inputs), then how far each input has gone, with its cos and
    sin; or where it is, if all designs `start` (inputs,) at one position."""
    offsets = np.ascontiguousarray(offsets if start is None else offsets + start)
    table = _run_table(offsets.tobytes(), offsets.shape).copy()
    table[:, CORRECTIONS_COLUMN] += extra_corrections
    return table


@lru_cache(maxsize=64)
def _run_table(content: bytes, shape: tuple[int, int]) -> Array:
    """The table of offsets (steps + 1, inputs) as bytes: the blocks of a sweep have them in common."""
    offsets = np.frombuffer(content).reshape(shape)
    longest = longest_step(offsets)
    corrections = RUN_CORRECTIONS + sum(longest > step for step in COARSE_STEPS)
    inputs = np.stack([offsets, np.cos(offsets), np.sin(offsets)], axis=2).reshape(len(offsets), -1)
    table = np.hstack([step_table(len(offsets), longest, corrections, FIRST_RUN_CORRECTIONS), inputs])
    # a step that fails condemns the one before too, so the first full prediction need not be near
    table[PREDICTOR_ORDER : PREDICTOR_ORDER + 1, LIMIT_COLUMN] = inf
    return table
