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

from planar.solving.setup import Setup

Array = np.ndarray

SINGULAR = 1e-6
"""A singular value below this part of the greatest is zero: beside a crossing positions are known to about 1e-8."""
AGREES = 1e-6
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
    for _ in range(REFINEMENTS):
        tangents = _tangents(setup, z)
        if tangents is None or tangents.free.shape[1] != 1:
            return None
        roots = _velocities(setup, z, tangents)
        if len(roots) != 1:
            return None
        refined = _refined(setup, z, roots[0])
        if np.max(np.abs(refined - z)) > 1e-3:
            return None
        z = refined
    tangents = _tangents(setup, z)
    if tangents is None:
        return None
    z2 = _accelerations(setup, z, roots[0], tangents)
    return None if z2 is None else Passing(z, roots[0], z2)


def _kinematics(setup: Setup, z: Array, z1: Array, z2: Array):  # noqa: ANN202 - Rates
    s = setup.station
    return setup.program.kinematics(
        np.concatenate([z, s.u]), np.concatenate([z1, s.u1]), np.concatenate([z2, s.u2]), s.p
    )


def _tangents(setup: Setup, z: Array) -> _Tangents | None:
    none = np.zeros_like(z)
    rest = _kinematics(setup, z, none, none)
    u, s, vt = np.linalg.svd(rest.slope)
    rank = int(np.sum(s > SINGULAR * s[0])) if s.size else 0
    base = -vt[:rank].T @ ((u[:, :rank].T @ rest.F1) / s[:rank])
    left = rest.slope @ base + rest.F1
    if np.max(np.abs(left), initial=0.0) > AGREES * max(1.0, np.max(np.abs(rest.F1), initial=0.0)):
        return None
    return _Tangents(base, vt[rank:].T, u[:, rank:])


def _velocities(setup: Setup, z: Array, tangents: _Tangents) -> list[Array]:
    """Every z1 for which the second order can be solved."""
    base, free, left = tangents
    scale = max(1.0, float(np.linalg.norm(base)))
    way = free[:, 0] * scale

    def open_at(c: float) -> Array:
        return left.T @ _kinematics(setup, z, base + c * way, np.zeros_like(z)).F2

    below, here, above = (open_at(c) for c in (-1.0, 0.0, 1.0))
    bend, slope = 0.5 * (above + below) - here, 0.5 * (above - below)
    sizes = np.abs(bend) + np.abs(slope) + np.abs(here)
    if not sizes.size or sizes.max() < AGREES * scale**2:
        return []
    first = int(np.argmax(sizes))
    roots = np.roots(
        [bend[first], slope[first], here[first]]
        if abs(bend[first]) > 1e-9 * sizes[first]
        else [slope[first], here[first]]
    )
    real = [float(root.real) for root in roots if abs(root.imag) < 1e-5 * (1.0 + abs(root))]
    fitting = [c for c in real if np.all(np.abs((bend * c + slope) * c + here) < 1e-5 * sizes.max() * (1.0 + c * c))]
    if len(fitting) == 2 and abs(fitting[0] - fitting[1]) < 1e-3 * (1.0 + abs(fitting[0])):
        return []  # a double root: the motions only touch, and the second order does not tell them apart
    return [base + c * way for c in fitting]


def _refined(setup: Setup, z: Array, z1: Array) -> Array:
    """The position to round-off: with the velocity's own equations beside the constraints it is no double root."""
    s = setup.station
    left, slope = setup.program.deflated(z, z1, s.u, s.u1, s.p)
    step = np.linalg.lstsq(slope, -left, rcond=SINGULAR)[0]
    return z + step[: z.size]


def _accelerations(setup: Setup, z: Array, z1: Array, tangents: _Tangents) -> Array | None:
    """z2 from the third order, in which it is linear."""
    s = setup.station
    known = _kinematics(setup, z, z1, np.zeros_like(z))
    base = -np.linalg.pinv(known.slope, rcond=SINGULAR) @ known.F2
    free, left = tangents.free[:, 0], tangents.left

    def open_at(e: float) -> Array:
        return left.T @ setup.program.third(
            np.concatenate([z, s.u]), np.concatenate([z1, s.u1]), np.concatenate([base + e * free, s.u2]), s.p
        )

    here, above = open_at(0.0), open_at(1.0)
    slope = above - here
    if np.linalg.norm(slope) < AGREES:
        return None
    e = -float(slope @ here) / float(slope @ slope)
    if np.max(np.abs(here + e * slope)) > 1e-5 * (1.0 + np.max(np.abs(here))):
        return None
    return base + e * free
