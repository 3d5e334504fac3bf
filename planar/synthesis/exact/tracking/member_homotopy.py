"""From one member of a family to another, for the path tracker of assemblies."""

from __future__ import annotations

import numpy as np

from planar.assemblies.polynomial.path_tracker import HomotopyValues
from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member


class MemberHomotopy:
    """Solutions are V = (1, places; 1, conjugates), each half up to a factor, so that what goes to infinity is followed
    like the rest."""

    def __init__(self, family: Family, begin: Member, end: Member):
        self.family, self.begin = family, begin
        self.change = tuple(b - a for a, b in zip(begin.parts, end.parts, strict=True))

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way; each row of slope has length one."""
        many = self.family.size
        x = affine_solutions(V)
        f, slope, along = self.family.rows_at(x.T.copy(), self.begin, self.change, way)
        rows, paths = f.shape
        whole = np.empty((rows, 2 * many + 2, paths), dtype=complex)
        for half, first in ((slope[:, :many], 0), (slope[:, many:], many + 1)):
            # x = X / X0
            over = V[:, first]
            here = x[:, first - (first > 0) : first - (first > 0) + many].T
            whole[:, first] = -np.einsum("rup,up->rp", half, here) / over
            whole[:, first + 1 : first + 1 + many] = half / over
        size = np.linalg.norm(whole, axis=1)
        scale = 1.0 / np.where(size > 0.0, size, 1.0)
        return (
            np.ascontiguousarray((f * scale).T),
            np.ascontiguousarray((whole * scale[:, None]).transpose(2, 0, 1)),
            np.ascontiguousarray((along * scale).T),
        )


def affine_solutions(V: ComplexArray) -> ComplexArray:
    """The unknowns (solutions, 2 many) of solutions in homogeneous coordinates."""
    half = V.shape[1] // 2
    with np.errstate(all="ignore"):
        return np.concatenate([V[:, 1:half] / V[:, :1], V[:, half + 1 :] / V[:, half : half + 1]], axis=1)


def homogeneous_solutions(x: ComplexArray) -> ComplexArray:
    """Homogeneous coordinates of unknowns."""
    half, one = x.shape[1] // 2, np.ones((len(x), 1))
    return np.concatenate([one, x[:, :half], one, x[:, half:]], axis=1)
