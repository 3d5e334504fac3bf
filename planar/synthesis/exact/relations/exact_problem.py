"""A task and a structure as polynomial systems: one for each part of the structure that has rows of its own."""

from __future__ import annotations

from cmath import exp
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.units import parse_unit
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.exact.relations.compiled_rows import CompiledRows
from planar.synthesis.exact.relations.elimination import EntryRows
from planar.synthesis.exact.relations.entry_relations import EntryNumber, EntryRelations, entry_relations, turned_link
from planar.synthesis.exact.relations.exact_numbers import ExactNumber, ExactScale
from planar.synthesis.exact.relations.family import Family, FamilyPart, Member
from planar.synthesis.exact.relations.given_numbers import KnownAxes, add_given_numbers
from planar.synthesis.exact.relations.polynomials import Polynomial, Symbol
from planar.synthesis.exact.relations.reference_pose import ReferencePose
from planar.synthesis.exact.relations.unknowns import NumberKind, refuse
from planar.synthesis.fitting.wanted_rows import wanted_size
from planar.synthesis.task.starts import free_numbers
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath, WantedPoses


class Component(NamedTuple):
    """A part of a structure with rows of its own, as a member of its family; `unknowns` are its symbols."""

    family: Family
    member: Member
    unknowns: tuple[Symbol, ...]

    @property
    def freedom(self) -> int:
        """How many real dimensions are left open; below zero more is wanted than can be met."""
        return self.family.size * 2 - self.family.row_count


