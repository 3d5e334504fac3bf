"""The linear equations of equilibrium at many positions, solved by dense inverses or by sparse factors.

Where the equations are regular they have one solution. Elsewhere singular values give the solution of least squares and
the forces that equilibrium leaves open.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from planar.dynamics.sparse_equilibrium import (
    RANK_TOLERANCE,
    DenseSystem,
    SparseSystem,
    pseudo_inverses,
    sparse_system,
)
from planar.equations.sparse_matrices import MAX_DENSE_UNKNOWNS, SparseMatrices
from planar.foundation.arrays import Array
from planar.foundation.time_limit import all_within_time


class Equilibrium:
    """E f = b at n positions: E (n, links, forces), b what forces have to do on the coordinates of the links.

    `matrix` is a dense array, or sparse where unknowns are many.
    """

    def __init__(self, matrices: SparseMatrices, rank_tolerances: Array | None = None):
        """Of the greatest singular value, the part below which others count as zero (n,), by default one for all."""
        is_sparse = min(matrices.pattern.shape) > MAX_DENSE_UNKNOWNS
        self.matrix: Array | SparseMatrices = matrices if is_sparse else np.asarray(matrices)
        count = len(matrices.values)
        self._rank_tolerances = np.full(count, RANK_TOLERANCE) if rank_tolerances is None else rank_tolerances

    def solve(self, right_sides: Array) -> Array:
        """E^-1 b (n, forces, k), or those of least squares, for b (n, links, k)."""
        if not isinstance(self.matrix, SparseMatrices):
            return np.asarray(self.inverse @ right_sides)
        solutions: Array = np.empty((len(self.matrix), self.matrix.shape[2], right_sides.shape[2]))
        for solution, system, right_side in zip(solutions, self._systems, right_sides, strict=True):
            solution[:] = system.solve(right_side)
        return solutions

    def inverse_rows(self, rows: slice) -> Array:
        """Some rows of the inverse (n, rows, links): what these forces do against one on each coordinate."""
        if not isinstance(self.matrix, SparseMatrices):
            return self.inverse[:, rows]
        units = np.eye(self.matrix.shape[2])[:, rows]
        return np.array([system.solve_transposed(units).T for system in self._systems])

    @property
    def inverse(self) -> Array:
        """E^-1 (n, forces, links), or what gives least squares."""
        if isinstance(self.matrix, SparseMatrices):
            count, links, _ = self.matrix.shape
            return self.solve(np.broadcast_to(np.eye(links), (count, links, links)))
        return self._inverse_and_null_space[0]

    @cached_property
    def null_space(self) -> Array:
        """Forces that balance one another (n, forces, ways), which equilibrium leaves open."""
        if not isinstance(self.matrix, SparseMatrices):
            return self._inverse_and_null_space[1]
        spaces = [system.null_space for system in self._systems]
        ways: Array = np.zeros((len(spaces), self.matrix.shape[2], max((each.shape[1] for each in spaces), default=0)))
        for own_ways, space in zip(ways, spaces, strict=True):
            own_ways[:, : space.shape[1]] = space
        return ways

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
            weak = ~regular | (sizes[0] * sizes[1] >= 1.0 / self._rank_tolerances)
        if weak.any():
            inverse[weak], spare = pseudo_inverses(matrix[weak], self._rank_tolerances[weak])
            ways = np.zeros((count, forces, spare.shape[2]))
            ways[weak] = spare
        return inverse, ways

    @cached_property
    def _systems(self) -> list[SparseSystem | DenseSystem]:
        """The equations of every position, where the matrix is sparse."""
        assert isinstance(self.matrix, SparseMatrices)
        return [
            sparse_system(self.matrix[k], float(self._rank_tolerances[k]))
            for k in all_within_time(range(len(self.matrix)), "positions")
        ]
