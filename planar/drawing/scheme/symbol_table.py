"""Symbols of kinematic schemes as data: strokes in millimetres at a place, along a direction. Pages carry the table."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, degrees, hypot, pi, sin, sqrt
from typing import NamedTuple

from planar.drawing.paper.picture import Circle, Fill, PaperPoint, Pen
from planar.drawing.paper.stroke_shapes import arc_arrow_head, arc_points, arrow_head

PIN_RADIUS = 1.2
"""mm: the radius of a pin."""
DOT_RADIUS = 0.3
"""mm: the radius of the stroke round a point that is no joint."""
BLOCK_SIZE = 7.0, 4.0
"""mm: length and height of a sliding block."""
RAIL_LENGTH = 2.5 * BLOCK_SIZE[0]
"""mm: the length of a fixed guide whose block may go anywhere."""
SUPPORT_HEIGHT = 4.2
"""mm: from a fixed pin to the base line of its support."""
SUPPORT_WIDTH = 7.0
"""mm: the length of that base line."""
HATCH_LENGTH = 1.7
"""mm: the length of a stroke of hatching; as far the strokes stand apart along the line."""
RIM_WIDTH = 1.8
"""mm: from the pitch circle of an internal wheel to its rim."""
RACK_HEIGHT = 2.4
"""mm: the height of a rack behind its pitch line."""
CYLINDER_WIDTH = 4.4
"""mm: the width of a cylinder."""
SLOT_SIZE = 15.0, 3.6
"""mm: length and width of a slot."""

MASS_CENTRE_RADIUS = 1.9
"""mm: the radius of the mark of a centre of mass."""
TORSION_SPRING_RADII = 1.9, 4.6
"""mm: the least and the greatest radius of a torsional spring."""
TORSION_SPRING_TURNS = 2
"""Turns of a torsional spring, but for half a turn, without a couple."""
TORSION_DAMPER_SIZE = 5.4, 7.8, 1.9
"""mm: the radii between which a torsional damper is drawn; rad: how far it reaches round."""

INPUT_ARC_SWEEP, INPUT_ARC_LEAD = 1.75, 0.25
"""rad: how far the arrow of a turning input reaches round, and how far ahead of the driven link it starts at best."""
INPUT_ARC_RADII = (6.0, 8.0, 10.5)
"""mm: how far from the pin it may be."""
INPUT_ARROW_LENGTH = 10.0
"""mm: the length of the arrow of a sliding input."""
INPUT_ARROW_OFFSET = 4.5
"""mm: how far it is from the line of the slide."""

MOTOR_RADIUS, MOTOR_DISTANCE = 2.7, 8.5
"""mm: of the circle of a motor, and how far its middle is from what it drives."""

SymbolPoint = tuple[float, float, float]
"""A point of a symbol: the part of the way to its second place, and so far along its direction and to the left (mm)."""
TurnedPoint = tuple[float, float, float, float]
"""A point of a torsional symbol: its angle from the first link (rad), how much of the winding and of the angle between
the links comes to it, and its radius (mm)."""


class SymbolStroke(NamedTuple):
    """A line, or an area, of a symbol."""

    pen: Pen
    points: tuple[SymbolPoint, ...]
    closed: bool = False
    fill: Fill = Fill.NONE


class SymbolCircle(NamedTuple):
    """A circle about a symbol's place: so much of a given radius, and so much more (mm)."""

    pen: Pen
    radius: float
    share: float = 0.0
    fill: Fill = Fill.NONE


class TurnedStroke(NamedTuple):
    """A line of a torsional symbol."""

    pen: Pen
    turned: tuple[TurnedPoint, ...]


class Hatching(NamedTuple):
    """The symbol "hatch" all along the way between a symbol's two places."""

    length: float = HATCH_LENGTH
    end: float = 0.2
    "mm: how far before the second place the last stroke starts"


SPRING_HALF_WIDTH = 1.9
"""mm: half the width of a spring, and of a damper."""
SIDE_BY_SIDE_OFFSET = 3.2
"""mm: a spring and a damper that stand side by side are so far off their middle."""


