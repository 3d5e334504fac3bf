"""Newton's step of one block at complex unknowns and numbers, as numpy code over lanes."""

from __future__ import annotations

from collections.abc import Mapping
from math import ceil
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.kernel import KernelEquations, KernelInstructions, Operand
from planar.codegen.printed_formula import PrintedFunction, compile_numpy
from planar.equations.linear import solve_by_elimination
from planar.equations.rates import block_jacobian
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.instruction_list import UnsupportedOperation, required_values
from planar.model.pairs import MeasureKind

ANALYTIC_OPERATIONS = frozenset({"input", "const", "add", "sub", "mul", "div", "neg", "cos", "sin"})
"""What a step may be made of: functions that keep their derivative at complex places."""


class ComplexNewtonStep:
    """What Newton's method takes away from a block's unknowns, by operands that are complex arrays (lanes,).

    An angle enters by its cos and sin. `operands`: what has to be given, the block's own unknowns among it. Raises
    UnsupportedOperation for a block whose equations are no polynomials in these.
    """

    def __init__(self, equations: KernelEquations, block: Block):
        e = equations.equations
        if any(row.kind is not MeasureKind.LENGTH for row in e.rows[block.rows]):
            raise UnsupportedOperation("an angle closes modulo a turn, or counts turns")
        instructions = KernelInstructions(equations, (), False, frozenset(), frozenset())
        jacobian = block_jacobian(e, block.rows, block.unknowns)
        rng = np.random.default_rng(0)
        function = ca.Function("jacobian", [e.z, e.u, e.p], [jacobian])
        sample = function(*(rng.uniform(0.5, 2.0, symbol.numel()) for symbol in (e.z, e.u, e.p))).full()
        outputs = [solve_by_elimination(jacobian, e.F[block.rows], sample)]
        made, wanted = instructions.hoister.result, instructions.list_values(outputs, 0)
        operands: dict[int, Operand] = {}
        for number in required_values(made, wanted):
            operation, _, _, key = made.instructions[number]
            if operation not in ANALYTIC_OPERATIONS:
                raise UnsupportedOperation(f"{operation} has no derivative at complex places")
            if key is not None:
                operands[number] = key
        is_angle = {"z": equations.is_angle, "u": equations.input_is_angle}
        bare = [(name, k) for name, k in operands.values() if name in is_angle and is_angle[name][k]]
        if bare:
            raise UnsupportedOperation(f"an angle stands outside cos and sin: {bare[0]}")
        self.operands: tuple[Operand, ...] = tuple(operands.values())
        self.function: PrintedFunction = compile_numpy(made, wanted, tuple(operands))

    def __call__(self, values: dict[Operand, Any]) -> tuple[ComplexArray, ...]:
        """The step of each unknown (lanes,)."""
        return self.function(*(values[each] for each in self.operands))


LANES = 2048
"""Solutions at once, whose values stay in the cache."""
FIRST_STEP, LEAST_STEP, TANGENT_STEP = 0.1, 1e-4, 1e-5
"""Of the way: the first step, the least (what needs a shorter one comes to where solutions meet, or goes off), and that
by which the direction at the beginning is told."""
MAX_STEPS = 200
"""Steps of the slowest lane, those that were taken back with them."""
KNOWN_PLACES = 4
"""Places before by which the next is predicted."""
END_CORRECTIONS, END_TOLERANCE = 3, 1e-9
"""Newton's steps at the end, the last of which moves nothing by more (rad, sizes)."""
COMPACTION_RATIO = 0.7
"""Where less than this part of the lanes goes on, the others are left behind."""
LARGEST_UNKNOWN = 40.0
"""Imaginary rad, or sizes: what is greater goes to infinity."""


class Tolerances(NamedTuple):
    """By how much (rad, sizes) Newton's method may correct what was predicted, and what its second step may add."""

    first: float = 0.2
    second: float = 1e-2

    def narrowed(self) -> Tolerances:
        """Tolerances at which paths keep apart that came to one end by these."""
        return Tolerances(0.1 * self.first, 0.01 * self.second)


class BlockSolutions(NamedTuple):
    """Solutions: lengths and angles (unknowns, lanes), and exp(i angle) of the latter (angles, lanes)."""

    unknowns: ComplexArray
    directions: ComplexArray

    def select(self, lanes: IntArray | BoolArray | slice) -> BlockSolutions:
        """Those of some lanes."""
        return BlockSolutions(self.unknowns[:, lanes], self.directions[:, lanes])


class FollowedSolutions(NamedTuple):
    """Where paths came to, and which of them came to the end (lanes,)."""

    solutions: BlockSolutions
    arrived: BoolArray


