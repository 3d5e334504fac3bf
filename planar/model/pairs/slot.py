"""The pin in a slot: a point of one link stays on a line of the other, and the link turns freely about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
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
from planar.model.pairs.guide_line import (
    BEARING_SIDES,
    LINE_NUMBER_KINDS,
    LINE_SCHEMA,
    GuidedPair,
    LinkLine,
    point_along_line,
)
from planar.model.pairs.rubbing import ContactLoad, Friction, LoadLaw
from planar.model.pairs.symbols import DrawingMark, SlotMark


@dataclass(frozen=True)
class SlotPair(GuidedPair):
    """A slot along a line of the first link, in which a pin at `point` of the second link slides."""

    keyword: ClassVar[str] = "slot"
    entry_description: ClassVar[str] = "a pin in a slot: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(
            list_schema("name", 2, 2) | {"uniqueItems": True}, "the link with the slot, then that of the pin"
        ),
        "line": described(LINE_SCHEMA, "the slot's middle line, in the first link"),
        "point": described(schema_reference("name"), "the pin, a point of the second link, which may turn in the slot"),
        **FRICTION_SCHEMA,
    }
    required_keys: ClassVar[tuple[str, ...]] = ("links", "line", "point")
    is_lower_pair: ClassVar[bool] = False
    residual_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.LENGTH, MeasureKind.LENGTH)
    number_kinds: ClassVar[tuple[MeasureKind, ...]] = (*LINE_NUMBER_KINDS, MeasureKind.LENGTH, MeasureKind.LENGTH)

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        first, second = shapes
        return (*self.line.measure_line(first), *second.position(self.point))

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second = frames
        return second.to_world(Vector(*numbers[4:6])) - point_along_line(first, numbers, own[0])

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """A force along the slot, as the pin presses on one side of it or the other."""
        if self.friction is None:
            return ()
        square = self._square_to_line(frames, shapes)
        press = ContactLoad(self.links[1], self.friction.coefficient(at_rest), square, sides=BEARING_SIDES)
        return (RubbingContact(self.effort_action(frames, shapes), (press,), LoadLaw.GREATEST),)

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        slotted, pinned = self.links
        return (SlotMark(self.name, slotted, *self._line_in_link(shapes), pinned, shapes[pinned].position(self.point)),)

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[SlotPair, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        name, links = entry.name("slot"), entry.two_links("links")
        line, point = LinkLine.read(entry, "line", links[0]), entry.point("point", links[1])
        return (cls(name, links, line, point, friction=read_friction(entry)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        (pair,) = group
        line = pair.line.write(quantity)
        entry = {"slot": pair.name, "links": list(pair.links), "line": line, "point": pair.point}
        return entry | write_friction(pair.friction, quantity)

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        def sample(
            angle: float, slide: float, frames: tuple[Frame, Frame], friction: float | None = None
        ) -> PairSample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            first, second = frames
            meet = first.to_world(through + direction(angle) * slide) - second.rotate_to_world(point)
            entry: dict[str, Any] = {
                "slot": "S",
                "links": ["a", "b"],
                "line": {"through": "P", "angle": angle},
                "point": "Q",
            }
            pair = cls("S", ("a", "b"), LinkLine("P", None, angle), "Q")
            if friction is not None:
                pair, entry["friction"] = replace(pair, friction=Friction(friction)), friction
            return PairSample(
                pair,
                (sample_shape(P=through), sample_shape(Q=point)),
                (first, frame_at(meet.x, meet.y, second.angle)),
                (slide,),
                entry,
            )

        return (
            sample(0.4, 0.8, (frame_at(0.1, 0.7, 0.6), frame_at(0.0, 0.0, -1.3))),
            sample(-2.5, -0.6, (frame_at(-1.0, 0.2, 3.0), frame_at(0.0, 0.0, 0.4)), 0.12),
        )
