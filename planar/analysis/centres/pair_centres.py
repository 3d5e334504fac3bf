"""What the pairs themselves show of instantaneous centres: points, normals, and ratios, from their own formulas."""

from __future__ import annotations

import numpy as np

from planar.analysis.centres.kennedy import ROUNDING, Found, Primary, Two, unit
from planar.analysis.rate_equations import Rate, Rates, gradients, part
from planar.foundation.geometry import Frame
from planar.model.mechanism import motions
from planar.model.pairs import Pair
from planar.results.motion import State

Array = np.ndarray
NONE = 1e-10
"""A singular value below this part of the greatest is none: slopes are exact to rounding."""


def primary(rates: Rates, middle: Array, size: float) -> Primary:
    """The centres that pairs show; lengths in the mechanism's `size` (m) about its `middle` (m), (2,)."""
    centres: dict[Two, Found] = {}
    normals: dict[Two, tuple[tuple[str, Array], ...]] = {}
    named = motions(rates.state.mechanism)
    for pair in named.values():
        if len(pair.bodies) != 2:
            continue
        poles = allowed(rates.state, pair, middle, size)
        two = frozenset(pair.links)
        if len(poles) == 1 and two not in centres:
            centres[two] = Found(unit(poles[0]), ROUNDING, pair=pair.name)
        elif len(poles) == 2:
            normals[two] = (*normals.get(two, ()), (pair.name, unit(np.cross(*poles))))
    ratios = []
    for tie in rates.ties:
        bodies = named[tie.pair].bodies
        if not tie.given and len(bodies) == 3 and all(rate.turns for rate in tie.slopes):
            # wheels alike turn alike, whatever the link does that they are seen from
            ratios.append((tie.pair, {link: tie.slopes.get(Rate(link), 0.0) for link in bodies}))
    return Primary(centres, normals, tuple(ratios))


def allowed(state: State, pair: Pair, middle: Array, size: float) -> Array:
    """The relative motions that a pair of two links allows, each as w times its pole (x, y, 1): (motions, 3).

    A translation is a pole at infinity, square to its way.
    """
    first, second = pair.bodies
    found = gradients(state, pair)
    frame = state.frames[second]
    if frame.fixed:  # motion is relative: either may be moved
        frame, second = state.frames[first], first
    x, y = (np.array(_origin(frame)) - middle) / size
    along_x, along_y, turn = (found.bodies[second, which] for which in ("x", "y", "angle"))
    free = [column for index, column in enumerate(found.own) if index not in found.held]
    # turned about the middle, the origin moves square to its reach
    columns = [along_x, along_y, turn / size - y * along_x + x * along_y, *free]
    null = _null(np.stack(columns, axis=1))[:, :3]
    twists = _span(null)
    return np.array([[-vy, vx, w] for vx, vy, w in twists]).reshape(-1, 3)


def _origin(frame: Frame) -> tuple[float, float]:
    return part(frame.x, 0), part(frame.y, 0)


def _null(matrix: Array) -> Array:
    _, values, rows = np.linalg.svd(matrix)
    rank = int((values > NONE * values.max(initial=0.0)).sum())
    return rows[rank:]


def _span(vectors: Array) -> Array:
    """An orthonormal basis of what vectors span."""
    if not len(vectors):
        return vectors
    _, values, rows = np.linalg.svd(vectors)
    return rows[: int((values > NONE).sum())]
