"""A linkage as a file of the program Linkage."""

from __future__ import annotations

from collections.abc import Iterator
from math import atan2, cos, degrees, hypot, pi, radians, sin
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from planar.formats.drawn.blocks import near, slots_for_blocks
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    DrawnStop,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    WheelJoint,
    curved_slot_notes,
    joined_links,
    joint_phrase,
    lost_stop_notes,
)
from planar.formats.drawn.file_format import WrittenText, cannot_say
from planar.formats.drawn.wheels import wheel_centre, wheel_ratio
from planar.formats.texts.names import NameBook

TITLE = "Linkage (Rector)"
PIXELS_PER_MILLIMETRE = 96.0 / 25.4
"""Coordinates are pixels of 1/96 inch: 18.897638 of them are the 5 mm of a drawing's grid."""
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}
ON_LINE = 1e-9
"""Of the drawing's size: how far the pins of a cylinder may lie beside its line."""
BEFORE_END = 1e-12
"""Of a stroke: an input that stands at its end is written this far before it, so that it does not turn back."""


class Cylinder(NamedTuple):
    """A driven slide as an actuator: the link of its body and that of its rod, and the pins at their ends."""

    body: str
    rod: str
    mount: PinJoint
    end: PinJoint


class WrittenArcSlot(NamedTuple):
    """A curved slot of at most a half circle: its link, its carrier, its radius, its ends anticlockwise, its stop."""

    link: str
    carrier: str
    radius: float
    ends: tuple[Place, Place]
    stop: DrawnStop


def write(linkage: DrawnLinkage) -> WrittenText:
    """The file, its lengths in pixels. Raises BadInput for what it cannot say."""
    return _Writer(slots_for_blocks(linkage.without_frame_points())).write()


