"""Forces at positions side by side, near positions of a grid that are known, and what each greatest of them is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planar.dynamics.forces import Forces, forces
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import NoAnswer
from planar.foundation.time_limit import stop_if_over
from planar.results.motion import Motion
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.continuation.fast_path import resting_inputs
from planar.solving.continuation.path import follow_samples
from planar.solving.input_grid import motion_at_inputs
from planar.solving.position import PositionSolver

MAX_PREDICTOR_ERROR = 0.5
"""Of a step's own length (sizes, rad): a position that is more off its straight prediction is not taken."""


ROUNDING = 1e-12
"""Of the greatest force: a lesser one is none."""


class Quantity(NamedTuple):
    """A number of which the greatest is wanted: an effort with its sign, the size of a force, or of a couple."""

    kind: str
    of: str
    sense: float


@dataclass(frozen=True)
class GridForces:
    """How forces are found at inputs near positions that are known."""

    solver: PositionSolver
    assembly: Assembly
    inertia: bool
    friction: bool

    def motion(self, z: Array, u: Array) -> Motion:
        """Positions side by side."""
        return motion_at_inputs(self.solver, self.assembly, z, u)

    def forces(self, motion: Motion) -> Forces:
        """Their forces."""
        return forces(motion, self.inertia, self.friction)

    def near(self, z: Array, start: Array, u: Array) -> tuple[Array, BoolArray]:
        """The unknowns at inputs u (n, inputs) on the way straight from known ones, z (n, unknowns) at `start`, and
        which are reached (n,): by Newton's method where the determinant keeps its sign, of mechanisms with stops or
        redundant pairs followed."""
        p, many = self.solver.inputs.p, len(u)
        found, is_reached = z.copy(), np.zeros(many, dtype=bool)
        if self.solver.functions.is_square and self.solver.stops is None:
            tried = self.solver.functions.correct_samples(z, u, p)
            gaps = self.solver.max_residuals(tried, u)
            slopes, by_inputs = self.solver.functions.jacobians(z, start, p)
            signs = [np.linalg.slogdet(each)[0] for each in (slopes, self.solver.functions.jacobians(tried, u, p)[0])]
            slope = -np.linalg.solve(slopes, by_inputs)
            ahead = np.einsum("nzu,nu->nz", slope, u - start)
            off = np.linalg.norm(tried - z - ahead, axis=1)
            close = off <= MAX_PREDICTOR_ERROR * np.linalg.norm(ahead, axis=1) + 1e-12
            is_reached = (gaps <= self.solver.tolerance) & (signs[0] == signs[1]) & close
            found[is_reached] = tried[is_reached]
            return found, is_reached
        for k in range(many):
            stop_if_over("while the worst cases were refined")
            try:
                way = follow_samples(self.solver, z[k], resting_inputs(np.stack([start[k], u[k]])))
            except NoAnswer:
                continue
            if way.stopped is None:
                found[k], is_reached[k] = way.z[-1], True
        return found, is_reached


def quantities(found: Forces, size: float) -> list[Quantity]:
    """All of which the greatest is wanted, in a mechanism of a size (m): efforts both ways, and of
    the pairs' forces and couples what is more than rounding."""
    every = [Quantity("effort", name, sense) for name in found.inputs for sense in (1.0, -1.0)]
    pairs = [Quantity(kind, name, 1.0) for name in found.reactions for kind in ("force", "couple")]
    arms = {"force": 1.0, "couple": size}
    sizes = [np.nanmax(quantity_values(found, each), initial=0.0) / arms[each.kind] for each in pairs]
    least = ROUNDING * max(sizes, default=0.0)
    return every + [each for each, largest in zip(pairs, sizes, strict=True) if largest > least]


def quantity_values(found: Forces, quantity: Quantity) -> Array:
    """The size of a quantity at every position (n,), an effort times its sense."""
    kind, name, sense = quantity
    if kind == "effort":
        effort: Array = np.asarray(found.inputs[name]) * sense
        return effort
    reaction = found.reactions[name]
    size: Array = np.linalg.norm(reaction.force, axis=1) if kind == "force" else np.abs(np.asarray(reaction.couple))
    return size


def named_positions(solver: PositionSolver, u: Array, names: Sequence[str]) -> Mapping[str, float]:
    """Positions of some inputs (rad or m) by name, of scaled ones (inputs,)."""
    every = [given.pair for given in solver.mechanism.inputs]
    return {name: float(u[every.index(name)]) * (solver.unit if solver.is_sliding(name) else 1.0) for name in names}
