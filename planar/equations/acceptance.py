"""The acceptance test of positions and their rates: computed block after block by their types, judged by the pairs.

It says yes to what is surely sound. To what it does not, the general path says why, or that it is sound nevertheless.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.block_type_functions import BlockTypeFunctions, block_type_functions
from planar.equations.block_types import INPUT_BLOCK, PlacedBlock, place_input_coordinates
from planar.equations.constraint_check import ORDERS, ConstraintCheck, constraint_check
from planar.equations.functions import MAX_CACHED_STRUCTURES, EquationFunctions, equation_functions
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.recorded_formula import (
    formula_of_results,
    greatest_entries,
    least_entries,
    number_of,
    recorded_arguments,
)
from planar.model.mechanism import Mechanism

INSTRUCTIONS_PER_CALL = 8
"""Instructions of blocks that are made one formula, with the checks of their pairs, and printed in the time that such a
formula saves in a call at one position."""
MAX_FUSED_INSTRUCTIONS = 4_000

Judged = TypeVar("Judged")
"""A float of one position, an array of many."""


class AcceptanceResult(NamedTuple, Generic[Judged]):
    """What is judged at a position; of many positions arrays. Lengths in sizes of the mechanism, angles in rad."""

    residual: Judged
    "what the worst constraint leaves open"
    finite_sum: Judged
    "the sum of all that is left open: a number only if everything is"
    velocity_error: Judged
    "how far velocities break the worst constraint, as a part of the greatest"
    acceleration_error: Judged
    "the same of accelerations"
    contact_gap: Judged
    "the greatest gap, or rate of one as a part of the greatest, of contacts that guides have to keep closed"
    regularity: Judged
    "no more than the least regularity of any block, see `PreparedMechanism.jacobian_regularity`"
    least_singular_value: Judged
    "no more than the least singular value of any block, columns of one size"
    rounding_amplification: Judged
    "by how much, at most, round-off is greater in the rates, see `solving.rates.sample_rates`"


RESULT_COUNT = len(AcceptanceResult._fields)


class InputSamples(NamedTuple):
    """Positions of inputs and their first and second rates, (inputs,) or (samples, inputs)."""

    u: Array
    u1: Array
    u2: Array


class Scales(NamedTuple):
    """The numbers p of a mechanism, what every row is divided by (rows,), and the least sizes of columns (unknowns,):
    see `PreparedMechanism.jacobian_regularity`."""

    p: Array
    row_scale: Array
    column_floor: Array


class JudgedPositions(NamedTuple):
    """Coordinates with their rates (samples, 3, coordinates), what is judged of each sample, and how far in steps as
    the inputs' rates each block is regular (samples, blocks), with the sign of its determinant."""

    coordinate_rates: Array
    result: AcceptanceResult[Array]
    distances: Array


class RecordedStep(NamedTuple):
    """Recorded: unknowns, by how much a step of Newton's method has moved each, and what is judged there."""

    z: Array
    moves: Array
    judged: JudgedPositions


