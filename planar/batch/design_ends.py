"""Where the designs of a block end, at dead points and stops: by closed forms, or along the curves of positions."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.batch.closed_form.dead_points import search_dead_points
from planar.batch.closed_form.joined_blocks import BlockJoiner, find_joiner
from planar.batch.design_arrays import split_into_blocks
from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import unknowns_from_state
from planar.batch.march.runs import last_good_unknowns, run_designs
from planar.batch.march.stops import (
    LEAST_RANGES,
    SAME_END,
    SURE_DISTANCE,
    TURN,
    StopLimits,
    are_periodic,
    nearest_end,
    stop_limits,
)
from planar.batch.reference_design import ReferenceDesign, stack_rows
from planar.codegen.llvm_compile import allocate_aligned
from planar.equations.linear import solve_vectors
from planar.foundation.arrays import BoolArray, IntArray
from planar.model.mechanism import Mechanism, links_counting_turns
from planar.model.pairs import MeasureKind, Pair
from planar.solving.checks import DIFFERENCE_STEP, column_norms, singular_distance
from planar.solving.continuation.predictor_corrector import (
    FIRST_STEP,
    LONGEST_STEP,
    SHOWN_SLIDE_EXTENT,
    STEP_GROWTH,
    first_step,
    is_step_sound,
)
from planar.solving.continuation.solution_curve import CLOSED_TOLERANCE, MIN_COLUMN_NORM
from planar.solving.stops import STOP_TOLERANCE

Array = np.ndarray

STEPS_BEYOND_STOP = 3
"""Steps beyond the stop of an input that are computed to judge how the input reaches it."""
DEAD_POINT_MARGIN = 1e-8
"""Parts of the run: a step that is so near to a dead point is not judged here."""
LONGEST_SEARCH_STEP, SEARCH_STEP = 0.1, 0.03
"""rad or sizes: the longest step of a search for ends, and of one between limits or of links that may turn fast."""
MAX_POSITIONS = 2**16
"""Positions that are solved at once, each with a copy of its design's numbers."""
LEAST_RANGE = 1e-2
"""rad or sizes: the general path takes shorter ranges between limits."""
DISTANCE_FROM_LIMIT = 1e-8
"""Parts of the range: so near to a limit the middle of the two assemblies that meet there is as near to it."""
SHORTEST_STEP = 1e-6
"""Arc length (rad, sizes): a curve that asks for shorter steps is not followed."""
CROSSING_DISTANCE = 0.01
"""A design so near to where branches cross is not followed."""
MAX_ARCS = 120
MAX_HALVINGS = 60
ZERO_TOLERANCE = 1e-9
"""rad, sizes or a rate by which a zero on an arc may be missed."""
PLACES_ON_ARC = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Parts of an arc at which the distances of pairs from their stops are computed."""
PASSES, DEAD_POINT, STOP = range(3)
"""What an arc does: it goes on; it ends its design at a dead point, or at the stop of a pair."""


def stop_ranges(reference: ReferenceDesign, designs: Mechanism, count: int) -> tuple[list[Pair], Array, Array, Array]:
    """The pairs with stops, which of them are angles that do not count turns (stops,), and between which positions they
    can go (stops, designs), in sizes and rad; infinite where open, of such angles a turn on."""
    low = stack_rows([-np.inf if stops.low is None else stops.low for stops in designs.stops], count)
    high = stack_rows([np.inf if stops.high is None else stops.high for stops in designs.stops], count)
    pairs = [reference.motions[stops.pair] for stops in designs.stops]
    periodic = np.array(are_periodic(pairs, reference.mechanism), dtype=bool)
    scale = np.array([reference.unit if pair.input_kind is MeasureKind.LENGTH else 1.0 for pair in pairs])
    low, high = low / scale[:, None], high / scale[:, None]
    low, high = (
        np.where(periodic[:, None] & np.isinf(low), high - TURN, low),
        np.where(periodic[:, None] & np.isinf(high), low + TURN, high),
    )
    return pairs, periodic, low, high


def watch_stops(
    reference: ReferenceDesign, designs: Mechanism, batch: DesignBatch, u: Array
) -> tuple[StopLimits, BoolArray, BoolArray]:
    """The stops of designs at their own inputs u (inputs, designs), in the assemblies z0 of a batch.

    Returns the limits of pairs that are not inputs, and of the input that runs; the designs whose stops a march can
    watch, which start inside all of them (designs,); and the designs that surely start beyond a stop (designs,).
    """
    count, inputs = u.shape[1], [driven.pair for driven in reference.mechanism.inputs]
    pairs, periodic, low, high = stop_ranges(reference, designs, count)
    is_fit, is_outside = np.all(low < high, axis=0), np.zeros(count, dtype=bool)
    running_range, others = (np.full(count, -np.inf), np.full(count, np.inf)), []
    for k, pair in enumerate(pairs):
        if pair.name not in inputs:
            others.append(k)
            width = high[k] - low[k]
            is_fit &= width >= LEAST_RANGES[0 if periodic[k] else 1]
            if periodic[k]:  # a wider range asks how many turns there were
                is_fit &= width <= TURN + SURE_DISTANCE
            continue
        index = inputs.index(pair.name)
        if periodic[k]:  # the stops at the input's own turn, as `PairStops.turns` defines it
            below = np.ceil((low[k] - STOP_TOLERANCE - u[index]) / TURN)
            above = np.ceil((u[index] - high[k] - STOP_TOLERANCE) / TURN)
            turns = TURN * np.where(below > 0.0, below, np.where(above > 0.0, -above, 0.0))
            low[k], high[k] = low[k] - turns, high[k] - turns
        room = np.minimum(u[index] - low[k], high[k] - u[index])
        is_outside |= is_fit & (room < -SURE_DISTANCE)
        is_fit &= room >= -SAME_END
        if index == reference.running_index:
            running_range = low[k], high[k]
    other_pairs = [pairs[k] for k in others]
    limits = stop_limits(other_pairs, periodic[others].tolist(), low[others], high[others], running_range)
    if other_pairs:
        placed = np.flatnonzero(np.isfinite(batch.z0).all(axis=0) & np.isfinite(u).all(axis=0))
        batch = batch._replace(stops=limits).select(placed)
        positions = DesignEvaluation(batch).pair_positions(batch.z0, u[:, placed])
        rooms = limits.select(placed).find_rooms(positions).min(axis=0)
        is_outside[placed] |= is_fit[placed] & (rooms < -SURE_DISTANCE)
        is_fit[placed] &= rooms > SURE_DISTANCE
    return limits, is_fit, is_outside


def find_input_stops(march: DesignBatch, index: int, lengths: Array) -> tuple[Array, Array, BoolArray]:
    """Where the running input `index` meets a stop of its own in a march of these lengths, of either sign (designs,).

    Returns the distances of the stops (rad or sizes), how many steps are solved up to there, a step at the stop itself
    among them, and whether that is clear, each (designs,).
    """
    assert march.stops is not None
    distances = np.abs(march.input_offsets[:, index])
    rooms, last = march.stops.input_rooms(march.u0[index], lengths), distances[-1]
    ends = rooms < last - SAME_END
    solved = np.where(ends, np.maximum(np.searchsorted(distances, rooms + SAME_END), 1), len(distances))
    off = np.array([np.abs(distances[np.clip(solved - k, 0, len(distances) - 1)] - rooms) for k in (0, 1)])
    unclear = ends & ((off > SAME_END) & (off < SURE_DISTANCE * max(last, 1.0))).any(axis=0)
    return rooms, solved, ~unclear


class FirstEnds(NamedTuple):
    """The first dead point or stop of designs, each (designs,): its distance from where they start (rad or sizes),
    infinite if there is none in the range and NaN if that is not decided; whether it is a stop; and the block that is
    at its dead point (of stops and designs without an end any number)."""

    distance: Array
    is_stopped: BoolArray
    block: IntArray


class FollowedDesigns(NamedTuple):
    """The positions of designs up to their ends.

    Each (designs,): which designs are settled, the number of solved steps, and of their ends the `distance` and
    `is_stopped`, see `FirstEnds`. Of the solved steps: design and step (solved,), and the points out (rows, solved).
    """

    is_settled: BoolArray
    solved_steps: IntArray
    distance: Array
    is_stopped: BoolArray
    design: IntArray
    step: IntArray
    out: Array


StepSolver = Callable[[IntArray, IntArray], tuple[Array, BoolArray]]
"""Returns the points (rows, solved) of designs at steps (solved,), and which of them pass the checks."""


def solve_until_ends(
    distance: Array, is_stopped: BoolArray, step: Array, step_count: int, first: IntArray, solve: StepSolver
) -> FollowedDesigns:
    """Solve the steps of designs from `first` (designs,) on that come before their ends, see `FirstEnds`.

    `step` is the length of a step, rad or sizes (designs,). A design whose end is so near to a step that it is not
    clear which comes first is not settled.
    """
    nearest = np.clip(np.rint(distance / step), 0, step_count) * step
    settled = ~np.isnan(distance) & (np.abs(distance - nearest) > DEAD_POINT_MARGIN * step_count * step)
    solved = np.where(settled, np.ceil(np.minimum(distance / step, step_count + 1.0)), 0.0).astype(int)
    count = np.maximum(solved - first, 0)
    design = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(design)) + np.repeat(first - np.cumsum(count) + count, count)
    out, passed = solve(design, number)
    settled[design[~passed]] = False
    solved[~settled] = 0
    if not passed.all():
        design, number, out = (rows[..., settled[design]] for rows in (design, number, out))
    return FollowedDesigns(settled, solved, distance, is_stopped, design, number, out)


def solve_positions(batch: DesignBatch, u: Array, z: Array) -> tuple[Array, BoolArray]:
    """The points (rows, designs) of a batch at inputs u (inputs, designs) before any end, by nearby unknowns z
    (unknowns, designs) or by the batch's signs, and which of them pass the checks."""
    batch = batch if batch.stops is None else batch._replace(stops=batch.stops.cleared())
    out = allocate_aligned(1, batch.output_row_count, u.shape[1])
    return out[0], run_designs(batch._replace(u0=u, z0=z, input_offsets=np.zeros((1, len(u)))), out) > 0


