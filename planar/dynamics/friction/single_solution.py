"""The one solution of contacts at positions where friction is too weak to leave a choice, with the proof of that.

phi(h - H y) changes by no more than K times what y changes by; where the spectral radius of K is below one it is a
contraction in a weighted norm (Perron's vector has the weights), and has one fixed point (S. Banach, 1922).
"""

from __future__ import annotations

import numpy as np

from planar.dynamics.friction.contact_system import ContactSystem
from planar.foundation.arrays import Array, BoolArray

CONTRACTION_LIMIT = 1.0 - 1e-9
MAX_STEPS, MAX_PLAIN_STEPS = 40, 20_000
SOLVED_TOLERANCE = 1e-13
"""Of the greatest part or contact."""


def has_single_solution(system: ContactSystem) -> BoolArray:
    """Where it is proved that contacts have one solution, which goes over into that without friction (n,)."""
    bounds = system.lipschitz_bounds()
    if not bounds.shape[1]:
        return np.ones(len(bounds), dtype=bool)
    return np.abs(np.linalg.eigvals(bounds)).max(axis=1) < CONTRACTION_LIMIT


def solve_contraction(system: ContactSystem) -> Array:
    """The solution (n, m) where there is one by contraction: by Newton's steps, and by plain ones if these go round."""
    y = np.zeros(system.loads.shape[:2])
    error = system.errors(y)
    for _ in range(MAX_STEPS):
        tried = system.newton_step(y)[0]
        then = system.errors(tried)
        better = then < error
        y = np.where(better[:, None], tried, y)
        error = np.where(better, then, error)
        if not better.any() or (error < SOLVED_TOLERANCE).all():
            break
    left = np.flatnonzero(error > SOLVED_TOLERANCE * 10)
    if left.size:
        y[left] = _fixed_point(system.at(left), y[left])
    return y


def _fixed_point(system: ContactSystem, y: Array) -> Array:
    for _ in range(MAX_PLAIN_STEPS):
        on = system.sizes(system.parts(y))[0]
        newton = system.newton_step(on)[0]
        y = np.where((system.errors(newton) < system.errors(on))[:, None], newton, on)
        if (system.errors(y) < SOLVED_TOLERANCE * 10).all():
            break
    return y
