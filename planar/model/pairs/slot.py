"""The pin in a slot: a point of one link stays on a line of the other, and the link turns freely about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.link_shapes import Shape
from planar.model.pairs.base import (
    Entry,
    Kind,
    Pair,
    Quantity,
    Sample,
    Schema,
    described,
    plain,
    several,
)
from planar.model.pairs.guide_line import LINE, MEASURES, Guided, Line, along
from planar.model.pairs.symbols import Mark, Opening


@dataclass(frozen=True)
class Slot(Guided):
    """A slot along a line of the first link, in which a pin at `point` of the second link slides."""

    keyword: ClassVar[str] = "slot"
    members: ClassVar[Mapping[str, Schema]] = {
        "links": several("name", 2, 2) | {"uniqueItems": True},
        "line": LINE,
        "point": described("name"),
    }
    required: ClassVar[tuple[str, ...]] = ("links", "line", "point")
    lower: ClassVar[bool] = False
    constrains: ClassVar[tuple[Kind, ...]] = (Kind.LENGTH, Kind.LENGTH)
    measures: ClassVar[tuple[Kind, ...]] = (*MEASURES, Kind.LENGTH, Kind.LENGTH)

    def measure(self, shapes: Sequence[Shape]) -> Sequence[Scalar]:
        first, second = shapes
        return (*self.line.measure(first), *second.at(self.point))

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second = frames
        return second.carry(Vector(*numbers[4:6])) - along(first, numbers, own[0])

    def marks(self, shapes: Mapping[str, Shape], beside: Sequence[Pair]) -> tuple[Mark, ...]:
        slotted, pinned = self.links
        return (Opening(self.name, slotted, *self._guide(shapes), pinned, shapes[pinned].at(self.point)),)

    @classmethod
    def read(cls, entry: Entry) -> tuple[Slot, ...]:
        entry.only(cls.keyword, *cls.members)
        name, links = entry.name("slot"), entry.two_links("links")
        return (cls(name, links, Line.read(entry, "line", links[0]), entry.point("point", links[1])),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        (pair,) = group
        line = pair.line.write(quantity)
        return {"slot": pair.name, "links": list(pair.links), "line": line, "point": pair.point}

    @classmethod
    def samples(cls) -> tuple[Sample, ...]:
        def sample(angle: float, slide: float, frames: tuple[Frame, Frame]) -> Sample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            first, second = frames
            meet = first.carry(through + direction(angle) * slide) - second.turn(point)
            entry = {"slot": "S", "links": ["a", "b"], "line": {"through": "P", "angle": angle}, "point": "Q"}
            return Sample(
                cls("S", ("a", "b"), Line("P", None, angle), "Q"),
                (plain(P=through), plain(Q=point)),
                (first, frame_at(meet.x, meet.y, second.angle)),
                (slide,),
                entry,
            )

        return (
            sample(0.4, 0.8, (frame_at(0.1, 0.7, 0.6), frame_at(0.0, 0.0, -1.3))),
            sample(-2.5, -0.6, (frame_at(-1.0, 0.2, 3.0), frame_at(0.0, 0.0, 0.4))),
        )
