"""Elements: the formulas of pairs, each derived once, from which the equations of any mechanism are assembled.

Two pairs whose formulas perform the same operations share an element, whatever their names and numbers are. A row of
an element is a sum of coordinates times constant factors and a *rest* that is not linear in the coordinates.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

from planar.codegen.printed_formula import PrintedFunction, compile_formula
from planar.equations.known_types import fingerprint
from planar.foundation.recorded_formula import RecordedFormula

MAX_ELEMENTS = 1024


class ElementKey(NamedTuple):
    """What an element is derived from: a formula of the frames of moving bodies, own coordinates of a pair, numbers."""

    formula: RecordedFormula
    body_count: int
    own_count: int
    number_count: int

    @property
    def fingerprint(self) -> str:
        """What tells the element from others in every process."""
        return fingerprint(self.formula.as_text(), *self[1:])


class ElementArguments(NamedTuple):
    """What an element's functions take, in this order: local coordinates (x, y, angle of every moving body, then own
    ones), cosines and sines of bodies' angles, and numbers, each by its index."""

    coordinates: tuple[int, ...]
    cosines: tuple[int, ...]
    sines: tuple[int, ...]
    numbers: tuple[int, ...]


@dataclass(frozen=True, eq=False)
class Element:
    """One formula of a pair type: its linear part, its rest, and the derivatives of the rest."""

    fingerprint: str
    "what tells it from others in every process"
    body_count: int
    coordinate_count: int
    factors: tuple[Mapping[int, float], ...]
    "for every row the constant factors of local coordinates"
    nonlinear: tuple[frozenset[int], ...]
    "for every row the local coordinates on which its rest depends"
    arguments: ElementArguments
    "what the functions of the rest take"
    rest: RecordedFormula
    "(arguments) -> the rests (rows,)"
    slopes: RecordedFormula
    "(arguments) -> the rests (rows,), then their derivatives (slope entries,)"
    second_rates: RecordedFormula
    "(arguments, rates of local coordinates) -> the second rates of the rests (rows,), coordinates without any"

    def as_text(self) -> str:
        """All but the fingerprint in one line of JSON."""
        factors = [list(factors.items()) for factors in self.factors]
        formulas = [formula.as_text() for formula in (self.rest, self.slopes, self.second_rates)]
        nonlinear = [sorted(columns) for columns in self.nonlinear]
        return json.dumps([self.body_count, self.coordinate_count, factors, nonlinear, self.arguments, *formulas])

    @classmethod
    def from_text(cls, fingerprint: str, text: str) -> Element:
        """The element of `as_text`."""
        bodies, coordinates, factors, nonlinear, arguments, *formulas = json.loads(text)
        return cls(
            fingerprint,
            bodies,
            coordinates,
            tuple(map(dict, factors)),
            tuple(map(frozenset, nonlinear)),
            ElementArguments(*map(tuple, arguments)),
            *map(RecordedFormula.from_text, formulas),
        )

    @property
    def row_count(self) -> int:
        """How many rows the formula has."""
        return len(self.factors)

    @cached_property
    def slope_entries(self) -> list[tuple[int, int]]:
        """The rows and local coordinates of the derivatives of the rest."""
        return [(row, column) for row, columns in enumerate(self.nonlinear) for column in sorted(columns)]

    @cached_property
    def rest_function(self) -> PrintedFunction:
        """`rest` of arrays."""
        return self._compile(self.rest)

    @cached_property
    def slopes_function(self) -> PrintedFunction:
        """`slopes` of arrays."""
        return self._compile(self.slopes)

    @cached_property
    def second_rates_function(self) -> PrintedFunction:
        """`second_rates` of arrays."""
        return self._compile(self.second_rates, self.coordinate_count)

    def _compile(self, formula: RecordedFormula, more_arguments: int = 0) -> PrintedFunction:
        return compile_formula(formula, sum(map(len, self.arguments)) + more_arguments)


class PlacedElement(NamedTuple):
    """An element between links of a mechanism: which coordinates and numbers of it stand for its own, and its rows."""

    element: Element
    coordinates: tuple[int, ...]
    "indices in (w, u)"
    numbers: tuple[int, ...]
    "indices in p"
    rows: range
