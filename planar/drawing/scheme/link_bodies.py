"""What each moving link looks like in its own axes: the lines between its joints, its plate, its further points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import hypot
from typing import NamedTuple

from planar.drawing.scheme.springs_masses import SpringMassMark, spring_mass_marks
from planar.foundation.geometry import Vector
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import DrawingMark, GuideMark, PinMark, PitchLineMark, SliderMark, SlotMark, WheelMark

RELATIVE_TOLERANCE = 1e-6
"""Points coincide, or lie on a line, within this part of the size of the mechanism."""

Segment = tuple[Vector, Vector]


class GuideLine(NamedTuple):
    """A line of a link along which something runs: where the link's body meets it, and its unit direction."""

    name: str
    foot: Vector
    direction: Vector


class LinkBody(NamedTuple):
    """A link in its own axes (m).

    `sides` are the lines between its joints, `plate` the corners of its hull anticlockwise (empty for a bar);
    `tracers` lead to points beside it that are no joints, of which `dots` are all. `joints` are where other links
    meet it in a point; `guides` the lines along which others run.
    """

    link: str
    sides: tuple[Segment, ...] = ()
    plate: tuple[Vector, ...] = ()
    tracers: tuple[Segment, ...] = ()
    joints: tuple[Vector, ...] = ()
    dots: tuple[Vector, ...] = ()
    guides: tuple[GuideLine, ...] = ()


