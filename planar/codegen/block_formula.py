"""A formula that many blocks share, as machine code that walks over slots of memory."""

from __future__ import annotations

from collections import Counter
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import Instruction, InstructionList, required_values
from planar.foundation.turns import leave_turn

LONG_CALL_NUMBERS = 2**14
"""Positions of instances from which on other threads go on while they are computed."""
LANES = 8
"""Numbers that are worked on at once; rows of memory are multiples of so many."""


class FormulaInput(NamedTuple):
    """What a formula takes: ("row", slot, which of its rows), ("p", number), or ("z", unknown, 0 or 1)."""

    source: str
    place: int
    part: int = 0


class BlockFormula:
    """Values by number; `leaves` are the numbers of those that are taken from outside."""

    def __init__(
        self, listing: InstructionList[FormulaInput], wanted: tuple[int, ...], leaves: dict[int, FormulaInput]
    ):
        self.instructions, self.outputs, self.inputs = listing, wanted, leaves
        self.order = required_values(listing, wanted)


def simplify_formula(formula: BlockFormula) -> BlockFormula:
    """The same formula with one division for all that is divided by the same, and none by what does not vary; with
    factors that do not vary put together; without what cancels in sums."""
    return _Simplifier(formula).rebuild()


class _Simplifier:
    """Makes a formula again. `still`: which of the new values do not vary; `terms`: of sums their terms,
    values of the source, with signs."""

    def __init__(self, formula: BlockFormula):
        self.formula, self.source = formula, formula.instructions
        self.result: InstructionList[FormulaInput] = InstructionList()
        self.numbers: dict[int, int] = {}
        self.still: set[int] = set()
        self.terms: dict[int, dict[int, int]] = {}

    def rebuild(self) -> BlockFormula:
        """The new formula."""
        values = [self.source.instructions[k] for k in self.formula.order]
        divided = Counter(value.operands[1] for value in values if value.operation == "div")
        for k, value in zip(self.formula.order, values, strict=True):
            of = [self.numbers[each] for each in value.operands]
            if value.operation == "div":
                own = self._quotient(of[0], of[1], divided[value.operands[1]] > 1)
            elif value.operation == "mul":
                own = self._product(of[0], of[1])
            elif value.operation in ("add", "sub", "neg"):
                own = self._sum(k, value, of)
            else:
                own = self.result.add_again(value, of)
            self._note(own)
            self.numbers[k] = own
        inputs = {self.numbers[k]: leaf for k, leaf in self.formula.inputs.items()}
        return BlockFormula(self.result, tuple(self.numbers[k] for k in self.formula.outputs), inputs)

    def _note(self, number: int) -> int:
        value = self.result.instructions[number]
        given = value.key is not None and value.key.source == "p"
        if value.operation == "const" or given or (value.operands and self.still.issuperset(value.operands)):
            self.still.add(number)
        return number

    def _quotient(self, above: int, below: int, is_shared: bool) -> int:
        if above in self.still or not (below in self.still or is_shared):
            return self.result.add("div", above, below)
        return self._product(above, self._note(self.result.add("div", self.result.add_constant(1.0), below)))

    def _product(self, first: int, second: int) -> int:
        if second not in self.still:
            first, second = second, first
        inside = self.result.instructions[first]
        if second in self.still and first not in self.still and inside.operation == "mul":
            varying, factor = inside.operands if inside.operands[1] in self.still else inside.operands[::-1]
            if factor in self.still:
                return self.result.add("mul", varying, self._note(self.result.add("mul", factor, second)))
        return self.result.add("mul", first, second)

    def _sum(self, k: int, value: Instruction[FormulaInput], of: list[int]) -> int:
        parts = [self.terms.get(each, {each: 1}) for each in value.operands]
        signs = {"add": (1, 1), "sub": (1, -1), "neg": (-1,)}[value.operation]
        whole: Counter[int] = Counter()
        for part, sign in zip(parts, signs, strict=True):
            for term, factor in part.items():
                whole[term] += sign * factor
        kept = {term: factor for term, factor in whole.items() if factor}
        self.terms[k] = kept
        if len(kept) == sum(map(len, parts)) or not set(kept.values()) <= {1, -1}:
            return self.result.add_again(value, of)
        total = self.result.add_constant(0.0)
        for term, factor in sorted(kept.items(), key=lambda each: -each[1]):
            total = self.result.add("add" if factor > 0 else "sub", total, self.numbers[term])
        return total


class KernelLayout(NamedTuple):
    """What a printed formula walks over: the slots that it takes and gives, how many numbers it takes, and rows that
    it gives outside the slots.

    `quick`: of the two rows outside, what is left open and how clear it is, the greatest and the
    least alone, beside the greatest second difference of the latter, and the fastest change of rows 2 and 3 of the
    slots that are given (cosines and sines).
    """

    output_rows: tuple[tuple[int, int], ...]
    number_count: int
    slot_count: int
    extra_row_count: int
    extremes_only: bool = False


