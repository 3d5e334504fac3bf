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

    def mixed(self, many: int) -> Array:
        """Designs (4, designs) of which one in ten or so has no crank that turns: it is from 0.2 to 0.52 long."""
        d = self.designs(many)
        d[0] = np.random.default_rng(1).uniform(0.2, 0.52, many)
        return d
