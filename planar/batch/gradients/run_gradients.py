"""What a gradient of a run gives, and the weights that it is asked with."""

from __future__ import annotations

import struct
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from planar.batch.design_arrays import read_designs, with_design_values
from planar.batch.general_path import OUTCOMES, GridMotion, point_rows, run_design
from planar.batch.gradients.native_gradient import padded_width, prepare_native_gradient
from planar.batch.prepare.native_run import NativeRuns
from planar.batch.prepare.run_calls import ALL_SOLVED, STATUS_OF_ENDING, UNSURE
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.design_equations import design_equations
from planar.derivatives.kinematic_slopes import CoordinateMotion, KinematicSlopes, constraint_elements, result_array
from planar.derivatives.parameters import Parameters
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import value_at
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, Outcome, join_names, suggest_name
from planar.foundation.jets import Scalar
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism

ORDERS = ("position", "velocity", "acceleration")
"""What a run tells of its points, in the order of its rows."""
DOUBLE = np.dtype(float)
RunWeights = Mapping[str, Mapping[str, Any]]


class RunGradient(NamedTuple):
    """The gradient of a weighed sum over a run: the sum itself, `value`; its `derivatives` in each number of the file
    by name (SI); `status` (steps + 1,): 0 is a position that brings its part, any other number k is
    `Sweep.outcomes[k]`: it brings nothing.
    """

    value: float
    derivatives: Mapping[str, float]
    status: IntArray

    def __repr__(self) -> str:
        return short_repr(self)


class WeightRows(NamedTuple):
    """Weights by the rows of a run: `rows` (weighed rows,), x and y of each weighed point one after the other, and
    `arrays` of two rows each (steps + 1, 2)."""

    rows: tuple[int, ...]
    arrays: tuple[Array, ...]


def read_weights(weights: RunWeights, index: Mapping[str, int], rates: bool, count: int) -> WeightRows:
    """The weights (count, 2) of points, `index` the row of each point's x among the positions. Raises BadInput."""
    if not (type(weights) is dict or isinstance(weights, Mapping)) or not weights:
        raise BadInput("weights", "name what is weighed, with an array each, as {'position': {'C': weights}}")
    orders = ORDERS if rates else ORDERS[:1]
    wide, shape = 2 * len(index), (count, 2)
    rows: list[int] = []
    arrays: list[Array] = []
    for order, points in weights.items():
        if order not in orders or not (type(points) is dict or isinstance(points, Mapping)):
            raise _refuse_order(order, orders, rates)
        first = wide * ORDERS.index(order)
        for point, given in points.items():
            if point not in index:
                hint = suggest_name(str(point), index, "its points")
                raise BadInput(f"weights[{order!r}]", f"the run was not prepared with the point {point!r:.60}{hint}")
            row = first + index[point]
            rows += (row, row + 1)
            is_read = type(given) is np.ndarray and given.dtype is DOUBLE and given.shape == shape
            arrays.append(given if is_read else _read_array(given, f"weights[{order!r}][{point!r}]", shape))
    if not rows:
        raise BadInput("weights", "name the points that are weighed, with an array each")
    return WeightRows(tuple(rows), tuple(arrays))


def _refuse_order(order: str, orders: Sequence[str], rates: bool) -> BadInput:
    if order in orders:
        return BadInput(f"weights[{order!r}]", "points by name are wanted here, with an array each")
    without = "" if rates or order not in ORDERS else "; prepare it with rates"
    return BadInput("weights", f"the run tells {join_names(orders)}, and no {str(order)!r:.60}{without}")


def _read_array(given: Any, place: str, shape: tuple[int, int]) -> Array:
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape:
        raise BadInput(place, f"an array of numbers of shape {shape} is wanted here, not {np.shape(given)}")
    return array


def check_finite(weights: WeightRows) -> None:
    """Refuse weights that are no numbers. Raises BadInput."""
    if not all(np.isfinite(each).all() for each in weights.arrays):
        raise BadInput("weights", "a number here is not finite")


def read_names(of: Sequence[str] | str | None, known: Iterable[str]) -> tuple[str, ...]:
    """The numbers by which derivatives are wanted; all where none are named. Raises BadInput."""
    known = tuple(known)
    if of is None:
        return known
    names = tuple(dict.fromkeys([of] if isinstance(of, str) else of))
    for name in names:
        if name not in known:
            hint = suggest_name(str(name), known, "numbers")
            raise BadInput("of", f"there is no derivative in a number {str(name)!r:.60}{hint}")
    return names


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


MAX_KEPT_SUMS = 8
"""Choices of weighed rows whose functions are kept."""
MAX_BLOCK_NUMBERS = 2**22
"""Weights that are laid out at once."""


