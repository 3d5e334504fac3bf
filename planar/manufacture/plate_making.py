"""The plates and pins of a linkage: bars round the points of each link, slots as long as their travel, gears."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import cos, hypot, pi, radians, sin
from typing import NamedTuple

from planar.formats.drawn.drawn_linkage import (
    DrawnLinkage,
    PinJoint,
    Place,
    SlideJoint,
    SlotJoint,
    Tracer,
    WheelJoint,
)
from planar.formats.drawn.wheels import wheel_centre
from planar.foundation.errors import BadInput
from planar.manufacture.cam_plates import CamDrive, hull_of_profile, outline_of
from planar.manufacture.gear_sizes import MeshedRack, MeshedWheel, Meshes, meshes
from planar.manufacture.involute import ADDENDUM, DEDENDUM, gear_outline
from planar.manufacture.plates import SAME_HOLE, Hole, Plate, Slot, Vertex, convex_hull, room_within, rounded_hull
from planar.manufacture.rack_teeth import rack_outline

BACKLASH = 0.02
"""Of the module: what each tooth is thinner."""
RIM = 3.0
"""Modules of a ring outside of its teeth."""


class Sizes(NamedTuple):
    """What all plates have in common (mm): pins by their names and others, the play of holes, the wall round them."""

    pin: float
    pins: Mapping[str, float]
    play: float
    wall: float

    def diameter(self, pin: str) -> float:
        """The diameter of a pin."""
        return self.pins.get(pin, self.pin)


class Pin(NamedTuple):
    """A pin: where it was drawn and on which link it is fixed, and the links whose plates it joins."""

    name: str
    at: Place
    on: str
    links: tuple[str, ...]


class Travel(NamedTuple):
    """How far the pin of a slide or slot goes along its guide from where it was drawn, to either side (mm)."""

    least: float
    greatest: float


def make_plates(
    linkage: DrawnLinkage,
    sizes: Sizes,
    travels: Mapping[str, Travel],
    pressure_angles: Mapping[str, float],
    drives: Sequence[CamDrive] = (),
    drilled: Sequence[Tracer] = (),
) -> tuple[list[Plate], list[Pin], list[tuple[str, str]]]:
    """Plates, pins, and the plates that mesh or touch, by name; the frame's first.

    `travels` are of slides and slots, of pinions along their racks, and of where cams touch flat faces, by the pairs'
    names; `drilled` are points that get a hole without a pin of a pair. Raises BadInput where a plate cannot be.
    """
    maker = _Maker(linkage, sizes, travels, drilled)
    meshed = meshes(linkage, pressure_angles)
    racks = [maker.rack(rack, travels[rack.joint]) for rack, _ in meshed.racks]
    touching = [maker.touching(drive) for drive in drives]
    plates = maker.bars(meshed.links | maker.pulleys() | {drive.cam for drive in drives})
    gears, meshing = maker.gears(meshed)
    cams = [maker.cam(drive) for drive in drives]
    meshing += [(cam.name, other.name) for cam, other in zip(cams, touching, strict=True)]
    return [*plates, *gears, *racks, *cams, *touching, *maker.discs()], maker.pins, meshing


class _Maker:
    """One linkage on its way to plates."""

    def __init__(
        self, linkage: DrawnLinkage, sizes: Sizes, travels: Mapping[str, Travel], drilled: Sequence[Tracer] = ()
    ) -> None:
        self.linkage, self.sizes, self.travels = linkage, sizes, travels
        self.holes: dict[str, dict[str, Place]] = {link: {} for link in linkage.links}
        self.slots: dict[str, list[Slot]] = {link: [] for link in linkage.links}
        self.pins: list[Pin] = []
        for joint in linkage.joints:
            if isinstance(joint, PinJoint):
                self._add_pin(joint.name, joint.at, joint.links[0], joint.links, joint.links)
            elif isinstance(joint, SlideJoint | SlotJoint):
                self._add_slot(joint, travels[joint.name])
        for point in drilled:
            holes = self.holes.get(point.link)
            if holes is not None and all(_apart(at, point.at) > SAME_HOLE * sizes.pin for at in holes.values()):
                holes[point.name] = point.at

    def _add_pin(self, name: str, at: Place, on: str, links: tuple[str, ...], drilled: tuple[str, ...]) -> None:
        self.pins.append(Pin(name, at, on, links))
        for link in drilled:
            self.holes[link][name] = at

    def _add_slot(self, joint: SlideJoint | SlotJoint, travel: Travel) -> None:
        """A slot, and the pin in it; two pins, apart by four diameters, where the link must not turn."""
        rider = joint.slider if isinstance(joint, SlideJoint) else joint.rider
        way = cos(radians(joint.angle)), sin(radians(joint.angle))
        (x, y), width = joint.at, self.sizes.diameter(joint.name)
        further = 4.0 * width if isinstance(joint, SlideJoint) else 0.0
        low, high = travel.least, travel.greatest + further
        start, end = ((x + along * way[0], y + along * way[1]) for along in (low, high))
        self.slots[joint.guide].append(Slot(joint.name, start, end, width + self.sizes.play))
        self._add_pin(joint.name, joint.at, rider, (joint.guide, rider), (rider,))
        if further:
            second = (x + further * way[0], y + further * way[1])
            self._add_pin(f"{joint.name} 2", second, rider, (joint.guide, rider), (rider,))

    def pulleys(self) -> set[str]:
        """Links that are wheels of belts and chains."""
        return {wheel for each in self.linkage.joints if isinstance(each, WheelJoint) for wheel in each.wheels}

    def _reach(self, link: str) -> float:
        widest = max(
            (
                *(self.sizes.diameter(name) for name in self.holes[link]),
                *(slot.width for slot in self.slots[link]),
                self.sizes.pin,
            )
        )
        return widest / 2.0 + self.sizes.wall

    def _cut(self, link: str) -> tuple[tuple[Hole, ...], tuple[Slot, ...]]:
        play = self.sizes.play
        holes = tuple(Hole(name, at, self.sizes.diameter(name) + play) for name, at in self.holes[link].items())
        return holes, tuple(self.slots[link])

    def bars(self, wheels: set[str]) -> list[Plate]:
        """A bar for every link, none for a wheel that has no other point than its centre."""
        found = []
        for link in self.linkage.links:
            holes, slots = self._cut(link)
            points = [hole.at for hole in holes] + [end for slot in slots for end in (slot.start, slot.end)]
            points += [each.at for each in self.linkage.tracers if each.link == link != self.linkage.frame]
            if link in wheels and len(set(points)) < 2 and link != self.linkage.frame:
                continue
            if not points:
                raise BadInput(link, "this link has no pin and no point, so there is no plate of it")
            core, reach = tuple(convex_hull(points)), self._reach(link)
            found.append(Plate(link, link, "bar", rounded_hull(core, reach), (), holes, slots, core, reach))
        found.sort(key=lambda plate: plate.link != self.linkage.frame)
        return found

    def gears(self, meshed: Meshes) -> tuple[list[Plate], list[tuple[str, str]]]:
        """A plate for each toothed wheel, once for all pairs that have the same teeth of it, and what meshes."""
        found: dict[tuple[str, int, bool], Plate] = {}

        def plate(wheel: MeshedWheel) -> str:
            key = wheel.link, wheel.teeth, wheel.internal
            if key not in found:
                several = any(link == wheel.link for link, _, _ in found)
                name = f"{wheel.link} {'ring' if wheel.internal else 'wheel'}{f' of {wheel.teeth}' if several else ''}"
                found[key] = self._ring(wheel, name) if wheel.internal else self._gear(wheel, name)
            return found[key].name

        meshing = [(plate(one), plate(other)) for one, other in meshed.gears]
        meshing += [(_rack_name(rack), plate(wheel)) for rack, wheel in meshed.racks]
        return list(found.values()), meshing

    def rack(self, rack: MeshedRack, travel: Travel) -> Plate:
        """Teeth as far as the pinion rolls and two pitches on, above a strip that two pins hold on its link's bar."""
        pin, wall, module = self.sizes.pin, self.sizes.wall, rack.module
        holes_deep = DEDENDUM * module + wall + pin / 2.0
        depth, more = holes_deep + pin / 2.0 + wall, 2.0 * pi * module
        low, high = travel.least - more, travel.greatest + more
        short = max(0.0, 2.0 * wall + 5.0 * pin - (high - low))
        low, high = low - short / 2.0, high + short / 2.0
        backlash = BACKLASH * module
        outline, teeth = rack_outline((low, high), module, rack.pressure_angle, rack.offset, backlash, depth)

        def place(along: float, up: float) -> Place:
            (x, y), (c, s) = rack.foot, rack.way
            return x + c * along - s * rack.side * up, y + s * along + c * rack.side * up

        inset = wall + pin / 2.0
        holes = self._fasten(rack.joint, rack.link, (place(low + inset, -holes_deep), place(high - inset, -holes_deep)))
        round_ = tuple((*place(x, y), 0.0) for x, y, _ in outline)
        edge = depth / 4.0
        ends = ((low, -depth), (high, -depth), (high, ADDENDUM * module), (low, ADDENDUM * module))
        core = tuple(place(x + (edge if x == low else -edge), y + (edge if y == -depth else -edge)) for x, y in ends)
        own = round_ if rack.side > 0.0 else round_[::-1]
        return Plate(_rack_name(rack), rack.link, "strip", own, (), holes, (), core, 2.0**0.5 * edge, 0, teeth, module)

    def _fasten(self, name: str, link: str, places: Sequence[Place]) -> tuple[Hole, ...]:
        """Pins that hold a plate on its link's bar, and the plate's holes for them."""
        width = self.sizes.pin + self.sizes.play
        for number, at in enumerate(places, 1):
            self._add_pin(f"{name} {number}", at, link, (link,), (link,))
        return tuple(Hole(f"{name} {number}", at, width) for number, at in enumerate(places, 1))

    def touching(self, drive: CamDrive) -> Plate:
        """What of a follower is in the cam's layer: its roller, or a shoe with its flat face."""
        return self._roller(drive) if drive.normal is None else self._shoe(drive, drive.normal)

    def _roller(self, drive: CamDrive) -> Plate:
        held = self.holes[drive.follower]
        near = (name for name, at in held.items() if _apart(at, drive.at) < 1e-6 * drive.roller)
        name = next(near, None)
        if name is None:
            name = f"{drive.name} roller"
            self._add_pin(name, drive.at, drive.follower, (drive.follower,), (drive.follower,))
        hole = Hole(name, drive.at, self.sizes.diameter(name) + self.sizes.play)
        if drive.roller < 0.75 * hole.diameter:
            told = f"its roller of radius {drive.roller:.4g} mm has no room for a pin of {hole.diameter:.4g} mm"
            raise BadInput(drive.name, f"{told}; take a smaller pin")
        outline, core = rounded_hull((drive.at,), drive.roller), (drive.at,)
        return Plate(f"{drive.name} roller", drive.follower, "roller", outline, (), (hole,), (), core, drive.roller)

    def _shoe(self, drive: CamDrive, normal: Place) -> Plate:
        pin, wall, travel = self.sizes.pin, self.sizes.wall, self.travels[drive.name]
        depth, (u, v), (x, y) = 2.0 * wall + pin, normal, drive.at
        low, high = travel.least - wall, travel.greatest + wall
        short = max(0.0, 2.0 * wall + 5.0 * pin - (high - low))
        low, high = low - short / 2.0, high + short / 2.0

        def place(along: float, up: float) -> Place:  # along to the left of the normal
            return x + u * up - v * along, y + v * up + u * along

        inset = wall + pin / 2.0
        holes = self._fasten(
            f"{drive.name} shoe", drive.follower, (place(low + inset, depth / 2.0), place(high - inset, depth / 2.0))
        )
        corners = (place(high, 0.0), place(low, 0.0), place(low, depth), place(high, depth))
        edge = depth / 4.0
        core = (
            place(high - edge, edge),
            place(low + edge, edge),
            place(low + edge, depth - edge),
            place(high - edge, depth - edge),
        )
        outline = tuple((*corner, 0.0) for corner in corners)
        return Plate(f"{drive.name} shoe", drive.follower, "shoe", outline, (), holes, (), core, 2.0**0.5 * edge)

    def cam(self, drive: CamDrive) -> Plate:
        """A cam by its profile, with the holes of its link that leave a wall within it."""
        name, wall = f"{drive.name} cam", self.sizes.wall
        held = tuple(
            hole
            for hole in self._cut(drive.cam)[0]
            if room_within(drive.profile, hole.at) >= hole.diameter / 2.0 + wall
        )
        if not any(_apart(hole.at, drive.centre) < 1e-6 * wall for hole in held):
            raise BadInput(name, "the hole of its pin leaves no wall within the profile; take a smaller pin or wall")
        core, reach = hull_of_profile(drive.profile)
        return Plate(name, drive.cam, "profile", outline_of(drive.profile), (), held, (), core, reach)

    def _gear(self, wheel: MeshedWheel, name: str) -> Plate:
        teeth = gear_outline(wheel.teeth, wheel.module, wheel.pressure_angle, wheel.phase, BACKLASH * wheel.module)
        pitch = wheel.module * wheel.teeth / 2.0
        room = pitch - DEDENDUM * wheel.module - self.sizes.wall
        holes, _ = self._cut(wheel.link)
        held = tuple(hole for hole in holes if _apart(hole.at, wheel.at) + hole.diameter / 2.0 <= room)
        if not any(_apart(hole.at, wheel.at) < 1e-9 * pitch for hole in held):
            raise BadInput(
                name, "the hole of its pin and the wall round it leave no room for the teeth; take a smaller pin"
            )
        outline = _shifted(teeth, wheel.at)
        reach = pitch + ADDENDUM * wheel.module
        return Plate(name, wheel.link, "wheel", outline, (), held, (), (wheel.at,), reach, 0, wheel.teeth, wheel.module)

    def _ring(self, wheel: MeshedWheel, name: str) -> Plate:
        teeth = gear_outline(
            wheel.teeth, wheel.module, wheel.pressure_angle, wheel.phase, BACKLASH * wheel.module, internal=True
        )
        reach = wheel.module * wheel.teeth / 2.0 + (DEDENDUM + RIM) * wheel.module
        outline, inside = rounded_hull((wheel.at,), reach), (_shifted(teeth, wheel.at),)
        return Plate(
            name, wheel.link, "ring", outline, inside, (), (), (wheel.at,), reach, 0, wheel.teeth, wheel.module
        )

    def discs(self) -> list[Plate]:
        """Wheels of belts and chains as discs of their pitch radius, which are bought rather than cut."""
        found = []
        for joint in self.linkage.joints:
            if not isinstance(joint, WheelJoint) or joint.meshes or joint.size_kind != "radii":
                continue
            for wheel, radius in zip(joint.wheels, joint.sizes, strict=True):
                centre = wheel_centre(self.linkage.joints, wheel, joint.carrier)
                if centre is not None:
                    holes = tuple(hole for hole in self._cut(wheel)[0] if _apart(hole.at, centre) < 1e-9 * radius)
                    outline = rounded_hull((centre,), radius)
                    found.append(Plate(f"{wheel} pulley", wheel, "disc", outline, (), holes, (), (centre,), radius))
        return found


def _rack_name(rack: MeshedRack) -> str:
    return f"{rack.joint} rack"


def _shifted(loop: tuple[Vertex, ...], at: Place) -> tuple[Vertex, ...]:
    return tuple((x + at[0], y + at[1], bulge) for x, y, bulge in loop)


def _apart(one: Place, other: Place) -> float:
    return hypot(one[0] - other[0], one[1] - other[1])
