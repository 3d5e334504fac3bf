"""What a mechanism with other dimensions shows at given positions of its inputs, with the exact derivatives in both."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import design_equations
from planar.derivatives.implicit_system import ImplicitSystem, Level
from planar.derivatives.result_expressions import ResultExpression, kinematic_expressions, refuse_name
from planar.document.dimensions import file_dimensions
from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import NoAnswer
from planar.model.mechanism import Mechanism
from planar.results.kinematic_result import KinematicResult
from planar.results.motion import Motion
from planar.solving.grids.grid_motion import motion_over_input
from planar.solving.position import solve


class PredictedValues(NamedTuple):
    """Results (n, parts), their derivatives in inputs (n, parts, inputs) and numbers (n, parts, numbers), SI, and where
    there are none of these (n,)."""

    values: Array
    by_inputs: Array
    by_numbers: Array
    is_singular: BoolArray


def position_results(moving: KinematicResult, name: str) -> dict[str, ResultExpression]:
    """What is told of the position of a point, link or pair, or of "B to E" (two points), by the results' names.

    Raises Unknown.
    """
    design = design_equations(moving.mechanism)
    first, _, second = name.partition(" to ")
    found = list(kinematic_expressions(design, moving, name))
    if not found and second:
        ends = [position_results(moving, end).get("position") for end in (first, second)]
        if ends[0] is None or ends[1] is None:
            raise refuse_name(design, moving, first if ends[0] is None else second)
        return {"distance": ResultExpression("distance", "length", ca.norm_2(ends[1].value - ends[0].value))}
    if not found:
        raise refuse_name(design, moving, name)
    return {each.name: each for each in found if each.kind in ("length", "angle")}


class PredictedResults:
    """Results of mechanisms that differ from one in some numbers, by one set of equations."""

    def __init__(self, mechanism: Mechanism, wanted: Sequence[tuple[str, str]], numbers: Sequence[str]):
        self.design = design_equations(mechanism)
        state = solve(mechanism)
        self.results = [position_results(state, name)[result] for name, result in wanted]
        self.system = ImplicitSystem([Level(self.design.z, self.design.F)], self.design.t)
        self._value = ca.vertcat(*(each.value for each in self.results))
        self._jacobians = self.system.result_jacobians(self._value)
        names = self.design.names
        self._columns = [names.index(name) for name in numbers]
        self._inputs = len(mechanism.inputs)

    @cached_property
    def _values(self) -> BufferedFunction:
        return BufferedFunction(ca.Function("values", [self.design.z, self.design.t], [ca.densify(self._value)]))

    def at_inputs(self, mechanism: Mechanism, inputs: Array) -> PredictedValues:
        """The results of a mechanism at positions of its inputs (n, inputs), rad or m. Raises NoAnswer."""
        if self._inputs == 1:
            with suppress(NoAnswer):  # of a single position the reason is told
                return self.along(motion_over_input(mechanism, inputs[:, 0]))
        names = [each.pair for each in mechanism.inputs]
        each_given = (dict(zip(names, map(float, u), strict=True)) for u in inputs)
        found = [self.design.coordinates_at(solve(mechanism, each)) for each in each_given]
        return self._predict(np.concatenate([z[0] for z, _ in found]), np.concatenate([t for _, t in found]), mechanism)

    def along(self, motion: Motion) -> PredictedValues:
        """The results at every position of a motion."""
        z, t = self.design.coordinates_at(motion)
        return self._predict(z[0], t, motion.mechanism)

    def _predict(self, z: Array, t: Array, mechanism: Mechanism) -> PredictedValues:
        known = file_dimensions(mechanism)
        own = [known[each.name].value for each in self.design.dimensions]
        t[:, t.shape[1] - len(own) :] = own
        values = self._values.evaluate_batch(len(z), z, t)[0]
        found = self.system.slopes(self._jacobians, [z], t)
        parts = values.reshape(len(z), -1)
        slopes = found.slopes
        return PredictedValues(parts, slopes[:, :, : self._inputs], slopes[:, :, self._columns], found.is_singular)
