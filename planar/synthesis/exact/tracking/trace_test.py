"""The trace test: whether solutions that were found are all, by a line in the numbers of a family and bilinear slices.

Along a line p + s v of members the solutions are a curve in unknowns and s. The slice s l(x) = 0 with l linear in the
places x meets it at the solutions of the member p and where l vanishes, nowhere at infinity. Other bilinear slices
are reached from there, and where a slice is moved by a constant, the sums of x and s of all points of an irreducible
curve move evenly, and those of some of them do not. A. Leykin, J. I. Rodriguez, F. Sottile, Trace test, Arnold Math. J.
4, 2018, section 3. Slices have the fewer points the fewer numbers a line moves: it moves those of one entry, of places
without their conjugates, and the solutions of all other rows, a curve, are taken for irreducible where the family is.
Where they are not, all parts have as many of the solutions, and random loops in all numbers lead from one to another.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.assemblies.polynomial.path_tracker import HomotopyValues, normalize, track_paths
from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family
from planar.synthesis.exact.relations.unknowns import NumberKind
from planar.synthesis.exact.tracking.member_homotopy import (
    EdgeHomotopy,
    affine_solutions,
    homogeneous_slopes,
    scaled_rows,
)
from planar.synthesis.exact.tracking.monodromy import CORRECTION, PREDICTION, STEPS, GenericSolutions, SolutionGraph
from planar.synthesis.exact.tracking.symmetry import exchange_images, first_of_same

MAX_POINTS = 1500
"""Of a slice, where nothing else is said; with more the test is not made."""
FIRST_SLICES, MORE_SLICES = (8, 5), 8
"""Between which points are followed at first, where there are FEW solutions or more, and how many more are tried before
the trace is said to be uneven."""
FEW = 10
LOOPS = 6
"""Through two random members each."""
SPREAD = 1.0
"""Of the sizes of a slice's coefficients (logarithm)."""
LEVELS = 1.0 + 0.3j, -0.4 + 1.1j
"""By which a slice is moved, of its greatest coefficient: the sums of its points are compared there and where it is."""
EVEN = 1e-10
"""Of the size of the sums: by how much a trace may be off."""
SEPARATE = 1e-9
"""Of the greatest unknown: solutions whose places are nearer are told from each other by conjugates alone."""
ON_SLICE = 1e-6
"""Of the size of a point: what s is less than that at the member itself."""

Slice = ComplexArray
"""Coefficients (2, 1 + unknowns) of 1 and the unknowns, and of s and s times these."""


class _SliceHomotopy:
    """Of each path a homotopy between two slices; solutions are (1, places, s; 1, conjugates, s)."""

    def __init__(
        self,
        family: Family,
        known: GenericSolutions,
        line: tuple[ComplexArray, ...],
        slices: tuple[ComplexArray, ComplexArray],
    ):
        self.family, self.member, self.line = family, known.member, line
        self.begin, self.end = slices

    def at_paths(self, paths: IntArray) -> _SliceHomotopy:
        """The homotopy of some of the paths."""
        copy = _SliceHomotopy.__new__(_SliceHomotopy)
        copy.family, copy.member, copy.line = self.family, self.member, self.line
        copy.begin, copy.end = self.begin[paths], self.end[paths]
        return copy

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way."""
        n = self.family.size
        x, s, other = _affine(V, n)
        f, slope, by_s = self.family.rows_at(x.T.copy(), self.member, self.line, s, True)
        rows, paths = f.shape
        change = self.end - self.begin
        c = self.begin + way[:, None, None] * change
        monomials = np.concatenate([np.ones((paths, 1)), x], axis=1)
        parts, changes = (np.einsum("pku,pu->pk", each, monomials) for each in (c, change))
        by_x = c[:, 0, 1:] + s[:, None] * c[:, 1, 1:]
        # unknowns in the order of V: places, s, conjugates, s
        total: ComplexArray = np.zeros((rows + 2, 2 * n + 2, paths), dtype=complex)
        total[:rows, :n], total[:rows, n], total[:rows, n + 1 : -1] = slope[:, :n], by_s, slope[:, n:]
        total[rows, :n], total[rows, n], total[rows, n + 1 : -1] = by_x[:, :n].T, parts[:, 1], by_x[:, n:].T
        total[rows + 1, n], total[rows + 1, -1] = 1.0, -1.0
        last = np.stack([parts[:, 0] + s * parts[:, 1], s - other])
        along = np.zeros((rows + 2, paths), dtype=complex)
        along[rows] = changes[:, 0] + s * changes[:, 1]
        return scaled_rows(np.concatenate([f, last]), homogeneous_slopes(total, V), along)


def _affine(V: ComplexArray, n: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The unknowns, and s of both halves."""
    y = affine_solutions(V)
    return np.concatenate([y[:, :n], y[:, n + 1 : -1]], axis=1), y[:, n], y[:, -1]


