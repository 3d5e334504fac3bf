"""On along the curves of many designs at once, from where compiled code left them to their dead points."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.runs import last_good_unknowns
from planar.batch.march.stops import nearest_end
from planar.equations.linear import solve_vectors
from planar.solving.checks.singular_values import DIFFERENCE_STEP, column_norms, singular_distance
from planar.solving.continuation.predictor_corrector import (
    FIRST_STEP,
    LONGEST_STEP,
    STEP_GROWTH,
    first_step,
    is_step_sound,
)
from planar.solving.continuation.solution_curve import CLOSED_TOLERANCE, MIN_COLUMN_NORM

Array = np.ndarray

SHORTEST_STEP = 1e-6
"""Arc length (rad, sizes): a curve that asks for shorter steps is left to be followed by itself."""
CROSSING_DISTANCE = 0.01
"""So near to where branches cross a design is left to be followed by itself."""
MAX_ARCS = 120
DEAD_POINT_MARGIN = 1e-8
"""Parts of the run: so near to a dead point a step is left to be judged by itself."""
MAX_HALVINGS = 60
PLACES_ON_ARC = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Parts of an arc at which it is looked whether pairs keep off their stops."""
PASSES, DEAD_POINT, STOP = range(3)
"""What an arc does: it goes on; it ends its design at a dead point, or at the stop of a pair."""


