"""A zero of a function between two places, and where it first falls below zero."""

from __future__ import annotations

from collections.abc import Callable
from math import ulp

import numpy as np

MAX_EVALUATIONS = 80
"""Bisection alone needs 52 for a root to round-off."""
SHORT_STEP = 1e-8
"""Of Newton's method, as a part of the place or of one: its square is round-off."""
PARTS_LOOKED_AT = np.linspace(0.05, 0.95, 19)
"""Parts of a way at which what has one sign at both ends may have the other."""
TOUCH_TOLERANCE = 1e-12
"""What would fall below zero by no more touches it, and goes on."""


def find_root(function: Callable[[float], float], lower: float, upper: float) -> float:
    """A zero of a function between two places at which its signs differ, to round-off.

    T. Chandrupatla, A new hybrid quadratic/bisection algorithm, Advances in Engineering Software 28, 1997.
    """
    a, b = upper, lower
    fa, fb = function(a), function(b)
    if fa * fb >= 0.0:  # an end at round-off of the zero
        return a if abs(fa) < abs(fb) else b
    part = 0.5
    for _ in range(MAX_EVALUATIONS):
        x = a + part * (b - a)
        fx = function(x)
        if fx * fa > 0.0:
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best = a if abs(fa) < abs(fb) else b
        least = 2.0 * ulp(max(abs(best), 1.0)) / abs(b - a)
        if fx == 0.0 or least > 0.5:
            break
        part = 0.5
        if fc in (fa, fb):
            continue
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        if phi**2 < xi and (1.0 - phi) ** 2 < 1.0 - xi:
            part = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
        part = min(1.0 - least, max(least, part))
    return best


def find_root_by_slope(
    function: Callable[[float], tuple[float, float]], ends: tuple[float, float], values: tuple[float, float]
) -> float:
    """A zero of a function that gives its value and its slope, between two ends where its `values` differ in sign.

    Newton's method, by halves where that leaves what is known to hold the zero. After a short step the next one is
    round-off, as each squares what is left.
    """
    (low, high), (of_low, of_high) = ends, values
    x = low + (high - low) * of_low / (of_low - of_high)
    for _ in range(MAX_EVALUATIONS):
        value, slope = function(x)
        if value * of_low > 0.0:
            low = x
        else:
            high = x
        after = x - value / slope if slope else x
        is_within = min(low, high) <= after <= max(low, high)
        if value == 0.0 or (is_within and slope and abs(after - x) <= SHORT_STEP * max(abs(x), 1.0)):
            return after
        if not is_within or not slope:
            after = 0.5 * (low + high)
        if abs(high - low) <= 2.0 * ulp(max(abs(x), 1.0)):
            break
        x = after
    return x


def lowest_on_cubic(start: tuple[float, float], end: tuple[float, float]) -> tuple[float, float]:
    """The lowest value of a cubic, known by value and slope at its start and end, at some places between; and where
    that is, as a part of the way."""
    (g0, s0), (g1, s1) = start, end
    t = PARTS_LOOKED_AT
    h = t**2 * (3.0 - 2.0 * t)
    values = (1.0 - h) * g0 + t * (1.0 - t) ** 2 * s0 + h * g1 - t**2 * (1.0 - t) * s1
    lowest = int(np.argmin(values))
    return float(values[lowest]), float(t[lowest])


def find_first_passage(
    value: Callable[[float], float],
    rate: Callable[[float], float],
    ends: tuple[float, float],
    known: tuple[tuple[float, float], tuple[float, float]],
) -> float | None:
    """Where on the way between two places a function that starts above zero first falls below it; None where nowhere.

    `known` are its value and its rate along the way at both ends; rates of `rate` are along the way too. Between them
    it falls at most once below zero and comes back: what a cubic of these values does is looked at.
    """
    (first, last), ((g0, s0), (g1, s1)) = ends, known
    g0 = max(g0, TOUCH_TOLERANCE)  # what rounding leaves at the start has no sign

    def zero(low: float, high: float) -> float:
        return find_root(lambda x: max(value(x), g0) if x == first else value(x), low, high)

    gone = abs(last - first)
    lowest, part = lowest_on_cubic((g0, s0 * gone), (g1, s1 * gone))
    middle = first + part * (last - first)
    if g1 < -TOUCH_TOLERANCE:
        # it may have been below, and above again in the meantime
        return zero(first, middle if lowest < 0.0 and s1 > 0.0 > value(middle) else last)
    if s0 < 0.0 < s1:
        middle = find_root(rate, first, last)
    elif not lowest < min(g0, g1):
        return None
    return zero(first, middle) if value(middle) < -TOUCH_TOLERANCE else None
