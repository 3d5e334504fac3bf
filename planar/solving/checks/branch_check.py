"""The branch check: do two positions of a run lie on one branch, and on no other?"""

from __future__ import annotations

import numpy as np

from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_arrays
from planar.equations.sparse_matrices import SparseMatrices
from planar.foundation.arrays import Array, BoolArray
from planar.solving.checks.singular_values import (
    DIFFERENCE_STEP,
    SINGULAR_DISTANCE_RATIO,
    column_norms,
    least_singular_values,
    singular_distance,
)

ZERO_SINGULAR_VALUE = 1e-6
"""A least singular value that is zero: on the singular position itself it is what rounding left."""


class BranchCheck:
    """Judges the steps of runs of one program, with one set of numbers p.

    Two positions lie on one branch if every unknown has moved as its rates allow, and if no block can have been
    singular between. A Jacobian stays regular until it has changed by its least singular value (Weyl), so least value
    over rate of change is a distance in which nothing happens: a step must be shorter than those at its two ends
    together. So a change point, where branches cross, is not passed within a step, whichever sign the determinant has
    beyond it and however the rates there agree.
    """

    def __init__(self, program: EquationFunctions, p: Array):
        self.functions, self.p = program, p

    def accept_steps(self, z: Array, u: Array) -> Array:
        """For each step of a run, z (samples, unknowns) and u (samples, inputs), whether it keeps to the branch."""
        slopes, drives = self.functions.jacobians(z, u, self.p)
        gains = -solve_arrays(slopes, drives)
        way = np.diff(u, axis=0)
        before, after = ((gain @ way[:, :, None])[..., 0] for gain in (gains[:-1], gains[1:]))
        smooth = np.all(is_move_allowed(np.diff(z, axis=0), before, after), axis=1)
        smooth &= self._keeps_direction(before, after, way)
        first = self._singular_distances(z[:-1], u[:-1], slopes[:-1], before, way)
        second = self._singular_distances(z[1:], u[1:], slopes[1:], after, way)
        return smooth & self._keeps_signs(slopes) & np.all(first + second > SINGULAR_DISTANCE_RATIO, axis=1)

    def _keeps_signs(self, slopes: Array | SparseMatrices) -> Array:
        """For each step whether the determinant of every block keeps its sign (steps,).

        Of two assemblies that come near to each other before a dead point each has another one, so that no step leads
        from one to the other, however alike they are.
        """
        keeps = np.ones(len(slopes) - 1, dtype=bool)
        for stage in self.functions.equations.blocks:
            own = slopes[:, stage.rows, stage.unknowns]
            if own.size and own.shape[1] == own.shape[2]:
                signs = np.linalg.slogdet(own)[0]
                keeps &= signs[:-1] * signs[1:] >= 0.0
        return keeps

    def _keeps_direction(self, before: Array, after: Array, input_step: Array) -> Array:
        """For each step whether every block goes on as it came (steps,): less than a right angle between the tangents.

        Beside a limit both ends of a step may be closed, and any move allowed by rates that grow beyond all bounds
        there; but on the branch that comes back from the limit they have the other sign.
        """
        both, straight = before * after, np.sum(input_step * input_step, axis=1)
        turns = [np.sum(both[:, stage.unknowns], axis=1) for stage in self.functions.equations.blocks]
        return (
            np.all([turn + straight >= 0.0 for turn in turns], axis=0)
            if turns
            else np.ones(len(input_step), dtype=bool)
        )

    def _singular_distances(
        self, z: Array, u: Array, slopes: Array | SparseMatrices, rates: Array, input_step: Array
    ) -> Array:
        """How far each block is from where it could be singular (samples, blocks), in steps of rates and way."""
        pace = np.maximum(np.max(np.abs(np.hstack([rates, input_step])), axis=1, initial=0.0), 1e-300)[:, None]
        nudge = DIFFERENCE_STEP / np.maximum(pace, DIFFERENCE_STEP)
        moved, _ = self.functions.jacobians(z + nudge * rates, u + nudge * input_step, self.p)
        distances = np.full((len(z), len(self.functions.equations.blocks)), np.inf)
        for index, stage in enumerate(self.functions.equations.blocks):
            here, there = (each[:, stage.rows, stage.unknowns] for each in (slopes, moved))
            if here.size:
                # columns of one size, so that a small link counts as much as a large one
                sizes = column_norms(here, 1e-300)[:, None]
                change = np.linalg.norm((there - here) / sizes, axis=(1, 2)) / nudge[:, 0]
                least = least_singular_values(here / sizes)
                # on the singular position itself rates are rounding, and say nothing of how it changes
                distances[:, index] = np.where(least < ZERO_SINGULAR_VALUE, 0.0, singular_distance(least, change))
        return np.nan_to_num(distances, nan=0.0, posinf=np.inf)


def is_move_allowed(move: Array, before: Array, after: Array) -> BoolArray:
    """Whether a move is one that the rates at its two ends allow, each as a move over the whole step.

    A smooth move differs from the mean of the two by no more than they differ from one another, with room for the
    curvature between (a quarter of the greater) and a floor of round-off for what hardly moves.
    """
    room = np.abs(after - before) + 0.25 * np.maximum(np.abs(before), np.abs(after)) + 1e-9
    return np.abs(move - 0.5 * (before + after)) <= room
