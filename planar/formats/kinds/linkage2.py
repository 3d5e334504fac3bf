"""Files of the program Linkage (D. M. Rector): connectors where they are drawn, and the Links that carry them."""

from __future__ import annotations

import re
from math import atan2, degrees, hypot, pi, radians
from string import ascii_lowercase, ascii_uppercase
from xml.etree.ElementTree import Element

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    AT_END,
    DrawnInput,
    DrawnLinkage,
    DrawnStop,
    Joint,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    Tracer,
    WheelJoint,
    slot_end_stop,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links, merge_links_of_two_pins, without_loose_links
from planar.formats.kinds.parts.linkage2_motion import arc_centre, swing_phase, turned_links
from planar.formats.kinds.parts.linkage2_text import PIXELS_PER_MILLIMETRE, write
from planar.formats.texts.names import NameBook
from planar.formats.texts.xml_text import number_attribute, parse_xml
from planar.foundation.errors import BadInput, join_names

MECHANISM_LAYERS = 0xFFFFFFF0
"""The bits of `layer` of which one is set on what moves; other layers are drawings."""
DEFAULT_RATE = 15.0
"""rpm, or strokes to and fro in a minute, where none is written."""
TURN = 2.0 * pi
FRAME = "frame"
LETTERS = ascii_uppercase + ascii_lowercase
JOINED = re.compile(r'(=\s*"[^"<]*")(?=\w)')
"""An attribute that the next follows without a blank, as in some of the program's own samples."""


