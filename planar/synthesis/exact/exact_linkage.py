"""A real solution as a mechanism, with the position of its input at every entry."""

from __future__ import annotations

from cmath import exp, phase
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.document.revised.changed_numbers import with_values
from planar.foundation.arrays import Array, ComplexArray
from planar.model.link_shapes import Link, PointReference, link_shape
from planar.model.mechanism import Mechanism, named_points
from planar.synthesis.exact.relations.entry_relations import EntryRelations, turned_link
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.relations.polynomials import Polynomial
from planar.synthesis.exact.relations.reference_pose import SlidingRow
from planar.synthesis.exact.relations.unknowns import NumberKind

Values = dict[int, complex]
"""Of symbols, by their numbers."""


class ExactLinkage(NamedTuple):
    """A mechanism, the numbers of it that were sought (SI), and where its running input is (n,) at the entries of each
    wanted item of the task, rad or m."""

    mechanism: Mechanism
    numbers: dict[str, float]
    inputs: tuple[Array, ...]


def exact_linkage(problem: ExactProblem, solution: Mapping[int, complex], name: str) -> ExactLinkage:
    """The linkage of a real solution, the values of all unknowns. Raises BadInput where no file could say it."""
    return _LinkageWriter(problem, {**problem.first_values(), **solution}).write(name)


def evaluate(row: Polynomial, values: Values) -> complex:
    """A polynomial in numbers."""
    total = 0.0 + 0.0j
    for key, factor in row.terms.items():
        product = complex(factor)
        for k in key:
            product *= values[k]
        total += product
    return total


def entry_values(relations: EntryRelations, numbers: ComplexArray, values: Values) -> Values:
    """The values of all symbols at an entry, which gives `numbers` (numbers, 2)."""
    here = dict(values)
    for each, given in zip(relations.numbers, numbers.tolist(), strict=True):
        value, other = (exp(1j * given[0]), exp(-1j * given[0])) if each.kind is NumberKind.TURN else given
        here[each.symbol.own], here[each.symbol.conjugate] = value, other
    rows = relations.rows
    if rows.turn is not None:
        linear = np.array([[evaluate(part, here) for part in row] for row in rows.linear])
        scale = np.linalg.norm(linear, axis=1, keepdims=True)
        linear = linear / np.where(scale > 0.0, scale, 1.0)
        turn = np.linalg.svd(linear)[2][-1].conj()
        turn = turn / (turn[2] if abs(turn[2]) > 0.0 else 1.0)
        unit = turn[0] / abs(turn[0]) if abs(turn[0]) > 0.0 else 1.0
        here[rows.turn.own], here[rows.turn.conjugate] = unit, unit.conjugate()
    for symbol, numerator, denominator in reversed(rows.steps):
        below = evaluate(denominator, here)
        value = evaluate(numerator, here) / below if below else 0.0
        here[symbol.own], here[symbol.conjugate] = value, complex(value).conjugate()
    return here


