"""A straight line of a link, and what the pairs have in common that let a point of another link move along it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from planar.foundation.geometry import Frame, Vector, direction
from planar.foundation.jets import Scalar, atan2, hypot
from planar.model.link_shapes import Shape, Spot
from planar.model.pairs.base import Effort, Entry, Kind, Pair, Quantity, Schema, described

LINE: Schema = {
    "type": "object",
    "properties": {"through": described("spot"), "to": described("spot"), "angle": described("angle")},
    "required": ["through"],
    "not": {"required": ["to", "angle"]},
    "additionalProperties": False,
}
"""What JSON Schema says of a line."""
MEASURES = (Kind.LENGTH, Kind.LENGTH, Kind.PURE, Kind.PURE)
"""What `Line.measure` gives: a point of the line, and the line's direction."""


class Line(NamedTuple):
    """A line `through` a point (a name, or x and y in m) at `angle` (rad) to the link's x-axis, or `to` a second."""

    through: Spot
    to: Spot | None = None
    angle: float = 0.0

    def measure(self, shape: Shape) -> tuple[Scalar, ...]:
        """x, y of the line's first point and of its direction, in the link's own axes."""
        way = direction(self.angle)
        if self.to is not None:
            whole = shape.at(self.to) - shape.at(self.through)
            size = hypot(whole.x, whole.y)
            way = Vector(whole.x / size, whole.y / size)
        return (*shape.at(self.through), *way)

    def angle_on(self, shape: Shape) -> Scalar:
        """The line's angle to the link's x-axis (rad)."""
        if self.to is None:
            return self.angle
        way = shape.at(self.to) - shape.at(self.through)
        return atan2(way.y, way.x)

    @classmethod
    def read(cls, entry: Entry, key: str, link: str) -> Line:
        """The line of this link under a key of an entry."""
        line = entry.inside(key)
        line.only(*LINE["properties"])
        through = line.place("through", link)
        if not line.has("to"):
            return cls(through, None, line.quantity("angle", "angle", 0.0))
        if line.has("angle"):
            raise line.refuse("angle", "give the line either 'to' a point or at an 'angle', not both")
        to = line.place("to", link)
        if to == through:
            raise line.refuse("to", "the line needs two different points")
        line.distinct("to", link, through, to)
        return cls(through, to)

    def write(self, quantity: Quantity) -> dict[str, Any]:
        """The line as a file has it."""

        def spot(place: Spot) -> Any:
            return place if isinstance(place, str) else [quantity(value, "length") for value in place]

        if self.to is None:
            return {"through": spot(self.through), "angle": quantity(self.angle, "angle")}
        return {"through": spot(self.through), "to": spot(self.to)}


def along(frame: Frame, numbers: Sequence[Scalar], slide: Scalar, off: Scalar = 0.0) -> Vector:
    """The place at a distance along a measured line of a link, and at a distance to the left of it."""
    way = Vector(*numbers[2:4])
    at = frame.carry(Vector(*numbers[0:2])) + frame.turn(way) * slide
    return at if isinstance(off, float) and off == 0.0 else at + frame.turn(Vector(-way.y, way.x)) * off


@dataclass(frozen=True)
class Guided(Pair):
    """A line of the first link, along which `point` of the second moves; how far is a coordinate of the pair's own.

    With the displacement as a coordinate nothing is ever divided by a sine that passes zero.
    """

    line: Line
    point: str

    coordinates: ClassVar[tuple[tuple[str, Kind], ...]] = (("displacement", Kind.LENGTH),)
    reports: ClassVar[Mapping[str, str]] = {
        "displacement": "length",
        "velocity": "velocity",
        "acceleration": "acceleration",
    }
    drive_kind: ClassVar[Kind] = Kind.LENGTH

    def drive(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The distance from `through` to the point along the line."""
        return own[0]

    def effort(self, frames: Mapping[str, Frame], shapes: Mapping[str, Shape]) -> Effort:
        first, second = self.links
        at = frames[second].carry(shapes[second].at(self.point))
        return Effort(second, first, at, frames[first].turn(self._guide(shapes)[1]))

    def report(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.reports, (position, rate, second), strict=True))

    def rides(self) -> tuple[tuple[str, str], str] | None:
        return (self.links[1], self.point), self.links[0]

    def _guide(self, shapes: Mapping[str, Shape]) -> tuple[Vector, Vector]:
        """A point of the line and its unit direction, in the axes of the first link."""
        x, y, *way = self.line.measure(shapes[self.links[0]])
        return Vector(x, y), Vector(*way)

    def ahead(self, drive: float) -> bool:
        return drive >= 0.0
