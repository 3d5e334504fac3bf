"""From one position to others along the branch on which it lies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, TrackingEnd
from planar.solving.continuation.fast_path import STRAIGHT_TOLERANCE, FastSamples, FastSolver, fast_run
from planar.solving.continuation.path_pieces import (
    BranchRates,
    PathBifurcation,
    PathPiece,
    bifurcations_until,
    path_pieces,
)
from planar.solving.continuation.period import Period, PeriodSearch
from planar.solving.continuation.predictor_corrector import ArcBudget, CurveTracker, NearbyBifurcation
from planar.solving.continuation.solution_curve import CurvePoint, CurveSolver

MIN_WINDOW = 8
"""Samples that are tried at once where none has passed before."""
MAX_SAMPLES_AHEAD = 1000
"""Samples that one trip is to come to at most."""


STOP_ROUNDING = 1e-11
"""rad or sizes: a place that is no farther beyond a stop is at it."""


class PathSolver(CurveSolver, FastSolver, Protocol):
    """What following needs of a solver beyond that."""

    def end_refusal(self, u: Array, point: CurvePoint, ending: TrackingEnd) -> NoAnswer:
        """What to say of a motion that ends at inputs u, and went as far as a point."""


class FollowedSamples(NamedTuple):
    """Unknowns at every sample that was reached (samples, unknowns), how many of them the general path had to solve,
    and why the rest was not reached, if not, with the last unknowns and inputs before that.

    `local` are rates by sample where the Jacobian is singular; `met` the change points passed, `missed` those near by.
    """

    z: Array
    general_count: int
    stopped: NoAnswer | None = None
    last_position: tuple[Array, Array] | None = None
    branch_rates: Mapping[int, BranchRates] = MappingProxyType({})
    passed: tuple[PathBifurcation, ...] = ()
    nearby: tuple[NearbyBifurcation, ...] = ()
    fast_samples: FastSamples | None = None


class PathFollower:
    """Goes along a straight way of the inputs to its first dead point, and tells the unknowns at places in their order.

    The way is one in which the fastest input goes one rad or size a unit.
    """

    def __init__(
        self,
        solver: PathSolver,
        p: Array,
        z: Array,
        start: Array,
        way: Array,
        branches: Sequence[int] = (),
        work: ArcBudget | None = None,
    ):
        reach = float(np.max(np.abs(way), initial=0.0)) or 1.0
        self.tracker = CurveTracker.from_position(solver, p, (z, start), way / reach, branches, work)
        self.curve = self.tracker.curve
        self.point = self.tracker.point
        self.dead_point: CurvePoint | None = None
        self._pieces, self._period_search = path_pieces(self.tracker), PeriodSearch(self.tracker)
        self._piece: PathPiece | None = None
        self._period: Period | None = None
        self._wanted = self._reached = 0.0

    def has_position(self, position: float) -> bool:
        """Whether a place lies on what has been followed already."""
        return self._piece is not None and (position <= self._piece.stop or self._period is not None)

    @property
    def end_inputs(self) -> tuple[Array, TrackingEnd]:
        """The inputs beyond which it does not go, and why."""
        if self.dead_point is not None:
            return self.curve.inputs(self.dead_point.y), TrackingEnd.DEAD_POINT
        if self.tracker.limit is not None and self._wanted < self.tracker.limit:
            return self.curve.inputs(self.point.y), TrackingEnd.OUT_OF_RANGE
        return self.tracker.end_inputs

    @property
    def last_position(self) -> tuple[Array, Array] | None:
        """Unknowns and inputs of the last position before that; where a slide goes out without an end, of one well out.
        None where it has been beyond that already."""
        here = self.point
        if self.end_inputs[1] is TrackingEnd.ENDLESS:
            here = self.tracker.far_point or here
            if here.y[-1] <= self._reached:
                return None
        return here.y[:-1], self.curve.inputs(here.y)

    @property
    def start_position(self) -> tuple[Array, BranchRates]:
        """The unknowns where it starts on a change point by a way that was asked for, with their rates along it."""
        found = self.unknowns_at(0.0)
        assert found is not None
        assert found[1] is not None
        return found[0], found[1]

    def unknowns_at(self, position: float) -> tuple[Array, BranchRates | None] | None:
        """The unknowns so far along the way, with rates where the Jacobian is singular; None if it ends before."""
        self._wanted = position
        while self._piece is None or not self.has_position(position):
            if self.dead_point is not None:
                return None
            before, self._piece = self._piece, next(self._pieces, None)
            if self._piece is None:
                at_stop = before is not None and self.tracker.ending is TrackingEnd.STOP
                if not at_stop or before is None or position > before.stop + STOP_ROUNDING:
                    return None
                self._piece = before
                break
            self.dead_point = self._piece.dead_point
            self.point = self.dead_point or self._piece.arc.after
            self._period = self._period_search.period_after(self._piece)
        self._reached = position
        if self._period is not None and position > self._piece.stop:
            return self._period.unknowns_at(self.curve, position)
        return self._piece.unknowns_at(self.curve, position)

    def bifurcations_until(self, last: float) -> tuple[PathBifurcation, ...]:
        """The change points passed up to a place that it has come to."""
        return (
            bifurcations_until(self.tracker, last)
            if self._period is None
            else tuple(self._period.bifurcations_until(self.curve, last))
        )


def follow_to(solver: PathSolver, p: Array, z: Array, start: Array, stop: Array) -> Array:
    """The unknowns at inputs `stop`; see `follow_straight`."""
    return follow_straight(solver, p, z, start, stop).z[-1]


def follow_straight(solver: PathSolver, p: Array, z: Array, start: Array, stop: Array) -> FollowedSamples:
    """The unknowns at inputs `start` and `stop`, followed along the straight line between them.

    Smoothly through change points. Raises NoAnswer where a dead point is on the way, or the branch cannot be followed.
    """
    way = stop - start
    reach = float(np.max(np.abs(way), initial=0.0))
    if reach == 0.0:
        return FollowedSamples(np.stack([z, z]), 0)
    trip = PathFollower(solver, p, z, start, way)
    found = trip.unknowns_at(reach)
    if found is None:
        raise path_end_refusal(solver, trip)
    local = {} if found[1] is None else {1: found[1]}
    return FollowedSamples(
        np.stack([z, found[0]]), 1, None, None, local, trip.bifurcations_until(reach), tuple(trip.tracker.nearby)
    )


def follow_samples(
    solver: PathSolver,
    p: Array,
    z: Array,
    u: Array,
    branches: Sequence[int] = (),
    rates: tuple[Array, Array] | None = None,
    budget: ArcBudget | None = None,
) -> FollowedSamples:
    """The unknowns at every sample of a run of inputs u (samples, inputs), from those of the first.

    The whole run is computed block after block, each at all samples; every sample then passes both checks, and from
    one that does not the general path goes on until the quick one can take over again. With first and second
    `rates` of the inputs the run tells those of its samples as well, so far as they are surely sound. What the general
    path does is counted in `work`.
    """
    return _SamplesFollower(solver, p, (z, u), branches, rates, budget or ArcBudget()).follow()


class _SamplesFollower:
    """A run that is followed: what is known of its samples, and the general path where it is needed."""

    def __init__(
        self,
        solver: PathSolver,
        p: Array,
        run: tuple[Array, Array],
        branches: Sequence[int],
        rates: tuple[Array, Array] | None,
        budget: ArcBudget,
    ):
        z, self.u = run
        self.solver, self.p, self.branches, self.rates, self.budget = solver, p, branches, rates, budget
        self.z = np.empty((len(self.u), z.size))
        self.z[0] = z
        self.general_count = 0
        self.branch_rates: dict[int, BranchRates] = {}
        self.passed: list[PathBifurcation] = []
        self.nearby: list[NearbyBifurcation] = []
        self.fast_samples = _FastSamplesBuffer(solver, len(self.u)) if rates is not None else None
        self.follower: PathFollower | None = None
        self._places: Iterator[tuple[float, float]] = iter(())
        "those of the next samples on the follower's way, each with the one after it"
        self._passed_before = 0

    def follow(self) -> FollowedSamples:
        """All samples, as far as the motion comes."""
        samples = window = len(self.u)
        done, stopped = 1, None
        while done < samples and stopped is None:
            first, last = done, min(done + window, samples)
            run, rest = (self.z, self.u), slice(done - 1, last)
            beside = done - 1 in self.branch_rates
            done = _solve_quickly(self.solver, run, rest, self.rates, self.fast_samples, beside)
            # of what comes after a sample that did not pass no more is tried than has passed before
            window = max(MIN_WINDOW, 2 * (done - first))
            if done > first:
                self._places = iter(())
            if done < last:
                done, stopped = self._follow_general(done)
        last_position = None if stopped is None or self.follower is None else self.follower.last_position
        nearby = (*self.nearby, *(self.follower.tracker.nearby if self.follower is not None else ()))
        known = self.fast_samples.first_samples(done) if self.fast_samples is not None else None
        z, passed = self.z[:done], tuple(self.passed)
        return FollowedSamples(z, self.general_count, stopped, last_position, self.branch_rates, passed, nearby, known)

    def _follow_general(self, done: int) -> tuple[int, NoAnswer | None]:
        """Samples from one on by the general path, until the quick one can be tried again: how many are known
        then, and why there are no more."""
        at_once = next(self._places, None)
        if self.follower is None or at_once is None:
            self.follower, at_once = self._start_follower(done)
        follower, place, stopped = self.follower, at_once[0], None
        for place, following in chain([at_once], self._places):
            at = follower.unknowns_at(place)
            if at is None:
                stopped = path_end_refusal(self.solver, follower)
                break
            self.z[done], rates = at
            if rates is not None:
                self.branch_rates[done] = rates
            done, self.general_count = done + 1, self.general_count + 1
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
        branches = self.branches[len(self.passed) :]
        follower, places = _straight_follower(self.solver, self.p, self.z[base], ahead, branches, self.budget)
        self._places, self._passed_before = pairwise([*places, np.inf]), len(self.passed)
        if follower.tracker.starts_on_bifurcation and base == done - 1:
            self.z[base], self.branch_rates[base] = follower.start_position
        return follower, next(self._places)

    def _turns_back(self, base: int, done: int) -> bool:
        """Whether the inputs go back after a sample on a change point."""
        return bool((self.u[done] - self.u[done - 1]) @ self.branch_rates[base].input_direction < 0.0)


class _FastSamplesBuffer:
    """What a run tells of its samples so far."""

    def __init__(self, solver: PathSolver, samples: int):
        many = len(solver.functions.equations.coordinates)
        self.parts, self.sure, self.open = np.empty((samples, 3, many)), np.zeros(samples, dtype=bool), 0.0

    def first_samples(self, samples: int) -> FastSamples:
        """Of its first samples."""
        return FastSamples(self.parts[:samples], self.sure[:samples], self.open)


def _solve_quickly(
    solver: PathSolver,
    samples: tuple[Array, Array],
    rest: slice,
    rates: tuple[Array, Array] | None,
    told: _FastSamplesBuffer | None,
    beside: bool,
) -> int:
    """Fill in unknowns of the samples after the first of the `rest` in one call, as far as they pass both parts of the
    gate; how many are known then. Of a first one `beside` a change point more is known than can be read off its slope.
    """
    (found, u), first = samples, rest.start
    still = np.zeros_like(u[rest])
    run = fast_run(
        solver, found[first], u[rest], *((still, still) if rates is None else (each[rest] for each in rates))
    )
    through = 0 if run is None else len(run.z)
    if run is None or not through:
        return first + 1
    same = slice(first + beside, first + through)
    found[same] = run.z[beside:]
    if told is not None:
        told.parts[same], told.sure[same] = run.coordinate_rates[beside:], run.is_sure[beside:]
        told.open = max(told.open, run.residual)
    return first + through


def _straight_follower(
    solver: PathSolver, p: Array, z: Array, u: Array, branches: Sequence[int], work: ArcBudget
) -> tuple[PathFollower, list[float]]:
    """A trip from the first of these inputs towards the next, and the places of those that lie on the same way."""
    away = np.max(np.abs(u - u[0]), axis=1, initial=0.0)
    way = u[int(np.argmax(away > 0.0))] - u[0]
    reach = float(np.max(np.abs(way), initial=0.0))
    if reach == 0.0:
        return PathFollower(solver, p, z, u[0], way, (), work), [0.0]
    axis = way / reach
    gone = (u[1:] - u[0]) @ axis / float(axis @ axis)
    aside = np.max(np.abs(u[1:] - u[0] - gone[:, None] * axis), axis=1) > STRAIGHT_TOLERANCE
    back = np.diff(gone, prepend=0.0) < 0.0
    off = aside | back
    many = int(np.argmax(off)) if off.any() else len(gone)
    return PathFollower(solver, p, z, u[0], way, branches, work), gone[:many].tolist()


def path_end_refusal(solver: PathSolver, trip: PathFollower) -> NoAnswer:
    """Why a trip goes no further."""
    u, ending = trip.end_inputs
    return solver.end_refusal(u, trip.point, ending)
