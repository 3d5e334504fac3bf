"""A structure's equations as functions of arrays z, u and p: residuals, Jacobians, rates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.assembled_equations import AssembledEquations
from planar.equations.block_type_functions import BlockTypeFunctions, block_type_functions
from planar.equations.block_types import PlacedBlock, place_blocks
from planar.equations.linear import solve_vectors
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.placed_blocks import BlockCall, ClosedFormAssemblies, KnownCoordinates, PlacedBlockCall
from planar.equations.sparse_matrices import MAX_DENSE_UNKNOWNS, SparseMatrices, SparsePattern
from planar.equations.structure_formulas import RoundingTerms, StructureFormulas
from planar.equations.symbolic_equations import (
    Block,
    ConstraintEquations,
    build_equations,
    slice_length,
)
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism

MAX_CACHED_STRUCTURES = 256
"""Mechanisms of which what was recorded is kept: more than come along, so that none is recorded twice in a round."""
MAX_ELEMENT_EVALUATIONS = 16.0
"""Evaluations by elements that take about as long as it takes to record the formulas of a structure."""
SAMPLES_PER_EVALUATION = 64.0
"""Samples that take as long as one evaluation takes whatever their number."""
RUN_NEWTON_STEPS = 4
"""Steps of a position within a run: from a start a degree or so away, four square the error away."""


class EquationRates(NamedTuple):
    """F and w with their first and second time derivatives, and dF/dz, dF/du: see `EquationFunctions.kinematics`.

    Each with a first axis for the samples, if there is one.
    """

    F: Array
    F1: Array
    F2: Array
    w: Array
    w1: Array
    w2: Array
    jacobian: Array | SparseMatrices
    "(rows, unknowns), by its entries where unknowns are many"
    input_jacobian: Array
    "(rows, inputs)"


class EquationFunctions:
    """The equations of one structure as functions of arrays.

    They are evaluated by elements and block types, which are derived once for all structures. Of a structure that is
    evaluated several times the formulas of all elements are made one, unless its unknowns are many.
    """

    def __init__(self, equations: ConstraintEquations, formulas: StructureFormulas | None = None):
        """`formulas` are those of equations that are not assembled from elements."""
        self.equations = equations
        if formulas is not None:
            self.formulas = formulas
        self._unknown_count = len(equations.unknowns)
        is_large = self._unknown_count > MAX_DENSE_UNKNOWNS and equations.elimination is not None
        self.is_sparse = is_large and equations.is_square
        "whether Jacobians are by their entries"
        self._evaluation_count = 0.0
        self._block_calls: dict[int, BlockCall] = {}
        self._block_assemblies: dict[int, ClosedFormAssemblies | None] = {}

    @cached_property
    def formulas(self) -> StructureFormulas:
        """The equations as formulas."""
        return StructureFormulas(self.equations)

    def _evaluator(self, samples: int = 1) -> AssembledEquations | StructureFormulas:
        """What evaluates the equations at samples."""
        self._evaluation_count += 1.0 + samples / SAMPLES_PER_EVALUATION
        are_formulas_worth_it = self._evaluation_count > MAX_ELEMENT_EVALUATIONS and not self.is_sparse
        elements = None if are_formulas_worth_it else self.equations.assembled
        return self.formulas if elements is None else elements

    @property
    def pattern(self) -> SparsePattern:
        """Where the entries of dF/dy stand."""
        assembled = self.equations.assembled
        return self.formulas.pattern if assembled is None else assembled.pattern

    def block_call(self, block: Block) -> BlockCall:
        """(z, u, p) -> F of this block (1, rows) and its Jacobian's columns in its own unknowns (unknowns, rows)."""
        if block.block_index not in self._block_calls:
            by_type = self._functions_of_type(block)
            self._block_calls[block.block_index] = (
                self.formulas.block_call(block)
                if by_type is None
                else PlacedBlockCall(by_type.closing, self._known_coordinates.arguments_of(block))
            )
        return self._block_calls[block.block_index]

    def _functions_of_type(self, block: Block) -> BlockTypeFunctions | None:
        """The functions of a block's type; None for one that has none."""
        placed = self.placed_blocks[block.block_index]
        return None if placed is None else block_type_functions(placed.key)

    @cached_property
    def placed_blocks(self) -> tuple[PlacedBlock | None, ...]:
        """The types of all blocks; None for one that has none."""
        return place_blocks(self.equations)

    @cached_property
    def _known_coordinates(self) -> KnownCoordinates:
        """Where blocks stand that are called by their types."""
        types = map(self._functions_of_type, self.equations.blocks)
        calls = [None if functions is None else functions.coordinates for functions in types]
        assert self.equations.assembled is not None
        return KnownCoordinates(self.equations, self.equations.assembled, self.placed_blocks, calls)

    def block_assemblies(self, block: Block) -> ClosedFormAssemblies | None:
        """Both assemblies of a block; None for one without a closed form."""
        if block.block_index not in self._block_assemblies:
            self._block_assemblies[block.block_index] = self._make_assemblies(block)
        return self._block_assemblies[block.block_index]

    def _make_assemblies(self, block: Block) -> ClosedFormAssemblies | None:
        by_type = self._functions_of_type(block)
        if by_type is not None:
            form = by_type.assemblies
            return form and form.placed(self._known_coordinates.arguments_of(block))
        from planar.equations.closed_form import closed_form_formula  # nearly all blocks have a type

        e = self.equations
        formula, has_changing_arm = closed_form_formula(e, block)
        if formula is None:
            return None
        shapes = (1, slice_length(block.unknowns)), (1, 1)
        function = FormulaFunction(formula, (*e.argument_counts, 1), shapes)
        return ClosedFormAssemblies(block.unknowns, function, self.block_call(block), has_changing_arm)

    def coordinates_ahead(self, block_index: int, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at z (unknowns,), as far as known ahead of a block; the rest of it may hold anything."""
        if self.equations.elimination is None:
            return self.coordinates(z, u, p)
        return self._known_coordinates.coordinates_ahead(block_index, z, u, p)

    def coordinates(self, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at z (unknowns,), or (samples, coordinates) at z (samples, unknowns), u alike."""
        samples = np.atleast_2d(z)
        w = self._evaluator(len(samples)).coordinates(samples, np.broadcast_to(u, (len(samples), u.shape[-1])), p)
        return w[0] if z.ndim == 1 else w

    @cached_property
    def _unknowns_pattern(self) -> SparsePattern:
        assert self.equations.assembled is not None
        blocks = [(block.rows, block.unknowns) for block in self.equations.blocks if slice_length(block.rows)]
        return self.equations.assembled.pattern.first_columns(self._unknown_count, blocks)

    def _split_entries(self, entries: Array, pattern: SparsePattern) -> tuple[Array | SparseMatrices, Array]:
        """dF/dz and dF/du (..., rows, unknowns or inputs) from the entries (..., entries) of dF/dy."""
        both = SparseMatrices(pattern, entries)
        if not self.is_sparse:
            dense = np.asarray(both)
            return dense[..., : self._unknown_count], dense[..., self._unknown_count :]
        of_unknowns = self._unknowns_pattern
        input_jacobian: Array = both[..., slice(None), slice(self._unknown_count, None)]
        return SparseMatrices(of_unknowns, entries[..., : len(of_unknowns.rows)]), input_jacobian

    def third_residual_rates(self, rates: Sequence[Array], p: Array) -> Array:
        """The third time derivatives of F (samples, rows), from y and its first to third rates, of (samples, y)."""
        return self.formulas.third_residual_rates(rates, p)

    def third_coordinate_rates(self, rates: Sequence[Array], p: Array) -> Array:
        """The same of w (samples, coordinates)."""
        return self.formulas.third_coordinate_rates(rates, p)

    def third_rate_remainder(self, y: Array, y1: Array, y2: Array, p: Array) -> Array:
        """The third time derivative of F (rows,), that of y left out."""
        return self.third_residual_rates((y[None], y1[None], y2[None], 0.0 * y[None]), p)[0]

    def jacobian_changes(self, y: Array, directions: Array, p: Array) -> Array:
        """How dF/dy (rows, y) at y (y,) changes along directions (k, y): (k, rows, y)."""
        return self.formulas.jacobian_changes(y, directions, p)

    def rounding_terms(self, y: Array, y1: Array, y2: Array, p: Array) -> RoundingTerms:
        """What carries round-off at samples y = (z, u) with first and second rates, each (samples, y)."""
        return self.formulas.rounding_terms(y, y1, y2, p)

    def kinematics(self, y: Array, y1: Array, y2: Array, p: Array) -> EquationRates:
        """Everything at one position, y = (z, u) with its first and second derivatives, or at samples (samples, y)."""
        samples = np.atleast_2d(y)
        evaluator = self._evaluator(len(samples))
        y1, y2 = np.broadcast_to(y1, samples.shape), np.broadcast_to(y2, samples.shape)
        residuals, coordinates, entries = evaluator.kinematics(samples, y1, y2, p)
        if y.ndim == 1:
            residuals, coordinates, entries = residuals[0], coordinates[0], entries[0]
        orders = (values[..., order, :] for values in (residuals, coordinates) for order in range(3))
        return EquationRates._make((*orders, *self._split_entries(entries, evaluator.pattern)))

    def correct_samples(self, z: Array, u: Array, p: Array) -> Array:
        """z (samples, unknowns) by Newton's method from near by, at samples u and p alike, each by itself."""
        u = np.broadcast_to(u, (len(z), u.shape[-1]))
        for _ in range(RUN_NEWTON_STEPS):
            evaluator = self._evaluator(len(z))
            residuals, entries = evaluator.residuals_and_jacobians(z, u, p)
            z = z - solve_vectors(self._split_entries(entries, evaluator.pattern)[0], residuals)
        return z

    def jacobians(self, z: Array, u: Array, p: Array) -> tuple[Array | SparseMatrices, Array]:
        """dF/dz (samples, rows, unknowns) and dF/du (samples, rows, inputs) at z (samples, unknowns), u alike."""
        evaluator = self._evaluator(len(z))
        return self._split_entries(evaluator.residuals_and_jacobians(z, u, p)[1], evaluator.pattern)

    def residuals_and_jacobian(self, z: Array, u: Array, p: Array) -> tuple[Array, Array | SparseMatrices]:
        """F (rows,) and its Jacobian (rows, unknowns and inputs) at one position."""
        evaluator = self._evaluator()
        residuals, entries = evaluator.residuals_and_jacobians(z[None], u[None], p)
        jacobian = SparseMatrices(evaluator.pattern, entries[0])
        return residuals[0], jacobian if self.is_sparse else np.asarray(jacobian)

    @cached_property
    def is_square(self) -> bool:
        """Whether every block has as many constraints as unknowns."""
        return self.equations.is_square


def equation_functions(mechanism: Mechanism) -> EquationFunctions:
    """The program of a mechanism's structure; mechanisms that differ in their links' dimensions share one."""
    return _cached_equation_functions(equation_structure(mechanism))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_equation_functions(structure: Mechanism) -> EquationFunctions:
    return EquationFunctions(build_equations(structure))
