"""Formulas and casadi functions printed as JavaScript."""

from __future__ import annotations

from math import isnan

import casadi as ca

from planar.codegen.printed_formula import FormulaFunction, write_operation
from planar.equations.casadi_functions import recorded_function
from planar.foundation.instruction_list import required_values

JS_OPERATIONS = {
    "add": "{}+{}",
    "sub": "{}-{}",
    "mul": "{}*{}",
    "div": "{}/{}",
    "less": "{}<{}",
    "most": "{}<={}",
    "neg": "-{}",
    "not": "!{}",
    "where": "{}?{}:0",
    "sqrt": "Math.sqrt({})",
    "cos": "Math.cos({})",
    "sin": "Math.sin({})",
    "abs": "Math.abs({})",
    "atan2": "Math.atan2({},{})",
    "minnum": "Math.min({},{})",
    "maxnum": "Math.max({},{})",
    "floor": "Math.floor({})",
    "tan": "Math.tan({})",
    "pow": "Math.pow({},{})",
}


def write_javascript(name: str, function: ca.Function | FormulaFunction) -> str:
    """A function of arrays, the last of which receives all results, one dense matrix after the other, column by column.

    Raises UnsupportedOperation where it holds an operation that is not known.
    """
    if isinstance(function, FormulaFunction):
        formula, counts = function.formula, function.argument_counts
    else:
        formula, counts = recorded_function(function), tuple(map(function.numel_in, range(function.n_in())))
    places = [f"a{k}[{place}]" for k, count in enumerate(counts) for place in range(count)]
    names: dict[int, str] = {}
    lines = []
    for number in required_values(formula, formula.results):
        operation, operands, constant, key = formula.instructions[number]
        if operation == "const":
            names[number] = _js_number(constant)
        elif key is not None:
            names[number] = places[key]
        else:
            names[number] = f"v{number}"
            expression = write_operation(
                JS_OPERATIONS, operation, [names[operand] for operand in operands], "on a page"
            )
            lines.append(f"const v{number}={expression};")
    lines += [f"o[{place}]={names[value]};" for place, value in enumerate(formula.results)]
    arguments = [f"a{k}" for k in range(len(counts))]
    return f"function {name}({','.join([*arguments, 'o'])}){{{''.join(lines)}return o}}"


def _js_number(value: float) -> str:
    if isnan(value):
        return "NaN"
    return repr(value) if value >= 0.0 else f"({value!r})"
