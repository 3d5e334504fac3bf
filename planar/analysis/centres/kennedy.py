"""Instantaneous centres from positions alone: those that pairs show, then by Kennedy's theorem one after the other.

A centre is a point of the projective plane, (x, y, w) of length one with lengths in the mechanism's size about its
middle, so that one at infinity (two links that slide, parallel links) is as good as any other. Any three links have
their three centres in one line (A. B. W. Kennedy, The Mechanics of Machinery, 1886): a centre is where two such lines
meet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import combinations
from typing import NamedTuple

import numpy as np

Array = np.ndarray
ROUNDING = 1e-15
"""How exact a centre is that a pair shows."""
WORST = 1e-7
"""A meeting whose error would be larger than this is none: its lines are nearly one."""
FINITE = 1e-9
"""A centre on which wheels' ratios are laid off has at least this w beside x and y."""

Two = frozenset[str]
"""Two links."""


class Through(NamedTuple):
    """A line of centres: through two centres of a third link, or the normal that a pair gives (`pair`)."""

    link: str = ""
    pair: str = ""


class Found(NamedTuple):
    """A centre and how it was found: by a pair, where two lines meet, or in the ratio of wheels on a line."""

    at: Array
    "(3,), of length one"
    error: float
    "an estimate of how exact it is"
    pair: str = ""
    lines: tuple[Through, ...] = ()
    ratio: str = ""
    "the pair whose ratio places it on the line through `lines[0]`"


@dataclass(frozen=True)
class Primary:
    """What the pairs show: centres, normals on which centres lie, and ratios of turning between three links."""

    centres: Mapping[Two, Found]
    normals: Mapping[Two, tuple[tuple[str, Array], ...]]
    ratios: tuple[tuple[str, Mapping[str, float]], ...]


def unit(vector: Array) -> Array:
    """A homogeneous point or line of length one; the last entry that is not nothing is positive."""
    vector = vector / np.linalg.norm(vector)
    lead = vector[np.flatnonzero(np.abs(vector) > 1e-14)[-1]]
    return vector if lead > 0.0 else -vector


