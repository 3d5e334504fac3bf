"""Records in results: points, links, pairs, limits, as arrays with names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, value_and_rates
from planar.foundation.short_repr import short_repr


class PointState(NamedTuple):
    """A point's position (m), velocity (m/s) and acceleration (m/s^2), each (2,), in the frame's axes.

    `sense` says in words which way it moves and whether it speeds up.
    """

    position: Array
    velocity: Array
    acceleration: Array
    sense: str

    def __repr__(self) -> str:
        return short_repr(self)


class LinkState(NamedTuple):
    """A link's angle (rad), angular velocity (rad/s) and angular acceleration (rad/s^2), anticlockwise positive.

    `sense` says in words which way it turns and whether it speeds up.
    """

    angle: float
    angular_velocity: float
    angular_acceleration: float
    sense: str

    def __repr__(self) -> str:
        return short_repr(self)


class InputState(NamedTuple):
    """An input's position, velocity and acceleration: rad or m, and per second."""

    position: float
    velocity: float
    acceleration: float

    def __repr__(self) -> str:
        return short_repr(self)


class PointMotion(NamedTuple):
    """A point's position (m), velocity (m/s) and acceleration (m/s^2) at every position of a motion, each (n, 2)."""

    position: Array
    velocity: Array
    acceleration: Array

    def __repr__(self) -> str:
        return short_repr(self)


class LinkMotion(NamedTuple):
    """A link's angle (rad, counted on from turn to turn) with its first and second rate, each (n,)."""

    angle: Array
    angular_velocity: Array
    angular_acceleration: Array

    def __repr__(self) -> str:
        return short_repr(self)


class InputMotion(NamedTuple):
    """An input's position, velocity and acceleration (rad or m, and per second), each (n,)."""

    position: Array
    velocity: Array
    acceleration: Array

    def __repr__(self) -> str:
        return short_repr(self)


class Limit(NamedTuple):
    """Where a motion cannot go on as it came, or an output turns back: solved for, to round-off of the input.

    `kind` is "input dead point" (the input turns back), "stroke end" (the output `of` turns back), "stop" (the pair
    `of` meets its stop), "change point" (branches of the motion cross), or "not followed further" where what lies
    beyond takes too much work. `of` is the pair whose relative motion turns back or stops: the input's own at the
    first, the output's at the second, the running input's where branches cross. `input` is the position of the input
    that runs (rad or m), in a run in time the time (s). `value` is the output's position there (rad or m), `end` for a
    slide's two ends "TDC" or "BDC" (farther from the driving crank's fixed pin, and nearer), `told` what there is to
    say of it, as where the other branches lead.
    """

    kind: str
    of: str
    input: float
    value: float
    end: str | None = None
    told: str = ""

    def __repr__(self) -> str:
        return short_repr(self)


class RelativeState(NamedTuple):
    """How one point moves against another, as seen from the axes of a link that carries the other.

    Vectors (2,), of a motion (n, 2); SI.

    velocity = rotation + sliding, acceleration = centripetal + tangential + coriolis + sliding_acceleration,
    where for two points of one link both sliding parts and the Coriolis part vanish.
    """

    axes: str
    position: Array
    velocity: Array
    rotation: Array
    sliding: Array
    acceleration: Array
    centripetal: Array
    tangential: Array
    coriolis: Array
    sliding_acceleration: Array

    def __repr__(self) -> str:
        return short_repr(self)


class ThirdRates(NamedTuple):
    """Frames of links and own coordinates of pairs over a motion, as jets that have third rates as well."""

    frames: Mapping[str, Frame]
    own: Mapping[str, tuple[Jet, ...]]

    def __repr__(self) -> str:
        return short_repr(self)


HALF_TURN_TOLERANCE = 1e-9
"""rad: an angle so little beyond half a turn is told as half a turn."""


def principal_angle(angle: float) -> float:
    """The same direction as an angle between -pi and pi; one that is there already to the last bit."""
    return wrap_angle(float(angle)) if abs(angle) > np.pi else angle


def principal_turns(angles: Array) -> float:
    """The whole turns (rad) to add to angles so that their least lies between -pi and pi, as positions have it.

    Of such as turn right round it is the first that lies there.
    """
    first = float(angles[0] if np.ptp(angles) >= 2.0 * np.pi else np.min(angles))
    return 0.0 if abs(first) <= np.pi + HALF_TURN_TOLERANCE else principal_angle(first) - first


def third_rate(value: Any) -> Any:
    """The third rate of a jet that has one; a plain number is at rest."""
    return value.parts[3] if isinstance(value, Jet) else 0.0


def vector_and_rates(vector: Vector) -> list[tuple[Any, Any]]:
    """x and y of a vector, then of its rates."""
    return list(zip(value_and_rates(vector.x), value_and_rates(vector.y), strict=True))


def scales(points: Array, angles: Array) -> tuple[tuple[float, float], tuple[float, float]]:
    """The greatest rates, beside which others are at rest: of points (m/s, m/s^2), and of links (rad/s, rad/s^2).

    From the places of points with their rates, (n, 3, 2), and the angles of links with theirs, (n, 3). v among points
    that are l apart at most is good for an acceleration of v^2 / l and for omega = v / l, and omega for omega^2.
    """
    speed, push = np.hypot(points[:, 1:, 0], points[:, 1:, 1]).max(axis=0, initial=0.0)
    size = np.hypot(*np.ptp(points[:, 0], axis=0)) if len(points) else 0.0
    turning, swing = np.abs(angles[:, 1:]).max(axis=0, initial=0.0)
    if size:
        push, turning = max(push, speed**2 / size), max(turning, speed / size)
    return (float(speed), float(push)), (float(turning), float(max(swing, turning**2)))


def stack_vectors(x: Any, y: Any) -> Array:
    """x and y as vectors (..., 2)."""
    return np.stack(np.broadcast_arrays(np.asarray(x, dtype=float), y), axis=-1)


def rotate_quarter_turn(vectors: Array) -> Array:
    """Vectors (..., 2) turned a quarter anticlockwise."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
