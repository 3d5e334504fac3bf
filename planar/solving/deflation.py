"""Constraints that hold to second order what they leave free to first order, all along a motion: made regular.

Two pins of one body in two parallel slots leave it only a translation, but to first order it may turn as well, in every
position. The slope of such constraints has less rank than unknowns on the whole curve of positions, which Newton's
method and continuation cannot bear. But the curve is also that on which the slope keeps this lower rank: with that as
further constraints it is regular. (A. Leykin, J. Verschelde, A. Zhao, Newton's method with
deflation for isolated singularities, Theor. Comp. Sci. 359, 2006; J. Hauenstein, C. Wampler, Isosingular sets and
deflation, Found. Comput. Math. 13, 2013.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.equations.functions import EquationFunctions
from planar.equations.rank_conditions import LowRankBlock, constraint_dependencies, with_rank_conditions
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array
from planar.solving.checks import MIN_REGULARITY, column_norms, null_space, rank
from planar.solving.newton import correct_position
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_CONDITIONS = 24
"""Conditions of one block; constraints that need more lack so much rank that something is free."""
PROBE_DISTANCE = 1e-2
"""rad, or lengths of the size: how far along the motion it is looked whether the rank is as low."""
PROBE_COUNT = 4
MAX_CORRECTIONS, CLOSED_TOLERANCE = 12, 1e-10


def deflate(setup: PreparedMechanism, weak: Sequence[Block], z: Array) -> tuple[EquationFunctions, Array] | None:
    """The program in which blocks that are singular at z, and all along the motion, keep this rank
    as a constraint too; and z by it. None where they are singular in this position alone, or something is free.
    """
    for with_earlier in (False, True):
        blocks = {stage.block_index: _low_rank_block(setup, stage, z, with_earlier) for stage in weak}
        known = {level: block for level, block in blocks.items() if block is not None}
        if len(known) < len(blocks):
            continue
        program = with_rank_conditions(setup.functions, known)
        y = _correct(setup, program, z, setup.inputs.u, z.size)
        if y is not None and _holds_along_motion(setup, program, y):
            return program, y[: z.size]
    return None


def _holds_along_motion(setup: PreparedMechanism, program: EquationFunctions, y: Array) -> bool:
    """Whether only the motions that inputs can make are left, and the rank is as low wherever these lead.

    There are as many motions at first order as inputs on their dead points too.
    """
    inputs = len(setup.inputs.u)
    if not inputs:
        return False
    jacobian = np.asarray(program.residuals_and_jacobian(y[:-inputs], y[-inputs:], setup.inputs.p)[1])
    sizes = column_norms(jacobian, np.concatenate([setup.min_column_scale, np.ones(inputs)]))
    motions = null_space(jacobian / sizes, MIN_REGULARITY, unit=1.0).T / sizes
    if len(motions) != inputs:
        return False
    for seed in range(PROBE_COUNT):
        motion = np.random.default_rng(seed).normal(size=inputs) @ motions
        probe = y + PROBE_DISTANCE * motion / np.linalg.norm(motion)
        if _correct(setup, program, probe[:-inputs], probe[-inputs:], len(y)) is None:
            return False
    return True


def _correct(setup: PreparedMechanism, program: EquationFunctions, z: Array, u: Array, free_count: int) -> Array | None:
    """Unknowns and inputs that close near z and u, of which the first `free_count` may move; None without."""
    y, gap = correct_position(program, (z, u, setup.inputs.p), free_count, MIN_REGULARITY, MAX_CORRECTIONS)
    return y if gap <= CLOSED_TOLERANCE else None


def _low_rank_block(setup: PreparedMechanism, stage: Block, z: Array, with_earlier: bool) -> LowRankBlock | None:
    """The low-rank part of a block's constraints, with those on which it rests if wanted; None of full rank."""
    columns_of_row = constraint_dependencies(setup.functions)
    stages, columns = [stage], set().union(*columns_of_row[stage.rows])
    for earlier in reversed(setup.equations.blocks[: stage.block_index] if with_earlier else ()):
        if columns & set(range(earlier.unknowns.start, earlier.unknowns.stop)):
            stages.append(earlier)
            columns |= set().union(*columns_of_row[earlier.rows])
    rows = [row for block in reversed(stages) for row in range(block.rows.start, block.rows.stop)]
    variables = sorted(columns)
    jacobian = np.asarray(setup.functions.residuals_and_jacobian(z, setup.inputs.u, setup.inputs.p)[1])
    jacobian = jacobian[np.ix_(rows, variables)] / setup.row_scale[rows, None]
    least = np.concatenate([setup.min_column_scale, np.ones(len(setup.inputs.u))])[variables]
    sizes = column_norms(jacobian, least)
    block_rank = rank(jacobian / sizes, MIN_REGULARITY, unit=1.0)
    too_many = (len(rows) - block_rank) * (len(variables) - block_rank) > MAX_CONDITIONS
    if block_rank == min(jacobian.shape) or too_many:
        return None
    return LowRankBlock(tuple(rows), tuple(variables), setup.row_scale[rows], sizes, block_rank)
