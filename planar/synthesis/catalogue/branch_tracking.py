"""The motion of many designs side by side: from where each goes together, until its input cannot go on."""

from __future__ import annotations

from math import pi

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.model.pairs import MeasureKind
from planar.synthesis.fitting.wanted_equations import CLOSED, WantedEquations, tangents

STEPS = 72
"""Of a turn, or of as far as a slide may go."""
SLIDE_RANGE = 4.0
"""Of the mechanism's size: how far a slide that runs is followed."""
MAX_TURN = 0.35
"""rad, or of the size: how much any unknown changes in a step; shorter steps towards dead points."""
MAX_STEPS = 110
LEAST_RATE = 0.03
"""Of the input beside all unknowns, along the path: where it is less a dead point is near, and the branch ends."""


def follow_branches(equations: WantedEquations, x: Array, y: Array) -> tuple[Array, BoolArray]:
    """The unknowns (designs, steps, unknowns) along each design's branch, the input rising, NaN beyond its ends; and
    which designs turn fully (designs,)."""
    forward, is_whole = _follow(equations, x, y, 1.0)
    part = np.flatnonzero(~is_whole)
    back, _ = _follow(equations, x[part], y[part], -1.0)
    joined = np.full((len(x), 2 * MAX_STEPS + 1, y.shape[1]), np.nan)
    joined[:, MAX_STEPS:] = forward
    joined[part, : MAX_STEPS + 1] = back[:, ::-1]
    return joined, is_whole


def _follow(equations: WantedEquations, x: Array, y: Array, sense: float) -> tuple[Array, BoolArray]:
    turns = equations.design.equations.input_kinds[0] is not MeasureKind.LENGTH
    span = 2.0 * pi if turns else SLIDE_RANGE * equations.design.solver.unit / equations.input_scale
    found = np.full((len(x), MAX_STEPS + 1, y.shape[1]), np.nan)
    found[:, 0] = y
    rows, here = np.arange(len(x)), y[:, None]
    way = np.zeros_like(here)
    way[..., -1] = sense
    tangent = _along(equations, x, here, way)
    is_whole = np.zeros(len(x), bool)
    for step in range(1, MAX_STEPS + 1):
        if not len(rows):
            break
        rate = np.abs(tangent[:, 0, -1])
        left = span - np.abs(here[:, 0, -1] - y[rows, -1])
        length = np.minimum(span / STEPS, left) / np.maximum(rate, 1e-9)
        length = np.minimum(length, MAX_TURN / np.maximum(np.abs(tangent[:, 0]).max(axis=1), 1e-9))
        there = here + length[:, None, None] * tangent
        there, _ = equations.close(x[rows], there, tangent, 3)
        after = _along(equations, x[rows], there, tangent)
        F, _ = equations.closure_at(x[rows], there)
        good: BoolArray = np.asarray(np.abs(F).max(axis=(1, 2), initial=0.0) < CLOSED)
        good &= np.isfinite(there).all(axis=(1, 2))
        good &= sense * after[:, 0, -1] > LEAST_RATE
        good &= np.abs(there - here).max(axis=(1, 2)) < 2.0 * MAX_TURN
        found[rows[good], step] = there[good, 0]
        done = good & (np.abs(there[:, 0, -1] - y[rows, -1]) > span * (1.0 - 1e-6))
        is_whole[rows[done]] = turns
        on = good & ~done
        rows, here, tangent = rows[on], there[on], after[on]
    return found, is_whole


def _along(equations: WantedEquations, x: Array, y: Array, before: Array) -> Array:
    """Unit vectors along the path, in the sense of those before."""
    jacobian = equations.jacobians(x, y)
    if not jacobian.shape[2]:
        return np.broadcast_to(before, y.shape).copy()
    found = tangents(np.where(np.isfinite(jacobian), jacobian, 0.0))
    sense = np.where(np.sum(found * before, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    told: Array = sense * found
    return told
