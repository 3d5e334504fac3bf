"""All positions of an input at which assemblies meet: its dead points, found block after block.

Of a block the function N = product of the slope's determinant over all its solutions, complex ones included, vanishes
just where two of them meet. It is an analytic function of the input where the blocks before it are, and real. Where
those have several assemblies it is taken for each choice of a dyad's sign, and multiplied over those of larger blocks;
where these come and go, at their own dead points, it has square roots.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from math import hypot, isfinite, log, pi
from typing import NamedTuple

import numpy as np

from planar.assemblies.block_roots import MAX_PATHS, block_roots
from planar.assemblies.circuits.chebyshev_zeros import ZERO, SignedLog, Zeros, find_zeros
from planar.assemblies.circuits.discriminant import DeadPointsUnclaimed, MovingSolutions
from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.polynomial.isotropic_form import isotropic_form
from planar.assemblies.search_tree import is_linear
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.arrays import Array
from planar.foundation.time_limit import time_is_over
from planar.model.pairs import MeasureKind
from planar.solving.assembly.block_assemblies import block_dependencies
from planar.solving.newton import CLOSED_TOLERANCE
from planar.solving.prepared_mechanism import PreparedMechanism

DyadChoices = tuple[int, ...]
"""Of every block on the way which of its two closed forms is taken, 0 where there is no choice to make."""

TURN_START = -1.2345
"""rad: where a turn is cut, at no position that means anything."""
MAX_SOLVED_BLOCKS = 60_000
"""Blocks solved before the search for dead points is given up."""
SLIDE_REACH_RATIO = 2.0
"""Of what all links together reach: further a slide cannot be out, if nothing else slides."""
SAME_POSITION_DISTANCE = 1e-10
"""rad or sizes: zeros of two functions that are nearer to each other than this are one."""


BRANCHES_CROSS = "branches cross, or all but cross"


class CriticalPositions(NamedTuple):
    """Positions of the input (rad in [0, 2 pi), or m) where two assemblies meet, and where they meet and go on both
    ways; the range looked over; and what leaves it open whether these are all."""

    positions: tuple[float, ...]
    crossings: tuple[float, ...]
    span: tuple[float, float]
    doubts: tuple[str, ...]


def longest_choice(setup: PreparedMechanism) -> int:
    """How many blocks of two unknowns or more hang on one another at most: each may be assembled in two ways."""
    blocks = setup.equations.blocks
    chosen = {k for k, block in enumerate(blocks) if slice_length(block.unknowns) > 1}
    return max((len(chosen & {k, *before}) for k, before in enumerate(_earlier_blocks(setup))), default=0)


def critical_positions(setup: PreparedMechanism, index: int) -> CriticalPositions:
    """The dead points of one input, the others standing still."""
    return _DeadPointSearch(setup, index).search()


class _PlacesDiffer(Exception):
    """Blocks have other assemblies at some places of the input than at others, or are solved at one place at a time."""


class _DeadPointSearch:
    """The dead points of one mechanism; positions of the input are in rad and sizes here."""

    def __init__(self, setup: PreparedMechanism, index: int):
        self.setup, self.index = setup, index
        self.stages = setup.equations.blocks
        self.pair = setup.mechanism.inputs[index].pair
        self.slides = setup.is_sliding(self.pair)
        self.dependencies = _earlier_blocks(setup)
        self.random_unknowns = np.random.default_rng(1).uniform(0.5, 2.0, len(setup.equations.unknowns))
        self.solutions: dict[int, MovingSolutions | None] = {}
        self.budget = MAX_SOLVED_BLOCKS
        reach = SLIDE_REACH_RATIO * sum(setup.reach.values()) or 1.0
        self.span = (-reach, reach) if self.slides else (TURN_START, TURN_START + 2.0 * pi)
        self._reached: dict[tuple[tuple[float, ...], tuple[int, ...]], list[tuple[DyadChoices, Array]]] = {}

    def search(self) -> CriticalPositions:
        found: list[list[float]] = []
        crossings: list[list[float]] = []
        doubts: list[str] = []
        if self.setup.structure.counts:
            doubts.append("angles count turns, so that one turn of the input does not show all positions")
        for level, stage in enumerate(self.stages):
            edges = {*self.span}.union(*(found[k] + crossings[k] for k in self.dependencies[level]))
            crossed, touched = set(), set()
            try:
                for low, high in pairwise(_distinct(edges)):
                    for each in self._zeros(level, low, high):
                        crossed |= set(each.crossed)
                        touched |= set(each.touched)
                        if not each.is_complete:
                            raise DeadPointsUnclaimed("they cannot be told apart to rounding")
            except DeadPointsUnclaimed as why:
                if time_is_over():
                    doubts.append(f"dead points may be missing: {why}")
                    break
                doubts.append(f"dead points of the group with {', '.join(stage.links)} may be missing: {why}")
            found.append(_distinct(crossed))
            crossings.append(_distinct(touched))
        # where two blocks have a dead point at once, two ways lead on from it
        every = sorted(at for part in found for at in part)
        if any(crossings) or any(high - low < SAME_POSITION_DISTANCE for low, high in pairwise(every)):
            doubts.append(BRANCHES_CROSS)
        if self.slides and not self._is_bounded():
            first, last = (self.setup.describe_input(self.pair, at) for at in self.span)
            doubts.append(f"other slides may let it run on without end; it was looked over from {first} to {last}")
        return CriticalPositions(self._to_si(found), self._to_si(crossings), self._si_range(), tuple(doubts))

    def _to_si(self, found: Sequence[Sequence[float]]) -> tuple[float, ...]:
        by = self.setup.unit if self.slides else 1.0
        every = (each * by if self.slides else each % (2.0 * pi) for part in found for each in part)
        return tuple(sorted(set(every)))

    def _si_range(self) -> tuple[float, float]:
        by = self.setup.unit
        return (self.span[0] * by, self.span[1] * by) if self.slides else (0.0, 2.0 * pi)

    def _is_bounded(self) -> bool:
        """Whether it is out of all links' reach what the input does beyond the range: where nothing else slides."""
        given = {each.pair for each in self.setup.mechanism.inputs}
        return not any(
            pair.input_kind is MeasureKind.LENGTH
            for name, pair in self.setup.relative_motions.items()
            if name not in given
        )

    def _zeros(self, level: int, low: float, high: float) -> Iterator[Zeros]:
        """The zeros of N of a block between two places where the blocks before it have dead points, for each choice."""
        kept: dict[float, dict[DyadChoices, SignedLog]] = {}

        def keep(places: Sequence[float]) -> None:
            missing = tuple(at for at in places if at not in kept)
            if missing:
                kept.update(zip(missing, self._discriminants(level, missing), strict=True))

        middle = 0.5 * (low + high)
        keep([middle])
        choices = set(kept[middle])
        for each in sorted(choices):

            def values(places: Sequence[float], each: DyadChoices = each) -> list[SignedLog]:
                keep(places)
                if any(set(kept[at]) != choices for at in places):
                    raise DeadPointsUnclaimed("the groups before it have others than were found")
                return [kept[at][each] for at in places]

            yield find_zeros(values, low, high)

    def _discriminants(self, level: int, places: tuple[float, ...]) -> list[dict[DyadChoices, SignedLog]]:
        """N of a block with the input at some places, for each choice before it."""
        over = time_is_over()
        if over:
            raise DeadPointsUnclaimed(over)
        found: list[dict[DyadChoices, SignedLog]] = [{} for _ in places]
        u = self._inputs_at(places)
        try:
            earlier = self._earlier_assemblies(level, places)
        except _PlacesDiffer:
            return [self._discriminants(level, (at,))[0] for at in places]
        for choices, z in earlier:
            for of_place, (sign, size) in zip(found, self._discriminant(level, z, u), strict=True):
                before = of_place.get(choices, SignedLog(1.0, 0.0))
                of_place[choices] = SignedLog(before.sign * sign, before.log + size)
        return found

    def _inputs_at(self, places: Sequence[float]) -> Array:
        u = np.repeat(self.setup.inputs.u[None], len(places), axis=0)
        u[:, self.index] = places
        return u

    def _earlier_assemblies(self, level: int, places: tuple[float, ...]) -> list[tuple[DyadChoices, Array]]:
        """Every assembly (places, unknowns) of the blocks on which one hangs."""
        found: list[tuple[DyadChoices, Array]] = [((), np.zeros((len(places), len(self.setup.equations.unknowns))))]
        u = self._inputs_at(places)
        earlier = tuple(sorted(self.dependencies[level]))
        for k, group in enumerate(earlier):
            key = places, earlier[: k + 1]
            if key not in self._reached:
                own = self.stages[group].unknowns
                following: list[tuple[DyadChoices, Array]] = []
                for choices, z in found:
                    for choice, values in self._assemblies(group, z, u):
                        there = z.copy()
                        there[:, own] = values
                        following.append(((*choices, choice), there))
                self._reached[key] = following
            found = self._reached[key]
        return found

    def _spend(self, by: int) -> None:
        self.budget -= by
        if self.budget < 0:
            raise DeadPointsUnclaimed("there are too many choices before it")

    def _assemblies(self, level: int, z: Array, u: Array) -> list[tuple[int, Array]]:
        """The assemblies of one block, those before it given (places, unknowns): which of two closed forms, and the
        unknowns (places, own unknowns)."""
        stage, setup = self.stages[level], self.setup
        self._spend(len(z))
        closed = setup.functions.block_assemblies(stage)
        if closed is not None:
            both, left, bend = closed.of_designs(z, u, setup.inputs.p)
            exists = bend < 1.0
            if not exists.any():
                return []
            if not exists.all():
                raise _PlacesDiffer
            if not (left <= CLOSED_TOLERANCE).all():
                raise DeadPointsUnclaimed("an earlier group does not close")
            return list(enumerate(both))
        if len(z) > 1:
            raise _PlacesDiffer
        self._spend(20)
        there = _with_inputs(setup, u[0])
        found = block_roots(there, stage, z[0], certify=False)
        if found.complete is Completeness.NOT or found.has_curve:
            raise DeadPointsUnclaimed("not all assemblies of the groups before it are known")
        return [(0, each[None]) for each in found.real]

    def _discriminant(self, level: int, z: Array, u: Array) -> list[SignedLog]:
        """N of one block at some places, those before it given (places, unknowns)."""
        stage, setup = self.stages[level], self.setup
        if slice_length(stage.rows) != slice_length(stage.unknowns):
            raise DeadPointsUnclaimed("it holds more than it needs")
        self._spend(len(z))
        closed = setup.functions.block_assemblies(stage)
        if closed is not None:
            bends = closed.evaluate_batch(z, u, setup.inputs.p)[1]
            if np.isnan(bends).any():
                raise DeadPointsUnclaimed("its links have no length")
            return [_dyad_discriminant(bend) for bend in bends.tolist()]
        if level not in self.solutions:
            self.solutions[level] = (
                None if is_linear(setup, stage, self.random_unknowns) else self._complex_solutions(stage)
            )
        of = self.solutions[level]
        if of is None:
            slopes = setup.functions.block_call(stage).evaluate_batch(len(z), z, u, setup.inputs.p)[1]
            return [SignedLog(*map(float, parts)) for parts in zip(*np.linalg.slogdet(slopes), strict=True)]
        self._spend(len(z) * of.form.bezout_number)
        return [of.discriminant(*place, setup.inputs.p) for place in zip(z, u, strict=True)]

    def _complex_solutions(self, stage: Block) -> MovingSolutions:
        found = isotropic_form(self.setup.equations, stage)
        if found is None:
            raise DeadPointsUnclaimed("its equations are no polynomials of this kind")
        if found.bezout_number > MAX_PATHS:
            raise DeadPointsUnclaimed(f"it may have up to {found.bezout_number} complex solutions")
        return MovingSolutions(self.setup.equations, found)


