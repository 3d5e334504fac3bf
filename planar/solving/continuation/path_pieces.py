"""The parts of a curve of positions between dead points, on each of which the inputs go one way."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.root_finding import root
from planar.solving.continuation.fast_path import STRAIGHT
from planar.solving.continuation.predictor_corrector import AT, Passed, Walk
from planar.solving.continuation.solution_curve import Arc, Curve, Point

Array = np.ndarray

NEARLY = 0.1
"""A correction longer than this part of an arc has gone astray."""
RESTING = 1e-7
"""The square root of twice what the inputs may have left (rad or sizes) of their way to where they turn back at a dead
point to rounding; also the least rate of the inputs along the curve from which one is left."""
STUCK = 1e-13
"""A rate of the inputs along the curve, for one of what is farthest out, that is rounding."""
SEAM = 1e-9
"""rad or sizes: so near to the end of a way a change point is at that end."""


class Local(NamedTuple):
    """Rates where a slope is singular: first, second and third derivative of the unknowns (3, unknowns) by the distance
    of the inputs along a way; and how much rank the slope lacks at the change point."""

    rates: Array
    way: Array
    lost: int


class Met(NamedTuple):
    """A change point on the way: the unknowns and inputs there, what the walk knows of it, and along which way."""

    u: Array
    passed: Passed
    way: Array


class Piece(NamedTuple):
    """A part of an arc on which the inputs go one way: from and to where on its axis, from and to where on the way of
    the inputs, and the dead point at its end, if one is there."""

    arc: Arc
    first: float
    last: float
    start: float
    stop: float
    dead: Point | None

    def holds(self, place: float) -> bool:
        """Whether the inputs come to a place within this piece."""
        return min(self.start, self.stop) <= place <= max(self.start, self.stop)

    def at(self, curve: Curve, place: float) -> tuple[Array, Local | None]:
        """The unknowns where the inputs are at a place, with their rates where the slope is singular."""
        arc = self.arc
        if self.dead is not None and place == self.stop:
            return self.dead.y[:-1], None
        x = root(lambda x: float(arc.rough(x)[-1]) - place, self.first, self.last)
        rough = arc.rough(x)
        rough[-1] = place
        if arc.exact:
            return curve.closed(rough, arc.lost)[:-1], Local(derivatives(arc, x), curve.way, arc.lost)
        ahead = np.zeros_like(rough)
        ahead[-1] = 1.0
        y = curve.corrected(rough, ahead)
        if y is None or np.linalg.norm(y - rough) > NEARLY * abs(self.last - self.first) or not curve.closes(y):
            y = arc.y(curve, root(lambda x: float(arc.y(curve, x)[-1]) - place, self.first, self.last))
        return y[:-1], None


def pieces(walk: Walk) -> Iterator[Piece]:
    """A walk's arcs, parted at dead points."""
    curve = walk.curve
    if rests(walk.here) and walk.here.bend[-1] < 0.0:
        here = walk.here
        yield Piece(Arc(here, here, here.y, here.tangent, 1.0, here.y[None], 1), 0.0, 0.0, 0.0, 0.0, here)
    for arc in walk.arcs():
        (first, last), before = arc.ends, arc.before
        if rests(before) and rests(arc.after) and abs(arc.after.y[-1] - before.y[-1]) < SEAM:
            yield Piece(arc, first, first, float(before.y[-1]), float(before.y[-1]), before)
            return  # all else moves on while the inputs rest
        while True:
            dead = turning(curve, arc, before, first, last)
            if dead is None:
                break
            at = float(arc.axis @ (dead.y - arc.origin))
            if before is not arc.before and abs(at - first) <= STRAIGHT:
                break  # the dead point from which this part starts
            yield Piece(arc, first, at, float(before.y[-1]), float(dead.y[-1]), dead)
            first, before = at, dead
        yield Piece(arc, first, last, float(before.y[-1]), float(arc.after.y[-1]), None)


