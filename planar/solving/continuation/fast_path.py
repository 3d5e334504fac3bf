"""Runs computed and judged block after block, as far as they are surely regular: their rows, and the branch check.

Two positions lie on one branch if every unknown has moved as its rates allow, and if no block can have been singular
between. A Jacobian stays regular until it has changed by its least singular value (Weyl), so least value over rate of
change is a distance in which nothing happens: a step must be shorter than those at its two ends together. So a change
point, where branches cross, is not passed within a step, whichever sign the determinant has beyond it and however the
rates there agree.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from itertools import chain
from types import MappingProxyType
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
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.recorded_formula import formula_of_results, greatest_entries, number_of, recorded_arguments
from planar.solving.checks import CONTACT_TOLERANCE, EPS, NEGLIGIBLE_ERROR, SINGULAR_DISTANCE_RATIO
from planar.solving.prepared_mechanism import PreparedMechanism

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism
    from planar.solving.continuation.predictor_corrector import NearbyBifurcation, PassedBifurcation

FILM_BACKWARDS = np.array([1.0, -1.0, 1.0])
"""Signs of position, velocity and acceleration in a film that runs backwards."""
MIN_FAST_REGULARITY = 1e-3
"""Strength of a block from which on its rates are taken as they come; what is weaker is looked at in doubles' whole
precision, see `regularity.SINGULAR_TOLERANCE`."""
MIN_SINGULAR_VALUE = 0.05
"""Least singular value (columns of one size) at both ends of a stride: no change point is near, not even of a
neighbouring linkage."""
MIN_SINGULAR_DISTANCE_RATIO = 3.0
"""How many strides the two ends of one are together from where a group could be singular; the gate asks for half."""
STRAIGHT_TOLERANCE = 1e-12
"""rad or sizes: inputs that are no further from a straight path are on it."""
STEP_LENGTH = 0.125
"""rad or sizes that the fastest input moves from one kept position to the next."""
STRIDES_AT_ONCE = 8
"""Kept positions that are computed together, so that each depends on the path alone."""
MAX_DIRECTIONS = 8
MAX_STORED_NUMBERS, MIN_STORED_POSITIONS = 20_000, 128
"""Numbers that are kept of positions along one path, and positions that are kept however many numbers they have."""


class StepEnds(NamedTuple):
    """What is known at one end of each step: the rates of the unknowns, as moves over the whole step (steps, unknowns),
    and how far, in steps, each block is from where it could be singular, with the sign of its determinant (steps,
    blocks)."""

    rates: Array
    distances: Array


def step_ends(functions: AcceptanceFunctions, z: Array, u: Array, steps: Array, scales: Scales) -> StepEnds:
    """What is known at positions z (steps, unknowns) and u (steps, inputs) of steps (steps, inputs)."""
    judged = functions.judge(z, InputSamples(u, steps, np.zeros_like(steps)), scales)
    return StepEnds(judged.coordinate_rates[:, 1, functions.unknown_columns], judged.distances)


def keep_branch(
    moves: Array,
    before: StepEnds,
    after: StepEnds,
    squares: Array,
    block_starts: IntArray,
    ratio: float = SINGULAR_DISTANCE_RATIO,
) -> Array:
    """For each step, by the moves of its unknowns (steps, unknowns), whether it keeps to its branch; of its inputs the
    sums of squares (steps,). `ratio` says how many steps its ends together have to be from where a block is singular.

    True or False, or recorded: then 1 or 0.
    """
    if not moves.shape[1]:
        return np.ones(len(moves), dtype=bool)
    with np.errstate(all="ignore"):  # what is not a number is no more than anything
        is_far = _all_of_step(np.abs(before.distances) + np.abs(after.distances) > ratio)
        smooth = _all_of_step(is_move_allowed(moves, before.rates, after.rates))
        return smooth * is_far * keep_signs(before, after) * keep_direction(before, after, squares, block_starts)


def _all_of_step(conditions: Array | BoolArray) -> Array:
    """For each step whether all its conditions (steps, conditions) hold."""
    hold: Array = np.multiply.reduce(conditions, axis=1, dtype=conditions.dtype)
    return hold


def keep_signs(before: StepEnds, after: StepEnds) -> Array:
    """For each step whether the determinant of every block keeps its sign.

    Of two assemblies that come near to each other before a dead point each has another one, so that no step leads from
    one to the other, however alike they are.
    """
    return _all_of_step(before.distances * after.distances >= 0.0)


def keep_direction(before: StepEnds, after: StepEnds, squares: Array, block_starts: IntArray) -> Array:
    """For each step whether every block goes on as it came: less than a right angle between the tangents.

    Beside a limit both ends of a step may be closed, and any move allowed by rates that grow beyond all bounds there;
    but on the branch that comes back from the limit they have the other sign.
    """
    turns = np.add.reduceat(before.rates * after.rates, block_starts, axis=1)
    return _all_of_step(turns + squares[:, None] >= 0.0)


def is_move_allowed(move: Array, before: Array, after: Array) -> Array:
    """Whether a move is one that the rates at its two ends allow, each as a move over the whole step.

    A smooth move differs from the mean of the two by no more than they differ from one another, with room for the
    curvature between (a quarter of the greater) and a floor of round-off for what hardly moves.
    """
    greater = greatest_entries(np.array([np.abs(before), np.abs(after)]))
    allowed: Array = np.abs(move - 0.5 * (before + after)) <= np.abs(after - before) + 0.25 * greater + 1e-9
    return allowed


class InputRates(NamedTuple):
    """Positions of the inputs over a run, with their first, second and third rates, each (samples, inputs)."""

    u: Array
    u1: Array
    u2: Array
    u3: Array

    def select(self, rows: IntArray | slice) -> InputRates:
        """The rows with these numbers."""
        return InputRates(*(rate[rows] for rate in self))


def resting_inputs(u: Array) -> InputRates:
    """Inputs at positions (samples, inputs) without rates."""
    rest = np.zeros_like(u)
    return InputRates(u, rest, rest, rest)


class BranchRates(NamedTuple):
    """Rates where a slope is singular: first, second and third derivative of the unknowns (3, unknowns) by the distance
    of the inputs along a direction; and how much rank the Jacobian lacks at the change point."""

    rates: Array
    input_direction: Array
    rank_loss: int


class RunSamples(NamedTuple):
    """The rows of a run as far as it comes.

    `z`: unknowns (rows, unknowns). `coordinate_rates`: coordinates with their rates (rows, 3, coordinates) at the rows
    that are surely sound, which `is_sure` says (rows,); `residual` is what the worst constraint leaves open at those.
    `dead_points` are rows, `branch_rates` the rates at rows where the Jacobian is singular. `passed` are the change
    points on the way, `nearby` those of neighbouring linkages. A run that does not come to its end has `stopped`, with
    the last unknowns and inputs before that where they are known. `reason` says why its range ends.
    """

    z: Array
    inputs: InputRates
    coordinate_rates: Array
    is_sure: BoolArray
    residual: float = 0.0
    dead_points: tuple[int, ...] = ()
    branch_rates: Mapping[int, BranchRates] = MappingProxyType({})
    passed: tuple[PassedBifurcation, ...] = ()
    nearby: tuple[NearbyBifurcation, ...] = ()
    stopped: NoAnswer | None = None
    last_position: tuple[Array, Array] | None = None
    reason: str = ""

    @property
    def outcome(self) -> Outcome:
        """Whether the run came to its end, or why not."""
        return Outcome.SOLVED if self.stopped is None else self.stopped.outcome

    def select(self, rows: IntArray) -> RunSamples:
        """The rows with these numbers, in this order."""
        numbers = rows.tolist()
        return self._replace(
            z=self.z[rows],
            inputs=self.inputs.select(rows),
            coordinate_rates=self.coordinate_rates[rows],
            is_sure=self.is_sure[rows],
            dead_points=tuple(k for k, row in enumerate(numbers) if row in self.dead_points),
            branch_rates={k: self.branch_rates[row] for k, row in enumerate(numbers) if row in self.branch_rates},
        )

    def from_row(self, first: int) -> RunSamples:
        """The rows from one on."""
        return self.select(np.arange(first, len(self.z)))

    def reversed(self) -> RunSamples:
        """The same run backwards: velocities turn round, accelerations stay, as in a film run backwards."""
        run = self.select(np.arange(len(self.z))[::-1])
        u, u1, u2, u3 = run.inputs
        return run._replace(
            inputs=InputRates(u, -u1, u2, -u3), coordinate_rates=run.coordinate_rates * FILM_BACKWARDS[:, None]
        )

    def with_last_row(self, z: Array, inputs: InputRates, is_dead_point: bool) -> RunSamples:
        """The rows with one more at the end, of unknowns z (unknowns,)."""
        last = RunSamples(z[None], inputs, np.zeros((1, *self.coordinate_rates.shape[1:])), np.zeros(1, dtype=bool))
        dead_points = (0,) if is_dead_point else ()
        return join_runs([self, last._replace(dead_points=dead_points, stopped=self.stopped)])


def unjudged_rows(setup: PreparedMechanism, z: Array, inputs: InputRates) -> RunSamples:
    """Rows of unknowns (rows, unknowns) of which nothing is known to be sound."""
    count = len(z)
    return RunSamples(z, inputs, np.zeros((count, 3, len(setup.scale))), np.zeros(count, dtype=bool))


def join_runs(parts: Sequence[RunSamples]) -> RunSamples:
    """The rows of runs one after the other; it ends as the last of them does."""
    first_rows = np.cumsum([0, *(len(part.z) for part in parts)]).tolist()
    numbered = list(zip(first_rows, parts, strict=False))
    return parts[-1]._replace(
        z=np.vstack([part.z for part in parts]),
        inputs=InputRates(*(np.vstack(rates) for rates in zip(*(part.inputs for part in parts), strict=True))),
        coordinate_rates=np.concatenate([part.coordinate_rates for part in parts]),
        is_sure=np.concatenate([part.is_sure for part in parts]),
        residual=max(part.residual for part in parts),
        dead_points=tuple(first + row for first, part in numbered for row in part.dead_points),
        branch_rates={first + row: rates for first, part in numbered for row, rates in part.branch_rates.items()},
        passed=tuple(chain.from_iterable(part.passed for part in parts)),
        nearby=tuple(chain.from_iterable(part.nearby for part in parts)),
        reason=next((part.reason for part in parts if part.reason), ""),
    )


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


@np.errstate(all="ignore")  # of what is not finite, at a dead point and for a step to the same place
def fast_run(setup: PreparedMechanism, z: Array, inputs: InputRates, start: int = 0) -> RunSamples | None:
    """The first rows of a run that are closed and keep to the branch, from the unknowns of its first row; or all rows
    from those of the row `start`, if all are and do. None for a structure that is not computed block after block."""
    functions, (u, u1, u2, _) = setup.acceptance, inputs
    if functions is None or not u.size:
        return None
    steps = np.diff(u, axis=0)
    path = _straight_path(steps, u1, u2)
    if path is not None:
        axis, distances, first, second = path
        z, samples, accepted = _run_along(setup, z, u, axis, distances, SINGULAR_DISTANCE_RATIO, start)
        w, w1, w2 = samples.coordinate_rates.transpose(1, 0, 2)
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
    setup: PreparedMechanism, z: Array, u: Array, axis: Array, steps: Array, ratio: float, start: int = 0
) -> tuple[Array, JudgedPositions, BoolArray]:
    """A run of inputs by steps (steps,) along an axis (inputs,) from the unknowns of the row `start`: unknowns (rows,
    unknowns), what is judged while the inputs move along the axis evenly, and which rows are closed and keep to the
    branch.

    `ratio` says how many steps the ends of one together have to be from where a block is singular.
    """
    functions = setup.acceptance
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


def _straight_path(steps: Array, u1: Array, u2: Array) -> tuple[Array, Array, Array, Array] | None:
    """The axis (inputs,) of a run along a straight line, how far each of its steps (steps, inputs) goes along it
    (steps,), and the first and second rates of the inputs (rows, inputs) as multiples of it (rows, 1).

    None where the steps or the rates are not along one line.
    """
    sizes = np.abs(steps).max(axis=1, initial=0.0)
    axis, along = np.ones(steps.shape[1]), sizes
    if sizes.any():
        longest = int(np.argmax(sizes))
        axis = steps[longest] / sizes[longest]
        along = steps @ axis / (axis @ axis)
        if not np.abs(steps - along[:, None] * axis).max() <= STRAIGHT_TOLERANCE:
            return None
    first, second = ((rates @ axis / (axis @ axis))[:, None] for rates in (u1, u2))
    is_along = np.array_equal(u1, first * axis) and np.array_equal(u2, second * axis)
    return (axis, along, first, second) if is_along else None


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
    """A position that is kept: unknowns, rates of these along the path, how far along it every block is regular, and
    coordinates."""

    z: Array
    rates: Array
    distances: Array
    coordinates: Array


class _InputPath(NamedTuple):
    """A straight path of the inputs: its axis, how far it goes, and how many strides lead to its last kept position."""

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
    """Positions at even distances along straight paths that lead away from one position, each made when it is needed.

    They depend on that position and the path alone: results do not depend, but for rounding, on earlier requests.
    """

    def __init__(self, setup: PreparedMechanism, z: Array):
        self.setup, self.z, self.start = setup, z, setup.inputs.u.tolist()
        self.max_positions = max(MAX_STORED_NUMBERS // max(len(z), 1), MIN_STORED_POSITIONS)
        self._kept: dict[tuple[float, ...], dict[int, _KeptPosition | None]] = {}
        self._step_arguments: dict[tuple[tuple[float, ...], int], list[list[float]]] = {}

    def unknowns_at(self, stop: Sequence[float]) -> Array | None:
        """The unknowns to which the straight path to other inputs leads; None where not all of it is surely sound."""
        path = self._path_to(stop)
        if path.reach == 0.0:
            return None if self.setup.acceptance is None or self.setup.stops is not None else self.z
        cached = self._last_kept(path)
        last = cached and self._walk(cached.z, np.array([path.last_stride * STEP_LENGTH, path.reach]), path.axis)[1]
        return last and last.z

    def position_at(self, mechanism: Mechanism) -> FastPosition | None:
        """The position with its rates to which the straight path to the inputs of a mechanism leads, if it is surely
        sound and they move along that path, by the formula of one step; None where that does not pay yet."""
        functions = self.setup.acceptance
        if functions is None or not (functions.has_one_formula and functions.has_closed_forms):
            return None
        if not self.setup.keeps_its_numbers(mechanism):
            return None
        stop, u1, u2 = self.setup.scaled_inputs(mechanism)
        path = self._path_to(stop)
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

    def _path_to(self, stop: Sequence[float]) -> _InputPath:
        direction = [end - start for end, start in zip(stop, self.start, strict=True)]
        reach = max(map(abs, direction), default=0.0)
        return _InputPath(tuple([part / reach for part in direction]) if reach else (), reach, int(reach / STEP_LENGTH))

    def _last_kept(self, path: _InputPath) -> _KeptPosition | None:
        """The last kept position on a path; None where what leads there is not surely sound."""
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
        steps = np.diff(places)
        samples, judgement, accepted = _run_along(self.setup, z, u, axis, steps, MIN_SINGULAR_DISTANCE_RATIO)
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