class BlockPaths:
    """Follows the solutions of one block; `base`: arrays p, u and z (rows, 1) of a design near the others.

    The block's numbers are what its equations take beside its own unknowns: lengths, and of angles the tangent of a
    quarter of how far they are from the base's, so that cos and sin stay such at complex numbers. Raises
    UnsupportedOperation, see `ComplexNewtonStep`.
    """

    def __init__(self, equations: KernelEquations, block: Block, base: Mapping[str, Array]):
        self.step, self.block = ComplexNewtonStep(equations, block), block
        own = range(block.unknowns.start, block.unknowns.stop)
        self.angles: IntArray = np.array([k - own.start for k in own if equations.is_angle[k]], dtype=int)
        self.lengths: IntArray = np.array([k - own.start for k in own if not equations.is_angle[k]], dtype=int)
        self.unknown_count = len(own)
        held = dict.fromkeys((name[0], k) for name, k in self.step.operands if name[0] != "z" or k not in own)
        turned = {"z": equations.is_angle, "u": equations.input_is_angle}
        self.number_operands: tuple[Operand, ...] = tuple(held)
        self.base_angles = [float(base[name][k][0]) if name in turned and turned[name][k] else None for name, k in held]

    def numbers(self, rows: Mapping[str, Array]) -> Array:
        """The block's numbers (numbers, lanes), of arrays p, u and z (rows, lanes)."""
        found = np.empty((len(self.number_operands), rows["p"].shape[1]))
        for row, (name, k), angle in zip(found, self.number_operands, self.base_angles, strict=True):
            row[:] = rows[name][k]
            if angle is not None:
                row[:] = np.tan(0.25 * (np.remainder(row - angle + np.pi, 2.0 * np.pi) - np.pi))
        return found

    def rows(self, numbers: Array, others: Mapping[str, Array]) -> dict[str, Array]:
        """Arrays p, u and z (rows, lanes) with the block's numbers; what it does not take is as in `others`."""
        found = {name: np.repeat(row, numbers.shape[1], axis=1) for name, row in others.items()}
        for row, (name, k), angle in zip(numbers, self.number_operands, self.base_angles, strict=True):
            found[name][k] = row if angle is None else angle + 4.0 * np.arctan(row)
        return found

    def solutions(self, unknowns: Array | ComplexArray) -> BlockSolutions:
        """Solutions from their unknowns (unknowns, lanes)."""
        whole = unknowns.astype(complex)
        return BlockSolutions(whole, np.exp(1j * whole[self.angles]))

    @staticmethod
    def conjugate(solutions: BlockSolutions) -> BlockSolutions:
        """The conjugates of solutions: at real numbers they are solutions too."""
        return BlockSolutions(solutions.unknowns.conj(), 1.0 / solutions.directions.conj())

    def newton_step(self, at: BlockSolutions, numbers: ComplexArray) -> ComplexArray:
        """What Newton's method takes away from the unknowns (unknowns, lanes), at numbers (numbers, lanes)."""
        first, values = self.block.unknowns.start, {}
        for row, (name, k), angle in zip(numbers, self.number_operands, self.base_angles, strict=True):
            if angle is None:
                values[name, k] = row
                continue
            scale = 1.0 / (1.0 + row * row)
            half_cos, half_sin = (1.0 - row * row) * scale, 2.0 * row * scale
            cos, sin = half_cos * half_cos - half_sin * half_sin, 2.0 * half_cos * half_sin
            values[f"{name}c", k] = cos * np.cos(angle) - sin * np.sin(angle)
            values[f"{name}s", k] = sin * np.cos(angle) + cos * np.sin(angle)
        inverse = 1.0 / at.directions
        cos, sin = 0.5 * (at.directions + inverse), -0.5j * (at.directions - inverse)
        for k, c, s in zip(self.angles.tolist(), cos, sin, strict=True):
            values["zc", first + k], values["zs", first + k] = c, s
        values |= {("z", first + k): at.unknowns[k] for k in self.lengths.tolist()}
        step = self.step(values)
        return np.array([np.broadcast_to(each, at.unknowns.shape[1:]) for each in step])

    def move(self, at: BlockSolutions, by: ComplexArray) -> BlockSolutions:
        """Solutions moved on by so much (unknowns, lanes): directions turn by the fourth order's fraction for exp."""
        turn = 1j * by[self.angles]
        even, odd = 1.0 + turn * turn * (1.0 / 12.0), 0.5 * turn
        return BlockSolutions(at.unknowns + by, at.directions * ((even + odd) / (even - odd)))

    def follow(
        self, at: BlockSolutions, begin: ComplexArray, end: ComplexArray, tolerances: Tolerances
    ) -> FollowedSolutions:
        """Solutions at numbers `begin` followed to the numbers `end`, both (numbers, lanes), on the straight way."""
        count = at.unknowns.shape[1]
        unknowns, directions = np.full_like(at.unknowns, np.nan), np.full_like(at.directions, np.nan)
        arrived = np.zeros(count, dtype=bool)
        with np.errstate(all="ignore"):  # what goes astray ends as what is no number
            for lanes in np.array_split(np.arange(count), max(1, ceil(count / LANES))):
                found = _Followed(self, at.select(lanes), begin[:, lanes], end[:, lanes], tolerances).run()
                ended, sizes = self._polish(found.solutions, end[:, lanes])
                unknowns[:, lanes], directions[:, lanes] = ended
                arrived[lanes] = found.arrived & (sizes <= END_TOLERANCE)
        return FollowedSolutions(BlockSolutions(unknowns, directions), arrived)

    def _polish(self, at: BlockSolutions, numbers: ComplexArray) -> tuple[BlockSolutions, Array]:
        """Solutions carried to round-off, and by how much the last step still moved them (lanes,)."""
        step = np.full_like(at.unknowns, np.nan)
        for _ in range(END_CORRECTIONS):
            step = self.newton_step(at, numbers)
            at = self.move(at, -step)
        unknowns = at.unknowns.copy()
        unknowns[self.angles] = -1j * np.log(at.directions)  # what was added up is only nearly that
        return BlockSolutions(unknowns, at.directions), np.max(np.abs(step), axis=0)