class ClosedFormDesigns:
    """Designs of a batch whose blocks all have closed forms, in assemblies of known signs; input `index` runs."""

    def __init__(self, joiner: BlockJoiner, batch: DesignBatch, index: int, signs: Array):
        self.joiner, self.batch, self.index, self.signs = joiner, batch, index, signs
        self.direction = np.where(np.arange(len(batch.u0)) == index, 1.0, 0.0)

    def find_ends(self, reached: Array, lengths: Array, step: Array) -> FirstEnds:
        """The first ends of designs that surely came as far as `reached`, whose input is to go by `lengths`, of either
        sign, in steps of a length (designs,)."""
        batch, stops, sense = self.batch, self.batch.stops, np.sign(lengths)
        if stops is not None and stops.wide_ranges.any():
            batch = batch._replace(stops=stops.near_positions(self.stop_positions(sense * reached)))
        # links that carry other blocks may turn faster than the input
        longest = SEARCH_STEP if self.joiner.equations.carrying_angles else LONGEST_SEARCH_STEP
        ranges = (reached, np.abs(lengths), np.minimum(step, longest), sense)
        distance, block = search_dead_points(self.joiner.equations, self.index, batch, self.signs, ranges)
        is_stopped = block >= len(self.signs)
        if stops is None:
            return FirstEnds(distance, is_stopped, block)
        stopped = np.flatnonzero(np.isfinite(distance) & is_stopped)
        if stopped.size:  # the functions of stops may reach one elsewhere too
            positions = self.stop_positions(np.where(np.isfinite(distance), sense * distance, 0.0))[:, stopped]
            is_there = stops.select(stopped).is_at_stop(positions, block[stopped] - len(self.signs))
            distance[stopped[~is_there]] = np.nan
        rooms = stops.input_rooms(self.direction @ batch.u0, lengths)
        return FirstEnds(*nearest_end(distance, is_stopped, rooms, np.abs(lengths)), block)

    def stop_positions(self, moved: Array) -> Array:
        """The positions of the pairs with stops (stops, designs) after the input has moved by `moved` (designs,)."""
        u = self.batch.u0 + moved * self.direction[:, None]
        return DesignEvaluation(self.batch).pair_positions(self.find_unknowns(self.batch, u), u)

    def lead(self, span: Array, step: float) -> tuple[Array, FirstEnds]:
        """Lead designs on by `span` (designs,): the unknowns (unknowns, designs), and the ends that come before."""
        ends = self.find_ends(np.zeros(len(span)), span, np.full(len(span), step))
        ends = ends._replace(distance=np.where(span == 0.0, np.inf, ends.distance))
        return self.find_unknowns(self.batch, self.batch.u0 + span * self.direction[:, None]), ends

    def find_unknowns(self, batch: DesignBatch, u: Array) -> Array:
        """z (unknowns, designs) of a batch of some of the designs at inputs u (inputs, designs)."""
        assert batch.signs is not None
        with np.errstate(all="ignore"):
            state = self.joiner.follow(batch, batch.signs, u)
        return unknowns_from_state(self.joiner.state, state, len(batch.z0))

    def solve_positions(self, design: IntArray, moved: Array) -> tuple[Array, BoolArray]:
        """The points (rows, positions) of designs whose input has moved by `moved`, and which pass the checks."""
        out, passed = np.empty((self.batch.output_row_count, len(design))), np.zeros(len(design), dtype=bool)
        for part in split_into_blocks(len(design), MAX_POSITIONS):
            batch = self.batch.select(design[part])
            u = batch.u0 + moved[part] * self.direction[:, None]
            # by their signs; the unknowns are computed for positions near where two assemblies meet
            rows, good = solve_positions(batch, u, np.full_like(batch.z0, np.nan))
            if not good.all():
                near, u = batch.select(~good), u[:, ~good]
                rows[:, ~good], good[~good] = solve_positions(near, u, self.find_unknowns(near, u))
            out[:, part], passed[part] = rows, good
        return out, passed

    def follow_to_ends(self, lengths: Array, good: IntArray, candidates: IntArray, steps: int) -> FollowedDesigns:
        """Follow designs whose first `good` steps are solved (designs,), none at first, to their ends.

        lengths (designs,): how far the input is to go in `steps`, rad or sizes. The first `candidates` (designs,) of
        the steps are not solved here, see `run_designs`.
        """
        step = np.abs(lengths) / steps
        ends = self.find_ends(np.maximum(good - 1, 0) * step, lengths, step)

        def solve(design: IntArray, number: IntArray) -> tuple[Array, BoolArray]:
            return self.solve_positions(design, (lengths / steps)[design] * number)

        return solve_until_ends(ends.distance, ends.is_stopped, step, steps, candidates, solve)

    def run_between_limits(self, steps: int) -> tuple[Array, Array]:
        """Run designs from the dead point or stop below to that above, in `steps`.

        Returns the limits of their inputs (2, designs), rad or sizes, NaN if they are not settled, and the points out
        (steps + 1, rows, designs), with no rates at dead points.
        """
        batch, count = self.batch, self.batch.p.shape[1]
        span, none = np.full(count, SHOWN_SLIDE_EXTENT), np.zeros(count)
        down, up = (self.find_ends(none, sense * span, np.full(count, SEARCH_STEP)) for sense in (-1.0, 1.0))
        length = up.distance + down.distance
        settled = np.isfinite(length) & (length > LEAST_RANGE)
        out = allocate_aligned(steps + 1, batch.output_row_count, count)
        out[:] = np.nan
        limited = np.flatnonzero(settled)
        for step in range(1, steps):
            moved = length[limited] * (step / steps) - down.distance[limited]
            out[step][:, limited], passed = self.solve_positions(limited, moved)
            settled[limited[~passed]] = False
        for step, sense, ends in ((0, -1.0, down), (steps, 1.0, up)):
            moved, is_stopped = sense * ends.distance, ends.is_stopped[limited]
            dead, stopped = limited[~is_stopped], limited[is_stopped]
            rows, passed = self._points_at_limit(dead, moved[dead], ends.block[dead], length[dead])
            out[step][: len(rows), dead] = rows
            settled[dead[~passed]] = False
            if stopped.size:
                out[step][:, stopped], passed = self.solve_positions(stopped, moved[stopped])
                settled[stopped[~passed]] = False
        start = self.direction @ batch.u0
        limits = np.stack([start - down.distance, start + up.distance])
        return np.where(settled, limits, np.nan), out

    def _points_at_limit(
        self, design: IntArray, moved: Array, block: IntArray, length: Array
    ) -> tuple[Array, BoolArray]:
        """The points (rows, designs) of some designs at a dead point, and which of them pass the residual check.

        Two assemblies of a block meet there as a root does: their middle goes straight on to it.
        """
        signs = np.take(self.signs, design, axis=1)
        other_signs = signs.copy()
        other_signs[block, np.arange(len(design))] *= -1.0
        batch, joiner = self.batch.select(design)._replace(rates=False), self.joiner

        def middle(part: float) -> Array:
            u = batch.u0 + (moved - np.sign(moved) * part * length) * self.direction[:, None]
            return np.asarray(0.5 * (joiner.follow(batch, signs, u) + joiner.follow(batch, other_signs, u)))

        rows = np.empty((2 * len(batch.links), len(design)))
        with np.errstate(all="ignore"):  # the Jacobian is singular there
            state = 2.0 * middle(DISTANCE_FROM_LIMIT) - middle(2.0 * DISTANCE_FROM_LIMIT)
            z = unknowns_from_state(joiner.state, state, len(batch.z0)).T
            evaluation = DesignEvaluation(batch)
            positions = evaluation.positions(z, batch.u0 + moved * self.direction[:, None])
            passed = evaluation.is_closed(positions)
            evaluation.write_points(rows, positions)
        return rows, passed


