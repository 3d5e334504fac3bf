"""A recorded formula as machine code, at many positions at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.arrays import Array
from planar.foundation.recorded_formula import RecordedFormula

LANES = 8
"""Positions that are worked on at once."""
FormulaKernel = Callable[[int, Sequence[Array]], Array]
"""(positions, arguments (entries, positions) or (entries,)) -> results (results, positions)."""


def compile_kernel(formula: RecordedFormula, argument_counts: Sequence[int], varies: Sequence[bool]) -> FormulaKernel:
    """The machine code of a formula; which of its arguments vary from position to position. Raises
    UnsupportedOperation."""
    varying: list[tuple[int, ...]] = []
    still: list[int] = []
    place = 0
    for count, is_varying in zip(argument_counts, varies, strict=True):
        keys = range(place, place + count)
        place += count
        if is_varying:
            varying += zip(keys)
        else:
            still += keys
    run = compile_rows(formula, varying, still, list(zip(formula.results)), contracts=False)

    def evaluate(count: int, arguments: Sequence[Array]) -> Array:
        stride = -(-count // LANES) * LANES
        rows = np.empty((len(varying), stride))
        numbers = np.empty(len(still))
        parts: tuple[list[Array], list[Array]] = [numbers[:0]], [rows[:0, :count]]
        for argument, is_varying in zip(arguments, varies, strict=True):
            parts[is_varying].append(argument)
        np.concatenate(parts[0], out=numbers)
        np.concatenate(parts[1], out=rows[:, :count])
        results: Array = np.empty((len(formula.results), stride))
        if count:
            run(stride // LANES, stride, *(array.ctypes.data for array in (rows, numbers, results)))
        return results[:, :count]

    return evaluate


def compile_rows(
    formula: RecordedFormula,
    varying: Sequence[tuple[int, ...]],
    still: Sequence[int],
    results: Sequence[tuple[int, ...]],
    contracts: bool,
) -> Any:
    """run(vectors, stride, varying, still, results): entries that vary and results in rows `stride` apart.

    `varying` and `still` are the keys of inputs, `results` values of the formula. A row has one of them at every
    position, or two beside each other, as the parts of complex numbers are. `contracts`: whether a product and a sum
    may be rounded once.
    """
    writer = IRWriter(LANES, contracts)
    writer.write_line(
        "define void @run(i64 %vectors, i64 %stride, ptr noalias readonly %varying, ptr readonly %still, "
        "ptr noalias %results) {"
    )
    writer.write_label("entry")
    by_key: dict[int, str] = {}
    for index, key in enumerate(still):
        number = writer.add_instruction(f"load double, ptr {writer.double_pointer('%still', str(index))}")
        by_key[key] = writer.broadcast(number)

    writer.write_line("br label %vector")
    writer.write_label("vector")
    writer.write_line("%v = phi i64 [0, %entry], [%vnext, %vector]")
    first = {width: writer.add_instruction(f"mul i64 %v, {width * LANES}") for width in (1, 2)}

    def pointer(base: str, row: int, width: int) -> str:
        return writer.row_pointer(base, "%stride", width * row, first[width])

    for row, keys in enumerate(varying):
        place = pointer("%varying", row, len(keys))
        values = writer.load_pairs(place) if len(keys) == 2 else (writer.load(place),)
        by_key |= zip(keys, values, strict=True)
    inputs = {k: by_key[value.key] for k, value in enumerate(formula.instructions) if value.key is not None}
    names: dict[int, str] = {}
    writer.write_values(formula, range(len(formula.instructions)), names, inputs)
    for row, parts in enumerate(results):
        place = pointer("%results", row, len(parts))
        if len(parts) == 2:
            writer.store_pairs(names[parts[0]], names[parts[1]], place)
        else:
            writer.store(names[parts[0]], place)
    writer.close_loop("v", "vectors", "vector", "done")
    writer.write_label("done")
    writer.end_function()
    return compile_function(writer.module_text(), "run", "int", "int", *["array"] * 3)
