"""Equilibrium at one position by sparse factors, of full or of lower rank.

A matrix E of lower rank is bordered by the vectors that it does not reach and by those that it takes to zero,

    [E, U; V^T, 0] [f; g] = [b; 0],

so that f is the solution of least squares and of least length (W. Govaerts, Numerical Methods for Bifurcations of
Dynamical Equilibria, 2000, ch. 3).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planar.equations.sparse_matrices import NORM_SAFETY, SparseMatrices, factorised, norm_by_powers
from planar.foundation.arrays import Array

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

RANK_TOLERANCE = 1e-9
"""A singular value below this part of the greatest counts as zero: its force is carried by others, or by nothing."""
ESTIMATE_MARGIN = 1e-2
"""Of the condition number that makes equations singular: below this part an estimate of it is enough."""
BORDER_COUNTS = (1, 2, 4, 8, 16, 32)
"""Numbers of singular vectors that are tried, beside those that follow from the shape of the matrix."""
BORDER_STEPS = 4
"""Steps of the iteration for singular vectors; those of values that count as zero converge in two."""


class SparseSystem:
    """E f = b with factors of E, bordered by left and right null vectors; without any E itself is factored."""

    def __init__(self, factors: SuperLU, left: Array, right: Array):
        """`left` (links, k) and `right` (forces, l) are orthonormal."""
        self._factors, self._left, self.null_space = factors, left, right

    def solve(self, right_sides: Array) -> Array:
        """f (forces, ...) for b (links, ...), of least squares and least length."""
        return self._solve(right_sides, self.null_space, "N")

    def solve_transposed(self, right_sides: Array) -> Array:
        """The same (links, ...) of the transposed matrix, for (forces, ...)."""
        return self._solve(right_sides, self._left, "T")

    def _solve(self, right_sides: Array, vectors: Array, trans: str) -> Array:
        size, count = vectors.shape
        padded = np.concatenate([right_sides, np.zeros((count, *right_sides.shape[1:]))]) if count else right_sides
        found: Array = self._factors.solve(np.ascontiguousarray(padded), trans=trans)
        return found[:size]

    def inverse_norm(self) -> float:
        """The norm of what solves the equations, no less than it but for the last digits."""
        return norm_by_powers(lambda right: self.solve_transposed(self.solve(right)), len(self._left))


class DenseSystem:
    """E f = b by the singular values of a dense matrix."""

    def __init__(self, matrix: Array, rank_tolerance: float):
        """`matrix` (links, forces); where not all of it is a number nothing of the result is."""
        if np.isfinite(matrix).all():
            inverses, ways = pseudo_inverses(matrix[None], np.array([rank_tolerance]))
            self._inverse, self.null_space = inverses[0], ways[0]
        else:
            self._inverse, self.null_space = np.full(matrix.shape[::-1], np.nan), np.zeros((matrix.shape[1], 0))

    def solve(self, right_sides: Array) -> Array:
        """As `SparseSystem.solve`."""
        return np.asarray(self._inverse @ right_sides)

    def solve_transposed(self, right_sides: Array) -> Array:
        """As `SparseSystem.solve_transposed`."""
        return np.asarray(self._inverse.T @ right_sides)


def sparse_system(matrix: SparseMatrices, rank_tolerance: float) -> SparseSystem | DenseSystem:
    """The equations of one matrix (links, forces), by its factors where its rank can be told from these."""
    links, forces = matrix.shape
    if not np.isfinite(matrix.values).all():
        return DenseSystem(np.asarray(matrix), rank_tolerance)
    if links == forces:
        factors = factorised(matrix.single, is_ordered=False)
        if factors is not None:
            system = SparseSystem(factors, np.zeros((links, 0)), np.zeros((forces, 0)))
            if matrix.greatest_singular_value_bound() * system.inverse_norm() < ESTIMATE_MARGIN / rank_tolerance:
                return system
    products = matrix.single @ matrix.single.T
    greatest = norm_by_powers(lambda left: products @ left, links) / NORM_SAFETY
    for count in BORDER_COUNTS:
        if count > min(links, forces):
            break
        system_of_lower_rank = _bordered_system(matrix, greatest, count, rank_tolerance)
        if system_of_lower_rank is not None:
            return system_of_lower_rank
    return DenseSystem(np.asarray(matrix), rank_tolerance)


def _bordered_system(matrix: SparseMatrices, greatest: float, count: int, rank_tolerance: float) -> SparseSystem | None:
    """The equations bordered by all vectors of singular values that count as zero, fewer than `count` beside those that
    follow from the shape; None where there may be more."""
    links, forces = matrix.shape
    rng = np.random.default_rng(count)
    left = np.linalg.qr(rng.normal(size=(links, count + max(links - forces, 0))))[0]
    right = np.linalg.qr(rng.normal(size=(forces, count + max(forces - links, 0))))[0]
    for _ in range(BORDER_STEPS):
        factors = factorised(matrix.bordered_by_blocks(left, right.T), is_ordered=False)
        if factors is None:
            return None
        units = [
            np.vstack([np.zeros((size, each.shape[1])), np.eye(each.shape[1])])
            for size, each in ((links, right), (forces, left))
        ]
        moved = factors.solve(units[0])[:forces], factors.solve(units[1], trans="T")[:links]
        right, left = (np.linalg.qr(each)[0] for each in moved)
    turned, values, back = np.linalg.svd(left.T @ (matrix @ right))
    rank = int(np.sum(values > rank_tolerance * greatest))
    if not rank:
        return None
    left, right = left @ turned[:, rank:], right @ back[rank:].T
    factors = factorised(matrix.bordered_by_blocks(left, right.T), is_ordered=False)
    if factors is None:
        return None
    system = SparseSystem(factors, left, right)
    return system if system.inverse_norm() * greatest < 1.0 / rank_tolerance else None


def pseudo_inverses(matrices: Array, rank_tolerances: Array) -> tuple[Array, Array]:
    """What gives least squares (n, forces, links), and null spaces (n, forces, ways), by singular values; those below
    such parts (n,) of the greatest count as zero."""
    u, s, v = np.linalg.svd(matrices)
    strong = s > rank_tolerances[:, None] * s[:, :1]
    few, back = s.shape[1], v.transpose(0, 2, 1)
    inverse = back[:, :, :few] * np.where(strong, 1.0 / np.where(strong, s, 1.0), 0.0)[:, None]
    spare = np.ones((len(matrices), back.shape[2]), dtype=bool)
    spare[:, :few] = ~strong
    return inverse @ u.transpose(0, 2, 1)[:, :few], (back * spare[:, None, :])[:, :, spare.any(axis=0)]
