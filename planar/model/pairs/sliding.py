"""The sliding pair: a point of one link stays on a line of the other, and the angle between them is fixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.link_shapes import Shape
from planar.model.pairs.base import (
    Entry,
    Kind,
    Pair,
    Quantity,
    Rewritten,
    Sample,
    Schema,
    described,
    plain,
    several,
)
from planar.model.pairs.guide_line import LINE, MEASURES, Guided, Line, along
from planar.model.pairs.symbols import Block, Guide, Mark


@dataclass(frozen=True)
class Sliding(Guided):
    """A line of the first link, on which `point` of the second stays.

    `turn` (rad) is the fixed angle from the line to the second link's x-axis.
    """

    turn: float = 0.0

    keyword: ClassVar[str] = "sliding"
    members: ClassVar[Mapping[str, Schema]] = {
        "links": several("name", 2, 2) | {"uniqueItems": True},
        "on": described("name"),
        "block": described("name"),
        "line": LINE,
        "point": described("name"),
        "turn": described("angle"),
    }
    required: ClassVar[tuple[str, ...]] = ("line",)
    rule: ClassVar[Schema] = {
        "oneOf": [
            {"required": ["on", "block"], "not": {"anyOf": [{"required": ["links"]}, {"required": ["point"]}]}},
            {"required": ["links", "point"], "not": {"anyOf": [{"required": ["on"]}, {"required": ["block"]}]}},
        ]
    }
    lower: ClassVar[bool] = True
    constrains: ClassVar[tuple[Kind, ...]] = (Kind.LENGTH, Kind.LENGTH, Kind.ANGLE)
    measures: ClassVar[tuple[Kind, ...]] = (*MEASURES, Kind.LENGTH, Kind.LENGTH, Kind.ANGLE)

    def measure(self, shapes: Sequence[Shape]) -> Sequence[Scalar]:
        first, second = shapes
        return (*self.line.measure(first), *second.at(self.point), self.line.angle_on(first) + self.turn)

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second = frames
        off = second.carry(Vector(*numbers[4:6])) - along(first, numbers, own[0])
        return (*off, second.angle - first.angle - numbers[6])

    def marks(self, shapes: Mapping[str, Shape], beside: Sequence[Pair]) -> tuple[Mark, ...]:
        guide, block = self.links
        through, way = self._guide(shapes)
        along_block = direction(-self.turn)  # the line's way, seen from the second link
        return (
            Guide(self.name, guide, through, way),
            Block(self.name, block, shapes[block].at(self.point), along_block, guide),
        )

    @classmethod
    def rewrite(cls, entry: Entry) -> Rewritten | None:
        """`"on": link, "block": point`: a block of its own, pinned at the point to the links that carry it."""
        if not entry.has("block"):
            if entry.has("on"):
                raise entry.refuse("on", "'on' goes with a 'block'; without one name two 'links' and a 'point'")
            return None
        entry.only("sliding", "on", "block", "line", "turn")
        on, point = entry.link("on"), entry.name("block")
        if not entry.carriers(point):
            raise entry.refuse("block", f"no link carries a point {point!r}, at which the block would be pinned")
        block = f"block {point}"
        full = {key: value for key, value in entry.fields().items() if key not in ("on", "block")}
        full |= {"links": [on, block], "point": point}
        return Rewritten(full, {block: {"points": {point: [0, 0]}}}, {"turning": point})

    @classmethod
    def read(cls, entry: Entry) -> tuple[Sliding, ...]:
        entry.only(cls.keyword, *(key for key in cls.members if key not in ("on", "block")))
        name, links = entry.name("sliding"), entry.two_links("links")
        line = Line.read(entry, "line", links[0])
        return (cls(name, links, line, entry.point("point", links[1]), entry.quantity("turn", "angle", 0.0)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        (pair,) = group
        entry = {"sliding": pair.name, "links": list(pair.links), "line": pair.line.write(quantity)}
        entry["point"] = pair.point
        if pair.turn != 0.0:
            entry["turn"] = quantity(pair.turn, "angle")
        return entry

    @classmethod
    def samples(cls) -> tuple[Sample, ...]:
        def sample(angle: float, turn: float, slide: float, first: Frame) -> Sample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            pair = cls("slide", ("a", "b"), Line("P", None, angle), "Q", turn)
            entry = {
                "sliding": "slide",
                "links": ["a", "b"],
                "line": {"through": "P", "angle": angle},
                "point": "Q",
                "turn": turn,
            }
            second = frame_at(0.0, 0.0, first.angle + angle + turn)
            meet = first.carry(through + direction(angle) * slide) - second.turn(point)
            shapes = plain(P=through), plain(Q=point)
            return Sample(pair, shapes, (first, frame_at(meet.x, meet.y, second.angle)), (slide,), entry)

        return (
            sample(0.4, 1.1, 0.8, frame_at(0.1, 0.7, 0.6)),
            sample(-2.5, 0.0, -0.6, frame_at(-1.0, 0.2, 3.0)),
            sample(pi / 2, pi, 1.7, frame_at(0.0, 0.0, -0.4)),
        )
