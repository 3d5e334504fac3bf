"""Groups that are not in closed form, followed by Newton's method from step to step: by numpy, or as machine code."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import POSE
from planar.batch.mechanisms.solved_block_type import Kind
from planar.codegen.block_formula import Formula, Leaf
from planar.foundation.geometry import GROUND, Frame

Array = np.ndarray

AHEAD = ((), (1,), (2, -1), (3, -3, 1), (4, -6, 4, -1), (5, -10, 10, -5, 1))
"""Weights of the last steps in the next one: the polynomial through them, continued."""
ORDER = 5
CORRECTIONS, FIRST = 2, 10
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
OUTSIDE = 3
"""Rows that are told outside the links' places: what is left open, the square of how regular, how far corrected."""


class Followed(NamedTuple):
    """What is told of groups (groups, steps): left open, the square of how regular, how far from where predicted."""

    left: Array
    regular: Array
    moved: Array


def followed(kind: Kind, state: Array, index: Array, p: Array, start: Array, rates: bool, native: bool) -> Followed:
    """Follow groups (many,) of a kind through all steps, from unknowns start (many, unknowns).

    Their places index (many, slots) in state (slots, rows, steps) are filled; p (many, numbers).
    """
    many, steps = len(index), state.shape[2]
    outside = np.empty((many, OUTSIDE, steps))
    if native:
        places = np.ascontiguousarray(index, dtype=np.int64) * (state.shape[1] * steps)
        table, counts = _table(steps)
        both = np.ascontiguousarray(np.stack([_first(kind, start), _second(kind, start)], axis=2))
        arrays = places, np.ascontiguousarray(p), both, table, counts, state, outside
        _following(kind, rates)(many, steps, steps, *(each.ctypes.data for each in arrays))
    else:
        _by_numpy(kind, state, index, p, start, rates, outside)
    return Followed(outside[:, 0], outside[:, 1], outside[:, 2])


def _first(kind: Kind, z: Array) -> Array:
    return np.where(kind.turning, np.cos(z), z)


def _second(kind: Kind, z: Array) -> Array:
    return np.where(kind.turning, np.sin(z), 0.0)


def _table(steps: int) -> tuple[Array, Array]:
    """Of every step the weights of those before, and how often it is corrected."""
    table, counts = np.zeros((steps, ORDER)), np.full(steps, CORRECTIONS, dtype=np.int64)
    for step in range(steps):
        known = min(max(step - 1, 0), ORDER)
        table[step, :known] = AHEAD[known]
    counts[: ORDER + 2] = FIRST
    return table, counts


def taken(formula: Formula, kind: Kind, rows: Any, p: Array, z: Array) -> dict[Leaf, Array]:
    """What a formula takes: `rows` tells a row of a slot; p (groups, numbers), z (groups, unknowns)."""
    parts = _first(kind, z), _second(kind, z)
    found = {}
    for leaf in formula.leaves.values():
        if leaf.what == "p":
            found[leaf] = p[:, leaf.first]
        elif leaf.what == "z":
            found[leaf] = parts[leaf.second][:, leaf.first]
        else:
            found[leaf] = rows(leaf.first, leaf.second)
    return found


def newton(kind: Kind, rows: Any, p: Array, z: Array, count: int) -> tuple[Array, Array, Array]:
    """So many steps of Newton's method: the unknowns, the square of how regular they are, how far they moved."""
    formula, moved, regular = kind.near.step, np.zeros_like(z), np.ones(len(z))
    for _ in range(count):
        *step, regular = formula.by_numpy(taken(formula, kind, rows, p, z))
        back = np.stack([np.broadcast_to(each, len(z)) for each in step], axis=1)
        z, moved = z - back, moved - back
    return z, np.broadcast_to(regular, len(z)), moved


