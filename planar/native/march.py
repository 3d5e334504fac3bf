"""The run of many designs, lane by lane, as one function of LLVM IR: predicted, corrected by Newton, judged, told.

The angles' cos and sin are the state; Newton's step d turns them by the rational rotation of Cayley, by 2 atan(d / 2),
so that no sine stands in the loop. The next step is predicted by the polynomial through the steps before.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca

from planar.equations import Equations, Stage
from planar.mechanism import Mechanism, motions
from planar.native.listing import Listing, NotPrinted, Turned, needed, without_turning
from planar.native.text import Text
from planar.pairs import Kind
from planar.plane import GROUND, Frame, Vector, frame_at
from planar.program import length, placed

ORDER = 5
"""Steps before from which the next is predicted."""


class Layout(NamedTuple):
    """What the function takes and gives, row by row, each with an entry for every design.

    state: ("c" or "s" of an angle, "z" of a length; index), drives: the same of the inputs; p and q: numbers of pairs,
    and coordinates of the points that are told; rates: of the inputs, first and second. out: rows that a step gives.
    """

    state: tuple[tuple[str, int], ...]
    drives: tuple[tuple[str, int], ...]
    p: int
    q: int
    rates: int
    out: int
    text: str
    lanes: int


def march(equations: Equations, mechanism: Mechanism, links: Sequence[str], rates: bool, lanes: int) -> Layout:
    """The function for points on these links, none of which is the frame. Raises NotPrinted.

    Of the mechanism only the structure matters: links, pairs, and which motions are driven.
    """
    carried: frozenset[int] = frozenset()
    while True:
        try:
            return _March(equations, mechanism, links, rates, lanes, carried).written()
        except Outside as angle:
            carried |= {angle.index}


class Outside(Exception):
    """An angle stands outside cos and sin, so that its value has to be carried beside them."""

    def __init__(self, index: int):
        super().__init__()
        self.index = index


class _Symbols(NamedTuple):
    z: ca.SX
    u: ca.SX
    p: ca.SX
    q: ca.SX
    u1: ca.SX
    u2: ca.SX


class _March:
    def __init__(
        self,
        e: Equations,
        mechanism: Mechanism,
        links: Sequence[str],
        rates: bool,
        lanes: int,
        carried: frozenset[int],
    ):
        if any(length(s.rows) != length(s.unknowns) or s.free for s in e.stages):
            raise NotPrinted("constraints hold each other more than once")
        named = motions(mechanism)
        self.turning = tuple(named[given.pair].drive_kind is Kind.ANGLE for given in mechanism.inputs)
        self.e, self.mechanism, self.links, self.rates = e, mechanism, tuple(links), rates
        self.text = Text(lanes)
        self.angle = [e.coordinates[column].kind is Kind.ANGLE for column in e.unknowns]
        inputs = e.u.numel()
        self.s = _Symbols(
            e.z, e.u, e.p, ca.SX.sym("q", 2 * len(links)), ca.SX.sym("u1", inputs), ca.SX.sym("u2", inputs)
        )
        self.state = tuple(
            (part, k)
            for k, is_angle in enumerate(self.angle)
            for part in (("c", "s", "z") if k in carried else ("c", "s") if is_angle else ("z",))
        )
        self.drives = tuple(
            (part, k) for k, is_angle in enumerate(self.turning) for part in (("c", "s", "z") if is_angle else ("z",))
        )

    # what is computed, as casadi expressions

    def _function(self, outputs: list[ca.SX]) -> ca.Function:
        return ca.Function("part", list(self.s), [ca.densify(ca.vertcat(*outputs))], {"cse": True})

    def _step(self, stage: Stage) -> ca.Function:
        """Newton's step of a stage, and the square of how regular its slope is."""
        e = self.e
        slope = ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns]))
        step, strength = _solved(slope, e.F[stage.rows])
        return self._function([step, strength])

    def _told(self) -> ca.Function:
        """What is left open by the constraints, then the points' positions, and rates."""
        e, s = self.e, self.s
        z1, z2 = _rates(e, s.u1, s.u2) if self.rates else (e.z, e.z)
        y, y1, y2 = ca.vertcat(e.z, e.u), ca.vertcat(z1, s.u1), ca.vertcat(z2, s.u2)
        frames = _frames(e, self.links)
        found: list[ca.SX] = []
        for k, link in enumerate(self.links):
            place = frames[link].carry(Vector(s.q[2 * k], s.q[2 * k + 1]))
            found += [place.x, place.y]
        places = ca.vertcat(*found)
        outputs = [_open(e, self.mechanism), places]
        if self.rates:
            first = ca.jtimes(places, y, y1)
            v1, v2 = ca.SX.sym("v1", y.numel()), ca.SX.sym("v2", y.numel())
            moving = ca.jtimes(places, y, v1)
            second = ca.jtimes(moving, y, v1) + ca.jtimes(places, y, v2)
            second = ca.substitute(second, ca.vertcat(v1, v2), ca.vertcat(y1, y2))
            outputs += [first, second]
        return self._function(outputs)

    # how it is written

    def _values(self, function: ca.Function, have: dict[tuple[str, int], str]) -> list[str]:
        """The values of a function where the leaves stand under these names."""
        listing = Listing()
        angles: dict[int, Turned] = {}
        kinds = zip(("z", "u", "p", "q", "u1", "u2"), self.s, strict=True)
        arguments = []
        for name, symbol in kinds:
            numbers = [listing.add("input", data=(name, k)) for k in range(symbol.numel())]
            arguments.append(numbers)
            turned = self.angle if name == "z" else self.turning if name == "u" else ()
            for k, is_angle in enumerate(turned):
                if is_angle:
                    parts = [listing.add("input", data=(name + part, k)) for part in "cs"]
                    angles[numbers[k]] = Turned(*parts)
        outputs = [each for output in listing.inlined(function, arguments) for each in output]
        made, wanted = without_turning(listing, outputs, angles)
        names = {k: have[v.data] for k, v in enumerate(made.values) if v.what == "input" and v.data in have}
        for k in needed(made, wanted):
            if made.values[k].what == "input" and k not in names:
                raise Outside(made.values[k].data[1])
        return self.text.values(made, wanted, names)

    def written(self) -> Layout:
        """The whole function: blocks of designs, in each the steps, in each of these Newton's."""
        t = self.text
        told = self._told()
        rows = 2 * len(self.links) * (3 if self.rates else 1)
        names = ("p", "q", "state", "drive", "rate", "table", "counts")
        arrays = ", ".join(f"ptr noalias readonly %{name}" for name in names)
        t.line(
            f"define void @march(i64 %blocks, i64 %steps, {arrays}, double %tolerance, double %astray, "
            "ptr noalias %out, ptr noalias %good) {"
        )
        t.label("entry")
        self.designs = t.new(f"mul i64 %blocks, {t.lanes}")
        self.slots = {each: t.slot() for each in self.state}
        self.steps = [[t.slot() for _ in range(ORDER)] for _ in self.angle]
        self.gone, self.moved = ([t.slot() for _ in self.angle] for _ in range(2))
        self.strong, self.fine, self.good = (t.slot() for _ in range(3))
        t.line("br label %block")
        have, at_start = self._block()
        self._predicted(have, at_start)
        self._corrected(have)
        self._tell(told, have, rows)
        t.loop("k", "steps", "step", "blockend")
        t.label("blockend")
        t.store(t.load(self.good), t.at("%good", self.lane))
        t.loop("b", "blocks", "block", "done")
        t.label("done")
        t.line("ret void")
        t.line("}")
        sizes = (self.e.p.numel(), 2 * len(self.links), 2 * self.e.u.numel() if self.rates else 0, rows)
        return Layout(self.state, self.drives, *sizes, t.module(), t.lanes)

    def _row(self, base: str, k: int | str) -> str:
        """Where the entries of a row for this block of designs stand."""
        t = self.text
        return t.at(base, t.new(f"add i64 {t.new(f'mul i64 {self.designs}, {k}')}, {self.lane}"))

    def _block(self) -> tuple[dict[tuple[str, int], str], dict[tuple[str, int], str]]:
        """A block of designs begins: its numbers, and the inputs at the start."""
        t, e = self.text, self.e
        inputs = e.u.numel()
        t.label("block")
        t.line("%b = phi i64 [0, %entry], [%bnext, %blockend]")
        self.lane = t.new(f"mul i64 %b, {t.lanes}")
        have = {("p", k): t.load(self._row("%p", k)) for k in range(e.p.numel())}
        have |= {("q", k): t.load(self._row("%q", k)) for k in range(2 * len(self.links))}
        if self.rates:
            have |= {(f"u{1 + k // inputs}", k % inputs): t.load(self._row("%rate", k)) for k in range(2 * inputs)}
        at_start = {each: t.load(self._row("%drive", k)) for k, each in enumerate(self.drives)}
        for k, each in enumerate(self.state):
            t.store(t.load(self._row("%state", k)), self.slots[each])
        for each in [slot for of in self.steps for slot in of]:
            t.store("zeroinitializer", each)
        t.store(t.constant(1.0), self.fine)
        t.store("zeroinitializer", self.good)
        t.line("br label %step")
        return have, at_start

    def _predicted(self, have: dict[tuple[str, int], str], at_start: dict[tuple[str, int], str]) -> None:
        """A step begins: where the inputs are, and where the unknowns would be if they went on as before."""
        t, inputs = self.text, self.e.u.numel()
        t.label("step")
        t.line("%k = phi i64 [0, %block], [%knext, %told]")
        begin = t.new(f"mul i64 %k, {ORDER + 3 * inputs}")

        def tabled(k: int) -> str:
            pointer = t.at("%table", t.new(f"add i64 {begin}, {k}"))
            return t.spread(t.new(f"load double, ptr {pointer}"))

        weights = [tabled(k) for k in range(ORDER)]
        for k in range(inputs):
            by, cos, sin = (tabled(ORDER + 3 * k + j) for j in range(3))
            have["u", k] = t.binary("add", at_start["z", k], by)
            if self.turning[k]:
                have["uc", k], have["us", k] = _turned(t, at_start["c", k], at_start["s", k], cos, sin)
        for k, before in enumerate(self.steps):
            ahead = t.summed([t.binary("mul", w, t.load(d)) for w, d in zip(weights, before, strict=True)])
            self._move(k, ahead)
            t.store(ahead, self.gone[k])
            t.store("zeroinitializer", self.moved[k])

    def _corrected(self, have: dict[tuple[str, int], str]) -> None:
        """Newton's method, stage after stage, so often as the step's count says."""
        t = self.text
        t.line(f"%count = load i64, ptr {t.new('getelementptr i64, ptr %counts, i64 %k')}")
        t.line("br label %newton")
        t.label("newton")
        t.line("%n = phi i64 [0, %step], [%nnext, %newton]")
        t.store(t.constant(1.0), self.strong)
        for stage in self.e.stages:
            if length(stage.unknowns) == 0:
                continue
            *delta, strength = self._values(self._step(stage), have | self._now())
            t.store(t.call("minnum", t.load(self.strong), strength), self.strong)
            for k, each in zip(range(stage.unknowns.start, stage.unknowns.stop), delta, strict=True):
                back = t.new(f"fneg {t.vector} {each}")
                self._move(k, back)
                t.store(t.binary("add", t.load(self.moved[k]), back), self.moved[k])
        t.loop("n", "count", "newton", "told")

    def _tell(self, told: ca.Function, have: dict[tuple[str, int], str], rows: int) -> None:
        """The step ends: its results are written and judged, and what it moved is remembered."""
        t, left = self.text, told.numel_out(0) - rows
        t.label("told")
        found = self._values(told, have | self._now())
        for k, each in enumerate(found[left:]):
            place = t.new(f"add i64 {t.new(f'mul i64 %k, {rows}')}, {k}")
            t.store(each, self._row("%out", place))
        self._judged(found[:left])
        for k, before in enumerate(self.steps):
            whole = t.binary("add", t.load(self.gone[k]), t.load(self.moved[k]))
            for later, earlier in zip(reversed(before[1:]), reversed(before[:-1]), strict=True):
                t.store(t.load(earlier), later)
            t.store(whole, before[0])

    def _now(self) -> dict[tuple[str, int], str]:
        names = {"c": "zc", "s": "zs", "z": "z"}
        return {(names[part], k): self.text.load(slot) for (part, k), slot in self.slots.items()}

    def _move(self, k: int, by: str) -> None:
        """Move an unknown on: a length by so much, an angle by the rational rotation."""
        t, slots = self.text, self.slots
        if not self.angle[k]:
            t.store(t.binary("add", t.load(slots["z", k]), by), slots["z", k])
            return
        half = t.binary("mul", by, t.constant(0.5))
        square = t.binary("mul", half, half)
        scale = t.binary("div", t.constant(1.0), t.binary("add", t.constant(1.0), square))
        cos = t.binary("mul", t.binary("sub", t.constant(1.0), square), scale)
        c, s = _turned(t, t.load(slots["c", k]), t.load(slots["s", k]), cos, t.binary("mul", by, scale))
        t.store(c, slots["c", k])
        t.store(s, slots["s", k])
        if ("z", k) in slots:
            # the rotation turns by 2 atan(by / 2)
            turned = t.each("atan", half)
            t.store(t.binary("add", t.load(slots["z", k]), t.binary("add", turned, turned)), slots["z", k])

    def _judged(self, left: list[str]) -> None:
        """Count the step as good while everything closes, is regular, and was moved as predicted."""
        t = self.text
        # sums, since what is not a number stays so in them
        worst, far = (
            t.summed([t.constant(0.0), *(t.call("fabs", each) for each in of)])
            for of in (left, [t.load(each) for each in self.moved])
        )
        # what is not a number is not below anything
        closes = t.compared("ole", worst, t.spread("%tolerance"))
        regular = t.compared("oge", t.load(self.strong), t.constant(WEAK**2))
        near = t.either(t.compared("ole", far, t.spread("%astray")), t.spread_flag("%k", ORDER))
        t.store(t.where(t.both(t.both(closes, regular), near), t.load(self.fine)), self.fine)
        t.store(t.binary("add", t.load(self.good), t.load(self.fine)), self.good)


