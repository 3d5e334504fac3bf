"""Burmester's curves: the dyads that carry a link through fewer poses than leave single ones.

The rows of a dyad are linear in its fixed pivot. Where they are three, their determinant vanishes on a cubic of the
joint, the circle-point curve, and the pivot that goes with it describes the centre-point curve (L. Burmester, Lehrbuch
der Kinematik, 1888; O. Bottema, B. Roth, Theoretical Kinematics, 1979, ch. 8). A line through a place of the cubic
meets it in two more.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.complete_synthesis import DyadCurve
from planar.synthesis.exact.relations.exact_problem import Component, ExactProblem

DIRECTIONS = 1440
"""Of lines through one place of a cubic."""
REACH = 40.0
"""Of the extent of the poses: what is farther is left out."""
BREAK = 2.0
"""The same, between places one after the other: farther apart they are on two parts of the curve."""


def dyad_curve(problem: ExactProblem, component: Component, x: ComplexArray | None = None) -> DyadCurve:
    """The dyads of a component: a curve or more, or the one with unknowns x."""
    dyad = _Dyad(problem, component)
    none: Array = np.zeros((0, 2))
    joints: Array = none
    dimension = component.freedom
    if x is not None:
        joints = dyad.to_world(np.array([[x[dyad.joint].real, x[dyad.joint].imag]]))
    elif dimension == 1:
        joints = dyad.to_world(dyad.trace())
    found = DyadCurve(dyad.pivot_name, dyad.joint_name, dimension, joints, none, dyad.world_rows())
    return replace(found, centre_points=found.centres(joints))


class _Dyad:
    def __init__(self, problem: ExactProblem, component: Component):
        self.problem, self.component = problem, component
        own = {each.own: k for k, each in enumerate(component.unknowns)}
        frame = problem.mechanism.frame
        self.pivot, self.joint = -1, -1
        self.pivot_name, self.joint_name = "", ""
        for (link, name), place in problem.pose.places.items():
            symbols = {k for k in place.substitute(problem.pose.values).symbols if k in own}
            if len(symbols) != 1 or not isinstance(name, str):
                continue
            k = own[symbols.pop()]
            if link == frame:
                self.pivot, self.pivot_name = k, name
            elif k != self.pivot:
                self.joint, self.joint_name = k, name
        for slide in problem.pose.slides:
            if slide.direction.symbols & own.keys():
                self.pivot_name = slide.pair.name

    def to_world(self, places: Array) -> Array:
        """Places (n, 2) in m."""
        origin = np.array([self.problem.origin.real, self.problem.origin.imag])
        found: Array = places * self.problem.size + origin
        return found

    @cached_property
    def rows(self) -> Array:
        """(entries, 3, 3): (1, x, y) of the joint times this times (1, x, y) of the pivot vanishes."""
        if self.pivot < 0:
            return np.zeros((0, 3, 3))
        places = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
        z = places[:, 0] + 1j * places[:, 1]
        x = np.zeros((4, 9), dtype=complex)
        x[self.joint], x[self.pivot] = np.repeat(z, 3), np.tile(z, 3)
        x[self.joint + 2], x[self.pivot + 2] = x[self.joint].conj(), x[self.pivot].conj()
        member = self.component.member
        still = [np.zeros_like(each) for each in member.parts]
        values = self.component.family.rows_at(x, member, still, np.zeros(9))[0].real.reshape(-1, 3, 3)
        back = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
        found: Array = np.einsum("ai,rij,bj->rab", back, values, back)
        return found

    def world_rows(self) -> Array:
        """The same for places in m."""
        size, origin = self.problem.size, self.problem.origin
        moved = np.array(
            [[1.0, -origin.real / size, -origin.imag / size], [0.0, 1.0 / size, 0.0], [0.0, 0.0, 1.0 / size]]
        )
        found: Array = np.einsum("ai,rij,bj->rab", moved, self.rows, moved)
        return found

    def _cubic(self, joints: Array) -> Array:
        found: Array = np.linalg.det(np.einsum("na,rab->nrb", np.insert(joints, 0, 1.0, axis=1), self.rows))
        return found

    def trace(self) -> Array:
        """The circle points (n, 2) in units of the problem, not numbers between parts."""
        start = self._one_place()
        angles = np.linspace(0.0, np.pi, DIRECTIONS + 1)
        way = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        steps = np.array([-2.0, -1.0, 1.0, 2.0])
        values = np.array([self._cubic(start + r * way) / r for r in steps])
        c2, c1, c0 = np.polyfit(steps, values, 2)
        with np.errstate(all="ignore"):
            spread = c1 * c1 - 4.0 * c2 * c0
            root = np.sqrt(spread)
            both = [(-c1 + sign * root) / (2.0 * c2) for sign in (-1.0, 1.0)]
        near, far = (start + each[:, None] * way for each in both)
        # after half a turn both are again where they were
        real = np.isfinite(near).all(axis=1)
        none = np.full((1, 2), np.nan)
        if real.all():
            return _broken(np.concatenate([near, none, far]))
        gap = int(np.argmin(real))
        near, far, real = (np.roll(each[:-1], -gap, axis=0) for each in (near, far, real))
        pieces = []
        for first, last in _runs(real):
            pieces += [near[first:last], far[first:last][::-1], near[first : first + 1], none]
        return _broken(np.concatenate(pieces)) if pieces else start[None]

    def _one_place(self) -> Array:
        """A place of the cubic: where a line meets it, which any does."""
        steps = np.array([-1.5, -0.5, 0.5, 1.5])
        for angle in (0.3, 1.1, 2.0, 2.7):
            base, way = np.array([0.31, 0.17]), np.array([np.cos(angle), np.sin(angle)])
            roots = np.roots(np.polyfit(steps, self._cubic(base + steps[:, None] * way), 3))
            real = roots.real[np.abs(roots.imag) < 1e-9 * np.maximum(1.0, np.abs(roots))]
            if len(real):
                found: Array = base + real[np.argmin(np.abs(real))] * way
                return found
        return np.zeros(2)


def _runs(there: Array) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], there.astype(int), [0]])))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _broken(places: Array) -> Array:
    """A polyline with its far places left out, and broken where it jumps."""
    found = places.copy()
    found[np.linalg.norm(np.nan_to_num(found), axis=1) > REACH] = np.nan
    jumps = np.linalg.norm(np.diff(found, axis=0), axis=1) > BREAK
    whole: Array = np.insert(found, np.flatnonzero(jumps) + 1, np.nan, axis=0)
    return whole
