"""In which senses several rates can be at once, where they follow from fewer: the covectors of their rows.

Along a direction that turns all rates but those of one freedom to zero they have the signs of a cocircuit; all others
are made of these, one after the other (A. Bjorner et al., Oriented Matroids, 1999, sec. 3.7).
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome

RANK_TOLERANCE = 1e-9
"""Of rows of length one."""
MAX_PATTERNS = 5_000
Signs = tuple[int, ...]


def cocircuits(rows: Array) -> list[Signs]:
    """The signs of rows @ c along all directions c in which as many as can be are zero; rows (n, d) of length one."""
    if not len(rows):
        return []
    s, v = np.linalg.svd(rows)[1:]
    basis = v[: int(np.sum(s > RANK_TOLERANCE * s[0]))]
    inner = rows @ basis.T
    rank = len(basis)
    found: dict[Signs, None] = {}
    for some in combinations(range(len(rows)), rank - 1):
        s, v = np.linalg.svd(inner[list(some)], full_matrices=True)[1:]
        if rank > 1 and s.min(initial=1.0) < RANK_TOLERANCE:
            continue
        along = inner @ v[-1]
        signs = np.where(np.abs(along) > RANK_TOLERANCE, np.sign(along), 0.0).astype(int)
        for each in (signs, -signs):
            found[tuple(each.tolist())] = None
        if len(found) > MAX_PATTERNS:
            raise _too_many()
    return list(found)


def sign_patterns(rows: Array) -> list[Signs]:
    """All signs that rows @ c can have, those with most zeros first."""
    zero: Signs = (0,) * len(rows)
    rays, found = cocircuits(rows), {zero}
    fresh = {zero}
    while fresh:
        made = {tuple(a or b for a, b in zip(ray, each, strict=True)) for each in fresh for ray in rays}
        made |= {tuple(a or b for a, b in zip(each, ray, strict=True)) for each in fresh for ray in rays}
        fresh = made - found
        found |= fresh
        if len(found) > MAX_PATTERNS:
            raise _too_many()
    return sorted(found, key=lambda each: (sum(map(abs, each)), each))


def _too_many() -> NoAnswer:
    return NoAnswer(
        Outcome.BRANCH_LOST, "so many pairs that rub stand still at once that not every way to go on can be tried"
    )
