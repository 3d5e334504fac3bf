"""Where strokes leave room for what may stand on one side or another: supports, hatching, arrows."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise, product
from math import pi
from typing import Self

import numpy as np

from planar.drawing.paper.picture import Arrow, Circle, Mark, Polyline, paper_point
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.link_bodies import unit_vector
from planar.foundation.geometry import Vector

GUIDE_LIFT = 0.8
"""mm: how far a guide may be off its block, where a rack lies between them."""
UPRIGHT_DIRECTIONS = (Vector(0, -1), Vector(-1, 0), Vector(1, 0), Vector(0, 1))
SLANTED_DIRECTIONS = tuple(Vector(x / 2**0.5, y / 2**0.5) for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1)))


@dataclass(frozen=True)
class Clearance:
    """Points of strokes (n, 2) in mm, from which the freest side for a symbol is told.

    `weights` (n,) say how much each is in the way: less where something is there for a part of the motion only.
    """

    points: np.ndarray
    weights: np.ndarray

    @classmethod
    def from_marks(cls, marks: Iterable[Mark], weight: float = 1.0) -> Self:
        """Strokes as points at most half a millimetre apart."""
        rows = [np.zeros((0, 2))]
        for mark in marks:
            if isinstance(mark, Circle):
                turns = np.radians(np.linspace(mark.start, mark.stop, 2 + int(4.0 * pi * mark.radius)))
                rows.append(np.array(mark.centre) + mark.radius * np.stack([np.cos(turns), np.sin(turns)], axis=1))
            elif isinstance(mark, Polyline | Arrow):
                spots = mark.points if isinstance(mark, Polyline) else (mark.tail, mark.head)
                closing = spots[:1] if isinstance(mark, Polyline) and mark.closed else ()
                for a, b in pairwise(np.array((*spots, *closing))):
                    parts = np.linspace(0.0, 1.0, 2 + int(np.hypot(*(b - a)) / 0.5))
                    rows.append(a + (b - a) * parts[:, None])
        points = np.concatenate(rows)
        return cls(points, np.full(len(points), weight))

    def with_marks(self, marks: Iterable[Mark], weight: float = 1.0) -> Self:
        """The same with more strokes."""
        more = self.from_marks(marks, weight)
        return type(self)(np.concatenate([self.points, more.points]), np.concatenate([self.weights, more.weights]))

    def centre(self) -> Vector:
        """The middle of all strokes."""
        if not len(self.points):
            return Vector(0.0, 0.0)
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return Vector(*map(float, (low + high) / 2.0))

    def count_in_box(self, at: Vector, way: Vector, low: Vector, high: Vector) -> float:
        """How much lies in a box: from `low` to `high` along a unit vector and to its left."""
        off = self.points - np.array(paper_point(at))
        along = off @ np.array(paper_point(way))
        left = off @ np.array(paper_point(symbols.quarter_turn(way)))
        return float(self.weights[(along > low.x) & (along < high.x) & (left > low.y) & (left < high.y)].sum())

    def count_near_arc(self, at: Vector, radius: float, middle: float, sweep: float) -> float:
        """How much lies near an arc about a place (mm, rad)."""
        off = self.points - np.array(paper_point(at))
        turned = (np.arctan2(off[:, 1], off[:, 0]) - middle + np.pi) % (2.0 * np.pi) - np.pi
        near = np.abs(np.hypot(off[:, 0], off[:, 1]) - radius) < 1.3
        return float(self.weights[near & (np.abs(turned) < sweep / 2.0 + 0.15)].sum())

    def support_direction(self, at: Vector) -> Vector:
        """Which way a support stands best: downwards, unless strokes are there."""
        centre = np.array(paper_point(at))

        def price(index: int, down: Vector) -> tuple[float, int]:
            off = self.points - centre
            along, left = off @ np.array(paper_point(down)), off @ np.array(paper_point(symbols.quarter_turn(down)))
            inside = (along > 1.4) & (along < symbol_table.SUPPORT_HEIGHT + symbol_table.HATCH_LENGTH + 0.8)
            inside &= np.abs(left) < np.minimum(1.0 + 0.7 * along, symbol_table.SUPPORT_WIDTH / 2.0 + 0.5)
            return float(self.weights[inside].sum()) + 1.5 * (index > 0) + 1.5 * (index > 3), index

        ways = [*UPRIGHT_DIRECTIONS, *SLANTED_DIRECTIONS]
        return ways[min(range(len(ways)), key=lambda index: price(index, ways[index]))]

    def hatching_side(
        self, at: Vector, way: Vector, low: float, high: float, half: float, middle: Vector
    ) -> tuple[float, float]:
        """On which side of a line, and how far off, its hatching is clearest; else below, else away from the middle.

        The side is 1 to the left of the direction, -1 to the right.
        """
        left = unit_vector(symbols.quarter_turn(way))

        def price(choice: tuple[float, float]) -> tuple[float, float, float]:
            sign, off = choice
            near, far = sorted((sign * (off - 0.25), sign * (off + symbol_table.HATCH_LENGTH + 1.0)))
            lifted = 1.0 * (off > half)
            crowded = self.count_in_box(at, way, Vector(low, near), Vector(high, far)) + lifted
            side = left * sign
            return round(crowded), side.y if abs(side.y) > 0.5 else 0.0, (middle - at).dot(side)

        return min(product((1.0, -1.0), (half, half + GUIDE_LIFT)), key=price)
