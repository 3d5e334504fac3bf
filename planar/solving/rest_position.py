"""A position solved without rates, as dead points and change points allow."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.results.motion import State
from planar.solving.checks.singular_values import MIN_REGULARITY, null_space
from planar.solving.continuation.path import follow_to
from planar.solving.diagnosis import refusals
from planar.solving.full_constraints import FullConstraints
from planar.solving.position import solved_mechanism
from planar.solving.rates.regularity import regularity


def rest_position(mechanism: Mechanism, drives: Sequence[Drive] = ()) -> State:
    """The position that `solve` finds, all rates zero; its mobility is that of this position.

    Raises NoAnswer where the mechanism cannot be assembled, or inputs leave it free or cannot be moved there.
    """
    known = solved_mechanism(mechanism)
    solver, z, remarks = known.solver, known.assembly.z, known.remarks
    if drives:
        there = solver.with_inputs_of(replace_inputs(mechanism, tuple(drives)))
        z = follow_to(there, z, solver.inputs.u, there.inputs.u)
        solver = there
    u, p = solver.inputs.u, solver.inputs.p
    gaps = solver.residuals(z[None], u[None])[:, 0]
    residual = float(gaps.max(initial=0.0))
    if residual > solver.tolerance:
        raise refusals.not_closed(solver, solver.row_pairs[int(np.argmax(gaps))], residual)
    w = solver.functions.coordinates(z, u, p)
    frames, own = frames_from_coordinates((w * solver.scale).tolist(), solver.column, solver.shapes, solver.pairs)
    solver.refuse_open_contact(frames, own)
    slopes = solver.functions.jacobians(z[None], u[None], p)
    # what is held to second order only is no freedom: the pairs' own Jacobian does not see it, the deflated one does
    more = solver.is_deflated or solver.equations.open_rows
    slope = np.hstack([each[0] for each in slopes]) if more else FullConstraints(solver).jacobian(w)
    mobility = null_space(slope).shape[1] if w.size else 0
    if np.any(regularity(solver, slopes[0][0]) < MIN_REGULARITY):
        told = "the inputs are on a dead point or a change point, where places are exact to the root of rounding only"
        remarks = (*remarks, told)
    return State(solver.mechanism, mobility, residual, remarks, frames, own, solver.shapes)
