"""Derivatives of positions, velocities and accelerations of all links by implicit differentiation.

All constraints F(q, p) = 0 in the coordinates q of the links, those of the inputs among them, hold with their first and
second rates for every value of the parameters. Evaluated on jets along the parameters, in which the derivatives of one
order of rates are still zero, each of them leaves open what J dq has to close, with the one matrix J = dF/dq for
positions, velocities and accelerations (A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, ch. 13 and 15).
Second derivatives follow in the same way from jets of the second order.

A jet along the parameters is Jet(value, slopes), whose slopes have a last axis for the parameters; one of the second
order is a jet of such jets, with two axes. Time derivatives are jets around these.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.document.dimensions import Dimension, change_dimensions, file_dimensions
from planar.dynamics.equilibrium import Equilibrium
from planar.dynamics.external_actions import LinkMotion
from planar.dynamics.link_coordinates import LinkCoordinates
from planar.equations.coordinates import consecutive_ranges
from planar.equations.elements import ElementGroup, PlacedElement, group_elements, pattern_of_groups
from planar.equations.mechanism_numbers import equation_structure, shapes_of_links
from planar.equations.sparse_matrices import SparseMatrices
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Jet, Scalar, constant_jet, cos, sin
from planar.model.mechanism import Input, Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.solving.position import solved_mechanism

DESIGN_SECTIONS = ("links", "pairs", "loads", "springs", "masses", "gravity")
"""Of the file: numbers of the design itself. Inputs run, sketches choose, and neither changes what is solved."""
INPUT_RATES = ("position", "velocity", "acceleration")


def design_dimensions(mechanism: Mechanism) -> tuple[Dimension, ...]:
    """The numbers of a mechanism's file that are no counts, no stops, and no numbers of its inputs' courses."""
    return tuple(
        dimension
        for dimension in file_dimensions(mechanism).values()
        if dimension.path[0] in DESIGN_SECTIONS
        and dimension.kind != "count"
        and dimension.address[0] not in ("stops", "pair_stiffness")
        and "varies" not in dimension.address
    )


class Parameters:
    """The parameters of a mechanism: `names`, `dimensions` of the file, and `unit`, its size (m).

    `offsets` name pairs whose pins may stand aside in their holes: by `clearance.B.x` and `clearance.B.y` (m, in the
    axes of the pair's first link), the last ones. Raises BadInput of a mechanism of which no derivatives are known.
    """

    def __init__(self, mechanism: Mechanism, offsets: tuple[str, ...] = ()):
        solver = solved_mechanism(mechanism).solver
        solver.refuse_misfit("derivatives are not told")
        for pair in mechanism.pairs:
            if not pair.measures_symbols:
                raise BadInput(pair.name, "derivatives are not told of a mechanism with a cam of given points")
        self.mechanism, self.offsets, self.unit = mechanism, offsets, solver.unit
        self.file_dimensions = design_dimensions(mechanism)
        self.dimensions = (
            *self.file_dimensions,
            *(_offset_dimension(pair, axis) for pair in offsets for axis in "xy"),
        )
        self.inputs = tuple(given.pair for given in mechanism.inputs)
        self.names = (
            *(f"{name}.{rate}" for rate in INPUT_RATES for name in self.inputs),
            *(dimension.name for dimension in self.dimensions),
        )

    @cached_property
    def scale(self) -> Array:
        """What each parameter is in units of (parameters,): m for a length of the mechanism's size, else as it is."""
        motions = relative_motions(self.mechanism)
        kinds = [motions[name].input_quantity_kinds()[0] for name in self.inputs] * len(INPUT_RATES)
        kinds += [dimension.kind for dimension in self.dimensions]
        return np.array([self.unit if kind == "length" else 1.0 for kind in kinds])

    def mechanism_with(self, numbers: Sequence[Scalar]) -> Mechanism:
        """The mechanism with other numbers, of any arithmetic, in place of those of the file; inputs, courses of loads
        and stops are left out."""
        changed = replace(
            self.mechanism,
            inputs=tuple(Input(name, 0.0) for name in self.inputs),
            loads=tuple(load._replace(varies=None) for load in self.mechanism.loads),
            stops=(),
        )
        return change_dimensions(changed, zip(self.file_dimensions, numbers, strict=True))


def _offset_dimension(pair: str, axis: str) -> Dimension:
    place = ("tolerances", "clearance", pair, axis)
    return Dimension(f"clearance.{pair}.{axis}", 0.0, "length", "", place, place)


TINY = 1e-300
ROUNDING = 1e-15
"""Of the greatest derivative of a coordinate (sizes, rad) by a parameter: lesser ones are rounding of none."""
CONTRADICTION = 1e-7
"""Constraints that no change of the coordinates keeps, by more than this part, are contradicted."""
OPENING = 1e-6
"""Contacts that are opened by more than this part of a change (sizes, rad) do not go with it."""
GROUND_RATES = ((0.0, 0.0, 1.0, 0.0, 0.0), (0.0,) * 5, (0.0,) * 5)


class ConstraintElements(LinkCoordinates):
    """The constraints of one structure, and the positions of its inputs, by elements: a row each."""

    def __init__(self, mechanism: Mechanism):
        super().__init__(mechanism)
        motions = relative_motions(mechanism)
        inputs = [motions[driven.pair] for driven in mechanism.inputs]
        numbered = {pair.name: pair for pair in (*mechanism.pairs, *inputs)}
        self.numbered_pairs = tuple(numbered)
        "the names of the pairs whose numbers are p, one after the other"
        placement = self.element_placement(numbered.values())
        self.pair_rows = consecutive_ranges({pair.name: len(pair.residual_kinds) for pair in mechanism.pairs})
        self.placed_pairs: dict[str, PlacedElement] = {
            pair.name: placement.residual_of(pair, self.pair_rows[pair.name].start) for pair in mechanism.pairs
        }
        self.constraint_count = sum(len(pair.residual_kinds) for pair in mechanism.pairs)
        placed_inputs = [placement.input_position_of(pair, self.constraint_count + k) for k, pair in enumerate(inputs)]
        self.row_count = self.constraint_count + len(inputs)
        self.groups = group_elements([*self.placed_pairs.values(), *placed_inputs])
        kinds = [kind for pair in mechanism.pairs for kind in pair.residual_kinds]
        self.is_length_row = np.array(
            [kind is MeasureKind.LENGTH for kind in (*kinds, *(i.input_kind for i in inputs))]
        )
        own_kinds = [kind for pair in mechanism.pairs for _, kind in pair.coordinate_kinds]
        of_links = [MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.ANGLE] * len(self.links)
        self.is_length = np.array([kind is MeasureKind.LENGTH for kind in (*of_links, *own_kinds)])
        self.pattern, self.entries = pattern_of_groups(self.groups, self.row_count, self.coordinate_count)
        "of every group the entries there (places, rows, local coordinates)"


_cached_elements = lru_cache(maxsize=32)(ConstraintElements)


def constraint_elements(mechanism: Mechanism) -> ConstraintElements:
    """The elements of a mechanism's structure, kept for all of its numbers."""
    return _cached_elements(equation_structure(mechanism))


def element_arguments(group: ElementGroup, q: Scalar, p: Scalar, orders: int) -> list[Scalar]:
    """What the formulas of an element take, from coordinates that are jets of `orders` parts in time, or, of none,
    numbers alone, and numbers p without a time."""
    taken, arguments = group.element.arguments, []
    arguments += [take_entries(q, group.coordinates[:, k]) for k in taken.coordinates]
    angles = {body: take_entries(q, group.coordinates[:, 3 * body + 2]) for body in {*taken.cosines, *taken.sines}}
    arguments += [cos(angles[body]) for body in taken.cosines]
    arguments += [sin(angles[body]) for body in taken.sines]
    numbers = [take_entries(p, group.numbers[:, k]) for k in taken.numbers]
    return [*arguments, *(constant_jet(number, orders) if orders else number for number in numbers)]


def variable_jet(value: Array, *derivatives: Array) -> Scalar:
    """What depends on the parameters: values (n, entries), slopes (n, entries, parameters), and second ones; values
    alone have one axis for none."""
    if not derivatives:
        return value[..., None]
    if len(derivatives) == 1:
        return Jet(value[..., None], derivatives[0])
    slopes, second_slopes = derivatives
    return Jet(Jet(value[..., None, None], slopes[..., None, :]), Jet(slopes[..., None], second_slopes))


def take_entries(value: Scalar, entries: Any) -> Scalar:
    """Some entries of arrays (n, entries, ...) in a jet, or of a jet of jets."""
    if isinstance(value, Jet):
        return Jet(*(take_entries(part, entries) for part in value.parts))
    return value[:, entries]


def slopes_of_order(value: Scalar, order: int) -> Scalar:
    """The derivatives of an order, of a number that may have none: 0; of order 0 the number itself."""
    if order:
        for _ in range(order):
            value = value.parts[1] if isinstance(value, Jet) else 0.0
        return value
    while isinstance(value, Jet):
        value = value.parts[0]
    return value


def stack_numbers(numbers: Sequence[Scalar], count: int, order: int) -> Scalar:
    """Numbers as one jet of arrays (1 or n, numbers, ...), of `count` parameters; of order 0 an array (1 or n, numbers,
    1)."""
    size = max((np.size(slopes_of_order(number, 0)) for number in numbers), default=1)
    arrays: list[Array] = [np.zeros((size, len(numbers), *((count,) * axes))) for axes in range(order + 1)]
    for k, number in enumerate(numbers):
        arrays[0][:, k] = np.ravel(slopes_of_order(number, 0))
        for axes in range(1, order + 1) if isinstance(number, Jet) else ():
            inner = number if axes == order else number.parts[0]
            shape = size, *((1,) * (order - axes)), *((count,) * axes)
            arrays[axes][:, k] = np.broadcast_to(slopes_of_order(inner, axes), shape).reshape(arrays[axes][:, k].shape)
    return variable_jet(*arrays)


class Directions:
    """The parameters along which there are derivatives: all of them, or those of some `columns` among their names, and
    `extra` ones behind them on which no coordinates depend."""

    def __init__(self, parameters: Parameters, columns: Sequence[int] | None = None, extra: int = 0):
        chosen = range(len(parameters.names)) if columns is None else columns
        self.places = {column: place for place, column in enumerate(chosen)}
        self.count = len(self.places) + extra

    def jet(self, column: int, value: Scalar, order: int) -> Scalar:
        """The parameter of a column, of an order; one that is not chosen is a number."""
        place = self.places.get(column)
        if place is None or order == 0:
            return value
        unit: Array = np.zeros(self.count)
        unit[place] = 1.0
        return Jet(value, unit) if order == 1 else Jet(Jet(value, unit), Jet(unit[:, None], 0.0))


class FileNumbers:
    """A mechanism with numbers of any arithmetic in place of those of its file: its `mechanism`, `shapes`, `measured`
    numbers of pairs by name, and `p`, those of all constraints one after the other."""

    def __init__(
        self,
        parameters: Parameters,
        pairs: Iterable[str],
        numbers: Sequence[Scalar],
        stack: Callable[[Sequence[Scalar]], Scalar],
    ):
        """`numbers` are those of the dimensions; `stack` makes p (1 or n, numbers, ...) of the numbers of `pairs`."""
        file_count = len(parameters.file_dimensions)
        self.mechanism = parameters.mechanism_with(numbers[:file_count])
        self.shapes = shapes_of_links(self.mechanism)
        self.relative_motions = relative_motions(self.mechanism)
        known = {pair.name: pair for pair in self.mechanism.pairs} | dict(self.relative_motions)
        self.measured = {
            name: list(pair.measure([self.shapes[link] for link in pair.bodies])) for name, pair in known.items()
        }
        for k, name in enumerate(parameters.offsets):
            offset = Vector(*numbers[file_count + 2 * k : file_count + 2 * k + 2])
            self.measured[name] = list(known[name].offset_pin(self.measured[name], offset))
        self.p = stack([value for name in pairs for value in self.measured[name]])


class CoordinateMotion(LinkMotion):
    """Positions of links and of relative motions from the coordinates q of links, jets in time of arrays (n,
    coordinates, ...) or of symbols (1, coordinates)."""

    def __init__(self, columns: LinkCoordinates, numbers: FileNumbers, size: float, q: Jet):
        self.columns, self.numbers, self._size, self.q = columns, numbers, size, q
        self.mechanism, self.shapes, self.orders = numbers.mechanism, numbers.shapes, len(q.parts)
        self._frames: dict[str, Frame] = {}

    @property
    def size(self) -> float:
        return self._size

    def moving_frame(self, link: str) -> Frame:
        """A link's axes as jets in time."""
        if link not in self._frames:
            first = self.columns.link_columns[link]
            self._frames[link] = frame_at(*(take_entries(self.q, first + k) for k in range(3)))
        return self._frames[link]

    def frame_rates(self, link: str) -> Sequence[Sequence[Scalar]]:
        if link not in self.columns.link_columns:
            return GROUND_RATES
        parts = [part.parts for part in self.moving_frame(link)[:5]]
        return [[part[rate] for part in parts] for rate in range(len(parts[0]))]

    def own_coordinates(self, name: str) -> tuple[Jet, ...]:
        """The coordinates of a pair's own as jets in time."""
        columns = self.columns.own_slices.get(name, slice(0, 0))
        return tuple(take_entries(self.q, k) for k in range(columns.start, columns.stop))

    def input_position(self, pair: Pair) -> Jet:
        """The position of a relative motion with its rates."""
        frames = [
            self.moving_frame(link) if link in self.columns.link_columns else self.frame(link) for link in pair.bodies
        ]
        numbers = [constant_jet(number, self.orders) for number in self.numbers.measured[pair.name]]
        position = pair.input_position(frames, numbers, self.own_coordinates(pair.name))
        return position if isinstance(position, Jet) else Jet(position, *([0.0] * (self.orders - 1)))


class KinematicSlopes:
    """The derivatives of all coordinates and their rates at positions (n), in the parameters.

    `rates` are the coordinates (n, coordinates), alone or with their first and second rates; `values` are those of the
    dimensions, by default of the file: numbers, or arrays (n,) for n positions.
    """

    def __init__(
        self,
        parameters: Parameters,
        rates: Sequence[Array],
        directions: Directions | None = None,
        values: Sequence[Any] | None = None,
    ):
        self.parameters, self.rates, self._values = parameters, rates, values
        self.directions = Directions(parameters) if directions is None else directions
        self.count = self.directions.count
        self.elements = constraint_elements(parameters.mechanism)
        self.first_numbers = self.numbers(1)
        unit = parameters.unit
        self._row_scale = np.where(self.elements.is_length_row, 1.0 / unit, 1.0)[:, None]
        self._column_scale = np.where(self.elements.is_length, unit, 1.0)[:, None]
        scaled = self._scaled_jacobian(slopes_of_order(self.first_numbers.p, 0)[..., 0])
        sizes = scaled.column_norms(TINY)
        self._column_scale = self._column_scale / sizes[..., None]
        self._constraints = Equilibrium(scaled.divide_columns(sizes))
        self.is_singular: BoolArray = np.asarray(np.any(self._constraints.null_space, axis=(1, 2)))
        "(n,): where constraints and inputs do not determine the coordinates, so that there are no derivatives"
        self.is_singular |= ~np.isfinite(scaled.values).all(axis=1)
        self.contradicts: BoolArray = np.zeros((len(rates[0]), self.count), dtype=bool)
        "(n, parameters): whether constraints contradict a change of a parameter alone"
        self.first_slopes = self._solve(1, self.first_numbers)

    def numbers(self, order: int) -> FileNumbers:
        """The numbers of the file as jets of an order; of order 0 as they are."""
        first = 3 * len(self.parameters.inputs)
        dimensions = self.parameters.dimensions
        numbers = []
        for index, value in enumerate([d.value for d in dimensions] if self._values is None else self._values):
            shaped = np.reshape(value, (-1, *((1,) * max(order, 1)))) if np.ndim(value) else value
            numbers.append(self.directions.jet(first + index, shaped, order))
        pairs = self.elements.numbered_pairs
        return FileNumbers(self.parameters, pairs, numbers, lambda values: stack_numbers(values, self.count, order))

    def _scaled_jacobian(self, p: Array) -> SparseMatrices:
        """dF/dq (n, rows, coordinates), lengths in sizes of the mechanism."""
        pattern = self.elements.pattern
        values: Array = np.zeros((len(self.rates[0]), len(pattern.rows)))
        for group, entries in zip(self.elements.groups, self.elements.entries, strict=True):
            _, slopes = group.evaluate(self.rates[0], p)
            for column in range(slopes.shape[-1]):
                values[:, entries[..., column]] += slopes[..., column]
        scale = self._row_scale[pattern.rows, 0] * self._column_scale[pattern.columns, 0]
        return SparseMatrices(pattern, values * scale)

    def _coordinates(self, *derivatives: Sequence[Array]) -> Jet:
        """The coordinates as jets in time, as far as their derivatives are given."""
        return Jet(*(variable_jet(value, *slopes) for value, *slopes in zip(self.rates, *derivatives, strict=False)))

    @cached_property
    def motion(self) -> CoordinateMotion:
        """The positions of links with their first derivatives."""
        return self._motion(self.first_numbers, self.first_slopes)

    @cached_property
    def second_motion(self) -> CoordinateMotion:
        """The positions of links with their second derivatives."""
        numbers = self.numbers(2)
        return self._motion(numbers, self.first_slopes, self._solve(2, numbers))

    def _motion(self, numbers: FileNumbers, *derivatives: Sequence[Array]) -> CoordinateMotion:
        return CoordinateMotion(self.elements, numbers, self.parameters.unit, self._coordinates(*derivatives))

    def _solve(self, order: int, numbers: FileNumbers) -> list[Array]:
        """The derivatives of an order of the coordinates and their rates (n, coordinates, parameters, ...)."""
        shape = len(self.rates[0]), self.elements.coordinate_count, *([self.count] * order)
        solved: list[Array] = []
        for rate in range(len(self.rates)):
            tried = [*solved, np.zeros(shape)]
            q = self._coordinates(tried) if order == 1 else self._coordinates(self.first_slopes, tried)
            opening = self._opening(q, numbers.p, rate, order)
            columns = opening.reshape(*opening.shape[:2], self.count**order) * self._row_scale
            constraints = self._constraints
            slopes = -constraints.solve(columns)
            slopes -= constraints.solve(columns + constraints.matrix @ slopes)  # refined once
            slopes[np.abs(slopes) < ROUNDING * np.abs(slopes).max(axis=1, keepdims=True, initial=0.0)] = 0.0
            if order == 1:
                residual = np.abs(columns + constraints.matrix @ slopes).max(axis=1, initial=0.0)
                terms = np.maximum(np.abs(columns).max(axis=1, initial=0.0), np.abs(slopes).max(axis=1, initial=0.0))
                self.contradicts |= residual > CONTRADICTION * terms
            solved.append((slopes * self._column_scale).reshape(shape))
        return solved

    def _opening(self, q: Jet, p: Scalar, rate: int, order: int) -> Array:
        """By how much a rate of all constraints is opened (n, rows, parameters, ...), the derivatives of the
        coordinates in it still zero."""
        opening: Array = np.zeros((len(self.rates[0]), self.elements.row_count, *([self.count] * order)))
        with np.errstate(all="ignore"):  # what is not defined is not a number
            for group in self.elements.groups:
                rests = group.element.rest.evaluate(element_arguments(group, q, p, rate + 1))
                for row, rest in enumerate(rests):
                    part = rest.parts[rate] if isinstance(rest, Jet) else 0.0
                    opening[:, group.rows[:, row]] = slopes_of_order(part, order)
        if order == 1:  # what inputs prescribe
            for k in range(len(self.parameters.inputs)):
                place = self.directions.places.get(rate * len(self.parameters.inputs) + k)
                if place is not None:
                    opening[:, self.elements.constraint_count + k, place] -= 1.0
        return opening

    @cached_property
    def tied(self) -> BoolArray:
        """Which parameters cannot change alone at each position (n, parameters): constraints contradict it, or a
        contact that other pairs have to keep closed opens."""
        opened: BoolArray = np.zeros_like(self.contradicts)
        unit, scale = self.parameters.unit, np.ones(self.count)
        for column, place in self.directions.places.items():
            scale[place] = self.parameters.scale[column]
        for pair in self.first_numbers.mechanism.pairs:
            if type(pair).contact_gap is not Pair.contact_gap:
                coordinates = [coordinate.parts[0] for coordinate in self.motion.own_coordinates(pair.name)]
                gap = pair.contact_gap(self.first_numbers.measured[pair.name], coordinates)
                opened |= np.abs(slopes_of_order(gap, 1) / unit * scale) > OPENING
        tied: BoolArray = self.contradicts | opened
        tied[self.is_singular] = False
        return tied


class NamedResult(NamedTuple):
    """A result by the name that it has in a state, its kind of quantity, and its parts, numbers of any arithmetic."""

    name: str
    kind: str
    parts: tuple[Scalar, ...]


POSITION_KINDS = ("length", "angle")
"""Of results that follow from positions alone."""
POINT_RESULTS = {"position": "length", "velocity": "velocity", "acceleration": "acceleration"}
LINK_RESULTS = ("angle", "angular_velocity", "angular_acceleration")


def kinematic_results(motion: CoordinateMotion, points: Mapping[str, tuple[str, str]], name: str) -> list[NamedResult]:
    """The results of a state of a name: of a point, else of a link, and of a pair; `points` are (link, point) by name.

    Without rates only what follows from positions.
    """
    results, orders = [], motion.orders
    if name in points:
        link, point = points[name]
        local = motion.shapes[link].position(point)
        results += [
            NamedResult(result, kind, tuple(motion.place(link, local, rate)))
            for rate, (result, kind) in zip(range(orders), POINT_RESULTS.items(), strict=False)
        ]
    elif name in motion.shapes:
        results += [
            NamedResult(result, result.replace("_", " "), (motion.angle_rates(name, rate),))
            for rate, result in zip(range(orders), LINK_RESULTS, strict=False)
        ]
    if name in motion.relative_motions:
        pair = motion.relative_motions[name]
        parts = [*motion.input_position(pair).parts, 0.0, 0.0][:3]
        for result, value in pair.results(*parts).items():
            if value is not None and (orders > 1 or pair.result_kinds[result] in POSITION_KINDS):
                results.append(NamedResult(result, pair.result_kinds[result], (value,)))
    return results


def result_array(value: Scalar, order: int, shape: Sequence[int]) -> Array:
    """The value (n,) or the derivatives of an order (n, parameters, ...) of a number."""
    part, array = slopes_of_order(value, order), np.empty(shape)
    array[:] = part if order else np.ravel(part)
    return array


def stack_results(values: Sequence[Scalar], order: int, shape: Sequence[int]) -> Array:
    """The same of several numbers (n, values, ...)."""
    return np.stack([result_array(value, order, shape) for value in values], axis=1)
