"""Tapes: sequences of blocks, each computed over all steps by the compiled function of its kind.

No function is compiled for a structure: all linkages with a block of one kind use the same function.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cached_property, lru_cache
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
    t, wanted = IRWriter(LANES), formula.formula
    block = BlockText(t)
    block.begin_steps(len(formula.directions) if formula.is_checked else None)
    names = {
        number: block.number(leaf.place) if leaf.source == "p" else block.load_row(leaf.place, leaf.part)
        for number, leaf in wanted.inputs.items()
    }
    known: dict[int, str] = {}
    t.write_values(wanted.instructions, wanted.order, known, names)
    values = [known[number] for number in wanted.outputs]
    block.store_rows(values, formula.output_rows)
    if formula.is_checked:
        directions = [
            LinkDirection(values[x], values[y], k if k is None else values[k]) for x, y, k in formula.directions
        ]
        is_closed = t.compare("ole", values[-2], block.tolerance)
        block.end_checked_steps(is_closed, directions, values[-1], least_cosine)
    else:
        block.end_steps()
    return block.function


class BlockText:
    """The function of a kind of block, written front to back: a loop over its steps, as many at once as there are
    lanes."""

    def __init__(self, ir: IRWriter):
        t = self.ir = ir
        t.write_line(f"define void @{BLOCK_NAME}({BLOCK_ARGUMENTS}) {{")
        t.write_label("entry")
        t.write_line(f"%rounded = add i64 %limit, {t.lanes - 1}")
        t.write_line(f"%vectors = lshr i64 %rounded, {t.lanes.bit_length() - 1}")
        self.tolerance, self.clearance = t.broadcast("%tolerance"), t.broadcast("%clearance")
        t.mark_hoist_point()
        self._slots: dict[int, str] = {}
        self._rows: dict[tuple[int, int], str] = {}
        self._numbers: dict[int, str] = {}
        self._watched: list[list[str]] = []

    def slot(self, slot: int) -> str:
        """The address of a slot."""
        if slot not in self._slots:
            with self.ir.hoisted():
                pointer = self.ir.add_instruction(f"getelementptr ptr, ptr %rows, i64 {slot}")
                self._slots[slot] = self.ir.add_instruction(f"load ptr, ptr {pointer}")
        return self._slots[slot]

    def number(self, place: int) -> str:
        """A number of the block, in every lane."""
        t = self.ir
        if place not in self._numbers:
            with t.hoisted():
                pointer = t.double_pointer("%p", str(place))
                self._numbers[place] = t.broadcast(t.add_instruction(f"load double, ptr {pointer}"))
        return self._numbers[place]

    def _row_pointer(self, slot: int, row: int) -> str:
        base = self.slot(slot)
        if (slot, row) not in self._rows:
            with self.ir.hoisted():
                first = self.ir.add_instruction(f"mul i64 %stride, {row}")
                self._rows[slot, row] = self.ir.double_pointer(base, first)
        return self.ir.double_pointer(self._rows[slot, row], "%off")

    def load_row(self, slot: int, row: int) -> str:
        """A row of a slot at the steps of the lanes."""
        return self.ir.load(self._row_pointer(slot, row))

    def store_rows(self, values: Sequence[str], rows: Sequence[tuple[int, int]]) -> None:
        """Store values in rows, each a slot and the number of its row; further values are not stored."""
        for value, row in zip(values, rows, strict=False):
            self.ir.store(value, self._row_pointer(*row))

    def begin_steps(self, direction_count: int | None = None) -> None:
        """Begin the loop. `direction_count`: of links that must not turn fast; None where steps are not checked."""
        t = self.ir
        t.write_line("br label %step")
        t.write_label("step")
        t.write_line("%k = phi i64 [0, %entry], [%knext, %next]")
        if direction_count is not None:
            # of each value that is watched the vectors before; the last one, the distance measure, is wanted two back
            depths = [1] * 2 * direction_count + [2 if t.lanes < 2 else 1]
            self._watched = [[f"%watched{n}of{d}" for d in range(depth)] for n, depth in enumerate(depths)]
        for name in (name for vectors in self._watched for name in vectors):
            t.write_line(f"{name} = phi {t.vector} [{t.constant(nan)}, %entry], [{name}next, %next]")
        t.write_line(f"%off = mul i64 %k, {t.lanes}")

    def end_steps(self) -> None:
        """End the loop of steps that are not checked."""
        self.ir.write_line("br label %next")
        self.ir.write_label("next")
        self.ir.close_loop("k", "vectors", "step", "done")
        self.ir.write_label("done")
        self.ir.end_function()

    def end_checked_steps(
        self, is_good: str, directions: Sequence[LinkDirection], clear: str, least_cosine: float
    ) -> None:
        """Check a vector of steps that `is_good` so far: the turns of directions, and the distance measure `clear` from
        a dead point. The block ends at the first step that is not good."""
        t, byte, lanes = self.ir, f"i{self.ir.lanes}", f"<{self.ir.lanes} x i1>"
        parts = [*(part for direction in directions for part in direction[:2]), clear]
        earlier = [self._earlier(value, vectors, 1) for value, vectors in zip(parts, self._watched, strict=True)]
        one, two = earlier[-1], self._earlier(clear, self._watched[-1], 2)
        is_good = write_turn_flags(t, is_good, directions, earlier[:-1], least_cosine)
        # between steps the measure deviates by less than its second difference; NaN before the first steps passes
        bend = t.call_intrinsic("fabs", t.binary("sub", t.binary("sub", clear, one), t.binary("sub", one, two)))
        needed = self._pick("ogt", bend, self.clearance)
        least_before = self._pick("olt", two, one)
        is_clear = t.compare("ogt", self._pick("olt", least_before, clear), needed)
        for value, vectors in zip(parts, self._watched, strict=True):
            for name, current in zip(vectors, (value, *vectors), strict=False):
                # a value of its own name, for the next vector
                t.write_line(f"{name}next = select i1 true, {t.vector} {current}, {t.vector} {current}")
        t.write_line(f"%fine = bitcast {lanes} {t.and_flags(is_good, is_clear)} to {byte}")
        t.write_line(f"%allfine = icmp eq {byte} %fine, -1")
        t.write_line("br i1 %allfine, label %next, label %ending")
        t.write_label("ending")
        bad = t.add_instruction(f"xor {byte} %fine, -1")
        lane = t.add_instruction(f"call {byte} @llvm.cttz.{byte}({byte} {bad}, i1 true)")
        t.write_line(f"%lane = zext {byte} {lane} to i64")
        t.write_line("%come = add i64 %off, %lane")
        t.write_line("%ends = icmp slt i64 %come, %limit")
        t.write_line("br i1 %ends, label %stopped, label %judged")
        t.write_label("stopped")
        below = t.compare("olt", clear, t.constant(0.0))
        dead = t.and_flags(below, t.compare("ogt", least_before, needed))
        is_dead = t.add_instruction(f"extractelement {lanes} {dead}, i64 %lane")
        t.write_line("store i64 %come, ptr %ended")
        outcome = t.add_instruction(f"select i1 {is_dead}, i64 {DEAD_POINT}, i64 {UNDECIDED}")
        t.write_line(f"store i64 {outcome}, ptr {t.add_instruction('getelementptr i64, ptr %ended, i64 1')}")
        t.write_line("br label %done")
        t.write_label("next")
        t.close_loop("k", "vectors", "step", "judged")
        t.write_label("judged")
        t.write_line(f"%lastlane = and i64 {t.add_instruction('sub i64 %limit, 1')}, {t.lanes - 1}")
        # towards a dead point of another block the measure changes as the root of the distance to it
        change = t.call_intrinsic("fabs", t.binary("sub", clear, one))
        ahead = t.binary("sub", clear, t.binary("mul", t.constant(GREATEST_CHANGE), change))
        stays = t.compare("ogt", ahead, self.clearance)
        flag = t.add_instruction(f"extractelement {lanes} {stays}, i64 %lastlane")
        place = t.add_instruction("getelementptr i64, ptr %ended, i64 2")
        t.write_line(f"store i64 {t.add_instruction(f'zext i1 {flag} to i64')}, ptr {place}")
        t.write_line("br label %done")
        self.ir.write_label("done")
        self.ir.end_function()
        t.write_line(f"declare {byte} @llvm.cttz.{byte}({byte}, i1)")

    def _pick(self, predicate: str, a: str, b: str) -> str:
        return self.ir.select(self.ir.compare(predicate, a, b), a, b)

    def _earlier(self, value: str, vectors: Sequence[str], by: int) -> str:
        """The values of a vector shifted by some steps; `vectors` are those before it."""
        t = self.ir
        if by > t.lanes:
            return vectors[1]
        lanes = ", ".join(f"i32 {t.lanes + k - by}" for k in range(t.lanes))
        return t.add_instruction(
            f"shufflevector {t.vector} {vectors[0]}, {t.vector} {value}, <{t.lanes} x i32> <{lanes}>"
        )

    @cached_property
    def function(self) -> Any:
        """The complete function, compiled."""
        return compile_function(self.ir.module_text(), BLOCK_NAME, *BLOCK_ARGUMENT_TYPES)


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
