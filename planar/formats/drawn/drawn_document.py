"""A drawn linkage to the value of a planar file: each link carries its points where they were drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import atan2, cos, degrees, hypot, radians, sin
from typing import Any

from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    Joint,
    PinJoint,
    Place,
    RackJoint,
    SlideJoint,
    SlotJoint,
    Tracer,
    WheelJoint,
    joined_links,
    position_on_line,
)
from planar.formats.drawn.file_format import ReadDocument
from planar.formats.drawn.rigid_links import without_rigid_motions
from planar.foundation.errors import BadInput

COINCIDENT = 1e-9
"""Of the drawing's size: points that are nearer to each other give no direction."""


def drawn_document(linkage: DrawnLinkage, place: str) -> ReadDocument:
    """The planar file of a linkage, in its own coordinates, its position as drawn. Raises BadInput.

    A link's angle is the direction from its first point to its second in the drawing; that of one with a single point
    is 0 as drawn, as is the frame's. What the linkage has to say of what was left out stands in the file's notes.
    """
    merged = without_rigid_motions(_with_links_held(linkage), place)
    if not merged.joints:
        raise BadInput(place, "there is no joint in this file, so nothing moves")
    return _Writer(merged).write()


def _with_links_held(linkage: DrawnLinkage) -> DrawnLinkage:
    """The linkage without pins of one link, which are points of it."""
    single = [item for item in linkage.joints if isinstance(item, PinJoint) and len(item.links) < 2]
    tracers = (*linkage.tracers, *(Tracer(item.name, item.links[0], item.at) for item in single if item.links))
    return replace(linkage, joints=tuple(item for item in linkage.joints if item not in single), tracers=tracers)


