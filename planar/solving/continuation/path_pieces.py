"""The parts of a curve of positions between dead points, on each of which the inputs go one way."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.root_finding import find_root
from planar.solving.continuation.fast_path import STRAIGHT_TOLERANCE
from planar.solving.continuation.predictor_corrector import AT_BIFURCATION_DISTANCE, CurveTracker, PassedBifurcation
from planar.solving.continuation.solution_curve import Arc, CurvePoint, SolutionCurve

Array = np.ndarray

MAX_CORRECTION_RATIO = 0.1
"""A correction longer than this part of an arc has gone astray."""
DEAD_POINT_TOLERANCE = 1e-7
"""The square root of twice what the inputs may have left (rad or sizes) of their way to where they turn back at a dead
point to rounding; also the least rate of the inputs along the curve from which one is left."""
ZERO_INPUT_RATE = 1e-13
"""A rate of the inputs along the curve, for one of what is farthest out, that is rounding."""
END_TOLERANCE = 1e-9
"""rad or sizes: so near to the end of a path a dead point, a change point or the end of a piece is at that end."""


class BranchRates(NamedTuple):
    """Rates where a slope is singular: first, second and third derivative of the unknowns (3, unknowns) by the distance
    of the inputs along a way; and how much rank the slope lacks at the change point."""

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
        """The unknowns where the inputs are at a place, with their rates where the slope is singular."""
        arc = self.arc
        if self.dead_point is not None and position == self.stop:
            return self.dead_point.y[:-1], None
        x = find_root(lambda x: float(arc.polynomial(x)[-1]) - position, self.first, self.last)
        rough = arc.polynomial(x)
        rough[-1] = position
        if arc.is_exact:
            return curve.correct_at_inputs(rough, arc.rank_loss)[:-1], BranchRates(
                derivatives_by_input(arc, x), curve.input_direction, arc.rank_loss
            )
        ahead = np.zeros_like(rough)
        ahead[-1] = 1.0
        y = curve.correct(rough, ahead)
        if (
            y is None
            or np.linalg.norm(y - rough) > MAX_CORRECTION_RATIO * abs(self.last - self.first)
            or not curve.is_closed(y)
        ):
            y = arc.curve_coordinates(
                curve, find_root(lambda x: float(arc.curve_coordinates(curve, x)[-1]) - position, self.first, self.last)
            )
        return y[:-1], None


def path_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
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


def is_dead_point(point: CurvePoint) -> bool:
    """Whether a point is a dead point to rounding.

    With rate g and second derivative b of the inputs by arc length it is g^2 / 2b before where they turn back. A small
    rate alone does not tell: it is small as well where slides go far out for little of the inputs.
    """
    g, b = float(point.tangent[-1]), float(point.curvature[-1])
    return (
        g * g <= DEAD_POINT_TOLERANCE**2 * abs(b) or abs(g) * max(1.0, float(np.max(np.abs(point.y)))) < ZERO_INPUT_RATE
    )


def start_point(curve: SolutionCurve, y: Array, branches: list[int]) -> CurvePoint:
    """The point at y, to be left so that the inputs go on.

    At a dead point two ways lead on: the first so that the most moved unknown grows; a number is taken off `branches`.
    """
    ahead = np.zeros_like(y)
    ahead[-1] = 1.0
    here = curve.point_at(y, ahead)
    if is_dead_point(here) and here.regular_distance > AT_BIFURCATION_DISTANCE:
        most = int(np.argmax(np.abs(here.tangent)))
        second = bool(branches) and branches.pop(0) > 1
        return here if bool(here.tangent[most] > 0.0) is not second else here.reversed()
    return here


def find_turning_point(
    curve: SolutionCurve, arc: Arc, before: CurvePoint, first: float, last: float
) -> CurvePoint | None:
    """The first dead point on an arc between two places on its axis, at which the inputs turn back, if there is one."""
    g0 = before.input_rate
    # of a dead point that was found on the arc rounding may leave more, on a small curve, than is a rest anywhere
    from_dead = before is not arc.before or is_dead_point(before)
    if from_dead:
        g0 = DEAD_POINT_TOLERANCE * float(np.sign(before.curvature[-1]))
    sense = float(np.sign(g0))
    g0, g1 = abs(g0), sense * arc.after.input_rate
    if is_dead_point(arc.after) and not from_dead and sense * arc.after.curvature[-1] < 0.0:
        # at its very end, whichever sign rounding gives what is left of the rate
        left = arc.after.input_rate / abs(float(arc.after.curvature[-1]))
        return arc.after if arc.is_exact else arc.point_at(curve, last + sense * left * float(np.sign(last - first)))
    if g1 > 0.0:
        # between two points that go on the inputs may have gone back in the meantime
        s0, s1, gone = sense * before.curvature[-1], sense * arc.after.curvature[-1], abs(last - first)
        if s0 >= 0.0 or s1 <= 0.0:
            return None
        least, part = min(
            (cubic_hermite(g0, s0 * gone, g1, s1 * gone, part), part) for part in np.linspace(0.05, 0.95, 19)
        )
        x = first + part * (last - first)
        if least > 0.0 or sense * arc.point_at(curve, x).input_rate > 0.0:
            return None
        last = x
    at = find_root(lambda x: sense * arc.point_at(curve, x).input_rate if x != first else g0, first, last)
    return arc.point_at(curve, at)


def cubic_hermite(g0: float, s0: float, g1: float, s1: float, part: float) -> float:
    """The cubic with these values and slopes at 0 and 1, at a part of the way between."""
    t = part
    return (2 * t**3 - 3 * t**2 + 1) * g0 + (t**3 - 2 * t**2 + t) * s0 + (3 * t**2 - 2 * t**3) * g1 + (t**3 - t**2) * s1


def derivatives_by_input(arc: Arc, x: float) -> Array:
    """The first three derivatives of the unknowns by the place of the inputs (3, unknowns), on an exact arc."""
    y1, y2, y3 = (arc.polynomial(x, order) for order in (1, 2, 3))
    t1, t2, t3 = y1[-1], y2[-1], y3[-1]
    # the chain rule, solved for the derivatives of the inverse
    x1 = 1.0 / t1
    x2 = -t2 * x1**3
    x3 = (3.0 * t2**2 / t1 - t3) * x1**4
    return np.array([y1 * x1, y2 * x1**2 + y1 * x2, y3 * x1**3 + 3.0 * y2 * x1 * x2 + y1 * x3])[:, :-1]
