"""The numbers of links and lines that are given, as conditions between the places of the first entry.

The coordinates of a link's points count from anchors, points of which they are given, so that nothing is sought of its
origin. One number more says where its x-axis goes; any further one is a condition.
"""

from __future__ import annotations

from cmath import exp
from collections.abc import Collection, Mapping
from functools import cached_property
from typing import NamedTuple

from planar.model.link_shapes import Link
from planar.synthesis.exact.relations.polynomials import Polynomial, as_polynomial
from planar.synthesis.exact.relations.reference_pose import Coordinates, LinkAxes, ReferencePose, SlidingRow
from planar.synthesis.exact.relations.unknowns import NumberKind

PARALLEL = 1e-12
"""Sine of the angle between a line and the direction in which a number moves it: it moves along itself."""


class _Point(NamedTuple):
    """A place of a link with its coordinates in the link's axes."""

    name: str
    place: Polynomial
    at: Coordinates


class _Anchor(NamedTuple):
    """A place from which coordinates count, with its own; `name` is empty for the origin."""

    name: str
    place: Polynomial
    value: complex


def add_given_numbers(
    pose: ReferencePose, displacements: Mapping[str, Polynomial], known_slides: Collection[str]
) -> None:
    """The conditions of all numbers that are given, with displacements that are known at the first entry;
    `known_slides` are pairs of which entries say how far they slide."""
    parts = []
    for link in pose.mechanism.links:
        lines = [_Line(pose, slide, displacements) for slide in pose.slides if slide.pair.links[0] == link.name]
        if link.name == pose.mechanism.frame:
            for line in lines:
                line.add_to_frame()
        else:
            parts.append(_LinkConditions(pose, link, lines))
    while parts:  # first those links of which directions are known
        part = next((part for part in parts if part.find_direction() is not None), parts[0])
        parts.remove(part)
        part.add()
    for slide in pose.slides:
        pose.seek_direction(slide.pair.name, slide.pair.name in known_slides)


class _Line:
    """The line of a pair, where it goes through in the axes of its link, and how far its slider is from there."""

    def __init__(self, pose: ReferencePose, slide: SlidingRow, displacements: Mapping[str, Polynomial]):
        self.pose, self.slide, self.link = pose, slide, slide.pair.bodies[0]
        self.is_elsewhere = isinstance(slide.through, str) and (self.link, slide.through) in pose.places
        "whether it goes through a place that is another's, too"
        self.turn = pose.line_turn(slide.pair)
        "the angle in the axes of its link, where it is given (rad)"
        self.through: Polynomial | None = None
        "the place from which displacements count, where one is known"
        self.along: Polynomial | None = None
        if slide.pair.name in displacements:
            self.along = displacements[slide.pair.name] * slide.direction
            self.through = slide.slider - self.along

    @cached_property
    def at(self) -> Coordinates:
        """What it goes through."""
        return self.pose.coordinates(self.link, self.slide.through, self.slide.pair)

    @property
    def has_place(self) -> bool:
        """Whether no number that is sought moves it across itself."""
        steps = [step for step, is_given in zip((1.0, 1.0j), self.at.is_given, strict=True) if not is_given]
        if self.turn is None:
            return not steps
        back = exp(-1j * self.turn)
        return all(abs((step * back).imag) < PARALLEL for step in steps)

    def add_elsewhere(self) -> None:
        """That it goes through places of points."""
        if self.slide.end is not None:
            self.add_across(self.slide.end)
        off = _now(self.pose, self.slide.slider - self.pose.place(self.link, str(self.slide.through)))
        if self.along is not None:
            self.pose.tie(off - self.along)
        else:
            self.add_across(off)

    def add_across(self, off: Polynomial) -> None:
        """That something is along it."""
        across = _now(self.pose, off * self.slide.direction.conjugate)
        self.pose.conditions.append(across - across.conjugate)

    def add_to_frame(self) -> None:
        """What is given of a line of the frame."""
        if self.is_elsewhere:
            self.add_elsewhere()
            return
        at = self.at
        if not any(at.is_given) or (self.through is None and not self.has_place):
            return
        place = self.pose.table.add_given(NumberKind.PLACE, at.value).value
        if self.through is None:
            self.add_across(self.slide.slider - place)
            return
        off = _now(self.pose, self.through - place)
        if all(at.is_given):
            self.pose.tie(off)
        else:
            self.pose.conditions.append(off + off.conjugate if at.is_given[0] else off - off.conjugate)


