"""The belt or chain: two wheels tied by a loop that does not slip, open or crossed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import LengthFormatter, Pair, PairSample, Schema, described, list_schema, schema_reference
from planar.model.pairs.friction import read_efficiency
from planar.model.pairs.symbols import BeltMark, DrawingMark, WheelMark
from planar.model.pairs.wheel_pairs import WheelPair

DRAWN_RADIUS_RATIO = 0.3
"""Of the distance of the centres: how large the larger of two wheels is drawn whose radii are not known."""


@dataclass(frozen=True)
class BeltPair(WheelPair):
    """Pulleys: ratio r/s of radii (or teeth, of a toothed belt), -r/s where the belt is crossed."""

    crossed: bool = False

    keyword: ClassVar[str] = "belt"
    entry_description: ClassVar[str] = "a belt on two wheels: its name"
    acts_at_distance: ClassVar[bool] = True
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        **WheelPair.entry_schemas,
        "radii": described(list_schema("size", 2, 2), "the radii of both wheels"),
        "teeth": described(
            {
                **list_schema("number", 2, 2),
                "items": {"type": "integer", **schema_reference("number"), "minimum": 1},
            },
            "the numbers of teeth of both wheels, in place of radii",
        ),
        "crossed": described(
            {"type": "boolean"}, "true where the loop crosses itself, so that the wheels turn opposite ways"
        ),
    }
    entry_rule: ClassVar[Schema] = {**WheelPair.entry_rule, "not": {"required": ["ratio", "crossed"]}}

    def ratio(self) -> Scalar:
        if self.size_kind == "ratio":
            return self.sizes[0]
        return (-1.0 if self.crossed else 1.0) * self.sizes[0] / self.sizes[1]

    def _find_distance_problem(self, centre_distance: float, format_length: LengthFormatter) -> str | None:
        r, s = self.sizes
        least = r + s if self.crossed else abs(r - s)
        if centre_distance > least:
            return None
        how = "crossed" if self.crossed else "open"
        return (
            f"the centres are {format_length(centre_distance)} apart; wheels of these radii need more "
            f"than {format_length(least)} ({how})"
        )

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        wheels = [mark for mark in super().drawing_marks(shapes, all_pairs) if isinstance(mark, WheelMark)]
        if len(wheels) != 2:
            return tuple(wheels)
        first, second = wheels
        here, there = self._carrier_centres(shapes, all_pairs)
        return (first, second, BeltMark(self.name, first, second, self.carrier, (here, there), self.ratio() < 0.0))

    def _pitch_radii(self, centre_distance: Scalar) -> tuple[Scalar, ...]:
        ratio = abs(self.ratio())
        larger = DRAWN_RADIUS_RATIO * centre_distance
        return (larger, larger / ratio) if ratio > 1.0 else (larger * ratio, larger)

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[Self, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        name, links, carrier, by, sizes, meet = cls._read_common(entry)
        crossed = entry.flag("crossed")
        if by == "ratio" and entry.has("crossed"):
            raise entry.error_at(
                "crossed", "the sign of 'ratio' says whether the wheels turn alike; leave 'crossed' out"
            )
        if by != "ratio" and min(sizes) < 0.0:
            raise entry.error_at(by, "wheels that a loop runs round have sizes above zero")
        return (cls(name, links, carrier, by, sizes, meet, crossed, efficiency=read_efficiency(entry)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        return super().write(group, quantity) | ({"crossed": True} if group[0].crossed else {})

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        links = ("a", "b")
        return (
            cls("loop", links, "c", "radii", (0.3, 0.5))._make_sample(-1.2, 7.4, {"radii": [0.3, 0.5]}, 1.1),
            cls("loop", links, "c", "radii", (0.4, 0.1), (0.2, 0.6), True)._make_sample(
                0.7, 2.5, {"radii": [0.4, 0.1], "mesh": {"a": 0.2, "b": 0.6}, "crossed": True}, 0.9
            ),
            cls("loop", links, "c", "teeth", (20.0, 31.0), efficiency=0.95)._make_sample(
                2.0, 0.3, {"teeth": [20, 31], "efficiency": 0.95}
            ),
        )


@dataclass(frozen=True)
class ChainPair(BeltPair):
    """Sprockets: ratio of their teeth or radii."""

    keyword: ClassVar[str] = "chain"
    entry_description: ClassVar[str] = "a chain on two wheels: its name"
