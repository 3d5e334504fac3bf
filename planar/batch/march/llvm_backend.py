"""The backend of machine code: designs side by side in the lanes of the machine's vectors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.batch.march import llvm_runner, numpy_backend
from planar.batch.march.backend import Closed, March, NotMarched
from planar.batch.march.llvm_runner import Designs, ended, run
from planar.codegen.aligned_arrays import room
from planar.codegen.instructions import NotPrinted

Array = np.ndarray

MORE = 2
"""Further corrections at every step for designs that the usual ones leave open."""


def march(task: March, out: Array) -> Array:
    """See `Marching`. What the usual corrections leave open runs once more with further ones; what does not begin so,
    by casadi.

    Raises NotMarched where the structure is not for vectors.
    """
    good = _run(task, out, 0)
    least = len(task.u)
    for again in (lambda part, room: _run(part, room, MORE), numpy_backend.march):
        left = np.flatnonzero(good < least)
        if left.size:
            own = room(*out.shape[:2], left.size)
            good[left] = again(task.of(left), own)
            out[:, :, left] = own
        least = 1
    return good


def reached(task: March, good: Array) -> Array:
    """See `Reaching`."""
    return llvm_runner.reached(
        task.program, task.mechanism, _designs(task), task.u, task.tolerance, MORE, np.maximum(good - 1, 0)
    )


def closed(task: March, levels: Sequence[int], corrections: int) -> Closed:
    """See `Closing`."""
    try:
        found = ended(task.program, task.mechanism, _designs(task), task.links, levels, task.tolerance, corrections)
    except NotPrinted as why:
        raise NotMarched(str(why)) from None
    return Closed(*found)


def _run(task: March, out: Array, more: int) -> Array:
    tolerance, unit = task.tolerance, task.unit
    try:
        return run(
            task.program, task.mechanism, _designs(task), task.u, task.links, task.rates, tolerance, more, unit, out
        )[1]
    except NotPrinted as why:
        raise NotMarched(str(why)) from None


def _designs(task: March) -> Designs:
    return Designs(task.p, task.q, task.z0, task.u0, task.u1, task.u2)
