"""Instruction lists as Python source, for floats and for arrays of any shape; what is often used as machine code."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.instruction_list import Instructions, UnsupportedOperation, required_values
from planar.foundation.recorded_formula import RecordedFormula

if TYPE_CHECKING:
    from planar.codegen.formula_kernel import FormulaKernel

PYTHON_OPERATIONS = {
    "add": "{} + {}",
    "sub": "{} - {}",
    "mul": "{} * {}",
    "div": "{} / {}",
    "less": "1.0 * ({} < {})",
    "most": "1.0 * ({} <= {})",
    "neg": "-{}",
    "not": "1.0 - {}",
    **{name: f"{name}({{}})" for name in ("sqrt", "abs", "cos", "sin", "tan", "floor")},
    **{name: f"{name}({{}}, {{}})" for name in ("atan2", "minnum", "maxnum", "pow", "where")},
}
FLOAT_OPERATIONS = PYTHON_OPERATIONS | {
    "minnum": "{0} if {0} <= {1} or {1} != {1} else {1}",
    "maxnum": "{0} if {0} >= {1} or {1} != {1} else {1}",
    "where": "{1} if {0} else 0.0",
}
"""The same of floats alone: what is no number is not equal to itself."""
REPEATING_OPERATIONS = ("minnum", "maxnum")
"""Those that may name an operand more than once."""
NUMPY_FUNCTIONS: Mapping[str, Callable[..., Any]] = {
    "sqrt": np.sqrt,
    "abs": np.abs,
    "cos": np.cos,
    "sin": np.sin,
    "tan": np.tan,
    "atan2": np.arctan2,
    "minnum": np.fmin,
    "maxnum": np.fmax,
    "floor": np.floor,
    "pow": np.power,
    "where": lambda condition, value: np.where(condition, value, 0.0),
}
FLOAT_FUNCTIONS: Mapping[str, Callable[..., float]] = {
    "sqrt": math.sqrt,
    "abs": abs,
    "cos": math.cos,
    "sin": math.sin,
    "tan": math.tan,
    "atan2": math.atan2,
    "floor": lambda a: float(math.floor(a)),
    "pow": math.pow,
}
MAX_NESTED_EXPRESSIONS = 12
"""So deep expressions stand within one another: Python's parser bears some hundred."""
MAX_INTERPRETED_CALLS = 12
"""Calls that take less time, the formula's instructions carried out one by one, than printing it."""
MAX_FLOAT_POSITIONS = 5
"""So few positions take less time one by one, by floats, than by arrays."""
NUMPY_INSTRUCTION_TIME, NUMPY_NUMBER_TIME = 1e-6, 1e-9
"""Seconds that an instruction takes on arrays, whatever their length, and for a number of them."""
MIN_COMPILED_TIME, COMPILED_TIME_PER_INSTRUCTION = 0.03, 3e-4
"""Seconds that a formula is computed by numpy before its machine code is made, which takes about as long."""
MAX_COMPILED_INSTRUCTIONS = 4_000
"""Longer ones take too long to compile."""
PrintedFunction = Callable[..., tuple[Any, ...]]
"""Arrays, or numbers, of the operands in their order, to the values that are wanted."""


