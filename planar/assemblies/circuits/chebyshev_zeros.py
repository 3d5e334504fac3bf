"""The zeros of a function on an interval, all of them: from series that are the function to rounding.

A function that is analytic inside the interval, at its ends but for square roots, is one without those of an angle phi,
x = middle + half sin(phi); on parts of the interval it is the sum of so many Chebyshev polynomials of phi (L. N.
Trefethen, Approximation Theory and Approximation Practice, 2013; J. Boyd, SIAM Rev. 55, 2013).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import isfinite, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from planar.foundation.arrays import Array
from planar.foundation.root_finding import find_root

NODE_COUNT, TAIL_TERMS = 32, 8
"""Places on a part, and how many of the last terms must have fallen away there."""
TAIL_TOLERANCE = 1e-9
"""Of the greatest value on a part: what is left of the last terms."""
ZERO_EXTREMUM = 1e-8
"""Of the greatest value on a part: an extremum so near to zero may be one."""
MAX_JUMP = 1e-6
"""Of the greatest value on two parts side by side: by how much it may differ where they meet."""
MIN_PART_WIDTH = 1e-3
"""rad: parts are not parted further for the sake of an extremum."""
SPLIT_RATIO = 0.4837
"""Where a part is parted: symmetric functions have their zeros in the middle."""
MAX_PARTS = 200
"""Parts of one interval, beyond which the function is given up."""
INTERIOR_RATIO = 1.0 - 1e-6
"""Of a part: at the very ends of the interval the function need not be there."""
OFF_AXIS_DISTANCE = 0.1
"""Complex zeros of the derivative that are nearer to a part than this are looked at, too."""


class SignedLog(NamedTuple):
    """A number as sign times exp(log): products of many factors have no other."""

    sign: float
    log: float


ZERO = SignedLog(0.0, -np.inf)
"""Zero."""


class Zeros(NamedTuple):
    """Where a function changes its sign; where it touches zero, to rounding; and whether these are surely all."""

    crossed: tuple[float, ...]
    touched: tuple[float, ...]
    is_complete: bool


def find_zeros(function: Callable[[Sequence[float]], Sequence[SignedLog]], low: float, high: float) -> Zeros:
    """Every zero between two places of a function, which may have square roots there; it is computed at many places at
    once."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)

    def place(phi: float) -> float:
        return middle + half * sin(phi)

    crossed: list[float] = []
    touched: list[float] = []
    waiting = [(-0.5 * pi, 0.5 * pi)]
    before: tuple[float, float] | None = None
    for _ in range(MAX_PARTS):
        if not waiting:
            break
        first, last = waiting.pop()
        values = function([place(phi) for phi in _nodes_between(first, last)])
        greatest = float(np.max([each.log for each in values]))
        if not isfinite(greatest):
            return Zeros(tuple(crossed), tuple(touched), False)
        series = _chebyshev_transform() @ np.array([each.sign * np.exp(each.log - greatest) for each in values])
        places = _extrema(series)
        at = chebyshev.chebval(places, series) / np.abs(series).max()
        fallen = np.abs(series[-TAIL_TERMS:]).max() <= TAIL_TOLERANCE * np.abs(series).max()
        # what all but touches zero may be far from it in view of what it is on a narrower part
        if not fallen or (np.abs(at).min() < ZERO_EXTREMUM and last - first > MIN_PART_WIDTH):
            between = first + SPLIT_RATIO * (last - first)
            waiting += [(between, last), (first, between)]
            continue
        # parts come in their order: what jumps from one to the next is no analytic function
        if before is not None:
            top = max(before[1], greatest)
            ends = before[0] * np.exp(before[1] - top), chebyshev.chebval(-1.0, series) * np.exp(greatest - top)
            if abs(ends[1] - ends[0]) > MAX_JUMP:
                return Zeros(tuple(crossed), tuple(touched), False)
        before = float(chebyshev.chebval(1.0, series)), greatest

        def scaled(phi: float, greatest: float = greatest) -> float:
            (value,) = function([place(phi)])
            return value.sign * float(np.exp(min(value.log - greatest, 300.0)))

        phis = 0.5 * (first + last) + 0.5 * (last - first) * places
        touched += [place(float(phi)) for phi in phis[np.abs(at) < ZERO_EXTREMUM]]
        for k in np.flatnonzero(at[1:] * at[:-1] < 0.0):
            if min(abs(at[k]), abs(at[k + 1])) >= ZERO_EXTREMUM:
                crossed.append(place(find_root(scaled, float(phis[k]), float(phis[k + 1]))))
    return Zeros(tuple(sorted(crossed)), tuple(sorted(touched)), not waiting)


def _extrema(series: Array) -> Array:
    """The ends of a part, and the places between which the series rises or falls all the way."""
    slope = chebyshev.chebtrim(chebyshev.chebder(series), 1e-14 * np.abs(series).max())
    found = chebyshev.chebroots(slope) if len(slope) > 1 else np.zeros(0)
    found = found.astype(complex)
    near = found[(np.abs(found.imag) < OFF_AXIS_DISTANCE) & (np.abs(found.real) < INTERIOR_RATIO)]
    return np.concatenate([[-INTERIOR_RATIO], np.unique(near.real), [INTERIOR_RATIO]])


def _nodes_between(first: float, last: float) -> Array:
    return 0.5 * (first + last) + 0.5 * (last - first) * _chebyshev_nodes()


@lru_cache(maxsize=1)
def _chebyshev_nodes() -> Array:
    return np.cos(pi * (np.arange(NODE_COUNT) + 0.5) / NODE_COUNT)


@lru_cache(maxsize=1)
def _chebyshev_transform() -> Array:
    """From values at the nodes to coefficients (terms, nodes)."""
    values = np.cos(np.arange(NODE_COUNT)[:, None] * np.arccos(_chebyshev_nodes()))
    values[0] *= 0.5
    return 2.0 / NODE_COUNT * values