class RunGradients:
    """Gradients over the positions (steps + 1,) of a run that starts and stops by itself (None) or where it is told.

    `names`: the numbers by which there are derivatives; `bound`: those that cannot change alone. Raises BadInput where
    derivatives are not told of a structure.
    """

    def __init__(
        self,
        reference: ReferenceDesign,
        points: tuple[str, ...],
        rates: bool,
        positions: Array,
        start: float | None,
        stop: float | None,
    ):
        if reference.is_sliding and stop is None:
            raise BadInput(
                "stop", "a slide runs between limits that change with the design; give start and stop for derivatives"
            )
        self._general = GeneralGradients(reference, points, rates)
        self.names, self.bound = self._general.names, self._general.bound
        self._positions, self._range = positions, (start, stop)
        self._width = 0
        self._native: dict[tuple[int, ...], NativeRuns | None] = {}
        self._bound = [k for k, name in enumerate(self.names) if name in self.bound]
        self._solved = np.zeros(len(positions), dtype=np.int8)
        self._solved.flags.writeable = False

    def gradient(self, weights: WeightRows, values: Mapping[str, float]) -> tuple[float, list[float], IntArray]:
        """The weighed sum of a design, its derivatives (names,), and the status of every position. Raises BadInput."""
        native = self._native_sums(weights.rows)
        if native is not None:
            told = self._run_native(native, weights, values)
            if told is not None:
                return told
        check_finite(weights)
        if values:
            read_designs(self._general.reference.mechanism, values)
        value, slopes, status = self._general.gradient(weights, values, *self._range)
        return value, slopes.tolist(), status

    def slopes_of_designs(self, rows: tuple[int, ...], names: tuple[str, ...], designs: Array, weights: Array) -> Array:
        """The derivatives (designs, `self.names`) of sums of these rows, of many designs (designs, names) with weights
        (designs, pairs of rows, steps + 1, 2) each. Raises BadInput."""
        found = np.zeros((len(designs), len(self.names)))
        many = max(MAX_BLOCK_NUMBERS // max(weights[:1].size, 1), 1)
        native = self._native_sums(rows)
        run = None if native is None or native.find_run is None else native.find_run(names)
        for first in range(0, len(designs), many):
            block = slice(first, first + many)
            given, weighed = designs[block], weights[block]
            sure = np.zeros(len(given), dtype=bool)
            if run is not None:
                padded = np.empty((*weighed.shape[:2], self._width, 2))
                padded[:, :, : weighed.shape[2]] = weighed
                sums, ending = run.run_designs(names, given, padded)
                sure = (ending != UNSURE) & np.isfinite(sums).all(axis=1)
                found[block][sure] = sums[sure, 1:]
            for k in np.flatnonzero(~sure):
                values = dict(zip(names, given[k].tolist(), strict=True))
                found[first + k] = self.gradient(WeightRows(rows, tuple(weighed[k])), values)[1]
        found[:, self._bound] = np.nan
        return found

    def _run_native(
        self, native: NativeRuns, weights: WeightRows, values: Mapping[str, float]
    ) -> tuple[float, list[float], IntArray] | None:
        """The same by compiled code; None where it is not sure."""
        # whole vectors of positions; what is behind the last one is not looked at
        rows, count = np.empty((len(weights.arrays), self._width, 2)), len(self._solved)
        for k, array in enumerate(weights.arrays):
            rows[k, :count] = array
        try:
            found, ending, end = native.run(values, rows)
        except KeyError:
            try:
                found, ending, end = native.run_other(values, rows)
            except (KeyError, struct.error, TypeError):
                return None
        except (struct.error, TypeError):
            return None
        if ending == UNSURE:
            return None
        status: IntArray = self._solved
        if ending != ALL_SOLVED:
            status = np.zeros(len(self._positions), dtype=np.int8)
            status[end:] = STATUS_OF_ENDING[ending]
            if not end:
                found = [0.0] * len(found)
        value, *slopes = found
        if not isfinite(sum(slopes, value)):
            return None
        for k in self._bound:
            slopes[k] = np.nan
        return value, slopes, status

    def _native_sums(self, rows: tuple[int, ...]) -> NativeRuns | None:
        """The compiled gradients of sums of these rows; None where there are none."""
        if rows not in self._native:
            if len(self._native) >= MAX_KEPT_SUMS:
                self._native.clear()
            self._native[rows] = self._prepare(rows)
        return self._native[rows]

    def _prepare(self, rows: tuple[int, ...]) -> NativeRuns | None:
        self._width = padded_width(len(self._positions))
        general, may_shift = self._general, self._range == (None, None)
        design = design_equations(general.reference.mechanism)
        return prepare_native_gradient(general.reference, design, general.points, rows, self._positions, may_shift)