def closed_form_designs(batch: DesignBatch, index: int) -> ClosedFormDesigns | None:
    """Designs of a batch at their start, where `index` is the input that runs; None where a block has no closed form,
    or nothing is known of the signs of the assemblies."""
    if batch.signs is None or links_counting_turns(batch.mechanism):
        return None
    joiner = find_joiner(batch, None)
    return None if joiner is None else ClosedFormDesigns(joiner, batch, index, batch.signs)


class _CurvePoints(NamedTuple):
    """Points of the curves y = (unknowns, place of the inputs), (designs, n + 1), tangents, bends, how far clear."""

    y: Array
    tangent: Array
    curvature: Array
    regular_distance: Array

    def select(self, designs: Array) -> _CurvePoints:
        return _CurvePoints(*(part[designs] for part in self))


class _CurveArcs(NamedTuple):
    """Arcs of the curves: the design, both ends with their tangents, and what the arc does."""

    design: Array
    y0: Array
    t0: Array
    y1: Array
    t1: Array
    end: Array

    def select(self, arcs: Array) -> _CurveArcs:
        return _CurveArcs(*(part[arcs] for part in self))

    def interpolate(self, x: Array) -> Array:
        """Near the arc, at parts x of the chord: Hermite's cubic."""
        x = x[:, None]
        chord = np.linalg.norm(self.y1 - self.y0, axis=1)[:, None]
        a, b = (1 + 2 * x) * (1 - x) ** 2, x * x * (3 - 2 * x)
        return a * self.y0 + b * self.y1 + chord * (x * (1 - x) ** 2 * self.t0 + x * x * (x - 1) * self.t1)


