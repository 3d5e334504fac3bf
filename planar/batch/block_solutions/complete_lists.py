"""All complex solutions of a block at numbers drawn at random, from which those of every design are reached.

At real numbers drawn about the reference design's they are the complete list of `planar.assemblies`; from there they
are followed to complex numbers, between which and those of any design solutions meet nowhere but by accident (A. P.
Morgan, A. J. Sommese, Coefficient-parameter polynomial continuation, Appl. Math. Comput. 29, 1989).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from threading import Lock
from typing import NamedTuple

import numpy as np

from planar.assemblies.block_roots import complex_assemblies
from planar.batch.block_solutions.block_paths import BlockPaths, BlockSolutions, Tolerances
from planar.batch.march.kernel import kernel_equations
from planar.batch.reference_design import ReferenceDesign
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.instruction_list import UnsupportedOperation
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_SOLUTIONS = 64
"""Complex solutions of a block of which all are followed; what has more is searched from starts."""
TRIES = 3
"""Draws of complex numbers, of which one has to be reached by all solutions."""
REAL_SPREAD, SPREAD, LEAST_SIZE = 0.15, 0.3, 0.3
"""How far real and complex numbers are drawn from the reference design's, of their size, which counts as that at least.
"""
SAME_SOLUTION = 1e-5
"""Of directions and lengths: nearer solutions are one."""


class GenericStart(NamedTuple):
    """Numbers (numbers, 1) with all solutions there."""

    numbers: ComplexArray
    solutions: BlockSolutions

    @property
    def solution_count(self) -> int:
        """How many solutions there are."""
        return self.solutions.unknowns.shape[1]


def find_generic_starts(
    setup: PreparedMechanism, paths: BlockPaths, base: Mapping[str, Array], span: Array, many: int
) -> tuple[GenericStart, ...]:
    """So many starts about a design with arrays p, u and z (rows, 1), from which they differ in the directions of
    `span` (numbers, directions), orthonormal.

    None of them where not all solutions are found, or they are too many.
    """
    rng, own = np.random.default_rng(0), paths.numbers(base)
    sizes = np.linalg.norm(span * np.maximum(np.abs(own), LEAST_SIZE), axis=0)
    rows = paths.rows(own + span @ (REAL_SPREAD * sizes * rng.normal(size=len(sizes)))[:, None], base)
    found = complex_assemblies(setup, paths.block, (rows["z"][:, 0], rows["u"][:, 0], rows["p"][:, 0]))
    if found is None or not 0 < len(found) <= MAX_SOLUTIONS:
        return ()
    count = len(found)
    here, begin = paths.solutions(found.T), np.repeat(paths.numbers(rows), count, axis=1).astype(complex)
    starts: list[GenericStart] = []
    for _ in range(TRIES + many):
        away = SPREAD * sizes * (rng.normal(size=len(sizes)) + 1j * rng.normal(size=len(sizes)))
        drawn = np.asarray(own + span @ away[:, None], dtype=complex)
        followed = paths.follow(here, begin, np.repeat(drawn, count, axis=1), Tolerances().narrowed())
        if followed.arrived.all() and len(first_of_each(paths, followed.solutions)) == count:
            starts.append(GenericStart(drawn, followed.solutions))
        if len(starts) == many:
            return tuple(starts)
    return ()


def solution_keys(paths: BlockPaths, solutions: BlockSolutions) -> ComplexArray:
    """A number for each solution (lanes,), by which any two are told apart."""
    rng = np.random.default_rng(1)
    parts = np.concatenate([solutions.directions, solutions.unknowns[paths.lengths]])
    weights = rng.normal(size=len(parts)) + 1j * rng.normal(size=len(parts))
    return np.asarray(weights @ parts)


def first_of_each(paths: BlockPaths, solutions: BlockSolutions) -> IntArray:
    """The lanes of solutions of which none before is the same, in their order."""
    keys = solution_keys(paths, solutions)
    same = np.abs(keys[:, None] - keys) < SAME_SOLUTION * (1.0 + np.abs(keys))
    return np.asarray(np.flatnonzero(np.argmax(same, axis=1) == np.arange(len(keys))), dtype=int)


MAX_UNKNOWNS = 8
"""Unknowns of a block of which all solutions are looked for, once, in about a second at most."""
TOLERANCES = (Tolerances(), Tolerances().narrowed())
"""Of the paths from one start, and from another where some of these are lost."""
REAL_TOLERANCE, UNDECIDED_TOLERANCE = 1e-7, 1e-4
"""Imaginary parts (rad, sizes) up to which a solution is real, and above which it surely is not."""
NEW_DIRECTION, MAX_SPANNING = 1e-8, 200
"""How far numbers lie off the directions that are known where that is a new one; designs that are looked at at once."""
MAX_LANES = 2**16
"""Solutions that are followed in one go, so that they find room."""


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
        solver, unknowns = reference.solver, len(reference.functions.equations.unknowns)
        u, p = solver.inputs.u[:, None], solver.inputs.p[:, None]
        self.setup, self.base = solver, {"p": p, "u": u, "z": np.zeros((unknowns, 1))}
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
        lanes, count = numbers.shape[1], starts[0].solution_count
        found = CompleteLists(
            np.full((self.paths.unknown_count, lanes, count), np.nan),
            np.zeros((lanes, count), dtype=bool),
            np.zeros(lanes, dtype=bool),
        )
        most = max(1, MAX_LANES // count)
        with np.errstate(all="ignore"):  # what goes astray ends as what is no number
            for start, tolerances in zip(starts, TOLERANCES, strict=True):
                left = np.flatnonzero(known & ~found.is_complete)
                for some in np.split(left, range(most, len(left), most)) if left.size else ():
                    part = self._lead(start, numbers[:, some], tolerances)
                    found.unknowns[:, some], found.exists[some], found.is_complete[some] = part
        return found

    def extend(self, z: Array, exists: BoolArray, p: Array, u: Array) -> CompleteLists:
        """Partial assemblies z (unknowns, designs, ways), of which some exist (designs, ways), each with all assemblies
        of the block: all unknowns (unknowns, designs, ways of both), which exist, and for which designs these are all.

        p and u are (rows, designs).
        """
        designs, ways = np.nonzero(exists)
        found = self.assemblies({"p": p[:, designs], "u": u[:, designs], "z": z[:, designs, ways]})
        if found is None:
            return CompleteLists(z, exists, np.zeros(len(exists), dtype=bool))
        complete = np.ones(len(exists), dtype=bool)
        complete[designs[~found.is_complete]] = False
        width = int(found.exists.sum(axis=1).max(initial=1))
        order = np.argsort(~found.exists, axis=1, kind="stable")[:, :width]
        whole = np.repeat(z[..., None], width, axis=3)
        there = np.zeros((*exists.shape, width), dtype=bool)
        there[designs, ways] = np.take_along_axis(found.exists, order, axis=1)
        own = whole[self.paths.block.unknowns]
        own[:, designs, ways] = np.take_along_axis(found.unknowns, order[None], axis=2)
        shape = len(exists), exists.shape[1] * width
        return CompleteLists(whole.reshape(len(z), *shape), there.reshape(shape), complete)

    def _generic_starts(self, numbers: Array) -> tuple[GenericStart, ...]:
        """Starts at numbers that differ from the base's where those of any designs yet did; none where there are none.

        Numbers that are tied to each other in all designs stay so: there may be fewer solutions then.
        """
        grown = self._starts is None
        while True:
            away = numbers - self.base_numbers
            away = away - self._span @ (self._span.T @ away)
            far = np.flatnonzero(np.linalg.norm(away, axis=0) > NEW_DIRECTION)
            if not far.size:
                break
            some = away[:, far[:: -(-len(far) // MAX_SPANNING)]]
            directions, sizes, _ = np.linalg.svd(some / np.linalg.norm(some, axis=0), full_matrices=False)
            self._span = np.linalg.qr(np.hstack([self._span, directions[:, sizes > NEW_DIRECTION]]))[0]
            grown = True
        if grown or self._starts is None:
            self._starts = find_generic_starts(self.setup, self.paths, self.base, self._span, len(TOLERANCES))
        return self._starts

    def _lead(self, start: GenericStart, numbers: Array, tolerances: Tolerances) -> CompleteLists:
        """All solutions of a start led to designs (numbers, lanes)."""
        lanes, count, paths = numbers.shape[1], start.solution_count, self.paths
        at = BlockSolutions(*(np.tile(each, (1, lanes)) for each in start.solutions))
        begin = np.repeat(start.numbers, lanes * count, axis=1)
        followed = paths.follow(at, begin, np.repeat(numbers, count, axis=1).astype(complex), tolerances)
        unknowns = followed.solutions.unknowns.reshape(-1, lanes, count)
        arrived = followed.arrived.reshape(lanes, count)
        away = np.max(np.abs(unknowns.imag), axis=0)
        exists, undecided = away <= REAL_TOLERANCE, (away > REAL_TOLERANCE) & (away < UNDECIDED_TOLERANCE)
        keys = solution_keys(paths, followed.solutions).reshape(lanes, count)
        ordered = np.sort(keys, axis=1)
        distinct = np.all(~_is_same(ordered[:, 1:], ordered[:, :-1]), axis=1)
        complete = arrived.all(axis=1) & distinct & (np.count_nonzero(~exists, axis=1) % 2 == 0)
        some = np.flatnonzero(~complete)
        if some.size:
            mirrored = solution_keys(paths, paths.conjugate(followed.solutions)).reshape(lanes, count)
            complete[some], first = _whole_with_conjugates(keys[some], mirrored[some], arrived[some], exists[some])
            exists[some] &= first
        complete &= ~np.any(undecided & arrived, axis=1)
        return CompleteLists(unknowns.real, exists & complete[:, None], complete)


def _is_same(one: ComplexArray, other: ComplexArray) -> BoolArray:
    return np.asarray(np.abs(one - other) < SAME_SOLUTION * (1.0 + np.abs(one)))


def _whole_with_conjugates(
    keys: ComplexArray, mirrored: ComplexArray, arrived: BoolArray, is_real: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """Whether the solutions that arrived are all with their conjugates (lanes,): these are solutions too.

    And which of them are not there before (lanes, solutions). `keys` are theirs, `mirrored` those of their conjugates.
    """
    count = keys.shape[1]
    earlier = np.tri(count, k=-1, dtype=bool) & arrived[:, None, :]
    first = arrived & ~np.any(_is_same(keys[:, :, None], keys[:, None, :]) & earlier, axis=2)
    partner = np.any(_is_same(mirrored[:, :, None], keys[:, None, :]) & first[:, None, :], axis=2)
    found = np.count_nonzero(first, axis=1) + np.count_nonzero(first & ~is_real & ~partner, axis=1)
    return found == count, first


@lru_cache(maxsize=64)
def block_listing(reference: ReferenceDesign, block_index: int) -> BlockListing | None:
    """The listing of a block, kept; None where its equations are not for that."""
    try:
        return BlockListing(reference, reference.functions.equations.blocks[block_index])
    except UnsupportedOperation:
        return None
