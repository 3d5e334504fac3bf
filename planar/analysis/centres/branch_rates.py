"""The branches of motion that cross in a change point, from the second order of all constraints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.analysis.centres.null_space_check import FullPosition, full_position, poles_of_motions
from planar.analysis.rate_equations import derivative
from planar.foundation.jets import Jet
from planar.results.motion import State

Array = np.ndarray
NEGLIGIBLE_RATIO = 1e-6
"""A part of the greatest below this is none: at a change point positions are exact to the root of rounding."""


def branch_poles(state: State, middle: Array, size: float) -> tuple[Mapping[str, Array], ...]:
    """The motions along each branch, of every link w times its pole (x, y, 1), in sizes about the middle.

    Of two ways v to move at first order those go on for which J a + H(v, v) = 0 has accelerations a: the left null
    vectors of J leave quadratic equations in the ratio of the two. None where these tell no simple crossing.
    """
    here = full_position(state)
    if here.motions.shape[1] != 2:
        return ()
    slope = here.constraints.jacobian(here.w)
    left, values, _ = np.linalg.svd(slope)
    rank = int((values > NEGLIGIBLE_RATIO * values.max(initial=1e-300)).sum())
    bent = [_second_derivative(here, here.motions @ way) for way in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))]
    first, second, both = (left[:, rank:].T @ each for each in bent)
    quadratics = np.stack([first, both - first - second, second], axis=1)
    _, sizes, rows = np.linalg.svd(np.vstack([quadratics, np.zeros((1, 3))]))
    if sizes[0] <= NEGLIGIBLE_RATIO or sizes[1] > NEGLIGIBLE_RATIO * sizes[0]:
        return ()
    a, b, c = rows[0]
    root = b * b - 4.0 * a * c
    if root <= NEGLIGIBLE_RATIO:
        return ()
    # the roots of a s^2 + b s t + c t^2, without cancelling
    q = -0.5 * (b + np.copysign(np.sqrt(root), b))
    ways = [np.array(way) / np.hypot(*way) for way in ((q, a), (c, q))]
    found = []
    for s, t in ways:
        moved = poles_of_motions(state, here, here.motions @ np.array([[s], [t]]), middle, size)
        most = max(float(np.linalg.norm(each)) for each in moved.values())
        found.append({link: each[0] / most for link, each in moved.items()})
    return tuple(found)


def _second_derivative(here: FullPosition, direction: Array) -> Array:
    """H(v, v): the second derivative of all constraints along a straight way in the coordinates (rows,)."""
    moving = [Jet(float(w), float(v), 0.0) for w, v in zip(here.w, direction, strict=True)]
    return np.array([derivative(value, 2) for _, value in here.constraints.row_residuals(moving)])
