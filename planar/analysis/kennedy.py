"""Instantaneous centres from positions alone: those that pairs show, then by Kennedy's theorem one after the other.

A centre is a point of the projective plane, (x, y, w) of length one with lengths in the mechanism's size about its
middle, so that one at infinity (two links that slide, parallel links) is as good as any other. Any three links have
their three centres in one line (A. B. W. Kennedy, The Mechanics of Machinery, 1886): a centre is where two such lines
meet.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

Array = np.ndarray
ROUNDING = 1e-15
"""How exact a centre is that a pair shows."""
WORST = 1e-7
"""A meeting whose error would be larger than this is none: its lines are nearly one."""

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


def constructed(links: Sequence[str], primary: Primary, known: Mapping[Two, Found]) -> dict[Two, Found]:
    """All centres that follow from known ones, in the order in which they are found: best conditioned first.

    Of meetings that are about as good, that of the links which come first. A new centre can only better those of its
    two links, so no others are looked at again.
    """
    found = dict(known)
    place = {link: index for index, link in enumerate(links)}
    best = {
        two: _best(two, links, primary, found) for two in map(frozenset, combinations(links, 2)) if two not in found
    }
    while True:
        ready = [
            (_order(candidate.error), sorted(place[link] for link in two), two)
            for two, candidate in best.items()
            if candidate
        ]
        if not ready:
            return found
        two = min(ready)[2]
        found[two] = best.pop(two)
        for other in best:
            if other & two:
                best[other] = _best(other, links, primary, found)


def _order(error: float) -> int:
    """Errors of one decade count alike, so that the order is that of the links where it may be."""
    return int(np.floor(np.log10(error)))


def _best(two: Two, links: Sequence[str], primary: Primary, found: Mapping[Two, Found]) -> Found | None:
    """The best conditioned place of a centre that two lines, or a ratio, give by now."""
    candidates = [*_meetings(two, links, primary, found), *_ratios(two, primary, found)]
    good = [each for each in candidates if each.error <= WORST]
    return min(good, key=lambda each: each.error, default=None)


def _meetings(two: Two, links: Sequence[str], primary: Primary, found: Mapping[Two, Found]) -> Iterator[Found]:
    names, lines, errors = [], [], []
    for pair, normal in primary.normals.get(two, ()):
        names.append(Through(pair=pair))
        lines.append(normal)
        errors.append(ROUNDING)
    a, b = sorted(two)
    for link in links:
        p, q = found.get(frozenset((a, link))), found.get(frozenset((link, b)))
        if link not in two and p and q:
            line = np.cross(p.at, q.at)
            length = float(np.linalg.norm(line))
            if length > (p.error + q.error) / WORST:
                names.append(Through(link))
                lines.append(line / length)
                errors.append((p.error + q.error) / length)
    if len(lines) < 2:
        return
    both = np.array(lines)
    first, second = np.triu_indices(len(lines), 1)
    meets = np.cross(both[first], both[second])
    sines = np.linalg.norm(meets, axis=1)
    sums = np.array(errors)[first] + np.array(errors)[second]
    wrong = np.where(sines > 0.0, sums / np.where(sines > 0.0, sines, 1.0), np.inf)
    k = int(np.argmin(wrong))
    if np.isfinite(wrong[k]):
        yield Found(unit(meets[k]), float(wrong[k]), lines=(names[first[k]], names[second[k]]))


def _ratios(two: Two, primary: Primary, found: Mapping[Two, Found]) -> Iterator[Found]:
    """Wheels a and b seen from c: s_a w_ac + s_b w_bc = 0 puts I_ab at s_a I_bc + s_b I_ac (both with w = 1)."""
    for pair, slopes in primary.ratios:
        if not two <= slopes.keys():
            continue
        a, b = sorted(two)
        (c,) = slopes.keys() - two
        p, q = found.get(frozenset((a, c))), found.get(frozenset((b, c)))
        if p and q and min(abs(p.at[2]), abs(q.at[2])) > 1e-9:
            at = slopes[a] * q.at / q.at[2] + slopes[b] * p.at / p.at[2]
            length = float(np.linalg.norm(at))
            error = (p.error / abs(p.at[2]) + q.error / abs(q.at[2])) * max(map(abs, slopes.values()))
            if length > error / WORST:
                yield Found(unit(at), error / length, lines=(Through(c),), ratio=pair)
