"""The gear pair: two toothed wheels in mesh, external or internal, on a fixed or a moving carrier."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import pi
from typing import Any, ClassVar, Self

from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Scalar, sign_of, sqrt, tan
from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.link_shapes import LinkShape
from planar.model.pairs.base import (
    EffortAction,
    LengthFormatter,
    Pair,
    PairSample,
    RubbingContact,
    Schema,
    ToothContact,
)
from planar.model.pairs.friction import FRICTION_SCHEMA, has_loss, read_efficiency, read_friction, write_friction
from planar.model.pairs.rubbing import ContactLoad, Friction, LoadLaw
from planar.model.pairs.teeth import STANDARD_PRESSURE_ANGLE, TEETH_SCHEMA, read_pressure_angle, write_pressure_angle
from planar.model.pairs.wheel_pairs import CENTRE_DISTANCE_TOLERANCE, WheelPair


@dataclass(frozen=True)
class GearPair(WheelPair):
    """Wheels in mesh: ratio -r/s of radii or teeth; an internal wheel's is negative."""

    pressure_angle: float = STANDARD_PRESSURE_ANGLE

    keyword: ClassVar[str] = "gear"
    entry_description: ClassVar[str] = "a pair of gears: its name"
    entry_schemas: ClassVar[Mapping[str, Schema]] = {**WheelPair.entry_schemas, **TEETH_SCHEMA, **FRICTION_SCHEMA}

    def ratio(self) -> Scalar:
        return self.sizes[0] if self.size_kind == "ratio" else -self.sizes[0] / self.sizes[1]

    def find_misfit(
        self, all_pairs: Sequence[Pair], shapes: Mapping[str, LinkShape], format_length: LengthFormatter
    ) -> str | None:
        if self.friction is not None and self._centre_pins(all_pairs) is None:
            return "the friction of teeth follows their size; pin both wheels to their carrier, or give an 'efficiency'"
        least = min(map(abs, self.sizes)) / max(map(abs, self.sizes))
        if self.size_kind != "ratio" and min(self.sizes) < 0.0 and self.efficiency <= least:
            return (
                f"teeth inside a wheel lose less than that: their 'efficiency' is above {least:.4g}, that of the radii"
            )
        return super().find_misfit(all_pairs, shapes, format_length)

    def _find_distance_problem(self, centre_distance: float, format_length: LengthFormatter) -> str | None:
        wanted = abs(self.sizes[0] + self.sizes[1])
        if abs(centre_distance - wanted) <= CENTRE_DISTANCE_TOLERANCE * max(centre_distance, wanted):
            return None
        return (
            f"wheels of these radii mesh with centres {format_length(wanted)} apart, but theirs are "
            f"{format_length(centre_distance)} apart"
        )

    def _pitch_radii(self, centre_distance: Scalar) -> tuple[Scalar, ...]:
        """From ratio = -r / s and the distance |r + s|, where of an internal pair the larger wheel is negative."""
        ratio = self.ratio()
        if isinstance(ratio, float) and ratio == 1.0:  # equal wheels that turn alike do not meet
            return 0.0, 0.0
        s = -sign_of(ratio) * centre_distance / (1.0 - ratio)
        return -ratio * s, s

    @classmethod
    def read(cls, entry: EntryReader) -> tuple[GearPair, ...]:
        entry.check_keys(cls.keyword, *cls.entry_schemas)
        name, links, carrier, by, sizes, meet = cls._read_common(entry)
        if by != "ratio" and max(sizes) < 0.0:
            raise entry.error_at(by, "both wheels are internal (negative); one at least has teeth on its outside")
        if by != "ratio" and min(sizes) < 0.0 <= sum(sizes):
            raise entry.error_at(by, "an internal wheel (negative) is larger than the wheel that runs in it")
        friction = read_friction(entry)
        if friction is not None and by != "teeth":
            raise entry.error_at(
                "friction", "the friction of teeth follows their number; give 'teeth', or an 'efficiency' in its place"
            )
        if friction is not None and entry.has("efficiency"):
            raise entry.error_at("efficiency", "give either 'friction' of the teeth or their 'efficiency', not both")
        found = cls(name, links, carrier, by, sizes, meet, read_pressure_angle(entry), friction=friction)
        return (replace(found, efficiency=read_efficiency(entry)),)

    @classmethod
    def write(cls, group: Sequence[Self], quantity: QuantityWriter) -> dict[str, Any]:
        found = super().write(group, quantity) | write_pressure_angle(group[0].pressure_angle, quantity)
        return found | write_friction(group[0].friction, quantity)

    def tooth_contact(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair]
    ) -> ToothContact | None:
        """The pitch point on the line of the centres, where both wheels are pinned to the carrier, apart.

        A ratio alone leaves open what stands between the wheels.
        """
        pins = self._centre_pins(all_pairs)
        if self.size_kind == "ratio" or pins is None:
            return None
        first, second = (shapes[self.carrier].position(pin[self.carrier]) for pin in pins)
        apart = sqrt((second - first).dot(second - first))
        if isinstance(apart, float) and apart == 0.0:
            return None
        way = (second - first) * (1.0 / apart)
        outside = -sign_of(self.ratio())
        carrier = frames[self.carrier]
        at = carrier.to_world(first + way * (outside * self._pitch_radii(apart)[0]))
        # teeth push a wheel that has them on its outside towards its own centre
        return ToothContact(
            at,
            carrier.rotate_to_world(Vector(-way.y, way.x)),
            carrier.rotate_to_world(way * outside),
            tan(self.pressure_angle),
        )

    def rubbing_contacts(
        self, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape], all_pairs: Sequence[Pair], at_rest: bool
    ) -> tuple[RubbingContact, ...]:
        """The couple between the wheels by which rubbing teeth resist their turning, on average over a mesh.

        Teeth rub before and behind the pitch point, to either side, at half the base pitch a quarter of it away on
        average: mu F p_b / 4 of the force F = W / cos(pressure angle) on a tooth. With the pitch p of W's circle that
        is mu W p / 4, a loss of mu (pi / 2)(1/z1 + 1/z2) of the power (G. Niemann, H. Winter, Maschinenelemente II,
        2003, with a contact ratio of one). An efficiency is that of such a couple c, by radii r and s and the force W:
        (W - c / s) / (W + c / r) where the first drives, the other way round where the second does.
        """
        contact = self.tooth_contact(frames, shapes, all_pairs)
        if contact is None or not self.has_friction:
            return super().rubbing_contacts(frames, shapes, all_pairs, at_rest)
        first, second = self.links
        centres = self._carrier_centres(shapes, all_pairs)
        apart = centres[1] - centres[0]
        own, other = self._pitch_radii(sqrt(apart.dot(apart)))
        along = against = 0.0
        if self.friction is not None:
            along = against = self.friction.coefficient(at_rest) * abs(other) * (0.5 * pi / abs(self.sizes[1]))
        elif has_loss(self.efficiency):
            lost = 1.0 - self.efficiency
            along = lost / (1.0 / other + self.efficiency / own)
            against = lost / (1.0 / own + self.efficiency / other)
        drives = f"{first} drives", f"{second} drives"
        ratio = self.ratio()
        # on the second wheel a force that way at the pitch point turns clockwise, but inside a larger first one
        turning = contact.drive_direction * (-1.0 if ratio < 1.0 else 1.0)
        press = ContactLoad(second, along, turning, None, against, drives)
        sense = 1.0 if ratio < 0.0 or ratio > 1.0 else -1.0
        return (RubbingContact(EffortAction(second, first), (press,), LoadLaw.GREATEST, sense),)

    @classmethod
    def samples(cls) -> tuple[PairSample, ...]:
        links = ("a", "b")
        return (
            cls("mesh", links, "c", "ratio", (-2.122,), (1.3, 3.7))._make_sample(
                0.0, 0.9, {"ratio": -2.122, "mesh": {"a": 1.3, "b": 3.7}}
            ),
            cls("mesh", links, "c", "radii", (0.3, 0.5), efficiency=0.97)._make_sample(
                -1.2, 7.4, {"radii": [0.3, 0.5], "efficiency": 0.97}, 0.8
            ),
            cls("mesh", links, "c", "radii", (-0.6, 0.2), pressure_angle=0.25)._make_sample(
                0.8, -2.5, {"radii": [-0.6, 0.2], "pressure_angle": 0.25}, 0.4
            ),
            cls("mesh", links, "c", "teeth", (20.0, 31.0), friction=Friction(0.06))._make_sample(
                2.0, 0.3, {"teeth": [20, 31], "friction": 0.06}, 0.7
            ),
        )
