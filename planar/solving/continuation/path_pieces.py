"""The parts of a curve of positions between dead points, on each of which the inputs go one way, up to a stop."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import TrackingEnd
from planar.foundation.root_finding import find_first_passage, find_root, lowest_on_cubic
from planar.solving.continuation.fast_path import STRAIGHT_TOLERANCE
from planar.solving.continuation.predictor_corrector import END_TOLERANCE, CurveTracker
from planar.solving.continuation.run_samples import BranchRates
from planar.solving.continuation.solution_curve import (
    DEAD_POINT_TOLERANCE,
    Arc,
    CurvePoint,
    SolutionCurve,
    input_axis,
    pair_motions_at,
)
from planar.solving.stops import STOP_TOLERANCE, PairStops

MAX_CORRECTION_RATIO = 0.1
"""A correction longer than this part of an arc has gone astray."""


class PathPiece(NamedTuple):
    """A part of an arc on which the inputs go one way: from and to where on its axis, from and to where on the way of
    the inputs, and the dead point at its end, if one is there."""

    arc: Arc
    first: float
    last: float
    start: float
    stop: float
    dead_point: CurvePoint | None

    def has_position(self, position: float) -> bool:
        """Whether the inputs come to a place within this piece."""
        return min(self.start, self.stop) <= position <= max(self.start, self.stop)

    def until(self, position: float) -> PathPiece:
        """The part of the piece up to a place of the inputs."""
        x = find_root(lambda x: self.arc.input_position(x) - position, self.first, self.last)
        return self._replace(last=x, stop=position, dead_point=None)

    def unknowns_at(self, curve: SolutionCurve, position: float) -> tuple[Array, BranchRates | None]:
        """The unknowns where the inputs are at a place, with their rates where the Jacobian is singular."""
        arc = self.arc
        if self.dead_point is not None and position == self.stop:
            return self.dead_point.y[:-1], None
        x = find_root(lambda x: arc.input_position(x) - position, self.first, self.last)
        rough = arc.polynomial(x)
        rough[-1] = position
        if arc.is_exact:
            y = curve.correct_beside_bifurcation(rough, arc.rank_loss, with_inputs=False)
            return y[:-1], BranchRates(derivatives_by_input(arc, x), curve.input_direction, arc.rank_loss)
        near = curve.correct(rough, input_axis(len(rough)))
        if (
            near is None
            or np.linalg.norm(near - rough) > MAX_CORRECTION_RATIO * abs(self.last - self.first)
            or not self._holds(near)
            or not curve.is_closed(near)
        ):
            near = arc.curve_coordinates(
                curve, find_root(lambda x: float(arc.curve_coordinates(curve, x)[-1]) - position, self.first, self.last)
            )
        return near[:-1], None

    def _holds(self, y: Array) -> bool:
        """Whether a point of the curve lies on this piece, and not beyond a dead point at its end, where the inputs
        come to the same places once more."""
        x, (low, high) = self.arc.place(y), sorted((self.first, self.last))
        slack = STRAIGHT_TOLERANCE * (high - low)
        return low - slack <= x <= high + slack


def path_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
    """A walk's arcs, parted at dead points, up to the first stop that a pair meets."""
    curve, stops = tracker.curve, tracker.curve.solver.stops
    search = None if stops is None else _StopSearch(stops, curve, tracker.point)
    for piece in _pieces_by_dead_points(tracker):
        met = None if search is None else search.first_on(piece.arc, piece.first, piece.last)
        if met is None:
            yield piece
            continue
        x, tracker.point = met
        stop = piece.start if x == piece.first else float(tracker.point.y[-1])
        arc = piece.arc._replace(after=tracker.point)
        yield piece._replace(arc=arc, last=x, stop=stop, dead_point=None)
        tracker.ending = TrackingEnd.STOP
        return


def _pieces_by_dead_points(tracker: CurveTracker) -> Iterator[PathPiece]:
    """A walk's arcs, parted at dead points."""
    curve = tracker.curve
    if tracker.point.is_dead_point and tracker.point.curvature[-1] < 0.0:
        here = tracker.point
        yield PathPiece(Arc(here, here, here.y, here.tangent, 1.0, here.y[None], 1), 0.0, 0.0, 0.0, 0.0, here)
    for arc in tracker.arcs():
        (first, last), before = arc.ends, arc.before
        if before.is_dead_point and arc.after.is_dead_point and abs(arc.after.y[-1] - before.y[-1]) < END_TOLERANCE:
            yield PathPiece(arc, first, first, float(before.y[-1]), float(before.y[-1]), before)
            return  # all else moves on while the inputs rest
        while True:
            dead = _find_turning_point(curve, arc, before, first, last)
            if dead is None:
                break
            x = arc.place(dead.y)
            if before is not arc.before and abs(x - first) <= STRAIGHT_TOLERANCE:
                break  # the dead point from which this part starts
            yield PathPiece(arc, first, x, float(before.y[-1]), float(dead.y[-1]), dead)
            first, before = x, dead
        yield PathPiece(arc, first, last, float(before.y[-1]), float(arc.after.y[-1]), None)


