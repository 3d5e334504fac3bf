"""A structure's equations as functions of arrays z, u and p: residuals, Jacobians, rates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache, partial
from threading import Lock
from typing import NamedTuple

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.assembled_equations import AssembledEquations
from planar.equations.block_type_functions import (
    BlockArguments,
    BlockTypeFunctions,
    ClosedFormAssemblies,
    block_type_functions,
)
from planar.equations.block_types import PlacedBlock, place_blocks
from planar.equations.linear import solve_vectors
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.sparse_matrices import MAX_DENSE_UNKNOWNS, SparseMatrices, SparsePattern
from planar.equations.structure_formulas import BlockCall, StructureFormulas
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
        index = block.block_index
        if index not in self._block_calls:
            block_type = self._block_types[index]
            self._block_calls[index] = (
                self.formulas.block_call(block)
                if block_type is None
                else _PlacedBlockCall(block_type.closing, self._known_coordinates.arguments_of(block))
            )
        return self._block_calls[index]

    @cached_property
    def placed_blocks(self) -> tuple[PlacedBlock | None, ...]:
        """The types of all blocks; None for one that has none."""
        return place_blocks(self.equations)

    @cached_property
    def _block_types(self) -> list[BlockTypeFunctions | None]:
        """The functions of the types of all blocks."""
        return [placed and block_type_functions(placed.key) for placed in self.placed_blocks]

    @cached_property
    def _known_coordinates(self) -> _KnownCoordinates:
        """Where blocks stand that are called by their types."""
        assert self.equations.assembled is not None
        return _KnownCoordinates(self.equations, self.equations.assembled, self.placed_blocks, self._block_types)

    def block_assemblies(self, block: Block) -> ClosedFormAssemblies | None:
        """Both assemblies of a block; None for one without a closed form."""
        index = block.block_index
        if index not in self._block_assemblies:
            block_type = self._block_types[index]
            if block_type is None:
                self._block_assemblies[index] = self._derive_assemblies(block)
            else:
                form = block_type.assemblies
                self._block_assemblies[index] = form and form.placed(self._known_coordinates.arguments_of(block))
        return self._block_assemblies[index]

    def _derive_assemblies(self, block: Block) -> ClosedFormAssemblies | None:
        """Both assemblies of a block without a type."""
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

    @property
    def is_square(self) -> bool:
        """Whether every block has as many constraints as unknowns."""
        return self.equations.is_square


class _PlacedBlockCall:
    """A function of a block's type, called with z, u and p of the structure."""

    def __init__(self, function: BlockCall, arguments: BlockArguments):
        self._function, self._arguments = function, arguments

    def __call__(self, *arguments: Array) -> list[Array]:
        """See `BlockCall`."""
        return self._function(*self._arguments(*arguments))

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """See `BlockCall`."""
        return self._function.evaluate_batch(count, *self._arguments(*arguments))


class _KnownCoordinates:
    """(w, u) as far as blocks ahead of one give it. Of one position the last one is kept: from one block to the next,
    or from one step of a block to the next, little changes."""

    def __init__(
        self,
        e: ConstraintEquations,
        assembled: AssembledEquations,
        placed: tuple[PlacedBlock | None, ...],
        block_types: Sequence[BlockTypeFunctions | None],
    ):
        self._equations, self._assembled, self._placed = e, assembled, placed
        self._block_types = block_types
        self._lock = Lock()
        self._last: tuple[Array, Array, Array] | None = None
        self._state: Array = np.zeros(0)
        self._block_of_unknown = np.repeat(
            np.arange(len(e.blocks)), [slice_length(block.unknowns) for block in e.blocks]
        )

    def coordinates_ahead(self, block_index: int, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at one position; what follows from this block or a later one holds anything."""
        with self._lock:
            self._update(block_index, z, u, p)
            return self._state[: len(self._equations.coordinates)].copy()

    def arguments_of(self, block: Block) -> BlockArguments:
        """z, u and p to what the functions of a block's type take: its unknowns, what it rests on of (w, u), and its
        numbers."""
        return partial(self._arguments, block)

    def _arguments(self, block: Block, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        placed = self._placed[block.block_index]
        assert placed is not None
        numbers = p[..., placed.numbers]
        if z.ndim == 1:
            with self._lock:
                self._update(block.block_index, z, u, p)
                return z[block.unknowns], self._state[placed.known], numbers
        unknowns = z[:, block.unknowns]
        if u.ndim == p.ndim == 1 and bool((z[:, : block.unknowns.start] == z[0, : block.unknowns.start]).all()):
            return unknowns, self._arguments(block, z[0], u, p)[1], numbers
        inputs = np.broadcast_to(u, (len(z), u.shape[-1]))
        return unknowns, np.hstack([self._assembled.coordinates(z, inputs, p), inputs])[:, placed.known], numbers

    def _update(self, block_index: int, z: Array, u: Array, p: Array) -> None:
        """Bring the state to a position, as far as the block."""
        count = len(self._equations.coordinates)
        if self._last is None or not (np.array_equal(u, self._last[1]) and np.array_equal(p, self._last[2])):
            self._state = np.concatenate([self._assembled.coordinates(z[None], u[None], p)[0], u])
            self._last = z.copy(), u.copy(), p.copy()
            return
        previous = self._last[0]
        start = self._equations.blocks[block_index].unknowns.start if block_index < len(self._placed) else len(z)
        changed = np.flatnonzero(z[:start] != previous[:start])
        if not len(changed):
            return
        first = int(self._block_of_unknown[changed[0]])
        for block in self._equations.blocks[first:block_index]:
            placed, block_type = self._placed[block.block_index], self._block_types[block.block_index]
            if placed is None or block_type is None:
                self._state[:count] = self._assembled.coordinates(z[None], u[None], p)[0]
                previous[:] = z
                return
            unknowns = z[block.unknowns]
            known, numbers = self._state[placed.known], p[placed.numbers]
            self._state[placed.coordinates] = block_type.coordinates(unknowns, known, numbers)[0][0]
        # blocks behind are computed again when they are asked for
        previous[:start] = z[:start]
        previous[start:] = np.nan


def equation_functions(mechanism: Mechanism) -> EquationFunctions:
    """The program of a mechanism's structure; mechanisms that differ in their links' dimensions share one."""
    return _cached_equation_functions(equation_structure(mechanism))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_equation_functions(structure: Mechanism) -> EquationFunctions:
    return EquationFunctions(build_equations(structure))
