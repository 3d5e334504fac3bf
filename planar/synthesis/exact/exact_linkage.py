"""A real solution as a mechanism, with the position of its input at every entry."""

from __future__ import annotations

from cmath import exp, phase
from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.document.revised.changed_numbers import with_values
from planar.foundation.arrays import Array, ComplexArray
from planar.model.link_shapes import Link, link_shape
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
        "x-axes of moving links at the first entry"
        self.lines: dict[str, complex] = {}
        "directions of lines, as they are written"

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
        sketch = tuple(self._sketch())
        base = replace(self.mechanism, sketch=sketch, name=name, about=None, source=None, published=(), ids=())
        whole = with_values(base, chosen | {f"{running}.position": start})
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
        self.axes[link.name] = way
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
        """The direction of a line, and the point that it goes through; `first` gets the displacement."""
        frame, name = self.mechanism.frame, slide.through
        way = evaluate(slide.direction, self.values)
        way /= abs(way)
        slider = self._world(slide.slider)
        shape = link_shape({each.name: each for each in self.mechanism.links}[frame])
        at_start = shape.position(name)
        through = complex(at_start.x, at_start.y)
        free = self.pose.free_coordinates(name)
        angle = self._angle_name(slide)
        found: dict[str, float] = {}
        given = self.problem.first_slides.get(slide.pair.name)
        if isinstance(name, str) and f"{frame}.{name}.x" in numbers:
            through = complex(numbers[f"{frame}.{name}.x"], numbers[f"{frame}.{name}.y"])
        elif any(free):
            through = self._place_on_line(slider, way, through, free, given)
            found |= {f"{frame}.{name}.x": through.real, f"{frame}.{name}.y": through.imag}
        along = ((slider - through) * way.conjugate()).real
        if angle in self.pose.free:
            if along < 0.0 and given is None:
                way, along = -way, -along
            found[angle] = phase(way)
        first[slide.pair.name] = along
        self.lines[slide.pair.name] = way
        return found

    def _place_on_line(
        self, slider: complex, way: complex, start: complex, free: tuple[bool, bool], given: float | None
    ) -> complex:
        if given is not None and all(free):
            return slider - given * way
        if all(free):  # where it comes nearest to a fixed pin
            pins = [self._world(p) for (own, _), p in self.pose.places.items() if own == self.mechanism.frame]
            near = pins[0] if pins else start
            return slider + ((near - slider) * way.conjugate()).real * way
        part = way.real if not free[0] else way.imag
        off = (start - slider).real if not free[0] else (start - slider).imag
        return slider + (off / part) * way if part else slider

    def _angle_name(self, slide: SlidingRow) -> str:
        index = [each.name for each in self.mechanism.pairs].index(slide.pair.name)
        own = [
            name
            for name, each in self.pose.numbers.items()
            if each.address[:2] == ("pairs", index) and each.kind == "angle" and "line" in each.address
        ]
        return own[0] if own else ""

    def _sketch(self) -> list[tuple[str, float, float]]:
        found = []
        for each in named_points(self.mechanism):
            moving = [one for one in each.members if one[0] != self.mechanism.frame and one in self.pose.places]
            if len(each.members) > 1 and len(moving) == len(each.members):
                at = self._world(self.pose.places[moving[0]])
                found.append((each.name, at.real, at.imag))
        return found

    def _inputs(self, running: str, start: float) -> tuple[Array, ...]:
        """Where the input is at every entry of the task's items, in the task's order."""
        by_item: dict[int, Array] = {}
        for k, (relations, wanted) in enumerate(zip(self.problem.relations, self.problem.items, strict=True)):
            given = self.problem.entry_numbers(wanted, relations.numbers, k > 0)
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
