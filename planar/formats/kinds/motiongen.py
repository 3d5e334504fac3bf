"""Files of MotionGen Pro, and its models as records of others have them: joints, links, slots, cylinders, actuators."""

from __future__ import annotations

from math import atan2, degrees, hypot

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    DrawnStop,
    Joint,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    Tracer,
    slot_end_stop,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links, merge_links_of_two_pins, without_loose_links
from planar.formats.texts.foreign_value import ForeignValue
from planar.formats.texts.names import NameBook

FRAME = "ground"


def recognise(source: ForeignText) -> bool:
    """Whether it is an object with joints and links, those of MotionGen among them."""
    value = source.value
    if not isinstance(value, dict):
        return False
    body = value.get("mechanism", value)
    if (
        not isinstance(body, dict)
        or not isinstance(body.get("joints"), list)
        or not isinstance(body.get("links"), list)
    ):
        return False
    return "motiongen" in str(value.get("name", "")) or ("actuators" in body and "slots" in body)


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a file. Raises BadInput at a JSON path."""
    top = ForeignValue(source.value)
    body = top.at("mechanism") if top.has("mechanism") else top
    linkage, welds = _Reader(body, source.title).read()
    merged = without_loose_links(merge_links_of_two_pins(merge_links(linkage, welds)))
    return drawn_document(merged, source.place)


class _Reader:
    """One file on its way to a linkage."""

    def __init__(self, body: ForeignValue, title: str) -> None:
        self.body, self.title = body, title
        self.book = NameBook({FRAME})
        self.notes: list[str] = []
        self.found: list[Joint] = []
        self.inputs: list[DrawnInput] = []
        self.stops: list[DrawnStop] = []
        self.places: dict[str, Place] = {}
        self.names: dict[str, str] = {}
        self.welded: set[str] = set()
        for number, item in enumerate(body.items("joints")):
            key = item.text("id")
            if key in self.places:
                raise item.at("id").error(f"there are two joints {key!r:.60}")
            self.places[key] = item.number("x"), item.number("y")
            short = key if len(key) < 12 else _letters(number)
            self.names[key] = self.book.fresh(item.text("name", "") or short, "joint")
            if item.flag("isWelded"):
                self.welded.add(key)
        self.links: dict[str, list[str]] = {}
        self.slotted: dict[str, str] = {}
        self.frames: list[str] = []
        for item in body.items("links"):
            self._add_link(item)

    def _add_link(self, given: ForeignValue) -> None:
        keys = [item.text() for item in given.items("jointIds" if given.has("jointIds") else "joints")]
        for index, key in enumerate(keys):
            if key not in self.places:
                raise given.error(f"link joint {index + 1} is {key!r:.60}, which is no joint of this file")
        if given.flag("isGround"):
            name = FRAME if not self.frames else self.book.fresh(FRAME)
            self.frames.append(name)
        else:
            name = self.book.fresh(given.text("name", "") or "".join(self.names[key] for key in keys)[:40], "link")
        self.links[name] = keys
        for slot in given.items("slotIds" if given.has("slotIds") else "slots", optional=True):
            self.slotted[slot.text()] = name

    def read(self) -> tuple[DrawnLinkage, list[tuple[str, ...]]]:
        riders = self._slots()
        welds: list[tuple[str, ...]] = [(FRAME, name) for name in self.frames[1:]]
        tracers = []
        for key, at in self.places.items():
            members = tuple(name for name, keys in self.links.items() if key in keys)
            if key in self.welded and len(members) > 1:
                welds.append(members)
            held = tuple(item for item in members if item != riders.get(key))
            if len(held) > 1:
                self.found.append(PinJoint(self.names[key], held, at))
            elif len(held) == 1 and key not in riders:
                tracers.append(Tracer(self.names[key], held[0], at))
        self._cylinders()
        for item in self.body.items("actuators", optional=True):
            self._actuator(item)
        for key in ("measurements", "forces", "torques"):
            if self.body.has(key) and self.body.value[key]:
                self.notes.append(f"{key} of the file are left out")
        linkage = DrawnLinkage(
            self.title,
            FRAME,
            tuple(self.found),
            tuple(tracers),
            tuple(self.inputs),
            stops=tuple(self.stops),
            length="in",
            links=(FRAME, *(name for name in self.links if name != FRAME)),
            notes=tuple(self.notes),
        )
        return linkage, welds

    def _slots(self) -> dict[str, str]:
        """Joints that ride in slots, by the bar of the slot; each is a pin in the slot of that bar."""
        result = {}
        for slot in self.body.items("slots", optional=True):
            ends = [item.text() for item in slot.items("ends" if slot.has("ends") else "jointIds")][:2]
            bar = self.slotted.get(slot.text("id"))
            if bar is None or len(ends) < 2 or any(item not in self.places for item in ends):
                raise slot.error("the slot is on no link, or not between two joints of this file")
            (x, y), (u, v) = self.places[ends[0]], self.places[ends[1]]
            if (x, y) == (u, v):
                raise slot.error("the ends of the slot coincide, so it has no direction")
            for item in slot.items("riders" if slot.has("riders") else "riderIds", optional=True):
                key = item.text()
                if key not in self.places:
                    raise item.error(f"{key!r:.60} is no joint of this file")
                holders = [name for name, keys in self.links.items() if key in keys and name != bar]
                if not holders:
                    self.notes.append(f"joint {self.names[key]!r} rides in a slot but is on no link, and is left out")
                    continue
                name = self.book.fresh(f"{self.names[key]}_slot")
                rail = SlotJoint(name, bar, holders[0], self.places[key], degrees(atan2(v - y, u - x)), (x, y))
                self.found.append(rail)
                stop, note = slot_end_stop(rail, hypot(u - x, v - y), "in")
                self.stops += stop
                self.notes += note
                result[key] = bar
        return result

    def _cylinders(self) -> None:
        """A barrel and a rod for each cylinder, which slide on the line of its two joints."""
        self.strokes: dict[frozenset[str], SlideJoint] = {}
        for cylinder in self.body.items("cylinders", optional=True):
            keys = [item.text() for item in cylinder.items("joints" if cylinder.has("joints") else "jointIds")]
            if len(keys) != 2 or any(key not in self.places for key in keys):
                raise cylinder.error("a cylinder is between two joints of this file")
            (x, y), (u, v) = self.places[keys[0]], self.places[keys[1]]
            if hypot(u - x, v - y) == 0.0:
                raise cylinder.error("the joints of the cylinder coincide, so it has no direction")
            halves = [self.book.fresh("barrel"), self.book.fresh("rod")]
            name = self.book.fresh(f"{self.names[keys[0]]}{self.names[keys[1]]}_stroke")
            slide = SlideJoint(name, halves[0], halves[1], (u, v), degrees(atan2(v - y, u - x)), (x, y))
            self.found.append(slide)
            self.strokes[frozenset(keys)] = slide
            for key, half in zip(keys, halves, strict=True):
                self._attach(key, half)
            if cylinder.has("stroke"):
                self._add_stroke(slide, hypot(u - x, v - y), cylinder)
        for ends, slide in self.strokes.items():  # a half may be one with a link by now
            current_halves = slide.guide, slide.slider
            self.stops = [s._replace(links=current_halves) if s.joint == slide.name else s for s in self.stops]
            if not any(stop.joint == slide.name for stop in self.stops):
                phrase = " and ".join(sorted(self.names[key] for key in ends))
                self.notes.append(f"the cylinder between {phrase} has no stroke in the file, and no stops here")

    def _add_stroke(self, slide: SlideJoint, length: float, cylinder: ForeignValue) -> None:
        """The stops of a cylinder, whose file says how long its stroke is, and not where in it the cylinder stands."""
        stroke = cylinder.number("stroke")
        if not stroke > 0.0:
            raise cylinder.at("stroke").error(f"a stroke is above zero, not {stroke:.6g}")
        low = max(-stroke, -length)
        self.stops.append(DrawnStop(slide.name, (slide.guide, slide.slider), low, stroke))
        self.notes.append(
            f"the cylinder {slide.name!r} has a stroke of {stroke:.6g} in, but the file does not say where in it the "
            f"cylinder was drawn: its stops are at {length + low:.6g} and {length + stroke:.6g} in, one stroke from "
            f"its drawn length of {length:.6g} in"
        )

    def _attach(self, key: str, half: str) -> None:
        """Join a half of a cylinder at a joint: to its pin, or rigidly to its link where the joint is welded."""
        pin = next((item for item in self.found if isinstance(item, PinJoint) and item.name == self.names[key]), None)
        holders = tuple(name for name, keys in self.links.items() if key in keys)
        if pin is not None:
            self.found[self.found.index(pin)] = pin._replace(links=(*pin.links, half))
        elif holders and key in self.welded:
            self._rename_half(half, holders[0])
        elif holders:
            self.found.append(PinJoint(self.names[key], (holders[0], half), self.places[key]))

    def _rename_half(self, half: str, link: str) -> None:
        """A half of a cylinder that is one with a link."""
        for keys, slide in self.strokes.items():
            if half in (slide.guide, slide.slider):
                guide, slider = (link if part == half else part for part in (slide.guide, slide.slider))
                self.strokes[keys] = slide._replace(guide=guide, slider=slider)
                self.found[self.found.index(slide)] = self.strokes[keys]

    def _actuator(self, given: ForeignValue) -> None:
        at, start = (
            given.text("at" if given.has("at") else "atId"),
            given.text("from" if given.has("from") else "fromId"),
        )
        rate = given.number("velocity", 0.0)
        if given.has("min") and given.has("max"):
            low, high = given.number("min"), given.number("max")
            is_rotary = given.text("type", "rotary") == "rotary"
            if not is_rotary or high - low < 360.0:
                self.notes.append(
                    f"the actuator at {self.names.get(at, at)!r} goes from {low:.6g} to {high:.6g} "
                    f"{'deg' if is_rotary else 'in'}, but the file does not say from where: it has no stops for that"
                )
        if given.text("type", "rotary") != "rotary":
            slide = self.strokes.get(frozenset((at, start)))
            if slide is None:
                self.notes.append("a linear actuator that is on no cylinder is left out")
                return
            self.inputs.append(DrawnInput(slide.name, (slide.guide, slide.slider), rate))
            return
        to = given.text("to")
        against, turned = (
            next((name for name, keys in self.links.items() if at in keys and other in keys), None)
            for other in (start, to)
        )
        pin = next(
            (item for item in self.found if isinstance(item, PinJoint) and item.name == self.names.get(at)), None
        )
        if pin is None or against is None or turned is None or not {against, turned} <= set(pin.links):
            raise given.error("a rotary actuator turns one link against another at a joint that both have")
        self.inputs.append(DrawnInput(pin.name, (against, turned), rate, "deg/s"))


def _letters(number: int) -> str:
    return chr(65 + number % 26) + (str(number // 26) if number >= 26 else "")


FORMAT = FileFormat(
    name="motiongen",
    title="MotionGen Pro",
    suffixes=(".motiongen",),
    source="reference-data/motiongen-library of PMKS-Web/PMKS_Verification, a file of MotionGen and two of its models",
    recognise=recognise,
    read=read,
)
