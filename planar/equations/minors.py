"""Minors of the Jacobian as further constraints: they vanish where its rank is low."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.elimination import stack_expressions
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions
from planar.equations.residuals import ConstraintRow
from planar.foundation.arrays import Array
from planar.model.pairs import MeasureKind


class LowRankBlock(NamedTuple):
    """A part of the slope of all constraints: its rows, its columns (of unknowns, then inputs), what each row and each
    column is divided by, and its rank."""

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    row_scales: Array
    column_scales: Array
    rank: int


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def constraint_dependencies(program: EquationFunctions) -> tuple[frozenset[int], ...]:
    """For every constraint the entries of (z, u) on which it depends."""
    e = program.equations
    columns: list[set[int]] = [set() for _ in e.rows]
    for row, column in zip(*ca.jacobian_sparsity(e.F, e.y).get_triplet(), strict=True):
        columns[row].add(column)
    return tuple(map(frozenset, columns))


def add_minors(program: EquationFunctions, blocks: Mapping[int, LowRankBlock]) -> EquationFunctions:
    """The functions whose blocks have the minors of their low-rank parts as constraints too."""
    e = program.equations
    slope = e.jacobian
    rows: list[ConstraintRow] = []
    left, stages = [], []
    for stage in e.blocks:
        first, own = len(rows), slice(stage.rows.start, stage.rows.stop)
        rows += e.rows[own]
        left.append(e.F[own])
        if stage.block_index in blocks:
            minors = list(_minors(slope, blocks[stage.block_index]))
            rows += [ConstraintRow(e.rows[stage.rows.start].pair, MeasureKind.PURE)] * len(minors)
            left += minors
        stages.append(stage._replace(rows=slice(first, len(rows))))
    expressions = e.expressions._replace(F=stack_expressions(left))
    return EquationFunctions(
        replace(e, rows=tuple(rows), blocks=tuple(stages), make_expressions=lambda: expressions, elimination=None)
    )


def _minors(slope: ca.SX, block: LowRankBlock) -> Iterator[ca.SX]:
    """As many minors, one larger than the rank, as tell where the Jacobian keeps it: of mixed rows and columns, so that
    none is special."""
    part = ca.densify(slope[list(block.rows), list(block.columns)]) / ca.DM(
        np.outer(block.row_scales, block.column_scales)
    )
    rng, size = np.random.default_rng(0), block.rank + 1
    across = [_orthonormal_rows(rng, size, part.size1()) for _ in range(part.size1() - block.rank)]
    along = [_orthonormal_rows(rng, size, part.size2()).T for _ in range(part.size2() - block.rank)]
    for rows in across:
        for columns in along:
            yield _determinant(ca.mtimes([ca.DM(rows), part, ca.DM(columns)]))


def _orthonormal_rows(rng: np.random.Generator, size: int, many: int) -> Array:
    """Orthonormal rows (size, many)."""
    return np.linalg.qr(rng.normal(size=(many, many)))[0][:size] if size < many else np.eye(many)


def _determinant(matrix: ca.SX) -> ca.SX:
    """A determinant without division, which would fail where it is to vanish (R. Bird, A simple division-free algorithm
    for computing determinants, Inf. Process. Lett. 111, 2011)."""
    size, part = matrix.size1(), matrix
    for _ in range(size - 1):
        upper = ca.triu(part, False)
        for k in range(size):
            upper[k, k] = -sum((part[j, j] for j in range(k + 1, size)), ca.SX(0.0))
        part = ca.mtimes(upper, matrix)
    return part[0, 0] if size % 2 else -part[0, 0]
