"""Equations as something that runs: casadi functions over the symbols z, u, p of the equations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property, lru_cache
from math import hypot
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_call import Called, Chained
from planar.equations.closed_form import Closed, closed
from planar.equations.constraint_equations import Equations, Stage, build
from planar.equations.elimination import stack
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.foundation.jets import Scalar
from planar.model.link_shapes import Shape, shape
from planar.model.mechanism import Input, Link, Mechanism, motions
from planar.model.pairs import Kind, Pair

Array = np.ndarray
CACHED = 256
"""Mechanisms of which what was derived is kept: more than come along, so that none is derived twice in a round."""

POLISHED = 2
"""Newton's steps that carry a closed form to round-off."""
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


class Assemblies:
    """The two assemblies of one stage in closed form, carried to round-off by Newton's steps."""

    def __init__(self, unknowns: slice, form: Called, polished: Called):
        self._unknowns, self._form, self._polished = unknowns, form, polished

    def __call__(self, z: Array, u: Array, p: Array) -> tuple[list[Array], float, float]:
        """Both (unknowns,), what they leave open at most, and how near they are to where they meet (`closed.Closed`).

        What is not there is not a number.
        """
        found, left, bend = [], 0.0, 0.0
        for sign in (1.0, -1.0):
            whole = z.copy()
            own, bends = self._form(z, u, p, np.array([sign]))
            bend = float(bends[0, 0])
            whole[self._unknowns] = own[0]
            for _ in range(POLISHED):
                whole[self._unknowns] = self._polished(whole, u, p)[0][0]
            # the greatest of what is left open does not see what is not a number
            sure = np.isfinite(whole[self._unknowns]).all()
            left = np.maximum(left, self._polished(whole, u, p)[1][0, 0] if sure else np.nan)
            found.append(whole[self._unknowns])
        return found, float(left), bend


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

    def closed(self, stage: Stage) -> Called:
        """The same, called on arrays: F and the slope's columns (unknowns, rows)."""
        if stage.level not in self._closed:
            self._closed[stage.level] = Called(self.closing(stage))
        return self._closed[stage.level]

    @cached_property
    def _closed(self) -> dict[int, Called]:
        return {}

    def assemblies(self, stage: Stage) -> Assemblies | None:
        """Both assemblies of a stage; None for one without a closed form."""
        if stage.level not in self._assemblies:
            form = closed(self.equations, stage)
            self._assemblies[stage.level] = form and self._both(stage, form)
        return self._assemblies[stage.level]

    @cached_property
    def _assemblies(self) -> dict[int, Assemblies | None]:
        return {}

    def _both(self, stage: Stage, form: Closed) -> Assemblies:
        e = self.equations
        found = stack(ca.atan2(each[1], each[0]) if len(each) == 2 else each[0] for each in form.found)
        left, slope = self.closing(stage)(e.z, e.u, e.p)
        polished = [e.z[stage.unknowns] - solved(slope, left), ca.norm_inf(left)]
        return Assemblies(
            stage.unknowns,
            Called(ca.Function("assembly", [e.z, e.u, e.p, form.sign], [found, form.bend])),
            Called(ca.Function("polished", [e.z, e.u, e.p], polished)),
        )

    @cached_property
    def positions(self) -> ca.Function:
        """(z, u, p) -> w."""
        e = self.equations
        return ca.Function("positions", [e.z, e.u, e.p], [ca.densify(e.w)])

    def coordinates(self, z: Array, u: Array, p: Array) -> Array:
        """w (coordinates,) at z (unknowns,), or (samples, coordinates) at z (samples, unknowns), u alike."""
        if z.ndim == 1:
            return self._coordinates(z, u, p)[0][0]
        return self._coordinates.over(len(z), z, u, p)[0][:, 0]

    @cached_property
    def _coordinates(self) -> Called:
        return Called(self.positions)

    @cached_property
    def _called(self) -> tuple[Called, Called]:
        return Called(self.rates), Called(self._slopes)

    @cached_property
    def rates(self) -> ca.Function:
        """(y, y1, y2, p) -> F and w, one after the other, with their first and second rates, and dF/dy."""
        e = self.equations
        both = ca.vertcat(e.F, e.w)
        y, y1, y2, first, second = derivatives(e, both)
        slopes = ca.jacobian(e.F, y)
        outputs = [ca.horzcat(both, first, second), slopes]
        return ca.Function("kinematics", [y, y1, y2, e.p], [ca.densify(output) for output in outputs])

    @cached_property
    def _third(self) -> ca.Function:
        e = self.equations
        y, y1, y2, _, second = derivatives(e, e.F)
        third = ca.jtimes(second, y, y1) + ca.jtimes(second, y1, y2)
        return ca.Function("third", [y, y1, y2, e.p], [ca.densify(third)])

    @cached_property
    def _jerks(self) -> ca.Function:
        e = self.equations
        both = ca.vertcat(e.F, e.w)
        y, y1, y2, _, second = derivatives(e, both)
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
            parts, slopes = self._called[0](y, y1, y2, p)
            return Rates(*parts[:, :rows], *parts[:, rows:], slopes[:unknowns].T, slopes[unknowns:].T)
        parts, slopes = self._called[0].over(len(y), y, y1, y2, p)
        parts, slopes = parts.transpose(1, 0, 2), slopes.transpose(0, 2, 1)
        return Rates(*parts[..., :rows], *parts[..., rows:], slopes[..., :unknowns], slopes[..., unknowns:])

    @cached_property
    def advance(self) -> ca.Function:
        """(z, u, p) -> z: Newton group after group, unrolled.

        Only for structures whose every group has as many constraints as unknowns.
        """
        e = self.equations
        z, u, p = (ca.SX.sym(name, each.numel()) for name, each in (("z", e.z), ("u", e.u), ("p", e.p)))
        return compact("advance", [z, u, p], [self.corrected(z, u, p, NEWTON_STEPS)[0]])

    def advanced(self, z: Array, u: Array, p: Array) -> Array:
        """The same at samples z (samples, unknowns), u and p alike, each by itself."""
        return self._advanced.over(len(z), z, u, p)[0][:, 0]

    @cached_property
    def _advanced(self) -> Called:
        return Called(self.advance)

    def corrected(self, z: ca.SX, u: ca.SX, p: ca.SX, steps: int = 1) -> tuple[ca.SX, ca.SX]:
        """Unknowns after so many of Newton's steps, group after group, for structures as `advance` takes, and what each
        group left open before its last step (rows,)."""
        open_ = []
        now = ca.vertsplit(z) if z.numel() else []
        for stage in self.equations.stages:
            for _ in range(steps if length(stage.unknowns) else 0):
                left, slope = self.closing(stage)(ca.vertcat(*now), u, p)
                now[stage.unknowns] = ca.vertsplit(ca.vertcat(*now[stage.unknowns]) - solved(slope, left))
            open_ += [left] if length(stage.unknowns) else []
        return stack(now), stack(open_)

    def run(self, z: Array, u: Array, p: Array) -> Array:
        """The unknowns at every sample of inputs u (samples, inputs), each from the one before, the first from z."""
        return self._run(z, u, p)

    @cached_property
    def _run(self) -> Chained:
        return Chained(self.advance)

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
        called = self._called[1]
        both = (called(z[0], u[0], p)[0][None] if samples == 1 else called.over(samples, z, u, p)[0]).transpose(0, 2, 1)
        return both[:, :, :unknowns], both[:, :, unknowns:]

    @cached_property
    def _left(self) -> Called:
        e = self.equations
        slopes = ca.jacobian(e.F, ca.vertcat(e.z, e.u))
        return Called(ca.Function("left", [e.z, e.u, e.p], [ca.densify(e.F), ca.densify(slopes)]))

    def left(self, z: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """F (rows,) and its slope (rows, unknowns and inputs) at one position."""
        if not len(self.equations.rows):
            return np.zeros(0), np.zeros((0, len(z) + len(u)))
        left, slope = self._left(z, u, p)
        return left[0], slope.T

    @cached_property
    def square(self) -> bool:
        """Whether every group has as many constraints as unknowns."""
        return all(length(stage.rows) == length(stage.unknowns) and not stage.free for stage in self.equations.stages)


def derivatives(e: Equations, value: ca.SX) -> tuple[ca.SX, ...]:
    """y = (z, u) with symbols for its derivatives, and those of an expression in y.

    The chain rule twice: d/dt = (d/dy) y1, d2/dt2 = (d/dy)(d/dt) y1 + (d/dy) y2.
    """
    y = ca.vertcat(e.z, e.u)
    y1, y2 = ca.SX.sym("y1", y.numel()), ca.SX.sym("y2", y.numel())
    first = ca.jtimes(value, y, y1)
    return y, y1, y2, first, ca.jtimes(first, y, y1) + ca.jtimes(value, y, y2)


def compact(name: str, given: Sequence[ca.SX], wanted: Sequence[ca.SX]) -> ca.Function:
    """A function in which what stands in several places is computed once."""
    return ca.Function(name, given, ca.cse(list(wanted)))


def length(part: slice) -> int:
    """How many entries a part of z or F has."""
    return part.stop - part.start


def solved(slope: ca.SX, left: ca.SX) -> ca.SX:
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


@lru_cache(maxsize=CACHED)
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
    slide = [named[given.pair].drive_kind is Kind.LENGTH for given in mechanism.inputs]
    return greatest(mechanism, {name: extent(shape) for name, shape in shapes.items()}, slide)


def greatest(mechanism: Mechanism, extents: Mapping[str, float], slide: Sequence[bool]) -> float:
    """The mechanism's size (m) from the extents of its links and from which of its inputs slide."""
    slides = [abs(given.position) for given, slides in zip(mechanism.inputs, slide, strict=True) if slides]
    return max(extents.values(), default=0.0) or max(slides, default=0.0) or 1.0


def extent(shape: Shape) -> float:
    """The greatest distance between two points of a link (m)."""
    x, y = [at.x for at in shape.points.values()], [at.y for at in shape.points.values()]
    return hypot(max(x) - min(x), max(y) - min(y)) if x else 0.0


def fitted(mechanism: Mechanism, shapes: Mapping[str, Shape], unit: float) -> Array:
    """p: the numbers of every pair, lengths divided by `unit`."""
    measured = {pair.name: pair.measure([shapes[link] for link in pair.bodies]) for pair in mechanism.pairs}
    return gathered(mechanism, measured, unit)


def gathered(mechanism: Mechanism, numbers: Mapping[str, Sequence[float]], unit: float) -> Array:
    """p from the numbers of every pair, lengths divided by `unit`."""
    found: list[float] = []
    for pair in mechanism.pairs:
        found += scaled(numbers[pair.name], pair.measures, unit)
    return np.array(found, dtype=float)


def scaled(values: Sequence[float], kinds: Sequence[Kind], unit: float) -> list[float]:
    """Numbers with the lengths among them divided by `unit`."""
    return [value / unit if kind is Kind.LENGTH else value for value, kind in zip(values, kinds, strict=True)]


def placed(
    w: Sequence[Scalar] | Array,
    column: Mapping[tuple[str, str], int],
    links: Iterable[str],
    pairs: Mapping[str, Pair],
    framed: Callable[..., Frame] = frame_at,
) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
    """Frames of links and own coordinates of pairs from w, whose entries may be floats, arrays or jets.

    `framed` makes a frame of x, y and angle.
    """
    frames = {
        link: framed(*(w[column[link, part]] for part in ("x", "y", "angle"))) if (link, "x") in column else GROUND
        for link in links
    }
    own = {name: tuple(w[column[name, part]] for part, _ in pair.coordinates) for name, pair in pairs.items()}
    return frames, own
