"""A linkage as most programs save one: a list of joints where they were drawn, each with the links that it joins."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass, field, replace
from math import cos, degrees, radians, sin
from typing import NamedTuple

from planar.foundation.errors import join_names

AT_END = 1e-6
"""Of a slot's length, or rad of a curved one: a pin this far beyond the end of its slot is at that end."""
Place = tuple[float, float]
"""x and y in the drawing, in the linkage's unit of length; y upwards."""


class PinJoint(NamedTuple):
    """Links that turn about one point."""

    name: str
    links: tuple[str, ...]
    at: Place


class SlideJoint(NamedTuple):
    """A link that slides along a line of another without turning against it.

    `angle` is the line's direction in the drawing (degrees); how far the slider is counts from `through`, from where it
    was drawn if that is None.
    """

    name: str
    guide: str
    slider: str
    at: Place
    angle: float
    through: Place | None = None


class SlotJoint(NamedTuple):
    """A pin of the link `rider` in a straight slot of the link `guide`, which leaves the turning free; as a slide."""

    name: str
    guide: str
    rider: str
    at: Place
    angle: float
    through: Place | None = None


class WheelJoint(NamedTuple):
    """Two wheels tied to each other, seen from the carrier on which both turn; as drawn they are in mesh.

    `kind` is one of "gear", "belt" and "chain"; `size_kind` says what `sizes` are: two "radii" (an internal wheel's is
    negative) or numbers of "teeth", or one signed "ratio".
    """

    name: str
    kind: str
    wheels: tuple[str, str]
    carrier: str
    size_kind: str
    sizes: tuple[float, ...]
    crossed: bool = False

    @property
    def meshes(self) -> bool:
        """Whether the wheels touch with their teeth."""
        return self.kind == "gear"


class RackJoint(NamedTuple):
    """A pinion that rolls on the pitch line of a rack; as drawn they are in mesh.

    `at` is the pinion's centre, `angle` the line's direction in the drawing (degrees), `radius` the pitch radius,
    positive where the centre lies to the left of the line. `teeth` are the pinion's, 0 where they are not said.
    """

    name: str
    rack: str
    pinion: str
    at: Place
    angle: float
    radius: float
    teeth: int = 0

    @property
    def contact(self) -> Place:
        """Where the pitch circle touches the pitch line."""
        way = radians(self.angle)
        return self.at[0] + self.radius * sin(way), self.at[1] - self.radius * cos(way)


Joint = PinJoint | SlideJoint | SlotJoint | WheelJoint | RackJoint


class Tracer(NamedTuple):
    """A point of a link where nothing is joined."""

    name: str
    link: str
    at: Place


class DrawnInput(NamedTuple):
    """A driven joint: at a pin the second of `links` against the first, at a slide along its line.

    `velocity` is in `unit` where one is named, else in rad/s or the unit of length per second.
    """

    joint: str
    links: tuple[str, str]
    velocity: float = 0.0
    unit: str = ""
    table: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    """Times (s), and how far the input has moved by then, smoothly (rad, or the unit of length)."""


class DrawnStop(NamedTuple):
    """Between which positions a joint moves: at a pin the second of `links` against the first, at a slide its slider.

    `low` and `high` are distances from the position as drawn (rad, or the unit of length), None where there is no stop;
    the drawn position lies between them.
    """

    joint: str
    links: tuple[str, str]
    low: float | None
    high: float | None
    restitution: float = 0.0


class DrawnMass(NamedTuple):
    """A mass of a link (kg) about a place of the drawing, with its moment of inertia there (kg m^2)."""

    link: str
    mass: float
    at: Place
    inertia: float = 0.0


class DrawnForce(NamedTuple):
    """A force (N) on a link at a place of the drawing; it may turn with the link."""

    link: str
    at: Place
    force: Place
    turns: bool = False


@dataclass(frozen=True)
class DrawnLinkage:
    """Joints in drawn, assembled coordinates; no assembly has to be searched.

    `length` is the unit of its coordinates; `notes` tell what could not be taken over.
    """

    title: str
    frame: str
    joints: tuple[Joint, ...]
    tracers: tuple[Tracer, ...] = ()
    inputs: tuple[DrawnInput, ...] = ()
    masses: tuple[DrawnMass, ...] = ()
    forces: tuple[DrawnForce, ...] = ()
    stops: tuple[DrawnStop, ...] = ()
    gravity: Place = (0.0, 0.0)
    length: str = "mm"
    links: tuple[str, ...] = ()
    """In the order in which they are to stand; those that no joint holds are left out."""
    curved_slots: tuple[str, ...] = ()
    """Links that stand for curved slots: their first pin is the centre, their second the pin in the slot."""
    notes: tuple[str, ...] = field(default=())

    def with_notes(self, *notes: str) -> DrawnLinkage:
        """The same linkage with more to say of it."""
        return replace(self, notes=(*self.notes, *notes))

    def without_frame_points(self) -> DrawnLinkage:
        """The same without the frame's points where nothing is joined, and a note of them."""
        result = [item.name for item in self.tracers if item.link == self.frame]
        if not result:
            return self
        kept = tuple(item for item in self.tracers if item.link != self.frame)
        message = f"points of the frame where nothing is joined are left out: {join_names(result)}"
        return replace(self, tracers=kept).with_notes(message)

    def joints_of(self, kind: type[Joint]) -> tuple[Joint, ...]:
        """Its joints of one kind."""
        return tuple(item for item in self.joints if isinstance(item, kind))