class _Writer:
    """One linkage on its way into a file."""

    def __init__(self, linkage: DrawnLinkage) -> None:
        self.linkage = linkage
        self.points = _points_of_links(linkage)
        self.axes = {link: axis for link in self.points if (axis := self._axis(link))}

    def _axis(self, link: str) -> tuple[str, str] | None:
        """Two points of a moving link that are apart."""
        points = self.points[link]
        if link == self.linkage.frame or not points:
            return None
        places = [at for item in self.points.values() for at in item.values()]
        size = max(hypot(x - places[0][0], y - places[0][1]) for x, y in places)
        (first, start), *others = points.items()
        apart = (name for name, (x, y) in others if hypot(x - start[0], y - start[1]) > COINCIDENT * size)
        second = next(apart, None)
        return (first, second) if second is not None else None

    def angle(self, link: str) -> float:
        """The link's angle as drawn (degrees)."""
        if link not in self.axes:
            return 0.0
        first, second = (self.points[link][name] for name in self.axes[link])
        return degrees(atan2(second[1] - first[1], second[0] - first[0]))

    def write(self) -> ReadDocument:
        linkage = self.linkage
        value: dict[str, Any] = {"planar": 1, "name": linkage.title or "mechanism"}
        if linkage.notes:
            value["notes"] = list(linkage.notes)
        value |= {"units": {"length": linkage.length, "angle": "deg"}, "frame": linkage.frame}
        value["links"] = {link: self._link(link) for link in self.points}
        value["pairs"] = [self._pair(joint) for joint in linkage.joints]
        if linkage.inputs:
            value["inputs"] = [self._input(item) for item in linkage.inputs]
        value |= self._acting()
        value["sketch"] = self._sketch()
        return ReadDocument(value, linkage.notes)

    def _link(self, link: str) -> dict[str, Any]:
        if link in self.linkage.curved_slots and link in self.axes and len(self.points[link]) == 2:
            (x, y), (u, v) = self.points[link].values()
            return {"ends": list(self.points[link]), "length": hypot(u - x, v - y), "curved_slot": True}
        result: dict[str, Any] = {"points": {name: list(at) for name, at in self.points[link].items()}}
        return result | ({"axis": list(self.axes[link])} if link in self.axes else {})

    def _pair(self, joint: Joint) -> dict[str, Any]:
        if isinstance(joint, PinJoint):
            return {"turning": joint.name, "links": list(joint.links)} | self._stops(joint)
        if isinstance(joint, SlideJoint):
            entry = {"sliding": joint.name, "links": [joint.guide, joint.slider], **self._line(joint)}
            return entry | {"turn": self.angle(joint.slider) - joint.angle} | self._stops(joint)
        if isinstance(joint, SlotJoint):
            return {"slot": joint.name, "links": [joint.guide, joint.rider], **self._line(joint)} | self._stops(joint)
        if isinstance(joint, RackJoint):
            return self._rack(joint)
        return self._wheels(joint)

    def _line(self, joint: SlideJoint | SlotJoint) -> dict[str, Any]:
        through = joint.at if joint.through is None else joint.through
        line = {"through": list(through), "angle": joint.angle - self.angle(joint.guide)}
        return {"line": line, "point": joint.name}

    def _rack(self, joint: RackJoint) -> dict[str, Any]:
        line = {"through": list(joint.contact), "angle": joint.angle - self.angle(joint.rack)}
        entry: dict[str, Any] = {"rack": joint.name, "links": [joint.rack, joint.pinion], "line": line}
        entry |= {"point": joint.name, "radius": joint.radius}
        turned = self.angle(joint.pinion) - self.angle(joint.rack)
        return entry | ({"mesh": {"displacement": 0, "angle": turned}} if turned else {})

    def _wheels(self, joint: WheelJoint) -> dict[str, Any]:
        sizes = joint.sizes[0] if joint.size_kind == "ratio" else list(joint.sizes)
        entry: dict[str, Any] = {joint.kind: joint.name, "links": list(joint.wheels), "carrier": joint.carrier}
        entry[joint.size_kind] = sizes
        if joint.crossed:
            entry["crossed"] = True
        mesh = {wheel: self.angle(wheel) - self.angle(joint.carrier) for wheel in joint.wheels}
        return entry | ({"mesh": mesh} if any(mesh.values()) else {})

    def _stops(self, joint: PinJoint | SlideJoint | SlotJoint) -> dict[str, Any]:
        """The stops of a joint as the keys of its entry; nothing where it has none."""
        limits: dict[str, list[float | None]] = {}
        restitution = 0.0
        for stop in self.linkage.stops:
            if stop.joint != joint.name:
                continue
            low, high, position, name = stop.low, stop.high, 0.0, joint.name
            if isinstance(joint, PinJoint):
                name, position, is_forward = self._pin_motion(joint, stop.links)
                low, high = (None if value is None else degrees(value) for value in (low, high))
                if not is_forward:
                    low, high = (None if value is None else -value for value in (high, low))
            else:
                position = position_on_line(joint)
            limits[name] = [None if value is None else position + value for value in (low, high)]
            restitution = max(restitution, stop.restitution)
        if not limits:
            return {}
        is_single = not isinstance(joint, PinJoint) or len(joint.links) == 2
        entry: dict[str, Any] = {"stops": limits[joint.name] if is_single else limits}
        return entry | ({"restitution": restitution} if restitution else {})

    def _input(self, given: DrawnInput) -> dict[str, Any]:
        joint = next(item for item in self.linkage.joints if item.name == given.joint)
        if isinstance(joint, PinJoint):
            return self._pin_input(given, joint)
        entry: dict[str, Any] = {"pair": joint.name, "position": 0}
        if isinstance(joint, SlideJoint | SlotJoint) and joint.through is not None:
            entry["position"] = position_on_line(joint)
        return entry | _rate(given.velocity, given.unit or f"{self.linkage.length}/s") | _law(given, entry["position"])

    def _pin_input(self, given: DrawnInput, joint: PinJoint) -> dict[str, Any]:
        name, position, is_forward = self._pin_motion(joint, given.links)
        rate = _rate(given.velocity if is_forward else -given.velocity, given.unit or "rad/s")
        turned = given if is_forward else given._replace(table=_reversed(given))
        return {"pair": name, "position": position} | rate | _law(turned, position, degrees)

    def _pin_motion(self, joint: PinJoint, links: tuple[str, str]) -> tuple[str, float, bool]:
        """The name and position (degrees) of a relative motion at a pin, and whether it grows as `links` say.

        At a pin on the frame it is the angle of the other link, elsewhere that of the later link against the earlier.
        """
        first, second = sorted(links, key=joint.links.index)
        name = joint.name if len(joint.links) == 2 else f"{joint.name}:{first},{second}"
        if self.linkage.frame in links:
            other = first if second == self.linkage.frame else second
            return name, self.angle(other), links[1] == other
        return name, self.angle(second) - self.angle(first), links[1] == second

    def _acting(self) -> dict[str, Any]:
        """Masses, loads and gravity, each in SI."""
        linkage, result = self.linkage, dict[str, Any]()
        if linkage.masses:
            result["masses"] = [
                {"link": item.link, "mass": f"{item.mass!r} kg", "at": list(item.at)}
                | ({"inertia": f"{item.inertia!r} kg m^2"} if item.inertia else {})
                for item in linkage.masses
            ]
        if linkage.forces:
            result["loads"] = [self._force(index) for index in range(len(linkage.forces))]
        if any(linkage.gravity):
            result["gravity"] = [f"{item!r} m/s^2" for item in linkage.gravity]
        return result

    def _force(self, index: int) -> dict[str, Any]:
        given = self.linkage.forces[index]
        point = next(name for name, at in self.points[given.link].items() if at == given.at)
        x, y = given.force
        if not given.turns or given.link == self.linkage.frame:
            return {"point": f"{given.link}.{point}", "force": [f"{x!r} N", f"{y!r} N"]}
        back = radians(-self.angle(given.link))
        turned = (cos(back) * x - sin(back) * y, sin(back) * x + cos(back) * y)
        return {"point": f"{given.link}.{point}", "force": [f"{e!r} N" for e in turned], "axes": given.link}

    def _sketch(self) -> dict[str, list[float]]:
        """Where the moving joints and points are: exactly where they were drawn."""
        frame = self.points[self.linkage.frame]
        return {
            name: list(at)
            for link, points in self.points.items()
            if link != self.linkage.frame
            for name, at in points.items()
            if name not in frame
        }


