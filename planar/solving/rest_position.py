"""Where a mechanism stands, without rates: on dead points and change points too, where a velocity is none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.equations.functions import placed
from planar.model.mechanism import Drive, Mechanism, with_inputs
from planar.results.motion import State
from planar.solving.continuation.path import follow
from planar.solving.diagnosis import refusals
from planar.solving.full_constraints import Constraints, null_space
from planar.solving.position import known_of
from planar.solving.rates.regularity import SINGULAR, strengths


def standing(mechanism: Mechanism, drives: Sequence[Drive] = ()) -> State:
    """The position that `solve` finds, all rates zero; its mobility is that of this position.

    Raises NoAnswer where the mechanism cannot be assembled, or inputs leave it free or cannot be moved there.
    """
    known = known_of(mechanism)
    solver, z, remarks = known.solver, known.assembly.z, known.remarks
    if drives:
        there = solver.moved(with_inputs(mechanism, tuple(drives)))
        z = follow(there, there.station.p, z, solver.station.u, there.station.u)
        solver = there
    u, p = solver.station.u, solver.station.p
    gaps = solver.gaps(z[None], u[None])[:, 0]
    residual = float(gaps.max(initial=0.0))
    if residual > solver.tolerance:
        raise refusals.not_closed(solver, solver.gate.names[int(np.argmax(gaps))], residual)
    w = solver.program.positions(z, u, p).full().ravel()
    frames, own = placed((w * solver.scale).tolist(), solver.column, solver.shapes, solver.pairs)
    solver.refuse_gap(frames, own)
    slopes = solver.program.slopes(z[None], u[None], p)
    # what is held to second order only is no freedom: the pairs' own slope does not see it, the deflated one does
    slope = np.hstack([each[0] for each in slopes]) if solver.deflated else Constraints(solver).slope(w)
    mobility = null_space(slope).shape[1] if w.size else 0
    if np.any(strengths(solver, slopes[0][0]) < SINGULAR):
        told = "the inputs are on a dead point or a change point, where places are exact to the root of rounding only"
        remarks = (*remarks, told)
    return State(solver.mechanism, mobility, residual, remarks, frames, own, solver.shapes)
