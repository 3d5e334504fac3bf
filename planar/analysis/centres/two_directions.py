"""The instantaneous centre of a link from two known directions of velocity, as textbooks construct it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr

QUARTER_TURN = np.array([[0.0, -1.0], [1.0, 0.0]])
"""A quarter anticlockwise."""
PARALLEL_TOLERANCE = 1e-9
"""Directions whose sine is no greater than this are one."""


class TwoDirections(NamedTuple):
    """The centre of a link two of whose points have known directions of velocity.

    `homogeneous` (3,) as in `Centre`, None where the link rests; `radius_a` and `radius_b` (m) are the distances to
    it, None where it lies at infinity; `angular_velocity` (rad/s) = v_a / r_a = v_b / r_b; `velocity_b` (2,) (m/s).
    """

    homogeneous: Array | None
    radius_a: float | None
    radius_b: float | None
    angular_velocity: float
    velocity_b: Array

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def position(self) -> Array | None:
        """(2,), m; None at infinity, and where the link rests."""
        if self.homogeneous is None or self.homogeneous[2] == 0.0:
            return None
        found: Array = self.homogeneous[:2] / self.homogeneous[2]
        return found


def centre_of(
    a: Sequence[float], velocity_a: Sequence[float], b: Sequence[float], velocity_b: Sequence[float] | float
) -> TwoDirections:
    """The centre from the velocity of A (2,) and that of B (2,), or its direction (an angle, rad) alone; m, m/s.

    Case 1: the perpendiculars to both velocities meet in it. Case 2, parallel velocities square to AB: the line
    through the arrows' heads meets AB in it; equal velocities put it at infinity. Raises BadInput where A and B are
    one point, or no rigid link can have such velocities, or a direction is not enough.

    >>> import planar
    >>> planar.centre_of((0, 0), (0, 1), (1, 0), (0, 2)).angular_velocity
    1.0
    """
    at_a, at_b, va = (np.array(each, dtype=float) for each in (a, b, velocity_a))
    if not all(each.shape == (2,) and np.isfinite(each).all() for each in (at_a, at_b, va)):
        raise BadInput("centre_of", "points and velocities are pairs of finite numbers")
    reach = float(np.hypot(*(at_b - at_a)))
    if reach <= PARALLEL_TOLERANCE * max(1e-300, np.abs(at_a).max(), np.abs(at_b).max()):
        raise BadInput("centre_of", "A and B are one point, so that their velocities show no centre")
    along = (at_b - at_a) / reach
    vb = _velocity_b(va, along, velocity_b)
    fastest = max(float(np.hypot(*va)), float(np.hypot(*vb)))
    if fastest == 0.0:
        return TwoDirections(None, None, None, 0.0, vb)
    # lengths in those of AB, from A; velocities beside the fastest
    p, q = va / fastest, vb / fastest
    if abs((q - p) @ along) > PARALLEL_TOLERANCE:
        raise BadInput("centre_of", "A and B move apart: along AB the velocities of a rigid link's points are equal")
    at = _meeting_point(p, q, along)
    angular_velocity = float(along @ QUARTER_TURN.T @ (vb - va)) / reach
    if abs(at[2]) <= PARALLEL_TOLERANCE * np.hypot(at[0], at[1]):
        way = np.array([at[0], at[1], 0.0]) / np.hypot(at[0], at[1])
        sign = 1.0 if (way[1], way[0]) > (0.0, 0.0) else -1.0
        return TwoDirections(sign * way + 0.0, None, None, 0.0, vb)
    position = at_a + reach * at[:2] / at[2]
    homogeneous = np.append(position, 1.0)
    radius_a, radius_b = (float(np.hypot(*(position - each))) for each in (at_a, at_b))
    return TwoDirections(homogeneous / np.linalg.norm(homogeneous), radius_a, radius_b, angular_velocity, vb)


def _velocity_b(va: Array, along: Array, given: Sequence[float] | float) -> Array:
    """The velocity of B: as given, or of the size on its direction that leaves AB as long as it is."""
    if np.ndim(given) == 1:
        vb = np.array(given, dtype=float)
        if vb.shape != (2,) or not np.isfinite(vb).all():
            raise BadInput("centre_of", "points and velocities are pairs of finite numbers")
        return vb
    if np.ndim(given) or not np.isfinite(given):
        raise BadInput("centre_of", "the velocity of B is a pair of finite numbers, or the angle of its direction")
    way = np.array([np.cos(given), np.sin(given)])
    if abs(way @ along) > PARALLEL_TOLERANCE:
        return way * float(va @ along / (way @ along))
    if abs(va @ along) > PARALLEL_TOLERANCE * np.hypot(*va):
        raise BadInput("centre_of", "A moves along AB and B square to it, which no rigid link can do")
    raise BadInput("centre_of", "both velocities are square to AB: say how fast B is, its direction is not enough")


def _meeting_point(p: Array, q: Array, along: Array) -> Array:
    """The homogeneous centre (3,), A the origin and AB of length one."""
    origin, other = np.array([0.0, 0.0, 1.0]), np.append(along, 1.0)
    if np.hypot(*p) <= PARALLEL_TOLERANCE:
        return origin
    if np.hypot(*q) <= PARALLEL_TOLERANCE:
        return other
    square_p, square_q = (np.append(QUARTER_TURN @ each / np.hypot(*each), 0.0) for each in (p, q))
    first, second = np.cross(origin, square_p), np.cross(other, square_q)
    if abs(square_p[:2] @ q) > PARALLEL_TOLERANCE * np.hypot(*q):
        return np.cross(first, second)
    if np.hypot(*(q - p)) <= PARALLEL_TOLERANCE:
        return square_p
    heads = np.cross(np.append(p, 1.0), np.append(along + q, 1.0))
    return np.cross(np.cross(origin, other), heads)
