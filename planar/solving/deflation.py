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
from planar.solving.checks.singular_values import MIN_REGULARITY, column_norms, null_space, rank
from planar.solving.newton import correct, shortest_step
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
    y = np.concatenate([z, setup.inputs.u])
    for with_earlier in (False, True):
        blocks = {stage.block_index: _low_rank_block(setup, stage, z, with_earlier) for stage in weak}
        known = {level: block for level, block in blocks.items() if block is not None}
        if len(known) < len(blocks):
            continue
        program = with_rank_conditions(setup.functions, known)
        there = _correct(setup, program, y, z.size)
        if there is not None and _holds_along_motion(setup, program, there):
            return program, there[: z.size]
    return None


def _holds_along_motion(setup: PreparedMechanism, program: EquationFunctions, y: Array) -> bool:
    """Whether only the motions that inputs can make are left, and the rank is as low wherever these lead.

    So many ways at first order as inputs are there on their dead points too.
    """
    inputs = len(setup.inputs.u)
    if not inputs:
        return False
    slope = np.asarray(program.residuals_and_jacobian(y[:-inputs], y[-inputs:], setup.inputs.p)[1])
    least = np.concatenate([setup.min_column_scale, np.ones(inputs)])
    sizes = column_norms(slope, least)
    ways = null_space(slope / sizes, MIN_REGULARITY, unit=1.0).T / sizes
    if len(ways) != inputs:
        return False
    for seed in range(PROBE_COUNT):
        way = np.random.default_rng(seed).normal(size=inputs) @ ways
        if _correct(setup, program, y + PROBE_DISTANCE * way / np.linalg.norm(way), len(y)) is None:
            return False
    return True


def _correct(setup: PreparedMechanism, program: EquationFunctions, y: Array, free_count: int) -> Array | None:
    """The nearest position to y = (unknowns, inputs) that closes, of which the first `free` may move; None without."""
    many, held = len(y) - len(setup.inputs.u), y[free_count:]

    def here(x: Array) -> tuple[Array, Array]:
        y = np.concatenate([x, held])
        left, slope = program.residuals_and_jacobian(y[:many], y[many:], setup.inputs.p)
        return left, slope[:, :free_count]

    found, gap = correct(here, shortest_step(MIN_REGULARITY), y[:free_count], MAX_CORRECTIONS)
    return np.concatenate([found, held]) if gap <= CLOSED_TOLERANCE else None


def _low_rank_block(setup: PreparedMechanism, stage: Block, z: Array, with_earlier: bool) -> LowRankBlock | None:
    """The low-rank part of a block's constraints, with those on which it rests if wanted; None of full rank."""
    columns_of = constraint_dependencies(setup.functions)
    stages = [stage]
    columns = _dependent_columns(columns_of, stage)
    for before in reversed(setup.equations.blocks[: stage.block_index] if with_earlier else ()):
        if columns & set(range(before.unknowns.start, before.unknowns.stop)):
            stages.append(before)
            columns |= _dependent_columns(columns_of, before)
    rows = [row for each in reversed(stages) for row in range(each.rows.start, each.rows.stop)]
    many = sorted(columns)
    both = setup.functions.jacobians(z[None], setup.inputs.u[None], setup.inputs.p)
    own = np.hstack([each[0] for each in both])[np.ix_(rows, many)] / setup.row_scale[rows, None]
    least = np.concatenate([setup.min_column_scale, np.ones(len(setup.inputs.u))])[many]
    sizes = column_norms(own, least)
    held = rank(own / sizes, MIN_REGULARITY, unit=1.0)
    too_many = (len(rows) - held) * (len(many) - held) > MAX_CONDITIONS
    if held == min(own.shape) or too_many:
        return None
    return LowRankBlock(tuple(rows), tuple(many), setup.row_scale[rows], sizes, held)


def _dependent_columns(columns_of: Sequence[frozenset[int]], stage: Block) -> set[int]:
    """The columns that a block's constraints depend on."""
    return set().union(*columns_of[stage.rows])
