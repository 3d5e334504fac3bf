"""A zero of a function between two places."""

from __future__ import annotations

from collections.abc import Callable
from math import ulp

MAX_EVALUATIONS = 80
"""Bisection alone needs 52 for a root to round-off."""


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