def _distinct(places: Iterable[float]) -> list[float]:
    """Places in their order; what rounding makes of one is one."""
    found: list[float] = []
    for at in sorted(places):
        if not found or at - found[-1] > SAME_POSITION_DISTANCE:
            found.append(at)
    return found


def _dyad_discriminant(bend: float) -> SignedLog:
    """How far a dyad is from where its assemblies meet; without the poles that `bend` has where a length vanishes."""
    number = (1.0 - bend) / hypot(1.0, bend) if isfinite(bend) else -1.0
    return SignedLog(float(np.sign(number)), log(abs(number))) if number else ZERO


def _with_inputs(setup: PreparedMechanism, u: Array) -> PreparedMechanism:
    """The same setup with other inputs' numbers."""
    there = object.__new__(type(setup))
    there.__dict__.update(setup.__dict__)
    there.inputs = setup.inputs._replace(u=u)
    return there


def _earlier_blocks(setup: PreparedMechanism) -> list[set[int]]:
    """The earlier blocks on which each block hangs, itself or through others."""
    stages = setup.equations.blocks
    of = {column: k for k, stage in enumerate(stages) for column in range(stage.unknowns.start, stage.unknowns.stop)}
    found: list[set[int]] = []
    for columns in block_dependencies(setup):
        direct = {of[column] for column in columns}
        found.append(direct.union(*(found[k] for k in direct)))
    return found
