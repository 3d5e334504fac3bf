"""What the pairs have in common that tie the turning of one wheel to that of another, both seen from a carrier."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import hypot
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Scalar, sqrt
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
    described,
    list_schema,
    sample_shape,
    schema_reference,
)
from planar.model.pairs.friction import (
    EFFICIENCY_SCHEMA,
    has_loss,
    mesh_loss,
    write_efficiency,
)
from planar.model.pairs.rubbing import ContactLoad
from planar.model.pairs.symbols import DrawingMark, WheelMark

LARGEST_RATIO = 1e6
SIZE_KEYS = ("radii", "teeth", "ratio")
NONZERO_SCHEMA: Schema = {"not": {"const": 0}}
CENTRE_DISTANCE_TOLERANCE = 1e-6
"""Centres are where the radii put them within this part of their distance: dimensions in files are rounded."""


PinsOfLinks = Mapping[str, Sequence[Mapping[str, str]]]
"""Of every link the pins that it is in, each with the points of its links."""
_last_pins: list[tuple[Sequence[Pair], PinsOfLinks]] = []
"""Those of the pairs that were last asked about: every wheel of a mechanism asks about the same."""


def _pins_of_links(pairs: Sequence[Pair]) -> PinsOfLinks:
    """The pins of all links; a pin of n links is several pairs."""
    for known, pins_of_links in _last_pins:
        if known is pairs:
            return pins_of_links
    pins: dict[str, dict[str, str]] = {}
    for pair in pairs:
        pins.setdefault(pair.entry_name(), {}).update(pair.coincident_points())
    of_links: dict[str, list[Mapping[str, str]]] = {}
    for pin in pins.values():
        for link in pin:
            of_links.setdefault(link, []).append(pin)
    if isinstance(pairs, tuple):  # which cannot change
        _last_pins[:] = [(pairs, of_links)]
    return of_links


@dataclass(frozen=True)
class WheelPair(Pair):
    """Two wheels whose angles a and b against the carrier obey b - b0 = ratio (a - a0); the angles count turns.

    `by` says what `sizes` are: two "radii" (m) or numbers of "teeth", or one "ratio". `meet` is (a0, b0) in rad.
    """

    carrier: str
    size_kind: str
    sizes: tuple[float, ...]
    mesh_reference: tuple[float, float] = (0.0, 0.0)
    efficiency: float = field(default=1.0, kw_only=True)

    entry_schemas: ClassVar[Mapping[str, Schema]] = {
        "links": described(list_schema("name", 2, 2) | {"uniqueItems": True}, "the first and the second wheel"),
        "carrier": described(
            schema_reference("name"), "the link on which both wheels turn, as the arm of planets; left out: the frame"
        ),
        "radii": described(
            {**list_schema("length", 2, 2), "items": {**schema_reference("length"), **NONZERO_SCHEMA}},
            "the pitch radii of both; that of an internal wheel is negative; the centres lie as far apart as they say",
        ),
        "teeth": described(
            {
                **list_schema("number", 2, 2),
                "items": {**schema_reference("number"), **NONZERO_SCHEMA, "type": "integer"},
            },
            "the numbers of teeth, in place of radii; those of an internal wheel are negative",
        ),
        "ratio": described(
            {
                **schema_reference("number"),
                "anyOf": [
                    {"minimum": 1.0 / LARGEST_RATIO, "maximum": LARGEST_RATIO},
                    {"minimum": -LARGEST_RATIO, "maximum": -1.0 / LARGEST_RATIO},
                ],
            },
            "how fast the second turns beside the first, in place of radii; negative where they turn opposite ways",
        ),
        "mesh": described(
            {
                "type": "object",
                "additionalProperties": schema_reference("angle"),
                "minProperties": 2,
                "maxProperties": 2,
            },
            "an angle of each wheel against the carrier, by the links' names, at which they meet; left out: 0 meets 0",
        ),
        **EFFICIENCY_SCHEMA,
    }
    required_keys: ClassVar[tuple[str, ...]] = ("links",)
    entry_rule: ClassVar[Schema] = {"oneOf": [{"required": [key]} for key in SIZE_KEYS]}
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

    @abstractmethod
    def ratio(self) -> Scalar:
        """The angular velocity of the second wheel by that of the first, both against the carrier."""

    @property
    def has_friction(self) -> bool:
        return super().has_friction or has_loss(self.efficiency)

    def measure(self, shapes: Sequence[LinkShape]) -> Sequence[Scalar]:
        return (self.ratio(), *self.mesh_reference)

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second, carrier = (frame.angle for frame in frames)
        ratio, a0, b0 = numbers
        return (second - carrier - b0 - (first - carrier - a0) * ratio,)

    def input_position(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The angle of the second wheel against the carrier."""
        return frames[1].angle - frames[2].angle

    def effort_action(self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]) -> EffortAction:
        return EffortAction(self.links[1], self.carrier)

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """What is lost of the power between the wheels, seen from the carrier."""
        if not has_loss(self.efficiency):
            return ()
        wheel, pins = self.links[1], self._centre_pins(all_pairs)
        centre = Vector(frames[wheel].x, frames[wheel].y)
        if pins is not None:
            centre = frames[wheel].to_world(shapes[wheel].position(pins[1][wheel]))
        torque = ContactLoad(wheel, 1.0, None, centre)
        return (mesh_loss(self.links, self.effort_action(frames, shapes), torque, self.efficiency),)

    def results(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.result_kinds, (position, rate, second), strict=True))

    def drawing_marks(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> tuple[DrawingMark, ...]:
        """Both pitch circles, where both wheels are pinned to the carrier."""
        pins = self._centre_pins(all_pairs)
        if pins is None:
            return ()
        first, second = self._carrier_centres(shapes, all_pairs)
        apart = second - first
        radii = self.sizes if self.size_kind == "radii" else self._pitch_radii(sqrt(apart.dot(apart)))
        return tuple(
            WheelMark(self.name, link, shapes[link].position(pin[link]), radius)
            for link, pin, radius in zip(self.links, pins, radii, strict=True)
            if not (isinstance(radius, float) and radius == 0.0)
        )

    def wheel_centres(self, all_pairs: Sequence[Pair]) -> Mapping[str, str | None]:
        return {wheel: (self._centre_pin(wheel, all_pairs) or {}).get(wheel) for wheel in self.links}

    def _carrier_centres(self, shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]) -> list[Vector]:
        """Where both wheels are pinned to the carrier, in its axes; fewer where one is not."""
        pins = [self._centre_pin(wheel, all_pairs) for wheel in self.links]
        return [shapes[self.carrier].position(pin[self.carrier]) for pin in pins if pin is not None]

    @abstractmethod
    def _pitch_radii(self, centre_distance: Scalar) -> tuple[Scalar, ...]:
        """Radii (m) in the ratio that go with centres so far apart; zeros where there are none."""

    def _centre_pin(self, wheel: str, beside: Sequence[Pair]) -> Mapping[str, str] | None:
        """The points of links in the pin in which a wheel turns in the carrier."""
        return next((pin for pin in _pins_of_links(beside).get(wheel, ()) if self.carrier in pin), None)

    def _centre_pins(self, beside: Sequence[Pair]) -> list[Mapping[str, str]] | None:
        """Those of both wheels; None where one of them is not pinned to the carrier."""
        pins = [pin for wheel in self.links if (pin := self._centre_pin(wheel, beside)) is not None]
        return pins if len(pins) == len(self.links) else None

    def describe_sizes(self, format_length: LengthFormatter) -> str:
        first, second = self.links
        sizes = [f"{format_length(size) if self.size_kind == 'radii' else f'{size:g}'}" for size in self.sizes]
        told = f"{self.size_kind} {' and '.join(sizes)}, " if len(sizes) == 2 else ""
        return f"{told}{second} turns {self.ratio():.6g} times as fast as {first} against {self.carrier}"

    def find_misfit(
        self, all_pairs: Sequence[Pair], shapes: Mapping[str, LinkShape], format_length: LengthFormatter
    ) -> str | None:
        if self.size_kind != "radii":
            return None
        centres = []
        for wheel in self.links:
            pin = self._centre_pin(wheel, all_pairs)
            if pin is None:
                return f"wheels with radii turn in their carrier, but link {wheel!r} is not pinned to {self.carrier!r}"
            centres.append(shapes[self.carrier].position(pin[self.carrier]))
        apart = centres[1] - centres[0]
        return self._find_distance_problem(hypot(apart.x, apart.y), format_length)

    @abstractmethod
    def _find_distance_problem(self, centre_distance: float, format_length: LengthFormatter) -> str | None:
        """What is wrong with wheels of these radii whose centres are so far apart (m)."""

    @classmethod
    def _read_sizes(cls, entry: EntryReader) -> tuple[str, tuple[float, ...]]:
        given = [key for key in SIZE_KEYS if entry.has(key)]
        if len(given) != 1:
            told = f"; here are {' and '.join(given)}" if given else ""
            raise entry.error_at(None, f"wheels are given by one of 'radii', 'teeth' and 'ratio'{told}")
        (by,) = given
        if by == "ratio":
            sizes: tuple[float, ...] = (entry.number("ratio"),)
        elif by == "radii":
            sizes = entry.quantities("radii", "length", 2)
        else:
            sizes = entry.whole_numbers("teeth", 2)
        if not all(sizes):
            raise entry.error_at(by, "zero is no size of a wheel")
        if not 1.0 / LARGEST_RATIO <= abs(sizes[0] / (sizes[1] if len(sizes) > 1 else 1.0)) <= LARGEST_RATIO:
            raise entry.error_at(
                by,
                f"wheels have a ratio from {1.0 / LARGEST_RATIO:g} to {LARGEST_RATIO:g} (its sign is free); "
                "take one between",
            )
        return by, sizes

    @classmethod
    def _read_common(
        cls, entry: EntryReader
    ) -> tuple[str, tuple[str, str], str, str, tuple[float, ...], tuple[float, float]]:
        """name, links, carrier, by, sizes and meet of an entry."""
        name, links = entry.name(cls.keyword), entry.two_links("links")
        carrier = entry.link("carrier") if entry.has("carrier") else entry.frame
        if carrier in links and entry.has("carrier"):
            raise entry.error_at("carrier", f"{carrier!r} is one of the wheels; the carrier is a third link")
        if carrier in links:
            told = f"{carrier!r} is one of the wheels, so a third link is their 'carrier'; name it"
            raise entry.error_at(None, told)
        by, sizes = cls._read_sizes(entry)
        meet = (0.0, 0.0)
        if entry.has("mesh"):
            mesh = entry.object_at("mesh")
            for key in mesh.fields():
                if key not in links:
                    raise mesh.error_at(key, f"{key!r} is neither of the wheels {links[0]!r} and {links[1]!r}")
            meet = (mesh.counted_angle(links[0]), mesh.counted_angle(links[1]))
        return name, links, carrier, by, sizes, meet

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        (pair,) = group
        entry: dict[str, Any] = {cls.keyword: pair.name, "links": list(pair.links), "carrier": pair.carrier}
        if pair.size_kind == "ratio":
            entry["ratio"] = quantity(pair.sizes[0], "number")
        elif pair.size_kind == "radii":
            entry["radii"] = [quantity(radius, "length") for radius in pair.sizes]
        else:
            entry["teeth"] = [quantity(teeth, "count") for teeth in pair.sizes]
        if pair.mesh_reference != (0.0, 0.0):
            both = zip(pair.links, pair.mesh_reference, strict=True)
            entry["mesh"] = {link: quantity(angle, "angle") for link, angle in both}
        return entry | write_efficiency(pair.efficiency, quantity)

    def _make_sample(
        self, carrier: float, first: float, more: Mapping[str, Any], apart: float | None = None
    ) -> PairSample:
        """The pair with its carrier and first wheel at these angles; wheels with radii pinned so far apart."""
        second = self.ratio() * (first - carrier - self.mesh_reference[0]) + carrier + self.mesh_reference[1]
        frames = frame_at(0.2, 0.5, first), frame_at(-0.7, 0.1, second), frame_at(0.3, -0.4, carrier)
        shapes = sample_shape(A=Vector(0.0, 0.0)), sample_shape(B=Vector(0.0, 0.0)), sample_shape(C=Vector(0.0, 0.0))
        beside: tuple[dict[str, Any], ...] = ()
        if apart is not None:
            shapes = shapes[0], shapes[1], sample_shape(A=Vector(0.0, 0.0), B=Vector(apart, 0.0))
            beside = {"turning": "A", "links": ["c", "a"]}, {"turning": "B", "links": ["c", "b"]}
        entry = {self.keyword: self.name, "links": ["a", "b"], "carrier": "c", **more}
        return PairSample(self, shapes, frames, (), entry, beside)
