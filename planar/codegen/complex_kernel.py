"""An instruction list on complex numbers as machine code over many columns, and by numpy in more digits."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import numpy as np

from planar.codegen.formula_kernel import LANES, compile_rows
from planar.codegen.instructions import check_length
from planar.codegen.printed_formula import compile_numpy
from planar.foundation.arrays import ComplexArray
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation, required_values
from planar.foundation.recorded_formula import RecordedFormula, formula_of_results

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
