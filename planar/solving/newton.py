"""Newton's method for one group of constraints, from many starts at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

Array = np.ndarray
ResidualFunction = Callable[[Array], tuple[Array, Array]]
"""Unknowns (starts, n) -> what is left open (starts, m), and its slope (starts, m, n)."""

CLOSED_TOLERANCE = 1e-11
"""A group counts as closed below this (lengths of the mechanism's size); the gate asks for more afterwards."""
STALLED_COST_RATIO = 1e-10
MAX_NEWTON_STEPS = 200
"""Iterations. A double root halves its error each time, so 27 take it from 1 to the square root of round-off."""


class NewtonResult(NamedTuple):
    """Where each start ended: the unknowns, the greatest part left open, and whether that closes the group."""

    unknowns: Array
    residual: Array
    converged: Array


def damped_newton(residual_function: ResidualFunction, starts: Array) -> NewtonResult:
    """Solve from every start by Levenberg's and Marquardt's damping of Gauss and Newton's method.

    The damping falls with every step that succeeds, so convergence at a simple root is quadratic; groups with more
    constraints than unknowns are solved in the sense of least squares, singular ones by the shortest step.
    K. Madsen, H. B. Nielsen, O. Tingleff, Methods for Non-Linear Least Squares Problems, 2nd ed., 2004, sec. 3.2.
    """
    z = np.array(starts, dtype=float)
    count, unknowns = z.shape
    left, slope = residual_function(z)
    if unknowns == 0:
        return _newton_result(z, left)
    cost = np.sum(left * left, axis=1)
    damping, growth = np.full(count, 1e-3), np.full(count, 2.0)
    busy = np.arange(count)
    for _ in range(MAX_NEWTON_STEPS):
        if busy.size == 0:
            break
        step = _damped_step(left[busy], slope[busy], damping[busy])
        tried = z[busy] + step
        new_left, new_slope = residual_function(tried)
        new_cost = np.sum(new_left * new_left, axis=1)
        better = new_cost < cost[busy]
        taken = busy[better]
        z[taken], left[taken], slope[taken] = tried[better], new_left[better], new_slope[better]
        small = np.max(np.abs(step), axis=1) < 1e-13
        # far from closed and hardly coming closer: a start that ends where nothing closes
        small |= better & (cost[busy] - new_cost < STALLED_COST_RATIO * cost[busy]) & (new_cost > 1e-8)
        settled = small | (better & (new_cost <= 1e-31)) | (damping[busy] > 1e12)
        cost[taken] = new_cost[better]
        damping[busy] = np.where(better, np.maximum(damping[busy] * 0.1, 1e-17), damping[busy] * growth[busy])
        growth[busy] = np.where(better, 2.0, growth[busy] * 2.0)
        busy = busy[~settled]
    return _newton_result(z, left)


def _damped_step(residuals: Array, jacobian: Array, damping: Array) -> Array:
    """The damped step, from a singular value decomposition, so that nothing is squared and nothing need be regular."""
    u, s, vt = np.linalg.svd(jacobian, full_matrices=False)
    along = np.einsum("kmr,km->kr", u, residuals)
    scale = np.maximum(s[:, :1], 1e-300)
    gain = s / np.maximum(s * s + damping[:, None] * scale * scale, 1e-300)
    return -np.einsum("krn,kr->kn", vt, np.where(s > 1e-14 * scale, gain, 0.0) * along)


def polish_root(residual_function: ResidualFunction, z: Array) -> Array:
    """One root (n,) carried to round-off by undamped steps, as long as each leaves less open."""
    z = z[None, :]
    left, slope = residual_function(z)
    for _ in range(4):
        if z.shape[1] == 0:
            break
        tried = z + _damped_step(left, slope, np.zeros(1))
        new_left, new_slope = residual_function(tried)
        if np.max(np.abs(new_left)) >= np.max(np.abs(left)):
            break
        z, left, slope = tried, new_left, new_slope
    return z[0]


def _newton_result(z: Array, residuals: Array) -> NewtonResult:
    gap = np.max(np.abs(residuals), axis=1, initial=0.0)
    return NewtonResult(z, gap, gap <= CLOSED_TOLERANCE)
