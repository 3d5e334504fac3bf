"""Positions of an input at which entries are met one after the other, as near as their order allows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.foundation.arrays import Array, IntArray

SAMPLES, CUTS = 360, 60
"""Positions of the range that are looked at, and those of a turn after which the first entry may come."""
REFINEMENTS, FINER = 4, 4
"""How often, and by how much, positions are looked at more closely."""


def ordered_inputs(misses_at: Callable[[Array], Array], low: float, high: float, is_whole: bool) -> Array:
    """The inputs (n,) between `low` and `high`, rising or falling from entry to entry, of least sum of squared misses.

    `misses_at` tells for inputs (m,) how far each entry is missed there (m, n). Of a whole turn entries may go on over
    its end, once round at most. The assignment of samples is found by dynamic programming.
    """
    span = high - low
    given = np.linspace(low, high, SAMPLES + 1)
    square = misses_at(given) ** 2
    best = np.inf
    inputs: Array = given
    for cut in range(0, SAMPLES, SAMPLES // CUTS) if is_whole else (0,):
        samples = np.arange(SAMPLES + 1) + cut  # of a whole turn beyond its end
        for order in (samples, samples[::-1]):
            total, steps = _least_rising(square[order % SAMPLES if is_whole else order])
            if total < best:
                best, inputs = total, low + order[steps] * (span / SAMPLES)
    if not is_whole:
        return _refined(misses_at, inputs, span / SAMPLES, (low, high), np.inf)

    def turned(beyond: Array) -> Array:
        within: Array = low + np.mod(beyond - low, span)
        return within

    endless = -np.inf, np.inf
    return turned(_refined(lambda tried: misses_at(turned(tried)), inputs, span / SAMPLES, endless, span))


def _least_rising(square: Array) -> tuple[float, IntArray]:
    """Rising rows (n,) of squared misses (rows, n), one a column, of the least sum, and that sum."""
    rows = np.arange(len(square))
    total, back = square[:, 0].copy(), []
    for column in square.T[1:]:
        least = np.minimum.accumulate(total)
        back.append(np.maximum.accumulate(np.where(total <= least, rows, 0)))
        total = least + column
    row = int(np.argmin(total))
    sum_of_squares, steps = float(total[row]), [row]
    for each in reversed(back):
        steps.append(int(each[steps[-1]]))
    return sum_of_squares, np.array(steps[::-1])


def _refined(
    misses_at: Callable[[Array], Array], inputs: Array, width: float, ends: tuple[float, float], most: float
) -> Array:
    """Each input moved to where it is nearest between the ends, less far than half of the way to its neighbours; from
    the first to the last it is so far at most."""
    every = np.arange(len(inputs))
    for _ in range(REFINEMENTS):
        left = most - abs(inputs[-1] - inputs[0])
        apart = np.abs(np.diff(inputs))
        apart = np.concatenate([[left], apart, [left]])
        room = np.minimum(width, 0.5 * np.minimum(apart[:-1], apart[1:]))
        offsets = np.linspace(-1.0, 1.0, 2 * FINER + 1)
        tried = np.clip(inputs[:, None] + offsets * room[:, None], *ends)
        off = misses_at(tried.ravel()).reshape(*tried.shape, len(inputs))[every, :, every]
        inputs = tried[every, np.argmin(off, axis=1)]
        width /= FINER
    return inputs
