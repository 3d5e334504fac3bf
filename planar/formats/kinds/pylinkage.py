"""Mechanisms that pylinkage saves as JSON: joints with their places, and links that name them."""

from __future__ import annotations

from math import atan2, ceil, cos, degrees, pi, sin

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    DrawnStop,
    Joint,
    PinJoint,
    Place,
    SlotJoint,
    Tracer,
    unit_note,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links, merge_links_of_two_pins, without_loose_links
from planar.formats.texts.foreign_value import ForeignValue
from planar.formats.texts.names import NameBook

FRAME = "ground"
JOINTS, LINKS = ("ground", "revolute", "prismatic", "tracker"), ("ground", "driver", "arc_driver", "link")


def recognise(source: ForeignText) -> bool:
    """Whether it is an object with lists of joints that have a type of pylinkage, and of links."""
    value = source.value
    if not isinstance(value, dict) or "planar" in value or not isinstance(value.get("links"), list):
        return False
    joints = value.get("joints")
    return isinstance(joints, list) and any(isinstance(j, dict) and j.get("type") in JOINTS for j in joints)


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a file. Raises BadInput at a JSON path."""
    linkage, welds = _Reader(ForeignValue(source.value), source).read()
    merged = without_loose_links(merge_links_of_two_pins(merge_links(linkage, welds)))
    return drawn_document(merged, source.place)


class _Reader:
    """One file on its way to a linkage."""

    def __init__(self, top: ForeignValue, source: ForeignText) -> None:
        self.top, self.title = top, top.text("name", "") or source.title
        self.length = source.length_unit or "mm"
        self.book = NameBook({FRAME})
        self.stops: list[DrawnStop] = []
        self.notes: list[str] = []
        self.joints: dict[str, ForeignValue] = {}
        for item in top.items("joints"):
            key = item.text("id")
            if key in self.joints:
                raise item.at("id").error(f"there are two joints {key!r:.60}")
            self.joints[key] = item
        self.names = {key: self.book.fresh(item.text("name", key), "joint") for key, item in self.joints.items()}
        self.links: dict[str, list[str]] = {}
        self.drivers: list[tuple[str, ForeignValue]] = []
        for item in top.items("links"):
            self._add_link(item)
        self.anchored = {key for key, item in self.joints.items() if item.text("type", "revolute") == "ground"}
        self.anchored |= {item.text("motor_joint") for _, item in self.drivers if item.has("motor_joint")}
        self.anchored |= set(self.links.get(FRAME, ()))

    def _add_link(self, given: ForeignValue) -> None:
        kind, key = given.text("type", "link"), given.text("id")
        if kind not in LINKS:
            raise given.at("type").error(f"links are of type {', '.join(LINKS)}, not {kind!r:.40}")
        keys = [item.text() for item in given.items("joints")]
        for item in keys:
            if item not in self.joints:
                raise given.at("joints").error(f"{item!r:.60} is no joint of this file")
        if kind == "ground":
            self.links[FRAME] = [*self.links.get(FRAME, ()), *keys]
            return
        name = self.book.fresh(given.text("name", "") or key, "link")
        self.links[name] = keys
        if kind != "link":
            self.drivers.append((name, given))

    def at(self, key: str) -> Place:
        given = self.joints[key]
        place = given.at("position")
        if isinstance(place.value, list) and None in place.value:
            raise place.error(f"joint {key!r:.60} has no place: the mechanism was saved before it was solved")
        return given.pair("position")

    def read(self) -> tuple[DrawnLinkage, list[tuple[str, ...]]]:
        result: list[Joint] = []
        tracers: list[Tracer] = []
        for key, name in self.names.items():
            kind = self.joints[key].text("type", "revolute")
            holders = [link for link, keys in self.links.items() if key in keys and link != FRAME]
            if kind == "tracker":
                tracers += self._tracker(key, holders)
            elif kind == "prismatic":
                result += self._prismatic(key, holders)
            elif kind not in JOINTS:
                raise self.joints[key].at("type").error(f"joints are of type {', '.join(JOINTS)}, not {kind!r:.40}")
            else:
                members = (*((FRAME,) if key in self.anchored else ()), *holders)
                if len(members) > 1:
                    result.append(PinJoint(name, members, self.at(key)))
                elif holders:
                    tracers.append(Tracer(name, holders[0], self.at(key)))
        inputs = self._inputs(result)
        linkage = DrawnLinkage(
            self.title,
            FRAME,
            tuple(result),
            tuple(tracers),
            tuple(inputs),
            stops=tuple(self.stops),
            links=(FRAME, *(item for item in self.links if item != FRAME)),
            length=self.length,
            notes=(*self.notes, unit_note(self.length)),
        )
        return linkage, []

    def _prismatic(self, key: str, holders: list[str]) -> list[Joint]:
        """A pin on a rail that is fixed to the frame."""
        given, at = self.joints[key], self.at(key)
        along = given.pair("axis") if given.has("axis") else (1.0, 0.0)
        through = given.pair("line_point") if given.has("line_point") else at
        if along == (0.0, 0.0):
            raise given.at("axis").error("the axis of a slide has a direction")
        if not holders:
            return []
        angle, name = degrees(atan2(along[1], along[0])), self.names[key]
        if len(holders) == 1:
            return [SlotJoint(name, FRAME, holders[0], at, angle, through)]
        slot = self.book.fresh(f"{name}_slide")
        return [PinJoint(name, tuple(holders), at), SlotJoint(slot, FRAME, holders[0], at, angle, through)]

    def _tracker(self, key: str, holders: list[str]) -> list[Tracer]:
        """A point by its distance and angle from the line of two joints of one link."""
        given = self.joints[key]
        first, second = given.text("ref_joint1_id"), given.text("ref_joint2_id")
        for item in (first, second):
            if item not in self.joints:
                raise given.error(f"{item!r:.60} is no joint of this file")
        link = next((name for name, keys in self.links.items() if first in keys and second in keys), None)
        if link is None:
            self.notes.append(f"the point {self.names[key]!r} is on no one link and is left out")
            return []
        (x, y), (u, v) = self.at(first), self.at(second)
        way = atan2(v - y, u - x) + given.number("angle", 0.0)
        far = given.number("distance", 0.0)
        return [Tracer(self.names[key], link, (x + far * cos(way), y + far * sin(way)))]

    def _inputs(self, found: list[Joint]) -> list[DrawnInput]:
        """The drivers: links that turn about a joint of the ground, so far in each step."""
        pins = {item.name: item for item in found if isinstance(item, PinJoint) and FRAME in item.links}
        inputs = []
        for link, given in self.drivers:
            motor = given.text("motor_joint", "")
            named = [self.names[motor]] if motor in self.names else [self.names[key] for key in self.links[link]]
            pin = next((item for item in named if item in pins and link in pins[item].links), None)
            if pin is None:
                raise given.error(f"the driver {link!r} turns about no joint of the ground")
            rate = given.number("angular_velocity", 0.0)
            if rate:
                self.notes.append(f"{link!r} turns by {rate:.6g} rad in a step; a step is taken as a second")
            if given.text("type") == "arc_driver":
                self._add_arc(link, given, pins[pin])
            inputs.append(DrawnInput(pin, (FRAME, link), rate))
        return inputs

    def _add_arc(self, link: str, given: ForeignValue, pin: PinJoint) -> None:
        """The stops of a driver that goes to and fro between two angles of the line from its pin to its other joint."""
        other = next((key for key in self.links[link] if self.names[key] != pin.name), None)
        if other is None or not (given.has("arc_start") and given.has("arc_end")):
            self.notes.append(f"{link!r} goes to and fro between angles that the file does not say; it has no stops")
            return
        start, end = sorted((given.number("arc_start"), given.number("arc_end")))
        x, y = self.at(other)
        angle = atan2(y - pin.at[1], x - pin.at[0])
        angle += 2.0 * pi * ceil((start - angle) / (2.0 * pi) - 1e-9)
        limits = f"between {degrees(start):.6g} and {degrees(end):.6g} deg"
        if start < end and angle <= end + 1e-9:
            self.stops.append(DrawnStop(pin.name, (FRAME, link), min(start - angle, 0.0), max(end - angle, 0.0)))
            self.notes.append(f"{link!r} goes to and fro {limits}; here it stops there")
        else:
            self.notes.append(f"{link!r} goes to and fro {limits}, but was drawn outside of these; it has no stops")


FORMAT = FileFormat(
    name="pylinkage",
    title="pylinkage",
    suffixes=(".json",),
    source="src/pylinkage/mechanism/serialization.py of HugoFara/pylinkage",
    recognise=recognise,
    read=read,
    names_length_unit=False,
)
