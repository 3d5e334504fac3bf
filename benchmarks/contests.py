"""The contests: each a swept linkage, many designs or one, and everybody who can solve it, timed in turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks import by_planar, peers
from benchmarks.entry import Array, Entry
from benchmarks.limit import Limit, Rates, compiled
from benchmarks.swept import RATES, Stephenson, SweptFourBar, SweptQuickReturn, Watt, angles
from benchmarks.swept.base import Swept
from benchmarks.timing import best

LIMIT = "C by hand"
DESIGNS, STEPS, TURN = 10_000, 200, 360
MIXED, WIDE, NEW = 2_000, 50_000, 200
SAMPLE = 40
"""Errors are taken over so many designs, evenly chosen."""
ROUNDS = 5


@dataclass(frozen=True)
class Result:
    """Seconds a position, the same in times of the limit, the greatest error, designs refused and refused wrongly.

    The error is that of any order, as a part of the greatest value of that order. `refused` of `designs` have a
    position that is not given; `wrong` were refused from another step on than the closed form says, or not at all.
    """

    contest: str
    system: str
    rates: bool
    seconds: float
    ratio: float
    error: float
    designs: int
    refused: int
    wrong: int


@dataclass(frozen=True)
class Contest:
    """`d` (dimensions, designs), or None for the file's own design alone, over `steps` of one turn.

    `limit` is the function of limit.c, where it is not the linkage's own.
    """

    name: str
    swept: Swept
    d: Array | None
    steps: int
    limit: str = ""

    def entries(self) -> list[Entry]:
        """Everybody who can solve it, the limit first."""
        theta = angles(self.steps)
        if self.d is None:
            return [*self._alone(theta), *by_planar.turns(self.swept, self.steps), *peers.turns(self.swept, theta)]
        return [
            *self._limits(theta),
            *by_planar.sweeps(self.swept, self.d, self.steps),
            *peers.sweeps(self.swept, self.d, theta),
        ]

    def measure(self) -> tuple[Result, ...]:
        """Time everybody, and see what they found."""
        entries = self.entries()
        times = best({index: entry.solve for index, entry in enumerate(entries)}, ROUNDS)
        seconds = [times[index] / entry.positions for index, entry in enumerate(entries)]
        first = {entry.rates: each for entry, each in reversed(list(zip(entries, seconds, strict=True)))}
        return tuple(
            self._result(entry, each, first[entry.rates]) for entry, each in zip(entries, seconds, strict=True)
        )

    def _result(self, entry: Entry, seconds: float, first: float) -> Result:
        found = entry.read(entry.solve())
        gone = np.isnan(found).any(axis=0)
        must = self._cannot()[np.ix_(entry.steps, entry.designs)]
        return Result(
            self.name,
            entry.system,
            entry.rates,
            seconds,
            seconds / first,
            _error(self, entry, found, ~must.any(axis=0)),
            len(entry.designs),
            int(gone.any(axis=0).sum()),
            int((_first(gone) != _first(must)).sum()),
        )

    def _d(self) -> Array:
        return self.swept.base()[:, None] if self.d is None else self.d

    def _cannot(self) -> Array:
        """Whether a design cannot be closed at a step (steps + 1, designs)."""
        return self.swept.stops(self._d(), angles(self.steps))

    def _limits(self, theta: Array) -> list[Entry]:
        limit = compiled()
        if limit is None:
            return []
        known = np.arange(self.d.shape[1]), np.arange(len(theta))
        start, name = self.swept.start(self.d), self.limit or self.swept.limit

        def read(found: Array) -> Array:
            if start is None:
                return np.moveaxis(found, 1, 0)
            return found.transpose(2, 1, 0, 3).reshape(*found.shape[2:0:-1], -1)

        return [
            Entry(LIMIT, rates is not None, *known, limit.sweep(name, self.d, theta, rates, start), read)
            for rates in (None, RATES)
        ]

    def _alone(self, theta: Array) -> list[Entry]:
        limit = compiled()
        if limit is None:
            return []
        swept, base, known = self.swept, self.swept.base(), (np.arange(1), np.arange(len(theta)))
        start = swept.start(base[:, None])
        one = np.ascontiguousarray(base[:, None])
        return [
            Entry(LIMIT, rates is not None, *known, limit.turn(f"{swept.limit}_turn", base, theta, rates), _of_turn)
            if start is None
            else Entry(
                LIMIT, rates is not None, *known, limit.sweep(swept.limit, one, theta, rates, start, True), _of_march
            )
            for rates in (None, RATES)
        ]


class Renewed(Contest):
    """Designs `d` one after the other, each a call of its own with numbers that were not asked for before."""

    def entries(self) -> list[Entry]:
        """See `Contest`."""
        theta = angles(self.steps)
        found = [*by_planar.sweep_new_designs(self.swept, self.d, self.steps), *peers.sweeps(self.swept, self.d, theta)]
        limit = compiled()
        if limit is None:
            return found
        known = np.arange(self.d.shape[1]), np.arange(len(theta))
        return [
            Entry(LIMIT, rates is not None, *known, *self._one_by_one(limit, theta, rates)) for rates in (None, RATES)
        ] + found

    def _one_by_one(self, limit: Limit, theta: Array, rates: Rates) -> tuple[Callable[[], Any], Callable[[Any], Array]]:
        """C's calls for one design each, and how to read them."""
        swept, columns = self.swept, [np.ascontiguousarray(each) for each in self.d.T]
        if swept.start(self.d) is None:
            calls = [limit.turn(f"{swept.limit}_turn", each, theta, rates) for each in columns]
            return lambda: [call() for call in calls], lambda found: np.stack(found, axis=2)
        calls = [
            limit.sweep(swept.limit, each[:, None], theta, rates, swept.start(each[:, None]), True) for each in columns
        ]
        return lambda: [call() for call in calls], lambda found: np.concatenate(
            [_of_march(each) for each in found], axis=2
        )


