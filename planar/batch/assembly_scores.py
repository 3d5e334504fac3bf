"""Distances of assemblies from the sketch, by which the one that is meant is chosen, for many designs at once."""

from __future__ import annotations

import numpy as np

from planar.batch.march.regularity import CLEAR_REGULARITY
from planar.solving.assembly.block_assemblies import CLEAR_SKETCH_DISTANCE
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE

Array = np.ndarray

NEAR_SKETCH = 0.15
"""Lengths of the size, on average, from the sketch: a large block that lies farther off may have another assembly that
is nearer, of which no start tells."""
MAX_BLOCK_UNKNOWNS = 4
"""Unknowns of the largest block whose regularity tells whether another assembly is near."""
CLEARLY_OPEN = 1.0 + 1e-6
"""Of a block's coalescence: from there on it cannot be joined, and stays open by more than what counts as closed."""


def is_at_sketch(squared_distance: Array, point_count: int | Array, reach: float = CLEAR_SKETCH_DISTANCE) -> Array:
    """Whether points lie where the sketch shows them, by the sum of their squared distances (squared sizes)."""
    return squared_distance <= point_count * reach**2


def is_clearly_regular(regularity: Array) -> Array:
    """Whether a block is so regular that no other of its assemblies is near."""
    return regularity > CLEAR_REGULARITY


def is_surely_farther(other: Array, whole: Array, roundings: int = 1) -> Array:
    """Whether another assembly of a block, taken alone, lies farther from the sketch than the whole that was taken.

    Squared distances never fall as blocks are added, so there is then no nearer one of the whole.
    """
    return other > whole + roundings * EQUAL_DISTANCE_TOLERANCE