class ExactProblem:
    """All that is to be solved for a task by one start; lengths are in units of `size` (m) from `origin`."""

    def __init__(self, task: SynthesisTask, mechanism: Mechanism):
        self.task, self.mechanism = task, mechanism
        self.items = _ordered_items(task, mechanism)
        self.free = free_numbers(task, mechanism).names
        is_function = isinstance(self.items[0], WantedFunction)
        self.pose = ReferencePose(mechanism, self.free, is_function)
        self.place: Polynomial | None = None
        "of what the first item places, at its first entry"
        self.axes = self._known_axes()
        self.first_slides = self._known_slides()
        relations = [self._relations(k, each) for k, each in enumerate(self.items)]
        add_given_numbers(self.pose, self.axes, self.first_slides)
        self.pose.finish()
        self.relations: tuple[EntryRelations, ...] = tuple(map(self._settled, relations))
        self.size = wanted_size(task, _extent(self.pose))
        self.origin = self._origin()
        self.exact_scale = self._exact_scale()
        self.components = self._components()

    # what is known at the first entry

    def _known_axes(self) -> dict[str, KnownAxes]:
        main, table, found = self.items[0], self.pose.table, dict[str, KnownAxes]()
        if isinstance(main, WantedFunction):
            if main.is_absolute:
                for name, value in ((main.from_pair, main.inputs[0]), (main.to_pair, main.values[0])):
                    self._add_axis(found, name, float(value))
            return found
        self.place = table.add_given(NumberKind.PLACE, complex(*main.places[0])).value
        if isinstance(main, WantedPoses):
            way = table.add_given(NumberKind.TURN, float(main.angles[0])).value
            found[main.link] = KnownAxes(way, self.place)
        if main.inputs is not None and main.is_absolute:
            self._add_axis(found, self.mechanism.inputs[0].pair, float(main.inputs[0]))
        return found

    def _add_axis(self, axes: dict[str, KnownAxes], pair: str, value: float) -> None:
        if self._slides(pair):
            return
        link = turned_link(self.pose, pair)
        if link in axes:
            raise refuse(f"the angle of {link!r} is given twice")
        axes[link] = KnownAxes(self.pose.table.add_given(NumberKind.TURN, value).value, None)

    def _known_slides(self) -> dict[str, float]:
        main = self.items[0]
        if not main.is_absolute:
            return {}
        if isinstance(main, WantedFunction):
            known = {main.from_pair: main.inputs, main.to_pair: main.values}
        else:
            known = {} if main.inputs is None else {self.mechanism.inputs[0].pair: main.inputs}
        return {name: float(values[0]) for name, values in known.items() if self._slides(name)}

    def _slides(self, pair: str) -> bool:
        return relative_motions(self.mechanism)[pair].input_kind is MeasureKind.LENGTH

    # rows

    def _relations(self, k: int, wanted: Wanted) -> EntryRelations:
        if isinstance(wanted, WantedPath):
            link, name = _member(self.mechanism, wanted.point)
            if k == 0:
                assert self.place is not None
                self.pose.tie(self.pose.place(link, name) - self.place)
            return entry_relations(self.pose, wanted._replace(link=link), self.pose.place(link, name), None)
        return entry_relations(self.pose, wanted, None, self.place)

    def _settled(self, each: EntryRelations) -> EntryRelations:
        """With what was put in later."""
        values = self.pose.values
        rows = EntryRows(
            tuple(row.substitute(values) for row in each.rows.rows),
            tuple(type(row)(*(part.substitute(values) for part in row)) for row in each.rows.linear),
            each.rows.turn,
            tuple(
                type(s)(s.symbol, s.numerator.substitute(values), s.denominator.substitute(values))
                for s in each.rows.steps
            ),
        )
        return each._replace(rows=rows)

    # numbers

    def _origin(self) -> complex:
        main = self.items[0]
        if not isinstance(main, WantedFunction):
            return complex(*main.places[0])
        places = [each.value for each in self.pose.table.given if each.kind is NumberKind.PLACE]
        return complex(places[0]) if places else 0.0

    def _exact_scale(self) -> ExactScale:
        files = self.task.units, self.mechanism.units
        lengths, angles = (
            tuple(map(parse_unit, names)) for names in ((each.length for each in files), (each.angle for each in files))
        )
        return ExactScale(lengths, angles, self.origin, self.size)

    def scaled(self, kind: NumberKind, value: complex) -> tuple[complex, complex]:
        """A number as members have it."""
        if kind is NumberKind.TURN:
            return value, value
        if kind is NumberKind.PLACE:
            value = value - self.origin
        value = complex(value) / self.size
        return value, value.conjugate()

    def _components(self) -> tuple[Component, ...]:
        table = self.pose.table
        given = [number for each in table.given for number in each.symbol]
        kinds = tuple(each.kind for each in table.given)
        first = np.array([self.scaled(each.kind, each.value) for each in table.given], dtype=complex).reshape(1, -1, 2)
        exact_first = [[self.exact_scale.scaled(each.kind, each.value) for each in table.given]]
        found = []
        for unknowns in _groups(self.pose, self.relations):
            symbols = [each.own for each in unknowns] + [each.conjugate for each in unknowns]
            own = set(symbols)
            conditions = EntryRows(tuple(row for row in self.pose.conditions if own & row.symbols), (), None, ())
            parts = [FamilyPart(CompiledRows(conditions, symbols, given), kinds, 1)]
            values, exact = [first], [exact_first]
            for k, (each, wanted) in enumerate(zip(self.relations, self.items, strict=True)):
                rows = each.rows
                if rows.turn is None:
                    rows = rows._replace(rows=tuple(row for row in rows.rows if own & row.symbols))
                elif not any(own & part.symbols for row in rows.linear for part in row):
                    continue
                numbers, exact_numbers = self.entry_numbers(wanted, each.numbers, k > 0)
                entry = [number for one in each.numbers for number in one.symbol]
                compiled = CompiledRows(rows, symbols, [*given, *entry])
                parts.append(FamilyPart(compiled, tuple(one.kind for one in each.numbers), len(numbers)))
                values.append(numbers)
                exact.append(exact_numbers)
            member = Member(tuple(values), tuple(exact))
            found.append(Component(Family(len(unknowns), tuple(parts)), member, unknowns))
        return tuple(found)

    def entry_numbers(
        self, wanted: Wanted, numbers: tuple[EntryNumber, ...], has_own_first: bool
    ) -> tuple[ComplexArray, list[list[ExactNumber]]]:
        """The numbers (entries, numbers, 2) of a wanted item, from those of the first entry of all, and as its file has
        them."""
        columns: list[tuple[Array | ComplexArray, float]] = []
        if isinstance(wanted, WantedFunction):
            columns += [(wanted.inputs, wanted.inputs[0]), (wanted.values, wanted.values[0])]
        else:
            columns.append((wanted.places[:, 0] + 1j * wanted.places[:, 1], 0.0))
            if isinstance(wanted, WantedPoses):
                columns.append((wanted.angles, self.items[0].angles[0]))  # type: ignore[union-attr]
            if wanted.inputs is not None:
                columns.append((wanted.inputs, wanted.inputs[0]))
        entries = range(0 if has_own_first else 1, len(wanted.weights))
        kinds = [one.kind for one in numbers]
        rows = [
            [
                self.scaled(kind, complex(column[k] - first))
                for kind, (column, first) in zip(kinds, columns, strict=True)
            ]
            for k in entries
        ]
        exact = [
            [
                self.exact_scale.scaled(kind, complex(column[k]), complex(first))
                for kind, (column, first) in zip(kinds, columns, strict=True)
            ]
            for k in entries
        ]
        return np.array(rows, dtype=complex).reshape(-1, len(numbers), 2), exact

    def first_values(self) -> dict[int, complex]:
        """The given numbers by their symbols."""
        found: dict[int, complex] = {}
        for each in self.pose.table.given:
            value, other = self.scaled(each.kind, each.value)
            if each.kind is NumberKind.TURN:
                value, other = exp(1j * value), exp(-1j * value)
            found |= {each.symbol.own: value, each.symbol.conjugate: other}
        return found


