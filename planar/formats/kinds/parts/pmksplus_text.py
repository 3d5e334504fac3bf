"""A linkage as a link of PMKS+."""

from __future__ import annotations

import re
from math import cos, dist, hypot, pi, radians, sin
from typing import NamedTuple

from planar.formats.drawn.blocks import slots_for_blocks
from planar.formats.drawn.drawn_linkage import (
    DrawnLinkage,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    joined_links,
    joint_phrase,
    lost_stop_notes,
)
from planar.formats.drawn.file_format import WrittenText, cannot_say
from planar.formats.kinds.parts.pmksplus_code import (
    DEFAULT_LINEAR_SPEED,
    DRIVEN,
    GROUNDED,
    PRISMATIC,
    SEALED,
    WELDED,
    CodedLink,
    encode_decimal,
    encode_integer,
    put_together,
)
from planar.formats.texts.names import NameBook

TITLE = "PMKS+ (link)"
ADDRESS = "https://app.pmksplus.com/?"
CENTIMETRES = {"mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}
TRACED = 16
"""The bit of a joint whose path is drawn."""
REACH = 100.0
"""Of a slot's direction, by two joints so far apart (cm): rounding turns it by 1e-5 at most."""

RADIUS, CLEARANCE, HEAD_MIN, HEAD_MAX = 0.15, 1.4, 1.525, 3.84
"""Of a cylinder's drawing: the radius of a joint by the scale of the drawn parts; by this radius, how far the head
stays from the barrel's mount, and half its length."""
ROUNDING = 2e-3
"""Places (cm) that the link's rounding does not tell apart."""
ON_LINE = 1e-6
"""Of a cylinder's length: how far its mounts may lie beside its line."""


class Cylinder(NamedTuple):
    """A slide that can be written as a hydraulic cylinder: the pins at its mounts, its stroke, its shortest length."""

    mount: PinJoint
    end: PinJoint
    stroke: float
    retracted: float


def cylinder_travel(barrel: float, scale: float) -> tuple[float, float]:
    """Between which distances from the barrel's mount the rod's inner end slides, by the scale of the drawn parts.

    The head stays clear of the mount, and comes out of the barrel at most by its own length (`cylinder.ts` of PMKS+).
    """
    radius = RADIUS * scale
    head = max(HEAD_MIN * radius, min(HEAD_MAX * radius, barrel / 2.0))
    return CLEARANCE * radius + head, max(barrel, CLEARANCE * radius) + head


def write(linkage: DrawnLinkage) -> WrittenText:
    """The link, its lengths in cm. Raises BadInput for what it cannot say."""
    if len(linkage.inputs) > 1:
        raise cannot_say(TITLE, f"the input at {linkage.inputs[1].joint!r}", "it has one input alone")
    return _Writer(slots_for_blocks(linkage.without_frame_points())).write()


class _Writer:
    """One linkage on its way into a link."""

    def __init__(self, linkage: DrawnLinkage) -> None:
        self.linkage = linkage
        self.scale = CENTIMETRES[linkage.length]
        self.book = NameBook()
        self.joints: list[list[str]] = []
        self.places: dict[str, Place] = {}
        self.members: dict[str, list[str]] = {}
        self.blocks: list[tuple[str, str]] = []
        self.driven = linkage.inputs[0].joint if linkage.inputs else None
        self.keys: dict[str, str] = {}
        slides = [item for item in linkage.joints if isinstance(item, SlideJoint)]
        self.cylinders = {slide.name: result for slide in slides if (result := self._cylinder(slide)) is not None}
        self.bars = {link for slide in slides if slide.name in self.cylinders for link in joined_links(slide)}
        "the barrels and rods of cylinders"
        spare = [(item.retracted - item.stroke) * self.scale for item in self.cylinders.values()]
        drawn_size = 2.0 * RADIUS * (CLEARANCE + HEAD_MAX)
        self.object_scale = max(min([1.0, *(item / drawn_size for item in spare)]), 1e-3)

    def write(self) -> WrittenText:
        linkage = self.linkage
        for joint in linkage.joints:
            if isinstance(joint, PinJoint):
                self._pin(joint)
        for tracer in linkage.tracers:
            if tracer.link in self.bars:
                continue
            self._joint(tracer.name, tracer.at, 0, [tracer.link])
        for joint in linkage.joints:
            if isinstance(joint, SlideJoint | SlotJoint):
                self._slide(joint)
            elif not isinstance(joint, PinJoint):
                raise cannot_say(TITLE, joint_phrase(joint))
        text = ADDRESS + put_together(self._coded()) + "\n"
        return WrittenText(text, tuple(self._notes()), says_stops=True)

    def _name(self, wanted: str) -> str:
        return self.book.fresh(re.sub(r"[^A-Za-z0-9]+", "_", wanted), "J")

    def _joint(self, name: str, at: Place, flags: int, links: list[str], more: tuple[str, ...] = ()) -> str:
        key = self._name(name)
        x, y = (encode_decimal(item * self.scale) for item in at)
        fields = [encode_integer(flags) + key, key, x, y, *(more or ("0",))]
        self.joints.append(fields)
        self.places[key] = at
        for link in links:
            if link != self.linkage.frame:
                self.members.setdefault(link, []).append(key)
        return key

    def _pin(self, joint: PinJoint) -> None:
        grounded = GROUNDED if self.linkage.frame in joint.links else 0
        driven = 0
        if joint.name == self.driven:
            driven = DRIVEN
            if len(joint.links) > 2:
                raise cannot_say(TITLE, f"the input at the pin {joint.name!r} of {len(joint.links)} links")
            joint = joint._replace(links=self.linkage.inputs[0].links)
        self.keys[joint.name] = self._joint(joint.name, joint.at, TRACED + grounded + driven, list(joint.links))

    def _slide(self, joint: SlideJoint | SlotJoint) -> None:
        """A pin of what slides, and the slide in its guide; the pin is welded where it must not turn."""
        if joint.name in self.cylinders:
            self._write_cylinder(joint, self.cylinders[joint.name])
            return
        rider = joint.slider if isinstance(joint, SlideJoint) else joint.rider
        flags = TRACED + (GROUNDED if rider == self.linkage.frame else 0)
        flags += WELDED if isinstance(joint, SlideJoint) else 0
        key = self._joint(joint.name, joint.at, flags, [rider])
        driven = DRIVEN if joint.name == self.driven else 0
        if joint.guide == self.linkage.frame:
            angle = (radians(joint.angle) + pi) % (2.0 * pi) - pi
            rail = self._joint(f"{joint.name}r", joint.at, PRISMATIC + GROUNDED + driven, [], (encode_decimal(angle),))
        else:
            ends = self._slot_ends(joint)
            rail = self._joint(f"{joint.name}r", joint.at, PRISMATIC + driven, [], ("0", joint.guide, *ends))
        self.blocks.append((key, rail))

    def _cylinder(self, slide: SlideJoint) -> Cylinder | None:
        """The slide as a cylinder: two bars with one pin each, on the line of the slide, between two stops."""
        stop = next((item for item in self.linkage.stops if item.joint == slide.name), None)
        if stop is None or stop.low is None or stop.high is None or self.linkage.frame in joined_links(slide):
            return None
        pins = []
        for link in (slide.guide, slide.slider):
            joints_of_link = [item for item in self.linkage.joints if link in joined_links(item) and item != slide]
            if len(joints_of_link) != 1 or not isinstance(joints_of_link[0], PinJoint) or self._carries_loads(link):
                return None
            pins.append(joints_of_link[0])
        (x, y), (u, v) = pins[0].at, pins[1].at
        span = hypot(u - x, v - y)
        direction = cos(radians(slide.angle)), sin(radians(slide.angle))
        along, across = (u - x) * direction[0] + (v - y) * direction[1], direction[0] * (v - y) - direction[1] * (u - x)
        tracers = [tracer.at for tracer in self.linkage.tracers if tracer.link in joined_links(slide)]
        offsets = [direction[0] * (at[1] - y) - direction[1] * (at[0] - x) for at in (slide.at, *tracers)]
        if not span or max(abs(offset) for offset in (across, *offsets)) > ON_LINE * span:
            return None
        stroke, retracted = stop.high - stop.low, span + (stop.low if along > 0.0 else -stop.high)
        smallest = 2.0 * RADIUS * (CLEARANCE + HEAD_MAX) * 1e-3 / self.scale
        if not retracted - stroke > smallest:
            return None
        return Cylinder(pins[0], pins[1], stroke, retracted)

    def _carries_loads(self, link: str) -> bool:
        """Whether a link has masses or forces of its own."""
        masses = {mass.link for mass in self.linkage.masses}
        return link in masses or link in {force.link for force in self.linkage.forces}

    def _write_cylinder(self, slide: SlideJoint | SlotJoint, cylinder: Cylinder) -> None:
        """A barrel from its mount to its inner end, and a rod from the seal to its own mount."""
        (x, y), (u, v) = cylinder.mount.at, cylinder.end.at
        span = hypot(u - x, v - y)
        barrel = cylinder.stroke + CLEARANCE * RADIUS * self.object_scale / self.scale
        low, _ = cylinder_travel(barrel, self.object_scale / self.scale)

        def place(distance: float) -> Place:
            return x + distance * (u - x) / span, y + distance * (v - y) / span

        guide, rider = joined_links(slide)
        inner = self._joint(f"{slide.name}n", place(barrel), 0, [guide])
        seal = place(low + span - cylinder.retracted)
        pin = self._joint(slide.name, seal, WELDED, [rider])
        flags = PRISMATIC + SEALED + (DRIVEN if slide.name == self.driven else 0)
        slot = ("0", guide, self.keys[cylinder.mount.name], inner)
        self.blocks.append((pin, self._joint(f"{slide.name}r", seal, flags, [], slot)))

    def _slot_ends(self, joint: SlideJoint | SlotJoint) -> tuple[str, str]:
        """Two joints of the guide, far apart on the line of the slot."""
        x, y = joint.at
        u, v = (REACH / self.scale * f(radians(joint.angle)) for f in (cos, sin))
        ends = ((x - u, y - v), (x + u, y + v))
        first, second = (self._joint(f"{joint.name}s", at, 0, [joint.guide]) for at in ends)
        return first, second

    def _coded(self) -> CodedLink:
        ids = {link: self._name(link) for link in self.members}
        for fields in self.joints:
            if len(fields) > 5:
                fields[5] = ids[fields[5]]
        links = [
            [f"YR{ids[link]}", ids[link], "0", "0", "0", "0", "c5cae9", *joints, "", ""]
            for link, joints in self.members.items()
        ]
        links += [
            [f"YP{(key := self._name('block'))}", key, "0", "0", "0", "0", "", *two, "", ""] for two in self.blocks
        ]
        rate, speed = self._rpm(), self._linear_speed()
        flags = encode_integer(8 + 64 + (1 if rate < 0.0 or speed < 0.0 else 0)).rjust(2, "0")
        decimals = [encode_decimal(self.object_scale), *([encode_decimal(abs(speed))] if speed else [])]
        return CodedLink(flags, decimals, [encode_integer(abs(round(rate))), "0"], "1011", self.joints, links, [])

    def _drives_pin(self) -> bool:
        joint = next((item for item in self.linkage.joints if item.name == self.driven), None)
        return isinstance(joint, PinJoint)

    def _rpm(self) -> float:
        """The speed of a driven pin."""
        return self.linkage.inputs[0].velocity * 30.0 / pi if self._drives_pin() else 0.0

    def _linear_speed(self) -> float:
        """The speed of a driven slide (cm/s)."""
        if not self.linkage.inputs or self._drives_pin():
            return 0.0
        return self.linkage.inputs[0].velocity * self.scale

    def _lost_point_notes(self) -> list[str]:
        """The notes of points of barrels and rods where no joint of the cylinder lies."""
        return [
            f"the point {tracer.name!r} of {tracer.link!r} is left out: the bars of a cylinder have no further points"
            for tracer in self.linkage.tracers
            if tracer.link in self.bars
            and not any(dist(tracer.at, at) * self.scale <= ROUNDING for at in self.places.values())
        ]

    def _notes(self) -> list[str]:
        linkage, rate = self.linkage, self._rpm()
        written = [item for item in linkage.stops if item.joint in self.cylinders]
        result = [
            *linkage.notes,
            *lost_stop_notes(linkage, written),
            *self._lost_point_notes(),
            "lengths are rounded to a thousandth of a cm, angles of rails to a thousandth of a radian",
        ]
        if abs(rate - round(rate)) > 1e-9:
            result.append(f"the velocity of the input is rounded to {round(rate)} rpm")
        if linkage.inputs and not self._drives_pin() and not linkage.inputs[0].velocity:
            result.append(
                f"the input rests, which the link does not say; there it moves at {DEFAULT_LINEAR_SPEED:g} cm/s"
            )
        return result
