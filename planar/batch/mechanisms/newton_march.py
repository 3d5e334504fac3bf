"""Blocks without closed form marched by Newton's method as machine code, step after step."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.prediction import extrapolation_weights
from planar.batch.mechanisms.block_type import POSE_ROWS, BlockType
from planar.codegen.block_formula import BlockFormula, FormulaInput
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.turns import leave_turn

Array = np.ndarray

PREDICTOR_ORDER = 5
"""Moves before from which the next is predicted."""
CORRECTIONS, FIRST_CORRECTIONS = 2, 10
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
CHECK_ROWS = 3
"""Rows that are told outside the links' places: what is left open, the square of how regular, how far corrected."""


class NewtonRun(NamedTuple):
    """What is told of groups (groups, steps): left open, the square of how regular, how far from where predicted."""

    residuals: Array
    squared_regularity: Array
    corrections: Array


def step_table(steps: int) -> tuple[Array, Array]:
    """Of every step the weights of those before, and how often it is corrected."""
    table, counts = np.zeros((steps, PREDICTOR_ORDER)), np.full(steps, CORRECTIONS, dtype=np.int64)
    for step in range(steps):
        known = min(max(step - 1, 0), PREDICTOR_ORDER)
        table[step, :known] = extrapolation_weights(known)
    counts[: PREDICTOR_ORDER + 2] = FIRST_CORRECTIONS
    return table, counts


def run_newton(block_type: BlockType, state: Array, index: Array, p: Array, start: Array, rates: bool) -> NewtonRun:
    """Follow groups (many,) of a kind through all steps from unknowns start (many, unknowns).

    Their places index (many, slots) in state (slots, rows, steps) are filled; p (many, numbers).
    """
    many, steps = len(index), state.shape[2]
    outside = np.empty((many, CHECK_ROWS, steps))
    places = np.ascontiguousarray(index, dtype=np.int64) * (state.shape[1] * steps)
    table, counts = step_table(steps)
    is_angle = block_type.unknown_is_angle
    both = np.stack([np.where(is_angle, np.cos(start), start), np.where(is_angle, np.sin(start), 0.0)], axis=2)
    arrays = places, np.ascontiguousarray(p), np.ascontiguousarray(both), table, counts, state, outside
    follow = _compile_newton_kernel(block_type, rates)
    with leave_turn():
        follow(many, steps, steps, *(each.ctypes.data for each in arrays))
    return NewtonRun(outside[:, 0], outside[:, 1], outside[:, 2])


@lru_cache(maxsize=256)
def _compile_newton_kernel(kind: BlockType, rates: bool) -> Any:
    kinds = ("int", "int", "int", *("array",) * 7)
    return compile_function(_NewtonKernelWriter(kind, rates).write(), "follow", *kinds)


