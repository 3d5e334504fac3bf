"""Positions of many linkages of one structure, each at many inputs, as one function of LLVM IR: positions in the lanes.

Nothing goes from one position to the next: groups in closed form need a sign, all others unknowns near by.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.native.compiled import compiled
from planar.native.kernel import Have, Kernel, Leaf, Outside, Part, Structure
from planar.native.listing import NotPrinted

Array = np.ndarray

LANES = 16
NAME = "series"
KINDS = (*("int",) * 3, *("array",) * 6)
"""Of the function's arguments: linkages, blocks of positions, steps of Newton's method; p, sign, state, drives, rates;
out."""
JUDGED = 3
"""Rows of what is told ahead of the rest: what is left open, how regular, how far moved."""


class Layout(NamedTuple):
    """What the function takes and gives, row by row, each with an entry for every position.

    state: of the unknowns that Newton's method solves, cos and sin of an angle or a length; drives: the same of what is
    given; signs: groups in closed form; out: rows that are told, see `Series`.
    """

    state: tuple[Leaf, ...]
    drives: tuple[Leaf, ...]
    signs: int
    out: int
    text: str


class Series(NamedTuple):
    """What was found, each (linkages, rows, positions) or (linkages, positions).

    left: what the constraints leave open; regular: the square of the volume that the columns of the least regular slope
    span; moved: how far Newton's method moved the unknowns; bend: of every group in closed form, see `Closed`;
    unknowns: of every unknown cos and sin, or the length; w: of every link x, y, cos and sin of its angle, and of every
    pair its own coordinates; w1, w2: first and second rates of the coordinates.
    """

    left: Array
    regular: Array
    moved: Array
    bend: Array
    unknowns: Array
    w: Array
    w1: Array
    w2: Array


class _Series(Kernel):
    def __init__(self, of: Structure, rates: bool):
        super().__init__(of, LANES, 0, frozenset({"p"}), frozenset())
        self.rates = rates
        newtons = {k for part in of.parts if part.form is None for k in part.unknowns}
        self.state = tuple(leaf for k, turns in enumerate(of.angle) if k in newtons for leaf in _leaves("z", k, turns))
        self.drives = tuple(
            leaf for k, turns in enumerate(of.turning) for leaf in (*_leaves("u", k, turns), *[("u", k)] * turns)
        )

    def written(self) -> Layout:
        """The whole function: linkages, of each blocks of positions."""
        t, of, e = self.text, self.of, self.of.equations
        numbers, inputs = e.p.numel(), e.u.numel()
        arrays = ", ".join(f"ptr noalias readonly %{name}" for name in ("p", "sign", "state", "drive", "rate"))
        t.line(f"define void @{NAME}(i64 %many, i64 %blocks, i64 %count, {arrays}, ptr noalias %out) {{")
        t.label("entry")
        slots = {leaf: t.slot() for leaf in self.state}
        self.strong, self.moved = t.slot(), t.slot()
        width = t.new(f"mul i64 %blocks, {t.lanes}")
        t.line("br label %linkage")
        t.label("linkage")
        t.line("%m = phi i64 [0, %entry], [%mnext, %linkageend]")

        def scalars(base: str, count: int) -> list[str]:
            first = t.new(f"mul i64 %m, {count}")
            return [
                t.spread(t.new(f"load double, ptr {t.at(base, t.new(f'add i64 {first}, {k}'))}")) for k in range(count)
            ]

        have: Have = {("p", k): value for k, value in enumerate(scalars("%p", numbers))}
        have |= {("sign", k): value for k, value in enumerate(scalars("%sign", len(of.forms)))}
        t.mark()
        t.line("br label %block")
        t.label("block")
        t.line("%b = phi i64 [0, %linkage], [%bnext, %told]")
        lane = t.new(f"mul i64 %b, {t.lanes}")

        def row(base: str, k: int, rows: int) -> str:
            first = t.new(f"mul i64 {t.new(f'mul i64 %m, {rows}')}, {width}")
            place = t.new(f"add i64 {t.new(f'add i64 {first}, {lane}')}, {t.new(f'mul i64 {width}, {k}')}")
            return t.at(base, place)

        have |= {leaf: t.load(row("%drive", k, len(self.drives))) for k, leaf in enumerate(self.drives)}
        if self.rates:
            names = [(f"u{order}", k) for order in (1, 2) for k in range(inputs)]
            have |= {leaf: t.load(row("%rate", k, 2 * inputs)) for k, leaf in enumerate(names)}
        for k, leaf in enumerate(self.state):
            t.store(t.load(row("%state", k, len(self.state))), slots[leaf])
        t.store(t.constant(1.0), self.strong)
        t.store("zeroinitializer", self.moved)
        bends = []
        for part in of.parts:
            if part.form is None:
                self._newton(part, have, slots)
            else:
                bends.append(self.found(part, have))
        t.line("br label %told")
        t.label("told")
        told = self._told()
        left, *values = self.parted([of.gaps(), *told], have)
        worst = t.summed([t.constant(0.0), *(t.call("fabs", each) for each in (*left, *self.off_circle(have)))])
        unknowns = [have[leaf] for k, turns in enumerate(of.angle) for leaf in _leaves("z", k, turns)]
        many = [
            worst,
            t.load(self.strong),
            t.load(self.moved),
            *bends,
            *unknowns,
            *(each for part in values for each in part),
        ]
        for k, each in enumerate(many):
            t.store(each, row("%out", k, len(many)))
        t.loop("b", "blocks", "block", "linkageend")
        t.label("linkageend")
        t.loop("m", "many", "linkage", "done")
        t.label("done")
        t.line("ret void")
        t.line("}")
        return Layout(self.state, self.drives, len(of.forms), len(many), t.module())

    def _newton(self, part: Part, have: Have, slots: dict[Leaf, str]) -> None:
        t, level = self.text, part.stage.level
        own = {leaf: slot for leaf, slot in slots.items() if leaf[1] in part.unknowns}
        strong = t.load(self.strong)
        t.line(f"br label %from{level}")
        t.label(f"from{level}")
        t.line(f"br label %newton{level}")
        t.label(f"newton{level}")
        t.line(f"%n{level} = phi i64 [0, %from{level}], [%n{level}next, %newton{level}]")
        now = {leaf: t.load(slot) for leaf, slot in own.items()}
        *delta, spanned, lengths = self.values(self.of.step(part.stage), have | now)
        for k, each in zip(part.unknowns, delta, strict=True):
            back = t.new(f"fneg {t.vector} {each}")
            t.store(t.binary("add", t.load(self.moved), t.call("fabs", each)), self.moved)
            if self.of.angle[k]:
                for leaf, value in zip(("zc", "zs"), self.turned_by(now["zc", k], now["zs", k], back), strict=True):
                    t.store(value, own[leaf, k])
            else:
                t.store(t.binary("add", now["z", k], back), own["z", k])
        t.store(t.call("minnum", strong, t.binary("div", spanned, lengths)), self.strong)
        t.loop(f"n{level}", "count", f"newton{level}", f"solved{level}")
        t.label(f"solved{level}")
        have.update({leaf: t.load(slot) for leaf, slot in own.items()})

    def _told(self) -> list[ca.SX]:
        e, s = self.of.equations, self.symbols
        w: list[ca.SX] = []
        for k, coordinate in enumerate(e.coordinates):
            turns = coordinate.of_link and coordinate.part == "angle"
            w += [ca.cos(e.w[k]), ca.sin(e.w[k])] if turns else [e.w[k]]
        whole = ca.vertcat(ca.SX(0, 1), *w)
        if not self.rates:
            return [whole]
        z1, z2 = self.of.rates(s["u1"], s["u2"])
        y, y1, y2 = ca.vertcat(e.z, e.u), ca.vertcat(z1, s["u1"]), ca.vertcat(z2, s["u2"])
        v1, v2 = ca.SX.sym("v1", y.numel()), ca.SX.sym("v2", y.numel())
        moving = ca.jtimes(e.w, y, v1)
        second = ca.jtimes(moving, y, v1) + ca.jtimes(e.w, y, v2)
        return [whole, ca.jtimes(e.w, y, y1), ca.substitute(second, ca.vertcat(v1, v2), ca.vertcat(y1, y2))]


def _leaves(name: str, k: int, turns: bool) -> list[Leaf]:
    return [(name + "c", k), (name + "s", k)] if turns else [(name, k)]


@lru_cache(maxsize=256)
def series(structure: Structure, rates: bool) -> Layout:
    """The function of a structure. Raises NotPrinted where an unknown angle's own value is needed."""
    try:
        return _Series(structure, rates).written()
    except Outside as angle:
        raise NotPrinted(f"an angle counts its turns: {angle.leaf}") from None


