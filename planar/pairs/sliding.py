"""The sliding pair: a point of one link stays on a line of the other, and the angle between them is fixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar, Self

from planar.algebra import Scalar, atan2, sqrt
from planar.pairs.base import Entry, Kind, Pair, Quantity, Rewritten, Sample
from planar.plane import Frame, Vector, direction, frame_at
from planar.shapes import Shape

WholePoint = str | tuple[float, float]


@dataclass(frozen=True)
class Sliding(Pair):
    """A line of the first link, on which `point` of the second stays.

    The line goes `through` a point at `angle` (rad) to the first link's x-axis, or `to` a second point.
    `turn` (rad) is the fixed angle from the line to the second link's x-axis.
    """

    through: WholePoint
    to: WholePoint | None
    angle: float
    point: str
    turn: float = 0.0

    keyword: ClassVar[str] = "sliding"
    constrains: ClassVar[tuple[Kind, ...]] = (Kind.LENGTH, Kind.LENGTH, Kind.ANGLE)
    coordinates: ClassVar[tuple[tuple[str, Kind], ...]] = (("displacement", Kind.LENGTH),)
    measures: ClassVar[tuple[Kind, ...]] = (*(Kind.LENGTH,) * 4, *(Kind.PURE,) * 2, Kind.ANGLE)
    reports: ClassVar[Mapping[str, str]] = {
        "displacement": "length",
        "velocity": "velocity",
        "acceleration": "acceleration",
    }
    drive_kind: ClassVar[Kind] = Kind.LENGTH

    def measure(self, first: Shape, second: Shape) -> Sequence[Scalar]:
        through = first.at(self.through)
        if self.to is None:
            line, angle = direction(self.angle), self.angle
        else:
            way = first.at(self.to) - through
            line, angle = way * (1.0 / sqrt(way.dot(way))), atan2(way.y, way.x)
        return (*through, *second.at(self.point), *line, angle + self.turn)

    def residual(
        self, first: Frame, second: Frame, numbers: Sequence[Scalar], own: Sequence[Scalar]
    ) -> Sequence[Scalar]:
        # with the displacement as a coordinate nothing is ever divided by a sine that passes zero
        through, point, line = Vector(*numbers[0:2]), Vector(*numbers[2:4]), Vector(*numbers[4:6])
        on_line = first.carry(through) + first.turn(line) * own[0]
        return (*(second.carry(point) - on_line), second.angle - first.angle - numbers[6])

    def drive(self, first: Frame, second: Frame, numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The distance from `through` to the point along the line."""
        return own[0]

    def report(self, position: float, rate: float, second: float) -> dict[str, float | None]:
        return dict(zip(self.reports, (position, rate, second), strict=True))

    def rides(self) -> tuple[tuple[str, str], str] | None:
        return (self.links[1], self.point), self.links[0]

    def ahead(self, drive: float) -> bool:
        return drive >= 0.0

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
        entry.only("sliding", "links", "line", "point", "turn")
        name = entry.name("sliding")
        links = entry.links("links")
        if len(links) != 2:
            raise entry.refuse("links", f"a sliding pair joins two links, not {len(links)}")
        line = entry.inside("line")
        line.only("through", "to", "angle")
        through = line.place("through", links[0])
        to: WholePoint | None = None
        if line.has("to"):
            if line.has("angle"):
                raise line.refuse("angle", "give the line either 'to' a point or at an 'angle', not both")
            to = line.place("to", links[0])
            if to == through:
                raise line.refuse("to", "the line needs two different points")
            line.distinct("to", links[0], through, to)
        angle = line.quantity("angle", "angle", 0.0)
        point = entry.point("point", links[1])
        return (cls(name, (links[0], links[1]), through, to, angle, point, entry.quantity("turn", "angle", 0.0)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        (pair,) = group

        def whole(place: WholePoint) -> Any:
            return place if isinstance(place, str) else [quantity(value, "length") for value in place]

        line: dict[str, Any] = {"through": whole(pair.through)}
        if pair.to is None:
            line["angle"] = quantity(pair.angle, "angle")
        else:
            line["to"] = whole(pair.to)
        entry: dict[str, Any] = {"sliding": pair.name, "links": list(pair.links), "line": line, "point": pair.point}
        if pair.turn != 0.0:
            entry["turn"] = quantity(pair.turn, "angle")
        return entry

    @classmethod
    def samples(cls) -> tuple[Sample, ...]:
        def sample(angle: float, turn: float, slide: float, first: Frame) -> Sample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            shapes = (
                Shape({"P": through}, Vector(0.0, 0.0), Vector(1.0, 0.0)),
                Shape({"Q": point}, Vector(0.0, 0.0), Vector(1.0, 0.0)),
            )
            pair = cls("slide", ("a", "b"), "P", None, angle, "Q", turn)
            entry = {
                "sliding": "slide",
                "links": ["a", "b"],
                "line": {"through": "P", "angle": angle},
                "point": "Q",
                "turn": turn,
            }
            second = frame_at(0.0, 0.0, first.angle + angle + turn)
            meet = first.carry(through + direction(angle) * slide) - second.turn(point)
            return Sample(pair, shapes, (first, frame_at(meet.x, meet.y, second.angle)), (slide,), entry)

        return (
            sample(0.4, 1.1, 0.8, frame_at(0.1, 0.7, 0.6)),
            sample(-2.5, 0.0, -0.6, frame_at(-1.0, 0.2, 3.0)),
            sample(pi / 2, pi, 1.7, frame_at(0.0, 0.0, -0.4)),
        )