WEAK = 1e-2
"""A stage whose slope is less regular than this is left to the general path."""


def _turned(t: Text, c: str, s: str, cos: str, sin: str) -> tuple[str, str]:
    return (
        t.binary("sub", t.binary("mul", c, cos), t.binary("mul", s, sin)),
        t.binary("add", t.binary("mul", s, cos), t.binary("mul", c, sin)),
    )


def _solved(slope: ca.SX, left: ca.SX) -> tuple[ca.SX, ca.SX]:
    """slope^-1 left, and the square of how far its columns are from depending on each other, 1 at best."""
    many = left.numel()
    if many == 1:
        return left / slope, slope * slope
    if many == 2:
        a, b, c, d = slope[0, 0], slope[0, 1], slope[1, 0], slope[1, 1]
        det = a * d - b * c
        scale = 1.0 / det
        step = ca.vertcat((d * left[0] - b * left[1]) * scale, (a * left[1] - c * left[0]) * scale)
        return step, det * det / ((a * a + c * c) * (b * b + d * d))
    q, r = ca.qr(slope)
    strength = ca.SX(1.0)
    for k in range(many):
        strength = ca.fmin(strength, r[k, k] ** 2 / ca.sumsqr(slope[:, k]))
    return ca.solve(r, ca.mtimes(q.T, left)), strength


