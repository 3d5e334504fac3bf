"""Vectors and moving frames in the plane, for any arithmetic (floats, arrays, symbols, jets)."""

from __future__ import annotations

from typing import NamedTuple

from planar.foundation.jets import Scalar, TermSizes, cos, sin


class Vector(NamedTuple):
    """A vector or a point (x, y)."""

    x: Scalar
    y: Scalar

    def __add__(self, other: Vector) -> Vector:  # type: ignore[override]
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y)

    def __mul__(self, factor: Scalar) -> Vector:
        return Vector(self.x * factor, self.y * factor)

    def dot(self, other: Vector) -> Scalar:
        return self.x * other.x + self.y * other.y

    def cross(self, other: Vector) -> Scalar:
        """The out-of-plane part of the vector product, anticlockwise positive."""
        return self.x * other.y - self.y * other.x

    def rotate(self, cos_sin: Vector) -> Vector:
        """This vector turned anticlockwise by the angle whose (cos, sin) is `by`."""
        return Vector(cos_sin.x * self.x - cos_sin.y * self.y, cos_sin.y * self.x + cos_sin.x * self.y)


def direction(angle: Scalar) -> Vector:
    """The unit vector at an angle, anticlockwise from the x-axis."""
    return Vector(cos(angle), sin(angle))


class Frame(NamedTuple):
    """Axes fixed to a link: origin (x, y), and direction both as cos, sin and as an angle that counts turns.

    `fixed` marks the mechanism's frame, whose axes are the world's.
    """

    x: Scalar
    y: Scalar
    cos: Scalar
    sin: Scalar
    angle: Scalar
    fixed: bool = False

    def to_world(self, point: Vector) -> Vector:
        """Where a point of the link lies in the world."""
        return Vector(self.x, self.y) + self.rotate_to_world(point)

    def rotate_to_world(self, vector: Vector) -> Vector:
        """A vector of the link in the directions of the world."""
        return vector.rotate(Vector(self.cos, self.sin))

    def to_local(self, point: Vector) -> Vector:
        """Where a point of the world lies in the link's axes."""
        return (point - Vector(self.x, self.y)).rotate(Vector(self.cos, -self.sin))


GROUND = Frame(0.0, 0.0, 1.0, 0.0, 0.0, True)


def frame_at(x: Scalar, y: Scalar, angle: Scalar) -> Frame:
    """A frame with its cos and sin made afresh from its angle."""
    return Frame(x, y, cos(angle), sin(angle), angle)


def frame_term_sizes(x: TermSizes, y: TermSizes, angle: TermSizes) -> Frame:
    """The sizes of a frame's parts and of their rates, its axes in whatever direction they are."""
    _, first, second = angle.parts
    axes = TermSizes(1.0, first, second + first * first)
    return Frame(x, y, axes, axes, angle)
