"""A task and a structure as polynomial systems: one for each part of the structure that has rows of its own."""

from __future__ import annotations

from cmath import exp
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

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
from planar.synthesis.exact.relations.given_numbers import add_given_numbers
from planar.synthesis.exact.relations.polynomials import Polynomial, Symbol
from planar.synthesis.exact.relations.reference_pose import LinkAxes, ReferencePose
from planar.synthesis.exact.relations.sought_numbers import sought_numbers
from planar.synthesis.exact.relations.unknowns import GivenNumber, NumberKind, refuse
from planar.synthesis.fitting.wanted_equations import wanted_size
from planar.synthesis.task.starts import free_numbers
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath, WantedPoses


class Component(NamedTuple):
    """A part of a structure with rows of its own, as a member of its family; `unknowns` are its symbols, `given` the
    numbers that stand in its rows, `items` the numbers of the wanted items that have rows of it."""

    family: Family
    member: Member
    unknowns: tuple[Symbol, ...]
    given: tuple[GivenNumber, ...]
    items: tuple[int, ...]

    @property
    def freedom(self) -> int:
        """How many real dimensions are left open; below zero more is wanted than can be met."""
        return self.family.size * 2 - self.family.row_count


class ExactProblem:
    """All that is to be solved for a task by one start; lengths are in units of `size` (m) from `origin`."""

    def __init__(self, task: SynthesisTask, mechanism: Mechanism):
        self.task, self.mechanism = task, mechanism
        self.items = _ordered_items(task, mechanism)
        self.free_numbers = free_numbers(task, mechanism)
        self.free = sought_numbers(task, mechanism, self.free_numbers)
        self.pose = ReferencePose(mechanism, self.free)
        self.place: Polynomial | None = None
        "of what the first item places, at its first entry"
        self.first_entry: dict[int, Callable[[Wanted], complex]] = {}
        "the given numbers that are those of the first entry, by their symbols"
        self._know_first_entry()
        self.first_slides = self._known_slides(lambda each: each.is_absolute)
        relations = [self._relations(k, each) for k, each in enumerate(self.items)]
        displacements = {name: self._know(NumberKind.LENGTH, value) for name, value in self.first_slides.items()}
        add_given_numbers(self.pose, displacements, self._known_slides(lambda _: True))
        self.pose.finish()
        self.relations: tuple[EntryRelations, ...] = tuple(map(self._settled, relations))
        self.size = wanted_size(task, _extent(self.pose))
        self.origin = self._origin()
        self.exact_scale = self._exact_scale()
        self.components = tuple(map(self._component, _groups(self.pose, self.relations)))
        self.fixed = self._component(())

    # what is known at the first entry

    def _know(self, kind: NumberKind, value: Callable[[Any], complex]) -> Polynomial:
        """A number of the first entry."""
        found = self.pose.table.add_given(kind, value(self.items[0]))
        self.first_entry[found.own] = value
        return found.value

    def _know_first_entry(self) -> None:
        main, axes = self.items[0], self.pose.axes
        if isinstance(main, WantedFunction):
            if main.is_absolute:
                self._know_axis(main.from_pair, lambda each: float(each.inputs[0]))
                self._know_axis(main.to_pair, lambda each: float(each.values[0]))
            return
        self.place = self._know(NumberKind.PLACE, lambda each: complex(*each.places[0]))
        if isinstance(main, WantedPoses):
            axes[main.link] = LinkAxes(self._know(NumberKind.TURN, lambda each: float(each.angles[0])), self.place)
        if main.inputs is not None and main.is_absolute:
            self._know_axis(self.mechanism.inputs[0].pair, lambda each: float(each.inputs[0]))

    def _know_axis(self, pair: str, value: Callable[[Any], complex]) -> None:
        if self._slides(pair):
            return
        link = turned_link(self.pose, pair)
        if link in self.pose.axes:
            raise refuse(f"the angle of {link!r} is given twice")
        self.pose.axes[link] = LinkAxes(self._know(NumberKind.TURN, value), None)

    def _known_slides(self, is_known: Callable[[Wanted], bool]) -> dict[str, Callable[[Any], float]]:
        """Pairs of which the first item says how far they slide, with what it says at its first entry (m)."""
        main = self.items[0]
        known: dict[str, Callable[[Any], float]] = {}
        if is_known(main) and isinstance(main, WantedFunction):
            known = {main.from_pair: lambda each: each.inputs[0], main.to_pair: lambda each: each.values[0]}
        elif is_known(main) and main.inputs is not None:
            known = {self.mechanism.inputs[0].pair: lambda each: each.inputs[0]}
        return {name: value for name, value in known.items() if self._slides(name)}

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

    def _component(self, unknowns: tuple[Symbol, ...]) -> Component:
        """The rows in which some unknowns stand, or those without any."""
        symbols = [each.own for each in unknowns] + [each.conjugate for each in unknowns]
        sought = {number for each in self.pose.table.unknowns for number in each}

        def belongs(used: frozenset[int]) -> bool:
            return bool(used & {*symbols}) if unknowns else not used & sought

        conditions = tuple(row for row in self.pose.conditions if row.symbols and belongs(row.symbols))
        counts = [
            len(self.entry_numbers(self.items[k], each.numbers, k > 0)[0]) for k, each in enumerate(self.relations)
        ]
        rows = [EntryRows(conditions, (), None, ())]
        for each, count in zip(self.relations, counts, strict=True):  # what has its first entry alone has no rows
            rows.append(_rows_of(belongs, each.rows) if count else EntryRows((), (), None, ()))
        used = frozenset[int]().union(*(each.symbols for each in rows))
        given = tuple(each for each in self.pose.table.given if used & {*each.symbol})
        numbers = [number for each in given for number in each.symbol]
        parts = [FamilyPart(CompiledRows(rows[0], symbols, numbers), tuple(each.kind for each in given), 1)]
        items = []
        for k, each in enumerate(self.relations):
            if rows[k + 1].equation_count:
                entry = [number for one in each.numbers for number in one.symbol]
                compiled = CompiledRows(rows[k + 1], symbols, [*numbers, *entry])
                parts.append(FamilyPart(compiled, tuple(one.kind for one in each.numbers), counts[k]))
                items.append(k)
        found = Component(Family(len(unknowns), tuple(parts)), Member(()), unknowns, given, tuple(items))
        return found._replace(member=self.member(found, self.items))

    def member(self, component: Component, items: Sequence[Wanted]) -> Member:
        """The member of a component's family for wanted items, which differ from the task's in their entries alone."""
        known = self.given_values(items)
        first = [self.scaled(each.kind, known[each.symbol.own]) for each in component.given]
        parts = [np.array(first, dtype=complex).reshape(1, -1, 2)]
        exact: list[list[list[ExactNumber]]] = [[[self._exact_given(each, items) for each in component.given]]]
        for k in component.items:
            numbers, exact_numbers = self.entry_numbers(items[k], self.relations[k].numbers, k > 0, items[0])
            parts.append(numbers)
            exact.append(exact_numbers)
        return Member(tuple(parts), tuple(exact))

    def _exact_given(self, given: GivenNumber, items: Sequence[Wanted]) -> ExactNumber:
        first = self.first_entry.get(given.symbol.own)
        value, start = (given.value, given.start) if first is None else (first(items[0]), 0.0)
        return self.exact_scale.scaled(given.kind, complex(value), start)

    def given_values(self, items: Sequence[Wanted]) -> dict[int, complex]:
        """The given numbers by their symbols (m, rad), those of the first entry from wanted items."""
        found = {each.symbol.own: each.value - each.start for each in self.pose.table.given}
        return found | {symbol: value(items[0]) for symbol, value in self.first_entry.items()}

    def entry_numbers(
        self, wanted: Wanted, numbers: tuple[EntryNumber, ...], has_own_first: bool, main: Wanted | None = None
    ) -> tuple[ComplexArray, list[list[ExactNumber]]]:
        """The numbers (entries, numbers, 2) of a wanted item, from those of the first entry of all, in the `main`, and
        as its file has them."""
        columns: list[tuple[Array | ComplexArray, float]] = []
        if isinstance(wanted, WantedFunction):
            columns += [(wanted.inputs, wanted.inputs[0]), (wanted.values, wanted.values[0])]
        else:
            columns.append((wanted.places[:, 0] + 1j * wanted.places[:, 1], 0.0))
            if isinstance(wanted, WantedPoses):
                columns.append((wanted.angles, (main or self.items[0]).angles[0]))  # type: ignore[union-attr]
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

    def first_values(self, items: Sequence[Wanted] | None = None) -> dict[int, complex]:
        """The given numbers by their symbols, as rows have them."""
        found: dict[int, complex] = {}
        known = self.given_values(items or self.items)
        for each in self.pose.table.given:
            value, other = self.scaled(each.kind, known[each.symbol.own])
            if each.kind is NumberKind.TURN:
                value, other = exp(1j * value), exp(-1j * value)
            found |= {each.symbol.own: value, each.symbol.conjugate: other}
        return found


def _rows_of(belongs: Callable[[frozenset[int]], bool], rows: EntryRows) -> EntryRows:
    """Those rows of an entry that belong to a component by their symbols."""
    if rows.turn is None:
        return rows._replace(rows=tuple(row for row in rows.rows if belongs(row.symbols)))
    return rows if belongs(rows.symbols) else EntryRows((), (), None, ())


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
