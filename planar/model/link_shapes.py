"""Where the points of a link lie in its own axes, from what a drawing states about them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import atan2, hypot
from typing import NamedTuple

from planar.foundation.argument_types import check_field_types, checked_arguments
from planar.foundation.geometry import Frame, Vector, direction
from planar.foundation.jets import Scalar, sqrt


@checked_arguments
class At(NamedTuple):
    """A point by its coordinates (m) in the axes in which the link was drawn."""

    x: Scalar
    y: Scalar


@checked_arguments
class Along(NamedTuple):
    """A point at a signed distance (m) from `start` on the way to `towards`, that way turned by `angle` (rad)."""

    start: str
    towards: str
    distance: Scalar
    angle: Scalar = 0.0


@checked_arguments
class Offset(NamedTuple):
    """A point at a signed distance (m) from `start` on the line to `towards`, and a signed offset (m) to its left."""

    start: str
    towards: str
    distance: Scalar
    offset: Scalar


@checked_arguments
class Distances(NamedTuple):
    """A point by its distances (m) from two points, to the left of the way from the first to the second, or right."""

    first: str
    second: str
    from_first: Scalar
    from_second: Scalar
    left: bool = True


PointDefinition = At | Along | Offset | Distances
PointReference = str | tuple[Scalar, Scalar]
"""A point of a link by name, or by coordinates in the axes in which the link was drawn."""


@checked_arguments
class Point(NamedTuple):
    """A named point of a link."""

    name: str
    place: PointDefinition


@dataclass(frozen=True)
class Link:
    """A rigid link: its named points, and how its own axes lie.

    `ends` with `length` (m) put the first end at the origin and the second on the x-axis;
    `axis` (p, q) puts the x-axis along p to q of points drawn by coordinates. `curved_slot` says that the link stands
    for one: the first end is its centre, in the link that is pinned there, the second the pin that slides in it.
    """

    name: str
    points: tuple[Point, ...] = ()
    ends: tuple[str, str] | None = None
    length: Scalar | None = None
    axis: tuple[str, str] | None = None
    curved_slot: bool = False

    def __post_init__(self) -> None:
        check_field_types(self)

    @classmethod
    def from_ends(
        cls, first: str, second: str, length: float, name: str = "", points: Mapping[str, PointDefinition] | None = None
    ) -> Link:
        """A link by its ends and its length (m), named by them unless said; further points as they are described.

        >>> Link.from_ends("B", "C", 0.066, points={"E": Along("B", "C", 0.04)}).names
        ('B', 'C', 'E')
        """
        further = tuple(Point(*each) for each in (points or {}).items())
        return cls(name or f"{first}{second}", further, (first, second), length)

    @classmethod
    def from_points(cls, name: str, points: Mapping[str, tuple[float, float] | PointDefinition]) -> Link:
        """A link by its points, each by x and y (m) or as it is described.

        >>> Link.from_points("frame", {"A": (0, 0), "D": (0.1, 0)}).points[1].place
        At(x=0.1, y=0)
        """
        known = (At, Along, Offset, Distances)
        return cls(name, tuple(Point(p, at if isinstance(at, known) else At(*at)) for p, at in points.items()))

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all its points, ends first."""
        return (self.ends or ()) + tuple(point.name for point in self.points)


class LinkPlace(NamedTuple):
    """A place of a link that has no name, by coordinates (m) in the link's own axes."""

    link: str
    at: Vector


PointName = str | LinkPlace
"""A point by the name that results give it, or a place of a link."""
PointMember = tuple[str, str | Vector]
"""A link, and a point of it by name or by coordinates (m) in the link's own axes."""


class PointPlacementError(Exception):
    """A point cannot be placed; `point` names it (None: the axis), the text says why."""

    def __init__(self, point: str | None, why: str):
        super().__init__(why)
        self.point = point


@dataclass(frozen=True)
class LinkShape:
    """The points of one link in the link's own axes (m)."""

    points: Mapping[str, Vector]
    origin: Vector
    axis: Vector
    """cos and sin of the link's x-axis in the axes in which it was drawn."""

    def position(self, point: PointReference) -> Vector:
        """A point by name, or by coordinates in the axes in which the link was drawn."""
        if isinstance(point, str):
            return self.points[point]
        return (Vector(*point) - self.origin).rotate(Vector(self.axis.x, -self.axis.y))


def place_in_link(shape: LinkShape, point: str | Vector) -> Vector:
    """Where a point of a link lies in its axes (m)."""
    return point if isinstance(point, Vector) else shape.position(point)


