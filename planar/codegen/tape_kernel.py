"""Machine code that walks over a tape: blocks of several formulas, one after the other, over all steps of each."""

from __future__ import annotations

from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np

from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.tape import LANES, Tape, TapeFormula, TapeResult, padded_steps
from planar.foundation.arrays import Array
from planar.foundation.turns import leave_turn

MARGIN = LANES
"""Numbers before and after a row of what is looked at between steps."""


@lru_cache(maxsize=16)
def compile_tape(formulas: tuple[TapeFormula, ...], greatest_change: float) -> Any:
    """walk(begin, end, steps, stride, slots, numbers, first, kinds, rows, p, tolerance, clearance, scratch, good,
    outcome, at).

    For every sequence from `begin` to `end`: `first` (sequences + 1,) are where its blocks begin; kinds (blocks,) which
    formula each is of; rows (blocks, slots) the addresses of the rows that it takes, and last of those that it gives,
    `stride` numbers apart; p (blocks, numbers); tolerance (sequences,) of what is left open, clearance (sequences,)
    that steps have at least. A cosine or sine may change by `greatest_change` from one step to the next. Told are
    `good` (sequences,), how many of its steps are good in all blocks, the `outcome` after these, and `at` which block
    that is: see `TapeResult`. `scratch`: see `scratch_size`.
    """
    text = _TapeWriter(formulas, greatest_change).write()
    return compile_function(text, "walk", *("int",) * 6, *("array",) * 10)


