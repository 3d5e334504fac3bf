"""The derivatives of results of a state, a motion or forces, at every position, in every parameter; and what a
mechanism with other dimensions shows at given positions of its inputs, with the derivatives in both."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.derivatives.force_slopes import ForceSlopes, factor_slopes, slopes_by_factors
from planar.derivatives.kinematic_slopes import (
    POSITION_KINDS,
    CoordinateMotion,
    Directions,
    KinematicSlopes,
    NamedResult,
    Parameters,
    constraint_elements,
    design_dimensions,
    kinematic_results,
    stack_results,
)
from planar.document.dimensions import Dimension, value_at
from planar.document.revised.changed_numbers import with_values
from planar.dynamics.forces import Forces
from planar.dynamics.load_variation import load_factors
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, NoAnswer, Unknown, suggest_name
from planar.foundation.jets import sqrt
from planar.foundation.time_limit import all_within_time
from planar.model.mechanism import Mechanism
from planar.results.kinematic_result import KinematicResult
from planar.results.motion import Motion, State
from planar.solving.input_grid import motion_over_input
from planar.solving.position import solve, solved_mechanism

MAX_CHUNK_NUMBERS = 2_000_000
"""Derivatives of coordinates that are held at once."""
NUDGE = 1e-3
"""Of a number, or of the size: a change of its own that a file may be refused for."""
GOLDEN_FRACTION = (5.0**0.5 - 1.0) / 2.0
"""Its multiples leave fractions that are all different: no two numbers are changed by the same part."""


class DerivedResults(NamedTuple):
    """Values (n, parts; angles go on over a turn) and derivatives (n, parts, parameters) of results by name, and the
    kind of quantity of each; where there are none (n,), and of these where friction is not determined (n,); which
    parameters cannot change alone."""

    values: Mapping[str, Array]
    slopes: Mapping[str, Array]
    kinds: Mapping[str, str]
    is_singular: BoolArray
    is_unknown: BoolArray
    tied: tuple[str, ...]


class PositionSlopes:
    """The derivatives at some of the positions."""

    def __init__(self, system: SlopeSystem, rows: slice):
        self.system, self.rows = system, rows
        rates = [rate[rows] for rate in system.rates]
        self.count = len(rates[0])
        self.kinematics = KinematicSlopes(system.parameters, rates, system.directions)
        self.is_singular = self.kinematics.is_singular
        self.is_unknown: BoolArray = np.zeros(self.count, dtype=bool)
        self.forces: ForceSlopes | None = None
        if system.is_balanced:
            turns = np.repeat(system.spring_turns[None], self.count, axis=0)
            self.forces = ForceSlopes(self.kinematics, system.forces, rows, system.factors[rows], turns)
            self.is_unknown = self.forces.is_unknown
            self.is_singular = self.is_singular | self.is_unknown

    def results(self, name: str, order: int) -> list[NamedResult]:
        """The results of a name, as jets of an order. Raises Unknown."""
        system, kinematics = self.system, self.kinematics
        motion = kinematics.motion if order == 1 else kinematics.second_motion
        results = kinematic_results(motion, system.moving._point_members, name)
        if self.forces is not None:
            results += self.forces.balance(order).results(name)
        if not results:
            raise unknown_name(system.moving, name)
        return results


class SlopeSystem:
    """The system of equations that a result follows from, with its values at the result's positions; `offsets` as of
    `Parameters`."""

    def __init__(
        self,
        result: State | Motion | Forces,
        offsets: tuple[str, ...] = (),
        is_balanced: bool = False,
        has_rates: bool = True,
        numbers: Sequence[str] | None = None,
    ):
        """`is_balanced`: forces without friction and inertia are derived, of a state or a motion too; `has_rates` is
        false where results of positions alone are asked for, `numbers` are the parameters, by default all. Raises
        BadInput of forces that equilibrium does not determine."""
        self.moving: State | Motion = result.moving if isinstance(result, Forces) else result
        self.forces = result if isinstance(result, Forces) else None
        self.is_balanced = is_balanced or self.forces is not None
        mechanism = self.moving.mechanism
        self.parameters = Parameters(mechanism, offsets)
        self.names = self.parameters.names if numbers is None else tuple(numbers)
        if self.forces is not None and mechanism.pair_stiffness:
            raise BadInput(
                mechanism.pair_stiffness[0][0],
                "derivatives are told of forces that equilibrium determines, and not of those shared by stiffness",
            )
        columns = [self.parameters.names.index(name) for name in self.names]
        self.directions = Directions(self.parameters, columns, len(mechanism.loads) if self.is_balanced else 0)
        elements = constraint_elements(mechanism)
        self.rates = elements.coordinates(self.moving)[: None if has_rates else 1]
        self.count = len(self.rates[0])
        self.spring_turns = elements.initial_spring_turns(self.rates[0][0], mechanism.springs)

    @cached_property
    def factors(self) -> Array:
        """The factors of the loads (n, loads)."""
        inputs = {name: np.broadcast_to(driven.position, (self.count,)) for name, driven in self.moving.inputs.items()}
        return load_factors(self.moving.mechanism, inputs, getattr(self.moving, "time", None), self.count)

    def parts(self, order: int = 1) -> Iterator[PositionSlopes]:
        """The derivatives of an order, part after part of the positions."""
        size = len(self.rates[0][0]) * self.directions.count**order
        step = max(1, MAX_CHUNK_NUMBERS // max(size, 1))
        for first in all_within_time(range(0, self.count, step), "parts of the positions"):
            yield self._single if step >= self.count else PositionSlopes(self, slice(first, first + step))

    @cached_property
    def _single(self) -> PositionSlopes:
        """Those of all positions at once."""
        return PositionSlopes(self, slice(None))

    def derive(self, results_of: Callable[[PositionSlopes], Sequence[NamedResult]]) -> DerivedResults:
        """The values and derivatives of results."""
        values: dict[str, list[Array]] = {}
        slopes: dict[str, list[Array]] = {}
        kinds: dict[str, str] = {}
        singular_rows, unknown_rows, tied = [], [], set[str]()
        for part in self.parts():
            singular_rows.append(part.is_singular)
            unknown_rows.append(part.is_unknown)
            is_tied: BoolArray = np.asarray(part.kinematics.tied.any(axis=0))
            tied.update(name for name, binds in zip(self.names, is_tied, strict=False) if binds)
            shape = part.count, self.directions.count
            # where a point and a pair have one name, and a result too, it is the pair's
            for result in {result.name: result for result in results_of(part)}.values():
                kinds[result.name] = result.kind
                values.setdefault(result.name, []).append(stack_results(result.parts, 0, shape[:1]))
                slopes.setdefault(result.name, []).append(stack_results(result.parts, 1, shape))
        # results side by side, so that rounding at a kink of a load's course is judged beside all of them
        ends = np.cumsum([arrays[0].shape[1] for arrays in slopes.values()])[:-1]
        joined = np.concatenate([np.concatenate(arrays) for arrays in slopes.values()], axis=1)
        if self.is_balanced:  # with what the factors of loads change by the parameters
            parameters, factors = np.split(joined, [len(self.names)], axis=2)
            joined = parameters + slopes_by_factors(factors, factor_slopes(self.moving, self.names))
        is_singular = np.concatenate(singular_rows)
        joined[is_singular] = np.nan
        return DerivedResults(
            {
                name: np.unwrap(np.concatenate(arrays), axis=0) if kinds[name] == "angle" else np.concatenate(arrays)
                for name, arrays in values.items()
            },
            dict(zip(slopes, np.split(joined, ends, axis=1), strict=True)),
            kinds,
            is_singular,
            np.concatenate(unknown_rows),
            tuple(name for name in self.names if name in tied),
        )

    def named_slopes(self, name: str) -> DerivedResults:
        """The values and derivatives of all results of a name; none in numbers that cannot change alone."""
        derived = self.derive(lambda part: part.results(name, 1))
        bound = {*tied_dimensions(self.moving.mechanism), *derived.tied}
        is_free = np.array([parameter not in bound for parameter in self.names])
        slopes = {result: np.where(is_free, array, np.nan) for result, array in derived.slopes.items()}
        return derived._replace(slopes=slopes, tied=tuple(number for number in self.names if number in bound))


def unknown_name(moving: KinematicResult, name: str) -> Unknown:
    """That nothing bears a name."""
    known = dict.fromkeys((*moving.point_names, *moving.frames, *moving._relative_motions))
    return Unknown(f"there is no point, link or pair {name!r}{suggest_name(name, known, 'names')}")


def second_derivatives(
    source: State | Motion | Forces,
    of: str,
    result: str,
    kind: str,
    offsets: tuple[str, ...] = (),
    numbers: Sequence[str] | None = None,
) -> Array:
    """The second derivatives of a result (n, parts, parameters, parameters), of this kind of quantity; see
    `SlopeSystem`."""
    has_rates = isinstance(source, Forces) or kind not in POSITION_KINDS
    system = SlopeSystem(source, offsets, has_rates=has_rates, numbers=numbers)
    count, rows = len(system.names), []
    for part in system.parts(2):
        (values,) = (named.parts for named in part.results(of, 2) if named.name == result)
        shape = part.count, system.directions.count, system.directions.count
        rows.append(stack_results(values, 2, shape)[:, :, :count, :count])
    return np.concatenate(rows)


def tied_dimensions(mechanism: Mechanism, among: Container[str] | None = None) -> tuple[str, ...]:
    """The numbers of a file, or those with these names, that cannot change alone, either way: others have to go with
    them.

    So the radii of wheels and the distance of their centres, or the rises of a cam's law.
    """
    known: dict[str, bool] = mechanism.__dict__.setdefault("_tied_dimensions", {})  # kept: numbers are tried
    chosen = [
        dimension
        for dimension in design_dimensions(mechanism)
        if dimension.path[0] in ("links", "pairs") and (among is None or dimension.name in among)
    ]
    untried = [dimension for dimension in chosen if dimension.name not in known]
    bound = {*_find_tied(mechanism, untried)}
    known.update({dimension.name: dimension.name in bound for dimension in untried})
    return tuple(dimension.name for dimension in chosen if known[dimension.name])


def _find_tied(mechanism: Mechanism, dimensions: Sequence[Dimension]) -> list[str]:
    """Those of some numbers that cannot change alone, found by halving.

    A file is checked once for all numbers that are free: changed together, each by a part of its own, tied numbers do
    not go with one another but by chance.
    """
    if not dimensions or any(_is_accepted(mechanism, dimensions, sign) for sign in (1.0, -1.0)):
        return []
    if len(dimensions) == 1:
        return [dimensions[0].name]
    middle = len(dimensions) // 2
    return [*_find_tied(mechanism, dimensions[:middle]), *_find_tied(mechanism, dimensions[middle:])]


def _is_accepted(mechanism: Mechanism, dimensions: Sequence[Dimension], sign: float) -> bool:
    """Whether a file is accepted in which these numbers are somewhat greater, or less for a sign of -1."""
    values, unit = {}, solved_mechanism(mechanism).solver.unit
    for index, dimension in enumerate(dimensions):
        size = abs(dimension.value) or (unit if dimension.kind == "length" else 1.0)
        values[dimension.name] = dimension.value + sign * NUDGE * (1.0 + index * GOLDEN_FRACTION % 1.0) * size
    try:
        with_values(mechanism, values)
    except BadInput:
        return False
    return True


class PredictedValues(NamedTuple):
    """Results (n, parts), their derivatives in inputs (n, parts, inputs) and numbers (n, parts, numbers), SI, and where
    there are none of these (n,)."""

    values: Array
    by_inputs: Array
    by_numbers: Array
    is_singular: BoolArray


def position_results(moving: KinematicResult, name: str) -> dict[str, NamedResult]:
    """The results of the position of a point, link or pair, or of "B to E" (two points), by the results' names.

    Raises Unknown.
    """
    parameters = Parameters(moving.mechanism)
    coordinates = constraint_elements(moving.mechanism).coordinates(moving)[0]
    return _results_at(KinematicSlopes(parameters, [coordinates], Directions(parameters, ())).motion, moving, name)


def _results_at(motion: CoordinateMotion, moving: KinematicResult, name: str) -> dict[str, NamedResult]:
    points = moving._point_members
    results = kinematic_results(motion, points, name)
    if results:
        return {result.name: result for result in results}
    first, _, second = name.partition(" to ")
    for end in (first, second) if second else (first,):
        if end not in points:
            raise unknown_name(moving, end)
    places = (kinematic_results(motion, points, end)[0].parts for end in (first, second))
    x, y = (one - other for one, other in zip(*places, strict=True))
    return {"distance": NamedResult("distance", "length", (sqrt(x * x + y * y),))}


class PredictedResults:
    """Results, (name, result) each, of mechanisms that differ from one in some numbers."""

    def __init__(self, mechanism: Mechanism, results: Sequence[tuple[str, str]], numbers: Sequence[str]):
        self.parameters = Parameters(mechanism)
        self.results = tuple(results)
        self.input_count = len(mechanism.inputs)
        columns = [*range(self.input_count), *map(self.parameters.names.index, numbers)]
        self.directions = Directions(self.parameters, columns)

    def at_inputs(self, mechanism: Mechanism, inputs: Array) -> PredictedValues:
        """The results of a mechanism at positions of its inputs (n, inputs), rad or m. Raises NoAnswer."""
        if self.input_count == 1:
            with suppress(NoAnswer):  # of a single position the reason is told
                return self.along(motion_over_input(mechanism, inputs[:, 0]))
        states = [
            solve(mechanism, dict(zip(self.parameters.inputs, map(float, position), strict=True)))
            for position in inputs
        ]
        elements = constraint_elements(mechanism)
        coordinates = np.concatenate([elements.coordinates(state)[0] for state in states])
        return self._predict(coordinates, states[0])

    def along(self, motion: Motion) -> PredictedValues:
        """The results at every position of a motion."""
        return self._predict(constraint_elements(motion.mechanism).coordinates(motion)[0], motion)

    def _predict(self, coordinates: Array, moving: KinematicResult) -> PredictedValues:
        numbers = [value_at(moving.mechanism, dimension.address) for dimension in self.parameters.dimensions]
        kinematics = KinematicSlopes(self.parameters, [coordinates], self.directions, numbers)
        parts = [
            part for name, result in self.results for part in _results_at(kinematics.motion, moving, name)[result].parts
        ]
        shape = len(coordinates), self.directions.count
        values, slopes = stack_results(parts, 0, shape[:1]), stack_results(parts, 1, shape)
        count = self.input_count
        return PredictedValues(values, slopes[..., :count], slopes[..., count:], kinematics.is_singular)
