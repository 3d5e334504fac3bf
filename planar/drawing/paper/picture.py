"""Pictures as data: strokes and letters in millimetres on paper, before anything draws them.

A picture can be looked at by a test, laid beside others on a sheet, or drawn by any means. Its own axes are x to the
right and y upwards; where on the sheet it comes to lie is not its concern.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple

import numpy as np

PaperPoint = tuple[float, float]
"""A place on paper (mm)."""


class Pen(Enum):
    """What a stroke stands for; how wide, dark and dashed that is drawn is settled in one place."""

    LINK = "link"
    """The body of a moving link."""
    PIN = "pin"
    """The outline of a pin or a sliding block."""
    GROUND = "ground"
    """The outline of what does not move: a support, a fixed guide."""
    HATCH = "hatch"
    """The hatching of what does not move."""
    PITCH = "pitch"
    """Pitch circles and pitch lines, centre lines."""
    BAND = "band"
    """A belt or a chain."""
    POSITION = "position"
    """A link in one of many positions."""
    PATH = "path"
    """The path of a point."""
    FIXED_CENTRODE = "fixed centrode"
    MOVING_CENTRODE = "moving centrode"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"
    PART = "part"
    """A part of an acceleration: centripetal, tangential, Coriolis."""
    IMAGE = "image"
    """A side of a link's image in a polygon."""
    CONSTRUCTION = "construction"
    """A line that only helps to find a point."""
    INPUT = "input"
    """The arrow that shows which way an input drives."""
    LEADER = "leader"
    """From a letter that stands away to what it names."""
    CENTRE = "centre"
    """The mark of an instantaneous centre, or the arrow towards one that is far away."""
    CENTRE_LINE = "centre line"
    """A line of centres, on which a centre was found."""
    CIRCLE = "circle"
    """The circle of a circle diagram."""
    CHORD = "chord"
    """In a circle diagram: a centre that a pair shows."""
    CHORD_FOUND = "chord found"
    """In a circle diagram: a centre found by Kennedy's theorem."""
    CHORD_SOLVED = "chord solved"
    """In a circle diagram: a centre found by equations."""
    REACTION = "reaction"
    """A force or couple that a pair puts on a link."""
    LOAD = "load"
    """A load, a weight, a spring, or what an input supplies."""
    INERTIA = "inertia"
    """A force of inertia, which nothing puts on a link."""
    AXIS = "axis"
    """An axis of a diagram, with its ticks."""
    CURVE = "curve"
    """A curve of a diagram."""
    SHARE = "share"
    """A part of what a curve is made of."""
    MEAN = "mean"
    """The mean of a curve."""
    FIRST_COGNATE, SECOND_COGNATE = "first cognate", "second cognate"
    """The body of a moving link of another linkage that traces the same path."""
    WANTED = "wanted"
    """What a mechanism is to do: places, poses, a curve."""
    WORST, LIKELY = "worst", "likely"
    """The edge of where something is in the worst case, and nearly always."""


class Fill(Enum):
    """What an area is filled with."""

    NONE = "none"
    PAPER = "paper"
    """Hides what lies below."""
    LINK = "link"
    """The light tone of a link that is a plate."""
    SOLID = "solid"
    """The black of a mark, such as a centre of mass."""
    ABOVE = "above"
    """What of a curve is above its mean."""
    BELOW = "below"
    """What of a curve is below its mean."""
    WORST, LIKELY = "worst", "likely"
    """Where something is in the worst case, and nearly always."""


class Polyline(NamedTuple):
    """A line through spots, or an area if it is closed; `about` says what it belongs to, such as "link AB"."""

    points: tuple[PaperPoint, ...]
    pen: Pen
    about: str = ""
    closed: bool = False
    fill: Fill = Fill.NONE


class Arrow(NamedTuple):
    """A straight arrow; its head's tip is at `head` exactly."""

    tail: PaperPoint
    head: PaperPoint
    pen: Pen
    about: str = ""


class Circle(NamedTuple):
    """A whole circle, or an arc anticlockwise from `start` to `stop` (degrees); an arc may end in an arrow head."""

    centre: PaperPoint
    radius: float
    pen: Pen
    about: str = ""
    fill: Fill = Fill.NONE
    start: float = 0.0
    stop: float = 360.0
    arrow_end: int = 0
    "1: an arrow head where the arc stops, -1: where it starts, 0: none"


class Label(NamedTuple):
    """A text that names something at a spot; it is placed near it, clear of strokes and of other letters.

    A text is shown as it stands; with `math` it is mathtext ("$A_1$"), only ever for texts that the program itself
    makes. `away` keeps it that far from the spot (mm), such as a pin's radius.
    """

    text: str
    at: PaperPoint
    about: str = ""
    size: float = 9.0
    "points"
    clearance: float = 1.0
    slanted: bool = False
    math: bool = False
    side: PaperPoint | None = None
    "the only side on which it may stand, such as (0, -1) for below, as the numbers of an axis do"


Outline = Polyline | Circle
Stroke = Outline | Arrow
Mark = Stroke | Label


class Picture(NamedTuple):
    """Marks in the order in which they are drawn, with a title and lines of text that go below."""

    marks: tuple[Mark, ...]
    title: str = ""
    notes: tuple[str, ...] = ()
    "such as the scale: `1 cm = 0.1 m/s`"
    window: tuple[PaperPoint, PaperPoint] | None = None
    "lower left and upper right corner of what is shown of the strokes; left out, all"


def paper_point(vector: Iterable[float]) -> PaperPoint:
    """A place on paper from any two numbers."""
    x, y = vector
    return float(x), float(y)


def extent(marks: Iterable[Mark]) -> tuple[PaperPoint, PaperPoint]:
    """The lower left and the upper right corner of everything but the texts (mm); letters count with their spot."""
    corners: list[PaperPoint] = []
    for mark in marks:
        if isinstance(mark, Polyline):
            corners += mark.points
        elif isinstance(mark, Arrow):
            corners += (mark.tail, mark.head)
        elif isinstance(mark, Circle):
            (x, y), r = mark.centre, mark.radius
            corners += ((x - r, y - r), (x + r, y + r))
        else:
            corners.append(mark.at)
    if not corners:
        return (0.0, 0.0), (0.0, 0.0)
    both = np.array(corners)
    return paper_point(both.min(axis=0)), paper_point(both.max(axis=0))
