"""Both assemblies of a block of two unknowns by its closed form, at one position or many."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from planar.equations.linear import solve_vectors
from planar.foundation.arrays import Array

POLISHING_STEPS = 2
"""Newton's steps that carry a closed form to round-off."""
SETTLED_STEP = 1e-9
"""rad or sizes: after a shorter step of Newton's method the next one is round-off."""


class ArrayFunction(Protocol):
    """A function of dense columns at one position, or at many."""

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results (columns, rows)."""

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results (positions, columns, rows); arguments (positions, entries), or (entries,) for all alike."""


class ClosedFormAssemblies:
    """The two assemblies of one block in closed form, carried to round-off by Newton's steps.

    `form` (z, u, p, sign) gives them, `closing` (z, u, p) the block's residuals and the columns of its Jacobian.
    `has_changing_arm`: whether a length of the block turns on an arm that may vanish as the mechanism moves.
    """

    def __init__(self, unknowns: slice, form: ArrayFunction, closing: ArrayFunction, has_changing_arm: bool):
        self._unknowns, self.form, self._closing = unknowns, form, closing
        self.has_changing_arm = has_changing_arm

    def evaluate_batch(self, z: Array, u: Array, p: Array) -> tuple[list[Array], Array]:
        """Both (positions, unknowns), not polished, and how near they are to where they meet (positions,), at z
        (positions, unknowns), u and p alike."""
        results = [self.form.evaluate_batch(len(z), z, u, p, np.array([sign])) for sign in (1.0, -1.0)]
        return [assembly[:, 0] for assembly, _ in results], results[0][1][:, 0, 0]

    def __call__(self, z: Array, u: Array, p: Array) -> tuple[list[Array], float, float]:
        """Both (unknowns,), the greatest residual of the two, and how near they are to where they meet (`ClosedForm`).

        What is not there is not a number.
        """
        assemblies, residual, coalescence = self.of_designs(z[None], u, p)
        return list(assemblies[:, 0]), float(residual[0]), float(coalescence[0])

    def of_designs(self, z: Array, u: Array, p: Array) -> tuple[Array, Array, Array]:
        """The same of designs z (designs, unknowns), u and p alike: both (2, designs, unknowns of the block), the
        greatest residuals and how near they are to where they meet (designs,)."""
        both, coalescence = self.evaluate_batch(z, u, p)
        greatest: Array = np.zeros(len(z))
        assemblies: list[Array] = []
        for assembly in both:
            tried = z.copy()
            tried[:, self._unknowns] = assembly
            self.polish(tried, u, p)
            residual = np.abs(self._closing.evaluate_batch(len(z), tried, u, p)[0][:, 0]).max(axis=1)
            # the greatest of what is left open does not see what is not a number
            is_defined = np.isfinite(tried[:, self._unknowns]).all(axis=1)
            greatest = np.maximum(greatest, np.where(is_defined, residual, np.nan))
            assemblies.append(tried[:, self._unknowns])
        return np.array(assemblies), greatest, coalescence

    def polish(self, z: Array, u: Array, p: Array) -> None:
        """Carry the block's unknowns in z (designs, unknowns) to round-off."""
        for _ in range(POLISHING_STEPS):
            residuals, columns = self._closing.evaluate_batch(len(z), z, u, p)
            with np.errstate(all="ignore"):  # what is not there is not a number
                moves = solve_vectors(columns.swapaxes(-1, -2), residuals[:, 0])
                z[:, self._unknowns] -= moves
                if not (np.abs(moves) > SETTLED_STEP).any():
                    break