class _Writer:
    """One linkage on its way into a file."""

    def __init__(self, linkage: DrawnLinkage) -> None:
        self.linkage = linkage
        self.scale = MILLIMETRES[linkage.length] * PIXELS_PER_MILLIMETRE
        self.connectors: list[str] = []
        self.at: list[Place] = []
        self.members: dict[str, list[int]] = {}
        self.gears: list[WheelJoint] = []
        self.actuators: dict[str, str] = {}
        "the attributes of links that are actuators"
        self.written_stops: list[DrawnStop] = []
        self.notes: list[str] = []
        places = [item.at for item in (*linkage.joints, *linkage.tracers) if not isinstance(item, WheelJoint)]
        self.reach = max((hypot(x - places[0][0], y - places[0][1]) for x, y in places), default=1.0) or 1.0

    def write(self) -> WrittenText:
        linkage = self.linkage
        inputs = {item.joint: item for item in linkage.inputs}
        cylinders: list[tuple[SlideJoint, Cylinder]] = []
        slots = dict(self._curved_slots())
        centres = {slot.stop.joint for slot in slots.values()}
        for joint in linkage.joints:
            if isinstance(joint, PinJoint) and joint.name in slots:
                self._write_curved_slot(joint, slots[joint.name])
            elif joint.name in centres:
                continue
            elif isinstance(joint, PinJoint):
                self._pin(joint, [item for item in linkage.inputs if item.joint == joint.name])
            elif isinstance(joint, SlideJoint | SlotJoint):
                cylinder = self._cylinder(joint) if joint.name in inputs else None
                if cylinder is not None and isinstance(joint, SlideJoint):
                    cylinders.append((joint, cylinder))
                    continue
                number = self._slide(joint)
                if joint.name in inputs:
                    self._drive(joint, inputs[joint.name], number)
            elif isinstance(joint, WheelJoint):
                self.gears.append(joint)
            else:
                raise cannot_say(TITLE, joint_phrase(joint))
        for tracer in linkage.tracers:
            self._connector(tracer.name, tracer.at, [tracer.link], 'draw="true"')
        for slide, cylinder in cylinders:
            self._write_cylinder(slide, cylinder, inputs[slide.name])
        ids = {link: number for number, link in enumerate(self.members)}
        ratios = [self._ratio(item, ids) for item in self.gears]
        wheels = {wheel for item in self.gears for wheel in item.wheels}
        lines = ["<linkage2>", '\t<program zoom="1" units="Millimeters"/>', *self.connectors]
        for link, numbers in self.members.items():
            gear = ' gear="true"' if link in wheels else ""
            kind = gear + self.actuators.get(link, "")
            lines.append(f'\t<Link id="{ids[link]}" name={quoteattr(link)} layer="16" linesize="1" solid="true"{kind}>')
            lines += [f'\t\t<connector id="{number}"/>' for number in numbers] + ["\t</Link>"]
        lines += ["\t<ratios>", *ratios, "\t</ratios>"] if ratios else []
        lines.append("</linkage2>")
        lost_slots = curved_slot_notes(linkage, [slot.link for slot in slots.values()])
        notes = (*linkage.notes, *lost_stop_notes(linkage, self.written_stops), *lost_slots, *self.notes)
        return WrittenText("\n".join(lines) + "\n", notes, says_stops=True, says_curved_slots=True)

    def _connector(self, name: str, at: Place, links: list[str], more: str = "", inside: tuple[int, ...] = ()) -> int:
        number = len(self.connectors)
        self.at.append(at)
        x, y = at[0] * self.scale, at[1] * self.scale
        head = f'\t<connector id="{number}" name={quoteattr(name)} layer="16" x="{x!r}" y="{y!r}"'
        head += f" {more}" if more else ""
        limits = "".join(f'<slidelimit id="{item}"/>' for item in inside)
        self.connectors.append(f"{head}>{limits}</connector>" if limits else f"{head}/>")
        for link in links:
            if link != self.linkage.frame:
                self.members.setdefault(link, []).append(number)
        return number

    def _pin(self, joint: PinJoint, driven: list[DrawnInput]) -> None:
        """A connector, or at an input one for each link that is driven and one for the rest: inputs turn all of one."""
        frame, rest = self.linkage.frame, list(joint.links)
        anchor = 'anchor="true"' if frame in joint.links else ""
        for number, given in enumerate(driven):
            if frame not in given.links:
                message = f"the input of {given.links[1]!r} against {given.links[0]!r}"
                raise cannot_say(TITLE, message, "its inputs turn a link on the frame")
            other = next(item for item in given.links if item != frame)
            rate = given.velocity * 30.0 / pi * (-1.0 if given.links[1] == other else 1.0)
            name = f"{joint.name}_{number}" if number else joint.name
            swing = self._swing(given, other)
            self._connector(name, joint.at, [other], f'anchor="true" input="true" rpm="{rate!r}"{swing}')
            rest.remove(other)
        if not driven:
            self._connector(joint.name, joint.at, rest, anchor)
        elif set(rest) - {frame}:
            self._connector(f"{joint.name}_fixed", joint.at, rest, anchor)

    def _curved_slots(self) -> Iterator[tuple[str, WrittenArcSlot]]:
        """The curved slots that the format says, by the pins in them: between two stops, of at most a half circle."""
        pins = [joint for joint in self.linkage.joints if isinstance(joint, PinJoint)]
        driven = {item.joint for item in self.linkage.inputs}
        in_slots: set[str] = set()
        for link in self.linkage.curved_slots:
            centre, pin = (joint for joint in pins if link in joint.links)
            stop = next((item for item in self.linkage.stops if item.joint == centre.name), None)
            if stop is None or stop.low is None or stop.high is None or {centre.name, pin.name} & (driven | in_slots):
                continue
            (x, y), (u, v) = centre.at, pin.at
            drawn, radius = atan2(v - y, u - x), hypot(u - x, v - y)
            low, high = (stop.low, stop.high) if stop.links[1] == link else (-stop.high, -stop.low)
            if not 0.0 < high - low <= pi * (1.0 + ON_LINE):
                continue
            first, last = ((x + radius * cos(drawn + turn), y + radius * sin(drawn + turn)) for turn in (low, high))
            carrier = next(name for name in centre.links if name != link)
            in_slots.add(pin.name)
            yield pin.name, WrittenArcSlot(link, carrier, radius, (first, last), stop)

    def _write_curved_slot(self, joint: PinJoint, slot: WrittenArcSlot) -> None:
        """A connector in the curved slot between two connectors of its carrier."""
        frame = self.linkage.frame
        anchor = 'anchor="true"' if slot.carrier == frame else ""
        limits = tuple(self._connector(f"{joint.name}_end", at, [slot.carrier], anchor) for at in slot.ends)
        more = f'slider="true" slideradius="{slot.radius * self.scale!r}"'
        riders = [link for link in joint.links if link != slot.link]
        self._connector(joint.name, joint.at, riders, more + (' anchor="true"' if frame in riders else ""), limits)
        self.written_stops.append(slot.stop)

    def _swing(self, drive: DrawnInput, link: str) -> str:
        """The attributes of an input that turns its link to and fro between two stops; none where it has none."""
        stop = next(
            (s for s in self.linkage.stops if s.joint == drive.joint and set(s.links) == set(drive.links)), None
        )
        if stop is None or stop.low is None or stop.high is None:
            return ""
        self.written_stops.append(stop)
        is_forward = drive.links[1] == link
        rate = drive.velocity if is_forward else -drive.velocity
        low, high = (stop.low, stop.high) if stop.links[1] == link else (-stop.high, -stop.low)
        limit = high - low
        begun = min(-low if rate >= 0.0 else high, limit * (1.0 - BEFORE_END))
        return f' limitangle="{degrees(limit)!r}" startoffset="{degrees(begun)!r}"'

    def _stop(self, joint: SlideJoint | SlotJoint) -> DrawnStop | None:
        return next((item for item in self.linkage.stops if item.joint == joint.name), None)

    def _cylinder(self, joint: SlideJoint | SlotJoint) -> Cylinder | None:
        """A driven slide between two pins on its line, of which one is alone on its link."""
        if isinstance(joint, SlotJoint) or self.linkage.frame in joined_links(joint):
            return None
        for body, rod in ((joint.guide, joint.slider), (joint.slider, joint.guide)):
            joints_of_rod = [item for item in self.linkage.joints if rod in joined_links(item) and item != joint]
            if len(joints_of_rod) != 1 or rod in {item.link for item in self.linkage.tracers}:
                continue
            end = joints_of_rod[0]
            if not isinstance(end, PinJoint) or not self._on_line(end.at, joint):
                continue
            pins = [item for item in self.linkage.joints if isinstance(item, PinJoint) and body in item.links]
            on_line = (pin for pin in pins if self._on_line(pin.at, joint) and not near(pin.at, end.at))
            mount = next(on_line, None)
            if mount is not None:
                return Cylinder(body, rod, mount, end)
        return None

    def _on_line(self, at: Place, joint: SlideJoint) -> bool:
        x, y = at[0] - joint.at[0], at[1] - joint.at[1]
        return abs(cos(radians(joint.angle)) * y - sin(radians(joint.angle)) * x) <= ON_LINE * self.reach

    def _write_cylinder(self, slide: SlideJoint, cylinder: Cylinder, drive: DrawnInput) -> None:
        """An actuator from the pin of the body to that of the rod; the rod is no Link of its own."""
        body, rod, mount, end = cylinder
        (x, y), (u, v) = mount.at, end.at
        advance = (u - x) * cos(radians(slide.angle)) + (v - y) * sin(radians(slide.angle))
        is_outward = (advance > 0.0) == (body == slide.guide)
        first = next(number for number in self.members[body] if near(self.at[number], mount.at))
        (second,) = self.members.pop(rod)
        self.members[body] = [first, second, *(item for item in self.members[body] if item != first)]
        self.actuators[body] = self._strokes(slide, drive, hypot(u - x, v - y), is_outward)
        self.notes.append(f"the link {rod!r} is the rod of the actuator {body!r}, which has no name there")

    def _drive(self, joint: SlideJoint | SlotJoint, drive: DrawnInput, rider: int) -> None:
        """An actuator beside a slide, from a connector of its guide behind the slide's to that."""
        stop = self._stop(joint)
        begun = -stop.low if stop is not None and stop.low is not None else 0.0
        length = begun + self.reach
        (x, y), angle = joint.at, radians(joint.angle)
        anchor = 'anchor="true"' if joint.guide == self.linkage.frame else ""
        place = (x - length * cos(angle), y - length * sin(angle))
        mount = self._connector(f"{joint.name}_mount", place, [joint.guide], anchor)
        name = NameBook((*self.members, *self.linkage.links)).fresh(f"{joint.name}_drive")
        self.members[name] = [mount, rider]
        self.actuators[name] = self._strokes(joint, drive, length, True)

    def _strokes(self, joint: SlideJoint | SlotJoint, drive: DrawnInput, length: float, is_outward: bool) -> str:
        """The attributes of an actuator of this length: its stroke, where in it it is, and its strokes in a minute."""
        stop = self._stop(joint)
        rider = joined_links(joint)[1]
        velocity = drive.velocity if drive.links[1] == rider else -drive.velocity
        low, high = (None, None) if stop is None else (stop.low, stop.high)
        if not is_outward:
            velocity, low, high = -velocity, None if high is None else -high, None if low is None else -low
        if stop is not None and low is not None and high is not None:
            self.written_stops.append(stop)
        else:
            low, high = -length / 2.0 if low is None else low, length / 2.0 if high is None else high
            stroke = f"{high - low:.6g} {self.linkage.length}"
            self.notes.append(f"the input at {joint.name!r} has no two stops; its actuator has a stroke of {stroke}")
        throw, begun = high - low, min(-low, (high - low) * (1.0 - BEFORE_END))
        cycles = 30.0 * velocity / throw
        size = f'throw="{throw * self.scale!r}" cpm="{cycles!r}" startoffset="{begun * self.scale!r}"'
        return f' actuator="true" {size}'

    def _slide(self, joint: SlideJoint | SlotJoint) -> int:
        """A connector in the slot between two of its guide; two of them, where the link must not turn."""
        rider = joint.slider if isinstance(joint, SlideJoint) else joint.rider
        (x, y), way = joint.at, (cos(radians(joint.angle)), sin(radians(joint.angle)))
        anchor = 'anchor="true"' if joint.guide == self.linkage.frame else ""
        low, high = self._slot_range(joint)
        more = 'slider="true"' + (' anchor="true"' if rider == self.linkage.frame else "")
        if rider == self.linkage.frame and isinstance(joint, SlideJoint):
            raise cannot_say(TITLE, f"the slide {joint.name!r} of a moving link on the frame")

        def in_slot(name: str, offset: float) -> int:
            places = ((x + s * way[0], y + s * way[1]) for s in (offset + low, offset + high))
            limits = tuple(self._connector(f"{name}_end", at, [joint.guide], anchor) for at in places)
            return self._connector(name, (x + offset * way[0], y + offset * way[1]), [rider], more, limits)

        number = in_slot(joint.name, 0.0)
        if isinstance(joint, SlideJoint):
            in_slot(f"{joint.name}_guided", 0.25 * self.reach)
        return number

    def _slot_range(self, joint: SlideJoint | SlotJoint) -> tuple[float, float]:
        """How far the ends of a slot lie from its pin: at the stops, else beyond the rest of the mechanism."""
        stop = self._stop(joint)
        low, high = (None, None) if stop is None else (stop.low, stop.high)
        ends = (-1.5 * self.reach if low is None else low, 1.5 * self.reach if high is None else high)
        if stop is not None and low is not None and high is not None:
            self.written_stops.append(stop)
        else:
            length = f"{ends[0]:.6g} and {ends[1]:.6g} {self.linkage.length}"
            self.notes.append(f"the slot of {joint.name!r} has no two stops; it ends {length} from its drawn position")
        return ends

    def _ratio(self, joint: WheelJoint, ids: dict[str, int]) -> str:
        what = f"the {joint.kind} {joint.name!r}"
        ratio, gears = wheel_ratio(joint), joint.kind == "gear"
        if self.linkage.frame in joint.wheels or not all(wheel in ids for wheel in joint.wheels):
            raise cannot_say(TITLE, what, "one of its wheels stands still")
        if gears == (ratio > 0.0):
            raise cannot_say(TITLE, what, "its gears are external ones, its chains are not crossed")
        centres = [wheel_centre(self.linkage.joints, wheel, joint.carrier) for wheel in joint.wheels]
        if centres[0] is None or centres[1] is None or near(centres[0], centres[1]):
            raise cannot_say(TITLE, what, "its wheels have no two pins on a common link")
        for wheel, centre in zip(joint.wheels, centres, strict=True):  # a wheel turns about its first connector
            self.members[wheel].sort(key=lambda number: self.at[number] != centre)
        turning = {self.members[wheel][0] for wheel in joint.wheels}
        if joint.carrier != self.linkage.frame and not turning <= set(self.members.get(joint.carrier, [])):
            raise cannot_say(TITLE, what, "an input turns its carrier about a connector of its own")
        first, second = ids[joint.wheels[0]], ids[joint.wheels[1]]
        kind = "gears" if gears else "chain"
        return (
            f'\t\t<ratio type="{kind}" sizeassize="false"><link id="{first}" size="{abs(ratio)!r}"/>'
            f'<link id="{second}" size="1"/></ratio>'
        )
