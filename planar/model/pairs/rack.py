"""The rack and pinion: the pinion's pitch circle rolls on the rack's pitch line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar, sign_of, tan
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    LengthFormatter,
    MeasureKind,
    Pair,
    PairSample,
    RubbingContact,
    Schema,
    ToothContact,
    described,
    list_schema,
    sample_shape,
    schema_reference,
)
from planar.model.pairs.friction import (
    EFFICIENCY_SCHEMA,
    FRICTION_SCHEMA,
    has_loss,
    mesh_loss,
    read_efficiency,
    read_friction,
    write_efficiency,
    write_friction,
)
from planar.model.pairs.guide_line import LINE_NUMBER_KINDS, LINE_SCHEMA, GuidedPair, LinkLine, point_along_line
from planar.model.pairs.rubbing import ContactLoad, Friction, LoadLaw
from planar.model.pairs.symbols import DrawingMark, PitchLineMark, WheelMark
from planar.model.pairs.teeth import STANDARD_PRESSURE_ANGLE, TEETH_SCHEMA, read_pressure_angle, write_pressure_angle


@dataclass(frozen=True)
class RackPair(GuidedPair):
    """The pitch line of the first link, on which the second link rolls about its `point` with `radius` (m).

    The radius is positive where the centre lies to the left of the line, negative to the right. At displacement
    `meet[0]` (m) of the centre along the line the pinion's angle against the rack is `meet[1]` (rad, counting turns).
    The pair ties turning to sliding; guides or pins keep the centre at its distance, as they do in a machine.
    """

    radius: float
    mesh_reference: tuple[float, float] = (0.0, 0.0)
    pressure_angle: float = STANDARD_PRESSURE_ANGLE
    efficiency: float = 1.0
    pinion_teeth: float | None = None
    """How many the pinion has, which friction follows."""

    keyword: ClassVar[str] = "rack"
    entry_description: ClassVar[str] = "a rack with its pinion: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(list_schema("name", 2, 2) | {"uniqueItems": True}, "the rack, then the pinion"),
        "line": described(LINE_SCHEMA, "the pitch line, in the rack"),
        "point": described(schema_reference("name"), "the pinion's centre"),
        "radius": described(
            {**schema_reference("length"), "not": {"const": 0}},
            "the pinion's pitch radius; negative where its centre lies to the right of the pitch line",
        ),
        "mesh": described(
            {
                "type": "object",
                "properties": {
                    "displacement": described(schema_reference("length"), "how far along the line the pinion stands"),
                    "angle": described(schema_reference("angle"), "the pinion's angle against the rack there"),
                },
                "required": ["displacement", "angle"],
                "additionalProperties": False,
            },
            "where the pinion stands along the line at one of its angles; left out: 0 meets 0",
        ),
        **TEETH_SCHEMA,
        "teeth": described(
            {"type": "integer", "minimum": 1}, "the pinion's number of teeth, which their friction follows"
        ),
        **FRICTION_SCHEMA,
        **EFFICIENCY_SCHEMA,
    }
    required_keys: ClassVar[tuple[str, ...]] = ("links", "line", "point", "radius")
    entry_rule: ClassVar[Schema] = {
        "anyOf": [
            {"not": {"required": ["friction"]}},
            {"required": ["teeth"], "not": {"required": ["efficiency"]}},
        ]
    }
    open_contact_hint: ClassVar[str] = "the centre lies left of the line for a radius above zero, right for one below"
    is_lower_pair: ClassVar[bool] = False
    counts_turns: ClassVar[bool] = True
    residual_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.LENGTH)
    coordinate_kinds: ClassVar[tuple[tuple[str, MeasureKind], ...]] = (
        ("displacement", MeasureKind.LENGTH),
        ("distance", MeasureKind.LENGTH),
    )
    number_kinds: ClassVar[tuple[MeasureKind, ...]] = (
        *LINE_NUMBER_KINDS,
        *(MeasureKind.LENGTH,) * 4,
        MeasureKind.TURNS,
    )

    @property
    def has_friction(self) -> bool:
        return super().has_friction or has_loss(self.efficiency)

    def wheel_centres(self, all_pairs: Sequence[Pair]) -> Mapping[str, str | None]:
        return {self.links[1]: self.point}

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        rack, pinion = shapes
        return (*self.line.measure_line(rack), *pinion.position(self.point), self.radius, *self.mesh_reference)

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        rack, pinion = frames
        displacement, distance = own
        radius, s0, a0 = numbers[6:9]
        off = pinion.to_world(Vector(*numbers[4:6])) - point_along_line(rack, numbers, displacement, distance)
        # no slip: rolling on along the line with the centre on its left is turning clockwise
        return (*off, displacement - s0 + (pinion.angle - rack.angle - a0) * radius)

    def describe_sizes(self, format_length: LengthFormatter) -> str:
        return f"pitch radius {format_length(abs(self.radius))}"

    def contact_gap(self, numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        return own[1] - numbers[6]

    def tooth_contact(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]
    ) -> ToothContact | None:
        """Where the pitch circle touches the pitch line."""
        rack, pinion = self.links
        _, along_line = self._line_in_link(shapes)
        way = frames[rack].rotate_to_world(along_line)
        left = Vector(-way.y, way.x) * sign_of(self.radius)
        centre = frames[pinion].to_world(shapes[pinion].position(self.point))
        return ToothContact(centre - left * abs(self.radius), way, left, tan(self.pressure_angle))

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """The couple between rack and pinion that the teeth's efficiency asks for, or their friction.

        That is a gear pair's with a wheel beyond all bounds: mu (pi / 2) / z of the power of z teeth of the pinion.
        """
        rack, pinion = self.links
        way = frames[rack].rotate_to_world(self._line_in_link(shapes)[1])
        sense = -self.radius / abs(self.radius)
        # seen from the pinion's centre the rack runs back: it drives where it pushes the pinion that way
        torque = ContactLoad(pinion, abs(self.radius), way * -1.0)
        if self.friction is not None and self.pinion_teeth is not None:
            arm = self.friction.coefficient(at_rest) * abs(self.radius) * (0.5 * pi / self.pinion_teeth)
            rubbing = torque._replace(factor=arm, opposed=arm, sides=(f"{rack} drives", f"{pinion} drives"))
            return (RubbingContact(EffortAction(pinion, rack), (rubbing,), LoadLaw.GREATEST, sense),)
        if not has_loss(self.efficiency):
            return ()
        return (mesh_loss(self.links, EffortAction(pinion, rack), torque, self.efficiency, sense),)

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        rack, pinion = self.links
        wheel = WheelMark(self.name, pinion, shapes[pinion].position(self.point), abs(self.radius))
        return wheel, PitchLineMark(self.name, rack, *self._line_in_link(shapes), wheel)

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[RackPair, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        name, links = entry.name("rack"), entry.two_links("links")
        line = LinkLine.read(entry, "line", links[0])
        point, radius = entry.point("point", links[1]), entry.quantity("radius", "length")
        if radius == 0.0:
            raise entry.error_at("radius", "zero is no radius of a pinion")
        meet = (0.0, 0.0)
        if entry.has("mesh"):
            mesh = entry.object_at("mesh")
            mesh.check_keys("displacement", "angle")
            meet = (mesh.quantity("displacement", "length"), mesh.counted_angle("angle"))
        friction, teeth = read_friction(entry), None
        if entry.has("teeth"):
            teeth = entry.number("teeth")
            if teeth < 1.0 or not teeth.is_integer():
                raise entry.error_at("teeth", "a whole number of teeth is wanted, one at least")
        if friction is not None and teeth is None:
            raise entry.error_at(
                "friction", "the friction of teeth follows their number; give 'teeth', or an 'efficiency' in its place"
            )
        if friction is not None and entry.has("efficiency"):
            raise entry.error_at("efficiency", "give either 'friction' of the teeth or their 'efficiency', not both")
        angle, efficiency = read_pressure_angle(entry), read_efficiency(entry)
        return (cls(name, links, line, point, radius, meet, angle, efficiency, teeth, friction=friction),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        (pair,) = group
        entry: dict[str, Any] = {"rack": pair.name, "links": list(pair.links), "line": pair.line.write(quantity)}
        entry |= {"point": pair.point, "radius": quantity(pair.radius, "length")}
        if pair.mesh_reference != (0.0, 0.0):
            s0, a0 = pair.mesh_reference
            entry["mesh"] = {"displacement": quantity(s0, "length"), "angle": quantity(a0, "angle")}
        entry |= write_pressure_angle(pair.pressure_angle, quantity)
        if pair.pinion_teeth is not None:
            entry["teeth"] = quantity(pair.pinion_teeth, "count")
        return entry | write_friction(pair.friction, quantity) | write_efficiency(pair.efficiency, quantity)

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        def sample(angle: float, radius: float, meet: tuple[float, float], turn: float, rack: Frame) -> PairSample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            slide = meet[0] - radius * (turn - meet[1])
            line = direction(angle)
            centre = rack.to_world(through + line * slide + Vector(-line.y, line.x) * radius)
            pinion = frame_at(0.0, 0.0, rack.angle + turn)
            at = centre - pinion.rotate_to_world(point)
            entry: dict[str, Any] = {
                "rack": "R",
                "links": ["a", "b"],
                "line": {"through": "P", "angle": angle},
                "point": "Q",
                "radius": radius,
            }
            if meet != (0.0, 0.0):
                entry["mesh"] = {"displacement": meet[0], "angle": meet[1]}
            pair = cls("R", ("a", "b"), LinkLine("P", None, angle), "Q", radius, meet)
            if radius < 0.0:
                pair, entry["efficiency"] = replace(pair, efficiency=0.9), 0.9
            else:
                pair = replace(pair, pinion_teeth=24.0, friction=Friction(0.06))
                entry |= {"teeth": 24, "friction": 0.06}
            return PairSample(
                pair,
                (sample_shape(P=through), sample_shape(Q=point)),
                (rack, frame_at(at.x, at.y, pinion.angle)),
                (slide, radius),
                entry,
            )

        return (
            sample(0.4, 0.3, (0.0, 0.0), 1.7, frame_at(0.1, 0.7, 0.6)),
            sample(-2.5, -0.2, (0.4, 0.9), -8.0, frame_at(-1.0, 0.2, 3.0)),
        )
