"""Elements: the formulas of pairs, each derived once, from which the equations of any mechanism are assembled.

Two pairs whose formulas perform the same operations share an element, whatever their names and numbers are. A row of
an element is a sum of coordinates times constant factors and a *rest* that is not linear in the coordinates.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca

from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.equations.pair_formulas import recorded_pair_formula
from planar.foundation.recorded_formula import RecordedFormula
from planar.model.pairs import Pair

MAX_ELEMENTS = 1024


class ElementKey(NamedTuple):
    """What an element is derived from: a formula of the frames of moving bodies, own coordinates of a pair, numbers."""

    formula: RecordedFormula
    body_count: int
    own_count: int
    number_count: int


class ElementArguments(NamedTuple):
    """What an element's functions take, in this order: local coordinates (x, y, angle of every moving body, then own
    ones), cosines and sines of bodies' angles, and numbers, each by its index."""

    coordinates: tuple[int, ...]
    cosines: tuple[int, ...]
    sines: tuple[int, ...]
    numbers: tuple[int, ...]


class Element:
    """One formula of a pair type as casadi expressions: its linear part, its rest, and the derivatives of the rest."""

    def __init__(self, key: ElementKey):
        formula, bodies, own_count, number_count = key
        self.coordinate_count = 3 * bodies + own_count
        self.coordinates = [ca.SX.sym(f"q{k}") for k in range(self.coordinate_count)]
        self.cosines = [ca.SX.sym(f"c{body}") for body in range(bodies)]
        self.sines = [ca.SX.sym(f"s{body}") for body in range(bodies)]
        self.numbers = [ca.SX.sym(f"n{k}") for k in range(number_count)]
        frames = [
            (*self.coordinates[3 * k : 3 * k + 2], self.cosines[k], self.sines[k], self.coordinates[3 * k + 2])
            for k in range(bodies)
        ]
        arguments = [*(part for frame in frames for part in frame), *self.coordinates[3 * bodies :], *self.numbers]
        values = [ca.SX(value) for value in formula.evaluate(arguments)]
        self.factors: list[dict[int, float]] = []
        "for every row the constant factors of local coordinates"
        self.nonlinear: list[set[int]] = []
        "for every row the local coordinates on which its rest depends"
        self.rest: list[ca.SX] = []
        everything = stack_expressions([*self.coordinates, *self.cosines, *self.sines])
        for value in values:
            slopes = ca.jacobian(value, everything)
            factors, nonlinear = {}, set()
            for place, column in enumerate(slopes.sparsity().get_triplet()[1]):
                slope = slopes.nz[place]
                if column < self.coordinate_count and slope.is_constant():
                    factors[column] = float(slope)
                else:
                    body = (column - self.coordinate_count) % max(bodies, 1)
                    nonlinear.add(column if column < self.coordinate_count else 3 * body + 2)
            linear = stack_expressions(self.coordinates[column] for column in factors)
            self.factors.append(factors)
            self.nonlinear.append(nonlinear)
            self.rest.append(ca.substitute(value, linear, ca.SX.zeros(len(factors))) if factors else value)
        self.slope_entries = [(row, column) for row, columns in enumerate(self.nonlinear) for column in sorted(columns)]
        "the rows and local coordinates of the derivatives of the rest"

    @cached_property
    def arguments(self) -> ElementArguments:
        """What the functions of the rest take."""
        symbols = {symbol.name() for symbol in ca.symvar(stack_expressions([*self.rest, *self._slopes]))}
        return ElementArguments(
            *(tuple(k for k, symbol in enumerate(group) if symbol.name() in symbols) for group in self._symbol_groups)
        )

    @property
    def _symbol_groups(self) -> tuple[list[ca.SX], ...]:
        return self.coordinates, self.cosines, self.sines, self.numbers

    @cached_property
    def _argument_column(self) -> ca.SX:
        """The symbols of the arguments, one below the other."""
        groups = zip(self._symbol_groups, self.arguments, strict=True)
        return stack_expressions(group[k] for group, indices in groups for k in indices)

    def _derivative(self, value: ca.SX, column: int) -> ca.SX:
        """The derivative by a local coordinate; cos and sin of an angle change with it."""
        slope = ca.jacobian(value, self.coordinates[column])
        body, part = divmod(column, 3)
        if part == 2 and body < len(self.cosines):
            cosine, sine = self.cosines[body], self.sines[body]
            slope = slope - sine * ca.jacobian(value, cosine) + cosine * ca.jacobian(value, sine)
        return slope

    @cached_property
    def _slopes(self) -> list[ca.SX]:
        return [self._derivative(self.rest[row], column) for row, column in self.slope_entries]

    @cached_property
    def rest_function(self) -> ca.Function:
        """(arguments) -> the rests (rows,)."""
        return ca.Function("rest", [self._argument_column], [_dense_column(self.rest)])

    @cached_property
    def rest_call(self) -> BufferedFunction:
        """The same, called on arrays."""
        return BufferedFunction(self.rest_function)

    @cached_property
    def slopes_call(self) -> BufferedFunction:
        """(arguments) -> the rests (rows,), and their derivatives (slope entries,)."""
        results = [_dense_column(self.rest), _dense_column(self._slopes)]
        return BufferedFunction(ca.Function("slopes", [self._argument_column], results))

    @cached_property
    def second_rate_call(self) -> BufferedFunction:
        """(arguments, rates of local coordinates) -> the second rates of the rests (rows,), coordinates without any."""
        rates = ca.SX.sym("rate", self.coordinate_count)
        second = [ca.SX(0.0) for _ in self.rest]
        for (row, column), slope in zip(self.slope_entries, self._slopes, strict=True):
            for other in self.nonlinear[row]:
                second[row] = second[row] + rates[column] * rates[other] * self._derivative(slope, other)
        return BufferedFunction(ca.Function("second", [self._argument_column, rates], [_dense_column(second)]))


