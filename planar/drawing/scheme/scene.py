"""A mechanism in one position, and how places of its links lie on paper."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, reduce
from math import copysign
from typing import Any, ClassVar, NamedTuple

import numpy as np

from planar.drawing.paper.picture import paper_point
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.link_bodies import (
    RELATIVE_TOLERANCE,
    LinkBody,
    LinkOutline,
    all_marks,
    distance_from_line,
    largest_span,
    link_outlines,
)
from planar.drawing.scheme.springs_masses import SpringMassMark
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs import Pair
from planar.model.pairs.symbols import CurvedSlotMark, DrawingMark, GuideMark, SliderMark

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


def least(first: Scalar, second: Scalar) -> Scalar:
    """The lesser of two numbers, or of functions of the dimensions and of the motion."""
    if hasattr(first, "minimum"):
        return first.minimum(second)
    return second.minimum(first) if hasattr(second, "minimum") else min(first, second)


def greatest(first: Scalar, second: Scalar) -> Scalar:
    """The greater of both."""
    return -least(-first, -second)


class Cylinder(NamedTuple):
    """A slide between moving links that is drawn as a cylinder with piston and rod; lengths in m along `direction`."""

    guide: str
    rod: str
    foot: Vector
    direction: Vector
    base: Scalar
    mouth: Scalar
    piston: Scalar
    "from the foot, before the rod is moved to where it is"
    rod_end: Scalar
    rod_place: Vector
    "of the rod's own axes, from which piston and end are as far along `rod_direction`"
    rod_direction: Vector


@dataclass(frozen=True)
class Scene:
    """A mechanism with its links in one position (frames of plain numbers) and the scale of its drawing."""

    mechanism: Mechanism
    bodies: Mapping[str, LinkBody]
    frames: Mapping[str, Frame]
    shapes: Mapping[str, LinkShape]
    scale: Scale
    travel: TravelRanges = field(default_factory=dict)

    is_moving: ClassVar[bool] = False
    "whether its strokes are drawn for the whole motion, not for one position"

    @property
    def per_mm(self) -> Scalar:
        """How many metres a millimetre on paper is."""
        return self.scale.per_mm

    @cached_property
    def marks(self) -> tuple[DrawingMark | SpringMassMark, ...]:
        """What its pairs say of how they are drawn, and its springs and masses."""
        return all_marks(self.mechanism, self.shapes)

    @property
    def places(self) -> Mapping[str, Mapping[str, Vector]]:
        """The points of every link in its own axes, by their names in the link."""
        return {link: shape.points for link, shape in self.shapes.items()}

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
    def outlines(self) -> Mapping[str, LinkOutline]:
        """The outlines of links made of points that nothing uses."""
        return link_outlines(self.mechanism, self.shapes)

    def is_unmarked(self, link: str, point: str) -> bool:
        """Whether a point has no letter and no dot: one of an outline, or the centre of a curved slot."""
        is_on_outline = link in self.outlines and point in self.outlines[link].points
        return is_on_outline or any((link, point) in slot.centre_points for slot in self.curved_slots.values())

    @cached_property
    def curved_slots(self) -> Mapping[str, CurvedSlotMark]:
        """The curved slots by the pairs at their centres."""
        return {mark.name: mark for mark in self.marks if isinstance(mark, CurvedSlotMark)}

    def outline_corners(self, link: str) -> tuple[Vector, ...]:
        """The corners of a link's outline in its axes; none where it has no outline."""
        return tuple(self.place(link, point) for point in self.outlines[link].corners) if link in self.outlines else ()

    @cached_property
    def running_points(self) -> Mapping[str, tuple[tuple[str, str], str] | None]:
        """((link, point), link) of each pair in which a point runs along a line."""
        return {pair.name: pair.point_on_line() for pair in self.mechanism.pairs}

    def place(self, link: str, point: str) -> Vector:
        """A point of a link in its own axes."""
        return self.shapes[link].position(point)

    def to_paper(self, link: str, at: Vector) -> Vector:
        """A place of a link on paper (mm)."""
        return self.frames[link].to_world(Vector(*paper_point(at))) * (1.0 / self.scale.per_mm)

    def direction_on_paper(self, link: str, way: Vector) -> Vector:
        """A direction of a link on paper."""
        return self.frames[link].rotate_to_world(Vector(*paper_point(way)))

    def running_point(self, name: str) -> tuple[str, Vector] | None:
        """The link whose point runs along a line, and the point in its axes."""
        rides = self.running_points[name]
        return None if rides is None else (rides[0][0], self.place(*rides[0]))

    def running_point_name(self, name: str) -> str:
        """The result name of the point that runs along a line."""
        rides = self.running_points[name]
        return name if rides is None else self.point_names.get(rides[0], name)

    def knows_travel(self, name: str) -> bool:
        """Whether it is known from where to where the displacement of a slide goes."""
        return name in self._known_travel

    @cached_property
    def _known_travel(self) -> TravelRanges:
        """The ranges of slides, of those that nobody has measured what their stops say."""
        stopped = {each.pair: (each.low, each.high) for each in self.mechanism.stops if None not in each[1:3]}
        return stopped | dict(self.travel)  # type: ignore[return-value]  # both ends are numbers

    def pair_marks(self, pair: Pair) -> Sequence[DrawingMark]:
        """What one pair, or the motion of two of several links on one pin, says of how it is drawn."""
        return pair.drawing_marks(self.shapes, self.mechanism.pairs)

    def displacement_along(self, name: str, link: str, foot: Vector, way: Vector) -> float:
        """How far (m) from a foot on a line of a link the point is that runs along it."""
        rider, at = self.running_point(name) or (link, foot)
        local = self.frames[link].to_local(self.frames[rider].to_world(at))
        return float((local - foot).dot(way))

    def shown_range(self, name: str, link: str, foot: Vector, way: Vector) -> tuple[Scalar, Scalar]:
        """From where to where that point is seen in the drawing: at one place, unless it is of the whole motion."""
        here = self.displacement_along(name, link, foot, way)
        return here, here

    def travel_range(self, name: str, link: str, through: Vector, foot: Vector, way: Vector) -> tuple[Scalar, Scalar]:
        """From where to where that point goes, from the foot; here and no farther where that is not known."""
        if not self.knows_travel(name):
            return self.shown_range(name, link, foot, way)
        start = float((through - foot).dot(way))
        low, high = sorted(start + value for value in self._known_travel[name])
        return low, high

    def drawn_range(self, name: str, link: str, through: Vector, foot: Vector, way: Vector) -> tuple[Scalar, Scalar]:
        """The same, and where it is now."""
        low, high = self.travel_range(name, link, through, foot, way)
        first, last = self.shown_range(name, link, foot, way)
        return least(low, first), greatest(high, last)

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
            ends = [sense * (p - mark.position).dot(mark.direction) for p in lying]
            covers = [sense * (p - line.foot).dot(line.direction) for p in guide.dots]
            rear, front = min(ends), max(ends)
            stroke = far - near
            mouth = greatest(CYLINDER_LENGTH_RATIO * near, 1.15 * stroke)
            mouth = least(mouth, MAX_CYLINDER_LENGTH_RATIO * near)
            if rear == front:
                rear = (mouth - stroke) / 2.0 - near  # the piston as far from either end of its way
            else:
                mouth = greatest(far + rear + GUIDE_OVERHANG * self.per_mm, 0.0)
            base = reduce(least, covers, 0.0)
            mouth = reduce(greatest, covers, mouth)
            ways = line.direction * sense, mark.direction * sense
            yield (
                mark.name,
                Cylinder(
                    mark.guide_link, mark.link, line.foot, ways[0], base, mouth, rear, front, mark.position, ways[1]
                ),
            )
