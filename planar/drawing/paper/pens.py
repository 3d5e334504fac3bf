"""How wide, dark and dashed each pen draws, as for print in black alone."""

from __future__ import annotations

from typing import NamedTuple

from planar.drawing.paper.picture import Fill, Pen
from planar.foundation.errors import BadInput

POINT = 25.4 / 72.0
"""mm in a typographic point."""
HEAD_LENGTH, HEAD_WIDTH = 2.7, 1.0
"""mm of an arrow's head, unless the arrow is shorter than twice that."""


class Ink(NamedTuple):
    """A pen's line: its width (mm), its colour, and its dashes and gaps by turns (mm; none: unbroken)."""

    width: float
    colour: str
    dashes: tuple[float, ...] = ()


# colours say again what width and dashes say, so that nothing is lost in grey
INK = {
    Pen.LINK: Ink(0.7, "#000000"),
    Pen.PIN: Ink(0.35, "#000000"),
    Pen.GROUND: Ink(0.35, "#000000"),
    Pen.HATCH: Ink(0.18, "#000000"),
    Pen.PITCH: Ink(0.18, "#333333", (4.0, 0.9, 0.5, 0.9)),
    Pen.BAND: Ink(0.3, "#222222", (5.0, 0.8)),
    Pen.POSITION: Ink(0.2, "#8f8f8f"),
    Pen.PATH: Ink(0.3, "#00796b"),
    Pen.FIXED_CENTRODE: Ink(0.4, "#26a69a"),
    Pen.MOVING_CENTRODE: Ink(0.4, "#0b46a8", (2.4, 1.1)),
    Pen.VELOCITY: Ink(0.4, "#0b46a8"),
    Pen.ACCELERATION: Ink(0.5, "#b00f1a"),
    Pen.PART: Ink(0.25, "#c02028"),
    Pen.IMAGE: Ink(0.2, "#202020", (2.6, 0.7)),
    Pen.CONSTRUCTION: Ink(0.15, "#777777", (1.5, 0.9)),
    Pen.INPUT: Ink(0.45, "#a84a00"),
    Pen.LEADER: Ink(0.1, "#555555"),
    Pen.CENTRE: Ink(0.6, "#6a1b9a"),
    Pen.CENTRE_LINE: Ink(0.13, "#8e5bb0", (3.2, 1.0)),
    Pen.CIRCLE: Ink(0.15, "#999999"),
    Pen.CHORD: Ink(0.5, "#000000"),
    Pen.CHORD_FOUND: Ink(0.25, "#6a1b9a", (2.2, 1.1)),
    Pen.CHORD_SOLVED: Ink(0.35, "#a84a00", (3.5, 0.9, 0.4, 0.9)),
    Pen.REACTION: Ink(0.35, "#0b46a8"),
    Pen.LOAD: Ink(0.65, "#b00f1a"),
    Pen.INERTIA: Ink(0.4, "#00796b", (1.6, 0.8)),
    Pen.AXIS: Ink(0.25, "#000000"),
    Pen.CURVE: Ink(0.45, "#000000"),
    Pen.SHARE: Ink(0.2, "#0b46a8"),
    Pen.MEAN: Ink(0.25, "#333333", (4.0, 0.9, 0.5, 0.9)),
}
FILLS = {
    Fill.PAPER: "#ffffff",
    Fill.LINK: "#ece7dd",
    Fill.SOLID: "#000000",
    Fill.ABOVE: "#c9c9c9",
    Fill.BELOW: "#ececec",
}
"""Colours of areas; those that are not here are empty."""


def ready() -> None:
    """Make sure that matplotlib is there before anything is drawn with it. Raises BadInput."""
    try:
        import matplotlib as _  # noqa: F401
    except ImportError:
        raise BadInput("matplotlib", "drawings need matplotlib: pip install 'planar[plot]'") from None