# long: the text of one function, written from its head to its end
def write_kernel_ir(formula: BlockFormula, layout: KernelLayout) -> str:
    """LLVM IR: for each instance, over all its steps; `gives` are the slot and row of the first wanted values.

    walk(many, vectors, stride, index, p, state, outside): index (many, slots) are the places of slots in state, whose
    rows are `stride` apart; p (many, numbers); outside (many, rows, stride) takes the wanted values that are left.
    """
    t = IRWriter(LANES)
    t.write_line(
        "define void @walk(i64 %many, i64 %vectors, i64 %stride, ptr readonly %index, ptr readonly %p, ptr %state, "
        "ptr %outside) {"
    )
    t.write_label("entry")
    t.write_line("br label %instance")
    t.write_label("instance")
    t.write_line("%i = phi i64 [0, %entry], [%inext, %instanceend]")
    names: dict[int, str] = {}
    first = t.add_instruction(f"mul i64 %i, {layout.number_count}")
    for number, leaf in formula.inputs.items():
        if leaf.source == "p":
            pointer = t.double_pointer("%p", t.add_instruction(f"add i64 {first}, {leaf.place}"))
            names[number] = t.broadcast(t.add_instruction(f"load double, ptr {pointer}"))
    begin = t.add_instruction(f"mul i64 %i, {layout.slot_count}")
    bases = []
    for slot in range(layout.slot_count):
        place = t.add_instruction(f"getelementptr i64, ptr %index, i64 {t.add_instruction(f'add i64 {begin}, {slot}')}")
        bases.append(t.add_instruction(f"load i64, ptr {place}"))

    def based(slot: int, row: int) -> str:
        return t.add_instruction(f"add i64 {bases[slot]}, {t.add_instruction(f'mul i64 %stride, {row}')}")

    taken = {number: based(leaf.place, leaf.part) for number, leaf in formula.inputs.items() if leaf.source == "row"}
    given = [based(slot, row) for slot, row in layout.output_rows]
    out = t.add_instruction(f"mul i64 {t.add_instruction('mul i64 %i, %stride')}, {layout.extra_row_count}")
    if not layout.extremes_only:
        given += [
            t.add_instruction(f"add i64 {out}, {t.add_instruction(f'mul i64 %stride, {row}')}")
            for row in range(layout.extra_row_count)
        ]
    watch = _ExtremesWriter(t, layout) if layout.extremes_only else None
    t.write_line("br label %step")
    t.write_label("step")
    t.write_line("%v = phi i64 [0, %instance], [%vnext, %step]")
    if watch is not None:
        watch.write_start()
    t.write_line(f"%off = mul i64 %v, {LANES}")
    for number, base in taken.items():
        names[number] = t.load(t.double_pointer("%state", t.add_instruction(f"add i64 {base}, %off")))
    known: dict[int, str] = {}
    t.write_values(formula.instructions, formula.order, known, names)
    found = [known[number] for number in formula.outputs]
    for k, (value, base) in enumerate(zip(found, given, strict=watch is None)):
        into = "%state" if k < len(layout.output_rows) else "%outside"
        t.store(value, t.double_pointer(into, t.add_instruction(f"add i64 {base}, %off")))
    if watch is not None:
        watch.write_step(found)
    t.close_loop("v", "vectors", "step", "instanceend")
    t.write_label("instanceend")
    if watch is not None:
        watch.write_end()
    t.close_loop("i", "many", "instance", "done")
    t.write_label("done")
    t.write_line("ret void")
    t.write_line("}")
    return t.module_text()


EXTREME_COUNT = 4
"""What `_Watch` tells: the greatest left open, the least clear, its greatest second difference, the fastest change."""


