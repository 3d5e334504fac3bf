"""A formula that many groups share: run by numpy, or printed as machine code that walks over slots of memory."""

from __future__ import annotations

import operator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.instructions import Listing, needed

Array = np.ndarray

LANES = 8
"""Numbers that are worked on at once; rows of memory are multiples of so many."""
DONE = {
    "add": operator.add,
    "sub": operator.sub,
    "mul": operator.mul,
    "div": operator.truediv,
    "neg": operator.neg,
    "abs": np.abs,
    "sqrt": np.sqrt,
    "cos": np.cos,
    "sin": np.sin,
    "minnum": np.fmin,
    "maxnum": np.fmax,
}


class Leaf(NamedTuple):
    """What a formula takes: ("row", slot, which of its rows), ("p", number), or ("z", unknown, 0 or 1)."""

    what: str
    first: int
    second: int = 0


class Formula:
    """Values by number; `leaves` are the numbers of those that are taken from outside."""

    def __init__(self, listing: Listing, wanted: tuple[int, ...], leaves: dict[int, Leaf]):
        self.listing, self.wanted, self.leaves = listing, wanted, leaves
        self.order = needed(listing, wanted)

    def by_numpy(self, taken: dict[Leaf, Any]) -> list[Any]:
        """The wanted values where the leaves are arrays, or numbers."""
        values, listing = {}, self.listing.values
        with np.errstate(all="ignore"):  # what cannot be assembled is no number, and judged as such
            for number in self.order:
                value = listing[number]
                if value.what == "input":
                    values[number] = taken[self.leaves[number]]
                elif value.what == "const":
                    values[number] = value.data
                else:
                    values[number] = DONE[value.what](*(values[k] for k in value.of))
        return [values[number] for number in self.wanted]


class Walk(NamedTuple):
    """What a printed formula walks over: the slots that it takes and gives, how many numbers it takes, and rows that
    it gives outside the slots.

    `quick`: of the two rows outside, what is left open and how clear it is, machine code tells the greatest and the
    least alone, beside the greatest second difference of the latter, and the fastest change of rows 2 and 3 of the
    slots that are given (cosines and sines).
    """

    gives: tuple[tuple[int, int], ...]
    numbers: int
    slots: int
    outside: int
    quick: bool = False


def printed(formula: Formula, walk: Walk) -> str:
    """LLVM IR: for each instance, over all its steps; `gives` are the slot and row of the first wanted values.

    walk(many, vectors, stride, index, p, state, outside): index (many, slots) are the places of slots in state, whose
    rows are `stride` apart; p (many, numbers); outside (many, rows, stride) takes the wanted values that are left.
    """
    from planar.codegen.llvm_ir import Text

    t = Text(LANES)
    t.line(
        "define void @walk(i64 %many, i64 %vectors, i64 %stride, ptr readonly %index, ptr readonly %p, ptr %state, "
        "ptr %outside) {"
    )
    t.label("entry")
    t.line("br label %instance")
    t.label("instance")
    t.line("%i = phi i64 [0, %entry], [%inext, %instanceend]")
    names: dict[int, str] = {}
    first = t.new(f"mul i64 %i, {walk.numbers}")
    for number, leaf in formula.leaves.items():
        if leaf.what == "p":
            pointer = t.at("%p", t.new(f"add i64 {first}, {leaf.first}"))
            names[number] = t.spread(t.new(f"load double, ptr {pointer}"))
    begin = t.new(f"mul i64 %i, {walk.slots}")
    bases = []
    for slot in range(walk.slots):
        place = t.new(f"getelementptr i64, ptr %index, i64 {t.new(f'add i64 {begin}, {slot}')}")
        bases.append(t.new(f"load i64, ptr {place}"))

    def based(slot: int, row: int) -> str:
        return t.new(f"add i64 {bases[slot]}, {t.new(f'mul i64 %stride, {row}')}")

    taken = {number: based(leaf.first, leaf.second) for number, leaf in formula.leaves.items() if leaf.what == "row"}
    given = [based(slot, row) for slot, row in walk.gives]
    out = t.new(f"mul i64 {t.new('mul i64 %i, %stride')}, {walk.outside}")
    if not walk.quick:
        given += [t.new(f"add i64 {out}, {t.new(f'mul i64 %stride, {row}')}") for row in range(walk.outside)]
    watch = _Watch(t, walk) if walk.quick else None
    t.line("br label %step")
    t.label("step")
    t.line("%v = phi i64 [0, %instance], [%vnext, %step]")
    if watch is not None:
        watch.begin()
    t.line(f"%off = mul i64 %v, {LANES}")
    for number, base in taken.items():
        names[number] = t.load(t.at("%state", t.new(f"add i64 {base}, %off")))
    known: dict[int, str] = {}
    t.put(formula.listing, formula.order, known, names)
    found = [known[number] for number in formula.wanted]
    for k, (value, base) in enumerate(zip(found, given, strict=watch is None)):
        into = "%state" if k < len(walk.gives) else "%outside"
        t.store(value, t.at(into, t.new(f"add i64 {base}, %off")))
    if watch is not None:
        watch.step(found)
    t.loop("v", "vectors", "step", "instanceend")
    t.label("instanceend")
    if watch is not None:
        watch.end()
    t.loop("i", "many", "instance", "done")
    t.label("done")
    t.line("ret void")
    t.line("}")
    return t.module()


