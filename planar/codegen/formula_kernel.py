"""A recorded formula as machine code at many positions at once, of real or of complex numbers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np

from planar.codegen.instructions import check_length
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.codegen.printed_formula import compile_numpy
from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation, required_values
from planar.foundation.recorded_formula import RecordedFormula, formula_of_results

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
    writer.write_line("ret void")
    writer.write_line("}")
    return compile_function(writer.module_text(), "run", "int", "int", *["array"] * 3)


ComplexPair = tuple[int, int]
"""The real and the imaginary part of a value, as values of a list of real numbers."""


class ComplexKernel:
    """Computes rows of complex values from rows of complex operands, column by column.

    The machine code is made at the first call; of operands in more digits numpy computes.
    """

    def __init__(self, instructions: InstructionList[Any], outputs: Sequence[int], operands: Sequence[int]):
        self.instructions, self.outputs, self.operands = instructions, list(outputs), list(operands)
        self._numpy = compile_numpy(instructions, outputs, operands)

    @cached_property
    def _native(self) -> Any:
        """The machine code of real and imaginary parts; None where there is none."""
        try:
            formula = real_formula(self.instructions, self.outputs, self.operands)
            check_length(len(formula.instructions))
            rows = [(2 * row, 2 * row + 1) for row in range(len(self.operands))]
            results = list(zip(formula.results[::2], formula.results[1::2], strict=True))
            return compile_rows(formula, rows, (), results, contracts=True)
        except UnsupportedOperation:
            return None

    def __call__(self, operands: ComplexArray) -> ComplexArray:
        """Outputs (outputs, columns) of operands (operands, columns); columns are a multiple of LANES."""
        columns = operands.shape[1]
        if operands.dtype != np.complex128 or self._native is None or not columns:
            return self.in_numpy(operands)
        operands = np.ascontiguousarray(operands)
        result: ComplexArray = np.empty((len(self.outputs), columns), dtype=complex)
        self._native(columns // LANES, columns, operands.ctypes.data, None, result.ctypes.data)
        return result

    def in_numpy(self, operands: ComplexArray) -> ComplexArray:
        """The same by numpy, in the digits that operands have."""
        result: ComplexArray = np.empty((len(self.outputs), operands.shape[1]), dtype=operands.dtype)
        for k, value in enumerate(self._numpy(*operands)):
            result[k] = value
        return result


def real_formula(
    instructions: InstructionList[Any], outputs: Sequence[int], operands: Sequence[int]
) -> RecordedFormula:
    """The formula of the real and imaginary parts of outputs, one output after the other, of those of operands.

    Raises UnsupportedOperation for what is no sum, difference, product or sign.
    """
    real: InstructionList[int] = InstructionList()
    pairs: dict[int, ComplexPair] = {}
    for row, number in enumerate(operands):
        pairs[number] = real.add_input(2 * row), real.add_input(2 * row + 1)
    for number in required_values(instructions, outputs, pairs):
        if number in pairs:
            continue
        value = instructions.instructions[number]
        parts = [pairs[operand] for operand in value.operands]
        if value.operation == "const":
            pairs[number] = real.add_constant(value.number), real.add_constant(0.0)
        elif value.operation in ("add", "sub"):
            (a, b), (c, d) = parts
            pairs[number] = real.add(value.operation, a, c), real.add(value.operation, b, d)
        elif value.operation == "neg":
            pairs[number] = real.add("neg", parts[0][0]), real.add("neg", parts[0][1])
        elif value.operation == "mul":
            (a, b), (c, d) = parts
            products = [real.add("mul", one, other) for one, other in ((a, c), (b, d), (a, d), (b, c))]
            pairs[number] = real.add("sub", *products[:2]), real.add("add", *products[2:])
        else:
            raise UnsupportedOperation(f"there is no {value.operation} of complex numbers")
    return formula_of_results(real, [part for number in outputs for part in pairs[number]])