class Construction:
    """The centres found so far, in the order in which they were found, and the best place of every other by now.

    Of places that are about as good, that of the links which come first is taken first. A new centre gives each open
    one of its links a single new line, which is met with the lines that this one had before.
    """

    def __init__(self, links: Sequence[str], primary: Primary, worst: float = WORST):
        self.links = tuple(links)
        self.found: dict[Two, Found] = {}
        self._primary = primary
        self._worst = worst
        self._place = {link: index for index, link in enumerate(self.links)}
        self._pairs = [frozenset(two) for two in combinations(self.links, 2)]
        count, many = len(self._pairs), len(self.links)
        self._first = max((len(normals) for normals in primary.normals.values()), default=0)
        "lines through links come after those that pairs give"
        self._number = np.zeros((many, many), dtype=int)
        above = np.triu_indices(many, 1)
        self._number[above] = self._number.T[above] = np.arange(count)
        self._at = np.zeros((many, many, 3))
        self._error = np.full((many, many), np.inf)
        self._lines = np.zeros((count, self._first + many, 3))
        self._wrong = np.full((count, self._first + many), np.inf)
        self._open = np.ones(count, dtype=bool)
        self._best = np.full(count, np.inf)
        self._meets = np.zeros((count, 3))
        self._by = np.zeros((count, 2), dtype=int)
        self._ratio: dict[int, Found] = {}
        self._heap: list[tuple[int, int, float]] = []
        self._start()

    def add(self, two: Two, one: Found) -> None:
        """Take a centre as found: every other that is open gets the lines that it gives."""
        a, b = sorted(self._place[link] for link in two)
        self.found[two] = one
        self._open[self._number[a, b]] = False
        self._at[a, b] = self._at[b, a] = one.at
        self._error[a, b] = self._error[b, a] = one.error
        for end, via in ((a, b), (b, a)):
            others = np.flatnonzero(np.isfinite(self._error[via]) & self._open[self._number[end]])
            others = others[(others != end) & (others != via)]
            if len(others):
                numbers = self._number[end, others]
                lines = _cross(one.at, self._at[via, others])
                self._draw(numbers, self._first + via, lines, one.error + self._error[via, others])
        self._lay_off(two)

    def run(self) -> None:
        """Everything that follows from what was added: best conditioned first."""
        while self._heap:
            _, number, error = heappop(self._heap)
            if not self._open[number] or error > self._error_of(number):
                continue  # found since, or bettered
            self.add(self._pairs[number], self._candidate(number))

    def lines(self, two: Two) -> int:
        """How many lines are known on which an open centre lies."""
        a, b = (self._place[link] for link in two)
        return int(np.isfinite(self._wrong[self._number[a, b]]).sum())

    def _start(self) -> None:
        for two, normals in self._primary.normals.items():
            a, b = (self._place[link] for link in two)
            number = np.array([self._number[a, b]])
            for slot, (_, normal) in enumerate(normals):
                self._draw(number, slot, normal[None], np.array([ROUNDING]))
        for two, one in self._primary.centres.items():
            self.add(two, one)

    def _draw(self, numbers: Array, slot: int, lines: Array, errors: Array) -> None:
        """A new line for each of several centres, (m, 3) with the errors of the points it goes through, (m,)."""
        lengths = _length(lines)
        good = lengths > errors / self._worst
        if not good.all():
            numbers, lines, errors, lengths = numbers[good], lines[good], errors[good], lengths[good]
        if not len(numbers):
            return
        lines, errors = lines / lengths[:, None], errors / lengths
        meets = _cross(lines[:, None], self._lines[numbers])
        sines = _length(meets)
        sums = errors[:, None] + self._wrong[numbers]
        wrong = np.where(sines > 0.0, sums / np.where(sines > 0.0, sines, 1.0), np.inf)
        others = wrong.argmin(axis=1)
        rows = np.arange(len(numbers))
        least = wrong[rows, others]
        self._lines[numbers, slot], self._wrong[numbers, slot] = lines, errors
        for row in np.flatnonzero((least <= self._worst) & (least <= self._best[numbers])):
            by = sorted((int(others[row]), slot))
            number = int(numbers[row])
            # of meetings alike that of the lines which come first, however they were found
            if (least[row], *by) < (self._best[number], *self._by[number]):
                self._best[number], self._by[number] = least[row], by
                self._meets[number] = meets[row, others[row]]
                self._push(number)

    def _lay_off(self, two: Two) -> None:
        """Wheels a and b seen from c: s_a w_ac + s_b w_bc = 0 puts I_ab at s_a I_bc + s_b I_ac (both with w = 1)."""
        for pair, slopes in self._primary.ratios:
            if not two <= slopes.keys():
                continue
            for c in two:
                a, b = sorted(slopes.keys() - {c})
                number = int(self._number[self._place[a], self._place[b]])
                p, q = self.found.get(frozenset((a, c))), self.found.get(frozenset((b, c)))
                if not self._open[number] or not p or not q or min(abs(p.at[2]), abs(q.at[2])) <= FINITE:
                    continue
                at = slopes[a] * q.at / q.at[2] + slopes[b] * p.at / p.at[2]
                length = float(np.linalg.norm(at))
                error = (p.error / abs(p.at[2]) + q.error / abs(q.at[2])) * max(map(abs, slopes.values()))
                known = self._ratio[number].error if number in self._ratio else np.inf
                if length > error / self._worst and error / length < known:
                    self._ratio[number] = Found(unit(at), error / length, lines=(Through(c),), ratio=pair)
                    self._push(number)

    def _push(self, number: int) -> None:
        error = self._error_of(number)
        heappush(self._heap, (_order(error), number, error))

    def _error_of(self, number: int) -> float:
        ratio = self._ratio.get(number)
        return min(float(self._best[number]), ratio.error if ratio else np.inf)

    def _candidate(self, number: int) -> Found:
        """The best place of a centre by now."""
        ratio = self._ratio.get(number)
        if ratio and ratio.error < self._best[number]:
            return ratio
        normals = self._primary.normals.get(self._pairs[number], ())
        lines = tuple(
            Through(pair=normals[slot][0]) if slot < self._first else Through(self.links[slot - self._first])
            for slot in self._by[number]
        )
        return Found(unit(self._meets[number]), float(self._best[number]), lines=lines)


def _order(error: float) -> int:
    """Errors of one decade count alike, so that the order is that of the links where it may be."""
    return int(np.floor(np.log10(error)))


def _cross(a: Array, b: Array) -> Array:
    """Vector products (..., 3), without what numpy's own does beside."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def _length(vectors: Array) -> Array:
    """Lengths (...,) of vectors (..., 3)."""
    return np.sqrt((vectors * vectors).sum(axis=-1))
