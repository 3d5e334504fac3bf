"""Two six-bars: one of two dyads, and one whose two loops close only together."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from benchmarks.linkages.base import ALPHA, OMEGA, THETA
from benchmarks.swept.base import Array, Dimension, Moving, Swept, crank_pin, dyad_pin, fixed, rows

BELL = 0.4
ROUNDED_STEP = 1e-12
"""m: steps below this that grow no smaller are rounding."""
"""The angle from DC to DF of the rocker that is a bell crank, rad; limit.c has it too."""
INPUT = {"position": THETA, "velocity": OMEGA, "acceleration": ALPHA}


class Watt(Swept):
    """A four-bar whose rocker drives a second dyad (Watt's second chain); its pin G is asked for."""

    name: ClassVar[str] = "six-bar of two dyads"
    limit: ClassVar[str] = "watt"
    spread: ClassVar[float] = 0.04
    point: ClassVar[str] = "G"
    dimensions: ClassVar[tuple[Dimension, ...]] = (
        Dimension("AB.length", 0.3),
        Dimension("BC.length", 0.8),
        Dimension("DC.length", 0.7),
        Dimension("frame.D.x", 1.0),
        Dimension("DC.F.distance", 0.45),
        Dimension("FG.length", 1.05),
        Dimension("HG.length", 0.6),
        Dimension("frame.H.x", 2.0),
        Dimension("frame.H.y", 0.1),
    )

    def document(self) -> dict[str, Any]:
        a, b, c, g, f, first, second, x, y = self.base()
        return {
            "planar": 1,
            "name": self.name,
            "frame": "frame",
            "links": {
                "frame": {"points": {"A": [0, 0], "D": [g, 0], "H": [x, y]}},
                "AB": {"ends": ["A", "B"], "length": a},
                "BC": {"ends": ["B", "C"], "length": b},
                "DC": {
                    "ends": ["D", "C"],
                    "length": c,
                    "points": {"F": {"along": ["D", "C"], "distance": f, "angle": BELL}},
                },
                "FG": {"ends": ["F", "G"], "length": first},
                "HG": {"ends": ["H", "G"], "length": second},
            },
            "pairs": [{"turning": point} for point in "ABCDFGH"],
            "inputs": [{"pair": "A", **INPUT}],
            "sketch": {"C": [0.8, 0.7], "G": [1.6, 0.6]},
        }

    def motion(self, d: Array, theta: Array) -> Array:
        a, b, c, g, f, first, second, x, y = d
        C = dyad_pin(crank_pin(a, theta[:, None]), fixed(g, 0.0 * g), b, c)
        part = f / c
        co, si = part * np.cos(np.longdouble(BELL)), part * np.sin(np.longdouble(BELL))
        sides = (C.p[0] - g, C.p[1]), C.v, C.a
        at, v, a = ((co * px - si * py, si * px + co * py) for px, py in sides)
        return rows(dyad_pin(Moving((g + at[0], at[1]), v, a), fixed(x, y), first, second))


class Stephenson(Swept):
    """Stephenson's third chain driven by the crank of its dyad, so that no dyad is left: four angles at once.

    The four-bar A, B, C, D carries E on its coupler; the crank GF moves it through EF. E is asked for.
    """

    name: ClassVar[str] = "six-bar without a dyad"
    limit: ClassVar[str] = "stephenson"
    point: ClassVar[str] = "E"
    dyadic: ClassVar[bool] = False
    spread: ClassVar[float] = 0.03
    dimensions: ClassVar[tuple[Dimension, ...]] = (
        Dimension("AB.length", 0.6),
        Dimension("BC.length", 0.7),
        Dimension("DC.length", 0.65),
        Dimension("frame.D.x", 0.8),
        Dimension("BC.E.x", 0.3),
        Dimension("BC.E.y", 0.35),
        Dimension("EF.length", 0.9),
        Dimension("GF.length", 0.13),
        Dimension("frame.G.x", 1.3),
        Dimension("frame.G.y", 0.7),
    )
    BARS: ClassVar[tuple[tuple[int, int], ...]] = ((0, 1), (1, 2), (2, 3), (1, 4), (2, 4), (4, 5))
    """Pins A, B, C, D, E, F between which a distance stands."""

    def document(self) -> dict[str, Any]:
        a, b, c, g, x, y, to_e, r, gx, gy = self.base()
        return {
            "planar": 1,
            "name": self.name,
            "frame": "frame",
            "links": {
                "frame": {"points": {"A": [0, 0], "D": [g, 0], "G": [gx, gy]}},
                "AB": {"ends": ["A", "B"], "length": a},
                "BC": {"ends": ["B", "C"], "length": b, "points": {"E": [x, y]}},
                "DC": {"ends": ["D", "C"], "length": c},
                "EF": {"ends": ["E", "F"], "length": to_e},
                "GF": {"ends": ["G", "F"], "length": r},
            },
            "pairs": [{"turning": point} for point in "ABCDEFG"],
            "inputs": [{"pair": "G", **INPUT}],
            "sketch": {"B": [0.1, 0.59], "C": [0.75, 0.65], "E": [0.45, 0.9]},
        }

    def start(self, d: Array) -> Array:
        """The unit vectors of AB, BC, DC and FE at THETA, from the file's own dimensions and sketch."""
        pins = self._pins(self.base().reshape(-1, 1), np.array([THETA]))[:, :, 0, 0]
        A, B, C, D, E, F = pins.astype(float)
        return np.concatenate(
            [(end - near) / np.hypot(*(end - near)) for near, end in ((A, B), (B, C), (D, C), (F, E))]
        )

    def motion(self, d: Array, theta: Array) -> Array:
        """By Newton's iteration on the distances between pins, angle after angle, in the arithmetic of `d`."""
        found = np.empty((6, len(theta), d.shape[1]), dtype=d.dtype)
        pins = self._pins(d, theta[:1])
        for step, angle in enumerate(theta):
            pins = self._pins(d, np.array([angle]), pins[:, :, 0])
            F = crank_pin(d[7], angle)
            zero = np.zeros_like(pins[:, :, 0])
            v, a = zero.copy(), zero.copy()
            v[5], a[5] = F.v, F.a
            slope = self._slope(pins[:, :, 0])
            v[_FREE] = self._solve(slope, -self._move(pins[:, :, 0], v))
            a[_FREE] = self._solve(slope, -self._move(pins[:, :, 0], a) - self._squares(v))
            found[0:2, step], found[2:4, step], found[4:6, step] = pins[4, :, 0], v[4], a[4]
        return found

    def _pins(self, d: Array, theta: Array, near: Array | None = None) -> Array:
        """A, B, C, D, E, F (6, 2, 1, designs) at one angle, from those near it or from the sketch."""
        a, b, c, g, x, y, to_e, r, gx, gy = d
        at = np.zeros((6, 2, d.shape[1]), dtype=d.dtype)
        if near is None:
            sketch = self.document()["sketch"]
            for pin, name in ((1, "B"), (2, "C"), (4, "E")):
                at[pin] = np.array(sketch[name], dtype=d.dtype)[:, None]
        else:
            at[_FREE] = near[_FREE]
        at[3, 0] = g
        at[5] = gx + r * np.cos(theta[0]), gy + r * np.sin(theta[0])
        wanted = np.stack([a, b, c, np.hypot(x, y), np.hypot(b - x, y), to_e]) ** 2
        before = np.inf
        for _ in range(60):
            off = self._squares(at) - wanted
            step = self._solve(self._slope(at), -0.5 * off)
            at[_FREE] += step
            size = np.max(np.abs(step))
            if size < 1e-17 or before <= size < ROUNDED_STEP:
                break
            before = size
        return at[:, :, None]

    def _slope(self, at: Array) -> Array:
        """The derivative (designs, 6, 6) of half the squared distances in B, C and E."""
        slope = np.zeros((at.shape[2], 6, 6))
        for row, (i, j) in enumerate(self.BARS):
            for pin, sign in ((i, 1.0), (j, -1.0)):
                if pin in _FREE:
                    column = 2 * _FREE.index(pin)
                    slope[:, row, column : column + 2] = sign * (at[i] - at[j]).T
        return slope

    def _move(self, at: Array, rate: Array) -> Array:
        return np.stack([np.sum((at[i] - at[j]) * (rate[i] - rate[j]), axis=0) for i, j in self.BARS])

    def _squares(self, at: Array) -> Array:
        return np.stack([np.sum((at[i] - at[j]) ** 2, axis=0) for i, j in self.BARS])

    def _solve(self, slope: Array, right: Array) -> Array:
        """The system solved in doubles, three times on what is left, which is reckoned as `right` is."""
        found = np.zeros_like(right)
        inverse = np.linalg.inv(slope)
        wide = slope.astype(right.dtype)
        for _ in range(3):
            left = right - np.einsum("nij,jn->in", wide, found)
            found += np.einsum("nij,jn->in", inverse, left.astype(float))
        return found.reshape(3, 2, -1)


_FREE = [1, 2, 4]
