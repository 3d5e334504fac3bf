"""A crank and slotted lever: a slider on a link that moves. The lever's end is asked for."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from benchmarks.linkages.base import ALPHA, OMEGA, THETA
from benchmarks.swept.base import Array, Dimension, Swept, crank_pin


class SweptQuickReturn(Swept):
    """Crank, the lever's pivot and the end of the lever vary."""

    name: ClassVar[str] = "quick return"
    limit: ClassVar[str] = "quick_return"
    point: ClassVar[str] = "E"
    only_turning: ClassVar[bool] = False
    dimensions: ClassVar[tuple[Dimension, ...]] = (
        Dimension("crank.length", 0.15),
        Dimension("frame.Q.y", -0.3),
        Dimension("lever.E.x", 0.6),
    )

    def document(self) -> dict[str, Any]:
        r, q, end = self.base()
        return {
            "planar": 1,
            "name": self.name,
            "frame": "frame",
            "links": {
                "frame": {"points": {"O": [0, 0], "Q": [0, q]}},
                "crank": {"ends": ["O", "A"], "length": r},
                "lever": {"points": {"Q": [0, 0], "E": [end, 0]}},
            },
            "pairs": [
                {"turning": "O"},
                {"turning": "Q"},
                {"sliding": "slide", "on": "lever", "block": "A", "line": {"through": "Q"}},
            ],
            "inputs": [{"pair": "O", "position": THETA, "velocity": OMEGA, "acceleration": ALPHA}],
            "sketch": {"E": [0.1, 0.28]},
        }

    def motion(self, d: Array, theta: Array) -> Array:
        r, q, end = d
        pin = crank_pin(r, theta[:, None])
        x, y = pin.p[0], pin.p[1] - q
        far = np.hypot(x, y)
        ux, uy = x / far, y / far
        turn = (ux * pin.v[1] - uy * pin.v[0]) / far
        grow = (ux * pin.a[1] - uy * pin.a[0] - 2.0 * (ux * pin.v[0] + uy * pin.v[1]) * turn) / far
        return np.stack(
            [
                end * ux,
                q + end * uy,
                -end * turn * uy,
                end * turn * ux,
                -end * (grow * uy + turn * turn * ux),
                end * (grow * ux - turn * turn * uy),
            ]
        )
