"""Teeth, modules and phases of the gears and racks of a linkage, so that all of them mesh where it was drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import atan2, cos, hypot, pi, radians, sin
from typing import NamedTuple

from planar.formats.drawn.drawn_linkage import DrawnLinkage, Place, RackJoint, WheelJoint
from planar.formats.drawn.wheels import wheel_centre, wheel_ratio
from planar.foundation.errors import BadInput

MODULES = (0.5, 0.6, 0.8, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
"""Of series I of ISO 54 (mm), for which cutters and other gears are sold."""
LEAST_TEETH, MOST_TEETH = 17, 60
"""Of the smallest gear: with fewer than 17 teeth of 20 degrees the root is undercut."""
WHOLE = 1e-6


class MeshedWheel(NamedTuple):
    """A toothed wheel: its link, centre (mm), teeth, module, and the polar angle of a tooth, or of a ring's space."""

    joint: str
    link: str
    at: tuple[float, float]
    teeth: int
    module: float
    phase: float
    internal: bool
    pressure_angle: float


class MeshedRack(NamedTuple):
    """A rack: its link, a place of its pitch line (mm) and the line's direction (unit) and how far on a tooth stands.

    Teeth point to the left of the direction where `side` is 1, to the right where it is -1.
    """

    joint: str
    link: str
    foot: Place
    way: Place
    side: float
    module: float
    offset: float
    pressure_angle: float


class Meshes(NamedTuple):
    """The two wheels of every pair of gears, and every rack with its pinion."""

    gears: list[tuple[MeshedWheel, MeshedWheel]]
    racks: list[tuple[MeshedRack, MeshedWheel]]

    @property
    def links(self) -> set[str]:
        """Those that are wheels."""
        return {wheel.link for two in self.gears for wheel in two} | {wheel.link for _, wheel in self.racks}


def meshes(linkage: DrawnLinkage, pressure_angles: Mapping[str, float]) -> Meshes:
    """All that has teeth. Raises BadInput where a pair has no centres apart, no whole teeth, or none that can mesh."""
    gears = [each for each in linkage.joints if isinstance(each, WheelJoint) and each.meshes]
    racks = [each for each in linkage.joints if isinstance(each, RackJoint)]
    sizes = {each.name: _pitch_radii(each, linkage) for each in gears}
    pitch_radii = [radius for both, _ in sizes.values() for radius in both]
    module = _common_module([*pitch_radii, *(abs(each.radius) for each in racks)])
    for name in [*(each.name for each in gears), *(each.name for each in racks)]:
        if pressure_angles[name] <= 0.0:
            told = "teeth of a pressure angle of 0 do not roll on each other: that is a strap, or a drive by friction"
            raise BadInput(name, told)
    phases: dict[tuple[str, int], float] = {}
    found = []
    for joint in gears:
        radii, centres = sizes[joint.name]
        teeth = _teeth(joint, radii, module)
        own = 2.0 * radii[0] / teeth[0]
        inside = radii[0] > radii[1] if wheel_ratio(joint) > 0.0 else None
        internal = (inside is True, inside is False)
        ways = _ways_to_contact(centres, internal)
        phase = _phases(joint, teeth, ways, internal, phases)
        angle = pressure_angles[joint.name]
        first, second = (
            MeshedWheel(joint.name, joint.wheels[i], centres[i], teeth[i], own, phase[i], internal[i], angle)
            for i in (0, 1)
        )
        found.append((first, second))
    return Meshes(found, [_rack(each, module, phases, pressure_angles[each.name]) for each in racks])


def _rack(
    joint: RackJoint, module: float | None, phases: dict[tuple[str, int], float], pressure_angle: float
) -> tuple[MeshedRack, MeshedWheel]:
    """A rack whose spaces take the pinion's teeth: as these stand by another pair, or one on the way to the rack."""
    size = abs(joint.radius)
    teeth = joint.teeth or (LEAST_TEETH if module is None else round(2.0 * size / module))
    own, (x, y), foot = 2.0 * size / teeth, joint.at, joint.contact
    way = atan2(foot[1] - y, foot[0] - x)
    phase = phases.setdefault((joint.pinion, teeth), way)
    offset = joint.radius * (phase - way) + pi * own / 2.0
    line = cos(radians(joint.angle)), sin(radians(joint.angle))
    side = 1.0 if joint.radius > 0.0 else -1.0
    rack = MeshedRack(joint.name, joint.rack, foot, line, side, own, offset, pressure_angle)
    return rack, MeshedWheel(joint.name, joint.pinion, (x, y), teeth, own, phase, False, pressure_angle)


