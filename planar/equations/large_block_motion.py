"""The motion of a block of many unknowns by matrices of numbers: what `block_motion` has one formula for."""

from __future__ import annotations

import numpy as np

from planar.equations.linear import solve_vectors
from planar.equations.sparse_matrices import SparseMatrices
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.arrays import Array

DIFFERENCE_STEP = 1e-6
"""The part of a step over which the change of a Jacobian is taken."""


class LargeBlockMotion:
    """The motion of equations that are one block, see `block_motion.derive_block_motion`."""

    def __init__(self, e: ConstraintEquations):
        assert e.assembled is not None
        self._assembled = e.assembled

    def evaluate_entries(self, count: int, *arguments: Array) -> Array:
        """The results (results, positions) of arguments (entries, positions) or (entries,)."""
        z, u, u1, u2 = (argument.T for argument in arguments[:4])
        numbers, row_scale, column_floor = arguments[4:]
        y, rest = np.hstack([z, u]), np.zeros_like(z)
        residuals, _, entries = self._assembled.kinematics(y, np.hstack([rest, u1]), np.hstack([rest, u2]), numbers)
        jacobians = self._jacobians(entries, z.shape[1])
        z1 = -solve_vectors(jacobians, residuals[:, 1])
        y1 = np.hstack([z1, u1])
        residuals, _, _ = self._assembled.kinematics(y, y1, np.hstack([rest, u2]), numbers)
        z2 = -solve_vectors(jacobians, residuals[:, 2])
        residuals, coordinates, _ = self._assembled.kinematics(y, y1, np.hstack([z2, u2]), numbers)
        bounds = self._bounds(y, y1, numbers, jacobians, row_scale, column_floor)
        return np.vstack([coordinates.reshape(count, -1).T, residuals[:, 0].T, bounds])

    def _jacobians(self, entries: Array, unknown_count: int) -> Array:
        whole: Array = np.asarray(SparseMatrices(self._assembled.pattern, entries))
        return whole[..., :unknown_count]

    def _bounds(
        self, y: Array, y1: Array, numbers: Array, jacobians: Array, row_scale: Array, column_floor: Array
    ) -> Array:
        """Regularity, least singular value, loss by round-off and distance (4, positions)."""
        scaled = jacobians / row_scale[:, None]
        sizes = np.maximum(np.linalg.norm(scaled, axis=-2), column_floor)
        values = _singular_values(scaled / sizes[:, None])
        regularity = np.minimum(values[:, -1] / np.maximum(1.0, values[:, 0]), 1.0)
        lengths = np.linalg.norm(jacobians, axis=-2)
        loss = np.maximum(1.0 / (lengths.min(axis=1) * regularity * regularity), 1.0)
        columns = jacobians / lengths[:, None]
        least = np.minimum(_singular_values(columns)[:, -1], 1.0)
        nudge = DIFFERENCE_STEP / np.maximum(np.abs(y1).max(axis=1, initial=0.0), DIFFERENCE_STEP)
        split = jacobians.shape[-1]
        moved = y + nudge[:, None] * y1
        ahead = self._jacobians(
            self._assembled.residuals_and_jacobians(moved[:, :split], moved[:, split:], numbers).entries, split
        )
        change = np.linalg.norm((ahead - jacobians) / lengths[:, None], axis=(1, 2)) / nudge
        with np.errstate(invalid="ignore"):
            signs = np.linalg.slogdet(np.nan_to_num(jacobians))[0]
        return np.stack(
            [regularity, least, loss, np.where(signs < 0.0, -1.0, 1.0) * least / np.maximum(change, 1e-300)]
        )


def _singular_values(matrices: Array) -> Array:
    """The singular values (positions, values), the greatest first; zero of what is not a number."""
    finite: Array = matrices.copy()
    finite[~np.isfinite(matrices).all(axis=(1, 2))] = 0.0
    values: Array = np.linalg.svd(finite, compute_uv=False)
    return values
