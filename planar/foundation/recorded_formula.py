"""Formulas recorded as lists of instructions: equal lists are the same formula, whatever the names of its data are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import floor, isnan
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.instruction_list import Instruction, InstructionList, Instructions, required_values
from planar.foundation.jets import Jet, Scalar, atan2, cos, sin, sqrt, tan


class RecordedFormula(NamedTuple):
    """Instructions in the order in which they are computed, their inputs by number, and the results among them."""

    instructions: tuple[Instruction[int], ...]
    results: tuple[int, ...]

    def evaluate(self, arguments: Sequence[Scalar]) -> list[Scalar]:
        """Compute the results in any arithmetic from the values of all arguments."""
        values: list[Scalar] = []
        for operation, operands, number, key in self.instructions:
            if key is not None:
                values.append(arguments[key])
            elif operation == "const":
                values.append(number)
            else:
                values.append(_FUNCTIONS[operation](*[values[k] for k in operands]))
        return [values[k] for k in self.results]

    def part(self, part: slice) -> RecordedFormula:
        """The formula of some of its results."""
        return formula_of_results(self, self.results[part])

    def as_text(self) -> str:
        """The formula in one line: its instructions, each with its operands, then the numbers of its results."""
        lines = (" ".join(map(str, (value.operation, *_text_operands(value)))) for value in self.instructions)
        return ";".join((*lines, " ".join(map(str, self.results))))

    @classmethod
    def from_text(cls, text: str) -> RecordedFormula:
        """The formula of `as_text`."""
        *lines, results = text.split(";")
        return cls(tuple(_instruction_of(*line.split(" ")) for line in lines), tuple(map(int, results.split())))


def _text_operands(value: Instruction[int]) -> Sequence[float]:
    if value.key is not None:
        return (value.key,)
    return (value.number,) if value.operation == "const" else value.operands


def _instruction_of(operation: str, *operands: str) -> Instruction[int]:
    if operation == "const":
        return Instruction(operation, number=float(operands[0]))
    if operation == "input":
        return Instruction(operation, key=int(operands[0]))
    return Instruction(operation, tuple(map(int, operands)))


class RecordedNumber:
    """A number that records what is computed with it: the same lines serve it as symbols and floats."""

    __slots__ = ("instructions", "number")
    __array_ufunc__ = None  # an array times it is no array of them
    is_symbolic = True
    "as the symbols of casadi: formulas that consist of pieces keep them all"

    def __init__(self, instructions: InstructionList[Any], number: int):
        self.instructions, self.number = instructions, number

    def record(self, operation: str, other: Scalar) -> RecordedNumber:
        """The number of an operation of this number and another."""
        if isinstance(other, Jet):
            return NotImplemented  # type: ignore[no-any-return]  # to Python
        instructions = self.instructions
        return RecordedNumber(instructions, instructions.add(operation, self.number, number_of(other, instructions)))

    def record_after(self, operation: str, other: Scalar) -> RecordedNumber:
        """The same of the other and this one."""
        instructions = self.instructions
        return RecordedNumber(instructions, instructions.add(operation, number_of(other, instructions), self.number))

    def _apply(self, function: str) -> RecordedNumber:
        return RecordedNumber(self.instructions, self.instructions.add(function, self.number))

    def __add__(self, other: Scalar) -> RecordedNumber:
        return self.record("add", other)

    __radd__ = __add__

    def __neg__(self) -> RecordedNumber:
        return self._apply("neg")

    def __sub__(self, other: Scalar) -> RecordedNumber:
        return self.record("sub", other)

    def __rsub__(self, other: Scalar) -> RecordedNumber:
        return self.record_after("sub", other)

    def __mul__(self, other: Scalar) -> RecordedNumber:
        return self.record("mul", other)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> RecordedNumber:
        return self.record("div", other)

    def __rtruediv__(self, other: Scalar) -> RecordedNumber:
        return self.record_after("div", other)

    def __pow__(self, exponent: Scalar) -> RecordedNumber:
        return self.record("pow", exponent)

    def __abs__(self) -> RecordedNumber:
        return self._apply("abs")

    def __lt__(self, other: Scalar) -> RecordedNumber:
        return self.record("less", other)

    def __gt__(self, other: Scalar) -> RecordedNumber:
        return self.record_after("less", other)

    def __le__(self, other: Scalar) -> RecordedNumber:
        return self.record("most", other)

    def __ge__(self, other: Scalar) -> RecordedNumber:
        return self.record_after("most", other)

    def cos(self) -> RecordedNumber:
        return self._apply("cos")

    def sin(self) -> RecordedNumber:
        return self._apply("sin")

    def tan(self) -> RecordedNumber:
        return self._apply("tan")

    def sqrt(self) -> RecordedNumber:
        return self._apply("sqrt")

    def floor(self) -> RecordedNumber:
        return self._apply("floor")

    def arctan2(self, x: Scalar) -> RecordedNumber:
        return self.record("atan2", x)

    def __rarctan2__(self, y: Scalar) -> RecordedNumber:
        return self.record_after("atan2", y)


def number_of(value: Scalar, instructions: InstructionList[Any]) -> int:
    """The number of a value in a list: a recorded one's own, or that of a constant."""
    return value.number if type(value) is RecordedNumber else instructions.add_constant(value)


