"""Residual and branch checks for many designs at once, each at the same step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.prediction import LEAST_START_REGULARITY, least_regularity
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import EquationFunctions, EquationRates
from planar.equations.linear import solve_arrays, solve_vectors
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, Scalar
from planar.model.mechanism import Mechanism
from planar.solving.checks.residual_check import EPS, NEGLIGIBLE_ERROR, ResidualCheck, stack_motion

Array = np.ndarray


class DesignFunctions:
    """Equation functions over many designs, each with its own p (numbers, designs)."""

    def __init__(self, functions: EquationFunctions, p: Array):
        self.functions = functions
        self.equations: ConstraintEquations = functions.equations
        self.p = np.ascontiguousarray(p.T)

    def correct(self, z: Array, u: Array) -> Array:
        """Newton's method from z (designs, unknowns) near by, at inputs u (designs, inputs)."""
        return self.functions.correct_samples(z, u, self.p) if z.size else z

    def coordinates(self, z: Array, u: Array) -> Array:
        """w (coordinates, designs)."""
        return np.ascontiguousarray(self.functions.coordinates(z, u, self.p).T)

    def jacobians(self, z: Array, u: Array) -> tuple[Array, Array]:
        """dF/dz (designs, rows, unknowns) and dF/du (designs, rows, inputs), as `EquationFunctions.jacobians`."""
        slopes, drives = self.functions.jacobians(z, u, self.p)
        return np.asarray(slopes), drives

    def kinematics(self, y: Array, y1: Array, y2: Array) -> EquationRates:
        """As `EquationFunctions.kinematics`, with an entry for each design."""
        found = self.functions.kinematics(y, y1, y2, self.p)
        return found._replace(jacobian=np.asarray(found.jacobian))


class DesignPositions(NamedTuple):
    """Where all designs are: z (designs, unknowns), u (designs, inputs), the Jacobians of F and of the unknowns."""

    z: Array
    u: Array
    jacobians: Array
    sensitivities: Array


def find_sensitivities(functions: DesignFunctions, z: Array, u: Array) -> DesignPositions:
    """Positions z (designs, unknowns), u (designs, inputs), with their derivatives."""
    jacobians, input_jacobians = functions.jacobians(z, u)
    return DesignPositions(z, u, jacobians, -solve_arrays(jacobians, input_jacobians))


def is_regular(functions: DesignFunctions, positions: DesignPositions) -> Array:
    """Whether the Jacobian of every block is regular enough to start from (designs,)."""
    regular = np.ones(len(positions.z), dtype=bool)
    for block in functions.equations.blocks:
        own = positions.jacobians[:, block.rows, block.unknowns]
        if own.size:
            arm = np.minimum(np.linalg.norm(own, axis=1).min(axis=1), 1.0)
            # short arms lose digits too, see `SHORT_ARM`
            least = np.maximum(LEAST_START_REGULARITY, np.sqrt(EPS / NEGLIGIBLE_ERROR / np.maximum(arm, 1e-300)))
            regular &= (column_volume(own) > least_regularity(least, own.shape[1])) & (arm > LEAST_START_REGULARITY)
    return regular


def column_volume(jacobians: Array) -> Array:
    """The volume that the columns of a Jacobian (designs, rows, unknowns) span, each of length one (designs,)."""
    if jacobians.shape[1:] == (2, 2):
        a, b, c, d = (jacobians[:, i, j] for i in (0, 1) for j in (0, 1))
        return np.abs(a * d - b * c) / np.sqrt(np.maximum((a * a + c * c) * (b * b + d * d), 1e-300))
    sizes = np.maximum(np.linalg.norm(jacobians, axis=1), 1e-300)
    return np.abs(np.linalg.det(jacobians)) / np.prod(sizes, axis=1)


class DesignResidualCheck:
    """The residual check, for designs each with its own p (numbers, designs), in units of the size."""

    def __init__(self, mechanism: Mechanism, functions: EquationFunctions, p: Array):
        self.p, self.column = p, coordinate_columns(functions.equations.coordinates)
        self.residual_check = ResidualCheck(mechanism, self.column)
        self.links = [link.name for link in mechanism.links]
        self.pairs = {pair.name: pair for pair in mechanism.pairs}

    def frames_from_coordinates(
        self, w: Sequence[Scalar] | Array
    ) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
        """Frames of links and own coordinates of pairs from w (coordinates, designs), arrays or jets."""
        return frames_from_coordinates(w, self.column, self.links, self.pairs)

    def is_resolved(self, w: Array) -> Array:
        """Whether no angle or length is so great that rounding takes digits of it (designs,)."""
        return EPS * np.abs(w).max(axis=0, initial=0.0) <= np.pi * NEGLIGIBLE_ERROR

    def worst_residual(self, w: Array, u: Array) -> Array:
        """What the worst constraint leaves open (designs,); w (coordinates, designs), u (inputs, designs)."""
        return self.residual_check.residuals(stack_motion([w.T], [u.T]), self.p).max(axis=0, initial=0.0)

    def worst_rate_residuals(self, w: Sequence[Array], u: Sequence[Array]) -> list[Array]:
        """How far velocities, then accelerations, break the worst constraint (designs,); w (designs, coordinates) and u
        (inputs, designs) with their first and second rates."""
        motion = stack_motion(w, [rates.T for rates in u])
        return [worst for worst, _ in self.residual_check.rate_residuals(motion, self.p)]


