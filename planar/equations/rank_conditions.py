"""Equations that hold where their Jacobian keeps a lower rank, beside the constraints themselves: minors vanish."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import product
from math import factorial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.equations.block_motion import DIFFERENCE_STEP
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions
from planar.equations.residuals import ConstraintRow
from planar.equations.sparse_matrices import SparseMatrices, SparsePattern
from planar.equations.structure_formulas import BlockCall, RoundingTerms, StructureFormulas
from planar.equations.symbolic_equations import Block, ConstraintEquations, ConstraintExpressions
from planar.foundation.arrays import Array
from planar.foundation.lazy_module import LazyModule
from planar.model.pairs import MeasureKind

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # few structures have such equations

CIRCLE_POINTS, CIRCLE_RADIUS = 32, 0.25
"""Of a circle in complex time: aliased powers of the series are below round-off with this many points."""
SMALLEST_CHANGE = 1e-12


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

    def of_jacobians(self, jacobians: Array) -> Array:
        """The part of Jacobians (..., rows, y)."""
        part: Array = jacobians[..., np.array(self.rows)[:, None], np.array(self.columns)]
        return part / np.multiply.outer(self.row_scales, self.column_scales)


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
    return EquationFunctions(conditioned, ConditionedEquations(functions.formulas, in_order, order))


def _conditioned_expressions(
    e: ConstraintEquations, parts: Sequence[LowRankBlock], order: Sequence[int]
) -> ConstraintExpressions:
    """F with the conditions, and w, as expressions, from which polynomials can be made."""
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


class ConditionedEquations(StructureFormulas):
    """The equations of one structure with conditions on the rank of parts of its Jacobian; `order` says which of the
    constraints, then conditions, every row is.

    By matrices of numbers: as formulas minors would grow with the fourth power of the rank, which is twenty and more
    where a part has the constraints of earlier blocks.
    """

    def __init__(self, base: StructureFormulas, parts: Sequence[LowRankBlock], order: list[int]):
        vars(self).update(vars(base))  # coordinates are the same
        self._base, self._parts, self._order = base, parts, order
        rows, columns = len(order), base.pattern.shape[1]
        first = rows * np.arange(columns + 1)
        self.pattern = SparsePattern((rows, columns), np.tile(np.arange(rows), columns), first)

    def _conditions(self, jacobians: Array) -> Array:
        """The conditions and their rates (orders, samples, conditions), from those of J (orders, samples, rows, y)."""
        minors = [
            determinant_rates(rows @ part.of_jacobians(jacobians) @ columns)
            for part in self._parts
            for rows, columns in part.minors
        ]
        return np.stack(minors, axis=-1)

    def _condition_rates(self, rates: Sequence[Array], p: Array) -> Array:
        """The conditions and their rates (orders, samples, conditions) from y and its rates, of (samples, y)."""
        jacobians = [self._base.jacobian_rate(rates[: order + 1], p) for order in range(len(rates))]
        return self._conditions(np.stack(jacobians))

    def residuals_and_jacobians(self, z: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """As `StructureFormulas.residuals_and_jacobians`."""
        residuals, base_entries = self._base.residuals_and_jacobians(z, u, p)
        jacobians = np.asarray(SparseMatrices(self._base.pattern, base_entries))
        y = np.hstack([z, np.broadcast_to(u, (len(z), u.shape[-1]))])
        samples, count = y.shape
        units = np.tile(np.eye(count), (samples, 1))
        changes = self._base.jacobian_changes(np.repeat(y, count, axis=0), units, p)
        values, slopes = self._conditions(np.stack([np.repeat(jacobians, count, axis=0), changes]))
        columns = np.concatenate([jacobians.swapaxes(1, 2), slopes.reshape(samples, count, -1)], axis=2)
        rows = np.hstack([residuals, values[::count]])
        return rows[:, self._order], columns[..., self._order].reshape(samples, -1)

    def kinematics(self, y: Array, y1: Array, y2: Array, p: Array) -> tuple[Array, Array, Array]:
        """As `StructureFormulas.kinematics`."""
        residuals, coordinates, _ = self._base.kinematics(y, y1, y2, p)
        conditions = self._condition_rates((y, y1, y2), p).swapaxes(0, 1)
        rows = np.concatenate([residuals, conditions], axis=2)[..., self._order]
        split = self._base.unknown_count
        return rows, coordinates, self.residuals_and_jacobians(y[:, :split], y[:, split:], p)[1]

    def third_residual_rates(self, rates: Sequence[Array], p: Array) -> Array:
        """As `StructureFormulas.third_residual_rates`."""
        conditions = self._condition_rates(rates, p)[3]
        return np.hstack([self._base.third_residual_rates(rates, p), conditions])[:, self._order]

    def jacobian_changes(self, y: Array, directions: Array, p: Array) -> Array:
        """As `StructureFormulas.jacobian_changes`, from second rates along sums and differences of directions."""
        units, count = np.eye(len(y)), len(directions)
        sums = (directions[:, None] + sign * units for sign in (1.0, -1.0))
        rates = np.concatenate([part.reshape(-1, len(y)) for part in sums])
        places = np.repeat(y[None], len(rates), axis=0)
        second = self.kinematics(places, rates, 0.0 * rates, p)[0][:, 2]
        ahead, behind = second.reshape(2, count, len(y), -1)
        return (0.25 * (ahead - behind)).swapaxes(1, 2)

    def rounding_terms(self, y: Array, y1: Array, y2: Array, p: Array) -> RoundingTerms:
        """As `StructureFormulas.rounding_terms`; conditions by differences, and their numbers count nothing."""
        terms = self._base.rounding_terms(y, y1, y2, p)
        rows = len(self._order) - sum(part.condition_count for part in self._parts)
        samples, count = y.shape
        steps = np.tile(np.concatenate([np.eye(count), -np.eye(count)]) * DIFFERENCE_STEP, (samples, 1))
        places, first, second = (np.repeat(rate, 2 * count, axis=0) for rate in (y, y1, y2))
        conditions = self._condition_rates((places + steps, first, second), p)
        ahead, behind = conditions.reshape(3, samples, 2, count, -1).transpose(2, 0, 1, 4, 3)
        slopes = (ahead - behind) / (2.0 * DIFFERENCE_STEP)

        def with_conditions(values: Array, of_conditions: Array) -> Array:
            constraints = np.concatenate([values[:, :rows], of_conditions], axis=1)[:, self._order]
            return np.concatenate([constraints, values[:, rows:]], axis=1)

        none = np.zeros((samples, slopes.shape[2]))
        return RoundingTerms(*map(with_conditions, terms, (none, none, *slopes)))

    def block_call(self, block: Block) -> BlockCall:
        """As `StructureFormulas.block_call`."""
        return _BlockOfConditioned(self, block)


class _BlockOfConditioned:
    """The residuals of a block (1, rows) and the columns of its Jacobian (unknowns, rows), called with z, u and p."""

    def __init__(self, equations: ConditionedEquations, block: Block):
        self._equations, self._block = equations, block

    def __call__(self, *arguments: Array) -> list[Array]:
        """At one position."""
        z, u, p = arguments
        return [values[0] for values in self.evaluate_batch(1, z[None], u[None], p)]

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """At many positions z (positions, unknowns), u alike."""
        z, u, p = arguments
        residuals, entries = self._equations.residuals_and_jacobians(z, np.broadcast_to(u, (count, u.shape[-1])), p)
        columns = entries.reshape(count, -1, residuals.shape[1])
        return [residuals[:, None, self._block.rows], columns[:, self._block.unknowns, self._block.rows]]


def determinant_rates(matrices: Array) -> Array:
    """Determinants and their rates (orders, samples), from matrices and their rates (orders, samples, n, n)."""
    orders = len(matrices)
    with np.errstate(invalid="ignore"):  # of what is no number
        return np.linalg.det(matrices) if orders == 1 else _determinant_series(matrices, orders)


def _determinant_series(matrices: Array, orders: int) -> Array:
    sizes = np.abs(matrices[1:]).max(axis=(2, 3), initial=0.0) ** (1.0 / np.arange(1, orders))[:, None]
    # the power series in time, by its values on a circle on which nothing changes by much
    radius = CIRCLE_RADIUS / np.maximum(sizes.max(axis=0, initial=0.0), SMALLEST_CHANGE)
    times = radius * np.exp(2j * np.pi * np.arange(CIRCLE_POINTS) / CIRCLE_POINTS)[:, None]
    moved = sum(
        (times**order / factorial(order))[..., None, None] * matrices[order].astype(complex) for order in range(orders)
    )
    series = np.fft.fft(np.linalg.det(moved), axis=0)[:orders].real / CIRCLE_POINTS
    rates: Array = series * np.array([factorial(order) / radius**order for order in range(orders)])
    rates[0] = np.linalg.det(matrices[0])
    return rates


def _orthonormal_rows(rng: np.random.Generator, size: int, count: int) -> Array:
    """Orthonormal rows (size, count)."""
    return np.linalg.qr(rng.normal(size=(count, count)))[0][:size] if size < count else np.eye(count)
