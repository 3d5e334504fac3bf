"""An instruction list on complex numbers as machine code over many columns, and by numpy in more digits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.codegen.instructions import check_length
from planar.codegen.printed_formula import compile_numpy
from planar.foundation.arrays import ComplexArray
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation, required_values

LANES = 8
"""Columns that are computed at once; the arrays have a multiple of so many."""

ComplexPair = tuple[int, int]
"""The real and the imaginary part of a value, as values of a list of real numbers."""


class ComplexKernel:
    """Computes rows of complex values from rows of complex operands, column by column.

    The machine code is made at the first call; of operands in more digits numpy computes.
    """

    def __init__(self, instructions: InstructionList[Any], outputs: Sequence[int], operands: Sequence[int]):
        self.instructions, self.outputs, self.operands = instructions, list(outputs), list(operands)
        self._numpy = compile_numpy(instructions, outputs, operands)
        self._native: Any = None
        self._can_be_native = True

    def __call__(self, operands: ComplexArray) -> ComplexArray:
        """Outputs (outputs, columns) of operands (operands, columns); columns are a multiple of LANES."""
        columns = operands.shape[1]
        if self._native is None and self._can_be_native:
            self._compile()
        if operands.dtype != np.complex128 or self._native is None or not columns:
            return self.in_numpy(operands)
        operands = np.ascontiguousarray(operands)
        result: ComplexArray = np.empty((len(self.outputs), columns), dtype=complex)
        self._native(columns // LANES, columns, operands.ctypes.data, result.ctypes.data)
        return result

    def in_numpy(self, operands: ComplexArray) -> ComplexArray:
        """The same by numpy, for columns of any number and in the digits that operands have."""
        result: ComplexArray = np.empty((len(self.outputs), operands.shape[1]), dtype=operands.dtype)
        for k, value in enumerate(self._numpy(*operands)):
            result[k] = value
        return result

    def _compile(self) -> None:
        from planar.codegen.llvm_compile import compile_function

        try:
            text = write_complex_ir(self.instructions, self.outputs, self.operands)
        except UnsupportedOperation:
            self._can_be_native = False
            return
        self._native = compile_function(text, "columns", "int", "int", "array", "array")


def write_complex_ir(instructions: InstructionList[Any], outputs: Sequence[int], operands: Sequence[int]) -> str:
    """LLVM IR of columns(vectors, stride, operands, outputs), whose rows of complex numbers are `stride` apart.

    Raises UnsupportedOperation for what is too long or no sum, difference, product or sign.
    """
    from planar.codegen.llvm_ir import IRWriter

    listing, pairs = real_instructions(instructions, outputs, operands)
    wanted = [part for number in outputs for part in pairs[number]]
    check_length(len(listing.instructions))
    t = IRWriter(LANES)
    t.write_line("define void @columns(i64 %vectors, i64 %stride, ptr noalias readonly %from, ptr noalias %to) {")
    t.write_label("entry")
    t.write_line("br label %step")
    t.write_label("step")
    t.write_line("%v = phi i64 [0, %entry], [%vnext, %step]")
    t.write_line(f"%off = mul i64 %v, {LANES}")

    def place(base: str, row: int) -> str:
        column = t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 %stride, {row}')}, %off")
        return t.double_pointer(base, t.add_instruction(f"mul i64 {column}, 2"))

    inputs: dict[int, str] = {}
    for row, number in enumerate(operands):
        inputs |= dict(zip(pairs[number], t.load_pairs(place("%from", row)), strict=True))
    names: dict[int, str] = {}
    t.write_values(listing, required_values(listing, wanted), names, inputs)
    for row, number in enumerate(outputs):
        first, second = (names[part] for part in pairs[number])
        t.store_pairs(first, second, place("%to", row))
    t.close_loop("v", "vectors", "step", "done")
    t.write_label("done")
    t.write_line("ret void")
    t.write_line("}")
    return t.module_text()


def real_instructions(
    instructions: InstructionList[Any], outputs: Sequence[int], operands: Sequence[int]
) -> tuple[InstructionList[tuple[int, int]], dict[int, ComplexPair]]:
    """The same values in real and imaginary parts: a list, and where both parts of each value are.

    Raises UnsupportedOperation.
    """
    real: InstructionList[tuple[int, int]] = InstructionList()
    pairs: dict[int, ComplexPair] = {}
    for row, number in enumerate(operands):
        pairs[number] = real.add_input((row, 0)), real.add_input((row, 1))
    for number in required_values(instructions, outputs, pairs):
        if number in pairs:
            continue
        value = instructions.instructions[number]
        parts = [pairs[each] for each in value.operands]
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
    return real, pairs
