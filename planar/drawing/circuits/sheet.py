"""What all panels of the diagram of circuits share: its scales on the paper, its lines, marks and letters."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.circuits.circuits import Circuits
from planar.drawing.circuits.curves import InputWindow, PlottedOutput
from planar.drawing.labels.fonts import font_families
from planar.foundation.arrays import Array

PanelPoint = tuple[float, float]

SMALL_TEXT, NORMAL_TEXT, LARGE_TEXT = 7.0, 8.0, 10.0
"""points"""
BRANCH_LINES = (
    ("#000000", "-"),
    ("#0b46a8", (0, (5.0, 1.6))),
    ("#b00f1a", (0, (5.0, 1.4, 1.0, 1.4))),
    ("#00796b", (0, (1.4, 1.2))),
    ("#6a1b9a", (0, (8.0, 1.4, 1.0, 1.4, 1.0, 1.4))),
    ("#a84a00", (0, (3.0, 2.4))),
)
"""Of branches, one after the other; a dash says what a colour says, for those who print in grey."""
ArtistStyle = dict[str, Any]
"""Properties of artists as matplotlib takes them by name."""
DEAD_POINT_MARK: ArtistStyle = {"ls": "", "marker": "o", "ms": 4.0, "color": "black"}
INPUT_LINE: ArtistStyle = {"lw": 0.6, "ls": (0, (6.0, 2.0, 1.0, 2.0)), "color": "0.45"}
ASSEMBLY_MARK: ArtistStyle = {"ls": "", "marker": "s", "ms": 4.5, "mew": 0.9, "mec": "black"}
"""Marks of dead points, of assemblies, and the line where the file has the input."""
OTHER_GREY, GAP_GREY, LEADER_GREY = "0.8", "0.62", "0.45"
"""Greys: of the other circuits, of the hatching, of leaders."""


class PanelLayout(NamedTuple):
    """What all panels share: the output, the range of the input, the units, and the range of the output."""

    circuits: Circuits
    output: PlottedOutput
    window: InputWindow
    input_unit: str
    output_unit: str
    output_low: float
    output_high: float
    panel_size: PanelPoint
    head_height: float
    "mm above a panel"

    def to_paper(self, x: Array, y: Array) -> Array:
        """Places (n, 2) on the paper, from the panel's corner."""
        wide, tall = self.panel_size
        return np.column_stack(
            [
                (np.atleast_1d(x) - self.window.low) / (self.window.high - self.window.low) * wide,
                (np.atleast_1d(y) - self.output_low) / (self.output_high - self.output_low) * tall,
            ]
        )


def text_settings(gid: str, text: str = "", heavy: bool = False) -> dict[str, Any]:
    """How a text is drawn as it stands, whatever is in it; without one only digits and such as every font has."""
    return {"family": list(font_families(text, heavy=heavy)), "parse_math": False, "gid": gid}