def joined_links(joint: Joint) -> tuple[str, ...]:
    """The links that a joint holds, the carrier of wheels among them."""
    if isinstance(joint, PinJoint):
        return joint.links
    if isinstance(joint, SlideJoint):
        return joint.guide, joint.slider
    if isinstance(joint, SlotJoint):
        return joint.guide, joint.rider
    if isinstance(joint, RackJoint):
        return joint.rack, joint.pinion
    return (*joint.wheels, joint.carrier)


def position_on_line(joint: SlideJoint | SlotJoint) -> float:
    """The position of a slide or of a pin in a slot as drawn: its distance from `through` along the line."""
    if joint.through is None:
        return 0.0
    x, y = joint.at[0] - joint.through[0], joint.at[1] - joint.through[1]
    return x * cos(radians(joint.angle)) + y * sin(radians(joint.angle))


def slot_end_stop(slot: SlotJoint, length: float, unit: str) -> tuple[list[DrawnStop], list[str]]:
    """The stops at the ends of a slot that begins at its point `through`, or a note where its pin lies beyond them."""
    position = position_on_line(slot)
    if -AT_END * length <= position <= (1.0 + AT_END) * length:
        return [DrawnStop(slot.name, (slot.guide, slot.rider), min(-position, 0.0), max(length - position, 0.0))], []
    beyond = max(-position, position - length)
    place = f"its pin was drawn {beyond:.6g} {unit} beyond its end"
    return [], [f"the slot of {slot.name!r} is {length:.6g} {unit} long, but {place}: it has no stops here"]


def stop_phrase(stop: DrawnStop, joint: Joint, length: str) -> str:
    """A stop in a note, measured from the position as drawn: "the stops of the slide 'C' (-5 to 20 mm as drawn)"."""
    angle = isinstance(joint, PinJoint)
    limits = (None if value is None else degrees(value) if angle else value for value in (stop.low, stop.high))
    low, high = ("open" if value is None else f"{value:.6g}" for value in limits)
    return f"the stops of {joint_phrase(joint)}, {low} to {high} {'deg' if angle else length} from its drawn position,"


def lost_stop_notes(linkage: DrawnLinkage, written: Container[DrawnStop] = ()) -> list[str]:
    """The notes of the stops that a format does not say, and of the restitution of those that it says."""
    joints = {joint.name: joint for joint in linkage.joints}
    notes = []
    for stop in linkage.stops:
        phrase = stop_phrase(stop, joints[stop.joint], linkage.length)
        if stop not in written:
            notes.append(f"{phrase} are left out: the format has none there")
        elif stop.restitution:
            notes.append(f"{phrase} lose their restitution of {stop.restitution:g}: the format has none")
    return notes


def curved_slot_notes(linkage: DrawnLinkage, written: Container[str] = ()) -> list[str]:
    """The notes of the curved slots that a format does not say."""
    lost = [link for link in linkage.curved_slots if link not in written]
    return [f"the curved slot {link!r} is written as a link from its centre to its pin" for link in lost]


def unit_note(length: str) -> str:
    """The note of a file that names no unit of length."""
    return f"the file names no unit of length; its numbers are taken as {length}"


def joint_phrase(joint: Joint) -> str:
    """The joint in a sentence: "the gear 'mesh'"."""
    if isinstance(joint, WheelJoint):
        return f"the {joint.kind} {joint.name!r}"
    kinds = {PinJoint: "pin", SlideJoint: "slide", SlotJoint: "slot", RackJoint: "rack"}
    return f"the {kinds[type(joint)]} {joint.name!r}"


def renamed_links(joint: Joint, names: dict[str, str]) -> Joint:
    """The joint with other names for its links; of a pin each stands once."""

    def name(link: str) -> str:
        return names.get(link, link)

    if isinstance(joint, PinJoint):
        return joint._replace(links=tuple(dict.fromkeys(map(name, joint.links))))
    if isinstance(joint, SlideJoint):
        return joint._replace(guide=name(joint.guide), slider=name(joint.slider))
    if isinstance(joint, SlotJoint):
        return joint._replace(guide=name(joint.guide), rider=name(joint.rider))
    if isinstance(joint, RackJoint):
        return joint._replace(rack=name(joint.rack), pinion=name(joint.pinion))
    first, second = joint.wheels
    return joint._replace(wheels=(name(first), name(second)), carrier=name(joint.carrier))
