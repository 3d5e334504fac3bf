"""What all panels of the diagram of circuits share: its scales on the paper, its lines, marks and letters."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.circuits.circuits import Circuits
from planar.drawing.circuits.curves import Reading, Window
from planar.drawing.labels.fonts import families

Array = np.ndarray
Spot = tuple[float, float]

SMALL, NORMAL, LARGE = 7.0, 8.0, 10.0
"""points"""
LINES = (
    ("#000000", "-"),
    ("#0b46a8", (0, (5.0, 1.6))),
    ("#b00f1a", (0, (5.0, 1.4, 1.0, 1.4))),
    ("#00796b", (0, (1.4, 1.2))),
    ("#6a1b9a", (0, (8.0, 1.4, 1.0, 1.4, 1.0, 1.4))),
    ("#a84a00", (0, (3.0, 2.4))),
)
"""Of branches, one after the other; a dash says what a colour says, for those who print in grey."""
DEAD = {"ls": "", "marker": "o", "ms": 4.0, "color": "black"}
HERE = {"lw": 0.6, "ls": (0, (6.0, 2.0, 1.0, 2.0)), "color": "0.45"}
MARK = {"ls": "", "marker": "s", "ms": 4.5, "mew": 0.9, "mec": "black"}
"""Marks of dead points, of assemblies, and the line where the file has the input."""
OTHER, GAP, RULE = "0.8", "0.62", "0.45"
"""Greys: of the other circuits, of the hatching, of leaders."""


class Sheet(NamedTuple):
    """What all panels share: the output, the range of the input, the units, and the range of the output."""

    circuits: Circuits
    reading: Reading
    shown: Window
    across: str
    up: str
    low: float
    high: float
    size: Spot
    head: float
    "mm above a panel"

    def mm(self, x: Array, y: Array) -> Array:
        """Places (n, 2) on the paper, from the panel's corner."""
        wide, tall = self.size
        return np.column_stack(
            [
                (np.atleast_1d(x) - self.shown.low) / (self.shown.high - self.shown.low) * wide,
                (np.atleast_1d(y) - self.low) / (self.high - self.low) * tall,
            ]
        )


def plain(gid: str, text: str = "", heavy: bool = False) -> dict[str, Any]:
    """How a text is drawn as it stands, whatever is in it; without one only digits and such as every font has."""
    return {"family": list(families(text, heavy=heavy)), "parse_math": False, "gid": gid}
