"""How a cam meets its follower: the follower's face, where it rests on the base circle, and where the two touch.

The formulas follow from the envelope of the follower's face in the cam's axes: J. E. Shigley, J. J. Uicker, Theory of
Machines and Mechanisms, McGraw-Hill 1980, ch. 6; R. L. Norton, Cam Design and Manufacturing Handbook, 2nd ed.,
Industrial Press 2009, ch. 7.
"""

from __future__ import annotations

from math import nan
from typing import NamedTuple

import numpy as np

from planar.foundation.geometry import Vector, direction
from planar.foundation.jets import Scalar, atan2, hypot, sqrt


class FollowerAxes(NamedTuple):
    """How a follower is guided, in the axes of the link that carries it and the cam (m, rad).

    A sliding one goes from `origin` along `line`, a swinging one (`line` None) turns about `origin`; its `arm` leads
    from there to the middle of its face at the angle zero of the follower against the carrier. `side` is 1 where
    turning anticlockwise lifts a swinging follower, else -1.
    """

    centre: Vector
    "of the cam"
    origin: Vector
    line: Vector | None
    arm: Vector
    side: float


class FollowerFace(NamedTuple):
    """What touches the cam: a roller about the middle of the face with a radius (m), zero for a point; or a flat face
    whose normal, away from the cam, has a direction in the follower (a unit vector against its axes)."""

    roller_radius: Scalar
    normal: Vector | None


class FollowerRest(NamedTuple):
    """How a follower rests on the base circle, whose radius is the last (m)."""

    axes: FollowerAxes
    face: FollowerFace
    base_radius: Scalar


class CamContact(NamedTuple):
    """Where a cam and its follower touch, in the carrier's axes from the cam's centre (m).

    `normal` is of length one, away from the cam; `velocity` the way in which the follower's point of contact moves as
    the lift grows, by the lift (of a swinging follower by its angle); `middle` the middle of the roller, or of what a
    flat face turns or slides with; `curvature_radius` that of the cam's profile, above zero where it is convex (m), and
    `pitch_radius` that of the curve of the roller's middle.
    """

    point: Vector
    normal: Vector
    velocity: Vector
    middle: Vector
    curvature_radius: Scalar
    pitch_radius: Scalar


def turn_left(vector: Vector) -> Vector:
    """A vector turned anticlockwise by a right angle."""
    return Vector(-vector.y, vector.x)


def rest_position(axes: FollowerAxes, face: FollowerFace, base_radius: Scalar) -> Scalar:
    """The follower's displacement along its line (m), or its angle (rad), where it rests on the base circle.

    NaN where it cannot.
    """
    if axes.line is not None:
        to_centre = axes.centre - axes.origin
        if face.normal is not None:
            return (base_radius + face.normal.dot(to_centre - axes.arm)) / face.normal.dot(axes.line)
        reach = base_radius + face.roller_radius
        offset = axes.line.cross(to_centre)
        return axes.line.dot(to_centre) + _root(reach * reach - offset * offset)
    apart = axes.centre - axes.origin
    distance = hypot(apart.x, apart.y)
    if face.normal is not None:
        cosine = (face.normal.dot(axes.arm) - base_radius) / distance
        turned = face.normal
    else:
        length, reach = hypot(axes.arm.x, axes.arm.y), base_radius + face.roller_radius
        cosine = (length * length + distance * distance - reach * reach) / (2.0 * length * distance)
        turned = axes.arm
    return atan2(apart.y, apart.x) + arc_opening(cosine) * axes.side - atan2(turned.y, turned.x)


def arc_opening(cosine: Scalar) -> Scalar:
    """The angle from 0 to pi of this cosine; NaN where there is none."""
    return atan2(_root(1.0 - cosine * cosine), cosine)