class _DesignCurves:
    """The curves of some designs; `SolutionCurve` in `solving` is that of one."""

    def __init__(self, batch: DesignBatch, design: Array, direction: Array):
        self.evaluation = DesignEvaluation(batch.select(design))
        self.start, self.direction = batch.u0.T[design], direction

    def inputs(self, y: Array) -> Array:
        return self.start + y[:, -1:] * self.direction

    def jacobians(self, y: Array) -> Array:
        dz, du = self.evaluation.jacobians(y[:, :-1], self.inputs(y))
        return np.concatenate([dz, (du @ self.direction)[..., None]], axis=2)

    def correct(self, y: Array, normal: Array) -> tuple[Array, Array]:
        """The points near y in the planes with these normals, and for which of them Newton's method converged."""
        gap = np.full(len(y), np.inf)
        for _ in range(6):
            arguments = np.hstack([y[:, :-1], self.inputs(y)])
            rates = self.evaluation.kinematics(arguments, 0.0 * arguments, 0.0 * arguments)
            gap = np.max(np.abs(rates.F), axis=1, initial=0.0)
            if np.all(gap <= 1e-15):
                break
            jacobian = np.concatenate([rates.jacobian, (rates.input_jacobian @ self.direction)[..., None]], axis=2)
            y = y + _solve_bordered(jacobian, normal, -rates.F, 0.0)
        return y, gap <= CLOSED_TOLERANCE

    def tangents(self, jacobian: Array, towards: Array) -> Array:
        """The tangents towards (designs, n + 1) where the Jacobian is this."""
        tangent = _solve_bordered(jacobian, towards, np.zeros(jacobian.shape[:2]), 1.0)
        return np.asarray(tangent / np.linalg.norm(tangent, axis=1, keepdims=True))

    def evaluate(self, y: Array, towards: Array) -> _CurvePoints:
        """The points at y, with tangents towards."""
        jacobian = self.jacobians(y)
        tangent = self.tangents(jacobian, towards)
        rates = np.hstack([tangent[:, :-1], tangent[:, -1:] * self.direction])
        second = self.evaluation.kinematics(np.hstack([y[:, :-1], self.inputs(y)]), rates, 0.0 * rates).F2
        curvature = _solve_bordered(jacobian, tangent, -second, 0.0)
        sizes = column_norms(jacobian, MIN_COLUMN_NORM)[:, None]
        difference = (self.jacobians(y + DIFFERENCE_STEP * tangent) - jacobian) / sizes
        change = np.linalg.norm(difference, axis=(1, 2)) / DIFFERENCE_STEP
        least = np.linalg.svd(np.nan_to_num(jacobian / sizes), compute_uv=False).min(axis=1, initial=np.inf)
        return _CurvePoints(y, tangent, curvature, singular_distance(least, change))


