"""The gear pair: two toothed wheels in mesh, external or internal, on a fixed or a moving carrier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import tan
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Scalar, sqrt
from planar.model.link_shapes import Shape
from planar.model.pairs.base import Contact, Entry, Pair, Quantity, Sample, Schema, Told
from planar.model.pairs.teeth import PRESSURE_ANGLE, TEETH, read_pressure_angle, write_pressure_angle
from planar.model.pairs.wheel_pairs import NEAR, Wheels


@dataclass(frozen=True)
class Gear(Wheels):
    """Wheels in mesh: ratio -r/s of radii or teeth; an internal wheel's is negative."""

    pressure_angle: float = PRESSURE_ANGLE

    keyword: ClassVar[str] = "gear"
    members: ClassVar[Mapping[str, Schema]] = {**Wheels.members, **TEETH}

    def ratio(self) -> Scalar:
        return self.sizes[0] if self.by == "ratio" else -self.sizes[0] / self.sizes[1]

    def _misplaced(self, apart: float, length: Told) -> str | None:
        wanted = abs(self.sizes[0] + self.sizes[1])
        if abs(apart - wanted) <= NEAR * max(apart, wanted):
            return None
        return f"wheels of these radii mesh with centres {length(wanted)} apart, but theirs are {length(apart)} apart"

    def _pitch_radii(self, apart: Scalar) -> tuple[Scalar, ...]:
        """From ratio = -r / s and the distance |r + s|, where of an internal pair the larger wheel is negative."""
        ratio = self.ratio()
        if ratio == 1.0:  # equal wheels that turn alike do not meet
            return 0.0, 0.0
        s = (apart if ratio < 0.0 else -apart) / (1.0 - ratio)
        return -ratio * s, s

    @classmethod
    def read(cls, entry: Entry) -> tuple[Gear, ...]:
        entry.only(cls.keyword, *cls.members)
        name, links, carrier, by, sizes, meet = cls._common(entry)
        if by != "ratio" and max(sizes) < 0.0:
            raise entry.refuse(by, "both wheels are internal (negative); one at least has teeth on its outside")
        if by != "ratio" and min(sizes) < 0.0 <= sum(sizes):
            raise entry.refuse(by, "an internal wheel (negative) is larger than the wheel that runs in it")
        return (cls(name, links, carrier, by, sizes, meet, read_pressure_angle(entry)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: Quantity) -> dict[str, Any]:
        return super().write(group, quantity) | write_pressure_angle(group[0].pressure_angle, quantity)

    def contact(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, Shape], beside: Sequence[Pair]
    ) -> Contact | None:
        """The pitch point on the line of the centres, where both wheels are pinned to the carrier, apart.

        A ratio alone leaves open what stands between the wheels.
        """
        pins = [self._centre(wheel, beside) for wheel in self.links]
        if self.by == "ratio" or None in pins:
            return None
        first, second = (shapes[self.carrier].at(pin[self.carrier]) for pin in pins)
        apart = sqrt((second - first).dot(second - first))
        if isinstance(apart, float) and apart == 0.0:
            return None
        way = (second - first) * (1.0 / apart)
        outside = 1.0 if self.ratio() < 0.0 else -1.0
        carrier = frames[self.carrier]
        at = carrier.carry(first + way * (outside * self._pitch_radii(apart)[0]))
        # teeth push a wheel that has them on its outside towards its own centre
        return Contact(at, carrier.turn(Vector(-way.y, way.x)), carrier.turn(way * outside), tan(self.pressure_angle))

    @classmethod
    def samples(cls) -> tuple[Sample, ...]:
        links = ("a", "b")
        return (
            cls("mesh", links, "c", "ratio", (-2.122,), (1.3, 3.7))._sample(
                0.0, 0.9, {"ratio": -2.122, "mesh": {"a": 1.3, "b": 3.7}}
            ),
            cls("mesh", links, "c", "radii", (0.3, 0.5))._sample(-1.2, 7.4, {"radii": [0.3, 0.5]}, 0.8),
            cls("mesh", links, "c", "radii", (-0.6, 0.2), pressure_angle=0.25)._sample(
                0.8, -2.5, {"radii": [-0.6, 0.2], "pressure_angle": 0.25}, 0.4
            ),
            cls("mesh", links, "c", "teeth", (20.0, 31.0))._sample(2.0, 0.3, {"teeth": [20, 31]}),
        )
