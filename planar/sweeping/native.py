"""The backend of machine code: designs side by side in the lanes of the machine's vectors."""

from __future__ import annotations

import numpy as np

from planar.native.backend import run
from planar.native.listing import NotPrinted
from planar.sweeping import by_program
from planar.sweeping.marching import March, Marched, NotMarched


def march(task: March) -> Marched:
    """See `Marched`. Designs that the machine code leaves off run once more by casadi, which corrects as often as need.

    Raises NotMarched where the structure is not for vectors.
    """
    try:
        out, good = run(
            task.program,
            task.p,
            task.q,
            task.z0,
            task.u0,
            task.u,
            task.u1,
            task.u2,
            task.mechanism,
            task.links,
            task.rates,
            task.tolerance,
        )
    except NotPrinted as why:
        raise NotMarched(str(why)) from None
    left = np.flatnonzero(good < len(task.u))
    if left.size:
        again = by_program.march(task.of(left))
        out[:, :, left], good[left] = again.out, again.good
    return Marched(out, good)
