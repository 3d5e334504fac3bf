"""A real solution as a mechanism, with the position of its input at every entry."""

from __future__ import annotations

from cmath import exp, phase
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import Dimension, file_dimensions
from planar.document.revised.changed_numbers import with_values
from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.model.link_shapes import At, Link, Point, link_shape
from planar.model.mechanism import Mechanism, named_points
from planar.synthesis.exact.relations.entry_relations import EntryRelations, turned_link
from planar.synthesis.exact.relations.exact_problem import ExactProblem
from planar.synthesis.exact.relations.polynomials import Polynomial
from planar.synthesis.exact.relations.reference_pose import Coordinates, LinkAxes, SlidingRow
from planar.synthesis.exact.relations.unknowns import NumberKind

NO_LENGTH = 1e-9
"""Of the size of the task: pins that are less apart are at one place."""
PARALLEL = 1e-12
"""Of a unit vector: a part that is nothing."""
AXES_STEPS, AXES_MET, AXES_OPEN = 40, 1e-13, 1e-6
"""Newton's steps for the axes of a link; rad, or of the size: what is met, and what no axes meet if none miss less."""

Values = dict[int, complex]
"""Of symbols, by their numbers."""


class NoLinkageError(ValueError):
    """A solution of the equations that is no linkage.

    Two pins of a link are at one place, a line goes from its second point to its first one, or the places are real
    where numbers of a link are not, as a coordinate of a point beyond its distance.
    """


class ExactLinkage(NamedTuple):
    """A mechanism, the numbers of it that were sought (SI), and where its running input is (n,) at the entries of each
    wanted item of the task, rad or m; `opposite` are links whose length is negative, so that points stand for it.
    `pose` (n,) are its points at the first entry, x + i y in units of the task, and the squares of its lines'
    directions."""

    mechanism: Mechanism
    numbers: dict[str, float]
    inputs: tuple[Array, ...]
    opposite: tuple[str, ...]
    pose: ComplexArray