def link_shape(link: Link) -> LinkShape:
    """Place every point of a link.

    Raises PointPlacementError where a point rests on itself, on a missing point, or on a triangle that does not close.
    """
    drawn: dict[str, Vector] = {}
    if link.ends is not None:
        drawn[link.ends[0]] = Vector(0.0, 0.0)
        drawn[link.ends[1]] = Vector(link.length, 0.0)
    places = {point.name: point.place for point in link.points}
    for name in places:
        if name not in drawn:
            _place_point(name, places, drawn)
    if link.axis is None:
        return LinkShape(drawn, Vector(0.0, 0.0), Vector(1.0, 0.0))
    origin, towards = (drawn[name] for name in link.axis)
    way = towards - origin
    length = sqrt(way.dot(way))
    if isinstance(length, float) and length == 0.0:
        raise PointPlacementError(None, f"points {link.axis[0]!r} and {link.axis[1]!r} coincide, so they give no axis")
    axis = Vector(way.x / length, way.y / length)
    back = Vector(axis.x, -axis.y)
    return LinkShape({name: (p - origin).rotate(back) for name, p in drawn.items()}, origin, axis)


def _place_point(name: str, places: Mapping[str, PointDefinition], drawn: dict[str, Vector]) -> None:
    """Place a point after those that it rests on; a chain of them may be as long as it likes."""
    way = {name: None}
    while way:
        name = next(reversed(way))
        if name not in places:
            raise PointPlacementError([*way][-2], f"there is no point {name!r} on this link")
        place = places[name]
        open_ones = [other for other in _reference_points(place) if other not in drawn]
        if not open_ones:
            drawn[name] = _point_position(name, place, drawn)
            del way[name]
            continue
        if open_ones[0] in way:
            circle = " on ".join((*way, open_ones[0]))
            raise PointPlacementError(name, f"point {name!r} rests on itself: {circle}")
        way[open_ones[0]] = None


def _reference_points(place: PointDefinition) -> tuple[str, ...]:
    if isinstance(place, At):
        return ()
    return (place.first, place.second) if isinstance(place, Distances) else (place.start, place.towards)


def _point_position(name: str, place: PointDefinition, drawn: Mapping[str, Vector]) -> Vector:
    if isinstance(place, At):
        return Vector(place.x, place.y)
    base, other = _reference_points(place)
    p, q = drawn[base], drawn[other]
    way = q - p
    length = sqrt(way.dot(way))
    if isinstance(length, float) and length == 0.0:
        raise PointPlacementError(name, f"points {base!r} and {other!r} coincide, so they give no direction")
    unit = Vector(way.x / length, way.y / length)
    if isinstance(place, Along):
        away: Vector = unit.rotate(direction(place.angle)) * place.distance
        return p + away
    if isinstance(place, Offset):
        return p + Vector(place.distance, place.offset).rotate(unit)
    return p + _triangle_apex(name, place, length).rotate(unit)


def _triangle_apex(name: str, place: Distances, base: Scalar) -> Vector:
    """The apex of a triangle on the x-axis from its three sides (law of cosines)."""
    a, b = place.from_first, place.from_second
    if isinstance(a + b + base, float):
        longest = max(a, b, base)
        if 2.0 * longest - (a + b + base) > 1e-12 * longest:
            raise PointPlacementError(
                name,
                f"the triangle {place.first}-{place.second}-{name} does not close: sides "
                f"{base:.6g}, {a:.6g} and {b:.6g} m (no side may exceed the sum of the others)",
            )
    along = (a * a - b * b + base * base) / (2.0 * base)
    height = a * a - along * along
    if isinstance(height, float):
        height = max(height, 0.0)  # a flat triangle, but for rounding
    root = sqrt(height)
    return Vector(along, root if place.left else -root)


def fitted_frame(shape: LinkShape, places: Mapping[str, Vector]) -> Frame | None:
    """Where a link stands whose points lie nearest to these places (m); None where they give it no direction.

    The rotation of least squares about both centroids is the direction of the sum of products of complex numbers.
    """
    points = [shape.points[name] for name in places]
    if len(points) < 2:
        return None
    share = 1.0 / len(points)
    own_centroid = Vector(sum(p.x for p in points) * share, sum(p.y for p in points) * share)
    centroid = Vector(sum(p.x for p in places.values()) * share, sum(p.y for p in places.values()) * share)
    arms = [(p - own_centroid, place - centroid) for p, place in zip(points, places.values(), strict=True)]
    cosine, sine = sum(own.dot(arm) for own, arm in arms), sum(own.cross(arm) for own, arm in arms)
    length = hypot(cosine, sine)
    if length <= 1e-9 * sum(own.dot(own) for own, _ in arms):
        return None
    axis = Vector(cosine / length, sine / length)
    origin = centroid - own_centroid.rotate(axis)
    return Frame(origin.x, origin.y, axis.x, axis.y, atan2(axis.y, axis.x))


def shape_extent(shape: LinkShape) -> float:
    """The greatest distance between two points of a link (m)."""
    x, y = [at.x for at in shape.points.values()], [at.y for at in shape.points.values()]
    return hypot(max(x) - min(x), max(y) - min(y)) if x else 0.0
