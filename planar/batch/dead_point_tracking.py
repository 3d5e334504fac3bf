"""On along the curves of many designs at once, from where compiled code left them to their dead points."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planar.batch.march.checks import DesignFunctions, PointWriter, design_positions, pair_positions
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.runs import last_good_unknowns
from planar.batch.march.stops import nearest_end
from planar.equations.linear import solve_vectors
from planar.solving.checks.singular_values import SINGULAR_DISTANCE_RATIO
from planar.solving.continuation.predictor_corrector import (
    FIRST_STEP,
    LONGEST_STEP,
    MAX_TANGENT_TURN,
)

Array = np.ndarray

SHORTEST_STEP = 1e-6
"""Arc length (rad, sizes): a curve that asks for shorter steps is left to be followed by itself."""
CROSSING_DISTANCE = 0.01
"""So near to where branches cross a design is left to be followed by itself."""
DIFFERENCE_STEP = 1e-6
CLOSED_TOLERANCE = 1e-10
MAX_ARCS = 120
DEAD_POINT_MARGIN = 1e-8
"""Parts of the run: so near to a dead point a step is left to be judged by itself."""
MAX_HALVINGS = 60
PLACES_ON_ARC = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Parts of an arc at which it is looked whether pairs keep off their stops."""


class FollowedDesigns(NamedTuple):
    """Which designs are settled (designs,), how many of their steps are solved (designs,), how far from the start their
    dead points are, rad or sizes, infinitely where there is none (designs,), and the steps that were solved here:
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

    def select(self, which: Array) -> _CurvePoints:
        return _CurvePoints(*(part[which] for part in self))


class _CurveArcs(NamedTuple):
    """Arcs of the curves: the design, and both ends with their tangents."""

    design: Array
    y0: Array
    t0: Array
    y1: Array
    t1: Array

    def select(self, which: Array) -> _CurveArcs:
        return _CurveArcs(*(part[which] for part in self))

    def interpolate(self, x: Array) -> Array:
        """Near the arc, at parts x of the chord: Hermite's cubic."""
        x = x[:, None]
        chord = np.linalg.norm(self.y1 - self.y0, axis=1)[:, None]
        a, b = (1 + 2 * x) * (1 - x) ** 2, x * x * (3 - 2 * x)
        return a * self.y0 + b * self.y1 + chord * (x * (1 - x) ** 2 * self.t0 + x * x * (x - 1) * self.t1)


def _join_arcs(parts: Sequence[_CurveArcs]) -> _CurveArcs:
    return _CurveArcs(*(np.concatenate(each) for each in zip(*parts, strict=True)))


class _DesignCurves:
    """The curves of some designs; `SolutionCurve` in `solving` is that of one."""

    def __init__(self, march: DesignBatch, design: Array, direction: Array):
        self.functions = DesignFunctions(march.functions, march.p[:, design])
        self.start, self.direction = march.u0.T[design], direction

    def inputs(self, y: Array) -> Array:
        return self.start + y[:, -1:] * self.direction

    def unknowns_and_inputs(self, y: Array, tangent: bool = False) -> Array:
        return np.hstack([y[:, :-1], y[:, -1:] * self.direction if tangent else self.inputs(y)])

    def jacobians(self, y: Array) -> Array:
        dz, du = self.functions.jacobians(y[:, :-1], self.inputs(y))
        return np.concatenate([dz, (du @ self.direction)[..., None]], axis=2)

    def correct(self, y: Array, normal: Array) -> tuple[Array, Array]:
        """The points near y in the planes with these normals, and which of them Newton's method found."""
        gap = np.full(len(y), np.inf)
        for _ in range(6):
            whole = self.unknowns_and_inputs(y)
            found = self.functions.kinematics(whole, 0.0 * whole, 0.0 * whole)
            gap = np.max(np.abs(found.F), axis=1, initial=0.0)
            if np.all(gap <= 1e-15):
                break
            slope = np.concatenate([found.jacobian, (found.input_jacobian @ self.direction)[..., None]], axis=2)
            y = y + _solve_bordered(slope, normal, -found.F, 0.0)
        return y, gap <= CLOSED_TOLERANCE

    def evaluate(self, y: Array, towards: Array, with_curvature: bool = True) -> _CurvePoints:
        """The points at y, with tangents towards; without bends if not the whole is wanted."""
        slope = self.jacobians(y)
        tangent = _solve_bordered(slope, towards, np.zeros(slope.shape[:2]), 1.0)
        tangent = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
        if not with_curvature:
            return _CurvePoints(y, tangent, tangent, np.zeros(len(y)))
        wide = self.unknowns_and_inputs(tangent, True)
        second = self.functions.kinematics(self.unknowns_and_inputs(y), wide, 0.0 * wide).F2
        bend = _solve_bordered(slope, tangent, -second, 0.0)
        sizes = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-6)
        change = (
            np.linalg.norm((self.jacobians(y + DIFFERENCE_STEP * tangent) - slope) / sizes, axis=(1, 2))
            / DIFFERENCE_STEP
        )
        least = np.linalg.svd(np.nan_to_num(slope / sizes), compute_uv=False).min(axis=1, initial=np.inf)
        return _CurvePoints(y, tangent, bend, least / np.maximum(change, 1e-300))


