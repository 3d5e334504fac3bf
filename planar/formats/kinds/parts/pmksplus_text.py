"""A linkage as a link of PMKS+."""

from __future__ import annotations

import re
from math import cos, pi, radians, sin

from planar.formats.drawn.blocks import slots_for_blocks
from planar.formats.drawn.drawn_linkage import DrawnLinkage, PinJoint, Place, SlideJoint, SlotJoint, joint_phrase
from planar.formats.drawn.file_format import WrittenText, cannot_say
from planar.formats.kinds.parts.pmksplus_code import CodedLink, encode_decimal, encode_integer, put_together
from planar.formats.texts.names import NameBook

TITLE = "PMKS+ (link)"
ADDRESS = "https://app.pmksplus.com/?"
LENGTHS, FORCES = {0: "in", 1: "cm", 2: "m"}, {0: "lbf", 1: "N"}
"""Units by their numbers in the head."""
CENTIMETRES = {"mm": 0.1, "cm": 1.0, "m": 100.0, "in": 2.54}
REACH = 100.0
"""Of a slot's direction, by two joints so far apart (cm): rounding turns it by 1e-5 at most."""


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

    def write(self) -> WrittenText:
        linkage = self.linkage
        for joint in linkage.joints:
            if isinstance(joint, PinJoint):
                self._pin(joint)
        for tracer in linkage.tracers:
            self._joint(tracer.name, tracer.at, 0, [tracer.link])
        for joint in linkage.joints:
            if isinstance(joint, SlideJoint | SlotJoint):
                self._slide(joint)
            elif not isinstance(joint, PinJoint):
                raise cannot_say(TITLE, joint_phrase(joint))
        return WrittenText(ADDRESS + put_together(self._coded(), encode_decimal(1.0)) + "\n", tuple(self._notes()))

    def _name(self, wanted: str) -> str:
        return self.book.fresh(re.sub(r"[^A-Za-z0-9]+", "_", wanted), "J")

    def _joint(self, name: str, at: Place, flags: int, links: list[str], more: tuple[str, ...] = ()) -> str:
        key = self._name(name)
        x, y = (encode_decimal(each * self.scale) for each in at)
        fields = [encode_integer(flags) + key, key, x, y, *(more or ("0",))]
        self.joints.append(fields)
        self.places[key] = at
        for link in links:
            if link != self.linkage.frame:
                self.members.setdefault(link, []).append(key)
        return key

    def _pin(self, joint: PinJoint) -> None:
        grounded = 4 if self.linkage.frame in joint.links else 0
        driven = 0
        if joint.name == self.driven:
            driven = 2
            if len(joint.links) > 2:
                raise cannot_say(TITLE, f"the input at the pin {joint.name!r} of {len(joint.links)} links")
            joint = joint._replace(links=self.linkage.inputs[0].links)
        self._joint(joint.name, joint.at, 16 + grounded + driven, list(joint.links))

    def _slide(self, joint: SlideJoint | SlotJoint) -> None:
        """A pin of what slides, and the slide in its guide; the pin is welded where it must not turn."""
        rider = joint.slider if isinstance(joint, SlideJoint) else joint.rider
        flags = 16 + (4 if rider == self.linkage.frame else 0) + (8 if isinstance(joint, SlideJoint) else 0)
        key = self._joint(joint.name, joint.at, flags, [rider])
        driven = 2 if joint.name == self.driven else 0
        if joint.guide == self.linkage.frame:
            angle = (radians(joint.angle) + pi) % (2.0 * pi) - pi
            rail = self._joint(f"{joint.name}r", joint.at, 1 + 4 + driven, [], (encode_decimal(angle),))
        else:
            ends = self._slot_ends(joint)
            rail = self._joint(f"{joint.name}r", joint.at, 1 + driven, [], ("0", joint.guide, *ends))
        self.blocks.append((key, rail))

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
        rate = self._rpm()
        flags = encode_integer(8 + 64 + (1 if rate < 0.0 else 0)).rjust(2, "0")
        return CodedLink(flags, [encode_integer(abs(round(rate))), "0"], "1011", self.joints, links, [])

    def _rpm(self) -> float:
        if not self.linkage.inputs:
            return 0.0
        given = self.linkage.inputs[0]
        joint = next(each for each in self.linkage.joints if each.name == given.joint)
        if not isinstance(joint, PinJoint):
            return 0.0
        return given.velocity * 30.0 / pi

    def _notes(self) -> list[str]:
        linkage, rate = self.linkage, self._rpm()
        found = [
            *linkage.notes,
            "lengths are rounded to a thousandth of a cm, angles of rails to a thousandth of a radian",
        ]
        if abs(rate - round(rate)) > 1e-9:
            found.append(f"the velocity of the input is rounded to {round(rate)} rpm")
        elif linkage.inputs and linkage.inputs[0].velocity and not rate:
            found.append("the velocity of the input is not said")
        return found