def _dense_column(values: Sequence[ca.SX]) -> ca.SX:
    return ca.densify(stack_expressions(values))


@lru_cache(maxsize=MAX_ELEMENTS)
def element_of_key(key: ElementKey) -> Element:
    """The element of a formula; pairs of the same formula share it."""
    return Element(key)


class PlacedElement(NamedTuple):
    """An element between links of a mechanism: which coordinates and numbers of it stand for its own, and its rows."""

    element: Element
    coordinates: tuple[int, ...]
    "indices in (w, u)"
    numbers: tuple[int, ...]
    "indices in p"
    rows: range


class ElementPlacement:
    """Finds the elements of pairs: `frame_columns` are the coordinates x, y, angle of every link that moves,
    `own_columns` and `number_columns` those of every pair."""

    def __init__(
        self,
        frame_columns: Mapping[str, Sequence[int]],
        own_columns: Mapping[str, Sequence[int]],
        number_columns: Mapping[str, Sequence[int]],
    ):
        self._frame_columns, self._own_columns, self._number_columns = frame_columns, own_columns, number_columns

    def residual_of(self, pair: Pair, first_row: int) -> PlacedElement:
        """The element of a pair's residual; its rows begin with a row."""
        return self._place(pair, False, range(first_row, first_row + len(pair.residual_kinds)))

    def input_position_of(self, pair: Pair, row: int) -> PlacedElement:
        """The element of the position of a relative motion."""
        return self._place(pair, True, range(row, row + 1))

    def _place(self, pair: Pair, is_input: bool, rows: range) -> PlacedElement:
        is_moving = tuple(link in self._frame_columns for link in pair.bodies)
        own, numbers = self._own_columns.get(pair.name, ()), self._number_columns.get(pair.name, ())
        formula = recorded_pair_formula(pair, is_input, is_moving, len(own), len(numbers))
        key = ElementKey(formula, sum(is_moving), len(own), len(numbers))
        columns = [column for link in pair.bodies for column in self._frame_columns.get(link, ())]
        return PlacedElement(element_of_key(key), (*columns, *own), tuple(numbers), rows)
