"""Derivatives of positions, velocities and accelerations of all links by implicit differentiation.

All constraints F(q, p) = 0 in the coordinates q of the links, those of the inputs among them, hold with their first and
second rates for every value of the parameters. Evaluated on jets along the parameters, in which the derivatives of one
order of rates are still zero, each of them leaves open what J dq has to close, with the one matrix J = dF/dq for
positions, velocities and accelerations (A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, ch. 13 and 15).
Second derivatives follow in the same way from jets of the second order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from planar.derivatives.directional_jets import (
    highest_slopes,
    parameter_jet,
    plain_value,
    stack_numbers,
    take_entries,
    variable_jet,
)
from planar.derivatives.parameters import INPUT_RATES, Parameters
from planar.dynamics.external_actions import LinkMotion
from planar.dynamics.link_coordinates import LinkCoordinates
from planar.equations.coordinates import consecutive_ranges
from planar.equations.element_groups import ElementGroup, group_elements
from planar.equations.element_placement import ElementPlacement
from planar.equations.elements import PlacedElement
from planar.equations.mechanism_numbers import equation_structure, shapes_of_links
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.generalised_inverses import invert_matrices
from planar.foundation.geometry import Frame, Vector, frame_at
from planar.foundation.jets import Jet, Scalar, constant_jet
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import Pair

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
        inputs = [motions[given.pair] for given in mechanism.inputs]
        self.number_ranges = consecutive_ranges(
            {pair.name: len(pair.number_kinds) for pair in (*mechanism.pairs, *inputs)}
        )
        placement = ElementPlacement(
            {link: range(first, first + 3) for link, first in self.link_columns.items()},
            {name: range(own.start, own.stop) for name, own in self.own_slices.items()},
            self.number_ranges,
        )
        self.pair_rows = consecutive_ranges({pair.name: len(pair.residual_kinds) for pair in mechanism.pairs})
        self.placed_pairs: dict[str, PlacedElement] = {
            pair.name: placement.residual_of(pair, self.pair_rows[pair.name].start) for pair in mechanism.pairs
        }
        self.constraint_count = sum(len(pair.residual_kinds) for pair in mechanism.pairs)
        placed_inputs = [placement.input_position_of(pair, self.constraint_count + k) for k, pair in enumerate(inputs)]
        self.row_count = self.constraint_count + len(inputs)
        self.groups = group_elements([*self.placed_pairs.values(), *placed_inputs])


@lru_cache(maxsize=32)
def _cached_elements(structure: Mechanism) -> ConstraintElements:
    return ConstraintElements(structure)


def constraint_elements(mechanism: Mechanism) -> ConstraintElements:
    """The elements of a mechanism's structure, kept for all of its numbers."""
    return _cached_elements(equation_structure(mechanism))


def element_arguments(group: ElementGroup, q: Scalar, p: Scalar, orders: int) -> list[Scalar]:
    """What the formulas of an element take, from coordinates that are jets of `orders` parts in time, or, of none,
    numbers alone, and numbers p without a time."""
    taken, arguments = group.element.arguments, []
    arguments += [take_entries(q, group.coordinates[:, k]) for k in taken.coordinates]
    angles = {body: take_entries(q, group.coordinates[:, 3 * body + 2]) for body in {*taken.cosines, *taken.sines}}
    arguments += [_cosine(angles[body]) for body in taken.cosines]
    arguments += [_sine(angles[body]) for body in taken.sines]
    numbers = [take_entries(p, group.numbers[:, k]) for k in taken.numbers]
    return [*arguments, *(constant_jet(number, orders) if orders else number for number in numbers)]


def _cosine(angle: Scalar) -> Scalar:
    return angle.cos() if isinstance(angle, Jet) else np.cos(angle)


def _sine(angle: Scalar) -> Scalar:
    return angle.sin() if isinstance(angle, Jet) else np.sin(angle)


class FileNumbers:
    """The numbers of a mechanism as jets of an order in all parameters: its `mechanism`, `shapes`, `measured` numbers
    of pairs by name, and `p`, those of all constraints one after the other; of order 0 as they are."""

    def __init__(self, parameters: Parameters, elements: ConstraintElements, count: int, order: int):
        """`count` is how many parameters there are, those of the file among them."""
        first = 3 * len(parameters.inputs)

        def number(index: int) -> Scalar:
            value = parameters.dimensions[index].value
            return value if order == 0 else parameter_jet(value, first + index, count, order)

        file_count = len(parameters.file_dimensions)
        self.mechanism = parameters.mechanism_with([number(k) for k in range(file_count)])
        self.shapes = shapes_of_links(self.mechanism)
        self.relative_motions = relative_motions(self.mechanism)
        pairs = {pair.name: pair for pair in self.mechanism.pairs} | dict(self.relative_motions)
        self.measured = {
            name: list(pair.measure([self.shapes[link] for link in pair.bodies])) for name, pair in pairs.items()
        }
        for k, name in enumerate(parameters.offsets):
            offset = Vector(number(file_count + 2 * k), number(file_count + 2 * k + 1))
            self.measured[name] = list(pairs[name].offset_pin(self.measured[name], offset))
        values = [value for name in elements.number_ranges for value in self.measured[name]]
        self.p = stack_numbers(values, count, order)


