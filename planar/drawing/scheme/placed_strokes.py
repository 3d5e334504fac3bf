"""Strokes of a scheme in the axes of links (m), and what they are on paper in one position.

A stroke says by which rule its points follow the links; pages carry these, with numbers that depend on the dimensions
and on the motion, and scripts evaluate them as `stroke_marks` does.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import atan2, pi, remainder
from typing import NamedTuple

from planar.drawing.paper.picture import Fill, Outline, Pen, Polyline, paper_point
from planar.drawing.scheme import symbols
from planar.drawing.scheme.link_bodies import unit_vector
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Scalar

MIN_SPRING_LENGTH = 1e-6
"""mm: ends of a spring nearer than this have no direction."""


class PlacedLine(NamedTuple):
    """A line through places of a link, or an area."""

    about: str
    link: str
    pen: Pen
    points: tuple[Vector, ...]
    closed: bool = False
    fill: Fill = Fill.NONE


class PlacedSymbol(NamedTuple):
    """A symbol of the table at a place of a link, along a unit vector, as far as `stop` where it has two places.

    Without a direction it stands upright. `side` -1 mirrors it, `radius` is a wheel's (m); `pen` draws what it has of
    links.
    """

    about: str
    link: str
    symbol: str
    at: Vector
    direction: Vector | None = symbols.EAST
    stop: Vector | None = None
    side: float = 1.0
    radius: Scalar = 0.0
    pen: Pen = Pen.LINK


class PlacedSpring(NamedTuple):
    """A symbol that reaches from a place of one link to a place of another."""

    about: str
    links: tuple[str, str]
    symbol: str
    places: tuple[Vector, Vector]


class PlacedTorsionSpring(NamedTuple):
    """A torsional symbol at a place of the link `pin`, between directions of two links; `free` as in `Spiral`."""

    about: str
    links: tuple[str, str]
    symbol: str
    pin: str
    at: Vector
    directions: tuple[Vector, Vector]
    free: float


PlacedStroke = PlacedLine | PlacedSymbol | PlacedSpring | PlacedTorsionSpring


def stroke_marks(strokes: Iterable[PlacedStroke], frames: Mapping[str, Frame], per_mm: float) -> Iterator[Outline]:
    """Strokes on paper (mm) where the links have these frames, with so many metres to a millimetre."""

    def to_paper(link: str, at: Vector) -> Vector:
        return frames[link].to_world(Vector(*paper_point(at))) * (1.0 / per_mm)

    def turned(link: str, way: Vector) -> Vector:
        return frames[link].rotate_to_world(Vector(*paper_point(way)))

    for each in strokes:
        if isinstance(each, PlacedLine):
            spots = tuple(paper_point(to_paper(each.link, at)) for at in each.points)
            yield Polyline(spots, each.pen, each.about, each.closed, each.fill)
        elif isinstance(each, PlacedSymbol):
            at = to_paper(each.link, each.at)
            way = symbols.EAST if each.direction is None else turned(each.link, each.direction)
            stop = None if each.stop is None else to_paper(each.link, each.stop)
            if stop is not None and (stop - at).dot(way) < 0.0:
                continue  # nothing is left of it
            radius = float(each.radius) / per_mm
            yield from symbols.symbol_marks(
                each.symbol, each.about, at, way, stop, side=each.side, radius=radius, pen=each.pen
            )
        elif isinstance(each, PlacedSpring):
            start, stop = (to_paper(link, at) for link, at in zip(each.links, each.places, strict=True))
            apart = stop - start
            if apart.dot(apart) > MIN_SPRING_LENGTH**2:
                yield from symbols.symbol_marks(each.symbol, each.about, start, unit_vector(apart), stop)
        else:
            ways = [turned(link, way) for link, way in zip(each.links, each.directions, strict=True)]
            first, second = (atan2(way.y, way.x) for way in ways)
            angles = [frames[link].angle for link in each.links]
            wound = remainder(angles[1] - angles[0] - each.free, 2.0 * pi)
            yield from symbols.torsion_spring(
                to_paper(each.pin, each.at), first, second, wound, each.symbol, each.about
            )
