"""The rack and pinion: the pinion's pitch circle rolls on the rack's pitch line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import tan
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.link_shapes import Shape
from planar.model.pairs.base import (
    Contact,
    Entry,
    Kind,
    Pair,
    Quantity,
    Sample,
    Schema,
    Told,
    described,
    plain,
    several,
)
from planar.model.pairs.guide_line import LINE, MEASURES, Guided, Line, along
from planar.model.pairs.symbols import Mark, PitchLine, Wheel
from planar.model.pairs.teeth import PRESSURE_ANGLE, TEETH, read_pressure_angle, write_pressure_angle


@dataclass(frozen=True)
class Rack(Guided):
    """The pitch line of the first link, on which the second link rolls about its `point` with `radius` (m).

    The radius is positive where the centre lies to the left of the line, negative to the right. At displacement
    `meet[0]` (m) of the centre along the line the pinion's angle against the rack is `meet[1]` (rad, counting turns).
    The pair ties turning to sliding; guides or pins keep the centre at its distance, as they do in a machine.
    """

    radius: float
    meet: tuple[float, float] = (0.0, 0.0)
    pressure_angle: float = PRESSURE_ANGLE

    keyword: ClassVar[str] = "rack"
    members: ClassVar[Mapping[str, Schema]] = {
        "links": several("name", 2, 2) | {"uniqueItems": True},
        "line": LINE,
        "point": described("name"),
        "radius": {**described("length"), "not": {"const": 0}},
        "mesh": {
            "type": "object",
            "properties": {"displacement": described("length"), "angle": described("angle")},
            "required": ["displacement", "angle"],
            "additionalProperties": False,
        },
        **TEETH,
    }
    required: ClassVar[tuple[str, ...]] = ("links", "line", "point", "radius")
    touching: ClassVar[str] = "the centre lies left of the line for a radius above zero, right for one below"
    lower: ClassVar[bool] = False
    counts_turns: ClassVar[bool] = True
    constrains: ClassVar[tuple[Kind, ...]] = (Kind.LENGTH, Kind.LENGTH, Kind.LENGTH)
    coordinates: ClassVar[tuple[tuple[str, Kind], ...]] = (("displacement", Kind.LENGTH), ("distance", Kind.LENGTH))
    measures: ClassVar[tuple[Kind, ...]] = (*MEASURES, *(Kind.LENGTH,) * 4, Kind.TURNS)

    def measure(self, shapes: Sequence[Shape]) -> Sequence[Scalar]:
        rack, pinion = shapes
        return (*self.line.measure(rack), *pinion.at(self.point), self.radius, *self.meet)

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        rack, pinion = frames
        displacement, distance = own
        radius, s0, a0 = numbers[6:9]
        off = pinion.carry(Vector(*numbers[4:6])) - along(rack, numbers, displacement, distance)
        # no slip: rolling on along the line with the centre on its left is turning clockwise
        return (*off, displacement - s0 + (pinion.angle - rack.angle - a0) * radius)

    def sizes_told(self, length: Told) -> str:
        return f"pitch radius {length(abs(self.radius))}"

    def apart(self, numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        return own[1] - numbers[6]

    def contact(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, Shape], beside: Sequence[Pair]
    ) -> Contact | None:
        """Where the pitch circle touches the pitch line."""
        rack, pinion = self.links
        _, along_line = self._guide(shapes)
        way = frames[rack].turn(along_line)
        left = Vector(-way.y, way.x) * (1.0 if self.radius > 0.0 else -1.0)
        centre = frames[pinion].carry(shapes[pinion].at(self.point))
        return Contact(centre - left * abs(self.radius), way, left, tan(self.pressure_angle))

    def marks(self, shapes: Mapping[str, Shape], beside: Sequence[Pair]) -> tuple[Mark, ...]:
        rack, pinion = self.links
        wheel = Wheel(self.name, pinion, shapes[pinion].at(self.point), abs(self.radius))
        return wheel, PitchLine(self.name, rack, *self._guide(shapes), wheel)

    @classmethod
    def read(cls, entry: Entry) -> tuple[Rack, ...]:
        entry.only(cls.keyword, *cls.members)
        name, links = entry.name("rack"), entry.two_links("links")
        line = Line.read(entry, "line", links[0])
        point, radius = entry.point("point", links[1]), entry.quantity("radius", "length")
        if radius == 0.0:
            raise entry.refuse("radius", "zero is no radius of a pinion")
        meet = (0.0, 0.0)
        if entry.has("mesh"):
            mesh = entry.inside("mesh")
            mesh.only("displacement", "angle")
            meet = (mesh.quantity("displacement", "length"), mesh.turned("angle"))
        return (cls(name, links, line, point, radius, meet, read_pressure_angle(entry)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        (pair,) = group
        entry = {"rack": pair.name, "links": list(pair.links), "line": pair.line.write(quantity), "point": pair.point}
        entry["radius"] = quantity(pair.radius, "length")
        if pair.meet != (0.0, 0.0):
            s0, a0 = pair.meet
            entry["mesh"] = {"displacement": quantity(s0, "length"), "angle": quantity(a0, "angle")}
        return entry | write_pressure_angle(pair.pressure_angle, quantity)

    @classmethod
    def samples(cls) -> tuple[Sample, ...]:
        def sample(angle: float, radius: float, meet: tuple[float, float], turn: float, rack: Frame) -> Sample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            slide = meet[0] - radius * (turn - meet[1])
            line = direction(angle)
            centre = rack.carry(through + line * slide + Vector(-line.y, line.x) * radius)
            pinion = frame_at(0.0, 0.0, rack.angle + turn)
            at = centre - pinion.turn(point)
            entry: dict[str, Any] = {
                "rack": "R",
                "links": ["a", "b"],
                "line": {"through": "P", "angle": angle},
                "point": "Q",
                "radius": radius,
            }
            if meet != (0.0, 0.0):
                entry["mesh"] = {"displacement": meet[0], "angle": meet[1]}
            return Sample(
                cls("R", ("a", "b"), Line("P", None, angle), "Q", radius, meet),
                (plain(P=through), plain(Q=point)),
                (rack, frame_at(at.x, at.y, pinion.angle)),
                (slide, radius),
                entry,
            )

        return (
            sample(0.4, 0.3, (0.0, 0.0), 1.7, frame_at(0.1, 0.7, 0.6)),
            sample(-2.5, -0.2, (0.4, 0.9), -8.0, frame_at(-1.0, 0.2, 3.0)),
        )
