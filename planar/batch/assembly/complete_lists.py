"""All assemblies of larger blocks, of many designs at once: every complex solution followed from design to design.

At real numbers drawn about the reference design's they are the complete list of `planar.assemblies`; from there they
are followed to complex numbers, between which and those of any design solutions meet nowhere but by accident (A. P.
Morgan, A. J. Sommese, Coefficient-parameter polynomial continuation, Appl. Math. Comput. 29, 1989).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from math import ceil
from threading import Lock
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.assemblies.block_roots import complex_assemblies
from planar.batch.march.kernel import KernelEquations, Operand, kernel_equations
from planar.batch.march.kernel_writer import KernelWriter
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.printed_formula import PrintedFunction, compile_numpy
from planar.equations.linear import solve_by_elimination
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.rates import block_jacobian
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.instruction_list import UnsupportedOperation, required_values
from planar.model.pairs import MeasureKind

ANALYTIC_OPERATIONS = frozenset({"input", "const", "add", "sub", "mul", "div", "neg", "cos", "sin"})
"""What a step may be made of: functions that keep their derivative at complex places."""
LANES = 2048
"""Solutions at once, whose values stay in the cache."""
FIRST_STEP, LEAST_STEP, TANGENT_STEP = 0.1, 1e-4, 1e-5
"""Parts of the path: the first step, the least (what needs a shorter one comes to where solutions meet, or goes off),
and that by which the direction at the beginning is found."""
MAX_STEPS = 200
"""Steps of the slowest lane, those that were taken back with them."""
KNOWN_PLACES = 4
"""Places before by which the next is predicted."""
END_CORRECTIONS, END_TOLERANCE = 3, 1e-9
"""Newton's steps at the end, the last of which moves nothing by more (rad, sizes)."""
COMPACTION_RATIO = 0.7
"""Where less than this part of the lanes goes on, the others are dropped."""
LARGEST_UNKNOWN = 40.0
"""Imaginary rad, or sizes: what is greater goes to infinity."""
Tolerances = tuple[float, float]
"""By how much (rad, sizes) Newton's method may correct what was predicted, and what its second step may add."""
TOLERANCES: tuple[Tolerances, Tolerances] = (0.2, 1e-2), (0.02, 1e-4)
"""Of the paths from one start; and from another where some of these are lost, at which paths keep apart that came to
one end by the first."""


def compile_newton_step(equations: KernelEquations, block: Block) -> tuple[PrintedFunction, tuple[Operand, ...]]:
    """Newton's step of a block at complex unknowns and numbers: what it takes away from the unknowns (lanes,), as a
    function of operands, the block's own unknowns among them, that are complex arrays (lanes,); and these operands.

    An angle enters by its cos and sin. Raises UnsupportedOperation for a block whose equations are no polynomials in
    these.
    """
    e = equations.equations
    if any(row.kind is not MeasureKind.LENGTH for row in e.rows[block.rows]):
        raise UnsupportedOperation("an angle closes modulo a turn, or counts turns")
    writer = KernelWriter(equations, (), False, 1)
    jacobian = block_jacobian(e, block.rows, block.unknowns)
    rng = np.random.default_rng(0)
    function = ca.Function("jacobian", [e.z, e.u, e.p], [jacobian])
    sample = function(*(rng.uniform(0.5, 2.0, symbol.numel()) for symbol in (e.z, e.u, e.p))).full()
    outputs = [solve_by_elimination(jacobian, e.F[block.rows], sample)]
    values, listing = writer.list_values(outputs, 0), writer.hoister.result
    operands: dict[int, Operand] = {}
    for number in required_values(listing, values):
        operation, _, _, key = listing.instructions[number]
        if operation not in ANALYTIC_OPERATIONS:
            raise UnsupportedOperation(f"{operation} has no derivative at complex places")
        if key is not None:
            operands[number] = key
    is_angle = {"z": equations.is_angle, "u": equations.input_is_angle}
    bare = [(name, k) for name, k in operands.values() if name in is_angle and is_angle[name][k]]
    if bare:
        raise UnsupportedOperation(f"an angle stands outside cos and sin: {bare[0]}")
    return compile_numpy(listing, values, tuple(operands)), tuple(operands.values())


