"""The equations of a structure evaluated from its elements by index arrays: no expression of a structure is made.

Every coordinate that elimination solved for is a constant linear combination of y = (z, u) and of the rests of the
pairs' rows, and so is every remaining constraint. The rests depend on few coordinates, those of their own bodies. They
are computed in *stages*: a stage has the rests whose coordinates are known, and then the coordinates that follow from
these and on which later rests depend.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planar.codegen.printed_formula import PrintedFunction
from planar.equations.elements import Element, PlacedElement
from planar.equations.elimination import EliminationRow, substitute_solutions
from planar.equations.sparse_matrices import SparsePattern
from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array, IntArray
from planar.foundation.jets import cos, sin
from planar.foundation.recorded_formula import RecordedFormula, elementwise

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix
    from scipy.sparse.linalg import SuperLU

MAX_DENSE_SIZE = 60
"""Unknowns and inputs up to which all entries of their derivatives are written."""
MAX_KEPT_NUMBERS = 10**6
"""Numbers of an evaluation that is kept."""


class Elimination(NamedTuple):
    """How the rows of all pairs and inputs were solved for coordinates. Indices of coordinates are those of (w, u)."""

    elements: tuple[PlacedElement, ...]
    solved: tuple[tuple[int, EliminationRow], ...]
    "the coordinates that were solved for, each by a row, in an order in which they can be computed"
    lines: tuple[EliminationRow, ...]
    coordinate_count: int
    input_count: int
    number_count: int


class _Combinations(NamedTuple):
    """Sums of the form: coefficient times an entry of x, in the order of their results, `starts` are the first terms
    of every result, `results` their places."""

    results: IntArray
    starts: IntArray
    sources: IntArray
    coefficients: Array

    def set_in(self, target: Array, x: Array) -> None:
        """Set the results in target (..., entries) from x (..., entries)."""
        if len(self.results):
            target[..., self.results] = np.add.reduceat(self.coefficients * x[..., self.sources], self.starts, axis=-1)

    def matrix(self, shape: tuple[int, int]) -> csr_matrix:
        """The matrix (results, x) of the sums."""
        rows = np.repeat(self.results, np.diff(self.starts, append=len(self.sources)))
        return _sparse_matrix(shape, self.coefficients, rows, self.sources)


def _sparse_matrix(shape: tuple[int, int], values: Array, rows: IntArray, columns: IntArray) -> csr_matrix:
    from scipy.sparse import csr_matrix  # few mechanisms are so large

    return csr_matrix((values, (rows, columns)), shape=shape)


def _starts(lengths: Iterable[int]) -> IntArray:
    """The places of the first terms of sums of so many terms each."""
    starts: IntArray = np.cumsum([0, *lengths])[:-1]
    return starts


def _combinations(terms: Iterable[tuple[int, Mapping[int, float]]]) -> _Combinations:
    filled = [(result, sums) for result, sums in terms if sums]
    return _Combinations(
        np.array([result for result, _ in filled], dtype=int),
        _starts(len(sums) for _, sums in filled),
        np.array([source for _, sums in filled for source in sums], dtype=int),
        np.array([value for _, sums in filled for value in sums.values()], dtype=float),
    )


class _Products(NamedTuple):
    """Sums of products: of an entry of a and an entry of b, in the order of their results."""

    results: IntArray
    starts: IntArray
    left: IntArray
    right: IntArray

    def set_in(self, target: Array, a: Array, b: Array) -> None:
        """Set the results in target (..., entries)."""
        if len(self.results):
            products = a[..., self.left] * b[..., self.right]
            target[..., self.results] = np.add.reduceat(products, self.starts, axis=-1)

    def matrix(self, shape: tuple[int, int], a: Array) -> csr_matrix:
        """The matrix (results, b) of the sums for one sample of a."""
        rows = np.repeat(self.results, np.diff(self.starts, append=len(self.left)))
        return _sparse_matrix(shape, a[self.left], rows, self.right)


def _products(terms: Sequence[tuple[int, Sequence[tuple[int, int]]]]) -> _Products:
    """Sums by their results, each of pairs of an entry of a and one of b."""
    return _Products(
        np.array([result for result, _ in terms], dtype=int),
        _starts(len(pairs) for _, pairs in terms),
        np.array([left for _, pairs in terms for left, _ in pairs], dtype=int),
        np.array([right for _, pairs in terms for _, right in pairs], dtype=int),
    )


class _ElementGroup(NamedTuple):
    """The places of one element in a structure that are evaluated together.

    Indices (parts of the element, instances): `arguments` of (s, cos s, sin s, p), `rows` of the rests, `slopes` of the
    entries of their derivatives, `coordinates` of s.
    """

    element: Element
    arguments: IntArray
    rows: IntArray
    slopes: IntArray
    coordinates: IntArray

    def evaluate(self, values: Array, rests: Array, slopes: Array | None) -> None:
        """Set the rests (samples, rows) and the entries of their slopes (samples, entries)."""
        element = self.element
        arguments = [values[:, columns] for columns in self.arguments]
        if slopes is None or not self.slopes.size:
            results = _call(element.rest_function, element.rest, arguments)
        else:
            results = _call(element.slopes_function, element.slopes, arguments)
            for columns, result in zip(self.slopes, results[len(self.rows) :], strict=True):
                slopes[:, columns] = result
        for columns, result in zip(self.rows, results, strict=False):
            rests[:, columns] = result

    def evaluate_second_rates(self, values: Array, rates: Array, rests: Array) -> None:
        """Set the second rates of the rests (samples, rows) that follow from first rates of s (samples, s) alone."""
        if self.slopes.size:
            arguments = [values[:, columns] for columns in self.arguments]
            arguments += [rates[:, columns] for columns in self.coordinates]
            results = _call(self.element.second_rates_function, self.element.second_rates, arguments)
            for columns, result in zip(self.rows, results, strict=True):
                rests[:, columns] = result


def _call(function: PrintedFunction, formula: RecordedFormula, arguments: Sequence[Array]) -> Sequence[Any]:
    """A formula of arrays (samples, instances), which may be arrays of recorded numbers."""
    if not arguments or arguments[0].dtype != object:
        with np.errstate(all="ignore"):  # what is not defined is not a number
            return function(*arguments)
    values = [formula.evaluate(instance) for instance in zip(*(argument[0] for argument in arguments), strict=True)]
    return [np.array(instances, dtype=object) for instances in zip(*values, strict=True)]


class _Stage(NamedTuple):
    """Rests that can be computed, then coordinates that follow from them."""

    groups: list[_ElementGroup]
    rest_rates: _Products
    "(entries of slopes, s) -> rates of the stage's rests"
    coordinates: _Combinations
    "x -> s"


class AssembledJacobians(NamedTuple):
    """F (samples, rows) and the entries of dF/dy (samples, entries)."""

    residuals: Array
    entries: Array


@dataclass(eq=False)
class _Evaluation:
    """What was computed at samples: the arguments of elements (samples, (s, cos s, sin s, p)), x (samples, x), the
    entries of the derivatives of rests (samples, entries), and those of dF/dy once they have been asked for."""

    z: Array
    u: Array
    p: Array
    values: Array
    x: Array
    slopes: Array | None
    jacobian_entries: Array | None = None


class AssembledEquations:
    """Evaluates the equations of one structure. `unknowns` are the coordinates of z, `rows` those of F among the pairs'
    own, of which some are angles that close modulo a turn."""

    def __init__(
        self, elimination: Elimination, unknowns: Sequence[int], rows: Sequence[int], is_angle: Sequence[bool]
    ):
        self._elimination, self._unknowns = elimination, np.array(unknowns, dtype=int)
        self._angle_rows = np.flatnonzero(is_angle)
        self._coordinate_count = elimination.coordinate_count
        self._y_count = len(unknowns) + elimination.input_count
        self._row_count = len(rows)
        self._state_count = elimination.coordinate_count + elimination.input_count
        self._rest_count = max((placed.rows.stop for placed in elimination.elements), default=0)
        self._line_of = dict(elimination.solved)
        self._place_of = {column: place for place, (column, _) in enumerate(elimination.solved)}
        self._y_place_of = {int(column): k for k, column in enumerate(self._unknowns)}
        first_input = len(unknowns)
        for column in range(self._coordinate_count, self._state_count):
            self._y_place_of[column] = first_input + column - self._coordinate_count
        self._residual_sums = [self._line_sums(elimination.lines[row]) for row in rows]
        self._make_slope_entries()
        self._make_stages()
        self._last: _Evaluation | None = None
        self._all_residuals = _combinations(enumerate(self._residual_sums))

    @property
    def argument_counts(self) -> tuple[int, int, int]:
        """How many entries z, u and p have."""
        return len(self._unknowns), self._elimination.input_count, self._elimination.number_count

    # sums over x = (y, rests)

    def _state_sums(self, column: int) -> dict[int, float]:
        """An entry of s as a sum over x."""
        if column in self._y_place_of:
            return {self._y_place_of[column]: 1.0}
        line = self._line_of[column]
        return {source: -value / line.factors[column] for source, value in self._line_sums(line, column).items()}

    def _line_sums(self, line: EliminationRow, pivot: int | None = None) -> dict[int, float]:
        """A constraint as a sum over x, a pivot left out."""
        factors = {column: factor for column, factor in line.factors.items() if column != pivot}
        multipliers = dict(line.multipliers)
        substitute_solutions(factors, multipliers, self._elimination.solved, self._place_of)
        sums = {self._y_place_of[column]: factor for column, factor in factors.items()}
        sums |= {self._y_count + row: multiplier for row, multiplier in multipliers.items()}
        return dict(sorted(sums.items()))

    # stages

    def _make_slope_entries(self) -> None:
        """Number the entries of the derivatives of all rests by s."""
        self._slope_count = 0
        self._first_slope: list[int] = []
        self._row_slopes: list[list[tuple[int, int]]] = [[] for _ in range(self._rest_count)]
        "for every row the numbers of its entries, each with its column in s"
        for placed in self._elimination.elements:
            self._first_slope.append(self._slope_count)
            for row, column in placed.element.slope_entries:
                self._row_slopes[placed.rows[row]].append((self._slope_count, placed.coordinates[column]))
                self._slope_count += 1

    def _make_stages(self) -> None:
        """Part rests and the coordinates on which they depend into stages."""
        first = self._coordinate_count
        needed = {column for entries in self._row_slopes for _, column in entries}
        level: dict[int, int] = {int(column): 0 for column in self._unknowns}
        row_level: dict[int, int] = {}
        y_count = self._y_count

        def level_of_row(row: int) -> int:
            if row not in row_level:
                columns = (column for _, column in self._row_slopes[row])
                row_level[row] = max((level[column] for column in columns if column < first), default=0)
            return row_level[row]

        early: dict[int, int] = {}
        sums_of = self._early_sums = {int(column): self._state_sums(column) for column in self._y_place_of}
        for column, _ in self._elimination.solved:
            if column in needed:
                sums_of[column] = self._state_sums(column)
                sources = [source - y_count for source in sums_of[column] if source >= y_count]
                level[column] = early[column] = 1 + max(map(level_of_row, sources), default=-1)
        self._start_columns = [*self._unknowns.tolist(), *(column for column, value in early.items() if value == 0)]
        self._start_coordinates = _combinations((column, sums_of[column]) for column in self._start_columns)
        count = 1 + max([*map(level_of_row, range(self._rest_count)), *early.values()], default=0)
        by_stage: list[dict[Element, list[tuple[PlacedElement, int]]]] = [{} for _ in range(count)]
        for placed, first_slope in zip(self._elimination.elements, self._first_slope, strict=True):
            for stage in {level_of_row(row) for row in placed.rows}:
                by_stage[stage].setdefault(placed.element, []).append((placed, first_slope))
        terms: list[list[tuple[int, list[tuple[int, int]]]]] = [[] for _ in range(count)]
        for row, slopes in enumerate(self._row_slopes):
            if slopes:
                terms[level_of_row(row)].append((row, slopes))
        self._columns_after_stage: list[list[int]] = [[] for _ in range(count)]
        for column, value in early.items():
            if value:
                self._columns_after_stage[value - 1].append(column)
        self._find_trigonometric_columns()
        self._stages = [
            _Stage(
                [self._group(element, places) for element, places in elements.items()],
                _products(stage_terms),
                _combinations((column, sums_of[column]) for column in columns),
            )
            for elements, stage_terms, columns in zip(by_stage, terms, self._columns_after_stage, strict=True)
        ]

    def _find_trigonometric_columns(self) -> None:
        """The entries of s whose cosines and sines are needed."""
        columns: set[int] = set()
        for placed in self._elimination.elements:
            for body in {*placed.element.arguments.cosines, *placed.element.arguments.sines}:
                columns.add(placed.coordinates[3 * body + 2])
        self._angles = np.array(sorted(columns), dtype=int)
        self._angle_place = {int(column): k for k, column in enumerate(self._angles)}

    def _group(self, element: Element, places: Sequence[tuple[PlacedElement, int]]) -> _ElementGroup:
        taken = element.arguments
        first_cosine = self._state_count
        first_sine, first_number = first_cosine + len(self._angles), first_cosine + 2 * len(self._angles)
        arguments = []
        for placed, _ in places:
            angle_of = [self._angle_place.get(placed.coordinates[3 * k + 2], 0) for k in range(element.body_count)]
            arguments.append(
                [
                    *(placed.coordinates[k] for k in taken.coordinates),
                    *(first_cosine + angle_of[k] for k in taken.cosines),
                    *(first_sine + angle_of[k] for k in taken.sines),
                    *(first_number + placed.numbers[k] for k in taken.numbers),
                ]
            )
        width = len(element.slope_entries)
        indices = (
            arguments,
            [list(placed.rows) for placed, _ in places],
            [range(start, start + width) for _, start in places],
            [placed.coordinates for placed, _ in places],
        )
        return _ElementGroup(element, *(np.array(part, dtype=int).reshape(len(places), -1).T for part in indices))

    # values

    def _evaluate(self, z: Array, u: Array, p: Array, with_slopes: bool) -> _Evaluation:
        """Everything at samples; that of the last ones is kept, of which rates are often asked for next."""
        last = self._last
        if (
            last is not None
            and (last.slopes is not None or not with_slopes)
            and np.array_equal(last.z, z)
            and np.array_equal(last.u, u)
            and np.array_equal(last.p, p)
        ):
            return last
        samples = len(z)
        x: Array = np.zeros((samples, self._y_count + self._rest_count), p.dtype)
        x[:, : z.shape[1]], x[:, z.shape[1] : self._y_count] = z, u
        slopes: Array | None = np.zeros((samples, self._slope_count), p.dtype) if with_slopes else None
        angle_count = len(self._angles)
        first_number = self._state_count + 2 * angle_count
        values: Array = np.zeros((samples, first_number + p.shape[-1]), p.dtype)
        values[:, first_number:] = p
        state = values[:, : self._state_count]
        state[:, self._coordinate_count :] = u
        self._start_coordinates.set_in(state, x)
        cosines = values[:, self._state_count : self._state_count + angle_count]
        sines = values[:, self._state_count + angle_count : first_number]
        for stage in self._stages:
            angles = state[:, self._angles]
            cosines[:], sines[:] = elementwise(cos, angles), elementwise(sin, angles)
            for group in stage.groups:
                group.evaluate(values, x[:, self._y_count :], slopes)
            stage.coordinates.set_in(state, x)
        evaluation = _Evaluation(z.copy(), u.copy(), p.copy(), values, x, slopes)
        self._last = evaluation if values.size <= MAX_KEPT_NUMBERS and values.dtype != object else None
        return evaluation

    def coordinates(self, z: Array, u: Array, p: Array) -> Array:
        """w (samples, coordinates) at z (samples, unknowns), u and p (numbers,) or alike."""
        return self._coordinates(self._evaluate(z, u, p, False).x)

    def _coordinates(self, x: Array) -> Array:
        """w (samples, coordinates) from x, or the rates of one from those of the other."""
        if x.dtype == object or self._y_count <= MAX_DENSE_SIZE:
            return self._sums(self._all_coordinates, x, self._coordinate_count)
        w: Array = np.zeros((len(x), self._coordinate_count), x.dtype)
        w[:, self._unknowns] = x[:, : len(self._unknowns)]
        solved, right_side, factored = self._factored_coordinates
        if len(solved):
            w[:, solved] = factored.solve(right_side @ x.T).T
        return w

    @cached_property
    def _all_coordinates(self) -> _Combinations:
        """x -> w."""
        return _combinations((column, self._state_sums(column)) for column in range(self._coordinate_count))

    @cached_property
    def _factored_coordinates(self) -> tuple[IntArray, csr_matrix, SuperLU]:
        """The coordinates that were solved for, in order; what their equations have of x on the right (coordinates, x),
        and the factored matrix of their factors. Of many links sums over x would be long."""
        from scipy.sparse.linalg import splu

        solved = [column for column, _ in self._elimination.solved]
        left: list[tuple[int, int, float]] = []
        right: list[tuple[int, int, float]] = []
        for place, (_, line) in enumerate(self._elimination.solved):
            for column, factor in line.factors.items():
                if column in self._place_of:
                    left.append((place, self._place_of[column], factor))
                else:
                    right.append((place, self._y_place_of[column], -factor))
            right += [(place, self._y_count + row, -multiplier) for row, multiplier in line.multipliers.items()]
        matrices = []
        for terms, width in ((left, len(solved)), (right, self._y_count + self._rest_count)):
            rows, columns, values = (np.array(part) for part in zip(*terms, strict=True))
            matrices.append(_sparse_matrix((len(solved), width), values, rows, columns))
        factored = splu(matrices[0].tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0)  # it is triangular
        return np.array(solved, dtype=int), matrices[1], factored

    @staticmethod
    def _sums(combinations: _Combinations, x: Array, count: int) -> Array:
        sums: Array = np.zeros((len(x), count), x.dtype)
        combinations.set_in(sums, x)
        return sums

    def _residuals(self, x: Array) -> Array:
        residuals = self._sums(self._all_residuals, x, self._row_count)
        residuals[:, self._angle_rows] = elementwise(wrap_angle, residuals[:, self._angle_rows])
        return residuals

    def residuals_and_jacobians(self, z: Array, u: Array, p: Array) -> AssembledJacobians:
        """F and the entries of dF/dy by their `pattern` at samples."""
        evaluation = self._evaluate(z, u, p, True)
        return AssembledJacobians(self._residuals(evaluation.x), self._jacobian_entries(evaluation))

    def _jacobian_entries(self, evaluation: _Evaluation) -> Array:
        if evaluation.jacobian_entries is None:
            assert evaluation.slopes is not None
            evaluation.jacobian_entries = self._jacobian_plan.entries(evaluation.slopes)
        return evaluation.jacobian_entries

    def derivatives(self, z: Array, u: Array, p: Array) -> list[Array | csr_matrix]:
        """dF/dy (rows, y) at each sample: what is asked once of a structure, so that no plan of entries is made."""
        slopes = self._evaluate(z, u, p, True).slopes
        assert slopes is not None
        return [self._derivatives_at(each) for each in slopes]

    def _derivatives_at(self, slopes: Array) -> Array | csr_matrix:
        y_count, states, rests = self._y_count, self._state_count, self._rest_count
        if y_count <= MAX_DENSE_SIZE:
            rates = self._rates(slopes[None], np.eye(y_count), None)[0]
            return self._sums(self._all_residuals, rates, self._row_count).T
        of_x = states, y_count + rests
        inputs = range(self._coordinate_count, states)
        start = _combinations((column, self._early_sums[column]) for column in (*self._start_columns, *inputs))
        of_states = start.matrix(of_x)[:, :y_count]
        nowhere = np.zeros(0, dtype=int)
        of_rests = _sparse_matrix((rests, y_count), np.zeros(0), nowhere, nowhere)
        for stage in self._stages:
            of_rests = of_rests + stage.rest_rates.matrix((rests, states), slopes) @ of_states
            sums = stage.coordinates.matrix(of_x)
            of_states = of_states + sums[:, :y_count] + sums[:, y_count:] @ of_rests
        sums = self._all_residuals.matrix((self._row_count, y_count + rests))
        return sums[:, :y_count] + sums[:, y_count:] @ of_rests

    def _rates(self, slopes: Array, y_rates: Array, bending: Array | None) -> tuple[Array, Array]:
        """The rates of x and of s for those of y (samples, y); `bending` (samples, rests) is what the rests' second
        rates owe to first ones."""
        samples, split = len(y_rates), len(self._unknowns)
        x_rates: Array = np.zeros((samples, self._y_count + self._rest_count), y_rates.dtype)
        x_rates[:, : self._y_count] = y_rates
        state_rates: Array = np.zeros((samples, self._state_count), y_rates.dtype)
        state_rates[:, self._coordinate_count :] = y_rates[:, split:]
        self._start_coordinates.set_in(state_rates, x_rates)
        rest_rates = x_rates[:, self._y_count :]
        for stage in self._stages:
            stage.rest_rates.set_in(rest_rates, slopes, state_rates)
            if bending is not None:
                rows = stage.rest_rates.results
                rest_rates[:, rows] += bending[:, rows]
            stage.coordinates.set_in(state_rates, x_rates)
        return x_rates, state_rates

    def kinematics(self, y: Array, y1: Array, y2: Array, p: Array) -> tuple[Array, Array, Array]:
        """F (samples, 3, rows) and w (samples, 3, coordinates) with their first and second rates, and the entries of
        dF/dy."""
        samples, split = len(y), len(self._unknowns)
        evaluation = self._evaluate(y[:, :split], y[:, split:], p, True)
        values, x, slopes = evaluation.values, evaluation.x, evaluation.slopes
        assert slopes is not None
        residuals, coordinates = [self._residuals(x)], [self._coordinates(x)]
        bending: Array = np.zeros((samples, self._rest_count))
        for order, rates in enumerate((y1, y2), 1):
            x_rates, state_rates = self._rates(slopes, rates, bending if order == 2 else None)
            residuals.append(self._sums(self._all_residuals, x_rates, self._row_count))
            coordinates.append(self._coordinates(x_rates))
            if order == 1:
                for stage in self._stages:
                    for group in stage.groups:
                        group.evaluate_second_rates(values, state_rates, bending)
        entries = self._jacobian_entries(evaluation)
        return np.stack(residuals, axis=1), np.stack(coordinates, axis=1), entries

    # Jacobians

    @property
    def pattern(self) -> SparsePattern:
        """Where the entries of dF/dy stand."""
        return self._jacobian_plan.pattern

    @cached_property
    def _rest_plan(self) -> _RestPlan:
        """How the derivatives of rests by y are computed."""
        state_entries: dict[int, dict[int, int]] = {}
        constants: list[float] = []

        def add_state(column: int, sums: Mapping[int, float]) -> dict[int, int]:
            entries = {}
            for source, value in sums.items():
                entries[source] = len(constants)
                constants.append(value)
            state_entries[column] = entries
            return entries

        for column in (*self._start_columns, *range(self._coordinate_count, self._state_count)):
            add_state(column, self._early_sums[column])
        rest_entries: dict[int, dict[int, int]] = {}
        rest_count = 0
        steps: list[tuple[_Products, _Combinations]] = []
        for number, stage in enumerate(self._stages):
            terms: list[tuple[int, list[tuple[int, int]]]] = []
            for row in stage.rest_rates.results:
                entries: dict[int, int] = {}
                pairs: dict[int, list[tuple[int, int]]] = {}
                for slope, column in self._row_slopes[row]:
                    for source, place in state_entries[column].items():
                        pairs.setdefault(source, []).append((slope, place))
                for source, factors in pairs.items():
                    entries[source] = rest_count
                    terms.append((rest_count, factors))
                    rest_count += 1
                rest_entries[int(row)] = entries
            sums: list[tuple[int, dict[int, float]]] = []
            for column in self._columns_after_stage[number]:
                constant, varying = self._expand(self._early_sums[column], rest_entries)
                sources = {**constant, **varying}
                places = add_state(column, {source: constant.get(source, 0.0) for source in sources})
                sums += [(places[source], parts) for source, parts in varying.items()]
            steps.append((_products(terms), _combinations(sums)))
        return _RestPlan(np.array(constants), rest_count, steps, rest_entries)

    def _expand(
        self, sums: Mapping[int, float], rest_entries: Mapping[int, Mapping[int, int]]
    ) -> tuple[dict[int, float], dict[int, dict[int, float]]]:
        """The derivative of a sum over x by y: constants, and for every entry of y sums over entries of the rests'."""
        constant = {source: value for source, value in sums.items() if source < self._y_count}
        varying: dict[int, dict[int, float]] = {}
        for source, value in sums.items():
            if source >= self._y_count:
                for column, entry in rest_entries.get(source - self._y_count, {}).items():
                    parts = varying.setdefault(column, {})
                    parts[entry] = parts.get(entry, 0.0) + value
        return constant, varying

    @cached_property
    def _jacobian_plan(self) -> _JacobianPlan:
        plan = self._rest_plan
        entries: list[tuple[int, int, float, dict[int, float]]] = []
        for row, sums in enumerate(self._residual_sums):
            constant, varying = self._expand(sums, plan.rest_entries)
            entries += [
                (column, row, constant.get(column, 0.0), varying.get(column, {})) for column in {**constant, **varying}
            ]
        entries.sort(key=lambda entry: entry[:2])
        columns = np.array([entry[0] for entry in entries], dtype=int)
        first = np.searchsorted(columns, np.arange(self._y_count + 1))
        pattern = SparsePattern(
            (len(self._residual_sums), self._y_count), np.array([entry[1] for entry in entries], dtype=np.int32), first
        )
        return _JacobianPlan(
            pattern, np.array([entry[2] for entry in entries]), _combinations(enumerate(e[3] for e in entries)), plan
        )


