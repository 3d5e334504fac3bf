"""The equations of one structure as recorded formulas of all elements one after the other.

What is derived of them, rates and derivatives along directions, is computed by carrying the same instructions out on
jets.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from itertools import chain
from typing import NamedTuple, Protocol

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.assembled_equations import AssembledEquations
from planar.equations.sparse_matrices import SparsePattern
from planar.equations.symbolic_equations import Block, ConstraintEquations, slice_length
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import Instruction
from planar.foundation.jets import Jet, Scalar, value_and_rates
from planar.foundation.recorded_formula import (
    RecordedFormula,
    formula_of_results,
    number_of,
    recorded_arguments,
)


class BlockCall(Protocol):
    """A function (z, u, p) of dense columns, as a block's F and the columns of its Jacobian, at one position or
    many."""

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results (columns, rows)."""

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results (positions, columns, rows); arguments (positions, entries), or (entries,) for all alike."""


def _record_elements(assembled: AssembledEquations, counts: Sequence[int]) -> tuple[RecordedFormula, RecordedFormula]:
    """The formulas (z, u, p) -> F (rows,), then the entries of dF/dy, and (z, u, p) -> w of elements."""
    instructions, (z, u, p) = recorded_arguments(counts)

    def formula_of(values: Iterable[Scalar]) -> RecordedFormula:
        return formula_of_results(instructions, [number_of(value, instructions) for value in values])

    residuals, entries = assembled.residuals_and_jacobians(z[None], u[None], p)
    coordinates = assembled.coordinates(z[None], u[None], p)
    return formula_of([*residuals[0], *entries[0]]), formula_of(coordinates[0])


def _record_expressions(e: ConstraintEquations) -> tuple[RecordedFormula, RecordedFormula]:
    """The same formulas of equations that no elements stand for: of least misfit, or with rank conditions."""
    import casadi as ca  # few structures have such equations

    from planar.equations.casadi_functions import recorded_function
    from planar.equations.elimination import stack_expressions

    entries = stack_expressions(e.jacobian.nz[k] for k in range(e.jacobian.nnz()))
    closing, coordinates = (
        recorded_function(ca.Function("formula", [e.z, e.u, e.p], [ca.densify(values)]))
        for values in (ca.vertcat(e.F, entries), e.w)
    )
    return closing, coordinates


class RoundingTerms(NamedTuple):
    """What carries round-off from numbers to F and w, one after the other (samples, rows and coordinates)."""

    value: Array
    term_sum: Array
    "the sum of the sizes of all numbers in them, each by its slope: a part of it is lost where all are rounded by it"
    jacobian: Array
    "by y = (z, u), (samples, rows and coordinates, y)"
    first_rate_jacobian: Array
    "the Jacobian of the first rates, alike"
    second_rate_jacobian: Array
    "the Jacobian of the second rates"


class StructureFormulas:
    """The equations of one structure as formulas; evaluated as by `AssembledEquations`."""

    def __init__(self, equations: ConstraintEquations):
        assembled, self._counts = equations.assembled, equations.argument_counts
        if assembled is not None:
            self.pattern = assembled.pattern
            self._closing, self._coordinates = _record_elements(assembled, self._counts)
        else:
            sparsity = equations.jacobian.sparsity()
            rows, first = np.array(sparsity.row(), dtype=int), np.array(sparsity.colind())
            self.pattern = SparsePattern(equations.jacobian.shape, rows, first)
            self._closing, self._coordinates = _record_expressions(equations)
        self._rows, self._coordinate_count = len(equations.rows), len(equations.coordinates)
        self._y_count = self.pattern.shape[1]
        self.unknown_count = self._counts[0]
        self._rate_functions: dict[tuple[str, int], FormulaFunction] = {}

    @cached_property
    def _residuals(self) -> RecordedFormula:
        return self._closing.part(slice(0, self._rows))

    @cached_property
    def _entries(self) -> RecordedFormula:
        """The entries of dF/dy."""
        return self._closing.part(slice(self._rows, None))

    @cached_property
    def _closing_function(self) -> FormulaFunction:
        return FormulaFunction(self._closing, self._counts, ((1, len(self._closing.results)),))

    @cached_property
    def coordinate_function(self) -> FormulaFunction:
        """(z, u, p) -> w (1, coordinates)."""
        return FormulaFunction(self._coordinates, self._counts, ((1, self._coordinate_count),))

    @cached_property
    def kinematics_function(self) -> FormulaFunction:
        """(y, y1, y2, p) -> F and w with their first and second rates (3, F and w), then the entries of dF/dy."""
        counts = *(3 * [self._y_count]), self._counts[-1]
        instructions, (y, y1, y2, p) = recorded_arguments(counts)
        of_rates = [*map(Jet, y, y1, y2), *p]
        both = *self._residuals.evaluate(of_rates), *self._coordinates.evaluate(of_rates)
        orders = zip(*map(value_and_rates, both), strict=True)
        entries = self._entries.evaluate([*y, *p])
        results = [number_of(value, instructions) for value in (*chain.from_iterable(orders), *entries)]
        return FormulaFunction(formula_of_results(instructions, results), counts, ((1, len(results)),))

    def coordinates(self, z: Array, u: Array, p: Array) -> Array:
        """w (samples, coordinates) at z (samples, unknowns), u and p (numbers,) or alike."""
        return self.coordinate_function.evaluate_entries(len(z), z.T, u.T, p.T).T

    def residuals_and_jacobians(self, z: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """F and the entries of dF/dy by the pattern at samples."""
        values = self._closing_function.evaluate_entries(len(z), z.T, u.T, p.T).T
        return values[:, : self._rows], values[:, self._rows :]

    def kinematics(self, y: Array, y1: Array, y2: Array, p: Array) -> tuple[Array, Array, Array]:
        """F (samples, 3, rows) and w (samples, 3, coordinates) with their first and second rates, and the entries of
        dF/dy."""
        values = self.kinematics_function.evaluate_entries(len(y), y.T, y1.T, y2.T, p.T).T
        split = 3 * (self._rows + self._coordinate_count)
        both = values[:, :split].reshape(len(y), 3, -1)
        return both[..., : self._rows], both[..., self._rows :], values[:, split:]

    def _rates(self, name: str, formula: RecordedFormula, rates: Sequence[Array], p: Array) -> Array:
        """The time derivatives (samples, results) of a formula's results, of the order of the last of the rates."""
        order = len(rates) - 1
        function = self._rate_functions.get((name, order))
        if function is None:
            counts = *([self._y_count] * (order + 1)), self._counts[-1]
            instructions, (*rates_of_y, numbers) = recorded_arguments(counts)
            jets = formula.evaluate([*map(Jet, *rates_of_y), *numbers])
            constant_part = 0.0 if order else 1.0
            parts = [jet.parts[order] if isinstance(jet, Jet) else constant_part * jet for jet in jets]
            results = [number_of(part, instructions) for part in parts]
            function = FormulaFunction(formula_of_results(instructions, results), counts, ((1, len(results)),))
            self._rate_functions[name, order] = function
        return function.evaluate_entries(len(rates[-1]), *(rate.T for rate in rates), p).T

    def third_residual_rates(self, rates: Sequence[Array], p: Array) -> Array:
        """The third time derivatives of F (samples, rows), from y and its first to third rates, of (samples, y)."""
        return self._rates("F", self._residuals, rates, p)

    def third_rate_remainder(self, y: Array, y1: Array, y2: Array, p: Array) -> Array:
        """The third time derivative of F (rows,), that of y left out."""
        return self.third_residual_rates((y[None], y1[None], y2[None], 0.0 * y[None]), p)[0]

    def third_coordinate_rates(self, rates: Sequence[Array], p: Array) -> Array:
        """The same of w (samples, coordinates)."""
        return self._rates("w", self._coordinates, rates, p)

    def jacobian_rate(self, rates: Sequence[Array], p: Array) -> Array:
        """The time derivative of dF/dy (samples, rows, y) of the order of the last rate, from y and its rates, of
        (samples, y), or y (y,) for all samples."""
        jacobian: Array = np.zeros((len(rates[-1]), *self.pattern.shape))
        jacobian[:, self.pattern.rows, self.pattern.columns] = self._rates("dF/dy", self._entries, rates, p)
        return jacobian

    def jacobian_changes(self, y: Array, directions: Array, p: Array) -> Array:
        """How dF/dy (rows, y) at y (y,), or places (k, y), changes along directions (k, y): (k, rows, y)."""
        return self.jacobian_rate((y, directions), p)

    def rounding_terms(self, y: Array, y1: Array, y2: Array, p: Array) -> RoundingTerms:
        """What carries round-off at samples y = (z, u) with first and second rates, each (samples, y)."""
        count, values = self._y_count, p.tolist()

        def both(arguments: Sequence[Scalar]) -> list[Scalar]:
            return [*self._residuals.evaluate(arguments), *self._coordinates.evaluate(arguments)]

        # in time, and of y by every entry of it
        units = np.eye(count)[:, None]
        of_y = [
            Jet(Jet(y[:, [k]], unit), Jet(y1[:, [k]], 0.0 * unit), Jet(y2[:, [k]], 0.0 * unit))
            for k, unit in enumerate(units)
        ]
        slopes: Array = np.zeros((3, len(y), self._rows + self._coordinate_count, count))
        value: Array = np.zeros(slopes.shape[1:3])
        for row, result in enumerate(both([*of_y, *values])):
            orders = result.parts if isinstance(result, Jet) else (result,)
            for order, part in enumerate(orders):
                if isinstance(part, Jet):
                    slopes[order, :, row] = part.parts[1]
            first = orders[0].parts[0] if isinstance(orders[0], Jet) else orders[0]
            value[:, row] = np.broadcast_to(first, (len(y), 1))[:, 0]
        of_p = [Jet(number, unit) for number, unit in zip(values, np.eye(len(p))[:, None], strict=True)]
        term_sum = np.abs(slopes[0]) @ np.abs(y)[..., None]
        for row, result in enumerate(both([*(y[:, [k]] for k in range(count)), *of_p])):
            if isinstance(result, Jet):
                term_sum[:, row] += np.abs(np.broadcast_to(result.parts[1], (len(y), len(p)))) @ np.abs(p)[:, None]
        return RoundingTerms(value, term_sum[..., 0], *slopes)

    def block_call(self, block: Block) -> BlockCall:
        """The residuals of a block and the columns of its Jacobian, as `block_function` has them."""
        return self.block_function(block)

    def block_function(self, block: Block) -> FormulaFunction:
        """(z, u, p) -> F of a block (1, rows), and the columns of its Jacobian in its unknowns (unknowns, rows)."""
        rows, unknowns = slice_length(block.rows), slice_length(block.unknowns)
        residuals = self._closing.results[block.rows]
        formula = self._with_dense_entries(self._closing, residuals, block.rows, block.unknowns)
        return FormulaFunction(formula, self._counts, ((1, rows), (unknowns, rows)))

    @property
    def dense_kinematics_function(self) -> FormulaFunction:
        """`kinematics_function` with all columns of dF/dy (y, rows) in place of its entries."""
        function, shape = self.kinematics_function, self.pattern.shape
        split = 3 * (self._rows + self._coordinate_count)
        results = function.formula.results[:split]
        formula = self._with_dense_entries(function.formula, results, slice(0, shape[0]), slice(0, shape[1]))
        return FormulaFunction(formula, function.argument_counts, ((3, split // 3), shape[::-1]))

    def _with_dense_entries(
        self, formula: RecordedFormula, results: Sequence[int], rows: slice, columns: slice
    ) -> RecordedFormula:
        """Some results of a formula whose last ones are the entries of dF/dy, and behind them columns of a part of it,
        every entry of them written."""
        dense = np.full((rows.stop - rows.start, columns.stop - columns.start), len(formula.instructions))
        entries, places = self.pattern.block_entries(rows, columns)
        first = len(formula.results) - len(self.pattern.rows)
        dense.reshape(-1)[places] = np.array(formula.results, dtype=int)[first + entries]
        with_zero = RecordedFormula(
            (*formula.instructions, Instruction("const")), (*results, *dense.T.ravel().tolist())
        )
        return with_zero.part(slice(None))
