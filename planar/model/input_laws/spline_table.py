"""A piece of a law that goes smoothly through the points of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from planar.foundation.arrays import Array
from planar.model.input_laws.segment import LONGEST_DURATION, SHORTEST_DURATION, LawSegment, SegmentKey
from planar.model.loads import MAX_LAW_ITEMS

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

SPLINE_DEGREE = 5
"""Of the spline: its fourth derivative goes on at every point, so acceleration and jerk are smooth."""
POSITION_TOLERANCE = 1e-6
"""By what part of its size a table may start beside where the piece starts: positions are rounded in print."""


@dataclass(frozen=True)
class TableSegment(LawSegment):
    """`positions` at `times`, which start at 0, and the spline through them (C. de Boor, A Practical Guide to
    Splines, Springer 2001, ch. XIII: not a knot at the ends).

    The spline is of degree 5; through fewer than six points, the one polynomial. It is taken from its first position
    on, so a law that starts elsewhere moves it as a whole.
    """

    times: tuple[float, ...]
    positions: tuple[float, ...]
    motion: ClassVar[str] = "table"
    description: ClassVar[str] = "a smooth spline through the points of a table"
    keys: ClassVar[Mapping[str, SegmentKey]] = {
        "times": SegmentKey(
            "times", "time", "rising times from where the piece starts, the first of them 0", is_list=True
        ),
        "positions": SegmentKey("positions", "position", "the input's positions at them", is_list=True),
    }

    @property
    def duration(self) -> float:
        return self.times[-1]

    @cached_property
    def splines(self) -> tuple[BSpline, ...]:
        """The way over t / duration, and its three derivatives. Raises ValueError where the times lie too unevenly."""
        from scipy.interpolate import make_interp_spline  # slow to load, so only where there is a table

        x = np.array(self.times, dtype=float) / self.duration
        way = np.array(self.positions, dtype=float) - self.positions[0]
        degree = min(SPLINE_DEGREE, len(x) - 1)
        spline = make_interp_spline(x, way, k=degree)
        return tuple(spline.derivative(k) if k else spline for k in range(min(degree, 3) + 1))

    def evaluate(self, t: Array, velocity: float) -> Array:
        x = t / self.duration
        found = np.zeros((4, len(t)))
        for k, spline in enumerate(self.splines):
            found[k] = spline(x) / self.duration**k
        return found

    def end_displacement_and_velocity(self, velocity: float) -> tuple[float, float]:
        rate = self.evaluate(np.array([self.duration]), velocity)[1, 0]
        return self.positions[-1] - self.positions[0], float(rate)

    def start_velocity(self, velocity: float) -> float:
        return float(self.evaluate(np.zeros(1), velocity)[1, 0])

    def starts_at(self, position: float) -> bool:
        """Whether its first position is this one."""
        first = self.positions[0]
        return abs(first - position) <= POSITION_TOLERANCE * max(
            abs(first), abs(position), max(self.positions) - min(self.positions)
        )

    def shift_to(self, position: float) -> TableSegment:
        """The same table with its first position here."""
        shift = position - self.positions[0]
        return replace(self, positions=(position, *(each + shift for each in self.positions[1:])))

    def find_problem(self) -> tuple[str, str] | None:
        return (
            super().find_problem()
            or self._find_count_problem()
            or self._find_order_problem()
            or self._find_smoothness_problem()
        )

    def _find_count_problem(self) -> tuple[str, str] | None:
        if not 2 <= len(self.times) <= MAX_LAW_ITEMS:
            return "times", f"a table has from 2 to {MAX_LAW_ITEMS} points, not {len(self.times)}"
        if len(self.positions) != len(self.times):
            told = f"there are {len(self.times)} times, so {len(self.times)} positions are wanted"
            return "positions", f"{told}, not {len(self.positions)}"
        return None

    def _find_order_problem(self) -> tuple[str, str] | None:
        if self.times[0] != 0.0:
            return "times[0]", f"times start at 0, where the piece starts, not at {float(self.times[0]):g} s"
        for i, (before, after) in enumerate(zip(self.times, self.times[1:], strict=False), start=1):
            if not after - before >= SHORTEST_DURATION:
                told = f"times increase, by {SHORTEST_DURATION:g} s at least, but"
                return f"times[{i}]", f"{told} {float(after):.9g} s comes after {float(before):.9g} s"
        if self.duration > LONGEST_DURATION:
            return "times", f"a piece takes {LONGEST_DURATION:g} s at most, not {float(self.duration):g} s"
        return None

    def _find_smoothness_problem(self) -> tuple[str, str] | None:
        try:
            found = self.splines[0](np.array(self.times) / self.duration)
        except (ValueError, ArithmeticError, np.linalg.LinAlgError):
            found = np.array([np.nan])
        way = np.array(self.positions, dtype=float) - self.positions[0]
        if not np.max(np.abs(found - way)) <= POSITION_TOLERANCE * np.max(np.abs(way)):
            return "times", "the times lie too unevenly for a smooth curve through all points"
        return None
