"""The equation functions over many designs at once, each with numbers of its own."""

from __future__ import annotations

import numpy as np

from planar.equations.functions import EquationFunctions, EquationRates
from planar.equations.symbolic_equations import ConstraintEquations

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