class _NewtonKernelWriter:
    """follow(many, steps, stride, index, p, start, table, counts, state, outside), step after step of each group."""

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
        arrays = "ptr readonly %index, ptr readonly %p, ptr readonly %start, ptr readonly %table, ptr readonly %counts"
        t.write_line(f"define void @follow(i64 %many, i64 %steps, i64 %stride, {arrays}, ptr %state, ptr %outside) {{")
        t.write_label("entry")
        self.unknown_slots = [[t.allocate() for _ in range(2)] for _ in range(self.unknown_count)]
        self.history_slots = [[t.allocate() for _ in range(PREDICTOR_ORDER)] for _ in range(self.unknown_count)]
        self.correction_slots = [t.allocate() for _ in range(self.unknown_count)]
        self.regularity_slot = t.allocate()
        t.write_line("br label %instance")
        have, bases = self._write_block_start()
        t.write_line("br label %step")
        t.write_label("step")
        t.write_line("%k = phi i64 [0, %instance], [%knext, %solved]")
        for leaf in self.operands:
            if leaf.source == "row":
                have[leaf] = t.load(self._state_pointer(bases[leaf.place], leaf.part))
        aheads = self._write_prediction()
        t.write_line(f"%count = load i64, ptr {t.add_instruction('getelementptr i64, ptr %counts, i64 %k')}")
        t.write_line("br label %newton")
        t.write_label("newton")
        t.write_line("%n = phi i64 [0, %step], [%nnext, %newton]")
        *back, strength = self._write_formula(self.formulas.step, have)
        for k, each in enumerate(back):
            forth = t.add_instruction(f"fneg {t.vector} {each}")
            self._write_move(k, forth)
            t.store(t.binary("add", t.load(self.correction_slots[k]), forth), self.correction_slots[k])
        t.store(strength, self.regularity_slot)
        t.close_loop("n", "count", "newton", "solved")
        t.write_label("solved")
        self._write_step_end(have, bases, aheads)
        t.close_loop("k", "steps", "step", "instanceend")
        t.write_label("instanceend")
        t.close_loop("i", "many", "instance", "done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        return t.module_text()

    def _write_block_start(self) -> tuple[dict[FormulaInput, str], list[str]]:
        """A group begins: its numbers, and where its places are."""
        t, kind = self.ir, self.block_type
        have: dict[FormulaInput, str] = {}
        t.write_label("instance")
        t.write_line("%i = phi i64 [0, %entry], [%inext, %instanceend]")
        begin = t.add_instruction(f"mul i64 %i, {len(kind.measures) + 2 * len(kind.angle_measures)}")
        for leaf in self.operands:
            if leaf.source == "p":
                have[leaf] = self._write_load("%p", t.add_instruction(f"add i64 {begin}, {leaf.place}"))
        begin = t.add_instruction(f"mul i64 %i, {kind.slot_count}")
        bases = []
        for slot in range(kind.slot_count):
            place = t.add_instruction(
                f"getelementptr i64, ptr %index, i64 {t.add_instruction(f'add i64 {begin}, {slot}')}"
            )
            bases.append(t.add_instruction(f"load i64, ptr {place}"))
        begin = t.add_instruction(f"mul i64 %i, {2 * self.unknown_count}")
        for k, both in enumerate(self.unknown_slots):
            for part, pointer in enumerate(both):
                t.store(self._write_load("%start", t.add_instruction(f"add i64 {begin}, {2 * k + part}")), pointer)
        for pointer in (each for own in self.history_slots for each in own):
            t.store("zeroinitializer", pointer)
        self.check_offset = t.add_instruction(f"mul i64 {t.add_instruction('mul i64 %i, %stride')}, {CHECK_ROWS}")
        return have, bases

    def _state_pointer(self, base: str, row: int) -> str:
        t = self.ir
        return t.double_pointer(
            "%state",
            t.add_instruction(
                f"add i64 {t.add_instruction(f'add i64 {base}, %k')}, {t.add_instruction(f'mul i64 %stride, {row}')}"
            ),
        )

    def _write_step_end(self, have: dict[FormulaInput, str], bases: list[str], aheads: list[str]) -> None:
        """The step ends: its results are written, and what it moved is remembered."""
        t, kind = self.ir, self.block_type
        *told, left = self._write_formula(self.output_formula, have)
        first = kind.slot_count - len(kind.inner_links)
        for number, value in enumerate(told):
            t.store(value, self._state_pointer(bases[first + number // self.row_count], number % self.row_count))
        far = t.add_all([t.constant(0.0), *(t.call_intrinsic("fabs", t.load(slot)) for slot in self.correction_slots)])
        for row, value in enumerate((left, t.load(self.regularity_slot), far)):
            place = t.add_instruction(
                f"add i64 {t.add_instruction(f'add i64 {self.check_offset}, %k')}, "
                f"{t.add_instruction(f'mul i64 %stride, {row}')}"
            )
            t.store(value, t.double_pointer("%outside", place))
        for own, ahead, moved in zip(self.history_slots, aheads, self.correction_slots, strict=True):
            whole = t.binary("add", ahead, t.load(moved))
            for later, earlier in zip(reversed(own[1:]), reversed(own[:-1]), strict=True):
                t.store(t.load(earlier), later)
            t.store(whole, own[0])

    def _write_load(self, base: str, place: str) -> str:
        return self.ir.broadcast(self.ir.add_instruction(f"load double, ptr {self.ir.double_pointer(base, place)}"))

    def _write_prediction(self) -> list[str]:
        """Move the unknowns to where they would be if they went on as before."""
        t = self.ir
        begin = t.add_instruction(f"mul i64 %k, {PREDICTOR_ORDER}")
        weights = [
            self._write_load("%table", t.add_instruction(f"add i64 {begin}, {k}")) for k in range(PREDICTOR_ORDER)
        ]
        aheads = []
        for k, own in enumerate(self.history_slots):
            ahead = t.add_all([t.binary("mul", w, t.load(slot)) for w, slot in zip(weights, own, strict=True)])
            self._write_move(k, ahead)
            t.store("zeroinitializer", self.correction_slots[k])
            aheads.append(ahead)
        return aheads

    def _write_move(self, k: int, by: str) -> None:
        """Move an unknown on: a length by so much, an angle by the rational rotation."""
        t, (one, two) = self.ir, self.unknown_slots[k]
        if not self.block_type.unknown_is_angle[k]:
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

    def _write_formula(self, formula: BlockFormula, have: dict[FormulaInput, str]) -> list[str]:
        t = self.ir
        given = {}
        for number, leaf in formula.inputs.items():
            given[number] = t.load(self.unknown_slots[leaf.place][leaf.part]) if leaf.source == "z" else have[leaf]
        known: dict[int, str] = {}
        t.write_values(formula.instructions, formula.order, known, given)
        return [known[number] for number in formula.outputs]
