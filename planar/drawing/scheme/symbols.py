"""Symbols of kinematic schemes in millimetres on paper: supports, rails, blocks, slots, cylinders, wheels, bands."""

from __future__ import annotations

from collections.abc import Sequence
from math import acos, atan2, ceil, degrees, pi, remainder, sqrt

from planar.drawing.paper.picture import Circle, Fill, Mark, Pen, Polyline, paper_point
from planar.foundation.geometry import Vector, direction

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

SymbolPath = tuple[tuple[float, float], ...]
"""Places by the part of a length at which they are, and how far they are off its line to the left (mm)."""
SPRING_HALF_WIDTH = 1.9
"""mm: half the width of a spring, and of a damper."""
SIDE_BY_SIDE_OFFSET = 3.2
"""mm: a spring and a damper that stand side by side are so far off their middle."""


def _zigzag(low: float, high: float, off: float) -> SymbolPath:
    """A spring between parts of a length, as far off its line (mm): six coils between straight ends."""
    lead = 0.14 * (high - low)
    step = (high - low - 2.0 * lead) / 12.0
    teeth = [
        (low + lead + step * (k + 0.5), off + (SPRING_HALF_WIDTH if k % 2 else -SPRING_HALF_WIDTH)) for k in range(12)
    ]
    return ((low, off), (low + lead, off), *teeth, (high - lead, off), (high, off))


def _dashpot(low: float, high: float, off: float) -> tuple[SymbolPath, ...]:
    """A damper alike: a rod with its piston in a cylinder that is open to one side."""
    far = high - low
    mouth, piston, base = low + 0.34 * far, low + 0.5 * far, low + 0.66 * far
    return (
        ((low, off), (piston, off)),
        ((piston, off - 0.65 * SPRING_HALF_WIDTH), (piston, off + 0.65 * SPRING_HALF_WIDTH)),
        (
            (mouth, off + SPRING_HALF_WIDTH),
            (base, off + SPRING_HALF_WIDTH),
            (base, off - SPRING_HALF_WIDTH),
            (mouth, off - SPRING_HALF_WIDTH),
        ),
        ((base, off), (high, off)),
    )


SPRING_SYMBOLS: dict[str, tuple[SymbolPath, ...]] = {
    "spring": (_zigzag(0.0, 1.0, 0.0),),
    "damper": _dashpot(0.0, 1.0, 0.0),
    "both": (
        ((0.0, 0.0), (0.1, 0.0)),
        ((0.1, -SIDE_BY_SIDE_OFFSET), (0.1, SIDE_BY_SIDE_OFFSET)),
        _zigzag(0.1, 0.9, SIDE_BY_SIDE_OFFSET),
        *_dashpot(0.1, 0.9, -SIDE_BY_SIDE_OFFSET),
        ((0.9, -SIDE_BY_SIDE_OFFSET), (0.9, SIDE_BY_SIDE_OFFSET)),
        ((0.9, 0.0), (1.0, 0.0)),
    ),
}
"""Springs and dampers between two places."""


def quarter_turn(way: Vector) -> Vector:
    """A vector turned a quarter anticlockwise."""
    return Vector(-way.y, way.x)


def stroke(about: str, pen: Pen, *spots: Vector) -> Polyline:
    """A stroke through places on paper."""
    return Polyline(tuple(paper_point(each) for each in spots), pen, about)


def filled_area(about: str, pen: Pen, fill: Fill, *spots: Vector) -> Polyline:
    """A filled area with its outline."""
    return Polyline(tuple(paper_point(each) for each in spots), pen, about, True, fill)


def hatching(start: Vector, stop: Vector, side: Vector, about: str) -> tuple[Polyline, ...]:
    """Strokes at 45 degrees from a line to the side to which the unit vector `side` points."""
    whole = stop - start
    length = sqrt(whole.dot(whole))
    if length <= 0.0:
        return ()
    way = whole * (1.0 / length)
    step = (side - way) * (HATCH_LENGTH / sqrt(2.0))
    count = max(1, round((length - HATCH_LENGTH / 2.0) / HATCH_LENGTH))
    first = length - (count - 1) * HATCH_LENGTH
    feet = (start + way * (first + HATCH_LENGTH * k - 0.2) for k in range(count))
    return tuple(stroke(about, Pen.HATCH, foot, foot + step) for foot in feet)


