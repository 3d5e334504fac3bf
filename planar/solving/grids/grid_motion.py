"""Positions at any inputs, one row each, as a motion: rates, and both parts of the gate, as in a run."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.results.motion import Motion
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.position import PositionSolver
from planar.solving.rates.sample_rates import InputRates
from planar.solving.runs.samples import RunSamples, build_motion


def motion_at_inputs(solver: PositionSolver, assembly: Assembly, z: Array, u: Array) -> Motion:
    """The positions of unknowns z (n, unknowns) at inputs u (n, inputs), scaled, at the file's own rates.

    The rows are positions side by side and no run. Raises NoAnswer where one does not close.
    """
    s = solver.inputs
    rates = (np.broadcast_to(rate, u.shape).copy() for rate in (s.u1, s.u2, np.zeros_like(s.u)))
    run = RunSamples(z, InputRates(u, *rates))
    return build_motion(solver, assembly, run, False, None)
