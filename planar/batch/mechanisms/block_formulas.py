"""The formulas of a kind of groups: how it is assembled, run, judged, and followed by Newton's method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca

from planar.batch.march.kernel import solved
from planar.batch.mechanisms.block_type import COS, SIN, X1, X2, Structure
from planar.codegen.block_formula import Formula, Leaf
from planar.codegen.instructions import (
    Listing,
    NotPrinted,
    Turned,
    check_length,
    needed,
    without_turning,
)
from planar.equations.closed_form import Closed
from planar.equations.constraint_equations import Equations, Stage
from planar.equations.functions import length, placed
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.model.pairs import Kind as Measure

NOTHING = 1e-300
"""Times what is a number it is nothing beside round-off; times what is none it is none."""


class Way(NamedTuple):
    """A way to assemble a kind: the numbers of the values that stand for its unknowns, and of its bends."""

    z: list[int]
    turned: dict[int, Turned]
    bends: list[int]


class Derivation:
    """The formulas of a kind, put into one listing."""

    def __init__(self, kind: Structure):
        self.kind, self.e = kind, kind.equations
        self.listing = Listing()
        e, given, measures = self.e, len(kind.given), kind.measures
        self.symbols = [e.u, e.p, ca.SX.sym("u1", e.u.numel()), ca.SX.sym("u2", e.u.numel())]
        self.u, self.turned = [], {}
        for k in range(e.u.numel()):
            slot, part = (k // 3, k % 3) if k < 3 * given else (given + k - 3 * given, 0)
            self.u.append(self.leaf("angle", (slot,)) if part == 2 else self.leaf("row", (slot, part)))
            if part == 2 or e.drives[k] is not Measure.LENGTH:
                self.turned[self.u[-1]] = Turned(self.leaf("row", (slot, COS)), self.leaf("row", (slot, SIN)))
        self.p = [self.leaf("p", k) for k in range(len(measures))]
        for place, k in enumerate(kind.angles):
            both = (self.leaf("p", len(measures) + 2 * place + part) for part in (0, 1))
            self.turned[self.p[k]] = Turned(*both)
        rows = [(k // 3, X1 + k % 3, X2 + k % 3) if k < 3 * given else (given + k - 3 * given, X1, X2)
                for k in range(e.u.numel())]  # fmt: skip
        self.u1 = [self.leaf("row", (slot, first)) for slot, first, _ in rows]
        self.u2 = [self.leaf("row", (slot, second)) for slot, _, second in rows]

    def leaf(self, what: str, data: Any) -> int:
        return self.listing.add("input", data=(what, data))

    def _inlined(
        self, of: Sequence[ca.SX], outputs: list[ca.SX], z: list[int], more: Sequence[list[int]] = ()
    ) -> list[int]:
        """The values of expressions in z, u, p, u1, u2 and further symbols."""
        whole = ca.densify(ca.vertcat(*outputs))
        function = ca.Function("part", [self.e.z, *self.symbols, *of], [whole], {"cse": True})
        arguments = [z, self.u, self.p, self.u1, self.u2, *more]
        return self.listing.inlined(function, arguments)[0]

    def assembled(self, signs: Sequence[int], polished: bool = False) -> Way:
        """The unknowns, group after group, by their closed forms; polished by a step of Newton's method."""
        e, way = self.e, len(self.listing.values)
        z = [self.leaf("unknown", (way, k)) for k in range(e.z.numel())]
        turned, bends, left = {}, [], iter(signs)
        for stage, form in zip(self.kind.stages, self.kind.closed, strict=True):
            assert form is not None
            flat = [*(part for found in form.found for part in found), form.bend]
            if isinstance(form, Closed):
                values = iter(self._inlined([form.sign], flat, z, [[next(left)]]))
            else:
                values = iter(self._inlined((), flat, z))
            own = range(stage.unknowns.start, stage.unknowns.stop)
            parts = {k: [next(values) for _ in found] for k, found in zip(own, form.found, strict=True)}
            bends.append(next(values))
            if polished:
                parts = self._polished(stage, z, parts)
            for k, found in parts.items():
                if len(found) == 2:
                    self.turned[z[k]] = turned[k] = Turned(*found)
                else:
                    z[k] = found[0]
        return Way(z, turned, bends)

    def followed(self, rates: bool | None) -> Formula:
        """One of the formulas of `Near`: None for the step, else what is told."""
        e, kind = self.e, self.kind
        z, turned = [], {}
        for k, is_angle in enumerate(kind.turning):
            z.append(self.leaf("unknown", ("of", k)) if is_angle else self.leaf("z", (k, 0)))
            if is_angle:
                turned[k] = self.turned[z[k]] = Turned(self.leaf("z", (k, 0)), self.leaf("z", (k, 1)))
        if rates is None:
            step, square, *lengths = solved(ca.densify(ca.jacobian(e.F, e.z)), e.F)
            strength = square / lengths[0] if lengths else square
            return self.formula(self._inlined((), [step, strength], z))
        way = Way(z, turned, [])
        poses = rows = self.poses(way)
        if rates:
            rows = [[*pose, *more] for pose, more in zip(poses, self.rates(way), strict=True)]
        left, _ = self.judged(way, self.gaps(way, poses))
        return self.formula([*(each for pose in rows for each in pose), left])

    def _polished(self, stage: Stage, z: list[int], parts: dict[int, list[int]]) -> dict[int, list[int]]:
        """The unknowns of a group after a step of Newton's method, angles turned by the rational rotation."""
        e, add, one = self.e, self.listing.add, self.listing.const(1.0)
        near = list(z)
        for k, found in parts.items():
            if len(found) == 2:
                c, s = found
                size = add("sqrt", add("add", add("mul", c, c), add("mul", s, s)))
                parts[k] = [add("div", c, size), add("div", s, size)]
                near[k] = self.leaf("unknown", ("near", len(self.listing.values)))
                self.turned[near[k]] = Turned(*parts[k])
            else:
                near[k] = found[0]
        slope = ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns]))
        step = self._inlined((), [_divided(slope, e.F[stage.rows])], near)
        found = {}
        for (k, own), back in zip(parts.items(), step, strict=True):
            if len(own) == 1:
                found[k] = [add("sub", own[0], back)]
                continue
            c, s = own
            half = add("mul", self.listing.const(-0.5), back)
            square = add("mul", half, half)
            scale = add("div", one, add("add", one, square))
            cos, sin = add("mul", add("sub", one, square), scale), add("mul", add("add", half, half), scale)
            found[k] = [
                add("sub", add("mul", c, cos), add("mul", s, sin)),
                add("add", add("mul", s, cos), add("mul", c, sin)),
            ]
        return found

    def _placed(self) -> tuple[dict[str, Frame], dict[str, tuple]]:
        """Frames of the inner links and own coordinates of the pairs, in the unknowns."""
        e, kind = self.e, self.kind
        column = {(c.owner, c.part): k for k, c in enumerate(e.coordinates)}
        return placed(ca.vertsplit(e.w), column, kind.inner, {pair.name: pair for pair in kind.mechanism.pairs})

    def poses(self, way: Way) -> list[list[int]]:
        """x, y, cos and sin of every inner link."""
        frames, _ = self._placed()
        parts = [part for name in self.kind.inner for part in frames[name][:4]]
        values = self._inlined((), [ca.SX(part) for part in parts], way.z)
        return [values[4 * k : 4 * k + 4] for k in range(len(self.kind.inner))]

    def gaps(self, way: Way, poses: list[list[int]]) -> list[int]:
        """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

        Of an angle that closes modulo a turn |sin| + 1 - cos; of cos and sin of an unknown, how far from the circle.
        """
        e, kind = self.e, self.kind
        places = ca.SX.sym("places", 3 * len(kind.inner))
        numbers: list[int] = []
        for k, (x, y, c, s) in enumerate(poses):
            numbers += [x, y, self.leaf("unknown", (len(self.listing.values), k))]
            self.turned[numbers[-1]] = Turned(c, s)
        names = (*kind.given, *kind.inner)
        split = [*ca.vertsplit(e.u)[: 3 * len(kind.given)], *ca.vertsplit(places)]
        frames = {name: frame_at(*split[3 * k : 3 * k + 3]) for k, name in enumerate(names)} | {"frame": GROUND}
        _, own = self._placed()
        found: list[tuple[Measure, ca.SX]] = []
        first, driven = 0, 3 * len(kind.given)
        for pair, joint in zip(kind.mechanism.pairs, kind.signature.joints, strict=True):
            sizes = [e.p[first + k] for k in range(len(pair.measures))]
            first += len(sizes)
            bodies = [frames[link] for link in pair.bodies]
            found += zip(pair.constrains, pair.residual(bodies, sizes, own[pair.name]), strict=True)
            if joint.driven:
                found.append((pair.drive_kind, pair.drive(bodies, sizes, own[pair.name]) - e.u[driven]))
                driven += 1
        open_ = [ca.sin(left) if kind is Measure.ANGLE else left for kind, left in found]
        open_ += [1.0 - ca.cos(left) for kind, left in found if kind is Measure.ANGLE]
        values = self._inlined((places,), [ca.SX(each) for each in open_], way.z, (numbers,))
        add = self.listing.add
        for c, s in way.turned.values():
            square = add("add", add("mul", c, c), add("mul", s, s))
            values.append(add("sub", square, self.listing.const(1.0)))
        return values

    def judged(self, way: Way, gaps: list[int]) -> list[int]:
        """What is left open at most, and the least of how far from where two ways meet."""
        add = self.listing.add
        left = whole = self.listing.const(0.0)
        for gap in gaps:
            own = add("abs", gap)
            left, whole = add("maxnum", left, own), add("add", whole, own)
        # what is no number stays so in a sum, but not in the greatest
        left = add("add", left, add("mul", self.listing.const(NOTHING), whole))
        clear = self.listing.const(1.0)
        for k, bend in enumerate(way.bends):
            own = add("sub", self.listing.const(1.0), bend)
            clear = add("minnum", clear, own) if k else own
        return [left, clear]

    def rates(self, way: Way) -> list[list[int]]:
        """x', y', angle', then the second ones of every inner link."""
        e, (u1, u2) = self.e, self.symbols[2:]
        z1, z2 = _rates(e, u1, u2)
        y, y1, y2 = ca.vertcat(e.z, e.u), ca.vertcat(z1, u1), ca.vertcat(z2, u2)
        v1, v2 = ca.SX.sym("v1", y.numel()), ca.SX.sym("v2", y.numel())
        w = e.w[: 3 * len(self.kind.inner)]
        first = ca.jtimes(w, y, v1)
        second = ca.jtimes(first, y, v1) + ca.jtimes(w, y, v2)
        both = ca.substitute(ca.vertcat(first, second), ca.vertcat(v1, v2), ca.vertcat(y1, y2))
        values = self._inlined((), [both], way.z)
        many = 3 * len(self.kind.inner)
        return [values[3 * k : 3 * k + 3] + values[many + 3 * k : many + 3 * k + 3] for k in range(many // 3)]

    def distance(self, poses: list[list[int]], stats: list[list[int]]) -> int:
        """The squared distance of the links' points to the sketch, from the sums of these: see `statistics`."""
        add = self.listing.add
        whole = self.listing.const(0.0)
        for (x, y, c, s), (many, px, py, tx, ty, along, across, squares) in zip(poses, stats, strict=True):
            mul = lambda a, b: add("mul", a, b)  # noqa: E731
            square = add("add", mul(x, x), mul(y, y))
            turned = add("sub", mul(c, px), mul(s, py)), add("add", mul(s, px), mul(c, py))
            mixed = add("add", mul(x, add("sub", turned[0], tx)), mul(y, add("sub", turned[1], ty)))
            mixed = add("sub", mixed, add("add", mul(c, along), mul(s, across)))
            own = add("add", add("add", mul(many, square), add("add", mixed, mixed)), squares)
            whole = add("add", whole, own)
        return whole

    def formula(self, wanted: list[int]) -> Formula:
        """The formula of wanted values. Raises NotPrinted where an angle stands outside cos and sin, or it is long."""
        made, numbers = without_turning(self.listing, wanted, self.turned)
        leaves: dict[int, Leaf] = {}
        order = needed(made, numbers)
        check_length(len(order))
        for number in order:
            value = made.values[number]
            if value.what == "input":
                what, data = value.data  # type: ignore[misc]
                if what in ("angle", "unknown"):
                    raise NotPrinted("an angle stands outside cos and sin")
                leaves[number] = Leaf(what, *(data if isinstance(data, tuple) else (data,)))
        return Formula(made, tuple(numbers), leaves)


def _rates(e: Equations, u1: ca.SX, u2: ca.SX) -> tuple[ca.SX, ca.SX]:
    """First and second rates of the unknowns, stage after stage."""
    y = ca.vertcat(e.z, e.u)
    v1, v2 = ca.SX.sym("v1", y.numel()), ca.SX.sym("v2", y.numel())
    first = ca.jtimes(e.F, y, v1)
    second = ca.jtimes(first, y, v1) + ca.jtimes(e.F, y, v2)
    z1, z2 = ca.SX.zeros(e.z.numel()), ca.SX.zeros(e.z.numel())
    for order, expression in ((z1, first), (z2, second)):
        for stage in e.stages:
            if length(stage.unknowns) == 0:
                continue
            known = ca.substitute(expression[stage.rows], ca.vertcat(v1, v2), ca.vertcat(z1, u1, z2, u2))
            slope = ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns]))
            order[stage.unknowns] = -_divided(slope, known)
    return z1, z2


def _divided(slope: ca.SX, left: ca.SX) -> ca.SX:
    return solved(slope, left)[0]
