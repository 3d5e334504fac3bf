"""How designs in closed form end that a march did not bring to the end, and the positions up to there."""

from __future__ import annotations

import numpy as np

from planar.batch.closed_form.choice import find_joiner
from planar.batch.closed_form.dead_points import find_dead_points
from planar.batch.closed_form.joined_blocks import BlockJoiner, unknowns_from_state
from planar.batch.dead_point_tracking import DEAD_POINT_MARGIN, FollowedDesigns
from planar.batch.march.backend import DesignBatch, DesignRunner
from planar.codegen.aligned_arrays import allocate_aligned
from planar.model.mechanism import links_counting_turns

Array = np.ndarray


def find_ends(
    batch: DesignBatch, index: int, good: Array, signs: Array, runner: DesignRunner, backend: str
) -> FollowedDesigns | None:
    """As `follow_to_dead_points`, of designs of which so many steps are good, one at least; None where a block is not
    in closed form. `index` is the input that runs; signs (blocks, designs) of the blocks' assemblies, 0 where that is
    not known."""
    joiner = None if links_counting_turns(batch.mechanism) else find_joiner(batch._replace(links=()), (), backend)
    if joiner is None:
        return None
    offsets, steps = batch.input_offsets[:, index], len(batch.input_offsets) - 1
    length = abs(float(offsets[-1]))
    direction = np.where(np.arange(len(batch.u0)) == index, np.sign(offsets[-1]), 0.0)
    unknown = np.flatnonzero(~signs.all(axis=0))
    signs[:, unknown] = joiner.equations.assembly_signs(*(rows[:, unknown] for rows in (batch.z0, batch.u0, batch.p)))
    step, count = np.full(len(good), length / steps), len(good)
    ends = find_dead_points(
        joiner, batch, signs, direction, np.abs(offsets)[good - 1], np.full(count, length), step
    ).distance
    nearest = np.clip(np.rint(ends / step), 0, steps) * step
    settled = ~np.isnan(ends) & (np.abs(ends - nearest) > DEAD_POINT_MARGIN * length)
    distances = np.abs(offsets)
    solved = np.where(settled, np.searchsorted(distances, np.minimum(ends, 2.0 * length)), 0)
    left = np.maximum(solved - good, 0)
    design = np.repeat(np.arange(count), left)
    at = good[design] + np.arange(len(design)) - np.repeat(np.cumsum(left) - left, left)
    out, passed = _solve_positions(joiner, batch.select(design), signs[:, design], direction, distances[at], runner)
    settled[design[~passed]] = False
    kept = settled[design]
    return FollowedDesigns(settled, np.where(settled, solved, 0), ends, design[kept], at[kept], out[:, kept])


def _solve_positions(
    joiner: BlockJoiner, batch: DesignBatch, signs: Array, direction: Array, distance: Array, runner: DesignRunner
) -> tuple[Array, Array]:
    """The points (rows, designs) so far from where designs start, and which pass the checks."""
    count = batch.p.shape[1]
    out = allocate_aligned(1, batch.output_row_count, count)
    if not count:
        return out[0], np.zeros(0, dtype=bool)
    u = batch.u0 + distance * direction[:, None]
    with np.errstate(all="ignore"):
        z = unknowns_from_state(joiner.state, joiner.follow(batch._replace(links=()), signs, u).state, len(batch.z0))
    offsets = np.zeros((1, len(u)))
    passed = runner.run(batch._replace(u0=u, z0=z, input_offsets=offsets), out) > 0
    return out[0], passed
