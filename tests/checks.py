"""What several test files ask of results: angles alike, residuals closed, forces of a document."""

from __future__ import annotations

from typing import Any

import numpy as np

import planar
from planar.dynamics.forces import Forces
from planar.equations.acceptance import AcceptanceFunctions, Scales
from planar.foundation.arrays import Array, BoolArray
from planar.solving.continuation import fast_path
from planar.solving.position import PositionSolver
from tests.builders import Value


def same_angles(found, wanted, far):
    np.testing.assert_allclose(np.exp(1j * found), np.exp(1j * np.asarray(wanted)), atol=far, rtol=0)


def passes_residual_check(mechanism, motion):
    """Whether every row is closed by the pairs' own formulas, run on plain numbers."""
    solver = PositionSolver(mechanism)
    u = np.stack([given.position for given in motion.inputs.values()], axis=1) / solver.input_scale
    gaps = solver.coordinate_residuals(solver.coordinates(motion.frames, motion.own), u)
    return gaps.shape[1] == len(motion) and bool(np.all(gaps <= solver.tolerance))


def forces_of(value: Value, **options: Any) -> Forces:
    return planar.forces(planar.solve(planar.from_dict(value)), **options)


ORDERS = ("position", "velocity", "acceleration")


def accept_steps(functions: AcceptanceFunctions, z: Array, u: Array, scales: Scales) -> BoolArray:
    """For each step of a run, z (samples, unknowns) and u (samples, inputs), whether it keeps to its branch."""
    way = np.diff(u, axis=0)
    before, after = (
        fast_path.step_ends(functions, z[part], u[part], way, scales) for part in (slice(-1), slice(1, None))
    )
    return fast_path.keep_branch(np.diff(z, axis=0), before, after, np.sum(way * way, axis=1), functions.block_starts)
