"""Formulas recorded as lists of operations: equal lists are the same formula, whatever the names of its data are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import floor
from typing import Any, NamedTuple

from planar.foundation.jets import Scalar, atan2, cos, sin, sqrt, tan

Operand = int | float
"""The number of an operation, or a constant."""
Operation = tuple[Any, ...]
"""The name of an operation and its operands; ("argument", k) is the formula's argument k."""


class RecordedFormula(NamedTuple):
    """Operations in the order in which they are computed, and the results of a formula among them."""

    operations: tuple[Operation, ...]
    results: tuple[Operand, ...]

    def evaluate(self, arguments: Sequence[Scalar]) -> list[Scalar]:
        """Compute the results in any arithmetic from the values of all arguments."""
        values: list[Scalar] = []
        for name, *operands in self.operations:
            if name == "argument":
                values.append(arguments[operands[0]])
            else:
                values.append(_FUNCTIONS[name](*(values[k] if type(k) is int else k for k in operands)))
        return [values[k] if type(k) is int else k for k in self.results]


class RecordedNumber:
    """A number that records what is computed with it: the same lines serve it as symbols and floats."""

    __slots__ = ("operations", "place")
    __array_ufunc__ = None  # an array times it is no array of them
    is_symbolic = True
    "as the symbols of casadi: formulas that consist of pieces keep them all"

    def __init__(self, operations: list[Operation], place: int):
        self.operations, self.place = operations, place

    def _record(self, name: str, *operands: Operand) -> RecordedNumber:
        self.operations.append((name, *operands))
        return RecordedNumber(self.operations, len(self.operations) - 1)

    def __add__(self, other: Scalar) -> Scalar:
        return self if other == 0.0 else self._record("add", self.place, _operand(other))

    __radd__ = __add__

    def __neg__(self) -> RecordedNumber:
        return self._record("neg", self.place)

    def __sub__(self, other: Scalar) -> Scalar:
        return self if other == 0.0 else self._record("sub", self.place, _operand(other))

    def __rsub__(self, other: Scalar) -> Scalar:
        return -self if other == 0.0 else self._record("sub", float(other), self.place)

    def __mul__(self, other: Scalar) -> Scalar:
        if other == 0.0:
            return 0.0
        return self if other == 1.0 else self._record("mul", self.place, _operand(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Scalar:
        return self if other == 1.0 else self._record("div", self.place, _operand(other))

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return 0.0 if other == 0.0 else self._record("div", float(other), self.place)

    def __pow__(self, exponent: Scalar) -> Scalar:
        return self._record("pow", self.place, float(exponent))

    def __abs__(self) -> RecordedNumber:
        return self._record("abs", self.place)

    def __lt__(self, other: Scalar) -> Scalar:
        return self._record("less", self.place, _operand(other))

    def __gt__(self, other: Scalar) -> Scalar:
        return self._record("less", _operand(other), self.place)

    def __le__(self, other: Scalar) -> Scalar:
        return self._record("at_most", self.place, _operand(other))

    def __ge__(self, other: Scalar) -> Scalar:
        return self._record("at_most", _operand(other), self.place)

    def cos(self) -> RecordedNumber:
        return self._record("cos", self.place)

    def sin(self) -> RecordedNumber:
        return self._record("sin", self.place)

    def tan(self) -> RecordedNumber:
        return self._record("tan", self.place)

    def sqrt(self) -> RecordedNumber:
        return self._record("sqrt", self.place)

    def floor(self) -> RecordedNumber:
        return self._record("floor", self.place)

    def arctan2(self, x: Scalar) -> RecordedNumber:
        return self._record("atan2", self.place, _operand(x))

    def __rarctan2__(self, y: Scalar) -> RecordedNumber:
        return self._record("atan2", _operand(y), self.place)


def record_formula(formula: Callable[[Sequence[RecordedNumber]], Sequence[Scalar]], count: int) -> RecordedFormula:
    """Record a formula of `count` arguments."""
    operations: list[Operation] = [("argument", k) for k in range(count)]
    results = formula([RecordedNumber(operations, k) for k in range(count)])
    return _without_idle_operations(operations, [_operand(result) for result in results])


def _without_idle_operations(operations: list[Operation], results: list[Operand]) -> RecordedFormula:
    """Leave out what no result needs, arguments among it."""
    needed = bytearray(len(operations))
    for k in results:
        if type(k) is int:
            needed[k] = 1
    for place in range(len(operations) - 1, -1, -1):
        if needed[place] and operations[place][0] != "argument":
            for k in operations[place][1:]:
                if type(k) is int:
                    needed[k] = 1
    number: dict[int, int] = {}
    remaining: list[Operation] = []
    for place, operation in enumerate(operations):
        if needed[place]:
            number[place] = len(remaining)
            name, *operands = operation
            is_argument = name == "argument"
            remaining.append((name, *(number[k] if type(k) is int and not is_argument else k for k in operands)))
    return RecordedFormula(tuple(remaining), tuple(number[k] if type(k) is int else k for k in results))


def _operand(value: Scalar) -> Operand:
    return value.place if type(value) is RecordedNumber else float(value)


_FUNCTIONS: dict[str, Callable[..., Scalar]] = {
    "add": lambda a, b: a + b,
    "sub": lambda a, b: a - b,
    "mul": lambda a, b: a * b,
    "div": lambda a, b: a / b,
    "pow": lambda a, b: a**b,
    "neg": lambda a: -a,
    "abs": abs,
    "less": lambda a, b: a < b,
    "at_most": lambda a, b: a <= b,
    "cos": cos,
    "sin": sin,
    "tan": tan,
    "sqrt": sqrt,
    "floor": lambda a: a.floor() if hasattr(a, "floor") else floor(a),
    "atan2": atan2,
}
