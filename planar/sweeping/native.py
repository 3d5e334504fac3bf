"""The backend of machine code: designs side by side in the lanes of the machine's vectors."""

from __future__ import annotations

import numpy as np

from planar.native.backend import run
from planar.native.listing import NotPrinted
from planar.sweeping import by_program
from planar.sweeping.marching import March, Marched, NotMarched

MORE = 2
"""Further corrections at every step for designs that the usual ones leave open."""


def march(task: March) -> Marched:
    """See `Marched`. What the usual corrections leave open runs once more with further ones, and then by casadi.

    Raises NotMarched where the structure is not for vectors.
    """
    out, good = _run(task, 0)
    for again in (lambda part: _run(part, MORE), by_program.march):
        left = np.flatnonzero(good < len(task.u))
        if left.size:
            out[:, :, left], good[left] = again(task.of(left))
    return Marched(out, good)


def _run(task: March, more: int) -> Marched:
    inputs = (task.u0, task.u, task.u1, task.u2)
    try:
        found = run(
            task.program, task.p, task.q, task.z0, *inputs, task.mechanism, task.links, task.rates, task.tolerance, more
        )
    except NotPrinted as why:
        raise NotMarched(str(why)) from None
    return Marched(*found)
