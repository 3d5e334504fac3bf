"""Derivatives of a block's results: by machine code where the block was marched, else by the places of its links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.block import DesignBlock, SolvedDesigns
from planar.batch.gradients.marched_slopes import march_slopes
from planar.batch.march.design_batch import DesignBatch
from planar.batch.named_results.design_slopes import DesignSlopes
from planar.foundation.arrays import Array, BoolArray


class MarchedBlock(NamedTuple):
    """The slopes of a block's results in numbers that can change alone (steps + 1, rows, designs), and the positions
    that are solved but have none yet (steps + 1, designs)."""

    slopes: Array
    missing: BoolArray


def march_block_slopes(
    slopes: DesignSlopes, block: DesignBlock, march: DesignBatch | None, done: SolvedDesigns
) -> MarchedBlock | None:
    """The slopes of a block that has been solved and marched so; None where machine code does not do that."""
    if march is None:
        return None
    found = march_slopes(slopes.reference, march, slopes.free, block.designs)
    if found is None:
        return None
    missing = np.zeros((len(found), found.shape[2]), dtype=bool)
    # mostly all are numbers, and their sum is one
    if done.status.any() or not np.isfinite(found.sum()):
        is_solved = done.status.T == 0
        missing = is_solved & ~np.isfinite(found).all(axis=1)
        np.copyto(found, np.nan, where=~is_solved[:, None])
    return MarchedBlock(found, missing)