class BlockPaths:
    """Follows the solutions of one block; `base`: arrays p, u and z (rows, 1) of a design near the others.

    The block's numbers are what its equations take beside its own unknowns: lengths, and of angles the tangent of a
    quarter of how far they are from the base's, so that cos and sin stay such at complex numbers. Raises
    UnsupportedOperation, see `compile_newton_step`.
    """

    def __init__(self, equations: KernelEquations, block: Block, base: Mapping[str, Array]):
        (self.step, self.step_operands), self.block = compile_newton_step(equations, block), block
        unknowns = range(block.unknowns.start, block.unknowns.stop)
        is_angle = np.array([equations.is_angle[k] for k in unknowns], dtype=bool)
        self.angles: IntArray = np.flatnonzero(is_angle)
        self.lengths: IntArray = np.flatnonzero(~is_angle)
        self.unknown_count = len(unknowns)
        numbers = dict.fromkeys((name[0], k) for name, k in self.step_operands if name[0] != "z" or k not in unknowns)
        self.number_operands: tuple[Operand, ...] = tuple(numbers)
        angles = {"z": equations.is_angle, "u": equations.input_is_angle}
        self.base_angles = [
            float(base[name][k][0]) if name in angles and angles[name][k] else None for name, k in numbers
        ]

    def numbers(self, rows: Mapping[str, Array]) -> Array:
        """The block's numbers (numbers, lanes), of arrays p, u and z (rows, lanes)."""
        numbers = np.empty((len(self.number_operands), rows["p"].shape[1]))
        for row, (name, k), angle in zip(numbers, self.number_operands, self.base_angles, strict=True):
            row[:] = rows[name][k]
            if angle is not None:
                row[:] = np.tan(0.25 * (np.remainder(row - angle + np.pi, 2.0 * np.pi) - np.pi))
        return numbers

    def rows(self, numbers: Array, others: Mapping[str, Array]) -> dict[str, Array]:
        """Arrays p, u and z (rows, lanes) with the block's numbers; what it does not take is as in `others`."""
        rows = {name: np.repeat(row, numbers.shape[1], axis=1) for name, row in others.items()}
        for row, (name, k), angle in zip(numbers, self.number_operands, self.base_angles, strict=True):
            rows[name][k] = row if angle is None else angle + 4.0 * np.arctan(row)
        return rows

    def newton_step(self, z: ComplexArray, numbers: ComplexArray) -> ComplexArray:
        """What Newton's method takes away from the block's unknowns z (unknowns, lanes), at numbers (numbers,
        lanes)."""
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
        direction = np.exp(1j * z[self.angles])
        inverse = 1.0 / direction
        cos, sin = 0.5 * (direction + inverse), -0.5j * (direction - inverse)
        for k, c, s in zip(self.angles.tolist(), cos, sin, strict=True):
            values["zc", first + k], values["zs", first + k] = c, s
        values |= {("z", first + k): z[k] for k in self.lengths.tolist()}
        step = self.step(*(values[operand] for operand in self.step_operands))
        return np.array([np.broadcast_to(part, z.shape[1:]) for part in step])

    def follow(
        self, start: ComplexArray, begin: ComplexArray, end: ComplexArray, tolerances: Tolerances
    ) -> tuple[ComplexArray, BoolArray]:
        """Solutions (unknowns, lanes) at numbers `begin` followed to the numbers `end`, both (numbers, lanes), on the
        straight path, angles between -pi and pi; and which of them came to the end (lanes,)."""
        count = start.shape[1]
        solutions, arrived = np.full_like(start, np.nan), np.zeros(count, dtype=bool)
        with np.errstate(all="ignore"):  # what goes astray ends as what is no number
            for lanes in np.array_split(np.arange(count), max(1, ceil(count / LANES))):
                z, came = _LanePaths(self, start[:, lanes], begin[:, lanes], end[:, lanes], tolerances).run()
                step = np.full_like(z, np.nan)
                for _ in range(END_CORRECTIONS):
                    step = self.newton_step(z, end[:, lanes])
                    z = z - step
                solutions[:, lanes], arrived[lanes] = z, came & (np.max(np.abs(step), axis=0) <= END_TOLERANCE)
            angles = solutions[self.angles]
            solutions[self.angles] = np.remainder(angles.real + np.pi, 2.0 * np.pi) - np.pi + 1j * angles.imag
        return solutions, arrived

    def keys(self, solutions: ComplexArray) -> ComplexArray:
        """A number for each solution (lanes,), by which any two are told apart."""
        rng = np.random.default_rng(1)
        parts = np.concatenate([np.exp(1j * solutions[self.angles]), solutions[self.lengths]])
        weights = rng.normal(size=len(parts)) + 1j * rng.normal(size=len(parts))
        return np.asarray(weights @ parts)


