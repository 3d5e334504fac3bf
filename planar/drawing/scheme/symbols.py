"""Symbols of the table placed on paper."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, pi, remainder, sqrt

from planar.drawing.paper.picture import Circle, Fill, Outline, Pen, Polyline, paper_point
from planar.drawing.scheme.symbol_table import SYMBOLS, Hatching, SymbolCircle, TurnedStroke, hatching_feet
from planar.foundation.geometry import Vector, direction

EAST = Vector(1.0, 0.0)


def quarter_turn(way: Vector) -> Vector:
    """A vector turned a quarter anticlockwise."""
    return Vector(-way.y, way.x)


def symbol_marks(
    name: str,
    about: str,
    at: Vector,
    way: Vector = EAST,
    stop: Vector | None = None,
    *,
    side: float = 1.0,
    radius: float = 0.0,
    pen: Pen = Pen.LINK,
) -> Iterator[Outline]:
    """A symbol of the table at a place on paper, along a unit vector, and as far as a second place where it has two.

    `side` -1 mirrors it, `radius` is that of a wheel (mm); `pen` draws links.
    """
    whole, left = (stop or at) - at, quarter_turn(way) * side
    for each in SYMBOLS[name]:
        if isinstance(each, Hatching):
            length = sqrt(whole.dot(whole))
            for foot in hatching_feet(length) if length > 0.0 else ():
                yield from symbol_marks("hatch", about, at + way * foot, way, side=side)
            continue
        own = pen if each.pen is Pen.LINK else each.pen
        if isinstance(each, SymbolCircle):
            yield Circle(paper_point(at), each.share * radius + each.radius, own, about, each.fill)
        elif not isinstance(each, TurnedStroke):
            spots = (at + whole * part + way * along + left * off for part, along, off in each.points)
            yield Polyline(tuple(paper_point(spot) for spot in spots), own, about, each.closed, each.fill)


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
            yield Polyline(tuple(paper_point(spot) for spot in spots), each.pen, about)


def turning_arrow(at: Vector, radius: float, middle: float, sweep: float, sense: int, about: str) -> Circle:
    """An arc about a place with an arrow head at the end to which it turns (rad)."""
    start = degrees(middle - sweep / 2.0) % 360.0
    return Circle(paper_point(at), radius, Pen.INPUT, about, Fill.NONE, start, start + degrees(sweep), sense)