class _ExtremesWriter:
    """Looks at what a formula gives, step after step, and tells extremes alone."""

    def __init__(self, text: Any, walk: KernelLayout):
        self.t, self.walk = text, walk
        self.turned = [k for k, (_, row) in enumerate(walk.output_rows) if row in (2, 3)]
        self.carried = [f"before{k}" for k in range(len(self.turned) + 2)]

    def write_start(self) -> None:
        """The values that are carried from one vector of steps to the next."""
        v = self.t.vector
        for k in range(EXTREME_COUNT):
            self.t.write_line(
                f"%most{k} = phi {v} [{self.t.constant(_INITIAL_EXTREMES[k])}, %instance], [%more{k}, %step]"
            )
        for name in self.carried:
            self.t.write_line(f"%{name} = phi {v} [zeroinitializer, %instance], [%next{name}, %step]")
        self.t.write_line("%begins = icmp eq i64 %v, 0")

    def _shifted_lanes(self, value: str, before: str, by: int) -> str:
        """The values `by` steps before; in the first vector what lies before it is the first value."""
        t = self.t
        first = ", ".join(f"i32 {max(k - by, 0)}" for k in range(LANES))
        later = ", ".join(f"i32 {LANES + k - by}" for k in range(LANES))
        mask = f"<{LANES} x i32>"
        one = t.add_instruction(f"shufflevector {t.vector} {value}, {t.vector} {value}, {mask} <{first}>")
        two = t.add_instruction(f"shufflevector {t.vector} {before}, {t.vector} {value}, {mask} <{later}>")
        return t.add_instruction(f"select i1 %begins, {t.vector} {one}, {t.vector} {two}")

    def write_step(self, found: list[str]) -> None:
        """One vector of steps: the formula's values."""
        t = self.t
        left, clear = found[-2:]
        fast = "zeroinitializer"
        for name, k in zip(self.carried, self.turned, strict=False):
            change = t.call_intrinsic("fabs", t.binary("sub", found[k], self._shifted_lanes(found[k], f"%{name}", 1)))
            fast = t.call_intrinsic("maxnum", fast, change)
            self._write_carried(name, found[k])
        name = self.carried[-1]
        one, two = (self._shifted_lanes(clear, f"%{name}", by) for by in (1, 2))
        bend = t.call_intrinsic("fabs", t.binary("add", t.binary("sub", clear, t.binary("add", one, one)), two))
        # the first two steps have no second difference
        known = ", ".join(f"i1 {'false' if k < 2 else 'true'}" for k in range(LANES))
        flag = f"<{LANES} x i1>"
        all_ = ", ".join(["i1 true"] * LANES)
        mask = t.add_instruction(f"select i1 %begins, {flag} <{known}>, {flag} <{all_}>")
        bend = t.add_instruction(f"select {flag} {mask}, {t.vector} {bend}, {t.vector} zeroinitializer")
        self._write_carried(name, clear)
        self._write_carried(self.carried[-2], clear)
        # a sum with what is no number is none, and compares with nothing
        values = (left, clear, bend, fast)
        for k, value in enumerate(values):
            how = "ogt" if _INITIAL_EXTREMES[k] <= 0.0 else "olt"
            worse = t.add_instruction(f"fcmp {how} {t.vector} {value}, %most{k}")
            odd = t.add_instruction(f"fcmp uno {t.vector} {value}, {value}")
            either = t.or_flags(worse, odd)
            self.t.write_line(f"%more{k}a = select <{LANES} x i1> {either}, {t.vector} {value}, {t.vector} %most{k}")
            stuck = t.add_instruction(f"fcmp uno {t.vector} %most{k}, %most{k}")
            self.t.write_line(f"%more{k} = select <{LANES} x i1> {stuck}, {t.vector} %most{k}, {t.vector} %more{k}a")

    def _write_carried(self, name: str, value: str) -> None:
        one = ", ".join(f"i32 {k}" for k in range(LANES))
        v = self.t.vector
        self.t.write_line(f"%next{name} = shufflevector {v} {value}, {v} {value}, <{LANES} x i32> <{one}>")

    def write_end(self) -> None:
        """An instance ends: its extremes, lane by lane."""
        t = self.t
        begin = t.add_instruction(f"mul i64 %i, {EXTREME_COUNT * LANES}")
        for k in range(EXTREME_COUNT):
            t.store(f"%more{k}", t.double_pointer("%outside", t.add_instruction(f"add i64 {begin}, {k * LANES}")))


_INITIAL_EXTREMES = (0.0, 1e300, 0.0, 0.0)
"""Where what `_Watch` tells begins."""


@lru_cache(maxsize=4096)
def _compiled_kernel(formula: BlockFormula, layout: KernelLayout) -> Any:
    return compile_function(
        write_kernel_ir(formula, layout), "walk", "int", "int", "int", "array", "array", "array", "array"
    )


def run_kernel(formula: BlockFormula, layout: KernelLayout, state: Array, index: Array, p: Array) -> Array:
    """Run a formula for instances (many,) whose slots are index (many, slots) of state (slots, rows, steps), one after
    the other, so that an instance may take what another has given.

    p (many, numbers). What it gives is written into the slots; what is left (many, rows, steps) is returned, with
    `extremes_only` the extremes (EXTREME_COUNT, many). Steps are a multiple of LANES.
    """
    many, steps = len(index), state.shape[2]
    shape = (EXTREME_COUNT, LANES) if layout.extremes_only else (layout.extra_row_count, steps)
    outside, p = np.empty((many, *shape)), np.ascontiguousarray(p)
    if not many:  # what is printed goes round once at least
        return outside
    places = np.ascontiguousarray(index, dtype=np.int64) * (state.shape[1] * steps)
    addresses = (each.ctypes.data for each in (places, p, state, outside))
    walk = _compiled_kernel(formula, layout)
    with leave_turn(many * steps >= LONG_CALL_NUMBERS):
        walk(many, steps // LANES, steps, *addresses)
    if layout.extremes_only:
        least = outside[:, 1].min(axis=1)
        return np.stack([outside[:, 0].max(axis=1), least, *(outside[:, k].max(axis=1) for k in (2, 3))])
    return outside
