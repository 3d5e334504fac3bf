"""Branches through a singular position: their directions by the conditions of second order, what follows by the third.

Constraints F = 0 with a Jacobian J that has null vectors N (n, k) and left ones L allow to second order the directions
v = N c with L^T F''(v, v) = 0: quadratic forms in c, one for each left null vector. Their second
derivatives w with J w + F''(v, v) = 0 allow to third order those with L^T (F'''(v, v, v) + 3 F''(v, w)) = 0, which is
linear in w. (A. Mueller, Higher-order analysis
of kinematic singularities of lower pair linkages and serial manipulators, J. Mech. Robotics 10, 2018.)
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray, append_number, greatest_size, length_of, stack_row
from planar.solving.checks.singular_values import SINGULAR_TOLERANCE
from planar.solving.newton import settle, shortest_step

EXACT_SINGULAR_TOLERANCE = 1e-10
"""At the position to round-off a singular value below this part of the greatest is zero."""
EXACT_FORM_TOLERANCE = 1e-10
"""There a quadratic form below this part of the greatest vanishes."""
SAME_DIRECTION_TOLERANCE = 1e-6
"""Directions that are nearer to one another are one."""
MAX_NULL_VECTORS = 6
"""Of k null vectors there are up to 2^(k - 1) directions: of more than so many they are not looked for."""
STARTS_PER_DIRECTION, MAX_DIRECTION_STEPS = 24, 40
"""Complex directions from which Newton's method starts, for each that there may be, and its steps."""
SETTLED_DIRECTION = 1e-9
"""Of its size: a complex direction that moves less has settled."""
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


class BranchDirections(NamedTuple):
    """Directions (k,) of length one, each with one of its two senses, and whether these are surely all."""

    found: list[Array]
    is_complete: bool


def branch_directions(forms: Array, tolerance: float = EXACT_FORM_TOLERANCE) -> BranchDirections:
    """The directions (k,) in which quadratic forms (forms, k, k) vanish.

    `tolerance` is how exactly the forms are known, as a part of the greatest. None where all vanish, or where two
    directions are one: branches that only touch are not parted by this order. Of two null vectors the directions are
    the roots of a polynomial. Of more Newton's method looks for all complex ones, of which there are 2^(k - 1) by
    Bezout's theorem if no two are one: the real ones among so many are all.
    """
    size = forms.shape[1]
    if size == 2:
        return BranchDirections(_roots_of_two(forms, tolerance), True)
    scale = greatest_size(forms)
    if size > MAX_NULL_VECTORS or len(forms) < size - 1 or scale < SINGULAR_TOLERANCE:
        return BranchDirections([], False)
    rng = np.random.default_rng(0)
    mixed = forms / scale
    if len(forms) > size - 1:
        mixed = np.tensordot(rng.normal(size=(size - 1, len(forms))), mixed, 1)
    every = _complex_directions(mixed, STARTS_PER_DIRECTION * 2 ** (size - 1), rng)
    real = [c.real for c in every if np.abs(c.imag).max() < SAME_DIRECTION_TOLERANCE]
    found = [way for c in real if (way := nearest_direction(forms, c, tolerance)) is not None]
    return BranchDirections(found, len(every) == 2 ** (size - 1))


def _complex_directions(forms: Array, start_count: int, rng: np.random.Generator) -> list[ComplexArray]:
    """The complex directions (k,) in which k - 1 forms vanish, to which Newton's method leads from random starts, with
    steps normal to where it is: of length one, the greatest entry positive."""
    size = forms.shape[1]
    c = rng.normal(size=(start_count, size)) + 1j * rng.normal(size=(start_count, size))
    change = np.full(start_count, np.inf)
    for _ in range(MAX_DIRECTION_STEPS):
        c /= np.linalg.norm(c, axis=1, keepdims=True)
        rows = np.einsum("fij,sj->sfi", forms, c)
        slopes = np.concatenate([2.0 * rows, c.conj()[:, None]], axis=1)
        open_ = np.append(np.einsum("sfi,si->sf", rows, c), np.zeros((len(c), 1)), axis=1)
        is_regular = np.abs(np.linalg.det(slopes)) > 0.0
        c, slopes, open_ = c[is_regular], slopes[is_regular], open_[is_regular]
        step = np.linalg.solve(slopes, open_[..., None])[..., 0]
        c, change = c - step, np.linalg.norm(step, axis=1)
    found: list[ComplexArray] = []
    for way in c[change < SETTLED_DIRECTION]:
        greatest = way[np.argmax(np.abs(way))]
        own = way * (abs(greatest) / greatest / np.linalg.norm(way))
        if all(1.0 - abs(np.vdot(own, other)) > SAME_DIRECTION_TOLERANCE for other in found):
            found.append(own)
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
