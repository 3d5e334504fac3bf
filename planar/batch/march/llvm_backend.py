"""The backend of machine code: designs side by side in the lanes of the machine's vectors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.batch.march import llvm_runner, numpy_backend
from planar.batch.march.backend import CorrectedAssemblies, DesignBatch, UnsupportedStructure
from planar.batch.march.llvm_runner import KernelArrays, correct_designs, run_designs_kernel
from planar.codegen.aligned_arrays import allocate_aligned
from planar.codegen.instructions import UnsupportedOperation

Array = np.ndarray

EXTRA_CORRECTIONS = 2
"""Further corrections at every step for designs that the usual ones leave open."""


def run_designs(task: DesignBatch, out: Array) -> Array:
    """See `DesignRunner`. What the usual corrections leave open runs once more with further ones; what does not begin
    so, by casadi.

    Raises UnsupportedStructure where the structure is not for vectors.
    """
    good = _run_compiled(task, out, 0)
    least = len(task.input_offsets)
    for again in (lambda part, room: _run_compiled(part, room, EXTRA_CORRECTIONS), numpy_backend.run_designs):
        left = np.flatnonzero(good < least)
        if left.size:
            own = allocate_aligned(*out.shape[:2], left.size)
            good[left] = again(task.select(left), own)
            out[:, :, left] = own
        least = 1
    return good


def last_good_unknowns(task: DesignBatch, good: Array) -> Array:
    """See `LastGoodUnknowns`."""
    return llvm_runner.unknowns_at_steps(
        task.program,
        task.mechanism,
        _kernel_arrays(task),
        task.input_offsets,
        task.tolerance,
        EXTRA_CORRECTIONS,
        np.maximum(good - 1, 0),
    )


def correct_assemblies(task: DesignBatch, point_blocks: Sequence[int], corrections: int) -> CorrectedAssemblies:
    """See `AssemblyCorrector`."""
    try:
        found = correct_designs(
            task.program, task.mechanism, _kernel_arrays(task), task.links, point_blocks, task.tolerance, corrections
        )
    except UnsupportedOperation as why:
        raise UnsupportedStructure(str(why)) from None
    return CorrectedAssemblies(*found)


def _run_compiled(task: DesignBatch, out: Array, extra_corrections: int) -> Array:
    tolerance, unit = task.tolerance, task.unit
    try:
        return run_designs_kernel(
            task.program,
            task.mechanism,
            _kernel_arrays(task),
            task.input_offsets,
            task.links,
            task.rates,
            tolerance,
            extra_corrections,
            unit,
            out,
        )[1]
    except UnsupportedOperation as why:
        raise UnsupportedStructure(str(why)) from None


def _kernel_arrays(task: DesignBatch) -> KernelArrays:
    return KernelArrays(task.p, task.q, task.z0, task.u0, task.u1, task.u2)
