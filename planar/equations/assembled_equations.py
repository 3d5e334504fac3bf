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


class _Sums(NamedTuple):
    """Sums of products of a factor and an entry of x, in the order of their results: `starts` are the first terms of
    every result, `results` their places. Factors are numbers, or the places of entries of another array."""

    results: IntArray
    starts: IntArray
    sources: IntArray
    factors: Any
    "numbers, or places (terms,)"

    def values(self, x: Array, entries: Array | None = None) -> Array:
        """The results (..., results) of x (..., entries), of whose array factors are `entries` (..., entries)."""
        factors = self.factors if entries is None else entries[..., self.factors]
        sums: Array = np.add.reduceat(factors * x[..., self.sources], self.starts, axis=-1)
        return sums

    def set_in(self, target: Array, x: Array, entries: Array | None = None) -> None:
        """Set the results in target (..., entries)."""
        if len(self.results):
            target[..., self.results] = self.values(x, entries)


def _sums(terms: Iterable[tuple[int, Iterable[tuple[int, float]]]], factor_type: type = float) -> _Sums:
    """Sums by their results, each of pairs of a source and a factor, which is a number or a place."""
    filled = [(result, pairs) for result, sums in terms if (pairs := list(sums))]
    return _Sums(
        np.array([result for result, _ in filled], dtype=int),
        np.cumsum([0, *(len(pairs) for _, pairs in filled)])[:-1],
        np.array([source for _, pairs in filled for source, _ in pairs], dtype=int),
        np.array([factor for _, pairs in filled for _, factor in pairs], dtype=factor_type),
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
    rest_rates: _Sums
    "s, by entries of slopes -> rates of the stage's rests"
    coordinates: _Sums
    "x -> s"


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
        self._number_slopes()
        self._make_stages()
        self._last: _Evaluation | None = None
        self._all_residuals = _sums((row, sums.items()) for row, sums in enumerate(self._residual_sums))

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

    def _number_slopes(self) -> None:
        """Number the entries of the derivatives of all rests by s, and the angles of s whose cos and sin they need."""
        self._slope_count = 0
        self._first_slope: list[int] = []
        self._row_slopes: list[list[tuple[int, int]]] = [[] for _ in range(self._rest_count)]
        "for every row the columns of its entries in s, each with the entry's number"
        angles: set[int] = set()
        for placed in self._elimination.elements:
            self._first_slope.append(self._slope_count)
            for row, column in placed.element.slope_entries:
                self._row_slopes[placed.rows[row]].append((placed.coordinates[column], self._slope_count))
                self._slope_count += 1
            taken = placed.element.arguments
            angles |= {placed.coordinates[3 * body + 2] for body in (*taken.cosines, *taken.sines)}
        self._angles = np.array(sorted(angles), dtype=int)

    def _make_stages(self) -> None:
        """Part rests and the coordinates on which they depend into stages."""
        first = self._coordinate_count
        needed = {column for entries in self._row_slopes for column, _ in entries}
        level: dict[int, int] = {int(column): 0 for column in self._unknowns}
        row_level: dict[int, int] = {}
        y_count = self._y_count

        def level_of_row(row: int) -> int:
            if row not in row_level:
                columns = (column for column, _ in self._row_slopes[row])
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
        self._start_coordinates = self._early_combinations(self._start_columns)
        count = 1 + max([*map(level_of_row, range(self._rest_count)), *early.values()], default=0)
        by_stage: list[dict[Element, list[tuple[PlacedElement, int]]]] = [{} for _ in range(count)]
        for placed, first_slope in zip(self._elimination.elements, self._first_slope, strict=True):
            for stage in {level_of_row(row) for row in placed.rows}:
                by_stage[stage].setdefault(placed.element, []).append((placed, first_slope))
        terms: list[list[tuple[int, list[tuple[int, int]]]]] = [[] for _ in range(count)]
        for row, slopes in enumerate(self._row_slopes):
            terms[level_of_row(row)].append((row, slopes))
        self._columns_after_stage: list[list[int]] = [[] for _ in range(count)]
        for column, value in early.items():
            if value:
                self._columns_after_stage[value - 1].append(column)
        self._stages = [
            _Stage(
                [self._group(element, places) for element, places in elements.items()],
                _sums(stage_terms, int),
                self._early_combinations(columns),
            )
            for elements, stage_terms, columns in zip(by_stage, terms, self._columns_after_stage, strict=True)
        ]

    def _early_combinations(self, columns: Iterable[int]) -> _Sums:
        """x -> entries of s on which rests depend."""
        return _sums((column, self._early_sums[column].items()) for column in columns)

    def _group(self, element: Element, places: Sequence[tuple[PlacedElement, int]]) -> _ElementGroup:
        taken = element.arguments
        first_cosine = self._state_count
        first_sine, first_number = first_cosine + len(self._angles), first_cosine + 2 * len(self._angles)
        place_of_angle = {int(column): k for k, column in enumerate(self._angles)}
        arguments = []
        for placed, _ in places:
            angle_of = [place_of_angle.get(placed.coordinates[3 * k + 2], 0) for k in range(element.body_count)]
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
            return _all_values(self._all_coordinates, x, self._coordinate_count)
        w: Array = np.zeros((len(x), self._coordinate_count), x.dtype)
        w[:, self._unknowns] = x[:, : len(self._unknowns)]
        solved, right_side, factored = self._factored_coordinates
        if len(solved):
            w[:, solved] = factored.solve(right_side @ x.T).T
        return w

    @cached_property
    def _all_coordinates(self) -> _Sums:
        """x -> w."""
        return _sums((column, self._state_sums(column).items()) for column in range(self._coordinate_count))

    @cached_property
    def _factored_coordinates(self) -> tuple[IntArray, csr_matrix, SuperLU]:
        """The coordinates that were solved for, in order; what their equations have of x on the right (coordinates, x),
        and the factored matrix of their factors. Of many links sums over x would be long."""
        from scipy.sparse import csr_matrix  # few mechanisms are so large
        from scipy.sparse.linalg import splu

        solved = [column for column, _ in self._elimination.solved]
        solved_terms: list[tuple[int, int, float]] = []
        known_terms: list[tuple[int, int, float]] = []
        for place, (_, line) in enumerate(self._elimination.solved):
            for column, factor in line.factors.items():
                if column in self._place_of:
                    solved_terms.append((place, self._place_of[column], factor))
                else:
                    known_terms.append((place, self._y_place_of[column], -factor))
            known_terms += [(place, self._y_count + row, -multiplier) for row, multiplier in line.multipliers.items()]
        matrices = []
        for terms, width in ((solved_terms, len(solved)), (known_terms, self._y_count + self._rest_count)):
            rows, columns, values = (np.array(part) for part in zip(*terms, strict=True))
            matrices.append(csr_matrix((values, (rows, columns)), shape=(len(solved), width)))
        factored = splu(matrices[0].tocsc(), permc_spec="NATURAL", diag_pivot_thresh=0.0)  # it is triangular
        return np.array(solved, dtype=int), matrices[1], factored

    def _residuals(self, x: Array) -> Array:
        residuals = _all_values(self._all_residuals, x, self._row_count)
        residuals[:, self._angle_rows] = elementwise(wrap_angle, residuals[:, self._angle_rows])
        return residuals

    def residuals_and_jacobians(self, z: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """F (samples, rows) and the entries (samples, entries) of dF/dy by their `pattern`, at samples."""
        evaluation = self._evaluate(z, u, p, True)
        return self._residuals(evaluation.x), self._jacobian_entries(evaluation)

    def _jacobian_entries(self, evaluation: _Evaluation) -> Array:
        if evaluation.jacobian_entries is None:
            assert evaluation.slopes is not None
            evaluation.jacobian_entries = self._jacobian_plan.entries(evaluation.slopes)
        return evaluation.jacobian_entries

    def _rates(self, slopes: Array, y_rates: Array, bending: Array) -> tuple[Array, Array]:
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
            stage.rest_rates.set_in(rest_rates, state_rates, slopes)
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
            x_rates, state_rates = self._rates(slopes, rates, bending)
            residuals.append(_all_values(self._all_residuals, x_rates, self._row_count))
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
    def _jacobian_plan(self) -> _JacobianPlan:
        """How the derivatives by y are computed."""
        constants: list[float] = []
        state_entries: dict[int, dict[int, int]] = {}
        "by columns of s: of every entry of y the place of the derivative"
        rest_entries: dict[int, dict[int, int]] = {}
        rest_count = 0
        steps: list[tuple[_Sums, _Sums]] = []

        def add_entries(sums: Mapping[int, float]) -> tuple[dict[int, int], list[tuple[int, Iterable[_Term]]]]:
            """The places of the derivatives of a sum over x, and what those of rests add to them."""
            places: dict[int, int] = {}
            parts: dict[int, dict[int, float]] = {}
            for source, factor in sums.items():
                by_rest = source >= self._y_count
                for column, entry in rest_entries.get(source - self._y_count, {}).items() if by_rest else ():
                    terms = parts.setdefault(column, {})
                    terms[entry] = terms.get(entry, 0.0) + factor
                if not by_rest:
                    places[source] = len(constants)
                    constants.append(factor)
            for column in parts:
                if column not in places:
                    places[column] = len(constants)
                    constants.append(0.0)
            return places, [(places[column], terms.items()) for column, terms in parts.items()]

        for column in (*self._start_columns, *range(self._coordinate_count, self._state_count)):
            state_entries[column], _ = add_entries(self._early_sums[column])
        for stage, columns in zip(self._stages, self._columns_after_stage, strict=True):
            products: list[tuple[int, list[tuple[int, int]]]] = []
            for row in stage.rest_rates.results.tolist():
                pairs: dict[int, list[tuple[int, int]]] = {}
                for column, slope in self._row_slopes[row]:
                    for source, place in state_entries[column].items():
                        pairs.setdefault(source, []).append((place, slope))
                rest_entries[row] = {source: rest_count + k for k, source in enumerate(pairs)}
                products += zip(rest_entries[row].values(), pairs.values(), strict=True)
                rest_count += len(pairs)
            changes = []
            for column in columns:
                state_entries[column], added = add_entries(self._early_sums[column])
                changes += added
            steps.append((_sums(products, int), _sums(changes)))
        entries: list[tuple[int, int, int]] = []
        changes_of: dict[int, Iterable[_Term]] = {}
        for row, sums in enumerate(self._residual_sums):
            places, added = add_entries(sums)
            changes_of |= added
            entries += [(column, row, place) for column, place in places.items()]
        entries.sort()
        steps.append((_sums((), int), _sums((place, changes_of.get(place, ())) for *_, place in entries)))
        entry_columns, rows, order = np.array(entries, dtype=int).reshape(-1, 3).T
        first = np.searchsorted(entry_columns, np.arange(self._y_count + 1))
        pattern = SparsePattern((self._row_count, self._y_count), rows.astype(np.int32), first)
        return _JacobianPlan(pattern, np.array(constants), rest_count, steps, order)


_Term = tuple[int, float]
"""A source and a factor."""


def _all_values(sums: _Sums, x: Array, count: int) -> Array:
    """The results (samples, count) of sums of x (samples, x), nothing where there is no sum."""
    values: Array = np.zeros((len(x), count), x.dtype)
    sums.set_in(values, x)
    return values


class _JacobianPlan(NamedTuple):
    """Derivatives by y: entries of those of s, and of F behind them, begin as constants, then stage after stage
    products of slopes and entries of s give entries of the rests, and these change entries of s, at last those of F."""

    pattern: SparsePattern
    "where the entries of dF/dy stand"
    constants: Array
    rest_count: int
    steps: list[tuple[_Sums, _Sums]]
    order: IntArray
    "the entries of dF/dy, column after column"

    def entries(self, slopes: Array) -> Array:
        """The entries (samples, entries) of dF/dy."""
        rests: Array = np.zeros((len(slopes), self.rest_count), slopes.dtype)
        state = np.repeat(self.constants[None].astype(slopes.dtype), len(slopes), axis=0)
        for products, changes in self.steps:
            products.set_in(rests, state, slopes)
            if len(changes.results):
                state[:, changes.results] += changes.values(rests)
        return state[:, self.order]
