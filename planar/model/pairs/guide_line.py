"""A straight line of a link, and what the pairs have in common that let a point of another link move along it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from planar.foundation.argument_types import checked_arguments
from planar.foundation.geometry import Frame, Vector, direction
from planar.foundation.jets import Scalar, atan2, hypot
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape, PointPlacementError, PointReference
from planar.model.pairs.base import EffortAction, MeasureKind, Pair, Schema, described, schema_reference

LINE_SCHEMA: Schema = {
    "type": "object",
    "properties": {
        "through": described(schema_reference("spot"), "a point of the link, or [x, y], from which distances count"),
        "to": described(schema_reference("spot"), "a second point of the line, in place of its angle"),
        "angle": described(
            schema_reference("angle"), "the line's direction, anticlockwise from the link's x-axis; left out: 0"
        ),
    },
    "required": ["through"],
    "not": {"required": ["to", "angle"]},
    "additionalProperties": False,
}
"""What JSON Schema says of a line."""
BEARING_SIDES = ("bears on the right of its line", "bears on the left of its line")
"""Of a force on the second link to the left of the line, and to its right."""
LINE_NUMBER_KINDS = (MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.PURE, MeasureKind.PURE)
"""What `measure_line` gives: a point of the line, and the line's direction."""


@checked_arguments
class LinkLine(NamedTuple):
    """A line `through` a point (a name, or x and y in m) at `angle` (rad) to the link's x-axis, or `to` a second."""

    through: PointReference
    to: PointReference | None = None
    angle: float = 0.0

    def measure_line(self, shape: LinkShape) -> tuple[Scalar, ...]:
        """x, y of the line's first point and of its direction, in the link's own axes."""
        way = direction(self.angle)
        if self.to is not None:
            whole = shape.position(self.to) - shape.position(self.through)
            size = hypot(whole.x, whole.y)
            if isinstance(size, float) and size == 0.0:
                raise PointPlacementError(None, "the two points of a line coincide, so they give no direction")
            way = Vector(whole.x / size, whole.y / size)
        return (*shape.position(self.through), *way)

    def direction_angle(self, shape: LinkShape) -> Scalar:
        """The line's angle to the link's x-axis (rad)."""
        if self.to is None:
            return self.angle
        way = shape.position(self.to) - shape.position(self.through)
        return atan2(way.y, way.x)

    @classmethod
    def read(cls, entry: EntryReader, key: str, link: str) -> LinkLine:
        """The line of this link under a key of an entry."""
        line = entry.object_at(key)
        line.check_keys(*LINE_SCHEMA["properties"])
        through = line.point_reference("through", link)
        if not line.has("to"):
            return cls(through, None, line.quantity("angle", "angle", 0.0))
        if line.has("angle"):
            raise line.error_at("angle", "give the line either 'to' a point or at an 'angle', not both")
        to = line.point_reference("to", link)
        if to == through:
            raise line.error_at("to", "the line needs two different points")
        line.check_distinct_points("to", link, through, to)
        return cls(through, to)

    def write(self, quantity: QuantityWriter) -> dict[str, Any]:
        """The line as a file has it."""

        def spot(place: PointReference) -> Any:
            return place if isinstance(place, str) else [quantity(value, "length") for value in place]

        if self.to is None:
            return {"through": spot(self.through), "angle": quantity(self.angle, "angle")}
        return {"through": spot(self.through), "to": spot(self.to)}


def point_along_line(frame: Frame, numbers: Sequence[Scalar], displacement: Scalar, offset: Scalar = 0.0) -> Vector:
    """The place at a distance along a measured line of a link, and at a distance to the left of it."""
    way = Vector(*numbers[2:4])
    along: Vector = frame.rotate_to_world(way) * displacement
    at = frame.to_world(Vector(*numbers[0:2])) + along
    if isinstance(offset, float) and offset == 0.0:
        return at
    beside: Vector = frame.rotate_to_world(Vector(-way.y, way.x)) * offset
    return at + beside


@dataclass(frozen=True)
class GuidedPair(Pair):
    """A line of the first link, along which `point` of the second moves; how far is a coordinate of the pair's own.

    With the displacement as a coordinate nothing is ever divided by a sine that passes zero.
    """

    line: LinkLine
    point: str

    coordinate_kinds: ClassVar[tuple[tuple[str, MeasureKind], ...]] = (("displacement", MeasureKind.LENGTH),)
    result_kinds: ClassVar[Mapping[str, str]] = {
        "displacement": "length",
        "velocity": "velocity",
        "acceleration": "acceleration",
    }
    input_kind: ClassVar[MeasureKind] = MeasureKind.LENGTH

    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The distance from `through` to the point along the line."""
        return own[0]

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        first, second = self.links
        at = frames[second].to_world(shapes[second].position(self.point))
        return EffortAction(second, first, at, frames[first].rotate_to_world(self._line_in_link(shapes)[1]))

    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.result_kinds, (position, rate, second), strict=True))

    def point_on_line(self) -> tuple[tuple[str, str], str] | None:
        return (self.links[1], self.point), self.links[0]

    def _square_to_line(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> Vector:
        """The unit vector to the left of the line, in the world's axes."""
        way = frames[self.links[0]].rotate_to_world(self._line_in_link(shapes)[1])
        return Vector(-way.y, way.x)

    def _line_in_link(self, shapes: Mapping[str, LinkShape]) -> tuple[Vector, Vector]:
        """A point of the line and its unit direction, in the axes of the first link."""
        x, y, *way = self.line.measure_line(shapes[self.links[0]])
        return Vector(x, y), Vector(*way)

    def is_intended_assembly(self, drive: float) -> bool:
        return drive >= 0.0
