"""Equations that hold where their Jacobian keeps a lower rank, beside the constraints themselves: minors vanish."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions
from planar.equations.residuals import ConstraintRow
from planar.equations.symbolic_equations import Block, ConstraintEquations, ConstraintExpressions
from planar.foundation.arrays import Array
from planar.foundation.lazy_module import LazyModule
from planar.model.pairs import MeasureKind

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # few structures have such equations


class LowRankBlock(NamedTuple):
    """A part of the Jacobian of all constraints: its rows, its columns (of unknowns, then inputs), what rows and
    columns are divided by, and its rank."""

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    row_scales: Array
    column_scales: Array
    rank: int

    @property
    def condition_count(self) -> int:
        """How many conditions tell where the rank is kept."""
        return (len(self.rows) - self.rank) * (len(self.columns) - self.rank)

    @property
    def minors(self) -> list[tuple[Array, Array]]:
        """What mixes rows (rank + 1, rows) and columns (columns, rank + 1) for each condition, a minor: of mixed ones
        none is special."""
        rng, size = np.random.default_rng(0), self.rank + 1
        rows, columns = len(self.rows), len(self.columns)
        across = [_orthonormal_rows(rng, size, rows) for _ in range(rows - self.rank)]
        along = [_orthonormal_rows(rng, size, columns).T for _ in range(columns - self.rank)]
        return list(product(across, along))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def constraint_dependencies(functions: EquationFunctions) -> tuple[frozenset[int], ...]:
    """For every constraint the entries of (z, u) on which it depends."""
    e = functions.equations
    pattern = functions.pattern
    # what cancels stands in the pattern: no block depends on a later one
    last = np.full(pattern.shape[0], 0)
    for block in e.blocks:
        last[block.rows] = block.unknowns.stop
    columns: list[set[int]] = [set() for _ in e.rows]
    for row, column in zip(pattern.rows.tolist(), pattern.columns.tolist(), strict=True):
        if column < last[row] or column >= len(e.unknowns):
            columns[row].add(column)
    return tuple(map(frozenset, columns))


def with_rank_conditions(functions: EquationFunctions, parts: Mapping[int, LowRankBlock]) -> EquationFunctions:
    """The functions whose blocks have the conditions on their low-rank parts as constraints too."""
    e = functions.equations
    rows: list[ConstraintRow] = []
    order: list[int] = []
    blocks: list[Block] = []
    condition_count = 0
    for block in e.blocks:
        first = len(rows)
        rows += e.rows[block.rows]
        order += range(block.rows.start, block.rows.stop)
        part = parts.get(block.block_index)
        if part is not None:
            rows += [ConstraintRow(e.rows[block.rows.start].pair, MeasureKind.PURE)] * part.condition_count
            order += range(len(e.rows) + condition_count, len(e.rows) + condition_count + part.condition_count)
            condition_count += part.condition_count
        blocks.append(block._replace(rows=slice(first, len(rows))))
    in_order = [parts[block.block_index] for block in e.blocks if block.block_index in parts]
    conditioned = replace(
        e,
        rows=tuple(rows),
        blocks=tuple(blocks),
        make_expressions=lambda: _conditioned_expressions(e, in_order, order),
        elimination=None,
    )
    return EquationFunctions(conditioned)


def _conditioned_expressions(
    e: ConstraintEquations, parts: Sequence[LowRankBlock], order: Sequence[int]
) -> ConstraintExpressions:
    """F with the conditions, and w, as expressions; `order` says which of F, then conditions, every row is."""
    F = [e.F]
    for part in parts:
        scales = np.multiply.outer(part.row_scales, part.column_scales)
        matrix = ca.densify(e.jacobian[list(part.rows), list(part.columns)]) / ca.DM(scales)
        F += [symbolic_determinant(ca.mtimes([ca.DM(rows), matrix, ca.DM(columns)])) for rows, columns in part.minors]
    return e.expressions._replace(F=ca.vertcat(*F)[list(order)])


def symbolic_determinant(matrix: ca.SX) -> ca.SX:
    """A determinant without division, which would fail where it is to vanish (R. Bird, A simple division-free algorithm
    for computing determinants, Inf. Process. Lett. 111, 2011)."""
    size, part = matrix.size1(), matrix
    for _ in range(size - 1):
        upper = ca.triu(part, False)
        for k in range(size):
            upper[k, k] = -sum((part[j, j] for j in range(k + 1, size)), ca.SX(0.0))
        part = ca.mtimes(upper, matrix)
    return part[0, 0] if size % 2 else -part[0, 0]


def _orthonormal_rows(rng: np.random.Generator, size: int, count: int) -> Array:
    """Orthonormal rows (size, count)."""
    return np.linalg.qr(rng.normal(size=(count, count)))[0][:size] if size < count else np.eye(count)
