"""The Geneva wheel: a pin drives it through one slot after the other, and a locking arc holds it meanwhile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import acos, asin, cos, pi, sin
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, direction, frame_at
from planar.foundation.jets import Scalar, TermSizes, atan2, hypot, value_between, within_turn
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    LengthFormatter,
    MeasureKind,
    Pair,
    PairSample,
    PieceEnds,
    Schema,
    described,
    list_schema,
    sample_shape,
    schema_reference,
)
from planar.model.pairs.symbols import DrawingMark, OutlineMark

LEAST_SLOTS, MOST_SLOTS = 3, 100
PIN_RATIO = 0.12
"""Of the crank's length: how wide the drawn slots are to either side of their middle line."""
ARC_POINTS = 25
"""Of a drawn arc."""
LOCKING_RATIO = 0.7
"""Of the crank's length: the radius of the drawn locking disc."""


@dataclass(frozen=True)
class GenevaPair(Pair):
    """A crank with a pin (first) and a wheel of `slots` (second), both on a carrier; their angles count turns.

    The pin enters and leaves the slots along them: the distance of the centres is that of the pin by sin(pi / slots).
    Where the crank stands at `mesh_reference[0]` (rad against the carrier) the pin is between the centres, the wheel at
    `mesh_reference[1]`. While the pin is outside, the wheel rests. J. H. Bickford, Mechanisms for Intermittent Motion,
    Industrial Press 1972, ch. 9.
    """

    carrier: str
    slots: int
    mesh_reference: tuple[float, float] = (0.0, 0.0)

    keyword: ClassVar[str] = "geneva"
    entry_description: ClassVar[str] = "a Geneva wheel with its crank: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(list_schema("name", 2, 2) | {"uniqueItems": True}, "the crank with the pin, then the wheel"),
        "carrier": described(schema_reference("name"), "the link on which both turn; left out: the frame"),
        "slots": described(
            {"type": "integer", "minimum": LEAST_SLOTS, "maximum": MOST_SLOTS}, "how many slots the wheel has"
        ),
        "mesh": described(
            {
                "type": "object",
                "additionalProperties": schema_reference("angle"),
                "minProperties": 2,
                "maxProperties": 2,
            },
            "the angles of both against the carrier, by the links' names, where the pin is between the centres; "
            "left out: 0 and 0",
        ),
    }
    required_keys: ClassVar[tuple[str, ...]] = ("links", "slots")
    is_lower_pair: ClassVar[bool] = False
    counts_turns: ClassVar[bool] = True
    ties_angles: ClassVar[bool] = True
    residual_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.TURNS,)
    number_kinds: ClassVar[tuple[MeasureKind, ...]] = (MeasureKind.PURE, MeasureKind.TURNS, MeasureKind.TURNS)
    result_kinds: ClassVar[Mapping[str, str]] = {
        "angle": "angle",
        "angular_velocity": "angular velocity",
        "angular_acceleration": "angular acceleration",
    }
    input_kind: ClassVar[MeasureKind] = MeasureKind.TURNS

    @property
    def bodies(self) -> tuple[str, ...]:
        return (*self.links, self.carrier)

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        return (1.0 / float(self.slots), *self.mesh_reference)

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        crank, wheel, carrier = (frame.angle for frame in frames)
        part, a0, b0 = numbers
        return (wheel - carrier - b0 + _wheel_turn(crank - carrier - a0, part, self.slots),)

    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The angle of the crank against the carrier."""
        return frames[0].angle - frames[2].angle

    def piece_ends(self, shapes: Mapping[str, LinkShape]) -> PieceEnds:
        """Where the pin enters a slot and leaves it."""
        engaged = 0.5 * pi - pi / self.slots
        middle = self.mesh_reference[0]
        return PieceEnds(self.links[0], self.carrier, (middle - engaged, middle + engaged))

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        return EffortAction(self.links[0], self.carrier)

    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.result_kinds, (position, rate, second), strict=True))

    def describe_sizes(self, format_length: LengthFormatter) -> str:
        crank, wheel = self.links
        part = 0.5 - 1.0 / self.slots
        return f"{self.slots} slots; {wheel} moves during {part:.6g} of a turn of {crank}, and rests else"

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        """The wheel with its slots, the crank with pin and locking disc, where both are pinned to the carrier."""
        centres = [self._centre(link, all_pairs) for link in self.links]
        if None in centres:
            return ()
        (crank_at, here), (wheel_at, there) = (each for each in centres if each is not None)
        apart = shapes[self.carrier].position(there) - shapes[self.carrier].position(here)
        distance, toward = hypot(apart.x, apart.y), atan2(apart.y, apart.x)
        crank, wheel = self.links
        a0, b0 = self.mesh_reference
        pin = direction(toward - a0)
        back = direction(toward + pi - b0)
        centre, hub = shapes[crank].position(crank_at), shapes[wheel].position(wheel_at)
        length = distance * sin(pi / self.slots)
        outline = tuple(hub + at.rotate(back) * distance for at in _wheel_outline(self.slots))
        rim = tuple(centre + at.rotate(pin) * length for at in _locking_outline(self.slots))
        roller = tuple(
            centre + (Vector(1.0, 0.0) + direction(2.0 * pi * k / ARC_POINTS) * PIN_RATIO).rotate(pin) * length
            for k in range(ARC_POINTS)
        )
        arm = (centre, centre + pin * length)
        return (
            OutlineMark(self.name, wheel, outline, True),
            OutlineMark(self.name, crank, rim, True),
            OutlineMark(self.name, crank, roller, True),
            OutlineMark(self.name, crank, arm, False),
        )

    def _centre(self, link: str, pairs: Sequence[Pair]) -> tuple[str, str] | None:
        """The points of a link and of the carrier in the pin between the two."""
        pins: dict[str, dict[str, str]] = {}
        for pair in pairs:  # a pin of n links is several pairs
            pins.setdefault(pair.entry_name(), {}).update(pair.coincident_points())
        found = (pin for pin in pins.values() if link in pin and self.carrier in pin)
        return next(((pin[link], pin[self.carrier]) for pin in found), None)

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[Self, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        name, links = entry.name(cls.keyword), entry.two_links("links")
        carrier = entry.link("carrier") if entry.has("carrier") else entry.frame
        if carrier in links:
            raise entry.error_at(
                "carrier" if entry.has("carrier") else None,
                f"{carrier!r} is the crank or the wheel; the carrier is a third link",
            )
        slots = entry.number("slots")
        if not (float(slots).is_integer() and LEAST_SLOTS <= slots <= MOST_SLOTS):
            raise entry.error_at("slots", f"a Geneva wheel has from {LEAST_SLOTS} to {MOST_SLOTS} slots, not {slots:g}")
        meet = (0.0, 0.0)
        if entry.has("mesh"):
            mesh = entry.object_at("mesh")
            mesh.check_keys(*links)
            meet = (mesh.counted_angle(links[0]), mesh.counted_angle(links[1]))
        return (cls(name, links, carrier, int(slots), meet),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        (pair,) = group
        entry: dict[str, Any] = {cls.keyword: pair.name, "links": list(pair.links), "carrier": pair.carrier}
        entry["slots"] = pair.slots if type(pair.slots) is int else int(pair.slots)
        if pair.mesh_reference != (0.0, 0.0):
            both = zip(pair.links, pair.mesh_reference, strict=True)
            entry["mesh"] = {link: quantity(angle, "angle") for link, angle in both}
        return entry

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        def sample(slots: int, turned: float, meet: tuple[float, float]) -> PairSample:
            carrier = 0.7
            crank = carrier + meet[0] + turned
            wheel = carrier + meet[1] - _wheel_turn(turned, 1.0 / slots, slots)
            bare = sample_shape(A=Vector(0.0, 0.0))
            entry: dict[str, Any] = {"geneva": "K", "links": ["a", "b"], "carrier": "c", "slots": slots}
            if meet != (0.0, 0.0):
                entry["mesh"] = {"a": meet[0], "b": meet[1]}
            frames = frame_at(0.2, 0.5, crank), frame_at(-0.7, 0.1, wheel), frame_at(0.3, -0.4, carrier)
            return PairSample(cls("K", ("a", "b"), "c", slots, meet), (bare, bare, bare), frames, (), entry)

        pinned = sample(5, 0.2, (0.3, 1.0))
        a, b = Vector(0.0, 0.0), Vector(1.0, 0.0)
        shapes = sample_shape(A=a), sample_shape(B=a), sample_shape(A=a, B=b)
        pins = {"turning": "A", "links": ["c", "a"]}, {"turning": "B", "links": ["c", "b"]}
        pinned = pinned._replace(shapes=shapes, other_entries=pins)
        return sample(6, 6.6, (0.0, 0.0)), sample(4, -0.35, (0.4, -2.0)), pinned


def _wheel_turn(angle: Scalar, part: Scalar, slots: int) -> Scalar:
    """By how much the wheel has turned back where the crank has turned by an angle from between the centres (rad)."""
    ratio = sin(pi / slots)
    if isinstance(angle, TermSizes):
        size, first, second = angle.parts
        fastest = ratio / (1.0 - ratio)
        return TermSizes(
            size + 2.0 * pi, first * (1.0 + fastest), (second + first * first * (1.0 + fastest)) * (1.0 + fastest)
        )
    within = within_turn(angle + pi)
    engaged = 0.5 * pi - pi / slots
    at = within - pi
    driven = atan2(_sin(at), 1.0 / ratio - _cos(at))
    low, high = pi - engaged, pi + engaged
    local = value_between(within, low, high, driven) + value_between(within, high, None, 0.0 * at + pi / slots)
    return (angle + pi - within) * part + local + value_between(within, None, low, 0.0 * at - pi / slots)


def _sin(angle: Scalar) -> Scalar:
    return direction(angle).y


def _cos(angle: Scalar) -> Scalar:
    return direction(angle).x


def _wheel_outline(slots: int) -> list[Vector]:
    """The rim of a wheel for centres one apart, a slot along the x-axis; the locking disc fills arcs between slots."""
    length, step = sin(pi / slots), 2.0 * pi / slots
    half, outer = PIN_RATIO * length, cos(pi / slots)
    inner = 1.0 - length - half
    disc = LOCKING_RATIO * length
    rim: list[Vector] = []
    reach = asin(min(half / outer, 1.0))
    for k in range(slots):
        slot = [Vector(outer * cos(reach), -half), Vector(inner, -half), Vector(inner, half)]
        slot.append(Vector(outer * cos(reach), half))
        rim += [each.rotate(direction(k * step)) for each in slot]
        # the locking disc's centre lies between two slots, one away
        middle = direction((k + 0.5) * step)
        spread = min(0.5 * step - reach, 0.8)
        first = Vector(outer * cos(spread), -outer * sin(spread)) - Vector(1.0, 0.0)
        opening = min(atan2(-first.y, -first.x), 0.5 * pi)
        arc = [-opening + 2.0 * opening * j / (ARC_POINTS - 1) for j in range(ARC_POINTS)]
        rim += [(Vector(1.0, 0.0) - direction(-each) * disc).rotate(middle) for each in arc if disc * cos(each) < 1.0]
    return rim


def _locking_outline(slots: int) -> list[Vector]:
    """The locking disc of a crank of length one, its pin along the x-axis: cut away where the wheel's corners turn."""
    wheel = 1.0 / sin(pi / slots)
    reach = wheel * cos(pi / slots)  # of the wheel's corners, from its centre
    cut = acos(min((LOCKING_RATIO**2 + 1.0) / (2.0 * LOCKING_RATIO * wheel), 1.0))
    arc = [cut + (2.0 * pi - 2.0 * cut) * j / (3 * ARC_POINTS) for j in range(3 * ARC_POINTS + 1)]
    seen = asin(min(LOCKING_RATIO * sin(cut) / reach, 1.0))
    back = [seen - 2.0 * seen * j / ARC_POINTS for j in range(ARC_POINTS + 1)]
    ends = [direction(angle) * LOCKING_RATIO for angle in arc]
    return [*ends, *(Vector(wheel, 0.0) - direction(-each) * reach for each in reversed(back))]