class _RestPlan(NamedTuple):
    """The derivatives of rests by y: entries of those of s begin as constants, then stage after stage products of
    slopes and entries of s give entries of the rests, and these change entries of s."""

    state_constants: Array
    rest_count: int
    steps: list[tuple[_Products, _Combinations]]
    rest_entries: dict[int, dict[int, int]]
    "for every row its entries by y"

    def entries(self, slopes: Array) -> Array:
        """Entries (samples, entries) of the derivatives of all rests."""
        rests: Array = np.zeros((len(slopes), self.rest_count), slopes.dtype)
        state = np.repeat(self.state_constants[None].astype(slopes.dtype), len(slopes), axis=0)
        for products, sums in self.steps:
            products.set_in(rests, slopes, state)
            if len(sums.results):
                constant = state[:, sums.results].copy()
                sums.set_in(state, rests)
                state[:, sums.results] += constant
        return rests


class _JacobianPlan(NamedTuple):
    """Entries of a Jacobian, column after column: constants, and sums over entries of the rests' derivatives."""

    pattern: SparsePattern
    constants: Array
    sums: _Combinations
    rest_plan: _RestPlan

    def entries(self, slopes: Array) -> Array:
        """The entries (samples, entries)."""
        rests = self.rest_plan.entries(slopes)
        entries: Array = np.zeros((len(slopes), len(self.constants)), slopes.dtype)
        self.sums.set_in(entries, rests)
        return entries + self.constants
