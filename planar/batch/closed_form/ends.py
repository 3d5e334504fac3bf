"""How designs in closed form end that a march did not bring to the end, and the positions up to there."""

from __future__ import annotations

import numpy as np

from planar.batch.closed_form.dead_points import DeadPoints, search_dead_points
from planar.batch.closed_form.joined_blocks import BlockJoiner, find_joiner
from planar.batch.dead_point_tracking import FollowedDesigns, solve_positions, solve_until_ends
from planar.batch.design_arrays import split_into_blocks
from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import unknowns_from_state
from planar.batch.march.stops import nearest_end
from planar.codegen.llvm_compile import allocate_aligned
from planar.model.mechanism import links_counting_turns
from planar.solving.continuation.predictor_corrector import SHOWN_SLIDE_EXTENT

Array = np.ndarray

LONGEST_STEP = 0.1
"""rad or sizes: no longer steps are looked at for what lies between."""
POSITIONS_AT_ONCE = 2**16
"""Positions that are solved at once, each with a copy of its design's numbers."""


class ClosedFormDesigns:
    """Designs of a batch whose blocks are all in closed form, in assemblies of known signs; input `index` runs."""

    def __init__(self, joiner: BlockJoiner, batch: DesignBatch, index: int, signs: Array):
        self.joiner, self.batch, self.index, self.signs = joiner, batch, index, signs
        self.direction = np.where(np.arange(len(batch.u0)) == index, 1.0, 0.0)

    def find_dead_points(self, reached: Array, lengths: Array, step: Array) -> DeadPoints:
        """The first dead points of designs that surely came so far, whose input is to go so far to either side, in
        steps of so much (designs,)."""
        batch, stops, sense = self.batch, self.batch.stops, np.sign(lengths)
        if stops is not None and stops.wide_ranges.any():
            batch = batch._replace(stops=stops.near_positions(self.stop_positions(sense * reached)))
        # links that carry other blocks may turn faster than the input
        longest = SEARCH_STEP if self.joiner.equations.carrying_angles else LONGEST_STEP
        ranges = (reached, np.abs(lengths), np.minimum(step, longest), sense)
        dead_points = search_dead_points(self.joiner.equations, self.index, batch, self.signs, ranges)
        if stops is None:
            return dead_points
        distance, stop = dead_points.distance, dead_points.block - len(self.signs)
        stopped = np.flatnonzero(np.isfinite(distance) & (stop >= 0))
        if stopped.size:  # the functions that tell where stops are may reach one elsewhere too
            positions = self.stop_positions(np.where(np.isfinite(distance), sense * distance, 0.0))[:, stopped]
            distance[stopped[~stops.select(stopped).is_at_stop(positions, stop[stopped])]] = np.nan
        rooms = stops.input_rooms(self.direction @ batch.u0, lengths)
        input_end = len(self.signs) + len(batch.stop_pairs)
        return DeadPoints(*nearest_end(*dead_points, rooms, np.abs(lengths), input_end))

    def is_stop(self, dead_points: DeadPoints) -> Array:
        """Whether a stop ends designs (designs,)."""
        return np.asarray(dead_points.block >= len(self.signs))

    def stop_positions(self, moved: Array) -> Array:
        """Where the pairs with stops are (stops, designs) when the input has moved so far (designs,)."""
        u = self.batch.u0 + moved * self.direction[:, None]
        return DesignEvaluation(self.batch).pair_positions(self.find_unknowns(self.batch, u), u)

    def lead(self, span: Array, step: float) -> tuple[Array, DeadPoints]:
        """Designs led on so far (designs,): the unknowns there (unknowns, designs), and what ends them before."""
        dead_points = self.find_dead_points(np.zeros(len(span)), span, np.full(len(span), step))
        dead_points = dead_points._replace(distance=np.where(span == 0.0, np.inf, dead_points.distance))
        u = self.batch.u0 + span * self.direction[:, None]
        return self.find_unknowns(self.batch, u), dead_points

    def find_unknowns(self, batch: DesignBatch, u: Array) -> Array:
        """z (unknowns, designs) of a batch of some of the designs at inputs u (inputs, designs)."""
        assert batch.signs is not None
        with np.errstate(all="ignore"):
            state = self.joiner.follow(batch, batch.signs, u)
        return unknowns_from_state(self.joiner.state, state, len(batch.z0))

    def solve_positions(self, design: Array, moved: Array) -> tuple[Array, Array]:
        """The points (rows, positions) of designs whose input has moved so far, and which pass the checks."""
        out, passed = np.empty((self.batch.output_row_count, len(design))), np.zeros(len(design), dtype=bool)
        for part in split_into_blocks(len(design), POSITIONS_AT_ONCE):
            batch = self.batch.select(design[part])
            u = batch.u0 + moved[part] * self.direction[:, None]
            # by their signs; the unknowns are computed for positions near where two assemblies meet
            rows, good = solve_positions(batch, u, np.full_like(batch.z0, np.nan))
            if not good.all():
                near, u = batch.select(~good), u[:, ~good]
                rows[:, ~good], good[~good] = solve_positions(near, u, self.find_unknowns(near, u))
            out[:, part], passed[part] = rows, good
        return out, passed


