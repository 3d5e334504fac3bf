"""Which solutions are the same, up to the lengths of their halves."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import ComplexArray, IntArray
from planar.synthesis.exact.tracking.symmetry import solution_keys

SAME = 1e-7
"""Of directions of length one: solutions nearer to each other are one. Two that are nearly real are no farther apart
than their imaginary parts."""


def first_of_same(V: ComplexArray) -> IntArray:
    """Of each solution the first that is the same (solutions,)."""
    found: IntArray = np.arange(len(V))
    if len(V) < 2:
        return found
    half, key = V.shape[1] // 2, solution_keys(V)
    parts = V[:, :half], V[:, half:]
    order = np.argsort(key.real, kind="stable")
    unit = [each / np.linalg.norm(each, axis=1, keepdims=True) for each in parts]
    room = 1e3 * SAME * np.maximum(1.0, np.abs(key))
    for at, k in enumerate(order.tolist()):
        for other in order[at + 1 :].tolist():
            if key[other].real - key[k].real > room[k]:
                break
            apart = max(np.linalg.norm(each[other] - np.vdot(each[k], each[other]) * each[k]) for each in unit)
            if apart < SAME:
                low = min(found[k], found[other])
                found[k] = found[other] = low
    return found
