"""Residual and branch checks for many designs at once, each at the same step, and their points with rates."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.prediction import LEAST_START_REGULARITY, least_regularity
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import EquationRates
from planar.equations.linear import solve_arrays, solve_vectors
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, Scalar
from planar.solving.checks import EPS, NEGLIGIBLE_ERROR, ResidualCheck, stack_motion

Array = np.ndarray


class DesignPositions(NamedTuple):
    """Where all designs are: z (designs, unknowns), u (inputs, designs), w (coordinates, designs), dF/dz (designs,
    rows, unknowns) and dF/du (designs, rows, inputs)."""

    z: Array
    u: Array
    w: Array
    jacobians: Array
    input_jacobians: Array


class DesignEvaluation:
    """The equations of a batch of designs in numbers, each with its own p, their checks, and their points."""

    def __init__(self, batch: DesignBatch):
        self.batch, self.functions = batch, batch.functions
        self.p = np.ascontiguousarray(batch.p.T)

    def correct(self, z: Array, u: Array) -> Array:
        """Newton's method from z (designs, unknowns) near by, at inputs u (designs, inputs)."""
        return self.functions.correct_samples(np.ascontiguousarray(z), u, self.p) if z.size else z

    def jacobians(self, z: Array, u: Array) -> tuple[Array, Array]:
        """dF/dz (designs, rows, unknowns) and dF/du (designs, rows, inputs), as `EquationFunctions.jacobians`."""
        jacobians, input_jacobians = self.functions.jacobians(z, u, self.p)
        return np.asarray(jacobians), input_jacobians

    def kinematics(self, y: Array, y1: Array, y2: Array) -> EquationRates:
        """As `EquationFunctions.kinematics`, with an entry for each design."""
        rates = self.functions.kinematics(y, y1, y2, self.p)
        return rates._replace(jacobian=np.asarray(rates.jacobian))

    def positions(self, z: Array, u: Array) -> DesignPositions:
        """The positions of unknowns z (designs, unknowns) and inputs u (inputs, designs)."""
        w = np.ascontiguousarray(self.functions.coordinates(z, u.T, self.p).T)
        return DesignPositions(z, u, w, *self.jacobians(z, u.T))

    @cached_property
    def _column(self) -> dict[tuple[str, str], int]:
        return coordinate_columns(self.functions.equations.coordinates)

    def _frames(self, w: Sequence[Scalar] | Array) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
        """Frames of links and own coordinates of pairs from w (coordinates, designs), arrays or jets."""
        mechanism = self.batch.mechanism
        links, pairs = [link.name for link in mechanism.links], {pair.name: pair for pair in mechanism.pairs}
        return frames_from_coordinates(w, self._column, links, pairs)

    def pair_positions(self, z: Array, u: Array) -> Array:
        """Where the pairs with stops are (stops, designs), in sizes and rad, at z (unknowns, designs), u (inputs,
        designs).

        Not a number where one of these is none.
        """
        w = self.functions.coordinates(np.ascontiguousarray(z.T), np.ascontiguousarray(u.T), self.p).T
        frames, coordinates = self._frames(np.ascontiguousarray(w))
        positions = np.empty((len(self.batch.stop_pairs), u.shape[1]))
        for row, pair in zip(positions, self.batch.stop_pairs, strict=True):
            row[:] = pair.input_position([frames[link] for link in pair.bodies], (), coordinates.get(pair.name, ()))
        return positions

    @cached_property
    def _residual_check(self) -> ResidualCheck:
        return ResidualCheck(self.batch.mechanism, self._column)

    def is_closed(self, positions: DesignPositions) -> Array:
        """Whether the residual of every constraint is at most the tolerance, in units of the size (designs,)."""
        motion = stack_motion([positions.w.T], [positions.u.T])
        worst = self._residual_check.residuals(motion, self.batch.p).max(axis=0, initial=0.0)
        return np.asarray(worst <= self.batch.tolerance)

    def accepts(self, positions: DesignPositions) -> Array:
        """Whether designs pass the checks of a position (designs,)."""
        # of a great angle or length rounding takes digits
        is_resolved = EPS * np.abs(positions.w).max(axis=0, initial=0.0) <= np.pi * NEGLIGIBLE_ERROR
        return self.is_closed(positions) & is_resolved & self._is_regular(positions.jacobians)

    def _is_regular(self, jacobians: Array) -> Array:
        """Whether the Jacobian of every block is regular enough to start from (designs,)."""
        regular = np.ones(len(jacobians), dtype=bool)
        for block in self.functions.equations.blocks:
            block_jacobians = jacobians[:, block.rows, block.unknowns]
            if block_jacobians.size:
                arm = np.minimum(np.linalg.norm(block_jacobians, axis=1).min(axis=1), 1.0)
                # short arms lose digits too, see `SHORT_ARM`
                base = np.maximum(LEAST_START_REGULARITY, np.sqrt(EPS / NEGLIGIBLE_ERROR / np.maximum(arm, 1e-300)))
                minimum = least_regularity(base, block_jacobians.shape[1])
                regular &= (column_volume(block_jacobians) > minimum) & (arm > LEAST_START_REGULARITY)
        return regular

    def write_points(self, out: Array, positions: DesignPositions) -> Array:
        """Write the points of a step, with their rates, to `out` (rows, designs); whether their rates break no
        constraint (designs,)."""
        batch, motion = self.batch, None
        w: Sequence[Scalar] | Array = positions.w
        if batch.rates:
            motion = self._coordinate_rates(positions)
            w = [Jet(*(np.ascontiguousarray(part[:, k]) for part in motion)) for k in range(len(w))]
        frames, _ = self._frames(w)
        order_rows = 2 * len(batch.links)
        for k, link in enumerate(batch.links):
            place = frames[link].to_world(Vector(*batch.q[2 * k : 2 * k + 2]))
            for axis, value in enumerate(place):
                for order, part in enumerate(value.parts if isinstance(value, Jet) else (value,)):
                    np.multiply(part, batch.unit, out=out[order * order_rows + 2 * k + axis])
        if motion is None:
            return np.ones(out.shape[1], dtype=bool)
        stacked = stack_motion(motion, [rates.T for rates in (positions.u, batch.u1, batch.u2)])
        gaps = [gap for gap, _ in self._residual_check.rate_residuals(stacked, batch.p)]
        return np.all([gap <= 1e3 * batch.tolerance for gap in gaps], axis=0)

    def _coordinate_rates(self, positions: DesignPositions) -> tuple[Array, Array, Array]:
        """w with its first and second rates, each (designs, coordinates)."""
        u1, u2 = self.batch.u1.T, self.batch.u2.T
        y = np.hstack([positions.z, positions.u.T])
        sensitivities = -solve_arrays(positions.jacobians, positions.input_jacobians)
        z1 = (sensitivities @ u1[:, :, None])[..., 0]
        y1 = np.hstack([z1, u1])
        z2 = -solve_vectors(positions.jacobians, self.kinematics(y, y1, np.hstack([np.zeros_like(z1), u2])).F2)
        rates = self.kinematics(y, y1, np.hstack([z2, u2]))
        return rates.w, rates.w1, rates.w2


def column_volume(jacobians: Array) -> Array:
    """The volume that the columns of a Jacobian (designs, rows, unknowns) span, each of length one (designs,)."""
    if jacobians.shape[1:] == (2, 2):
        a, b, c, d = (jacobians[:, i, j] for i in (0, 1) for j in (0, 1))
        return np.abs(a * d - b * c) / np.sqrt(np.maximum((a * a + c * c) * (b * b + d * d), 1e-300))
    sizes = np.maximum(np.linalg.norm(jacobians, axis=1), 1e-300)
    return np.abs(np.linalg.det(jacobians)) / np.prod(sizes, axis=1)
