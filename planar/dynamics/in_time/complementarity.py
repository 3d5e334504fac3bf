"""Contacts that push and never pull: the linear complementarity problem of a few of them."""

from __future__ import annotations

from itertools import chain, combinations

import numpy as np

from planar.foundation.arrays import Array

MAX_CONTACTS = 10
"""Contacts at once of which all subsets are tried."""
FEASIBLE_TOLERANCE = 1e-9
"""Of the greatest: what may be missing from zero."""


def solve_complementarity(matrix: Array, offset: Array) -> Array | None:
    """x >= 0 (n,) with y = matrix x + offset >= 0 and x y = 0, the fewest entries above zero; None where there is none.

    `matrix` is symmetric and has no negative eigenvalue. All subsets of contacts are tried (R. Cottle, J.-S. Pang,
    R. Stone, The Linear Complementarity Problem, 1992, sec. 1.1).
    """
    many = len(offset)
    room = FEASIBLE_TOLERANCE * float(np.abs(offset).max(initial=0.0))
    for some in chain.from_iterable(combinations(range(many), size) for size in range(min(many, MAX_CONTACTS) + 1)):
        pick = list(some)
        x = np.zeros(many)
        if pick:
            x[pick] = np.linalg.lstsq(matrix[np.ix_(pick, pick)], -offset[pick], rcond=1e-12)[0]
        y = matrix @ x + offset
        least = FEASIBLE_TOLERANCE * float(np.abs(x).max(initial=0.0))
        if x.min(initial=0.0) >= -least and y.min(initial=0.0) >= -room and np.abs(y[pick]).max(initial=0.0) <= room:
            return np.maximum(x, 0.0)
    return None
