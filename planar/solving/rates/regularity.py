"""How a mechanism can move from a position: its mobility by rank, and whether its inputs determine its motion."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.equations.constraint_equations import Stage
from planar.equations.functions import Rates, length
from planar.foundation.errors import NoAnswer
from planar.solving.continuation.path import corrected
from planar.solving.diagnosis import refusals
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

SINGULAR = 1e-5
"""A group's slope is singular where its least singular value is below this part of its links' own reach.

Near a dead point the slope falls with the square root of the distance to it, so that round-off in the input of one
part in 1e16 becomes one in 1e16 / slope^2 in the velocity: at 1e-5 six digits remain, below they are lost.
"""
NOTHING = 1e-9
"""A strength below this is zero but for rounding."""
NEAR_BY = 1e-2
"""How far (rad, or lengths of the size) a position is moved to see whether what holds there holds elsewhere."""


class Crossing(Exception):
    """A position with one freedom more than inputs, to first order; `refused` says what to say if it is so in truth."""

    def __init__(self, refused: Callable[[], NoAnswer]):
        super().__init__()
        self.refused = refused


def mobility(setup: Setup, z: Array, motion: Rates) -> int:
    """The mobility at a position by rank; raises NoAnswer where the velocity is not determined, or contradicted.

    Raises Crossing where the next orders have to tell whether it is determined.

    With the inputs' positions counted as unknowns, what the pairs leave free is unknowns + inputs - rank.
    """
    inputs = setup.station.u.size
    found_weak = strengths(setup, motion.slope) < SINGULAR
    weak = [stage for stage, is_weak in zip(setup.equations.stages, found_weak, strict=True) if is_weak]
    square = all(length(stage.rows) == length(stage.unknowns) for stage in setup.equations.stages)
    if not weak and square:
        return inputs
    if not weak:
        # the unknowns are determined; each independent way in which the inputs break the rest is a freedom less
        found = inputs - _broken_ways(motion)
        if found < inputs and not _agree(setup, motion):
            raise refusals.disagreeing(setup, found, "velocities")
        return found
    found = z.size + inputs - _rank(_scaled(setup, np.hstack([motion.slope, motion.drive_slope])))
    links = _moving_at_rest(setup, motion.slope) or list(dict.fromkeys(link for stage in weak for link in stage.links))
    if found <= inputs:
        raise refusals.dead_point(setup, links)

    def refused() -> NoAnswer:
        from planar.solving.diagnosis.redundancy import ways_on  # only where something is refused

        ways = ways_on(setup, motion.w)
        always = any(always_weak(setup, stage, z) for stage in weak) if ways is None else ways > inputs
        return refusals.ever_free(setup, links) if always else refusals.change_point(setup, links, found, z)

    raise Crossing(refused) if found == inputs + 1 else refused()


def _broken_ways(motion: Rates) -> int:
    """The rank of what unit rates of the inputs leave open after the unknowns have done all they can."""
    if motion.slope.shape[0] == motion.slope.shape[1]:
        return 0
    sizes = np.maximum(np.linalg.norm(motion.drive_slope, axis=0), NOTHING)
    rates = np.linalg.lstsq(motion.slope, motion.drive_slope, rcond=1e-12)[0]
    left = (motion.drive_slope - motion.slope @ rates) / sizes
    return int(np.sum(np.linalg.svd(left, compute_uv=False) > SINGULAR))


def strengths(setup: Setup, slope: Array) -> Array:
    """The least singular value of every group's slope (..., stages), each column by what its links could reach at best.

    Zero at a dead point or a change point; lengths are divided by the reach of the group's links, so that neither
    their size nor that of the whole matters. `slope` is (..., rows, unknowns).
    """
    scaled = _scaled(setup, slope)
    stages = setup.equations.stages
    found = [_least(scaled[..., stage.rows, stage.unknowns]) for stage in stages]
    return np.stack(found, axis=-1) if stages else np.zeros((*slope.shape[:-2], 0))


def _least(own: Array) -> Array:
    if not own.shape[-1]:
        return np.ones(own.shape[:-2])
    if own.shape[-2] < own.shape[-1]:
        return np.zeros(own.shape[:-2])
    values = np.linalg.svd(own, compute_uv=False)
    return values[..., -1] / np.maximum(1.0, values[..., 0])


def _scaled(setup: Setup, slope: Array) -> Array:
    """A slope (..., rows, unknowns and inputs), every group's lengths in units of its reach, columns of one size.

    The size of an unknown's column is that in its own group, whatever large or small things later groups hang on it.
    A column that could reach further than it does now keeps what it lacks: it is that which vanishes.
    """
    scaled = slope / setup.by[:, None]
    sizes = np.maximum(np.linalg.norm(slope, axis=-2), 1.0)
    for stage in setup.equations.stages:
        own = np.linalg.norm(scaled[..., stage.rows, stage.unknowns], axis=-2)
        sizes[..., stage.unknowns] = np.maximum(own, setup.least[stage.unknowns])
    return scaled / sizes[..., None, :]


def cancelled(slope: Array, known: Array) -> Array:
    """The rates of the unknowns (unknowns,) that cancel what known rates open (rows,)."""
    if slope.shape[0] == slope.shape[1]:
        return np.linalg.solve(slope, -known) if known.size else np.zeros(0)
    return np.linalg.lstsq(slope, -known, rcond=1e-12)[0]


def _agree(setup: Setup, motion: Rates) -> bool:
    """Whether rates of the inputs that are more than the freedom do not contradict one another."""
    left = motion.slope @ cancelled(motion.slope, motion.F1) + motion.F1
    scale = np.max(np.abs(setup.station.u1), initial=0.0) or 1.0
    return bool(np.max(np.abs(left), initial=0.0) <= 1e-9 * scale)


def always_weak(setup: Setup, stage: Stage, z: Array) -> bool:
    """Whether a group is singular in closed positions near by too, so that it is no matter of this one."""
    u, p = setup.station.u, setup.station.p
    for seed in range(3):
        rng = np.random.default_rng(seed)
        near = u + rng.uniform(-NEAR_BY, NEAR_BY, u.size)
        moved = corrected(setup.program, p, z + rng.uniform(-NEAR_BY, NEAR_BY, z.size), near, stage.level)
        if moved is not None and strengths(setup, slope_at(setup, moved, near))[stage.level] > NOTHING:
            return False
    return True


def slope_at(setup: Setup, z: Array, u: Array) -> Array:
    """dF/dz (rows, unknowns) at unknowns z and inputs u."""
    return setup.program.slopes(z[None], u[None], setup.station.p)[0][0]


def _moving_at_rest(setup: Setup, slope: Array) -> list[str]:
    """The links that can move while the inputs are held, from the slope's null vectors."""
    _, values, vectors = np.linalg.svd(_scaled(setup, slope))
    null = vectors[int(np.sum(values > SINGULAR * max(1.0, values[0]))) :]
    if null.size == 0:
        return []
    return moved_by(setup, np.max(np.abs(null), axis=0))


def moved_by(setup: Setup, rates: Array) -> list[str]:
    """The links that rates of the unknowns (unknowns,) move."""
    share = np.abs(rates)
    moved = [
        setup.equations.coordinates[column].owner
        for column, part in zip(setup.equations.unknowns, share, strict=True)
        if part > 1e-3 * share.max()
    ]
    joined = [link for name in moved for link in (setup.pairs[name].links if name in setup.pairs else (name,))]
    return [link for link in dict.fromkeys(joined) if link != setup.mechanism.frame]


def _rank(matrix: Array) -> int:
    if matrix.size == 0:
        return 0
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(values > SINGULAR * max(1.0, values[0])))
