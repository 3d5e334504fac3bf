"""The loosest tolerances with which a result keeps to a limit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.tolerance.spread import LinearSpread, NormalSpread
from planar.analysis.tolerance.tolerance import ToleranceBand
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr


class Allowance(NamedTuple):
    """Tolerances, plus and minus (SI), by their numbers, with which a result is off by `limit` at most.

    By `equal` each number contributes alike where it does most: t_i goes as 1 / |slope|. By `least_cost` the sum of
    g_i / t_i is least, where g_i is the given tolerance, so that each costs as much as given: by Lagrange's rule t_i
    goes as sqrt(g_i / |slope|) in the worst case, as (g_i / slope^2)^(1/3) where squares are added (M. F. Spotts,
    Journal of Engineering for Industry 95 (1973) 762).
    `factor` is that by which the given tolerances could all be multiplied instead. Clearances stay as they are.
    """

    limit: float
    statistical: bool
    equal: Mapping[str, float]
    least_cost: Mapping[str, float]
    factor: float

    def __repr__(self) -> str:
        return short_repr(self)


def allowance(band: ToleranceBand, limit: float, statistical: bool = False) -> Allowance:
    """The loosest tolerances with which the result of a band is off by a limit (SI) at most at every position: in the
    worst case, or by three standard deviations. Raises BadInput, and NoAnswer where clearances alone are too much."""
    if not limit > 0.0 or not np.isfinite(limit):
        raise BadInput("--allow", "a deviation above 0 is to be allowed")
    linear = band.linear
    strengths = np.nanmax(np.linalg.norm(linear.slopes, axis=1), axis=0, initial=0.0)
    half = 0.5 * (linear.upper - linear.lower)
    counts = (strengths > 1e-9 * strengths.max(initial=0.0)) & (half > 0.0)
    if not counts.any():
        raise BadInput("--allow", f"no tolerance of a number changes {band.of!r}")
    if _reach(linear, np.zeros(len(strengths)), statistical) >= limit:
        raise NoAnswer(Outcome.TOO_INEXACT, "the clearances of the pins alone take it beyond that limit")
    known = np.where(counts, strengths, 1.0)
    rules = (1.0 / known, (half / known**2) ** (1.0 / 3.0) if statistical else np.sqrt(half / known))
    names = [each.number for each in band.variations.numbers]
    found = []
    for shares in rules:
        shape = np.where(counts, shares, 0.0)
        told = shape * _scale(linear, shape, limit, statistical)
        found.append({name: float(t) for name, t, counted in zip(names, told, counts, strict=True) if counted})
    return Allowance(limit, statistical, found[0], found[1], _scale(linear, half, limit, statistical))


def _reach(linear: LinearSpread, half: Array, statistical: bool) -> float:
    """The greatest deviation with tolerances plus and minus `half`."""
    spread = linear._replace(lower=-half, upper=half)
    if not statistical:
        return float(np.nanmax(spread.farthest()))
    normal = NormalSpread(spread.middle, spread.variances.sum(axis=0))
    with np.errstate(invalid="ignore"):
        known = np.where(np.isfinite(normal.covariance), normal.covariance, 0.0)
    greatest = np.sqrt(np.linalg.eigvalsh(known)[:, -1])
    return float(np.nanmax(np.linalg.norm(normal.mean, axis=1) + linear.sigmas * greatest))


def _scale(linear: LinearSpread, half: Array, limit: float, statistical: bool) -> float:
    """By what tolerances are multiplied so that they reach the limit."""
    free = linear._replace(radii=0.0 * linear.radii, shift=0.0 * linear.shift)
    alone = _reach(free, half, statistical)
    if not alone:
        return float("inf")
    high = limit / alone
    return find_root(lambda scale: _reach(linear, scale * half, statistical) - limit, 0.0, high)
