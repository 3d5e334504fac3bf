"""The solution of contacts that goes over into the one without friction, followed as coefficients grow from nothing."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.dynamics.friction.contact_system import ContactSystem
from planar.foundation.arrays import Array

FIRST_STEP, MIN_STEP = 0.125, 1e-9
"""Of the way from no friction to all of it."""
MAX_NEWTON_STEPS = 12
SOLVED_TOLERANCE = 1e-11
MAX_CHANGE = 0.5
"""Of the greatest contact: a step that changes contacts by more is taken shorter."""


class PathEnd(NamedTuple):
    """How far friction can grow, as a part of what it is (1: all of it), and the contacts there (m,)."""

    part: float
    y: Array


def follow_from_frictionless(system: ContactSystem) -> PathEnd:
    """The contacts at the one position of a system, as far as coefficients can grow from nothing.

    They cannot beyond a part of friction at which two solutions meet and vanish: there the matrix of the equations
    changes its orientation.
    """
    y = _correct(system.scaled(0.0), np.zeros(system.loads.shape[:2]))
    part, step = 0.0, FIRST_STEP
    if y is None:
        return PathEnd(0.0, np.zeros(system.loads.shape[1]))
    while part < 1.0 and step > MIN_STEP:
        ahead = min(part + step, 1.0)
        tried = _correct(system.scaled(ahead), y)
        near = max(float(np.abs(y).max(initial=0.0)), part * 1e-300)
        if tried is not None and (
            part == 0.0 or step < MIN_STEP * 8 or np.abs(tried - y).max(initial=0.0) <= MAX_CHANGE * near
        ):
            part, y, step = ahead, tried, min(2.0 * step, FIRST_STEP)
        else:
            step *= 0.5
    return PathEnd(part, y[0])


def _correct(system: ContactSystem, y: Array) -> Array | None:
    """The solution (1, m) near y that has the orientation of that without friction; None where there is none."""
    for _ in range(MAX_NEWTON_STEPS):
        y = system.newton_step(y)[0]
        if system.errors(y)[0] < SOLVED_TOLERANCE:
            return y if np.linalg.det(system.newton_step(y)[1])[0] > 0.0 else None
        if not np.isfinite(y).all():
            return None
    return None
