"""Room for what machine code writes: rows that begin where the vectors of the machine do."""

from __future__ import annotations

import numpy as np
from numpy.typing import DTypeLike

from planar.foundation.arrays import Array

WIDEST_VECTOR_BYTES = 64
"""Bytes of the widest vectors of a machine."""


def allocate_aligned(steps: int, rows: int, designs: int, dtype: DTypeLike = np.float64) -> Array:
    """An array (steps, rows, designs), not filled, every row of which begins at a whole vector."""
    many = WIDEST_VECTOR_BYTES // np.dtype(dtype).itemsize
    width = -(-designs // many) * many
    made = np.empty(steps * rows * width + many, dtype)
    first = -(made.ctypes.data // made.itemsize) % many
    return made[first : first + steps * rows * width].reshape(steps, rows, width)[:, :, :designs]


def is_aligned(array: Array) -> bool:
    """Whether every row of an array begins so."""
    return not any(place % WIDEST_VECTOR_BYTES for place in (array.ctypes.data, *array.strides[:2]))
