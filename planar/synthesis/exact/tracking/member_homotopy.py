"""From one member of a family to another, for the path tracker of assemblies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.assemblies.polynomial.path_tracker import HomotopyValues
from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, Member


class MemberHomotopy:
    """Solutions are V = (1, places; 1, conjugates), each half up to a factor, so that what goes to infinity is followed
    like the rest. Numbers of the members (entries, numbers, 2) may have a last axis of paths."""

    def __init__(self, family: Family, begin: Member, end: Member):
        self.family, self.begin = family, begin
        self.change = tuple(b - a for a, b in zip(begin.parts, end.parts, strict=True))

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way; each row of slope has length one."""
        f, slope, along = self.family.rows_at(affine_solutions(V).T.copy(), self.begin, self.change, way)
        return scaled_rows(f, homogeneous_slopes(slope, V), along)


class EdgeHomotopy:
    """Of each path a homotopy of its own between two of several members: `edges` (paths, 2)."""

    def __init__(self, family: Family, members: Sequence[Member], edges: IntArray):
        self.family, self.edges = family, edges
        self.numbers = [np.stack(parts, axis=-1) for parts in zip(*(each.parts for each in members), strict=True)]

    def at_paths(self, paths: IntArray) -> MemberHomotopy:
        """The homotopy of some of the paths."""
        begin, end = (Member(tuple(part[..., nodes] for part in self.numbers)) for nodes in self.edges[paths].T)
        return MemberHomotopy(self.family, begin, end)

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way, of all paths."""
        return self.at_paths(np.arange(len(V)))(V, way)


def homogeneous_slopes(slope: ComplexArray, V: ComplexArray) -> ComplexArray:
    """Derivatives by homogeneous coordinates (paths, rows, 2 many + 2) from those by unknowns x = X / X0 (rows, 2 many,
    paths)."""
    rows, both, paths = slope.shape
    half = both // 2
    result: ComplexArray = np.empty((paths, rows, 2, half + 1), dtype=complex)
    result[..., 1:] = slope.reshape(rows, 2, half, paths).transpose(3, 0, 1, 2)
    sides = V.reshape(paths, 1, 2, half + 1)
    inverse = 1.0 / sides[..., :1]
    result[..., 1:] *= inverse
    result[..., 0] = -(result[..., 1:] * (sides[..., 1:] * inverse)).sum(axis=3)
    return result.reshape(paths, rows, -1)


def scaled_rows(f: ComplexArray, slope: ComplexArray, along: ComplexArray) -> HomotopyValues:
    """Rows (rows, paths), slopes (paths, rows, columns) and changes (rows, paths), path by path and with each row of
    slope of length one."""
    size = np.sqrt(np.einsum("prc,prc->pr", slope.real, slope.real) + np.einsum("prc,prc->pr", slope.imag, slope.imag))
    scale = 1.0 / np.where(size > 0.0, size, 1.0)
    return f.T * scale, slope * scale[..., None], along.T * scale


def affine_solutions(V: ComplexArray) -> ComplexArray:
    """The unknowns (solutions, 2 many) of solutions in homogeneous coordinates."""
    half = V.shape[1] // 2
    with np.errstate(all="ignore"):
        return np.concatenate([V[:, 1:half] / V[:, :1], V[:, half + 1 :] / V[:, half : half + 1]], axis=1)


def homogeneous_solutions(x: ComplexArray) -> ComplexArray:
    """Homogeneous coordinates of unknowns."""
    half, one = x.shape[1] // 2, np.ones((len(x), 1))
    return np.concatenate([one, x[:, :half], one, x[:, half:]], axis=1)
