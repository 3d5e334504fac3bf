"""How fast the input goes along the motion, which is not at all at its dead points, at positions of many designs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca

from planar.derivatives.design_equations import design_equations
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.synthesis.fitting.adjoint_rows import AdjointRows, LinearSystem


class RateRows(AdjointRows):
    """The rate of the running input where all unknowns together go on by one."""

    def __init__(self, mechanism: Mechanism, free: Sequence[str], scale: Array):
        super().__init__(free, scale)
        self.design = design_equations(mechanism)

    def __len__(self) -> int:
        """One, but of a mechanism without unknowns, of which nothing can stop."""
        return int(self.design.z.numel() > 0)

    def systems(self) -> Iterator[LinearSystem]:
        """The velocities where the input goes on by one."""
        design = self.design
        velocities = ca.SX.sym("v", design.z.numel())
        by_input = ca.jacobian(design.F, design.u)[:, 0] * float(design.input_scale[0])
        equations = ca.jacobian(design.F, design.z) @ velocities + by_input
        yield LinearSystem(design, equations, velocities, 1.0 / ca.sqrt(1.0 + ca.sumsqr(velocities)))