def _find_turning_point(
    curve: SolutionCurve, arc: Arc, before: CurvePoint, first: float, last: float
) -> CurvePoint | None:
    """The first dead point on an arc between two places on its axis, at which the inputs turn back, if there is one."""
    g0 = before.input_rate
    # of a dead point that was found on the arc rounding may leave more, on a small curve, than is a rest anywhere
    from_dead = before is not arc.before or before.is_dead_point
    if from_dead:
        g0 = DEAD_POINT_TOLERANCE * float(np.sign(before.curvature[-1]))
    sense = float(np.sign(g0))
    g0, g1 = abs(g0), sense * arc.after.input_rate
    if arc.after.is_dead_point and not from_dead and sense * arc.after.curvature[-1] < 0.0:
        # at its very end, whichever sign rounding gives what is left of the rate
        distance = arc.after.input_rate / abs(float(arc.after.curvature[-1]))
        x = last + sense * distance * float(np.sign(last - first))
        return arc.after if arc.is_exact else arc.point_at(curve, x)
    if g1 > 0.0:
        # between two points that go on the inputs may have gone back in the meantime
        s0, s1, length = sense * before.curvature[-1], sense * arc.after.curvature[-1], abs(last - first)
        if s0 >= 0.0 or s1 <= 0.0:
            return None
        least, part = lowest_on_cubic((g0, s0 * length), (g1, s1 * length))
        x = first + part * (last - first)
        if least > 0.0 or sense * arc.point_at(curve, x).input_rate > 0.0:
            return None
        last = x
    x = find_root(lambda x: sense * arc.point_at(curve, x).input_rate if x != first else g0, first, last)
    return arc.point_at(curve, x)


class _StopSearch:
    """Looks for stops along one curve from its start; `rooms` are how far the pairs are from them."""

    def __init__(self, stops: PairStops, curve: SolutionCurve, start: CurvePoint):
        self.stops, self.curve = stops, curve
        self.turns = stops.turns(pair_motions_at(stops.pairs, curve, start)[:, 0])

    def rooms_at(self, point: CurvePoint) -> Array:
        """How far lower and upper stops are, with the first derivative by arc length (2, stops, 2)."""
        motions = pair_motions_at(self.stops.pairs, self.curve, point)
        rate = motions[:, 1] / self.stops.scale
        return np.stack([self.stops.rooms(motions[:, 0], self.turns), np.array([rate, -rate])], axis=2)

    def first_on(self, arc: Arc, first: float, last: float) -> tuple[float, CurvePoint] | None:
        """The first stop on an arc between two places on its axis, in whose direction the curve runs: where on its
        axis, and the point there."""
        before, after = (self.rooms_at(self._point_at(arc, x)) for x in (first, last))
        passages = [
            x
            for side, k in np.ndindex(*before.shape[:2])
            if np.isfinite(before[side, k, 0])
            and (x := self._passed_at(arc, (first, last), (before[side, k], after[side, k]), (side, k))) is not None
        ]
        if not passages:
            return None
        x = min(passages, key=lambda x: abs(x - first))
        return x, self._point_at(arc, x)

    def _point_at(self, arc: Arc, x: float) -> CurvePoint:
        for point, end in zip((arc.before, arc.after), arc.ends, strict=True):
            if x == end:
                return point
        return arc.point_at(self.curve, x)

    def _passed_at(
        self, arc: Arc, ends: tuple[float, float], rooms: tuple[Array, Array], which: tuple[int, int]
    ) -> float | None:
        """Where one stop is first passed between the ends, at which its rooms and their rates are known."""
        (first, last), ((g0, s0), (g1, s1)) = ends, rooms

        def room_and_rate(x: float) -> Array:
            return self.rooms_at(self._point_at(arc, x))[which]

        sense = 1.0 if last >= first else -1.0
        if g0 <= STOP_TOLERANCE and (g0 < -STOP_TOLERANCE or s0 < 0.0 or (s0 == 0.0 and g1 < g0)):
            return first  # it stands at the stop, and goes on beyond
        return find_first_passage(
            lambda x: float(room_and_rate(x)[0]),
            lambda x: sense * float(room_and_rate(x)[1]),
            ends,
            ((g0, s0), (g1, s1)),
        )


def derivatives_by_input(arc: Arc, x: float) -> Array:
    """The first three derivatives of the unknowns by the place of the inputs (3, unknowns), on an exact arc."""
    y1, y2, y3 = (arc.polynomial(x, order) for order in (1, 2, 3))
    t1, t2, t3 = y1[-1], y2[-1], y3[-1]
    # the chain rule, solved for the derivatives of the inverse
    x1 = 1.0 / t1
    x2 = -t2 * x1**3
    x3 = (3.0 * t2**2 / t1 - t3) * x1**4
    return np.array([y1 * x1, y2 * x1**2 + y1 * x2, y3 * x1**3 + 3.0 * y2 * x1 * x2 + y1 * x3])[:, :-1]
