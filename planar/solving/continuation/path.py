"""The pieces of a curve of positions, between dead points, up to a stop, over a period; and positions along them."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from functools import partial
from itertools import chain, pairwise
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, greatest_size
from planar.foundation.errors import NoAnswer, Outcome, TrackingEnd
from planar.foundation.root_finding import find_first_passage, find_root, lowest_on_cubic
from planar.solving.continuation.fast_path import (
    STRAIGHT_TOLERANCE,
    BranchRates,
    InputRates,
    RunSamples,
    fast_run,
    unjudged_rows,
)
from planar.solving.continuation.predictor_corrector import (
    END_TOLERANCE,
    SHOWN_SLIDE_EXTENT,
    ArcBudget,
    CurveTracker,
    NearbyBifurcation,
    PassedBifurcation,
)
from planar.solving.continuation.solution_curve import (
    DEAD_POINT_TOLERANCE,
    Arc,
    CurvePoint,
    SolutionCurve,
    input_axis,
    pair_motions_at,
)
from planar.solving.prepared_mechanism import PreparedMechanism
from planar.solving.stops import STOP_TOLERANCE, PairStops

MAX_CORRECTION_RATIO = 0.1
"""A correction longer than this part of an arc has gone astray."""
MAX_PIECES = 1500
"""A curve that is longer, as with wheels of many teeth, is not waited for."""
CLOSED_TOLERANCE = 1e-7
"""rad or sizes: a curve that comes so near to its start, in its direction, is closed."""
ROUNDING_TOLERANCE = 1e-9
MAX_CHECKED_PIECES = 16
"""Pieces whose first points are tried at once, whole turns on."""
MIN_WINDOW = 8
"""Samples that are tried at once where none has passed before."""
MAX_SAMPLES_AHEAD = 1000
"""Samples that one trip is to come to at most."""
STOP_ROUNDING = 1e-11
"""rad or sizes: a place that is no farther beyond a stop is at it."""


class PathPiece(NamedTuple):
    """A part of an arc on which the inputs go in one direction: the places on its axis and those of the inputs at which
    it starts and stops, and the dead point at its end, if one is there."""

    arc: Arc
    first: float
    last: float
    start: float
    stop: float
    dead_point: CurvePoint | None

    def until(self, position: float) -> PathPiece:
        """The part of the piece up to a place of the inputs."""
        x = find_root(lambda x: self.arc.input_position(x) - position, self.first, self.last)
        return self._replace(last=x, stop=position, dead_point=None)

    def unknowns_at(self, curve: SolutionCurve, position: float) -> tuple[Array, BranchRates | None]:
        """The unknowns where the inputs are at a place, with their rates where the Jacobian is singular."""
        arc = self.arc
        if self.dead_point is not None and position == self.stop:
            return self.dead_point.y[:-1], None
        x = find_root(lambda x: arc.input_position(x) - position, self.first, self.last)
        rough = arc.polynomial(x)
        rough[-1] = position
        if arc.is_exact:
            y = curve.correct_beside_bifurcation(rough, arc.rank_loss, with_inputs=False)
            return y[:-1], BranchRates(derivatives_by_input(arc, x), curve.input_direction, arc.rank_loss)
        near = curve.correct(rough, input_axis(len(rough)))
        # beyond a dead point at its end the inputs come to the same positions once more
        low, high = sorted((self.first, self.last))
        slack = STRAIGHT_TOLERANCE * (high - low)
        if (
            near is None
            or np.linalg.norm(near - rough) > MAX_CORRECTION_RATIO * abs(self.last - self.first)
            or not low - slack <= arc.place(near) <= high + slack
            or not curve.is_closed(near)
        ):
            near = arc.curve_coordinates(
                curve, find_root(lambda x: float(arc.curve_coordinates(curve, x)[-1]) - position, self.first, self.last)
            )
        return near[:-1], None


def piece_at(pieces: Sequence[PathPiece], position: float) -> PathPiece:
    """The piece on which the inputs are at a place, of pieces on which they go in one direction."""
    sense = 1.0 if pieces[-1].stop >= pieces[0].start else -1.0
    index = bisect_left(pieces, sense * position, key=lambda piece: sense * piece.stop)
    return pieces[min(index, len(pieces) - 1)]


def path_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
    """The arcs of a curve, parted at dead points, up to the first stop that a pair meets."""
    curve, stops = tracker.curve, tracker.curve.solver.stops
    if stops is None:
        yield from _pieces_by_dead_points(tracker)
        return
    turns = stops.turns(pair_motions_at(stops.pairs, curve, tracker.point)[:, 0])
    for piece in _pieces_by_dead_points(tracker):
        met = _first_stop(curve, stops, turns, piece)
        if met is None:
            yield piece
            continue
        x, tracker.point = met
        stop = piece.start if x == piece.first else float(tracker.point.y[-1])
        arc = piece.arc._replace(after=tracker.point)
        yield piece._replace(arc=arc, last=x, stop=stop, dead_point=None)
        tracker.ending = TrackingEnd.STOP
        return


def _pieces_by_dead_points(tracker: CurveTracker) -> Iterator[PathPiece]:
    """The arcs of a curve, parted at dead points."""
    curve = tracker.curve
    if tracker.point.is_dead_point and tracker.point.curvature[-1] < 0.0:
        point = tracker.point
        yield PathPiece(Arc(point, point, point.y, point.tangent, 1.0, point.y[None], 1), 0.0, 0.0, 0.0, 0.0, point)
    for arc in tracker.arcs():
        (first, last), before = arc.ends, arc.before
        if before.is_dead_point and arc.after.is_dead_point and abs(arc.after.y[-1] - before.y[-1]) < END_TOLERANCE:
            yield PathPiece(arc, first, first, float(before.y[-1]), float(before.y[-1]), before)
            return  # all else moves on while the inputs rest
        while True:
            dead = _find_turning_point(curve, arc, before, first, last)
            if dead is None:
                break
            x = arc.place(dead.y)
            if before is not arc.before and abs(x - first) <= STRAIGHT_TOLERANCE:
                break  # the dead point from which this part starts
            yield PathPiece(arc, first, x, float(before.y[-1]), float(dead.y[-1]), dead)
            first, before = x, dead
        yield PathPiece(arc, first, last, float(before.y[-1]), float(arc.after.y[-1]), None)


def _find_turning_point(
    curve: SolutionCurve, arc: Arc, before: CurvePoint, first: float, last: float
) -> CurvePoint | None:
    """The first dead point on an arc between two places on its axis, at which the inputs turn back, if there is one."""
    g0 = before.input_rate
    # of a dead point that was found on the arc rounding may leave more, on a small curve, than is a rest anywhere
    from_dead = before is not arc.before or before.is_dead_point
    if from_dead:
        g0 = DEAD_POINT_TOLERANCE * float(np.sign(before.curvature[-1]))
    sense = float(np.sign(g0))
    g0, g1 = abs(g0), sense * arc.after.input_rate
    if arc.after.is_dead_point and not from_dead and sense * arc.after.curvature[-1] < 0.0:
        # at its very end, whichever sign rounding gives what is left of the rate
        distance = arc.after.input_rate / abs(float(arc.after.curvature[-1]))
        x = last + sense * distance * float(np.sign(last - first))
        return arc.after if arc.is_exact else arc.point_at(curve, x)
    if g1 > 0.0:
        # between two points that go on the inputs may have gone back in the meantime
        s0, s1, length = sense * before.curvature[-1], sense * arc.after.curvature[-1], abs(last - first)
        if s0 >= 0.0 or s1 <= 0.0:
            return None
        lowest, part = lowest_on_cubic((g0, s0 * length), (g1, s1 * length))
        x = first + part * (last - first)
        if lowest > 0.0 or sense * arc.point_at(curve, x).input_rate > 0.0:
            return None
        last = x
    x = find_root(lambda x: sense * arc.point_at(curve, x).input_rate if x != first else g0, first, last)
    return arc.point_at(curve, x)


def _first_stop(
    curve: SolutionCurve, stops: PairStops, turns: Array, piece: PathPiece
) -> tuple[float, CurvePoint] | None:
    """The first stop on a piece in whose direction the curve runs: where on the axis of its arc, and the point there.

    `turns` are those of the pairs where the curve starts (stops,), rad.
    """
    arc, first, last = piece[:3]
    sense = 1.0 if last >= first else -1.0

    def point_at(x: float) -> CurvePoint:
        known = dict(zip(arc.ends, (arc.before, arc.after), strict=True))
        return known.get(x) or arc.point_at(curve, x)

    def rooms_at(x: float) -> Array:
        """How far lower and upper stops are, with the first derivative by arc length (2, stops, 2)."""
        motions = pair_motions_at(stops.pairs, curve, point_at(x))
        rate = motions[:, 1] / stops.scale
        return np.stack([stops.rooms(motions[:, 0], turns), np.array([rate, -rate])], axis=2)

    def room_at(stop: tuple[int, ...], x: float) -> float:
        return float(rooms_at(x)[stop][0])

    def rate_at(stop: tuple[int, ...], x: float) -> float:
        return sense * float(rooms_at(x)[stop][1])

    before, after = rooms_at(first), rooms_at(last)
    passages: list[float | None] = []
    for stop in np.ndindex(*before.shape[:2]):
        (g0, s0), (g1, s1) = before[stop], after[stop]
        if g0 <= STOP_TOLERANCE and (g0 < -STOP_TOLERANCE or s0 < 0.0 or (s0 == 0.0 and g1 < g0)):
            passages.append(first)  # it stands at the stop, and goes on beyond
        elif np.isfinite(g0):
            passages.append(
                find_first_passage(partial(room_at, stop), partial(rate_at, stop), (first, last), ((g0, s0), (g1, s1)))
            )
    x = min((x for x in passages if x is not None), key=lambda x: abs(x - first), default=None)
    return None if x is None else (x, point_at(x))


def derivatives_by_input(arc: Arc, x: float) -> Array:
    """The first three derivatives of the unknowns by the place of the inputs (3, unknowns), on an exact arc."""
    y1, y2, y3 = (arc.polynomial(x, order) for order in (1, 2, 3))
    t1, t2, t3 = y1[-1], y2[-1], y3[-1]
    # the chain rule, solved for the derivatives of the inverse
    x1 = 1.0 / t1
    x2 = -t2 * x1**3
    x3 = (3.0 * t2**2 / t1 - t3) * x1**4
    return np.array([y1 * x1, y2 * x1**2 + y1 * x2, y3 * x1**3 + 3.0 * y2 * x1 * x2 + y1 * x3])[:, :-1]


class Period(NamedTuple):
    """The pieces from a start to where the curve is back there, what y (n + 1,) has grown by: whole turns, the change
    points passed, and that on which it started."""

    pieces: tuple[PathPiece, ...]
    growth: Array
    passed: tuple[PassedBifurcation, ...]
    started: tuple[PassedBifurcation, ...]

    @property
    def length(self) -> float:
        """How far the inputs go in it (rad)."""
        return float(self.growth[-1])

    def unknowns_at(self, curve: SolutionCurve, position: float) -> tuple[Array, BranchRates | None]:
        """The unknowns where the inputs are at a place beyond the start, with rates as `PathPiece.unknowns_at` has
        them."""
        times = float(np.floor(position / self.length))
        within = position - times * self.length
        z, branch_rates = piece_at(self.pieces, within).unknowns_at(curve, within)
        z = z + times * self.growth[:-1]
        if branch_rates is None:
            # where many turns are counted, rounding of the place is more than that of the unknowns
            y = curve.correct(np.append(z, position), input_axis(len(z) + 1))
            z = z if y is None else y[:-1]
        return z, branch_rates

    def bifurcations_until(self, last: float) -> Iterator[PassedBifurcation]:
        """The change points passed up to a place of the inputs."""
        yield from self.started
        if not self.passed:
            return  # however many turns there are
        for times in range(int((last + END_TOLERANCE) / self.length) + 1):
            for passed in self.passed:
                if passed.bifurcation.y[-1] + times * self.length <= last + END_TOLERANCE:
                    yield passed._replace(u=passed.u + times * self.length * passed.input_direction)


class PeriodicPieces:
    """The pieces of a curve one after the other, and its period once these have come back to the start.

    Periods are looked for where one input turns, and the curve goes on smoothly through change points.
    """

    def __init__(self, tracker: CurveTracker):
        self.tracker, self.start = tracker, tracker.point
        self.period: Period | None = None
        self._following, self._pieces = path_pieces(tracker), list[PathPiece]()
        turns_alone = tracker.is_periodic[-1] and np.count_nonzero(tracker.curve.input_direction) <= 1
        self._may_close = turns_alone and not tracker.branches

    def __iter__(self) -> Iterator[PathPiece]:
        return self

    def __next__(self) -> PathPiece:
        piece = next(self._following)
        self._may_close &= piece.dead_point is None and len(self._pieces) < MAX_PIECES
        self.period = self._period_until(piece) if self._may_close else None
        return piece

    def _period_until(self, piece: PathPiece) -> Period | None:
        """The period, if this next piece is its last."""
        self._pieces.append(piece)
        closing = closing_piece(self.tracker, piece, self.start)
        if closing is None or not closing[0].stop > ROUNDING_TOLERANCE:
            return None
        last, growth = closing
        passages = self.tracker.passed_until(growth[-1])
        passed = tuple(passage for passage in passages if passage.bifurcation.y[-1] > END_TOLERANCE)
        started = tuple(passage for passage in self.tracker.passed if passage.is_start)
        period = Period((*self._pieces[:-1], last), growth, passed, started)
        return period if self._is_closed(period) else None

    def _is_closed(self, period: Period) -> bool:
        """Whether all of it, not its start alone, is closed full turns on: where angles count turns it need not be."""
        solver = self.tracker.curve.solver
        pieces = period.pieces[:: max(1, len(period.pieces) // MAX_CHECKED_PIECES)]
        y = np.array([piece.arc.before.y for piece in pieces if not piece.arc.is_exact]) + period.growth
        residuals = solver.max_residuals(y[:, :-1], self.tracker.curve.inputs(y))
        return bool(np.all(residuals <= solver.tolerance))


def closing_piece(tracker: CurveTracker, piece: PathPiece, start: CurvePoint) -> tuple[PathPiece, Array] | None:
    """The piece up to a start, whole turns on, if that lies on it and the curve goes on from there as it did; and these
    turns (n + 1,)."""
    curve, arc = tracker.curve, piece.arc
    begin, end = arc.ends
    growth = _whole_turns(tracker, arc.after.y, start)
    target = start.y + growth
    # by the whole arc, to whose end that is: a piece before a dead point may be a small part of it
    if float(np.linalg.norm(arc.after.y - target)) > 2.0 * abs(end - begin) + CLOSED_TOLERANCE:
        return None
    x, (low, high) = arc.place(target), sorted((piece.first, piece.last))
    if not low - ROUNDING_TOLERANCE <= x <= high + ROUNDING_TOLERANCE:
        return None
    point = arc.point_at(curve, x)
    is_back = np.linalg.norm(point.y - target) <= CLOSED_TOLERANCE and point.tangent @ start.tangent >= 0.5
    if not is_back or not curve.is_closed(target):
        return None
    return PathPiece(arc, piece.first, x, piece.start, float(target[-1]), None), growth


def _whole_turns(tracker: CurveTracker, y: Array, start: CurvePoint) -> Array:
    """The whole turns (n + 1,) by which the start comes nearest to y."""
    turns: Array = np.where(tracker.is_periodic, np.round((y - start.y) / (2.0 * np.pi)), 0.0)
    return 2.0 * np.pi * turns


class ClosedCircuit(NamedTuple):
    """The pieces of a closed curve in their order, and whether it starts in a dead point."""

    pieces: tuple[PathPiece, ...]
    starts_at_dead_point: bool

    @property
    def branches(self) -> tuple[tuple[PathPiece, ...], ...]:
        """Its parts between dead points."""
        return split_at_dead_points(self.pieces)


def split_at_dead_points(pieces: Iterable[PathPiece]) -> tuple[tuple[PathPiece, ...], ...]:
    """The pieces of a curve in their order, by branch: the input goes in one direction on each."""
    branches: list[list[PathPiece]] = [[]]
    for piece in pieces:
        branches[-1].append(piece)
        if piece.dead_point is not None:
            branches.append([])
    return tuple(tuple(branch) for branch in branches if branch and branch[0].start != branch[-1].stop)


def moving_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
    """The pieces of a curve on which something moves."""
    return (piece for piece in path_pieces(tracker) if piece.first != piece.last)


def is_endless(tracker: CurveTracker, piece: PathPiece) -> bool:
    """Whether the input slides on so far at a piece's end that it is not followed further."""
    return not tracker.is_periodic[-1] and abs(piece.stop) > SHOWN_SLIDE_EXTENT


