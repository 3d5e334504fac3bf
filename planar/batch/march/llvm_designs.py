"""The run of many designs, lane by lane, as one function of LLVM IR: predicted, solved, judged, told.

What Newton's method solves is predicted by the polynomial through the steps before.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from planar.batch.march.kernel import FASTEST, WEAK, Have, Leaf, Outside, Part, Structure
from planar.batch.march.point_outputs import Points
from planar.codegen.instructions import NotPrinted

ORDER, RING = 6, 8
"""Steps before from which the next is predicted, and for how many there is room: a power of two."""
NAME = "march"
KINDS = (*("int",) * 5, *("array",) * 7, *("float",) * 3, "array", "array")
"""Of the function's arguments: blocks, steps, width of the arrays that are read, how far a row and a step of `out` are
from the next; p, q, state, drives, rates, table, counts; tolerance, astray, scale; out, good."""


class Layout(NamedTuple):
    """What the function takes and gives, row by row, each with an entry for every design.

    state: cos and sin of an angle, or a length, and what else is carried of it; drives: the same of the inputs; out:
    rows that a step gives; table: numbers that a step takes.
    """

    state: tuple[Leaf, ...]
    drives: tuple[Leaf, ...]
    out: int
    table: int
    text: str
    lanes: int


def march(
    structure: Structure, links: Sequence[str], rates: bool, lanes: int, levels: tuple[int, ...] | None = None
) -> Layout:
    """The function for points on these links, none of which is the frame. Raises NotPrinted.

    A step gives x and y of every point, then with `rates` all first and all second rates. With `levels`, of the group
    that places each point, it gives more: x and y of every point in the other assembly of its group (infinite where
    that is
    not in closed form), the state, and how regular the least regular of the groups is that Newton's method solves.
    """
    carried: frozenset[Leaf] = frozenset()
    while True:
        try:
            return _March(structure, tuple(links), rates, lanes, levels, carried).written()
        except Outside as angle:
            if angle.leaf in carried:  # its value is wanted before its own group is solved
                raise NotPrinted(f"a group stands in an angle of a later one: {angle.leaf}") from None
            carried |= {angle.leaf}


class _March(Points):
    def __init__(
        self,
        of: Structure,
        links: tuple[str, ...],
        rates: bool,
        lanes: int,
        levels: tuple[int, ...] | None,
        carried: frozenset[Leaf],
    ):
        super().__init__(of, links, rates, lanes, frozenset({"p", "q", "u1", "u2"}), carried)
        self.levels = levels
        self.others: dict[int, list[str]] = {}
        self.state = tuple(leaf for k, turns in enumerate(of.angle) for leaf in self._leaves("z", k, turns))
        self.drives = tuple(
            leaf for k, turns in enumerate(of.turning) for leaf in (("uc", k), ("us", k), ("u", k))[0 if turns else 2 :]
        )
        self.inputs = len(of.turning)
        self.newtons = [k for part in of.parts if part.form is None for k in part.unknowns]

    def _leaves(self, name: str, k: int, turns: bool) -> list[Leaf]:
        if not turns:
            return [(name, k)]
        return [(name + "c", k), (name + "s", k), *([(name, k)] if self.carries((name, k)) else [])]

    def written(self) -> Layout:
        """The whole function: blocks of designs, in each the steps."""
        t = self.text
        rows = 2 * len(self.links) * (3 if self.rates else 1)
        rows += 0 if self.levels is None else 2 * len(self.links) + len(self.state) + 1
        arrays = ", ".join(
            f"ptr noalias readonly %{name}" for name in ("p", "q", "state", "drive", "rate", "table", "counts")
        )
        t.line(
            f"define void @{NAME}(i64 %blocks, i64 %steps, i64 %width, i64 %row, i64 %time, {arrays}, "
            "double %tolerance, double %astray, double %scale, ptr noalias %out, ptr noalias %good) {"
        )
        t.label("entry")
        self.slots = {leaf: t.slot() for leaf in self.state}
        self.rings = {leaf: t.slot(RING) for leaf in self.state if leaf[1] in self.newtons}
        self.moved = t.slot()
        self.moves = {part.stage.level: t.slot() for part in self.of.parts if part.form is None}
        self.bends = [[t.slot() for _ in range(2)] for _ in self.of.forms]
        self.strong, self.fine, self.good = (t.slot() for _ in range(3))
        self.turns = [t.slot() for _ in range(self.counted().numel())]
        scale = t.spread("%scale")
        t.line("br label %block")
        have, at_start = self._block()
        self._step(have, at_start)
        flags = []
        for part in self.of.parts:
            if part.form is None:
                self._newton(part, have)
            else:
                flags += self._closed(part, have)
        t.line("br label %told")
        t.label("told")
        self._tell(have, flags, scale)
        t.loop("k", "steps", "step", "blockend")
        t.label("blockend")
        t.store(t.load(self.good), t.at("%good", self.lane))
        t.loop("b", "blocks", "block", "done")
        t.label("done")
        t.line("ret void")
        t.line("}")
        return Layout(self.state, self.drives, rows, ORDER + 3 * self.inputs, t.module(), t.lanes)

    def _row(self, base: str, k: int) -> str:
        """Where the entries of a row that is read stand for this block of designs."""
        t = self.text
        return t.at(base, t.new(f"add i64 {t.new(f'mul i64 %width, {k}')}, {self.lane}"))

    def _block(self) -> tuple[Have, Have]:
        """A block of designs begins: its numbers, and the inputs at the start."""
        t, count = self.text, self.inputs
        t.label("block")
        t.line("%b = phi i64 [0, %entry], [%bnext, %blockend]")
        self.lane = t.new(f"mul i64 %b, {t.lanes}")
        have: Have = {("p", k): t.load(self._row("%p", k)) for k in range(self.symbols["p"].numel())}
        have |= {("q", k): t.load(self._row("%q", k)) for k in range(2 * len(self.links))}
        if self.rates:
            have |= {(f"u{1 + k // count}", k % count): t.load(self._row("%rate", k)) for k in range(2 * count)}
        t.mark()
        at_start = {leaf: t.load(self._row("%drive", k)) for k, leaf in enumerate(self.drives)}
        state = {leaf: t.load(self._row("%state", k)) for k, leaf in enumerate(self.state)}
        if self.of.forms:
            sides = self.values([self.of.sides], have | at_start | state)
            for k, side in enumerate(sides):
                have["sign", k] = t.call("copysign", t.constant(1.0), side)
        for leaf, value in state.items():
            t.store(value, self.slots[leaf])
        for slot in [slot for of in self.bends for slot in of]:
            t.store("zeroinitializer", slot)
        for leaf, ring in self.rings.items():
            for k in range(RING - 1):
                t.store("zeroinitializer", t.place(ring, str(k)))
            t.store(state[leaf], t.place(ring, str(RING - 1)))
        t.store(t.constant(1.0), self.fine)
        t.store("zeroinitializer", self.good)
        t.line("br label %step")
        return have, at_start

    def _step(self, have: Have, at_start: Have) -> None:
        """A step begins: where the inputs are."""
        t = self.text
        t.label("step")
        t.line("%k = phi i64 [0, %block], [%knext, %told]")
        begin = t.new(f"mul i64 %k, {ORDER + 3 * self.inputs}")

        def tabled(k: int) -> str:
            return t.spread(t.new(f"load double, ptr {t.at('%table', t.new(f'add i64 {begin}, {k}'))}"))

        self.weights = [tabled(k) for k in range(ORDER)] if self.newtons else []
        for k, turns in enumerate(self.of.turning):
            by, cos, sin = (tabled(ORDER + 3 * k + j) for j in range(3))
            have["u", k] = t.binary("add", at_start["u", k], by)
            if turns:
                have["uc", k], have["us", k] = self.turned(at_start["uc", k], at_start["us", k], cos, sin)
        t.store(t.constant(1.0), self.strong)
        t.store("zeroinitializer", self.moved)
        self.last = [t.new(f"and i64 {t.new(f'sub i64 %k, {j + 1}')}, {RING - 1}") for j in range(ORDER)]

    def _closed(self, part: Part, have: Have) -> list[str]:
        """A group in closed form; flags that say where its two assemblies keep apart.

        Between steps too: the bend does not reach one, by as much as it bends over the last three steps. So it may be
        the step before at which a group had come too near.
        """
        t = self.text
        if self.levels is not None:
            self._other(part, have)
        bend = self.found(part, have)
        for k in part.unknowns:
            if self.carries(("z", k)):
                self._carried(k, have)
        before, earlier = (t.load(slot) for slot in self.bends[self.signs[part.stage.level]])
        change = t.binary("sub", t.binary("add", bend, earlier), t.binary("add", before, before))
        # of all three: the middle of the change may lie a step back, as where a run starts just before a dead point
        most = t.call("maxnum", t.call("maxnum", bend, before), earlier)
        room = t.binary("sub", t.constant(1.0), most)
        for slot, value in zip(self.bends[self.signs[part.stage.level]], (bend, before), strict=True):
            t.store(value, slot)
        change = t.binary("mul", t.call("fabs", change), t.constant(0.5))
        kept = t.where(t.spread_flag("%k", "sgt", 1), change)
        return [t.compared("oge", t.binary("sub", room, kept), t.constant(WEAK**2))]

    def _other(self, part: Part, have: Have) -> None:
        """Where the group places its points in its other assembly."""
        assert self.levels is not None
        level, there = part.stage.level, dict(have)
        there["sign", self.signs[level]] = self.text.new(f"fneg {self.text.vector} {have['sign', self.signs[level]]}")
        self.found(part, there)
        points = [k for k, each in enumerate(self.levels) if each == level]
        places = self.values([self.places(points)], there)
        self.others |= {k: places[2 * n : 2 * n + 2] for n, k in enumerate(points)}

    def _carried(self, k: int, have: Have) -> None:
        """Move an angle's own value on to where its new cos and sin are."""
        t = self.text
        c, s = (t.load(self.slots[leaf, k]) for leaf in ("zc", "zs"))
        cos, sin = self.turned(have["zc", k], have["zs", k], c, t.new(f"fneg {t.vector} {s}"))
        half = t.each("atan", t.binary("div", sin, t.binary("add", t.constant(1.0), cos)))
        have["z", k] = t.binary("add", t.load(self.slots["z", k]), t.binary("add", half, half))
        for leaf in ("zc", "zs", "z"):
            t.store(have[leaf, k], self.slots[leaf, k])

    def _newton(self, part: Part, have: Have) -> None:
        """Newton's method for a group from where it would be if it went on as before, so often as the step says."""
        t, level = self.text, part.stage.level
        own = {leaf: slot for leaf, slot in self.slots.items() if leaf[1] in part.unknowns}
        ahead = {
            leaf: t.summed(
                [
                    t.binary("mul", w, t.load(t.place(self.rings[leaf], at)))
                    for w, at in zip(self.weights, self.last, strict=True)
                ]
            )
            for leaf in own
        }
        for k in part.unknowns:
            if self.of.angle[k]:
                ahead["zc", k], ahead["zs", k] = self.unit(ahead["zc", k], ahead["zs", k])
        for leaf, slot in own.items():
            t.store(ahead[leaf], slot)
        count = t.new(f"load i64, ptr {t.new('getelementptr i64, ptr %counts, i64 %k')}")
        strong, before = t.load(self.strong), t.load(self.moved)
        moved = self.moves[level]
        t.store("zeroinitializer", moved)
        t.line(f"br label %from{level}")
        t.label(f"from{level}")
        t.line(f"br label %newton{level}")
        t.label(f"newton{level}")
        t.line(f"%n{level} = phi i64 [0, %from{level}], [%n{level}next, %newton{level}]")
        now = {leaf: t.load(slot) for leaf, slot in own.items()}
        *delta, spanned, lengths = self.values(self.of.step(part.stage), have | now)
        far = []
        for k, each in zip(part.unknowns, delta, strict=True):
            far.append(t.call("fabs", each))
            back = t.new(f"fneg {t.vector} {each}")
            if ("z", k) in now:
                now["z", k] = t.binary("add", now["z", k], back)
            if self.carries(("z", k)):
                now["zc", k], now["zs", k] = t.each("cos", now["z", k]), t.each("sin", now["z", k])
            elif self.of.angle[k]:
                now["zc", k], now["zs", k] = self.turned_by(now["zc", k], now["zs", k], back)
        for leaf, slot in own.items():
            t.store(now[leaf], slot)
        t.store(t.summed([t.load(moved), *far]), moved)
        t.loop(f"n{level}", count.lstrip("%"), f"newton{level}", f"solved{level}")
        t.label(f"solved{level}")
        have.update({leaf: t.load(slot) for leaf, slot in own.items()})
        t.store(t.call("minnum", strong, self._regular(spanned, lengths, len(part.unknowns))), self.strong)
        t.store(t.binary("add", before, t.load(moved)), self.moved)
        here = t.new(f"and i64 %k, {RING - 1}")
        for leaf in own:
            t.store(have[leaf], t.place(self.rings[leaf], here))

    def _gentle(self, angles: Sequence[str]) -> list[str]:
        """Flags that say of counted angles that they are not far from where they were a step before."""
        t, flags = self.text, []
        for angle, slot in zip(angles, self.turns, strict=True):
            far = t.call("fabs", t.binary("sub", angle, t.load(slot)))
            t.store(angle, slot)
            flags.append(t.either(t.compared("ole", far, t.constant(FASTEST)), t.spread_flag("%k", "sle", 0)))
        return flags

    def _regular(self, spanned: str, lengths: str, count: int) -> str:
        """How regular a slope is, where that is told; else only whether it is enough: not below nothing."""
        t = self.text
        if self.levels is not None:
            return t.binary("div", spanned, lengths)
        least = WEAK**2 if count <= 2 else WEAK**3
        return t.binary("sub", spanned, t.binary("mul", lengths, t.constant(least)))

    def _tell(self, have: Have, flags: list[str], scale: str) -> None:
        """The step ends: its results are written, and judged."""
        t, told = self.text, self.told()
        left, counted, *values = self.parted([self.of.gaps(), self.counted(), *told], have)
        flags = [*flags, *self._gentle(counted)]
        many = [t.binary("mul", scale, each) for of in values for each in of]
        if self.levels is not None:
            nowhere = [t.constant(inf)] * 2
            many += [part for k in range(len(self.links)) for part in self.others.get(k, nowhere)]
            many += [*(have[leaf] for leaf in self.state), t.load(self.strong)]
        for k, each in enumerate(many):
            place = t.new(f"add i64 {t.new('mul i64 %k, %time')}, {t.new(f'mul i64 %row, {k}')}")
            t.stream(each, t.at("%out", t.new(f"add i64 {place}, {self.lane}")))
        # sums, since what is not a number stays so in them, and is not below anything
        worst = t.summed([t.constant(0.0), *(t.call("fabs", each) for each in (*left, *self.off_circle(have)))])
        flags = [*flags, t.compared("ole", worst, t.spread("%tolerance"))]
        if self.newtons:
            least = WEAK**3 if self.levels is not None else 0.0
            flags.append(t.compared("oge", t.load(self.strong), t.constant(least)))
            near = t.compared("ole", t.load(self.moved), t.spread("%astray"))
            flags.append(t.either(near, t.spread_flag("%k", "sle", ORDER)))
        for flag in flags[1:]:
            flags[0] = t.both(flags[0], flag)
        t.store(t.where(flags[0], t.load(self.fine)), self.fine)
        t.store(t.binary("add", t.load(self.good), t.load(self.fine)), self.good)
