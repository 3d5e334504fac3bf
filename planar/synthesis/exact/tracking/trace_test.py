"""The trace test: whether solutions that were found are all, by a line in the numbers of a family and a linear slice.

Along a line p + s v of members the solutions are a curve in unknowns and s. Where it meets a plane, and that plane is
moved along itself, the sum of all points of an irreducible curve moves evenly, and that of some of them does not. The
points on a plane are found by monodromy from those of the member; where their trace is even they are all, and the plane
s = 0 has no more than they lead to. A. Leykin, J. I. Rodriguez, F. Sottile, Trace test, Arnold Math. J. 4, 2018.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.assemblies.polynomial.path_tracker import (
    HomotopyValues,
    is_finite_solution,
    normalize,
    track_paths,
)
from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind
from planar.synthesis.exact.tracking.exact_certificates import certify_member
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions
from planar.synthesis.exact.tracking.monodromy import CLOSER_STEPS, GenericSolutions
from planar.synthesis.exact.tracking.solution_graph import CORRECTION
from planar.synthesis.exact.tracking.same_solutions import first_of_same
from planar.synthesis.exact.tracking.symmetry import exchange_images

MAX_POINTS = 1500
"""Of a slice, where nothing else is said; with more the test is not made."""
ROUNDS, IDLE_ROUNDS = 200, 15
FEW, CLOSER = 0.02, 1e-6
"""Of paths: where no more are lost they are followed again, and how far predictions may be off then."""
FINITE = 1e-6
"""Of solutions of length one: what is nearer to infinity is there."""
NEARER = 1e4
"""No solution of a random member is at infinity that is nearer than this."""
MOVES = 0.0, 1.0, -1.0
"""Of a plane: levels at which the sums of its points are compared."""
EVEN = 1e-8
"""Of the size of the sums: by how much a trace may be off."""


class _Plane(NamedTuple):
    """c . (x, s) = level."""

    c: ComplexArray
    level: complex


class _SliceHomotopy:
    """From a plane to another; solutions are (1, places, s; 1, conjugates, s)."""

    def __init__(
        self,
        family: Family,
        known: GenericSolutions,
        line: tuple[ComplexArray, ...],
        planes: tuple[_Plane, _Plane],
    ):
        self.family, self.member, self.line = family, known.member, line
        self.begin, self.end = planes

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way."""
        n = self.family.size
        x, s, y = _affine(V, n)
        f, slope, by_s = self.family.rows_at(x.T.copy(), self.member, self.line, s, True)
        rows, paths = f.shape
        c = self.begin.c + way[:, None] * (self.end.c - self.begin.c)
        level = self.begin.level + way * (self.end.level - self.begin.level)
        whole: ComplexArray = np.zeros((paths, rows + 2, 2 * n + 2), dtype=complex)
        whole[:, :rows, :n], whole[:, :rows, n] = slope[:, :n].transpose(2, 0, 1), by_s.T
        whole[:, :rows, n + 1 : 2 * n + 1] = slope[:, n:].transpose(2, 0, 1)
        whole[:, rows, : 2 * n + 1] = c
        whole[:, rows + 1, n], whole[:, rows + 1, 2 * n + 1] = 1.0, -1.0
        left: ComplexArray = np.zeros((paths, rows + 2), dtype=V.dtype)
        left[:, :rows], left[:, rows] = f.T, np.sum(c * y[:, :-1], axis=1) - level
        left[:, rows + 1] = y[:, n] - y[:, 2 * n + 1]
        along: ComplexArray = np.zeros_like(left)
        along[:, rows] = y[:, :-1] @ (self.end.c - self.begin.c) - (self.end.level - self.begin.level)
        found: ComplexArray = np.empty((paths, rows + 2, 2 * n + 4), dtype=complex)
        for first, at in ((0, 0), (n + 1, n + 2)):
            part, over = whole[:, :, first : first + n + 1], V[:, at][:, None]
            found[:, :, at] = -np.einsum("pru,pu->pr", part, y[:, first : first + n + 1]) / over
            found[:, :, at + 1 : at + n + 2] = part / over[..., None]
        size = np.linalg.norm(found, axis=2)
        scale: Array = 1.0 / np.where(size > 0.0, size, 1.0)
        return left * scale, found * scale[..., None], along * scale


