"""Room for what machine code writes: rows that begin where the vectors of the machine do."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array

WIDEST_VECTOR = 8
"""Numbers of the widest vectors of a machine."""


def allocate_aligned(steps: int, rows: int, designs: int) -> Array:
    """An array (steps, rows, designs), not filled, every row of which begins at a whole vector."""
    width = -(-designs // WIDEST_VECTOR) * WIDEST_VECTOR
    made = np.empty(steps * rows * width + WIDEST_VECTOR)
    first = -(made.ctypes.data // made.itemsize) % WIDEST_VECTOR
    return made[first : first + steps * rows * width].reshape(steps, rows, width)[:, :, :designs]


def is_aligned(array: Array) -> bool:
    """Whether every row of an array begins so."""
    whole = WIDEST_VECTOR * array.itemsize
    return not (array.ctypes.data % whole or array.strides[0] % whole or array.strides[1] % whole)