class _Followed:
    """Some lanes on their way."""

    def __init__(
        self,
        paths: BlockPaths,
        at: BlockSolutions,
        begin: ComplexArray,
        end: ComplexArray,
        tolerances: Tolerances,
    ):
        self.paths, self.tolerances = paths, tolerances
        self.at, self.begin, self.change = at, begin, end - begin
        count = at.unknowns.shape[1]
        self.way, self.length = np.zeros(count), np.full(count, FIRST_STEP)
        self.lanes = np.arange(count)
        self.times = np.full((KNOWN_PLACES, count), np.nan)
        self.places = np.full((KNOWN_PLACES, *at.unknowns.shape), np.nan + 0j)
        # the direction at the beginning as a place just before it
        self.times[0], self.times[1] = 0.0, -TANGENT_STEP
        self.places[0] = at.unknowns
        self.places[1] = at.unknowns + paths.newton_step(at, begin + TANGENT_STEP * self.change)

    def run(self) -> FollowedSolutions:
        """See `BlockPaths.follow`."""
        unknowns, directions = self.at.unknowns.copy(), self.at.directions.copy()
        arrived = np.zeros(len(self.way), dtype=bool)
        for _ in range(MAX_STEPS):
            self._advance()
            ended = self.way >= 1.0
            going = ~ended & (self.length > LEAST_STEP)
            if np.count_nonzero(going) > COMPACTION_RATIO * len(going):
                continue
            unknowns[:, self.lanes], directions[:, self.lanes] = self.at
            arrived[self.lanes] = ended
            self._keep(np.flatnonzero(going))
            if not self.lanes.size:
                break
        if self.lanes.size:
            unknowns[:, self.lanes], directions[:, self.lanes] = self.at
            arrived[self.lanes] = self.way >= 1.0
        return FollowedSolutions(BlockSolutions(unknowns, directions), arrived)

    def _keep(self, which: IntArray) -> None:
        self.at, self.lanes = self.at.select(which), self.lanes[which]
        self.begin, self.change = self.begin[:, which], self.change[:, which]
        self.way, self.length = self.way[which], self.length[which]
        self.times, self.places = self.times[:, which], self.places[:, :, which]

    def _advance(self) -> None:
        """One step of every lane; where its corrections are too great it is taken back, and the next one is shorter."""
        left = 1.0 - self.way
        length = np.where(self.length >= 0.8 * left, left, self.length)
        ahead = np.where(length == left, 1.0, self.way + length)
        tried = self.paths.move(self.at, self._prediction(ahead))
        numbers, sizes = self.begin + ahead * self.change, []
        for _ in range(2):
            step = self.paths.newton_step(tried, numbers)
            sizes.append(np.max(np.abs(step), axis=0))
            tried = self.paths.move(tried, -step)
        first, second = sizes
        good = (first <= self.tolerances.first) & (second <= self.tolerances.second) & (self.way < 1.0)
        size = np.abs(tried.unknowns)
        size[self.paths.angles] = np.abs(tried.unknowns[self.paths.angles].imag)
        good &= np.max(size, axis=0) < LARGEST_UNKNOWN
        known = np.count_nonzero(np.isfinite(self.times), axis=0)
        growth = np.clip((0.3 * self.tolerances.first / np.maximum(first, 1e-300)) ** (1.0 / known), 0.5, 2.5)
        self.length = np.where(self.way >= 1.0, self.length, np.where(good, length * growth, 0.4 * length))
        self.way = np.where(good, ahead, self.way)
        self.at = BlockSolutions(*(np.where(good, new, old) for new, old in zip(tried, self.at, strict=True)))
        self.times = np.where(good, np.concatenate([ahead[None], self.times[:-1]]), self.times)
        self.places = np.where(good, np.concatenate([tried.unknowns[None], self.places[:-1]]), self.places)

    def _prediction(self, ahead: Array) -> ComplexArray:
        """How far the unknowns go (unknowns, lanes), by Newton's divided differences of the places before."""
        times, level = self.times, self.places
        total, factor = np.zeros_like(self.at.unknowns), np.ones_like(ahead)
        for order in range(1, KNOWN_PLACES):
            level = (level[:-1] - level[1:]) / (times[: KNOWN_PLACES - order] - times[order:])[:, None]
            factor = factor * (ahead - times[order - 1])
            total = total + np.where(np.isfinite(times[order]), factor * level[0], 0.0)
        return total
