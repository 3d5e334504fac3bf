"""Tapes: sequences of blocks, each computed over all steps by the compiled function of its kind.

No function is compiled for a structure: all linkages with a block of one kind use the same function.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import lru_cache
from math import nan
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.arrays import Array, IntArray
from planar.foundation.instruction_list import InstructionList, required_values
from planar.foundation.turns import leave_turn

LANES = 8
"""Steps in one vector; the length of a row is a multiple of it."""
GOOD, DEAD_POINT, UNDECIDED = range(3)
"""Outcomes of a sequence: good to the end, until a dead point, until a step that is not sure."""
SHIFT = LANES.bit_length() - 1
"""By how many bits a number of steps is one of vectors."""
LONG_CALL_NUMBERS = 2**14
"""Blocks times steps from which on other threads run while they are computed."""
MAX_BLOCK_FUNCTIONS = 4096
GREATEST_CHANGE = 2.5
"""Largest change of a square root up to its zero, divided by its change in the step before: 1 / (sqrt(2) - 1)."""
BLOCK_NAME = "block"
BLOCK_ARGUMENTS = (
    "i64 %limit, i64 %stride, ptr readonly %rows, ptr readonly %p, double %tolerance, double %clearance, ptr %ended"
)
"""Arguments of a block function: the number of steps; the length of a row; the addresses of the slots; the numbers of
the block; the residual tolerance; the least distance measure from a dead point; and an output array: the first step
that is not good and its outcome, and whether the block stays clear of a dead point up to the next step."""
BLOCK_ARGUMENT_TYPES = ("int", "int", "array", "array", "float", "float", "array")
_WALK = f"""
define void @walk(i64 %begin, i64 %end, i64 %steps, i64 %stride, i64 %slots, i64 %numbers, ptr readonly %functions,
  ptr readonly %first, ptr readonly %kinds, ptr readonly %rows, ptr readonly %p, ptr readonly %tolerance,
  ptr readonly %clearance, ptr %good, ptr %outcome, ptr %at) {{
entry:
  %ended = alloca [3 x i64]
  %verdict = getelementptr i64, ptr %ended, i64 1
  %stays = getelementptr i64, ptr %ended, i64 2
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
  store i64 1, ptr %stays
  %kindp = getelementptr i64, ptr %kinds, i64 %j
  %kind = load i64, ptr %kindp
  %functionp = getelementptr ptr, ptr %functions, i64 %kind
  %function = load ptr, ptr %functionp
  %rowfirst = mul i64 %j, %slots
  %own = getelementptr ptr, ptr %rows, i64 %rowfirst
  %pfirst = mul i64 %j, %numbers
  %ownp = getelementptr double, ptr %p, i64 %pfirst
  call void %function(i64 %limit, i64 %stride, ptr %own, ptr %ownp, double %open, double %clear, ptr %ended)
  %come = load i64, ptr %ended
  %ends = icmp slt i64 %come, %limit
  %said = load i64, ptr %verdict
  %isclear = load i64, ptr %stays
  %near = icmp eq i64 %isclear, 0
  %isdead = icmp eq i64 %outcomenow, {DEAD_POINT}
  %unsure = and i1 %near, %isdead
  %kept = select i1 %unsure, i64 {UNDECIDED}, i64 %outcomenow
  %outcomenext = select i1 %ends, i64 %said, i64 %kept
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
"""Computes sequences from `begin` to `end`, each block by the function of its kind; a sequence that is not good at its
first step ends there. A dead point is undecided where a later block may end before it."""


class FormulaInput(NamedTuple):
    """An input of a formula: ("row", slot, number of its row), ("p", number), or ("z", unknown, 0 or 1)."""

    source: str
    place: int
    part: int = 0


class BlockFormula:
    """A list of instructions with the numbers of its outputs and inputs, and in `order` those of all values needed."""

    def __init__(self, instructions: InstructionList[FormulaInput], outputs: Sequence[int]):
        self.instructions, self.outputs = instructions, outputs
        self.order = required_values(instructions, outputs)
        keys = ((number, instructions.instructions[number].key) for number in self.order)
        self.inputs = {number: key for number, key in keys if key is not None}


class TapeFormula(NamedTuple):
    """The formula of a kind of block: the slot and row of each of its first values; the vectors along links that must
    not turn fast, by the numbers of the values x, y and squared length (None for a length of one); and whether the last
    two values are the residual and the distance measure from a dead point."""

    formula: BlockFormula
    output_rows: tuple[tuple[int, int], ...]
    directions: tuple[tuple[int, int, int | None], ...] = ()
    is_checked: bool = False


class Tape(NamedTuple):
    """Sequences of blocks: where each sequence begins in the blocks, first (sequences + 1,); of every block the number
    of its function in `kinds` (blocks,), the addresses of its slots (blocks, slots), whose rows are one after the
    other, and its numbers p (blocks, numbers), each block after those that it needs; the `tolerance` of residuals
    (sequences,), and the least distance measure from a dead point, `clearance` (sequences,)."""

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
    """The length of a row of steps: a multiple of LANES."""
    return LANES * -(-steps // LANES)


def run_tape(functions: Sequence[Any], steps: int, tape: Tape) -> TapeResult:
    """Compute all blocks of a tape with the functions of their kinds, see `compile_block`; rows have `padded_steps`."""
    stride, sequence_count = padded_steps(steps), len(tape.tolerance)
    result = TapeResult(*np.empty((3, sequence_count), dtype=np.int64))
    addresses = np.array([ctypes.cast(item, ctypes.c_void_p).value for item in functions], dtype=np.int64)
    arrays = [addresses, *(np.ascontiguousarray(item) for item in tape), *result]
    walk = compile_function(_WALK, "walk", *("int",) * 6, *("array",) * 10)
    with leave_turn(len(tape.kinds) * steps >= LONG_CALL_NUMBERS):
        walk(
            0,
            sequence_count,
            steps,
            stride,
            tape.slots.shape[1],
            tape.p.shape[1],
            *(item.ctypes.data for item in arrays),
        )
    return result


@lru_cache(maxsize=MAX_BLOCK_FUNCTIONS)
def compile_block(formula: TapeFormula, least_cosine: float = -1.0) -> Any:
    """The function of a kind by its formula. `least_cosine`: of the angle by which a link may turn in a step."""
    return compile_function(_BlockWriter(formula, least_cosine).write(), BLOCK_NAME, *BLOCK_ARGUMENT_TYPES)


class _BlockWriter:
    """Writes the function of `compile_block`."""

    def __init__(self, formula: TapeFormula, least_cosine: float):
        self.ir, self.formula, self.least_cosine = IRWriter(LANES), formula, least_cosine

    def write(self) -> str:
        """The text of the function."""
        t, tape_formula = self.ir, self.formula
        t.write_line(f"define void @{BLOCK_NAME}({BLOCK_ARGUMENTS}) {{")
        t.write_label("entry")
        t.write_line(f"%rounded = add i64 %limit, {LANES - 1}")
        t.write_line(f"%vectors = lshr i64 %rounded, {SHIFT}")
        self.tolerance, self.clearance = t.broadcast("%tolerance"), t.broadcast("%clearance")
        slots: dict[int, str] = {}

        def row_pointer(slot: int, row: int) -> str:
            if slot not in slots:
                pointer = t.add_instruction(f"getelementptr ptr, ptr %rows, i64 {slot}")
                slots[slot] = t.add_instruction(f"load ptr, ptr {pointer}")
            return t.double_pointer(slots[slot], t.add_instruction(f"mul i64 %stride, {row}"))

        names: dict[int, str] = {}
        input_pointers: dict[int, str] = {}
        for number, leaf in tape_formula.formula.inputs.items():
            if leaf.source == "p":
                place = t.double_pointer("%p", str(leaf.place))
                names[number] = t.broadcast(t.add_instruction(f"load double, ptr {place}"))
            else:
                input_pointers[number] = row_pointer(leaf.place, leaf.part)
        output_pointers = [row_pointer(*place) for place in tape_formula.output_rows]
        t.write_line("br label %step")
        t.write_label("step")
        t.write_line("%vector = phi i64 [0, %entry], [%vectornext, %next]")
        watched = [
            f"%watched{k}" for k in range(2 * len(tape_formula.directions) + 1 if tape_formula.is_checked else 0)
        ]
        for name in watched:
            t.write_line(f"{name} = phi {t.vector} [{t.constant(nan)}, %entry], [{name}next, %next]")
        t.write_line(f"%off = mul i64 %vector, {LANES}")
        for number, pointer in input_pointers.items():
            names[number] = t.load(t.double_pointer(pointer, "%off"))
        known: dict[int, str] = {}
        t.write_values(tape_formula.formula.instructions, tape_formula.formula.order, known, names)
        values = [known[number] for number in tape_formula.formula.outputs]
        for value, pointer in zip(values, output_pointers, strict=False):
            t.store(value, t.double_pointer(pointer, "%off"))
        if tape_formula.is_checked:
            self._write_check(watched, values)
        else:
            t.write_line("br label %next")
        t.write_label("next")
        t.close_loop("vector", "vectors", "step", "judged" if tape_formula.is_checked else "done")
        if tape_formula.is_checked:
            t.write_label("judged")
            t.write_line(f"%lastlane = and i64 {t.add_instruction('sub i64 %limit, 1')}, {LANES - 1}")
            stays = write_stays_clear(t, values[-1], self._earlier(values[-1], watched[-1], 1), self.clearance)
            write_stays(t, t.add_instruction(f"extractelement <{LANES} x i1> {stays}, i64 %lastlane"))
            t.write_line("br label %done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        if tape_formula.is_checked:
            t.write_line(f"declare i{LANES} @llvm.cttz.i{LANES}(i{LANES}, i1)")
        return t.module_text()

    def _write_check(self, watched: list[str], values: list[str]) -> None:
        """Check a vector of steps: the turns of directions, the residual, and the distance measure from a dead point;
        `watched` are the values of the vector before. The block ends at the first step that is not good."""
        t, byte = self.ir, f"i{LANES}"
        residual, clear = values[-2:]
        directions = [
            LinkDirection(values[x], values[y], k if k is None else values[k]) for x, y, k in self.formula.directions
        ]
        parts = [*(part for direction in directions for part in direction[:2]), clear]
        earlier = [self._earlier(value, before, 1) for value, before in zip(parts, watched, strict=True)]
        good = write_turn_flags(
            t, t.compare("ole", residual, self.tolerance), directions, earlier[:-1], self.least_cosine
        )
        judged = write_clear_flags(t, clear, earlier[-1], self._earlier(clear, watched[-1], 2), self.clearance)
        for value, before in zip(parts, watched, strict=True):
            # a value of its own name, for the next vector
            t.write_line(f"{before}next = select i1 true, {t.vector} {value}, {t.vector} {value}")
        t.write_line(f"%fine = bitcast <{LANES} x i1> {t.and_flags(good, judged.is_clear)} to {byte}")
        t.write_line(f"%allfine = icmp eq {byte} %fine, -1")
        t.write_line("br i1 %allfine, label %next, label %ending")
        t.write_label("ending")
        bad = t.add_instruction(f"xor {byte} %fine, -1")
        lane = t.add_instruction(f"call {byte} @llvm.cttz.{byte}({byte} {bad}, i1 true)")
        t.write_line(f"%come = add i64 %off, {t.add_instruction(f'zext {byte} {lane} to i64')}")
        t.write_line("%ends = icmp slt i64 %come, %limit")
        t.write_line("br i1 %ends, label %stopped, label %judged")
        t.write_label("stopped")
        below = t.compare("olt", clear, t.constant(0.0))
        dead = t.and_flags(below, t.compare("ogt", judged.least_before, judged.needed))
        bits = t.add_instruction(f"bitcast <{LANES} x i1> {dead} to {byte}")
        is_dead = t.add_instruction(f"trunc {byte} {t.add_instruction(f'lshr {byte} {bits}, {lane}')} to i1")
        write_ended(t, "%come", t.add_instruction(f"select i1 {is_dead}, i64 {DEAD_POINT}, i64 {UNDECIDED}"))
        t.write_line("br label %done")

    def _earlier(self, value: str, before: str, by: int) -> str:
        """The values of a vector shifted by some steps; `before` is the previous vector."""
        v, lanes = self.ir.vector, ", ".join(f"i32 {LANES + k - by}" for k in range(LANES))
        return self.ir.add_instruction(f"shufflevector {v} {before}, {v} {value}, <{LANES} x i32> <{lanes}>")


class LinkDirection(NamedTuple):
    """Values of a vector along a link, with its squared length, None where that is one."""

    x: str
    y: str
    square: str | None


def write_turn_flags(
    t: IRWriter, is_good: str, directions: Sequence[LinkDirection], earlier: Sequence[str], least_cosine: float
) -> str:
    """Whether a step is good and no direction turns fast; `earlier` are x and y of each in the step before."""
    for k, (x, y, square) in enumerate(directions):
        along = t.add_all([t.binary("mul", a, b) for a, b in zip((x, y), earlier[2 * k : 2 * k + 2], strict=True)])
        minimum = t.constant(least_cosine)
        if square is not None:
            minimum = t.binary("mul", square, minimum)
        # NaN before the first step passes
        is_good = t.and_flags(is_good, t.compare("uge", along, minimum))
    return is_good


def write_turn_check(
    t: IRWriter, is_good: str, directions: Sequence[LinkDirection], slots: Sequence[str], least_cosine: float
) -> str:
    """The same, with x and y of each direction in slots: those of the step before, then those of this step."""
    is_good = write_turn_flags(t, is_good, directions, [t.load(slot) for slot in slots], least_cosine)
    for value, slot in zip((part for direction in directions for part in direction[:2]), slots, strict=True):
        t.store(value, slot)
    return is_good


class ClearFlags(NamedTuple):
    """Whether no dead point is near a step; the least distance measure of the two steps before it, and the least that
    they need."""

    is_clear: str
    least_before: str
    needed: str


def write_clear_flags(t: IRWriter, clear: str, one: str, two: str, clearance: str) -> ClearFlags:
    """Judge a step by its distance measure from a dead point and those of the two steps before: between steps it
    deviates by less than its second difference."""

    def pick(predicate: str, a: str, b: str) -> str:
        return t.select(t.compare(predicate, a, b), a, b)

    bend = t.call_intrinsic("fabs", t.binary("sub", t.binary("sub", clear, one), t.binary("sub", one, two)))
    # NaN before the first steps passes
    needed, minimum = pick("ogt", bend, clearance), pick("olt", two, one)
    return ClearFlags(t.compare("ogt", pick("olt", minimum, clear), needed), minimum, needed)


def write_stays_clear(t: IRWriter, clear: str, one: str, clearance: str) -> str:
    """Whether no dead point is near before the next step, by the distance measures of a step and the one before:
    towards a dead point of another block the measure changes as the root of the distance to it."""
    change = t.call_intrinsic("fabs", t.binary("sub", clear, one))
    ahead = t.binary("sub", clear, t.binary("mul", t.constant(GREATEST_CHANGE), change))
    return t.compare("ogt", ahead, clearance)


def write_stays(t: IRWriter, flag: str) -> None:
    """Store whether a block stays clear."""
    place = t.add_instruction("getelementptr i64, ptr %ended, i64 2")
    t.write_line(f"store i64 {t.add_instruction(f'zext i1 {flag} to i64')}, ptr {place}")


def write_ended(t: IRWriter, step: str, outcome: str) -> None:
    """Store the first step that is not good, and the outcome there."""
    t.write_line(f"store i64 {step}, ptr %ended")
    t.write_line(f"store i64 {outcome}, ptr {t.add_instruction('getelementptr i64, ptr %ended, i64 1')}")
