"""Both parts of the gate for many designs at once, each at the same step."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from planar.batch.march.design_functions import DesignFunctions
from planar.batch.march.regularity import LEAST_NUMPY_REGULARITY, least_regularity
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_arrays
from planar.equations.residuals import split_pair_numbers
from planar.foundation.geometry import Frame
from planar.foundation.jets import Scalar
from planar.model.mechanism import Mechanism
from planar.solving.checks.branch_check import BranchCheck, is_move_allowed
from planar.solving.checks.residual_check import EPS, NEGLIGIBLE_ERROR, ResidualCheck
from planar.solving.checks.singular_values import SINGULAR_DISTANCE_RATIO

Array = np.ndarray


class DesignPositions(NamedTuple):
    """Where all designs are: z (designs, unknowns), u (designs, inputs), with the slopes of F and of the unknowns."""

    z: Array
    u: Array
    jacobians: Array
    sensitivities: Array


class DesignBranchCheck(BranchCheck):
    """The second part of the gate, for designs each with its own p: see `BranchCheck`."""

    def __init__(self, functions: DesignFunctions):
        super().__init__(functions.program, functions.p)

    def evaluate(self, z: Array, u: Array) -> DesignPositions:
        """What is judged at a step; z (designs, unknowns), u (designs, inputs)."""
        slopes, drives = self.functions.jacobians(z, u, self.p)
        return DesignPositions(z, u, slopes, -solve_arrays(slopes, drives))

    def check_step(
        self, before: DesignPositions, after: DesignPositions, regular_distance: Array | None
    ) -> tuple[Array, Array]:
        """Whether each design kept to its branch in a step (designs,), and how far ahead each is from leaving it.

        `ahead` is the latter from the step before, where that went as far as this one.
        """
        way = after.u - before.u
        first, second = ((each.sensitivities @ way[:, :, None])[..., 0] for each in (before, after))
        keeps = np.all(is_move_allowed(after.z - before.z, first, second), axis=1) & self._keeps_direction(
            first, second, way
        )
        clear = (
            self._singular_distances(before.z, before.u, before.jacobians, first, way)
            if regular_distance is None
            else regular_distance
        )
        further = self._singular_distances(after.z, after.u, after.jacobians, second, way)
        return keeps & np.all(clear + further > SINGULAR_DISTANCE_RATIO, axis=1), further

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
        self.residual_check.numbers = {**split_pair_numbers(mechanism.pairs, list(p))}
        # a pin of many links has motions between links that no pair of its own joins
        for given in mechanism.inputs:
            self.residual_check.numbers.setdefault(given.pair, tuple(residual_check.numbers[given.pair]))
        self.column = coordinate_columns(program.equations.coordinates)
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
        frames, own = self.frames_from_coordinates(w)
        gaps = self.residual_check.residuals(frames, own, u)
        return np.broadcast_to(gaps.max(axis=0, initial=0.0), w.shape[1:] or u.shape[1:])
