"""The turning pair: a point of one link stays on a point of the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    MeasureKind,
    Pair,
    PairSample,
    RubbingContact,
    Schema,
    described,
    list_schema,
    sample_shape,
    schema_reference,
)
from planar.model.pairs.friction import FRICTION_SCHEMA, read_friction, write_friction
from planar.model.pairs.rubbing import ContactLoad, Friction, LoadLaw
from planar.model.pairs.symbols import DrawingMark, PinMark


@dataclass(frozen=True)
class TurningPair(Pair):
    """A pin through `points` of the two links; a pin of n links is n - 1 of these, all from its first link."""

    points: tuple[str, str]
    pin: str
    radius: float | None = None

    keyword: ClassVar[str] = "turning"
    entry_description: ClassVar[str] = (
        "a turning pair: the point that its links carry, or its name where their points have others"
    )
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(
            list_schema("name", 2) | {"uniqueItems": True},
            "the links that the pin holds, two or more; left out: all that carry a point of its name, the frame first",
        ),
        "points": described(
            list_schema("name", 2), "the pin's point on each of the links, where they have other names for it"
        ),
        "pin_radius": described(schema_reference("size"), "the pin's radius, for rubbing speeds and friction"),
        "pin_diameter": described(schema_reference("size"), "the pin's diameter, in place of pin_radius"),
        **FRICTION_SCHEMA,
    }
    entry_rule: ClassVar[Schema] = {"not": {"required": ["pin_radius", "pin_diameter"]}}
    is_lower_pair: ClassVar[bool] = True
    residual_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.LENGTH, MeasureKind.LENGTH)
    number_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.LENGTH,) * 4
    result_kinds: ClassVar[Mapping[str, str]] = {
        "relative_angle": "angle",
        "relative_angular_velocity": "angular velocity",
        "relative_angular_acceleration": "angular acceleration",
        "rubbing_speed": "velocity",
    }
    input_kind: ClassVar[MeasureKind] = MeasureKind.ANGLE

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        first, second = shapes
        return (*first.position(self.points[0]), *second.position(self.points[1]))

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second = frames
        return second.to_world(Vector(*numbers[2:])) - first.to_world(Vector(*numbers[:2]))

    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The angle of the second link against the first; at a pin on the frame, of the other link."""
        first, second = frames
        return first.angle - second.angle if second.fixed else second.angle - first.angle

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        first, second = self.links
        return EffortAction(first, second) if frames[second].fixed else EffortAction(second, first)

    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        rubbing = None if self.radius is None else abs(rate) * self.radius
        return dict(zip(self.result_kinds, (position, rate, second, rubbing), strict=True))

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """A couple, as great as the force at the radius of the friction circle.

        The force is tangent to that circle, of r sin(arctan mu). Of a pin of several links every other turns in the
        first.
        """
        if self.friction is None or self.radius is None:
            return ()
        arm = self.radius * self.friction.angle_sine(at_rest)
        loads = tuple(ContactLoad(self.links[1], arm, way) for way in (Vector(1.0, 0.0), Vector(0.0, 1.0)))
        return (RubbingContact(self.effort_action(frames, shapes), loads, LoadLaw.RESULTANT),)

    def pin_diameter(self) -> Scalar | None:
        return None if self.radius is None else 2.0 * self.radius

    def has_pin(self) -> bool:
        return True

    def offset_pin(self, numbers: Sequence[Scalar], offset: Vector) -> Sequence[Scalar]:
        return (numbers[0] + offset.x, numbers[1] + offset.y, *numbers[2:])

    def friction_circle_radius(self) -> Scalar | None:
        if self.friction is None or self.radius is None:
            return None
        return self.radius * self.friction.angle_sine(at_rest=False)

    def coincident_points(self) -> tuple[tuple[str, str], ...]:
        return tuple(zip(self.links, self.points, strict=True))

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        places = tuple(shapes[link].position(point) for link, point in self.coincident_points())
        return (PinMark(self.pin, self.links, places),)

    def entry_name(self) -> str:
        return self.pin

    @classmethod
    def relative_motions(cls, group: Sequence[Self]) -> tuple[Self, ...]:
        """Of a pin of n links all n(n-1)/2 relative motions, named in the order of the links."""
        if len(group) == 1:
            return tuple(group)
        ends = [(group[0].links[0], group[0].points[0])] + [(pair.links[1], pair.points[1]) for pair in group]
        return cls._pairs_between(group[0].pin, ends, list(combinations(range(len(ends)), 2)), group[0].radius)

    @classmethod
    def _pairs_between(
        cls, pin: str, ends: Sequence[tuple[str, str]], which: Sequence[tuple[int, int]], radius: float | None
    ) -> tuple[Self, ...]:
        """Turning pairs between chosen ends (link, point) of one pin."""
        return tuple(
            cls(
                pin if len(ends) == 2 else f"{pin}:{ends[i][0]},{ends[j][0]}",
                (ends[i][0], ends[j][0]),
                (ends[i][1], ends[j][1]),
                pin,
                radius,
            )
            for i, j in which
        )

    @classmethod
    def joining_entry(cls, point: str) -> dict[str, Any]:
        return {cls.keyword: point}

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[Self, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        pin = entry.name("turning")
        if entry.has("links"):
            links = entry.links("links")
        else:
            links = entry.links_with_point(pin)
            if len(links) < 2:
                told = f"only link {links[0]!r} carries" if links else "no link carries"
                raise entry.error_at(
                    "turning", f"a turning pair needs two links, but {told} a point {pin!r}; name its 'links'"
                )
        points = entry.names("points", len(links)) if entry.has("points") else (pin,) * len(links)
        for index, (link, point) in enumerate(zip(links, points, strict=True)):
            entry.check_point_on_link(point, link, f"points[{index}]" if entry.has("points") else "turning")
        if entry.has("pin_radius") and entry.has("pin_diameter"):
            raise entry.error_at("pin_diameter", "give either 'pin_radius' or 'pin_diameter', not both")
        radius = None
        if entry.has("pin_radius"):
            radius = entry.quantity("pin_radius", "length")
        elif entry.has("pin_diameter"):
            radius = entry.quantity("pin_diameter", "length") / 2.0
        if radius is not None and radius <= 0.0:
            raise entry.error_at(
                "pin_radius" if entry.has("pin_radius") else "pin_diameter", "a pin must have a size above zero"
            )
        friction = read_friction(entry)
        if friction is not None and radius is None:
            raise entry.error_at("friction", "the friction of a pin follows its size; give its 'pin_radius' too")
        ends = list(zip(links, points, strict=True))
        found = cls._pairs_between(pin, ends, [(0, k) for k in range(1, len(ends))], radius)
        return tuple(replace(pair, friction=friction) for pair in found)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        ends = [group[0].coincident_points()[0]] + [pair.coincident_points()[1] for pair in group]
        entry: dict[str, Any] = {"turning": group[0].pin, "links": [link for link, _ in ends]}
        if any(point != group[0].pin for _, point in ends):
            entry["points"] = [point for _, point in ends]
        if group[0].radius is not None:
            entry["pin_radius"] = quantity(group[0].radius, "length")
        return entry | write_friction(group[0].friction, quantity)

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        def sample(first: Vector, second: Vector, frames: tuple[Frame, Frame], radius: float | None) -> PairSample:
            shapes = sample_shape(P=first), sample_shape(P=second)
            pair = cls("P", ("a", "b"), ("P", "P"), "P", radius)
            if radius is not None:
                pair = replace(pair, friction=Friction(0.15, 0.2))
            entry: dict[str, Any] = {"turning": "P", "links": ["a", "b"]}
            if radius is not None:
                entry |= {"pin_radius": radius, "friction": 0.15, "static_friction": 0.2}
            meet = frames[0].to_world(first) - frames[1].rotate_to_world(second)
            return PairSample(pair, shapes, (frames[0], frame_at(meet.x, meet.y, frames[1].angle)), (), entry)

        return (
            sample(Vector(0.3, -0.2), Vector(-0.5, 0.4), (frame_at(0.1, 0.7, 0.6), frame_at(0.0, 0.0, -1.9)), 0.02),
            sample(Vector(1.3, 0.0), Vector(0.0, 0.0), (frame_at(-2.0, 0.4, 2.8), frame_at(0.0, 0.0, 4.0)), None),
        )