WATCHED = 4
"""What `_Watch` tells: the greatest left open, the least clear, its greatest second difference, the fastest change."""


class _Watch:
    """Looks at what a formula gives, step after step, and tells extremes alone."""

    def __init__(self, text: Any, walk: Walk):
        self.t, self.walk = text, walk
        self.turned = [k for k, (_, row) in enumerate(walk.gives) if row in (2, 3)]
        self.carried = [f"before{k}" for k in range(len(self.turned) + 2)]

    def begin(self) -> None:
        """The values that are carried from one vector of steps to the next."""
        v = self.t.vector
        for k in range(WATCHED):
            self.t.line(f"%most{k} = phi {v} [{self.t.constant(_FIRST[k])}, %instance], [%more{k}, %step]")
        for name in self.carried:
            self.t.line(f"%{name} = phi {v} [zeroinitializer, %instance], [%next{name}, %step]")
        self.t.line("%begins = icmp eq i64 %v, 0")

    def _behind(self, value: str, before: str, by: int) -> str:
        """The values `by` steps before; in the first vector what lies before it is the first value."""
        t = self.t
        first = ", ".join(f"i32 {max(k - by, 0)}" for k in range(LANES))
        later = ", ".join(f"i32 {LANES + k - by}" for k in range(LANES))
        mask = f"<{LANES} x i32>"
        one = t.new(f"shufflevector {t.vector} {value}, {t.vector} {value}, {mask} <{first}>")
        two = t.new(f"shufflevector {t.vector} {before}, {t.vector} {value}, {mask} <{later}>")
        return t.new(f"select i1 %begins, {t.vector} {one}, {t.vector} {two}")

    def step(self, found: list[str]) -> None:
        """One vector of steps: the formula's values."""
        t = self.t
        left, clear = found[-2:]
        fast = "zeroinitializer"
        for name, k in zip(self.carried, self.turned, strict=False):
            change = t.call("fabs", t.binary("sub", found[k], self._behind(found[k], f"%{name}", 1)))
            fast = t.call("maxnum", fast, change)
            self._carry(name, found[k])
        name = self.carried[-1]
        one, two = (self._behind(clear, f"%{name}", by) for by in (1, 2))
        bend = t.call("fabs", t.binary("add", t.binary("sub", clear, t.binary("add", one, one)), two))
        # the first two steps have no second difference
        known = ", ".join(f"i1 {'false' if k < 2 else 'true'}" for k in range(LANES))
        flag = f"<{LANES} x i1>"
        all_ = ", ".join(["i1 true"] * LANES)
        mask = t.new(f"select i1 %begins, {flag} <{known}>, {flag} <{all_}>")
        bend = t.new(f"select {flag} {mask}, {t.vector} {bend}, {t.vector} zeroinitializer")
        self._carry(name, clear)
        self._carry(self.carried[-2], clear)
        # a sum with what is no number is none, and compares with nothing
        values = (left, clear, bend, fast)
        for k, value in enumerate(values):
            how = "ogt" if _FIRST[k] <= 0.0 else "olt"
            worse = t.new(f"fcmp {how} {t.vector} {value}, %most{k}")
            odd = t.new(f"fcmp uno {t.vector} {value}, {value}")
            either = t.either(worse, odd)
            self.t.line(f"%more{k}a = select <{LANES} x i1> {either}, {t.vector} {value}, {t.vector} %most{k}")
            stuck = t.new(f"fcmp uno {t.vector} %most{k}, %most{k}")
            self.t.line(f"%more{k} = select <{LANES} x i1> {stuck}, {t.vector} %most{k}, {t.vector} %more{k}a")

    def _carry(self, name: str, value: str) -> None:
        one = ", ".join(f"i32 {k}" for k in range(LANES))
        v = self.t.vector
        self.t.line(f"%next{name} = shufflevector {v} {value}, {v} {value}, <{LANES} x i32> <{one}>")

    def end(self) -> None:
        """An instance ends: its extremes, lane by lane."""
        t = self.t
        begin = t.new(f"mul i64 %i, {WATCHED * LANES}")
        for k in range(WATCHED):
            t.store(f"%more{k}", t.at("%outside", t.new(f"add i64 {begin}, {k * LANES}")))


