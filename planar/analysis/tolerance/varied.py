"""What varies in a mechanism, as bounds: boxes of its parameters, and deviations of a result by slopes over boxes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.derivatives.enclosures import OVER, Balls, Enclosures, ParameterBoxes, ParametricSystem, down, up
from planar.foundation.arrays import Array, IntArray

NESTED = 4
"""Boxes of deviations within one another along which slopes are taken."""


class Varied(NamedTuple):
    """What varies: inputs, then deviations from nominal, each with its column of t.

    The last ones are x and y of `discs` points, each of which stays within a circle about its nominal place.
    """

    columns: IntArray
    inputs: int
    lower: Array
    "the least deviations (k,)"
    upper: Array
    discs: int

    def boxes_of_t(self, base: Array, lower: Array, upper: Array) -> ParameterBoxes:
        """Boxes (lanes, parameters) where what varies has bounds (lanes, varied), and all else is as in `base`."""
        low, high = np.tile(base, (2, len(lower), 1))
        for k, column in enumerate(self.columns):
            if k < self.inputs:
                low[:, column], high[:, column] = lower[:, k], upper[:, k]
                continue
            moves = (lower[:, k] != 0.0) | (upper[:, k] != 0.0)
            low[:, column] = np.where(moves, down(low[:, column] + lower[:, k]), low[:, column])
            high[:, column] = np.where(moves, up(high[:, column] + upper[:, k]), high[:, column])
        return ParameterBoxes(low, high)

    def deviations(self, low: Array, high: Array) -> tuple[Array, Array]:
        """The least and the greatest deviation (lanes, parts) by slopes between bounds (lanes, parts, varied)."""
        split = self.inputs + len(self.lower) - 2 * self.discs
        own = slice(self.inputs, split)
        many = split - self.inputs
        products = [slope[..., own] * end[:many] for slope in (low, high) for end in (self.lower, self.upper)]
        least, greatest = np.minimum.reduce(products), np.maximum.reduce(products)
        size = np.maximum(np.abs(low), np.abs(high))[..., split:]
        reach = np.hypot(size[..., ::2], size[..., 1::2]) * self.upper[many::2]
        lost = (np.abs(least).sum(axis=2) + np.abs(greatest).sum(axis=2) + reach.sum(axis=2)) * (OVER - 1.0)
        return least.sum(axis=2) - reach.sum(axis=2) - lost, greatest.sum(axis=2) + reach.sum(axis=2) + lost


def slope_bounds(slopes: Balls) -> tuple[Array, Array]:
    """What slopes are between."""
    return down(slopes.middle - slopes.radius), up(slopes.middle + slopes.radius)


def mean_slopes(  # many: equations, what varies in them, and what is proved of boxes of it
    system: ParametricSystem, varied: Varied, base: Array, bounds: tuple[Array, Array], outer: Enclosures
) -> tuple[Array, Array]:
    """What the mean of slopes is between (lanes, parts, varied), along straight ways from the nominal to all deviations
    of boxes that are proved: each part of a way lies in a box of its own, one in the other."""
    place = np.array([system.columns.index(column) for column in varied.columns], dtype=int)
    low, high = slope_bounds(outer.slopes)
    many, k = len(low), varied.inputs
    if not many or not len(varied.lower):
        return low[..., place], high[..., place]
    at = np.repeat(np.arange(many), NESTED - 1)
    share = np.tile(np.arange(1, NESTED) / NESTED, many)[:, None]
    lower, upper = (each[at] for each in bounds)
    lower[:, k:], upper[:, k:] = down(lower[:, k:] * share), up(upper[:, k:] * share)
    moved = 0.5 * (lower + upper - bounds[0][at] - bounds[1][at])
    start = outer.middle[at] + (outer.tangents[at][..., place] @ moved[:, :, None])[:, :, 0]
    inner = system.enclose(varied.boxes_of_t(base, lower, upper), start)
    inside = outer.rows(at).holds(inner)[:, None, None]
    found = []
    for part, own, way in zip(slope_bounds(inner.slopes), (low, high), (-1.0, 1.0), strict=True):
        parts = np.where(inside, part, own[at]).reshape(many, NESTED - 1, *own.shape[1:])
        size = np.abs(parts).sum(axis=1) + np.abs(own)
        found.append(((parts.sum(axis=1) + own + way * (OVER - 1.0) * size) / NESTED)[..., place])
    return found[0], found[1]
