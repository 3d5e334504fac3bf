"""The functions of block types: residuals and Jacobian, coordinates, both assemblies in closed form, runs.

A block type's formulas are those of its elements one after the other, as `AssembledEquations` evaluates them, and its
closed form. Those of known types are read, see `known_types`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import cached_property, lru_cache
from math import inf, isfinite, remainder
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.block_types import MAX_BLOCK_TYPES, BlockTypeKey, block_equations
from planar.equations.elements import known_text
from planar.equations.linear import solve_vectors
from planar.equations.structure_formulas import BlockCall, StructureFormulas
from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.jets import TURN
from planar.foundation.recorded_formula import (
    RecordedFormula,
    formula_of_results,
    number_of,
    recorded_arguments,
)
from planar.model.pairs import MeasureKind

if TYPE_CHECKING:
    from planar.equations.block_motion import LargeBlockMotion

MAX_RUN_STEPS = 6
"""Steps of Newton's method at a position of a run."""
POLISHING_STEPS = 2
"""Newton's steps that carry a closed form to round-off."""
SETTLED_STEP = 1e-9
"""rad or sizes: after a shorter step of Newton's method the next one is round-off."""
MAX_FORMULA_UNKNOWNS = 12
"""Unknowns of a block: the formula of the motion of a larger one would be too long."""


class BlockTypeFormulas(NamedTuple):
    """The formulas of a block type: of its unknowns, the coordinates that are known ahead of it, and its numbers."""

    closing: RecordedFormula
    "-> F (rows,), then the columns of its Jacobian"
    coordinates: RecordedFormula
    "-> its own coordinates"
    closed_form: RecordedFormula | None
    "(..., sign) -> its unknowns in closed form, then where its assemblies meet; None where it has none"
    has_changing_arm: bool
    "whether a length of the closed form turns on an arm that changes as the mechanism moves"

    def as_text(self) -> str:
        """All in one line of JSON."""
        formulas = self.closing, self.coordinates, self.closed_form
        return json.dumps([*(formula and formula.as_text() for formula in formulas), self.has_changing_arm])

    @classmethod
    def from_text(cls, text: str) -> BlockTypeFormulas:
        """The formulas of `as_text`."""
        closing, coordinates, closed_form, has_changing_arm = json.loads(text)
        form = closed_form and RecordedFormula.from_text(closed_form)
        return cls(RecordedFormula.from_text(closing), RecordedFormula.from_text(coordinates), form, has_changing_arm)


def derive_block_type(key: BlockTypeKey) -> BlockTypeFormulas:
    """The formulas of a block type."""
    from planar.equations.closed_form import closed_form_formula  # most types are known

    equations = block_equations(key)
    formulas = StructureFormulas(equations)
    return BlockTypeFormulas(
        formulas.block_function(equations.blocks[0]).formula,
        formulas.coordinate_function.formula,
        *closed_form_formula(equations, equations.blocks[0]),
    )


def polish(
    closing: BlockCall, z: Array, u: Array, p: Array, unknowns: slice = slice(None), steps: int = POLISHING_STEPS
) -> None:
    """Carry a block's unknowns in z (designs, unknowns) to round-off by Newton's method; `closing` gives its F and the
    columns of its Jacobian."""
    for _ in range(steps):
        residuals, columns = closing.evaluate_batch(len(z), z, u, p)
        with np.errstate(all="ignore"):  # what is not there is not a number
            moves = solve_vectors(columns.swapaxes(-1, -2), residuals[:, 0])
            z[:, unknowns] -= moves
            if not (np.abs(moves) > SETTLED_STEP).any():
                break


BlockArguments = Callable[[Array, Array, Array], tuple[Array, Array, Array]]
"""z, u and p of the structure to what the functions of a block take."""