def rail(start: Vector, stop: Vector, side: Vector, about: str) -> tuple[Polyline, ...]:
    """A line of what does not move, hatched on one side."""
    return stroke(about, Pen.GROUND, start, stop), *hatching(start, stop, side, about)


def support(at: Vector, down: Vector, about: str) -> tuple[Polyline, ...]:
    """A fixed pin's stand: a triangle from the pin towards `down`, on a hatched base line."""
    across = quarter_turn(down)
    foot = at + down * SUPPORT_HEIGHT
    legs = stroke(about, Pen.GROUND, foot - across * 2.4, at, foot + across * 2.4)
    return legs, *rail(foot - across * (SUPPORT_WIDTH / 2.0), foot + across * (SUPPORT_WIDTH / 2.0), down, about)


def pin(at: Vector, about: str) -> Circle:
    """A pin."""
    return Circle(paper_point(at), PIN_RADIUS, Pen.PIN, about, Fill.PAPER)


def dot(at: Vector, about: str, pen: Pen = Pen.LINK) -> Circle:
    """A point that is no joint."""
    return Circle(paper_point(at), DOT_RADIUS, pen, about, Fill.NONE)


def block(at: Vector, way: Vector, about: str) -> Polyline:
    """A sliding block along a unit vector."""
    along, across = way * (BLOCK_SIZE[0] / 2.0), quarter_turn(way) * (BLOCK_SIZE[1] / 2.0)
    corners = at - along - across, at + along - across, at + along + across, at - along + across
    return filled_area(about, Pen.PIN, Fill.PAPER, *corners)


def slot(at: Vector, way: Vector, about: str, pen: Pen) -> Polyline:
    """A slot along a unit vector, its ends round."""
    radius = SLOT_SIZE[1] / 2.0
    along, turn = way * (SLOT_SIZE[0] / 2.0 - radius), atan2(way.y, way.x)
    half = [direction(turn - pi / 2.0 + pi * k / 8.0) * radius for k in range(9)]
    return filled_area(
        about, pen, Fill.PAPER, *(at + along + each for each in half), *(at - along - each for each in half)
    )


def spring(start: Vector, stop: Vector, symbol: str, about: str) -> tuple[Polyline, ...]:
    """A spring or a damper between two places that are apart."""
    whole = stop - start
    left = quarter_turn(whole * (1.0 / sqrt(whole.dot(whole))))
    paths = SPRING_SYMBOLS[symbol]
    return tuple(stroke(about, Pen.PIN, *(start + whole * part + left * off for part, off in path)) for path in paths)


def torsion_spring(
    at: Vector, first: float, second: float, wound: float, symbol: str, about: str
) -> tuple[Polyline, ...]:
    """A torsional spring about a pin: its outer end to the direction of one link, its inner end to that of the other.

    Its coils are those without a couple, and by how much it is `wound` more. A damper: a vane on the one link in a part
    of a ring on the other (rad).
    """
    strokes = []
    if symbol != "damper":
        low, high = TORSION_SPRING_RADII
        whole = 2.0 * pi * TORSION_SPRING_TURNS + remainder(second - first - wound, 2.0 * pi) + wound
        parts = [k / 60.0 for k in range(61)]
        spots = (at + direction(first + whole * part) * (high + (low - high) * part) for part in parts)
        strokes.append(stroke(about, Pen.PIN, *spots))
    if symbol != "spring":
        low, high, sweep = TORSION_DAMPER_SIZE
        turns = [first - sweep / 2.0 + sweep * k / 12.0 for k in range(13)]
        ring = [at + direction(turn) * low for turn in turns] + [at + direction(turn) * high for turn in turns[::-1]]
        vane = direction(first + wound * sweep / (2.5 * pi))
        strokes.append(stroke(about, Pen.PIN, *ring))
        strokes.append(stroke(about, Pen.PIN, at + vane * PIN_RADIUS, at + vane * (high - 0.5)))
    return tuple(strokes)


def mass_centre(at: Vector, about: str) -> tuple[Mark, ...]:
    """A centre of mass: a circle of which two opposite quarters are black."""
    quarters = [
        (at, *(at + direction(start + pi * k / 16.0) * MASS_CENTRE_RADIUS for k in range(9))) for start in (0.0, pi)
    ]
    whole = Circle(paper_point(at), MASS_CENTRE_RADIUS, Pen.PIN, about, Fill.PAPER)
    return whole, *(filled_area(about, Pen.PIN, Fill.SOLID, *corners) for corners in quarters)


