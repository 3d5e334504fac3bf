"""Counterweights that are solid discs: their moment of inertia is no free choice, so the best are searched for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.dynamics.balancing.counterweights import CounterweightSet
from planar.dynamics.balancing.optimum import Optimum, Response
from planar.foundation.arrays import Array
from planar.foundation.time_limit import all_within_time

RANDOM_STARTS = 12
"""Starts beside that from the optimum of the convex hull."""
MAX_SEARCH_STEPS = 200


def search_discs(objective: Response, weights: CounterweightSet, hull: Optimum, seed: int = 0) -> Optimum:
    """The best discs that searches from several starts find (SLSQP), beside the bound of the convex hull of all discs.

    That bound holds for every disc; between it and what is found nothing is known.
    """
    mine = objective.restricted(weights)
    many, discs = len(weights.links), np.array([limit.disc for limit in weights.limits])
    random = np.random.default_rng(seed)
    starts = [_from_hull(hull.x, many)]
    for _ in range(RANDOM_STARTS):
        angle, radius = random.uniform(-np.pi, np.pi, many), np.sqrt(random.uniform(0.0, 1.0, many))
        starts.append(
            np.stack([random.uniform(0.0, 1.0, many), radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        )
    nothing = np.zeros(4 * many)
    best: Array = nothing
    value = mine.greatest(nothing)
    scale = value or 1.0
    for start in all_within_time(starts, "searches for discs"):
        found = _improve(mine, start, discs, scale)
        reached = mine.greatest(found)
        if reached < value:
            best, value = found, reached
    return Optimum(best, value, hull.bound)


def _from_hull(x: Array, many: int) -> Array:
    """Mass and centre (links, 3) of variables (4 links,)."""
    rows = x.reshape(many, 4)
    mass = np.clip(rows[:, :1], 1e-6, 1.0)
    centre = rows[:, 1:3] / mass
    away = np.maximum(np.linalg.norm(centre, axis=1, keepdims=True), 1.0)
    return np.concatenate([mass, centre / away], axis=1)


def _variables(rows: Array, discs: Array) -> Array:
    """Variables (4 links,) of discs by mass and centre (links, 3)."""
    m, x, y = rows.T
    return np.stack([m, m * x, m * y, m * (x * x + y * y) + discs * m * m], axis=1).ravel()


def _jacobian(rows: Array, discs: Array) -> Array:
    """Their derivatives (4 links, 3 links)."""
    found = np.zeros((len(rows), 4, len(rows), 3))
    for k, (m, x, y) in enumerate(rows):
        found[k, :, k, 0] = 1.0, x, y, x * x + y * y + 2.0 * discs[k] * m
        found[k, :, k, 1] = 0.0, m, 0.0, 2.0 * m * x
        found[k, :, k, 2] = 0.0, 0.0, m, 2.0 * m * y
    return found.reshape(4 * len(rows), 3 * len(rows))


def _improve(mine: Response, start: Array, discs: Array, scale: float) -> Array:
    """The variables (4 links,) of discs to which a search leads."""
    from scipy.optimize import minimize  # slow to load, and only needed here

    many = len(discs)
    matrix, offset = mine.matrix / scale, mine.offset / scale

    def rows(v: Array) -> Array:
        return v[:-1].reshape(many, 3)

    def sizes(v: Array) -> Array:
        response = matrix @ _variables(rows(v), discs) + offset
        inside = 1.0 - (rows(v)[:, 1:] ** 2).sum(axis=1)
        return np.concatenate([v[-1] ** 2 - (response**2).sum(axis=1), inside])

    def slopes(v: Array) -> Array:
        response = matrix @ _variables(rows(v), discs) + offset
        by = -2.0 * np.einsum("nd,ndc->nc", response, matrix) @ _jacobian(rows(v), discs)
        found = np.zeros((len(by) + many, len(v)))
        found[: len(by), :-1], found[: len(by), -1] = by, 2.0 * v[-1]
        for k in range(many):
            found[len(by) + k, 3 * k + 1 : 3 * k + 3] = -2.0 * rows(v)[k, 1:]
        return found

    first = np.append(start.ravel(), float(np.linalg.norm(matrix @ _variables(start, discs) + offset, axis=1).max()))
    bounds: Sequence[tuple[float, float | None]] = [*[(0.0, 1.0), (-1.0, 1.0), (-1.0, 1.0)] * many, (0.0, None)]
    cost = np.zeros(len(first))
    cost[-1] = 1.0
    found = minimize(
        lambda v: float(v[-1]),
        first,
        jac=lambda _: cost,
        bounds=bounds,
        constraints=[{"type": "ineq", "fun": sizes, "jac": slopes}],
        method="SLSQP",
        options={"maxiter": MAX_SEARCH_STEPS, "ftol": 1e-12},
    )
    end = rows(found.x).copy()
    end[:, 0] = np.clip(end[:, 0], 0.0, 1.0)
    end[:, 1:] /= np.maximum(np.linalg.norm(end[:, 1:], axis=1, keepdims=True), 1.0)
    return _variables(end, discs)