def rest_problem(axes: FollowerAxes, face: FollowerFace, base_radius: float) -> str:
    """Why the follower cannot rest on the base circle; empty where it can."""
    to_centre = axes.centre - axes.origin
    reach = base_radius + float(face.roller_radius)
    if axes.line is not None:
        if face.normal is not None:
            return "" if face.normal.dot(axes.line) > 1e-6 else "the flat face lies along the line of the follower"
        return "" if reach > abs(axes.line.cross(to_centre)) else "its line passes the cam's base circle by"
    distance, length = hypot(*map(float, to_centre)), hypot(*map(float, axes.arm))
    if face.normal is not None:
        short = abs(face.normal.dot(axes.arm) - base_radius) < distance
        return "" if short else "its flat face does not reach the base circle"
    if not length > 0.0:
        return "its arm has no length"
    return "" if abs(length - distance) < reach < length + distance else "its arm does not reach the base circle"


def find_contact(
    axes: FollowerAxes,
    face: FollowerFace,
    base_radius: Scalar,
    lift: tuple[Scalar, ...],
    sense: float,
) -> CamContact:
    """Where the two touch at a lift with its derivatives by the cam's angle; `sense` 1: the cam runs anticlockwise.

    The lift's third derivative is not needed.
    """
    s, s1, s2 = lift[:3]
    position = rest_position(axes, face, base_radius)
    if axes.line is not None:
        middle = axes.origin + axes.arm + axes.line * (position + s) - axes.centre
        first, second, along, turned = axes.line * s1, axes.line * s2, axes.line, None
    else:
        turned = direction(position + axes.side * s)
        arm = axes.arm.rotate(turned)
        middle, along = axes.origin + arm - axes.centre, turn_left(arm) * axes.side
        first, second = along * s1, along * s2 - arm * (s1 * s1)
    if face.normal is not None:
        return _flat_contact(axes, face.normal, (s1, s2), sense, middle, turned)
    # the curve of the roller's middle in the cam's axes, turned back: its tangent, and how that goes on
    tangent = first - turn_left(middle) * sense
    bend = second - turn_left(first) * (2.0 * sense) - middle
    size = hypot(tangent.x, tangent.y)
    normal = turn_left(tangent) * (sense / size)
    # where the curve is straight the radius is without bound: nothing is wrong with that
    pitch = _ratio(size * size * size, tangent.cross(bend) * -sense)
    radius = face.roller_radius
    return CamContact(middle - normal * radius, normal, along, middle, pitch - radius, pitch)


def _flat_contact(
    axes: FollowerAxes, face: Vector, rates: tuple[Scalar, Scalar], sense: float, middle: Vector, turned: Vector | None
) -> CamContact:
    """The same for a flat face: a line whose distance from the cam's centre goes with its normal's direction."""
    s1, s2 = rates
    if turned is None:
        assert axes.line is not None
        normal, turning, bend = face, -sense + 0.0 * s1, 0.0 * s1
        distance = normal.dot(middle)
        d1, d2 = normal.dot(axes.line) * s1, normal.dot(axes.line) * s2
    else:
        normal, turning, bend = face.rotate(turned), axes.side * s1 - sense, axes.side * s2
        distance = normal.dot(middle)
        # the pivot keeps its distance from the face: only the centre's, as seen along the normal, goes on
        across, back = turn_left(normal).dot(axes.origin - axes.centre), normal.dot(axes.origin - axes.centre)
        d1 = across * axes.side * s1
        d2 = across * axes.side * s2 - back * s1 * s1
    by_normal = d1 / turning
    radius = distance + (d2 * turning - d1 * bend) / (turning * turning * turning)
    point = normal * distance + turn_left(normal) * by_normal
    along = axes.line
    if turned is not None:
        along = turn_left(point + axes.centre - axes.origin) * axes.side
    assert along is not None
    return CamContact(point, normal, along, middle, radius, radius)


def _root(square: Scalar) -> Scalar:
    """A square root; NaN of a number below zero."""
    if isinstance(square, float):
        return sqrt(square) if square >= 0.0 else nan
    with np.errstate(invalid="ignore", divide="ignore"):  # a jet takes the roots of arrays as well
        return np.sqrt(square) if isinstance(square, np.ndarray) else sqrt(square)


def _ratio(above: Scalar, below: Scalar) -> Scalar:
    """A quotient; infinite where a number is divided by zero."""
    if isinstance(below, float) and below == 0.0:
        return float("inf")
    if not isinstance(below, np.ndarray):
        return above / below
    with np.errstate(divide="ignore"):
        return above / below
