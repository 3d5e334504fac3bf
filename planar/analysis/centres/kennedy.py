"""Instantaneous centres from positions alone: those that pairs show, then by Kennedy's theorem one after the other.

A centre is a point of the projective plane, (x, y, w) of length one with lengths in the mechanism's size about its
middle, so that one at infinity (two links that slide, parallel links) is as good as any other. Any three links have
their three centres in one line (A. B. W. Kennedy, The Mechanics of Machinery, 1886): a centre is where two such lines
meet.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.time_limit import stop_if_over

ROUNDING = 1e-15
"""How exact a centre is that a pair shows."""
MAX_MEETING_ERROR = 1e-7
"""A meeting whose error would be larger than this is none: its lines are nearly one."""
LEAST_FINITE_RATIO = 1e-9
"""A centre on which wheels' ratios are laid off has at least this w beside x and y."""

LinkPair = frozenset[str]
"""Two links."""


class KennedyLine(NamedTuple):
    """A line of centres: through two centres of a third link, or the normal that a pair gives (`pair`)."""

    link: str = ""
    pair: str = ""


class FoundCentre(NamedTuple):
    """A centre and how it was found: by a pair, where two lines meet, or in the ratio of wheels on a line."""

    at: Array
    "(3,), of length one"
    error: float
    "an estimate of how exact it is"
    pair: str = ""
    lines: tuple[KennedyLine, ...] = ()
    ratio: str = ""
    "the pair whose ratio places it on the line through `lines[0]`"


@dataclass(frozen=True)
class PrimaryCentres:
    """What the pairs show: centres, normals on which centres lie, and ratios of turning between three links."""

    centres: Mapping[LinkPair, FoundCentre]
    normals: Mapping[LinkPair, tuple[tuple[str, Array], ...]]
    ratios: tuple[tuple[str, Mapping[str, float]], ...]


def normalise(vector: Array) -> Array:
    """A homogeneous point or line of length one; the last entry that is not nothing is positive."""
    vector = vector / np.linalg.norm(vector)
    lead = vector[np.flatnonzero(np.abs(vector) > 1e-14)[-1]]
    return vector if lead > 0.0 else -vector


