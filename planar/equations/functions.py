"""A structure's equations as functions of arrays z, u and p: residuals, Jacobians, rates, by elements or compiled.

The functions that are derived of a whole structure are kept on disk, by a fingerprint of all that they depend on: to
derive them takes many times as long as to read them.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.equations.assembled_equations import AssembledEquations
from planar.equations.block_motion import function_with_cse
from planar.equations.block_type_functions import BlockTypeFunctions, block_type_functions
from planar.equations.block_types import PlacedBlock, place_blocks
from planar.equations.casadi_call import (
    BufferedFunction,
    read_function,
)
from planar.equations.closed_form_assemblies import ClosedFormAssemblies
from planar.equations.elimination import stack_expressions
from planar.equations.linear import solve_linear, solve_vectors
from planar.equations.mechanism_numbers import equation_structure, structure_fingerprint
from planar.equations.placed_blocks import (
    BlockAssemblyCall,
    BlockCall,
    KnownCoordinates,
    PlacedAssemblies,
    PlacedBlockCall,
)
from planar.equations.rates import rate_symbols, time_derivatives
from planar.equations.sparse_matrices import MAX_DENSE_UNKNOWNS, SparseMatrices, SparsePattern
from planar.equations.symbolic_equations import (
    Block,
    ConstraintEquations,
    build_equations,
    slice_length,
)
from planar.foundation.arrays import Array
from planar.foundation.kept_texts import KeptTexts
from planar.foundation.printed_formula import FormulaFunction
from planar.foundation.private_cache import PrivateCache
from planar.model.mechanism import Mechanism

MAX_CACHED_STRUCTURES = 256
"""Mechanisms of which what was derived is kept: more than come along, so that none is derived twice in a round."""

KEPT_EQUATIONS = PrivateCache("equations", ".equations", b"planar equations\n", 128 * 2**20)
"""Functions of structures, as casadi writes them; those of one take from 0.1 to 1 MB."""
MAX_ELEMENT_EVALUATIONS = 16.0
"""Evaluations by elements that take about as long as it takes to derive simple functions of a whole structure."""
SAMPLES_PER_EVALUATION = 64.0
"""Samples that take as long as one evaluation takes whatever their number."""
RUN_NEWTON_STEPS = 4
"""Unrolled steps of a position within a run: from a start a degree or so away, four square the error away."""


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


def kept_function(make: Callable[[Any], ca.Function]) -> cached_property[ca.Function]:
    """A property of `EquationFunctions`: a function that is made once, in this process or in one before."""

    def get(functions: EquationFunctions) -> ca.Function:
        return functions.kept(make.__name__, lambda: make(functions))

    get.__doc__ = make.__doc__
    return cached_property(get)


class EquationFunctions:
    """The equations of one structure as functions of arrays; `texts` is where derived ones are kept.

    They are evaluated by elements and block types, which are derived once for all structures. From a structure that is
    evaluated several times casadi functions of the whole are derived, unless its unknowns are many.
    """

    def __init__(self, equations: ConstraintEquations, texts: KeptTexts | None = None):
        self.equations, self._texts = equations, texts
        self._unknown_count, self._row_count = len(equations.unknowns), len(equations.rows)
        is_square = equations.is_square and self._unknown_count == self._row_count
        self.is_sparse = is_square and self._unknown_count > MAX_DENSE_UNKNOWNS and equations.elimination is not None
        "whether Jacobians are by their entries"
        self._evaluation_count = 0.0

    def _elements(self, samples: int = 1) -> AssembledEquations | None:
        """The equations as elements evaluate them at samples; None where functions of the whole do that."""
        self._evaluation_count += 1.0 + samples / SAMPLES_PER_EVALUATION
        is_compiled = self._evaluation_count > MAX_ELEMENT_EVALUATIONS and not self.is_sparse
        return None if is_compiled else self.equations.assembled

    def compile(self) -> None:
        """Evaluate by functions of the whole from now on."""
        self._evaluation_count = MAX_ELEMENT_EVALUATIONS

    def kept(self, name: str, make: Callable[[], ca.Function]) -> ca.Function:
        """What `make` makes of this structure, from the disk where it is kept there by this name."""
        text = None if self._texts is None else self._texts.take(name)
        function = read_function(text)
        if function is None:
            function = make()
            if self._texts is not None:
                self._texts.add(name, function.serialize)
        return function

    def block_function(self, block: Block) -> ca.Function:
        """(z, u, p) -> F of this block (rows,) and its Jacobian in the block's own unknowns (rows, unknowns)."""
        k = block.block_index
        if k not in self._block_functions:
            self._block_functions[k] = self.kept(f"closing {k}", lambda: self._make_block_function(block))
        return self._block_functions[k]

    @cached_property
    def _block_functions(self) -> dict[int, ca.Function]:
        return {}

    def _make_block_function(self, block: Block) -> ca.Function:
        e = self.equations
        outputs = [e.F[block.rows], ca.densify(e.jacobian[block.rows, block.unknowns])]
        return ca.Function("closing", [e.z, e.u, e.p], outputs)

    def block_call(self, block: Block) -> BlockCall:
        """The same, called on arrays: F and the Jacobian's columns (unknowns, rows)."""
        if block.block_index not in self._block_calls:
            self._block_calls[block.block_index] = self._make_block_call(block)
        return self._block_calls[block.block_index]

    @cached_property
    def _block_calls(self) -> dict[int, BlockCall]:
        return {}

    def _make_block_call(self, block: Block) -> BlockCall:
        by_type = self._functions_of_type(block)
        if by_type is None:
            return BufferedFunction(self.block_function(block))
        return PlacedBlockCall(block, by_type.closing, self._known_coordinates)

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

    def block_assemblies(self, block: Block) -> BlockAssemblyCall | None:
        """Both assemblies of a block; None for one without a closed form."""
        if block.block_index not in self._block_assemblies:
            self._block_assemblies[block.block_index] = self._make_assemblies(block)
        return self._block_assemblies[block.block_index]

    @cached_property
    def _block_assemblies(self) -> dict[int, BlockAssemblyCall | None]:
        return {}

    def _make_assemblies(self, block: Block) -> BlockAssemblyCall | None:
        by_type = self._functions_of_type(block)
        if by_type is not None:
            assemblies = by_type.assemblies
            return assemblies and PlacedAssemblies(block, assemblies, self._known_coordinates)
        from planar.equations.closed_form import closed_form_formula  # nearly all blocks have a type

        e = self.equations
        form = closed_form_formula(e, block)
        if form is None:
            return None
        counts = *(symbol.numel() for symbol in (e.z, e.u, e.p)), 1
        function = FormulaFunction(form.formula, counts, ((1, slice_length(block.unknowns)), (1, 1)))
        return ClosedFormAssemblies(block.unknowns, function, self.block_call(block), form.has_changing_arm)

    @kept_function
    def coordinate_function(self) -> ca.Function:
        """(z, u, p) -> w."""
        e = self.equations
        return ca.Function("positions", [e.z, e.u, e.p], [ca.densify(e.w)])

    def coordinates_ahead(self, block_index: int, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at z (unknowns,), as far as known ahead of a block; the rest of it may hold anything."""
        if self.equations.elimination is None:
            return self.coordinates(z, u, p)
        return self._known_coordinates.coordinates_ahead(block_index, z, u, p)

    def coordinates(self, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at z (unknowns,), or (samples, coordinates) at z (samples, unknowns), u alike."""
        many = np.atleast_2d(z)
        elements = self._elements(len(many))
        if elements is not None:
            w = elements.coordinates(many, np.broadcast_to(u, (len(many), u.shape[-1])), p)
            return w[0] if z.ndim == 1 else w
        if z.ndim == 1:
            return self._coordinate_function(z, u, p)[0][0]
        return self._coordinate_function.evaluate_batch(len(z), z, u, p)[0][:, 0]

    @cached_property
    def _coordinate_function(self) -> BufferedFunction:
        return BufferedFunction(self.coordinate_function)

    @cached_property
    def _kinematics_calls(self) -> tuple[BufferedFunction, BufferedFunction]:
        return BufferedFunction(self.kinematics_function), BufferedFunction(self._jacobian_function)

    @kept_function
    def kinematics_function(self) -> ca.Function:
        """(y, y1, y2, p) -> F and w, one after the other, with their first and second rates, and dF/dy."""
        e = self.equations
        both = ca.vertcat(e.F, e.w)
        y = e.y
        y1, y2 = rate_symbols(y, 2)
        first, second = time_derivatives(both, y, y1, y2)
        outputs = [ca.densify(ca.horzcat(both, first, second)), self._dense_jacobian]
        return ca.Function("kinematics", [y, y1, y2, e.p], outputs)

    @property
    def _dense_jacobian(self) -> ca.SX:
        """dF/dy (rows, y)."""
        return ca.densify(self.equations.jacobian)

    @cached_property
    def _unknowns_pattern(self) -> SparsePattern:
        assert self.equations.assembled is not None
        blocks = [(block.rows, block.unknowns) for block in self.equations.blocks if slice_length(block.rows)]
        return self.equations.assembled.pattern.first_columns(self._unknown_count, blocks)

    def _split_entries(self, entries: Array) -> tuple[Array | SparseMatrices, Array]:
        """dF/dz and dF/du (..., rows, unknowns or inputs) from the entries (..., entries) of dF/dy."""
        assert self.equations.assembled is not None
        both = SparseMatrices(self.equations.assembled.pattern, entries)
        if not self.is_sparse:
            dense = np.asarray(both)
            return dense[..., : self._unknown_count], dense[..., self._unknown_count :]
        pattern = self._unknowns_pattern
        input_jacobian: Array = both[..., slice(None), slice(self._unknown_count, None)]
        return SparseMatrices(pattern, entries[..., : len(pattern.rows)]), input_jacobian

    def _split_columns(self, slopes: Array) -> tuple[Array, Array]:
        """The same from the columns (..., y, rows) of dF/dy."""
        slopes = slopes.swapaxes(-1, -2)
        return slopes[..., : self._unknown_count], slopes[..., self._unknown_count :]

    @kept_function
    def _third_rate_function(self) -> ca.Function:
        e = self.equations
        y = e.y
        y1, y2 = rate_symbols(y, 2)
        third = time_derivatives(e.F, y, y1, y2, ca.SX.zeros(y.numel()))[-1]
        return ca.Function("third", [y, y1, y2, e.p], [ca.densify(third)])

    @kept_function
    def _jerk_function(self) -> ca.Function:
        e = self.equations
        y = e.y
        y1, y2, y3 = rate_symbols(y, 3)
        third = time_derivatives(ca.vertcat(e.F, e.w), y, y1, y2, y3)[-1]
        return ca.Function("jerks", [y, y1, y2, y3, e.p], [ca.densify(third)])

    def third_rates(self, y: Array, y1: Array, y2: Array, y3: Array, p: Array) -> tuple[Array, Array]:
        """The third time derivatives of F (samples, rows) and of w (samples, coordinates); y (samples, y) alike."""
        rows = self._row_count
        both = self._jerk_function(y.T, y1.T, y2.T, y3.T, p).full().T
        return both[:, :rows], both[:, rows:]

    def third_rate_remainder(self, y: Array, y1: Array, y2: Array, p: Array) -> Array:
        """The third time derivative of F (rows,), that of y left out."""
        return self._third_rate_call(y, y1, y2, p)[0][0]

    @cached_property
    def _third_rate_call(self) -> BufferedFunction:
        return BufferedFunction(self._third_rate_function)

    @kept_function
    def _weighted_hessian_function(self) -> ca.Function:
        e = self.equations
        y, rows = e.y, ca.SX.sym("l", e.F.numel())
        return ca.Function("weighed", [y, rows, e.p], [ca.densify(ca.jacobian(ca.jtimes(e.F, y, rows, True), y))])

    @cached_property
    def _weighted_hessian_call(self) -> BufferedFunction:
        return BufferedFunction(self._weighted_hessian_function)

    def weighted_hessian(self, y: Array, weights: Array, p: Array) -> Array:
        """The second derivatives (y, y) of the sum of the rows of F, each times its number."""
        return self._weighted_hessian_call(y, weights, p)[0].T

    @kept_function
    def _deflated_function(self) -> ca.Function:
        e = self.equations
        z1, u1 = ca.SX.sym("z1", e.z.numel()), ca.SX.sym("u1", e.u.numel())
        both = ca.vertcat(e.F, ca.jtimes(e.F, e.y, ca.vertcat(z1, u1)))
        slopes = ca.jacobian(both, ca.vertcat(e.z, z1))
        return ca.Function("deflated", [e.z, z1, e.u, u1, e.p], [ca.densify(both), ca.densify(slopes)])

    def deflated_system(self, z: Array, z1: Array, u: Array, u1: Array, p: Array) -> tuple[Array, Array]:
        """F and its first time derivative (2 rows,), and their Jacobian in z and z1 (2 rows, 2 unknowns).

        A. Leykin, J. Verschelde, A. Zhao, Newton's method with deflation for isolated singularities, Theor. Comp. Sci.
        359, 2006.
        """
        both, slopes = self._deflated_call(z, z1, u, u1, p)
        return both[0], slopes.T

    @cached_property
    def _deflated_call(self) -> BufferedFunction:
        return BufferedFunction(self._deflated_function)

    def kinematics(self, y: Array, y1: Array, y2: Array, p: Array) -> EquationRates:
        """Everything at one position, y = (z, u) with its first and second derivatives, or at samples (samples, y)."""
        rows = self._row_count
        many = np.atleast_2d(y)
        elements = self._elements(len(many))
        if elements is not None:
            y1, y2 = np.broadcast_to(y1, many.shape), np.broadcast_to(y2, many.shape)
            residuals, coordinates, entries = elements.kinematics(many, y1, y2, p)
            if y.ndim == 1:
                residuals, coordinates, entries = residuals[0], coordinates[0], entries[0]
            orders = (values[..., order, :] for values in (residuals, coordinates) for order in range(3))
            return EquationRates._make((*orders, *self._split_entries(entries)))
        if y.ndim == 1:
            parts, slopes = self._kinematics_calls[0](y, y1, y2, p)
        else:
            parts, slopes = self._kinematics_calls[0].evaluate_batch(len(y), y, y1, y2, p)
            parts = parts.transpose(1, 0, 2)
        return EquationRates._make((*parts[..., :rows], *parts[..., rows:], *self._split_columns(slopes)))

    @kept_function
    def newton_function(self) -> ca.Function:
        """(z, u, p) -> z: Newton block after block, unrolled.

        Only for structures whose every block has as many constraints as unknowns.
        """
        e = self.equations
        z, u, p = (ca.SX.sym(name, each.numel()) for name, each in (("z", e.z), ("u", e.u), ("p", e.p)))
        unknowns = ca.vertsplit(z) if z.numel() else []
        for block in e.blocks:
            for _ in range(RUN_NEWTON_STEPS if slice_length(block.unknowns) else 0):
                left, slope = self.block_function(block)(ca.vertcat(*unknowns), u, p)
                after = ca.vertcat(*unknowns[block.unknowns]) - solve_linear(slope, left)
                unknowns[block.unknowns] = ca.vertsplit(after)
        return function_with_cse("advance", [z, u, p], [stack_expressions(unknowns)])

    def correct_samples(self, z: Array, u: Array, p: Array) -> Array:
        """The same at samples z (samples, unknowns), u and p alike, each by itself."""
        elements = self._elements(RUN_NEWTON_STEPS * len(z))
        if elements is not None:
            u = np.broadcast_to(u, (len(z), u.shape[-1]))
            for _ in range(RUN_NEWTON_STEPS):
                residuals, entries = elements.residuals_and_jacobians(z, u, p)
                z = z - solve_vectors(self._split_entries(entries)[0], residuals)
            return z
        return self._newton_call.evaluate_batch(len(z), z, u, p)[0][:, 0]

    @cached_property
    def _newton_call(self) -> BufferedFunction:
        return BufferedFunction(self.newton_function)

    @kept_function
    def _jacobian_function(self) -> ca.Function:
        e = self.equations
        return ca.Function("slopes", [e.z, e.u, e.p], [self._dense_jacobian])

    def jacobians(self, z: Array, u: Array, p: Array) -> tuple[Array | SparseMatrices, Array]:
        """dF/dz (samples, rows, unknowns) and dF/du (samples, rows, inputs) at z (samples, unknowns), u alike."""
        samples, unknowns = z.shape
        if self._row_count == 0:
            return np.zeros((samples, 0, unknowns)), np.zeros((samples, 0, u.shape[1]))
        elements = self._elements(samples)
        if elements is not None:
            return self._split_entries(elements.residuals_and_jacobians(z, u, p).entries)
        called = self._kinematics_calls[1]
        return self._split_columns(
            called(z[0], u[0], p)[0][None] if samples == 1 else called.evaluate_batch(samples, z, u, p)[0]
        )

    @kept_function
    def _residual_function(self) -> ca.Function:
        e = self.equations
        return ca.Function("left", [e.z, e.u, e.p], [ca.densify(e.F), self._dense_jacobian])

    @cached_property
    def _residual_call(self) -> BufferedFunction:
        return BufferedFunction(self._residual_function)

    def residuals_and_jacobian(self, z: Array, u: Array, p: Array) -> tuple[Array, Array | SparseMatrices]:
        """F (rows,) and its Jacobian (rows, unknowns and inputs) at one position."""
        if not len(self.equations.rows):
            return np.zeros(0), np.zeros((0, len(z) + len(u)))
        elements = self._elements()
        if elements is not None:
            residuals, entries = elements.residuals_and_jacobians(z[None], u[None], p)
            jacobian = SparseMatrices(elements.pattern, entries[0])
            return residuals[0], jacobian if self.is_sparse else np.asarray(jacobian)
        left, slope = self._residual_call(z, u, p)
        return left[0], slope.T

    @cached_property
    def is_square(self) -> bool:
        """Whether every block has as many constraints as unknowns."""
        return self.equations.is_square


def equation_functions(mechanism: Mechanism) -> EquationFunctions:
    """The program of a mechanism's structure; mechanisms that differ in their links' dimensions share one."""
    return _cached_equation_functions(equation_structure(mechanism))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_equation_functions(structure: Mechanism) -> EquationFunctions:
    key = structure_fingerprint(structure)
    texts = None if key is None or KEPT_EQUATIONS.folder() is None else KeptTexts(KEPT_EQUATIONS, key)
    return EquationFunctions(build_equations(structure), texts)
