"""How wide, dark and dashed each pen draws, as for print in black alone."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

from planar.drawing.paper.picture import Arrow, Circle, Fill, Pen, Polyline
from planar.foundation.errors import BadInput

MM_PER_POINT = 25.4 / 72.0
"""mm in a typographic point."""
ARROW_HEAD_LENGTH, ARROW_HEAD_WIDTH = 2.7, 1.0
"""mm of an arrow's head, unless the arrow is shorter than twice that."""

MIN_CIRCLE_DASHES = 6
"""A circle with room for fewer dashes is drawn unbroken: a small mark would be an arc."""


class PenStyle(NamedTuple):
    """A pen's line: its width (mm), its colour, and its dashes and gaps by turns (mm; none: unbroken)."""

    width: float
    colour: str
    dashes: tuple[float, ...] = ()


# colours say again what width and dashes say, so that nothing is lost in grey
PEN_STYLES = {
    Pen.LINK: PenStyle(0.7, "#000000"),
    Pen.PIN: PenStyle(0.35, "#000000"),
    Pen.GROUND: PenStyle(0.35, "#000000"),
    Pen.HATCH: PenStyle(0.18, "#000000"),
    Pen.PITCH: PenStyle(0.18, "#333333", (4.0, 0.9, 0.5, 0.9)),
    Pen.BAND: PenStyle(0.3, "#222222", (5.0, 0.8)),
    Pen.POSITION: PenStyle(0.2, "#8f8f8f"),
    Pen.PATH: PenStyle(0.3, "#00796b"),
    Pen.FIXED_CENTRODE: PenStyle(0.4, "#26a69a"),
    Pen.MOVING_CENTRODE: PenStyle(0.4, "#0b46a8", (2.4, 1.1)),
    Pen.VELOCITY: PenStyle(0.4, "#0b46a8"),
    Pen.ACCELERATION: PenStyle(0.5, "#b00f1a"),
    Pen.PART: PenStyle(0.25, "#c02028"),
    Pen.IMAGE: PenStyle(0.2, "#202020", (2.6, 0.7)),
    Pen.CONSTRUCTION: PenStyle(0.15, "#777777", (1.5, 0.9)),
    Pen.INPUT: PenStyle(0.45, "#a84a00"),
    Pen.LEADER: PenStyle(0.1, "#555555"),
    Pen.CENTRE: PenStyle(0.6, "#6a1b9a"),
    Pen.CENTRE_LINE: PenStyle(0.13, "#8e5bb0", (3.2, 1.0)),
    Pen.CIRCLE: PenStyle(0.15, "#999999"),
    Pen.CHORD: PenStyle(0.5, "#000000"),
    Pen.CHORD_FOUND: PenStyle(0.25, "#6a1b9a", (2.2, 1.1)),
    Pen.CHORD_SOLVED: PenStyle(0.35, "#a84a00", (3.5, 0.9, 0.4, 0.9)),
    Pen.REACTION: PenStyle(0.35, "#0b46a8"),
    Pen.LOAD: PenStyle(0.65, "#b00f1a"),
    Pen.INERTIA: PenStyle(0.4, "#00796b", (1.6, 0.8)),
    Pen.AXIS: PenStyle(0.25, "#000000"),
    Pen.CURVE: PenStyle(0.45, "#000000"),
    Pen.SHARE: PenStyle(0.2, "#0b46a8"),
    Pen.MEAN: PenStyle(0.25, "#333333", (4.0, 0.9, 0.5, 0.9)),
    Pen.FIRST_COGNATE: PenStyle(0.55, "#1565c0"),
    Pen.SECOND_COGNATE: PenStyle(0.55, "#c75a00", (3.0, 1.2)),
    Pen.WANTED: PenStyle(0.3, "#c2185b", (4.0, 0.7)),
    Pen.WORST: PenStyle(0.05, "#c9dcf2"),
    Pen.LIKELY: PenStyle(0.1, "#85addc"),
}
FILL_COLOURS = {
    Fill.PAPER: "#ffffff",
    Fill.LINK: "#ece7dd",
    Fill.SOLID: "#000000",
    Fill.ABOVE: "#c9c9c9",
    Fill.BELOW: "#ececec",
    Fill.WORST: "#c9dcf2",
    Fill.LIKELY: "#85addc",
}
"""Colours of areas; those that are not here are empty."""


def pen_style(mark: Polyline | Arrow | Circle) -> PenStyle:
    """The line by which a stroke is drawn."""
    style = PEN_STYLES[mark.pen]
    is_small = isinstance(mark, Circle) and 2.0 * pi * abs(mark.radius) < MIN_CIRCLE_DASHES * sum(style.dashes)
    return style._replace(dashes=()) if is_small else style


def require_matplotlib() -> None:
    """Make sure that matplotlib is there before anything is drawn with it. Raises BadInput."""
    try:
        import matplotlib as _  # noqa: F401
    except ImportError:
        raise BadInput("matplotlib", 'drawings need matplotlib: pip install "planar-linkages[plot]"') from None
