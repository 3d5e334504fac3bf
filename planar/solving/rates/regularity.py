"""How regular the Jacobian of a position is: of each block, its mobility by rank, the links that are free."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.equations.functions import EquationRates
from planar.equations.linear import solve_vectors
from planar.equations.sparse_matrices import SparseMatrices
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array
from planar.solving.checks.singular_values import MIN_REGULARITY, ZERO_REGULARITY, null_space, rank
from planar.solving.newton import correct_blocks
from planar.solving.prepared_mechanism import PreparedMechanism

NEIGHBOUR_DISTANCE = 1e-2
"""How far (rad, or lengths of the size) a position is moved to see whether what holds there holds elsewhere."""


class Freedom(NamedTuple):
    """How a mechanism can move from a position, to first order: its mobility, and the blocks that are singular there.

    With the inputs' positions counted as unknowns, what the pairs leave free is unknowns + inputs - rank.
    """

    mobility: int
    weak_blocks: tuple[Block, ...]


def freedom_by_rank(setup: PreparedMechanism, motion: EquationRates) -> Freedom:
    """The freedom at a position by rank."""
    inputs = setup.inputs.u.size
    is_block_weak = regularity(setup, motion.jacobian) < MIN_REGULARITY
    weak = tuple(block for block, is_weak in zip(setup.equations.blocks, is_block_weak, strict=True) if is_weak)
    if not weak:
        # the unknowns are determined; each independent way in which the inputs break the rest is a freedom less
        return Freedom(inputs - _contradiction_rank(motion), ())
    jacobian = np.hstack([motion.jacobian, motion.input_jacobian])
    total_rank = rank(_scaled_jacobian(setup, jacobian), MIN_REGULARITY, unit=1.0)
    return Freedom(len(setup.equations.unknowns) + inputs - total_rank, weak)


def _contradiction_rank(motion: EquationRates) -> int:
    """The rank of what unit rates of the inputs leave open after the unknowns have done all they can."""
    if motion.jacobian.shape[0] == motion.jacobian.shape[1]:
        return 0
    sizes = np.maximum(np.linalg.norm(motion.input_jacobian, axis=0), ZERO_REGULARITY)
    rates = np.linalg.lstsq(motion.jacobian, motion.input_jacobian, rcond=1e-12)[0]
    residual = (motion.input_jacobian - motion.jacobian @ rates) / sizes
    return int(np.sum(np.linalg.svd(residual, compute_uv=False) > MIN_REGULARITY))


def regularity(setup: PreparedMechanism, jacobian: Array | SparseMatrices) -> Array:
    """The least singular value of every group's slope (..., stages), each column by what its links could reach at best.

    Zero at a dead point or a change point; lengths are divided by the reach of the block's links, so that neither
    their size nor that of the whole matters. `jacobian` is (..., rows, unknowns).
    """
    least_values = []
    for stage in setup.equations.blocks:
        block_jacobian = jacobian[..., stage.rows, stage.unknowns] / setup.row_scale[stage.rows, None]
        sizes = np.maximum(np.linalg.norm(block_jacobian, axis=-2), setup.min_column_scale[stage.unknowns])
        least_values.append(_least_singular_value(block_jacobian / sizes[..., None, :]))
    return np.stack(least_values, axis=-1) if least_values else np.zeros((*jacobian.shape[:-2], 0))


def _least_singular_value(block_jacobian: Array) -> Array:
    if not block_jacobian.shape[-1]:
        return np.ones(block_jacobian.shape[:-2])
    if block_jacobian.shape[-2] < block_jacobian.shape[-1]:
        return np.zeros(block_jacobian.shape[:-2])
    values = np.linalg.svd(block_jacobian, compute_uv=False)
    return values[..., -1] / np.maximum(1.0, values[..., 0])


def _scaled_jacobian(setup: PreparedMechanism, jacobian: Array | SparseMatrices) -> Array:
    """A Jacobian (..., rows, unknowns and inputs), every block's lengths in units of its reach, columns of one size.

    The size of an unknown's column is that in its own block, however large or small the things that hang on it are. A
    column that could reach further than it does now keeps what it lacks: it is that which vanishes.
    """
    jacobian = np.asarray(jacobian)
    scaled = jacobian / setup.row_scale[:, None]
    sizes = np.maximum(np.linalg.norm(jacobian, axis=-2), 1.0)
    for stage in setup.equations.blocks:
        norms = np.linalg.norm(scaled[..., stage.rows, stage.unknowns], axis=-2)
        sizes[..., stage.unknowns] = np.maximum(norms, setup.min_column_scale[stage.unknowns])
    return scaled / sizes[..., None, :]


def input_rates_agree(setup: PreparedMechanism, motion: EquationRates) -> bool:
    """Whether rates of the inputs that are more than the freedom do not contradict one another."""
    residual = motion.F1 - motion.jacobian @ solve_vectors(motion.jacobian, motion.F1)
    scale = np.max(np.abs(setup.inputs.u1), initial=0.0) or 1.0
    return bool(np.max(np.abs(residual), initial=0.0) <= 1e-9 * scale)


def is_always_singular(setup: PreparedMechanism, stage: Block, z: Array) -> bool:
    """Whether a block is singular in closed positions near by too, so that it is no matter of this one."""
    u, p = setup.inputs.u, setup.inputs.p
    for seed in range(3):
        rng = np.random.default_rng(seed)
        near = u + rng.uniform(-NEIGHBOUR_DISTANCE, NEIGHBOUR_DISTANCE, u.size)
        beside = correct_blocks(
            setup.functions,
            p,
            z + rng.uniform(-NEIGHBOUR_DISTANCE, NEIGHBOUR_DISTANCE, z.size),
            near,
            stage.block_index,
        )
        if (
            beside is not None
            and regularity(setup, jacobian_at(setup, beside, near))[stage.block_index] > ZERO_REGULARITY
        ):
            return False
    return True


def jacobian_at(setup: PreparedMechanism, z: Array, u: Array) -> Array | SparseMatrices:
    """dF/dz (rows, unknowns) at unknowns z and inputs u."""
    jacobian: Array | SparseMatrices = setup.functions.jacobians(z[None], u[None], setup.inputs.p)[0][0]
    return jacobian


def links_free_at_rest(setup: PreparedMechanism, jacobian: Array | SparseMatrices) -> list[str]:
    """The links that can move while the inputs are held, from the null vectors of the Jacobian."""
    null = null_space(_scaled_jacobian(setup, jacobian), MIN_REGULARITY, unit=1.0)
    return moved_links(setup, np.max(np.abs(null), axis=1)) if null.size else []


def moved_links(setup: PreparedMechanism, rates: Array) -> list[str]:
    """The links that rates of the unknowns (unknowns,) move."""
    share = np.abs(rates)
    owners = [
        setup.equations.coordinates[column].owner
        for column, part in zip(setup.equations.unknowns, share, strict=True)
        if part > 1e-3 * share.max()
    ]
    joined = [link for name in owners for link in (setup.pairs[name].links if name in setup.pairs else (name,))]
    return [link for link in dict.fromkeys(joined) if link != setup.mechanism.frame]