class DesignsAtStep(NamedTuple):
    """All designs at one step: z (designs, unknowns), u (inputs, designs), w (coordinates, designs), which of them have
    passed the checks at this step and all before, and the Jacobians by which they were judged."""

    z: Array
    u: Array
    w: Array
    passed: Array
    positions: DesignPositions


def make_residual_check(batch: DesignBatch) -> DesignResidualCheck:
    """The residual check for a march."""
    return DesignResidualCheck(batch.mechanism, batch.functions, batch.p)


def design_positions(functions: DesignFunctions, batch: DesignBatch, z: Array, u: Array) -> DesignsAtStep:
    """Designs at unknowns z (designs, unknowns) and inputs u (inputs, designs), with which of them pass."""
    w, check, positions = (
        functions.coordinates(z, u.T),
        make_residual_check(batch),
        find_sensitivities(functions, z, u.T),
    )
    passed = (check.worst_residual(w, u) <= batch.tolerance) & check.is_resolved(w) & is_regular(functions, positions)
    return DesignsAtStep(z, u, w, passed, positions)


def pair_positions(batch: DesignBatch, z: Array, u: Array) -> Array:
    """Where the pairs with stops are (stops, designs), in sizes and rad, at z (unknowns, designs), u (inputs, designs).

    Not a number where one of these is none.
    """
    functions = batch.functions
    w = DesignFunctions(functions, batch.p).coordinates(np.ascontiguousarray(z.T), np.ascontiguousarray(u.T))
    links, pairs = [link.name for link in batch.mechanism.links], {each.name: each for each in batch.mechanism.pairs}
    column = coordinate_columns(functions.equations.coordinates)
    frames, own = frames_from_coordinates(w, column, links, pairs)
    found = np.empty((len(batch.stop_pairs), u.shape[1]))
    for row, pair in zip(found, batch.stop_pairs, strict=True):
        row[:] = pair.input_position([frames[link] for link in pair.bodies], (), own.get(pair.name, ()))
    return found


class PointWriter:
    """The points of a march, with their rates."""

    def __init__(self, batch: DesignBatch, functions: DesignFunctions):
        self.batch, self.functions, self.residual_check = batch, functions, make_residual_check(batch)

    def write(self, out: Array, row: DesignsAtStep) -> Array:
        """Write the points of a step (rows, designs); whether their rates break no constraint (designs,)."""
        batch = self.batch
        if not batch.rates:
            self._write_points(out, row.w)
            return np.ones(row.w.shape[1:] or row.passed.shape, dtype=bool)
        found = self._rates(row)
        w = [Jet(*(np.ascontiguousarray(part[:, k]) for part in found)) for k in range(found[0].shape[1])]
        self._write_points(out, w)
        gaps = self.residual_check.worst_rate_residuals(found, (row.u, batch.u1, batch.u2))
        return np.all([gap <= 1e3 * batch.tolerance for gap in gaps], axis=0)

    def _rates(self, row: DesignsAtStep) -> tuple[Array, Array, Array]:
        """w with its first and second rates, each (designs, coordinates)."""
        batch, none = self.batch, np.zeros_like(row.z)
        y, u1, u2 = np.hstack([row.z, row.u.T]), batch.u1.T, batch.u2.T

        def at(z1: Array, z2: Array) -> EquationRates:
            return self.functions.kinematics(y, np.hstack([z1, u1]), np.hstack([z2, u2]))

        z1 = (row.positions.sensitivities @ u1[:, :, None])[..., 0]
        z2 = -solve_vectors(row.positions.jacobians, at(z1, none).F2)
        found = at(z1, z2)
        return found.w, found.w1, found.w2

    def _write_points(self, out: Array, w: Sequence[Scalar] | Array) -> None:
        frames, _ = self.residual_check.frames_from_coordinates(w)
        many = 2 * len(self.batch.links)
        for k, link in enumerate(self.batch.links):
            place = frames[link].to_world(Vector(*self.batch.q[2 * k : 2 * k + 2]))
            for axis, value in enumerate(place):
                for order, part in enumerate(value.parts if isinstance(value, Jet) else (value,)):
                    np.multiply(part, self.batch.unit, out=out[order * many + 2 * k + axis])
