"""What each link looks like in its own axes: lines between its joints, its plate, its further points, its outline."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain, combinations
from math import ceil, hypot, pi
from typing import NamedTuple

from planar.drawing.scheme.springs_masses import Coil, MassCentreMark, Spiral, SpringMassMark, spring_mass_marks
from planar.foundation.geometry import Vector, direction
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import CurvedSlot, Mechanism, curved_slots, named_points, slot_centres
from planar.model.pairs.symbols import (
    CamMark,
    CurvedSlotMark,
    DrawingMark,
    GuideMark,
    PinMark,
    PitchLineMark,
    SliderMark,
    SlotMark,
    WheelMark,
)

RELATIVE_TOLERANCE = 1e-6
"""Points coincide, or lie on a line, within this part of the size of the mechanism."""

MIN_OUTLINE_POINTS = 6
"""The least number of points that make an outline, where nothing uses them; fewer are tracers, which are lettered."""
MAX_ORDERED_CORNERS = 200
"""Of more points the outline is their convex hull: whether their order crosses itself takes too long to find."""

ARC_STEP, MIN_ARC_STEPS = pi / 60.0, 8
"""rad between corners of the line that is drawn for a curved slot, and the least number of its parts."""

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


class LinkOutline(NamedTuple):
    """The points of a link that nothing uses, and those of them that are the corners of its outline, in order."""

    points: tuple[str, ...]
    corners: tuple[str, ...]


def all_marks(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> tuple[DrawingMark | SpringMassMark, ...]:
    """What all pairs say of how they are drawn, and springs and masses."""
    slots = {slot.pair.name: _curved_slot_mark(slot, mechanism, shapes) for slot in curved_slots(mechanism)}
    marks = (
        (slots[pair.name],) if pair.name in slots else pair.drawing_marks(shapes, mechanism.pairs)
        for pair in mechanism.pairs
    )
    return (*chain.from_iterable(marks), *spring_mass_marks(mechanism, shapes))


def _marks_by_link(
    marks: Iterable[DrawingMark | SpringMassMark],
) -> defaultdict[str, list[DrawingMark | SpringMassMark]]:
    """The marks in which the name of a link stands, in their order."""
    by_link: defaultdict[str, list[DrawingMark | SpringMassMark]] = defaultdict(list)
    for mark in marks:
        texts = {
            entry for part in mark for entry in (part if isinstance(part, tuple) else (part,)) if type(entry) is str
        }
        for text in texts:
            by_link[text].append(mark)
    return by_link


def _curved_slot_mark(slot: CurvedSlot, mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> CurvedSlotMark:
    """How a curved slot is drawn in the link that has it."""
    centre_points = slot.pair.coincident_points()
    centre = shapes[slot.carrier].position(dict(centre_points)[slot.carrier])
    angles = slot.angles(mechanism)
    low, high = angles or (0.0, 2.0 * pi)
    count = max(MIN_ARC_STEPS, ceil((high - low) / ARC_STEP))
    directions = tuple(direction(low + (high - low) * k / count) for k in range(count + (angles is not None)))
    radius = shapes[slot.link].position(slot.pin).x
    return CurvedSlotMark(slot.pair.name, slot.carrier, centre, radius, directions, angles is None, centre_points)


def link_bodies(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> dict[str, LinkBody]:
    """The body of every moving link."""
    points = body_points(mechanism, {link: shape.points for link, shape in shapes.items()}, shapes)
    return bodies_of_points(points, all_marks(mechanism, shapes), RELATIVE_TOLERANCE * largest_span(shapes))


def body_points(
    mechanism: Mechanism, places: Mapping[str, Mapping[str, Vector]], shapes: Mapping[str, LinkShape]
) -> dict[str, list[Vector]]:
    """The places of the points of each moving link, but for those of its outline and centres of curved slots."""
    outlines = link_outlines(mechanism, shapes)
    centres = slot_centres(mechanism)
    return {
        link.name: [
            place
            for point, place in places[link.name].items()
            if (link.name not in outlines or point not in outlines[link.name].points)
            and (link.name, point) not in centres
        ]
        for link in mechanism.links
        if link.name != mechanism.frame
    }


def link_outlines(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> dict[str, LinkOutline]:
    """The outlines of links that have `MIN_OUTLINE_POINTS` points, or more, that nothing uses.

    A point is used by a pair, a load, a spring, a mass or a published value, as an end or on the axis of its link, and
    where links share it. The corners have the order of the file, unless that crosses itself: then they are those of the
    convex hull.
    """
    tolerance, marks_of = RELATIVE_TOLERANCE * largest_span(shapes), _marks_by_link(all_marks(mechanism, shapes))
    named_in_file = {load.point for load in mechanism.loads} | {
        name for item in mechanism.published for name in (item.of, item.relative_to)
    }
    used_names = {
        member
        for named in named_points(mechanism)
        for member in named.members
        if len(named.members) > 1 or not named_in_file.isdisjoint((named.name, ".".join(member)))
    }
    outlines = {}
    for link in mechanism.links:
        marks = marks_of[link.name]
        used_places = [*_joint_points(link.name, marks), *_action_places(link.name, marks)]
        lines = [mark for mark in marks if isinstance(mark, LINE_MARKS) and mark.link == link.name]
        unused = {
            point: place
            for point, place in shapes[link.name].points.items()
            if point not in (*(link.ends or ()), *(link.axis or ()))
            and (link.name, point) not in used_names
            and all(distance_between(place, other) > tolerance for other in used_places)
            and all(distance_from_line(place, line.through, line.direction) > tolerance for line in lines)
        }
        if len(unused) >= MIN_OUTLINE_POINTS:
            corners = _outline_corners(list(unused.values()), tolerance)
            names = tuple(next(point for point, place in unused.items() if place == corner) for corner in corners)
            outlines[link.name] = LinkOutline(tuple(unused), names)
    return outlines


def outline_point_names(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> frozenset[str]:
    """The result names of the points of outlines."""
    outlines = link_outlines(mechanism, shapes)
    return frozenset(
        named.name
        for named in named_points(mechanism)
        if any(link in outlines and point in outlines[link].points for link, point in named.members)
    )


def _outline_corners(points: Sequence[Vector], tolerance: float) -> tuple[Vector, ...]:
    """The corners of an outline in their order; the two ends of points on one line."""
    corners = distinct_points(points, tolerance)
    hull = convex_hull(corners, tolerance)
    if not hull:
        return _end_points(corners) or corners
    if len(corners) > MAX_ORDERED_CORNERS:
        return hull
    crosses = any(_segments_cross(one, other) for one, other in combinations(_edges(corners), 2))
    return hull if crosses else corners


def _segments_cross(one: Segment, other: Segment) -> bool:
    """Whether two segments cross between their ends."""

    def sides(line: Segment, endpoints: Segment) -> float:
        along = line[1] - line[0]
        return along.cross(endpoints[0] - line[0]) * along.cross(endpoints[1] - line[0])

    return sides(one, other) < 0.0 and sides(other, one) < 0.0


def _action_places(link: str, marks: Iterable[DrawingMark | SpringMassMark]) -> Iterator[Vector]:
    """The places of a link at which springs, masses and cams are."""
    for mark in marks:
        if isinstance(mark, Coil):
            yield from (place for owner, place in zip(mark.links, mark.at, strict=True) if owner == link)
        elif (isinstance(mark, MassCentreMark) and mark.link == link) or (
            isinstance(mark, Spiral) and mark.pin == link
        ):
            yield mark.at
        elif isinstance(mark, CamMark):
            if mark.link == link:
                yield mark.centre
            if mark.follower_link == link:
                yield mark.middle


def bodies_of_points(
    points: Mapping[str, Sequence[Vector]], marks: Sequence[DrawingMark | SpringMassMark], tolerance: float
) -> dict[str, LinkBody]:
    """The bodies of links by their points and by what pairs say of how they are drawn.

    Lengths below `tolerance` are none. Numbers may be any that compare as numbers do, such as those that know
    how they depend on the dimensions.
    """
    marks_of = _marks_by_link(marks)
    return {link: _link_body(link, own, marks_of[link], tolerance) for link, own in points.items()}


def largest_span(shapes: Mapping[str, LinkShape]) -> float:
    """The greatest distance (m) that two points of one link span in x or y; 1 where no link has two points."""
    spans = [0.0]
    for each in shapes.values():
        for values in zip(*each.points.values(), strict=True):
            spans.append(float(max(values) - min(values)))
    return max(spans) or 1.0


LINE_MARKS = GuideMark, SlotMark, PitchLineMark
"""What pairs say of lines of links."""


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
    if len(joints) == 1 and not others and not guides:  # a link with one pin goes as far as its centre of mass
        masses = [mark.at for mark in marks if isinstance(mark, MassCentreMark) and mark.link == link]
        others = list(distinct_points((*joints, *masses), tolerance)[1:])
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
    lines = [mark for mark in marks if isinstance(mark, LINE_MARKS) and mark.link == link]
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


def is_inside_outline(point: Vector, corners: Sequence[Vector]) -> bool:
    """Whether a point is inside a polygon: a ray from it crosses the sides an odd number of times."""
    crossed = [
        (a, b)
        for a, b in _edges(corners)
        if (a.y > point.y) != (b.y > point.y) and point.x < a.x + (b.x - a.x) * ((point.y - a.y) / (b.y - a.y))
    ]
    return len(crossed) % 2 == 1


def _edges(plate: Sequence[Vector]) -> tuple[Segment, ...]:
    return tuple(zip(plate, (*plate[1:], *plate[:1]), strict=True))


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