def _rates(e: Equations, u1: ca.SX, u2: ca.SX) -> tuple[ca.SX, ca.SX]:
    """First and second rates of the unknowns, stage after stage."""
    y = ca.vertcat(e.z, e.u)
    v1, v2 = ca.SX.sym("v1", y.numel()), ca.SX.sym("v2", y.numel())
    first = ca.jtimes(e.F, y, v1)
    second = ca.jtimes(first, y, v1) + ca.jtimes(e.F, y, v2)
    z1 = ca.SX.zeros(e.z.numel())
    z2 = ca.SX.zeros(e.z.numel())
    for order, expression in ((1, first), (2, second)):
        for stage in e.stages:
            if length(stage.unknowns) == 0:
                continue
            known = ca.substitute(expression[stage.rows], ca.vertcat(v1, v2), ca.vertcat(z1, u1, z2, u2))
            slope = ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns]))
            step = -_solved(slope, known)[0]
            if order == 1:
                z1[stage.unknowns] = step
            else:
                z2[stage.unknowns] = step
    return z1, z2


def _open(e: Equations, mechanism: Mechanism) -> ca.SX:
    """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

    Of an angle that closes modulo a turn |sin| + 1 - cos, which needs no arc.
    """
    column = {(c.owner, c.part): k for k, c in enumerate(e.coordinates)}
    shapes = {link.name: None for link in mechanism.links}
    frames, own = placed(ca.vertsplit(e.w), column, shapes, {pair.name: pair for pair in mechanism.pairs})
    found, first = [], 0
    numbers: dict[str, list[ca.SX]] = {}
    for pair in mechanism.pairs:
        numbers[pair.name] = [e.p[first + k] for k in range(len(pair.measures))]
        first += len(pair.measures)
        left = pair.residual([frames[link] for link in pair.bodies], numbers[pair.name], own[pair.name])
        found += list(zip(pair.constrains, left, strict=True))
    named = motions(mechanism)
    for k, given in enumerate(mechanism.inputs):
        pair = named[given.pair]
        drive = pair.drive([frames[link] for link in pair.bodies], numbers.get(pair.name, []), own.get(pair.name, ()))
        found.append((pair.drive_kind, drive - e.u[k]))
    closed = [ca.fabs(ca.sin(left)) + 1.0 - ca.cos(left) if kind is Kind.ANGLE else left for kind, left in found]
    return ca.vertcat(*closed)


def _frames(e: Equations, links: Sequence[str]) -> dict[str, Frame]:
    column = {(c.owner, c.part): k for k, c in enumerate(e.coordinates)}

    def frame(link: str) -> Frame:
        if (link, "x") not in column:
            return GROUND
        return frame_at(*(e.w[column[link, part]] for part in ("x", "y", "angle")))

    return {link: frame(link) for link in dict.fromkeys(links)}
