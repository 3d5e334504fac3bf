"""From one position to others along the branch on which it lies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import chain, pairwise

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, TrackingEnd
from planar.solving.continuation.fast_path import STRAIGHT_TOLERANCE, fast_run
from planar.solving.continuation.path_pieces import PathPiece, Period, PeriodSearch, path_pieces
from planar.solving.continuation.predictor_corrector import (
    ArcBudget,
    CurveTracker,
    NearbyBifurcation,
    PassedBifurcation,
)
from planar.solving.continuation.run_samples import (
    BranchRates,
    InputRates,
    RunSamples,
    resting_inputs,
    unjudged_rows,
)
from planar.solving.prepared_mechanism import PreparedMechanism

MIN_WINDOW = 8
"""Samples that are tried at once where none has passed before."""
MAX_SAMPLES_AHEAD = 1000
"""Samples that one trip is to come to at most."""
STOP_ROUNDING = 1e-11
"""rad or sizes: a place that is no farther beyond a stop is at it."""


class PathFollower:
    """Goes along a straight path of the inputs to its first dead point, and tells the unknowns at places in their
    order.

    The path is one on which the fastest input goes one rad or size a unit.
    """

    def __init__(
        self,
        solver: PreparedMechanism,
        z: Array,
        start: Array,
        direction: Array,
        branches: Sequence[int] = (),
        budget: ArcBudget | None = None,
    ):
        speed = float(np.max(np.abs(direction), initial=0.0)) or 1.0
        self.tracker = CurveTracker(solver, z, start, direction / speed, branches, budget)
        self._pieces, self._period_search = path_pieces(self.tracker), PeriodSearch(self.tracker)
        self._piece: PathPiece | None = None
        self._period: Period | None = None
        self._reached = 0.0

    def has_position(self, position: float) -> bool:
        """Whether a place lies on what has been followed already."""
        return self._piece is not None and (position <= self._piece.stop or self._period is not None)

    @property
    def last_position(self) -> tuple[Array, Array] | None:
        """Unknowns and inputs of the last position before that; where a slide goes out without an end, of one well out.
        None where it has been beyond that already."""
        point = self.tracker.point
        if self.tracker.ending is TrackingEnd.ENDLESS:
            point = self.tracker.far_point or point
            if point.y[-1] <= self._reached:
                return None
        return point.y[:-1], self.tracker.curve.inputs(point.y)

    def unknowns_at(self, position: float) -> tuple[Array, BranchRates | None] | None:
        """The unknowns so far along the path, with rates where the Jacobian is singular; None if it ends before."""
        tracker, piece = self.tracker, self._piece
        while piece is None or not self.has_position(position):
            if tracker.ending is TrackingEnd.DEAD_POINT:
                return None
            following = next(self._pieces, None)
            if following is None:
                if tracker.ending is TrackingEnd.STOP and piece and position <= piece.stop + STOP_ROUNDING:
                    break
                if tracker.limit is not None and position < tracker.limit:
                    tracker.limit, tracker.ending = None, TrackingEnd.OUT_OF_RANGE
                return None
            piece = self._piece = following
            self._period = self._period_search.period_after(piece)
            if piece.dead_point is not None:
                tracker.point, tracker.ending = piece.dead_point, TrackingEnd.DEAD_POINT
        self._reached = position
        if self._period is not None and position > piece.stop:
            return self._period.unknowns_at(tracker.curve, position)
        return piece.unknowns_at(tracker.curve, position)

    def bifurcations_until(self, last: float) -> tuple[PassedBifurcation, ...]:
        """The change points passed up to a place that it has come to."""
        return self.tracker.passed_until(last) if self._period is None else (*self._period.bifurcations_until(last),)


def follow_to(solver: PreparedMechanism, z: Array, start: Array, stop: Array) -> Array:
    """The unknowns at inputs `stop`; see `follow_straight`."""
    return follow_straight(solver, z, start, stop).z[-1]


def follow_straight(solver: PreparedMechanism, z: Array, start: Array, stop: Array) -> RunSamples:
    """The unknowns at inputs `start` and `stop`, followed along the straight line between them.

    Smoothly through change points. Raises NoAnswer where a dead point is on the way, or the branch cannot be followed.
    """
    inputs = resting_inputs(np.stack([start, stop]))
    if np.array_equal(start, stop):
        return unjudged_rows(solver, np.stack([z, z]), inputs)
    run = _SamplesFollower(solver, z, inputs).follow(is_quick=False)
    if run.stopped is not None:
        raise run.stopped
    return run


def follow_samples(
    solver: PreparedMechanism,
    z: Array,
    inputs: InputRates,
    branches: Sequence[int] = (),
    budget: ArcBudget | None = None,
) -> RunSamples:
    """A run of inputs, from the unknowns of its first sample as far as the motion comes.

    The whole run is computed block after block, each at all samples; every sample then passes both checks, and from
    one that does not the general path goes on until the quick one can take over again. What the general path does is
    counted in `budget`.
    """
    return _SamplesFollower(solver, z, inputs, branches, budget).follow()


class _SamplesFollower:
    """A run that is followed: what is known of its samples, and the general path where it is needed."""

    def __init__(
        self,
        solver: PreparedMechanism,
        z: Array,
        inputs: InputRates,
        branches: Sequence[int] = (),
        budget: ArcBudget | None = None,
    ):
        self.solver, self.branches, self.budget = solver, branches, budget or ArcBudget()
        self.run = unjudged_rows(solver, np.empty((len(inputs.u), z.size)), inputs)
        self.z, self.u = self.run.z, inputs.u
        self.z[0] = z
        self.residual = 0.0
        self.branch_rates: dict[int, BranchRates] = {}
        self.passed: list[PassedBifurcation] = []
        self.nearby: list[NearbyBifurcation] = []
        self.follower: PathFollower | None = None
        self._places: Iterator[tuple[float, float]] = iter(())
        "those of the next samples on the follower's path, each with the one after it"
        self._passed_before = 0

    def follow(self, is_quick: bool = True) -> RunSamples:
        """All samples, as far as the motion comes; by the general path alone where `is_quick` is not set."""
        samples = window = len(self.u)
        done, stopped = 1, None
        while done < samples and stopped is None:
            first, last = done, min(done + window, samples)
            if is_quick:
                done = self._follow_quickly(slice(done - 1, last))
            # of what comes after a sample that did not pass no more is tried than has passed before
            window = max(MIN_WINDOW, 2 * (done - first))
            if done > first:
                self._places = iter(())
            if done < last:
                done, stopped = self._follow_general(done)
        rows = slice(done)
        return RunSamples(
            self.z[rows],
            self.run.inputs.select(rows),
            self.run.coordinate_rates[rows],
            self.run.is_sure[rows],
            self.residual,
            branch_rates=self.branch_rates,
            passed=tuple(self.passed),
            nearby=(*self.nearby, *(self.follower.tracker.nearby if self.follower is not None else ())),
            stopped=stopped,
            last_position=None if stopped is None or self.follower is None else self.follower.last_position,
        )

    def _follow_quickly(self, rest: slice) -> int:
        """Fill in the samples after the first of the `rest` in one call, as far as they pass both checks; how many are
        known then. Of a first one on a change point more is known than can be read off its Jacobian."""
        first, on_branch = rest.start, int(rest.start in self.branch_rates)
        run = fast_run(self.solver, self.z[first], self.run.inputs.select(rest))
        if run is None or not len(run.z):
            return int(first) + 1
        rows = slice(first + on_branch, first + len(run.z))
        self.z[rows], self.run.is_sure[rows] = run.z[on_branch:], run.is_sure[on_branch:]
        self.run.coordinate_rates[rows] = run.coordinate_rates[on_branch:]
        self.residual = max(self.residual, run.residual)
        return int(rows.stop)

    def _follow_general(self, done: int) -> tuple[int, NoAnswer | None]:
        """Samples from one on by the general path, until the quick one can be tried again: how many are known
        then, and why there are no more."""
        at_once = next(self._places, None)
        if self.follower is None or at_once is None:
            self.follower, at_once = self._start_follower(done)
        follower, place, stopped = self.follower, at_once[0], None
        for place, following in chain([at_once], self._places):
            position = follower.unknowns_at(place)
            if position is None:
                stopped = follower.tracker.end_refusal()
                break
            self.z[done], rates = position
            if rates is not None:
                self.branch_rates[done] = rates
            done += 1
            if rates is None and not follower.has_position(following):
                break
        self.passed[self._passed_before :] = follower.bifurcations_until(place)
        return done, stopped

    def _start_follower(self, done: int) -> tuple[PathFollower, tuple[float, float]]:
        """A follower from the last sample known on, and the first place to which it is to come."""
        if self.follower is not None:
            self.nearby += self.follower.tracker.nearby
        base = done - 1
        while base and base in self.branch_rates and self._turns_back(base, done):
            base -= 1  # what turns back on a change point comes back by the branch on which it came
        ahead = np.vstack([self.u[base], self.u[done : done + MAX_SAMPLES_AHEAD]])
        direction, places = _straight_places(ahead)
        branches = self.branches[len(self.passed) :] if direction.any() else ()
        follower = PathFollower(self.solver, self.z[base], self.u[base], direction, branches, self.budget)
        self._places, self._passed_before = pairwise([*places, np.inf]), len(self.passed)
        if follower.tracker.starts_on_bifurcation and base == done - 1:
            start = follower.unknowns_at(0.0)
            assert start is not None
            z, rates = start
            assert rates is not None
            self.z[base], self.branch_rates[base] = z, rates
        return follower, next(self._places)

    def _turns_back(self, base: int, done: int) -> bool:
        """Whether the inputs go back after a sample on a change point."""
        return bool((self.u[done] - self.u[done - 1]) @ self.branch_rates[base].input_direction < 0.0)


def _straight_places(u: Array) -> tuple[Array, list[float]]:
    """The direction from the first of these inputs (samples, inputs) towards the next, and the places of those that lie
    on the same straight line, as far as they go on."""
    distances = np.max(np.abs(u - u[0]), axis=1, initial=0.0)
    direction = u[int(np.argmax(distances > 0.0))] - u[0]
    speed = float(np.max(np.abs(direction), initial=0.0))
    if speed == 0.0:
        return direction, [0.0]
    axis = direction / speed
    along = (u[1:] - u[0]) @ axis / float(axis @ axis)
    is_aside = np.max(np.abs(u[1:] - u[0] - along[:, None] * axis), axis=1) > STRAIGHT_TOLERANCE
    leaves = is_aside | (np.diff(along, prepend=0.0) < 0.0)
    return direction, along[: int(np.argmax(leaves)) if leaves.any() else len(along)].tolist()