def met(walk: Walk, last: float = np.inf) -> tuple[Met, ...]:
    """The change points that a walk has passed up to a place of the inputs on their way."""
    return tuple(
        Met(walk.curve.inputs(each.crossing.y), each, walk.curve.way)
        for each in walk.passed
        if each.crossing.y[-1] <= last + SEAM
    )


def rests(point: Point) -> bool:
    """Whether a point is a dead point to rounding.

    With rate g and second derivative b of the inputs by arc length it is g^2 / 2b before where they turn back. A small
    rate alone does not tell: it is small as well where slides go far out for little of the inputs.
    """
    g, b = float(point.tangent[-1]), float(point.bend[-1])
    return g * g <= RESTING**2 * abs(b) or abs(g) * max(1.0, float(np.max(np.abs(point.y)))) < STUCK


def onwards(curve: Curve, y: Array, branches: list[int]) -> Point:
    """The point at y, to be left so that the inputs go on.

    At a dead point two ways lead on: the first so that the most moved unknown grows; a number is taken off `branches`.
    """
    ahead = np.zeros_like(y)
    ahead[-1] = 1.0
    here = curve.at(y, ahead)
    if rests(here) and here.clear > AT:
        most = int(np.argmax(np.abs(here.tangent)))
        second = bool(branches) and branches.pop(0) > 1
        return here if bool(here.tangent[most] > 0.0) is not second else here.turned()
    return here


def turning(curve: Curve, arc: Arc, before: Point, first: float, last: float) -> Point | None:
    """The first dead point on an arc between two places on its axis, at which the inputs turn back, if there is one."""
    g0 = before.advance
    # of a dead point that was found on the arc rounding may leave more, on a small curve, than is a rest anywhere
    from_dead = before is not arc.before or rests(before)
    if from_dead:
        g0 = RESTING * float(np.sign(before.bend[-1]))
    sense = float(np.sign(g0))
    g0, g1 = abs(g0), sense * arc.after.advance
    if rests(arc.after) and not from_dead and sense * arc.after.bend[-1] < 0.0:
        # at its very end, whichever sign rounding gives what is left of the rate
        left = arc.after.advance / abs(float(arc.after.bend[-1]))
        return arc.after if arc.exact else arc.at(curve, last + sense * left * float(np.sign(last - first)))
    if g1 > 0.0:
        # between two points that go on the inputs may have gone back in the meantime
        s0, s1, gone = sense * before.bend[-1], sense * arc.after.bend[-1], abs(last - first)
        if s0 >= 0.0 or s1 <= 0.0:
            return None
        least, part = min((cubic(g0, s0 * gone, g1, s1 * gone, part), part) for part in np.linspace(0.05, 0.95, 19))
        x = first + part * (last - first)
        if least > 0.0 or sense * arc.at(curve, x).advance > 0.0:
            return None
        last = x
    at = root(lambda x: sense * arc.at(curve, x).advance if x != first else g0, first, last)
    return arc.at(curve, at)


def cubic(g0: float, s0: float, g1: float, s1: float, part: float) -> float:
    """The cubic with these values and slopes at 0 and 1, at a part of the way between."""
    t = part
    return (2 * t**3 - 3 * t**2 + 1) * g0 + (t**3 - 2 * t**2 + t) * s0 + (3 * t**2 - 2 * t**3) * g1 + (t**3 - t**2) * s1


def derivatives(arc: Arc, x: float) -> Array:
    """The first three derivatives of the unknowns by the place of the inputs (3, unknowns), on an exact arc."""
    y1, y2, y3 = (arc.rough(x, order) for order in (1, 2, 3))
    t1, t2, t3 = y1[-1], y2[-1], y3[-1]
    # the chain rule, solved for the derivatives of the inverse
    x1 = 1.0 / t1
    x2 = -t2 * x1**3
    x3 = (3.0 * t2**2 / t1 - t3) * x1**4
    return np.array([y1 * x1, y2 * x1**2 + y1 * x2, y3 * x1**3 + 3.0 * y2 * x1 * x2 + y1 * x3])[:, :-1]