def scratch_size(formulas: tuple[TapeFormula, ...], stride: int) -> int:
    """Numbers of room for what is looked at between steps."""
    rows = 1 + max(each.direction_count for each in formulas)
    return rows * (stride + 2 * MARGIN) + 2 * (stride // LANES)


class _TapeWriter:
    """Writes the function of `compile_tape`."""

    def __init__(self, formulas: tuple[TapeFormula, ...], greatest_change: float):
        self.ir, self.formulas, self.greatest_change = IRWriter(LANES), formulas, greatest_change
        self.tolerance = self.clearance = ""

    def write(self) -> str:
        """The text of the function."""
        t = self.ir
        integers = ", ".join(f"i64 %{name}" for name in ("begin", "end", "steps", "stride", "slots", "numbers"))
        given = ", ".join(f"ptr readonly %{name}" for name in ("first", "kinds", "rows", "p", "tolerance", "clearance"))
        told = ", ".join(f"ptr %{name}" for name in ("scratch", "good", "outcome", "at"))
        t.write_line(f"define void @walk({integers}, {given}, {told}) {{")
        t.write_label("entry")
        t.write_line(f"%row = add i64 %stride, {2 * MARGIN}")
        rows = 1 + max(each.direction_count for each in self.formulas)
        t.write_line(f"%flagsat = mul i64 %row, {rows}")
        t.write_line("%fineflags = getelementptr double, ptr %scratch, i64 %flagsat")
        t.write_line("%slowflags = getelementptr i8, ptr %fineflags, i64 %stride")
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
        # flags are of so many vectors of the intervals between steps; values of one more
        t.write_line("%rounded = add i64 %limit, 6")
        t.write_line(f"%spans = lshr i64 %rounded, {LANES.bit_length() - 1}")
        t.write_line("%vectors = add i64 %spans, 1")
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
                self.write_check(k)
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

    def scratch_row(self, k: int) -> str:
        """A pointer to the first step of a row of what is looked at between steps."""
        t = self.ir
        begin = t.add_instruction(f"mul i64 %row, {k}")
        return t.double_pointer("%scratch", t.add_instruction(f"add i64 {begin}, {MARGIN}"))

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
        given += [self.scratch_row(1 + k) for k in range(own.direction_count)]
        clear_row = self.scratch_row(0)
        t.write_line(f"br label %kind{kind}step")
        t.write_label(f"kind{kind}step")
        v = f"vector{kind}"
        t.write_line(f"%{v} = phi i64 [0, %kind{kind}], [%{v}next, %kind{kind}step]")
        t.write_line(f"%off{kind} = mul i64 %{v}, {LANES}")
        for number, pointer in pointers.items():
            names[number] = t.load(t.double_pointer(pointer, f"%off{kind}"))
        known: dict[int, str] = {}
        t.write_values(own.formula.instructions, own.formula.order, known, names)
        found = [known[number] for number in own.formula.outputs]
        if own.is_checked:
            found[-2:] = [self.write_merged(found[-2], found[-1])]
            given.append(clear_row)
        for value, pointer in zip(found, given, strict=True):
            t.store(value, t.double_pointer(pointer, f"%off{kind}"))
        t.close_loop(v, "vectors", f"kind{kind}step", f"kind{kind}{'check' if own.is_checked else 'good'}")
        if not own.is_checked:
            t.write_label(f"kind{kind}good")
            t.write_line("br label %blockend")

    def write_merged(self, left: str, clear: str) -> str:
        """How clear a step is where it is closed; else what tells that it is not good, but not below zero without a
        dead point."""
        t, flags = self.ir, f"<{LANES} x i1>"
        beyond = t.compare("olt", clear, t.constant(0.0))
        nan = t.constant(float("nan"))
        other = t.add_instruction(f"select {flags} {beyond}, {t.vector} {clear}, {t.vector} {nan}")
        closed = t.compare("ole", left, self.tolerance)
        return t.add_instruction(f"select {flags} {closed}, {t.vector} {clear}, {t.vector} {other}")

    def write_check(self, kind: int) -> None:
        """Whether all is good between steps; if not, where that ends."""
        t, own, flags = self.ir, self.formulas[kind], f"<{LANES} x i1>"
        name, byte = f"kind{kind}", f"i{LANES}"
        t.write_label(f"{name}check")
        clear_row = self.scratch_row(0)
        ends = [t.add_instruction(f"mul i64 %vectors, {LANES}")]
        ends += [t.add_instruction(f"add i64 {ends[0]}, {k}") for k in (1, -1, -2)]
        self.write_extrapolated(clear_row, "-1", "0", "1")
        self.write_extrapolated(clear_row, ends[0], ends[2], ends[3])
        self.write_extrapolated(clear_row, ends[1], ends[0], ends[2])
        rows = [self.scratch_row(1 + k) for k in range(own.direction_count)]
        t.write_line(f"br label %{name}span")
        t.write_label(f"{name}span")
        w = f"interval{kind}"
        t.write_line(f"%{w} = phi i64 [0, %{name}check], [%{w}next, %{name}span]")
        t.write_line(f"%all{kind} = phi {byte} [-1, %{name}check], [%allnext{kind}, %{name}span]")
        fine, slow = self.write_flags(f"%{w}", clear_row, rows)
        for pointer, value in (("%fineflags", fine), ("%slowflags", slow)):
            value_bits = t.add_instruction(f"bitcast {flags} {value} to {byte}")
            place = t.add_instruction(f"getelementptr i8, ptr {pointer}, i64 %{w}")
            t.write_line(f"store {byte} {value_bits}, ptr {place}")
            if value is fine:
                t.write_line(f"%allnext{kind} = and {byte} %all{kind}, {value_bits}")
        t.close_loop(w, "spans", f"{name}span", f"{name}told")
        t.write_label(f"{name}told")
        t.write_line(f"%whole{kind} = icmp eq {byte} %allnext{kind}, -1")
        t.write_line(f"br i1 %whole{kind}, label %{name}good, label %{name}find")
        t.write_label(f"{name}good")
        t.write_line("br label %blockend")
        self.write_search(kind, clear_row)

    def write_extrapolated(self, row: str, to: str, near: str, far: str) -> None:
        """A number beyond the end of a row, as if it went on straight."""
        t = self.ir
        one, two = (t.add_instruction(f"load double, ptr {t.double_pointer(row, k)}") for k in (near, far))
        twice = t.add_instruction(f"fadd double {one}, {one}")
        t.write_line(
            f"store double {t.add_instruction(f'fsub double {twice}, {two}')}, ptr {t.double_pointer(row, to)}"
        )

    def write_flags(self, counter: str, clear_row: str, direction_rows: list[str]) -> tuple[str, str]:
        """Of the intervals from a vector of steps to the next ones: whether all is good, and whether nothing turns
        too fast. Between two steps what is clear bends by less than its second differences say."""
        t, flags = self.ir, f"<{LANES} x i1>"
        begin = t.add_instruction(f"mul i64 {counter}, {LANES}")
        here = {k: t.add_instruction(f"add i64 {begin}, {k}") for k in (-1, 1, 2)} | {0: begin}
        values = [t.load(t.double_pointer(clear_row, here[k])) for k in (-1, 0, 1, 2)]
        moves = [t.binary("sub", b, a) for a, b in pairwise(values)]
        bends = [t.call_intrinsic("fabs", t.binary("sub", b, a)) for a, b in pairwise(moves)]

        def pick(how: str, a: str, b: str) -> str:
            return t.add_instruction(f"select {flags} {t.compare(how, a, b)}, {t.vector} {a}, {t.vector} {b}")

        # what is no number bends by nothing, and is not good itself
        known = t.compare("ord", bends[0], bends[0])
        first = t.select_or_zero(known, bends[0])
        needed = pick("ogt", pick("ogt", bends[1], first), self.clearance)
        fine = t.and_flags(t.compare("ogt", values[1], needed), t.compare("ogt", values[2], needed))
        fastest = t.constant(0.0)
        for row in direction_rows:
            change = t.binary("sub", t.load(t.double_pointer(row, here[1])), t.load(t.double_pointer(row, begin)))
            fastest = pick("ogt", t.call_intrinsic("fabs", change), fastest)
        slow = t.compare("ole", fastest, t.constant(self.greatest_change))
        return t.and_flags(fine, slow), slow

    def write_search(self, kind: int, clear_row: str) -> None:
        """The first interval that is not good, and why."""
        t, name, byte, w = self.ir, f"kind{kind}", f"i{LANES}", f"searched{kind}"
        t.write_label(f"{name}find")
        t.write_line(f"%{w} = phi i64 [0, %{name}told], [%{w}next, %{name}find]")
        place = t.add_instruction(f"getelementptr i8, ptr %fineflags, i64 %{w}")
        t.write_line(f"%bits{kind} = load {byte}, ptr {place}")
        t.write_line(f"%{w}next = add i64 %{w}, 1")
        t.write_line(f"%{w}more = icmp eq {byte} %bits{kind}, -1")
        t.write_line(f"br i1 %{w}more, label %{name}find, label %{name}found")
        t.write_label(f"{name}found")
        bad = t.add_instruction(f"xor {byte} %bits{kind}, -1")
        lane = t.add_instruction(f"call {byte} @llvm.cttz.{byte}({byte} {bad}, i1 true)")
        wide = t.add_instruction(f"zext {byte} {lane} to i64")
        begin = t.add_instruction(f"mul i64 %{w}, {LANES}")
        before = t.add_instruction(f"add i64 {begin}, {wide}")
        t.write_line(f"%come{kind} = add i64 {before}, 1")
        place = t.add_instruction(f"getelementptr i8, ptr %slowflags, i64 %{w}")
        slow = t.add_instruction(f"load {byte}, ptr {place}")
        slow = t.add_instruction(f"trunc {byte} {t.add_instruction(f'lshr {byte} {slow}, {lane}')} to i1")
        clear = t.add_instruction(f"load double, ptr {t.double_pointer(clear_row, f'%come{kind}')}")
        beyond = t.add_instruction(f"fcmp olt double {clear}, 0.0")
        dead = t.add_instruction(f"and i1 {slow}, {beyond}")
        t.write_line(f"%verdict{kind} = select i1 {dead}, i64 1, i64 2")
        t.write_line(f"%ends{kind} = icmp slt i64 %come{kind}, %limit")
        t.write_line(f"br i1 %ends{kind}, label %{name}stopped, label %{name}good")
        t.write_label(f"{name}stopped")
        t.write_line("br label %blockend")


def run_tape(formulas: tuple[TapeFormula, ...], greatest_change: float, steps: int, tape: Tape) -> TapeResult:
    """Walk over a whole tape, whose slots are addresses; see `compile_tape`."""
    stride, many = padded_steps(steps), len(tape.tolerance)
    result = TapeResult(*np.empty((3, many), dtype=np.int64))
    scratch = np.empty(scratch_size(formulas, stride) + LANES)
    slots, p = tape.slots, tape.p
    given = (tape.first, tape.kinds, slots, p, tape.tolerance, tape.clearance)
    arrays = [*(np.ascontiguousarray(each) for each in given), scratch, *result]
    addresses = [each.ctypes.data for each in arrays]
    addresses[6] += -addresses[6] % 64
    walk = compile_tape(formulas, greatest_change)
    with leave_turn():
        walk(0, many, steps, stride, slots.shape[1], p.shape[1], *addresses)
    return result


def clear_rows(addresses: Array, first: Array, count: int) -> None:
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
