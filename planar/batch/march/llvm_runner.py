"""Runs of many designs through the compiled function."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.kernel import KernelEquations
from planar.batch.march.llvm_designs import (
    ARGUMENT_TYPES,
    FUNCTION_NAME,
    PREDICTOR_ORDER,
    DesignsKernelLayout,
    write_designs_kernel,
)
from planar.codegen.aligned_arrays import allocate_aligned, is_aligned
from planar.codegen.instructions import UnsupportedOperation
from planar.codegen.llvm_compile import compile_function
from planar.equations.functions import EquationFunctions, equation_structure
from planar.model.mechanism import Mechanism

Array = np.ndarray

LANES = 16
"""Designs at once: two vectors of the widest machines, so that one waits while the other works."""
CORRECTIONS, FIRST_CORRECTIONS = 1, 6
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
CORRECTION_LIMIT, MAX_CORRECTION_LIMIT = 3e-3, 0.05
"""rad or sizes by which Newton's method may correct what was predicted for steps of the first of these, and at most."""
COARSE_STEPS = (0.04, 0.12)
"""rad or sizes: where the inputs go farther in a step, what is predicted takes one more of Newton's, and another."""
LONGEST_STEP = 0.5
"""rad or sizes: farther apart positions do not show whether a group comes to a dead point between them."""
PREDICTOR_WEIGHTS = ((1,), (1,), (2, -1), (3, -3, 1), (4, -6, 4, -1), (5, -10, 10, -5, 1), (6, -15, 20, -15, 6, -1))
"""Weights of the last steps in the next: the polynomial through them, continued; ahead of the first there is its
start."""


@lru_cache(maxsize=256)
def kernel_equations(program: EquationFunctions, mechanism: Mechanism) -> KernelEquations:
    """A structure ready to be printed. Raises UnsupportedOperation."""
    return KernelEquations(program.equations, mechanism)


def designs_kernel(
    program: EquationFunctions,
    mechanism: Mechanism,
    links: tuple[str, ...],
    rates: bool,
    point_blocks: tuple[int, ...] | None = None,
) -> DesignsKernelLayout:
    """The function for points on links of a structure, see `march`. Raises UnsupportedOperation."""
    found = _designs_kernel_or_reason(program, mechanism, links, rates, point_blocks)
    if isinstance(found, str):
        raise UnsupportedOperation(found)
    return found


@lru_cache(maxsize=256)
def _designs_kernel_or_reason(
    program: EquationFunctions,
    mechanism: Mechanism,
    links: tuple[str, ...],
    rates: bool,
    point_blocks: tuple[int, ...] | None,
) -> DesignsKernelLayout | str:
    """The same, or why there is none: every block of a sweep would find that out again."""
    try:
        return write_designs_kernel(kernel_equations(program, mechanism), links, rates, LANES, point_blocks)
    except UnsupportedOperation as why:
        return str(why)


class KernelArrays(NamedTuple):
    """What differs from design to design, lengths in sizes, each (rows, designs): p, the numbers of the pairs; q, the
    points' coordinates in their links; z, the unknowns where the run starts, closed; start, u1, u2, the inputs there
    and their rates."""

    p: Array
    q: Array
    z: Array
    u0: Array
    u1: Array
    u2: Array


def run_designs_kernel(
    program: EquationFunctions,
    mechanism: Mechanism,
    designs: KernelArrays,
    offsets: Array,
    links: Sequence[str],
    rates: bool,
    tolerance: float,
    extra_corrections: int = 0,
    scale: float = 1.0,
    out: Array | None = None,
) -> tuple[Array, Array]:
    """The places of points on links over a run of designs, and how many of its first steps every design did well.

    gone (steps, inputs): how far the inputs are from where they start at every step, the first none. `more` are further
    corrections at every step, for designs that are less well predicted. What is told is times `scale`.

    Returns (steps, rows, designs), in `out` if that is given: x and y of every point, then with `rates` all first and
    all second rates; and (designs,). Raises UnsupportedOperation where the structure is not for this backend.
    """
    longest = float(np.max(np.abs(np.diff(offsets, axis=0)), initial=0.0))
    if longest > LONGEST_STEP or len(offsets) == 2:
        raise UnsupportedOperation("steps so long do not show what lies between them")
    plan = designs_kernel(program, equation_structure(mechanism), tuple(links), rates)
    table, counts = _step_table(offsets)
    out, good = _run_kernel(
        plan, designs, rates, table, counts + extra_corrections, (tolerance, _correction_limit(longest), scale), out
    )
    # what is told of a step only at the next one condemns the step too
    return out, np.where((good > 1) & (good < len(offsets)), good - 1, good)


def unknowns_at_steps(
    program: EquationFunctions,
    mechanism: Mechanism,
    designs: KernelArrays,
    offsets: Array,
    tolerance: float,
    extra_corrections: int,
    steps: Array,
) -> Array:
    """The unknowns (unknowns, designs) of a run that came to these steps, at (designs,), of each design to one."""
    plan = designs_kernel(program, equation_structure(mechanism), (), False, ())
    table, counts = _step_table(offsets)
    astray = _correction_limit(float(np.max(np.abs(np.diff(offsets, axis=0)), initial=0.0)))
    found, _ = _run_kernel(plan, designs, False, table, counts + extra_corrections, (tolerance, astray, 1.0), None)
    return _unknowns_from_state(plan, found[steps, :, np.arange(len(steps))].T, len(designs.z))


class KernelAssemblies(NamedTuple):
    """Where designs are that were closed from near by: which are, and how regular the least regular is of the groups
    that Newton's method closed (the volume that the columns of its slope span), both (designs,); the unknowns
    (unknowns, designs); the points that were asked for, and the same in the other assembly of their group, infinite
    where that is not known (points, 2, designs)."""

    converged: Array
    regularity: Array
    z: Array
    points: Array
    other_points: Array


