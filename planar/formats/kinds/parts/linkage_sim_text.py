"""A linkage as a JSON file of linkage_sim: bodies in SI, axes as drawn, the origin at a joint."""

from __future__ import annotations

import json
from math import cos, radians, sin
from typing import Any

from planar.formats.drawn.drawn_linkage import DrawnLinkage, PinJoint, Place, SlideJoint, SlotJoint, joint_phrase
from planar.formats.drawn.file_format import WrittenText, cannot_say

VERSION = "1.0.0"
TITLE = "linkage_sim (JSON 1.0.0)"
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
"""Of a unit of length; a number of such units is divided by its inverse, which is exact."""
PER_METRE = {"mm": 1000.0, "cm": 100.0, "m": 1.0}


def write(linkage: DrawnLinkage) -> WrittenText:
    """The file, with masses, without inputs. Raises BadInput for what it cannot say."""
    return _Writer(linkage).write()


class _Writer:
    """One linkage on its way into a file."""

    def __init__(self, linkage: DrawnLinkage) -> None:
        self.linkage = linkage
        self.names = {link: f"{link}_" if link == "ground" else link for link in linkage.links}
        self.names[linkage.frame] = "ground"
        self.points: dict[str, dict[str, Place]] = {link: {} for link in linkage.links}
        self.joints: dict[str, Any] = {}

    def write(self) -> WrittenText:
        for joint in self.linkage.joints:
            if isinstance(joint, PinJoint):
                self._pin(joint)
            elif isinstance(joint, SlideJoint):
                self._slide(joint)
            elif isinstance(joint, SlotJoint):
                raise cannot_say(TITLE, joint_phrase(joint), "it has pins and slides alone")
            else:
                raise cannot_say(TITLE, joint_phrase(joint), "it has pins and slides alone")
        tracers: dict[str, dict[str, Place]] = {link: {} for link in self.points}
        for item in self.linkage.tracers:
            tracers[item.link][item.name] = item.at
        origins = {
            link: (0.0, 0.0)
            if link == self.linkage.frame
            else next(iter((points or tracers[link]).values()), (0.0, 0.0))
            for link, points in self.points.items()
        }
        bodies = {self.names[link]: self._body(link, origins[link], tracers[link]) for link in self.points}
        value = {"schema_version": VERSION, "bodies": bodies, "joints": self.joints}
        notes = ["inputs are not said: the form holds no drivers"] if self.linkage.inputs else []
        return WrittenText(json.dumps(value, indent=2, ensure_ascii=False) + "\n", tuple(notes))

    def _metres(self, value: float) -> float:
        unit = self.linkage.length
        return value / PER_METRE[unit] if unit in PER_METRE else value * METRES[unit]

    def _pin(self, joint: PinJoint) -> None:
        first, *others = joint.links
        for link in joint.links:
            self.points[link][joint.name] = joint.at
        for other in others:
            name = joint.name if len(others) == 1 else f"{joint.name}-{self.names[other]}"
            self.joints[name] = self._ends(first, joint.name, other, joint.name) | {"type": "revolute"}

    def _slide(self, joint: SlideJoint) -> None:
        through = f"{joint.name} line"
        self.points[joint.guide][through] = joint.at if joint.through is None else joint.through
        self.points[joint.slider][joint.name] = joint.at
        axis = [cos(radians(joint.angle)), sin(radians(joint.angle))]
        ends = self._ends(joint.guide, through, joint.slider, joint.name)
        self.joints[joint.name] = ends | {"type": "prismatic", "axis_local_i": axis, "delta_theta_0": 0.0}

    def _ends(self, first: str, p: str, second: str, q: str) -> dict[str, Any]:
        return {"body_i": self.names[first], "body_j": self.names[second], "point_i": p, "point_j": q}

    def _body(self, link: str, origin: Place, tracers: dict[str, Place]) -> dict[str, Any]:
        def local(at: Place) -> list[float]:
            return [self._metres(at[0] - origin[0]), self._metres(at[1] - origin[1])]

        masses = [item for item in self.linkage.masses if item.link == link]
        total = sum(item.mass for item in masses)
        centre, inertia = origin, sum(item.inertia for item in masses)
        if total:
            centre = tuple(sum(e.mass * e.at[axis] for e in masses) / total for axis in (0, 1))  # type: ignore[assignment]
            for item in masses:
                x, y = (self._metres(item.at[axis] - centre[axis]) for axis in (0, 1))
                inertia += item.mass * (x * x + y * y)
        body: dict[str, Any] = {"attachment_points": {name: local(at) for name, at in self.points[link].items()}}
        body |= {"mass": total, "cg_local": local(centre), "Izz_cg": inertia}
        return body | ({"coupler_points": {name: local(at) for name, at in tracers.items()}} if tracers else {})
