"""All complex solutions of a block at numbers drawn at random, from which those of every design are reached.

One solution is followed round loops of complex numbers, at whose end it is another one: so all are found in turn
(monodromy; T. Duff and others, Solving polynomial systems via homotopy continuation and monodromy, IMA J. Numer. Anal.
39, 2019). A loop from all but one of K solutions misses the last with a probability of about 1/K.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from planar.batch.block_solutions.block_paths import BlockPaths, BlockSolutions, Tolerances
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray

MAX_SOLUTIONS = 64
"""Complex solutions of a block of which all are followed; what has more is searched from starts."""
LOOPS = 8
"""Loops that are gone round side by side."""
IDLE_ROUNDS, MAX_ROUNDS = 2, 16
"""Rounds of loops that find nothing new, after which nothing more is looked for; and of all rounds."""
SPREAD, LEAST_SIZE = 0.3, 0.3
"""How far numbers are drawn from the base's, of their size, which counts as that at least."""
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


def find_generic_start(
    paths: BlockPaths, base: Array, roots: Array, varied: BoolArray, seed: int = 0
) -> GenericStart | None:
    """A start from the base's numbers (numbers, 1) and some of its assemblies there (unknowns, roots).

    Only numbers that are `varied` (numbers,) differ from the base's. None where there are too many solutions, or the
    loops come to no end.
    """
    rng = np.random.default_rng(seed)

    def drawn(count: int) -> ComplexArray:
        size = SPREAD * np.maximum(np.abs(base), LEAST_SIZE) * varied[:, None]
        shape = (len(base), count)
        return np.asarray(base + size * (rng.normal(size=shape) + 1j * rng.normal(size=shape)))

    start, tolerances = drawn(1), Tolerances()
    first = paths.follow(
        paths.solutions(roots), _spread(base, roots.shape[1]), _spread(start, roots.shape[1]), tolerances
    )
    known = first.solutions.select(first.arrived)
    idle = 0
    for _ in range(MAX_ROUNDS):
        count = known.unknowns.shape[1]
        if idle == IDLE_ROUNDS or not 0 < count <= MAX_SOLUTIONS:
            break
        at = BlockSolutions(*(np.tile(each, (1, LOOPS)) for each in known))
        whole = _spread(start, count * LOOPS)
        corners = [whole, *(np.repeat(drawn(LOOPS), count, axis=1) for _ in range(2)), whole]
        arrived = np.ones(count * LOOPS, dtype=bool)
        for begin, end in pairwise(corners):
            followed = paths.follow(at, begin, end, tolerances)
            at, arrived = followed.solutions, arrived & followed.arrived
        both = BlockSolutions(
            *(np.concatenate([old, new[:, arrived]], axis=1) for old, new in zip(known, at, strict=True))
        )
        known = both.select(first_of_each(paths, both))
        idle = idle + 1 if known.unknowns.shape[1] == count else 0
    return GenericStart(start, known) if idle == IDLE_ROUNDS else None


def move_generic_start(paths: BlockPaths, start: GenericStart, seed: int) -> GenericStart | None:
    """The same at other numbers; None where some solution does not come there."""
    rng = np.random.default_rng(seed)
    turned = np.exp(1j * rng.uniform(0.0, 2.0 * np.pi, start.numbers.shape))
    real = start.numbers.real
    other = real + (start.numbers - real) * turned
    count = start.solution_count
    followed = paths.follow(
        start.solutions, _spread(start.numbers, count), _spread(other, count), Tolerances().narrowed()
    )
    apart = len(first_of_each(paths, followed.solutions)) == count
    return GenericStart(other, followed.solutions) if apart and followed.arrived.all() else None


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


def _spread(numbers: ComplexArray | Array, lanes: int) -> ComplexArray:
    return np.repeat(numbers, lanes, axis=1).astype(complex)
