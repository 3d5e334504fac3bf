"""A linkage as a file of the program Linkage."""

from __future__ import annotations

from math import cos, hypot, pi, radians, sin
from xml.sax.saxutils import quoteattr

from planar.formats.drawn.blocks import near, slots_for_blocks
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    WheelJoint,
    joint_phrase,
)
from planar.formats.drawn.file_format import WrittenText, cannot_say
from planar.formats.drawn.wheels import wheel_centre, wheel_ratio

TITLE = "Linkage (Rector)"
PIXELS_PER_MILLIMETRE = 96.0 / 25.4
"""Coordinates are pixels of 1/96 inch: 18.897638 of them are the 5 mm of a drawing's grid."""
MILLIMETRES = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4}


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
        places = [each.at for each in (*linkage.joints, *linkage.tracers) if not isinstance(each, WheelJoint)]
        self.reach = max((hypot(x - places[0][0], y - places[0][1]) for x, y in places), default=1.0) or 1.0

    def write(self) -> WrittenText:
        linkage = self.linkage
        driven = {each.joint for each in linkage.inputs}
        for joint in linkage.joints:
            if isinstance(joint, PinJoint):
                self._pin(joint, [each for each in linkage.inputs if each.joint == joint.name])
            elif isinstance(joint, SlideJoint | SlotJoint):
                if joint.name in driven:
                    raise cannot_say(TITLE, f"the input at {joint.name!r}", "its inputs turn a link on the frame")
                self._slide(joint)
            elif isinstance(joint, WheelJoint):
                self.gears.append(joint)
            else:
                raise cannot_say(TITLE, joint_phrase(joint))
        for tracer in linkage.tracers:
            self._connector(tracer.name, tracer.at, [tracer.link], 'draw="true"')
        ids = {link: number for number, link in enumerate(self.members)}
        ratios = [self._ratio(each, ids) for each in self.gears]
        wheels = {wheel for each in self.gears for wheel in each.wheels}
        lines = ["<linkage2>", '\t<program zoom="1" units="Millimeters"/>', *self.connectors]
        for link, numbers in self.members.items():
            gear = ' gear="true"' if link in wheels else ""
            lines.append(f'\t<Link id="{ids[link]}" name={quoteattr(link)} layer="16" linesize="1" solid="true"{gear}>')
            lines += [f'\t\t<connector id="{number}"/>' for number in numbers] + ["\t</Link>"]
        lines += ["\t<ratios>", *ratios, "\t</ratios>"] if ratios else []
        lines.append("</linkage2>")
        return WrittenText("\n".join(lines) + "\n", linkage.notes)

    def _connector(self, name: str, at: Place, links: list[str], more: str = "", inside: tuple[int, ...] = ()) -> int:
        number = len(self.connectors)
        self.at.append(at)
        x, y = at[0] * self.scale, at[1] * self.scale
        head = f'\t<connector id="{number}" name={quoteattr(name)} layer="16" x="{x!r}" y="{y!r}"'
        head += f" {more}" if more else ""
        limits = "".join(f'<slidelimit id="{each}"/>' for each in inside)
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
                told = f"the input of {given.links[1]!r} against {given.links[0]!r}"
                raise cannot_say(TITLE, told, "its inputs turn a link on the frame")
            other = next(each for each in given.links if each != frame)
            rate = given.velocity * 30.0 / pi * (-1.0 if given.links[1] == other else 1.0)
            name = f"{joint.name}_{number}" if number else joint.name
            self._connector(name, joint.at, [other], f'anchor="true" input="true" rpm="{rate!r}"')
            rest.remove(other)
        if not driven:
            self._connector(joint.name, joint.at, rest, anchor)
        elif set(rest) - {frame}:
            self._connector(f"{joint.name}_fixed", joint.at, rest, anchor)

    def _slide(self, joint: SlideJoint | SlotJoint) -> None:
        """A connector in the slot between two of its guide; two of them, where the link must not turn."""
        rider = joint.slider if isinstance(joint, SlideJoint) else joint.rider
        (x, y), way = joint.at, (cos(radians(joint.angle)), sin(radians(joint.angle)))
        anchor = 'anchor="true"' if joint.guide == self.linkage.frame else ""
        ends = ((x + s * self.reach * way[0], y + s * self.reach * way[1]) for s in (-1.5, 1.5))
        limits = tuple(self._connector(f"{joint.name}_end", at, [joint.guide], anchor) for at in ends)
        more = 'slider="true"' + (' anchor="true"' if rider == self.linkage.frame else "")
        if rider == self.linkage.frame and isinstance(joint, SlideJoint):
            raise cannot_say(TITLE, f"the slide {joint.name!r} of a moving link on the frame")
        self._connector(joint.name, joint.at, [rider], more, limits)
        if isinstance(joint, SlideJoint):
            second = (x + 0.25 * self.reach * way[0], y + 0.25 * self.reach * way[1])
            self._connector(f"{joint.name}_guided", second, [rider], more, limits)

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
