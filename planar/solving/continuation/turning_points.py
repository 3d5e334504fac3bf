"""Dead points on a curve of positions: where its inputs turn back, to round-off."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, greatest_size
from planar.foundation.root_finding import find_root, lowest_on_cubic
from planar.solving.continuation.bifurcation import AT_BIFURCATION_DISTANCE
from planar.solving.continuation.solution_curve import Arc, CurvePoint, SolutionCurve

DEAD_POINT_TOLERANCE = 1e-7
"""The square root of twice what the inputs may have left (rad or sizes) of their way to where they turn back at a dead
point to rounding; also the least rate of the inputs along the curve from which one is left."""
ZERO_INPUT_RATE = 1e-13
"""A rate of the inputs along the curve, for one of what is farthest out, that is rounding."""


def is_dead_point(point: CurvePoint) -> bool:
    """Whether a point is a dead point to rounding.

    With rate g and second derivative b of the inputs by arc length it is g^2 / 2b before where they turn back. A small
    rate alone does not tell: it is small as well where slides go far out for little of the inputs.
    """
    g, b = float(point.tangent[-1]), float(point.curvature[-1])
    return g * g <= DEAD_POINT_TOLERANCE**2 * abs(b) or abs(g) * max(1.0, greatest_size(point.y)) < ZERO_INPUT_RATE


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
        least, part = lowest_on_cubic((g0, s0 * gone), (g1, s1 * gone))
        x = first + part * (last - first)
        if least > 0.0 or sense * arc.point_at(curve, x).input_rate > 0.0:
            return None
        last = x
    at = find_root(lambda x: sense * arc.point_at(curve, x).input_rate if x != first else g0, first, last)
    return arc.point_at(curve, at)
