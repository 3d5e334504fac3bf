"""What the pairs themselves show of instantaneous centres: points, normals, and ratios, from their own formulas."""

from __future__ import annotations

import numpy as np

from planar.analysis.centres.kennedy import ROUNDING, FoundCentre, LinkPair, PrimaryCentres, normalise
from planar.analysis.rate_equations import Rate, RateEquations, derivative, pair_gradients
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame
from planar.model.mechanism import relative_motions
from planar.model.pairs import Pair
from planar.results.motion import State
from planar.solving.checks import null_space

RANK_TOLERANCE = 1e-10
"""A singular value below this part of the greatest is none: slopes are exact to rounding."""


def primary_centres(equations: RateEquations, middle: Array, size: float) -> PrimaryCentres:
    """The centres that pairs show; lengths in the mechanism's `size` (m) about its `middle` (m), (2,)."""
    centres: dict[LinkPair, FoundCentre] = {}
    normals: dict[LinkPair, tuple[tuple[str, Array], ...]] = {}
    named = relative_motions(equations.state.mechanism)
    for pair in named.values():
        if len(pair.bodies) != 2:
            continue
        poles = allowed_poles(equations.state, pair, middle, size)
        two = frozenset(pair.links)
        if len(poles) == 1 and two not in centres:
            centres[two] = FoundCentre(normalise(poles[0]), ROUNDING, pair=pair.name)
        elif len(poles) == 2:
            normals[two] = (*normals.get(two, ()), (pair.name, normalise(np.cross(*poles))))
    ratios = []
    for tie in equations.equations:
        bodies = named[tie.pair].bodies
        if not tie.is_input and len(bodies) == 3 and all(rate.is_angular for rate in tie.coefficients):
            # wheels alike turn alike, whatever the link does that they are seen from
            ratios.append((tie.pair, {link: tie.coefficients.get(Rate(link), 0.0) for link in bodies}))
    return PrimaryCentres(centres, normals, tuple(ratios))


def allowed_poles(state: State, pair: Pair, middle: Array, size: float) -> Array:
    """The relative motions that a pair of two links allows, each as w times its pole (x, y, 1): (motions, 3).

    A translation is a pole at infinity, square to its way.
    """
    first, second = pair.bodies
    found = pair_gradients(state, pair)
    frame = state.frames[second]
    if frame.fixed:  # motion is relative: either may be moved
        frame, second = state.frames[first], first
    x, y = (np.array(_origin(frame)) - middle) / size
    along_x, along_y, turn = (found.bodies[second, which] for which in ("x", "y", "angle"))
    free = [column for index, column in enumerate(found.own) if index not in found.held]
    # turned about the middle, the origin moves square to its reach
    columns = [along_x, along_y, turn / size - y * along_x + x * along_y, *free]
    null = null_space(np.stack(columns, axis=1), RANK_TOLERANCE).T[:, :3]
    twists = _orthonormal_basis(null)
    return np.array([[-vy, vx, w] for vx, vy, w in twists]).reshape(-1, 3)


def _origin(frame: Frame) -> tuple[float, float]:
    return derivative(frame.x, 0), derivative(frame.y, 0)


def _orthonormal_basis(vectors: Array) -> Array:
    """An orthonormal basis of what vectors span."""
    if not len(vectors):
        return vectors
    _, values, rows = np.linalg.svd(vectors)
    return rows[: int((values > RANK_TOLERANCE).sum())]
