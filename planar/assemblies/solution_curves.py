"""Curves of assemblies of one block: links that can move while the inputs are held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.solving.newton import CLOSED_TOLERANCE, ResidualFunction, correct, damped_newton, one_system, shortest_step

SINGULAR_RATIO = 1e-5
"""Least singular value, of the greatest, below which a direction may be open."""
STEP_LENGTH = 0.05
"""How far along the direction that is open a curve of assemblies is looked for (rad, sizes)."""
MAX_CORRECTIONS = 8
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
        left = [each for each in left if _distances(curve, each, angles).min() > STEP_LENGTH]
    return kept


def _follow_curve(closing: ResidualFunction, start: Array, angles: BoolArray) -> list[Array]:
    """Places along a curve a step of ALONG from each other, right round or so far both ways."""
    way = np.linalg.svd(closing(start[None])[1][0])[2][-1]
    found = [start]
    for first in (way, -way):
        here, forward = start, first
        for count in range(round(MAX_CURVE_LENGTH / STEP_LENGTH)):
            ahead = _correct(closing, here + STEP_LENGTH * forward)
            if ahead is None or not 0.5 * STEP_LENGTH < np.linalg.norm(ahead - here) < 1.5 * STEP_LENGTH:
                break
            found.append(ahead)
            forward, here = (ahead - here) / np.linalg.norm(ahead - here), ahead
            if count > 1 and _distances(here[None], start, angles)[0] < STEP_LENGTH:
                return found
    return found


def _correct(closing: ResidualFunction, tried: Array) -> Array | None:
    """The place of a curve beside one that is tried."""
    found, gap = correct(one_system(closing), shortest_step(SINGULAR_RATIO), tried, MAX_CORRECTIONS)
    return found if gap <= CLOSED_TOLERANCE else None


def _distances(curve: Array, place: Array, angles: BoolArray) -> Array:
    """How far the places of a curve (places, unknowns) are from another one."""
    gaps = np.where(angles, np.abs(np.exp(1j * curve) - np.exp(1j * place)), np.abs(curve - place))
    return np.linalg.norm(gaps, axis=1)
