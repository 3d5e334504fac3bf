"""Rank, null space, and how far a Jacobian is from a singular one: pure numerics, refused by whoever asks."""

from __future__ import annotations

from typing import Any

import numpy as np

from planar.foundation.arrays import Array

SINGULAR_TOLERANCE = 1e-6
"""A singular value below this part of the greatest is zero: where constraints touch, rounding leaves about 1e-8."""
MIN_REGULARITY = 1e-5
"""A block is singular where its least singular value is below this part of its links' own reach.

Near a dead point it falls with the square root of the distance to it, so that round-off in the input of one part in
1e16 becomes one in 1e16 / value^2 in the velocity: at 1e-5 six digits remain, below they are lost.
"""
ZERO_REGULARITY = 1e-9
"""A regularity below this is zero but for rounding."""
SINGULAR_DISTANCE_RATIO = 1.5
"""How many times shorter than the distances from singular positions at its two ends a step must be."""
DIFFERENCE_STEP = 1e-6
"""The part of a step over which the change of a Jacobian is taken."""


def rank(matrix: Array, tolerance: float = SINGULAR_TOLERANCE, unit: float = 1e-300) -> int:
    """How many singular values of a matrix (rows, columns) exceed a part of the greatest, or of a greater unit."""
    return _count_nonzero(np.linalg.svd(matrix, compute_uv=False), tolerance, unit) if matrix.size else 0


def null_space(matrix: Array, tolerance: float = SINGULAR_TOLERANCE, unit: float = 1e-300) -> Array:
    """Orthonormal columns that a matrix (rows, columns) takes to zero (columns, nullity); see `rank`."""
    if not matrix.size:
        return np.eye(matrix.shape[1])
    _, values, vectors = np.linalg.svd(matrix)
    return vectors[_count_nonzero(values, tolerance, unit) :].T


def _count_nonzero(values: Array, tolerance: float, unit: float) -> int:
    return int(np.sum(values > tolerance * max(values[0], unit)))


def column_norms(jacobians: Array, least: float | Array) -> Array:
    """The sizes of columns (..., columns), by which they are judged so that a small link counts as much as a large."""
    return np.maximum(np.sqrt(np.add.reduce(jacobians * jacobians, axis=-2)), least)


def singular_distance(least: Array | float, change: Array | np.floating[Any]) -> Array:
    """How far a matrix keeps its rank: until it has changed by its least singular value (Weyl's inequality).

    `change` is the norm of its change by what the distance is counted in.
    """
    return least / np.maximum(change, 1e-300)
