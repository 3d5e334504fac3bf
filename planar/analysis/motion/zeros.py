"""Zeros and summits of functions of one position: bracketed on samples, then solved for."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.polynomial import Chebyshev

from planar.foundation.arrays import Array

SERIES_NODES, MAX_HALVINGS = 12, 4
"""Exact positions through which a quantity is laid to be differentiated; how often their stretch is halved for it."""
SERIES_TOLERANCE = 1e-12
"""The last terms of a series, as a part of the greatest, when it has come to its end."""
SECTION_TOLERANCE = 1e-10
"""Of the stretch that is searched: how near a position that is found by sections is to the maximum."""
REAL_ROOT_TOLERANCE = 1e-9
"""A root of a polynomial whose imaginary part is below this is real."""


def bracket_zeros(positions: Array, values: Array, falling: bool = False) -> Iterator[tuple[float, float]]:
    """Where a quantity passes zero, or only where it falls through it: the positions on either side."""
    kept = values != 0.0
    positions, values = positions[kept], values[kept]
    for k in np.flatnonzero(np.sign(values[:-1]) != np.sign(values[1:])):
        if not falling or values[k] > 0.0:
            yield float(positions[k]), float(positions[k + 1])


def bracket_near_zeros(positions: Array, values: Array, slopes: Array) -> Iterator[tuple[float, float]]:
    """Where a quantity comes so near to zero between positions of like sign that it may reach it there.

    It does not, where it is convex and the tangents on either side meet before zero; half of that is allowed for.
    """
    v, w, a, b = values[:-1], values[1:], slopes[:-1], slopes[1:]
    for k in np.flatnonzero((v * w > 0.0) & (v * a < 0.0) & (w * b > 0.0)):
        step = positions[k + 1] - positions[k]
        along = (w[k] - b[k] * step - v[k]) / (a[k] - b[k])
        if (v[k] + a[k] * along) / min(v[k], w[k], key=abs) <= 0.5:
            yield float(positions[k]), float(positions[k + 1])


def bracket_maxima(positions: Array, values: Array) -> Iterator[tuple[float, float]]:
    """Where a quantity has a local maximum: the positions on either side."""
    inner = values[1:-1]
    for k in np.flatnonzero((inner >= values[:-2]) & (inner >= values[2:]) & (values[:-2] + values[2:] < 2.0 * inner)):
        yield float(positions[k]), float(positions[k + 2])


def find_maximum(function: Callable[[float], float], low: float, high: float) -> float:
    """Where a function is greatest between two positions: a zero of the derivative of a polynomial through it.

    Where no polynomial follows the function, as at a kink, the position is searched for by sections.
    """
    lowest, highest = low, high
    at = 0.5 * (low + high)
    for _ in range(MAX_HALVINGS):
        series = Chebyshev.interpolate(
            lambda some: np.array([function(float(each)) for each in some]), SERIES_NODES - 1, domain=[low, high]
        )
        roots = [float(each.real) for each in series.deriv().roots() if abs(each.imag) < REAL_ROOT_TOLERANCE]
        flat = [each for each in roots if low <= each <= high]
        at = max([*flat, low, high], key=series)
        terms = np.abs(series.coef)
        if terms[-2:].max() <= SERIES_TOLERANCE * terms.max():
            break
        quarter = 0.25 * (high - low)
        low, high = max(at - quarter, lowest), min(at + quarter, highest)
    else:
        from scipy.optimize import minimize_scalar  # slow to load, and only needed here

        options = {"xatol": SECTION_TOLERANCE * (highest - lowest)}
        section = minimize_scalar(lambda x: -function(float(x)), bounds=(low, high), method="bounded", options=options)
        if -section.fun > function(at):
            return float(section.x)
    return at
