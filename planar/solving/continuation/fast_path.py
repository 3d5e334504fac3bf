"""The fast path: positions and runs computed and judged block after block, as far as they are surely regular."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.acceptance import (
    RESULT_COUNT,
    AcceptanceFunctions,
    AcceptanceResult,
    InputSamples,
    JudgedPositions,
    Scales,
)
from planar.equations.constraint_check import ORDERS
from planar.equations.functions import MAX_CACHED_STRUCTURES
from planar.equations.placed_blocks import SETTLED_STEP
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.recorded_formula import formula_of_results, greatest_entries, number_of, recorded_arguments
from planar.solving.checks.branch_check import StepEnds, keep_branch, step_ends
from planar.solving.checks.residual_check import CONTACT_TOLERANCE, EPS, NEGLIGIBLE_ERROR
from planar.solving.prepared_mechanism import PreparedMechanism

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism
    from planar.solving.stops import PairStops

MIN_FAST_REGULARITY = 1e-3
"""Strength of a block from which on its rates are taken as they come; what is weaker is looked at in doubles' whole
precision, see `regularity.SINGULAR_TOLERANCE`."""
MIN_SINGULAR_VALUE = 0.05
"""Least singular value (columns of one size) at both ends of a stride: no change point is near, not even of a
neighbouring linkage."""
MIN_SINGULAR_DISTANCE_RATIO = 3.0
"""How many strides the two ends of one are together from where a group could be singular; the gate asks for half."""
STRAIGHT_TOLERANCE = 1e-12
"""rad or sizes: inputs that are no further from a straight way are on it."""
STEP_LENGTH = 0.125
"""rad or sizes that the fastest input moves from one kept position to the next."""
STRIDES_AT_ONCE = 8
"""Kept positions that are computed together, so that each depends on the way alone."""
MAX_DIRECTIONS = 8
MAX_STORED_NUMBERS, MIN_STORED_POSITIONS = 20_000, 128
"""Numbers that are kept of positions along one way, and positions that are kept however many numbers they have."""


class FastPosition(NamedTuple):
    """A position that is surely sound, with its rates (3, coordinates), and what its worst constraint leaves open."""

    coordinate_rates: Array
    residual: float


def fast_position(setup: PreparedMechanism, z: Array) -> FastPosition | None:
    """The position with its rates, if it is surely sound."""
    if setup.acceptance is None:
        return None
    s = setup.inputs
    parts, judged = setup.acceptance.position(z, InputSamples(s.u, s.u1, s.u2), setup.acceptance_scales)
    return FastPosition(parts, judged.residual) if _is_sure(judged, setup.tolerance) else None


def is_surely_regular(setup: PreparedMechanism, z: Array) -> bool:
    """Whether every block is surely determined at a position."""
    if setup.acceptance is None:
        return False
    u, rest = setup.inputs.u, np.zeros_like(setup.inputs.u)
    judged = setup.acceptance.position(z, InputSamples(u, rest, rest), setup.acceptance_scales)[1]
    return judged.regularity >= MIN_FAST_REGULARITY


class FastSamples(NamedTuple):
    """Coordinates with their rates at the rows of a run (rows, 3, coordinates), which rows are surely sound (rows,),
    and what the worst constraint leaves open at those. Of the other rows nothing is told."""

    coordinate_rates: Array
    is_sure: BoolArray
    residual: float

    def cut(self, rows: slice) -> FastSamples:
        """Some of the rows."""
        return FastSamples(self.coordinate_rates[rows], self.is_sure[rows], self.residual)

    def padded(self, before: int, after: int) -> FastSamples:
        """With so many more rows at the ends of which nothing is told."""
        rows = slice(before, before + len(self.is_sure))
        coordinate_rates: Array = np.zeros((rows.stop + after, *self.coordinate_rates.shape[1:]))
        is_sure: BoolArray = np.zeros(rows.stop + after, dtype=bool)
        coordinate_rates[rows], is_sure[rows] = self.coordinate_rates, self.is_sure
        return FastSamples(coordinate_rates, is_sure, self.residual)

    def reversed(self) -> FastSamples:
        """The rows in the opposite order, velocities turned round."""
        return FastSamples(
            self.coordinate_rates[::-1] * np.array([1.0, -1.0, 1.0])[:, None], self.is_sure[::-1], self.residual
        )


def concatenate_samples(first: FastSamples | None, second: FastSamples | None) -> FastSamples | None:
    """The rows of both."""
    if first is None or second is None:
        return None
    parts = np.concatenate([first.coordinate_rates, second.coordinate_rates])
    return FastSamples(parts, np.concatenate([first.is_sure, second.is_sure]), max(first.residual, second.residual))


class FastSolver(Protocol):
    """What a quick run needs of a solver."""

    @property
    def acceptance(self) -> AcceptanceFunctions | None:
        """What computes and judges positions block after block."""

    @property
    def stops(self) -> PairStops | None:
        """The stops of its pairs, if it has any."""

    def stop_positions(self, z: Array, u: Array) -> Array:
        """The positions of the pairs that have stops (stops,), or (stops, rows)."""

    @property
    def tolerance(self) -> float:
        """What the residual check lets pass."""

    @property
    def acceptance_scales(self) -> Scales:
        """The numbers of a mechanism by which positions are judged."""


class FastRun(NamedTuple):
    """The first rows of a run, all of them closed and on one branch: unknowns (rows, unknowns), coordinates with their
    rates (rows, 3, coordinates), which rows are surely sound with these, and what the worst constraint leaves open."""

    z: Array
    coordinate_rates: Array
    is_sure: BoolArray
    residual: float


def fast_run(setup: FastSolver, z: Array, u: Array, u1: Array, u2: Array, at: int = 0) -> FastRun | None:
    """A run of inputs (rows, inputs) with rates u1, u2 from the unknowns of its first row, as far as its rows are
    closed and keep to the branch; or from those of a row `at` within it, if all rows are and do. None for a structure
    that is not computed block after block."""
    functions, scales = setup.acceptance, setup.acceptance_scales
    if functions is None or not u.size:
        return None
    way, steps = _straight_way(u), np.diff(u, axis=0)
    along = None if way is None else _along(way.axis, u1, u2)
    if way is not None and along is not None:
        samples, judged = _run_along(functions, z, u, way.axis, scales, at)
        w, w1, w2 = judged.coordinate_rates.transpose(1, 0, 2)
        first, second = along
        with np.errstate(all="ignore"):  # at a dead point rates are no numbers
            coordinate_rates = np.stack([w, w1 * first, w2 * first * first + w1 * second], axis=1)
        ends = _ends_along(functions, judged, way.gone)
    else:
        samples, judged = functions.run(z, InputSamples(u, u1, u2), scales, at)
        coordinate_rates = judged.coordinate_rates
        ends = (
            step_ends(functions, samples[:-1], u[:-1], steps, scales),
            step_ends(functions, samples[1:], u[1:], steps, scales),
        )
    result = judged.result
    with np.errstate(all="ignore"):  # of what is not finite
        accepted, is_sure = _is_closed(result, setup.tolerance), _is_sure(result, setup.tolerance)
    squares = np.sum(steps * steps, axis=1)
    accepted[1:] &= keep_branch(np.diff(samples, axis=0), *ends, squares, functions.block_starts)
    if setup.stops is not None:
        from planar.solving.stops import MAX_SURE_MOVE  # few mechanisms have stops

        accepted &= setup.stops.sure_rows(setup.stop_positions(samples, u), samples)
        accepted[1:] &= np.abs(steps).max(axis=1, initial=0.0) <= MAX_SURE_MOVE
    count = _count_first(accepted)
    if at and count < len(u):
        return None
    residual = float(result.residual[:count].max(initial=0.0))
    return FastRun(samples[:count], coordinate_rates[:count], is_sure[:count], residual)


def _run_along(
    functions: AcceptanceFunctions, z: Array, u: Array, axis: Array, scales: Scales, at: int = 0
) -> tuple[Array, JudgedPositions]:
    """A run of inputs along an axis, judged while they move along it evenly."""
    return functions.run(z, InputSamples(u, np.broadcast_to(axis, u.shape), np.zeros_like(u)), scales, at)


def _count_first(accepted: BoolArray) -> int:
    """How many of the first rows are accepted, up to the first that is not."""
    return len(accepted) if accepted.all() else int(np.argmin(accepted))


class _StraightWay(NamedTuple):
    """The axis (inputs,) of a run along a straight line, and how far each step goes along it (steps,)."""

    axis: Array
    gone: Array


def _straight_way(u: Array) -> _StraightWay | None:
    """The straight way of inputs (rows, inputs); None where it is none."""
    steps = np.diff(u, axis=0)
    sizes = np.abs(steps).max(axis=1, initial=0.0)
    if not sizes.any():
        return _StraightWay(np.ones(u.shape[1]), sizes)
    most = int(np.argmax(sizes))
    axis = steps[most] / sizes[most]
    gone = steps @ axis / (axis @ axis)
    is_straight = np.abs(steps - gone[:, None] * axis).max() <= STRAIGHT_TOLERANCE
    return _StraightWay(axis, gone) if is_straight else None


def _along(axis: Array, u1: Array, u2: Array) -> tuple[Array, Array] | None:
    """First and second rates of inputs as multiples (rows, 1) of an axis; None where they are none."""
    first, second = ((rates @ axis / (axis @ axis))[:, None] for rates in (u1, u2))
    is_along = np.array_equal(u1, first * axis) and np.array_equal(u2, second * axis)
    return (first, second) if is_along else None


def _ends_along(functions: AcceptanceFunctions, judged: JudgedPositions, gone: Array) -> tuple[StepEnds, StepEnds]:
    """What is known at both ends of steps so far along the axis by which positions were judged."""
    return _ends(judged.coordinate_rates[:, 1, functions.unknown_columns], judged.distances, gone[:, None])


def _ends(rates: Array, distances: Array, step: Array) -> tuple[StepEnds, StepEnds]:
    """The same by the rates of unknowns and the distances along the axis; `step` (steps, 1)."""
    with np.errstate(all="ignore"):  # a step to the same place
        return (
            StepEnds(rates[:-1] * step, distances[:-1] / np.abs(step)),
            StepEnds(rates[1:] * step, distances[1:] / np.abs(step)),
        )


def _is_sure(result: AcceptanceResult[Any], tolerance: float) -> Any:
    """Whether a position, or which of many, are surely sound with their rates."""
    return (
        _is_closed(result, tolerance)
        & (result.velocity_error <= 1e3 * tolerance)
        & (result.acceleration_error <= 1e3 * tolerance)
        & (result.contact_gap <= CONTACT_TOLERANCE)
        & (result.regularity >= MIN_FAST_REGULARITY)
        & (EPS * result.rounding_amplification <= NEGLIGIBLE_ERROR)
    )


def _is_closed(result: AcceptanceResult[Any], tolerance: float) -> Any:
    """Whether every constraint is closed, and everything a number."""
    # what is not finite is not equal to itself, less itself
    return (result.residual <= tolerance) & (result.finite_sum - result.finite_sum == 0.0)


class _KeptPosition(NamedTuple):
    """A position that is kept: unknowns, rates of these along the way, how far along it every block is regular, and
    coordinates."""

    z: Array
    rates: Array
    distances: Array
    coordinates: Array


class _KeptWay(NamedTuple):
    """A straight way of the inputs: its axis, how far it goes, and how many strides lead to its last kept position."""

    axis: tuple[float, ...]
    reach: float
    last_stride: int


def _rates_along(axis: Sequence[float], u1: list[float], u2: list[float]) -> tuple[float, float] | None:
    """First and second rates of inputs as multiples of an axis; None where they are none."""
    square = sum(part * part for part in axis) or 1.0
    first, second = (sum(a * b for a, b in zip(rates, axis, strict=False)) / square for rates in (u1, u2))
    if [first * part for part in axis] != u1 or [second * part for part in axis] != u2:
        return None
    return first, second


class StraightPathCache:
    """Positions at even distances along straight ways that lead away from one position, each made when it is needed.

    They depend on that position and the way alone, so that what is found by them does not depend, but for rounding, on
    what was asked for before.
    """

    def __init__(self, setup: PreparedMechanism, z: Array):
        self.setup, self.z, self.start = setup, z, setup.inputs.u.tolist()
        self.max_positions = max(MAX_STORED_NUMBERS // max(len(z), 1), MIN_STORED_POSITIONS)
        self._kept: dict[tuple[float, ...], dict[int, _KeptPosition | None]] = {}
        self._step_arguments: dict[tuple[tuple[float, ...], int], list[list[float]]] = {}

    def unknowns_at(self, stop: Sequence[float]) -> Array | None:
        """The unknowns to which the straight way to other inputs leads; None where not all of it is surely sound."""
        way = self._way_to(stop)
        if way.reach == 0.0:
            return None if self.setup.acceptance is None or self.setup.stops is not None else self.z
        kept = self._last_kept(way)
        last = kept and self._walk(kept.z, np.array([way.last_stride * STEP_LENGTH, way.reach]), way.axis)[1]
        return last and last.z

    def position_at(self, mechanism: Mechanism) -> FastPosition | None:
        """The position with its rates to which the straight way to the inputs of a mechanism leads, if it is surely
        sound and they move along that way, by the formula of one step; None where that does not pay yet."""
        functions = self.setup.acceptance
        if functions is None or not (functions.has_one_formula and functions.has_closed_forms):
            return None
        if not self.setup.keeps_its_numbers(mechanism):
            return None
        stop, u1, u2 = self.setup.scaled_inputs(mechanism)
        way = self._way_to(stop)
        place = way.last_stride * STEP_LENGTH
        along = _rates_along(way.axis, u1, u2)
        kept = self._last_kept(way) if along is not None and way.reach > place else None
        if along is None or kept is None:
            return None
        key = way.axis, way.last_stride
        known = self._step_arguments.get(key)
        if known is None:
            u = np.array(self.start) + place * np.array(way.axis)
            known = self._step_arguments[key] = [
                functions.signs_at(kept.coordinates, u, self.setup.inputs.p),
                *(part.tolist() for part in kept[:3]),
                [*way.axis],
                *(part.tolist() for part in self.setup.acceptance_scales),
            ]
        values = _step_formula(functions).values(*known, [way.reach - place, *along], stop)
        keeps_branch, greatest_move, *of_result = values[: RESULT_COUNT + 2]
        result: AcceptanceResult[float] = AcceptanceResult(*of_result)
        is_regular = greatest_move <= SETTLED_STEP and result.least_singular_value > MIN_SINGULAR_VALUE
        if not (keeps_branch and is_regular and _is_sure(result, self.setup.tolerance)):
            return None
        return FastPosition(np.array(values[RESULT_COUNT + 2 :]).reshape(ORDERS, -1), result.residual)

    def _way_to(self, stop: Sequence[float]) -> _KeptWay:
        way = [there - here for there, here in zip(stop, self.start, strict=True)]
        reach = max(map(abs, way), default=0.0)
        return _KeptWay(tuple([gone / reach for gone in way]) if reach else (), reach, int(reach / STEP_LENGTH))

    def _last_kept(self, way: _KeptWay) -> _KeptPosition | None:
        """The last kept position on a way; None where what leads there is not surely sound."""
        many = way.last_stride
        if self.setup.acceptance is None or self.setup.stops is not None or many > self.max_positions:
            return None
        kept = self._kept.get(way.axis)
        if kept is None:
            if len(self._kept) >= MAX_DIRECTIONS:
                self._kept.clear()
                self._step_arguments.clear()
            kept = self._kept[way.axis] = {}
        while many not in kept:
            first = max(kept, default=0)
            before = kept.get(first)
            if kept and before is None:
                return None
            strides = np.arange(first, min(first + STRIDES_AT_ONCE, self.max_positions) + 1)
            positions = self._walk(self.z if before is None else before.z, strides * STEP_LENGTH, way.axis)
            kept.update(zip(strides.tolist(), positions, strict=True))
        return kept.get(many)

    def _walk(self, z: Array, places: Array, along: Sequence[float]) -> list[_KeptPosition | None]:
        """The positions at places along an axis, from the unknowns at the first as far as each step is surely sound."""
        functions = self.setup.acceptance
        assert functions is not None
        axis, scales = np.array(along), self.setup.acceptance_scales
        u = np.array(self.start) + places[:, None] * axis
        samples, judged = _run_along(functions, z, u, axis, scales)
        result, gone = judged.result, np.diff(places)
        with np.errstate(all="ignore"):  # of what is not finite
            accepted = _is_closed(result, self.setup.tolerance) & (result.least_singular_value > MIN_SINGULAR_VALUE)
        ends, squares = _ends_along(functions, judged, gone), gone * gone * (axis @ axis)
        ratio = MIN_SINGULAR_DISTANCE_RATIO
        accepted[1:] &= keep_branch(np.diff(samples, axis=0), *ends, squares, functions.block_starts, ratio)
        count = _count_first(accepted)
        rates = judged.coordinate_rates[:, 1, functions.unknown_columns]
        parts = samples[:count], rates, judged.distances, judged.coordinate_rates[:, 0]
        kept = [_KeptPosition(*of_position) for of_position in zip(*parts, strict=False)]
        return [*kept, *[None] * (len(samples) - count)]


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _step_formula(functions: AcceptanceFunctions) -> FormulaFunction:
    """(signs of blocks, the kept position, axis, scales, how far along it from that position with first and second
    rate, inputs) -> whether the step keeps to its branch, the greatest move by Newton's method, what is judged,
    and coordinates with their rates in time."""
    unknowns, inputs = len(functions.unknown_columns), len(functions.equations.input_kinds)
    blocks, distances = functions.block_count, len(functions.block_starts)
    counts = blocks, unknowns, unknowns, distances, inputs, *functions.scale_counts, 3, inputs
    instructions, (signs, z, rates, regular, axis, p, row_scale, floor, along, u) = recorded_arguments(counts)
    gone, first, second = np.split(along, 3)
    step = functions.record_step(signs, z, InputSamples(u, axis, np.zeros_like(axis)), Scales(p, row_scale, floor))
    judged = step.judged
    w, w1, w2 = judged.coordinate_rates[0]
    both = np.stack([rates, w1[functions.unknown_columns]]), np.stack([regular, judged.distances[0]])
    ends = _ends(*both, np.array([gone]))
    squares = gone * gone * np.sum(axis * axis, keepdims=True)
    keeps = keep_branch((step.z - z)[None], *ends, squares, functions.block_starts, MIN_SINGULAR_DISTANCE_RATIO)
    results = [*keeps, *greatest_entries(np.abs(step.moves)[:, None]), *(values[0] for values in judged.result)]
    results += [*w, *(w1 * first), *(w2 * first * first + w1 * second)]
    formula = formula_of_results(instructions, [number_of(result, instructions) for result in results])
    return FormulaFunction(formula, counts, ((1, len(results)),))
