"""A crank-rocker: the pin between coupler and rocker is asked for."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from benchmarks.linkages import FourBar
from benchmarks.swept.base import Array, Dimension, Swept, crank_pin, dyad_pin, fixed, rows

_SAME = FourBar()


class SweptFourBar(Swept):
    """Crank, coupler, rocker and frame vary."""

    name: ClassVar[str] = "four-bar"
    wide_limit: ClassVar[str] = "four_bar_stopping"
    """The function of limit.c for designs that may stop between two steps."""
    limit: ClassVar[str] = "four_bar"
    point: ClassVar[str] = "C"
    dimensions: ClassVar[tuple[Dimension, ...]] = (
        Dimension("AB.length", _SAME.a),
        Dimension("BC.length", _SAME.b),
        Dimension("DC.length", _SAME.c),
        Dimension("AD.D.x", _SAME.g),
    )

    def document(self) -> dict[str, Any]:
        return _SAME.document()

    def motion(self, d: Array, theta: Array) -> Array:
        a, b, c, g = d
        return rows(dyad_pin(crank_pin(a, theta[:, None]), fixed(g, 0.0 * g), b, c))

    def assemblies(self, d: Array, theta: Array) -> list[Array]:
        """Both: of wide designs the one nearer to the sketch may be to the right of the way from B to D."""
        a, b, c, g = d
        mirrored = rows(dyad_pin(fixed(g, 0.0 * g), crank_pin(a, theta[:, None]), c, b))
        return [self.motion(d, theta), mirrored]

    def wide(self, many: int) -> Array:
        """Designs (4, designs) with lengths from 0.2 to 1.5, of which about half cannot turn."""
        return np.random.default_rng(0).uniform(0.2, 1.5, (4, many))

    def mixed(self, many: int) -> Array:
        """Designs (4, designs) of which one in ten or so has no crank that turns: it is from 0.2 to 0.52 long."""
        d = self.designs(many)
        d[0] = np.random.default_rng(1).uniform(0.2, 0.52, many)
        return d

    def stops(self, d: Array, theta: Array) -> Array:
        """See `Swept`: between two steps too, where the diagonal is longest or shortest."""
        a, b, c, g = d
        found = np.empty((len(theta), d.shape[1]), dtype=bool)
        for first in range(0, d.shape[1], 1000):
            some = slice(first, first + 1000)
            far = a[some] ** 2 + g[some] ** 2 - 2.0 * a[some] * g[some] * np.cos(theta)[:, None]
            gone = (far > (b[some] + c[some]) ** 2) | (far < (b[some] - c[some]) ** 2)
            for place, extreme in ((np.pi, a[some] + g[some]), (2.0 * np.pi, np.abs(a[some] - g[some]))):
                broken = (extreme > b[some] + c[some]) | (extreme < np.abs(b[some] - c[some]))
                gone |= broken & (theta > place)[:, None]
            found[:, some] = np.logical_or.accumulate(gone, axis=0)
        return found
