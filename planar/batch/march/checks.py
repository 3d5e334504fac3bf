"""The residual check, the regularity and the points of many designs at once, by casadi's functions."""

from __future__ import annotations

from copy import copy
from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import DesignBatch
from planar.batch.march.design_functions import DesignFunctions
from planar.batch.march.regularity import LEAST_NUMPY_REGULARITY, least_regularity
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import EquationFunctions, EquationRates
from planar.equations.linear import solve_arrays, solve_vectors
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.equations.residuals import split_pair_numbers
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet
from planar.model.mechanism import Mechanism
from planar.solving.checks.branch_check import BranchCheck
from planar.solving.checks.residual_check import EPS, NEGLIGIBLE_ERROR, ResidualCheck

Array = np.ndarray


class DesignPositions(NamedTuple):
    """Where all designs are: z (designs, unknowns), u (designs, inputs), with the slopes of F and of the unknowns."""

    z: Array
    u: Array
    jacobians: Array
    sensitivities: Array


class DesignBranchCheck(BranchCheck):
    """The second part of the gate, for designs each with its own p (numbers, designs): see `Branch`."""

    def __init__(self, columns: DesignFunctions, p: Array):
        super().__init__(columns, p)  # type: ignore[arg-type] - it asks for slopes and equations only

    def evaluate(self, z: Array, u: Array) -> DesignPositions:
        """What is judged at a step; z (designs, unknowns), u (designs, inputs)."""
        slopes, drives = self.functions.jacobians(z, u, self.p)
        return DesignPositions(z, u, slopes, -solve_arrays(slopes, drives))

    def is_regular(self, positions: DesignPositions) -> Array:
        """Whether the slope of every group is regular enough for a backend (designs,)."""
        found = np.ones(len(positions.z), dtype=bool)
        for stage in self.functions.equations.blocks:
            own = positions.jacobians[:, stage.rows, stage.unknowns]
            if own.size:
                arm = np.minimum(np.linalg.norm(own, axis=1).min(axis=1), 1.0)
                # short arms lose digits too, see `SHORT_ARM`
                least = np.maximum(LEAST_NUMPY_REGULARITY, np.sqrt(EPS / NEGLIGIBLE_ERROR / np.maximum(arm, 1e-300)))
                found &= column_volume(own) > (least_regularity(least, own.shape[1]))
        return found


def column_volume(jacobians: Array) -> Array:
    """The volume that the columns of a slope (designs, rows, unknowns) span, each of length one (designs,)."""
    if jacobians.shape[1:] == (2, 2):
        a, b, c, d = (jacobians[:, i, j] for i in (0, 1) for j in (0, 1))
        return np.abs(a * d - b * c) / np.sqrt(np.maximum((a * a + c * c) * (b * b + d * d), 1e-300))
    sizes = np.maximum(np.linalg.norm(jacobians, axis=1), 1e-300)
    return np.abs(np.linalg.det(jacobians)) / np.prod(sizes, axis=1)


class DesignResidualCheck:
    """The first part of the gate, for designs each with its own p (numbers, designs), in units of the size."""

    def __init__(self, residual_check: ResidualCheck, mechanism: Mechanism, program: EquationFunctions, p: Array):
        self.mechanism, self.program = mechanism, program
        self.residual_check = copy(residual_check)
        self.residual_check.unit = 1.0
        self.residual_check.numbers = split_pair_numbers(mechanism.pairs, p)
        # a pin of many links has motions between links that no pair of its own joins
        for given in mechanism.inputs:
            self.residual_check.numbers.setdefault(given.pair, tuple(residual_check.numbers[given.pair]))
        self.column = coordinate_columns(program.equations.coordinates)
        self.links = [link.name for link in mechanism.links]
        self.pairs = {pair.name: pair for pair in mechanism.pairs}

    def frames_from_coordinates(self, w):  # noqa: ANN001, ANN201 - arrays or jets alike
        """Frames of links and own coordinates of pairs from w (coordinates, designs)."""
        return frames_from_coordinates(w, self.column, self.links, self.pairs)

    def is_resolved(self, w: Array) -> Array:
        """Whether no angle or length is so great that rounding takes digits of it (designs,)."""
        return EPS * np.abs(w).max(axis=0, initial=0.0) <= np.pi * NEGLIGIBLE_ERROR

    def worst_residual(self, w: Array, u: Array) -> Array:
        """What the worst constraint leaves open (designs,); w (coordinates, designs), u (inputs, designs)."""
        frames, own = self.frames_from_coordinates(w)
        gaps = self.residual_check.residuals(frames, own, u)
        return np.broadcast_to(gaps.max(axis=0, initial=0.0), w.shape[1:] or u.shape[1:])