class FollowedDesigns(NamedTuple):
    """Which designs are settled (designs,), how many of their steps are solved (designs,), how far from the start their
    dead points are, rad or sizes, infinitely where there is none (designs,), and the steps that were solved points:
    design, step (solved,) and the points there, out (rows, solved). It is a stop that ends a design where `stop`
    (designs,) is not negative: that of this pair, and behind these that of the input."""

    is_settled: Array
    solved_steps: Array
    distance: Array
    design: Array
    step: Array
    out: Array
    stop: Array


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
        self.batch, self.good_steps = batch, good_steps
        self.steps = len(batch.input_offsets) - 1
        length = float(batch.input_offsets[-1, index])
        self.direction = np.where(np.arange(len(batch.u0)) == index, np.sign(length), 0.0)
        self.distances = np.abs(batch.input_offsets[:, index])
        self.design_count = len(good_steps)
        none = np.zeros((0, len(batch.z0) + 1))
        self.arcs = [_CurveArcs(np.zeros(0, dtype=int), none, none, none, none, np.zeros(0, dtype=int))]
        self.is_settled = np.zeros(self.design_count, dtype=bool)
        self.dead_point_distance = np.full(self.design_count, np.inf)
        "the place of the dead point, or of the stop"
        self.stop = np.full(self.design_count, -1)
        self.input_rooms = np.full(self.design_count, np.inf)
        if batch.stops is not None:
            self.input_rooms = batch.stops.input_rooms(batch.u0[index], np.full(self.design_count, length))
        self.limits = np.minimum(self.distances[-1], self.input_rooms)
        "where the input is at the end of its range, or at its stop"
        self.turns = np.zeros((len(batch.stop_pairs), self.design_count))
        "rad to add to the positions of pairs with stops, so that they lie between these"

    def follow(self, z: Array) -> FollowedDesigns:
        """See `follow_to_dead_points`; z (designs, unknowns) at the last good steps."""
        self._track(z)
        arcs = _CurveArcs(*(np.concatenate(parts) for parts in zip(*self.arcs, strict=True)))
        for end in (DEAD_POINT, STOP):
            self._end_arcs(arcs, end)
        # designs whose input meets a stop of its own before anything else end there
        last = self.distances[-1]
        ends = nearest_end(self.dead_point_distance, self.stop, self.input_rooms, last, len(self.turns))
        self.dead_point_distance, self.stop = ends
        near = self._is_near_step(self.input_rooms) & (self.stop == len(self.turns))
        self.is_settled &= ~np.isnan(self.dead_point_distance) & ~near
        return self._solve_steps(arcs)

    def _is_near_step(self, distances: Array) -> Array:
        """Whether distances of the input (designs,) are as good as those of a step."""
        return np.abs(self.distances[:, None] - distances).min(axis=0) < DEAD_POINT_MARGIN * self.distances[-1]

    def _track(self, z: Array) -> None:
        active = np.flatnonzero(np.all(np.isfinite(z), axis=1))
        y = np.hstack([z[active], self.distances[self.good_steps[active] - 1][:, None]])
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
                    return
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
            is_last = (end != PASSES) | (after.y[:, -1] >= self.limits[active])
            self.is_settled[active[fine & is_last]] = True
            self.arcs.append(arcs.select(fine))
            step = np.where(fine, STEP_GROWTH * step, 0.5 * step)
            parts = zip(after, points, strict=True)
            points = _CurvePoints(*(np.where(fine.reshape(-1, *[1] * (new.ndim - 1)), new, old) for new, old in parts))

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
        return y, fine & (np.abs(value(y)) < 1e-7)

    def _end_arcs(self, arcs: _CurveArcs, end: int) -> None:
        """End the arcs that end their design so, and the designs, at the dead point or stop."""
        ended = np.flatnonzero(arcs.end == end)
        if not ended.size:
            return
        part = arcs.select(ended)
        design, curves = part.design, _DesignCurves(self.batch, part.design, self.direction)
        if end == STOP:
            y, fine = self._find_falling_zero(part, lambda y: self._rooms(design, y).min(axis=0))
            self.stop[design] = np.argmin(self._rooms(design, y), axis=0)
        else:
            y, fine = self._find_falling_zero(part, lambda y: curves.tangents(curves.jacobians(y), part.t0)[:, -1])
        self.dead_point_distance[design] = y[:, -1]
        self.is_settled[design[~fine | self._is_near_step(y[:, -1])]] = False
        arcs.y1[ended], arcs.t1[ended] = y, curves.tangents(curves.jacobians(y), part.y1 - part.y0)

    def _solve_steps(self, arcs: _CurveArcs) -> FollowedDesigns:
        """The designs with the points at their steps on arcs."""
        solved = np.where(
            self.is_settled,
            np.searchsorted(self.distances, np.minimum(self.dead_point_distance, 2 * self.distances[-1])),
            0,
        )
        first, last = (np.searchsorted(self.distances, y[:, -1], side="right") for y in (arcs.y0, arcs.y1))
        first = np.maximum(first, self.good_steps[arcs.design])
        last = np.minimum(last, np.minimum(solved, self.steps + 1)[arcs.design])
        count = np.where(self.is_settled[arcs.design], np.maximum(last - first, 0), 0)
        arc = np.repeat(np.arange(len(count)), count)
        step = first[arc] + np.arange(len(arc)) - np.repeat(np.cumsum(count) - count, count)
        out, fine = self._points_at_steps(arcs.select(arc), step)
        design = arcs.design[arc]
        self.is_settled[design[~fine]] = False
        # every step of a design once, no more and no less
        step_counts = np.bincount(design, minlength=self.design_count)
        self.is_settled &= step_counts == np.maximum(solved - self.good_steps, 0)
        kept = self.is_settled[design]
        return FollowedDesigns(
            self.is_settled, solved, self.dead_point_distance, design[kept], step[kept], out[:, kept], self.stop
        )

    def _points_at_steps(self, arcs: _CurveArcs, step: Array) -> tuple[Array, Array]:
        """The points (rows, steps) where arcs come to steps, and which of them pass the checks."""
        out = np.empty((self.batch.output_row_count, len(step)))
        if not len(step):
            return out, np.zeros(0, dtype=bool)
        place = self.distances[step]
        y, fine = self._find_falling_zero(arcs, lambda y: place - y[:, -1])
        batch = self.batch.select(arcs.design, y[:, :-1].T)
        evaluation = DesignEvaluation(batch)
        u = batch.u0 + place * self.direction[:, None]
        z = evaluation.correct(y[:, :-1], u.T)
        fine &= np.max(np.abs(z - y[:, :-1]), axis=1, initial=0.0) < 1e-3
        positions = evaluation.positions(z, u)
        fine &= evaluation.accepts(positions) & evaluation.write_points(out, positions)
        return out, fine
