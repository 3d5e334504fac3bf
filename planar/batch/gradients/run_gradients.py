"""What a gradient of a run gives, and the weights that it is asked with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple

import numpy as np

from planar.batch.design_arrays import read_designs, split_into_blocks, with_design_values
from planar.batch.general_path import OUTCOMES, DesignRun
from planar.batch.gradients.compiled_gradient import GradientWriter, run_designs
from planar.batch.prepare.compiled_runs import (
    ALL_SOLVED,
    STATUS_OF_ENDING,
    UNSURE,
    CompiledRuns,
    address_of,
    padded_width,
    prepare_runs,
)
from planar.batch.reference_design import ReferenceDesign
from planar.derivatives.kinematic_slopes import POINT_RESULTS, CoordinateMotion, NamedResult, Parameters
from planar.derivatives.result_slopes import SlopeSystem, tied_dimensions
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, Outcome, join_names, suggest_name
from planar.foundation.short_repr import short_repr

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


MAX_KEPT_SUMS = 8
"""Choices of weighted rows whose functions are kept."""
MAX_BLOCK_NUMBERS = 2**22
"""Weights that are laid out at once."""


class RunGradients:
    """Gradients of sums over the positions (steps + 1,) of a run of one linkage.

    The run starts and stops by itself (None) or at the ends of its `span`. `names`: the numbers by which there are
    derivatives, as `planar.gradient` has them; `bound`: those that cannot change alone. Raises BadInput for a structure
    without derivatives.
    """

    def __init__(
        self,
        reference: ReferenceDesign,
        points: tuple[str, ...],
        rates: bool,
        positions: Array,
        span: tuple[float | None, float | None],
    ):
        if reference.is_sliding and span[1] is None:
            raise BadInput(
                "stop", "a slide runs between limits that change with the design; give start and stop for derivatives"
            )
        self.reference, self.points, self.rates = reference, points, rates
        self.names = Parameters(reference.mechanism).names
        if not reference.functions.is_square:
            raise BadInput(
                "pairs",
                "constraints hold each other more than once here, so that no length can change alone; "
                "give derivatives a mechanism without the surplus pairs",
            )
        self.bound = frozenset(tied_dimensions(reference.mechanism))
        self._positions, self._span = positions, span
        self._width = padded_width(len(positions))
        self.compiled: dict[tuple[int, ...], CompiledRuns | None] = {}
        "by the rows that are weighted; None where there is no machine code"
        self._bound = [k for k, name in enumerate(self.names) if name in self.bound]
        # inputs that stand still in a run have no rates, despite their numbers
        standing = {each.pair for each in reference.mechanism.inputs} - {reference.pair}
        rates_of_standing = {f"{name}.{rate}" for name in standing for rate in ("velocity", "acceleration")}
        self._unused = [k for k, name in enumerate(self.names) if name in rates_of_standing]
        self._solved = np.zeros(len(positions), dtype=np.int8)
        self._solved.flags.writeable = False

    def gradient(self, weights: WeightRows, values: Mapping[str, float]) -> tuple[float, list[float], IntArray]:
        """The weighted sum of a design, its derivatives (names,), and the status of every position. Raises BadInput."""
        compiled = self._compiled_sums(weights.rows)
        result = None if compiled is None else self._run_compiled(compiled, weights, values)
        if result is not None:
            return result
        if not all(np.isfinite(array).all() for array in weights.arrays):
            raise BadInput("weights", "a number here is not finite")
        if values:
            read_designs(self.reference.mechanism, values)
        return self._solve_gradient(weights, values)

    def slopes_of_designs(self, rows: tuple[int, ...], names: tuple[str, ...], designs: Array, weights: Array) -> Array:
        """The derivatives (designs, `self.names`) of sums of these rows, of many designs (designs, names) with weights
        (designs, pairs of rows, steps + 1, 2) each. Raises BadInput."""
        slopes = np.zeros((len(designs), len(self.names)))
        compiled = self._compiled_sums(rows)
        bound = None if compiled is None or compiled.can_misfit else compiled.bind(names)
        for block in split_into_blocks(len(designs), max(MAX_BLOCK_NUMBERS // max(weights[:1].size, 1), 1)):
            block_designs, block_weights = designs[block], weights[block]
            is_sure = np.zeros(len(block_designs), dtype=bool)
            if bound is not None:
                padded = np.empty((*block_weights.shape[:2], self._width, 2))
                padded[:, :, : block_weights.shape[2]] = block_weights
                sums, ending = run_designs(bound, block_designs, padded, 1 + len(self.names))
                is_sure = (ending != UNSURE) & np.isfinite(sums).all(axis=1)
                slopes[block][is_sure] = sums[is_sure, 1:]
            for k in np.flatnonzero(~is_sure):
                values = dict(zip(names, block_designs[k].tolist(), strict=True))
                slopes[block.start + k] = self.gradient(WeightRows(rows, tuple(block_weights[k])), values)[1]
        slopes[:, self._bound] = np.nan
        return slopes

    def _run_compiled(
        self, compiled: CompiledRuns, weights: WeightRows, values: Mapping[str, float]
    ) -> tuple[float, list[float], IntArray] | None:
        """The same by compiled code; None where it is not sure."""
        # whole vectors of positions; what is behind the last one is not read
        rows, count = np.empty((len(weights.arrays), self._width, 2)), len(self._solved)
        for k, array in enumerate(weights.arrays):
            rows[k, :count] = array
        result = compiled(values, address_of(rows))
        if result is None:
            return None
        numbers, ending, end = result
        sums = numbers.ravel()[: 1 + len(self.names)].tolist()
        status: IntArray = self._solved
        if ending != ALL_SOLVED:
            status = np.zeros(len(self._positions), dtype=np.int8)
            status[end:] = STATUS_OF_ENDING[ending]
            if not end:
                sums = [0.0] * len(sums)
        value, *slopes = sums
        if not isfinite(sum(slopes, value)):
            return None
        for k in self._bound:
            slopes[k] = np.nan
        return value, slopes, status

    def _compiled_sums(self, rows: tuple[int, ...]) -> CompiledRuns | None:
        """The compiled gradients of sums of these rows; None where there are none."""
        if rows not in self.compiled:
            if len(self.compiled) >= MAX_KEPT_SUMS:
                self.compiled.clear()
            writer, may_shift = GradientWriter(self.reference, self.points, rows), self._span == (None, None)
            self.compiled[rows] = prepare_runs(self.reference, self._positions, may_shift, writer.compile)
        return self.compiled[rows]

    def _solve_gradient(self, weights: WeightRows, values: Mapping[str, float]) -> tuple[float, list[float], IntArray]:
        """The same by the motion of the design."""
        mechanism = with_design_values(self.reference.mechanism, values)
        start, stop = self._span
        begin = float(mechanism.inputs[self.reference.running_index].position) if start is None else float(start)
        length = 2.0 * np.pi if stop is None else stop - begin
        grid = begin + length * np.linspace(0.0, 1.0, len(self._positions))
        result = DesignRun(mechanism, self.reference.pair, grid, len(grid) - 1).run()
        status: IntArray = np.array(result.status)
        value, total = 0.0, np.zeros(len(self.names))
        if result.motion is not None and result.row_count:
            derived = SlopeSystem(result.motion, has_rates=self.rates).derive(
                lambda part: self._weighted_results(weights.rows, part.kinematics.motion)
            )
            solved = slice(result.row_count)
            w: Array = np.stack([array[solved] for array in weights.arrays])
            coordinates: Array = np.stack([array[solved] for array in derived.values.values()])
            slopes: Array = np.stack([array[solved] for array in derived.slopes.values()])
            sums, sum_slopes = np.einsum("rnp,rnp->n", w, coordinates), np.einsum("rnp,rnpk->nk", w, slopes)
            is_valid = ~derived.is_singular[solved] & np.isfinite(sum_slopes).all(axis=1) & np.isfinite(sums)
            status[solved][~is_valid] = OUTCOMES.index(Outcome.DEAD_POINT)
            value, total = float(sums[is_valid].sum()), sum_slopes[is_valid].sum(axis=0)
        total[self._unused] = 0.0
        total[self._bound] = np.nan
        return value, total.tolist(), status

    def _weighted_results(self, rows: Sequence[int], motion: CoordinateMotion) -> list[NamedResult]:
        """The points, or their rates, whose x and y are weighted in these rows."""
        results: list[NamedResult] = []
        for row in rows[::2]:
            order, index = divmod(row // 2, len(self.points))
            link, point = self.reference.point_member(self.points[index])
            place = motion.place(link, motion.shapes[link].position(point), order)
            results.append(NamedResult(str(len(results)), POINT_RESULTS[ORDERS[order]], tuple(place)))
        return results