class DesignsAtStep(NamedTuple):
    """All designs at one step: z (designs, unknowns), u (inputs, designs), w (coordinates, designs), which of them have
    passed the gate at this step and all before, and the slopes by which they were judged."""

    z: Array
    u: Array
    w: Array
    passed: Array
    positions: DesignPositions


def make_residual_check(task: DesignBatch) -> DesignResidualCheck:
    """The first part of the gate for a march."""
    own = shapes_of_links(task.mechanism)
    return DesignResidualCheck(
        ResidualCheck(task.mechanism, own, mechanism_size(task.mechanism, own)), task.mechanism, task.program, task.p
    )


def design_positions(functions: DesignFunctions, batch: DesignBatch, z: Array, u: Array) -> DesignsAtStep:
    """Designs at unknowns z (designs, unknowns) and inputs u (inputs, designs), with which of them pass."""
    w, regularity, closed = (
        functions.coordinates(z, u.T),
        DesignBranchCheck(functions, batch.p),
        make_residual_check(batch),
    )
    here = regularity.evaluate(z, u.T)
    passed = (closed.worst_residual(w, u) <= batch.tolerance) & closed.is_resolved(w) & regularity.is_regular(here)
    return DesignsAtStep(z, u, w, passed, here)


class PointWriter:
    """The points of a march, with their rates."""

    def __init__(self, task: DesignBatch, functions: DesignFunctions):
        self.task, self.functions, self.residual_check = task, functions, make_residual_check(task)

    def write(self, out: Array, row: DesignsAtStep) -> Array:
        """Write the points of a step (rows, designs); whether their rates break no constraint (designs,)."""
        task = self.task
        if not task.rates:
            self._write_points(out, row.w)
            return np.ones(row.w.shape[1:] or row.passed.shape, dtype=bool)
        found = self._rates(row)
        w = [Jet(*(np.ascontiguousarray(part[:, k]) for part in found)) for k in range(found[0].shape[1])]
        self._write_points(out, w)
        frames, own = self.residual_check.frames_from_coordinates(w)
        inputs = [Jet(u, u1, u2) for u, u1, u2 in zip(row.u, task.u1, task.u2, strict=True)]
        gaps = self.residual_check.residual_check.rate_residuals(frames, own, inputs)
        return np.all([np.broadcast_to(gap, row.passed.shape) <= 1e3 * task.tolerance for gap, _ in gaps], axis=0)

    def _rates(self, row: DesignsAtStep) -> tuple[Array, Array, Array]:
        """w with its first and second rates, each (designs, coordinates)."""
        task, none = self.task, np.zeros_like(row.z)
        y, u1, u2 = np.hstack([row.z, row.u.T]), task.u1.T, task.u2.T

        def at(z1: Array, z2: Array) -> EquationRates:
            return self.functions.kinematics(y, np.hstack([z1, u1]), np.hstack([z2, u2]))

        z1 = (row.positions.sensitivities @ u1[:, :, None])[..., 0]
        z2 = -solve_vectors(row.positions.jacobians, at(z1, none).F2)
        found = at(z1, z2)
        return found.w, found.w1, found.w2

    def _write_points(self, out: Array, w) -> None:  # noqa: ANN001 - arrays or jets alike
        frames, _ = self.residual_check.frames_from_coordinates(w)
        many = 2 * len(self.task.links)
        for k, link in enumerate(self.task.links):
            place = frames[link].to_world(Vector(*self.task.q[2 * k : 2 * k + 2]))
            for axis, value in enumerate(place):
                for order, part in enumerate(value.parts if isinstance(value, Jet) else (value,)):
                    np.multiply(part, self.task.unit, out=out[order * many + 2 * k + axis])
