"""Gradients of runs by the general path: any structure, all positions of a run together."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from planar.batch.design_arrays import with_design_values
from planar.batch.general_path import OUTCOMES, GridMotion, point_rows, run_design
from planar.batch.gradients.run_gradient import WeightRows
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.kinematic_slopes import CoordinateMotion, KinematicSlopes, constraint_elements, result_array
from planar.derivatives.parameters import Parameters
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import value_at
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.jets import Scalar
from planar.model.mechanism import Mechanism


class GeneralGradients:
    """Gradients of the runs of one linkage over points and rates.

    `names`: the numbers by which there are derivatives, as `planar.gradient` has them; `bound`: those that cannot
    change alone. Raises BadInput where derivatives are not told of a structure.
    """

    def __init__(self, reference: ReferenceDesign, points: tuple[str, ...], rates: bool):
        self.reference, self.points, self.rates = reference, points, rates
        self.parameters = Parameters(reference.mechanism)
        if not reference.functions.is_square:
            raise BadInput(
                "pairs",
                "constraints hold each other more than once here, so that no length can change alone; "
                "give derivatives a mechanism without the surplus pairs",
            )
        self.names = self.parameters.names

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
        coordinates = constraint_elements(mechanism).coordinates(motion)[: 3 if self.rates else 1]
        numbers = [value_at(mechanism, dimension.address) for dimension in self.parameters.dimensions]
        kinematics = KinematicSlopes(self.parameters, [rates[solved] for rates in coordinates], values=numbers)
        w = np.hstack(weights.arrays)[solved]
        rows = self._rows(kinematics.motion)
        shape = len(w), len(self.names)
        slopes = np.zeros(shape)
        for row, weight in zip(weights.rows, w.T, strict=True):
            slopes += weight[:, None] * result_array(rows[row], 1, shape)
        told = point_rows(motion, self.points, self.rates)[solved][:, list(weights.rows)]
        brings = ~kinematics.is_singular & np.isfinite(slopes).all(axis=1) & np.isfinite(told).all(axis=1)
        status[solved][~brings] = OUTCOMES.index(Outcome.DEAD_POINT)
        whole = slopes[brings].sum(axis=0)
        whole[self.still] = 0.0
        whole[[name in self.bound for name in self.names]] = np.nan
        return float((told * w)[brings].sum()), whole, status

    def _rows(self, motion: CoordinateMotion) -> list[Scalar]:
        """What a run tells, row by row: x and y of every point, then their rates."""
        members = [self.reference.point_member(name) for name in self.points]
        return [
            part
            for rate in range(len(motion.q.parts))
            for link, point in members
            for part in motion.place(link, motion.shapes[link].position(point), rate)
        ]
