"""The belt or chain: two wheels tied by a loop that does not slip, open or crossed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from planar.foundation.jets import Scalar
from planar.model.link_shapes import Shape
from planar.model.pairs.base import Entry, Pair, Quantity, Sample, Schema, Told, described, several
from planar.model.pairs.symbols import Band, Mark, Wheel
from planar.model.pairs.wheel_pairs import Wheels

LARGER = 0.3
"""Of the distance of the centres: how large the larger of two wheels is drawn whose radii are not known."""


@dataclass(frozen=True)
class Belt(Wheels):
    """Pulleys: ratio r/s of radii (or teeth, of a toothed belt), -r/s where the belt is crossed."""

    crossed: bool = False

    keyword: ClassVar[str] = "belt"
    at_a_distance: ClassVar[bool] = True
    members: ClassVar[Mapping[str, Schema]] = {
        **Wheels.members,
        "radii": several("size", 2, 2),
        "teeth": {**several("number", 2, 2), "items": {"type": "integer", **described("number"), "minimum": 1}},
        "crossed": {"type": "boolean"},
    }
    rule: ClassVar[Schema] = {**Wheels.rule, "not": {"required": ["ratio", "crossed"]}}

    def ratio(self) -> Scalar:
        if self.by == "ratio":
            return self.sizes[0]
        return (-1.0 if self.crossed else 1.0) * self.sizes[0] / self.sizes[1]

    def _misplaced(self, apart: float, length: Told) -> str | None:
        r, s = self.sizes
        least = r + s if self.crossed else abs(r - s)
        if apart > least:
            return None
        how = "crossed" if self.crossed else "open"
        return f"the centres are {length(apart)} apart; wheels of these radii need more than {length(least)} ({how})"

    def marks(self, shapes: Mapping[str, Shape], beside: Sequence[Pair]) -> tuple[Mark, ...]:
        wheels = [mark for mark in super().marks(shapes, beside) if isinstance(mark, Wheel)]
        if len(wheels) != 2:
            return tuple(wheels)
        return (*wheels, Band(self.name, *wheels, self.ratio() < 0.0))

    def _pitch_radii(self, apart: Scalar) -> tuple[Scalar, ...]:
        ratio = abs(self.ratio())
        larger = LARGER * apart
        return (larger, larger / ratio) if ratio > 1.0 else (larger * ratio, larger)

    @classmethod
    def read(cls, entry: Entry) -> tuple[Self, ...]:
        entry.only(cls.keyword, *cls.members)
        name, links, carrier, by, sizes, meet = cls._common(entry)
        crossed = entry.flag("crossed")
        if by == "ratio" and entry.has("crossed"):
            raise entry.refuse("crossed", "the sign of 'ratio' says whether the wheels turn alike; leave 'crossed' out")
        if by != "ratio" and min(sizes) < 0.0:
            raise entry.refuse(by, "wheels that a loop runs round have sizes above zero")
        return (cls(name, links, carrier, by, sizes, meet, crossed),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        return super().write(group, quantity) | ({"crossed": True} if group[0].crossed else {})

    @classmethod
    def samples(cls) -> tuple[Sample, ...]:
        links = ("a", "b")
        return (
            cls("loop", links, "c", "radii", (0.3, 0.5))._sample(-1.2, 7.4, {"radii": [0.3, 0.5]}, 1.1),
            cls("loop", links, "c", "radii", (0.4, 0.1), (0.2, 0.6), True)._sample(
                0.7, 2.5, {"radii": [0.4, 0.1], "mesh": {"a": 0.2, "b": 0.6}, "crossed": True}, 0.9
            ),
            cls("loop", links, "c", "teeth", (20.0, 31.0))._sample(2.0, 0.3, {"teeth": [20, 31]}),
        )


@dataclass(frozen=True)
class Chain(Belt):
    """Sprockets: ratio of their teeth or radii."""

    keyword: ClassVar[str] = "chain"
