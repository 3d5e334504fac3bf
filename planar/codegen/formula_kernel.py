"""A recorded formula as machine code, at many positions at once."""

from __future__ import annotations

from collections.abc import Callable, Sequence

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
    run = compile_function(_write_ir(formula, argument_counts, varies), "run", "int", "int", *["array"] * 3)
    varying_count = sum(count for count, is_varying in zip(argument_counts, varies, strict=True) if is_varying)
    still_count = sum(argument_counts) - varying_count
    result_count = len(formula.results)

    def evaluate(count: int, arguments: Sequence[Array]) -> Array:
        stride = -(-count // LANES) * LANES
        varying, still = np.empty((varying_count, stride)), np.empty(still_count)
        row = place = 0
        for argument, is_varying in zip(arguments, varies, strict=True):
            if is_varying:
                varying[row : row + len(argument), :count] = argument
                row += len(argument)
            else:
                still[place : place + len(argument)] = argument
                place += len(argument)
        results: Array = np.empty((result_count, stride))
        if count:
            run(stride // LANES, stride, *(array.ctypes.data for array in (varying, still, results)))
        return results[:, :count]

    return evaluate


def _write_ir(formula: RecordedFormula, argument_counts: Sequence[int], varies: Sequence[bool]) -> str:
    """run(vectors, stride, varying, still, results): entries that vary and results in rows `stride` apart."""
    writer = IRWriter(LANES, contracts=False)
    writer.write_line(
        "define void @run(i64 %vectors, i64 %stride, ptr readonly %varying, ptr readonly %still, ptr %results) {"
    )
    writer.write_label("entry")
    places: list[tuple[bool, int]] = []
    rows = [0, 0]
    for count, is_varying in zip(argument_counts, varies, strict=True):
        places += [(is_varying, rows[is_varying] + k) for k in range(count)]
        rows[is_varying] += count
    inputs: dict[int, str] = {}
    bases: dict[int, str] = {}
    keys = [(number, value.key) for number, value in enumerate(formula.instructions) if value.key is not None]
    for number, key in keys:
        is_varying, place = places[key]
        if is_varying:
            bases[number] = writer.add_instruction(f"mul i64 %stride, {place}")
        else:
            one = writer.add_instruction(f"load double, ptr {writer.double_pointer('%still', str(place))}")
            inputs[number] = writer.broadcast(one)
    targets = [writer.add_instruction(f"mul i64 %stride, {place}") for place in range(len(formula.results))]
    writer.write_line("br label %vector")
    writer.write_label("vector")
    writer.write_line("%v = phi i64 [0, %entry], [%vnext, %vector]")
    writer.write_line(f"%first = mul i64 %v, {LANES}")
    for number, base in bases.items():
        index = writer.add_instruction(f"add i64 {base}, %first")
        inputs[number] = writer.load(writer.double_pointer("%varying", index))
    names: dict[int, str] = {}
    writer.write_values(formula, range(len(formula.instructions)), names, inputs)
    for base, result in zip(targets, formula.results, strict=True):
        index = writer.add_instruction(f"add i64 {base}, %first")
        writer.store(names[result], writer.double_pointer("%results", index))
    writer.close_loop("v", "vectors", "vector", "done")
    writer.write_label("done")
    writer.write_line("ret void")
    writer.write_line("}")
    return writer.module_text()
