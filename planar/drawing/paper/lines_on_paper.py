"""Straight lines on paper: what lies on them, and how far they go in a window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.drawing.paper.boxes import Box

Array = np.ndarray
SIZE = 100.0
"""mm: lengths beside which homogeneous points are well conditioned on paper."""
NOTHING = 1e-9
"""Of sines, and of lines beside the one at infinity."""
AS_ONE = 0.05
"""mm within which spots, and lines in the window, are one."""


class Ray(NamedTuple):
    """A straight line on paper: a spot on it (mm), its unit direction, the centres on it by name, other spots on it."""

    through: Array
    way: Array
    about: str
    on: frozenset[str]
    spots: tuple[Array, ...] = ()

    def part(self, at: Array) -> float:
        """How far along it a spot is (mm)."""
        return float((at - self.through) @ self.way)

    def at(self, part: float) -> Array:
        """The spot so far along it."""
        return self.through + part * self.way

    def off(self, at: Array) -> float:
        """How far a spot is beside it (mm)."""
        x, y = at - self.through
        return abs(float(self.way[0] * y - self.way[1] * x))

    def same(self, other: Ray) -> bool:
        """Whether both are one line as far as a window goes."""
        across = self.way[0] * other.way[1] - self.way[1] * other.way[0]
        return abs(float(across)) * SIZE < AS_ONE and self.off(other.through) < AS_ONE

    def inside(self, window: Box) -> tuple[float, float] | None:
        """Between which parts it lies in a window (Liang and Barsky, 1984)."""
        low, high = -np.inf, np.inf
        for axis in (0, 1):
            near, far = (float(window[k] - self.through[axis]) for k in (axis, axis + 2))
            along = float(self.way[axis])
            if abs(along) < 1e-12:
                if near > 0.0 or far < 0.0:
                    return None
                continue
            first, last = sorted((near / along, far / along))
            low, high = max(low, first), min(high, last)
        return (low, high) if low < high else None


def crosses(one: Array, other: Array) -> float:
    """The sine between two unit vectors."""
    return abs(float(one[0] * other[1] - one[1] * other[0]))