class _Slices:
    """Slices of the solutions along one line of members, and the points of each."""

    def __init__(self, family: Family, known: GenericSolutions, V: ComplexArray, rng: np.random.Generator):
        self.size, self.rng = family.size, rng
        x, one = affine_solutions(V), np.ones((len(V), 1))
        self.form_size = _form_size(x)
        line = _random_line(family, rng)

        def between(slices: Sequence[Slice], edges: IntArray) -> _SliceHomotopy:
            every = np.array(slices)
            return _SliceHomotopy(family, known, line, (every[edges[:, 0]], every[edges[:, 1]]))

        self.graph: SolutionGraph[Slice] = SolutionGraph(between, None)
        W = np.concatenate([one, x[:, : self.size], 0.0 * one, one, x[:, self.size :], 0.0 * one], axis=1)
        first = self.random_slice()
        first[0] = 0.0
        self.graph.add_node(first, normalize(W))
        while len(self.graph.nodes) < FIRST_SLICES[len(V) > FEW]:
            self.graph.add_node(self.random_slice(), W[:0])
        self.levels = [1]
        for level in LEVELS:
            moved = self.graph.nodes[1].copy()
            moved[0, 0] += level * np.abs(moved).max()
            self.levels.append(self.graph.add_node(moved, W[:0]))
            self.graph.leaves.add(self.levels[-1])

    def random_slice(self) -> Slice:
        """Coefficients at random; none of conjugates where places tell solutions from each other."""
        shape = (2, 1 + 2 * self.size)
        result: Slice = self.rng.normal(size=shape) + 1j * self.rng.normal(size=shape)
        result *= np.exp(SPREAD * self.rng.normal(size=shape))
        result[:, 1 + self.form_size :] = 0.0
        return result

    def close(self, most_points: int) -> bool:
        """Find the points of all slices; whether they have an even trace and are no more than so many."""
        for _ in range(MORE_SLICES):
            while self.graph.follow_open_edges():
                if self.graph.most > most_points:
                    return False
            if self._is_even():
                return True
            self.graph.add_node(self.random_slice(), self.graph.solutions[0][:0])
        return False

    def _is_even(self) -> bool:
        """Whether the sum of the points of a slice moves evenly with its level."""
        first, *others = self.levels
        if not all(self.graph.follow_edge(first, level) for level in others):
            return False
        points = [self.graph.solutions[level] for level in self.levels]
        sums = []
        for V in points:
            x, s, _ = _affine(V, self.size)
            sums.append(np.append(x[:, : self.form_size].sum(axis=0), s.sum()))
        slopes = [(each - sums[0]) / level for each, level in zip(sums[1:], LEVELS, strict=True)]
        size = max(float(np.abs(each).max()) for each in sums)
        return len({*map(len, points)}) == 1 and bool(np.abs(slopes[1] - slopes[0]).max() <= EVEN * max(size, 1.0))

    def at_member(self) -> ComplexArray:
        """The unknowns (solutions, unknowns) of the points that are the member's."""
        x, s, _ = _affine(self.graph.solutions[0], self.size)
        result: ComplexArray = x[np.abs(s) < ON_SLICE * np.maximum(1.0, np.abs(x).max(axis=1))]
        return result


def _form_size(x: ComplexArray) -> int:
    """How many unknowns a slice's form has for solutions x (solutions, unknowns): the places, or the conjugates too."""
    half = int(x.shape[1]) // 2
    apart = np.abs(x[:, None, :half] - x[:, :half]).max(axis=2) + np.where(np.eye(len(x)), np.inf, 0.0)
    return half if apart.min() > SEPARATE * max(1.0, float(np.abs(x).max())) else 2 * half


def _random_line(family: Family, rng: np.random.Generator) -> tuple[ComplexArray, ...]:
    """Changes of the numbers of one entry, or of those that conditions hold where there is none."""
    moving = max(range(1, len(family.parts)), key=lambda k: family.parts[k].entry_count, default=0)
    line: list[ComplexArray] = []
    for k, part in enumerate(family.parts):
        change: ComplexArray = np.zeros((part.entry_count, len(part.kinds), 2), dtype=complex)
        if k == moving:
            change[0, :, 0] = rng.normal(size=len(part.kinds)) + 1j * rng.normal(size=len(part.kinds))
            change[0, :, 1] = np.where([kind is NumberKind.LENGTH for kind in part.kinds], change[0, :, 0], 0.0)
        line.append(change)
    return tuple(line)


def _is_closed(family: Family, known: GenericSolutions, V: ComplexArray, rng: np.random.Generator) -> bool:
    """Whether random loops in all numbers lead from solutions V of the member to these alone."""
    members = [known.member, *(family.random_member(rng) for _ in range(2 * LOOPS))]
    first = 1 + 2 * np.repeat(np.arange(LOOPS), len(V))
    nodes = np.zeros_like(first)
    ends = np.tile(V, (LOOPS, 1))
    for target in (first, first + 1, np.zeros_like(first)):
        paths = track_paths(
            EdgeHomotopy(family, members, np.stack([nodes, target], axis=1)), ends, PREDICTION, CORRECTION, STEPS
        )
        first, nodes, ends = first[paths.is_single], target[paths.is_single], paths.V[paths.is_single]
    return bool((first_of_same(np.concatenate([V, ends])) < len(V)).all())


def trace_test(
    family: Family,
    known: GenericSolutions,
    exchanges: tuple[tuple[int, ...], ...],
    seed: int = 9,
    most_points: int = MAX_POINTS,
) -> bool:
    """Whether the solutions of a random member, with what exchanges make of them, are all that it has.

    False also where the slice has more points than `most_points`.
    """
    V = np.concatenate(exchange_images(exchanges)(known.V))
    V = V[first_of_same(V) == np.arange(len(V))]
    if not 0 < 2 * len(V) <= most_points:
        return False
    rng = np.random.default_rng(seed)
    slices = _Slices(family, known, V, rng)
    return slices.close(most_points) and len(slices.at_member()) == len(V) and _is_closed(family, known, V, rng)