def recognise(source: ForeignText) -> bool:
    """Whether it is the XML of Linkage."""
    return source.value is None and "<linkage2" in source.text[:4000]


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a file of Linkage. Raises BadInput."""
    root = parse_xml(JOINED.sub(r"\1 ", source.text), source.place)
    if root.tag != "linkage2":
        raise BadInput(source.place, f"the outermost element is {root.tag!r:.40}, and not 'linkage2'")
    linkage, welds = _Reader(root, source).read()
    linkage = merge_links_of_two_pins(merge_links(linkage, welds))
    return drawn_document(without_loose_links(linkage), source.place)


class _Reader:
    """One file on its way to a linkage."""

    def __init__(self, root: Element, source: ForeignText) -> None:
        self.root, self.source = root, source
        self.book = NameBook({FRAME})
        self.notes: list[str] = []
        self.joints: list[Joint] = []
        self.inputs: list[DrawnInput] = []
        self.stops: list[DrawnStop] = []
        self.tracers: list[Tracer] = []
        self.curved_slots: list[str] = []
        self.welds: list[tuple[str, ...]] = []
        self.connectors = {self._id(item): item for item in root.iter() if item in [*root] and item.tag == "connector"}
        elements = [item for item in root if item.tag in ("Link", "element") and self._moves(item, "a link")]
        if not self.connectors:
            raise BadInput(source.place, "there is no connector in this file")
        self.anchors = {key for key, item in self.connectors.items() if item.get("anchor") == "true"}
        self.elements = self._with_extent(elements)
        self.names = {key: self._connector_name(key) for key in self.connectors}
        self.places = {key: self._place(key) for key in self.connectors}
        self.links: dict[str, list[str]] = {}
        self.named: dict[str, str] = {}
        self.still: set[str] = set()
        for item in self.elements:
            self._add_link(item)

    def read(self) -> tuple[DrawnLinkage, list[tuple[str, ...]]]:
        for key, element in self.connectors.items():
            if not self._moves(element, ""):
                continue
            self._join(key, element)
        for item in self.elements:
            self._fasten(item)
        self._wheels()
        linkage = DrawnLinkage(
            self.source.title,
            FRAME,
            tuple(self.joints),
            tuple(self.tracers),
            tuple(self.inputs),
            stops=tuple(self.stops),
            length="mm",
            links=(FRAME, *self.links),
            curved_slots=tuple(self.curved_slots),
            notes=tuple(dict.fromkeys(self.notes)),
        )
        return linkage, self.welds

    def _id(self, element: Element) -> str:
        key = element.get("id")
        if key is None:
            raise BadInput(self.source.place, f"an element {element.tag!r} has no 'id'")
        return key.strip()

    def _moves(self, element: Element, what: str) -> bool:
        """Whether an element is of the mechanism, and no drawing and no measurement."""
        layer = element.get("layer", "").strip()
        drawn = layer.isdecimal() and int(layer) not in (0,) and not int(layer) & MECHANISM_LAYERS
        if (drawn or element.get("measurementelement") == "true") and what:
            self.notes.append("drawings and measurements of the file are left out")
        return not drawn and element.get("measurementelement") != "true"

    def _connector_name(self, key: str) -> str:
        wanted = self.connectors[key].get("name", "").strip() or _letters(key)
        return self.book.fresh(wanted, "point")

    def _place(self, key: str) -> tuple[float, float]:
        message = f"{self.source.place}, connector {key}"
        x, y = (number_attribute(self.connectors[key], name, message) for name in ("x", "y"))
        return x / PIXELS_PER_MILLIMETRE, y / PIXELS_PER_MILLIMETRE

    def _with_extent(self, elements: list[Element]) -> list[Element]:
        """Without the Links that stand for a connector alone: one that is on other Links as well, or an anchor."""
        held = [{self._id(item) for item in element if item.tag == "connector"} for element in elements]

        def is_alone(number: int) -> bool:
            own = held[number]
            if len(own) != 1 or elements[number].get("gear") == "true":
                return False
            return own <= self.anchors or any(own & other for index, other in enumerate(held) if index != number)

        return [element for number, element in enumerate(elements) if not is_alone(number)]

    def _add_link(self, element: Element) -> None:
        key = self._id(element)
        name = self.book.fresh(element.get("name", "").strip() or f"L{key}", "link")
        keys = [self._id(item) for item in element if item.tag == "connector"]
        for item in keys:
            if item not in self.connectors:
                raise BadInput(f"{self.source.place}, Link {key}", f"there is no connector {item!r} in this file")
        keys = list(dict.fromkeys(keys))
        if key not in self.named:
            self.named[key] = name
        if element.get("fastenconnector") in self.anchors:
            self.still.add(name)
        if element.get("actuator") == "true" and len(keys) >= 2:
            self._actuator(element, name, keys)
            return
        self.links[name] = keys

    def _actuator(self, element: Element, name: str, keys: list[str]) -> None:
        """Two halves, of which the second is driven along the line of its two ends."""
        first, second = keys[:2]
        rod = self.book.fresh(f"{name}_rod")
        self.links |= {name: [first, *keys[2:]], rod: [second]}
        (x, y), (u, v) = self.places[first], self.places[second]
        joint = self.book.fresh(f"{name}_stroke")
        self.joints.append(
            SlideJoint(joint, name, rod, (u, v), degrees(atan2(v - y, u - x)), through=(x, y)),
        )
        message = f"{self.source.place}, Link {element.get('id')}"
        throw = number_attribute(element, "throw", message, 0.0) / PIXELS_PER_MILLIMETRE
        cpm = number_attribute(element, "cpm", message, DEFAULT_RATE)
        offset = number_attribute(element, "startoffset", message, 0.0) / PIXELS_PER_MILLIMETRE
        begun, way = swing_phase(throw, offset) if throw > 0.0 else (0.0, 1)
        self.inputs.append(DrawnInput(joint, (name, rod), way * 2.0 * throw * cpm / 60.0))
        if throw > 0.0:
            self.stops.append(DrawnStop(joint, (name, rod), -begun, throw - begun))
        after = f", {begun:.6g} mm of it done as drawn" if begun else ""
        self.notes.append(
            f"the actuator {name!r} goes to and fro by {throw:.6g} mm{after}, {abs(cpm):g} times a minute; "
            "here it runs at that mean speed between stops"
        )
        self._by_hand(element, f"actuator {name!r}")

    def _by_hand(self, element: Element, what: str) -> None:
        if element.get("alwaysmanual") == "true":
            self.notes.append(f"the {what} is moved by hand in that program; here it runs at the speed of the file")

    def _join(self, key: str, element: Element) -> None:
        """The joint at a connector: a pin of its Links, and where it slides a pin in a slot."""
        holders = [name for name, keys in self.links.items() if key in keys]
        anchored = key in self.anchors
        at, name = self.places[key], self.names[key]
        limits = [self._id(item) for item in element if item.tag == "slidelimit"]
        slides = element.get("slider") == "true" and len(limits) >= 2
        if slides and self._slide(key, holders, anchored, limits[0], limits[1]):
            return
        members = ([FRAME] if anchored else []) + holders
        fastened = element.get("fastenlink") or element.get("fasten")
        if fastened and not members:
            self.tracers.append(Tracer(name, self.named.get(fastened, FRAME), at))
            return
        if not members:
            self.notes.append(f"connector {name!r} is on no link and is left out")
            return
        self.joints.append(PinJoint(name, tuple(members), at))
        if element.get("input") == "true":
            self._drive(key, element, holders if anchored else members)

    def _slide(self, key: str, holders: list[str], anchored: bool, start: str, end: str) -> bool:
        """A pin in the slot between two connectors; whether there is one link, or the frame, that has this slot."""
        for item in (start, end):
            if item not in self.places:
                raise BadInput(
                    f"{self.source.place}, connector {key}", f"there is no connector {item!r} that limits its slide"
                )
        carriers = [n for n, keys in self.links.items() if start in keys and end in keys and key not in keys]
        fixed = all(item in self.anchors for item in (start, end))
        guide = FRAME if fixed else next(iter(carriers), None)
        riders = [FRAME, *holders] if anchored else holders
        riders = [item for item in riders if item != guide]
        if guide is None or not riders:
            message = "no one link carries both ends of its slot" if guide is None else "no link slides there"
            self.notes.append(f"connector {self.names[key]!r} does not slide here: {message}")
            return False
        (x, y), (u, v) = self.places[start], self.places[end]
        if (x, y) == (u, v):
            raise BadInput(
                f"{self.source.place}, connector {key}", "the ends of its slot coincide, so it has no direction"
            )
        at, name = self.places[key], self.names[key]
        radius = number_attribute(self.connectors[key], "slideradius", f"{self.source.place}, connector {key}", 0.0)
        if radius:
            centre = arc_centre((x, y), (u, v), radius / PIXELS_PER_MILLIMETRE)
            self._arc(key, guide, riders, centre, ((x, y), (u, v)) if radius > 0.0 else ((u, v), (x, y)))
            return True
        along = self.book.fresh(f"{name}_slot") if len(riders) > 1 else name
        if len(riders) > 1:
            self.joints.append(PinJoint(name, tuple(riders), at))
        slot = SlotJoint(along, guide, riders[0], at, degrees(atan2(v - y, u - x)), through=(x, y))
        self.joints.append(slot)
        stops, notes = slot_end_stop(slot, hypot(u - x, v - y), "mm")
        self.stops += stops
        self.notes += notes
        return True

    def _arc(self, key: str, guide: str, riders: list[str], centre: Place, ends: tuple[Place, Place]) -> None:
        """A pin in a curved slot, from one end anticlockwise to the other: a link about its centre holds it there."""
        name, at = self.names[key], self.places[key]
        arc, pin = self.book.fresh(f"{name}_arc"), self.book.fresh(f"{name}_centre")
        self.links[arc] = []
        self.curved_slots.append(arc)
        self.joints.append(PinJoint(pin, (guide, arc), centre))
        self.joints.append(PinJoint(name, (*riders, arc), at))
        radius = hypot(at[0] - centre[0], at[1] - centre[1])
        note = f"the curved slot of {name!r} is here the link {arc!r} about its centre, {radius:.6g} mm long"
        start, position, end = (atan2(y - centre[1], x - centre[0]) for x, y in (ends[0], at, ends[1]))
        length, offset = (end - start) % TURN, (position - start + AT_END) % TURN - AT_END
        if offset <= length + AT_END:
            self.stops.append(DrawnStop(pin, (guide, arc), min(-offset, 0.0), max(length - offset, 0.0)))
            note += f", with stops where the slot ends, {degrees(length):.6g} deg apart"
        else:
            note += f"; its pin was drawn beyond the ends of the slot, {degrees(length):.6g} deg apart: it has no stops"
        self.notes.append(note)

    def _drive(self, key: str, element: Element, members: list[str]) -> None:
        """The input of a connector: it turns the Link there that is not held elsewhere against the frame."""
        name = self.names[key]
        if key not in self.anchors:
            self.notes.append(f"the input at {name!r} is on no anchor and is left out")
            return
        free = [link for link in members if link not in self.still]
        turning = turned_links(key, free, self.links, self.anchors - {key})
        if not turning:
            self.notes.append(f"the input at {name!r} turns no link and is left out")
            return
        if len(turning) > 1:
            self.notes.append(f"the links that the input at {name!r} turns are one here: {join_names(turning)}")
            self.welds.append(tuple(turning))
        message = f"{self.source.place}, connector {key}"
        rate = -number_attribute(element, "rpm", message, DEFAULT_RATE)
        limit = number_attribute(element, "limitangle", message, 0.0)
        if limit > 0.0:
            begun, way = swing_phase(limit, number_attribute(element, "startoffset", message, 0.0))
            after = f", {begun:g} of them done as drawn" if begun else ""
            self.notes.append(
                f"the input at {name!r} goes to and fro by {limit:g} degrees{after}; here it turns at its speed "
                "between stops"
            )
            ends = (-begun, limit - begun) if rate >= 0.0 else (begun - limit, begun)
            self.stops.append(DrawnStop(name, (FRAME, turning[0]), *map(radians, ends)))
            rate *= way
        self._by_hand(element, f"input at {name!r}")
        self.inputs.append(DrawnInput(name, (FRAME, turning[0]), rate, "rpm"))

    def _fasten(self, element: Element) -> None:
        """What a Link is fastened to: another, which it goes with, or an anchor, on which a gear stands still."""
        own = self.named[self._id(element)]
        other = self.named.get(element.get("fastenlink") or "", own)
        if other != own:
            self.welds.append((own, other))
        if own in self.still:
            self.welds.append((FRAME, own))
        to = element.get("fastenconnector")
        held = [None if to in self.anchors else to, *(e.get("id") for e in element if e.tag == "fastenconnector")]
        for key in filter(None, held):
            if key in self.places and not any(key in keys for keys in self.links.values()):
                self.tracers.append(Tracer(self.book.fresh(f"{self.names[key]}_on_{own}"), own, self.places[key]))
            elif key in self.places:
                self.welds += [(own, name) for name, keys in self.links.items() if key in keys and name != own]

    def _wheels(self) -> None:
        for ratio in (item for group in self.root.iter("ratios") for item in group if item.tag == "ratio"):
            parts = [item for item in ratio if item.tag == "link"]
            message = f"{self.source.place}, ratios"
            if len(parts) != 2:
                raise BadInput(message, f"a ratio is of two links, not of {len(parts)}")
            keys = [self._id(item) for item in parts]
            if not all(key in self.named for key in keys):
                raise BadInput(
                    message, f"there is no Link {next(k for k in keys if k not in self.named)!r} in this file"
                )
            sizes = [number_attribute(item, "size", message) for item in parts]
            if min(sizes) <= 0.0:
                raise BadInput(message, "the sizes of wheels are above zero")
            self._wheel_joint(ratio, (self.named[keys[0]], self.named[keys[1]]), (sizes[0], sizes[1]))

    def _wheel_joint(self, ratio: Element, wheels: tuple[str, str], sizes: tuple[float, float]) -> None:
        centres = [self._centre(wheel) for wheel in wheels]
        (x, y), (u, v) = (self.places[item] for item in centres)
        apart = hypot(u - x, v - y)
        carriers = [n for n, keys in self.links.items() if set(centres) <= set(keys)]
        fixed = all(item in self.anchors for item in centres)
        if not fixed and not carriers:
            raise BadInput(
                f"{self.source.place}, ratios", f"the wheels {wheels[0]!r} and {wheels[1]!r} have no common carrier"
            )
        carrier = FRAME if fixed else carriers[0]
        name = self.book.fresh(f"{wheels[0]}_{wheels[1]}")
        if ratio.get("type") == "gears":
            total = sizes[0] + sizes[1]
            by = (
                ("radii", (apart * sizes[0] / total, apart * sizes[1] / total))
                if apart
                else ("ratio", (-sizes[0] / sizes[1],))
            )
            self.joints.append(WheelJoint(name, "gear", wheels, carrier, *by))
        else:
            self.joints.append(WheelJoint(name, "chain", wheels, carrier, "ratio", (sizes[0] / sizes[1],)))

    def _centre(self, wheel: str) -> str:
        """The connector about which a wheel turns: its first."""
        keys = self.links[wheel]
        if not keys:
            raise BadInput(f"{self.source.place}, ratios", f"the wheel {wheel!r} has no connector to turn about")
        return keys[0]


def _letters(key: str) -> str:
    """The letter by which Linkage shows a connector's number: 0 is A, 25 Z, 26 a, and 52 A1."""
    if not key.isdecimal() or int(key) > 10**6:
        return key
    times, letter = divmod(int(key), len(LETTERS))
    return LETTERS[letter] + (str(times) if times else "")


FORMAT = FileFormat(
    name="linkage2",
    title="Linkage (Rector)",
    suffixes=(".linkage2",),
    source="the reader and writer of Linkage, LinkageDoc.cpp, and files that its users saved",
    recognise=recognise,
    read=read,
    write=write,
    precision="double precision",
)