class _LanePaths:
    """Some lanes on their paths."""

    def __init__(
        self,
        paths: BlockPaths,
        start: ComplexArray,
        begin: ComplexArray,
        end: ComplexArray,
        tolerances: Tolerances,
    ):
        self.paths, self.tolerances = paths, tolerances
        self.begin, self.change = begin, end - begin
        count = start.shape[1]
        self.length = np.full(count, FIRST_STEP)
        self.lanes = np.arange(count)
        self.times = np.full((KNOWN_PLACES, count), np.nan)
        self.places = np.full((KNOWN_PLACES, *start.shape), np.nan + 0j)
        "parts of the path at the last places (unknowns, lanes), the newest first"
        # the direction at the beginning as a place just before it
        self.times[0], self.times[1] = 0.0, -TANGENT_STEP
        self.places[0] = start
        self.places[1] = start + paths.newton_step(start, begin + TANGENT_STEP * self.change)

    def run(self) -> tuple[ComplexArray, BoolArray]:
        """Where the lanes came to (unknowns, lanes), and which of them came to the end."""
        solutions = self.places[0].copy()
        arrived = np.zeros(len(self.times[0]), dtype=bool)
        for step in range(MAX_STEPS):
            self._advance()
            ended = self.times[0] >= 1.0
            going = ~ended & (self.length > LEAST_STEP)
            if np.count_nonzero(going) > COMPACTION_RATIO * len(going) and step < MAX_STEPS - 1:
                continue
            solutions[:, self.lanes], arrived[self.lanes] = self.places[0], ended
            self.lanes, self.length = self.lanes[going], self.length[going]
            self.begin, self.change = self.begin[:, going], self.change[:, going]
            self.times, self.places = self.times[:, going], self.places[:, :, going]
            if not self.lanes.size:
                break
        return solutions, arrived

    def _advance(self) -> None:
        """One step of every lane; where its corrections are too great it is taken back, and the next one is shorter."""
        rest = 1.0 - self.times[0]
        length = np.where(self.length >= 0.8 * rest, rest, self.length)
        ahead = np.where(length == rest, 1.0, self.times[0] + length)
        tried = self.places[0] + self._prediction(ahead)
        numbers, sizes = self.begin + ahead * self.change, []
        for _ in range(2):
            step = self.paths.newton_step(tried, numbers)
            sizes.append(np.max(np.abs(step), axis=0))
            tried = tried - step
        first, second = sizes
        good = (first <= self.tolerances[0]) & (second <= self.tolerances[1]) & (self.times[0] < 1.0)
        size = np.abs(tried)
        size[self.paths.angles] = np.abs(tried[self.paths.angles].imag)
        good &= np.max(size, axis=0) < LARGEST_UNKNOWN
        known = np.count_nonzero(np.isfinite(self.times), axis=0)
        growth = np.clip((0.3 * self.tolerances[0] / np.maximum(first, 1e-300)) ** (1.0 / known), 0.5, 2.5)
        self.length = np.where(self.times[0] >= 1.0, self.length, np.where(good, length * growth, 0.4 * length))
        self.times = np.where(good, np.concatenate([ahead[None], self.times[:-1]]), self.times)
        self.places = np.where(good, np.concatenate([tried[None], self.places[:-1]]), self.places)

    def _prediction(self, ahead: Array) -> ComplexArray:
        """How far the unknowns go (unknowns, lanes), by Newton's divided differences of the places before."""
        times, level = self.times, self.places
        total, factor = np.zeros_like(self.places[0]), np.ones_like(ahead)
        for order in range(1, KNOWN_PLACES):
            level = (level[:-1] - level[1:]) / (times[: KNOWN_PLACES - order] - times[order:])[:, None]
            factor = factor * (ahead - times[order - 1])
            total = total + np.where(np.isfinite(times[order]), factor * level[0], 0.0)
        return total