def write_python(
    formula: Instructions,
    results: Sequence[int],
    names: Mapping[int, str],
    parameters: Sequence[str],
    operations: Mapping[str, str] = PYTHON_OPERATIONS,
) -> str:
    """The source of `values`, a function of the parameters. `names` are expressions of values that are known.

    A value that is used once stands within the expression that uses it. The name of any other is taken again once
    nothing needs the value, so that few arrays are in use, and in the cache. Raises UnsupportedOperation.
    """
    expressions = dict(names)
    order = [number for number in required_values(formula, results, expressions) if number not in expressions]
    use_counts = Counter(operand for number in order for operand in formula.instructions[number].operands)
    use_counts.update(results)
    statement_of: dict[int, int] = {}
    "by values that stand within another's expression, the value whose statement that is"
    last_use: dict[int, float] = dict.fromkeys(results, math.inf)
    depths: dict[int, int] = {}
    for number in reversed(order):
        statement = statement_of.setdefault(number, number)
        can_nest = formula.instructions[number].operation not in REPEATING_OPERATIONS
        for operand in formula.instructions[number].operands:
            depth = depths.get(number, 0) + 1
            if can_nest and use_counts[operand] == 1 and operand not in last_use and depth <= MAX_NESTED_EXPRESSIONS:
                statement_of[operand], depths[operand] = statement, depth
            last_use[operand] = max(last_use.get(operand, 0), statement)
    lines = [f"def values({', '.join(parameters)}):"]
    repeated = [number for number in names if use_counts[number] > 1 and names[number].endswith("]")]
    for number in repeated:
        expressions[number] = f"e{number}"
        lines.append(f"    e{number} = {names[number]}")
    needed_by: dict[float, list[int]] = defaultdict(list)
    for number in order:
        needed_by[last_use[number]].append(number)
    free: list[str] = []
    count = 0
    for number in order:
        operation, operands, constant, _ = formula.instructions[number]
        if operation == "const":
            expressions[number] = f"({constant!r})"
            continue
        expression = write_operation(operations, operation, [expressions[operand] for operand in operands], "on arrays")
        if statement_of[number] != number:
            expressions[number] = f"({expression})"
            continue
        free += [expressions[value] for value in needed_by[number] if expressions[value][0] == "r"]
        if not free:
            free.append(f"r{count}")
            count += 1
        expressions[number] = free.pop()
        lines.append(f"    {expressions[number]} = {expression}")
    lines.append(f"    return ({''.join(expressions[number] + ', ' for number in results)})")
    return "\n".join(lines)


def write_numpy(formula: Instructions, results: Sequence[int], operands: Sequence[int]) -> str:
    """The source of `values`, a function of the operands: numbers of instructions that are known."""
    names = {number: f"x{k}" for k, number in enumerate(operands)}
    return write_python(formula, results, names, list(names.values()))


def compile_source(source: str, functions: Mapping[str, Callable[..., Any]] = NUMPY_FUNCTIONS) -> PrintedFunction:
    """The function of a source, ready to be called on arrays, or on floats by `FLOAT_FUNCTIONS`."""
    scope: dict[str, Any] = {**functions, "nan": math.nan, "inf": math.inf}
    exec(source, scope)
    compiled: PrintedFunction = scope["values"]
    return compiled


def compile_numpy(formula: Instructions, results: Sequence[int], operands: Sequence[int]) -> PrintedFunction:
    """The function of `write_numpy`, ready to be called on arrays."""
    return compile_source(write_numpy(formula, results, operands))


def compile_formula(formula: RecordedFormula, argument_count: int) -> PrintedFunction:
    """A recorded formula of so many arguments, ready to be called on arrays."""
    names = {number: f"x{value.key}" for number, value in enumerate(formula.instructions) if value.key is not None}
    return compile_source(write_python(formula, formula.results, names, [f"x{k}" for k in range(argument_count)]))


def write_operation(templates: Mapping[str, str], operation: str, operands: Sequence[str], place: str) -> str:
    """An operation in a language, by its templates.

    Raises UnsupportedOperation, which says by `place` ("on arrays") where the operation is missing.
    """
    if operation not in templates:
        raise UnsupportedOperation(f"there is no {operation} {place}")
    return templates[operation].format(*operands)


