"""The linear algebra of a curve of many unknowns: a sparse Jacobian J (n, n + 1) with one more row below it.

With the tangent t, J t = 0, one factorisation of the bordered matrix solves for steps in any plane, for the shortest
ones, and for products with the pseudo-inverse of J, columns of any size. (E. Allgower, K. Georg, Introduction to
Numerical Continuation Methods, 2003, ch. 4.)
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.equations.sparse_matrices import SparseMatrices, factorised
from planar.foundation.arrays import Array, append_number, greatest_size, length_of

BORDER_SIZE = 1e-4
"""The greatest entry of the row below: a pivot in it would fill the factors."""
POWER_STEPS, POWER_CHANGE = 40, 1e-2
"""Steps of the power method for a norm, and the part of it by which the last of them changes it."""
SUBSPACE_STEPS, MORE_VECTORS = 8, 4
"""Steps of the iteration of a subspace, and by how many vectors it is larger than what it is for."""
NORM_SAFETY = 1.1
"""A norm found so is too small by less than this factor."""


class BorderedJacobian:
    """J (n, n + 1) of rank n, bordered by a direction (n + 1,) that is not normal to its tangent."""

    def __init__(self, jacobian: SparseMatrices, border: Array):
        """Raises ValueError where the bordered matrix is singular."""
        border = border * (BORDER_SIZE / greatest_size(border))
        factors = factorised(jacobian.bordered(border))
        if factors is None:
            raise ValueError("singular")
        self.jacobian, self._factors, self.border = jacobian, factors, border
        ahead: Array = factors.solve(append_number(np.zeros(len(border) - 1), 1.0))
        self.tangent_ratio = length_of(ahead) * length_of(border)
        "how many times longer the tangent is than its part along the border"
        self.tangent = ahead / length_of(ahead)
        "of length one, less than a right angle from the border"

    def step(self, right_side: Array, normal: Array | None = None) -> Array:
        """x (n + 1, ...) with J x = right side (n, ...), normal to a direction, or to the border."""
        step: Array = self._factors.solve(np.concatenate([right_side, 0.0 * right_side[:1]]))
        if normal is not None:
            step = step - np.multiply.outer(self.tangent, (normal @ step) / (normal @ self.tangent))
        return step

    def pseudo_inverse(self, right_side: Array, sizes: Array) -> Array:
        """J_s^+ right side (n, ...), where J_s is J with columns divided by their sizes (n + 1,)."""
        step = self.step(right_side, sizes * sizes * self.tangent)
        return (sizes * step.T).T

    def transposed_pseudo_inverse(self, vector: Array, sizes: Array) -> Array:
        """(J_s^+)^T vector (n + 1, ...)."""
        ahead = sizes * self.tangent
        across = vector - np.multiply.outer(ahead, (ahead @ vector) / (ahead @ ahead))
        bordered_solution: Array = self._factors.solve(np.ascontiguousarray((sizes * across.T).T), trans="T")
        return bordered_solution[:-1]

    def least_singular_vectors(self, count: int) -> tuple[Array, Array, Array]:
        """The least singular values of J, the greater ones first (count,), with their vectors: those on the left as
        columns (n, count), those on the right as rows, below them the tangent (count + 1, n + 1).

        By iteration of a subspace that is somewhat larger: Golub and Van Loan, sec. 8.2.4.
        """
        rows, even = len(self.border) - 1, np.ones(len(self.border))
        vector_count = min(count + MORE_VECTORS, rows)
        basis = np.linalg.qr(np.random.default_rng(rows).normal(size=(rows, vector_count)))[0]
        for _ in range(SUBSPACE_STEPS):
            basis = np.linalg.qr(self.transposed_pseudo_inverse(self.pseudo_inverse(basis, even), even))[0]
        rotation, inverses, right = np.linalg.svd(self.pseudo_inverse(basis, even).T, full_matrices=False)
        order = slice(min(count, vector_count) - 1, None, -1) if count < vector_count else slice(None, None, -1)
        values = 1.0 / np.maximum(inverses, 1e-300)
        return (basis @ rotation)[:, order], values[order], np.vstack([right[order], self.tangent])

    def least_singular_value(self, sizes: Array) -> float:
        """The least singular value of J_s."""

        def squared(right_side: Array) -> Array:
            return self.transposed_pseudo_inverse(self.pseudo_inverse(right_side, sizes), sizes)

        return 1.0 / norm_by_powers(squared, len(self.border) - 1)

    def relative_change(self, change: SparseMatrices, sizes: Array) -> float:
        """The norm of J_s^+ E_s, where E_s is a change of J with columns divided by the same sizes."""
        scaled = change.divide_columns(sizes).single

        def squared(vector: Array) -> Array:
            image = self.pseudo_inverse(scaled @ vector, sizes)
            back: Array = scaled.T @ self.transposed_pseudo_inverse(image, sizes)
            return back

        return norm_by_powers(squared, len(self.border))


def closing_step(jacobian: SparseMatrices, residual: Array, left_null: Array, null: Array) -> Array:
    """x (n + 1,), normal to null vectors (n + 1, k + 1), that closes F in all directions but those left ones (n, k)."""
    factors = factorised(jacobian.bordered_by_blocks(left_null, null.T))
    n = null.shape[0]
    if factors is None:
        return np.full(n, np.nan)
    step: Array = factors.solve(np.concatenate([-residual, np.zeros(null.shape[1])]))[:n]
    return step


def norm_by_powers(squared: Callable[[Array], Array], size: int) -> float:
    """The norm of a matrix A, no less than it but for the last digits, from products with A^T A by the power method.

    G. Golub, C. Van Loan, Matrix Computations, 4th ed., 2013, sec. 8.2.
    """
    vector: Array = np.random.default_rng(size).normal(size=size)
    vector /= length_of(vector)
    value = 0.0
    for _ in range(POWER_STEPS):
        vector = squared(vector)
        before, value = value, length_of(vector)
        if not 0.0 < value < np.inf:
            break
        vector = vector / value
        if abs(value - before) <= POWER_CHANGE * value:
            break
    return NORM_SAFETY * float(np.sqrt(value))
