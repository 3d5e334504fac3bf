"""The sliding pair: a point of one link stays on a line of the other, and the angle between them is fixed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import Any, ClassVar, Self

from planar.foundation.errors import join_names
from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    ExpandedEntry,
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
from planar.model.pairs.symbols import DrawingMark, GuideMark, SliderMark

TILTED_SIDES = ("tilted clockwise, bears at both ends", "tilted anticlockwise, bears at both ends")
"""Of a couple on the second link anticlockwise, and clockwise."""


@dataclass(frozen=True)
class SlidingPair(GuidedPair):
    """A line of the first link, on which `point` of the second stays.

    `block_angle` (rad) is the fixed angle from the line to the second link's x-axis. The block is `guide_length` (m)
    long, with the point in its middle, so that it bears at one end or both; `guide_width` (m) is how far its two faces
    are apart, between which the line lies.
    """

    block_angle: float = 0.0
    guide_length: float | None = None
    guide_width: float | None = None

    keyword: ClassVar[str] = "sliding"
    entry_description: ClassVar[str] = "a sliding pair: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(
            list_schema("name", 2, 2) | {"uniqueItems": True},
            "the link with the line, then the one that slides along it",
        ),
        "on": described(schema_reference("name"), "the link with the line, where a block slides on it"),
        "block": described(
            schema_reference("name"),
            "a point: a block slides that is pinned there to the links that carry it, in place of links and point",
        ),
        "line": described(LINE_SCHEMA, "the line of sliding, in the first link"),
        "point": described(schema_reference("name"), "the point of the second link that stays on the line"),
        "turn": described(
            schema_reference("angle"),
            "the fixed angle, anticlockwise, from the line to the second link's x-axis; left out: 0",
        ),
        **FRICTION_SCHEMA,
        "guide_length": described(
            schema_reference("size"),
            "how long the block is that slides, its point in the middle: tilted it bears at both ends; "
            "left out: so long that tilting presses nothing",
        ),
        "guide_width": described(
            schema_reference("size"), "how far the faces are apart between which it slides; left out: 0"
        ),
    }
    required_keys: ClassVar[tuple[str, ...]] = ("line",)
    entry_rule: ClassVar[Schema] = {
        "oneOf": [
            {"required": ["on", "block"], "not": {"anyOf": [{"required": ["links"]}, {"required": ["point"]}]}},
            {"required": ["links", "point"], "not": {"anyOf": [{"required": ["on"]}, {"required": ["block"]}]}},
        ]
    }
    is_lower_pair: ClassVar[bool] = True
    residual_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.ANGLE)
    number_kinds: ClassVar[tuple[MeasureKind, ...]] = (
        *LINE_NUMBER_KINDS,
        MeasureKind.LENGTH,
        MeasureKind.LENGTH,
        MeasureKind.ANGLE,
    )

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        first, second = shapes
        return (
            *self.line.measure_line(first),
            *second.position(self.point),
            self.line.direction_angle(first) + self.block_angle,
        )

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second = frames
        off = second.to_world(Vector(*numbers[4:6])) - point_along_line(first, numbers, own[0])
        return (*off, second.angle - first.angle - numbers[6])

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """A force along the line, as both ends of the block press on the guide, and the couple of its two faces.

        A force N square to the line and a couple M are N/2 - M/L and N/2 + M/L at the ends of a block of length L. The
        sum of their sizes is that of N where the block bears on one side, of 2M/L where it bears on both, whichever is
        greater. A face that presses by N lies half the width off the line: friction there has the couple mu N w/2.
        """
        if self.friction is None:
            return ()
        coefficient, sliding = self.friction.coefficient(at_rest), self.effort_action(frames, shapes)
        square = self._square_to_line(frames, shapes)
        loads = [ContactLoad(self.links[1], coefficient, square, sides=BEARING_SIDES)]
        if self.guide_length is not None:
            at_an_end = coefficient * 2.0 / self.guide_length
            loads.append(ContactLoad(self.links[1], at_an_end, None, sliding.point, sides=TILTED_SIDES))
        found = [RubbingContact(sliding, tuple(loads), LoadLaw.GREATEST)]
        if self.guide_width is not None:
            off = ContactLoad(self.links[1], coefficient * self.guide_width * 0.5, square)
            found.append(RubbingContact(EffortAction(self.links[1], self.links[0]), (off,), LoadLaw.SIGNED))
        return tuple(found)

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        guide, block = self.links
        through, way = self._line_in_link(shapes)
        along_block = direction(-self.block_angle)  # the line's way, seen from the second link
        return (
            GuideMark(self.name, guide, through, way),
            SliderMark(self.name, block, shapes[block].position(self.point), along_block, guide),
        )

    def completed_by_sketch(
        self,
        entry: EntryReader,
        shapes: Mapping[str, LinkShape],
        sketched_frames: Mapping[str, Frame],
        places: Mapping[str, Vector],
    ) -> tuple[Self, str] | None:
        """With a `turn` of a quarter or half turn where it is left out and the sketched points fit no turn of 0.

        Across the line the second link cannot move, so that the misfit of a turn is known without the displacement.
        """
        first, second = self.links
        if entry.has("turn") or not places or first not in sketched_frames:
            return None
        through, line_direction = self._line_in_link(shapes)
        guide, point = sketched_frames[first], shapes[second].position(self.point)
        x_axis = guide.rotate_to_world(line_direction)
        arms = {name: shapes[second].points[name] - point for name in places}
        sketched = {
            name: (place - guide.to_world(through)).rotate(Vector(x_axis.x, -x_axis.y))
            for name, place in places.items()
        }
        misfits = {}
        for turn in (0.0, pi / 2, -pi / 2, pi):
            gaps = [sketched[name] - arm.rotate(direction(turn)) for name, arm in arms.items()]
            displacement = sum(gap.x for gap in gaps) / len(gaps)
            misfits[turn] = sqrt(sum((gap.x - displacement) ** 2 + gap.y**2 for gap in gaps) / len(gaps))
        best, second_best = sorted(misfits, key=misfits.__getitem__)[:2]
        extent = max(sqrt(arm.dot(arm)) for arm in arms.values())
        is_decided = misfits[0.0] > 0.5 * extent and misfits[second_best] > 2.0 * misfits[best] + 1e-6 * extent
        if best == 0.0 or not is_decided:
            return None
        degrees = f"{best * 180 / pi:.0f}"
        remark = (
            f"'turn' of {self.name!r} is left out; {degrees} deg is assumed, as the sketch of {join_names(places)} has "
            f'link {second!r} at that angle to the line; write "turn": "{degrees} deg" to confirm it, or "turn": 0'
        )
        return replace(self, block_angle=best), remark

    @classmethod
    def expand_short_form(cls, entry: EntryReader) -> ExpandedEntry | None:
        """`"on": link, "block": point`: a block of its own, pinned at the point to the links that carry it."""
        if not entry.has("block"):
            if entry.has("on"):
                raise entry.error_at("on", "'on' goes with a 'block'; without one name two 'links' and a 'point'")
            return None
        entry.check_keys(*(key for key in (cls.keyword, *cls.entry_schemas) if key not in ("links", "point")))
        on, written = entry.link("on"), entry.text("block") or ""
        link, _, link_point = written.partition(".")
        if link_point and link in entry.links_with_point(link_point):
            raise entry.error_at(
                "block",
                f"a block is a new link, pinned at a point of other links, and 'block' names that point; for link "
                f'{link!r} itself to slide write "links": ["{on}", "{link}"], "point": "{link_point}"',
            )
        point = entry.name("block")
        if not entry.links_with_point(point):
            raise entry.error_at(
                "block",
                f"a block is a new link, pinned at a point of other links, and no link carries a point {point!r}; "
                "for a link that exists to slide write 'links' and 'point'",
            )
        block = f"block {point}"
        full = {key: value for key, value in entry.fields().items() if key not in ("on", "block")}
        full |= {"links": [on, block], "point": point}
        return ExpandedEntry(full, {block: {"points": {point: [0, 0]}}}, {"turning": point})

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[SlidingPair, ...]:
        entry.check_keys(cls.keyword, *(key for key in cls.entry_schemas if key not in ("on", "block")))
        name, links = entry.name("sliding"), entry.two_links("links")
        line = LinkLine.read(entry, "line", links[0])
        turn, point = entry.quantity("turn", "angle", 0.0), entry.point("point", links[1])
        sizes = {key: entry.quantity(key, "length") for key in ("guide_length", "guide_width") if entry.has(key)}
        for key, size in sizes.items():
            if size <= 0.0:
                raise entry.error_at(key, "a guide must have a size above zero")
        return (cls(name, links, line, point, turn, **sizes, friction=read_friction(entry)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        (pair,) = group
        entry: dict[str, Any] = {"sliding": pair.name, "links": list(pair.links), "line": pair.line.write(quantity)}
        entry["point"] = pair.point
        if pair.block_angle != 0.0:
            entry["turn"] = quantity(pair.block_angle, "angle")
        entry |= write_friction(pair.friction, quantity)
        sizes = {"guide_length": pair.guide_length, "guide_width": pair.guide_width}
        return entry | {key: quantity(size, "length") for key, size in sizes.items() if size is not None}

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        def sample(angle: float, turn: float, slide: float, first: Frame) -> PairSample:
            through, point = Vector(0.2, 0.5), Vector(-0.3, 0.1)
            pair = cls("slide", ("a", "b"), LinkLine("P", None, angle), "Q", turn)
            entry: dict[str, Any] = {
                "sliding": "slide",
                "links": ["a", "b"],
                "line": {"through": "P", "angle": angle},
                "point": "Q",
                "turn": turn,
            }
            second = frame_at(0.0, 0.0, first.angle + angle + turn)
            meet = first.to_world(through + direction(angle) * slide) - second.rotate_to_world(point)
            shapes = sample_shape(P=through), sample_shape(Q=point)
            if turn == 0.0:
                pair = replace(pair, guide_length=0.3, guide_width=0.1, friction=Friction(0.1))
                entry |= {"friction": 0.1, "guide_length": 0.3, "guide_width": 0.1}
            return PairSample(pair, shapes, (first, frame_at(meet.x, meet.y, second.angle)), (slide,), entry)

        return (
            sample(0.4, 1.1, 0.8, frame_at(0.1, 0.7, 0.6)),
            sample(-2.5, 0.0, -0.6, frame_at(-1.0, 0.2, 3.0)),
            sample(pi / 2, pi, 1.7, frame_at(0.0, 0.0, -0.4)),
        )
