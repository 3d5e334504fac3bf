"""The fast path along straight input paths: compiled functions alone, as far as every position is surely regular."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from planar.equations.functions import EquationFunctions
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.solving.checks.branch_check import is_move_allowed
from planar.solving.checks.residual_check import CONTACT_TOLERANCE, EPS, NEGLIGIBLE_ERROR
from planar.solving.checks.singular_values import SINGULAR_DISTANCE_RATIO
from planar.solving.prepared_mechanism import PositionInputs, PreparedMechanism

if TYPE_CHECKING:
    from planar.equations.acceptance import AcceptanceFunctions, AcceptanceResult
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
MAX_DIRECTIONS = 8
MAX_STORED_NUMBERS, MIN_STORED_POSITIONS = 20_000, 128
"""Numbers that are kept of positions along one way, and positions that are kept however many numbers they have."""


class FastPosition:
    """A position that is surely sound, with its rates."""

    __slots__ = ("coordinate_rates", "residual")

    def __init__(self, parts: Array, residual: float):
        self.coordinate_rates, self.residual = parts, residual


def fast_position(setup: PreparedMechanism, z: Array) -> FastPosition | None:
    """The position with its rates (coordinates, orders), if it is surely sound."""
    judged = setup.acceptance
    if judged is None:
        return None
    s = setup.inputs
    parts, verdict, _, _ = judged.position(z, s.u1, s.u, s.u1, s.u2, s.p, setup.row_scale, setup.min_column_scale)
    told = judged.result(verdict[0].tolist())
    passed = _is_accepted(setup, told) and told.regularity >= MIN_FAST_REGULARITY
    return FastPosition(parts.T, told.residual) if passed else None


def is_surely_regular(setup: PreparedMechanism, z: Array) -> bool:
    """Whether every block is surely determined at a position."""
    if setup.acceptance is None:
        return False
    s = setup.inputs
    regularity = setup.acceptance.regularity(z, s.u, s.p, setup.row_scale, setup.min_column_scale)[0]
    return bool(regularity[0, 0] >= MIN_FAST_REGULARITY)


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
        many = ((before, after), (0, 0), (0, 0))
        return FastSamples(np.pad(self.coordinate_rates, many), np.pad(self.is_sure, many[0]), self.residual)

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
    """What a run in compiled functions needs of a solver."""

    functions: EquationFunctions
    inputs: PositionInputs

    @property
    def acceptance(self) -> AcceptanceFunctions | None:
        """What judges positions in compiled functions."""

    @property
    def stops(self) -> PairStops | None:
        """The stops of its pairs, if it has any."""

    def stop_positions(self, z: Array, u: Array) -> Array:
        """The positions of the pairs that have stops (stops,), or (stops, rows)."""

    @property
    def tolerance(self) -> float:
        """What the residual check lets pass."""

    @property
    def row_scale(self) -> Array:
        """What every row of a Jacobian is divided by (rows,)."""

    @property
    def min_column_scale(self) -> Array:
        """What the column of every unknown could be at best (unknowns,)."""


class FastRun(NamedTuple):
    """The first rows of a run, all of them surely sound: unknowns (rows, unknowns), coordinates with their rates (rows,
    3, coordinates), and what the worst constraint leaves open."""

    z: Array
    coordinate_rates: Array
    residual: float


def fast_run(setup: FastSolver, z: Array, u: Array, u1: Array, u2: Array) -> FastRun | None:
    """A run along a straight way of inputs (rows, inputs) with rates u1, u2 from the unknowns of its first row, as far
    as it is surely sound: both checks, rates, contacts. None for what is no such run."""
    judged, p = setup.acceptance, setup.inputs.p
    if judged is None or not u.size:
        return None
    steps = u[1:] - u[:-1]
    sizes = np.abs(steps).max(axis=1, initial=0.0)
    most = int(np.argmax(sizes))
    axis = steps[most] / sizes[most] if sizes[most] > 0.0 else np.ones(u.shape[1])
    square = float(axis @ axis)
    gone = steps @ axis / square
    if np.abs(steps - gone[:, None] * axis).max(initial=0.0) > STRAIGHT_TOLERANCE:
        return None
    found = np.concatenate([z[None], setup.functions.run_samples(z, u[1:], p)])
    settled, parts, verdict, ways, distances = judged.corrected_position.evaluate_batch(
        len(u), found, axis, u, u1, u2, p, setup.row_scale, setup.min_column_scale
    )
    settled = settled[:, 0]
    told = judged.result(verdict[:, 0].T)
    # what is not a number is not below anything
    fine = told.residual <= setup.tolerance
    fine &= np.isfinite(told.finite_sum)
    fine &= np.maximum(told.velocity_error, told.acceleration_error) <= 1e3 * setup.tolerance
    fine &= told.contact_gap <= CONTACT_TOLERANCE
    fine &= told.regularity >= MIN_FAST_REGULARITY
    fine &= EPS * told.rounding_amplification <= NEGLIGIBLE_ERROR
    if z.size:
        with np.errstate(invalid="ignore", over="ignore"):
            fine[1:] &= _keeps_branch(judged.block_starts, settled, gone, ways[:, 0], distances[:, 0], square)
    if setup.stops is not None:
        from planar.solving.stops import MAX_SURE_MOVE  # few mechanisms have stops

        fine &= setup.stops.sure_rows(setup.stop_positions(settled, u), settled)
        fine[1:] &= sizes <= MAX_SURE_MOVE
    many = len(fine) if fine.all() else int(np.argmin(fine))
    return FastRun(settled[:many], parts[:many], float(told.residual[:many].max(initial=0.0)))


def _is_accepted(setup: PreparedMechanism, verdict: AcceptanceResult[float]) -> bool:
    tolerance = setup.tolerance
    return (
        verdict.residual <= tolerance
        and isfinite(verdict.finite_sum)
        and verdict.velocity_error <= 1e3 * tolerance
        and verdict.acceleration_error <= 1e3 * tolerance
        and verdict.contact_gap <= CONTACT_TOLERANCE
        and EPS * verdict.rounding_amplification <= NEGLIGIBLE_ERROR
    )


def _keeps_branch(starts: IntArray, z: Array, gone: Array, rates: Array, distances: Array, square: float) -> BoolArray:
    """For each step of a run whether it keeps to its branch; see `branch`.

    Steps have `gone` (steps,) along the axis of the inputs; rates `ways` (rows, unknowns) and distances (rows, blocks)
    are along it too, with the signs of the blocks' determinants.
    """
    step = gone[:, None]
    before, after = rates[:-1] * step, rates[1:] * step
    turns = np.add.reduceat(before * after, starts, axis=1).min(axis=1) + gone * gone * square
    far = np.abs(distances)
    safe = (far[:-1] + far[1:]).min(axis=1) > SINGULAR_DISTANCE_RATIO * np.abs(gone)
    safe &= (np.signbit(distances[:-1]) == np.signbit(distances[1:])).all(axis=1)
    return (turns >= 0.0) & safe & is_move_allowed(z[1:] - z[:-1], before, after).all(axis=1)


class StraightPathCache:
    """Positions at even distances along straight ways that lead away from one position, each made when it is needed.

    They depend on that position and the way alone, so that what is found by them does not depend on what was asked for
    before.
    """

    def __init__(self, setup: PreparedMechanism, z: Array):
        self.setup, self.z, self.start = setup, z, setup.inputs.u
        self.max_positions = max(MAX_STORED_NUMBERS // max(len(z), 1), MIN_STORED_POSITIONS)
        self._kept: dict[tuple[float, ...], dict[int, Array | None]] = {}

    def unknowns_at(self, stop: Array) -> Array | None:
        """The unknowns to which the straight way to other inputs leads; None where not all of it is surely sound."""
        if self.setup.acceptance is None or self.setup.stops is not None:
            return None
        way = stop - self.start
        reach = max(map(abs, way.tolist()), default=0.0)
        if reach == 0.0:
            return self.z
        many = int(reach / STEP_LENGTH)
        if not many <= self.max_positions:
            return None
        axis = way / reach
        key = tuple(axis.tolist())
        kept = self._kept.get(key)
        if kept is None:
            if len(self._kept) >= MAX_DIRECTIONS:
                self._kept.clear()
            kept = self._kept[key] = {0: self.z}
        known = many
        while known not in kept:
            known -= 1
        for k in range(known, many):
            z = kept[k]
            if z is None:
                return None
            kept[k + 1] = self._take_step(z, self.start + k * STEP_LENGTH * axis, STEP_LENGTH * axis)
        z, here = kept[many], self.start + many * STEP_LENGTH * axis
        return None if z is None else self._take_step(z, here, stop - here)

    def _take_step(self, z: Array, u: Array, step: Array) -> Array | None:
        judged = self.setup.acceptance
        assert judged is not None
        after, verdict = judged.step_check(z, u, step, self.setup.inputs.p)
        told = judged.step_result(verdict[0].tolist())
        passed = (
            told.residual <= self.setup.tolerance
            and isfinite(told.finite_sum)
            and told.deviation <= 1.0
            and told.forward_product >= 0.0
            and told.regular_distance > MIN_SINGULAR_DISTANCE_RATIO
            and told.least_singular_value > MIN_SINGULAR_VALUE
        )
        return after[0] if passed else None
