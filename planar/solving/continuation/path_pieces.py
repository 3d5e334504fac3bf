"""The parts of a curve of positions between dead points, on each of which the inputs go one way."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import TrackingEnd
from planar.foundation.root_finding import find_root
from planar.solving.continuation.fast_path import STRAIGHT_TOLERANCE
from planar.solving.continuation.predictor_corrector import CurveTracker, PassedBifurcation
from planar.solving.continuation.solution_curve import Arc, CurvePoint, SolutionCurve
from planar.solving.continuation.stop_search import stop_search
from planar.solving.continuation.turning_points import find_turning_point, is_dead_point

MAX_CORRECTION_RATIO = 0.1
"""A correction longer than this part of an arc has gone astray."""
END_TOLERANCE = 1e-9
"""rad or sizes: so near to the end of a path a dead point, a change point or the end of a piece is at that end."""


class BranchRates(NamedTuple):
    """Rates where a slope is singular: first, second and third derivative of the unknowns (3, unknowns) by the distance
    of the inputs along a way; and how much rank the Jacobian lacks at the change point."""

    rates: Array
    input_direction: Array
    rank_loss: int


class PathBifurcation(NamedTuple):
    """A change point on the way: the unknowns and inputs there, what the walk knows of it, and along which way."""

    u: Array
    passed: PassedBifurcation
    input_direction: Array


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
        ahead = np.zeros_like(rough)
        ahead[-1] = 1.0
        near = curve.correct(rough, ahead)
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
        x, low, high = (
            float(self.arc.axis @ (y - self.arc.origin)),
            min(self.first, self.last),
            max(self.first, self.last),
        )
        slack = STRAIGHT_TOLERANCE * (high - low)
        return low - slack <= x <= high + slack


def path_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
    """A walk's arcs, parted at dead points, up to the first stop that a pair meets."""
    search = stop_search(tracker.curve, tracker.point)
    for piece in _pieces_by_dead_points(tracker):
        met = None if search is None else search.first_on(piece.arc, piece.first, piece.last)
        if met is None:
            yield piece
            continue
        tracker.point = met.point
        last = piece.start if met.x == piece.first else float(met.point.y[-1])
        yield PathPiece(piece.arc._replace(after=met.point), piece.first, met.x, piece.start, last, None)
        tracker.ending = TrackingEnd.STOP
        return


def _pieces_by_dead_points(tracker: CurveTracker) -> Iterator[PathPiece]:
    """A walk's arcs, parted at dead points."""
    curve = tracker.curve
    if is_dead_point(tracker.point) and tracker.point.curvature[-1] < 0.0:
        here = tracker.point
        yield PathPiece(Arc(here, here, here.y, here.tangent, 1.0, here.y[None], 1), 0.0, 0.0, 0.0, 0.0, here)
    for arc in tracker.arcs():
        (first, last), before = arc.ends, arc.before
        if is_dead_point(before) and is_dead_point(arc.after) and abs(arc.after.y[-1] - before.y[-1]) < END_TOLERANCE:
            yield PathPiece(arc, first, first, float(before.y[-1]), float(before.y[-1]), before)
            return  # all else moves on while the inputs rest
        while True:
            dead = find_turning_point(curve, arc, before, first, last)
            if dead is None:
                break
            at = float(arc.axis @ (dead.y - arc.origin))
            if before is not arc.before and abs(at - first) <= STRAIGHT_TOLERANCE:
                break  # the dead point from which this part starts
            yield PathPiece(arc, first, at, float(before.y[-1]), float(dead.y[-1]), dead)
            first, before = at, dead
        yield PathPiece(arc, first, last, float(before.y[-1]), float(arc.after.y[-1]), None)


def bifurcations_until(tracker: CurveTracker, last: float = np.inf) -> tuple[PathBifurcation, ...]:
    """The change points that a walk has passed up to a place of the inputs on their way."""
    return tuple(
        PathBifurcation(tracker.curve.inputs(each.bifurcation.y), each, tracker.curve.input_direction)
        for each in tracker.passed
        if each.bifurcation.y[-1] <= last + END_TOLERANCE
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