def _zigzag(low: float, high: float, off: float) -> SymbolStroke:
    """A spring between parts of a length, as far off its line (mm): six coils between straight ends."""
    lead = 0.14 * (high - low)
    step = (high - low - 2.0 * lead) / 12.0
    teeth = [
        (low + lead + step * (k + 0.5), off + (SPRING_HALF_WIDTH if k % 2 else -SPRING_HALF_WIDTH)) for k in range(12)
    ]
    return _path((low, off), (low + lead, off), *teeth, (high - lead, off), (high, off))


def _dashpot(low: float, high: float, off: float) -> tuple[SymbolStroke, ...]:
    """A damper alike: a rod with its piston in a cylinder that is open to one side."""
    far, half = high - low, SPRING_HALF_WIDTH
    mouth, piston, base = low + 0.34 * far, low + 0.5 * far, low + 0.66 * far
    return (
        _path((low, off), (piston, off)),
        _path((piston, off - 0.65 * half), (piston, off + 0.65 * half)),
        _path((mouth, off + half), (base, off + half), (base, off - half), (mouth, off - half)),
        _path((base, off), (high, off)),
    )


def _path(*points: tuple[float, float]) -> SymbolStroke:
    """A stroke between two places, by parts of the way and how far it is off to the left (mm)."""
    return SymbolStroke(Pen.PIN, tuple((part, 0.0, off) for part, off in points))


def _arc(part: float, radius: float, start: float, stop: float, steps: int = 8) -> tuple[SymbolPoint, ...]:
    """Points of an arc about one of the two places."""
    turns = (start + (stop - start) * k / steps for k in range(steps + 1))
    return tuple((part, radius * cos(turn), radius * sin(turn)) for turn in turns)


def hatching_feet(length: float) -> list[float]:
    """Where along a line of some length (mm) the strokes of its hatching start."""
    step, end = Hatching()
    count = max(1, round((length - step / 2.0) / step))
    return [length - (count - 1 - k) * step - end for k in range(count)]


def _box(half_length: float, half_width: float) -> tuple[SymbolPoint, ...]:
    corners = ((-1, -1), (1, -1), (1, 1), (-1, 1))
    return tuple((0.0, a * half_length, b * half_width) for a, b in corners)


def _support() -> tuple[SymbolStroke, ...]:
    """A fixed pin's stand: a triangle from the pin along the direction, on a hatched base line."""
    deep, half, step = SUPPORT_HEIGHT, SUPPORT_WIDTH / 2.0, HATCH_LENGTH / sqrt(2.0)
    hatches = (
        SymbolStroke(Pen.HATCH, ((0.0, deep, foot - half), (0.0, deep + step, foot - half - step)))
        for foot in hatching_feet(SUPPORT_WIDTH)
    )
    return (
        SymbolStroke(Pen.GROUND, ((0.0, deep, -2.4), (0.0, 0.0, 0.0), (0.0, deep, 2.4))),
        SymbolStroke(Pen.GROUND, ((0.0, deep, -half), (0.0, deep, half))),
        *hatches,
    )


def _between(half: float) -> tuple[SymbolPoint, ...]:
    """The corners of a tube of some half width (mm) between two places."""
    return (0.0, 0.0, -half), (1.0, 0.0, -half), (1.0, 0.0, half), (0.0, 0.0, half)


def _stop(along: tuple[float, float], across: tuple[float, float]) -> SymbolStroke:
    """A small black block between two places along a symbol's direction, and to its left (mm)."""
    (near, far), (low, high) = along, across
    corners = ((near, low), (far, low), (far, high), (near, high))
    return SymbolStroke(Pen.PIN, tuple((0.0, x, y) for x, y in corners), True, Fill.SOLID)


def _letter_m() -> SymbolStroke:
    corners = ((-1.1, -1.3), (-1.1, 1.3), (0.0, -0.3), (1.1, 1.3), (1.1, -1.3))
    return SymbolStroke(Pen.PIN, tuple((0.0, *corner) for corner in corners))


