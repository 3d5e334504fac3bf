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

from planar.equations.functions import Rates
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

SINGULAR = 1e-6
"""A singular value below this part of the greatest is zero: beside a crossing positions are known to about 1e-8."""
AGREES, ALIKE = 1e-6, 1e-5
"""Parts of the greatest: of a condition that is met to the position's own error, and of one that is squared in it."""
TRULY = 1e-10
"""At the position to round-off the least singular value, as a part of the greatest, is zero to rounding."""
MOVED = 1e-6
"""rad or sizes: a singular position is first known to about 1e-8; what moves further was none."""
FAR = 1e-3
"""Roots nearer than this part are one."""
REFINEMENTS = 4


class Passing(NamedTuple):
    """A position at a singularity, to round-off, with the rates of the one motion that goes on through it."""

    z: Array
    z1: Array
    z2: Array


class _Tangents(NamedTuple):
    """What the first order leaves: z1 = base + free c, and the rows `left` that have to vanish in second order."""

    base: Array
    free: Array
    left: Array


def passing(setup: Setup, z: Array) -> Passing | None:
    """The one motion through a singular position near z, one freedom more than inputs; None if it is not one."""
    u1, u2 = setup.station.u1, setup.station.u2
    speed, gain = float(np.linalg.norm(u1)), float(np.linalg.norm(u2))
    if speed > 0.0:
        # in units of time in which the inputs run at speed one, so that no tolerance depends on the speed
        found = _Crossing(setup, u1 / speed, u2 / speed**2).passing(z)
        return found and Passing(found.z, found.z1 * speed, found.z2 * speed**2)
    way = u2 / gain if gain > 0.0 else np.eye(u1.size)[0]
    found = _Crossing(setup, way, np.zeros_like(way)).passing(z)
    return found and Passing(found.z, 0.0 * found.z1, found.z1 * gain)


class _Crossing:
    """The conditions of each order at positions of one mechanism, for given rates of its inputs."""

    def __init__(self, setup: Setup, u1: Array, u2: Array):
        self.program, self.u, self.p = setup.program, setup.station.u, setup.station.p
        self.u1, self.u2 = u1, u2

    def passing(self, z: Array) -> Passing | None:
        for _ in range(REFINEMENTS):
            z1 = self._velocity(z)
            if z1 is None:
                return None
            refined = self._refined(z, z1)
            if np.max(np.abs(refined - z)) > MOVED:
                return None
            z = refined
        slope = self._rates(z, 0.0 * z, 0.0 * z).slope
        values = np.linalg.svd(slope, compute_uv=False)
        if values[min(slope.shape) - 1] > TRULY * values[0]:
            return None  # it only comes near
        z1, tangents = self._velocity(z), self._tangents(z)
        z2 = None if z1 is None or tangents is None else self._acceleration(z, z1, tangents)
        return None if z1 is None or z2 is None else Passing(z, z1, z2)

    def _at(self, z: Array, z1: Array, z2: Array) -> tuple[Array, Array, Array]:
        return np.concatenate([z, self.u]), np.concatenate([z1, self.u1]), np.concatenate([z2, self.u2])

    def _rates(self, z: Array, z1: Array, z2: Array) -> Rates:
        return self.program.kinematics(*self._at(z, z1, z2), self.p)

    def _tangents(self, z: Array) -> _Tangents | None:
        """What the first order leaves open; None where it cannot be met."""
        none = np.zeros_like(z)
        rest = self._rates(z, none, none)
        u, s, vt = np.linalg.svd(rest.slope)
        rank = int(np.sum(s > SINGULAR * s[0])) if s.size else 0
        base = -vt[:rank].T @ ((u[:, :rank].T @ rest.F1) / s[:rank])
        left = rest.slope @ base + rest.F1
        if np.max(np.abs(left), initial=0.0) > AGREES * max(1.0, np.max(np.abs(rest.F1), initial=0.0)):
            return None
        return _Tangents(base, vt[rank:].T, u[:, rank:])

    def _velocity(self, z: Array) -> Array | None:
        """The z1 for which the second order can be solved; None if there is none, or more than one."""
        tangents = self._tangents(z)
        if tangents is None or tangents.free.shape[1] != 1:
            return None
        scale = max(1.0, float(np.linalg.norm(tangents.base)))
        way = tangents.free[:, 0] * scale

        def open_at(c: float) -> Array:
            return tangents.left.T @ self._rates(z, tangents.base + c * way, np.zeros_like(z)).F2

        below, here, above = (open_at(c) for c in (-1.0, 0.0, 1.0))
        roots = _common_roots(0.5 * (above + below) - here, 0.5 * (above - below), here, AGREES * scale**2)
        return tangents.base + roots[0] * way if len(roots) == 1 else None

    def _refined(self, z: Array, z1: Array) -> Array:
        """The position to round-off: with the velocity's own equations beside the constraints it is no double root."""
        left, slope = self.program.deflated(z, z1, self.u, self.u1, self.p)
        return z + np.linalg.lstsq(slope, -left, rcond=SINGULAR)[0][: z.size]

    def _acceleration(self, z: Array, z1: Array, tangents: _Tangents) -> Array | None:
        """z2 from the third order, in which it is linear."""
        known = self._rates(z, z1, np.zeros_like(z))
        base = -np.linalg.pinv(known.slope, rcond=SINGULAR) @ known.F2
        free = tangents.free[:, 0]

        def open_at(e: float) -> Array:
            return tangents.left.T @ self.program.third(*self._at(z, z1, base + e * free), self.p)

        here, above = open_at(0.0), open_at(1.0)
        slope = above - here
        if np.linalg.norm(slope) < AGREES:
            return None
        e = -float(slope @ here) / float(slope @ slope)
        if np.max(np.abs(here + e * slope)) > ALIKE * (1.0 + np.max(np.abs(here))):
            return None
        return base + e * free


def _common_roots(bend: Array, slope: Array, here: Array, least: float) -> list[float]:
    """The real roots that quadratic equations bend c^2 + slope c + here = 0 have in common.

    None where all vanish, or where a root is double: there motions only touch, and this order does not part them.
    """
    sizes = np.abs(bend) + np.abs(slope) + np.abs(here)
    if not sizes.size or sizes.max() < least:
        return []
    first = int(np.argmax(sizes))
    straight = abs(bend[first]) < AGREES * 1e-3 * sizes[first]
    roots = np.roots([slope[first], here[first]] if straight else [bend[first], slope[first], here[first]])
    real = [float(root.real) for root in roots if abs(root.imag) < ALIKE * (1.0 + abs(root))]
    left = [(c, np.max(np.abs((bend * c + slope) * c + here)) / (1.0 + c * c)) for c in real]
    fitting = [c for c, open_by in left if open_by < ALIKE * sizes.max()]
    if len(fitting) == 2 and abs(fitting[0] - fitting[1]) < FAR * (1.0 + abs(fitting[0])):
        return []
    return fitting