def follow_circuit(tracker: CurveTracker) -> ClosedCircuit:
    """The circuit from where a tracker stands. Raises NoAnswer where it is not found to close."""
    start = tracker.point
    pieces: list[PathPiece] = []
    for piece in moving_pieces(tracker):
        if len(pieces) > 1:
            dead = piece.dead_point
            if dead is not None and start.is_dead_point:
                gap = dead.y - start.y - _whole_turns(tracker, dead.y, start)
                if np.linalg.norm(gap) < CLOSED_TOLERANCE:
                    return ClosedCircuit((*pieces, piece), True)
            closing = closing_piece(tracker, piece, start)
            if closing is not None:
                return ClosedCircuit((*pieces, closing[0]), start.is_dead_point)
        pieces.append(piece)
        problem = f"the motion does not come back within {MAX_PIECES} arcs" if len(pieces) > MAX_PIECES else ""
        if is_endless(tracker, piece):
            problem = "the input slides on without an end"
        if problem:
            remedy = "name where the range starts and stops instead of the circuit"
            raise NoAnswer(Outcome.BRANCH_LOST, f"{problem}; {remedy}")
    raise tracker.end_refusal()


class PathFollower:
    """Follows a straight path of the inputs to its first dead point, and returns the unknowns at places in their order.

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
        speed = greatest_size(direction) or 1.0
        self.tracker = CurveTracker(solver, z, start, direction / speed, branches, budget)
        self._pieces = PeriodicPieces(self.tracker)
        self._piece: PathPiece | None = None
        self._reached = 0.0

    def has_position(self, position: float) -> bool:
        """Whether a place lies on what has been followed already."""
        return self._piece is not None and (position <= self._piece.stop or self._pieces.period is not None)

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
            if piece.dead_point is not None:
                tracker.point, tracker.ending = piece.dead_point, TrackingEnd.DEAD_POINT
        self._reached = position
        if self._pieces.period is not None and position > piece.stop:
            return self._pieces.period.unknowns_at(tracker.curve, position)
        return piece.unknowns_at(tracker.curve, position)

    def bifurcations_until(self, last: float) -> tuple[PassedBifurcation, ...]:
        """The change points passed up to a place that it has come to."""
        period = self._pieces.period
        return self.tracker.passed_until(last) if period is None else (*period.bifurcations_until(last),)


def follow_to(solver: PreparedMechanism, z: Array, start: Array, stop: Array) -> Array:
    """The unknowns at inputs `stop`; see `follow_straight`."""
    return follow_straight(solver, z, start, stop)[0]


def follow_straight(
    solver: PreparedMechanism, z: Array, start: Array, stop: Array
) -> tuple[Array, tuple[PassedBifurcation, ...], list[NearbyBifurcation]]:
    """The unknowns at inputs `stop`, followed along the straight line from unknowns z at inputs `start`; the change
    points that are passed, and those of neighbouring linkages.

    Smoothly through change points. Raises NoAnswer where a dead point is on the way, or the branch cannot be followed.
    """
    distance = greatest_size(stop - start)
    if distance == 0.0:
        return z, (), []
    follower = PathFollower(solver, z, start, stop - start)
    position = follower.unknowns_at(distance)
    if position is None:
        raise follower.tracker.end_refusal()
    return position[0], follower.bifurcations_until(distance), follower.tracker.nearby


def follow_samples(
    solver: PreparedMechanism,
    z: Array,
    inputs: InputRates,
    branches: Sequence[int] = (),
    budget: ArcBudget | None = None,
) -> RunSamples:
    """A run of inputs, from the unknowns of its first sample as far as the motion comes.

    The run is computed block after block, each at all samples; every sample then passes both checks, and from
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

    def follow(self) -> RunSamples:
        """All samples, as far as the motion comes."""
        samples = window = len(self.u)
        done, stopped = 1, None
        while done < samples and stopped is None:
            first, last = done, min(done + window, samples)
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
        # what turns back on a change point comes back by the branch on which it came
        move = self.u[done] - self.u[done - 1]
        while base and base in self.branch_rates and move @ self.branch_rates[base].input_direction < 0.0:
            base -= 1
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