class AcceptanceFunctions:
    """Computes and judges positions of one structure. Only for structures whose every block is of a type, with as many
    constraints as unknowns."""

    def __init__(self, structure: Mechanism, functions: EquationFunctions):
        self.structure, self.equations = structure, functions.equations
        e = self.equations
        blocks = [(INPUT_BLOCK, placed) for placed in place_input_coordinates(e)]
        if functions.is_square:
            blocks += zip(e.blocks, functions.placed_blocks, strict=True)
        self._placed: list[tuple[Block, PlacedBlock]] = [
            (block, placed) for block, placed in blocks if placed is not None
        ]
        self.is_available = functions.is_square and e.elimination is not None and len(self._placed) == len(blocks)
        self.unknown_columns = np.array(e.unknowns, dtype=int)
        "the coordinates that are the unknowns"
        self.block_starts = np.array([block.unknowns.start for block in e.blocks], dtype=int)
        self._call_count = 0

    @cached_property
    def check(self) -> ConstraintCheck:
        """The check of all constraints."""
        return constraint_check(self.structure, len(self.equations.coordinates))

    @cached_property
    def _blocks(self) -> list[tuple[Block, PlacedBlock, BlockTypeFunctions]]:
        """The blocks in their order, those first that follow from the inputs alone."""
        return [(block, placed, block_type_functions(placed.key)) for block, placed in self._placed]

    def position(self, z: Array, inputs: InputSamples, scales: Scales) -> tuple[Array, AcceptanceResult[float]]:
        """Coordinates with their rates (3, coordinates) at unknowns z (unknowns,), and what is judged of them."""
        self._call_count += 1
        if self.has_one_formula:
            values = self._fused_position.values(*(argument.tolist() for argument in (z, *inputs, *scales)))
            split = ORDERS * len(self.equations.coordinates)
            return np.array(values[:split]).reshape(ORDERS, -1), AcceptanceResult(*values[split : split + RESULT_COUNT])
        judged = self.judge(z[None], InputSamples(*(rates[None] for rates in inputs)), scales)
        return judged.coordinate_rates[0], AcceptanceResult(*(float(values[0]) for values in judged.result))

    def judge(self, z: Array, inputs: InputSamples, scales: Scales) -> JudgedPositions:
        """Judge samples z (samples, unknowns)."""
        with np.errstate(all="ignore"):  # what is not defined is not a number, and is not accepted
            return self._judge_blocks(z.T, np.array([rates.T for rates in inputs]), scales)

    def run(self, z: Array, inputs: InputSamples, scales: Scales, index: int = 0) -> tuple[Array, JudgedPositions]:
        """The unknowns at samples of inputs (samples, unknowns), on the branch of z (unknowns,) at the sample `at`, and
        what is judged of them."""
        self._call_count += 1
        with np.errstate(all="ignore"):
            if self.has_one_formula:
                samples = self._solve_run(z, inputs.u, scales.p, index)
                return samples, self._judge_by_one_formula(samples, inputs, scales)
            samples = np.empty((len(inputs.u), len(z)))
            rates = np.array([rates.T for rates in inputs])
            return samples, self._judge_blocks(samples.T, rates, scales, (z, index))

    def _solve_run(self, start: Array, u: Array, p: Array, index: int) -> Array:
        """The unknowns at samples of inputs u (samples, inputs), block after block, on the branch of `start` at one."""
        count = len(self.equations.coordinates)
        entries: Array = np.empty((len(u), count + u.shape[1]))
        entries[:, count:] = u
        last = self._blocks[-1][0]
        for block, placed, of_type in self._blocks:
            known, numbers = entries[:, placed.known], p[placed.numbers]
            unknowns = known[:, :0]
            if slice_length(block.unknowns):
                unknowns = of_type.run(start[block.unknowns], known, numbers, index)
                entries[:, self.unknown_columns[block.unknowns]] = unknowns
            if block is not last:  # nothing follows from its coordinates
                (coordinates,) = of_type.coordinates.evaluate_batch(len(u), unknowns, known, numbers)
                entries[:, placed.coordinates] = coordinates[:, 0]
        return entries[:, self.unknown_columns]

    @property
    def has_one_formula(self) -> bool:
        """Whether a formula of all blocks pays by now."""
        return self._call_count > self._calls_before_fusing

    @cached_property
    def has_closed_forms(self) -> bool:
        """Whether every block that has unknowns has a closed form."""
        return all(of_type.assemblies is not None for block, _, of_type in self._blocks if slice_length(block.unknowns))

    @property
    def block_count(self) -> int:
        """How many blocks there are, those of inputs among them."""
        return len(self._placed)

    @property
    def scale_counts(self) -> tuple[int, int, int]:
        """How many numbers `Scales` has of each kind."""
        e = self.equations
        assert e.elimination is not None
        return e.elimination.number_count, len(e.rows), len(e.unknowns)

    def record_step(self, signs: Array, near: Array, inputs: InputSamples, scales: Scales) -> RecordedStep:
        """The formula of the position at inputs, blocks in closed form by their signs (blocks,), angles within half a
        turn of those `near` (unknowns,): all of it recorded numbers."""
        e = self.equations
        entries: Array = np.zeros(len(e.coordinates) + len(inputs.u), dtype=object)
        entries[len(e.coordinates) :] = inputs.u
        z, moves = near.copy(), near.copy()
        for k, (block, placed, of_type) in enumerate(self._blocks):
            known, numbers = entries[placed.known], scales.p[placed.numbers]
            unknowns = z[block.unknowns]
            if len(unknowns):
                results = of_type.polished_form.evaluate_entries(1, unknowns, known, numbers, signs[k : k + 1])
                assembly, moves[block.unknowns] = np.split(results[:, 0], 2)
                move = assembly - unknowns
                z[block.unknowns] = np.where(of_type.is_angle, unknowns + wrap_angle(move), assembly)
            coordinates = of_type.coordinates.evaluate_entries(1, z[block.unknowns], known, numbers)
            entries[placed.coordinates] = coordinates[:, 0]
        return RecordedStep(z, moves, self.judge(z[None], InputSamples(*(rates[None] for rates in inputs)), scales))

    def signs_at(self, coordinates: Array, u: Array, p: Array) -> list[float]:
        """Of every block the sign of its assembly in closed form at a position; 0 of one without unknowns."""
        entries, z = np.append(coordinates, u), coordinates[self.unknown_columns]
        return [
            of_type.nearest_sign(z[block.unknowns], entries[placed.known], p[placed.numbers])
            if slice_length(block.unknowns)
            else 0.0
            for block, placed, of_type in self._blocks
        ]

    def _judge_by_one_formula(self, z: Array, inputs: InputSamples, scales: Scales) -> JudgedPositions:
        """Judge samples z (samples, unknowns) by the formula of all blocks and pairs."""
        values = self._fused_position.evaluate_entries(len(z), z.T, *(rates.T for rates in inputs), *scales)
        split = ORDERS * len(self.equations.coordinates)
        rates = values[:split].reshape(ORDERS, -1, len(z)).transpose(2, 0, 1)
        result = AcceptanceResult(*values[split : split + RESULT_COUNT])
        return JudgedPositions(rates, result, values[split + RESULT_COUNT :].T)

    def _judge_blocks(
        self, z: Array, u: Array, scales: Scales, start: tuple[Array, int] | None = None
    ) -> JudgedPositions:
        """All blocks one after the other, each at all samples: at unknowns z (unknowns, samples), and inputs u with
        their rates (3, inputs, samples). With `start`, unknowns at the sample of that number, z is filled: by those on
        the branch of them."""
        count, samples = len(self.equations.coordinates), u.shape[-1]
        entries: Array = np.zeros((ORDERS, count + u.shape[1], samples), u.dtype)
        entries[:, count:] = u
        open_rows: list[Array] = []
        bounds: list[Array] = []
        for block, placed, of_type in self._blocks:
            known, numbers = entries[:, placed.known], scales.p[placed.numbers]
            if start is not None and slice_length(block.unknowns):
                near, index = start
                z[block.unknowns] = of_type.run(near[block.unknowns], known[0].T, numbers, index).T
            sizes = scales.row_scale[block.rows], scales.column_floor[block.unknowns]
            results = of_type.motion.evaluate_entries(samples, z[block.unknowns], *known, numbers, *sizes)
            split = ORDERS * len(placed.coordinates)
            entries[:, placed.coordinates] = results[:split].reshape(ORDERS, -1, samples)
            if slice_length(block.unknowns):
                open_rows.append(np.abs(results[split:-4]))
            if block is not INPUT_BLOCK:
                bounds.append(results[-4:])
        regularity, least, loss, distances = np.array(bounds).reshape(len(bounds), 4, samples).swapaxes(0, 1)
        coordinates = entries[:, :count]
        residual, finite_sum, velocity_error, acceleration_error, contact_gap = self.check.judge(entries, scales.p)
        size = greatest_entries(np.abs(coordinates[0])) / np.pi
        one = 0.0 * size + 1.0
        result: AcceptanceResult[Array] = AcceptanceResult(
            greatest_entries(np.concatenate([*open_rows, residual[None]])),
            coordinates.sum(axis=(0, 1)) + finite_sum + (regularity + least).sum(axis=0),
            velocity_error,
            acceleration_error,
            contact_gap,
            least_entries(np.concatenate([one[None], regularity])),
            least_entries(np.concatenate([one[None], least])),
            greatest_entries(np.concatenate([one[None], loss])) * greatest_entries(np.stack([one, size])),
        )
        return JudgedPositions(coordinates.transpose(2, 0, 1), result, distances.T)

    @cached_property
    def _calls_before_fusing(self) -> float:
        """After how many calls at one position a formula of all blocks and pairs pays."""
        motions = [of_type.motion for *_, of_type in self._blocks]
        counts = [len(motion.formula.instructions) for motion in motions if isinstance(motion, FormulaFunction)]
        can_be_fused = len(counts) == len(motions) and sum(counts) <= MAX_FUSED_INSTRUCTIONS
        return sum(counts) / INSTRUCTIONS_PER_CALL if can_be_fused else np.inf

    @cached_property
    def _fused_position(self) -> FormulaFunction:
        """(z, u, u1, u2, p, row scale, column floor) -> coordinates with their rates, what is judged, and distances:
        the formulas of all blocks and pairs one after the other."""
        e = self.equations
        inputs = len(e.input_kinds)
        counts = len(e.unknowns), inputs, inputs, inputs, *self.scale_counts
        instructions, (z, u, u1, u2, *scales) = recorded_arguments(counts)
        judged = self.judge(z[None], InputSamples(u[None], u1[None], u2[None]), Scales(*scales))
        results = [*judged.coordinate_rates.reshape(-1), *(values[0] for values in judged.result)]
        results += list(judged.distances[0])
        formula = formula_of_results(instructions, [number_of(result, instructions) for result in results])
        return FormulaFunction(formula, counts, ((1, len(results)),))


def acceptance_functions(mechanism: Mechanism) -> AcceptanceFunctions:
    """The program of a structure's acceptance; mechanisms that differ in their links' dimensions share one."""
    return _cached_functions(equation_structure(mechanism))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_functions(structure: Mechanism) -> AcceptanceFunctions:
    return AcceptanceFunctions(structure, equation_functions(structure))
