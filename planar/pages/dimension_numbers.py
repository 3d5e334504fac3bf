"""Numbers that depend on the dimensions: their values in the file, and what a page works them out by."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import total_ordering
from typing import Any

import casadi as ca

from planar.codegen.javascript import write_javascript
from planar.document.dimensions import change_dimension, link_lengths
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.geometry import Vector
from planar.model.mechanism import Mechanism


@total_ordering
@dataclass(frozen=True, eq=False)
class DimensionNumber:
    """A number as a function of the dimensions, which compares by its value in the file.

    What is chosen by comparing is thus chosen for the file's dimensions, and what is drawn follows them. Its expression
    is made when it is asked for: most numbers are only compared.
    """

    value: float
    make_expression: Callable[[], Any]

    def __float__(self) -> float:
        return self.value

    def __abs__(self) -> float:
        return abs(self.value)

    def __eq__(self, other: object) -> bool:
        return self.value == float(other)  # type: ignore[arg-type]  # of nothing but numbers

    def __lt__(self, other: Any) -> bool:
        return self.value < float(other)

    def __hash__(self) -> int:
        return hash(self.value)

    def __add__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value + float(other), lambda: self.make_expression() + _expression(other))

    def __sub__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value - float(other), lambda: self.make_expression() - _expression(other))

    def __mul__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value * float(other), lambda: self.make_expression() * _expression(other))

    def __truediv__(self, other: Any) -> DimensionNumber:
        return DimensionNumber(self.value / float(other), lambda: self.make_expression() / _expression(other))

    __radd__, __rmul__ = __add__, __mul__


def _expression(number: Any) -> Any:
    return number.make_expression() if isinstance(number, DimensionNumber) else number


class DimensionNumbers:
    """Numbers that depend on the dimensions, each with its place in what the page's function `sizes` gives."""

    def __init__(self, mechanism: Mechanism, live: bool = True):
        self.dimensions = list(link_lengths(mechanism, (link.name for link in mechanism.links))) if live else []
        self.d = ca.SX.sym("d", len(self.dimensions))
        for k, each in enumerate(self.dimensions):
            mechanism = change_dimension(mechanism, each, self.d[k])
        self.mechanism, self.shapes = mechanism, shapes_of_links(mechanism)
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
        return write_javascript("sizes", ca.Function("sizes", [self.d], [ca.vertcat(*map(ca.SX, self.values))]))

    def with_values(self, tree: Any) -> Any:
        """Tuples, lists and dictionaries of numbers with each number as one that knows its value."""
        flat = list(_numbers_of(tree))
        known = ca.Function("values", [self.d], [ca.vertcat(*map(ca.SX, flat))])(
            [each.value for each in self.dimensions]
        )
        return _replace_numbers(tree, iter(known.full().ravel().tolist()))


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