def _of_turn(found: Array) -> Array:
    return found[:, :, None].copy()


def _of_march(found: Array) -> Array:
    return np.moveaxis(found[0], 0, 1).copy()


def _first(gone: Array) -> Array:
    """The first step (designs,) that is gone, of all steps' number where none is."""
    return np.where(gone.any(axis=0), gone.argmax(axis=0), len(gone))


def _error(contest: Contest, entry: Entry, found: Array, whole: Array) -> float:
    """The greatest error of those designs that turn all round, in longer arithmetic."""
    turning = np.flatnonzero(whole)
    chosen = turning[np.unique(np.linspace(0, len(turning) - 1, SAMPLE).astype(int))]
    wide = np.ascontiguousarray(contest._d()[:, entry.designs[chosen]]).astype(np.longdouble)
    both = contest.swept.assemblies(wide, angles(contest.steps).astype(np.longdouble))
    every = [exact[: len(found), entry.steps] for exact in both]
    apart = np.stack([np.abs(found[:, :, chosen] - exact) for exact in every])
    # of each design the assembly that it was solved in
    own = np.nanmax(apart[:, :2], axis=(1, 2)).argmin(axis=0)
    off = np.take_along_axis(apart, own[None, None, None], axis=0)[0]
    greatest = np.abs(every[0]).max(axis=(1, 2))
    # a component's error beside the greater of the two
    scale = np.repeat(greatest.reshape(-1, 2).max(axis=1), 2)
    return float(np.nanmax(off / scale[:, None, None]))


def contests() -> tuple[Contest, ...]:
    """All of them, in the order in which they are shown."""
    four_bar, quick_return, watt, stephenson = SweptFourBar(), SweptQuickReturn(), Watt(), Stephenson()
    many = f"{DESIGNS:,} designs x {STEPS} steps"
    return (
        *(
            Contest(f"{swept.name}, {many}", swept, swept.designs(DESIGNS), STEPS)
            for swept in (four_bar, quick_return, watt, stephenson)
        ),
        Contest(f"four-bar, {MIXED:,} designs of which some cannot turn", four_bar, four_bar.mixed(MIXED), STEPS),
        Contest(
            f"four-bar, {WIDE:,} designs from a wide box, half of which cannot turn",
            four_bar,
            four_bar.wide(WIDE),
            STEPS,
            four_bar.wide_limit,
        ),
        Renewed(f"a new four-bar in each call, {TURN} steps", four_bar, four_bar.designs(NEW), TURN),
        Renewed(f"a new six-bar without a dyad in each call, {TURN} steps", stephenson, stephenson.designs(NEW), TURN),
        Contest(f"one four-bar, {TURN} steps", four_bar, None, TURN),
        Contest(f"one six-bar without a dyad, {TURN} steps", stephenson, None, TURN),
    )
