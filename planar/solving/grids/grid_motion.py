"""Positions at any inputs, one row each, as a motion: rates, and both parts of the gate, as in a run."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.continuation.path import follow_samples
from planar.solving.position import PositionSolver, solved_mechanism
from planar.solving.rates.sample_rates import InputRates
from planar.solving.runs.samples import RunSamples, build_motion


def motion_at_inputs(solver: PositionSolver, assembly: Assembly, z: Array, u: Array) -> Motion:
    """The positions of unknowns z (n, unknowns) at inputs u (n, inputs), scaled, at the file's own rates.

    The rows are positions side by side and no run. Raises NoAnswer where one does not close.
    """
    s = solver.inputs
    rates = (np.broadcast_to(rate, u.shape).copy() for rate in (s.u1, s.u2, np.zeros_like(s.u)))
    run = RunSamples(z, InputRates(u, *rates))
    return build_motion(solver, solver.remarks(assembly), run, False, None)


def motion_over_input(mechanism: Mechanism, positions: Array) -> Motion:
    """The positions of a mechanism of one input at positions (n,) of it (rad or m), in one run from its own.

    The rows are positions side by side and no run. Raises NoAnswer where the run does not reach one.
    """
    known = solved_mechanism(mechanism)
    solver = known.solver
    u = positions[:, None] / (solver.unit if solver.is_sliding(mechanism.inputs[0].pair) else 1.0)
    order = np.argsort(positions)
    way = follow_samples(solver, solver.inputs.p, known.assembly.z, np.concatenate([solver.inputs.u[None], u[order]]))
    if way.stopped is not None:
        raise way.stopped
    z = np.empty((len(u), way.z.shape[1]))
    z[order] = way.z[1:]
    return motion_at_inputs(solver, known.assembly, z, u)
