"""A formula that many blocks share, and its run by numpy over slots of memory."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.instructions import InstructionList, required_values
from planar.codegen.numpy_code import NumpyFunction, compile_numpy
from planar.foundation.arrays import Array


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

    def evaluate_numpy(self, taken: dict[FormulaInput, Any]) -> list[Any]:
        """The wanted values where what the formula takes are arrays, or numbers."""
        with np.errstate(all="ignore"):  # what cannot be assembled is no number, and judged as such
            return list(self._numpy_function(*(taken[each] for each in self.inputs.values())))

    @cached_property
    def _numpy_function(self) -> NumpyFunction:
        return compile_numpy(self.instructions, self.outputs, tuple(self.inputs))


def share_reciprocals(formula: BlockFormula) -> BlockFormula:
    """The same formula with one division for all that is divided by the same, and none by what does not vary."""
    source, made = formula.instructions, InstructionList[FormulaInput]()
    numbers: dict[int, int] = {}
    still: set[int] = set()
    below = Counter(
        source.instructions[k].operands[1] for k in formula.order if source.instructions[k].operation == "div"
    )
    for k in formula.order:
        value = source.instructions[k]
        of = [numbers[each] for each in value.operands]
        if (
            value.operation == "const"
            or (value.key is not None and value.key.source == "p")
            or (value.operands and still.issuperset(value.operands))
        ):
            still.add(k)
        by = value.operands[1] if value.operation == "div" else None
        if by is not None and k not in still and (by in still or below[by] > 1):
            numbers[k] = made.add("mul", of[0], made.add("div", made.add_constant(1.0), of[1]))
        else:
            numbers[k] = made.add_again(value, of)
    inputs = {numbers[k]: leaf for k, leaf in formula.inputs.items()}
    return BlockFormula(made, tuple(numbers[k] for k in formula.outputs), inputs)


class KernelLayout(NamedTuple):
    """What a printed formula walks over: the slots that it takes and gives, how many numbers it takes, and rows that
    it gives outside the slots.

    `quick`: of the two rows outside, what is left open and how clear it is, machine code tells the greatest and the
    least alone, beside the greatest second difference of the latter, and the fastest change of rows 2 and 3 of the
    slots that are given (cosines and sines).
    """

    output_rows: tuple[tuple[int, int], ...]
    number_count: int
    slot_count: int
    extra_row_count: int
    extremes_only: bool = False


def run_formula(formula: BlockFormula, layout: KernelLayout, state: Array, index: Array, p: Array) -> Array:
    """Run a formula for instances (many,) whose slots are index (many, slots) of state (slots, rows, steps).

    p (many, numbers). What it gives is written into the slots; what is left (many, rows, steps) is returned.
    """
    many, steps = len(index), state.shape[2]
    outside, p = np.empty((many, layout.extra_row_count, steps)), np.ascontiguousarray(p)
    taken: dict[FormulaInput, Any] = {}
    for leaf in formula.inputs.values():
        if leaf.source == "p":
            taken[leaf] = p[:, leaf.place, None]
        else:
            taken[leaf] = state[index[:, leaf.place], leaf.part]
    found = formula.evaluate_numpy(taken)
    for k, value in enumerate(found):
        if k < len(layout.output_rows):
            slot, row = layout.output_rows[k]
            state[index[:, slot], row] = value
        else:
            outside[:, k - len(layout.output_rows)] = value
    return outside
