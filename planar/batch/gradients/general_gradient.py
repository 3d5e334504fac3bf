"""Gradients of runs by the general path: any structure, position after position by numpy and casadi."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import casadi as ca
import numpy as np

from planar.batch.design_arrays import with_design_values
from planar.batch.general_path import OUTCOMES, GridMotion, point_rows, run_design
from planar.batch.gradients.run_gradient import WeightRows
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.implicit_system import ImplicitSystem
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import value_at
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, Outcome
from planar.model.mechanism import Mechanism

MAX_KEPT_RESULTS = 16
"""Choices of weighed rows whose functions are kept."""


class GeneralGradients:
    """Gradients of the runs of one linkage over points and rates.

    `names`: the numbers by which there are derivatives, as `planar.gradient` has them; `bound`: those that cannot
    change alone. Raises BadInput where derivatives are not told of a structure.
    """

    def __init__(self, reference: ReferenceDesign, points: tuple[str, ...], rates: bool):
        self.reference, self.points, self.rates = reference, points, rates
        self.design: DesignEquations = design_equations(reference.mechanism)
        if not reference.functions.is_square:
            raise BadInput(
                "pairs",
                "constraints hold each other more than once here, so that no length can change alone; "
                "give derivatives a mechanism without the surplus pairs",
            )
        self.names = self.design.names
        self._weighed: dict[tuple[int, ...], BufferedFunction] = {}

    @cached_property
    def bound(self) -> frozenset[str]:
        """The numbers that cannot change alone."""
        return frozenset(tied_dimensions(self.reference.mechanism))

    @cached_property
    def still(self) -> Array:
        """Of `names` the rates of inputs that stand still in a run (names,), whatever their numbers say."""
        pair = self.reference.pair
        given = {each.pair for each in self.reference.mechanism.inputs} - {pair}
        rates = {f"{name}.{rate}" for name in given for rate in ("velocity", "acceleration")}
        return np.array([name in rates for name in self.names])

    @cached_property
    def expressions(self) -> list[ca.SX]:
        """What a run tells, row by row: x and y of every point, then their rates."""
        frames, _ = self.design.placed
        members = [self.reference.point_member(name) for name in self.points]
        shapes = self.design.work.shapes
        at = [frames[link].to_world(shapes[link].position(point)) for link, point in members]
        position = stack_expressions(part for place in at for part in place)
        orders = [position, *self.design.rates(position)] if self.rates else [position]
        return [row for order in orders for row in ca.vertsplit(order)]

    @cached_property
    def system(self) -> ImplicitSystem:
        """The levels that the run's rows follow from."""
        whole = self.design.kinematics
        return whole if self.rates else ImplicitSystem(whole.levels[:1], self.design.t)

    def run(
        self, values: Mapping[str, float], start: float | None, stop: float | None, steps: int
    ) -> tuple[Mechanism, GridMotion]:
        """The motion of a design over a range, as `planar.prepared` has it."""
        mechanism = with_design_values(self.reference.mechanism, values)
        begin = float(mechanism.inputs[self.reference.running_index].position) if start is None else float(start)
        grid = begin + (2.0 * np.pi if stop is None else stop - begin) * np.linspace(0.0, 1.0, steps + 1)
        return mechanism, run_design(mechanism, self.reference.pair, grid)

    def gradient(
        self,
        weights: WeightRows,
        values: Mapping[str, float],
        start: float | None,
        stop: float | None,
    ) -> tuple[float, Array, IntArray]:
        """The weighed sum, its derivatives (names,), and the status of every position (steps + 1,)."""
        mechanism, found = self.run(values, start, stop, len(weights.arrays[0]) - 1)
        status: IntArray = np.array(found.status)
        if found.motion is None or not found.many:
            return 0.0, np.where([name in self.bound for name in self.names], np.nan, 0.0), status
        motion, solved = found.motion, slice(found.many)
        unknowns, t = self.design.coordinates_at(motion)
        t[:, t.shape[1] - len(self.design.dimensions) :] = [
            value_at(mechanism, each.address) for each in self.design.dimensions
        ]
        w = np.hstack(weights.arrays)[solved]
        given = [each[solved] for each in unknowns[: len(self.system.levels)]]
        slopes, is_singular = self.system.gradient(self._weighed_rows(weights.rows), w, given, t[solved])
        told = point_rows(motion, self.points, self.rates)[solved][:, list(weights.rows)]
        brings = ~is_singular & np.isfinite(slopes).all(axis=1) & np.isfinite(told).all(axis=1)
        status[solved][~brings] = OUTCOMES.index(Outcome.DEAD_POINT)
        whole = slopes[brings].sum(axis=0)
        whole[self.still] = 0.0
        whole[[name in self.bound for name in self.names]] = np.nan
        return float((told * w)[brings].sum()), whole, status

    def _weighed_rows(self, rows: tuple[int, ...]) -> BufferedFunction:
        found = self._weighed.get(rows)
        if found is None:
            if len(self._weighed) >= MAX_KEPT_RESULTS:
                self._weighed.clear()
            results = ca.vertcat(*(self.expressions[row] for row in rows))
            found = self._weighed[rows] = self.system.weighed_results(results)
        return found
