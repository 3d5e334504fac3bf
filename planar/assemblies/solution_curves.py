"""Curves of assemblies of one block: links that can move while the inputs are held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.foundation.angles import distances
from planar.foundation.arrays import Array, BoolArray
from planar.solving.continuation.predictor_corrector import next_point
from planar.solving.continuation.solution_curve import ImplicitCurve
from planar.solving.newton import ResidualFunction, damped_newton, one_system

SINGULAR_RATIO = 1e-5
"""Least singular value, of the greatest, below which a direction may be open."""
STEP_LENGTH = 0.05
"""How far along the direction that is open a curve of assemblies is looked for (rad, sizes)."""
MAX_CURVE_LENGTH = 20.0
"""How far a curve is followed each way (rad, sizes): eight links that turn right round together are shorter."""


def is_on_curve(residual_function: ResidualFunction, root: Array) -> bool:
    """Whether an assembly is one of a whole curve: along the direction that is open there are others like it."""
    slope = residual_function(root[None])[1][0]
    _, values, ways = np.linalg.svd(slope)
    if len(values) == slope.shape[1] and values[-1] > SINGULAR_RATIO * values[0]:
        return False
    beside = root + STEP_LENGTH * np.array([[1.0], [-1.0]]) * ways[-1]
    found = damped_newton(residual_function, beside)
    for each, closed in zip(found.unknowns, found.converged, strict=True):
        if closed and np.linalg.norm(each - root) > 0.3 * STEP_LENGTH:
            there = np.linalg.svd(residual_function(each[None])[1][0], compute_uv=False)
            if there[-1] < SINGULAR_RATIO * there[0]:
                return True
    return False


def one_per_curve(closing: ResidualFunction, roots: Sequence[Array], angles: BoolArray) -> list[Array]:
    """Of places on curves one for each curve, as far as following tells; `angles` (unknowns,) says which those are.

    Where two ways are open there is no one way to follow, and one place stands for all.
    """
    left, kept = list(roots), []
    while left:
        kept.append(left.pop(0))
        values = np.linalg.svd(closing(kept[-1][None])[1][0], compute_uv=False)
        if len(values) > 1 and values[-2] < SINGULAR_RATIO * values[0]:
            return kept
        curve = np.array(_follow_curve(closing, kept[-1], angles))
        left = [each for each in left if _distance(curve, each, angles).min() > STEP_LENGTH]
    return kept


def _follow_curve(closing: ResidualFunction, start: Array, angles: BoolArray) -> list[Array]:
    """Places along a curve no more than STEP_LENGTH from each other, right round or so far both ways."""
    curve = ImplicitCurve(one_system(closing))
    direction = np.linalg.svd(curve.jacobian(start))[2][-1]
    found = [start]
    for first in (direction, -direction):
        here, length = curve.point_at(start, first), 0.0
        while length < MAX_CURVE_LENGTH:
            after, step = next_point(curve, here, STEP_LENGTH)
            if after is None:
                break
            found.append(after.y)
            here, length = after, length + step
            if length > 2.0 * STEP_LENGTH and _distance(here.y[None], start, angles)[0] < STEP_LENGTH:
                return found
    return found


def _distance(curve: Array, point: Array, angles: BoolArray) -> Array:
    """How far the points of a curve (points, unknowns) are from another one."""
    return np.linalg.norm(distances(angles, curve, point), axis=1)
