"""Blocks without closed form followed by Newton's method as machine code, step after step, as blocks of a tape."""

from __future__ import annotations

from functools import lru_cache
from math import inf
from typing import Any

import numpy as np

from planar.batch.march.kernel_writer import write_normalised
from planar.batch.march.prediction import LEAST_COSINE, correction_limit, prediction_weights
from planar.batch.mechanisms.block_type import COS, POSE_ROWS, SIN, BlockType, rotate
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.tape import (
    BLOCK_ARGUMENT_TYPES,
    BLOCK_ARGUMENTS,
    BLOCK_NAME,
    UNDECIDED,
    BlockFormula,
    FormulaInput,
    LinkDirection,
    write_clear_flags,
    write_ended,
    write_stays,
    write_stays_clear,
    write_turn_check,
)
from planar.foundation.arrays import Array

PREDICTOR_ORDER = 5
"""Number of earlier moves from which the next is predicted."""
CORRECTIONS, FIRST_CORRECTIONS = 2, 10
"""Steps of Newton's method where there are enough earlier moves for a prediction, and before."""
TABLE_COLUMNS = PREDICTOR_ORDER + 2


def step_table(steps: int, step: float) -> Array:
    """Of every step of such a length the weights of the moves before, how often it is corrected, and by how much at
    most (steps, TABLE_COLUMNS): what is not where it was predicted may be elsewhere."""
    table = np.zeros((steps, TABLE_COLUMNS))
    table[:, :PREDICTOR_ORDER] = prediction_weights(steps, PREDICTOR_ORDER, 2)
    table[:, -2:] = CORRECTIONS, correction_limit(step)
    table[: PREDICTOR_ORDER + 2, -2], table[: PREDICTOR_ORDER + 1, -1] = FIRST_CORRECTIONS, inf
    return table


def newton_numbers(block_type: BlockType, p: Array, start: Array) -> Array:
    """The numbers of blocks as `compile_newton_block` takes them: p (blocks, numbers) and unknowns to start from
    (blocks, unknowns)."""
    is_angle = block_type.unknown_is_angle
    both = np.stack([np.where(is_angle, np.cos(start), start), np.where(is_angle, np.sin(start), 0.0)], axis=2)
    return np.hstack([p, both.reshape(len(p), -1)])


@lru_cache(maxsize=256)
def compile_newton_block(kind: BlockType, rates: bool) -> Any:
    """The function of a block type, see `planar.codegen.tape`: after its slots there is one of the `step_table`."""
    return compile_function(_NewtonBlockWriter(kind, rates).write(), BLOCK_NAME, *BLOCK_ARGUMENT_TYPES)


