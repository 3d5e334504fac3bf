"""Casadi functions called on arrays, and carried out on numbers of another kind: balls, symbols, new instructions."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from threading import Lock
from types import MappingProxyType
from typing import Any

import casadi as ca
import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation
from planar.foundation.recorded_formula import RecordedFormula, formula_of_results

CHUNK_SIZES = (256, 32, 8)
"""Positions that are worked on by one call."""
MAX_MAPPED_ENTRIES = 20_000
"""Entries of a function's results: one of more is called for one position after the other, since to make a call of
many positions takes long, and room."""


def formula_text(rows: ca.SX, *symbols: ca.SX) -> str:
    """Rows in columns of symbols, as casadi writes a function: the same text whatever the symbols are called."""
    renamed = [ca.SX.sym(f"q{k}", symbol.numel()) for k, symbol in enumerate(symbols)]
    function = ca.Function("rows", list(symbols), [ca.densify(rows)])
    text: str = ca.Function("rows", renamed, [function(*renamed)]).serialize()
    return text


class _BoundCall:
    """A function of so many positions, run from its own arrays to its own arrays."""

    def __init__(self, function: Any, count: int):
        self.inputs = [np.zeros((count, function.numel_in(k))) for k in range(function.n_in())]
        self.outputs = [np.zeros((count, *function.size_out(k)[::-1])) for k in range(function.n_out())]
        # the buffer has to live as long as what runs it
        self._buffer, self.run = (function.map(count) if count > 1 else function).buffer()
        for set_array, arrays in ((self._buffer.set_arg, self.inputs), (self._buffer.set_res, self.outputs)):
            for k, array in enumerate(arrays):
                if array.size:
                    set_array(k, array.reshape(-1).data)


class BufferedFunction:
    """A function of dense columns. Results are (columns, rows), or (positions, columns, rows).

    A call through casadi's own interface costs some 30 us, one through its buffers less than one.
    """

    def __init__(self, function: Any):
        self.function = function
        self._lock = Lock()
        self._single = _BoundCall(function, 1)
        self._calls = {1: self._single}
        "by the number of positions"
        self._asked: Counter[int] = Counter()

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results at one position, each argument as long as the function's."""
        with self._lock:
            for array, argument in zip(self._single.inputs, arguments, strict=True):
                array[0] = argument
            self._single.run()
            return [array[0].copy() for array in self._single.outputs]

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results at many positions; arguments (positions, entries), or (entries,) for all of them alike."""
        results: list[Array] = [np.empty((count, *array.shape[1:])) for array in self._single.outputs]
        first = 0
        with self._lock:
            for size in self._call_sizes(count):
                if size not in self._calls:
                    self._calls[size] = _BoundCall(self.function, size)
                call, last = self._calls[size], min(first + size, count)
                for array, argument in zip(call.inputs, arguments, strict=True):
                    array[: last - first] = argument if argument.ndim == 1 else argument[first:last]
                call.run()
                for result, array in zip(results, call.outputs, strict=True):
                    result[first:last] = array[: last - first]
                first = last
        return results

    def _call_sizes(self, count: int) -> list[int]:
        """The numbers of positions of calls, one after the other; of the last one some may be left over."""
        if sum(array.size for array in self._single.outputs) > MAX_MAPPED_ENTRIES:
            return [1] * count
        self._asked[count] += 1
        if 0 < count <= CHUNK_SIZES[1] or (count <= CHUNK_SIZES[0] and self._asked[count] > 2):
            return [count]
        sizes: list[int] = []
        for size in CHUNK_SIZES:
            chunks, count = divmod(count, size)
            sizes += [size] * chunks
        return [*sizes, CHUNK_SIZES[-1]] if count else sizes


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
UNARY_OPERATIONS = {
    ca.OP_NEG: "neg",
    ca.OP_SQRT: "sqrt",
    ca.OP_COS: "cos",
    ca.OP_SIN: "sin",
    ca.OP_FABS: "abs",
    ca.OP_FLOOR: "floor",
}
BINARY_OPERATIONS = {
    ca.OP_ADD: "add",
    ca.OP_SUB: "sub",
    ca.OP_MUL: "mul",
    ca.OP_DIV: "div",
    ca.OP_ATAN2: "atan2",
    ca.OP_FMIN: "minnum",
    ca.OP_FMAX: "maxnum",
    ca.OP_LT: "less",
    ca.OP_LE: "most",
}
FORMULA_OPERATIONS = {
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
    ca.OP_TAN: "tan",
    ca.OP_NOT: "not",
    ca.OP_IF_ELSE_ZERO: "where",
}
"""What formulas of pairs may have beside what machine code knows."""


def evaluate_function(
    function: ca.Function,
    inputs: Sequence[Sequence[Any]],
    convert: Callable[[float], Any],
    apply: Callable[[int, list[Any]], Any] = lambda code, operands: OPERATIONS[code](*operands),
) -> list[list[Any]]:
    """The results of a function, dense, column by column; `convert` makes a constant, `apply` a casadi operation.

    By default those of `OPERATIONS`; raises KeyError for another.
    """
    work: dict[int, Any] = {}
    results: list[list[Any]] = [[convert(0.0)] * function.numel_out(k) for k in range(function.n_out())]
    places = [function.sparsity_out(k).find() for k in range(function.n_out())]
    for k in range(function.n_instructions()):
        code, out, of = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        if code == ca.OP_INPUT:
            work[out[0]] = inputs[of[0]][of[1]]
        elif code == ca.OP_CONST:
            work[out[0]] = convert(function.instruction_constant(k))
        elif code == ca.OP_OUTPUT:
            results[out[0]][places[out[0]][out[1]]] = work[of[0]]
        else:
            work[out[0]] = apply(code, [work[operand] for operand in of])
    return results


def inline_function(
    listing: InstructionList[Any],
    function: ca.Function,
    inputs: Sequence[Sequence[int]],
    more_operations: Mapping[int, str] = MappingProxyType({}),
) -> list[list[int]]:
    """A function of values of a list: the numbers of its results, dense, column by column.

    `more_operations` names operations of casadi that machine code has no instruction for. Raises UnsupportedOperation.
    """

    def apply(code: int, operands: list[int]) -> int:
        name = more_operations.get(code) or UNARY_OPERATIONS.get(code) or BINARY_OPERATIONS.get(code)
        if name is not None:
            return listing.add(name, *operands)
        if code in (ca.OP_SQ, ca.OP_TWICE):
            return listing.add("mul" if code == ca.OP_SQ else "add", operands[0], operands[0])
        if code == ca.OP_INV:
            return listing.add("div", listing.add_constant(1.0), operands[0])
        if code == ca.OP_ASSIGN:
            return operands[0]
        if code == ca.OP_SIGN:  # of derivatives of pieces, as what follows
            zero = listing.add_constant(0.0)
            return listing.add("sub", listing.add("less", zero, operands[0]), listing.add("less", operands[0], zero))
        if code == ca.OP_NOT:
            return listing.add("sub", listing.add_constant(1.0), operands[0])
        raise UnsupportedOperation(f"operation {code}")

    return evaluate_function(function, inputs, listing.add_constant, apply)


def recorded_function(function: ca.Function) -> RecordedFormula:
    """A casadi function as a formula: its arguments one after the other, its results dense, column by column."""
    instructions: InstructionList[int] = InstructionList()
    sizes = [function.numel_in(k) for k in range(function.n_in())]
    inputs = [[instructions.add_input(sum(sizes[:k]) + place) for place in range(size)] for k, size in enumerate(sizes)]
    results = inline_function(instructions, function, inputs, FORMULA_OPERATIONS)
    return formula_of_results(instructions, [number for result in results for number in result])


def is_piecewise_in(expression: ca.SX, symbols: ca.SX) -> bool:
    """Whether an expression changes its formula as these symbols change."""
    others = [symbol for symbol in ca.symvar(expression) if not ca.depends_on(symbols, symbol)]
    function = ca.Function("pieces", [symbols, ca.vertcat(ca.SX(0, 1), *others)], [expression])
    choices: list[int] = []

    def depends(code: int, operands: list[bool]) -> bool:
        if any(operands) and code in (ca.OP_FLOOR, ca.OP_LT, ca.OP_LE):
            choices.append(code)
        return any(operands)

    evaluate_function(function, [[True] * symbols.numel(), [False] * len(others)], lambda _: False, depends)
    return bool(choices)