def _rate(velocity: float, unit: str) -> dict[str, str]:
    """The velocity of an input as a text; nothing where it rests."""
    return {"velocity": f"{velocity!r} {unit}"} if velocity else {}


def _law(given: DrawnInput, position: float, unit: Callable[[float], float] = float) -> dict[str, Any]:
    """The course of an input in time from its position on; nothing where it is even."""
    if given.table is None:
        return {}
    times, moved = given.table
    positions = [position + unit(item) for item in moved]
    return {"law": [{"motion": "table", "times": list(times), "positions": positions}]}


def _reversed(given: DrawnInput) -> tuple[tuple[float, ...], tuple[float, ...]] | None:
    return None if given.table is None else (given.table[0], tuple(-item for item in given.table[1]))


def _points_of_links(linkage: DrawnLinkage) -> dict[str, dict[str, Place]]:
    """The points that each link carries; links that nothing holds are not among them."""
    order = dict.fromkeys((linkage.frame, *linkage.links, *(link for j in linkage.joints for link in joined_links(j))))
    held = {linkage.frame, *(link for joint in linkage.joints for link in joined_links(joint))}
    points: dict[str, dict[str, Place]] = {link: {} for link in order if link in held}
    for joint in linkage.joints:
        if isinstance(joint, PinJoint):
            for link in joint.links:
                points[link][joint.name] = joint.at
        elif isinstance(joint, SlideJoint | SlotJoint):
            points[joint.slider if isinstance(joint, SlideJoint) else joint.rider][joint.name] = joint.at
        elif isinstance(joint, RackJoint):
            points[joint.pinion][joint.name] = joint.at
    for tracer in linkage.tracers:
        if tracer.link in points:
            points[tracer.link][tracer.name] = tracer.at
    taken = {name for item in points.values() for name in item}
    for number, force in enumerate(linkage.forces, 1):
        if force.link in points and force.at not in points[force.link].values():
            name = next(n for n in (f"F{number}", f"F{number}_", f"F{number}__") if n not in taken)
            points[force.link][name] = force.at
    for link, own in points.items():
        if not own:  # the frame of one that is held by slides alone, or a wheel on its carrier
            own[_origin_name(link, taken)] = (0.0, 0.0)
    return points


def _origin_name(link: str, taken: set[str]) -> str:
    name = f"origin_{link}"
    while name in taken:
        name += "_"
    taken.add(name)
    return name
