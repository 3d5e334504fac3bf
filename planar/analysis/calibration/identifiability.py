"""What a measurement cannot tell apart: changes of the numbers that it does not see, in words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import Dimension
from planar.foundation.arrays import Array
from planar.foundation.errors import join_names
from planar.foundation.short_repr import short_repr

RANK_TOLERANCE = 1e-7
"""Of the greatest singular value: a change of the numbers that shows less than this is not seen."""
NO_PART = 1e-5
"""Of the greatest: a lesser part of an unseen change is none."""


class Unidentified(NamedTuple):
    """A change of numbers that the measurement does not see, to the first order: by how much each changes (SI), the
    first by one, and a sentence."""

    numbers: Mapping[str, float]
    sentence: str

    def __repr__(self) -> str:
        return short_repr(self)


def unseen_changes(slopes: Array) -> tuple[Array, Array, int]:
    """The singular values of derivatives (rows, numbers), unseen changes (unseen, numbers), each with a one where the
    others have none, and the rank."""
    _, s, v = np.linalg.svd(slopes, full_matrices=True)
    rank = int((s > RANK_TOLERANCE * max(s.max(initial=0.0), np.finfo(float).tiny)).sum())
    return s, _reduced_rows(v[rank:]), rank


def _reduced_rows(rows: Array) -> Array:
    """The same space by rows of which each has a one in a column where the others have none (complete pivoting)."""
    found, taken = rows.copy(), list[int]()
    for k in range(len(found)):
        rest = np.abs(found[k:]).copy()
        rest[:, taken] = 0.0
        row, column = divmod(int(np.argmax(rest)), found.shape[1])
        found[[k, k + row]] = found[[k + row, k]]
        found[k] /= found[k, column]
        others = np.arange(len(found)) != k
        found[others] -= np.outer(found[others, column], found[k])
        taken.append(column)
    found[np.abs(found) < NO_PART * np.abs(found).max(axis=1, initial=0.0, keepdims=True)] = 0.0
    return found


def describe_unseen(change: Array, dimensions: Sequence[Dimension], frame: str) -> Unidentified:
    """An unseen change (numbers,) in SI, in words."""
    parts = [(each, float(part)) for each, part in zip(dimensions, change, strict=True) if part]
    first = parts[0][1]
    parts = [(each, part / first) for each, part in parts]
    names, by = [each.name for each, _ in parts], [part for _, part in parts]
    same_kind = len({each.kind for each, _ in parts}) == 1
    if len(parts) == 1:
        sentence = f"the measurement does not depend on {names[0]}"
    elif same_kind and len(parts) == 2 and abs(by[1] - 1.0) < NO_PART:
        sentence = f"only the difference {names[0]} - {names[1]} is known"
    elif same_kind and len(parts) == 2 and abs(by[1] + 1.0) < NO_PART:
        sentence = f"only the sum {names[0]} + {names[1]} is known"
    elif _is_proportional(parts):
        sentence = f"only the ratios of {join_names(names)} are known, and not the size of the mechanism"
    elif same_kind and max(abs(part - 1.0) for part in by) < NO_PART:
        sentence = f"{join_names(names)} move together: only their differences are known"
    else:
        sentence = f"{join_names(names)} move together, as {' : '.join(f'{part:.3g}' for part in by[:13])}"
    if all(each.link == frame for each, _ in parts) and len(parts) > 1:
        sentence += "; where the frame's axes lie is free"
    return Unidentified(dict(zip(names, by, strict=True)), sentence)


def _is_proportional(parts: Sequence[tuple[Dimension, float]]) -> bool:
    """Whether all are lengths that change by the same part of each."""
    if len(parts) < 3 or any(each.kind != "length" or not each.value for each, _ in parts):
        return False
    ratios = [part / each.value for each, part in parts]
    return max(ratios) - min(ratios) < 1e-3 * abs(ratios[0])