def correct_designs(
    program: EquationFunctions,
    mechanism: Mechanism,
    designs: KernelArrays,
    links: Sequence[str],
    point_blocks: Sequence[int],
    tolerance: float,
    corrections: int,
) -> KernelAssemblies:
    """Designs closed from unknowns near by, at the inputs where they start; points on `links` that these groups place.

    Raises UnsupportedOperation.
    """
    plan = designs_kernel(program, equation_structure(mechanism), tuple(links), False, tuple(point_blocks))
    gone = np.zeros((1, len(designs.u0)))
    table, counts = _step_table(gone)
    counts[:] = corrections
    out, good = _run_kernel(plan, designs, False, table, counts, (tolerance, np.inf, 1.0), None)
    rows, places = out[0], 2 * len(links)
    z = _unknowns_from_state(plan, rows[2 * places :], len(designs.z))
    both = rows[: 2 * places].reshape(2, len(links), 2, rows.shape[1])
    return KernelAssemblies(good > 0, np.sqrt(np.maximum(rows[-1], 0.0)), z, *both)


def _unknowns_from_state(kernel: DesignsKernelLayout, rows: Array, count: int) -> Array:
    """The unknowns (unknowns, designs) of a state (rows, designs)."""
    state = dict(zip(kernel.state, rows, strict=False))
    z = np.empty((count, rows.shape[1]))
    for k in range(count):
        z[k] = state["z", k] if ("z", k) in state else np.arctan2(state["zs", k], state["zc", k])
    return z


def _correction_limit(longest: float) -> float:
    return min(CORRECTION_LIMIT * max(1.0, longest / COARSE_STEPS[0]) ** 2, MAX_CORRECTION_LIMIT)


def _run_kernel(
    kernel: DesignsKernelLayout,
    designs: KernelArrays,
    rates: bool,
    table: Array,
    counts: Array,
    tolerances: tuple[float, float, float],
    out: Array | None,
) -> tuple[Array, Array]:
    function = compile_function(kernel.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
    many, steps, lanes = designs.p.shape[1], len(table), kernel.lanes
    rows = (
        designs.p,
        designs.q,
        _operand_rows(kernel.state, designs.z),
        _operand_rows(kernel.inputs, designs.u0),
        np.concatenate([designs.u1, designs.u2]) if rates else np.zeros((0, many)),
    )
    given = out
    if out is None or not is_aligned(out):
        out = allocate_aligned(steps, kernel.output_row_count, many)
    good = np.empty(-(-many // lanes) * lanes)
    whole = many // lanes * lanes
    if whole:
        _call_function(function, kernel, rows, whole, (table, counts), tolerances, out, good)
    if whole < many:
        # those that do not fill the lanes, with copies of the last beside them
        which = np.minimum(np.arange(whole, whole + lanes), many - 1)
        last = allocate_aligned(steps, kernel.output_row_count, lanes)
        _call_function(
            function, kernel, [row[:, which] for row in rows], lanes, (table, counts), tolerances, last, good[whole:]
        )
        out[:, :, whole:] = last[:, :, : many - whole]
    if given is not None and given is not out:
        given[...] = out
    return out, good[:many].astype(int)


def _call_function(
    function: Any,
    kernel: DesignsKernelLayout,
    rows: Sequence[Array],
    design_count: int,
    tables: tuple[Array, Array],
    tolerances: tuple[float, float, float],
    out: Array,
    good: Array,
) -> None:
    arrays = [np.ascontiguousarray(row) for row in (*rows, *tables)]
    width = rows[0].shape[1]
    strides = (out.strides[1] // out.itemsize, out.strides[0] // out.itemsize)
    function(
        design_count // kernel.lanes,
        len(tables[0]),
        width,
        *strides,
        *(each.ctypes.data for each in arrays),
        *tolerances,
        out.ctypes.data,
        good.ctypes.data,
    )


def _operand_rows(operands: Sequence[tuple[str, int]], values: Array) -> Array:
    """Cosines, sines and values of rows, as leaves say."""
    found = np.empty((len(operands), values.shape[1]))
    for row, (part, k) in zip(found, operands, strict=True):
        of = values[k]
        # designs mostly start at one input
        alike = of.size and of[0] == of[-1] and np.all(of == of[0])
        row[:] = {"c": np.cos, "s": np.sin}.get(part[1:], np.positive)(of[:1] if alike else of)
    return found


def _step_table(offsets: Array) -> tuple[Array, Array]:
    """What every step needs to know: the weights of the steps before, and how far each input has gone."""
    steps, inputs = offsets.shape
    table, counts = np.zeros((steps, PREDICTOR_ORDER + 3 * inputs)), np.full(steps, CORRECTIONS, dtype=np.int64)
    for step in range(min(steps, PREDICTOR_ORDER)):
        table[step, : len(PREDICTOR_WEIGHTS[step])] = PREDICTOR_WEIGHTS[step]
    table[PREDICTOR_ORDER:, :PREDICTOR_ORDER] = PREDICTOR_WEIGHTS[PREDICTOR_ORDER]
    longest = float(np.max(np.abs(np.diff(offsets, axis=0)), initial=0.0))
    counts[:] = CORRECTIONS + sum(longest > each for each in COARSE_STEPS)
    counts[: PREDICTOR_ORDER + 1] = FIRST_CORRECTIONS
    for k in range(inputs):
        table[:, PREDICTOR_ORDER + 3 * k : PREDICTOR_ORDER + 3 * k + 3] = np.stack(
            [offsets[:, k], np.cos(offsets[:, k]), np.sin(offsets[:, k])], axis=1
        )
    return table, counts
