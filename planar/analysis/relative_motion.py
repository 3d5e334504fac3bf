"""The motion of one link seen from another: the pole, and how fast it moves on."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import Unknown, suggest_name
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import value_and_rates
from planar.foundation.short_repr import short_repr


class RelativeMotion(NamedTuple):
    """The motion of a link in the axes of another: where its own axes are, how they turn, each with two rates.

    Of one position, or of n of them: vectors (2,) or (n, 2), turns () or (n,). SI.
    """

    origin: Array
    velocity: Array
    acceleration: Array
    angle: Array
    angular_velocity: Array
    "angular velocity"
    angular_acceleration: Array
    "angular acceleration"

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def fixed_pole(self) -> tuple[Array, Array]:
        """The pole in the axes of the other link, with its rate: each (..., 3), homogeneous.

        It is w times the point (x, y, 1) that is at rest, where w is the angular velocity: from v + w k × (r - o) = 0,
        r = o + k × v / w. Where the link only slides, w = 0 and the pole lies at infinity, square to v.
        """
        w, alpha = self.angular_velocity[..., None], self.angular_acceleration[..., None]
        at = w * self.origin + quarter_turn(self.velocity)
        rate = alpha * self.origin + w * self.velocity + quarter_turn(self.acceleration)
        return np.concatenate([at, w], axis=-1), np.concatenate([rate, alpha], axis=-1)

    @property
    def moving_pole(self) -> tuple[Array, Array]:
        """The same pole in the link's own axes, with its rate as seen from there."""
        w, alpha = self.angular_velocity[..., None], self.angular_acceleration[..., None]
        at = self.vectors_in_link(quarter_turn(self.velocity))
        rate = self.vectors_in_link(quarter_turn(self.acceleration)) - w * quarter_turn(at)
        return np.concatenate([at, w], axis=-1), np.concatenate([rate, alpha], axis=-1)

    def vectors_in_link(self, vectors: Array) -> Array:
        """Vectors of the other link's axes in the link's own."""
        return _rotate(vectors, -self.angle)

    def points_in_other(self, points: Array) -> Array:
        """Where points of the link lie in the axes of the other."""
        return self.origin + _rotate(points, self.angle)


def relative_motion(frames: Mapping[str, Frame], link: str, other: str) -> RelativeMotion:
    """The motion of a link against another, from frames that are jets. Raises Unknown."""
    for name in (link, other):
        if name not in frames:
            raise Unknown(f"there is no link {name!r}{suggest_name(name, frames, 'links')}")
    if link == other:
        raise Unknown(f"a motion is of one link against another, and both are {link!r}")
    moved, base = frames[link], frames[other]
    at, angle = base.to_local(Vector(moved.x, moved.y)), moved.angle - base.angle
    x, y, turned = (_value_and_rates(value) for value in (at.x, at.y, angle))
    places = (np.stack(np.broadcast_arrays(*both), axis=-1) for both in zip(x, y, strict=True))
    shape = np.broadcast_shapes(*(np.shape(part) for part in (*x, *y, *turned)))
    vectors = (np.broadcast_to(each, (*shape, 2)) for each in places)
    return RelativeMotion(*vectors, *(np.broadcast_to(part, shape) for part in turned))


def quarter_turn(vectors: Array) -> Array:
    """Vectors (..., 2) turned a quarter anticlockwise."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _rotate(vectors: Array, angle: Array) -> Array:
    cos, sin = np.cos(angle)[..., None], np.sin(angle)[..., None]
    return cos * vectors + sin * quarter_turn(vectors)


def _value_and_rates(value: Any) -> list[Array]:
    parts = value_and_rates(value)
    return [np.asarray(part, dtype=float) for part in parts]
