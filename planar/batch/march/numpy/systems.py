"""Linear systems of blocks by numpy, from what the kernel's functions give."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.batch.march.kernel import KernelBlock
from planar.equations.linear import solve_vectors

Array = np.ndarray


def stack_values(values: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Values of one shape, or spread over it, along a last axis."""
    return np.stack([np.broadcast_to(each, shape) for each in values], axis=-1)


def newton_step(part: KernelBlock, values: Sequence[Any]) -> tuple[Sequence[Any], Any, Any]:
    """Newton's step of a block, the square of how regular its Jacobian is, and that of its shortest arm."""
    if not part.is_large:
        *expressions, volume, lengths, squared_arm = values
        return expressions, volume / lengths, squared_arm
    count = len(part.unknowns)
    flat = stack_values(values, np.broadcast_shapes(*(np.shape(each) for each in values)))
    residuals, columns = flat[..., :count], flat[..., count:-1].reshape(*flat.shape[:-1], count, count)
    jacobians = columns.swapaxes(-1, -2)
    regular = np.isfinite(jacobians).all(axis=(-2, -1))
    diagonals = np.diagonal(np.linalg.qr(np.where(regular[..., None, None], jacobians, 0.0))[1], axis1=-2, axis2=-1)
    least = np.min(diagonals**2 / np.sum(jacobians * jacobians, axis=-2), axis=-1)
    step = solve_vectors(jacobians, residuals)
    return list(np.moveaxis(step, -1, 0)), np.minimum(least, 1.0), flat[..., -1]
