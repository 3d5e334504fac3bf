"""Rates where constraints are singular but only one motion goes on: by the conditions of second and third order.

Constraints F(z, u(t)) = 0 are differentiated: J z1 + F_u u1 = 0 leaves z1 = a + N c where N spans what J takes to zero.
The second derivative J z2 + F2(z1) = 0 can be solved only if L^T F2(a + N c) = 0, where L spans what J^T takes to zero:
quadratic equations for c, one root of them for every motion that goes on. The third derivative gives z2 in the same
way, linearly. (C. Rheinboldt 1986; A. Mueller, Higher-order analysis of kinematic singularities, J. Mech. Robotics 8,
2016.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.equations.functions import EquationRates
from planar.foundation.arrays import Array
from planar.solving.checks.singular_values import SINGULAR_TOLERANCE
from planar.solving.continuation.bifurcation import ZERO_INPUT_RATE
from planar.solving.continuation.second_order import EXACT_SINGULAR_TOLERANCE, branch_directions, solve_third_order
from planar.solving.prepared_mechanism import PreparedMechanism

CONDITION_TOLERANCE, FORM_TOLERANCE = 1e-6, 1e-5
"""Parts of the greatest: of a condition that is met to the position's own error, and of one that is squared in it."""
MAX_REFINEMENT = 1e-6
"""rad or sizes: a singular position is first known to about 1e-8; what moves further was none."""
REFINEMENT_STEPS = 4


class SingularRates(NamedTuple):
    """A position at a singularity, to round-off, with the rates of the one motion that goes on through it."""

    z: Array
    z1: Array
    z2: Array


class _FirstOrderSolution(NamedTuple):
    """What the first order leaves: z1 = base + free c, and the rows `left` that have to vanish in second order."""

    base: Array
    null: Array
    left_null: Array


def singular_rates(setup: PreparedMechanism, z: Array) -> SingularRates | None:
    """The one motion through a singular position near z, one freedom more than inputs; None if it is not one."""
    u1, u2 = setup.inputs.u1, setup.inputs.u2
    if not u1.size:
        return None  # no input says which way
    speed, gain = float(np.linalg.norm(u1)), float(np.linalg.norm(u2))
    if speed > 0.0:
        # in units of time in which the inputs run at speed one, so that no tolerance depends on the speed
        found = _RateConditions(setup, u1 / speed, u2 / speed**2).solve(z)
        return found and SingularRates(found.z, found.z1 * speed, found.z2 * speed**2)
    way = u2 / gain if gain > 0.0 else np.eye(u1.size)[0]
    found = _RateConditions(setup, way, np.zeros_like(way)).solve(z)
    return found and SingularRates(found.z, 0.0 * found.z1, found.z1 * gain)


class _RateConditions:
    """The conditions of each order at positions of one mechanism, for given rates of its inputs."""

    def __init__(self, setup: PreparedMechanism, u1: Array, u2: Array):
        self.program, self.u, self.p = setup.functions, setup.inputs.u, setup.inputs.p
        self.u1, self.u2 = u1, u2

    def solve(self, z: Array) -> SingularRates | None:
        for _ in range(REFINEMENT_STEPS):
            z1 = self._velocity(z)
            if z1 is None:
                return None
            refined = self._refine(z, z1)
            if np.max(np.abs(refined - z)) > MAX_REFINEMENT:
                return None
            z = refined
        slope = self._rates(z, 0.0 * z, 0.0 * z).jacobian
        values = np.linalg.svd(slope, compute_uv=False)
        if values[min(slope.shape) - 1] > EXACT_SINGULAR_TOLERANCE * values[0]:
            return None  # it only comes near
        z1, tangents = self._velocity(z), self._first_order(z)
        z2 = None if z1 is None or tangents is None else self._acceleration(z, z1, tangents)
        return None if z1 is None or z2 is None else SingularRates(z, z1, z2)

    def _with_inputs(self, z: Array, z1: Array, z2: Array) -> tuple[Array, Array, Array]:
        return np.concatenate([z, self.u]), np.concatenate([z1, self.u1]), np.concatenate([z2, self.u2])

    def _rates(self, z: Array, z1: Array, z2: Array) -> EquationRates:
        return self.program.kinematics(*self._with_inputs(z, z1, z2), self.p)

    def _first_order(self, z: Array) -> _FirstOrderSolution | None:
        """What the first order leaves open; None where it cannot be met."""
        none = np.zeros_like(z)
        rest = self._rates(z, none, none)
        u, s, vt = np.linalg.svd(rest.jacobian)
        rank = int(np.sum(s > SINGULAR_TOLERANCE * s[0])) if s.size else 0
        base = -vt[:rank].T @ ((u[:, :rank].T @ rest.F1) / s[:rank])
        left = rest.jacobian @ base + rest.F1
        if np.max(np.abs(left), initial=0.0) > CONDITION_TOLERANCE * max(1.0, np.max(np.abs(rest.F1), initial=0.0)):
            return None
        return _FirstOrderSolution(base, vt[rank:].T, u[:, rank:])

    def _velocity(self, z: Array) -> Array | None:
        """The z1 for which the second order can be solved; None if there is none, or more than one."""
        tangents = self._first_order(z)
        if tangents is None or tangents.null.shape[1] != 1:
            return None
        # the motions to first order: as the inputs go, with their part, and along what is free while they are held
        speed = float(np.linalg.norm(np.append(tangents.base, 1.0)))
        base, free = tangents.base / speed, tangents.null[:, 0]

        def second_order(motion: Array, input_part: float) -> Array:
            whole = np.concatenate([z, self.u]), np.concatenate([motion, input_part * self.u1])
            return tangents.left_null.T @ self.program.kinematics(*whole, 0.0 * whole[0], self.p).F2

        along, across = second_order(base, 1.0 / speed), second_order(free, 0.0)
        mixed = 0.5 * (second_order(base + free, 1.0 / speed) - along - across)
        forms = np.array([[along, mixed], [mixed, across]]).transpose(2, 0, 1)
        ways = [c for c in branch_directions(forms, FORM_TOLERANCE).found if abs(c[0]) > ZERO_INPUT_RATE]
        return tangents.base + speed * ways[0][1] / ways[0][0] * free if len(ways) == 1 else None

    def _refine(self, z: Array, z1: Array) -> Array:
        """The position to round-off: with the velocity's own equations beside the constraints it is no double root."""
        left, slope = self.program.deflated_system(z, z1, self.u, self.u1, self.p)
        return z + np.linalg.lstsq(slope, -left, rcond=SINGULAR_TOLERANCE)[0][: z.size]

    def _acceleration(self, z: Array, z1: Array, tangents: _FirstOrderSolution) -> Array | None:
        """z2 from the third order, in which it is linear."""
        known = self._rates(z, z1, np.zeros_like(z))
        base = -np.linalg.pinv(known.jacobian, rcond=SINGULAR_TOLERANCE) @ known.F2
        free = tangents.null[:, 0]

        def third_order(e: Array) -> Array:
            whole = self._with_inputs(z, z1, base + e[0] * free)
            return tangents.left_null.T @ self.program.third_rate_remainder(*whole, self.p)

        e = solve_third_order(third_order, 1, FORM_TOLERANCE)
        return None if e is None else base + e[0] * free
