"""Vectors of the plane over numbers of any type, and intersections of circles and lines: nothing here is planar's.

All functions are analytic in their numbers, so that derivatives follow from steps into the imaginary direction.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Vector:
    """x and y: floats, complex numbers of a complex step, or arrays of them."""

    x: Any
    y: Any

    def __add__(self, other: Vector) -> Vector:
        return Vector(self.x + other.x, self.y + other.y)

    def __sub__(self, other: Vector) -> Vector:
        return Vector(self.x - other.x, self.y - other.y)

    def scaled(self, factor: Any) -> Vector:
        """The vector times a number."""
        return Vector(self.x * factor, self.y * factor)

    def turned(self, direction: Vector) -> Vector:
        """The vector turned by the angle of a direction, and stretched by its length."""
        return Vector(self.x * direction.x - self.y * direction.y, self.x * direction.y + self.y * direction.x)

    def turned_back(self, direction: Vector) -> Vector:
        """The vector turned by minus the angle of a direction, and stretched by its length."""
        return self.turned(Vector(direction.x, -direction.y))

    def dot(self, other: Vector) -> Any:
        """The scalar product."""
        return self.x * other.x + self.y * other.y

    def cross(self, other: Vector) -> Any:
        """The z-component of the vector product."""
        return self.x * other.y - self.y * other.x

    @property
    def squared(self) -> Any:
        """The square of the length."""
        return self.dot(self)

    @property
    def left(self) -> Vector:
        """The vector turned by a right angle anticlockwise."""
        return Vector(-self.y, self.x)


def unit_vector(angle: Any) -> Vector:
    """The direction of an angle (rad)."""
    return Vector(np.cos(angle), np.sin(angle))


def real_root(square: Any) -> Any:
    """The square root, not a number where the real part is negative."""
    with np.errstate(invalid="ignore"):
        return np.sqrt(np.where(np.real(square) >= 0.0, square, np.nan))


def circle_intersection(first: Vector, first_square: Any, second: Vector, second_square: Any, sign: Any) -> Vector:
    """Where two circles meet, by the squares of their radii: left (sign 1) or right (-1) of the way from the first
    centre to the second."""
    between = second - first
    along = (between.squared + first_square - second_square) / (2.0 * between.squared)
    across = sign * real_root(first_square / between.squared - along * along)
    return first + between.scaled(along) + between.left.scaled(across)


def line_displacement(through: Vector, direction: Vector, centre: Vector, radius_square: Any, sign: Any) -> Any:
    """How far along a line it meets a circle: the farther point (sign 1) or the nearer one (-1)."""
    off = centre - through
    height = direction.cross(off)
    return direction.dot(off) + sign * real_root(radius_square - height * height)


def direction_between(drawn: Vector, placed: Vector) -> Vector:
    """The direction by which a vector as it is drawn is turned to where it is placed; both are equally long."""
    return placed.turned_back(drawn).scaled(1.0 / drawn.squared)
