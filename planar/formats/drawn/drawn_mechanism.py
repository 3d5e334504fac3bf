"""A mechanism where it stands as a drawn linkage, for formats that save joints in drawn coordinates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import ceil, degrees, floor, pi

from planar.formats.drawn.drawn_linkage import (
    DrawnForce,
    DrawnInput,
    DrawnLinkage,
    DrawnMass,
    DrawnStop,
    Joint,
    PinJoint,
    Place,
    RackJoint,
    SlideJoint,
    SlotJoint,
    Tracer,
    WheelJoint,
    position_on_line,
)
from planar.formats.drawn.file_format import cannot_say
from planar.foundation.geometry import Frame, Vector
from planar.foundation.units import parse_unit
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, curved_slots, named_points, pair_entries, relative_motions
from planar.model.pairs.base import MeasureKind, Pair
from planar.model.pairs.belt import BeltPair, ChainPair
from planar.model.pairs.gear import GearPair
from planar.model.pairs.rack import RackPair
from planar.model.pairs.sliding import SlidingPair
from planar.model.pairs.slot import SlotPair
from planar.model.pairs.turning import TurningPair

WHEELS = {GearPair: "gear", BeltPair: "belt", ChainPair: "chain"}
LENGTHS = ("mm", "cm", "m", "in")
"""Units of length that drawn linkages have; any other is written as mm."""
STOP_TOLERANCE = 1e-9
"""rad, or the drawing's unit of length: a position this far from a stop is at it."""


def drawn_mechanism(
    mechanism: Mechanism, frames: Mapping[str, Frame], title: str, without: tuple[type[Pair], ...] = ()
) -> DrawnLinkage:
    """The mechanism as a linkage where its links have these frames, in its own unit of length.

    `title` is the format's, for BadInput where a pair is of a type that no drawn linkage has; pairs of the types
    `without` are left out. What a drawn linkage cannot say beside the motion stands in its notes.
    """
    return _Drawing(mechanism, frames, title, without).linkage()


