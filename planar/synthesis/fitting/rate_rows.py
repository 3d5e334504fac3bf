"""How fast the input goes along the motion, which is not at all at its dead points, at positions of many designs."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from planar.derivatives.design_equations import design_equations
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.synthesis.fitting.adjoint_rows import AdjointRows, LinearSystem


def rate_rows(mechanism: Mechanism, free: Sequence[str], scale: Array) -> AdjointRows:
    """The rate of the running input where all unknowns together go on by one: a column, but none of a mechanism without
    unknowns, of which nothing can stop."""
    design = design_equations(mechanism)
    velocities = ca.SX.sym("v", design.z.numel())
    by_input = ca.jacobian(design.F, design.u)[:, 0] * float(design.input_scale[0])
    equations = ca.jacobian(design.F, design.z) @ velocities + by_input
    rate = LinearSystem(design, equations, velocities, 1.0 / ca.sqrt(1.0 + ca.sumsqr(velocities)))
    return AdjointRows([rate] if design.z.numel() else [], free, scale)
