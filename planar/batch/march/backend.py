"""What a backend does for a sweep: all designs of a block through the same steps, each position judged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planar.equations.functions import EquationFunctions
from planar.model.mechanism import Mechanism

Array = np.ndarray


class UnsupportedStructure(Exception):
    """A backend cannot do this structure; the text says why."""


class DesignBatch(NamedTuple):
    """A block of designs that is to run. Lengths are in units of one size for all, angles in rad.

    p (numbers, designs): the numbers of all pairs; q (2 a point, designs): coordinates of the wanted points in the axes
    of their `links`, none of which is the frame; z0 (unknowns, designs): the assembly at the start; u (steps + 1,
    inputs): how far the inputs are from where each design starts, u0 (inputs, designs); u1, u2 (inputs, designs): their
    rates, the same at every step. `rates`: whether first and second rates are wanted. `tolerance`: what a constraint
    may leave open. `mechanism` has the pairs and inputs; its numbers are not those of the designs. `unit`: the size, m.
    """

    program: EquationFunctions
    mechanism: Mechanism
    p: Array
    q: Array
    z0: Array
    input_offsets: Array
    u0: Array
    u1: Array
    u2: Array
    links: tuple[str, ...]
    rates: bool
    tolerance: float
    unit: float

    @property
    def output_row_count(self) -> int:
        """What is told at a step: x and y of each point, then their first, then second rates."""
        return 2 * len(self.links) * (3 if self.rates else 1)

    def select(self, designs: Array, z0: Array | None = None) -> DesignBatch:
        """The march of some of the designs, from other unknowns if they are given."""
        parts = {name: getattr(self, name)[:, designs] for name in ("p", "q", "z0", "u0", "u1", "u2")}
        return self._replace(**parts | ({} if z0 is None else {"z0": z0}))


DesignRunner = Callable[[DesignBatch, Array], Array]
"""Takes a march and room for what it tells, out (steps + 1, rows, designs), which it fills with x and y of each point,
then their first, then second rates (m, s); gives how many of the first steps passed both parts of the gate (designs,).
"""


class CorrectedAssemblies(NamedTuple):
    """Where designs are that a backend closed from near by: which are, and how regular the least regular is of the
    groups that Newton's method closed (the volume that the columns of its slope span), both (designs,); the unknowns
    (unknowns, designs); the points of the march, and the same in the other assembly of their group, infinite where that
    is not known (points, 2, designs), in sizes."""

    converged: Array
    regularity: Array
    z: Array
    points: Array
    other_points: Array


AssemblyCorrector = Callable[[DesignBatch, Sequence[int], int], CorrectedAssemblies]
"""Takes a march, of which it looks at the start only, the groups that place its points, and how many of Newton's steps
it may take. Raises UnsupportedStructure."""


LastGoodUnknowns = Callable[[DesignBatch, Array], Array]
"""Takes a march and how many of its first steps were good, one at least; gives the unknowns at the last of these
(unknowns, designs)."""