def _solve_bordered(jacobians: Array, normal: Array, right: Array, last: float) -> Array:
    """x with Jacobian x = left and normal x = last, for each design; not numbers where that is singular."""
    whole = np.concatenate([jacobians, normal[:, None]], axis=1)
    right = np.concatenate([right, np.full((len(right), 1), last)], axis=1)
    return solve_vectors(whole, right, least_determinant=1e-12)


def follow_to_dead_points(batch: DesignBatch, index: int, good_steps: Array) -> FollowedDesigns:
    """Go on from the last of the good steps of each design, one at least.

    Each step is under the conditions of `solving.continuation.predictor_corrector`; a design that does not keep them is
    not settled. `index` is the input that runs.
    """
    with np.errstate(all="ignore"):  # what leads astray ends as what is no number
        return _DeadPointTracker(batch, index, good_steps).follow(last_good_unknowns(batch, good_steps).T)


class _DeadPointTracker:
    def __init__(self, march: DesignBatch, index: int, good: Array):
        self.batch, self.good_steps = march, good
        self.steps = len(march.input_offsets) - 1
        length = float(march.input_offsets[-1, index])
        self.direction = np.where(np.arange(len(march.u0)) == index, np.sign(length), 0.0)
        self.distances = np.abs(march.input_offsets[:, index])
        self.design_count = len(good)
        self.arcs: list[_CurveArcs] = []
        self.dead_point_arcs: list[_CurveArcs] = []
        self.is_settled = np.zeros(self.design_count, dtype=bool)
        self.dead_point_distance = np.full(self.design_count, np.inf)
        "the place of the dead point, or of the stop"
        self.stop = np.full(self.design_count, -1)
        self.stop_arcs: list[_CurveArcs] = []
        self.input_rooms = np.full(self.design_count, np.inf)
        if march.stops is not None:
            self.input_rooms = march.stops.input_rooms(march.u0[index], np.full(self.design_count, length))
        self.limits = np.minimum(self.distances[-1], self.input_rooms)
        "where the input is at the end of its range, or at its stop"
        self.turns = np.zeros((len(march.stop_pairs), self.design_count))
        "rad to add to the positions of pairs with stops, so that they lie between these"

    def follow(self, z: Array) -> FollowedDesigns:
        """See `follow_to_dead_points`; z (designs, unknowns) at the last good steps."""
        self._track(z)
        if self.dead_point_arcs:
            self._find_dead_points()
        if self.stop_arcs:
            self._find_stops()
        self._end_at_input_stops()
        return self._result()

    def _track(self, z: Array) -> None:
        active = np.flatnonzero(np.all(np.isfinite(z), axis=1))
        y = np.hstack([z[active], self.distances[self.good_steps[active] - 1][:, None]])
        curves = _DesignCurves(self.batch, active, self.direction)
        if self.turns.size and self.batch.stops is not None:
            at = pair_positions(self.batch.select(active), y[:, :-1].T, curves.inputs(y).T)
            self.turns[:, active] = self.batch.stops.select(active).turns_between(at)
        ahead = np.zeros_like(y)
        ahead[:, -1] = 1.0
        here, step = curves.evaluate(y, ahead), np.full(len(active), FIRST_STEP)
        for _ in range(MAX_ARCS):
            going = (here.regular_distance > CROSSING_DISTANCE) & (step > SHORTEST_STEP) & ~self.is_settled[active]
            going &= np.isfinite(here.curvature).all(axis=1) & (np.abs(here.y).max(axis=1) < 1e3)
            if not going.all():
                here, step, active = here.select(going), step[going], active[going]
                if not active.size:
                    return
                curves = _DesignCurves(self.batch, active, self.direction)
            bent = np.linalg.norm(here.curvature, axis=1)
            step = np.minimum.reduce(
                [step, np.full(len(step), LONGEST_STEP), 1.2 * here.regular_distance, 0.8 * MAX_TANGENT_TURN / bent]
            )
            ahead = here.y + step[:, None] * here.tangent + 0.5 * step[:, None] ** 2 * here.curvature
            y, fine = curves.correct(ahead, here.tangent)
            after = curves.evaluate(y, here.tangent)
            gone = np.linalg.norm(y - here.y, axis=1)
            fine &= np.sum(after.tangent * here.tangent, axis=1) > np.cos(MAX_TANGENT_TURN)
            fine &= (SINGULAR_DISTANCE_RATIO * gone < here.regular_distance + after.regular_distance) & (
                gone < 2.0 * step
            )
            # an input that may have gone back and on again within the step
            dips = (here.curvature[:, -1] < 0.0) & (after.curvature[:, -1] > 0.0) & (after.tangent[:, -1] > 0.0)
            low = np.minimum(here.tangent[:, -1], after.tangent[:, -1])
            fine &= ~(dips & (low < gone * np.maximum(np.abs(here.curvature[:, -1]), np.abs(after.curvature[:, -1]))))
            meets = np.zeros_like(fine)
            if self.turns.size:
                clear, meets = self._judge_stops(_CurveArcs(active, here.y, here.tangent, after.y, after.tangent))
                fine &= clear | (meets & (after.tangent[:, -1] > 0.0))
            self._record_arcs(active, here, after, fine, meets)
            step = np.where(fine, 1.6 * step, 0.5 * step)
            here = _CurvePoints(
                *(
                    np.where(fine.reshape(-1, *[1] * (new.ndim - 1)), new, old)
                    for new, old in zip(after, here, strict=True)
                )
            )

    def _rooms(self, design: Array, y: Array) -> Array:
        """How far pairs are from their stops (stops, designs) at points of designs, negative beyond."""
        stops, own = self.batch.stops, self.batch.select(design)
        assert stops is not None
        u = own.u0 + y[:, -1] * self.direction[:, None]
        at = pair_positions(own, y[:, :-1].T, u) + self.turns[:, design]
        return np.minimum(at - stops.low[:, design], stops.high[:, design] - at)

    def _judge_stops(self, arcs: _CurveArcs) -> tuple[Array, Array]:
        """Where pairs surely keep off their stops all along arcs, and where they surely meet one (designs,)."""
        rooms = np.array([self._rooms(arcs.design, arcs.interpolate(x + 0.0 * arcs.design)) for x in PLACES_ON_ARC])
        bend = np.abs(np.diff(rooms, 2, axis=0)).max(axis=0)
        clear = rooms.min(axis=0) > 0.5 * bend
        inside = rooms > 0.0
        passes = inside[0] & ~inside[-1] & (np.count_nonzero(inside[:-1] != inside[1:], axis=0) == 1)
        return clear.all(axis=0), (clear | passes).all(axis=0) & passes.any(axis=0)

    def _record_arcs(
        self, active: Array, here: _CurvePoints, after: _CurvePoints, accepted: Array, meets: Array
    ) -> None:
        """Keep what was gone through; a design is settled at its dead point, where it `meets` a stop, or at its last
        step."""
        arcs = _CurveArcs(active, here.y, here.tangent, after.y, after.tangent)
        dead = accepted & (after.tangent[:, -1] <= 0.0)
        stopped = accepted & ~dead & meets
        on = accepted & ~dead & ~stopped
        self.is_settled[active[dead | stopped | (on & (after.y[:, -1] >= self.limits[active]))]] = True
        if stopped.any():
            self.stop_arcs.append(arcs.select(stopped))
        if dead.any():
            self.dead_point_arcs.append(arcs.select(dead))
        if on.any():
            self.arcs.append(arcs.select(on))

    def _find_falling_zero(
        self, arcs: _CurveArcs, value: Callable[[_DesignCurves, Array], Array]
    ) -> tuple[Array, Array]:
        """Where on each arc a value of its points falls through zero: the points, and which of them surely do."""
        curves, chord = _DesignCurves(self.batch, arcs.design, self.direction), arcs.y1 - arcs.y0
        a, b = np.zeros(len(chord)), np.ones(len(chord))
        fa, fb = value(curves, arcs.y0), value(curves, arcs.y1)
        fine, y = (fa >= 0.0) & (fb <= 0.0), arcs.y0
        for k in range(MAX_HALVINGS):
            x = np.clip((a * fb - b * fa) / (fb - fa), a, b) if k % 3 else 0.5 * (a + b)
            x = np.where(np.isfinite(x), x, 0.5 * (a + b))
            y, found = curves.correct(arcs.interpolate(x), chord)
            fine &= found
            f = value(curves, y)
            up = f > 0.0
            a, fa, b, fb = np.where(up, x, a), np.where(up, f, fa), np.where(up, b, x), np.where(up, fb, f)
            if np.all((np.abs(f) < 1e-10) | (b - a < 1e-13) | ~fine):
                break
        return y, fine & (np.abs(value(curves, y)) < 1e-7)

    def _find_dead_points(self) -> None:
        arcs = _join_arcs(self.dead_point_arcs)
        found = self._find_falling_zero(arcs, lambda curves, y: curves.evaluate(y, arcs.t0, False).tangent[:, -1])
        self._end_on(arcs, *found)

    def _find_stops(self) -> None:
        arcs = _join_arcs(self.stop_arcs)
        y, fine = self._find_falling_zero(arcs, lambda _, y: self._rooms(arcs.design, y).min(axis=0))
        self.stop[arcs.design] = np.argmin(self._rooms(arcs.design, y), axis=0)
        self._end_on(arcs, y, fine)

    def _end_at_input_stops(self) -> None:
        """Designs whose input meets a stop of its own before anything else ends them there."""
        last = self.distances[-1]
        found = nearest_end(self.dead_point_distance, self.stop, self.input_rooms, last, len(self.turns))
        self.dead_point_distance, self.stop = found
        near = np.abs(self.distances[:, None] - self.input_rooms).min(axis=0) < DEAD_POINT_MARGIN * last
        self.is_settled &= ~np.isnan(self.dead_point_distance) & ~(near & (self.stop == len(self.turns)))

    def _end_on(self, arcs: _CurveArcs, y: Array, fine: Array) -> None:
        """End designs at points y on arcs that are `fine`."""
        self.is_settled[arcs.design[~fine]] = False
        self.dead_point_distance[arcs.design] = y[:, -1]
        near = np.abs(self.distances[None] - y[:, -1:]).min(axis=1) < DEAD_POINT_MARGIN * self.distances[-1]
        self.is_settled[arcs.design[near]] = False
        ahead = arcs.y1 - arcs.y0
        curves = _DesignCurves(self.batch, arcs.design, self.direction)
        self.arcs.append(arcs._replace(y1=y, t1=curves.evaluate(y, ahead, False).tangent))

    def _result(self) -> FollowedDesigns:
        solved = np.where(
            self.is_settled,
            np.searchsorted(self.distances, np.minimum(self.dead_point_distance, 2 * self.distances[-1])),
            0,
        )
        none = np.zeros(0, dtype=int)
        if not self.arcs:
            out = np.zeros((self.batch.output_row_count, 0))
            return FollowedDesigns(self.is_settled, solved, self.dead_point_distance, none, none, out, self.stop)
        whole = _join_arcs(self.arcs)
        first, last = (np.searchsorted(self.distances, each[:, -1], side="right") for each in (whole.y0, whole.y1))
        first = np.maximum(first, self.good_steps[whole.design])
        last = np.minimum(last, np.minimum(solved, self.steps + 1)[whole.design])
        count = np.where(self.is_settled[whole.design], np.maximum(last - first, 0), 0)
        arc = np.repeat(np.arange(len(count)), count)
        step = first[arc] + np.arange(len(arc)) - np.repeat(np.cumsum(count) - count, count)
        out, fine = self._points_at_steps(whole.select(arc), step)
        design = whole.design[arc]
        self.is_settled[design[~fine]] = False
        # every step of a design once, no more and no less
        held = np.bincount(design, minlength=self.design_count)
        self.is_settled &= held == np.maximum(solved - self.good_steps, 0)
        kept = self.is_settled[design]
        return FollowedDesigns(
            self.is_settled, solved, self.dead_point_distance, design[kept], step[kept], out[:, kept], self.stop
        )

    def _points_at_steps(self, arcs: _CurveArcs, step: Array) -> tuple[Array, Array]:
        """The points (rows, steps) where arcs come to steps, and which of them pass the checks."""
        march = self.batch
        wide = march.output_row_count
        if not len(step):
            return np.zeros((wide, 0)), np.zeros(0, dtype=bool)
        place = self.distances[step]
        y, fine = self._find_falling_zero(arcs, lambda _, y: place - y[:, -1])
        own = march.select(arcs.design, y[:, :-1].T)
        columns = DesignFunctions(march.functions, own.p)
        u = own.u0 + place * self.direction[:, None]
        z = columns.correct(y[:, :-1], u.T)
        fine &= np.max(np.abs(z - y[:, :-1]), axis=1, initial=0.0) < 1e-3
        row, out = design_positions(columns, own, z, u), np.empty((wide, len(step)))
        fine &= row.passed & PointWriter(own, columns).write(out, row)
        return out, fine
