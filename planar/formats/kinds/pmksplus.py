"""Links of PMKS+ (app.pmksplus.com): the whole mechanism in the address, which is read and not opened."""

from __future__ import annotations

import re
from math import atan2, degrees, hypot
from urllib.parse import unquote

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnForce,
    DrawnInput,
    DrawnLinkage,
    DrawnStop,
    Joint,
    PinJoint,
    SlideJoint,
    SlotJoint,
    Tracer,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links_of_two_pins, without_loose_links
from planar.formats.kinds.parts.pmksplus_code import (
    DRIVEN,
    GROUNDED,
    PRISMATIC,
    SEALED,
    WELDED,
    PlusJoint,
    PlusMechanism,
    decode_mechanism,
)
from planar.formats.kinds.parts.pmksplus_query import decode_query
from planar.formats.kinds.parts.pmksplus_text import cylinder_travel, write
from planar.formats.texts.names import NameBook
from planar.foundation.errors import BadInput

FRAME = "ground"
CODE = re.compile(r"(?:https?://[\w.:/-]+\?|\?)?([\w-]{1,6}\.[\w,-]*\.[\w,-]*\.[\w-]{3,5}\.[^\n?&#]+)")
QUERY = re.compile(r"(?:https?://[\w.:/-]+)?\??j=[^&]*&l=.*", re.DOTALL)
SNAP = 5e-4
"""Rounding of a link's angles (rad): one this near to a multiple of 15 degrees is meant to be that."""
ROUNDED = 2e-3
"""Rounding of a link's lengths: a cylinder this far beyond an end of its stroke is at that end."""