def _ordered_items(task: SynthesisTask, mechanism: Mechanism) -> tuple[Wanted, ...]:
    """Poses first: they say how a link stands."""
    items = sorted(task.wanted, key=lambda each: not isinstance(each, WantedPoses))
    if len(items) > 1:
        if any(isinstance(each, WantedFunction) or each.inputs is not None for each in items):
            raise refuse("of several wanted things none may be a function or have inputs given")
        if len({each.link for each in items if isinstance(each, WantedPoses)}) > 1:
            raise refuse("poses of several links are wanted")
    if len(mechanism.inputs) != 1:
        raise refuse(f"{mechanism.name!r} has several inputs")
    return tuple(items)


def _member(mechanism: Mechanism, name: str) -> tuple[str, str]:
    every = {each.name: each.members for each in named_points(mechanism)}
    moving = [each for each in every[name] if each[0] != mechanism.frame]
    if not moving:
        raise refuse(f"{name!r} does not move")
    return moving[0]


def _extent(pose: ReferencePose) -> float:
    lengths = [abs(each.value) for each in pose.numbers.values() if each.kind == "length" and each.path[0] == "links"]
    return max(map(float, lengths), default=1.0) or 1.0


def _groups(pose: ReferencePose, relations: tuple[EntryRelations, ...]) -> list[tuple[Symbol, ...]]:
    """The unknowns that rows tie to each other."""
    together = [{each.own} for each in pose.table.unknowns]
    rows = [row.symbols for row in pose.conditions]
    for each in relations:
        rows += [row.symbols for row in each.rows.rows]
        rows.append(frozenset(k for row in each.rows.linear for part in row for k in part.symbols))
    for row in rows:
        own = {k & ~1 for k in row}
        meeting = [each for each in together if each & own]
        if len(meeting) > 1:
            together = [each for each in together if each not in meeting] + [set().union(*meeting)]
    order = [each.own for each in pose.table.unknowns]
    together.sort(key=lambda each: min(map(order.index, each)))
    return [tuple(one for one in pose.table.unknowns if one.own in each) for each in together]
