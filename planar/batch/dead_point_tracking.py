"""On along the curves of many designs at once, from where compiled code left them to their dead points."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.runs import last_good_unknowns, run_designs
from planar.batch.march.stops import nearest_end
from planar.codegen.llvm_compile import allocate_aligned
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
ZERO_TOLERANCE = 1e-9
"""rad, sizes or a rate by which a zero on an arc may be missed."""
PLACES_ON_ARC = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Parts of an arc at which it is looked whether pairs keep off their stops."""
PASSES, DEAD_POINT, STOP = range(3)
"""What an arc does: it goes on; it ends its design at a dead point, or at the stop of a pair."""


class FollowedDesigns(NamedTuple):
    """How designs end that were followed past a march.

    Which designs are settled, how many of their steps are solved, the distance of their ends from the start (rad or
    sizes; infinite where there is none), and whether it is a stop that ends them, each (designs,). Then the steps that
    were solved: design and step (solved,) and the points there, out (rows, solved).
    """

    is_settled: Array
    solved_steps: Array
    distance: Array
    is_stopped: Array
    design: Array
    step: Array
    out: Array


StepSolver = Callable[[Array, Array], tuple[Array, Array]]
"""Returns the points (rows, solved) of designs at steps (solved,), and which of them pass the checks."""


def solve_until_ends(
    distance: Array, is_stopped: Array, step: Array, step_count: int, first: Array, solve: StepSolver
) -> FollowedDesigns:
    """Solve the steps of designs from `first` (designs,) on that come before their ends.

    `distance` is that of the ends, NaN where it is not known, and `step` the length of a step, rad or sizes (designs,).
    A design whose end is so near to a step that it is not clear which comes first is not settled.
    """
    nearest = np.clip(np.rint(distance / step), 0, step_count) * step
    settled = ~np.isnan(distance) & (np.abs(distance - nearest) > DEAD_POINT_MARGIN * step_count * step)
    solved = np.where(settled, np.ceil(np.minimum(distance / step, step_count + 1.0)), 0.0).astype(int)
    count = np.maximum(solved - first, 0)
    design = np.repeat(np.arange(len(count)), count)
    number = first[design] + np.arange(len(design)) - np.repeat(np.cumsum(count) - count, count)
    out, passed = solve(design, number)
    settled[design[~passed]] = False
    solved[~settled] = 0
    if not passed.all():
        design, number, out = (rows[..., settled[design]] for rows in (design, number, out))
    return FollowedDesigns(settled, solved, distance, is_stopped, design, number, out)


def solve_positions(batch: DesignBatch, u: Array, z: Array) -> tuple[Array, Array]:
    """The points (rows, designs) of a batch at inputs u (inputs, designs) before any end, by unknowns z (unknowns,
    designs) near by or by the batch's signs, and which of them pass the checks."""
    # they lie before their ends
    batch = batch if batch.stops is None else batch._replace(stops=batch.stops.cleared())
    out = allocate_aligned(1, batch.output_row_count, u.shape[1])
    return out[0], run_designs(batch._replace(u0=u, z0=z, input_offsets=np.zeros((1, len(u)))), out) > 0


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
        self.stop = np.full(self.design_count, -1)
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
        rows = self.distance, self.stop, self.input_rooms
        distance, stop = nearest_end(*rows, self.length, len(self.turns))
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

        return solve_until_ends(distance, stop >= 0, step, self.step_count, self.good_steps, solve)

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
        self.is_settled[design[~fine]] = False
        if is_stop.any():
            self.stop[design] = np.where(is_stop, np.argmin(self._rooms(design, y), axis=0), -1)
        arcs.y1[ended], arcs.t1[ended] = y, curves.tangents(curves.jacobians(y), part.y1 - part.y0)
