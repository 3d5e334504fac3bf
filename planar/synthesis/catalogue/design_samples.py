"""Random designs of a mechanism that go together, whatever its structure.

Where links stand is drawn at random, and so are the free numbers; then numbers and places are changed together as
little as closes all equations (Newton's steps of least norm). Closure is linear in lengths and coordinates, so that
nearly every draw becomes a design, where of random lengths hardly any go together.
"""

from __future__ import annotations

from math import log, pi

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.model.pairs import MeasureKind
from planar.synthesis.fitting.wanted_equations import WantedEquations
from planar.synthesis.task.starts import FreeNumbers

CLOSING_STEPS, CLOSED = 24, 1e-9
MOBILITY_OF_PLACES = 0.1
"""How readily places change to close a design, beside numbers."""
NEAR_SHARE, NEAR_SPREAD = 0.25, 0.25
"""Of designs near the start, and how far from it they are, of the numbers and the size."""
LENGTH_RANGE = (0.12, 1.6)
"""Of the mechanism's size: between which lengths are drawn, evenly by their logarithm."""
COORDINATE_RANGE = 0.9
"""Of the size: how far coordinates go, either way."""
LEAST_LENGTH = 0.02


def draw_designs(
    equations: WantedEquations, free: FreeNumbers, count: int, random: np.random.Generator
) -> tuple[Array, Array]:
    """Scaled free numbers (designs, free), and unknowns (designs, unknowns) at which each goes together; fewer than
    `count` of them."""
    lower, upper = free.lower / equations.scale, free.upper / equations.scale
    start = free.values / equations.scale
    unit = equations.design.solver.unit / equations.unit
    x = draw_numbers(equations, free, count, random, unit)
    y = draw_places(equations, count, random, 1.0)
    near = random.random(count) < NEAR_SHARE
    x[near] = start * (1.0 + NEAR_SPREAD * random.normal(size=(int(near.sum()), len(start))))
    x = np.clip(x, lower, upper)
    least = np.where(is_positive(free), np.maximum(lower, 2.0 * LEAST_LENGTH), lower)
    x, y = _close(equations, x, y, least, upper)
    F, _ = equations.closure_at(x, y[:, None])
    good: BoolArray = np.asarray(np.abs(F).max(axis=(1, 2), initial=0.0) < CLOSED)
    good &= ((x >= lower - 1e-12) & (x <= upper + 1e-12)).all(axis=1)
    good &= (x[:, is_positive(free)] > LEAST_LENGTH).all(axis=1)
    return x[good], y[good]


def is_positive(free: FreeNumbers) -> BoolArray:
    """The numbers that are lengths of something, not coordinates: these are above zero."""
    return np.array(
        [
            kind == "length" and not name.endswith((".x", ".y"))
            for name, kind in zip(free.names, free.kinds, strict=True)
        ],
        dtype=bool,
    )


def draw_numbers(
    equations: WantedEquations, free: FreeNumbers, count: int, random: np.random.Generator, unit: float
) -> Array:
    """Random free numbers (designs, free), scaled, of designs of about the size `unit`."""
    lower, upper = free.lower / equations.scale, free.upper / equations.scale
    start = free.values / equations.scale
    found = np.empty((count, len(free.names)))
    for k, (positive, kind) in enumerate(zip(is_positive(free), free.kinds, strict=True)):
        if np.isfinite(lower[k]) and np.isfinite(upper[k]):
            found[:, k] = random.uniform(lower[k], upper[k], count)
        elif positive:
            found[:, k] = unit * np.exp(random.uniform(log(LENGTH_RANGE[0]), log(LENGTH_RANGE[1]), count))
        elif kind == "length":
            found[:, k] = start[k] * random.integers(0, 2, count) + unit * COORDINATE_RANGE * random.uniform(
                -1, 1, count
            )
        elif kind == "angle":
            found[:, k] = random.uniform(-pi, pi, count)
        else:
            found[:, k] = start[k] * np.exp(random.normal(0.0, 0.5, count))
    return found


def draw_places(equations: WantedEquations, count: int, random: np.random.Generator, unit: float) -> Array:
    """Random unknowns and inputs (designs, unknowns) of designs of about the size `unit`."""
    design = equations.design
    kinds = [design.equations.coordinates[k].kind for k in design.equations.unknowns]
    kinds.append(design.equations.input_kinds[0])
    found = np.empty((count, len(kinds)))
    for k, kind in enumerate(kinds):
        if kind is MeasureKind.LENGTH:
            found[:, k] = unit * random.uniform(-1.2, 1.2, count)
        else:
            found[:, k] = random.uniform(-pi, pi, count)
    return found


def _close(equations: WantedEquations, x: Array, y: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Numbers between bounds, and unknowns, that keep the equations: steps of least norm, and back to the bounds."""
    for _ in range(CLOSING_STEPS):
        F, F_y, F_x = (each[:, 0] for each in equations.closure_slopes_at(x, y[:, None]))
        if not F.shape[1]:
            break
        slopes = np.concatenate([F_x, MOBILITY_OF_PLACES * F_y], axis=2)
        square = slopes @ slopes.swapaxes(1, 2)
        square += 1e-13 * np.eye(square.shape[1])
        step = -(slopes.swapaxes(1, 2) @ np.linalg.solve(square, F[..., None]))[..., 0]
        step = np.nan_to_num(np.clip(step, -2.0, 2.0))
        x = np.clip(x + step[:, : x.shape[1]], lower, upper)
        y = y + MOBILITY_OF_PLACES * step[:, x.shape[1] :]
    return x, y
