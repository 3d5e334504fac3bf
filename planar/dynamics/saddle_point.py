"""Sparse systems of a symmetric matrix A bordered by constraints J: [A, J^T; J, 0], with their factors."""

from __future__ import annotations

import numpy as np

from planar.equations.sparse_matrices import NORM_SAFETY, SparseMatrices, SparsePattern, factorised, norm_by_powers
from planar.foundation.arrays import Array, IntArray


class SaddlePattern:
    """Where the entries of [A, J^T; J, 0] stand, from those of A (n, n) and J (rows, n)."""

    def __init__(self, square: SparsePattern, constraints: SparsePattern):
        self.square, self.constraints = square, constraints
        count = square.shape[0]
        below = count + constraints.rows
        rows = np.concatenate([square.rows, below, constraints.columns])
        columns = np.concatenate([square.columns, constraints.columns, below])
        self._order: IntArray = np.lexsort((rows, columns))
        size = count + constraints.shape[0]
        first = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=size))])
        self._pattern = SparsePattern((size, size), rows[self._order], first)

    def matrix(self, square: Array, constraints: Array) -> SparseMatrices:
        """The matrix from the entries of A and J."""
        values = np.concatenate([square, constraints, constraints])
        return SparseMatrices(self._pattern, values[self._order])


class SaddleSystem:
    """One system [A, J^T; J, 0] with its factors. Raises ValueError where it is singular to the last bit."""

    def __init__(self, pattern: SaddlePattern, square: Array, constraints: Array):
        """`square` and `constraints` are the entries of A and J."""
        self._matrix = pattern.matrix(square, constraints)
        self._constraints = SparseMatrices(pattern.constraints, constraints)
        self._count = pattern.square.shape[0]
        factors = factorised(self._matrix.single, is_ordered=False)
        if factors is None:
            raise ValueError("singular")
        self._factors = factors

    def solve(self, upper: Array, lower: Array) -> tuple[Array, Array]:
        """x (n,) and multipliers (rows,) with A x + J^T multipliers = upper and J x = lower."""
        right_side = np.concatenate([upper, lower])
        found: Array = self._factors.solve(right_side)
        found += self._factors.solve(right_side - self._matrix @ found)
        return found[: self._count], found[self._count :]

    def shortest(self, residuals: Array) -> Array:
        """x (n,) of least length, measured by A, with J x = residuals (rows,)."""
        return self.solve(np.zeros(self._count), residuals)[0]

    def regularity(self) -> float:
        """The least singular value of J beside the greatest one, where A is the unit matrix."""
        rows = self._constraints.shape[0]
        if not rows:
            return 1.0
        zeros = np.zeros(self._count)
        inverse_norm = norm_by_powers(lambda right: -self.solve(zeros, right)[1], rows)
        greatest = norm_by_powers(lambda left: self._constraints @ (left @ self._constraints), rows)
        return NORM_SAFETY**2 / (inverse_norm * greatest)

    def greatest_compliance(self) -> float:
        """The greatest eigenvalue of N (N^T A N)^-1 N^T, where N spans the x with J x = 0."""
        zeros = np.zeros(self._constraints.shape[0])
        return norm_by_powers(lambda upper: self.solve(upper, zeros)[0], self._count) ** 2


def unit_pattern(count: int) -> SparsePattern:
    """The pattern of a diagonal matrix."""
    return SparsePattern((count, count), np.arange(count), np.arange(count + 1))
