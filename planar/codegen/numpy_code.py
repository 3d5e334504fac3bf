"""Instruction lists as Python source of numpy: the same values for arrays of any shape, one statement each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from planar.codegen.instructions import InstructionList, UnsupportedOperation, required_values

NUMPY_OPERATORS = {"add": "+", "sub": "-", "mul": "*", "div": "/"}
NUMPY_COMPARISONS = {"less": "<", "most": "<="}
"""What gives 1 where it is true, else 0."""
NUMPY_FUNCTIONS = {
    "sqrt": np.sqrt,
    "abs": np.abs,
    "cos": np.cos,
    "sin": np.sin,
    "atan2": np.arctan2,
    "minnum": np.fmin,
    "maxnum": np.fmax,
    "floor": np.floor,
}
NumpyFunction = Callable[..., tuple[Any, ...]]
"""Arrays, or numbers, of the operands in their order, to the values that are wanted."""


def write_numpy(instructions: InstructionList[Any], wanted: Sequence[int], operands: Sequence[int]) -> str:
    """The source of `values`, a function of the operands: numbers of instructions that are known.

    A value's name is taken again once nothing needs the value, so that few arrays are in use, and in the cache.
    Raises UnsupportedOperation.
    """
    names = {number: f"x{k}" for k, number in enumerate(operands)}
    lines = [f"def values({', '.join(names.values())}):"]
    order = [number for number in required_values(instructions, wanted, names) if number not in names]
    last_use = {operand: number for number in order for operand in instructions.instructions[number].operands}
    last_use |= dict.fromkeys(wanted, -1)
    free: list[str] = []
    count = 0
    for number in order:
        operation, of, constant, _ = instructions.instructions[number]
        if operation == "const":
            names[number] = f"({constant!r})"
            continue
        expression = _expression(operation, [names[each] for each in of])
        free += [names[each] for each in dict.fromkeys(of) if last_use[each] == number and names[each][0] == "r"]
        if not free:
            free.append(f"r{count}")
            count += 1
        names[number] = free.pop()
        lines.append(f"    {names[number]} = {expression}")
    lines.append(f"    return ({''.join(names[number] + ', ' for number in wanted)})")
    return "\n".join(lines)


def compile_numpy(instructions: InstructionList[Any], wanted: Sequence[int], operands: Sequence[int]) -> NumpyFunction:
    """The function of `write_numpy`, ready to be called."""
    scope: dict[str, Any] = {**NUMPY_FUNCTIONS, "nan": np.nan, "inf": np.inf}
    exec(write_numpy(instructions, wanted, operands), scope)
    compiled: NumpyFunction = scope["values"]
    return compiled


def _expression(operation: str, of: list[str]) -> str:
    if operation in NUMPY_OPERATORS:
        return f"{of[0]} {NUMPY_OPERATORS[operation]} {of[1]}"
    if operation in NUMPY_COMPARISONS:
        return f"1.0 * ({of[0]} {NUMPY_COMPARISONS[operation]} {of[1]})"
    if operation == "neg":
        return f"-{of[0]}"
    if operation in NUMPY_FUNCTIONS:
        return f"{operation}({', '.join(of)})"
    raise UnsupportedOperation(f"there is no {operation} on arrays")
