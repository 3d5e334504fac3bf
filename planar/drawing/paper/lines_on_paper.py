"""Straight lines on paper: what lies on them, and how far they go in a window."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.drawing.paper.boxes import Box
from planar.foundation.arrays import Array

PAPER_SIZE = 100.0
"""mm: lengths beside which homogeneous points are well conditioned on paper."""
PARALLEL_TOLERANCE = 1e-9
"""Of sines, and of lines beside the one at infinity."""
COINCIDENCE_TOLERANCE = 0.05
"""mm within which spots, and lines in the window, are one."""


class PaperLine(NamedTuple):
    """A straight line on paper: a spot on it (mm), its unit direction, the centres on it by name, other spots on it."""

    through: Array
    direction: Array
    about: str
    centre_names: frozenset[str]
    points: tuple[Array, ...] = ()

    def coordinate_of(self, at: Array) -> float:
        """How far along it a spot is (mm)."""
        return float((at - self.through) @ self.direction)

    def point_at(self, coordinate: float) -> Array:
        """The spot so far along it."""
        return self.through + coordinate * self.direction

    def distance_to(self, at: Array) -> float:
        """How far a spot is beside it (mm)."""
        x, y = at - self.through
        return abs(float(self.direction[0] * y - self.direction[1] * x))

    def is_same_line(self, other: PaperLine) -> bool:
        """Whether both are one line as far as a window goes."""
        across = self.direction[0] * other.direction[1] - self.direction[1] * other.direction[0]
        return (
            abs(float(across)) * PAPER_SIZE < COINCIDENCE_TOLERANCE
            and self.distance_to(other.through) < COINCIDENCE_TOLERANCE
        )

    def clip_to(self, window: Box) -> tuple[float, float] | None:
        """Between which parts it lies in a window (Liang and Barsky, 1984)."""
        low, high = -np.inf, np.inf
        for axis in (0, 1):
            near, far = (float(window[k] - self.through[axis]) for k in (axis, axis + 2))
            along = float(self.direction[axis])
            if abs(along) < 1e-12:
                if near > 0.0 or far < 0.0:
                    return None
                continue
            first, last = sorted((near / along, far / along))
            low, high = max(low, first), min(high, last)
        return (low, high) if low < high else None


def sine_between(one: Array, other: Array) -> float:
    """The sine between two unit vectors."""
    return abs(float(one[0] * other[1] - one[1] * other[0]))
