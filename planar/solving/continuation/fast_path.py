"""The fast path: positions and runs computed and judged block after block, as far as they are surely regular."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

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
from planar.equations.block_type_functions import SETTLED_STEP
from planar.equations.constraint_check import ORDERS
from planar.equations.functions import MAX_CACHED_STRUCTURES
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.recorded_formula import formula_of_results, greatest_entries, number_of, recorded_arguments
from planar.solving.checks.branch_check import StepEnds, keep_branch, step_ends
from planar.solving.checks.residual_check import CONTACT_TOLERANCE, EPS, NEGLIGIBLE_ERROR
from planar.solving.checks.singular_values import SINGULAR_DISTANCE_RATIO
from planar.solving.continuation.run_samples import InputRates, RunSamples
from planar.solving.prepared_mechanism import PreparedMechanism

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism

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
    parts, result = setup.acceptance.position(z, InputSamples(s.u, s.u1, s.u2), setup.acceptance_scales)
    return FastPosition(parts, result.residual) if _is_sure(result, setup.tolerance) else None


def is_surely_regular(setup: PreparedMechanism, z: Array) -> bool:
    """Whether every block is surely determined at a position."""
    if setup.acceptance is None:
        return False
    u, rest = setup.inputs.u, np.zeros_like(setup.inputs.u)
    result = setup.acceptance.position(z, InputSamples(u, rest, rest), setup.acceptance_scales)[1]
    return result.regularity >= MIN_FAST_REGULARITY


@np.errstate(all="ignore")  # of what is not finite, at a dead point and for a step to the same place
def fast_run(setup: PreparedMechanism, z: Array, inputs: InputRates, start: int = 0) -> RunSamples | None:
    """The first rows of a run that are closed and keep to the branch, from the unknowns of its first row; or all rows
    from those of the row `start`, if all are and do. None for a structure that is not computed block after block."""
    functions, (u, u1, u2, _) = setup.acceptance, inputs
    if functions is None or not u.size:
        return None
    path, steps = _straight_path(u), np.diff(u, axis=0)
    along = None if path is None else _along(path.axis, u1, u2)
    if path is not None and along is not None:
        z, samples, accepted = _run_along(setup, z, u, path, SINGULAR_DISTANCE_RATIO, start)
        w, w1, w2 = samples.coordinate_rates.transpose(1, 0, 2)
        first, second = along
        coordinate_rates = np.stack([w, w1 * first, w2 * first * first + w1 * second], axis=1)
    else:
        scales = setup.acceptance_scales
        z, samples = functions.run(z, InputSamples(u, u1, u2), scales, start)
        coordinate_rates = samples.coordinate_rates
        accepted = _is_closed(samples.result, setup.tolerance)
        before = step_ends(functions, z[:-1], u[:-1], steps, scales)
        after = step_ends(functions, z[1:], u[1:], steps, scales)
        squares = np.sum(steps * steps, axis=1)
        accepted[1:] &= keep_branch(np.diff(z, axis=0), before, after, squares, functions.block_starts)
    is_sure = _is_sure(samples.result, setup.tolerance)
    if setup.stops is not None:
        from planar.solving.stops import MAX_SURE_MOVE  # few mechanisms have stops

        accepted &= setup.stops.sure_rows(setup.stop_positions(z, u), z)
        accepted[1:] &= np.abs(steps).max(axis=1, initial=0.0) <= MAX_SURE_MOVE
    count = _count_first(accepted)
    if start and count < len(u):
        return None
    residual = float(samples.result.residual[:count].max(initial=0.0))
    return RunSamples(z[:count], inputs.select(slice(count)), coordinate_rates[:count], is_sure[:count], residual)


def _run_along(
    setup: PreparedMechanism, z: Array, u: Array, path: _StraightPath, ratio: float, start: int = 0
) -> tuple[Array, JudgedPositions, BoolArray]:
    """A run of inputs along a straight path from the unknowns of the row `start`: unknowns (rows, unknowns), what is
    judged while the inputs move along the axis evenly, and which rows are closed and keep to the branch.

    `ratio` says how many steps the ends of one together have to be from where a block is singular.
    """
    functions, (axis, steps) = setup.acceptance, path
    assert functions is not None
    inputs = InputSamples(u, np.broadcast_to(axis, u.shape), np.zeros_like(u))
    z, samples = functions.run(z, inputs, setup.acceptance_scales, start)
    ends = _ends(samples.coordinate_rates[:, 1, functions.unknown_columns], samples.distances, steps[:, None])
    accepted, squares = _is_closed(samples.result, setup.tolerance), steps * steps * (axis @ axis)
    accepted[1:] &= keep_branch(np.diff(z, axis=0), *ends, squares, functions.block_starts, ratio)
    return z, samples, accepted


def _count_first(accepted: BoolArray) -> int:
    """How many of the first rows are accepted, up to the first that is not."""
    return len(accepted) if accepted.all() else int(np.argmin(accepted))


class _StraightPath(NamedTuple):
    """The axis (inputs,) of a run along a straight line, and how far each step goes along it (steps,)."""

    axis: Array
    steps: Array


def _straight_path(u: Array) -> _StraightPath | None:
    """The straight path of inputs (rows, inputs); None where it is none."""
    steps = np.diff(u, axis=0)
    sizes = np.abs(steps).max(axis=1, initial=0.0)
    if not sizes.any():
        return _StraightPath(np.ones(u.shape[1]), sizes)
    longest = int(np.argmax(sizes))
    axis = steps[longest] / sizes[longest]
    along = steps @ axis / (axis @ axis)
    is_straight = np.abs(steps - along[:, None] * axis).max() <= STRAIGHT_TOLERANCE
    return _StraightPath(axis, along) if is_straight else None


def _along(axis: Array, u1: Array, u2: Array) -> tuple[Array, Array] | None:
    """First and second rates of inputs as multiples (rows, 1) of an axis; None where they are none."""
    first, second = ((rates @ axis / (axis @ axis))[:, None] for rates in (u1, u2))
    is_along = np.array_equal(u1, first * axis) and np.array_equal(u2, second * axis)
    return (first, second) if is_along else None


def _ends(rates: Array, distances: Array, step: Array) -> tuple[StepEnds, StepEnds]:
    """What is known at both ends of steps (steps, 1) along an axis, by the rates of unknowns and the distances along
    it."""
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
        path = self._way_to(stop)
        if path.reach == 0.0:
            return None if self.setup.acceptance is None or self.setup.stops is not None else self.z
        cached = self._last_kept(path)
        last = cached and self._walk(cached.z, np.array([path.last_stride * STEP_LENGTH, path.reach]), path.axis)[1]
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
        path = self._way_to(stop)
        place = path.last_stride * STEP_LENGTH
        along = _rates_along(path.axis, u1, u2)
        cached = self._last_kept(path) if along is not None and path.reach > place else None
        if along is None or cached is None:
            return None
        key = path.axis, path.last_stride
        known = self._step_arguments.get(key)
        if known is None:
            u = np.array(self.start) + place * np.array(path.axis)
            known = self._step_arguments[key] = [
                functions.signs_at(cached.coordinates, u, self.setup.inputs.p),
                *(part.tolist() for part in cached[:3]),
                [*path.axis],
                *(part.tolist() for part in self.setup.acceptance_scales),
            ]
        values = _step_formula(functions).values(*known, [path.reach - place, *along], stop)
        keeps_branch, greatest_move, *of_result = values[: RESULT_COUNT + 2]
        result: AcceptanceResult[float] = AcceptanceResult(*of_result)
        is_regular = greatest_move <= SETTLED_STEP and result.least_singular_value > MIN_SINGULAR_VALUE
        if not (keeps_branch and is_regular and _is_sure(result, self.setup.tolerance)):
            return None
        return FastPosition(np.array(values[RESULT_COUNT + 2 :]).reshape(ORDERS, -1), result.residual)

    def _way_to(self, stop: Sequence[float]) -> _KeptWay:
        direction = [end - start for end, start in zip(stop, self.start, strict=True)]
        reach = max(map(abs, direction), default=0.0)
        return _KeptWay(tuple([part / reach for part in direction]) if reach else (), reach, int(reach / STEP_LENGTH))

    def _last_kept(self, path: _KeptWay) -> _KeptPosition | None:
        """The last kept position on a way; None where what leads there is not surely sound."""
        stride = path.last_stride
        if self.setup.acceptance is None or self.setup.stops is not None or stride > self.max_positions:
            return None
        cached = self._kept.get(path.axis)
        if cached is None:
            if len(self._kept) >= MAX_DIRECTIONS:
                self._kept.clear()
                self._step_arguments.clear()
            cached = self._kept[path.axis] = {}
        while stride not in cached:
            first = max(cached, default=0)
            before = cached.get(first)
            if cached and before is None:
                return None
            strides = np.arange(first, min(first + STRIDES_AT_ONCE, self.max_positions) + 1)
            positions = self._walk(self.z if before is None else before.z, strides * STEP_LENGTH, path.axis)
            cached.update(zip(strides.tolist(), positions, strict=True))
        return cached.get(stride)

    @np.errstate(all="ignore")  # of what is not finite
    def _walk(self, z: Array, places: Array, along: Sequence[float]) -> list[_KeptPosition | None]:
        """The positions at places along an axis, from the unknowns at the first as far as each step is surely sound."""
        functions, axis = self.setup.acceptance, np.array(along)
        assert functions is not None
        u = np.array(self.start) + places[:, None] * axis
        path = _StraightPath(axis, np.diff(places))
        samples, judgement, accepted = _run_along(self.setup, z, u, path, MIN_SINGULAR_DISTANCE_RATIO)
        accepted &= judgement.result.least_singular_value > MIN_SINGULAR_VALUE
        count = _count_first(accepted)
        rates = judgement.coordinate_rates[:, 1, functions.unknown_columns]
        parts = samples[:count], rates, judgement.distances, judgement.coordinate_rates[:, 0]
        positions = [_KeptPosition(*of_position) for of_position in zip(*parts, strict=False)]
        return [*positions, *[None] * (len(samples) - count)]


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _step_formula(functions: AcceptanceFunctions) -> FormulaFunction:
    """(signs of blocks, the kept position, axis, scales, how far along it from that position with first and second
    rate, inputs) -> whether the step keeps to its branch, the greatest move by Newton's method, what is judged,
    and coordinates with their rates in time."""
    unknowns, inputs = len(functions.unknown_columns), len(functions.equations.input_kinds)
    blocks, distances = functions.block_count, len(functions.block_starts)
    counts = blocks, unknowns, unknowns, distances, inputs, *functions.scale_counts, 3, inputs
    instructions, (signs, z, rates, regular, axis, p, row_scale, floor, along, u) = recorded_arguments(counts)
    distance, first, second = np.split(along, 3)
    step = functions.record_step(signs, z, InputSamples(u, axis, np.zeros_like(axis)), Scales(p, row_scale, floor))
    judgement = step.judged
    w, w1, w2 = judgement.coordinate_rates[0]
    both = np.stack([rates, w1[functions.unknown_columns]]), np.stack([regular, judgement.distances[0]])
    ends = _ends(*both, np.array([distance]))
    squares = distance * distance * np.sum(axis * axis, keepdims=True)
    keeps = keep_branch((step.z - z)[None], *ends, squares, functions.block_starts, MIN_SINGULAR_DISTANCE_RATIO)
    results = [*keeps, *greatest_entries(np.abs(step.moves)[:, None]), *(values[0] for values in judgement.result)]
    results += [*w, *(w1 * first), *(w2 * first * first + w1 * second)]
    formula = formula_of_results(instructions, [number_of(result, instructions) for result in results])
    return FormulaFunction(formula, counts, ((1, len(results)),))