def _pitch_radii(
    joint: WheelJoint, linkage: DrawnLinkage
) -> tuple[tuple[float, float], tuple[tuple[float, float], tuple[float, float]]]:
    centres = [wheel_centre(linkage.joints, wheel, joint.carrier) for wheel in joint.wheels]
    ratio = wheel_ratio(joint)
    if centres[0] is None or centres[1] is None or ratio == 1.0:
        raise BadInput(joint.name, "its wheels have no two pins on a common link, so no place where teeth would meet")
    apart = hypot(centres[1][0] - centres[0][0], centres[1][1] - centres[0][1])
    if apart == 0.0:
        raise BadInput(joint.name, "its wheels turn about one place, so no teeth of theirs meet")
    second = apart / abs(1.0 - ratio)
    return (abs(ratio) * second, second), (centres[0], centres[1])


def _common_module(radii: Sequence[float]) -> float | None:
    """A module by which all wheels have whole teeth, the largest that is sold if there is one; else None."""
    if not radii:
        return None
    least = 2.0 * min(radii)
    sold = [each for each in MODULES[::-1] if LEAST_TEETH <= least / each <= MOST_TEETH + WHOLE]
    for module in (*sold, *(least / teeth for teeth in range(LEAST_TEETH, MOST_TEETH + 1))):
        teeth = least / module
        if all(abs(2.0 * radius / module - round(2.0 * radius / module)) < WHOLE * teeth for radius in radii):
            return module
    return None


def _teeth(joint: WheelJoint, radii: tuple[float, float], module: float | None) -> tuple[int, int]:
    """The numbers of teeth: the file's, those by the common module, else the least whole ones of the ratio."""
    if joint.size_kind == "teeth":
        return abs(round(joint.sizes[0])), abs(round(joint.sizes[1]))
    if module is not None:
        return round(2.0 * radii[0] / module), round(2.0 * radii[1] / module)
    share = Fraction(radii[0] / radii[1]).limit_denominator(200)
    if share == 0 or abs(float(share) * radii[1] / radii[0] - 1.0) > WHOLE:
        raise BadInput(joint.name, "its ratio is none of whole numbers of teeth up to 200")
    times = -(-LEAST_TEETH // min(share.numerator, share.denominator))
    return share.numerator * times, share.denominator * times


def _ways_to_contact(
    centres: tuple[tuple[float, float], tuple[float, float]], internal: tuple[bool, bool]
) -> tuple[float, float]:
    """The polar angle, about each centre, of where the wheels touch."""
    (x, y), (u, v) = centres
    way = atan2(v - y, u - x)
    if internal[0]:
        return way, way
    return (way + pi, way + pi) if internal[1] else (way, way + pi)


def _phases(
    joint: WheelJoint,
    teeth: tuple[int, int],
    ways: tuple[float, float],
    internal: tuple[bool, bool],
    known: dict[tuple[str, int], float],
) -> tuple[float, float]:
    """Where each wheel has a tooth, so that a tooth of one meets a space of the other on the line of centres.

    A wheel that has its teeth by another pair keeps them, and the other follows: measured in pitches, along the pitch
    circles from where they touch, teeth are where spaces are. A ring's spaces are what its outline has as teeth.
    """
    keys = [*zip(joint.wheels, teeth, strict=True)]
    first = known.get(keys[0])
    second = known.get(keys[1])

    def follow(angle: float, one: int, other: int) -> float:
        """The angle of a tooth of the other wheel: outside wheels pass with opposite senses, in a ring alike."""
        offset = (angle - ways[one]) * teeth[one] / (2.0 * pi)
        return ways[other] + (offset if any(internal) else -(offset + 0.5)) * 2.0 * pi / teeth[other]

    if first is None:
        first = ways[0] if second is None else follow(second, 1, 0)
    if second is None:
        second = follow(first, 0, 1)
    apart = (second - follow(first, 0, 1)) * teeth[1] / (2.0 * pi)
    if abs(apart - round(apart)) > 1e-6:
        raise BadInput(joint.name, "these wheels close a ring of gears, and their teeth do not meet all round it")
    known[keys[0]], known[keys[1]] = first, second
    return first, second