def _slot() -> SymbolStroke:
    half = SLOT_SIZE[1] / 2.0
    ends = (*_arc(1.0, half, -pi / 2.0, pi / 2.0), *_arc(0.0, half, pi / 2.0, 1.5 * pi))
    return SymbolStroke(Pen.LINK, ends, True, Fill.PAPER)


def _torsion_spring() -> TurnedStroke:
    """Its outer end to the direction of one link, its inner end to that of the other."""
    low, high = TORSION_SPRING_RADII
    parts = [k / 60.0 for k in range(61)]
    whole = 2.0 * pi * TORSION_SPRING_TURNS
    return TurnedStroke(Pen.PIN, tuple((whole * part, part, part, high + (low - high) * part) for part in parts))


def _torsion_damper() -> tuple[TurnedStroke, ...]:
    """A vane on the one link in a part of a ring on the other."""
    low, high, sweep = TORSION_DAMPER_SIZE
    turns = [-sweep / 2.0 + sweep * k / 12.0 for k in range(13)]
    ring = [(turn, low) for turn in turns] + [(turn, high) for turn in turns[::-1]]
    lean = sweep / (2.5 * pi)
    return (
        TurnedStroke(Pen.PIN, tuple((turn, 0.0, 0.0, radius) for turn, radius in ring)),
        TurnedStroke(Pen.PIN, ((0.0, lean, 0.0, PIN_RADIUS), (0.0, lean, 0.0, high - 0.5))),
    )


def _arrow(*places: PaperPoint) -> tuple[SymbolStroke, ...]:
    """An arrow along places (mm from the symbol's place), its head at the last of them."""
    head = arrow_head(places[-2], places[-1], hypot(*(b - a for a, b in zip(*places[-2:], strict=True))))
    assert head is not None, "an arrow has a length"
    lines = (*places[:-1], head.line_end), head.corners
    line, corners = (tuple((0.0, *each) for each in spots) for spots in lines)
    return SymbolStroke(Pen.INPUT, line), SymbolStroke(Pen.INPUT, corners, True, Fill.SOLID)


def _arc_arrow(radius: float, start: float, sweep: float) -> tuple[SymbolStroke, ...]:
    """An arc about the symbol's place with an arrow head at its end (mm, rad)."""
    whole = Circle((0.0, 0.0), radius, Pen.INPUT, start=degrees(start), stop=degrees(start + sweep), arrow_end=1)
    found = arc_arrow_head(whole)
    assert found is not None, "an arc has a length"
    head, first, last = found
    line = arc_points(whole._replace(start=first, stop=last)).tolist()
    corners = tuple((0.0, *corner) for corner in head.corners)
    return (
        SymbolStroke(Pen.INPUT, tuple((0.0, x, y) for x, y in line)),
        SymbolStroke(Pen.INPUT, corners, True, Fill.SOLID),
    )


def _mass_centre() -> tuple[SymbolCircle | SymbolStroke, ...]:
    """A circle of which two opposite quarters are black."""
    quarters = (
        SymbolStroke(
            Pen.PIN, ((0.0, 0.0, 0.0), *_arc(0.0, MASS_CENTRE_RADIUS, start, start + pi / 2.0)), True, Fill.SOLID
        )
        for start in (0.0, pi)
    )
    return SymbolCircle(Pen.PIN, MASS_CENTRE_RADIUS, fill=Fill.PAPER), *quarters