def _solve_bordered(jacobians: Array, normal: Array, right: Array, last: float) -> Array:
    """x with Jacobian x = right and normal x = last, for each design; not numbers where that is singular."""
    bordered = np.concatenate([jacobians, normal[:, None]], axis=1)
    right = np.concatenate([right, np.full((len(right), 1), last)], axis=1)
    return solve_vectors(bordered, right, least_determinant=1e-12)


def follow_to_dead_points(batch: DesignBatch, index: int, good_steps: Array) -> FollowedDesigns:
    """Go on from the last of the good steps of each design, one at least.

    Each step is under the conditions of `solving.continuation.predictor_corrector`; a design that does not keep them is
    not settled. `index` is the input that runs.
    """
    with np.errstate(all="ignore"):  # what leads astray ends as what is no number
        return _DeadPointTracker(batch, index, good_steps).follow(last_good_unknowns(batch, good_steps).T)


class _DeadPointTracker:
    def __init__(self, batch: DesignBatch, index: int, good_steps: Array):
        self.batch, self.good_steps, self.design_count = batch, good_steps, len(good_steps)
        length = float(batch.input_offsets[-1, index])
        self.direction = np.where(np.arange(len(batch.u0)) == index, np.sign(length), 0.0)
        self.length, self.step_count = abs(length), len(batch.input_offsets) - 1
        self.is_settled = np.zeros(self.design_count, dtype=bool)
        self.distance = np.full(self.design_count, np.inf)
        "of the dead point, or of the stop, from the start"
        self.is_stopped = np.zeros(self.design_count, dtype=bool)
        self.input_rooms = np.full(self.design_count, np.inf)
        if batch.stops is not None:
            self.input_rooms = batch.stops.input_rooms(batch.u0[index], np.full(self.design_count, length))
        self.turns = np.zeros((len(batch.stop_pairs), self.design_count))
        "rad to add to the positions of pairs with stops, so that they lie between these"

    def follow(self, z: Array) -> FollowedDesigns:
        """See `follow_to_dead_points`; z (designs, unknowns) at the last good steps."""
        arcs = _CurveArcs(*(np.concatenate(parts) for parts in zip(*self._track(z), strict=True)))
        self._end_arcs(arcs)
        # designs whose input meets a stop of its own before anything else end there
        distance, is_stopped = nearest_end(self.distance, self.is_stopped, self.input_rooms, self.length)
        distance[~self.is_settled] = np.nan
        # the arcs in the order of designs, and of each as the input goes on
        arcs = arcs.select(np.lexsort((arcs.y0[:, -1], arcs.design)))
        step = np.full(self.design_count, self.length / self.step_count)

        def solve(design: Array, number: Array) -> tuple[Array, Array]:
            if not len(design):
                return np.empty((self.batch.output_row_count, 0)), np.zeros(0, dtype=bool)
            place, width = number * step[design], 2.0 * self.length
            arc = np.searchsorted(arcs.design * width + arcs.y0[:, -1], design * width + place, side="right") - 1
            part = arcs.select(np.maximum(arc, 0))
            y, fine = self._find_falling_zero(part, lambda y: place - y[:, -1])
            batch = self.batch.select(design)
            out, passed = solve_positions(batch, batch.u0 + place * self.direction[:, None], y[:, :-1].T)
            return out, passed & fine & (part.design == design)

        return solve_until_ends(distance, is_stopped, step, self.step_count, self.good_steps, solve)

    def _track(self, z: Array) -> list[_CurveArcs]:
        """The arcs of the designs from their last good steps to where something ends them."""
        none = np.zeros((0, z.shape[1] + 1))
        sound_arcs = [_CurveArcs(np.zeros(0, dtype=int), none, none, none, none, np.zeros(0, dtype=int))]
        active = np.flatnonzero(np.all(np.isfinite(z), axis=1))
        start = (self.good_steps[active] - 1) * (self.length / self.step_count)
        y = np.hstack([z[active], start[:, None]])
        curves = _DesignCurves(self.batch, active, self.direction)
        if self.turns.size and self.batch.stops is not None:
            positions = curves.evaluation.pair_positions(y[:, :-1].T, curves.inputs(y).T)
            self.turns[:, active] = self.batch.stops.select(active).turns_between(positions)
        towards = np.zeros_like(y)
        towards[:, -1] = 1.0
        points, step = curves.evaluate(y, towards), np.full(len(active), FIRST_STEP)
        for _ in range(MAX_ARCS):
            going = (points.regular_distance > CROSSING_DISTANCE) & (step > SHORTEST_STEP) & ~self.is_settled[active]
            going &= np.isfinite(points.curvature).all(axis=1) & (np.abs(points.y).max(axis=1) < 1e3)
            if not going.all():
                points, step, active = points.select(going), step[going], active[going]
                if not active.size:
                    break
                curves = _DesignCurves(self.batch, active, self.direction)
            bend = np.linalg.norm(points.curvature, axis=1)
            step = first_step(np.minimum(step, LONGEST_STEP), points.regular_distance, bend)
            predicted = points.y + step[:, None] * points.tangent + 0.5 * step[:, None] ** 2 * points.curvature
            y, fine = curves.correct(predicted, points.tangent)
            after = curves.evaluate(y, points.tangent)
            length = np.linalg.norm(y - points.y, axis=1)
            cosine = np.sum(after.tangent * points.tangent, axis=1)
            fine &= is_step_sound(step, length, cosine, points.regular_distance + after.regular_distance)
            # an input that may have gone back and on again within the step
            dips = (points.curvature[:, -1] < 0.0) & (after.curvature[:, -1] > 0.0) & (after.tangent[:, -1] > 0.0)
            low = np.minimum(points.tangent[:, -1], after.tangent[:, -1])
            bends = np.maximum(np.abs(points.curvature[:, -1]), np.abs(after.curvature[:, -1]))
            fine &= ~(dips & (low < length * bends))
            end = np.where(after.tangent[:, -1] <= 0.0, DEAD_POINT, PASSES)
            arcs = _CurveArcs(active, points.y, points.tangent, after.y, after.tangent, end)
            if self.turns.size:
                clear, meets = self._judge_stops(arcs)
                meets &= end == PASSES
                fine &= clear | meets
                end[meets] = STOP
            # a design is settled at its dead point, where it meets a stop, or at its last step
            limits = np.minimum(self.length, self.input_rooms[active])
            self.is_settled[active[fine & ((end != PASSES) | (after.y[:, -1] >= limits))]] = True
            sound_arcs.append(arcs.select(fine))
            step = np.where(fine, STEP_GROWTH * step, 0.5 * step)
            parts = zip(after, points, strict=True)
            points = _CurvePoints(*(np.where(fine.reshape(-1, *[1] * (new.ndim - 1)), new, old) for new, old in parts))
        return sound_arcs

    def _rooms(self, design: Array, y: Array) -> Array:
        """How far pairs are from their stops (stops, designs) at points of designs, negative beyond."""
        stops, batch = self.batch.stops, self.batch.select(design)
        assert stops is not None
        u = batch.u0 + y[:, -1] * self.direction[:, None]
        positions = DesignEvaluation(batch).pair_positions(y[:, :-1].T, u) + self.turns[:, design]
        return np.minimum(positions - stops.low[:, design], stops.high[:, design] - positions)

    def _judge_stops(self, arcs: _CurveArcs) -> tuple[Array, Array]:
        """Where pairs surely keep off their stops all along arcs, and where they surely meet one (designs,)."""
        rooms = np.array([self._rooms(arcs.design, arcs.interpolate(x + 0.0 * arcs.design)) for x in PLACES_ON_ARC])
        bend = np.abs(np.diff(rooms, 2, axis=0)).max(axis=0)
        clear = rooms.min(axis=0) > 0.5 * bend
        inside = rooms > 0.0
        passes = inside[0] & ~inside[-1] & (np.count_nonzero(inside[:-1] != inside[1:], axis=0) == 1)
        return clear.all(axis=0), (clear | passes).all(axis=0) & passes.any(axis=0)

    def _find_falling_zero(self, arcs: _CurveArcs, value: Callable[[Array], Array]) -> tuple[Array, Array]:
        """Where on each arc a value of its points falls through zero: the points, and which of them surely do."""
        curves, chord = _DesignCurves(self.batch, arcs.design, self.direction), arcs.y1 - arcs.y0
        a, b = np.zeros(len(chord)), np.ones(len(chord))
        fa, fb = value(arcs.y0), value(arcs.y1)
        fine, y = (fa >= 0.0) & (fb <= 0.0), arcs.y0
        for k in range(MAX_HALVINGS):
            x = np.clip((a * fb - b * fa) / (fb - fa), a, b) if k % 3 else 0.5 * (a + b)
            x = np.where(np.isfinite(x), x, 0.5 * (a + b))
            y, converged = curves.correct(arcs.interpolate(x), chord)
            fine &= converged
            f = value(y)
            up = f > 0.0
            a, fa, b, fb = np.where(up, x, a), np.where(up, f, fa), np.where(up, b, x), np.where(up, fb, f)
            if np.all((np.abs(f) < 1e-10) | (b - a < 1e-13) | ~fine):
                break
        return y, fine & (np.abs(value(y)) < ZERO_TOLERANCE)

    def _end_arcs(self, arcs: _CurveArcs) -> None:
        """End the last arcs of designs, and the designs, at their dead points and stops."""
        ended = np.flatnonzero(arcs.end != PASSES)
        if not ended.size:
            return
        part = arcs.select(ended)
        design, is_stop = part.design, part.end == STOP
        curves = _DesignCurves(self.batch, design, self.direction)

        def value(y: Array) -> Array:
            rate = curves.tangents(curves.jacobians(y), part.t0)[:, -1]
            return np.where(is_stop, self._rooms(design, y).min(axis=0), rate) if is_stop.any() else rate

        y, fine = self._find_falling_zero(part, value)
        self.distance[design] = y[:, -1]
        self.is_settled[design[~fine]], self.is_stopped[design] = False, is_stop
        arcs.y1[ended], arcs.t1[ended] = y, curves.tangents(curves.jacobians(y), part.y1 - part.y0)