def recorded_arguments(counts: Sequence[int]) -> tuple[InstructionList[int], list[Array]]:
    """An empty list of instructions, and arguments of a formula, with these numbers of entries, that record in it."""
    instructions: InstructionList[int] = InstructionList()
    arguments = np.empty(sum(counts), dtype=object)
    arguments[:] = [RecordedNumber(instructions, instructions.add_input(place)) for place in range(sum(counts))]
    return instructions, np.split(arguments, np.cumsum(counts)[:-1])


def record_formula(formula: Callable[[Sequence[RecordedNumber]], Sequence[Scalar]], count: int) -> RecordedFormula:
    """Record a formula of `count` arguments."""
    instructions: InstructionList[int] = InstructionList()
    results = formula([RecordedNumber(instructions, instructions.add_input(k)) for k in range(count)])
    return formula_of_results(instructions, [number_of(result, instructions) for result in results])


def formula_of_results(formula: Instructions, results: Sequence[int]) -> RecordedFormula:
    """The formula of some values of a list, without what they do not need."""
    required = required_values(formula, results)
    places = {number: place for place, number in enumerate(required)}
    renumbered: list[Instruction[int]] = []
    for number in required:
        operation, operands, constant, key = formula.instructions[number]
        renumbered.append(Instruction(operation, tuple([places[operand] for operand in operands]), constant, key))
    return RecordedFormula(tuple(renumbered), tuple([places[result] for result in results]))


def _floor(value: Scalar) -> Scalar:
    if isinstance(value, float):
        return float(floor(value))
    return value.floor() if hasattr(value, "floor") else np.floor(value)


def _number_or_recorded(operation: str, of_numbers: Callable[[Scalar, Scalar], Scalar]) -> Callable[..., Scalar]:
    """An operation that is no operator of Python, on numbers and arrays or recorded."""

    def apply(a: Scalar, b: Scalar) -> Scalar:
        if type(a) is RecordedNumber:
            return a.record(operation, b)
        return b.record_after(operation, a) if type(b) is RecordedNumber else of_numbers(a, b)

    return apply


def _least(a: Scalar, b: Scalar) -> Scalar:
    if type(a) is type(b) is float:
        return a if a <= b or isnan(b) else b
    return np.fmin(a, b)


def _greatest(a: Scalar, b: Scalar) -> Scalar:
    if type(a) is type(b) is float:
        return a if a >= b or isnan(b) else b
    return np.fmax(a, b)


def _where(condition: Scalar, value: Scalar) -> Scalar:
    if type(condition) is float:
        return value if condition else 0.0
    return np.where(condition, value, 0.0) if isinstance(condition, np.ndarray | np.generic) else condition * value


def elementwise(function: Callable[[Scalar], Scalar], values: Array) -> Array:
    """A function of every number of an array, recorded ones too."""
    called: Callable[[Array], Array] = np.frompyfunc(function, 1, 1) if values.dtype == object else function
    return called(values)


least_of = _number_or_recorded("minnum", _least)
"""The lesser of two, of which one may not be a number."""
greatest_of = _number_or_recorded("maxnum", _greatest)
"""The greater of two, of which one may not be a number."""


def least_entries(values: Array) -> Array:
    """The least along the first axis, recorded ones too; infinity of none."""
    return _reduced(values, np.fmin, least_of, np.inf)


def greatest_entries(values: Array) -> Array:
    """The greatest along the first axis of what is zero or more, recorded ones too; zero of none."""
    return _reduced(values, np.fmax, greatest_of, 0.0)


def _reduced(values: Array, of_arrays: np.ufunc, of_two: Callable[..., Scalar], start: float) -> Array:
    if values.dtype != object:
        reduced: Array = of_arrays.reduce(values, axis=0, initial=start)
        return reduced
    result: Array = np.full(values.shape[1:], start, dtype=object)
    for row in values:
        result = np.frompyfunc(of_two, 2, 1)(row, result)
    return result


_where_of_numbers = _number_or_recorded("where", _where)


def where(condition: Scalar, value: Scalar) -> Scalar:
    """A value where a condition, 0 or 1, holds, else nothing."""
    if isinstance(value, Jet):
        return Jet(*(where(condition, part) for part in value.parts))
    return _where_of_numbers(condition, value)


def _choice_of_two(of_numbers: Callable[[Scalar, Scalar], Scalar], is_least: bool) -> Callable[..., Scalar]:
    """The lesser or the greater of two, of which jets may be some."""

    def choose(a: Scalar, b: Scalar) -> Scalar:
        if not isinstance(a, Jet) and not isinstance(b, Jet):
            return of_numbers(a, b)
        is_first = 1.0 * (a <= b if is_least else b <= a)
        return where(is_first, a) + where(1.0 - is_first, b)

    return choose


_FUNCTIONS: dict[str, Callable[..., Scalar]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a**b,
    "neg": lambda a: -a,
    "abs": abs,
    "less": lambda a, b: 1.0 * (a < b),
    "most": lambda a, b: 1.0 * (a <= b),
    "not": lambda a: 1.0 - a,
    "where": where,
    "minnum": _choice_of_two(least_of, True),
    "maxnum": _choice_of_two(greatest_of, False),
    "cos": cos,
    "sin": sin,
    "tan": tan,
    "sqrt": sqrt,
    "floor": _floor,
    "atan2": atan2,
}