class _LinkConditions:
    def __init__(self, pose: ReferencePose, link: Link, lines: list[_Line]):
        self.pose, self.link = pose, link
        self.ends = link.ends or ()
        self.points = [
            _Point(name, pose.places[own, name], pose.coordinates(own, name))
            for own, name in ((link.name, name) for name in link.names)
            if (own, name) in pose.places
        ]
        self.elsewhere = [each for each in lines if each.is_elsewhere]
        others = [each for each in lines if not each.is_elsewhere]
        self.points += [
            _Point(f"through {each.slide.pair.name}", each.through, each.at)
            for each in others
            if each.through is not None
        ]
        self.offsets = [each for each in others if each.through is None and each.has_place]
        self.turns = [(line.slide, self._turn(line.turn)) for line in lines if line.turn is not None]
        "slides with the direction of their lines in the axes of the link"
        for slide in pose.slides:
            pair = slide.pair
            angle: float | None = getattr(pair, "block_angle", None)  # None where the link may turn on the line
            if pair.links[1] == link.name and angle is not None and f"{pair.name}.turn" not in pose.free:
                self.turns.append((slide, self._turn(-angle) if angle else as_polynomial(1.0)))
        self.direction, self.origin = pose.axes.get(link.name, LinkAxes(None, None))
        self.anchors = self._anchors()

    def _anchors(self) -> list[_Anchor | None]:
        """The places from which x and y count."""
        if self.origin is not None:
            return [_Anchor("", self.origin, 0.0)] * 2
        whole = next((each for each in self.points if all(each.at.is_given)), None)
        found: list[_Anchor | None] = []
        for axis in range(2):
            own = whole or next((each for each in self.points if each.at.is_given[axis]), None)
            found.append(None if own is None else _Anchor(own.name, own.place, own.at.value))
        return found

    def _rest(self) -> list[tuple[_Point, bool, bool]]:
        """The points of which more is given than where an anchor is: whether x, and whether y."""
        found = []
        for each in self.points:
            x, y = (
                is_given and (anchor is None or anchor.name != each.name)
                for is_given, anchor in zip(each.at.is_given, self.anchors, strict=True)
            )
            if x or y:
                found.append((each, x, y))
        return found

    def add(self) -> None:
        """The conditions of what is given of a moving link."""
        for line in self.elsewhere:
            line.add_elsewhere()
        open_anchors = sum(each is None for each in self.anchors)
        if 0 < len(self.offsets) <= open_anchors:
            self.offsets = []  # they only say where the origin is
        elif open_anchors and self.offsets:
            self.origin = self.pose.table.add_unknown().value
            self.anchors = [_Anchor("", self.origin, 0.0)] * 2
        rest = self._rest()
        count = sum(x + y for _, x, y in rest) + len(self.turns) + len(self.offsets)
        if self.direction is None:
            if count < 2:
                return
            if not self.turns and not self.offsets and count == 2 and len(rest) == 1:
                self._add_distance(rest[0][0])
                return
        way = self.find_direction() or self._sought_direction()
        self.pose.axes[self.link.name] = LinkAxes(way, self.origin)
        for slide, turn in self.turns:
            self.pose.tie(slide.direction - way * turn)
        for point, x, y in rest:
            self._add_point(point, (x, y), way)
        for line in self.offsets:
            line.add_across(self._offset(line, way))

    def find_direction(self) -> Polynomial | None:
        """The x-axis, where it is known, or that of a line is."""
        for slide, turn in self.turns:
            if self.direction is None and self.pose.is_known(slide.direction):
                self.direction = slide.direction * turn.conjugate
                self.turns = [other for other in self.turns if other[0] is not slide]
        return self.direction

    def _turn(self, angle: float) -> Polynomial:
        return self.pose.table.add_given(NumberKind.TURN, angle).value

    def _sought_direction(self) -> Polynomial:
        way = self.pose.table.add_unknown().value
        self.pose.conditions.append(way * way.conjugate - 1.0)
        return way

    def _step(self, name: str, value: complex, anchor: _Anchor) -> Polynomial:
        """The coordinates of a point from an anchor, as a number that is given; those of ends are lengths."""
        if name in self.ends and (not anchor.name or anchor.name in self.ends):
            if value == anchor.value:
                return Polynomial({})
            return self.pose.table.add_given(NumberKind.LENGTH, value.real, anchor.value.real).value
        return self.pose.table.add_given(NumberKind.VECTOR, value, anchor.value).value

    def _add_distance(self, point: _Point) -> None:
        anchor = self.anchors[0]
        assert anchor is not None
        off, step = _now(self.pose, point.place - anchor.place), self._step(point.name, point.at.value, anchor)
        self.pose.conditions.append(off * off.conjugate - step * step.conjugate)

    def _add_point(self, point: _Point, is_given: tuple[bool, bool], way: Polynomial) -> None:
        if all(is_given):
            anchor = self.anchors[0]
            assert anchor is not None
            step = self._step(point.name, point.at.value, anchor)
            self.pose.tie(_now(self.pose, point.place - anchor.place) - step * way)
            return
        axis = 0 if is_given[0] else 1
        anchor = self.anchors[axis]
        assert anchor is not None
        turned = _now(self.pose, (point.place - anchor.place) * way.conjugate)
        if axis and point.name in self.ends and (not anchor.name or anchor.name in self.ends):
            self.pose.conditions.append(turned - turned.conjugate)
            return
        turned = turned - self.pose.table.add_given(NumberKind.VECTOR, point.at.value, anchor.value).value
        self.pose.conditions.append(turned - turned.conjugate if axis else turned + turned.conjugate)

    def _offset(self, line: _Line, way: Polynomial) -> Polynomial:
        """From what a line goes through to its slider."""
        x, y = self.anchors
        assert x is not None and y is not None
        if x.name == y.name:
            step = self.pose.table.add_given(NumberKind.VECTOR, line.at.value, x.value).value
            return line.slide.slider - x.place - step * way
        start = complex(x.value.real, y.value.imag)
        step = self.pose.table.add_given(NumberKind.VECTOR, line.at.value, start).value
        across, along = ((line.slide.slider - each.place) * way.conjugate for each in (y, x))
        own = (along + along.conjugate + across - across.conjugate) * 0.5
        return (own - step) * way


def _now(pose: ReferencePose, row: Polynomial) -> Polynomial:
    return as_polynomial(row).substitute(pose.values)
