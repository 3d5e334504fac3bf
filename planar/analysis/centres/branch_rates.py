"""The branches of motion that cross in a change point, from the second order of all constraints."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.analysis.centres.null_space_check import FullPosition, full_position, poles_of_motions
from planar.analysis.rate_equations import derivative
from planar.foundation.arrays import Array
from planar.foundation.jets import Jet
from planar.results.motion import State
from planar.solving.checks import SINGULAR_TOLERANCE, null_space
from planar.solving.continuation.bifurcation import branch_directions


def branch_poles(state: State, middle: Array, size: float) -> tuple[Mapping[str, Array], ...]:
    """The motions along each branch, of every link w times its pole (x, y, 1), in sizes about the middle.

    Of two ways v to move at first order those go on for which J a + H(v, v) = 0 has accelerations a: the left null
    vectors of J leave quadratic equations in the ratio of the two. None where these tell no simple crossing.
    """
    here = full_position(state)
    if here.motions.shape[1] != 2:
        return ()
    left_null = null_space(here.constraints.jacobian(here.w).T)
    bent = [_second_derivative(here, here.motions @ way) for way in ((1.0, 0.0), (0.0, 1.0), (1.0, 1.0))]
    first, second, both = (left_null.T @ each for each in bent)
    mixed = 0.5 * (both - first - second)
    forms = np.array([[first, mixed], [mixed, second]]).transpose(2, 0, 1)
    directions = branch_directions(forms, SINGULAR_TOLERANCE).vectors
    found = []
    for c in directions if len(directions) == 2 else ():
        moved = poles_of_motions(state, here, here.motions @ c[:, None], middle, size)
        most = max(float(np.linalg.norm(each)) for each in moved.values())
        found.append({link: each[0] / most for link, each in moved.items()})
    return tuple(found)


def _second_derivative(here: FullPosition, direction: Array) -> Array:
    """H(v, v): the second derivative of all constraints along a straight way in the coordinates (rows,)."""
    moving = [Jet(float(w), float(v), 0.0) for w, v in zip(here.w, direction, strict=True)]
    return np.array([derivative(value, 2) for _, value in here.constraints.row_residuals(moving)])
