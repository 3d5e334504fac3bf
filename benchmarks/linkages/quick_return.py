"""A crank and slotted lever, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any, ClassVar

from benchmarks.linkages.base import ALPHA, OMEGA, THETA, Linkage, Scalar, Two


@dataclass(frozen=True)
class QuickReturn(Linkage):
    """x1 e^(i x0) = r e^(i theta) + i d: crank r about O, lever about Q, d below O, the block at the crank's end.

    x is the block's place in polar coordinates about Q, so its rates are the crank pin's velocity and acceleration
    along and across the lever, with Coriolis' part taken off: r'' - r phi'^2 and r phi'' + 2 r' phi' (J. L. Meriam,
    L. G. Kraige, Engineering Mechanics: Dynamics, art. 2/6).
    """

    r: float = 0.15
    d: float = 0.3

    name: ClassVar[str] = "quick return"
    crank: ClassVar[str] = "O"
    answers: ClassVar[tuple[tuple[str, str], tuple[str, str]]] = (("lever", "angle"), ("slide", "displacement"))

    def document(self) -> dict[str, Any]:
        return {
            "planar": 1,
            "name": self.name,
            "frame": "frame",
            "links": {
                "frame": {"points": {"O": [0, 0], "Q": [0, -self.d]}},
                "crank": {"ends": ["O", "A"], "length": self.r},
                "lever": {"points": {"Q": [0, 0]}},
            },
            "pairs": [
                {"turning": "O"},
                {"turning": "Q"},
                {"sliding": "slide", "on": "lever", "block": "A", "line": {"through": "Q"}},
            ],
            "inputs": [{"pair": "O", "position": THETA, "velocity": OMEGA, "acceleration": ALPHA}],
        }

    def positions(self, m: Any, theta: Scalar) -> Two:
        x, y = self.r * m.cos(theta), self.r * m.sin(theta) + self.d
        return m.atan2(y, x), m.hypot(x, y)

    def motion(self, m: Any, theta: Scalar, omega: Scalar, alpha: Scalar) -> tuple[Two, Two, Two]:
        ax, ay = self.r * m.cos(theta), self.r * m.sin(theta)
        x, y = ax, ay + self.d
        slide = m.sqrt(x * x + y * y)
        ex, ey = x / slide, y / slide
        vx, vy = -omega * ay, omega * ax
        wx, wy = -alpha * ay - omega * omega * ax, alpha * ax - omega * omega * ay
        slide1, turn1 = vx * ex + vy * ey, (vy * ex - vx * ey) / slide
        return (
            (m.atan2(y, x), slide),
            (turn1, slide1),
            ((wy * ex - wx * ey - 2.0 * slide1 * turn1) / slide, wx * ex + wy * ey + slide * turn1 * turn1),
        )

    def loop(self, x: Sequence[float], theta: float) -> Two:
        return (
            x[1] * cos(x[0]) - self.r * cos(theta),
            x[1] * sin(x[0]) - self.r * sin(theta) - self.d,
        )

    def slope(self, x: Sequence[float]) -> tuple[Two, Two]:
        return (-x[1] * sin(x[0]), cos(x[0])), (x[1] * cos(x[0]), sin(x[0]))

    def bend(self, x: Sequence[float], v: Sequence[float], theta: float, omega: float, alpha: float) -> tuple[Two, Two]:
        ax, ay = self.r * cos(theta), self.r * sin(theta)
        c, s, turn1, slide1 = cos(x[0]), sin(x[0]), v[0], v[1]
        return (omega * ay, -omega * ax), (
            alpha * ay + omega**2 * ax - 2.0 * slide1 * turn1 * s - x[1] * turn1**2 * c,
            -alpha * ax + omega**2 * ay + 2.0 * slide1 * turn1 * c - x[1] * turn1**2 * s,
        )