class ClosedFormAssemblies:
    """The two assemblies of one block in closed form, carried to round-off by Newton's steps.

    `form` (z, u, p, sign) gives them, `closing` (z, u, p) the block's residuals and the columns of its Jacobian. Both
    take what `arguments` gives; None where that is z, u and p themselves.
    `has_changing_arm`: whether a length of the block turns on an arm that may vanish as the mechanism moves.
    """

    def __init__(
        self,
        unknowns: slice,
        form: BlockCall,
        closing: BlockCall,
        has_changing_arm: bool,
        arguments: BlockArguments | None = None,
    ):
        self._unknowns, self._form, self._closing = unknowns, form, closing
        self.has_changing_arm, self._arguments = has_changing_arm, arguments

    def placed(self, arguments: BlockArguments) -> ClosedFormAssemblies:
        """The same of a block of this type in a structure."""
        return ClosedFormAssemblies(self._unknowns, self._form, self._closing, self.has_changing_arm, arguments)

    def __call__(self, z: Array, u: Array, p: Array) -> tuple[list[Array], float, float]:
        """Both (unknowns,), the greatest residual of the two, and how near they are to where they meet (`ClosedForm`).

        What is not there is not a number.
        """
        assemblies, residual, coalescence = self.of_designs(z[None], u, p)
        return list(assemblies[:, 0]), float(residual[0]), float(coalescence[0])

    def evaluate_batch(self, z: Array, u: Array, p: Array) -> tuple[list[Array], Array]:
        """Both (positions, unknowns), not polished, and how near they are to where they meet (positions,), at z
        (positions, unknowns), u and p alike."""
        return self._evaluate_form(*self._block_arguments(z, u, p))

    def _block_arguments(self, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        return (z, u, p) if self._arguments is None else self._arguments(z, u, p)

    def _evaluate_form(self, z: Array, u: Array, p: Array) -> tuple[list[Array], Array]:
        results = [self._form.evaluate_batch(len(z), z, u, p, np.array([sign])) for sign in (1.0, -1.0)]
        return [assembly[:, 0] for assembly, _ in results], results[0][1][:, 0, 0]

    def of_designs(self, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        """The same of designs z (designs, unknowns), u and p alike: both (2, designs, unknowns of the block), the
        greatest residuals and how near they are to where they meet (designs,)."""
        z, u, p = self._block_arguments(z, u, p)
        both, coalescence = self._evaluate_form(z, u, p)
        greatest: Array = np.zeros(len(z))
        assemblies: list[Array] = []
        for assembly in both:
            tried = z.copy()
            tried[:, self._unknowns] = assembly
            polish(self._closing, tried, u, p, self._unknowns)
            residual = np.abs(self._closing.evaluate_batch(len(z), tried, u, p)[0][:, 0]).max(axis=1)
            # the greatest of what is left open does not see what is not a number
            is_defined = np.isfinite(tried[:, self._unknowns]).all(axis=1)
            greatest = np.maximum(greatest, np.where(is_defined, residual, np.nan))
            assemblies.append(tried[:, self._unknowns])
        return np.array(assemblies), greatest, coalescence


class BlockTypeFunctions:
    """The functions (unknowns, known coordinates, numbers) of a block type."""

    def __init__(self, key: BlockTypeKey):
        self._key = key
        self._counts = key.unknown_count, len(key.known_kinds), key.number_count
        self.is_angle = np.array(
            [kind is not MeasureKind.LENGTH for kind, _ in key.own_kinds[: key.unknown_count]], bool
        )

    @cached_property
    def _formulas(self) -> BlockTypeFormulas:
        text = known_text(self._key.fingerprint)
        return derive_block_type(self._key) if text is None else BlockTypeFormulas.from_text(text)

    @cached_property
    def closing(self) -> FormulaFunction:
        """F (1, rows) and the columns of its Jacobian (unknowns, rows)."""
        rows = len(self._key.row_kinds)
        return FormulaFunction(self._formulas.closing, self._counts, ((1, rows), (self._counts[0], rows)))

    @cached_property
    def coordinates(self) -> FormulaFunction:
        """Its own coordinates (1, coordinates)."""
        return FormulaFunction(self._formulas.coordinates, self._counts, ((1, len(self._key.own_kinds)),))

    @cached_property
    def motion(self) -> FormulaFunction | LargeBlockMotion:
        """(unknowns, known coordinates with first and second rates, numbers, row scale, column floor): see
        `block_motion`."""
        unknowns, known, numbers = self._counts
        text = known_text(motion_fingerprint(self._key))
        if text is not None:
            formula = RecordedFormula.from_text(text)
        else:
            from planar.equations.block_motion import LargeBlockMotion, derive_block_motion  # most types are known

            if unknowns > MAX_FORMULA_UNKNOWNS:
                return LargeBlockMotion(block_equations(self._key))
            formula = derive_block_motion(block_equations(self._key))
        counts = unknowns, known, known, known, numbers, len(self._key.row_kinds), unknowns
        return FormulaFunction(formula, counts, ((1, len(formula.results)),))

    @cached_property
    def assemblies(self) -> ClosedFormAssemblies | None:
        """Both assemblies; None for a type without a closed form."""
        formula, count = self._formulas.closed_form, self._counts[0]
        if formula is None:
            return None
        form = FormulaFunction(formula, (*self._counts, 1), ((1, count), (1, 1)))
        return ClosedFormAssemblies(slice(0, count), form, self.closing, self._formulas.has_changing_arm)

    def run(self, z: Array, known: Array, numbers: Array, index: int = 0) -> Array:
        """The unknowns (samples, unknowns) where known coordinates are `known` (samples, known); z is next to those of
        the sample `at`."""
        run = self._run_newton if self.assemblies is None else self._run_form
        return run(z, known, numbers, index)

    def _run_form(self, z: Array, known: Array, numbers: Array, index: int) -> Array:
        """The assembly in closed form that is the nearer to z at that sample."""
        assert self.assemblies is not None
        is_angle = self.is_angle
        sign = np.array([self.nearest_sign(z, known[index], numbers)])
        starts = np.repeat(z[None], len(known), axis=0)
        assemblies, steps = self.polished_form.evaluate_batch(len(known), starts, known, numbers, sign)
        samples: Array = assemblies[:, 0]
        angles = samples[:, is_angle]
        turned = np.cumsum(wrap_angle(np.diff(angles, axis=0, prepend=angles[:1])), axis=0)
        samples[:, is_angle] = z[is_angle] + wrap_angle(angles[index] - z[is_angle]) + (turned - turned[index])
        if (np.abs(steps) > SETTLED_STEP).any():
            polish(self.closing, samples, known, numbers)
        return samples

    def nearest_sign(self, z: Array, known: Array, numbers: Array) -> float:
        """The sign of the assembly in closed form that is the nearer to z (unknowns,)."""
        place = z.tolist(), known.tolist(), numbers.tolist()

        def distance(sign: float) -> float:
            values = self.polished_form.values(*place, [sign])
            moves = [value - unknown for value, unknown in zip(values, place[0], strict=False)]
            if not all(map(isfinite, moves)):
                return inf
            sizes = (remainder(move, TURN) if turns else move for move, turns in zip(moves, self.is_angle, strict=True))
            return max(map(abs, sizes))

        return min((1.0, -1.0), key=distance)

    @cached_property
    def polished_form(self) -> FormulaFunction:
        """(unknowns, known coordinates, numbers, sign) -> the unknowns of an assembly in closed form after a step of
        Newton's method, and that step."""
        assert self._formulas.closed_form is not None
        counts = *self._counts, 1
        instructions, (z, known, numbers, sign) = recorded_arguments(counts)
        assembly = self._formulas.closed_form.evaluate([*z, *known, *numbers, *sign])[: len(z)]
        closing = self._formulas.closing.evaluate([*assembly, *known, *numbers])
        first, second, a, c, b, d = closing  # the Jacobian column by column
        determinant = a * d - b * c
        steps = (d * first - b * second) / determinant, (a * second - c * first) / determinant
        results = [*(unknown - step for unknown, step in zip(assembly, steps, strict=True)), *steps]
        formula = formula_of_results(instructions, [number_of(result, instructions) for result in results])
        return FormulaFunction(formula, counts, ((1, len(z)), (1, len(z))))

    def _run_newton(self, z: Array, known: Array, numbers: Array, index: int) -> Array:
        """By Newton's method from where the samples before lead."""
        samples: Array = np.empty((len(known), len(z)))

        samples[index] = z
        polish(self.closing, samples[index : index + 1], known[index], numbers, steps=MAX_RUN_STEPS)
        for rows in (range(index + 1, len(known)), range(index - 1, -1, -1)):
            previous, step = samples[index], np.zeros(len(z))
            for k in rows:
                samples[k] = previous + step
                polish(self.closing, samples[k : k + 1], known[k], numbers, steps=MAX_RUN_STEPS)
                previous, step = samples[k], samples[k] - previous
        return samples


def motion_fingerprint(key: BlockTypeKey) -> str:
    """What tells the motion of a type from all other formulas."""
    return f"{key.fingerprint} motion"


@lru_cache(maxsize=MAX_BLOCK_TYPES)
def block_type_functions(key: BlockTypeKey) -> BlockTypeFunctions:
    """The functions of a block type, known or derived."""
    return BlockTypeFunctions(key)
