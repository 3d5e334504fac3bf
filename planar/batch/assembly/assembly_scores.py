"""Assemblies of many designs at once, and the distances from the sketch by which the ones that are meant are chosen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.march.prediction import CLEAR_REGULARITY
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


class DesignAssemblies(NamedTuple):
    """z (unknowns, designs), and for which of them it is surely the one that the search one by one would take.

    `failed_block`: the level of the block that surely cannot be joined to the rest, -1 where all can (designs,);
    `signs` (blocks, designs): of the assemblies of blocks in closed form, 0 where they are not known; None of none.
    """

    z: Array
    is_sure: Array
    failed_block: Array
    signs: Array | None = None


def is_at_sketch(
    squared_distance: Array, point_count: int | Array, reach: float | Array = CLEAR_SKETCH_DISTANCE
) -> Array:
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