_FIRST = (0.0, 1e300, 0.0, 0.0)
"""Where what `_Watch` tells begins."""


@lru_cache(maxsize=4096)
def _walking(formula: Formula, walk: Walk) -> Any:
    from planar.codegen.llvm_compile import compiled

    return compiled(printed(formula, walk), "walk", "int", "int", "int", "array", "array", "array", "array")


def walked(formula: Formula, walk: Walk, state: Array, index: Array, p: Array, native: bool) -> Array:
    """Run a formula for instances (many,) whose slots are index (many, slots) of state (slots, rows, steps).

    p (many, numbers). What it gives is written into the slots; what is left (many, rows, steps) is returned. As machine
    code one instance after the other, so that it may take what another has given; steps are then a multiple of LANES.
    """
    many, steps = len(index), state.shape[2]
    shape = (WATCHED, LANES) if walk.quick and native else (walk.outside, steps)
    outside, p = np.empty((many, *shape)), np.ascontiguousarray(p)
    if not many:  # what is printed goes round once at least
        return outside
    if native:
        places = np.ascontiguousarray(index, dtype=np.int64) * (state.shape[1] * steps)
        addresses = (each.ctypes.data for each in (places, p, state, outside))
        _walking(formula, walk)(many, steps // LANES, steps, *addresses)
        if walk.quick:
            least = outside[:, 1].min(axis=1)
            return np.stack([outside[:, 0].max(axis=1), least, *(outside[:, k].max(axis=1) for k in (2, 3))])
        return outside
    taken: dict[Leaf, Any] = {}
    for leaf in formula.leaves.values():
        if leaf.what == "p":
            taken[leaf] = p[:, leaf.first, None]
        else:
            taken[leaf] = state[index[:, leaf.first], leaf.second]
    found = formula.by_numpy(taken)
    for k, value in enumerate(found):
        if k < len(walk.gives):
            slot, row = walk.gives[k]
            state[index[:, slot], row] = value
        else:
            outside[:, k - len(walk.gives)] = value
    return outside
