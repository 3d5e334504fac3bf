"""The branch check: do two positions of a run lie on one branch, and on no other?

Two positions lie on one branch if every unknown has moved as its rates allow, and if no block can have been singular
between. A Jacobian stays regular until it has changed by its least singular value (Weyl), so least value over rate of
change is a distance in which nothing happens: a step must be shorter than those at its two ends together. So a change
point, where branches cross, is not passed within a step, whichever sign the determinant has beyond it and however the
rates there agree.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.equations.acceptance import AcceptanceFunctions, InputSamples, Scales
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.recorded_formula import greatest_entries
from planar.solving.checks.singular_values import SINGULAR_DISTANCE_RATIO


class StepEnds(NamedTuple):
    """What is known at one end of each step: the rates of the unknowns, as moves over the whole step (steps, unknowns),
    and how far, in steps, each block is from where it could be singular, with the sign of its determinant (steps,
    blocks)."""

    rates: Array
    distances: Array


def step_ends(functions: AcceptanceFunctions, z: Array, u: Array, way: Array, scales: Scales) -> StepEnds:
    """What is known at positions z (steps, unknowns) and u (steps, inputs) of steps by `way` (steps, inputs)."""
    judged = functions.judge(z, InputSamples(u, way, np.zeros_like(way)), scales)
    return StepEnds(judged.coordinate_rates[:, 1, functions.unknown_columns], judged.distances)


def keep_branch(
    moves: Array,
    before: StepEnds,
    after: StepEnds,
    squares: Array,
    block_starts: IntArray,
    ratio: float = SINGULAR_DISTANCE_RATIO,
) -> Array:
    """For each step, by the moves of its unknowns (steps, unknowns), whether it keeps to its branch; of its inputs the
    sums of squares (steps,). `ratio` says how many steps its ends together have to be from where a block is singular.

    True or False, or recorded: then 1 or 0.
    """
    if not moves.shape[1]:
        return np.ones(len(moves), dtype=bool)
    with np.errstate(all="ignore"):  # what is not a number is no more than anything
        is_far = _all_of_step(np.abs(before.distances) + np.abs(after.distances) > ratio)
        smooth = _all_of_step(is_move_allowed(moves, before.rates, after.rates))
        return smooth * is_far * keep_signs(before, after) * keep_direction(before, after, squares, block_starts)


def _all_of_step(conditions: Array | BoolArray) -> Array:
    """For each step whether all its conditions (steps, conditions) hold."""
    hold: Array = np.multiply.reduce(conditions, axis=1, dtype=conditions.dtype)
    return hold


def keep_signs(before: StepEnds, after: StepEnds) -> Array:
    """For each step whether the determinant of every block keeps its sign.

    Of two assemblies that come near to each other before a dead point each has another one, so that no step leads from
    one to the other, however alike they are.
    """
    return _all_of_step(before.distances * after.distances >= 0.0)


def keep_direction(before: StepEnds, after: StepEnds, squares: Array, block_starts: IntArray) -> Array:
    """For each step whether every block goes on as it came: less than a right angle between the tangents.

    Beside a limit both ends of a step may be closed, and any move allowed by rates that grow beyond all bounds there;
    but on the branch that comes back from the limit they have the other sign.
    """
    turns = np.add.reduceat(before.rates * after.rates, block_starts, axis=1)
    return _all_of_step(turns + squares[:, None] >= 0.0)


def is_move_allowed(move: Array, before: Array, after: Array) -> Array:
    """Whether a move is one that the rates at its two ends allow, each as a move over the whole step.

    A smooth move differs from the mean of the two by no more than they differ from one another, with room for the
    curvature between (a quarter of the greater) and a floor of round-off for what hardly moves.
    """
    greater = greatest_entries(np.array([np.abs(before), np.abs(after)]))
    allowed: Array = np.abs(move - 0.5 * (before + after)) <= np.abs(after - before) + 0.25 * greater + 1e-9
    return allowed
