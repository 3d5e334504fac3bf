"""Casadi functions printed as JavaScript, from the same instructions as machine code is made of."""

from __future__ import annotations

from math import isnan

import casadi as ca

from planar.equations.generic_evaluation import inline_function
from planar.foundation.instruction_list import InstructionList, required_values

CASE_OPERATIONS = {ca.OP_NOT: "not", ca.OP_IF_ELSE_ZERO: "where"}
"""What machine code is not asked for."""

JS_OPERATORS = {"add": "+", "sub": "-", "mul": "*", "div": "/", "less": "<", "most": "<="}
JS_FUNCTIONS = {
    "sqrt": "Math.sqrt",
    "cos": "Math.cos",
    "sin": "Math.sin",
    "abs": "Math.abs",
    "atan2": "Math.atan2",
    "minnum": "Math.min",
    "maxnum": "Math.max",
    "floor": "Math.floor",
}


def write_javascript(name: str, function: ca.Function) -> str:
    """A function of arrays, the last of which receives all results, one dense matrix after the other, column by column.

    Raises UnsupportedOperation where it holds an operation that is not known.
    """
    listing: InstructionList[tuple[int, int]] = InstructionList()
    inputs = [[listing.add_input((k, at)) for at in range(function.numel_in(k))] for k in range(function.n_in())]
    wanted = [value for result in inline_function(listing, function, inputs, CASE_OPERATIONS) for value in result]
    arguments = [f"a{k}" for k in range(function.n_in())]
    told: dict[int, str] = {}
    lines = []
    for number in required_values(listing, wanted):
        what, of, constant, key = listing.instructions[number]
        if what == "const":
            told[number] = _js_number(constant)
        elif key is not None:
            argument, at = key
            told[number] = f"a{argument}[{at}]"
        else:
            told[number] = f"v{number}"
            lines.append(f"const v{number}={_js_expression(what, [told[each] for each in of])};")
    lines += [f"o[{at}]={told[value]};" for at, value in enumerate(wanted)]
    return f"function {name}({','.join([*arguments, 'o'])}){{{''.join(lines)}return o}}"


def _js_number(value: float) -> str:
    if isnan(value):
        return "NaN"
    return repr(value) if value >= 0.0 else f"({value!r})"


def _js_expression(what: str, of: list[str]) -> str:
    if what in JS_OPERATORS:
        return f"{of[0]}{JS_OPERATORS[what]}{of[1]}"
    if what == "neg":
        return f"-{of[0]}"
    if what == "not":
        return f"!{of[0]}"
    if what == "where":
        return f"{of[0]}?{of[1]}:0"
    return f"{JS_FUNCTIONS[what]}({','.join(of)})"
