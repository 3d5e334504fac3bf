"""What each moving link looks like in its own axes: the lines between its joints, its plate, its further points."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import hypot
from typing import NamedTuple

from planar.drawing.scheme.springs_masses import Element, elements
from planar.foundation.geometry import Vector
from planar.model.link_shapes import Shape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import Block, Guide, Mark, Opening, Pin, PitchLine, Wheel

NEAR = 1e-6
"""Points coincide, or lie on a line, within this part of the size of the mechanism."""

Side = tuple[Vector, Vector]


class GuideLine(NamedTuple):
    """A line of a link along which something runs: where the link's body meets it, and its unit direction."""

    name: str
    foot: Vector
    way: Vector


class Body(NamedTuple):
    """A link in its own axes (m).

    `sides` are the lines between its joints, `plate` the corners of its hull anticlockwise (empty for a bar);
    `tracers` lead to points beside it that are no joints, of which `dots` are all. `joints` are where other links
    meet it in a point; `guides` the lines along which others run.
    """

    link: str
    sides: tuple[Side, ...] = ()
    plate: tuple[Vector, ...] = ()
    tracers: tuple[Side, ...] = ()
    joints: tuple[Vector, ...] = ()
    dots: tuple[Vector, ...] = ()
    guides: tuple[GuideLine, ...] = ()


def all_marks(mechanism: Mechanism, shapes: Mapping[str, Shape]) -> tuple[Mark | Element, ...]:
    """What all pairs say of how they are drawn, and springs and masses."""
    of_pairs = (mark for pair in mechanism.pairs for mark in pair.marks(shapes, mechanism.pairs))
    return (*of_pairs, *elements(mechanism, shapes))


def bodies(mechanism: Mechanism, shapes: Mapping[str, Shape]) -> dict[str, Body]:
    """The body of every moving link."""
    marks = all_marks(mechanism, shapes)
    near = NEAR * size(shapes)
    return {
        link.name: _body(link.name, [*shapes[link.name].points.values()], marks, near)
        for link in mechanism.links
        if link.name != mechanism.frame
    }


def size(shapes: Mapping[str, Shape]) -> float:
    """The greatest distance (m) that two points of one link span in x or y; 1 where no link has two points."""
    spans = [0.0]
    for each in shapes.values():
        for values in zip(*each.points.values(), strict=True):
            spans.append(float(max(values) - min(values)))
    return max(spans) or 1.0


def _body(link: str, points: Sequence[Vector], marks: Sequence[Mark | Element], near: float) -> Body:
    joints = distinct(_joints(link, marks), near)
    others = list(distinct((*joints, *points), near)[len(joints) :])
    guides = _guides(link, marks, joints, near)
    feet = [side for guide in guides if (side := _to_foot(guide.foot, joints, near)) is not None]
    if not joints and not guides:
        joints, others = tuple(others[:1]), others[1:]
    dots = tuple(others)
    base = joints if len(joints) > 1 or not others else (*joints, others.pop(0))
    if guides and len(joints) < 2:  # the guide is its body; points on it lengthen it
        on = [p for p in dots if any(off_line(p, guide.foot, guide.way) <= near for guide in guides)]
        base = (*joints, *on)
        others = [p for p in dots if p not in on]
    plate = hull(base, near)
    if plate:
        tracers = [side for p in others if not _inside(p, plate, near) for side in _from_edge(p, plate)]
        return Body(link, (*_around(plate), *feet), plate, tuple(tracers), joints, dots, guides)
    line = _ends(base)
    if line is None:
        star = [(joints[0], p) for p in others] if joints else []
        return Body(link, tuple(feet), (), tuple(star), joints, dots, guides)
    way = unit(line[1] - line[0])
    on = [p for p in others if off_line(p, line[0], way) <= near]
    line = _ends((*line, *on)) or line
    ends = line if len(joints) > 1 else joints or line[:1]  # what turns about one joint is a star
    tracers = [(end, p) for p in others if p not in on for end in ends]
    return Body(link, (line, *feet), (), tuple(tracers), joints, dots, guides)


def _joints(link: str, marks: Iterable[Mark | Element]) -> Iterable[Vector]:
    """Where other links meet a link in a point."""
    for mark in marks:
        if isinstance(mark, Pin):
            yield from (at for each, at in zip(mark.links, mark.at, strict=True) if each == link)
        elif (isinstance(mark, Block) and mark.link == link) or (isinstance(mark, Opening) and mark.pin == link):
            yield mark.at
        elif isinstance(mark, Wheel) and mark.link == link:
            yield mark.centre


