"""Curvature of the paths of a link's points: pole, inflection circle and Euler-Savary, beside v^3 / |v x a|.

A moving point at r from the pole, with the pole's own velocity u along the common tangent of both centrodes, has
v = w k × r and a = alpha k × r - w^2 r - w k × u. What follows from that: O. Bottema, B. Roth, Theoretical Kinematics,
1979, ch. VIII; E. A. Dijksman, Motion Geometry of Mechanisms, 1976, ch. 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot, inf, isnan, nan
from typing import NamedTuple

import numpy as np

from planar.analysis.relative_motion import RelativeMotion, quarter_turn, relative_motion
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, Unknown
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Drive, named_points, replace_inputs
from planar.results.motion import State
from planar.solving.position import PositionSolver

NEGLIGIBLE_RATIO = 1e-9
"""A rate below this part of the greatest is none: rates are good to some 1e-13 of it."""
STRAIGHT_RATIO = 1e9
"""A radius of so many sizes of the mechanism is none: the path has no curvature there."""


class MotionCircle(NamedTuple):
    """A circle: its centre (2,) and its diameter, m."""

    centre: Array
    diameter: float

    def __repr__(self) -> str:
        return short_repr(self)


class PathCurvature(NamedTuple):
    """How the path of a point is curved at a position.

    `radius` (m) is by Euler-Savary, or `direct` where the pole is at infinity; `direct` by v^3 / |v x a|. Both are inf
    where the path is straight (a point of the inflection circle), 0 at a cusp (a point in the pole), NaN where there
    is no path (a point that stays at rest). `centre` (2,), m, is the centre of curvature, None where it is at infinity
    or there is no path.
    """

    position: Array
    radius: float
    direct: float
    centre: Array | None

    def __repr__(self) -> str:
        return short_repr(self)


@dataclass(frozen=True)
class Curvature:
    """The motion of a link against another to second order, in that one's axes; lengths in m, rates per s.

    What does not depend on the input's acceleration: `pole`, `pole_velocity`, `inflection`, and every curvature.
    What does: `bresse`, `acceleration_pole`. None is what there is not, as `reason` says.
    """

    link: str
    other: str
    motion: RelativeMotion
    size: float
    "of the mechanism (m)"
    least: float
    "m/s: a speed that is none"
    members: dict[str, str]
    "the link's own name of every point that it carries, by all its names"
    shape: dict[str, Array]
    pole: Array | None
    "(2,), where the link is at rest"
    pole_velocity: Array | None
    "(2,), m/s, along the common tangent of both centrodes"
    inflection: MotionCircle | None
    "points on it run straight, to second order; it touches the common tangent in the pole"
    bresse: MotionCircle | None
    "points on it have no tangential acceleration (Bresse's second circle); None too where it is a straight line"
    acceleration_pole: Array | None
    "(2,), where the link has no acceleration"
    reason: str
    "why there is no pole or no inflection circle, else empty"

    __repr__ = short_repr

    def path(self, point: str | Sequence[float]) -> PathCurvature:
        """The curvature of the path of a point of the link, by name or by its coordinates (m) in the link's axes.

        Euler-Savary: with r from the pole to the point and e the part of the inflection circle's diameter along r,
        the radius is r^2 / abs(r - e), and the centre lies at r^2 / (r - e) from the point towards the pole. Raises
        Unknown for a point that the link does not carry.
        """
        at = self.motion.points_in_other(self._local_point(point))
        direct, away = self._radius_from_rates(at)
        if self.pole is None or isnan(direct):
            return PathCurvature(at, direct, direct, None if away is None else at + away)
        if direct == 0.0:
            return PathCurvature(at, 0.0, 0.0, self.pole)
        r = at - self.pole
        length = hypot(*r)
        way = r / length
        reach = 0.0 if self.inflection is None else 2.0 * float((self.inflection.centre - self.pole) @ way)
        if length**2 >= STRAIGHT_RATIO * self.size * abs(length - reach):
            return PathCurvature(at, inf, direct, None)
        signed = length**2 / (length - reach)
        return PathCurvature(at, abs(signed), direct, at - signed * way)

    def _local_point(self, point: str | Sequence[float]) -> Array:
        if not isinstance(point, str):
            return np.array(point, dtype=float).reshape(2)
        if point not in self.members:
            raise Unknown(f"link {self.link!r} carries no point {point!r}; its points are {', '.join(self.shape)}")
        return self.shape[self.members[point]]

    def _radius_from_rates(self, at: Array) -> tuple[float, Array | None]:
        """The radius from velocity and acceleration of a point, and the way from it to the centre."""
        m = self.motion
        r = at - m.origin
        v = m.velocity + m.angular_velocity * quarter_turn(r)
        a = m.acceleration + m.angular_acceleration * quarter_turn(r) - m.angular_velocity**2 * r
        speed = hypot(*v)
        if speed <= self.least:
            # in the pole: a cusp, unless the pole stays there as well
            stays = self.pole is None or self.pole_velocity is None or hypot(*self.pole_velocity) <= self.least
            return (nan if stays else 0.0), None
        bend = float(v[0] * a[1] - v[1] * a[0])
        if speed**3 >= STRAIGHT_RATIO * self.size * abs(bend):
            return inf, None
        return speed**3 / abs(bend), quarter_turn(v) * (speed**2 / bend)


@takes_result("State")
def curvature(state: State, link: str, other: str | None = None) -> Curvature:
    """The motion of a link to second order as seen from another (left out: the frame), for the curvature of paths.

    Where the only input is at rest, rates are per unit of it (1 rad/s or 1 m/s, no acceleration). Raises Unknown
    for a link that is not there, BadInput where several inputs are all at rest, so that no ratio of their rates is
    given.

    >>> import planar
    >>> state = planar.solve(planar.load("four-bar"))
    >>> [round(float(each), 3) for each in planar.curvature(state, "BC").pole]
    [0.076, 0.132]
    """
    other = state.mechanism.frame if other is None else other
    relative_motion(state.frames, link, other)  # refuses what there is not
    state = _at_unit_rate(state)
    motion = relative_motion(state.frames, link, other)
    size = _size(state)
    fastest = max(
        max(float(hypot(*each.velocity)), size * abs(float(each.angular_velocity)))
        for each in (
            relative_motion(state.frames, name, state.mechanism.frame)
            for name in state.frames
            if name != state.mechanism.frame
        )
    )
    members = {
        name: point
        for each in named_points(state.mechanism)
        for owner, point in each.members
        if owner == link
        for name in (each.name, f"{link}.{point}", point)
    }
    shape = {name: np.array(at, dtype=float) for name, at in state.shapes[link].points.items()}
    found = _second_order_motion(motion, link, other, size, NEGLIGIBLE_RATIO * fastest)
    return Curvature(link, other, motion, size, NEGLIGIBLE_RATIO * fastest, members, shape, *found)


def _at_unit_rate(state: State) -> State:
    """The state, with a unit rate of its input where that is at rest."""
    inputs = state.mechanism.inputs
    if any(given.velocity for given in inputs) or not inputs:
        return state
    if len(inputs) > 1:
        names = ", ".join(given.pair for given in inputs)
        raise BadInput("inputs", f"the inputs {names} are all at rest: give one a velocity, for how the links move")
    return PositionSolver(replace_inputs(state.mechanism, (Drive(inputs[0].pair, None, 1.0, 0.0),))).state_with_rates(
        state
    )


def _size(state: State) -> float:
    points = np.array([point.position for point in state.points.values()]).reshape(-1, 2)
    return float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0


_SecondOrderMotion = tuple[Array | None, Array | None, MotionCircle | None, MotionCircle | None, Array | None, str]


def _second_order_motion(
    motion: RelativeMotion, link: str, other: str, size: float, least: float
) -> _SecondOrderMotion:
    """Pole, its velocity, inflection circle, Bresse's second circle, acceleration pole; and what there is to say."""
    turning, hastening = float(motion.angular_velocity), float(motion.angular_acceleration)
    still = max(hypot(*motion.velocity), size * abs(turning)) <= least
    if still:
        return None, None, None, None, None, f"{link} and {other} move as one here, so that no path is drawn"
    # the centre of acceleration: a + alpha k × r - w^2 r = 0 is solved for r
    a, spread = motion.acceleration, turning**4 + hastening**2
    far = spread == 0.0 or size * spread**0.5 <= NEGLIGIBLE_RATIO * hypot(*a)
    centre = None if far else motion.origin + (turning**2 * a + hastening * quarter_turn(a)) / spread
    if size * abs(turning) <= NEGLIGIBLE_RATIO * hypot(*motion.velocity):
        told = f"{link} slides against {other} without turning here: the pole is at infinity, all points are as fast"
        return None, None, None, None, centre, told
    reach = quarter_turn(motion.velocity) / turning
    pole = motion.origin + reach
    # what lies in the pole has a = -w k × u
    u = quarter_turn(a + hastening * quarter_turn(reach) - turning**2 * reach) / turning
    if hypot(*u) <= least:
        told = f"the pole of {link} against {other} stays where it is, so that there is no inflection circle"
        return pole, np.zeros(2), None, None, centre, told
    across = -quarter_turn(u) / turning
    inflection = MotionCircle(pole + across / 2.0, hypot(*across))
    if abs(hastening) * size <= NEGLIGIBLE_RATIO * abs(turning) * hypot(*u):
        return pole, u, inflection, None, centre, ""
    along = u * (turning / hastening)
    return pole, u, inflection, MotionCircle(pole + along / 2.0, hypot(*along)), centre, ""