def solved(
    structure: Structure,
    p: Array,
    sign: Array,
    near: Array,
    drives: Array,
    rates: Array | None,
    corrections: int = 0,
) -> Series:
    """Positions of linkages, lengths in units of one size. Raises NotPrinted.

    p (linkages, numbers); sign (linkages, groups in closed form); near (linkages, rows, positions): of the unknowns
    that
    Newton's method solves cos and sin of angles, else lengths, as `Layout.state` has them; drives (linkages, rows,
    positions): of what is given cos, sin and value of angles, else values, as `Layout.drives` has them; rates
    (linkages,
    2 inputs, positions): first and then second rates of what is given; None: none are wanted. Positions are a multiple
    of LANES; `corrections`: steps of Newton's method.
    """
    plan = series(structure, rates is not None)
    many, _, positions = drives.shape
    if positions % LANES:
        raise ValueError(f"positions come in multiples of {LANES}")
    out = np.empty((many, plan.out, positions))
    none = np.zeros(0)
    arrays = [np.ascontiguousarray(each) for each in (p, sign, near, drives, none if rates is None else rates)]
    function = compiled(plan.text, NAME, *KINDS)
    function(many, positions // LANES, corrections, *(each.ctypes.data for each in arrays), out.ctypes.data)
    return _read(structure, plan, out, rates is not None)


def _read(structure: Structure, plan: Layout, out: Array, rates: bool) -> Series:
    w = sum(2 if c.of_link and c.part == "angle" else 1 for c in structure.equations.coordinates)
    unknowns, coordinates = sum(2 if turns else 1 for turns in structure.angle), len(structure.equations.coordinates)
    ends = np.cumsum([JUDGED, plan.signs, unknowns, w, *([coordinates] * 2 if rates else [0, 0])])
    judged, bend, found, told, first, second, _ = np.split(out, ends, axis=1)
    return Series(judged[:, 0], judged[:, 1], judged[:, 2], bend, found, told, first, second)
