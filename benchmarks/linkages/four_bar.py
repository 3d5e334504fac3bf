"""A crank-rocker, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any, ClassVar

from benchmarks.linkages.base import ALPHA, OMEGA, THETA, Linkage, Scalar, Two


@dataclass(frozen=True)
class FourBar(Linkage):
    """a e^(i theta) + b e^(i x0) = g + c e^(i x1): crank a, coupler b, rocker c, frame g along the x-axis.

    The loop equation is that of R. L. Norton, Design of Machinery, ch. 4. C is here the intersection of the circles
    about B and D; the one to the left of the way from B to D is taken. The rates follow from the loop equation's
    derivatives, each turned so that one unknown drops out (the same, ch. 6 and 7).
    """

    a: float = 0.3
    b: float = 0.8
    c: float = 0.7
    g: float = 1.0

    name: ClassVar[str] = "four-bar"
    crank: ClassVar[str] = "A"
    answers: ClassVar[tuple[tuple[str, str], tuple[str, str]]] = (("BC", "angle"), ("DC", "angle"))

    def document(self) -> dict[str, Any]:
        return {
            "planar": 1,
            "name": self.name,
            "frame": "AD",
            "links": {
                "AD": {"points": {"A": [0, 0], "D": [self.g, 0]}},
                "AB": {"ends": ["A", "B"], "length": self.a},
                "BC": {"ends": ["B", "C"], "length": self.b},
                "DC": {"ends": ["D", "C"], "length": self.c},
            },
            "pairs": [{"turning": point} for point in "ABCD"],
            "inputs": [{"pair": "A", "position": THETA, "velocity": OMEGA, "acceleration": ALPHA}],
            "sketch": {"C": [0.8, 0.7]},
        }

    def positions(self, m: Any, theta: Scalar) -> Two:
        _, bx, by, cx, cy = self._sides(m, theta)
        return m.atan2(by, bx), m.atan2(cy, cx)

    def motion(self, m: Any, theta: Scalar, omega: Scalar, alpha: Scalar) -> tuple[Two, Two, Two]:
        (ax, ay), bx, by, cx, cy = self._sides(m, theta)
        # dot and cross products of the sides stand for the cosines and sines of the angles between them
        between = bx * cy - by * cx
        b1 = omega * (cx * ay - cy * ax) / between
        c1 = omega * (bx * ay - by * ax) / between
        # i alpha a - omega^2 a + i b2 b - b1^2 b = i c2 c - c1^2 c
        px = c1 * c1 * cx - b1 * b1 * bx - omega * omega * ax - alpha * ay
        py = c1 * c1 * cy - b1 * b1 * by - omega * omega * ay + alpha * ax
        b2 = -(cx * px + cy * py) / between
        c2 = -(bx * px + by * py) / between
        return (m.atan2(by, bx), m.atan2(cy, cx)), (b1, c1), (b2, c2)

    def _sides(self, m: Any, theta: Scalar) -> tuple[Two, Scalar, Scalar, Scalar, Scalar]:
        """AB, then the components of BC and DC."""
        ax, ay = self.a * m.cos(theta), self.a * m.sin(theta)
        ex, ey = self.g - ax, -ay
        square = ex * ex + ey * ey
        along = (self.b * self.b - self.c * self.c + square) / (2.0 * square)
        across = m.sqrt(self.b * self.b / square - along * along)
        bx, by = along * ex - across * ey, along * ey + across * ex
        return (ax, ay), bx, by, bx - ex, by - ey

    def loop(self, x: Sequence[float], theta: float) -> Two:
        return (
            self.a * cos(theta) + self.b * cos(x[0]) - self.g - self.c * cos(x[1]),
            self.a * sin(theta) + self.b * sin(x[0]) - self.c * sin(x[1]),
        )

    def slope(self, x: Sequence[float]) -> tuple[Two, Two]:
        return (
            (-self.b * sin(x[0]), self.c * sin(x[1])),
            (self.b * cos(x[0]), -self.c * cos(x[1])),
        )

    def bend(self, x: Sequence[float], v: Sequence[float], theta: float, omega: float, alpha: float) -> tuple[Two, Two]:
        ax, ay = self.a * cos(theta), self.a * sin(theta)
        return (-omega * ay, omega * ax), (
            -alpha * ay - omega**2 * ax - self.b * v[0] ** 2 * cos(x[0]) + self.c * v[1] ** 2 * cos(x[1]),
            alpha * ax - omega**2 * ay - self.b * v[0] ** 2 * sin(x[0]) + self.c * v[1] ** 2 * sin(x[1]),
        )
