"""Room for what machine code writes: rows that begin where the vectors of the machine do."""

from __future__ import annotations

import numpy as np

Array = np.ndarray

ALIGNED = 8
"""Numbers of the widest vectors of a machine."""


def room(steps: int, rows: int, designs: int) -> Array:
    """An array (steps, rows, designs), not filled, every row of which begins at a whole vector."""
    width = -(-designs // ALIGNED) * ALIGNED
    made = np.empty(steps * rows * width + ALIGNED)
    first = -(made.ctypes.data // made.itemsize) % ALIGNED
    return made[first : first + steps * rows * width].reshape(steps, rows, width)[:, :, :designs]


def is_room(array: Array) -> bool:
    """Whether every row of an array begins so."""
    whole = ALIGNED * array.itemsize
    return not (array.ctypes.data % whole or array.strides[0] % whole or array.strides[1] % whole)
