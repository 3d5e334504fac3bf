"""A mechanism in one position, and how places of its links lie on paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import copysign
from typing import Any, NamedTuple

import numpy as np

from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.link_bodies import RELATIVE_TOLERANCE, LinkBody, all_marks, distance_from_line, largest_span
from planar.drawing.scheme.springs_masses import SpringMassMark
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs.symbols import DrawingMark, GuideMark, SliderMark

TravelRanges = Mapping[str, tuple[float, float]]
"""From where to where the displacement of a slide goes (m), by its pair."""
GUIDE_OVERHANG = 5.5
"""mm: how far a guide goes on beyond the middle of its block."""
CYLINDER_LENGTH_RATIO, MAX_CYLINDER_LENGTH_RATIO = 0.62, 0.95
"""Of the shortest length of a cylinder with its rod: how long the cylinder is drawn, and may be for its stroke."""


def plain_frames(frames: Mapping[str, Frame], index: int | None = None) -> dict[str, Frame]:
    """The frames of a position, or of a motion at an index, as plain numbers without their rates."""

    def number(value: Any) -> float:
        value = value.parts[0] if isinstance(value, Jet) else value
        return float(value if index is None or np.ndim(value) == 0 else value[index])

    return {
        link: Frame(number(at.x), number(at.y), number(at.cos), number(at.sin), number(at.angle), at.fixed)
        for link, at in frames.items()
    }


class Cylinder(NamedTuple):
    """A slide between moving links that is drawn as a cylinder with a piston and its rod; lengths in m along `way`."""

    guide: str
    rod: str
    foot: Vector
    direction: Vector
    base: float
    mouth: float
    piston: float
    "from the foot, before the rod is moved to where it is"
    rod_end: float


@dataclass(frozen=True)
class Scene:
    """A mechanism with its links in one position (frames of plain numbers) and the scale of its drawing."""

    mechanism: Mechanism
    bodies: Mapping[str, LinkBody]
    frames: Mapping[str, Frame]
    shapes: Mapping[str, LinkShape]
    scale: Scale
    travel: TravelRanges = field(default_factory=dict)

    @cached_property
    def marks(self) -> tuple[DrawingMark | SpringMassMark, ...]:
        """What its pairs say of how they are drawn, and its springs and masses."""
        return all_marks(self.mechanism, self.shapes)

    @cached_property
    def cylinders(self) -> Mapping[str, Cylinder]:
        """The slides that are drawn as cylinders, by pair."""
        return dict(self._find_cylinders())

    @cached_property
    def tolerance(self) -> float:
        """Lengths below this are none (m)."""
        return RELATIVE_TOLERANCE * largest_span(self.shapes)

    @cached_property
    def point_names(self) -> Mapping[tuple[str, str], str]:
        """The result name of each (link, point)."""
        return {member: each.name for each in named_points(self.mechanism) for member in each.members}

    @cached_property
    def running_points(self) -> Mapping[str, tuple[tuple[str, str], str] | None]:
        """((link, point), link) of each pair in which a point runs along a line."""
        return {pair.name: pair.point_on_line() for pair in self.mechanism.pairs}

    def to_paper(self, link: str, at: Vector) -> Vector:
        """A place of a link on paper (mm)."""
        return self.frames[link].to_world(at) * (1.0 / self.scale.per_mm)

    def direction_on_paper(self, link: str, way: Vector) -> Vector:
        """A direction of a link on paper."""
        return self.frames[link].rotate_to_world(way)

    def running_point(self, name: str) -> tuple[str, Vector] | None:
        """The link whose point runs along a line, and the point in its axes."""
        rides = self.running_points[name]
        return None if rides is None else (rides[0][0], self.shapes[rides[0][0]].position(rides[0][1]))

    def running_point_name(self, name: str) -> str:
        """The result name of the point that runs along a line."""
        rides = self.running_points[name]
        return name if rides is None else self.point_names.get(rides[0], name)

    def displacement_along(self, name: str, link: str, foot: Vector, way: Vector) -> float:
        """How far (m) from a foot on a line of a link the point is that runs along it."""
        rider, at = self.running_point(name) or (link, foot)
        local = self.frames[link].to_local(self.frames[rider].to_world(at))
        return float((local - foot).dot(way))

    def travel_range(self, name: str, link: str, through: Vector, foot: Vector, way: Vector) -> tuple[float, float]:
        """From where to where that point goes, from the foot; here and no farther where that is not known."""
        here = self.displacement_along(name, link, foot, way)
        if name not in self.travel:
            return here, here
        start = float((through - foot).dot(way))
        low, high = sorted(start + value for value in self.travel[name])
        return low, high

    def _find_cylinders(self) -> Iterator[tuple[str, Cylinder]]:
        """Slides that look like cylinders: driven ones between moving links, and those whose block has a rod."""
        driven = {given.pair for given in self.mechanism.inputs}
        guides = {mark.name: mark for mark in self.marks if isinstance(mark, GuideMark)}
        frame = self.mechanism.frame
        for mark in self.marks:
            if not isinstance(mark, SliderMark) or frame in (mark.link, mark.guide_link):
                continue
            guide, rod = self.bodies[mark.guide_link], self.bodies[mark.link]
            line = next(each for each in guide.guides if each.name == mark.name)
            pinned = [p for p in guide.joints if distance_from_line(p, line.foot, line.direction) <= self.tolerance]
            lying = [
                p
                for p in (*rod.joints, *rod.dots)
                if distance_from_line(p, mark.position, mark.direction) <= self.tolerance
            ]
            if len(pinned) != 1 or len(guide.joints) != 1 or (mark.name not in driven and len(lying) < 2):
                continue
            low, high = self.travel_range(
                mark.name, mark.guide_link, guides[mark.name].through, line.foot, line.direction
            )
            sense = copysign(1.0, low + high)
            near, far = sorted((sense * low, sense * high))
            ends = [sense * float((p - mark.position).dot(mark.direction)) for p in lying]
            covers = [sense * float((p - line.foot).dot(line.direction)) for p in guide.dots]
            rear, front = min(ends), max(ends)
            stroke = far - near
            mouth = min(max(CYLINDER_LENGTH_RATIO * near, 1.15 * stroke), MAX_CYLINDER_LENGTH_RATIO * near)
            if rear == front:
                rear = (mouth - stroke) / 2.0 - near  # the piston as far from either end of its way
            else:
                mouth = max(far + rear + GUIDE_OVERHANG * self.scale.per_mm, 0.0)
            base, mouth = min((0.0, *covers)), max((mouth, *covers))
            yield (
                mark.name,
                Cylinder(mark.guide_link, mark.link, line.foot, line.direction * sense, base, mouth, rear, front),
            )
