"""What one writes without a library for mechanisms: the loop equations in scipy.optimize.fsolve."""

from __future__ import annotations

import math

import numpy as np
from scipy.optimize import fsolve

from benchmarks.linkages import Linkage
from benchmarks.linkages.base import ALPHA, OMEGA
from benchmarks.ways.trial import CRANK, Array, Trial

WAY = "scipy fsolve"


def trials(linkage: Linkage) -> tuple[Trial, ...]:
    """fsolve from the position before, without a Jacobian; rates from the loop equations' derivatives by hand."""
    start = np.array(linkage.positions(math, float(CRANK[0])))

    def positions() -> Array:
        x, found = start, np.empty((len(CRANK), 2))
        for index, theta in enumerate(CRANK):
            x = found[index] = fsolve(linkage.loop, x, (theta,))
        return found

    def motion() -> Array:
        x, found = start, np.empty((3, len(CRANK), 2))
        for index, theta in enumerate(CRANK):
            x = fsolve(linkage.loop, x, (theta,))
            found[:, index] = x, *_rates(linkage, x, float(theta))
        return found

    return (
        Trial(WAY, False, len(CRANK), positions, lambda found: found[None]),
        Trial(WAY, True, len(CRANK), motion, lambda found: found),
    )


def _rates(linkage: Linkage, x: Array, theta: float) -> tuple[Array, Array]:
    """Velocities and accelerations of x (2,)."""
    slope = linkage.slope(x)
    first, _ = linkage.bend(x, (0.0, 0.0), theta, OMEGA, ALPHA)
    v = -np.linalg.solve(slope, first)
    _, second = linkage.bend(x, v, theta, OMEGA, ALPHA)
    return v, -np.linalg.solve(slope, second)
