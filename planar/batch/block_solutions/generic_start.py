"""All complex solutions of a block at numbers drawn at random, from which those of every design are reached.

At real numbers drawn about the reference design's they are the complete list of `planar.assemblies`; from there they
are followed to complex numbers, between which and those of any design solutions meet nowhere but by accident (A. P.
Morgan, A. J. Sommese, Coefficient-parameter polynomial continuation, Appl. Math. Comput. 29, 1989).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.assemblies.block_roots import complex_assemblies
from planar.batch.block_solutions.block_paths import BlockPaths, BlockSolutions, Tolerances
from planar.foundation.arrays import Array, ComplexArray, IntArray
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
