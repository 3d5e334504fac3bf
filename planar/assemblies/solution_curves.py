"""Curves of assemblies of one group: links that can move while the inputs are held."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.solving.newton import CLOSED, Closing, newton

Array = np.ndarray

OPEN = 1e-5
"""Least singular value, of the greatest, below which a direction may be open."""
ALONG = 0.05
"""How far along the direction that is open a curve of assemblies is looked for (rad, sizes)."""
LONGEST = 20.0
"""How far a curve is followed each way (rad, sizes): eight links that turn right round together are shorter."""


def goes_on(closing: Closing, root: Array) -> bool:
    """Whether an assembly is one of a whole curve: along the direction that is open there are others like it."""
    slope = closing(root[None])[1][0]
    _, values, ways = np.linalg.svd(slope)
    if len(values) == slope.shape[1] and values[-1] > OPEN * values[0]:
        return False
    beside = root + ALONG * np.array([[1.0], [-1.0]]) * ways[-1]
    found = newton(closing, beside)
    for each, closed in zip(found.unknowns, found.closed, strict=True):
        if closed and np.linalg.norm(each - root) > 0.3 * ALONG:
            there = np.linalg.svd(closing(each[None])[1][0], compute_uv=False)
            if there[-1] < OPEN * there[0]:
                return True
    return False


def one_of_each(closing: Closing, places: Sequence[Array], angles: Array) -> list[Array]:
    """Of places on curves one for each curve, as far as following tells; `angles` (unknowns,) says which those are.

    Where two ways are open there is no one way to follow, and one place stands for all.
    """
    left, kept = list(places), []
    while left:
        kept.append(left.pop(0))
        values = np.linalg.svd(closing(kept[-1][None])[1][0], compute_uv=False)
        if len(values) > 1 and values[-2] < OPEN * values[0]:
            return kept
        curve = np.array(_followed(closing, kept[-1], angles))
        left = [each for each in left if _apart(curve, each, angles).min() > ALONG]
    return kept


def _followed(closing: Closing, start: Array, angles: Array) -> list[Array]:
    """Places along a curve a step of ALONG from each other, right round or so far both ways."""
    way = np.linalg.svd(closing(start[None])[1][0])[2][-1]
    found = [start]
    for first in (way, -way):
        here, forward = start, first
        for count in range(round(LONGEST / ALONG)):
            ahead = _corrected(closing, here + ALONG * forward)
            if ahead is None or not 0.5 * ALONG < np.linalg.norm(ahead - here) < 1.5 * ALONG:
                break
            found.append(ahead)
            forward, here = (ahead - here) / np.linalg.norm(ahead - here), ahead
            if count > 1 and _apart(here[None], start, angles)[0] < ALONG:
                return found
    return found


def _corrected(closing: Closing, tried: Array) -> Array | None:
    """The place of a curve beside one that is tried."""
    for _ in range(8):
        left, slope = closing(tried[None])
        if np.abs(left).max() <= CLOSED:
            return tried
        tried = tried - np.linalg.pinv(slope[0], rcond=OPEN) @ left[0]
    return None


def _apart(curve: Array, place: Array, angles: Array) -> Array:
    """How far the places of a curve (places, unknowns) are from another one."""
    gaps = np.where(angles, np.abs(np.exp(1j * curve) - np.exp(1j * place)), np.abs(curve - place))
    return np.linalg.norm(gaps, axis=1)