class _LinkageWriter:
    def __init__(self, problem: ExactProblem, values: Values):
        self.problem, self.pose, self.values = problem, problem.pose, values
        self.mechanism = problem.mechanism
        self.axes: dict[str, complex] = {}
        self.origins: dict[str, complex] = {}
        "x-axes and origins of moving links at the first entry"
        self.lines: dict[str, complex] = {}
        "directions of lines at the first entry, as they are written"

    def _world(self, place: Polynomial) -> complex:
        return evaluate(place.substitute(self.pose.values), self.values) * self.problem.size + self.problem.origin

    def write(self, name: str) -> ExactLinkage:
        """The mechanism with its numbers."""
        numbers: dict[str, float] = {}
        for link in self.mechanism.links:
            numbers |= self._link_numbers(link)
        first: dict[str, float] = {}
        for slide in self.pose.slides:
            numbers |= self._line_numbers(slide, numbers, first)
        running = self.mechanism.inputs[0].pair
        start = first[running] if running in first else phase(self.axes[turned_link(self.pose, running)])
        chosen = {key: value for key, value in numbers.items() if key in self.pose.free}
        base = replace(self.mechanism, name=name, about=None, source=None, published=(), ids=())
        whole = with_values(base, chosen | {f"{running}.position": start})
        whole = replace(whole, sketch=tuple(self._sketch(whole)))
        return ExactLinkage(whole, chosen, self._inputs(running, start))

    def _places(self, link: Link) -> dict[str, complex]:
        return {
            name: self._world(place)
            for (own, name), place in self.pose.places.items()
            if own == link.name and isinstance(name, str)
        }

    def _link_numbers(self, link: Link) -> dict[str, float]:
        places = self._places(link)
        if link.name == self.mechanism.frame:
            found: dict[str, float] = {}
            for name, at in places.items():
                found |= {f"{link.name}.{name}.x": at.real, f"{link.name}.{name}.y": at.imag}
            if link.ends is not None and link.ends[1] in places:
                found[f"{link.name}.length"] = places[link.ends[1]].real
            return found
        origin, way = self._link_axes(link, places)
        self.origins[link.name], self.axes[link.name] = origin, way
        found = {}
        for name, at in places.items():
            own = (at - origin) / way
            found |= {f"{link.name}.{name}.x": own.real, f"{link.name}.{name}.y": own.imag}
        if link.ends is not None and all(end in places for end in link.ends):
            found[f"{link.name}.length"] = abs(places[link.ends[1]] - places[link.ends[0]])
        return found

    def _link_axes(self, link: Link, places: Mapping[str, complex]) -> tuple[complex, complex]:
        """Where the origin of a link is, and its x-axis as a unit vector, at the first entry."""
        known = self.problem.axes.get(link.name)
        if known is not None and known.origin is not None:
            return self._world(known.origin), evaluate(known.direction, self.values)
        shape = link_shape(link)
        drawn = {name: complex(shape.position(name).x, shape.position(name).y) for name in link.names}
        names = [*(link.ends or ()), *(name for name in drawn if name not in (link.ends or ()))]
        used = [name for name in names if name in places]
        if known is not None:
            way = evaluate(known.direction, self.values)
        elif len(used) > 1:
            first, *others = used
            other = max(others[:1], key=lambda each: abs(places[each] - places[first]))
            way = (places[other] - places[first]) * (drawn[other] - drawn[first]).conjugate()
            way = way / abs(way) if abs(way) > 0.0 else 1.0 + 0.0j
        else:
            way = 1.0 + 0.0j
        if not used:
            return 0.0j, way
        return places[used[0]] - drawn[used[0]] * way, way

    def _line_numbers(
        self, slide: SlidingRow, numbers: Mapping[str, float], first: dict[str, float]
    ) -> dict[str, float]:
        """The direction of a line, and the point that it goes through, in its link's axes; `first` gets the
        displacement."""
        link, name = slide.pair.bodies[0], slide.through
        axis, origin = self.axes.get(link, 1.0), self.origins.get(link, 0.0)
        way = evaluate(slide.direction, self.values)
        way /= abs(way) * axis
        slider = (self._world(slide.slider) - origin) / axis
        at_start = link_shape(self.pose.links[link]).position(name)
        through = complex(at_start.x, at_start.y)
        free = self._free_coordinates(link, name)
        angle = self.pose.line_angle(slide.pair.name)
        found: dict[str, float] = {}
        given = self.problem.first_slides.get(slide.pair.name)
        if isinstance(name, str) and f"{link}.{name}.x" in numbers:
            through = complex(numbers[f"{link}.{name}.x"], numbers[f"{link}.{name}.y"])
        elif any(free):
            through = self._place_on_line(slider, way, through, free, given, link)
            found |= {f"{link}.{name}.x": through.real, f"{link}.{name}.y": through.imag}
        along = ((slider - through) * way.conjugate()).real
        if angle is not None and angle in self.pose.free:
            if along < 0.0 and given is None:
                way, along = -way, -along
            found[angle] = phase(way)
        first[slide.pair.name] = along
        self.lines[slide.pair.name] = way * axis
        return found

    def _free_coordinates(self, link: str, name: PointReference) -> tuple[bool, bool]:
        if link == self.mechanism.frame:
            return self.pose.free_coordinates(name)
        x, y = (f"{link}.{name}.{axis}" in self.pose.free for axis in "xy")
        return x, y

    def _place_on_line(
        self, slider: complex, way: complex, start: complex, free: tuple[bool, bool], given: float | None, link: str
    ) -> complex:
        if given is not None and all(free):
            return slider - given * way
        if all(free):  # where it comes nearest to a fixed pin, or to the origin of a link that moves
            frame = self.mechanism.frame
            pins = [self._world(p) for (own, _), p in self.pose.places.items() if own == frame == link]
            near = pins[0] if pins else 0.0j if link != frame else start
            return slider + ((near - slider) * way.conjugate()).real * way
        part = way.real if not free[0] else way.imag
        off = (start - slider).real if not free[0] else (start - slider).imag
        return slider + (off / part) * way if part else slider

    def _sketch(self, mechanism: Mechanism) -> Iterator[tuple[str, float, float]]:
        """Where every point stands that is not on the frame: joints alone may not tell two assemblies apart."""
        shapes = {link.name: link_shape(link) for link in mechanism.links}
        placed = {link for link, _ in self.pose.places}
        for each in named_points(mechanism):
            links = [(link, point) for link, point in each.members if link in placed]
            if links and all(link != mechanism.frame for link, _ in each.members):
                link, point = links[0]
                own = shapes[link].position(point)
                at = self.origins[link] + complex(float(own.x), float(own.y)) * self.axes[link]
                yield each.name, at.real, at.imag

    def _inputs(self, running: str, start: float) -> tuple[Array, ...]:
        """Where the input is at every entry of the task's items, in the task's order."""
        by_item: dict[int, Array] = {}
        for k, (relations, wanted) in enumerate(zip(self.problem.relations, self.problem.items, strict=True)):
            given, _ = self.problem.entry_numbers(wanted, relations.numbers, k > 0)
            positions: list[float] = [] if k else [start]
            for numbers in given:
                here = entry_values(relations, numbers, self.values)
                positions.append(start + self._moved(relations, running, here))
            by_item[id(wanted)] = np.array(positions)
        return tuple(by_item[id(each)] for each in self.problem.task.wanted)

    def _moved(self, relations: EntryRelations, running: str, here: Values) -> float:
        if running in relations.slides:
            slid = evaluate(relations.slides[running], here).real * self.problem.size
            written = next(each for each in self.pose.slides if each.pair.name == running)
            way = evaluate(written.direction, here)
            return slid * abs(way) * (1.0 if (self.lines[running] / way).real > 0.0 else -1.0)
        return phase(evaluate(relations.links[turned_link(self.pose, running)].turn, here))
