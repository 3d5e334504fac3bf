"""When designs have the angles, or the positions of a pair, that are wanted: these tell the samples as a clock does."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.matching.match_problem import MatchProblem
from planar.synthesis.matching.wanted_entries import Entries, FunctionEntries, PoseEntries

STARTS = 24
"""Samples of a motion at which the first entry is tried."""


def clocked_samples(problem: MatchProblem, entries: Entries, design: IntArray, may_turn: bool) -> Iterator[Array]:
    """Samples (n, entries) of designs (n,) at which a link has the angles of wanted poses, or a pair the positions that
    are given, not numbers where there is none; from several samples, either way.

    Angles count by their differences where a mechanism may be turned, positions where they are not absolute.
    """
    motions, count = problem.catalogue.motions, problem.catalogue.sample_count
    if isinstance(entries, PoseEntries):
        clock, wanted, wraps = motions.angles[problem.link(entries), design], entries.angles, True
        by_differences = may_turn and problem.can_move
    else:
        assert isinstance(entries, FunctionEntries)
        clock, wanted = motions.values[entries.from_pair][design], entries.given
        wraps, by_differences = problem.is_angle(entries.from_pair), not entries.is_absolute
    closed = motions.is_closed[design]
    for start in range(0, count, max(1, count // STARTS)):
        off = clock - (clock[:, start : start + 1] - wanted[0] if by_differences else 0.0)
        for sense in (1, -1):
            found = np.empty((len(design), len(wanted)))
            for k, each in enumerate(wanted):
                found[:, k] = _first_crossing(off - each, start, sense, closed, wraps)
            if by_differences:
                found[:, 0] = np.where(np.isfinite(clock[:, start]), float(start), np.nan)
            yield found


def _first_crossing(off: Array, start: int, sense: int, closed: BoolArray, wraps: bool) -> Array:
    """The first sample (n,) from `start` on, either way, at which something (n, samples) is nothing."""
    count = off.shape[1]
    order = (start + sense * np.arange(count + 1)) % count
    way = off[:, order].astype(float)
    if wraps:
        way -= 2.0 * pi * np.round(way / (2.0 * pi))
    one, other = way[:, :-1], way[:, 1:]
    crosses = (one * other <= 0.0) & (np.abs(one - other) < pi if wraps else True)
    crosses &= closed[:, None] | (np.diff(order) == sense)
    first = np.argmax(crosses, axis=1)
    rows = np.arange(len(off))
    before, behind = one[rows, first], other[rows, first]
    part = before / np.where(before == behind, 1.0, before - behind)
    return np.where(crosses[rows, first], start + sense * (first + part), np.nan)
