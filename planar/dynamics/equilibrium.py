"""The linear equations of equilibrium at many positions, solved by dense inverses or by sparse factors.

Where the equations are regular they have one solution. Elsewhere singular values give the solution of least squares and
the forces that equilibrium leaves open. Whether equations are regular is judged by the same bound for both.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planar.equations.sparse_matrices import MAX_DENSE_UNKNOWNS, SparseMatrices, factorised
from planar.foundation.arrays import Array, BoolArray
from planar.solving.continuation.bordered_jacobian import norm_by_powers

if TYPE_CHECKING:
    from scipy.sparse.linalg import SuperLU

RANK_TOLERANCE = 1e-9
"""A singular value below this part of the greatest counts as zero: its force is carried by others, or by nothing."""
ESTIMATE_MARGIN = 1e-2
"""Of the condition number that makes equations singular: where an estimate is above this part, singular values
decide."""


class Equilibrium:
    """E f = b at n positions: E (n, links, forces), b what forces have to do on the coordinates of the links.

    `matrix` is a dense array, or sparse where unknowns are many.
    """

    def __init__(self, matrices: SparseMatrices):
        is_sparse = min(matrices.pattern.shape) > MAX_DENSE_UNKNOWNS
        self.matrix: Array | SparseMatrices = matrices if is_sparse else np.asarray(matrices)

    def solve(self, right_sides: Array) -> Array:
        """E^-1 b (n, forces, k), or those of least squares, for b (n, links, k)."""
        if not isinstance(self.matrix, SparseMatrices):
            return np.asarray(self.inverse @ right_sides)
        return self._solve_sparse(self.matrix, right_sides, is_transposed=False)

    def inverse_rows(self, rows: slice) -> Array:
        """Some rows of the inverse (n, rows, links): what these forces do against one on each coordinate."""
        if not isinstance(self.matrix, SparseMatrices):
            return self.inverse[:, rows]
        count, _, forces = self.matrix.shape
        units = np.eye(forces)[:, rows]
        solution = self._solve_sparse(self.matrix, np.broadcast_to(units, (count, *units.shape)), is_transposed=True)
        return solution.transpose(0, 2, 1)

    @property
    def inverse(self) -> Array:
        """E^-1 (n, forces, links), or what gives least squares."""
        if isinstance(self.matrix, SparseMatrices):
            count, links, _ = self.matrix.shape
            return self.solve(np.broadcast_to(np.eye(links), (count, links, links)))
        return self._inverse_and_null_space[0]

    @property
    def null_space(self) -> Array:
        """Forces that balance one another (n, forces, ways), which equilibrium leaves open."""
        if not isinstance(self.matrix, SparseMatrices):
            return self._inverse_and_null_space[1]
        spare = self._singular_inverse_and_null_space[1]
        found = np.zeros((len(self.matrix), self.matrix.shape[2], spare.shape[2]))
        found[self._is_singular] = spare
        return found

    @cached_property
    def _inverse_and_null_space(self) -> tuple[Array, Array]:
        """Both of a dense matrix."""
        matrix = np.asarray(self.matrix)
        count, links, forces = matrix.shape
        inverse, ways = np.zeros((count, forces, links)), np.zeros((count, forces, 0))
        weak = np.full(count, bool(matrix.size))
        if links == forces:
            # the norms show that no singular value is weak, in a tenth of the time that it takes to compute them
            regular = np.full(count, True)
            try:
                inverse = np.linalg.inv(matrix)
            except np.linalg.LinAlgError:  # some are singular
                regular = np.linalg.slogdet(matrix)[0] != 0.0
                inverse[regular] = np.linalg.inv(matrix[regular])
            sizes = [np.linalg.norm(each, axis=(1, 2)) for each in (matrix, inverse)]
            weak = ~regular | (sizes[0] * sizes[1] >= 1.0 / RANK_TOLERANCE)
        if weak.any():
            inverse[weak], spare = _pseudo_inverse(matrix[weak])
            ways = np.zeros((count, forces, spare.shape[2]))
            ways[weak] = spare
        return inverse, ways

    @cached_property
    def _factors(self) -> list[SuperLU | None]:
        """The factors of sparse matrices that are square; None where one is singular, or not all of it a number."""
        assert isinstance(self.matrix, SparseMatrices)
        pattern = self.matrix.pattern
        if pattern.shape[0] != pattern.shape[1]:
            return [None] * len(self.matrix)
        return [factorised(pattern.matrix(values), is_ordered=False) for values in self.matrix.values]

    @cached_property
    def _is_singular(self) -> BoolArray:
        """The positions at which a sparse matrix is singular, or may be (n,)."""
        assert isinstance(self.matrix, SparseMatrices)
        singular: BoolArray = np.array(np.isfinite(self.matrix.values).all(axis=1))
        for k, factors in enumerate(self._factors):
            if factors is not None:
                condition = self.matrix[k].greatest_singular_value_bound() * _norm_of_inverse(factors)
                singular[k] = not condition < ESTIMATE_MARGIN / RANK_TOLERANCE
        return singular

    @cached_property
    def _singular_inverse_and_null_space(self) -> tuple[Array, Array]:
        """Both of the sparse matrices that are singular, by their singular values."""
        links, forces = self.matrix.shape[1:]
        if not self._is_singular.any():
            return np.zeros((0, forces, links)), np.zeros((0, forces, 0))
        return _pseudo_inverse(np.asarray(self.matrix[self._is_singular]))

    def _solve_sparse(self, matrix: SparseMatrices, right_sides: Array, is_transposed: bool) -> Array:
        rows = matrix.shape[1 if is_transposed else 2]
        found = np.full((len(matrix), rows, right_sides.shape[2]), np.nan)
        singular = self._is_singular
        for k in np.flatnonzero(~singular):
            factors = self._factors[k]
            if factors is not None:
                found[k] = factors.solve(np.ascontiguousarray(right_sides[k]), trans="T" if is_transposed else "N")
        if singular.any():
            inverse = self._singular_inverse_and_null_space[0]
            found[singular] = (inverse.transpose(0, 2, 1) if is_transposed else inverse) @ right_sides[singular]
        return found


def _norm_of_inverse(factors: SuperLU) -> float:
    def squared(vector: Array) -> Array:
        found: Array = factors.solve(factors.solve(vector), trans="T")
        return found

    return norm_by_powers(squared, len(factors.perm_r))


def _pseudo_inverse(matrix: Array) -> tuple[Array, Array]:
    """What gives least squares (n, forces, links), and the null space (n, forces, ways), by singular values."""
    u, s, v = np.linalg.svd(matrix)
    strong = s > RANK_TOLERANCE * s[:, :1]
    few, back = s.shape[1], v.transpose(0, 2, 1)
    inverse = back[:, :, :few] * np.where(strong, 1.0 / np.where(strong, s, 1.0), 0.0)[:, None]
    spare = np.ones((len(matrix), back.shape[2]), dtype=bool)
    spare[:, :few] = ~strong
    return inverse @ u.transpose(0, 2, 1)[:, :few], (back * spare[:, None, :])[:, :, spare.any(axis=0)]
