"""Machine code that walks over a tape: blocks of several formulas, one after the other, over all steps of each."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.block_formula import BlockFormula
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.arrays import Array, IntArray
from planar.foundation.turns import leave_turn

LANES = 8
"""Steps that are worked on at once; rows of numbers are multiples of so many."""
GOOD, DEAD_POINT, UNDECIDED = range(3)
"""Outcomes of a sequence: good to the end, until a dead point, until a step that is not sure."""
SHIFT = LANES.bit_length() - 1
"""By how many bits a number of steps is one of vectors."""
_NAN = f"splat (double 0x{0x7FF8000000000000:X})"


class TapeFormula(NamedTuple):
    """A formula of a tape: what it gives are so many rows of a point, then, where it is checked, the cosines and
    sines of so many links, which may not turn fast, what is left open, and how clear of a dead point it is."""

    formula: BlockFormula
    row_count: int
    direction_count: int = 0

    @property
    def is_checked(self) -> bool:
        """Whether it tells more than rows."""
        return len(self.formula.outputs) > self.row_count


def padded_steps(steps: int) -> int:
    """How many numbers a row of so many steps has: whole vectors."""
    return LANES * -(-steps // LANES)


class Tape(NamedTuple):
    """Sequences of blocks: where each sequence begins in the blocks, first (sequences + 1,); of every block the number
    of its formula in `kinds` (blocks,), the rows that it takes and, last, those that it gives, `slots` (blocks, slots),
    numbers p (blocks, numbers), each block after those that it needs; by how much constraints may be open, tolerance
    (sequences,), and how clear of a dead point steps are at least, clearance (sequences,)."""

    first: Array
    kinds: Array
    slots: Array
    p: Array
    tolerance: Array
    clearance: Array


class TapeResult(NamedTuple):
    """Of every sequence how many of its first steps are good in all its blocks, the outcome after these, and at which
    block (sequences,)."""

    good: Array
    outcome: Array
    at: Array


@lru_cache(maxsize=16)
def compile_tape(formulas: tuple[TapeFormula, ...], least_cosine: float) -> Any:
    """walk(begin, end, steps, stride, slots, numbers, first, kinds, rows, p, tolerance, clearance, flags, good,
    outcome, at).

    For every sequence from `begin` to `end`: `first` (sequences + 1,) are where its blocks begin; kinds (blocks,) which
    formula each is of; rows (blocks, slots) the addresses of the rows that it takes, and last of those that it gives,
    `stride` numbers apart; p (blocks, numbers); tolerance (sequences,) of what is left open, clearance (sequences,)
    that steps have at least. `least_cosine` is that of the angle by which a link turns in a step. Told are `good`
    (sequences,), how many of its steps are good in all blocks, the `outcome` after these, and `at` which block
    that is: see `TapeResult`. `flags`: two bytes for every vector of steps.
    """
    text = _TapeWriter(formulas, least_cosine).write()
    return compile_function(text, "walk", *("int",) * 6, *("array",) * 10)


class _TapeWriter:
    """Writes the function of `compile_tape`."""

    def __init__(self, formulas: tuple[TapeFormula, ...], least_cosine: float):
        self.ir, self.formulas, self.least_cosine = IRWriter(LANES), formulas, least_cosine
        self.tolerance = self.clearance = ""

    def write(self) -> str:
        """The text of the function."""
        t = self.ir
        integers = ", ".join(f"i64 %{name}" for name in ("begin", "end", "steps", "stride", "slots", "numbers"))
        given = ", ".join(f"ptr readonly %{name}" for name in ("first", "kinds", "rows", "p", "tolerance", "clearance"))
        told = ", ".join(f"ptr %{name}" for name in ("flags", "good", "outcome", "at"))
        t.write_line(f"define void @walk({integers}, {given}, {told}) {{")
        t.write_label("entry")
        t.write_line(f"%bytes = lshr i64 %stride, {SHIFT}")
        t.write_line("%deadflags = getelementptr i8, ptr %flags, i64 %bytes")
        t.write_line("%any = icmp slt i64 %begin, %end")
        t.write_line("br i1 %any, label %sequence, label %done")
        t.write_label("sequence")
        t.write_line("%i = phi i64 [%begin, %entry], [%inext, %sequenceend]")
        t.write_line(f"%jbegin = load i64, ptr {self.integer_pointer('%first', '%i')}")
        t.write_line("%inext = add i64 %i, 1")
        t.write_line(f"%jend = load i64, ptr {self.integer_pointer('%first', '%inext')}")
        self.tolerance, self.clearance = (
            t.broadcast(t.add_instruction(f"load double, ptr {t.double_pointer(array, '%i')}"))
            for array in ("%tolerance", "%clearance")
        )
        t.write_line("br label %block")
        self.write_blocks()
        t.write_label("sequenceend")
        for name, value in (("good", "limitnext"), ("outcome", "outcomenext"), ("at", "atnext")):
            t.write_line(f"store i64 %{value}, ptr {self.integer_pointer(f'%{name}', '%i')}")
        t.write_line("%imore = icmp slt i64 %inext, %end")
        t.write_line("br i1 %imore, label %sequence, label %done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        t.write_line(f"declare i{LANES} @llvm.cttz.i{LANES}(i{LANES}, i1)")
        return t.module_text()

    def integer_pointer(self, base: str, index: str) -> str:
        """A pointer to the whole number at an index."""
        return self.ir.add_instruction(f"getelementptr i64, ptr {base}, i64 {index}")

    def write_blocks(self) -> None:
        """The loop over the blocks of a sequence: each by its own formula."""
        t, kinds = self.ir, range(len(self.formulas))
        t.write_label("block")
        t.write_line("%j = phi i64 [%jbegin, %sequence], [%jnext, %blockend]")
        t.write_line("%limit = phi i64 [%steps, %sequence], [%limitnext, %blockend]")
        t.write_line("%outcomenow = phi i64 [0, %sequence], [%outcomenext, %blockend]")
        t.write_line("%atnow = phi i64 [0, %sequence], [%atnext, %blockend]")
        t.write_line(f"%rounded = add i64 %limit, {LANES - 1}")
        t.write_line(f"%vectors = lshr i64 %rounded, {SHIFT}")
        t.write_line(f"%kind = load i64, ptr {self.integer_pointer('%kinds', '%j')}")
        t.write_line("%pfrom = mul i64 %j, %numbers")
        t.write_line("%rowsfrom = mul i64 %j, %slots")
        cases = " ".join(f"i64 {k}, label %kind{k}" for k in kinds[1:])
        t.write_line(f"switch i64 %kind, label %kind0 [{cases}]")
        ends = []
        for k in kinds:
            self.write_formula(k)
            ends.append(f"kind{k}good")
            if self.formulas[k].is_checked:
                self.write_search(k)
                ends += [f"kind{k}stopped"]
        t.write_label("blockend")
        for name, now, stop in (("limit", "limit", "come"), ("outcome", "outcomenow", "verdict"), ("at", "atnow", "")):
            values = []
            for end in ends:
                stopped = end.endswith("stopped")
                own = f"%{stop}{end[4:-7]}" if stop else "%j"
                values.append(f"[{own if stopped else '%' + now}, %{end}]")
            t.write_line(f"%{name}next = phi i64 {', '.join(values)}")
        t.write_line("%jnext = add i64 %j, 1")
        t.write_line("%jmore = icmp slt i64 %jnext, %jend")
        t.write_line("br i1 %jmore, label %block, label %sequenceend")

    def write_formula(self, kind: int) -> None:
        """All steps of a block, by its formula."""
        t, own = self.ir, self.formulas[kind]
        t.write_label(f"kind{kind}")
        names: dict[int, str] = {}
        pointers: dict[int, str] = {}
        slots: dict[int, str] = {}

        def slot_pointer(slot: int | str) -> str:
            place = t.add_instruction(f"add i64 %rowsfrom, {slot}")
            pointer = t.add_instruction(f"getelementptr ptr, ptr %rows, i64 {place}")
            return t.add_instruction(f"load ptr, ptr {pointer}")

        for number, leaf in own.formula.inputs.items():
            if leaf.source == "p":
                place = t.add_instruction(f"add i64 %pfrom, {leaf.place}")
                names[number] = t.broadcast(t.add_instruction(f"load double, ptr {t.double_pointer('%p', place)}"))
            else:
                if leaf.place not in slots:
                    slots[leaf.place] = slot_pointer(leaf.place)
                begin = t.add_instruction(f"mul i64 %stride, {leaf.part}")
                pointers[number] = t.double_pointer(slots[leaf.place], begin)
        into = slot_pointer(t.add_instruction("sub i64 %slots, 1"))
        given = [t.double_pointer(into, t.add_instruction(f"mul i64 %stride, {row}")) for row in range(own.row_count)]
        t.write_line(f"br label %kind{kind}step")
        t.write_label(f"kind{kind}step")
        v = f"vector{kind}"
        t.write_line(f"%{v} = phi i64 [0, %kind{kind}], [%{v}next, %kind{kind}step]")
        watched = [f"%watched{kind}.{k}" for k in range(2 * own.direction_count + 1 if own.is_checked else 0)]
        for each in watched:
            t.write_line(f"{each} = phi {t.vector} [{_NAN}, %kind{kind}], [{each}next, %kind{kind}step]")
        if own.is_checked:
            t.write_line(f"%all{kind} = phi i{LANES} [-1, %kind{kind}], [%allnext{kind}, %kind{kind}step]")
        t.write_line(f"%off{kind} = mul i64 %{v}, {LANES}")
        for number, pointer in pointers.items():
            names[number] = t.load(t.double_pointer(pointer, f"%off{kind}"))
        known: dict[int, str] = {}
        t.write_values(own.formula.instructions, own.formula.order, known, names)
        found = [known[number] for number in own.formula.outputs]
        for value, pointer in zip(found, given, strict=not own.is_checked):
            t.store(value, t.double_pointer(pointer, f"%off{kind}"))
        if own.is_checked:
            self.write_check(kind, watched, found[own.row_count :])
        t.close_loop(v, "vectors", f"kind{kind}step", f"kind{kind}{'told' if own.is_checked else 'good'}")
        if not own.is_checked:
            t.write_label(f"kind{kind}good")
            t.write_line("br label %blockend")

    def write_check(self, kind: int, watched: list[str], found: list[str]) -> None:
        """Look at a vector of steps: directions, what is left open and how clear it is, as before in `watched`."""
        t, flags, byte = self.ir, f"<{LANES} x i1>", f"i{LANES}"
        *directions, left, clear = found
        cosines = []
        for k in range(0, len(directions), 2):
            now = directions[k : k + 2]
            then = [self.earlier(value, before, 1) for value, before in zip(now, watched[k:], strict=False)]
            cosines.append(t.add_all([t.binary("mul", a, b) for a, b in zip(now, then, strict=True)]))
        clear = self.write_merged(left, clear, cosines)
        for value, before in zip((*directions, clear), watched, strict=True):
            # a value of its own name, for the next vector
            t.write_line(f"{before}next = select i1 true, {t.vector} {value}, {t.vector} {value}")
        fine, dead = self.write_flags(clear, watched[-1])
        bits = [t.add_instruction(f"bitcast {flags} {each} to {byte}") for each in (fine, dead)]
        for pointer, value in zip(("%flags", "%deadflags"), bits, strict=True):
            place = t.add_instruction(f"getelementptr i8, ptr {pointer}, i64 %vector{kind}")
            t.write_line(f"store {byte} {value}, ptr {place}")
        t.write_line(f"%allnext{kind} = and {byte} %all{kind}, {bits[0]}")

    def earlier(self, value: str, before: str, by: int) -> str:
        """The values so many steps before those of a vector; `before` is the vector before it."""
        v, lanes = self.ir.vector, ", ".join(f"i32 {LANES + k - by}" for k in range(LANES))
        return self.ir.add_instruction(f"shufflevector {v} {before}, {v} {value}, <{LANES} x i32> <{lanes}>")

    def pick(self, how: str, a: str, b: str) -> str:
        """One value where it compares so with another, else the other."""
        t = self.ir
        flag = t.compare(how, a, b)
        return t.add_instruction(f"select <{LANES} x i1> {flag}, {t.vector} {a}, {t.vector} {b}")

    def write_merged(self, left: str, clear: str, cosines: list[str]) -> str:
        """How clear a step is where it is closed, and nothing has turned too fast; else no number, but for what is
        below zero."""
        t = self.ir
        good = t.compare("ole", left, self.tolerance)
        for cosine in cosines:
            # where a step is no position nothing turns
            good = t.and_flags(good, t.compare("uge", cosine, t.constant(self.least_cosine)))
        told = t.or_flags(good, t.compare("olt", clear, t.constant(0.0)))
        return t.add_instruction(f"select <{LANES} x i1> {told}, {t.vector} {clear}, {t.vector} {_NAN}")

    def write_flags(self, clear: str, before: str) -> tuple[str, str]:
        """Whether all is good up to each step of a vector, and whether there is a dead point just before it. Between
        steps what is clear bends by less than its second differences say."""
        t = self.ir
        one, two = (self.earlier(clear, before, by) for by in (1, 2))
        bend = t.call_intrinsic("fabs", t.binary("sub", t.binary("sub", clear, one), t.binary("sub", one, two)))
        # at the first steps some of these are no numbers, which is passed over
        needed = self.pick("ogt", bend, self.clearance)
        least = self.pick("olt", two, one)
        fine = t.compare("ogt", self.pick("olt", least, clear), needed)
        dead = t.and_flags(t.compare("olt", clear, t.constant(0.0)), t.compare("ogt", least, needed))
        return fine, dead

    def write_search(self, kind: int) -> None:
        """The first interval that is not good, and why."""
        t, name, byte, w = self.ir, f"kind{kind}", f"i{LANES}", f"searched{kind}"
        t.write_label(f"{name}told")
        t.write_line(f"%good{kind} = icmp eq {byte} %allnext{kind}, -1")
        t.write_line(f"br i1 %good{kind}, label %{name}good, label %{name}find")
        t.write_label(f"{name}good")
        t.write_line("br label %blockend")
        t.write_label(f"{name}find")
        t.write_line(f"%{w} = phi i64 [0, %{name}told], [%{w}next, %{name}find]")
        place = t.add_instruction(f"getelementptr i8, ptr %flags, i64 %{w}")
        t.write_line(f"%bits{kind} = load {byte}, ptr {place}")
        t.write_line(f"%{w}next = add i64 %{w}, 1")
        t.write_line(f"%{w}more = icmp eq {byte} %bits{kind}, -1")
        t.write_line(f"br i1 %{w}more, label %{name}find, label %{name}found")
        t.write_label(f"{name}found")
        bad = t.add_instruction(f"xor {byte} %bits{kind}, -1")
        lane = t.add_instruction(f"call {byte} @llvm.cttz.{byte}({byte} {bad}, i1 true)")
        wide = t.add_instruction(f"zext {byte} {lane} to i64")
        after = t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 %{w}, {LANES}')}, {wide}")
        t.write_line(f"%come{kind} = add i64 {after}, 0")
        place = t.add_instruction(f"getelementptr i8, ptr %deadflags, i64 %{w}")
        dead = t.add_instruction(f"lshr {byte} {t.add_instruction(f'load {byte}, ptr {place}')}, {lane}")
        dead = t.add_instruction(f"trunc {byte} {dead} to i1")
        t.write_line(f"%verdict{kind} = select i1 {dead}, i64 {DEAD_POINT}, i64 {UNDECIDED}")
        t.write_line(f"%ends{kind} = icmp slt i64 %come{kind}, %limit")
        t.write_line(f"br i1 %ends{kind}, label %{name}stopped, label %{name}good")
        t.write_label(f"{name}stopped")
        t.write_line("br label %blockend")


def run_tape(formulas: tuple[TapeFormula, ...], least_cosine: float, steps: int, tape: Tape) -> TapeResult:
    """Walk over a whole tape, whose slots are addresses; see `compile_tape`."""
    stride, many = padded_steps(steps), len(tape.tolerance)
    result = TapeResult(*np.empty((3, many), dtype=np.int64))
    flags = np.empty(2 * stride // LANES, dtype=np.int8)
    slots, p = tape.slots, tape.p
    given = (tape.first, tape.kinds, slots, p, tape.tolerance, tape.clearance)
    arrays = [*(np.ascontiguousarray(each) for each in given), flags, *result]
    addresses = [each.ctypes.data for each in arrays]
    walk = compile_tape(formulas, least_cosine)
    with leave_turn():
        walk(0, many, steps, stride, slots.shape[1], p.shape[1], *addresses)
    return result


def clear_rows(addresses: IntArray, first: IntArray, count: int) -> None:
    """Rows of so many numbers, a multiple of LANES, at addresses (rows,): NaN from the number first (rows,) on."""
    if len(addresses):
        held = [np.ascontiguousarray(each, dtype=np.int64) for each in (addresses, first)]
        _compiled_clearing()(len(addresses), count, *(each.ctypes.data for each in held))


@lru_cache(maxsize=1)
def _compiled_clearing() -> Any:
    """clear(many, count, rows, first)."""
    t = IRWriter(LANES)
    t.write_line("define void @clear(i64 %many, i64 %count, ptr readonly %rows, ptr readonly %first) {")
    t.write_label("entry")
    t.write_line(f"%vectors = lshr i64 %count, {LANES.bit_length() - 1}")
    t.write_line("br label %row")
    t.write_label("row")
    t.write_line("%i = phi i64 [0, %entry], [%inext, %rowend]")
    t.write_line(f"%at = load ptr, ptr {t.add_instruction('getelementptr ptr, ptr %rows, i64 %i')}")
    t.write_line(f"%from = load i64, ptr {t.add_instruction('getelementptr i64, ptr %first, i64 %i')}")
    t.write_line(f"%begin = lshr i64 %from, {LANES.bit_length() - 1}")
    last = t.add_instruction(f"insertelement <{LANES} x i64> poison, i64 %from, i64 0")
    t.write_line("%some = icmp slt i64 %begin, %vectors")
    t.write_line("br i1 %some, label %vector, label %rowend")
    t.write_label("vector")
    t.write_line("%v = phi i64 [%begin, %row], [%vnext, %vector]")
    place = t.add_instruction(f"mul i64 %v, {LANES}")
    pointer = t.double_pointer("%at", place)
    flag, nan = t.lanes_from(place, last), t.constant(float("nan"))
    own = t.load(pointer)
    t.store(t.add_instruction(f"select <{LANES} x i1> {flag}, {t.vector} {nan}, {t.vector} {own}"), pointer)
    t.close_loop("v", "vectors", "vector", "rowend")
    t.write_label("rowend")
    t.close_loop("i", "many", "row", "done")
    t.write_label("done")
    t.write_line("ret void")
    t.write_line("}")
    return compile_function(t.module_text(), "clear", "int", "int", "array", "array")