MAX_SOLUTIONS = 64
"""Complex solutions of a block of which all are followed; what has more is searched from starts."""
TRIES = 3
"""Draws of complex numbers, of which one has to be reached by all solutions."""
REAL_SPREAD, SPREAD, LEAST_SIZE = 0.15, 0.3, 0.3
"""How far real and complex numbers are drawn from the reference design's, of their size, which counts as that at least.
"""
SAME_SOLUTION = 1e-5
"""Of directions and lengths: nearer solutions are one."""
MAX_UNKNOWNS = 8
"""Unknowns of a block of which all solutions are looked for, once, in about a second at most."""
REAL_TOLERANCE, UNDECIDED_TOLERANCE = 1e-7, 1e-4
"""Imaginary parts (rad, sizes) up to which a solution is real, and above which it surely is not."""
NEW_DIRECTION, MAX_SPANNING = 1e-8, 200
"""How far numbers lie off the directions that are known where that is a new one; designs that are looked at at once."""
MAX_LANES = 2**16
"""Solutions that are followed in one go, so that they find room."""

GenericStart = tuple[ComplexArray, ComplexArray]
"""Numbers (numbers, 1), and all solutions there (unknowns, lanes)."""


class CompleteLists(NamedTuple):
    """Assemblies of a block: its unknowns (unknowns, lanes, solutions), which of them are real (lanes, solutions), and
    for which lanes these surely are all (lanes,)."""

    unknowns: Array
    exists: BoolArray
    is_complete: BoolArray