def closed_form_designs(batch: DesignBatch, index: int) -> ClosedFormDesigns | None:
    """Designs of a batch at their start, where `index` is the input that runs; None where a block has no closed form,
    or nothing is known of the signs of the assemblies."""
    if batch.signs is None or links_counting_turns(batch.mechanism):
        return None
    joiner = find_joiner(batch, None)
    return None if joiner is None else ClosedFormDesigns(joiner, batch, index, batch.signs)


def find_ends(
    designs: ClosedFormDesigns, lengths: Array, good: Array, candidates: Array, steps: int
) -> FollowedDesigns:
    """As `follow_to_dead_points`, of designs of which so many steps are good (designs,), none at first.

    lengths (designs,): how far the input is to go, rad or sizes, in so many steps. Of these so many `candidates`
    (designs,) need not be solved here, see `run_designs`.
    """
    step = np.abs(lengths) / steps
    dead_points = designs.find_dead_points(np.maximum(good - 1, 0) * step, lengths, step)

    def solve(design: Array, number: Array) -> tuple[Array, Array]:
        return designs.solve_positions(design, np.sign(lengths)[design] * number * step[design])

    is_stopped = designs.is_stop(dead_points)
    return solve_until_ends(dead_points.distance, is_stopped, step, steps, candidates, solve)


SEARCH_STEP = 0.03
"""rad or sizes of the first look on for a dead point."""
LEAST_RANGE = 1e-2
"""rad or sizes: a shorter range is left to be looked at by itself."""
DISTANCE_FROM_LIMIT = 1e-8
"""Parts of the range: so near to a limit the middle of the two assemblies that meet there is as near to it."""


def run_between_limits(designs: ClosedFormDesigns, steps: int) -> tuple[Array, Array]:
    """Run designs from the dead point or stop below to that above, in so many steps.

    Returns the limits of their inputs (2, designs), rad or sizes, NaN where they are not settled, and the points out
    (steps + 1, rows, designs), with no rates at dead points.
    """
    batch, count = designs.batch, designs.batch.p.shape[1]
    span, none = np.full(count, SHOWN_SLIDE_EXTENT), np.zeros(count)
    down, up = (designs.find_dead_points(none, sense * span, np.full(count, SEARCH_STEP)) for sense in (-1.0, 1.0))
    length = up.distance + down.distance
    settled = np.isfinite(length) & (length > LEAST_RANGE)
    out = allocate_aligned(steps + 1, batch.output_row_count, count)
    out[:] = np.nan
    limited = np.flatnonzero(settled)
    for step in range(1, steps):
        moved = length[limited] * (step / steps) - down.distance[limited]
        out[step][:, limited], passed = designs.solve_positions(limited, moved)
        settled[limited[~passed]] = False
    for step, sense, ends in ((0, -1.0, down), (steps, 1.0, up)):
        moved, is_stop = sense * ends.distance, designs.is_stop(ends)[limited]
        dead, stopped = limited[~is_stop], limited[is_stop]
        rows, passed = _points_at_limit(designs, dead, moved[dead], ends.block[dead], length[dead])
        out[step][: len(rows), dead] = rows
        settled[dead[~passed]] = False
        if stopped.size:
            out[step][:, stopped], passed = designs.solve_positions(stopped, moved[stopped])
            settled[stopped[~passed]] = False
    start = designs.direction @ batch.u0
    limits = np.stack([start - down.distance, start + up.distance])
    return np.where(settled, limits, np.nan), out


def _points_at_limit(
    designs: ClosedFormDesigns, design: Array, moved: Array, block: Array, length: Array
) -> tuple[Array, Array]:
    """The points (rows, designs) of some designs at a dead point, and which of them pass the residual check.

    There two assemblies of a block meet as a root does: their middle goes straight on to it.
    """
    signs = np.take(designs.signs, design, axis=1)
    other_signs = signs.copy()
    other_signs[block, np.arange(len(design))] *= -1.0
    batch, joiner = designs.batch.select(design)._replace(rates=False), designs.joiner

    def middle(part: float) -> Array:
        u = batch.u0 + (moved - np.sign(moved) * part * length) * designs.direction[:, None]
        return np.asarray(0.5 * (joiner.follow(batch, signs, u) + joiner.follow(batch, other_signs, u)))

    rows = np.empty((2 * len(batch.links), len(design)))
    with np.errstate(all="ignore"):  # the Jacobian is singular there
        state = 2.0 * middle(DISTANCE_FROM_LIMIT) - middle(2.0 * DISTANCE_FROM_LIMIT)
        z = unknowns_from_state(joiner.state, state, len(batch.z0)).T
        evaluation = DesignEvaluation(batch)
        positions = evaluation.positions(z, batch.u0 + moved * designs.direction[:, None])
        passed = evaluation.is_closed(positions)
        evaluation.write_points(rows, positions)
    return rows, passed
