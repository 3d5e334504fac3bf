"""A curve of positions in pieces: between dead points, up to a stop, over a period, round a circuit."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome, TrackingEnd
from planar.foundation.root_finding import find_first_passage, find_root, lowest_on_cubic
from planar.solving.continuation.fast_path import STRAIGHT_TOLERANCE
from planar.solving.continuation.predictor_corrector import (
    END_TOLERANCE,
    SHOWN_SLIDE_EXTENT,
    CurveTracker,
    PassedBifurcation,
)
from planar.solving.continuation.run_samples import BranchRates
from planar.solving.continuation.solution_curve import (
    DEAD_POINT_TOLERANCE,
    Arc,
    CurvePoint,
    SolutionCurve,
    input_axis,
    pair_motions_at,
)
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


class PathPiece(NamedTuple):
    """A part of an arc on which the inputs go one way: from and to where on its axis, from and to where on the way of
    the inputs, and the dead point at its end, if one is there."""

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
        if (
            near is None
            or np.linalg.norm(near - rough) > MAX_CORRECTION_RATIO * abs(self.last - self.first)
            or not self._holds(near)
            or not curve.is_closed(near)
        ):
            near = arc.curve_coordinates(
                curve, find_root(lambda x: float(arc.curve_coordinates(curve, x)[-1]) - position, self.first, self.last)
            )
        return near[:-1], None

    def _holds(self, y: Array) -> bool:
        """Whether a point of the curve lies on this piece, and not beyond a dead point at its end, where the inputs
        come to the same places once more."""
        x, (low, high) = self.arc.place(y), sorted((self.first, self.last))
        slack = STRAIGHT_TOLERANCE * (high - low)
        return low - slack <= x <= high + slack


def piece_at(pieces: Sequence[PathPiece], position: float) -> PathPiece:
    """The piece on which the inputs are at a place, of pieces on which they go one way."""
    sense = 1.0 if pieces[-1].stop >= pieces[0].start else -1.0
    index = bisect_left(pieces, sense * position, key=lambda piece: sense * piece.stop)
    return pieces[min(index, len(pieces) - 1)]


def path_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
    """A walk's arcs, parted at dead points, up to the first stop that a pair meets."""
    curve, stops = tracker.curve, tracker.curve.solver.stops
    search = None if stops is None else _StopSearch(stops, curve, tracker.point)
    for piece in _pieces_by_dead_points(tracker):
        met = None if search is None else search.first_on(piece.arc, piece.first, piece.last)
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
    """A walk's arcs, parted at dead points."""
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


class _StopSearch:
    """Looks for stops along one curve from its start; `rooms` are how far the pairs are from them."""

    def __init__(self, stops: PairStops, curve: SolutionCurve, start: CurvePoint):
        self.stops, self.curve = stops, curve
        self.turns = stops.turns(pair_motions_at(stops.pairs, curve, start)[:, 0])

    def rooms_at(self, point: CurvePoint) -> Array:
        """How far lower and upper stops are, with the first derivative by arc length (2, stops, 2)."""
        motions = pair_motions_at(self.stops.pairs, self.curve, point)
        rate = motions[:, 1] / self.stops.scale
        return np.stack([self.stops.rooms(motions[:, 0], self.turns), np.array([rate, -rate])], axis=2)

    def first_on(self, arc: Arc, first: float, last: float) -> tuple[float, CurvePoint] | None:
        """The first stop on an arc between two places on its axis, in whose direction the curve runs: where on its
        axis, and the point there."""
        before, after = (self.rooms_at(self._point_at(arc, x)) for x in (first, last))
        passages = [
            x
            for side, k in np.ndindex(*before.shape[:2])
            if np.isfinite(before[side, k, 0])
            and (x := self._passed_at(arc, (first, last), (before[side, k], after[side, k]), (side, k))) is not None
        ]
        if not passages:
            return None
        x = min(passages, key=lambda x: abs(x - first))
        return x, self._point_at(arc, x)

    def _point_at(self, arc: Arc, x: float) -> CurvePoint:
        for point, end in zip((arc.before, arc.after), arc.ends, strict=True):
            if x == end:
                return point
        return arc.point_at(self.curve, x)

    def _passed_at(
        self, arc: Arc, ends: tuple[float, float], rooms: tuple[Array, Array], which: tuple[int, int]
    ) -> float | None:
        """Where one stop is first passed between the ends, at which its rooms and their rates are known."""
        (first, last), ((g0, s0), (g1, s1)) = ends, rooms

        def room_and_rate(x: float) -> Array:
            return self.rooms_at(self._point_at(arc, x))[which]

        sense = 1.0 if last >= first else -1.0
        if g0 <= STOP_TOLERANCE and (g0 < -STOP_TOLERANCE or s0 < 0.0 or (s0 == 0.0 and g1 < g0)):
            return first  # it stands at the stop, and goes on beyond
        return find_first_passage(
            lambda x: float(room_and_rate(x)[0]),
            lambda x: sense * float(room_and_rate(x)[1]),
            ends,
            ((g0, s0), (g1, s1)),
        )


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


class PeriodSearch:
    """Looks whether a walk on which one input turns comes back, as it goes on smoothly through change points."""

    def __init__(self, walk: CurveTracker):
        self.tracker, self.start = walk, walk.point
        self._pieces: list[PathPiece] | None = []
        if not walk.is_periodic[-1] or np.count_nonzero(walk.curve.input_direction) > 1 or walk.branches:
            self._pieces = None

    def period_after(self, piece: PathPiece) -> Period | None:
        """The period, if the next piece of the walk is its last."""
        if self._pieces is None:
            return None
        if piece.dead_point is not None or len(self._pieces) >= MAX_PIECES:
            self._pieces = None
            return None
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
        """Whether all of it, not its start alone, is closed whole turns on: where angles count turns it need not be."""
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
    """The pieces of a curve in their order, by branch: the input goes one way on each."""
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
    """The circuit from where a walk stands. Raises NoAnswer where it is not found to close."""
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
