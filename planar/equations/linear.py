"""Small linear systems solved, as casadi expressions and for stacks of arrays.

Everywhere the matrix is a Jacobian of residuals in unknowns (..., rows, unknowns), and the right side is what these
have to make; a rate that cancels it is minus what is returned.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planar.equations.sparse_matrices import SparseMatrices
from planar.foundation.arrays import Array
from planar.foundation.lazy_module import LazyModule

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # known types of elements and blocks do without expressions

MAX_CRAMER_UNKNOWNS = 4
"""More unknowns are not solved by determinants."""
RANK_TOLERANCE = 1e-12
"""Singular values below this part of the greatest count as zero where there are more rows, or fewer, than unknowns."""


def solve_linear(matrix: ca.SX, right_side: ca.SX) -> ca.SX:
    """matrix^-1 right side (unknowns, 1); two by two by the adjugate, larger by QR, neither of which needs a pivot."""
    if matrix.numel() == 1:
        return right_side / matrix
    if matrix.numel() == 4:
        a, b, c, d = matrix[0, 0], matrix[0, 1], matrix[1, 0], matrix[1, 1]
        return ca.vertcat(d * right_side[0] - b * right_side[1], a * right_side[1] - c * right_side[0]) / (
            a * d - b * c
        )
    q, r = ca.qr(matrix)
    return ca.solve(r, ca.mtimes(q.T, right_side))


def solve_by_determinants(matrix: ca.SX, right_side: ca.SX) -> ca.SX:
    """matrix^-1 right side, as `solve_with_volume` has it."""
    return solve_with_volume(matrix, right_side)[0]


def solve_with_volume(matrix: ca.SX, right_side: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """matrix^-1 right side, the squared volume that the columns span, and the product of the squares of their lengths.

    Up to four unknowns by determinants (Cramer's rule), which leave nothing where the matrix has nothing; of more by
    QR, and then in place of the volume the least squared ratio of a column's part across those before it, beside one.
    """
    count = right_side.numel()
    if count == 1:
        return right_side / matrix, matrix * matrix, ca.SX(1.0)
    if count > MAX_CRAMER_UNKNOWNS:
        q, r = ca.qr(matrix)
        least = ca.SX(1.0)
        for k in range(count):
            least = ca.fmin(least, r[k, k] ** 2 / ca.sumsqr(matrix[:, k]))
        return ca.solve(r, ca.mtimes(q.T, right_side)), least, ca.SX(1.0)
    minors = _minors(ca.horzcat(matrix, right_side))
    determinant = minors[tuple(range(count))]
    scale = 1.0 / determinant
    # the right side in place of a column, moved there from the end
    solution = [
        minors[tuple(k for k in range(count + 1) if k != column)]
        * (1.0 if (count - 1 - column) % 2 == 0 else -1.0)
        * scale
        for column in range(count)
    ]
    lengths = ca.SX(1.0)
    for k in range(count):
        lengths = lengths * ca.sumsqr(matrix[:, k])
    return ca.vertcat(*solution), determinant * determinant, lengths


def solve_by_elimination(matrix: ca.SX, right_side: ca.SX, sample: Array) -> ca.SX:
    """matrix^-1 right side: up to four unknowns by determinants, of more by Gauss's elimination.

    Pivots stand where they are greatest in `sample`, the matrix at one place; so the expressions grow by what is there
    alone, but where one of these entries vanishes nothing is found.
    """
    count = right_side.numel()
    if count <= MAX_CRAMER_UNKNOWNS:
        return solve_by_determinants(matrix, right_side)
    rows = [[*(matrix[i, j] for j in range(count)), right_side[i]] for i in range(count)]
    numbers = np.array(sample, dtype=float)
    pivots: list[tuple[int, int]] = []
    open_rows, free = list(range(count)), list(range(count))
    while open_rows:
        i, j = max(((i, j) for i in open_rows for j in free), key=lambda place: abs(float(numbers[place])))
        pivots.append((i, j))
        open_rows.remove(i)
        free.remove(j)
        scale = 1.0 / rows[i][j]
        for other in open_rows:
            if not rows[other][j].is_zero():
                factor = rows[other][j] * scale
                rows[other] = [a if b.is_zero() else a - factor * b for a, b in zip(rows[other], rows[i], strict=True)]
                rows[other][j] = ca.SX(0.0)
                numbers[other] -= numbers[other, j] / numbers[i, j] * numbers[i]
    solution: dict[int, ca.SX] = {}
    for i, j in reversed(pivots):
        known = sum((rows[i][k] * value for k, value in solution.items() if not rows[i][k].is_zero()), ca.SX(0.0))
        solution[j] = (rows[i][-1] - known) / rows[i][j]
    return ca.vertcat(*(solution[k] for k in range(count)))


def _minors(matrix: ca.SX) -> dict[tuple[int, ...], ca.SX]:
    """The determinants of all rows with as many columns, by those of two rows at a time (Laplace)."""
    rows, columns = matrix.shape
    minors: dict[tuple[int, ...], ca.SX] = {(): ca.SX(1.0)}
    for first in range(0, rows, 2):
        pair = matrix[first : min(first + 2, rows), :]
        next_minors: dict[tuple[int, ...], ca.SX] = {}
        for chosen, value in minors.items():
            rest = [k for k in range(columns) if k not in chosen]
            for added, minor in _row_minors(pair, rest):
                sign = -1.0 if sum(a > b for a in chosen for b in added) % 2 else 1.0
                key = tuple(sorted((*chosen, *added)))
                next_minors[key] = next_minors.get(key, ca.SX(0.0)) + sign * value * minor
        minors = next_minors
    return minors


def _row_minors(rows: ca.SX, columns: Sequence[int]) -> list[tuple[tuple[int, ...], ca.SX]]:
    """The minors of one row, or of two, by their columns."""
    if rows.shape[0] == 1:
        return [((k,), rows[0, k]) for k in columns]
    return [
        ((i, j), rows[0, i] * rows[1, j] - rows[0, j] * rows[1, i])
        for n, i in enumerate(columns)
        for j in columns[n + 1 :]
    ]


def solve_arrays(
    matrices: Array | SparseMatrices,
    right_sides: Array,
    least_determinant: float = 0.0,
    least_squares: bool = False,
) -> Array:
    """matrices^-1 right sides (..., unknowns, k); matrices (..., rows, unknowns), right sides (..., rows, k).

    Not numbers where the determinant of a square matrix is not above `least_determinant`; with `least_squares` those
    of least squares where there are more than two unknowns. With more rows, or fewer, than unknowns always those.
    """
    if isinstance(matrices, SparseMatrices):
        has_blocks = len(matrices.pattern.blocks) > 1
        return _substitute_blocks(matrices, right_sides) if has_blocks else matrices.solve(right_sides)
    rows, unknowns = matrices.shape[-2:]
    if rows != unknowns:
        return _pseudo_inverses(matrices) @ right_sides
    if matrices.ndim > 2 and unknowns == 1:
        return _divide(right_sides, matrices, least_determinant)
    if matrices.ndim > 2 and unknowns == 2:
        a, b, c, d = (matrices[..., i, j, None] for i in (0, 1) for j in (0, 1))
        first, second = right_sides[..., 0, :], right_sides[..., 1, :]
        adjugate_times = np.stack([d * first - b * second, a * second - c * first], axis=-2)
        return _divide(adjugate_times, (a * d - b * c)[..., None, :], least_determinant)
    if not least_determinant:
        try:
            return np.linalg.solve(matrices, right_sides)
        except np.linalg.LinAlgError:
            pass
    known = np.all(np.isfinite(matrices), axis=(-2, -1))
    regular = np.array(known)
    regular[known] = np.abs(np.linalg.det(matrices[known])) > least_determinant
    right_sides = np.broadcast_to(right_sides, (*matrices.shape[:-1], right_sides.shape[-1]))
    solutions = np.full(right_sides.shape, np.nan)
    solutions[regular] = np.linalg.solve(matrices[regular], right_sides[regular])
    if least_squares:
        solutions[~regular] = np.linalg.pinv(np.nan_to_num(matrices[~regular])) @ right_sides[~regular]
    return solutions


def _substitute_blocks(matrices: SparseMatrices, right_sides: Array) -> Array:
    """The same of matrices that are triangular by blocks, one diagonal block of all after the other."""
    pattern = matrices.pattern
    right = np.broadcast_to(right_sides, (*matrices.shape[:-1], right_sides.shape[-1]))
    solutions: Array = np.zeros(right.shape)
    for (rows, columns), (entries, starts) in zip(pattern.blocks, pattern.earlier_entries, strict=True):
        rest = right[..., rows, :].copy()
        if len(entries):
            terms = matrices.values[..., entries, None] * solutions[..., pattern.columns[entries], :]
            rest[..., pattern.rows[entries[starts]] - rows.start, :] -= np.add.reduceat(terms, starts, axis=-2)
        solutions[..., columns, :] = solve_arrays(matrices[..., rows, columns], rest)
    return solutions


def solve_vectors(
    matrices: Array | SparseMatrices, vectors: Array, least_determinant: float = 0.0, least_squares: bool = False
) -> Array:
    """The same of one vector each: vectors (..., rows) to (..., unknowns)."""
    return solve_arrays(matrices, vectors[..., None], least_determinant, least_squares)[..., 0]


def inverse_arrays(matrices: Array | SparseMatrices) -> Array:
    """matrices^-1 (..., unknowns, rows), or what gives least squares; not numbers where one is singular."""
    return solve_arrays(matrices, np.eye(matrices.shape[-2]))


def _divide(values: Array, determinants: Array, least_determinant: float) -> Array:
    """Values over determinants, not numbers where these are too small."""
    if least_determinant or not np.all(determinants):
        determinants = np.where(np.abs(determinants) > least_determinant, determinants, np.nan)
    return values / determinants


def _pseudo_inverses(matrices: Array) -> Array:
    """What gives least squares (..., unknowns, rows); not numbers where a matrix is not all numbers."""
    known = np.all(np.isfinite(matrices), axis=(-2, -1))
    if np.all(known):
        return np.linalg.pinv(matrices, rcond=RANK_TOLERANCE)
    inverses = np.full((*matrices.shape[:-2], *matrices.shape[:-3:-1]), np.nan)
    inverses[known] = np.linalg.pinv(matrices[known], rcond=RANK_TOLERANCE)
    return inverses
