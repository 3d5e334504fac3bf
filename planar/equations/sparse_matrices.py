"""Sparse Jacobians: their columns, their factors, and bordered ones along a curve of many unknowns."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.foundation.arrays import Array, IntArray, append_number, greatest_size, length_of

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import SuperLU


MAX_DENSE_UNKNOWNS = 60
"""Square systems of more unknowns are kept by their entries and solved by a sparse factorisation."""
MIN_PIVOT_RATIO = 0.01
"""A pivot is taken from the diagonal where it is no less than this part of the greatest in its column."""


class SparsePattern:
    """Where entries stand, column after column: `rows` (entries,), and the `first` entry of every column, with the end
    of the last (columns + 1,)."""

    def __init__(
        self, shape: tuple[int, int], rows: IntArray, first: IntArray, blocks: Sequence[tuple[slice, slice]] = ()
    ):
        """`blocks` are the rows and columns of square diagonal blocks, if the matrix is triangular by them."""
        self.shape, self.rows, self.first, self.blocks = shape, rows, first, blocks
        self._blocks: dict[tuple[int, int, int, int], tuple[IntArray, IntArray]] = {}

    @cached_property
    def columns(self) -> IntArray:
        """The column of every entry."""
        return np.repeat(np.arange(self.shape[1]), np.diff(self.first))

    @cached_property
    def _zeros(self) -> csc_matrix:
        from scipy.sparse import csc_matrix  # few mechanisms are so large

        return csc_matrix((np.zeros(len(self.rows)), self.rows, self.first), shape=self.shape)

    def matrix(self, values: Array) -> csc_matrix:
        """The matrix of these entries as scipy has it."""
        matrix = copy(self._zeros)  # to check its indices takes ten times as long
        matrix.data = np.ascontiguousarray(values)
        return matrix

    @cached_property
    def bordered(self) -> SparsePattern:
        """The pattern with a full row below."""
        entries = np.arange(1, self.shape[1] + 1)
        rows = np.insert(self.rows, self.first[1:], self.shape[0])
        return SparsePattern((self.shape[0] + 1, self.shape[1]), rows, self.first + np.append(0, entries))

    def block_entries(self, rows: slice, columns: slice) -> tuple[IntArray, IntArray]:
        """The entries of a block, and their places in it, row after row."""
        key = rows.start, rows.stop, columns.start, columns.stop
        if key not in self._blocks:
            entries = np.arange(self.first[columns.start], self.first[columns.stop])
            entry_rows = self.rows[entries]
            entries = entries[(entry_rows >= rows.start) & (entry_rows < rows.stop)]
            width = columns.stop - columns.start
            places = (self.rows[entries] - rows.start) * width + self.columns[entries] - columns.start
            self._blocks[key] = entries, places
        return self._blocks[key]

    def first_columns(self, count: int, blocks: Sequence[tuple[slice, slice]] = ()) -> SparsePattern:
        """The pattern of the first `count` columns, triangular by some blocks."""
        return SparsePattern((self.shape[0], count), self.rows[: self.first[count]], self.first[: count + 1], blocks)

    @cached_property
    def earlier_entries(self) -> list[tuple[IntArray, IntArray]]:
        """For every block the entries in its rows before its own columns, row after row, and the first one of every
        row that has some."""
        order = np.argsort(self.rows, kind="stable")
        sorted_rows = self.rows[order]
        parts: list[tuple[IntArray, IntArray]] = []
        for rows, columns in self.blocks:
            entries = order[np.searchsorted(sorted_rows, rows.start) : np.searchsorted(sorted_rows, rows.stop)]
            entries = entries[self.columns[entries] < columns.start]
            parts.append((entries, np.flatnonzero(np.diff(self.rows[entries], prepend=-1))))
        return parts


class SparseMatrices:
    """Matrices (..., rows, columns) of one pattern by their `values` (..., entries).

    Blocks of rows and columns are arrays, and numpy's functions take the whole as one.
    """

    def __init__(self, pattern: SparsePattern, values: Array):
        self.pattern, self.values = pattern, values

    @property
    def shape(self) -> tuple[int, ...]:
        """As that of an array."""
        return (*self.values.shape[:-1], *self.pattern.shape)

    @property
    def size(self) -> int:
        """As that of an array: whether there is anything in it."""
        return int(np.prod(self.shape))

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any) -> Any:
        """Some of the matrices, or a block of rows and columns of all (..., rows, columns) as an array."""
        if isinstance(key, tuple) and len(key) > 1 and isinstance(key[-1], slice) and isinstance(key[-2], slice):
            both = zip(key[-2:], self.pattern.shape, strict=True)
            rows, columns = (slice(*part.indices(count)[:2]) for part, count in both)
            entries, places = self.pattern.block_entries(rows, columns)
            shape = rows.stop - rows.start, columns.stop - columns.start
            blocks = np.zeros((*self.values.shape[:-1], shape[0] * shape[1]))
            blocks[..., places] = self.values[..., entries]
            return blocks.reshape(*self.values.shape[:-1], *shape)
        return SparseMatrices(self.pattern, self.values[key])

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> Array:
        dense = np.zeros(self.shape)
        dense[..., self.pattern.rows, self.pattern.columns] = self.values
        return dense

    def __matmul__(self, other: Array) -> Array:
        if self.values.ndim == 1:
            product: Array = self.single @ other
            return product
        if other.ndim == 1:
            return np.asarray((self @ other[:, None])[..., 0])
        stack = self.values.shape[:-1]
        factors = np.broadcast_to(other, (*stack, *other.shape[-2:]))
        products: Array = np.empty((*stack, self.pattern.shape[0], other.shape[-1]))
        for place in np.ndindex(stack):
            products[place] = self[place].single @ factors[place]
        return products

    __array_ufunc__ = None  # an array times it is its own product

    def __rmatmul__(self, other: Array) -> Array:
        """A row (rows,), or rows (k, rows), times one matrix."""
        product: Array = (self.single.T @ np.asarray(other).T).T
        return product

    @cached_property
    def single(self) -> csc_matrix:
        """One matrix (rows, columns) as scipy has it."""
        return self.pattern.matrix(self.values)

    def bordered(self, row: Array) -> csc_matrix:
        """The same with a row (columns,) below it."""
        return self.pattern.bordered.matrix(np.insert(self.values, self.pattern.first[1:], row))

    def bordered_by_blocks(self, right: Array, below: Array) -> csc_matrix:
        """One matrix with columns (rows, k) on its right, rows (k, columns) below it, and zeros in the corner."""
        from scipy.sparse import bmat, csc_matrix  # few mechanisms are so large

        return bmat([[self.single, csc_matrix(right)], [csc_matrix(below), None]], format="csc")

    def column_norms(self, least: float) -> Array:
        """The sizes of the columns (..., columns), `least` at least."""
        squares = np.zeros((*self.values.shape[:-1], self.pattern.shape[1]))
        filled = np.flatnonzero(np.diff(self.pattern.first))
        squares[..., filled] = np.add.reduceat(self.values**2, self.pattern.first[filled], axis=-1)
        return np.maximum(np.sqrt(squares), least)

    def greatest_singular_value_bound(self) -> float:
        """A number that no singular value of one matrix exceeds: the root of its greatest sums of columns and rows."""
        sizes = np.abs(self.values)
        sums = (np.bincount(indices, sizes).max(initial=0.0) for indices in (self.pattern.columns, self.pattern.rows))
        return float(np.sqrt(np.prod([*sums])))

    def divide_columns(self, sizes: Array) -> SparseMatrices:
        """Every column (..., columns) divided by its size."""
        return SparseMatrices(self.pattern, self.values / sizes[..., self.pattern.columns])

    def join_last_columns(self, weights: Array) -> SparseMatrices:
        """One matrix whose last columns are one, the sum of each times its weight (columns,)."""
        if len(weights) == 1:
            last, values = self.pattern.first[-2], self.values.copy()
            values[last:] *= weights[0]
            return SparseMatrices(self.pattern, values)
        from scipy.sparse import csc_matrix, hstack  # few mechanisms are so large

        first = self.pattern.shape[1] - len(weights)
        joined = self.single[:, first:] @ csc_matrix(weights[:, None])
        narrow = hstack([self.single[:, :first], joined], format="csc")
        return SparseMatrices(SparsePattern(narrow.shape, narrow.indices, narrow.indptr), narrow.data)

    def solve(self, right_sides: Array) -> Array:
        """matrices^-1 right sides (..., unknowns, k), each by a factorisation of its own; not numbers where one is
        singular."""
        matrices = self.values.reshape(-1, self.values.shape[-1])
        right = np.broadcast_to(right_sides, (*self.values.shape[:-1], *right_sides.shape[-2:]))
        solutions = np.full((len(matrices), *right.shape[-2:]), np.nan)
        for out, values, right_side in zip(solutions, matrices, right.reshape(solutions.shape), strict=True):
            factors = factorised(self.pattern.matrix(values))
            if factors is not None:
                out[:] = factors.solve(np.ascontiguousarray(right_side))
        return solutions.reshape(right.shape)


def factorised(matrix: csc_matrix, is_ordered: bool = True) -> SuperLU | None:
    """The factors of a square matrix; None where it is singular to the last bit, or not all of it a number.

    `is_ordered`: whether rows and columns that belong together stand at the same places.
    """
    from scipy.sparse.linalg import splu  # few mechanisms are so large

    if not np.isfinite(matrix.data).all():
        return None
    try:
        if not is_ordered:
            return splu(matrix)
        # groups of links stand one below the other: that pivots stay among their own rows keeps the factors as sparse
        return splu(matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=MIN_PIVOT_RATIO)
    except RuntimeError:
        return None


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
