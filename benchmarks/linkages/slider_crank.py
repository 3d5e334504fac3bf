"""A slider-crank in line, in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any, ClassVar

from benchmarks.linkages.base import ALPHA, OMEGA, THETA, Linkage, Scalar, Two


@dataclass(frozen=True)
class SliderCrank(Linkage):
    """r e^(i theta) + rod e^(i x0) = x1: crank r, rod, the piston on the x-axis.

    sin x0 = -(r / rod) sin theta, x1 = r cos theta + rod cos x0 (R. L. Norton, Design of Machinery, ch. 4, without
    offset); the rates are these two, differentiated.
    """

    r: float = 0.48
    rod: float = 1.6

    name: ClassVar[str] = "slider-crank"
    crank: ClassVar[str] = "O"
    answers: ClassVar[tuple[tuple[str, str], tuple[str, str]]] = (("rod", "angle"), ("stroke", "displacement"))

    def document(self) -> dict[str, Any]:
        return {
            "planar": 1,
            "name": self.name,
            "frame": "frame",
            "links": {
                "frame": {"points": {"O": [0, 0]}},
                "crank": {"ends": ["O", "A"], "length": self.r},
                "rod": {"ends": ["A", "B"], "length": self.rod},
                "piston": {"points": {"B": [0, 0]}},
            },
            "pairs": [
                *({"turning": point} for point in "OAB"),
                {"sliding": "stroke", "links": ["frame", "piston"], "line": {"through": "O"}, "point": "B"},
            ],
            "inputs": [{"pair": "O", "position": THETA, "velocity": OMEGA, "acceleration": ALPHA}],
            "sketch": {"B": [1.8, 0]},
        }

    def positions(self, m: Any, theta: Scalar) -> Two:
        sine = -self.r * m.sin(theta) / self.rod
        return m.asin(sine), self.r * m.cos(theta) + self.rod * m.sqrt(1.0 - sine * sine)

    def motion(self, m: Any, theta: Scalar, omega: Scalar, alpha: Scalar) -> tuple[Two, Two, Two]:
        ax, ay = self.r * m.cos(theta), self.r * m.sin(theta)
        bx, by = m.sqrt(self.rod * self.rod - ay * ay), -ay
        v = -omega * ax / bx
        w = (omega * omega * ay - alpha * ax + v * v * by) / bx
        return (
            (m.asin(by / self.rod), ax + bx),
            (v, -omega * ay - v * by),
            (w, -alpha * ay - omega * omega * ax - w * by - v * v * bx),
        )

    def loop(self, x: Sequence[float], theta: float) -> Two:
        return (
            self.r * cos(theta) + self.rod * cos(x[0]) - x[1],
            self.r * sin(theta) + self.rod * sin(x[0]),
        )

    def slope(self, x: Sequence[float]) -> tuple[Two, Two]:
        return (-self.rod * sin(x[0]), -1.0), (self.rod * cos(x[0]), 0.0)

    def bend(self, x: Sequence[float], v: Sequence[float], theta: float, omega: float, alpha: float) -> tuple[Two, Two]:
        ax, ay = self.r * cos(theta), self.r * sin(theta)
        return (-omega * ay, omega * ax), (
            -alpha * ay - omega**2 * ax - self.rod * v[0] ** 2 * cos(x[0]),
            alpha * ax - omega**2 * ay - self.rod * v[0] ** 2 * sin(x[0]),
        )
