"""One linkage at many positions of its inputs, these in the lanes, as one function of LLVM IR.

Only where every group is in closed form: then nothing goes from one position to the next but the signs of the groups.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.kernel import FASTEST, WEAK, Have, Leaf, Outside, Structure
from planar.batch.march.point_outputs import Points
from planar.codegen.instructions import NotPrinted
from planar.codegen.llvm_compile import compiled
from planar.codegen.llvm_ir import Text

Array = np.ndarray

LANES = 16
NAME = "turn"
KINDS = ("int", "int", "array", "array", "float", "float", "array", "array")
"""Of the function's arguments: blocks of positions, how many positions; numbers, drives; tolerance, scale; out,
fine."""


class Layout(NamedTuple):
    """numbers: what is the same at every position, one after the other; drives: rows of cos, sin and value of what is
    given; out: rows that are told, of which the last are counted angles and the groups' bends."""

    numbers: tuple[Leaf, ...]
    drives: tuple[Leaf, ...]
    out: int
    text: str


class _Turn(Points):
    def __init__(self, of: Structure, links: tuple[str, ...], rates: bool):
        super().__init__(of, links, rates, LANES, frozenset({"p", "q", "u1", "u2", "sign"}), frozenset())
        if any(part.form is None for part in of.parts):
            raise NotPrinted("a group is not in closed form")
        sizes = {name: self.symbols[name].numel() for name in ("p", "q", "sign", *(("u1", "u2") if rates else ()))}
        self.numbers = tuple((name, k) for name, size in sizes.items() for k in range(size))
        self.drives = tuple(
            leaf for k, turns in enumerate(of.turning) for leaf in (("uc", k), ("us", k), ("u", k))[0 if turns else 2 :]
        )

    def written(self) -> Layout:
        """The whole function: blocks of positions, then whether the groups keep clear of their dead points."""
        t, of = self.text, self.of
        t.line(
            f"define void @{NAME}(i64 %blocks, i64 %positions, ptr noalias readonly %numbers, "
            "ptr noalias readonly %drive, double %tolerance, double %scale, ptr noalias %out, ptr noalias %fine) {"
        )
        t.label("entry")
        self.fine = t.slot()
        t.store(t.constant(1.0), self.fine)
        self.width = t.new(f"mul i64 %blocks, {t.lanes}")
        scale = t.spread("%scale")
        have: Have = {
            leaf: t.spread(t.new(f"load double, ptr {t.at('%numbers', str(k))}")) for k, leaf in enumerate(self.numbers)
        }
        t.mark()
        t.line("br label %block")
        t.label("block")
        t.line("%b = phi i64 [0, %entry], [%bnext, %block]")
        first = t.new(f"mul i64 %b, {t.lanes}")
        have |= {leaf: t.load(self._row("%drive", k, first)) for k, leaf in enumerate(self.drives)}
        bends = [self.found(part, have) for part in of.parts]
        left, counted, *values = self.parted([of.gaps(), self.counted(), *self.told()], have)
        worst = t.summed([t.constant(0.0), *(t.call("fabs", each) for each in (*left, *self.off_circle(have)))])
        self._judged(t.compared("ole", worst, t.spread("%tolerance")))
        rows = [*(t.binary("mul", scale, each) for part in values for each in part), *counted, *bends]
        for k, each in enumerate(rows):
            t.store(each, self._row("%out", k, first))
        t.loop("b", "blocks", "block", "after")
        t.label("after")
        first_bend = len(rows) - len(bends)
        self._clear(t, range(first_bend - len(counted), first_bend), range(first_bend, len(rows)))
        t.line("ret void")
        t.line("}")
        return Layout(self.numbers, self.drives, len(rows), t.module())

    def _row(self, base: str, k: int, first: str) -> str:
        t = self.text
        return t.at(base, t.new(f"add i64 {t.new(f'mul i64 {self.width}, {k}')}, {first}"))

    def _judged(self, flag: str) -> None:
        t = self.text
        t.store(t.where(flag, t.load(self.fine)), self.fine)

    def _clear(self, t: Text, angles: Sequence[int], bends: Sequence[int]) -> None:
        """Between positions too no bend reaches one, by as much as it bends over three of them; no counted angle goes
        far."""
        if not bends and not angles:
            t.store(t.load(self.fine), "%fine")
            return
        t.line("br label %judge")
        t.label("judge")
        t.line("%j = phi i64 [0, %after], [%jnext, %judge]")
        first = t.new(f"mul i64 %j, {t.lanes}")
        places = t.new(f"insertelement <{t.lanes} x i64> poison, i64 {t.new('sub i64 %positions, 2')}, i64 0")
        for k in angles:
            one, two, three = (t.load(self._row("%out", k, t.new(f"add i64 {first}, {ahead}"))) for ahead in range(3))
            for before, after in ((one, two), (two, three)):
                far = t.call("fabs", t.binary("sub", after, before))
                self._judged(t.either(t.compared("ole", far, t.constant(FASTEST)), t.beyond(first, places)))
        for k in bends:
            one, two, three = (t.load(self._row("%out", k, t.new(f"add i64 {first}, {ahead}"))) for ahead in range(3))
            change = t.binary("sub", t.binary("add", one, three), t.binary("add", two, two))
            kept = t.binary("mul", t.call("fabs", change), t.constant(0.5))
            least = t.call("minnum", t.call("minnum", self._short(one), self._short(two)), self._short(three))
            flag = t.compared("oge", t.binary("sub", least, kept), t.constant(WEAK**2))
            self._judged(t.either(flag, t.beyond(first, places)))
        t.loop("j", "blocks", "judge", "done")
        t.label("done")
        t.store(t.load(self.fine), "%fine")

    def _short(self, bend: str) -> str:
        return self.text.binary("sub", self.text.constant(1.0), bend)


