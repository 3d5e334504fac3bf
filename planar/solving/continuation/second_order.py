"""Branches through a singular position: their directions by the conditions of second order, what follows by the third.

Constraints F = 0 with a Jacobian J that has null vectors N (n, k) and left ones L allow to second order the directions
v = N c with L^T F''(v, v) = 0: quadratic forms in c, one for each left null vector. Their second
derivatives w with J w + F''(v, v) = 0 allow to third order those with L^T (F'''(v, v, v) + 3 F''(v, w)) = 0, which is
linear in w. (A. Mueller, Higher-order analysis
of kinematic singularities of lower pair linkages and serial manipulators, J. Mech. Robotics 10, 2018.)
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.foundation.arrays import Array, append_number, greatest_size, length_of, stack_row
from planar.solving.checks.singular_values import SINGULAR_TOLERANCE
from planar.solving.newton import settle, shortest_step

EXACT_SINGULAR_TOLERANCE = 1e-10
"""At the position to round-off a singular value below this part of the greatest is zero."""
EXACT_FORM_TOLERANCE = 1e-10
"""There a quadratic form below this part of the greatest vanishes."""
SAME_DIRECTION_TOLERANCE = 1e-6
"""Directions that are nearer to one another are one."""
STARTS_PER_NULL_VECTOR = 12
"""Directions for each null vector from which others are looked for."""
MAX_REFINEMENTS, CONVERGED_STEP = 12, 1e-13


def nearest_direction(forms: Array, c: Array, tolerance: float = EXACT_FORM_TOLERANCE) -> Array | None:
    """The direction (k,) of length one next to c in which all quadratic forms (forms, k, k) vanish."""
    scale = greatest_size(forms)
    if scale < SINGULAR_TOLERANCE:
        return None
    forms = forms / scale

    def of_length_one(c: Array) -> tuple[Array, Array]:
        rows = forms @ c
        return append_number(rows @ c, 0.5 * float(c @ c - 1.0)), stack_row(2.0 * rows, c)

    start = c / length_of(c)
    c, _ = settle(of_length_one, shortest_step(1e-10), start, MAX_REFINEMENTS, (len(c), CONVERGED_STEP))
    vanishes = greatest_size(forms @ c @ c) < tolerance
    return c if vanishes and abs(c @ c - 1.0) < SAME_DIRECTION_TOLERANCE else None


def branch_directions(forms: Array, tolerance: float = EXACT_FORM_TOLERANCE) -> list[Array]:
    """All directions (k,) of length one in which quadratic forms (forms, k, k) vanish, each with one of its two senses.

    `tolerance` is how exactly the forms are known, as a part of the greatest. None where all vanish, or where two
    directions are one: branches that only touch are not parted by this order. Of two null vectors the directions are
    the roots of a polynomial; of more, where Newton's method leads to from many starts.
    """
    size = forms.shape[1]
    if size == 2:
        return _roots_of_two(forms, tolerance)
    found: list[Array] = []
    for start in np.random.default_rng(0).normal(size=(STARTS_PER_NULL_VECTOR * size, size)):
        c = nearest_direction(forms, start, tolerance)
        if c is not None and not any(is_same_direction(c, other) for other in found):
            found.append(c)
    return found


def is_same_direction(c: Array, other: Array) -> bool:
    """Whether two directions of length one are one, whichever sense they have."""
    return min(length_of(c - other), length_of(c + other)) <= SAME_DIRECTION_TOLERANCE


def solve_third_order(condition: Callable[[Array], Array], count: int, tolerance: float = np.inf) -> Array | None:
    """The part e (count,) of a second derivative in the null space that meets a condition (forms,) linear in it.

    None where it leaves e open, or is not met within this part of one and of its size.
    """
    base = condition(np.zeros(count))
    jacobian = np.stack([condition(unit) - base for unit in np.eye(count)], axis=1)
    if np.linalg.svd(jacobian, compute_uv=False)[-1] < SINGULAR_TOLERANCE:
        return None
    e = np.linalg.lstsq(jacobian, -base, rcond=None)[0]
    return e if np.max(np.abs(base + jacobian @ e)) <= tolerance * (1.0 + np.max(np.abs(base))) else None


def _roots_of_two(forms: Array, tolerance: float) -> list[Array]:
    """The roots that quadratic forms in two unknowns have in common."""
    quadratics = np.stack([forms[:, 0, 0], forms[:, 0, 1] + forms[:, 1, 0], forms[:, 1, 1]], axis=1)
    _, sizes, rows = np.linalg.svd(np.vstack([quadratics, np.zeros((1, 3))]))
    if sizes[0] <= SINGULAR_TOLERANCE:
        return []
    a, b, c = rows[0]
    discriminant = b * b - 4.0 * a * c
    if discriminant <= tolerance:
        return []
    # the roots of a s^2 + b s t + c t^2, without cancelling
    q = -0.5 * (b + np.copysign(np.sqrt(discriminant), b))
    roots = [np.array(root) / np.hypot(*root) for root in ((q, a), (c, q))]
    return [
        root
        for root in roots
        if np.max(np.abs(quadratics @ (root[0] ** 2, root[0] * root[1], root[1] ** 2))) <= tolerance * sizes[0]
    ]
