"""All positions of an input at which assemblies meet: its dead points, found group after group.

Of a group the function N = product of the slope's determinant over all its solutions, complex ones included, vanishes
just where two of them meet. It is an analytic function of the input where the groups before it are, and real. Where
those have several assemblies it is taken for each choice of a dyad's sign, and multiplied over those of larger groups;
where these come and go, at their own dead points, it has square roots.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from math import hypot, isfinite, log, pi
from typing import NamedTuple

import numpy as np

from planar.assemblies.block_roots import MOST_PATHS, roots
from planar.assemblies.circuits.chebyshev_zeros import NONE, Value, Zeros, zeros
from planar.assemblies.circuits.discriminant import Solutions, Unclaimed
from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.polynomial.isotropic_form import form
from planar.assemblies.search_tree import straight
from planar.equations.constraint_equations import Stage
from planar.equations.functions import length
from planar.model.pairs import Kind
from planar.solving.assembly.block_assemblies import hanging
from planar.solving.newton import CLOSED
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

Choices = tuple[int, ...]
"""Of every group on the way which of its two closed forms is taken, 0 where there is no choice to make."""

START = -1.2345
"""rad: where a turn is cut, at no position that means anything."""
BUDGET = 60_000
"""Groups solved before the search for dead points is given up."""
BEYOND = 2.0
"""Of what all links together reach: further a slide cannot be out, if nothing else slides."""
ROUNDING = 1e-10
"""rad or sizes: zeros of two functions that are nearer to each other than this are one."""


CROSS = "branches cross, or all but cross"


class Critical(NamedTuple):
    """Positions of the input (rad in [0, 2 pi), or m) where two assemblies meet, and where they meet and go on both
    ways; the range looked over; and what leaves it open whether these are all."""

    positions: tuple[float, ...]
    crossings: tuple[float, ...]
    span: tuple[float, float]
    open: tuple[str, ...]


def critical(setup: Setup, index: int) -> Critical:
    """The dead points of one input, the others standing still."""
    return _Searching(setup, index).critical()


class _Searching:
    """The dead points of one mechanism; positions of the input are in rad and sizes here."""

    def __init__(self, setup: Setup, index: int):
        self.setup, self.index = setup, index
        self.stages = setup.equations.stages
        self.pair = setup.mechanism.inputs[index].pair
        self.slides = setup.slides(self.pair)
        self.hangs_on = _before(setup)
        self.anywhere = np.random.default_rng(1).uniform(0.5, 2.0, len(setup.equations.unknowns))
        self.solutions: dict[int, Solutions | None] = {}
        self.budget = BUDGET
        reach = BEYOND * sum(setup.reach.values()) or 1.0
        self.span = (-reach, reach) if self.slides else (START, START + 2.0 * pi)
        self._reached: dict[tuple[float, tuple[int, ...]], list[tuple[Choices, Array]]] = {}

    def critical(self) -> Critical:
        found: list[list[float]] = []
        crossings: list[list[float]] = []
        doubts: list[str] = []
        if self.setup.outline.counts:
            doubts.append("angles count turns, so that one turn of the input does not show all positions")
        for level, stage in enumerate(self.stages):
            edges = {*self.span}.union(*(found[k] + crossings[k] for k in self.hangs_on[level]))
            crossed, touched = set(), set()
            try:
                for low, high in pairwise(_distinct(edges)):
                    for each in self._zeros(level, low, high):
                        crossed |= set(each.crossed)
                        touched |= set(each.touched)
                        if not each.all:
                            raise Unclaimed("they cannot be told apart to rounding")
            except Unclaimed as why:
                doubts.append(f"dead points of the group with {', '.join(stage.links)} may be missing: {why}")
            found.append(_distinct(crossed))
            crossings.append(_distinct(touched))
        # where two groups have a dead point at once, two ways lead on from it
        every = sorted(at for part in found for at in part)
        if any(crossings) or any(high - low < ROUNDING for low, high in pairwise(every)):
            doubts.append(CROSS)
        if self.slides and not self._bounded():
            low, high = (self.setup.told(self.pair, at) for at in self.span)
            doubts.append(f"other slides may let it run on without end; it was looked over from {low} to {high}")
        return Critical(self._told(found), self._told(crossings), self._range(), tuple(doubts))

    def _told(self, found: Sequence[Sequence[float]]) -> tuple[float, ...]:
        by = self.setup.unit if self.slides else 1.0
        every = (each * by if self.slides else each % (2.0 * pi) for part in found for each in part)
        return tuple(sorted(set(every)))

    def _range(self) -> tuple[float, float]:
        by = self.setup.unit
        return (self.span[0] * by, self.span[1] * by) if self.slides else (0.0, 2.0 * pi)

    def _bounded(self) -> bool:
        """Whether it is out of all links' reach what the input does beyond the range: where nothing else slides."""
        given = {each.pair for each in self.setup.mechanism.inputs}
        return not any(pair.drive_kind is Kind.LENGTH for name, pair in self.setup.named.items() if name not in given)

    def _zeros(self, level: int, low: float, high: float) -> Iterator[Zeros]:
        """The zeros of N of a group between two places where the groups before it have dead points, for each choice."""
        kept: dict[float, dict[Choices, Value]] = {}

        def values(at: float) -> dict[Choices, Value]:
            if at not in kept:
                kept[at] = self._values(level, at)
            return kept[at]

        choices = set(values(0.5 * (low + high)))
        for each in sorted(choices):

            def value(at: float, each: Choices = each) -> Value:
                found = values(at)
                if set(found) != choices:
                    raise Unclaimed("the groups before it have others than were found")
                return found[each]

            yield zeros(value, low, high)

    def _values(self, level: int, at: float) -> dict[Choices, Value]:
        """N of a group with the input at a place, for each choice before it."""
        found: dict[Choices, Value] = {}
        u = self._inputs(at)
        for choices, z in self._before(level, at):
            sign, size = self._value(level, z, u)
            before = found.get(choices, Value(1.0, 0.0))
            found[choices] = Value(before.sign * sign, before.log + size)
        return found

    def _inputs(self, at: float) -> Array:
        u = self.setup.station.u.copy()
        u[self.index] = at
        return u

    def _before(self, level: int, at: float) -> list[tuple[Choices, Array]]:
        """Every assembly of the groups on which one hangs."""
        found = [((), np.zeros(len(self.setup.equations.unknowns)))]
        u = self._inputs(at)
        earlier = tuple(sorted(self.hangs_on[level]))
        for k, group in enumerate(earlier):
            key = at, earlier[: k + 1]
            if key not in self._reached:
                own = self.stages[group].unknowns
                following = []
                for choices, z in found:
                    for choice, values in self._assemblies(group, z, u):
                        there = z.copy()
                        there[own] = values
                        following.append(((*choices, choice), there))
                self._reached[key] = following
            found = self._reached[key]
        return found

    def _spend(self, by: int) -> None:
        self.budget -= by
        if self.budget < 0:
            raise Unclaimed("there are too many choices before it")

    def _assemblies(self, level: int, z: Array, u: Array) -> list[tuple[int, Array]]:
        """The assemblies of one group, those before it given: which of two closed forms, and the unknowns."""
        stage, setup = self.stages[level], self.setup
        self._spend(1)
        closed = setup.program.assemblies(stage)
        if closed is not None:
            both, left, bend = closed(z, u, setup.station.p)
            if not bend < 1.0:
                return []
            if not left <= CLOSED:
                raise Unclaimed("an earlier group does not close")
            return list(enumerate(both))
        self._spend(20)
        there = _at(setup, u)
        found = roots(there, stage, z, certify=False)
        if found.complete is Completeness.NOT or found.curve:
            raise Unclaimed("not all assemblies of the groups before it are known")
        return [(0, each) for each in found.real]

    def _value(self, level: int, z: Array, u: Array) -> Value:
        """N of one group, those before it given."""
        stage, setup = self.stages[level], self.setup
        if length(stage.rows) != length(stage.unknowns):
            raise Unclaimed("it holds more than it needs")
        self._spend(1)
        closed = setup.program.assemblies(stage)
        if closed is not None:
            _, _, bend = closed(z, u, setup.station.p)
            if np.isnan(bend):
                raise Unclaimed("its links have no length")
            return _valued(bend)
        if level not in self.solutions:
            self.solutions[level] = None if straight(setup, stage, self.anywhere) else self._solutions(stage)
        of = self.solutions[level]
        if of is None:
            slope = setup.program.closed(stage)(z, u, setup.station.p)[1]
            return Value(*map(float, np.linalg.slogdet(slope)))
        self._spend(of.form.bound)
        return of.product(z, u, setup.station.p)

    def _solutions(self, stage: Stage) -> Solutions:
        found = form(self.setup.equations, stage)
        if found is None:
            raise Unclaimed("its equations are no polynomials of this kind")
        if found.bound > MOST_PATHS:
            raise Unclaimed(f"it may have up to {found.bound} complex solutions")
        return Solutions(self.setup.equations, found)


def _distinct(places: Iterable[float]) -> list[float]:
    """Places in their order; what rounding makes of one is one."""
    found: list[float] = []
    for at in sorted(places):
        if not found or at - found[-1] > ROUNDING:
            found.append(at)
    return found


def _valued(bend: float) -> Value:
    """How far a dyad is from where its assemblies meet; without the poles that `bend` has where a length vanishes."""
    number = (1.0 - bend) / hypot(1.0, bend) if isfinite(bend) else -1.0
    return Value(float(np.sign(number)), log(abs(number))) if number else NONE


def _at(setup: Setup, u: Array) -> Setup:
    """The same setup with other inputs' numbers."""
    there = object.__new__(type(setup))
    there.__dict__.update(setup.__dict__)
    there.station = setup.station._replace(u=u)
    return there


def _before(setup: Setup) -> list[set[int]]:
    """The earlier groups on which each group hangs, itself or through others."""
    stages = setup.equations.stages
    of = {column: k for k, stage in enumerate(stages) for column in range(stage.unknowns.start, stage.unknowns.stop)}
    found: list[set[int]] = []
    for columns in hanging(setup):
        direct = {of[column] for column in columns}
        found.append(direct.union(*(found[k] for k in direct)))
    return found
