"""The equations of contacts: every friction force is as great as what the others leave its pair to carry.

With all constraint forces x, their balance A x + D y = b and what contacts exert y (along D, one each), a contact is as
great as a part of its pair's own force: the length of a vector (pins), or the greatest of some parts (guides, slots,
teeth), which are linear in x. With x = inverse (b - D y) they are

    y_j = phi_j(h_j - H_j y),      phi convex and phi(t g) = t phi(g) for t > 0
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.short_repr import short_repr

ROUND_OFF = 1e-14


class ContactSystem(NamedTuple):
    """The equations at n positions, of m contacts with k parts each (those that there are not are zero).

    `loads` h (n, m, k), `slopes` H (n, m, k, m); of each contact (m,) whether it is as great as the parts' vector is
    long, and whether it is just its first part, with its sign; else it is the greatest part. `grows` (m,): whether
    it is friction, which grows with its coefficient from nothing; what pushes teeth apart is there without any.
    """

    loads: Array
    slopes: Array
    is_resultant: BoolArray
    is_signed: BoolArray
    grows: BoolArray

    def __repr__(self) -> str:
        return short_repr(self)

    def at(self, rows: IntArray) -> ContactSystem:
        """The same at some of the positions."""
        return self._replace(loads=self.loads[rows], slopes=self.slopes[rows])

    def where(self, rows: BoolArray) -> ContactSystem:
        """The same where positions are as wanted (n,), and no contacts at the others."""
        chosen = rows[:, None, None]
        return self._replace(
            loads=np.where(chosen, self.loads, 0.0), slopes=np.where(chosen[..., None], self.slopes, 0.0)
        )

    def scaled(self, part: float) -> ContactSystem:
        """With every coefficient of friction times a part."""
        by = np.where(self.grows, part, 1.0)
        return self._replace(loads=self.loads * by[:, None], slopes=self.slopes * by[:, None, None])

    def parts(self, y: Array) -> Array:
        """The parts h - H y (n, m, k) at y (n, m)."""
        return self.loads - np.einsum("nakm,nm->nak", self.slopes, y)

    def sizes(self, parts: Array) -> tuple[Array, Array]:
        """phi (n, m) of parts, and how it changes with each of them (n, m, k)."""
        long = np.linalg.norm(parts, axis=2)
        along = parts / np.maximum(long, 1e-300)[..., None]
        first = np.argmax(parts, axis=2) * ~self.is_signed
        greatest = np.arange(parts.shape[2]) == first[..., None]
        change = np.where(self.is_resultant[:, None], along, greatest)
        return np.einsum("nak,nak->na", change, parts), change

    def errors(self, y: Array) -> Array:
        """How far y (n, m) are from solving the equations, beside the greatest part or contact (n,)."""
        parts = self.parts(y)
        off = np.abs(self.sizes(parts)[0] - y).max(axis=1, initial=0.0)
        size = np.maximum(np.abs(parts).max(axis=(1, 2), initial=0.0), np.abs(y).max(axis=1, initial=0.0))
        return off / np.maximum(size, 1e-300)

    def newton_step(self, y: Array) -> tuple[Array, Array]:
        """Where each contact would go (n, m) if it went on as it changes at y, and the matrix of that (n, m, m).

        As phi(g) = phi'(g) g, that solves (1 + phi' H) y = phi' h.
        """
        change = self.sizes(self.parts(y))[1]
        matrix = np.eye(y.shape[1]) + np.einsum("nak,nakm->nam", change, self.slopes)
        asked = np.einsum("nak,nak->na", change, self.loads)
        return _solve(matrix, asked), matrix

    def lipschitz_bounds(self) -> Array:
        """By how much contact a can change at most with contact b (n, m, m)."""
        greatest = np.abs(self.slopes).max(axis=2, initial=0.0)
        long = np.linalg.norm(self.slopes, axis=2)
        return np.where(self.is_resultant[:, None], long, greatest)


def _solve(matrix: Array, right: Array) -> Array:
    try:
        return np.linalg.solve(matrix, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        return (np.linalg.pinv(matrix) @ right[..., None])[..., 0]
