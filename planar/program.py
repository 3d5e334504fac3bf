"""Equations as something that runs: casadi functions over the symbols z, u, p of the equations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.algebra import Scalar
from planar.equations import Equations, Stage, build
from planar.mechanism import Input, Link, Mechanism, motions
from planar.pairs import Kind, Pair
from planar.plane import GROUND, Frame, frame_at
from planar.shapes import Shape, shape

Array = np.ndarray

NEWTON_STEPS = 4
"""Unrolled steps of a position within a run: from a start a degree or so away, four square the error away."""


class Rates(NamedTuple):
    """What `Program.kinematics` returns: F and w with their first and second time derivatives, and dF/dz, dF/du.

    Each with a first axis for the samples, if there is one.
    """

    F: Array
    F1: Array
    F2: Array
    w: Array
    w1: Array
    w2: Array
    slope: Array
    "(rows, unknowns)"
    drive_slope: Array
    "(rows, inputs)"


class Program:
    """The casadi functions of one structure, each built when it is first asked for."""

    def __init__(self, equations: Equations):
        self.equations = equations

    def closing(self, stage: Stage) -> ca.Function:
        """(z, u, p) -> F of this stage (rows,) and its slope in the stage's own unknowns (rows, unknowns)."""
        return self._closing[stage.level]

    @cached_property
    def _closing(self) -> dict[int, ca.Function]:
        e = self.equations
        slopes = ca.jacobian(e.F, e.z)
        return {
            stage.level: ca.Function(
                "closing", [e.z, e.u, e.p], [e.F[stage.rows], ca.densify(slopes[stage.rows, stage.unknowns])]
            )
            for stage in e.stages
        }

    @cached_property
    def positions(self) -> ca.Function:
        """(z, u, p) -> w."""
        e = self.equations
        return ca.Function("positions", [e.z, e.u, e.p], [ca.densify(e.w)])

    @cached_property
    def _kinematics(self) -> ca.Function:
        e = self.equations
        both = ca.vertcat(e.F, e.w)
        y, y1, y2, first, second = _derivatives(e, both)
        slopes = ca.jacobian(e.F, y)
        outputs = [ca.horzcat(both, first, second), slopes]
        return ca.Function("kinematics", [y, y1, y2, e.p], [ca.densify(output) for output in outputs])

    @cached_property
    def _third(self) -> ca.Function:
        e = self.equations
        y, y1, y2, _, second = _derivatives(e, e.F)
        third = ca.jtimes(second, y, y1) + ca.jtimes(second, y1, y2)
        return ca.Function("third", [y, y1, y2, e.p], [ca.densify(third)])

    @cached_property
    def _jerks(self) -> ca.Function:
        e = self.equations
        both = ca.vertcat(e.F, e.w)
        y, y1, y2, _, second = _derivatives(e, both)
        y3 = ca.SX.sym("y3", y.numel())
        third = ca.jtimes(second, y, y1) + ca.jtimes(second, y1, y2) + ca.jtimes(second, y2, y3)
        return ca.Function("jerks", [y, y1, y2, y3, e.p], [ca.densify(third)])

    def jerks(self, y: Array, y1: Array, y2: Array, y3: Array, p: Array) -> tuple[Array, Array]:
        """The third time derivatives of F (samples, rows) and of w (samples, coordinates); y (samples, y) alike."""
        rows = self.equations.F.numel()
        both = self._jerks(y.T, y1.T, y2.T, y3.T, p).full().T
        return both[:, :rows], both[:, rows:]

    def third(self, y: Array, y1: Array, y2: Array, p: Array) -> Array:
        """The third time derivative of F (rows,), that of y left out."""
        return self._third(y, y1, y2, p).full().ravel()

    @cached_property
    def _bends(self) -> tuple[ca.Function, ca.Function]:
        e = self.equations
        y, way, rows = ca.vertcat(e.z, e.u), ca.SX.sym("way", e.z.numel() + e.u.numel()), ca.SX.sym("l", e.F.numel())
        along = ca.jacobian(ca.jtimes(e.F, y, way), y)
        weighed = ca.jacobian(ca.jtimes(e.F, y, rows, True), y)
        return (
            ca.Function("along", [y, way, e.p], [ca.densify(along)]),
            ca.Function("weighed", [y, rows, e.p], [ca.densify(weighed)]),
        )

    def bend_along(self, y: Array, way: Array, p: Array) -> Array:
        """The slope of (dF/dy) way (rows, y): the second derivatives of F with one direction filled in."""
        return self._bends[0](y, way, p).full()

    def bend_of(self, y: Array, rows: Array, p: Array) -> Array:
        """The second derivatives (y, y) of the sum of the rows of F, each times its number."""
        return self._bends[1](y, rows, p).full()

    @cached_property
    def _deflated(self) -> ca.Function:
        e = self.equations
        z1, u1 = ca.SX.sym("z1", e.z.numel()), ca.SX.sym("u1", e.u.numel())
        both = ca.vertcat(e.F, ca.jtimes(e.F, ca.vertcat(e.z, e.u), ca.vertcat(z1, u1)))
        slopes = ca.jacobian(both, ca.vertcat(e.z, z1))
        return ca.Function("deflated", [e.z, z1, e.u, u1, e.p], [ca.densify(both), ca.densify(slopes)])

    def deflated(self, z: Array, z1: Array, u: Array, u1: Array, p: Array) -> tuple[Array, Array]:
        """F and its first time derivative (2 rows,), and their slope in z and z1 (2 rows, 2 unknowns).

        A. Leykin, J. Verschelde, A. Zhao, Newton's method with deflation for isolated singularities, Theor. Comp. Sci.
        359, 2006.
        """
        both, slopes = self._deflated(z, z1, u, u1, p)
        return both.full().ravel(), slopes.full()

    def kinematics(self, y: Array, y1: Array, y2: Array, p: Array) -> Rates:
        """Everything at one position, y = (z, u) with its first and second derivatives, or at samples (samples, y)."""
        rows, unknowns = self.equations.F.numel(), self.equations.z.numel()
        if y.ndim == 1:
            parts, slopes = (each.full() for each in self._kinematics(y, y1, y2, p))
            return Rates(*parts[:rows].T, *parts[rows:].T, slopes[:, :unknowns], slopes[:, unknowns:])
        samples, width = y.shape
        parts, slopes = (each.full() for each in self._kinematics(y.T, y1.T, y2.T, p))
        parts = parts.reshape(-1, samples, 3).transpose(2, 1, 0)
        slopes = slopes.reshape(rows, samples, width).transpose(1, 0, 2)
        return Rates(*parts[..., :rows], *parts[..., rows:], slopes[..., :unknowns], slopes[..., unknowns:])

    @cached_property
    def advance(self) -> ca.Function:
        """(z, u, p) -> z: Newton group after group, unrolled.

        Only for structures whose every group has as many constraints as unknowns.
        """
        e = self.equations
        z, u, p = (ca.SX.sym(name, each.numel()) for name, each in (("z", e.z), ("u", e.u), ("p", e.p)))
        now = ca.vertsplit(z)
        for stage in e.stages:
            for _ in range(NEWTON_STEPS if length(stage.unknowns) else 0):
                left, slope = self.closing(stage)(ca.vertcat(*now), u, p)
                now[stage.unknowns] = ca.vertsplit(ca.vertcat(*now[stage.unknowns]) - _solved(slope, left))
        return ca.Function("advance", [z, u, p], [ca.vertcat(*now)])

    def runs(self, samples: int) -> ca.Function:
        """(z, u of every sample, p of every sample) -> z of every sample, each from the one before."""
        if samples not in self._runs:
            self._runs[samples] = self.advance.mapaccum("runs", samples)
        return self._runs[samples]

    @cached_property
    def _runs(self) -> dict[int, ca.Function]:
        return {}

    @cached_property
    def _slopes(self) -> ca.Function:
        e = self.equations
        slopes = ca.jacobian(e.F, ca.vertcat(e.z, e.u))
        return ca.Function("slopes", [e.z, e.u, e.p], [ca.densify(slopes)])

    def slopes(self, z: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """dF/dz (samples, rows, unknowns) and dF/du (samples, rows, inputs) at z (samples, unknowns), u alike."""
        samples, unknowns = z.shape
        rows, inputs = self.equations.F.numel(), u.shape[1]
        if rows == 0:
            return np.zeros((samples, 0, unknowns)), np.zeros((samples, 0, inputs))
        both = self._slopes(z.T, u.T, p).full().reshape(rows, samples, unknowns + inputs).transpose(1, 0, 2)
        return both[:, :, :unknowns], both[:, :, unknowns:]

    @property
    def square(self) -> bool:
        """Whether every group has as many constraints as unknowns."""
        return all(length(stage.rows) == length(stage.unknowns) and not stage.free for stage in self.equations.stages)


def _derivatives(e: Equations, value: ca.SX) -> tuple[ca.SX, ...]:
    """y = (z, u) with symbols for its derivatives, and those of an expression in y.

    The chain rule twice: d/dt = (d/dy) y1, d2/dt2 = (d/dy)(d/dt) y1 + (d/dy) y2.
    """
    y = ca.vertcat(e.z, e.u)
    y1, y2 = ca.SX.sym("y1", y.numel()), ca.SX.sym("y2", y.numel())
    first = ca.jtimes(value, y, y1)
    return y, y1, y2, first, ca.jtimes(first, y, y1) + ca.jtimes(value, y, y2)


def length(part: slice) -> int:
    """How many entries a part of z or F has."""
    return part.stop - part.start


def _solved(slope: ca.SX, left: ca.SX) -> ca.SX:
    """slope^-1 left; two by two by the adjugate, larger by QR, neither of which needs a pivot to be chosen."""
    if slope.numel() == 1:
        return left / slope
    if slope.numel() == 4:
        a, b, c, d = slope[0, 0], slope[0, 1], slope[1, 0], slope[1, 1]
        return ca.vertcat(d * left[0] - b * left[1], a * left[1] - c * left[0]) / (a * d - b * c)
    q, r = ca.qr(slope)
    return ca.solve(r, ca.mtimes(q.T, left))


def program(mechanism: Mechanism) -> Program:
    """The program of a mechanism's structure; mechanisms that differ in their links' dimensions share one."""
    return _program(structure(mechanism))


@lru_cache(maxsize=64)
def _program(structure: Mechanism) -> Program:
    return Program(build(structure))


def structure(mechanism: Mechanism) -> Mechanism:
    """All of a mechanism that its equations depend on: names of links, pairs, which motions are driven."""
    return Mechanism(
        name="",
        frame=mechanism.frame,
        links=tuple(Link(link.name) for link in mechanism.links),
        pairs=mechanism.pairs,
        inputs=tuple(Input(given.pair, 0.0) for given in mechanism.inputs),
    )


def shapes(mechanism: Mechanism) -> dict[str, Shape]:
    """The shape of every link (m)."""
    return {link.name: shape(link) for link in mechanism.links}


def size(mechanism: Mechanism, shapes: Mapping[str, Shape]) -> float:
    """The mechanism's size (m): the greatest distance between two points of one link, else of a slide's travel."""
    named = motions(mechanism)
    slides = [abs(g.position) for g in mechanism.inputs if named[g.pair].drive_kind is Kind.LENGTH]
    return max(map(extent, shapes.values()), default=0.0) or max(slides, default=0.0) or 1.0


def extent(shape: Shape) -> float:
    """The greatest distance between two points of a link (m)."""
    spread = np.array(list(shape.points.values()), dtype=float)
    return float(np.hypot(*(spread.max(axis=0) - spread.min(axis=0)))) if len(spread) else 0.0


def fitted(mechanism: Mechanism, shapes: Mapping[str, Shape], unit: float) -> Array:
    """p: the numbers of every pair, lengths divided by `unit`."""
    found: list[float] = []
    for pair in mechanism.pairs:
        found += scaled(pair.measure([shapes[link] for link in pair.bodies]), pair.measures, unit)
    return np.array(found, dtype=float)


def positions(mechanism: Mechanism, unit: float) -> Array:
    """u: the positions of the inputs, lengths divided by `unit`."""
    return rates(mechanism, "position", unit)


def rates(mechanism: Mechanism, order: str, unit: float) -> Array:
    """Position, velocity or acceleration of the inputs, lengths divided by `unit`."""
    named = motions(mechanism)
    kinds = [named[given.pair].drive_kind for given in mechanism.inputs]
    return np.array(scaled([getattr(given, order) for given in mechanism.inputs], kinds, unit), dtype=float)


def scaled(values: Sequence[float], kinds: Sequence[Kind], unit: float) -> list[float]:
    """Numbers with the lengths among them divided by `unit`."""
    return [value / unit if kind is Kind.LENGTH else value for value, kind in zip(values, kinds, strict=True)]


def placed(
    w: Sequence[Scalar] | Array, column: Mapping[tuple[str, str], int], links: Iterable[str], pairs: Mapping[str, Pair]
) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
    """Frames of links and own coordinates of pairs from w, whose entries may be floats, arrays or jets."""
    frames = {
        link: frame_at(*(w[column[link, part]] for part in ("x", "y", "angle"))) if (link, "x") in column else GROUND
        for link in links
    }
    own = {name: tuple(w[column[name, part]] for part, _ in pair.coordinates) for name, pair in pairs.items()}
    return frames, own
