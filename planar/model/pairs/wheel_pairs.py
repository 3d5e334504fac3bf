"""What the pairs have in common that tie the turning of one wheel to that of another, both seen from a carrier."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Scalar, sqrt
from planar.model.link_shapes import Shape
from planar.model.pairs.base import (
    Effort,
    Entry,
    Kind,
    Pair,
    Quantity,
    Sample,
    Schema,
    Told,
    described,
    plain,
    several,
)
from planar.model.pairs.symbols import Mark, Wheel

STEEPEST = 1e6
SIZES = ("radii", "teeth", "ratio")
NONZERO: Schema = {"not": {"const": 0}}
NEAR = 1e-6
"""Centres are where the radii put them within this part of their distance: dimensions in files are rounded."""


@dataclass(frozen=True)
class Wheels(Pair):
    """Two wheels whose angles a and b against the carrier obey b - b0 = ratio (a - a0); the angles count turns.

    `by` says what `sizes` are: two "radii" (m) or numbers of "teeth", or one "ratio". `meet` is (a0, b0) in rad.
    """

    carrier: str
    by: str
    sizes: tuple[float, ...]
    meet: tuple[float, float] = (0.0, 0.0)

    members: ClassVar[Mapping[str, Schema]] = {
        "links": several("name", 2, 2) | {"uniqueItems": True},
        "carrier": described("name"),
        "radii": {**several("length", 2, 2), "items": {**described("length"), **NONZERO}},
        "teeth": {**several("number", 2, 2), "items": {**described("number"), **NONZERO, "type": "integer"}},
        "ratio": {
            **described("number"),
            "anyOf": [
                {"minimum": 1.0 / STEEPEST, "maximum": STEEPEST},
                {"minimum": -STEEPEST, "maximum": -1.0 / STEEPEST},
            ],
        },
        "mesh": {
            "type": "object",
            "additionalProperties": described("angle"),
            "minProperties": 2,
            "maxProperties": 2,
        },
    }
    required: ClassVar[tuple[str, ...]] = ("links",)
    rule: ClassVar[Schema] = {"oneOf": [{"required": [key]} for key in SIZES]}
    lower: ClassVar[bool] = False
    counts_turns: ClassVar[bool] = True
    ties_angles: ClassVar[bool] = True
    constrains: ClassVar[tuple[Kind, ...]] = (Kind.TURNS,)
    measures: ClassVar[tuple[Kind, ...]] = (Kind.PURE, Kind.TURNS, Kind.TURNS)
    reports: ClassVar[Mapping[str, str]] = {
        "angle": "angle",
        "angular_velocity": "angular velocity",
        "angular_acceleration": "angular acceleration",
    }
    drive_kind: ClassVar[Kind] = Kind.TURNS

    @property
    def bodies(self) -> tuple[str, ...]:
        return (*self.links, self.carrier)

    @abstractmethod
    def ratio(self) -> Scalar:
        """The angular velocity of the second wheel by that of the first, both against the carrier."""

    def measure(self, shapes: Sequence[Shape]) -> Sequence[Scalar]:
        return (self.ratio(), *self.meet)

    def residual(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Sequence[Scalar]:
        first, second, carrier = (frame.angle for frame in frames)
        ratio, a0, b0 = numbers
        return (second - carrier - b0 - (first - carrier - a0) * ratio,)

    def drive(self, frames: Sequence[Frame], numbers: Sequence[Scalar], own: Sequence[Scalar]) -> Scalar:
        """The angle of the second wheel against the carrier."""
        return frames[1].angle - frames[2].angle

    def effort(self, frames: Mapping[str, Frame], shapes: Mapping[str, Shape]) -> Effort:
        return Effort(self.links[1], self.carrier)

    def report(self, position: Scalar, rate: Scalar, second: Scalar) -> dict[str, Scalar | None]:
        return dict(zip(self.reports, (position, rate, second), strict=True))

    def marks(self, shapes: Mapping[str, Shape], beside: Sequence[Pair]) -> tuple[Mark, ...]:
        """Both pitch circles, where both wheels are pinned to the carrier."""
        pins = [self._centre(wheel, beside) for wheel in self.links]
        if None in pins:
            return ()
        carrier = shapes[self.carrier]
        apart = carrier.at(pins[1][self.carrier]) - carrier.at(pins[0][self.carrier])
        radii = self.sizes if self.by == "radii" else self._pitch_radii(sqrt(apart.dot(apart)))
        return tuple(
            Wheel(self.name, link, shapes[link].at(pin[link]), radius)
            for link, pin, radius in zip(self.links, pins, radii, strict=True)
            if not (isinstance(radius, float) and radius == 0.0)
        )

    @abstractmethod
    def _pitch_radii(self, apart: Scalar) -> tuple[Scalar, ...]:
        """Radii (m) in the ratio that go with centres so far apart; zeros where there are none."""

    def _centre(self, wheel: str, beside: Sequence[Pair]) -> Mapping[str, str] | None:
        """The points of links in the pin in which a wheel turns in the carrier."""
        pins: dict[str, dict[str, str]] = {}
        for pair in beside:  # a pin of n links is several pairs
            pins.setdefault(pair.entry_name(), {}).update(pair.coincident())
        return next((pin for pin in pins.values() if wheel in pin and self.carrier in pin), None)

    def sizes_told(self, length: Told) -> str:
        first, second = self.links
        sizes = [f"{length(size) if self.by == 'radii' else f'{size:g}'}" for size in self.sizes]
        told = f"{self.by} {' and '.join(sizes)}, " if len(sizes) == 2 else ""
        return f"{told}{second} turns {self.ratio():.6g} times as fast as {first} against {self.carrier}"

    def misfit(self, beside: Sequence[Pair], shapes: Mapping[str, Shape], length: Told) -> str | None:
        if self.by != "radii":
            return None
        centres = []
        for wheel in self.links:
            pin = self._centre(wheel, beside)
            if pin is None:
                return f"wheels with radii turn in their carrier, but link {wheel!r} is not pinned to {self.carrier!r}"
            centres.append(shapes[self.carrier].at(pin[self.carrier]))
        apart = centres[1] - centres[0]
        return self._misplaced(hypot(apart.x, apart.y), length)

    @abstractmethod
    def _misplaced(self, apart: float, length: Told) -> str | None:
        """What is wrong with wheels of these radii whose centres are so far apart (m)."""

    @classmethod
    def _sizes(cls, entry: Entry) -> tuple[str, tuple[float, ...]]:
        given = [key for key in SIZES if entry.has(key)]
        if len(given) != 1:
            told = f"; here are {' and '.join(given)}" if given else ""
            raise entry.refuse(None, f"wheels are given by one of 'radii', 'teeth' and 'ratio'{told}")
        (by,) = given
        if by == "ratio":
            sizes: tuple[float, ...] = (entry.number("ratio"),)
        elif by == "radii":
            sizes = entry.quantities("radii", "length", 2)
        else:
            sizes = entry.counts("teeth", 2)
        if not all(sizes):
            raise entry.refuse(by, "zero is no size of a wheel")
        if not 1.0 / STEEPEST <= abs(sizes[0] / (sizes[1] if len(sizes) > 1 else 1.0)) <= STEEPEST:
            raise entry.refuse(
                by, f"wheels have a ratio from {1.0 / STEEPEST:g} to {STEEPEST:g} (its sign is free); take one between"
            )
        return by, sizes

    @classmethod
    def _common(cls, entry: Entry) -> tuple[str, tuple[str, str], str, str, tuple[float, ...], tuple[float, float]]:
        """name, links, carrier, by, sizes and meet of an entry."""
        name, links = entry.name(cls.keyword), entry.two_links("links")
        carrier = entry.link("carrier") if entry.has("carrier") else entry.frame
        if carrier in links and entry.has("carrier"):
            raise entry.refuse("carrier", f"{carrier!r} is one of the wheels; the carrier is a third link")
        if carrier in links:
            told = f"{carrier!r} is one of the wheels, so a third link is their 'carrier'; name it"
            raise entry.refuse(None, told)
        by, sizes = cls._sizes(entry)
        meet = (0.0, 0.0)
        if entry.has("mesh"):
            mesh = entry.inside("mesh")
            for key in mesh.fields():
                if key not in links:
                    raise mesh.refuse(key, f"{key!r} is neither of the wheels {links[0]!r} and {links[1]!r}")
            meet = (mesh.turned(links[0]), mesh.turned(links[1]))
        return name, links, carrier, by, sizes, meet

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        (pair,) = group
        entry: dict[str, Any] = {cls.keyword: pair.name, "links": list(pair.links), "carrier": pair.carrier}
        if pair.by == "ratio":
            entry["ratio"] = pair.sizes[0]
        elif pair.by == "radii":
            entry["radii"] = [quantity(radius, "length") for radius in pair.sizes]
        else:
            entry["teeth"] = [int(teeth) for teeth in pair.sizes]
        if pair.meet != (0.0, 0.0):
            both = zip(pair.links, pair.meet, strict=True)
            entry["mesh"] = {link: quantity(angle, "angle") for link, angle in both}
        return entry

    def _sample(self, carrier: float, first: float, more: Mapping[str, Any], apart: float | None = None) -> Sample:
        """The pair with its carrier and first wheel at these angles; wheels with radii pinned so far apart."""
        second = self.ratio() * (first - carrier - self.meet[0]) + carrier + self.meet[1]
        frames = frame_at(0.2, 0.5, first), frame_at(-0.7, 0.1, second), frame_at(0.3, -0.4, carrier)
        shapes, beside = (plain(A=Vector(0.0, 0.0)), plain(B=Vector(0.0, 0.0)), plain(C=Vector(0.0, 0.0))), ()
        if apart is not None:
            shapes = (*shapes[:2], plain(A=Vector(0.0, 0.0), B=Vector(apart, 0.0)))
            beside = {"turning": "A", "links": ["c", "a"]}, {"turning": "B", "links": ["c", "b"]}
        entry = {self.keyword: self.name, "links": ["a", "b"], "carrier": "c", **more}
        return Sample(self, shapes, frames, (), entry, beside)
