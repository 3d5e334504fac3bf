"""The runner of machine code: designs side by side in the lanes of the machine's vectors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from planar.batch.march.backend import CorrectedAssemblies, DesignBatch, UnsupportedStructure
from planar.batch.march.kernel import batch_equations
from planar.batch.march.llvm.kernel_runs import correct_designs, run_designs_kernel, unknowns_at_steps
from planar.foundation.instruction_list import UnsupportedOperation

Array = np.ndarray

EXTRA_CORRECTIONS = 2
"""Further corrections at every step for designs that the usual ones leave open."""


class LLVMRunner:
    """See `DesignRunner`; with so many corrections more at every step than usual."""

    def __init__(self, extra_corrections: int = 0):
        self.extra_corrections = extra_corrections

    def can_help(self, batch: DesignBatch) -> bool:
        """See `DesignRunner`: nothing is corrected where all blocks are in closed form."""
        try:
            return not self.extra_corrections or batch_equations(batch).has_newton_blocks
        except UnsupportedOperation:
            return False

    def run(self, batch: DesignBatch, out: Array, candidates: Array | None = None) -> Array:
        """See `DesignRunner`."""
        with _refusing_structures():
            return run_designs_kernel(batch, self.extra_corrections, out, candidates)[1]

    def last_good_unknowns(self, batch: DesignBatch, good: Array) -> Array:
        """See `DesignRunner`."""
        with _refusing_structures():
            return unknowns_at_steps(batch, EXTRA_CORRECTIONS, np.maximum(good - 1, 0))

    def correct_assemblies(
        self, batch: DesignBatch, point_blocks: Sequence[int], corrections: int
    ) -> CorrectedAssemblies:
        """See `DesignRunner`."""
        with _refusing_structures():
            return correct_designs(batch, point_blocks, corrections)


@contextmanager
def _refusing_structures() -> Iterator[None]:
    try:
        yield
    except UnsupportedOperation as why:
        raise UnsupportedStructure(str(why)) from None
