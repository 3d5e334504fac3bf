"""Inverses of stacks of matrices, as far as there are any."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, BoolArray

SINGULAR = 1e-9
"""A singular value below this part of the greatest is none."""


def invert_matrices(matrices: Array) -> tuple[Array, BoolArray]:
    """The inverses (n, columns, rows) of matrices (n, rows, columns), as far as there are any, and where they do not
    determine all that they are multiplied by (n,)."""
    count, rows, columns = matrices.shape
    is_known: BoolArray = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    if not columns or not count:
        return np.zeros((count, columns, rows)), ~is_known
    known = np.where(is_known[:, None, None], matrices, 0.0)
    row_scale = _nonzero(np.linalg.norm(known, axis=2, keepdims=True))
    column_scale = _nonzero(np.linalg.norm(known / row_scale, axis=1, keepdims=True))
    scaled = known / row_scale / column_scale
    inverse, is_sure = _regular_inverses(scaled)
    is_singular: BoolArray = ~is_known | (rows < columns)
    if not is_sure.all():
        u, s, v = np.linalg.svd(scaled[~is_sure], full_matrices=False)
        is_zero: BoolArray = np.asarray(s <= SINGULAR * s[:, :1])
        reciprocals = np.where(is_zero, 0.0, 1.0 / np.where(is_zero, 1.0, s))
        inverse[~is_sure] = (v.transpose(0, 2, 1) * reciprocals[:, None]) @ u.transpose(0, 2, 1)
        is_singular[~is_sure] |= is_zero.any(axis=1)
    return inverse / row_scale.transpose(0, 2, 1) / column_scale.transpose(0, 2, 1), is_singular


def _regular_inverses(matrices: Array) -> tuple[Array, BoolArray]:
    """The inverses of matrices (n, rows, columns), and which of them (n,) surely have no singular value of zero."""
    count, rows, columns = matrices.shape
    inverses = np.zeros((count, columns, rows))
    none: BoolArray = np.zeros(count, dtype=bool)
    if rows != columns:
        return inverses, none
    try:
        inverses[:] = np.linalg.inv(matrices)
    except np.linalg.LinAlgError:  # one of them is singular to the last digit
        return inverses, none
    # no less than the condition number
    sizes = np.linalg.norm(matrices, axis=(1, 2)) * np.linalg.norm(inverses, axis=(1, 2))
    return inverses, np.asarray(sizes < 1.0 / SINGULAR)


def _nonzero(scale: Array) -> Array:
    return np.where(scale > 0.0, scale, 1.0)
