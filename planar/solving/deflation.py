"""Constraints that hold to second order what they leave free to first order, all along a motion: made regular.

Two pins of one body in two parallel slots leave it only a translation, but to first order it may turn as well, in every
position. The slope of such constraints has less rank than unknowns on the whole curve of positions, which Newton's
method and continuation cannot bear. But the curve is also that on which the slope keeps this lower rank: with the
minors that vanish there as further constraints it is regular. (A. Leykin, J. Verschelde, A. Zhao, Newton's method with
deflation for isolated singularities, Theor. Comp. Sci. 359, 2006; J. Hauenstein, C. Wampler, Isosingular sets and
deflation, Found. Comput. Math. 13, 2013.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.equations.constraint_equations import Stage
from planar.equations.functions import Program
from planar.equations.minors import Block, depends, with_minors
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

LARGEST = 12
"""Rank from which on minors would be expressions too long."""
SINGULAR = 1e-5
"""A singular value below this part of the greatest is zero: a double root is known to about 1e-8."""
AWAY = 1e-2
"""rad, or lengths of the size: how far along the motion it is looked whether the rank is as low."""
TRIES = 4
CORRECTIONS, CLOSED = 12, 1e-10


def deflated(setup: Setup, weak: Sequence[Stage], z: Array) -> tuple[Program, Array] | None:
    """The program in which groups that are singular at z, and all along the motion, have the minors that vanish there
    as constraints too; and z by it. None where they are singular in this position alone, or something is free.
    """
    y = np.concatenate([z, setup.station.u])
    for with_earlier in (False, True):
        blocks = {stage.level: _block(setup, stage, z, with_earlier) for stage in weak}
        known = {level: block for level, block in blocks.items() if block is not None}
        if len(known) < len(blocks):
            continue
        program = with_minors(setup.program, known)
        there = _closed(setup, program, y, z.size)
        if there is not None and _goes_on(setup, program, there):
            return program, there[: z.size]
    return None


def _goes_on(setup: Setup, program: Program, y: Array) -> bool:
    """Whether only the motions that inputs can make are left, and the minors vanish wherever these lead.

    So many ways at first order as inputs are there on their dead points too.
    """
    inputs = len(setup.station.u)
    if not inputs:
        return False
    slope = program.left(y[:-inputs], y[-inputs:], setup.station.p)[1]
    least = np.concatenate([setup.least, np.ones(inputs)])
    sizes = np.maximum(np.linalg.norm(slope, axis=0), least)
    _, values, vectors = np.linalg.svd(slope / sizes)
    if int(np.sum(values > SINGULAR * max(1.0, values[0]))) != len(y) - inputs:
        return False
    ways = vectors[len(y) - inputs :] / sizes
    for seed in range(TRIES):
        way = np.random.default_rng(seed).normal(size=inputs) @ ways
        if _closed(setup, program, y + AWAY * way / np.linalg.norm(way), len(y)) is None:
            return False
    return True


def _closed(setup: Setup, program: Program, y: Array, free: int) -> Array | None:
    """The nearest position to y = (unknowns, inputs) that closes, of which the first `free` may move; None without."""
    y, many, before = y.copy(), len(y) - len(setup.station.u), np.inf
    for _ in range(CORRECTIONS):
        left, slope = program.left(y[:many], y[many:], setup.station.p)
        gap = float(np.max(np.abs(left), initial=0.0))
        if not gap < before:
            break
        before = gap
        y[:free] -= np.linalg.lstsq(slope[:, :free], left, rcond=SINGULAR)[0]
    return y if before <= CLOSED else None


def _block(setup: Setup, stage: Stage, z: Array, with_earlier: bool) -> Block | None:
    """The block of a group's constraints, and of those on which it rests if wanted; None where that has full rank."""
    columns_of = depends(setup.program)
    stages = [stage]
    columns = _columns(columns_of, stage)
    for before in reversed(setup.equations.stages[: stage.level] if with_earlier else ()):
        if columns & set(range(before.unknowns.start, before.unknowns.stop)):
            stages.append(before)
            columns |= _columns(columns_of, before)
    rows = [row for each in reversed(stages) for row in range(each.rows.start, each.rows.stop)]
    many = sorted(columns)
    both = setup.program.slopes(z[None], setup.station.u[None], setup.station.p)
    own = np.hstack([each[0] for each in both])[np.ix_(rows, many)] / setup.by[rows, None]
    least = np.concatenate([setup.least, np.ones(len(setup.station.u))])[many]
    sizes = np.maximum(np.linalg.norm(own, axis=0), least)
    values = np.linalg.svd(own / sizes, compute_uv=False)
    rank = int(np.sum(values > SINGULAR * max(1.0, values[0])))
    if rank == min(own.shape) or rank >= LARGEST:
        return None
    return Block(tuple(rows), tuple(many), setup.by[rows], sizes, rank)


def _columns(columns_of: Sequence[frozenset[int]], stage: Stage) -> set[int]:
    """The columns that a group's constraints depend on."""
    return set().union(*columns_of[stage.rows])
