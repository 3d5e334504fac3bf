"""Symbols of the table placed on paper, and what is counted by its length: hatching, rims, bands."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import acos, atan2, ceil, degrees, pi, remainder, sqrt

from planar.drawing.paper.picture import Circle, Fill, Outline, Pen, Polyline, paper_point
from planar.drawing.scheme.symbol_table import (
    HATCH_LENGTH,
    RIM_WIDTH,
    SLOT_SIZE,
    SYMBOLS,
    SymbolCircle,
    TurnedStroke,
    hatching_feet,
)
from planar.foundation.geometry import Vector, direction

EAST = Vector(1.0, 0.0)


def quarter_turn(way: Vector) -> Vector:
    """A vector turned a quarter anticlockwise."""
    return Vector(-way.y, way.x)


def stroke(about: str, pen: Pen, *spots: Vector) -> Polyline:
    """A stroke through places on paper."""
    return Polyline(tuple(paper_point(each) for each in spots), pen, about)


def filled_area(about: str, pen: Pen, fill: Fill, *spots: Vector) -> Polyline:
    """A filled area with its outline."""
    return Polyline(tuple(paper_point(each) for each in spots), pen, about, True, fill)


def symbol_marks(
    name: str,
    about: str,
    at: Vector,
    way: Vector = EAST,
    stop: Vector | None = None,
    *,
    left: Vector | None = None,
    radius: float = 0.0,
    pen: Pen = Pen.LINK,
) -> Iterator[Outline]:
    """A symbol of the table at a place on paper, along a unit vector, and as far as a second place where it has two.

    `left` is the unit vector to its left where it may be mirrored, `radius` that of a wheel (mm); `pen` draws links.
    """
    whole = (stop or at) - at
    left = left or quarter_turn(way)
    for each in SYMBOLS[name]:
        own = pen if each.pen is Pen.LINK else each.pen
        if isinstance(each, SymbolCircle):
            yield Circle(paper_point(at), each.share * radius + each.radius, own, about, each.fill)
        elif not isinstance(each, TurnedStroke):
            spots = (at + whole * part + way * along + left * off for part, along, off in each.points)
            yield Polyline(tuple(paper_point(spot) for spot in spots), own, about, each.closed, each.fill)


def hatching(start: Vector, stop: Vector, side: Vector, about: str) -> Iterator[Outline]:
    """Strokes at 45 degrees from a line to the side to which the unit vector `side` points."""
    whole = stop - start
    length = sqrt(whole.dot(whole))
    if length > 0.0:
        way = whole * (1.0 / length)
        for foot in hatching_feet(length):
            yield from symbol_marks("hatch", about, start + way * foot, way, left=side)


def rail(start: Vector, stop: Vector, side: Vector, about: str) -> tuple[Outline, ...]:
    """A line of what does not move, hatched on one side."""
    return stroke(about, Pen.GROUND, start, stop), *hatching(start, stop, side, about)


def slot(at: Vector, way: Vector, about: str, pen: Pen) -> Iterator[Outline]:
    """A slot of the usual length along a unit vector."""
    half = way * ((SLOT_SIZE[0] - SLOT_SIZE[1]) / 2.0)
    return symbol_marks("slot opening", about, at - half, way, at + half, pen=pen)


def torsion_spring(
    at: Vector, first: float, second: float, wound: float, symbol: str, about: str
) -> Iterator[Polyline]:
    """A torsional symbol about a pin between the directions of two links (rad).

    Its coils are those without a couple, and by how much it is `wound` more.
    """
    apart = remainder(second - first - wound, 2.0 * pi)
    for each in SYMBOLS[symbol]:
        if isinstance(each, TurnedStroke):
            spots = (at + direction(first + turn + a * wound + b * apart) * r for turn, a, b, r in each.turned)
            yield stroke(about, each.pen, *spots)


def wheel(at: Vector, radius: float, about: str, rim: str = "rim") -> Iterator[Outline]:
    """A pitch circle; of an internal wheel (radius below zero) also its rim."""
    for name in ("wheel", rim) if radius < 0.0 else ("wheel",):
        yield from symbol_marks(name, about, at, radius=abs(radius))


def fixed_wheel(at: Vector, radius: float, about: str) -> tuple[Outline, ...]:
    """A wheel that does not move: a hatched one."""
    return *wheel(at, radius, about, "fixed rim"), *rim_hatching(at, radius, about)


def rim_hatching(at: Vector, radius: float, about: str) -> Iterator[Outline]:
    """Hatching in three places inside the circle of a wheel, of an internal wheel outside its rim."""
    inside = radius > 0.0
    rim = abs(radius) if inside else abs(radius) + RIM_WIDTH
    if inside and rim < 3.0 * HATCH_LENGTH:
        return
    arc = min(pi / 5.0, 12.0 / rim)
    count = max(2, ceil(arc * rim / HATCH_LENGTH))
    for middle in (pi / 2.0, pi * 7.0 / 6.0, pi * 11.0 / 6.0):
        for k in range(count + 1):
            out = direction(middle + arc * (k / count - 0.5))
            inward = out * (-1.0 if inside else 1.0)
            yield from symbol_marks("hatch", about, at + out * rim, quarter_turn(out) * -1.0, left=inward)


def band(centres: Sequence[Vector], radii: Sequence[float], crossed: bool, about: str) -> tuple[Outline, ...]:
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