class FormulaFunction:
    """A recorded formula as a function of dense columns: by floats at one position, by arrays at many.

    `argument_counts` are the entries of every argument, whose places, one argument after the other, are the keys of the
    formula's inputs; `shapes` (columns, rows) are those of its results, column by column.
    """

    def __init__(
        self, formula: RecordedFormula, argument_counts: Sequence[int], shapes: Sequence[tuple[int, int]]
    ) -> None:
        self.formula, self.argument_counts, self.shapes = formula, tuple(argument_counts), tuple(shapes)
        self._sizes = [columns * rows for columns, rows in shapes]
        self._call_count = 0
        self._array_time = 0.0
        self._kernels: dict[tuple[bool, ...], FormulaKernel] = {}
        self._slices = [slice(sum(self._sizes[:k]), sum(self._sizes[: k + 1])) for k in range(len(shapes))]

    def _source(self, operations: Mapping[str, str]) -> str:
        """What is compiled: an argument is indexed by its entries."""
        places = [(k, place) for k, count in enumerate(self.argument_counts) for place in range(count)]
        names = {
            number: "a{}[{}]".format(*places[value.key])
            for number, value in enumerate(self.formula.instructions)
            if value.key is not None
        }
        parameters = [f"a{k}" for k in range(len(self.argument_counts))]
        return write_python(self.formula, self.formula.results, names, parameters, operations)

    @cached_property
    def _of_floats(self) -> PrintedFunction:
        return compile_source(self._source(FLOAT_OPERATIONS), FLOAT_FUNCTIONS)

    @cached_property
    def _of_arrays(self) -> PrintedFunction:
        return compile_source(self._source(PYTHON_OPERATIONS))

    def _interpret(self, arguments: Iterable[Iterable[Any]]) -> Sequence[Any]:
        return self.formula.evaluate([entry for argument in arguments for entry in argument])

    @property
    def _is_printed(self) -> bool:
        """Whether it was called so often that printing it pays."""
        self._call_count += 1
        return self._call_count > MAX_INTERPRETED_CALLS

    def values(self, *arguments: Sequence[float]) -> Sequence[float]:
        """All results, one after the other, at one position; what is not defined there is not a number."""
        try:
            return self._of_floats(*arguments) if self._is_printed else self._interpret(arguments)
        except (ArithmeticError, ValueError):
            return [float(value) for value in self._array_values([np.array(argument) for argument in arguments])]

    def _array_values(self, arguments: Sequence[Array]) -> Sequence[Any]:
        """The same of arrays whose first axis is that of an argument's entries."""
        with np.errstate(all="ignore"):
            return self._of_arrays(*arguments) if self._is_printed else self._interpret(arguments)

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results (columns, rows) at one position, every argument as long as the function's."""
        values = np.array(self.values(*(argument.tolist() for argument in arguments)))
        return [values[part].reshape(shape) for part, shape in zip(self._slices, self.shapes, strict=True)]

    def evaluate_entries(self, count: int, *arguments: Array) -> Array:
        """All results, one after the other (results, positions); arguments (entries, positions), or (entries,) for all
        positions alike, which may be arrays of recorded numbers."""
        is_recorded = any(argument.dtype == object for argument in arguments)
        if count <= MAX_FLOAT_POSITIONS or is_recorded:
            positions = [
                [(argument if argument.ndim == 1 else argument[:, k]).tolist() for argument in arguments]
                for k in range(count)
            ]
            if is_recorded:
                columns: Array = np.empty((count, sum(self._sizes)), dtype=object)
                columns[:] = [self._interpret(position) for position in positions]
                return columns.T
            columns = np.array([self.values(*position) for position in positions], dtype=float)
            return columns.reshape(count, sum(self._sizes)).T
        kernel = self._kernel(count, arguments)
        if kernel is not None:
            return kernel(count, arguments)
        results: Array = np.empty((sum(self._sizes), count))
        for row, value in zip(results, self._array_values(arguments), strict=True):
            row[:] = value
        return results

    def _kernel(self, count: int, arguments: Sequence[Array]) -> FormulaKernel | None:
        """The formula's machine code, once what numpy took for it is more than compiling takes; None before."""
        instructions = len(self.formula.instructions)
        self._array_time += instructions * (NUMPY_INSTRUCTION_TIME + count * NUMPY_NUMBER_TIME)
        if self._array_time < MIN_COMPILED_TIME + instructions * COMPILED_TIME_PER_INSTRUCTION:
            return None
        if instructions > MAX_COMPILED_INSTRUCTIONS:
            self._array_time = -np.inf
            return None
        varies = tuple(argument.ndim > 1 for argument in arguments)
        if varies not in self._kernels:
            from planar.codegen.formula_kernel import compile_kernel  # llvmlite takes long to load

            try:
                self._kernels[varies] = compile_kernel(self.formula, self.argument_counts, varies)
            except UnsupportedOperation:
                self._array_time = -np.inf
                return None
        return self._kernels[varies]

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results (positions, columns, rows); arguments (positions, entries), or (entries,) for all alike."""
        results = self.evaluate_entries(count, *(argument.T for argument in arguments)).T
        return [results[:, part].reshape(count, *shape) for part, shape in zip(self._slices, self.shapes, strict=True)]