def cylinder(base: Vector, mouth: Vector, way: Vector, about: str) -> Polyline:
    """A cylinder from its base to its mouth."""
    across = quarter_turn(way) * (CYLINDER_WIDTH / 2.0)
    return filled_area(about, Pen.LINK, Fill.PAPER, base - across, mouth - across, mouth + across, base + across)


def piston(at: Vector, end: Vector, way: Vector, about: str, pen: Pen = Pen.LINK) -> tuple[Polyline, Polyline]:
    """A piston across its cylinder with its rod to the end."""
    across = quarter_turn(way) * (CYLINDER_WIDTH / 2.0 - 0.7)
    return stroke(about, pen, at - across, at + across), stroke(about, pen, at, end)


def rack(start: Vector, stop: Vector, back: Vector, about: str) -> tuple[Polyline, Polyline]:
    """A bar on one side of a pitch line, and the pitch line a little longer than it."""
    behind, over = back * RACK_HEIGHT, Vector(back.y, -back.x) * 2.0
    if over.dot(stop - start) < 0.0:
        over = over * -1.0
    bar = filled_area(about, Pen.PIN, Fill.LINK, start, stop, stop + behind, start + behind)
    return bar, stroke(about, Pen.PITCH, start - over, stop + over)


def wheel(at: Vector, radius: float, about: str, rim: Pen) -> tuple[Circle, ...]:
    """A pitch circle; of an internal wheel (radius below zero) also its rim."""
    pitch = Circle(paper_point(at), abs(radius), Pen.PITCH, about)
    return (pitch, Circle(paper_point(at), abs(radius) + RIM_WIDTH, rim, about)) if radius < 0.0 else (pitch,)


def fixed_wheel(at: Vector, radius: float, about: str) -> tuple[Mark, ...]:
    """A wheel that does not move: a hatched one."""
    return *wheel(at, radius, about, Pen.GROUND), *rim_hatching(at, radius, about)


def rim_hatching(at: Vector, radius: float, about: str) -> tuple[Polyline, ...]:
    """Hatching in three places inside the circle of a wheel, of an internal wheel outside its rim."""
    inside = radius > 0.0
    rim = abs(radius) if inside else abs(radius) + RIM_WIDTH
    if inside and rim < 3.0 * HATCH_LENGTH:
        return ()
    arc = min(pi / 5.0, 12.0 / rim)
    count = max(2, ceil(arc * rim / HATCH_LENGTH))
    strokes = []
    for middle in (pi / 2.0, pi * 7.0 / 6.0, pi * 11.0 / 6.0):
        for k in range(count + 1):
            out = direction(middle + arc * (k / count - 0.5))
            step = (out * (-1.0 if inside else 1.0) + quarter_turn(out)) * (HATCH_LENGTH / sqrt(2.0))
            strokes.append(stroke(about, Pen.HATCH, at + out * rim, at + out * rim + step))
    return tuple(strokes)


def band(centres: Sequence[Vector], radii: Sequence[float], crossed: bool, about: str) -> tuple[Mark, ...]:
    """A loop round two wheels: both circles and their outer, if crossed their inner, common tangents."""
    (p, q), (r, s) = centres, radii
    circles = tuple(Circle(paper_point(at), each, Pen.BAND, about) for at, each in ((p, r), (q, s)))
    whole = q - p
    length = sqrt(whole.dot(whole))
    far = -s if crossed else s
    if length <= 0.0 or abs(r - far) > length:
        return circles
    turn, lean = atan2(whole.y, whole.x), acos((r - far) / length)
    normals = [direction(turn + sign * lean) for sign in (1.0, -1.0)]
    return *circles, *(stroke(about, Pen.BAND, p + out * r, q + out * far) for out in normals)


def turning_arrow(at: Vector, radius: float, middle: float, sweep: float, sense: int, about: str) -> Circle:
    """An arc about a place with an arrow head at the end to which it turns (rad)."""
    start = degrees(middle - sweep / 2.0) % 360.0
    return Circle(paper_point(at), radius, Pen.INPUT, about, Fill.NONE, start, start + degrees(sweep), sense)
