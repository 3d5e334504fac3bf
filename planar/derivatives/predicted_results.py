"""What a mechanism with other dimensions shows at given positions of its inputs, with the exact derivatives in both."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from planar.derivatives.kinematic_slopes import (
    CoordinateMotion,
    Directions,
    KinematicSlopes,
    NamedResult,
    constraint_elements,
    kinematic_results,
    stack_results,
    unknown_name,
)
from planar.derivatives.parameters import Parameters
from planar.document.dimensions import value_at
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import NoAnswer
from planar.foundation.jets import sqrt
from planar.model.mechanism import Mechanism
from planar.results.kinematic_result import KinematicResult
from planar.results.motion import Motion
from planar.solving.input_grid import motion_over_input
from planar.solving.position import solve


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
        names = [driven.pair for driven in mechanism.inputs]
        states = [solve(mechanism, dict(zip(names, map(float, position), strict=True))) for position in inputs]
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
