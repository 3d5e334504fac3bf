"""Numbers that depend on the dimensions, and on the motion: their values in the file, and what a page has them from."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, total_ordering
from typing import Any

import casadi as ca

from planar.document.dimensions import change_dimensions, link_lengths
from planar.equations.elimination import stack_expressions
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.geometry import Vector
from planar.model.mechanism import Mechanism
from planar.pages.javascript import write_javascript


@total_ordering
@dataclass(frozen=True, eq=False)
class DimensionNumber:
    """A number as a function of the dimensions, which compares by its value in the file.

    What is chosen by comparing is thus chosen for the file's dimensions, and what is drawn follows them. Its expression
    is made when it is asked for: most numbers are only compared.
    """

    value: float
    make_expression: Callable[[], Any]

    @cached_property
    def expression(self) -> Any:
        """What it is worked out by."""
        return self.make_expression()

    def __float__(self) -> float:
        return self.value

    def __abs__(self) -> DimensionNumber:
        return -self if self.value < 0.0 else self

    def __neg__(self) -> DimensionNumber:
        return DimensionNumber(-self.value, lambda: -self.expression)

    def __eq__(self, other: object) -> bool:
        return self.value == float(other)  # type: ignore[arg-type]  # of nothing but numbers

    def __lt__(self, other: Any) -> bool:
        return self.value < float(other)

    def __hash__(self) -> int:
        return hash(self.value)

    def __add__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value + float(other), lambda: self.expression + _expression(other))

    def __sub__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value - float(other), lambda: self.expression - _expression(other))

    def __mul__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value * float(other), lambda: self.expression * _expression(other))

    def __truediv__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value / float(other), lambda: self.expression / _expression(other))

    __radd__, __rmul__ = __add__, __mul__

    def __rsub__(self, other: Any) -> DimensionNumber:
        return -self + other

    def __rtruediv__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(float(other) / self.value, lambda: _expression(other) / self.expression)

    def sqrt(self) -> DimensionNumber:
        """Its square root."""
        return DimensionNumber(self.value**0.5, lambda: ca.sqrt(self.expression))

    def minimum(self, other: Any) -> DimensionNumber:
        """The lesser of both, whatever the dimensions are."""
        least = min(self.value, float(other))
        return DimensionNumber(least, lambda: ca.fmin(self.expression, _expression(other)))


def _expression(number: Any) -> Any:
    return number.expression if isinstance(number, DimensionNumber) else number


class DimensionNumbers:
    """Numbers that depend on the dimensions, each with its place in what the page's function `sizes` gives."""

    def __init__(self, mechanism: Mechanism, live: bool = True):
        self.dimensions = list(link_lengths(mechanism, (link.name for link in mechanism.links))) if live else []
        self.d = ca.SX.sym("d", len(self.dimensions))
        self.mechanism = change_dimensions(
            mechanism, ((dimension, self.d[k]) for k, dimension in enumerate(self.dimensions))
        )
        self.shapes = shapes_of_links(self.mechanism)
        self.values: list[Any] = []

    def add(self, value: Any) -> int:
        """The place of a number."""
        self.values.append(_expression(value))
        return len(self.values) - 1

    def add_point(self, at: Vector) -> list[int]:
        """The places of x and y."""
        return [self.add(at.x), self.add(at.y)]

    def to_javascript(self) -> str:
        """sizes(d): all numbers."""
        return write_javascript("sizes", ca.Function("sizes", [self.d], [_column(self.values)]))

    def with_values(self, tree: Any) -> Any:
        """Tuples, lists and dictionaries of numbers with each number as one that knows its value."""
        flat = list(_numbers_of(tree))
        known = ca.Function("values", [self.d], [_column(flat)])([each.value for each in self.dimensions])
        return _replace_numbers(tree, iter(known.full().ravel().tolist()))


class DrawingNumbers:
    """Numbers of a drawing: functions of the dimensions, of how far slides go, and of the scale.

    `per_mm` is how many metres a millimetre is; as everything that is compared it has the value of a usual window.
    """

    def __init__(self, dimensions: DimensionNumbers, per_mm: float, digits: int | None = None):
        self.dimensions, self.digits = dimensions, digits
        scale = ca.SX.sym("per_mm")
        self.per_mm = DimensionNumber(per_mm, lambda: scale)
        self._scale = scale
        self.travel: list[ca.SX] = []
        self.values: list[Any] = []
        self._numbers: dict[int, tuple[Any, int]] = {}

    def add(self, value: Any) -> int:
        """The place of a number."""
        known = self._numbers.get(id(value))
        if known is None:
            known = self._numbers[id(value)] = value, len(self.values)
            self.values.append(self._rounded(_expression(value)))
        return known[1]

    def add_point(self, at: Vector) -> list[int]:
        """The places of x and y."""
        return [self.add(at.x), self.add(at.y)]

    def add_travel(self, low: float, high: float) -> tuple[DimensionNumber, DimensionNumber]:
        """Both ends of what a page finds to be the range of something over the motion, in the order of the calls."""
        first, last = ca.SX.sym("low"), ca.SX.sym("high")
        self.travel += [first, last]
        return DimensionNumber(low, lambda: first), DimensionNumber(high, lambda: last)

    def to_javascript(self) -> str:
        """drawn(d, travel, per_mm): all numbers."""
        given = [self.dimensions.d, ca.vertcat(*self.travel), self._scale]
        return write_javascript("drawn", ca.Function("drawn", given, [_column(self.values)]))

    def _rounded(self, value: Any) -> Any:
        constant = self.digits is not None and ca.SX(value).is_constant()
        return float(f"{float(value):.{self.digits}g}") if constant else value


def _column(values: Sequence[Any]) -> ca.SX:
    """Numbers and expressions one below the other; to copy an expression takes longer than to stack it."""
    return stack_expressions(each if isinstance(each, ca.SX) else ca.SX(each) for each in values)


def _numbers_of(tree: Any) -> Iterator[Any]:
    if isinstance(tree, dict):
        tree = tuple(tree.values())
    if isinstance(tree, tuple | list):
        for part in tree:
            yield from _numbers_of(part)
    elif not isinstance(tree, str | bool):
        yield tree


def _replace_numbers(tree: Any, values: Iterator[float]) -> Any:
    if isinstance(tree, dict):
        return {name: _replace_numbers(part, values) for name, part in tree.items()}
    if isinstance(tree, tuple | list):
        parts = [_replace_numbers(part, values) for part in tree]
        return type(tree)(*parts) if hasattr(tree, "_fields") else type(tree)(parts)
    return tree if isinstance(tree, str | bool) else DimensionNumber(next(values), lambda: tree)