class BlockListing:
    """All assemblies of one block of a reference design's designs. Raises UnsupportedOperation.

    The complete list is made when designs are first asked for, and again where they differ from the base's in what none
    did before.
    """

    def __init__(self, reference: ReferenceDesign, block: Block):
        equations = kernel_equations(reference.functions, equation_structure(reference.mechanism))
        if reference.candidates.counts_turns or not 2 < slice_length(block.unknowns) <= MAX_UNKNOWNS:
            raise UnsupportedOperation("its solutions are not all followed")
        if not reference.candidates.sketched_by_level.get(block.block_index):
            raise UnsupportedOperation("without a sketch any assembly will do")
        inputs, unknown_count = reference.solver.inputs, len(reference.functions.equations.unknowns)
        self.setup = reference.solver
        self.base = {"p": inputs.p[:, None], "u": inputs.u[:, None], "z": np.zeros((unknown_count, 1))}
        self.paths = BlockPaths(equations, block, self.base)
        self.base_numbers = self.paths.numbers(self.base)
        self._span = np.zeros((len(self.base_numbers), 0))
        "directions in which numbers of any designs yet differ from the base's, orthonormal"
        self._starts: tuple[GenericStart, ...] | None = None
        self._lock = Lock()  # one listing serves all threads

    def assemblies(self, rows: Mapping[str, Array]) -> CompleteLists | None:
        """Of designs with arrays p, u and z (rows, lanes), where the unknowns before the block are known in z.

        None where not all solutions are found of which they would be made.
        """
        numbers = self.paths.numbers(rows)
        known = np.isfinite(numbers).all(axis=0)
        with self._lock:
            starts = self._generic_starts(numbers[:, known])
        if not starts:
            return None
        lanes, count = numbers.shape[1], starts[0][1].shape[1]
        lists = CompleteLists(
            np.full((self.paths.unknown_count, lanes, count), np.nan),
            np.zeros((lanes, count), dtype=bool),
            np.zeros(lanes, dtype=bool),
        )
        most = max(1, MAX_LANES // count)
        with np.errstate(all="ignore"):  # what goes astray ends as what is no number
            for start, tolerances in zip(starts, TOLERANCES, strict=True):
                rest = np.flatnonzero(known & ~lists.is_complete)
                for part in np.split(rest, range(most, len(rest), most)) if rest.size else ():
                    of_part = self._lead(start, numbers[:, part], tolerances)
                    lists.unknowns[:, part], lists.exists[part], lists.is_complete[part] = of_part
        return lists

    def extend(self, z: Array, exists: BoolArray, p: Array, u: Array) -> tuple[Array, BoolArray, BoolArray]:
        """Partial assemblies z (unknowns, designs, options), of which some exist (designs, options), each with all
        assemblies of the block: all unknowns (unknowns, designs, options, assemblies), which exist, and for which
        designs these are all.

        p and u are (rows, designs).
        """
        designs, options = np.nonzero(exists)
        lists = self.assemblies({"p": p[:, designs], "u": u[:, designs], "z": z[:, designs, options]})
        if lists is None:
            return z[..., None], exists[..., None], np.zeros(len(exists), dtype=bool)
        is_complete = np.ones(len(exists), dtype=bool)
        is_complete[designs[~lists.is_complete]] = False
        width = int(lists.exists.sum(axis=1).max(initial=1))
        order = np.argsort(~lists.exists, axis=1, kind="stable")[:, :width]
        extended = np.repeat(z[..., None], width, axis=3)
        extended_exists = np.zeros((*exists.shape, width), dtype=bool)
        extended_exists[designs, options] = np.take_along_axis(lists.exists, order, axis=1)
        unknowns = extended[self.paths.block.unknowns]
        unknowns[:, designs, options] = np.take_along_axis(lists.unknowns, order[None], axis=2)
        return extended, extended_exists, is_complete

    def _generic_starts(self, numbers: Array) -> tuple[GenericStart, ...]:
        """Starts at numbers that differ from the base's where those of any designs yet did; none where there are none.

        Numbers that are tied to each other in all designs stay so: there may be fewer solutions then.
        """
        while True:
            offsets = numbers - self.base_numbers
            offsets = offsets - self._span @ (self._span.T @ offsets)
            far = np.flatnonzero(np.linalg.norm(offsets, axis=0) > NEW_DIRECTION)
            if not far.size:
                break
            sample = offsets[:, far[:: -(-len(far) // MAX_SPANNING)]]
            directions, sizes, _ = np.linalg.svd(sample / np.linalg.norm(sample, axis=0), full_matrices=False)
            self._span = np.linalg.qr(np.hstack([self._span, directions[:, sizes > NEW_DIRECTION]]))[0]
            self._starts = None
        if self._starts is None:
            self._starts = tuple(self._find_starts())
        return self._starts

    def _find_starts(self) -> list[GenericStart]:
        """A start for each of `TOLERANCES` at numbers that differ from the base's in the directions of the span; none
        where not all solutions are found, or they are too many."""
        rng, paths, span = np.random.default_rng(0), self.paths, self._span
        sizes = np.linalg.norm(span * np.maximum(np.abs(self.base_numbers), LEAST_SIZE), axis=0)
        real_offsets = REAL_SPREAD * sizes * rng.normal(size=len(sizes))
        rows = paths.rows(self.base_numbers + span @ real_offsets[:, None], self.base)
        assemblies = complex_assemblies(self.setup, paths.block, (rows["z"][:, 0], rows["u"][:, 0], rows["p"][:, 0]))
        starts: list[GenericStart] = []
        if assemblies is None or not 0 < len(assemblies) <= MAX_SOLUTIONS:
            return starts
        count = len(assemblies)
        solutions, begin = assemblies.T.astype(complex), np.repeat(paths.numbers(rows), count, axis=1).astype(complex)
        for _ in range(TRIES + len(TOLERANCES)):
            offsets = SPREAD * sizes * (rng.normal(size=len(sizes)) + 1j * rng.normal(size=len(sizes)))
            drawn = np.asarray(self.base_numbers + span @ offsets[:, None], dtype=complex)
            ends, arrived = paths.follow(solutions, begin, np.repeat(drawn, count, axis=1), TOLERANCES[1])
            keys = paths.keys(ends)
            if arrived.all() and np.count_nonzero(_is_same(keys[:, None], keys)) == count:
                starts.append((drawn, ends))
            if len(starts) == len(TOLERANCES):
                return starts
        return []

    def _lead(self, start: GenericStart, numbers: Array, tolerances: Tolerances) -> tuple[Array, BoolArray, BoolArray]:
        """All solutions of a start led to designs (numbers, lanes), as `CompleteLists`."""
        lanes, paths, (start_numbers, solutions) = numbers.shape[1], self.paths, start
        count = solutions.shape[1]
        tiled, begin = np.tile(solutions, (1, lanes)), np.repeat(start_numbers, lanes * count, axis=1)
        ends, arrived = paths.follow(tiled, begin, np.repeat(numbers, count, axis=1).astype(complex), tolerances)
        unknowns, arrived = ends.reshape(-1, lanes, count), arrived.reshape(lanes, count)
        imaginary = np.max(np.abs(unknowns.imag), axis=0)
        exists = imaginary <= REAL_TOLERANCE
        undecided = (imaginary > REAL_TOLERANCE) & (imaginary < UNDECIDED_TOLERANCE)
        keys = paths.keys(ends).reshape(lanes, count)
        ordered = np.sort(keys, axis=1)
        distinct = np.all(~_is_same(ordered[:, 1:], ordered[:, :-1]), axis=1)
        complete = arrived.all(axis=1) & distinct & (np.count_nonzero(~exists, axis=1) % 2 == 0)
        rest = np.flatnonzero(~complete)
        if rest.size:
            # at real numbers the conjugates of solutions are solutions too
            mirrored = paths.keys(ends.conj()).reshape(lanes, count)
            complete[rest], first = _complete_with_conjugates(keys[rest], mirrored[rest], arrived[rest], exists[rest])
            exists[rest] &= first
        complete &= ~np.any(undecided & arrived, axis=1)
        return unknowns.real, exists & complete[:, None], complete


def _is_same(one: ComplexArray, other: ComplexArray) -> BoolArray:
    return np.asarray(np.abs(one - other) < SAME_SOLUTION * (1.0 + np.abs(one)))


def _complete_with_conjugates(
    keys: ComplexArray, mirrored: ComplexArray, arrived: BoolArray, is_real: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Whether the solutions that arrived are all with their conjugates (lanes,): these are solutions too.

    And which of them are not there before (lanes, solutions). `keys` are theirs, `mirrored` those of their conjugates.
    """
    count = keys.shape[1]
    earlier = np.tri(count, k=-1, dtype=bool) & arrived[:, None, :]
    first = arrived & ~np.any(_is_same(keys[:, :, None], keys[:, None, :]) & earlier, axis=2)
    partner = np.any(_is_same(mirrored[:, :, None], keys[:, None, :]) & first[:, None, :], axis=2)
    solution_count = np.count_nonzero(first, axis=1) + np.count_nonzero(first & ~is_real & ~partner, axis=1)
    return solution_count == count, first


@lru_cache(maxsize=64)
def block_listing(reference: ReferenceDesign, block_index: int) -> BlockListing | None:
    """The listing of a block, kept; None where its equations are not for that."""
    try:
        return BlockListing(reference, reference.functions.equations.blocks[block_index])
    except UnsupportedOperation:
        return None
