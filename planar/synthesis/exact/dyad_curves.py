"""Burmester's curves: the dyads that carry a link through poses where these leave more than single ones.

The rows of a dyad are linear in its fixed pivot, or in the direction of its slide. Where they are as many as the
homogeneous coordinates of that, their determinant vanishes on a curve of the other pin: a cubic, the circle-point
curve, whose pivots are the centre-point curve (L. Burmester, Lehrbuch der Kinematik, 1888; O. Bottema, B. Roth,
Theoretical Kinematics, 1979, ch. 8), or a circle, the pins with three positions on one line. A line through a place of
the curve meets it in as many more as its degree has left.
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
SPECIAL, ON_CURVE = 1e-10, 1e-8
"""Of what rows could make of a determinant, below which it vanishes everywhere; of its size, on the curve."""
BREAK = 2.0
"""The same, between places one after the other: farther apart they are on two parts of the curve."""


def is_dyad(problem: ExactProblem, component: Component) -> bool:
    """Whether a component is a dyad with nothing given: two pins, or a pin and a slide."""
    dyad = _Dyad(problem, component)
    conditions = component.family.parts[0].rows.equation_count
    return component.family.size == 2 and dyad.pin >= 0 and dyad.other >= 0 and conditions == int(dyad.has_slide)


def dyad_curve(problem: ExactProblem, component: Component, x: ComplexArray | None = None) -> DyadCurve:
    """The dyads of a component: a curve or more, or the one with unknowns x."""
    dyad = _Dyad(problem, component)
    none: Array = np.zeros((0, 2))
    pins: Array = none
    dimension = component.freedom
    if x is not None:
        pins = dyad.to_world(np.array([[x[dyad.pin].real, x[dyad.pin].imag]]))
        dimension = 0
    elif dimension == 1:
        pins = dyad.to_world(dyad.trace())
    found = DyadCurve(dyad.pivot_name, dyad.joint_name, dimension, pins, none, np.zeros(0), dyad.world_rows())
    if not dyad.has_slide:
        return replace(found, centre_points=found.centres(pins))
    found = replace(found, directions=found.lines(pins))
    return replace(found, circle_points=none, centre_points=pins) if dyad.is_line_on_link else found


class _Dyad:
    """A dyad by a pin, the joint where there are two, and its other pair, among the unknowns of a component."""

    def __init__(self, problem: ExactProblem, component: Component):
        self.problem, self.component = problem, component
        own = {y.own: k for k, y in enumerate(component.unknowns)}
        frame = problem.mechanism.frame
        pivot, joint, self.has_slide = -1, -1, False
        self.pivot_name, self.joint_name = "", ""
        for (link, name), place in problem.pose.places.items():
            symbols = {k & ~1 for k in place.substitute(problem.pose.values).symbols} & own.keys()
            if len(symbols) != 1 or not isinstance(name, str):
                continue
            k = own[symbols.pop()]
            if link == frame:
                pivot, self.pivot_name = k, name
            elif k != pivot:
                joint, self.joint_name = k, name
        self.pin, self.other = joint, pivot
        self.is_line_on_link = False
        for slide in problem.pose.slides:
            ways = {k & ~1 for k in slide.direction.symbols} & own.keys()
            if ways:
                self.is_line_on_link = slide.pair.bodies[0] != frame
                self.pin, self.other, self.has_slide = max(pivot, joint), own[ways.pop()], True
                if self.is_line_on_link:
                    self.joint_name = slide.pair.name
                else:
                    self.pivot_name = slide.pair.name

    def to_world(self, places: Array) -> Array:
        """Places (n, 2) in m."""
        origin = np.array([self.problem.origin.real, self.problem.origin.imag])
        found: Array = places * self.problem.size + origin
        return found

    @cached_property
    def rows(self) -> Array:
        """(entries, 3, 3 or 2): (1, x, y) of the pin times this times (1, x, y) of the pivot, or (cos, sin) of the
        line, vanishes."""
        pins = np.array([0.0, 1.0, 1.0j])
        others = np.array([1.0, 1.0j]) if self.has_slide else pins
        x = np.zeros((4, 3 * len(others)), dtype=complex)
        x[self.pin], x[self.other] = np.repeat(pins, len(others)), np.tile(others, 3)
        x[self.pin + 2], x[self.other + 2] = x[self.pin].conj(), x[self.other].conj()
        member = self.component.member
        still = [np.zeros_like(part) for part in member.parts]
        given = self.component.family.parts[0].rows.equation_count
        values = self.component.family.rows_at(x, member, still, np.zeros(x.shape[1]))[0][given:]
        back = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
        # a row is real, or i times one that is
        whole = (values.real + values.imag).reshape(-1, 3, len(others))
        found: Array = np.einsum("ai,rij->raj", back, whole)
        return found if self.has_slide else np.einsum("raj,bj->rab", found, back)

    def world_rows(self) -> Array:
        """The same for places in m."""
        size, origin = self.problem.size, self.problem.origin
        moved = np.array(
            [[1.0, -origin.real / size, -origin.imag / size], [0.0, 1.0 / size, 0.0], [0.0, 0.0, 1.0 / size]]
        )
        found: Array = np.einsum("ia,rij->raj", moved, self.rows)
        return found if self.has_slide else np.einsum("raj,jb->rab", found, moved)

    def _rows_at(self, pins: Array) -> Array:
        found: Array = np.einsum("na,rab->nrb", np.insert(pins, 0, 1.0, axis=1), self.rows)
        return found

    def _determinant(self, pins: Array) -> Array:
        found: Array = np.linalg.det(self._rows_at(pins))
        return found

    def trace(self) -> Array:
        """The places of the pin (n, 2) in units of the problem, not numbers between parts; none where the poses are
        special, so that there is no curve, or any place will do."""
        near = np.random.default_rng(11).uniform(-1.0, 1.0, (24, 2))
        size = float(np.median(np.abs(self._determinant(near))))
        whole = float(np.median(np.prod(np.linalg.norm(self._rows_at(near), axis=2), axis=1)))
        if size <= SPECIAL * whole:
            return np.zeros((0, 2))
        places = self._trace()
        known = np.isfinite(places).all(axis=1)
        reach = np.maximum(1.0, np.linalg.norm(places[known], axis=1)) ** self.rows.shape[2]
        off = np.abs(self._determinant(places[known])) > ON_CURVE * size * reach
        if off.any():
            return np.zeros((0, 2))
        return places[known][:1] if np.ptp(places[known], axis=0).max(initial=0.0) < ON_CURVE else places

    def _trace(self) -> Array:
        start = self._one_place()
        angles = np.linspace(0.0, np.pi, DIRECTIONS + 1)
        way = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        steps = np.array([-2.0, -1.0, 1.0, 2.0])
        values = np.array([self._determinant(start + r * way) / r for r in steps])
        if self.has_slide:
            c1, c0 = np.polyfit(steps, values, 1)
            with np.errstate(all="ignore"):
                return _broken(start - (c0 / c1)[:, None] * way)
        c2, c1, c0 = np.polyfit(steps, values, 2)
        with np.errstate(all="ignore"):
            spread = c1 * c1 - 4.0 * c2 * c0
            root = np.sqrt(spread)
            both = [(-c1 + sign * root) / (2.0 * c2) for sign in (-1.0, 1.0)]
        near, far = (start + part[:, None] * way for part in both)
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
        """A place of the curve: where a line meets it, which any does that meets a cubic, or goes through the middle of
        a circle."""
        steps = np.array([-1.5, -0.5, 0.5, 1.5])
        base = self._middle() if self.has_slide else np.array([0.31, 0.17])
        for angle in (0.3, 1.1, 2.0, 2.7):
            way = np.array([np.cos(angle), np.sin(angle)])
            degree = self.rows.shape[2]
            roots = np.roots(np.polyfit(steps, self._determinant(base + steps[:, None] * way), degree))
            real = roots.real[np.abs(roots.imag) < 1e-9 * np.maximum(1.0, np.abs(roots))]
            if len(real):
                found: Array = base + real[np.argmin(np.abs(real))] * way
                return found
        return base

    def _middle(self) -> Array:
        """Where the slope of a conic vanishes."""
        grid = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]), axis=-1).reshape(-1, 2)
        x, y = grid.T
        powers = np.stack([x * x, x * y, y * y, x, y, np.ones(len(grid))], axis=1)
        a, b, c, d, e, _ = np.linalg.lstsq(powers, self._determinant(grid), rcond=None)[0]
        found: Array = -np.linalg.pinv(np.array([[2.0 * a, b], [b, 2.0 * c]])) @ np.array([d, e])
        return found


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