class CoordinateMotion(LinkMotion):
    """Positions of links from their coordinates q, jets in time of arrays (n, coordinates, ...)."""

    def __init__(self, elements: ConstraintElements, numbers: FileNumbers, size: float, q: Jet):
        self.elements, self.numbers, self._size, self.q = elements, numbers, size, q
        self.mechanism, self.shapes = numbers.mechanism, numbers.shapes
        self._frames: dict[str, Frame] = {}

    @property
    def size(self) -> float:
        return self._size

    def moving_frame(self, link: str) -> Frame:
        """A link's axes as jets in time."""
        if link not in self._frames:
            first = self.elements.link_columns[link]
            self._frames[link] = frame_at(*(take_entries(self.q, first + k) for k in range(3)))
        return self._frames[link]

    def frame_rates(self, link: str) -> Sequence[Sequence[Scalar]]:
        if link not in self.elements.link_columns:
            return GROUND_RATES
        parts = [part.parts for part in self.moving_frame(link)[:5]]
        return [[part[rate] for part in parts] for rate in range(len(parts[0]))]

    def own_coordinates(self, name: str) -> tuple[Jet, ...]:
        """The coordinates of a pair's own as jets in time."""
        own = self.elements.own_slices.get(name)
        return () if own is None else tuple(take_entries(self.q, k) for k in range(own.start, own.stop))

    def input_position(self, pair: Pair) -> Jet:
        """The position of a relative motion with its rates."""
        orders = len(self.q.parts)
        frames = [
            self.moving_frame(link) if link in self.elements.link_columns else self.frame(link) for link in pair.bodies
        ]
        numbers = [constant_jet(number, orders) for number in self.numbers.measured[pair.name]]
        position = pair.input_position(frames, numbers, self.own_coordinates(pair.name))
        return position if isinstance(position, Jet) else Jet(position, *([0.0] * (orders - 1)))


class PositionRates(NamedTuple):
    """Coordinates (n, coordinates) with their first and second rates."""

    q: Array
    q1: Array
    q2: Array