def all_marks(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> tuple[DrawingMark | SpringMassMark, ...]:
    """What all pairs say of how they are drawn, and springs and masses."""
    of_pairs = (mark for pair in mechanism.pairs for mark in pair.drawing_marks(shapes, mechanism.pairs))
    return (*of_pairs, *spring_mass_marks(mechanism, shapes))


def link_bodies(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> dict[str, LinkBody]:
    """The body of every moving link."""
    moving = {
        link.name: [*shapes[link.name].points.values()] for link in mechanism.links if link.name != mechanism.frame
    }
    return bodies_of_points(moving, all_marks(mechanism, shapes), RELATIVE_TOLERANCE * largest_span(shapes))


def bodies_of_points(
    points: Mapping[str, Sequence[Vector]], marks: Sequence[DrawingMark | SpringMassMark], tolerance: float
) -> dict[str, LinkBody]:
    """The bodies of links by their points and by what pairs say of how they are drawn.

    Lengths below `tolerance` are none. Numbers may be any that compare as numbers do, such as those that know
    how they depend on the dimensions.
    """
    return {link: _link_body(link, own, marks, tolerance) for link, own in points.items()}


def largest_span(shapes: Mapping[str, LinkShape]) -> float:
    """The greatest distance (m) that two points of one link span in x or y; 1 where no link has two points."""
    spans = [0.0]
    for each in shapes.values():
        for values in zip(*each.points.values(), strict=True):
            spans.append(float(max(values) - min(values)))
    return max(spans) or 1.0


def _link_body(
    link: str, points: Sequence[Vector], marks: Sequence[DrawingMark | SpringMassMark], tolerance: float
) -> LinkBody:
    joints = distinct_points(_joint_points(link, marks), tolerance)
    others = list(distinct_points((*joints, *points), tolerance)[len(joints) :])
    guides = _guide_lines(link, marks, joints, tolerance)
    feet = [side for guide in guides if (side := _foot_segment(guide.foot, joints, tolerance)) is not None]
    if not joints and not guides:
        joints, others = tuple(others[:1]), others[1:]
    dots = tuple(others)
    base = joints if len(joints) > 1 or not others else (*joints, others.pop(0))
    if guides and len(joints) < 2:  # the guide is its body; points on it lengthen it
        on = [
            p for p in dots if any(distance_from_line(p, guide.foot, guide.direction) <= tolerance for guide in guides)
        ]
        base = (*joints, *on)
        others = [p for p in dots if p not in on]
    plate = convex_hull(base, tolerance)
    if plate:
        tracers = [side for p in others if not _is_inside(p, plate, tolerance) for side in _edge_segments(p, plate)]
        return LinkBody(link, (*_edges(plate), *feet), plate, tuple(tracers), joints, dots, guides)
    line = _end_points(base)
    if line is None:
        star = [(joints[0], p) for p in others] if joints else []
        return LinkBody(link, tuple(feet), (), tuple(star), joints, dots, guides)
    way = unit_vector(line[1] - line[0])
    on = [p for p in others if distance_from_line(p, line[0], way) <= tolerance]
    line = _end_points((*line, *on)) or line
    ends = line if len(joints) > 1 else joints or line[:1]  # what turns about one joint is a star
    tracers = [(end, p) for p in others if p not in on for end in ends]
    return LinkBody(link, (line, *feet), (), tuple(tracers), joints, dots, guides)


def _joint_points(link: str, marks: Iterable[DrawingMark | SpringMassMark]) -> Iterable[Vector]:
    """Where other links meet a link in a point."""
    for mark in marks:
        if isinstance(mark, PinMark):
            yield from (at for each, at in zip(mark.links, mark.positions, strict=True) if each == link)
        elif isinstance(mark, SliderMark) and mark.link == link:
            yield mark.position
        elif isinstance(mark, SlotMark) and mark.pin_link == link:
            yield mark.pin_position
        elif isinstance(mark, WheelMark) and mark.link == link:
            yield mark.centre


def _guide_lines(
    link: str, marks: Iterable[DrawingMark | SpringMassMark], joints: Sequence[Vector], tolerance: float
) -> tuple[GuideLine, ...]:
    """The lines of a link, each with the joint on it, else the foot of the perpendicular from the nearest joint."""
    lines = [mark for mark in marks if isinstance(mark, GuideMark | SlotMark | PitchLineMark) and mark.link == link]
    made: list[GuideLine] = []
    for mark in lines:
        through, way = mark.through, mark.direction
        on = [p for p in joints if distance_from_line(p, through, way) <= tolerance]
        if on:
            foot = min(on, key=lambda p: abs((p - through).dot(way)))
        elif joints:
            nearest = min(joints, key=lambda p: distance_from_line(p, through, way))
            foot = through + way * (nearest - through).dot(way)
        else:
            foot = _line_crossing(
                through, way, [(other.through, other.direction) for other in lines if other is not mark]
            )
        made.append(GuideLine(mark.name, foot, way))
    return tuple(made)


def _line_crossing(through: Vector, way: Vector, others: Iterable[tuple[Vector, Vector]]) -> Vector:
    """Where a line crosses the first of others that it is not parallel to; without one its own first point."""
    for point, along in others:
        sine = way.cross(along)
        if abs(sine) > RELATIVE_TOLERANCE:
            return through + way * ((point - through).cross(along) / sine)
    return through


def _foot_segment(foot: Vector, joints: Sequence[Vector], tolerance: float) -> Segment | None:
    """From the nearest joint to a foot that is no joint."""
    if not joints:
        return None
    nearest = min(joints, key=lambda p: distance_between(p, foot))
    return (nearest, foot) if distance_between(nearest, foot) > tolerance else None


def _edge_segments(point: Vector, plate: Sequence[Vector]) -> tuple[Segment, Segment]:
    """Lines to a point from the ends of the edge of a plate that is nearest to it."""
    edge = min(_edges(plate), key=lambda side: distance_between(side[0], point) + distance_between(side[1], point))
    return (edge[0], point), (edge[1], point)


def _is_inside(point: Vector, plate: Sequence[Vector], tolerance: float) -> bool:
    return all((b - a).cross(point - a) >= -tolerance * distance_between(a, b) for a, b in _edges(plate))


def _edges(plate: Sequence[Vector]) -> tuple[Segment, ...]:
    return tuple(zip(plate, (*plate[1:], plate[0]), strict=True))


def _end_points(points: Sequence[Vector]) -> Segment | None:
    """The two ends of points on one line, the first given first."""
    if len(points) < 2:
        return None
    far = max(points, key=lambda p: distance_between(p, points[0]))
    start = max(points, key=lambda p: distance_between(p, far))
    return start, far


def convex_hull(points: Sequence[Vector], tolerance: float) -> tuple[Vector, ...]:
    """The corners of the convex hull, anticlockwise; nothing where the points lie on one line within `near` (m).

    Andrew's monotone chain (A. M. Andrew, Information Processing Letters 9, 1979).
    """
    line = _end_points(points)
    if line is None or max(distance_from_line(p, line[0], unit_vector(line[1] - line[0])) for p in points) <= tolerance:
        return ()
    ordered = sorted(points)

    def half(row: Iterable[Vector]) -> list[Vector]:
        kept: list[Vector] = []
        for p in row:
            while len(kept) > 1 and (kept[-1] - kept[-2]).cross(p - kept[-2]) <= tolerance * distance_between(
                kept[-2], p
            ):
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return (*half(ordered), *half(reversed(ordered)))


def distinct_points(points: Iterable[Vector], tolerance: float) -> tuple[Vector, ...]:
    """The points but for those that coincide with an earlier one."""
    kept: list[Vector] = []
    for point in points:
        if all(distance_between(point, other) > tolerance for other in kept):
            kept.append(point)
    return tuple(kept)


def distance_between(a: Vector, b: Vector) -> float:
    """The distance of two points."""
    return hypot(a.x - b.x, a.y - b.y)


def distance_from_line(point: Vector, through: Vector, way: Vector) -> float:
    """The distance of a point from a line in a unit direction."""
    return abs(way.cross(point - through))


def unit_vector(way: Vector) -> Vector:
    """The unit vector in a direction; the x-direction where it has none."""
    length = hypot(way.x, way.y)
    return Vector(way.x / length, way.y / length) if length > 0.0 else Vector(1.0, 0.0)