def recognise(source: ForeignText) -> bool:
    """Whether it is an address of PMKS+, or the code of one."""
    if source.value is not None or len(source.text) > 200_000:
        return False
    text = unquote(source.text.strip())
    if QUERY.fullmatch(text):
        return True
    result = CODE.fullmatch(text)
    return result is not None and result[1].count(",") > 4


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a link. Raises BadInput."""
    text = unquote(source.text.strip())
    code = CODE.fullmatch(text)
    if QUERY.fullmatch(text):
        mechanism = decode_query(text, source.place)
    elif code is not None:
        mechanism = decode_mechanism(code[1], source.place)
    else:
        raise BadInput(source.place, "this is no link of PMKS+")
    linkage = _Reader(mechanism, source).read()
    return drawn_document(without_loose_links(merge_links_of_two_pins(linkage)), source.place)


class _Reader:
    """One link on its way to a linkage."""

    def __init__(self, mechanism: PlusMechanism, source: ForeignText) -> None:
        self.mechanism, self.place, self.source = mechanism, source.place, source
        self.book = NameBook({FRAME})
        self.notes = list(mechanism.notes)
        self.stops: list[DrawnStop] = []
        self.links: dict[str, tuple[str, ...]] = {}
        self.blocks: dict[str, str] = {}
        "the prismatic joint of each pin that a block carries"
        self.ids: dict[str, str] = {}
        for key, link in mechanism.links.items():
            for item in link.joints:
                if item not in mechanism.joints:
                    raise BadInput(self.place, f"the link {key!r:.40} names a joint {item!r:.40} that is not there")
            if link.is_block:
                pin, rail = self._block(link.joints)
                self.blocks[pin] = rail
                continue
            name = self.book.fresh(link.name, "link")
            self.links[name] = link.joints
            self.ids |= dict.fromkeys((key, *link.parts), name)

    def flags(self, joint: str) -> int:
        return self.mechanism.joints[joint].flags

    def _place_of(self, joint: str) -> str:
        return f"{self.place}, joint {joint}"

    def read(self) -> DrawnLinkage:
        mechanism = self.mechanism
        names = {key: self.book.fresh(joint.name, "joint") for key, joint in mechanism.joints.items()}
        joints: list[Joint] = []
        tracers: list[Tracer] = []
        inputs: list[DrawnInput] = []
        for key, joint in mechanism.joints.items():
            holders = [link for link, members in self.links.items() if key in members]
            is_prismatic = bool(joint.flags & PRISMATIC)
            rail = key if is_prismatic and holders else self.blocks.get(key)
            is_grounded = bool(joint.flags & GROUNDED) and not is_prismatic
            members = tuple(([FRAME] if is_grounded else []) + holders)
            if rail is not None:
                made = self._sliding(names, key, rail, members)
                joints += made
                slide = made[-1] if made else None
                if self.flags(rail) & DRIVEN and isinstance(slide, SlideJoint | SlotJoint):
                    rider = slide.slider if isinstance(slide, SlideJoint) else slide.rider
                    inputs.append(DrawnInput(slide.name, (slide.guide, rider), self._linear_speed(rail, slide.name)))
            elif len(members) == 1 and not is_grounded:
                tracers.append(Tracer(names[key], members[0], joint.at))
            elif len(members) > 1:
                joints.append(PinJoint(names[key], members, joint.at))
            if joint.flags & DRIVEN and not is_prismatic and len(members) > 1:
                rpm = joint.speed * (-1.0 if mechanism.rpm < 0.0 else 1.0) or mechanism.rpm
                inputs.append(DrawnInput(names[key], (members[0], members[1]), rpm, "rpm"))
        if any(link.mass for link in mechanism.links.values() if not link.is_block):
            self.notes.append("masses of links are left out: the link does not say their unit")
        return DrawnLinkage(
            self.source.title,
            FRAME,
            tuple(joints),
            tuple(tracers),
            tuple(inputs),
            forces=tuple(self._forces()),
            stops=tuple(self.stops),
            length=mechanism.length,
            links=(FRAME, *self.links),
            notes=tuple(self.notes),
        )

    def _linear_speed(self, rail: str, name: str) -> float:
        """The speed of a driven slide: its own or that of the link."""
        speed = self.mechanism.linear_speed
        if speed is None:
            self.notes.append(f"the driven slide {name!r} rests: the link does not say its speed")
            return 0.0
        return self.mechanism.joints[rail].speed * (-1.0 if speed < 0.0 else 1.0) or speed

    def _block(self, joints: tuple[str, ...]) -> tuple[str, str]:
        """The pin and the prismatic joint that a block connects."""
        rails = [item for item in joints if self.flags(item) & PRISMATIC]
        pins = [item for item in joints if item not in rails]
        if len(rails) != 1 or len(pins) != 1:
            raise BadInput(self.place, f"a block joins one pin and one slide, not {', '.join(joints)!r:.60}")
        return pins[0], rails[0]

    def _sliding(self, names: dict[str, str], pin: str, rail: str, members: tuple[str, ...]) -> list[Joint]:
        """The pin of a block, and its slot in the frame or in a moving link."""
        slot, at = self.mechanism.joints[rail].slot, self.mechanism.joints[pin].at
        if not members:
            return []
        if slot is None:
            guide, through = FRAME, at
            angle = self._angle(self.mechanism.joints[rail].angle)
        else:
            guide, start, end = self._slot(rail, slot)
            angle, through = degrees(atan2(end.at[1] - start.at[1], end.at[0] - start.at[0])), start.at
        riders = [item for item in members if item != guide]
        if not riders:
            raise BadInput(self._place_of(rail), "it slides on the link that carries it")
        name = names[pin]
        is_rigid = bool((self.flags(pin) & WELDED) or (self.flags(rail) & (WELDED | SEALED)))
        if len(riders) == 1 or self.flags(rail) & SEALED:
            kind = SlideJoint if is_rigid else SlotJoint
            made = kind(name, guide, riders[0], at, angle, through)
            if slot is not None and self.flags(rail) & SEALED:
                self._add_stroke(made, pin, slot)
            pins: list[Joint] = [PinJoint(self.book.fresh(f"{name}_pin"), tuple(riders), at)] if riders[1:] else []
            return [*pins, made]
        slot_name = self.book.fresh(f"{name}_slot")
        return [PinJoint(name, tuple(riders), at), SlotJoint(slot_name, guide, riders[0], at, angle, through)]

    def _slot(self, rail: str, slot: tuple[str, str, str]) -> tuple[str, PlusJoint, PlusJoint]:
        """The link of a slot, and the joints between which it lies."""
        link, *ends = slot
        joints = self.mechanism.joints
        if link not in self.ids or ends[0] not in joints or ends[1] not in joints:
            raise BadInput(self._place_of(rail), "its slot is of a link or between joints that are not there")
        start, end = joints[ends[0]], joints[ends[1]]
        if start.at == end.at:
            raise BadInput(self._place_of(rail), "the ends of its slot coincide, so it has no direction")
        return self.ids[link], start, end

    def _add_stroke(self, slide: SlideJoint | SlotJoint, pin: str, slot: tuple[str, str, str]) -> None:
        """The stops of a hydraulic cylinder, by the length of its barrel and the scale of the drawn parts.

        The barrel's mount is that of its two joints that is farther from the rod's mount.
        """
        joints = self.mechanism.joints
        rod = next((m for m in self.links.values() if pin in m and len(m) == 2), None)
        mounts = [joints[item].at for item in slot[1:]]
        if rod is not None:
            far = joints[next(item for item in rod if item != pin)].at
            mounts.sort(key=lambda at: -hypot(at[0] - far[0], at[1] - far[1]))
        (x, y), (u, v) = mounts
        barrel = hypot(u - x, v - y)
        position = ((slide.at[0] - x) * (u - x) + (slide.at[1] - y) * (v - y)) / barrel
        low, high = cylinder_travel(barrel, self.mechanism.scale)
        least, greatest = low - position, high - position
        phrase = f"the cylinder at {slide.name!r} has a stroke of {high - low:.6g} {self.mechanism.length}"
        if least > ROUNDED or greatest < -ROUNDED or not low < high:
            self.notes.append(f"{phrase}, but was drawn {max(least, -greatest):.3g} beyond it; it has no stops here")
            return
        if mounts[0] != joints[slot[1]].at:
            least, greatest = -greatest, -least
        riding = slide.slider if isinstance(slide, SlideJoint) else slide.rider
        self.stops.append(DrawnStop(slide.name, (slide.guide, riding), min(least, 0.0), max(greatest, 0.0)))

    def _angle(self, angle: float) -> float:
        """An angle of a rail (rad) in degrees: 1.571 is 90, where that is what was rounded."""
        given = degrees(angle)
        nearest = 15.0 * round(given / 15.0)
        if given != nearest and abs(given - nearest) <= degrees(SNAP):
            message = "angles that are rounded in the link are taken as the multiples of 15 degrees that they round"
            if message not in self.notes:
                self.notes.append(message)
            return nearest
        return given

    def _forces(self) -> list[DrawnForce]:
        newton = 4.4482216152605 if self.mechanism.force == "lbf" else 1.0
        forces = []
        for force in self.mechanism.forces:
            if force.link not in self.ids:
                raise BadInput(
                    self.place, f"the force {force.name!r:.40} is on a link {force.link!r:.40} that is not there"
                )
            (x, y), (u, v) = force.start, force.end
            length = hypot(u - x, v - y)
            if length == 0.0:
                self.notes.append(f"the force {force.name!r} has no direction and is left out")
                continue
            size = force.magnitude * newton * (1.0 if force.is_outward else -1.0)
            vector = (size * (u - x) / length, size * (v - y) / length)
            forces.append(DrawnForce(self.ids[force.link], (x, y), vector, force.is_local))
        return forces


FORMAT = FileFormat(
    name="pmksplus",
    title="PMKS+ (link)",
    suffixes=(".pmksplus",),
    source="src/app/services/transcoding of PMKS-Web/PMKSWeb, url-processor.service.ts of 2023, docs/fixture-urls.md",
    recognise=recognise,
    read=read,
    write=write,
    precision="thousandths of the unit of length and of a radian",
    links=("https://app.pmksplus.com/?CODE", "https://app.pmksplus.com/?j=...&l=...&f=...&s=..."),
)
