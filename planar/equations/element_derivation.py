"""Elements derived by casadi, as recorded formulas."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from planar.equations.elements import PARTS_OF_FRAME, Element, ElementArguments, ElementKey
from planar.equations.elimination import stack_expressions
from planar.equations.generic_evaluation import recorded_function
from planar.foundation.recorded_formula import RecordedFormula


def derive_element(key: ElementKey) -> Element:
    """The element of a formula."""
    return _ElementDerivation(key).element(key.fingerprint)


class _ElementDerivation:
    """The rests of a formula as expressions, and their derivatives."""

    def __init__(self, key: ElementKey):
        formula, bodies, own_count, number_count = key
        self._body_count, self._coordinate_count = bodies, 3 * bodies + own_count
        self._coordinates = [ca.SX.sym(f"q{k}") for k in range(self._coordinate_count)]
        self._cosines = [ca.SX.sym(f"c{body}") for body in range(bodies)]
        self._sines = [ca.SX.sym(f"s{body}") for body in range(bodies)]
        self._numbers = [ca.SX.sym(f"n{k}") for k in range(number_count)]
        frames = [
            (*self._coordinates[3 * k : 3 * k + 2], self._cosines[k], self._sines[k], self._coordinates[3 * k + 2])
            for k in range(bodies)
        ]
        arguments = [*(part for frame in frames for part in frame), *self._coordinates[3 * bodies :], *self._numbers]
        assert len(arguments) == PARTS_OF_FRAME * bodies + own_count + number_count
        self._factors: list[dict[int, float]] = []
        self._nonlinear: list[set[int]] = []
        self._rest: list[ca.SX] = []
        everything = stack_expressions([*self._coordinates, *self._cosines, *self._sines])
        for value in map(ca.SX, formula.evaluate(arguments)):
            slopes = ca.jacobian(value, everything)
            factors, nonlinear = {}, set()
            for place, column in enumerate(slopes.sparsity().get_triplet()[1]):
                slope = slopes.nz[place]
                if column < self._coordinate_count and slope.is_constant():
                    factors[column] = float(slope)
                else:
                    body = (column - self._coordinate_count) % max(bodies, 1)
                    nonlinear.add(column if column < self._coordinate_count else 3 * body + 2)
            linear = stack_expressions(self._coordinates[column] for column in factors)
            self._factors.append(factors)
            self._nonlinear.append(nonlinear)
            self._rest.append(ca.substitute(value, linear, ca.SX.zeros(len(factors))) if factors else value)

    def element(self, fingerprint: str) -> Element:
        """All that an element consists of."""
        entries = [(row, column) for row, columns in enumerate(self._nonlinear) for column in sorted(columns)]
        slopes = [self._derivative(self._rest[row], column) for row, column in entries]
        groups = self._coordinates, self._cosines, self._sines, self._numbers
        symbols = {symbol.name() for symbol in ca.symvar(stack_expressions([*self._rest, *slopes]))}
        arguments = ElementArguments(
            *(tuple(k for k, symbol in enumerate(group) if symbol.name() in symbols) for group in groups)
        )
        column = stack_expressions(group[k] for group, indices in zip(groups, arguments, strict=True) for k in indices)
        rates = ca.SX.sym("rate", self._coordinate_count)
        second = [ca.SX(0.0) for _ in self._rest]
        for (row, place), slope in zip(entries, slopes, strict=True):
            for other in self._nonlinear[row]:
                second[row] = second[row] + rates[place] * rates[other] * self._derivative(slope, other)
        return Element(
            fingerprint,
            self._body_count,
            self._coordinate_count,
            tuple(self._factors),
            tuple(map(frozenset, self._nonlinear)),
            arguments,
            _recorded([column], self._rest),
            _recorded([column], [*self._rest, *slopes]),
            _recorded([column, rates], second),
        )

    def _derivative(self, value: ca.SX, column: int) -> ca.SX:
        """The derivative by a local coordinate; cos and sin of an angle change with it."""
        slope = ca.jacobian(value, self._coordinates[column])
        body, part = divmod(column, 3)
        if part == 2 and body < self._body_count:
            cosine, sine = self._cosines[body], self._sines[body]
            slope = slope - sine * ca.jacobian(value, cosine) + cosine * ca.jacobian(value, sine)
        return slope


def _recorded(arguments: Sequence[ca.SX], results: Sequence[ca.SX]) -> RecordedFormula:
    return recorded_function(ca.Function("formula", arguments, [ca.densify(stack_expressions(results))]))