def exact_linkage(problem: ExactProblem, solution: Mapping[int, complex], name: str) -> ExactLinkage:
    """The linkage of a real solution, the values of all unknowns. Raises BadInput where no file could say it, and
    NoLinkageError where it is no linkage."""
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
        self.axes: dict[str, complex] = {self.mechanism.frame: 1.0 + 0.0j}
        self.origins: dict[str, complex] = {self.mechanism.frame: 0.0j}
        "x-axes and origins of links at the first entry"
        self.lines: dict[str, complex] = {}
        "directions of lines at the first entry, as they are written"
        self.numbers: dict[str, float] = {}
        self.displacements: dict[str, float] = {}
        "of slides at the first entry (m)"

    def _world(self, place: Polynomial) -> complex:
        return evaluate(place.substitute(self.pose.values), self.values) * self.problem.size + self.problem.origin

    def _way(self, direction: Polynomial) -> complex:
        way = evaluate(direction.substitute(self.pose.values), self.values)
        return way / abs(way) if abs(way) > 0.0 else 1.0 + 0.0j

    def write(self, name: str) -> ExactLinkage:
        """The mechanism with its numbers."""
        self._check_pins()
        for link in self.mechanism.links:
            if link.name != self.mechanism.frame:
                self.origins[link.name], self.axes[link.name] = self._link_axes(link)
            for point, place in self._places(link).items():
                self._note(self.pose.coordinates(link.name, point), self._own(link.name, place))
        for slide in self.pose.slides:
            self._note_line(slide)
        missing = [each for each in self.problem.free if each not in self.numbers and self.problem.task.free]
        if missing:
            raise BadInput(
                "$.free", f"{missing[0]!r} of {self.mechanism.name!r} cannot be sought exactly; leave it out"
            )
        running = self.mechanism.inputs[0].pair
        start = self.displacements.get(running)
        if start is None:
            start = phase(self.axes[turned_link(self.pose, running)])
        base = replace(self.mechanism, name=name, about=None, source=None, published=(), ids=())
        base, numbers, opposite = _with_opposite_links(base, self.numbers)
        whole = with_values(base, numbers | {f"{running}.position": start})
        whole = replace(whole, sketch=tuple(self._sketch(whole)))
        chosen = {name: value for name, value in numbers.items() if name in self.pose.free or name not in self.numbers}
        places = [self._world(place) / self.problem.size for place in self.pose.places.values()]
        pose = np.array([*places, *(way * way for way in self.lines.values())])
        return ExactLinkage(whole, chosen, self._inputs(running, start), opposite, pose)

    def _check_pins(self) -> None:
        """Raise NoLinkageError where pins of a link are at one place that are apart in the start."""
        pins = {member for pair in self.mechanism.pairs if pair.has_pin() for member in pair.coincident_points()}
        nothing = NO_LENGTH * self.problem.size
        for link in self.mechanism.links:
            places, shape = self._places(link), link_shape(link)
            for one, other in combinations([name for name in places if (link.name, name) in pins], 2):
                start = shape.position(one) - shape.position(other)
                if abs(places[one] - places[other]) < nothing < np.hypot(float(start.x), float(start.y)):
                    raise NoLinkageError(f"{one!r} and {other!r} of {link.name!r} are at one place")

    def _places(self, link: Link) -> dict[str, complex]:
        return {name: self._world(place) for (own, name), place in self.pose.places.items() if own == link.name}

    def _own(self, link: str, place: complex) -> complex:
        """A place in the axes of a link."""
        return (place - self.origins[link]) / self.axes[link]

    def _note(self, at: Coordinates, own: complex) -> None:
        """The numbers of a point that are sought, of where it lies in its link."""
        for name, value, start in ((at.x, own.real, at.value.real), (at.y, own.imag, at.value.imag)):
            if name is not None:
                self.numbers[name] = float(self.pose.numbers[name].value + value - start)

    def _link_axes(self, link: Link) -> tuple[complex, complex]:
        """Where the origin of a link is, and its x-axis as a unit vector, at the first entry."""
        direction, origin = self.pose.axes.get(link.name, LinkAxes(None, None))
        known_way = None if direction is None else self._way(direction)
        known_origin = None if origin is None else self._world(origin)
        drawn_origin, drawn_way = self._drawn_axes(link, known_way)
        if known_origin is not None and known_way is not None:
            return known_origin, known_way
        rows = _AxesRows(self, link, known_way, known_origin)
        return rows.solve(drawn_origin if known_origin is None else known_origin, drawn_way)

    def _drawn_axes(self, link: Link, way: complex | None) -> tuple[complex, complex]:
        """The axes by which points lie as they are drawn, one of them there and another one in that direction."""
        places, shape = self._places(link), link_shape(link)
        drawn = {name: complex(shape.position(name).x, shape.position(name).y) for name in link.names}
        used = [name for name in link.names if name in places]
        if way is None:
            way = 1.0 + 0.0j
            if len(used) > 1:
                first, *others = used
                other = max(others[:1], key=lambda each: abs(places[each] - places[first]))
                turn = (places[other] - places[first]) * (drawn[other] - drawn[first]).conjugate()
                way = turn / abs(turn) if abs(turn) > 0.0 else way
        return (places[used[0]] - drawn[used[0]] * way, way) if used else (0.0j, way)

    def _note_line(self, slide: SlidingRow) -> None:
        """The numbers of a line that are sought, and how far its slider is from what it goes through."""
        (link, block), name = slide.pair.links, slide.pair.name
        way = self._way(slide.direction) / self.axes[link]
        slider = self._own(link, self._world(slide.slider))
        at = self.pose.coordinates(link, slide.through, slide.pair)
        turn = self.pose.line_turn(slide.pair)
        given = self.problem.first_slides.get(name)
        along_line = None if turn is None else exp(1j * turn)
        if slide.end is not None:
            along_line = evaluate(slide.end.substitute(self.pose.values), self.values) / self.axes[link]
        if along_line is not None and (way * along_line.conjugate()).real < 0.0:
            if slide.end is not None and name not in self.pose.patched:
                raise NoLinkageError(f"the line of {name!r} goes the opposite way")
            way = -way
        if isinstance(slide.through, str) and (link, slide.through) in self.pose.places:
            through = self._own(link, self._world(self.pose.places[link, slide.through]))
        elif given is not None:
            through = slider - given(self.problem.items[0]) * way
        else:
            through = self._place_on_line(slider, way, at, link)
        along = ((slider - through) * way.conjugate()).real
        if along_line is None:
            if along < 0.0 and name in self.pose.patched:
                way, along = -way, -along
            self.numbers[f"{name}.line.angle"] = phase(way)
        if f"{name}.turn" in self.pose.free and block in self.pose.axes:
            self.numbers[f"{name}.turn"] = phase(self.axes[block] / (way * self.axes[link]))
        self._note(at, through)
        self.displacements[name] = along
        self.lines[name] = way * self.axes[link]

    def _place_on_line(self, slider: complex, way: complex, at: Coordinates, link: str) -> complex:
        """Where a line goes through: as far as that is open where it comes nearest to a fixed pin, or to the origin of
        a link that moves."""
        start = at.value
        if at.x is not None and at.y is not None:
            frame = self.mechanism.frame
            pins = [self._world(p) for (own, _), p in self.pose.places.items() if own == frame == link]
            near = pins[0] if pins else 0.0j if link != frame else start
            return slider + ((near - slider) * way.conjugate()).real * way
        if at.x is None and at.y is None:
            return start
        part, off = (way.real, (start - slider).real) if at.x is None else (way.imag, (start - slider).imag)
        return slider + (off / part) * way if abs(part) > PARALLEL else start

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