class _Drawing:
    """One mechanism on its way to a linkage."""

    def __init__(
        self, mechanism: Mechanism, frames: Mapping[str, Frame], title: str, without: tuple[type[Pair], ...]
    ) -> None:
        from planar.model.link_shapes import link_shape

        self.without = without
        self.mechanism, self.frames, self.title = mechanism, frames, title
        self.shapes: dict[str, LinkShape] = {link.name: link_shape(link) for link in mechanism.links}
        self.length = mechanism.units.length if mechanism.units.length in LENGTHS else "mm"
        self.unit = parse_unit(self.length)

    def linkage(self) -> DrawnLinkage:
        mechanism = self.mechanism
        if mechanism.closes_within is not None:
            raise cannot_say(self.title, "the misfit that 'closes_within' allows", "its pairs close exactly")
        groups = [group for group in pair_entries(mechanism) if not isinstance(group[0], self.without)]
        joints = tuple(self._joint(group) for group in groups)
        return DrawnLinkage(
            mechanism.name,
            mechanism.frame,
            joints,
            tuple(self._tracers(joints)),
            tuple(self._inputs()),
            tuple(self._masses()),
            tuple(self._forces()),
            tuple(self._stops(joints)),
            mechanism.gravity,
            self.length,
            tuple(link.name for link in mechanism.links),
            tuple(slot.link for slot in curved_slots(mechanism)),
            tuple(self._notes(joints)),
        )

    def _place(self, at: Vector) -> Place:
        return float(self.unit.from_si(at.x)), float(self.unit.from_si(at.y))

    def _world(self, link: str, point: str) -> Place:
        return self._place(self.frames[link].to_world(self.shapes[link].position(point)))

    def _joint(self, group: Sequence[Pair]) -> Joint:
        pair = group[0]
        if isinstance(pair, TurningPair):
            links = (pair.links[0], *(item.links[1] for item in group))
            return PinJoint(pair.entry_name(), links, self._world(pair.links[0], pair.points[0]))
        if isinstance(pair, SlidingPair | SlotPair):
            guide, rider = pair.links
            frame, shape = self.frames[guide], self.shapes[guide]
            angle = degrees(frame.angle + pair.line.direction_angle(shape))
            x, y, *_ = pair.line.measure_line(shape)
            through = self._place(frame.to_world(Vector(x, y)))
            kind = SlideJoint if isinstance(pair, SlidingPair) else SlotJoint
            return kind(pair.name, guide, rider, self._world(rider, pair.point), _plain(angle), through)
        for known, kind_name in WHEELS.items():
            if isinstance(pair, known):
                sizes = pair.sizes
                if pair.size_kind == "radii":
                    sizes = tuple(float(self.unit.from_si(item)) for item in sizes)
                crossed = bool(getattr(pair, "crossed", False))
                return WheelJoint(pair.name, kind_name, pair.links, pair.carrier, pair.size_kind, sizes, crossed)
        if isinstance(pair, RackPair):
            return self._rack(pair)
        raise cannot_say(self.title, f"the {pair.keyword} {pair.name!r}")

    def _rack(self, pair: RackPair) -> RackJoint:
        rack, pinion = pair.links
        angle = degrees(self.frames[rack].angle + pair.line.direction_angle(self.shapes[rack]))
        radius, teeth = float(self.unit.from_si(pair.radius)), int(pair.pinion_teeth or 0)
        return RackJoint(pair.name, rack, pinion, self._world(pinion, pair.point), _plain(angle), radius, teeth)

    def _tracers(self, joints: Sequence[Joint]) -> list[Tracer]:
        """Points of links where nothing is joined, by the names that results give them."""
        ridden = {ride[0] for pair in self.mechanism.pairs if (ride := pair.point_on_line())}
        result = []
        for item in named_points(self.mechanism):
            link, point = item.members[0]
            pinned = any((link, point) in pair.coincident_points() for pair in self.mechanism.pairs)
            if not pinned and (link, point) not in ridden:
                result.append(Tracer(item.name.replace(".", "_"), link, self._world(link, point)))
        taken = {joint.name for joint in joints}
        return [item._replace(name=f"{item.name}_point") if item.name in taken else item for item in result]

    def _inputs(self) -> list[DrawnInput]:
        motions = relative_motions(self.mechanism)
        result = []
        for given in self.mechanism.inputs:
            pair = motions[given.pair]
            links = self._motion_links(pair)
            if pair.input_kind is MeasureKind.TURNS:
                raise cannot_say(self.title, f"the input at {given.pair!r}", "its inputs are at pins and slides")
            length = pair.input_kind is MeasureKind.LENGTH
            velocity = float(self.unit.from_si(given.velocity)) if length else float(given.velocity)
            result.append(DrawnInput(pair.entry_name(), links, velocity))
        return result

    def _motion_links(self, pair: Pair) -> tuple[str, str]:
        """The links of a relative motion, so that it is the motion of the second against the first."""
        first, second = pair.links
        return (second, first) if second == self.mechanism.frame and isinstance(pair, TurningPair) else (first, second)

    def _stops(self, joints: Sequence[Joint]) -> list[DrawnStop]:
        """The stops of pins, slides and pins in slots, measured from the positions as drawn."""
        motions = relative_motions(self.mechanism)
        by_name = {joint.name: joint for joint in joints}
        stops = []
        for stop in self.mechanism.stops:
            pair = motions[stop.pair]
            joint = by_name.get(pair.entry_name())
            if not isinstance(joint, PinJoint | SlideJoint | SlotJoint):
                continue
            limits = (stop.low, stop.high)
            if isinstance(joint, PinJoint):
                low, high = _angle_limits(float(pair.input_position_at(self.shapes, self.frames, {})), *limits)
            else:
                position = position_on_line(joint)
                low, high = (None if value is None else float(self.unit.from_si(value)) - position for value in limits)
            low, high = None if low is None else min(low, 0.0), None if high is None else max(high, 0.0)
            low, high = (
                0.0 if value is not None and -STOP_TOLERANCE < value < STOP_TOLERANCE else value
                for value in (low, high)
            )
            stops.append(DrawnStop(joint.name, self._motion_links(pair), low, high, stop.restitution))
        return stops

    def _masses(self) -> list[DrawnMass]:
        result = []
        for item in self.mechanism.masses:
            at = self._place(self.frames[item.link].to_world(self.shapes[item.link].position(item.at)))
            result.append(DrawnMass(item.link, float(item.mass), at, float(item.inertia)))
        return result

    def _forces(self) -> list[DrawnForce]:
        named = {item.name: item.members[0] for item in named_points(self.mechanism)}
        result = []
        for load in self.mechanism.loads:
            if load.point is None or load.force is None or load.varies is not None:
                continue
            link, _, point = load.point.rpartition(".")
            member = (link, point) if link else named.get(load.point)
            if member is None or load.axes not in (None, self.mechanism.frame, member[0]):
                continue
            force = Vector(*load.force)
            turned = self.frames[load.axes].rotate_to_world(force) if load.axes else force
            result.append(
                DrawnForce(member[0], self._world(*member), (float(turned.x), float(turned.y)), bool(load.axes))
            )
        return result

    def _notes(self, joints: Sequence[Joint]) -> list[str]:
        """What of the mechanism no drawn linkage says."""
        mechanism = self.mechanism
        held = {
            "springs and dampers": bool(mechanism.springs),
            "stops of pairs that are no pins, slides or slots": len(self._stops(joints)) < len(mechanism.stops),
            "friction": any(pair.has_friction for pair in mechanism.pairs),
            "laws of inputs": any(given.law for given in mechanism.inputs),
            "motors": any(given.motor for given in mechanism.inputs),
            "accelerations of inputs": any(given.acceleration and not given.law for given in mechanism.inputs),
            "tolerances": mechanism.tolerances is not None,
            "stiffness of pairs": bool(mechanism.pair_stiffness),
            "published values": bool(mechanism.published),
            "torques, and loads that vary": len(self._forces()) < len(mechanism.loads),
        }
        return [f"{what} are left out: the format has none" for what, there in held.items() if there]


def _angle_limits(position: float, low: float | None, high: float | None) -> tuple[float | None, float | None]:
    """The distances of stops (rad) from a position, taken whole turns off so that it lies between them."""
    if low is not None:
        turns = floor((position - low + STOP_TOLERANCE) / (2.0 * pi))
    else:
        turns = ceil((position - (high or 0.0) - STOP_TOLERANCE) / (2.0 * pi))
    position -= 2.0 * pi * turns
    return None if low is None else low - position, None if high is None else high - position


def _plain(angle: float) -> float:
    """An angle (degrees) between -180 and 180, without the last digits of a sum of radians."""
    turned = (angle + 180.0) % 360.0 - 180.0
    near = round(turned * 2.0) / 2.0
    return near if abs(turned - near) < 1e-12 else turned