@lru_cache(maxsize=256)
def turn(structure: Structure, links: tuple[str, ...], rates: bool) -> Layout:
    """The function of a structure for points on these links, none of which is the frame. Raises NotPrinted."""
    try:
        return _Turn(structure, links, rates).written()
    except Outside as angle:
        raise NotPrinted(f"an angle counts its turns: {angle.leaf}") from None


class Turn:
    """A function ready to be called, always at the same positions u (positions, inputs) of the inputs, three at least.

    Raises NotPrinted.
    """

    def __init__(self, structure: Structure, links: tuple[str, ...], rates: bool, u: Array):
        self.plan = turn(structure, links, rates)
        self.function: Any = compiled(self.plan.text, NAME, *KINDS)
        self.positions, self.rows = len(u), self.plan.out
        if self.positions < 3:
            raise NotPrinted("two positions do not show what lies between them")
        self.blocks = -(-self.positions // LANES)
        # those that do not fill the lanes are the last again
        whole = np.concatenate([u, np.repeat(u[-1:], self.blocks * LANES - len(u), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self.drives = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in self.plan.drives])
        self.fine = np.zeros(LANES)
        self._drives, self._fine = self.drives.ctypes.data, self.fine.ctypes.data

    def numbers(self, **rows: Array) -> Array:
        """The numbers of a linkage: p, q, sign, u1, u2, each a row."""
        return np.array([rows[name][k] for name, k in self.plan.numbers])

    def __call__(self, numbers: Array, tolerance: float, scale: float) -> tuple[Array, bool]:
        """x and y of every point, then with rates their first and second rates, (rows, positions), times `scale`; and
        whether all passed both parts of the gate."""
        width = self.blocks * LANES
        # two more positions than there are may be looked at
        out = np.empty(self.rows * width + 2)
        self.function(
            self.blocks,
            self.positions,
            numbers.ctypes.data,
            self._drives,
            tolerance,
            scale,
            out.ctypes.data,
            self._fine,
        )
        return out[:-2].reshape(self.rows, width)[:, : self.positions], bool(self.fine.min() == 1.0)
