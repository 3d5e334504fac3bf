"""Links of PMKS+ (app.pmksplus.com): the whole mechanism in the address, which is read and not opened."""

from __future__ import annotations

import re
from math import atan2, degrees, hypot

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnForce,
    DrawnInput,
    DrawnLinkage,
    Joint,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    Tracer,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links_of_two_pins, without_loose_links
from planar.formats.kinds.parts.pmksplus_code import CodedLink, decode_decimal, decode_flags, decode_integer, take_apart
from planar.formats.kinds.parts.pmksplus_text import FORCES, LENGTHS, write
from planar.formats.texts.names import NameBook
from planar.foundation.errors import BadInput

FRAME = "ground"
PRISMATIC, DRIVEN, GROUNDED, WELDED = 1, 2, 4, 8
"""Bits of a joint's flags."""
CODE = re.compile(r"(?:https?://[\w.:/-]+\?|\?)?([\w-]{1,6}\.[\w,-]*\.[\w,-]*\.[\w-]{3,5}\.[\w.,-]+)")
SNAP = 5e-4
"""Rounding of a link's angles (rad): one this near to a multiple of 15 degrees is meant to be that."""


def recognise(source: ForeignText) -> bool:
    """Whether it is an address of PMKS+, or the code of one."""
    if source.value is not None or len(source.text) > 200_000:
        return False
    found = CODE.fullmatch(source.text.strip())
    return found is not None and found[1].count(",") > 4


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a link. Raises BadInput."""
    found = CODE.fullmatch(source.text.strip())
    if found is None:
        raise BadInput(source.place, "this is no link of PMKS+")
    linkage = _Reader(take_apart(found[1], source.place), source).read()
    return drawn_document(without_loose_links(merge_links_of_two_pins(linkage)), source.place)


class _Reader:
    """One link on its way to a linkage."""

    def __init__(self, coded: CodedLink, source: ForeignText) -> None:
        self.coded, self.place, self.source = coded, source.place, source
        self.book = NameBook({FRAME})
        self.joints: dict[str, list[str]] = {}
        for fields in coded.joints:
            if len(fields) < 5 or len(fields[0]) < 2:
                raise BadInput(self.place, f"a joint of the link has too few parts: {','.join(fields)!r:.60}")
            self.joints[fields[0][1:]] = fields
        self.links: dict[str, list[str]] = {}
        self.sliders: list[list[str]] = []
        self.ids: dict[str, str] = {}
        for fields in coded.links:
            self._add_link(fields)
        self.notes: list[str] = []

    def flags(self, joint: str) -> int:
        return decode_flags(self.joints[joint][0][:1], self._told(joint))

    def at(self, joint: str) -> Place:
        x, y = (decode_decimal(each, self._told(joint)) for each in self.joints[joint][2:4])
        return x, y

    def _told(self, joint: str) -> str:
        return f"{self.place}, joint {joint}"

    def _add_link(self, fields: list[str]) -> None:
        head = fields[0]
        if len(head) < 3 or len(fields) < 8 or head[0] not in "YN" or head[1] not in "RP":
            raise BadInput(self.place, f"a part of the link is no link: {','.join(fields)!r:.60}")
        if head[0] == "N":  # a part of a link that was made of several
            return
        listed = fields[7:]
        joints = listed[: listed.index("")] if "" in listed else listed
        for each in joints:
            if each not in self.joints:
                raise BadInput(self.place, f"the link {head[2:]!r:.40} names a joint {each!r:.40} that is not there")
        if head[1] == "P":
            self.sliders.append(joints)
            return
        name = self.book.fresh(fields[1] or head[2:], "link")
        self.ids[head[2:]] = name
        self.links[name] = joints

    def read(self) -> DrawnLinkage:
        names = {joint: self.book.fresh(fields[1] or joint, "joint") for joint, fields in self.joints.items()}
        found: list[Joint] = []
        tracers: list[Tracer] = []
        drives: list[DrawnInput] = []
        slid = dict(map(self._slider, self.sliders))
        for joint, name in names.items():
            flags = self.flags(joint)
            if flags & PRISMATIC:
                continue
            holders = [link for link, joints in self.links.items() if joint in joints]
            members = tuple(([FRAME] if flags & GROUNDED else []) + holders)
            if joint in slid:
                made = self._sliding(names, joint, slid[joint], members)
                found += made
                if self.flags(slid[joint]) & DRIVEN and made and isinstance(made[-1], SlideJoint | SlotJoint):
                    rail = made[-1]
                    rider = rail.slider if isinstance(rail, SlideJoint) else rail.rider
                    drives.append(DrawnInput(rail.name, (rail.guide, rider), self._speed()))
            elif len(members) == 1 and not flags & GROUNDED:
                tracers.append(Tracer(name, members[0], self.at(joint)))
            elif len(members) > 1:
                found.append(PinJoint(name, members, self.at(joint)))
            if flags & DRIVEN and len(members) > 1:
                drives.append(DrawnInput(name, (members[0], members[1]), self._speed(), "rpm"))
        if any(decode_decimal(fields[2], self.place) for fields in self.coded.links if fields[0][1] == "R"):
            self.notes.append("masses of links are left out: the link does not say their unit")
        return DrawnLinkage(
            self.source.title,
            FRAME,
            tuple(found),
            tuple(tracers),
            tuple(drives),
            forces=tuple(self._forces()),
            length=self._unit(0, LENGTHS, "cm"),
            links=(FRAME, *self.links),
            notes=tuple(self.notes),
        )

    def _unit(self, index: int, units: dict[int, str], default: str) -> str:
        text = self.coded.units
        return units.get(decode_integer(text[index], self.place), default) if index < len(text) else default

    def _speed(self) -> float:
        rate = float(decode_integer(self.coded.integers[0], self.place)) if self.coded.integers[0] else 0.0
        return -rate if decode_flags(self.coded.flags or "0", self.place) & 1 else rate

    def _slider(self, joints: list[str]) -> tuple[str, str]:
        """The pin and the prismatic joint that a block ties together."""
        rails = [each for each in joints if self.flags(each) & PRISMATIC]
        pins = [each for each in joints if each not in rails]
        if len(rails) != 1 or len(pins) != 1:
            raise BadInput(self.place, f"a block joins one pin and one slide, not {', '.join(joints)!r:.60}")
        return pins[0], rails[0]

    def _sliding(self, names: dict[str, str], pin: str, rail: str, members: tuple[str, ...]) -> list[Joint]:
        """The pin of a block, and its slot in the frame or in a moving link."""
        fields, at = self.joints[rail], self.at(pin)
        if not members:
            return []
        if len(fields) >= 8 and fields[5]:
            if fields[5] not in self.ids or fields[6] not in self.joints or fields[7] not in self.joints:
                raise BadInput(self._told(rail), "its slot is of a link or between joints that are not there")
            guide, ends = self.ids[fields[5]], (self.at(fields[6]), self.at(fields[7]))
            (x, y), (u, v) = ends
            if hypot(u - x, v - y) == 0.0:
                raise BadInput(self._told(rail), "the ends of its slot coincide, so it has no direction")
            angle, through = degrees(atan2(v - y, u - x)), ends[0]
        else:
            guide, through = FRAME, at
            angle = self._angle(decode_decimal(fields[4], self._told(rail)))
        riders = [each for each in members if each != guide]
        name = names[pin]
        if len(riders) == 1:
            kind = SlideJoint if self.flags(pin) & WELDED else SlotJoint
            return [kind(name, guide, riders[0], at, angle, through)]
        slot = self.book.fresh(f"{name}_slot")
        return [PinJoint(name, tuple(riders), at), SlotJoint(slot, guide, riders[0], at, angle, through)]

    def _angle(self, angle: float) -> float:
        """An angle of a rail (rad) in degrees: 1.571 is 90, where that is what was rounded."""
        given = degrees(angle)
        nearest = 15.0 * round(given / 15.0)
        if given != nearest and abs(given - nearest) <= degrees(SNAP):
            told = "angles that are rounded in the link are taken as the multiples of 15 degrees that they round"
            if told not in self.notes:
                self.notes.append(told)
            return nearest
        return given

    def _forces(self) -> list[DrawnForce]:
        pounds = 4.4482216152605
        found = []
        for fields in self.coded.forces:
            if len(fields) < 8 or fields[1] not in self.ids:
                raise BadInput(self.place, f"a force of the link is none: {','.join(fields)!r:.60}")
            flags = decode_flags(fields[0][:1], self.place)
            x, y, u, v, size = (decode_decimal(each, self.place) for each in fields[3:8])
            long = hypot(u - x, v - y)
            if long == 0.0:
                self.notes.append(f"the force {fields[2]!r} has no direction and is left out")
                continue
            newtons = size * (pounds if self._unit(2, FORCES, "N") == "lbf" else 1.0) * (1.0 if flags & 2 else -1.0)
            force = (newtons * (u - x) / long, newtons * (v - y) / long)
            found.append(DrawnForce(self.ids[fields[1]], (x, y), force, bool(flags & 1)))
        return found


FORMAT = FileFormat(
    name="pmksplus",
    title="PMKS+ (link)",
    suffixes=(".pmksplus",),
    source="src/app/services/transcoding of PMKS-Web/PMKSWeb, and the links of its docs/fixture-urls.md",
    recognise=recognise,
    read=read,
    write=write,
    precision="thousandths of the unit of length and of a radian",
)
