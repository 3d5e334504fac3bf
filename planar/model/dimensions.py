"""The dimensions of a mechanism's links by name, and the mechanism with one of them changed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from planar.model.mechanism import Along, At, Distances, Link, Mechanism, Point, PointDefinition


class Dimension(NamedTuple):
    """A length (m) that a link is described by: `link.length`, or `link.point.what`."""

    name: str
    link: str
    value: float


def dimensions(mechanism: Mechanism, links: frozenset[str]) -> Iterator[Dimension]:
    """The lengths by which these links are described, in the order of the file.

    Of a point: x and y; the distance along two points; the distances from two points, under their names.
    """
    for link in mechanism.links:
        if link.name not in links:
            continue
        if link.length is not None:
            yield Dimension(f"{link.name}.length", link.name, link.length)
        for point in link.points:
            for what, value in _lengths_of_place(point.place).items():
                yield Dimension(f"{link.name}.{point.name}.{what}", link.name, value)


def change_dimension(mechanism: Mechanism, dimension: Dimension, value: float) -> Mechanism:
    """The mechanism with this dimension at another value (m)."""

    def remade(link: Link) -> Link:
        if link.name != dimension.link:
            return link
        what = dimension.name.removeprefix(f"{link.name}.")
        if what == "length":
            return replace(link, length=value)
        point, part = what.rsplit(".", 1)
        points = (Point(p.name, _change_place(p.place, part, value)) if p.name == point else p for p in link.points)
        return replace(link, points=tuple(points))

    return replace(mechanism, links=tuple(remade(link) for link in mechanism.links))


def _lengths_of_place(place: PointDefinition) -> dict[str, float]:
    if isinstance(place, At):
        return {"x": place.x, "y": place.y}
    if isinstance(place, Along):
        return {"distance": place.distance}
    return {place.first: place.from_first, place.second: place.from_second}


def _change_place(place: PointDefinition, part: str, value: float) -> PointDefinition:
    if isinstance(place, Distances):
        field = "from_first" if part == place.first else "from_second"
        return place._replace(**{field: value})
    return place._replace(**{part: value})