class KinematicSlopes:
    """The derivatives of all coordinates and their rates at positions (n), in all parameters.

    `parameter_count` may be greater than that of `parameters`: the coordinates do not depend on those that follow.
    """

    def __init__(self, parameters: Parameters, parameter_count: int, rates: PositionRates):
        self.parameters, self.count, self.rates = parameters, parameter_count, rates
        self.elements = constraint_elements(parameters.mechanism)
        self.first_numbers = FileNumbers(parameters, self.elements, parameter_count, 1)
        values = FileNumbers(parameters, self.elements, parameter_count, 0)
        self.jacobian = self._jacobian(values.p[..., 0])
        self.inverse, self.is_singular = invert_matrices(self.jacobian)
        "(n,): where constraints and inputs do not determine the coordinates, so that there are no derivatives"
        self.contradicts: BoolArray = np.zeros((len(rates.q), parameter_count), dtype=bool)
        "(n, parameters): whether constraints contradict a change of a parameter alone"
        self.first_slopes = self._solve(1, self.first_numbers)

    def _jacobian(self, p: Array) -> Array:
        """dF/dq (n, rows, coordinates)."""
        jacobian: Array = np.zeros((len(self.rates.q), self.elements.row_count, self.elements.coordinate_count))
        for group in self.elements.groups:
            _, slopes = group.evaluate(self.rates.q, p)
            for column, coordinates in enumerate(group.coordinates.T):  # a link may be two bodies of a pair
                jacobian[:, group.rows, coordinates[:, None]] += slopes[..., column]
        return jacobian

    def coordinates(self, slopes: Sequence[Array], second: Sequence[Array] | None = None) -> Jet:
        """The coordinates as jets in time, as far as their derivatives are given."""
        return Jet(
            *(
                variable_jet(value, slope, None if second is None else second[rate])
                for rate, (value, slope) in enumerate(zip(self.rates, slopes, strict=False))
            )
        )

    @cached_property
    def motion(self) -> CoordinateMotion:
        """The positions of links with their first derivatives."""
        return CoordinateMotion(
            self.elements, self.first_numbers, self.parameters.unit, self.coordinates(self.first_slopes)
        )

    @cached_property
    def second_numbers(self) -> FileNumbers:
        """The numbers of the file of the second order."""
        return FileNumbers(self.parameters, self.elements, self.count, 2)

    @cached_property
    def second_motion(self) -> CoordinateMotion:
        """The positions of links with their second derivatives."""
        q = self.coordinates(self.first_slopes, self._solve(2, self.second_numbers))
        return CoordinateMotion(self.elements, self.second_numbers, self.parameters.unit, q)

    def _solve(self, order: int, numbers: FileNumbers) -> list[Array]:
        """The derivatives of an order of the coordinates and their rates (n, coordinates, parameters, ...)."""
        shape = len(self.rates.q), self.elements.coordinate_count, *([self.count] * order)
        solved: list[Array] = []
        for rate in range(len(self.rates)):
            tried = [*solved, np.zeros(shape)]
            q = self.coordinates(tried) if order == 1 else self.coordinates(self.first_slopes[: rate + 1], tried)
            opening = self._opening(q, numbers.p, rate, order)
            columns = opening.reshape(*opening.shape[:2], -1)
            slopes = -self.inverse @ columns
            residual = columns + self.jacobian @ slopes
            slopes -= self.inverse @ residual  # refined once
            if order == 1:
                residual = np.abs(columns + self.jacobian @ slopes).max(axis=1, initial=0.0)
                terms = np.abs(columns) + np.abs(self.jacobian) @ np.abs(slopes)
                self.contradicts |= residual > CONTRADICTION * terms.max(axis=1, initial=0.0)
            solved.append(slopes.reshape(shape))
        return solved

    def _opening(self, q: Jet, p: Scalar, rate: int, order: int) -> Array:
        """By how much a rate of all constraints is opened (n, rows, parameters, ...), the derivatives of the
        coordinates in it still zero."""
        opening: Array = np.zeros((len(self.rates.q), self.elements.row_count, *([self.count] * order)))
        with np.errstate(all="ignore"):  # what is not defined is not a number
            for group in self.elements.groups:
                rests = group.element.rest.evaluate(element_arguments(group, q, p, rate + 1))
                for row, rest in enumerate(rests):
                    part = rest.parts[rate] if isinstance(rest, Jet) else 0.0
                    opening[:, group.rows[:, row]] = highest_slopes(part, order)
        if order == 1:  # what inputs prescribe
            for k in range(len(self.parameters.inputs)):
                row = self.elements.constraint_count + k
                opening[:, row, rate * len(self.parameters.inputs) + k] -= 1.0
        return opening

    @cached_property
    def tied(self) -> BoolArray:
        """Which parameters cannot change alone at each position (n, parameters): constraints contradict it, or a
        contact that other pairs have to keep closed opens."""
        opened: BoolArray = np.zeros_like(self.contradicts)
        unit = self.parameters.unit
        for pair in self.first_numbers.mechanism.pairs:
            if type(pair).contact_gap is not Pair.contact_gap:
                own = [coordinate.parts[0] for coordinate in self.motion.own_coordinates(pair.name)]
                gap = pair.contact_gap(self.first_numbers.measured[pair.name], own)
                opened |= np.abs(highest_slopes(gap, 1) / unit * self.parameter_scale) > OPENING
        tied: BoolArray = self.contradicts | opened
        tied[self.is_singular] = False
        return tied

    @cached_property
    def parameter_scale(self) -> Array:
        """What each parameter is in units of (parameters,): m for one of the size, else as it is."""
        motions = relative_motions(self.parameters.mechanism)
        kinds = [motions[name].input_quantity_kinds()[0] for name in self.parameters.inputs] * len(INPUT_RATES)
        kinds += [dimension.kind for dimension in self.parameters.dimensions]
        scale: Array = np.ones(self.count)
        scale[: len(kinds)] = [self.parameters.unit if kind == "length" else 1.0 for kind in kinds]
        return scale


class NamedResult(NamedTuple):
    """A result by the name that it has in a state, its kind of quantity, and its parts, numbers of any arithmetic."""

    name: str
    kind: str
    parts: tuple[Scalar, ...]


POINT_RESULTS = {"position": "length", "velocity": "velocity", "acceleration": "acceleration"}
LINK_RESULTS = ("angle", "angular_velocity", "angular_acceleration")


def kinematic_results(motion: CoordinateMotion, points: Mapping[str, tuple[str, str]], name: str) -> list[NamedResult]:
    """What a state tells of a name: of a point, else of a link, and of a pair; `points` are (link, point) by name."""
    results = []
    if name in points:
        link, point = points[name]
        local = motion.shapes[link].position(point)
        results += [
            NamedResult(result, kind, tuple(motion.place(link, local, rate)))
            for rate, (result, kind) in enumerate(POINT_RESULTS.items())
        ]
    elif name in motion.shapes:
        results += [
            NamedResult(result, result.replace("_", " "), (motion.angle_rates(name, rate),))
            for rate, result in enumerate(LINK_RESULTS)
        ]
    if name in motion.relative_motions:
        pair = motion.relative_motions[name]
        for result, value in pair.results(*motion.input_position(pair).parts).items():
            if value is not None:
                results.append(NamedResult(result, pair.result_kinds[result], (value,)))
    return results


def result_array(value: Scalar, order: int, shape: Sequence[int]) -> Array:
    """The value (n,) or the derivatives of an order (n, parameters, ...) of a number."""
    part = highest_slopes(value, order) if order else plain_value(value)
    array: Array = np.empty(shape)
    array[:] = part if order else np.reshape(part, (-1,)) if np.ndim(part) else part
    return array