class _NewtonBlockWriter:
    """Writes the function of `compile_newton_block`."""

    def __init__(self, kind: BlockType, rates: bool):
        self.ir, self.block_type = IRWriter(1), kind
        self.formulas = kind.newton_formulas
        self.output_formula = self.formulas.poses_and_rates if rates else self.formulas.poses
        self.row_count = POSE_ROWS + 6 if rates else POSE_ROWS
        self.unknown_count = len(kind.unknown_is_angle)
        self.operands = sorted(
            {leaf for formula in (self.formulas.step, self.output_formula) for leaf in formula.inputs.values()}
        )

    def write(self) -> str:
        """The text of the function."""
        t = self.ir
        t.write_line(f"define void @{BLOCK_NAME}({BLOCK_ARGUMENTS}) {{")
        t.write_label("entry")
        self.unknown_slots = [[t.allocate() for _ in range(2)] for _ in range(self.unknown_count)]
        self.history_slots = [[t.allocate() for _ in range(PREDICTOR_ORDER)] for _ in range(self.unknown_count)]
        self.correction_slots = [t.allocate() for _ in range(self.unknown_count)]
        self.direction_slots = [t.allocate() for _ in range(2 * len(self.block_type.inner_links))]
        self.clear_slots = [t.allocate() for _ in range(2)]
        self.regularity_slot = t.allocate()
        names, bases = self._write_block_start()
        t.write_line("br label %step")
        t.write_label("step")
        t.write_line("%k = phi i64 [0, %entry], [%knext, %good]")
        for leaf in self.operands:
            if leaf.source == "row":
                names[leaf] = t.load(self._row_pointer(bases[leaf.place], leaf.part))
        row = t.double_pointer(bases[-1], t.add_instruction(f"mul i64 %k, {TABLE_COLUMNS}"))
        aheads = self._write_prediction(row)
        count = t.add_instruction(f"load double, ptr {t.double_pointer(row, str(PREDICTOR_ORDER))}")
        t.write_line(f"%count = fptosi double {count} to i64")
        t.write_line("br label %newton")
        t.write_label("newton")
        t.write_line("%n = phi i64 [0, %step], [%nnext, %newton]")
        *steps, regularity = self._write_formula(self.formulas.step, names)
        for k, step in enumerate(steps):
            correction = t.add_instruction(f"fneg {t.vector} {step}")
            self._write_move(k, correction)
            t.store(t.binary("add", t.load(self.correction_slots[k]), correction), self.correction_slots[k])
        t.store(regularity, self.regularity_slot)
        t.close_loop("n", "count", "newton", "solved")
        t.write_label("solved")
        self._write_step_end(names, bases, aheads, self._write_load(row, PREDICTOR_ORDER + 1))
        t.write_label("bad")
        write_ended(t, "%k", str(UNDECIDED))
        t.write_line("br label %done")
        t.write_label("good")
        t.close_loop("k", "limit", "step", "judged")
        t.write_label("judged")
        clear, previous = (t.load(slot) for slot in self.clear_slots)
        stays = write_stays_clear(t, clear, previous, self.clearance)
        write_stays(t, t.add_instruction(f"extractelement <1 x i1> {stays}, i64 0"))
        t.write_line("br label %done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        return t.module_text()

    def _write_block_start(self) -> tuple[dict[FormulaInput, str], list[str]]:
        """Load the numbers of a block and the addresses of its slots."""
        t, kind = self.ir, self.block_type
        names = {leaf: self._write_load("%p", leaf.place) for leaf in self.operands if leaf.source == "p"}
        bases = []
        for slot in range(kind.slot_count + 1):
            place = t.add_instruction(f"getelementptr ptr, ptr %rows, i64 {slot}")
            bases.append(t.add_instruction(f"load ptr, ptr {place}"))
        for k, pointer in enumerate(slot_pointer for both in self.unknown_slots for slot_pointer in both):
            t.store(self._write_load("%p", kind.number_count + k), pointer)
        for pointer in (slot_pointer for slots in self.history_slots for slot_pointer in slots):
            t.store("zeroinitializer", pointer)
        for pointer in (*self.direction_slots, *self.clear_slots):
            t.store(t.constant(np.nan), pointer)
        self.tolerance, self.clearance = t.broadcast("%tolerance"), t.broadcast("%clearance")
        return names, bases

    def _row_pointer(self, base: str, row: int) -> str:
        return self.ir.row_pointer(base, "%stride", row, "%k")

    def _write_step_end(self, names: dict[FormulaInput, str], bases: list[str], aheads: list[str], limit: str) -> None:
        """Write the results of a step, judge them, and store its moves."""
        t, kind = self.ir, self.block_type
        *outputs, residual = self._write_formula(self.output_formula, names)
        first = kind.slot_count - len(kind.inner_links)
        for number, value in enumerate(outputs):
            t.store(value, self._row_pointer(bases[first + number // self.row_count], number % self.row_count))
        far = t.add_all([t.constant(0.0), *(t.call_intrinsic("fabs", t.load(slot)) for slot in self.correction_slots)])
        for slots, ahead, moved in zip(self.history_slots, aheads, self.correction_slots, strict=True):
            move = t.binary("add", ahead, t.load(moved))
            for later, earlier in zip(reversed(slots[1:]), reversed(slots[:-1]), strict=True):
                t.store(t.load(earlier), later)
            t.store(move, slots[0])
        is_good = t.and_flags(t.compare("ole", residual, self.tolerance), t.compare("ole", far, limit))
        places = range(0, len(outputs), self.row_count)
        directions = [LinkDirection(outputs[number + COS], outputs[number + SIN], None) for number in places]
        is_good = write_turn_check(t, is_good, directions, self.direction_slots, LEAST_COSINE)
        clear, previous, earlier = (t.load(slot) for slot in (self.regularity_slot, *self.clear_slots))
        fine = t.and_flags(is_good, write_clear_flags(t, clear, previous, earlier, self.clearance).is_clear)
        t.store(clear, self.clear_slots[0])
        t.store(previous, self.clear_slots[1])
        t.write_line(f"br i1 {t.add_instruction(f'extractelement <1 x i1> {fine}, i64 0')}, label %good, label %bad")

    def _write_load(self, base: str, place: int) -> str:
        t = self.ir
        return t.broadcast(t.add_instruction(f"load double, ptr {t.double_pointer(base, str(place))}"))

    def _write_prediction(self, row: str) -> list[str]:
        """Move the unknowns by their predicted moves, with the weights in a row of the table."""
        t = self.ir
        weights = [self._write_load(row, k) for k in range(PREDICTOR_ORDER)]
        aheads = []
        for k, slots in enumerate(self.history_slots):
            ahead = t.add_all([t.binary("mul", w, t.load(slot)) for w, slot in zip(weights, slots, strict=True)])
            self._write_move(k, ahead)
            t.store("zeroinitializer", self.correction_slots[k])
            aheads.append(ahead)
        return aheads

    def _write_move(self, k: int, by: str) -> None:
        """Add a move to an unknown: to an angle by the rational rotation."""
        t, (first, second) = self.ir, self.unknown_slots[k]
        if not self.block_type.unknown_is_angle[k]:
            t.store(t.binary("add", t.load(first), by), first)
            return
        rotated = rotate(t.binary, t.constant, t.load(first), t.load(second), by)
        # back onto the circle, which rounding leaves
        for value, slot in zip(write_normalised(t, *rotated), (first, second), strict=True):
            t.store(value, slot)

    def _write_formula(self, formula: BlockFormula, names: dict[FormulaInput, str]) -> list[str]:
        t = self.ir
        inputs = {}
        for number, leaf in formula.inputs.items():
            inputs[number] = t.load(self.unknown_slots[leaf.place][leaf.part]) if leaf.source == "z" else names[leaf]
        known: dict[int, str] = {}
        t.write_values(formula.instructions, formula.order, known, inputs)
        return [known[number] for number in formula.outputs]
