"""The program's functions over many designs at once, each with numbers of its own."""

from __future__ import annotations

import numpy as np

from planar.equations.constraint_equations import Equations
from planar.equations.functions import Program, Rates

Array = np.ndarray


class Columns:
    """A program over many designs, each with its own p (numbers, designs)."""

    def __init__(self, program: Program, p: Array):
        self.program = program
        self.equations: Equations = program.equations
        self.p = np.ascontiguousarray(p.T)

    def advance(self, z: Array, u: Array) -> Array:
        """Newton's method from z (designs, unknowns) near by, at inputs u (designs, inputs)."""
        return self.program.advanced(z, u, self.p) if z.size else z

    def positions(self, z: Array, u: Array) -> Array:
        """w (coordinates, designs)."""
        return np.ascontiguousarray(self.program.coordinates(z, u, self.p).T)

    def slopes(self, z: Array, u: Array, p: Array | None = None) -> tuple[Array, Array]:
        """dF/dz (designs, rows, unknowns) and dF/du (designs, rows, inputs), as `Program.slopes`."""
        return self.program.slopes(z, u, self.p)

    def kinematics(self, y: Array, y1: Array, y2: Array) -> Rates:
        """As `Program.kinematics`, with an entry for each design."""
        return self.program.kinematics(y, y1, y2, self.p)