class _AxesRows:
    """What is given of a link as equations for its axes: the direction (rad) and the origin (units of the task)."""

    def __init__(self, writer: _LinkageWriter, link: Link, way: complex | None, origin: complex | None):
        self.writer, self.pose, self.name = writer, writer.pose, link.name
        self.is_open = np.array([way is None, *[origin is None] * 2])
        self.points = [(place, self.pose.coordinates(link.name, name)) for name, place in writer._places(link).items()]
        self.lines: list[tuple[complex, complex, complex | None, complex | None]] = []
        for slide in self.pose.slides:
            if slide.pair.bodies[0] == link.name:
                self._add_line(slide)

    def _add_line(self, slide: SlidingRow) -> None:
        pose, writer = self.pose, self.writer
        at = pose.coordinates(self.name, slide.through, slide.pair)
        way, slider = writer._way(slide.direction), writer._world(slide.slider)
        given = writer.problem.first_slides.get(slide.pair.name)
        is_elsewhere = (self.name, slide.through) in pose.places
        if given is not None and not is_elsewhere:
            self.points.append((slider - given(writer.problem.items[0]) * way, at))
        line_turn = pose.line_turn(slide.pair)
        turn = None if line_turn is None else exp(1j * line_turn)
        has_place = given is None and not is_elsewhere and all(at.is_given)
        self.lines.append((slider, way, turn, at.value if has_place else None))

    def rows(self, unknowns: Array) -> Array:
        """By how much what is given is missed, rad and in units of the task."""
        size, found = self.writer.problem.size, list[float]()
        way, origin = exp(1j * unknowns[0]), complex(unknowns[1], unknowns[2]) * size
        for place, at in self.points:
            off = ((place - origin) / way - at.value) / size
            found += [off.real] * at.is_given[0] + [off.imag] * at.is_given[1]
        for slider, line, turn, through in self.lines:
            if turn is not None:
                found.append((line / (way * turn)).imag)
            if through is not None:
                found.append(((slider - origin - through * way) / line).imag / size)
        return np.array(found)

    def solve(self, origin: complex, way: complex) -> tuple[complex, complex]:
        """The axes that are nearest to some by which points are as they are drawn. Raises NoLinkageError where there
        are none, and BadInput where they are not found to round-off."""
        size = self.writer.problem.size
        reach = max((abs(place) / size for place, _ in self.points), default=1.0)  # what is far is rounded more
        least = np.inf
        for turn in (0.0, 1.0, -1.0, 2.0, -2.0, 3.0, -3.0, 4.0):
            x = np.array([phase(way) + turn * np.pi / 4 * self.is_open[0], origin.real / size, origin.imag / size])
            for _ in range(AXES_STEPS):
                rows = self.rows(x)
                miss = np.abs(rows).max(initial=0.0) / max(1.0, reach)
                least = min(least, miss)
                if miss < AXES_MET:
                    return complex(x[1], x[2]) * size, exp(1j * x[0])
                slopes = np.array([(self.rows(x + h) - self.rows(x - h)) / 2e-6 for h in 1e-6 * np.eye(3)]).T
                x = x - self.is_open * np.linalg.lstsq(slopes * self.is_open, rows, rcond=1e-9)[0]
        if least > AXES_OPEN:
            raise NoLinkageError(f"no axes of {self.name!r} give its points the numbers that are given")
        raise BadInput("$.free", f"no axes of {self.name!r} give its points the numbers that are given")


def _with_opposite_links(
    mechanism: Mechanism, numbers: Mapping[str, float]
) -> tuple[Mechanism, dict[str, float], tuple[str, ...]]:
    """The mechanism with points for each link whose length is negative, its numbers, and the names of such links."""
    links, values, opposite = list[Link](), dict(numbers), list[str]()
    lengths = {each.path[1]: each.name for each in file_dimensions(mechanism).values() if _is_link_length(each)}
    for link in mechanism.links:
        name = lengths.get(link.name)
        if name is None or values.get(name, 0.0) >= 0.0 or link.ends is None:
            links.append(link)
            continue
        shape = link_shape(link)
        at = {point: shape.position(point) for point in link.names}
        at[link.ends[1]] = Vector(values.pop(name), 0.0)
        links.append(Link(link.name, tuple(Point(point, At(float(p.x), float(p.y))) for point, p in at.items())))
        values[f"{link.name}.{link.ends[1]}.x"] = float(at[link.ends[1]].x)
        opposite.append(link.name)
    return replace(mechanism, links=tuple(links)) if opposite else mechanism, values, tuple(opposite)


def _is_link_length(each: Dimension) -> bool:
    return len(each.path) == 3 and (each.path[0], each.path[2]) == ("links", "length")
