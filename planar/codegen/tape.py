"""Tapes: blocks that are worked off one after the other, each over all steps by the compiled function of its kind.

Nothing is compiled for a structure: the function of a kind of block serves every linkage that has such a block.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import lru_cache
from math import nan
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
LONG_CALL_NUMBERS = 2**14
"""Blocks times steps from which on other threads go on while they are computed."""
MAX_BLOCK_FUNCTIONS = 4096
BLOCK_NAME = "block"
BLOCK_ARGUMENTS = (
    "i64 %limit, i64 %stride, ptr readonly %rows, ptr readonly %p, double %tolerance, double %clearance, "
    "ptr %flags, ptr %ended"
)
"""Of the function of a kind: how many steps are wanted; how far rows are apart; the addresses of its slots; its own
numbers; what may be left open; how clear of a dead point steps are at least; room for two bytes a vector of steps; and
where it puts the first step that is not good, with the outcome, if one is not."""
BLOCK_ARGUMENT_TYPES = ("int", "int", "array", "array", "float", "float", "array", "array")
_WALK = f"""
define void @walk(i64 %begin, i64 %end, i64 %steps, i64 %stride, i64 %slots, i64 %numbers, ptr readonly %functions,
  ptr readonly %first, ptr readonly %kinds, ptr readonly %rows, ptr readonly %p, ptr readonly %tolerance,
  ptr readonly %clearance, ptr %flags, ptr %good, ptr %outcome, ptr %at) {{
entry:
  %ended = alloca [2 x i64]
  %verdict = getelementptr i64, ptr %ended, i64 1
  %any = icmp slt i64 %begin, %end
  br i1 %any, label %sequence, label %done
sequence:
  %i = phi i64 [%begin, %entry], [%inext, %sequenceend]
  %inext = add i64 %i, 1
  %firstp = getelementptr i64, ptr %first, i64 %i
  %jbegin = load i64, ptr %firstp
  %lastp = getelementptr i64, ptr %first, i64 %inext
  %jend = load i64, ptr %lastp
  %tolerancep = getelementptr double, ptr %tolerance, i64 %i
  %open = load double, ptr %tolerancep
  %clearancep = getelementptr double, ptr %clearance, i64 %i
  %clear = load double, ptr %clearancep
  %some = icmp slt i64 %jbegin, %jend
  br i1 %some, label %block, label %sequenceend
block:
  %j = phi i64 [%jbegin, %sequence], [%jnext, %block]
  %limit = phi i64 [%steps, %sequence], [%come, %block]
  %outcomenow = phi i64 [{GOOD}, %sequence], [%outcomenext, %block]
  %atnow = phi i64 [0, %sequence], [%atnext, %block]
  store i64 %limit, ptr %ended
  %kindp = getelementptr i64, ptr %kinds, i64 %j
  %kind = load i64, ptr %kindp
  %functionp = getelementptr ptr, ptr %functions, i64 %kind
  %function = load ptr, ptr %functionp
  %rowfirst = mul i64 %j, %slots
  %own = getelementptr ptr, ptr %rows, i64 %rowfirst
  %pfirst = mul i64 %j, %numbers
  %ownp = getelementptr double, ptr %p, i64 %pfirst
  call void %function(i64 %limit, i64 %stride, ptr %own, ptr %ownp, double %open, double %clear, ptr %flags, ptr %ended)
  %come = load i64, ptr %ended
  %ends = icmp slt i64 %come, %limit
  %said = load i64, ptr %verdict
  %outcomenext = select i1 %ends, i64 %said, i64 %outcomenow
  %atnext = select i1 %ends, i64 %j, i64 %atnow
  %jnext = add i64 %j, 1
  %jmore = icmp slt i64 %jnext, %jend
  %on = icmp sgt i64 %come, 0
  %both = and i1 %jmore, %on
  br i1 %both, label %block, label %sequenceend
sequenceend:
  %goodnow = phi i64 [%steps, %sequence], [%come, %block]
  %outcomelast = phi i64 [{GOOD}, %sequence], [%outcomenext, %block]
  %atlast = phi i64 [0, %sequence], [%atnext, %block]
  %goodp = getelementptr i64, ptr %good, i64 %i
  store i64 %goodnow, ptr %goodp
  %outcomep = getelementptr i64, ptr %outcome, i64 %i
  store i64 %outcomelast, ptr %outcomep
  %atp = getelementptr i64, ptr %at, i64 %i
  store i64 %atlast, ptr %atp
  %imore = icmp slt i64 %inext, %end
  br i1 %imore, label %sequence, label %done
done:
  ret void
}}
"""
"""Sequences from `begin` to `end`, each block by the function of its kind; a sequence that is not good at its first
step goes no further."""


class TapeFormula(NamedTuple):
    """The formula of a kind of block: the slot and row to which each of its first values goes; by the numbers of the
    values the cosines and sines of links that may not turn fast; and whether the last two values are what is left open,
    and how clear of a dead point it is."""

    formula: BlockFormula
    output_rows: tuple[tuple[int, int], ...]
    directions: tuple[tuple[int, int], ...] = ()
    is_checked: bool = False


class Tape(NamedTuple):
    """Sequences of blocks: where each sequence begins in the blocks, first (sequences + 1,); of every block the number
    of its function in `kinds` (blocks,), the addresses of its slots (blocks, slots), whose rows are one after the
    other, and its numbers p (blocks, numbers), each block after those that it needs; by how much constraints may be
    open, tolerance (sequences,), and how clear of a dead point steps are at least, clearance (sequences,)."""

    first: IntArray
    kinds: IntArray
    slots: IntArray
    p: Array
    tolerance: Array
    clearance: Array


class TapeResult(NamedTuple):
    """Of every sequence how many of its first steps are good in all its blocks, the outcome after these, and at which
    block (sequences,)."""

    good: IntArray
    outcome: IntArray
    at: IntArray


def padded_steps(steps: int) -> int:
    """How many numbers a row of so many steps has: whole vectors."""
    return LANES * -(-steps // LANES)


def run_tape(functions: Sequence[Any], steps: int, tape: Tape) -> TapeResult:
    """Work off a whole tape by the functions of its kinds, see `compile_block`, over rows of `padded_steps`."""
    stride, many = padded_steps(steps), len(tape.tolerance)
    result = TapeResult(*np.empty((3, many), dtype=np.int64))
    flags = np.empty(2 * stride // LANES, dtype=np.int8)
    addresses = np.array([ctypes.cast(each, ctypes.c_void_p).value for each in functions], dtype=np.int64)
    arrays = [addresses, *(np.ascontiguousarray(each) for each in tape), flags, *result]
    walk = compile_function(_WALK, "walk", *("int",) * 6, *("array",) * 11)
    with leave_turn(len(tape.kinds) * steps >= LONG_CALL_NUMBERS):
        walk(0, many, steps, stride, tape.slots.shape[1], tape.p.shape[1], *(each.ctypes.data for each in arrays))
    return result


@lru_cache(maxsize=MAX_BLOCK_FUNCTIONS)
def compile_block(formula: TapeFormula, least_cosine: float = -1.0) -> Any:
    """The function of a kind by its formula. `least_cosine`: of the angle by which a link may turn in a step."""
    return compile_function(_BlockWriter(formula, least_cosine).write(), BLOCK_NAME, *BLOCK_ARGUMENT_TYPES)


class _BlockWriter:
    """Writes the function of `compile_block`."""

    def __init__(self, own: TapeFormula, least_cosine: float):
        self.ir, self.own, self.least_cosine = IRWriter(LANES), own, least_cosine

    def write(self) -> str:
        """The text of the function."""
        t, own = self.ir, self.own
        t.write_line(f"define void @{BLOCK_NAME}({BLOCK_ARGUMENTS}) {{")
        t.write_label("entry")
        t.write_line(f"%rounded = add i64 %limit, {LANES - 1}")
        t.write_line(f"%vectors = lshr i64 %rounded, {SHIFT}")
        t.write_line(f"%bytes = lshr i64 %stride, {SHIFT}")
        t.write_line("%deadflags = getelementptr i8, ptr %flags, i64 %bytes")
        self.tolerance, self.clearance = t.broadcast("%tolerance"), t.broadcast("%clearance")
        slots: dict[int, str] = {}

        def row_pointer(slot: int, row: int) -> str:
            if slot not in slots:
                pointer = t.add_instruction(f"getelementptr ptr, ptr %rows, i64 {slot}")
                slots[slot] = t.add_instruction(f"load ptr, ptr {pointer}")
            return t.double_pointer(slots[slot], t.add_instruction(f"mul i64 %stride, {row}"))

        names: dict[int, str] = {}
        taken: dict[int, str] = {}
        for number, leaf in own.formula.inputs.items():
            if leaf.source == "p":
                place = t.double_pointer("%p", str(leaf.place))
                names[number] = t.broadcast(t.add_instruction(f"load double, ptr {place}"))
            else:
                taken[number] = row_pointer(leaf.place, leaf.part)
        given = [row_pointer(*place) for place in own.output_rows]
        t.write_line("br label %step")
        t.write_label("step")
        t.write_line("%vector = phi i64 [0, %entry], [%vectornext, %step]")
        watched = [f"%watched{k}" for k in range(2 * len(own.directions) + 1 if own.is_checked else 0)]
        for each in watched:
            t.write_line(f"{each} = phi {t.vector} [{t.constant(nan)}, %entry], [{each}next, %step]")
        if own.is_checked:
            t.write_line(f"%all = phi i{LANES} [-1, %entry], [%allnext, %step]")
        t.write_line(f"%off = mul i64 %vector, {LANES}")
        for number, pointer in taken.items():
            names[number] = t.load(t.double_pointer(pointer, "%off"))
        known: dict[int, str] = {}
        t.write_values(own.formula.instructions, own.formula.order, known, names)
        found = [known[number] for number in own.formula.outputs]
        for value, pointer in zip(found, given, strict=False):
            t.store(value, t.double_pointer(pointer, "%off"))
        if own.is_checked:
            self._write_check(watched, found)
        t.close_loop("vector", "vectors", "step", "told" if own.is_checked else "done")
        if own.is_checked:
            self._write_search()
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        if own.is_checked:
            t.write_line(f"declare i{LANES} @llvm.cttz.i{LANES}(i{LANES}, i1)")
        return t.module_text()

    def _write_check(self, watched: list[str], found: list[str]) -> None:
        """Look at a vector of steps: directions, what is left open and how clear it is, as before in `watched`."""
        t, flags, byte = self.ir, f"<{LANES} x i1>", f"i{LANES}"
        left, clear = found[-2:]
        parts = [found[k] for both in self.own.directions for k in both]
        earlier = [self._earlier(value, before, 1) for value, before in zip(parts, watched, strict=False)]
        good = t.compare("ole", left, self.tolerance)
        clear = write_where_good(t, clear, write_turn_flags(t, good, parts, earlier, self.least_cosine))
        for value, before in zip((*parts, clear), watched, strict=True):
            # a value of its own name, for the next vector
            t.write_line(f"{before}next = select i1 true, {t.vector} {value}, {t.vector} {value}")
        fine, dead = self._write_flags(clear, watched[-1])
        bits = [t.add_instruction(f"bitcast {flags} {each} to {byte}") for each in (fine, dead)]
        for pointer, value in zip(("%flags", "%deadflags"), bits, strict=True):
            place = t.add_instruction(f"getelementptr i8, ptr {pointer}, i64 %vector")
            t.write_line(f"store {byte} {value}, ptr {place}")
        t.write_line(f"%allnext = and {byte} %all, {bits[0]}")

    def _earlier(self, value: str, before: str, by: int) -> str:
        """The values so many steps before those of a vector; `before` is the vector before it."""
        v, lanes = self.ir.vector, ", ".join(f"i32 {LANES + k - by}" for k in range(LANES))
        return self.ir.add_instruction(f"shufflevector {v} {before}, {v} {value}, <{LANES} x i32> <{lanes}>")

    def _write_flags(self, clear: str, before: str) -> tuple[str, str]:
        """Whether all is good up to each step of a vector, and whether there is a dead point just before it."""
        t = self.ir
        one, two = (self._earlier(clear, before, by) for by in (1, 2))
        fine, least, needed = write_fine_flags(t, clear, one, two, self.clearance)
        dead = t.and_flags(t.compare("olt", clear, t.constant(0.0)), t.compare("ogt", least, needed))
        return fine, dead

    def _write_search(self) -> None:
        """The first interval that is not good, and why."""
        t, byte = self.ir, f"i{LANES}"
        t.write_label("told")
        t.write_line(f"%isgood = icmp eq {byte} %allnext, -1")
        t.write_line("br i1 %isgood, label %done, label %find")
        t.write_label("find")
        t.write_line("%w = phi i64 [0, %told], [%wnext, %find]")
        place = t.add_instruction("getelementptr i8, ptr %flags, i64 %w")
        t.write_line(f"%bits = load {byte}, ptr {place}")
        t.write_line("%wnext = add i64 %w, 1")
        t.write_line(f"%wmore = icmp eq {byte} %bits, -1")
        t.write_line("br i1 %wmore, label %find, label %found")
        t.write_label("found")
        bad = t.add_instruction(f"xor {byte} %bits, -1")
        lane = t.add_instruction(f"call {byte} @llvm.cttz.{byte}({byte} {bad}, i1 true)")
        wide = t.add_instruction(f"zext {byte} {lane} to i64")
        t.write_line(f"%come = add i64 {t.add_instruction(f'mul i64 %w, {LANES}')}, {wide}")
        place = t.add_instruction("getelementptr i8, ptr %deadflags, i64 %w")
        dead = t.add_instruction(f"lshr {byte} {t.add_instruction(f'load {byte}, ptr {place}')}, {lane}")
        dead = t.add_instruction(f"trunc {byte} {dead} to i1")
        verdict = t.add_instruction(f"select i1 {dead}, i64 {DEAD_POINT}, i64 {UNDECIDED}")
        t.write_line("%ends = icmp slt i64 %come, %limit")
        t.write_line("br i1 %ends, label %stopped, label %done")
        t.write_label("stopped")
        write_ended(t, "%come", verdict)
        t.write_line("br label %done")


def write_turn_flags(t: IRWriter, good: str, now: Sequence[str], earlier: Sequence[str], least_cosine: float) -> str:
    """Where it is good, and none of the directions, each a cosine and a sine, turns fast from one step to the next."""
    for k in range(0, len(now), 2):
        cosine = t.add_all([t.binary("mul", a, b) for a, b in zip(now[k : k + 2], earlier[k : k + 2], strict=True)])
        # where a step is no position nothing turns
        good = t.and_flags(good, t.compare("uge", cosine, t.constant(least_cosine)))
    return good


def write_where_good(t: IRWriter, clear: str, good: str) -> str:
    """How clear a step is where it is good; else no number, but for what is below zero."""
    told = t.or_flags(good, t.compare("olt", clear, t.constant(0.0)))
    return t.select(told, clear, t.constant(nan))


def write_fine_flags(t: IRWriter, clear: str, one: str, two: str, clearance: str) -> tuple[str, str, str]:
    """Whether no dead point is near, by how clear a step and the two before it are; how clear these two are at least,
    and how clear they need to be. Between steps what is clear bends by less than its second differences say."""

    def pick(how: str, a: str, b: str) -> str:
        return t.select(t.compare(how, a, b), a, b)

    bend = t.call_intrinsic("fabs", t.binary("sub", t.binary("sub", clear, one), t.binary("sub", one, two)))
    # at the first steps some of these are no numbers, which is passed over
    needed, least = pick("ogt", bend, clearance), pick("olt", two, one)
    return t.compare("ogt", pick("olt", least, clear), needed), least, needed


def write_ended(t: IRWriter, step: str, outcome: str) -> None:
    """Tell the first step that is not good, and the outcome there."""
    t.write_line(f"store i64 {step}, ptr %ended")
    t.write_line(f"store i64 {outcome}, ptr {t.add_instruction('getelementptr i64, ptr %ended, i64 1')}")


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
