"""Designs after a step of a fit that may be taken back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray


@dataclass
class Trial:
    """Designs after a step (designs, ...)."""

    numbers: Array
    unknowns: list[Array]
    zeros: list[Array]
    tangents: list[Array]
    guarded: Array
    slack: Array
    is_good: BoolArray
    "(designs,): whether they go together at all that is looked at"
    is_shortened: BoolArray
    "(designs,): whether the step was made less than it was given"
    residuals: list[Array]

    @cached_property
    def misses(self) -> Array:
        """The sums of squares (designs,) of what is wanted alone."""
        return sum_squares(self.residuals)

    def replace(self, rows: IntArray, other: Trial, own: IntArray) -> None:
        """Designs (rows) as they are in another trial (own)."""
        for name, mine in vars(self).items():
            its = getattr(other, name)
            for here, there in zip(mine, its, strict=True) if isinstance(mine, list) else [(mine, its)]:
                here[rows] = there[own]


def sum_squares(residuals: Sequence[Array]) -> Array:
    """The sums (designs,) of squares of rows (designs, n, parts) of several kinds; infinite where one is not known."""
    found = np.zeros(len(residuals[0]))
    for each in residuals:
        found += (each**2).sum(axis=(1, 2))
    return np.where(np.isfinite(found), found, np.inf)