def _guides(link: str, marks: Iterable[Mark | Element], joints: Sequence[Vector], near: float) -> tuple[GuideLine, ...]:
    """The lines of a link, each with the joint on it, else the foot of the perpendicular from the nearest joint."""
    lines = [mark for mark in marks if isinstance(mark, Guide | Opening | PitchLine) and mark.link == link]
    made: list[GuideLine] = []
    for mark in lines:
        through, way = mark.through, mark.way
        on = [p for p in joints if off_line(p, through, way) <= near]
        if on:
            foot = min(on, key=lambda p: abs((p - through).dot(way)))
        elif joints:
            nearest = min(joints, key=lambda p: off_line(p, through, way))
            foot = through + way * (nearest - through).dot(way)
        else:
            foot = _crossing(through, way, [(other.through, other.way) for other in lines if other is not mark])
        made.append(GuideLine(mark.name, foot, way))
    return tuple(made)


def _crossing(through: Vector, way: Vector, others: Iterable[tuple[Vector, Vector]]) -> Vector:
    """Where a line crosses the first of others that it is not parallel to; without one its own first point."""
    for point, along in others:
        sine = way.cross(along)
        if abs(sine) > NEAR:
            return through + way * ((point - through).cross(along) / sine)
    return through


def _to_foot(foot: Vector, joints: Sequence[Vector], near: float) -> Side | None:
    """From the nearest joint to a foot that is no joint."""
    if not joints:
        return None
    nearest = min(joints, key=lambda p: apart(p, foot))
    return (nearest, foot) if apart(nearest, foot) > near else None


def _from_edge(point: Vector, plate: Sequence[Vector]) -> tuple[Side, Side]:
    """Lines to a point from the ends of the edge of a plate that is nearest to it."""
    edge = min(_around(plate), key=lambda side: apart(side[0], point) + apart(side[1], point))
    return (edge[0], point), (edge[1], point)


def _inside(point: Vector, plate: Sequence[Vector], near: float) -> bool:
    return all((b - a).cross(point - a) >= -near * apart(a, b) for a, b in _around(plate))


def _around(plate: Sequence[Vector]) -> tuple[Side, ...]:
    return tuple(zip(plate, (*plate[1:], plate[0]), strict=True))


def _ends(points: Sequence[Vector]) -> Side | None:
    """The two ends of points on one line, the first given first."""
    if len(points) < 2:
        return None
    far = max(points, key=lambda p: apart(p, points[0]))
    start = max(points, key=lambda p: apart(p, far))
    return start, far


def hull(points: Sequence[Vector], near: float) -> tuple[Vector, ...]:
    """The corners of the convex hull, anticlockwise; nothing where the points lie on one line within `near` (m).

    Andrew's monotone chain (A. M. Andrew, Information Processing Letters 9, 1979).
    """
    line = _ends(points)
    if line is None or max(off_line(p, line[0], unit(line[1] - line[0])) for p in points) <= near:
        return ()
    ordered = sorted(points)

    def half(row: Iterable[Vector]) -> list[Vector]:
        kept: list[Vector] = []
        for p in row:
            while len(kept) > 1 and (kept[-1] - kept[-2]).cross(p - kept[-2]) <= near * apart(kept[-2], p):
                kept.pop()
            kept.append(p)
        return kept[:-1]

    return (*half(ordered), *half(reversed(ordered)))


def distinct(points: Iterable[Vector], near: float) -> tuple[Vector, ...]:
    """The points but for those that coincide with an earlier one, as plain numbers."""
    kept: list[Vector] = []
    for point in points:
        plain = Vector(float(point.x), float(point.y))
        if all(apart(plain, other) > near for other in kept):
            kept.append(plain)
    return tuple(kept)


def apart(a: Vector, b: Vector) -> float:
    """The distance of two points."""
    return hypot(a.x - b.x, a.y - b.y)


def off_line(point: Vector, through: Vector, way: Vector) -> float:
    """The distance of a point from a line in a unit direction."""
    return abs(way.cross(point - through))


def unit(way: Vector) -> Vector:
    """The unit vector in a direction; the x-direction where it has none."""
    length = hypot(way.x, way.y)
    return Vector(way.x / length, way.y / length) if length > 0.0 else Vector(1.0, 0.0)