def _affine(V: ComplexArray, n: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    """The unknowns, s, and all entries of both halves."""
    y = affine_solutions(V)
    return np.concatenate([y[:, :n], y[:, n + 1 : -1]], axis=1), y[:, n], y


class _Slices:
    """Planes that cut the solutions along one line of members."""

    def __init__(self, family: Family, known: GenericSolutions, rng: np.random.Generator):
        self.family, self.known, self.rng = family, known, rng
        self.line = tuple(rng.normal(size=each.shape) + 1j * rng.normal(size=each.shape) for each in known.member.parts)
        for part, each in zip(family.parts, self.line, strict=True):
            real = [k for k, kind in enumerate(part.kinds) if kind is NumberKind.LENGTH]
            each[:, real, 1] = each[:, real, 0]
        self.start = _Plane(np.eye(1, 2 * family.size + 1, family.size)[0].astype(complex), 0.0)

    def random_plane(self) -> _Plane:
        """A plane."""
        c, level = self.rng.normal(size=(2, 2 * self.family.size + 1)), self.rng.normal(size=2)
        return _Plane(c[0] + 1j * c[1], complex(*level))

    def follow(self, points: ComplexArray, one: _Plane, other: _Plane) -> tuple[ComplexArray, bool]:
        """The points of one plane on another, and whether all came there."""
        between = _SliceHomotopy(self.family, self.known, self.line, (one, other))
        ends = track_paths(between, points)
        again = np.flatnonzero(~ends.is_near_end)
        if 0 < len(again) <= FEW * len(points):
            more = points[again].astype(np.clongdouble)
            closer = track_paths(between, more, CLOSER, CORRECTION, CLOSER_STEPS)
            for whole, part in zip(ends, closer, strict=True):
                whole[again] = part
        return ends.V[ends.is_single], bool(ends.is_single.all())

    def points_on(self, plane: _Plane, points: ComplexArray, most: int) -> ComplexArray | None:
        """All points of a plane, found from some of them by going round; None where their trace is not even, or where
        they are more than so many."""
        idle = 0
        for _ in range(ROUNDS):
            a, b = self.random_plane(), self.random_plane()
            gone = points
            for first, last in ((plane, a), (a, b), (b, plane)):
                gone, _ = self.follow(gone, first, last)
            both = np.concatenate([points, gone])
            new = both[first_of_same(both) == np.arange(len(both))]
            idle = idle + 1 if len(new) == len(points) else 0
            points = new
            if idle and self.is_even(points, plane):
                return points
            if len(points) > most or idle >= IDLE_ROUNDS:
                return None
        return None

    def is_even(self, points: ComplexArray, plane: _Plane) -> bool:
        """Whether the sum of the points moves evenly with the plane's level."""
        sums = []
        for step in MOVES:
            moved, is_whole = (
                (points, True) if not step else self.follow(points, plane, plane._replace(level=plane.level + step))
            )
            if not is_whole:
                return False
            x, s, _ = _affine(moved, self.family.size)
            sums.append(np.append(x.sum(axis=0), s.sum()))
        off = np.abs(sums[1] + sums[2] - 2.0 * sums[0]).max()
        size = max(float(np.abs(each).max()) for each in sums)
        return bool(off <= EVEN * max(size, 1.0))


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
    if len(V) * 4 > most_points:
        return False
    n, x = family.size, affine_solutions(V)
    slices = _Slices(family, known, np.random.default_rng(seed))
    one = np.ones((len(x), 1))
    W = normalize(np.concatenate([one, x[:, :n], 0.0 * one, one, x[:, n:], 0.0 * one], axis=1))
    plane = slices.random_plane()
    points = slices.points_on(plane, slices.follow(W, slices.start, plane)[0], most_points)
    if points is None:
        return False
    back, _ = slices.follow(points, plane, slices.start)
    x = _affine(back[is_finite_solution(back, FINITE)], n)[0]
    others = x[first_of_same(np.concatenate([V, _homogeneous(x)]))[len(V) :] >= len(V)]
    return not len(others) or _are_at_infinity(family, known.member, V, others)


def _are_at_infinity(family: Family, member: Member, V: ComplexArray, x: ComplexArray) -> bool:
    """Whether ends beside those that are known only look as if they were at finite places: where several meet at
    infinity doubles come there by and by."""
    if not is_available() or (np.abs(x).max(axis=1) < NEARER).any():
        return False
    proof = certify_member(family, member, x)
    told = first_of_same(np.concatenate([V, _homogeneous(proof.x[proof.proved])]))
    return bool((told < len(V)).all())


def _homogeneous(x: ComplexArray) -> ComplexArray:
    half, one = x.shape[1] // 2, np.ones((len(x), 1))
    return normalize(np.concatenate([one, x[:, :half], one, x[:, half:]], axis=1))