def _by_numpy(kind: Kind, state: Array, index: Array, p: Array, z: Array, rates: bool, outside: Array) -> None:
    table, counts = _table(state.shape[2])
    inner = index[:, kind.slots - len(kind.inner) :]
    before = [np.zeros_like(z) for _ in range(ORDER)]
    formula = kind.near.moving if rates else kind.near.told
    wide = POSE + 6 if rates else POSE
    for k in range(state.shape[2]):

        def rows(slot: int, row: int, k: int = k) -> Array:
            return state[index[:, slot], row, k]

        ahead: Any = sum(weight * move for weight, move in zip(table[k], before, strict=True))
        z, regular, moved = newton(kind, rows, p, z + ahead, int(counts[k]))
        *told, left = formula.by_numpy(taken(formula, kind, rows, p, z))
        for number, value in enumerate(told):
            state[inner[:, number // wide], number % wide, k] = value
        outside[:, 0, k], outside[:, 1, k] = left, regular
        outside[:, 2, k] = np.sum(np.abs(moved), axis=1)
        before = [ahead + moved, *before[:-1]]


def shown(kind: Kind, frames: list[Frame], rows: Any, p: Array) -> Array:
    """The unknowns (groups, unknowns) of groups whose inner links are shown about these frames.

    `rows` and p as for `taken`. Lengths of slides are read off the frames, in which they are linear.
    """
    given = [
        Frame(*(rows(slot, row) for row in range(POSE)), np.zeros(len(p)))  # angles are asked of no pair here
        for slot in range(len(kind.given))
    ]
    of = dict(zip((*kind.given, *kind.inner), (*given, *frames), strict=True)) | {"frame": GROUND}
    own: dict[tuple[str, str], Array] = {}
    first = 0
    for pair in kind.mechanism.pairs:
        numbers = [p[:, first + k] for k in range(len(pair.measures))]
        first += len(numbers)
        bodies, many = [of[link] for link in pair.bodies], len(pair.coordinates)
        if not many:
            continue
        still = np.array(pair.residual(bodies, numbers, [0.0] * many)[:2])
        for k, (part, _) in enumerate(pair.coordinates):
            unit = [float(j == k) for j in range(many)]
            way = np.array(pair.residual(bodies, numbers, unit)[:2]) - still
            own[pair.name, part] = -np.sum(way * still, axis=0) / np.sum(way * way, axis=0)
    own |= {(name, "angle"): frame.angle for name, frame in zip(kind.inner, frames, strict=True)}
    e = kind.equations
    names = [(e.coordinates[column].owner, e.coordinates[column].part) for column in e.unknowns]
    return np.stack([own[name] for name in names], axis=1)


@lru_cache(maxsize=256)
def _following(kind: Kind, rates: bool) -> Any:
    from planar.codegen.llvm_compile import compiled

    kinds = ("int", "int", "int", *("array",) * 7)
    return compiled(_Printing(kind, rates).written(), "follow", *kinds)


class _Printing:
    """follow(many, steps, stride, index, p, start, table, counts, state, outside), step after step of each group."""

    def __init__(self, kind: Kind, rates: bool):
        from planar.codegen.llvm_ir import Text

        self.t, self.kind = Text(1), kind
        self.near = kind.near
        self.told = self.near.moving if rates else self.near.told
        self.rows = POSE + 6 if rates else POSE
        self.many = len(kind.turning)
        self.used = sorted({leaf for formula in (self.near.step, self.told) for leaf in formula.leaves.values()})

    def written(self) -> str:
        """The text of the function."""
        t = self.t
        arrays = "ptr readonly %index, ptr readonly %p, ptr readonly %start, ptr readonly %table, ptr readonly %counts"
        t.line(f"define void @follow(i64 %many, i64 %steps, i64 %stride, {arrays}, ptr %state, ptr %outside) {{")
        t.label("entry")
        self.z = [[t.slot() for _ in range(2)] for _ in range(self.many)]
        self.before = [[t.slot() for _ in range(ORDER)] for _ in range(self.many)]
        self.moved = [t.slot() for _ in range(self.many)]
        self.strong = t.slot()
        t.line("br label %instance")
        have, bases = self._instance()
        t.line("br label %step")
        t.label("step")
        t.line("%k = phi i64 [0, %instance], [%knext, %solved]")
        for leaf in self.used:
            if leaf.what == "row":
                have[leaf] = t.load(self._at(bases[leaf.first], leaf.second))
        aheads = self._ahead()
        t.line(f"%count = load i64, ptr {t.new('getelementptr i64, ptr %counts, i64 %k')}")
        t.line("br label %newton")
        t.label("newton")
        t.line("%n = phi i64 [0, %step], [%nnext, %newton]")
        *back, strength = self._values(self.near.step, have)
        for k, each in enumerate(back):
            forth = t.new(f"fneg {t.vector} {each}")
            self._move(k, forth)
            t.store(t.binary("add", t.load(self.moved[k]), forth), self.moved[k])
        t.store(strength, self.strong)
        t.loop("n", "count", "newton", "solved")
        t.label("solved")
        self._tell(have, bases, aheads)
        t.loop("k", "steps", "step", "instanceend")
        t.label("instanceend")
        t.loop("i", "many", "instance", "done")
        t.label("done")
        t.line("ret void")
        t.line("}")
        return t.module()

    def _instance(self) -> tuple[dict[Leaf, str], list[str]]:
        """A group begins: its numbers, and where its places are."""
        t, kind, have = self.t, self.kind, {}
        t.label("instance")
        t.line("%i = phi i64 [0, %entry], [%inext, %instanceend]")
        begin = t.new(f"mul i64 %i, {len(kind.measures) + 2 * len(kind.angles)}")
        for leaf in self.used:
            if leaf.what == "p":
                have[leaf] = self._read("%p", t.new(f"add i64 {begin}, {leaf.first}"))
        begin = t.new(f"mul i64 %i, {kind.slots}")
        bases = []
        for slot in range(kind.slots):
            place = t.new(f"getelementptr i64, ptr %index, i64 {t.new(f'add i64 {begin}, {slot}')}")
            bases.append(t.new(f"load i64, ptr {place}"))
        begin = t.new(f"mul i64 %i, {2 * self.many}")
        for k, both in enumerate(self.z):
            for part, slot in enumerate(both):
                t.store(self._read("%start", t.new(f"add i64 {begin}, {2 * k + part}")), slot)
        for slot in (each for own in self.before for each in own):
            t.store("zeroinitializer", slot)
        self.out = t.new(f"mul i64 {t.new('mul i64 %i, %stride')}, {OUTSIDE}")
        return have, bases

    def _at(self, base: str, row: int) -> str:
        t = self.t
        return t.at("%state", t.new(f"add i64 {t.new(f'add i64 {base}, %k')}, {t.new(f'mul i64 %stride, {row}')}"))

    def _tell(self, have: dict[Leaf, str], bases: list[str], aheads: list[str]) -> None:
        """The step ends: its results are written, and what it moved is remembered."""
        t, kind = self.t, self.kind
        *told, left = self._values(self.told, have)
        first = kind.slots - len(kind.inner)
        for number, value in enumerate(told):
            t.store(value, self._at(bases[first + number // self.rows], number % self.rows))
        far = t.summed([t.constant(0.0), *(t.call("fabs", t.load(slot)) for slot in self.moved)])
        for row, value in enumerate((left, t.load(self.strong), far)):
            place = t.new(f"add i64 {t.new(f'add i64 {self.out}, %k')}, {t.new(f'mul i64 %stride, {row}')}")
            t.store(value, t.at("%outside", place))
        for own, ahead, moved in zip(self.before, aheads, self.moved, strict=True):
            whole = t.binary("add", ahead, t.load(moved))
            for later, earlier in zip(reversed(own[1:]), reversed(own[:-1]), strict=True):
                t.store(t.load(earlier), later)
            t.store(whole, own[0])

    def _read(self, base: str, place: str) -> str:
        return self.t.spread(self.t.new(f"load double, ptr {self.t.at(base, place)}"))

    def _ahead(self) -> list[str]:
        """Move the unknowns to where they would be if they went on as before."""
        t = self.t
        begin = t.new(f"mul i64 %k, {ORDER}")
        weights = [self._read("%table", t.new(f"add i64 {begin}, {k}")) for k in range(ORDER)]
        aheads = []
        for k, own in enumerate(self.before):
            ahead = t.summed([t.binary("mul", w, t.load(slot)) for w, slot in zip(weights, own, strict=True)])
            self._move(k, ahead)
            t.store("zeroinitializer", self.moved[k])
            aheads.append(ahead)
        return aheads

    def _move(self, k: int, by: str) -> None:
        """Move an unknown on: a length by so much, an angle by the rational rotation."""
        t, (one, two) = self.t, self.z[k]
        if not self.kind.turning[k]:
            t.store(t.binary("add", t.load(one), by), one)
            return
        half = t.binary("mul", by, t.constant(0.5))
        square = t.binary("mul", half, half)
        scale = t.binary("div", t.constant(1.0), t.binary("add", t.constant(1.0), square))
        cos = t.binary("mul", t.binary("sub", t.constant(1.0), square), scale)
        sin = t.binary("mul", by, scale)
        c, s = t.load(one), t.load(two)
        c, s = (
            t.binary("sub", t.binary("mul", c, cos), t.binary("mul", s, sin)),
            t.binary("add", t.binary("mul", s, cos), t.binary("mul", c, sin)),
        )
        # back onto the circle, which rounding leaves
        size = t.binary("add", t.binary("mul", c, c), t.binary("mul", s, s))
        whole = t.binary("sub", t.constant(1.5), t.binary("mul", t.constant(0.5), size))
        t.store(t.binary("mul", c, whole), one)
        t.store(t.binary("mul", s, whole), two)

    def _values(self, formula: Formula, have: dict[Leaf, str]) -> list[str]:
        t = self.t
        given = {}
        for number, leaf in formula.leaves.items():
            given[number] = t.load(self.z[leaf.first][leaf.second]) if leaf.what == "z" else have[leaf]
        known: dict[int, str] = {}
        t.put(formula.listing, formula.order, known, given)
        return [known[number] for number in formula.wanted]
