"""The instructions of a casadi function carried out on numbers of another kind: balls, symbols, or new instructions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import casadi as ca

OPERATIONS: Mapping[int, Callable[..., Any]] = {
    ca.OP_ADD: lambda a, b: a + b,
    ca.OP_SUB: lambda a, b: a - b,
    ca.OP_MUL: lambda a, b: a * b,
    ca.OP_DIV: lambda a, b: a / b,
    ca.OP_NEG: lambda a: -a,
    ca.OP_COS: lambda a: a.cos(),
    ca.OP_SIN: lambda a: a.sin(),
    ca.OP_SQ: lambda a: a * a,
    ca.OP_TWICE: lambda a: a + a,
    ca.OP_INV: lambda a: 1 / a,
    ca.OP_ASSIGN: lambda a: a,
}
"""What the coefficients of a linkage are made of."""


def apply_operation(code: int, operands: Sequence[Any]) -> Any:
    """What an operation of casadi makes of numbers of any kind. Raises KeyError for one that is not of `OPERATIONS`."""
    return OPERATIONS[code](*operands)


def evaluate_function(
    function: ca.Function,
    inputs: Sequence[Sequence[Any]],
    convert: Callable[[float], Any],
    apply: Callable[[int, list[Any]], Any] = apply_operation,
) -> list[list[Any]]:
    """The results of a function, dense, column by column; `convert` makes a constant, `apply` a casadi operation."""
    work: dict[int, Any] = {}
    found: list[list[Any]] = [[convert(0.0)] * function.numel_out(k) for k in range(function.n_out())]
    places = [function.sparsity_out(k).find() for k in range(function.n_out())]
    for k in range(function.n_instructions()):
        code, out, of = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        if code == ca.OP_INPUT:
            work[out[0]] = inputs[of[0]][of[1]]
        elif code == ca.OP_CONST:
            work[out[0]] = convert(function.instruction_constant(k))
        elif code == ca.OP_OUTPUT:
            found[out[0]][places[out[0]][out[1]]] = work[of[0]]
        else:
            work[out[0]] = apply(code, [work[each] for each in of])
    return found