class KennedyConstruction:
    """The centres found so far, in the order in which they were found, and the best place of every other by now.

    Of places that are about as good, that of the links which come first is taken first. A new centre gives each open
    one of its links a single new line, which is met with the lines that this one had before.
    """

    def __init__(
        self,
        links: Sequence[str],
        primary: PrimaryCentres,
        max_error: float = MAX_MEETING_ERROR,
        targets: Iterable[LinkPair] | None = None,
    ):
        """`targets`: pairs of links whose centres are searched for, beside those that pairs show; by default all."""
        self.links = tuple(links)
        self.found: dict[LinkPair, FoundCentre] = {}
        self._primary = primary
        self._max_error = max_error
        self._place = {link: index for index, link in enumerate(self.links)}
        self._pairs = [frozenset(two) for two in combinations(self.links, 2)]
        if targets is not None:
            included = {*targets, *primary.centres, *primary.normals}
            self._pairs = [two for two in self._pairs if two in included]
        count, many = len(self._pairs), len(self.links)
        self._first = max((len(normals) for normals in primary.normals.values()), default=0)
        "lines through links come after those that pairs give"
        self._number = np.full((many, many), count)
        "of a pair that is not searched for the last, which is never open"
        for number, two in enumerate(self._pairs):
            a, b = (self._place[link] for link in two)
            self._number[a, b] = self._number[b, a] = number
        self._at = np.zeros((many, many, 3))
        self._error = np.full((many, many), np.inf)
        self._lines = np.zeros((count, self._first + many, 3))
        self._line_error = np.full((count, self._first + many), np.inf)
        self._open = np.arange(count + 1) < count
        self._best = np.full(count, np.inf)
        self._meeting_points = np.zeros((count, 3))
        self._meeting_lines = np.zeros((count, 2), dtype=int)
        self._ratio: dict[int, FoundCentre] = {}
        self._heap: list[tuple[int, int, float]] = []
        self._add_primary()

    def add_centre(self, two: LinkPair, one: FoundCentre) -> None:
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
                lines = cross_products(one.at, self._at[via, others])
                self._add_lines(numbers, self._first + via, lines, one.error + self._error[via, others])
        self._apply_ratios(two)

    def find_all(self) -> None:
        """Everything that follows from what was added: best conditioned first."""
        while self._heap:
            _, number, error = heappop(self._heap)
            if not self._open[number] or error > self._least_error(number):
                continue  # found since, or bettered
            stop_if_over(f"after {len(self.found)} centres")
            self.add_centre(self._pairs[number], self._best_centre(number))

    def count_lines(self, two: LinkPair) -> int:
        """How many lines are known on which an open centre lies."""
        a, b = (self._place[link] for link in two)
        return int(np.isfinite(self._line_error[self._number[a, b]]).sum())

    def _add_primary(self) -> None:
        for two, normals in self._primary.normals.items():
            a, b = (self._place[link] for link in two)
            number = np.array([self._number[a, b]])
            for slot, (_, normal) in enumerate(normals):
                self._add_lines(number, slot, normal[None], np.array([ROUNDING]))
        for two, one in self._primary.centres.items():
            self.add_centre(two, one)

    def _add_lines(self, numbers: Array, slot: int, lines: Array, errors: Array) -> None:
        """A new line for each of several centres, (m, 3) with the errors of the points it goes through, (m,)."""
        lengths = _lengths(lines)
        good = lengths > errors / self._max_error
        if not good.all():
            numbers, lines, errors, lengths = numbers[good], lines[good], errors[good], lengths[good]
        if not len(numbers):
            return
        lines, errors = lines / lengths[:, None], errors / lengths
        meets = cross_products(lines[:, None], self._lines[numbers])
        sines = _lengths(meets)
        sums = errors[:, None] + self._line_error[numbers]
        wrong = np.where(sines > 0.0, sums / np.where(sines > 0.0, sines, 1.0), np.inf)
        others = wrong.argmin(axis=1)
        rows = np.arange(len(numbers))
        least = wrong[rows, others]
        self._lines[numbers, slot], self._line_error[numbers, slot] = lines, errors
        for row in np.flatnonzero((least <= self._max_error) & (least <= self._best[numbers])):
            by = sorted((int(others[row]), slot))
            number = int(numbers[row])
            # of meetings alike that of the lines which come first, however they were found
            if (least[row], *by) < (self._best[number], *self._meeting_lines[number]):
                self._best[number], self._meeting_lines[number] = least[row], by
                self._meeting_points[number] = meets[row, others[row]]
                self._push(number)

    def _apply_ratios(self, two: LinkPair) -> None:
        """Wheels a and b seen from c: s_a w_ac + s_b w_bc = 0 puts I_ab at s_a I_bc + s_b I_ac (both with w = 1)."""
        for pair, slopes in self._primary.ratios:
            if not two <= slopes.keys():
                continue
            for c in two:
                a, b = sorted(slopes.keys() - {c})
                number = int(self._number[self._place[a], self._place[b]])
                p, q = self.found.get(frozenset((a, c))), self.found.get(frozenset((b, c)))
                if not self._open[number] or not p or not q or min(abs(p.at[2]), abs(q.at[2])) <= LEAST_FINITE_RATIO:
                    continue
                at = slopes[a] * q.at / q.at[2] + slopes[b] * p.at / p.at[2]
                length = float(np.linalg.norm(at))
                error = (p.error / abs(p.at[2]) + q.error / abs(q.at[2])) * max(map(abs, slopes.values()))
                known = self._ratio[number].error if number in self._ratio else np.inf
                if length > error / self._max_error and error / length < known:
                    self._ratio[number] = FoundCentre(
                        normalise(at), error / length, lines=(KennedyLine(c),), ratio=pair
                    )
                    self._push(number)

    def _push(self, number: int) -> None:
        error = self._least_error(number)
        heappush(self._heap, (_error_decade(error), number, error))

    def _least_error(self, number: int) -> float:
        ratio = self._ratio.get(number)
        return min(float(self._best[number]), ratio.error if ratio else np.inf)

    def _best_centre(self, number: int) -> FoundCentre:
        """The best place of a centre by now."""
        ratio = self._ratio.get(number)
        if ratio and ratio.error < self._best[number]:
            return ratio
        normals = self._primary.normals.get(self._pairs[number], ())
        lines = tuple(
            KennedyLine(pair=normals[slot][0]) if slot < self._first else KennedyLine(self.links[slot - self._first])
            for slot in self._meeting_lines[number]
        )
        return FoundCentre(normalise(self._meeting_points[number]), float(self._best[number]), lines=lines)


def _error_decade(error: float) -> int:
    """Errors of one decade count alike, so that the order is that of the links where it may be."""
    return int(np.floor(np.log10(error)))


def cross_products(a: Array, b: Array) -> Array:
    """Vector products (..., 3), without what numpy's own does beside."""
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)


def _lengths(vectors: Array) -> Array:
    """Lengths (...,) of vectors (..., 3)."""
    found: Array = np.sqrt((vectors * vectors).sum(axis=-1))
    return found