SYMBOLS: dict[str, Sequence[SymbolStroke | SymbolCircle | TurnedStroke | Hatching]] = {
    "pin": (SymbolCircle(Pen.PIN, PIN_RADIUS, fill=Fill.PAPER),),
    "dot": (SymbolCircle(Pen.LINK, DOT_RADIUS),),
    "fixed dot": (SymbolCircle(Pen.PIN, DOT_RADIUS),),
    "block": (SymbolStroke(Pen.PIN, _box(BLOCK_SIZE[0] / 2.0, BLOCK_SIZE[1] / 2.0), True, Fill.PAPER),),
    "slot opening": (_slot(),),
    "support": _support(),
    "hatch": (SymbolStroke(Pen.HATCH, ((0.0, 0.0, 0.0), (0.0, -HATCH_LENGTH / sqrt(2.0), HATCH_LENGTH / sqrt(2.0)))),),
    "rail": (SymbolStroke(Pen.GROUND, ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))), Hatching()),
    "cylinder": (SymbolStroke(Pen.LINK, _between(CYLINDER_WIDTH / 2.0), True, Fill.PAPER),),
    "piston": (
        SymbolStroke(Pen.LINK, ((0.0, 0.0, 0.7 - CYLINDER_WIDTH / 2.0), (0.0, 0.0, CYLINDER_WIDTH / 2.0 - 0.7))),
        SymbolStroke(Pen.LINK, ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))),
    ),
    "rack bar": (
        SymbolStroke(
            Pen.PIN,
            ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, RACK_HEIGHT), (0.0, 0.0, RACK_HEIGHT)),
            True,
            Fill.LINK,
        ),
        SymbolStroke(Pen.PITCH, ((0.0, -2.0, 0.0), (1.0, 2.0, 0.0))),
    ),
    "block stop": (_stop((BLOCK_SIZE[0] / 2.0 + 0.2, BLOCK_SIZE[0] / 2.0 + 1.6), (-1.5, 1.5)),),
    "piston stop": tuple(_stop((0.5, 1.7), (side * 0.9, side * (CYLINDER_WIDTH / 2.0 - 0.4))) for side in (-1.0, 1.0)),
    "pin stop": (_stop((PIN_RADIUS + 0.2, PIN_RADIUS + 1.4), (-1.5, 1.5)),),
    "bar stop": (_stop((5.0, 7.2), (0.6, 2.0)),),
    "motor": (SymbolCircle(Pen.PIN, MOTOR_RADIUS, fill=Fill.PAPER), _letter_m()),
    "wheel": (SymbolCircle(Pen.PITCH, 0.0, 1.0),),
    "rim": (SymbolCircle(Pen.LINK, RIM_WIDTH, 1.0),),
    "fixed rim": (SymbolCircle(Pen.GROUND, RIM_WIDTH, 1.0),),
    "wheel mark": (SymbolStroke(Pen.PIN, ((0.8, 0.0, 0.0), (1.0, 0.0, 0.0))),),
    "band circle": (SymbolCircle(Pen.BAND, 0.0, 1.0),),
    "turning input": _arc_arrow(INPUT_ARC_RADII[0], INPUT_ARC_LEAD, INPUT_ARC_SWEEP),
    "sliding input": _arrow(
        (-INPUT_ARROW_LENGTH / 2.0, INPUT_ARROW_OFFSET), (INPUT_ARROW_LENGTH / 2.0, INPUT_ARROW_OFFSET)
    ),
    "mass centre": _mass_centre(),
    "spring": (_zigzag(0.0, 1.0, 0.0),),
    "damper": _dashpot(0.0, 1.0, 0.0),
    "both": (
        _path((0.0, 0.0), (0.1, 0.0)),
        _path((0.1, -SIDE_BY_SIDE_OFFSET), (0.1, SIDE_BY_SIDE_OFFSET)),
        _zigzag(0.1, 0.9, SIDE_BY_SIDE_OFFSET),
        *_dashpot(0.1, 0.9, -SIDE_BY_SIDE_OFFSET),
        _path((0.9, -SIDE_BY_SIDE_OFFSET), (0.9, SIDE_BY_SIDE_OFFSET)),
        _path((0.9, 0.0), (1.0, 0.0)),
    ),
    "torsion spring": (_torsion_spring(),),
    "torsion damper": _torsion_damper(),
    "torsion both": (_torsion_spring(), *_torsion_damper()),
}
"""The strokes of every symbol. Of "hatch" one stroke, to the left of the line; what marks a wheel in a moving
picture reaches to its circle; springs and dampers lie between two places."""
