"""Designs in closed form whose input runs between two dead points or stops, those of each design its own."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.closed_form.ends import ClosedFormDesigns
from planar.batch.march.checks import (
    DesignFunctions,
    DesignsAtStep,
    PointWriter,
    find_sensitivities,
    make_residual_check,
)
from planar.batch.march.kernel import unknowns_from_state
from planar.codegen.aligned_arrays import allocate_aligned
from planar.solving.continuation.predictor_corrector import SHOWN_SLIDE_EXTENT

Array = np.ndarray

SEARCH_STEP = 0.03
"""rad or sizes of the first look on for a dead point."""
LEAST_RANGE = 1e-2
"""rad or sizes: a shorter range is left to be looked at by itself."""
DISTANCE_FROM_LIMIT = 1e-8
"""Parts of the range: so near to a limit the middle of the two assemblies that meet there is as near to it."""


class LimitedRuns(NamedTuple):
    """Which designs are settled (designs,), the limits of their inputs (2, designs), rad or sizes, and the points out
    (steps + 1, rows, designs), with no rates at dead points."""

    is_settled: Array
    limits: Array
    out: Array


def run_between_limits(designs: ClosedFormDesigns, steps: int) -> LimitedRuns:
    """Run designs from the dead point or stop below to that above, in so many steps."""
    batch, count = designs.batch, designs.batch.p.shape[1]
    span, none = np.full(count, SHOWN_SLIDE_EXTENT), np.zeros(count)
    down, up = (designs.find_dead_points(none, sense * span, np.full(count, SEARCH_STEP)) for sense in (-1.0, 1.0))
    length = up.distance + down.distance
    settled = np.isfinite(length) & (length > LEAST_RANGE)
    out = allocate_aligned(steps + 1, batch.output_row_count, count)
    out[:] = np.nan
    some = np.flatnonzero(settled)
    for step in range(1, steps):
        moved = length[some] * (step / steps) - down.distance[some]
        out[step][:, some], passed = designs.solve_positions(some, moved)
        settled[some[~passed]] = False
    for step, sense, found in ((0, -1.0, down), (steps, 1.0, up)):
        moved, is_stop = sense * found.distance, found.block[some] >= len(designs.signs)
        dead, stopped = some[~is_stop], some[is_stop]
        rows, passed = _points_at_limit(designs, dead, moved[dead], found.block[dead], length[dead])
        out[step][: len(rows), dead] = rows
        settled[dead[~passed]] = False
        if stopped.size:
            out[step][:, stopped], passed = designs.solve_positions(stopped, moved[stopped])
            settled[stopped[~passed]] = False
    start = designs.direction @ batch.u0
    limits = np.stack([start - down.distance, start + up.distance])
    return LimitedRuns(settled, np.where(settled, limits, np.nan), out)


def _points_at_limit(
    designs: ClosedFormDesigns, some: Array, moved: Array, block: Array, length: Array
) -> tuple[Array, Array]:
    """The points (rows, designs) of some designs at a dead point, and which of them pass the residual check.

    There two assemblies of a block meet as a root does: their middle goes straight on to it.
    """
    signs = np.take(designs.signs, some, axis=1)
    other, columns = signs.copy(), np.arange(len(some))
    other[block, columns] *= -1.0
    batch = designs.batch.select(some)

    def middle(part: float) -> Array:
        u = batch.u0 + (moved - np.sign(moved) * part * length) * designs.direction[:, None]
        return np.asarray(0.5 * (designs.follow(batch, signs, u) + designs.follow(batch, other, u)))

    state = 2.0 * middle(DISTANCE_FROM_LIMIT) - middle(2.0 * DISTANCE_FROM_LIMIT)
    z = unknowns_from_state(designs.joiner.state, state, len(batch.z0)).T
    u, functions = batch.u0 + moved * designs.direction[:, None], DesignFunctions(batch.functions, batch.p)
    w, own = functions.coordinates(z, u.T), batch._replace(rates=False)
    passed = make_residual_check(own).worst_residual(w, u) <= batch.tolerance
    rows = np.empty((2 * len(batch.links), len(some)))
    with np.errstate(all="ignore"):  # the Jacobian is singular there
        PointWriter(own, functions).write(rows, DesignsAtStep(z, u, w, passed, find_sensitivities(functions, z, u.T)))
    return rows, passed
