"""Curves that close: the period of a motion, and the whole circuit of an assembly through its dead points."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.solving.continuation.path_pieces import PathPiece, path_pieces
from planar.solving.continuation.predictor_corrector import (
    END_TOLERANCE,
    SHOWN_SLIDE_EXTENT,
    CurveTracker,
    PassedBifurcation,
)
from planar.solving.continuation.run_samples import BranchRates
from planar.solving.continuation.solution_curve import CurvePoint, SolutionCurve, input_axis

MAX_PIECES = 1500
"""A curve that is longer, as with wheels of many teeth, is not waited for."""
CLOSED_TOLERANCE = 1e-7
"""rad or sizes: a curve that comes so near to its start, in its direction, is closed."""
ROUNDING_TOLERANCE = 1e-9
MAX_CHECKED_PIECES = 16
"""Pieces whose first points are tried at once, whole turns on."""


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
        index = min(bisect_left([piece.stop for piece in self.pieces], within), len(self.pieces) - 1)
        z, branch_rates = self.pieces[index].unknowns_at(curve, within)
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
        passed = tuple(each for each in self.tracker.passed_until(growth[-1]) if each.bifurcation.y[-1] > END_TOLERANCE)
        started = tuple(each for each in self.tracker.passed if each.is_start)
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


class CircuitBranch(NamedTuple):
    """A part of a circuit on which the input goes one way: to a dead point, or to the circuit's start."""

    pieces: tuple[PathPiece, ...]

    @property
    def ends(self) -> tuple[float, float]:
        """Where the input starts and stops on its way."""
        return self.pieces[0].start, self.pieces[-1].stop

    def unknowns_at(self, curve: SolutionCurve, position: float) -> tuple[Array, BranchRates | None]:
        """The unknowns where the input is at a place, with their rates where the Jacobian is singular."""
        piece = next((piece for piece in self.pieces if piece.has_position(position)), self.pieces[-1])
        return piece.unknowns_at(curve, position)


class ClosedCircuit(NamedTuple):
    """The pieces of a closed curve in their order, and whether it starts in a dead point."""

    pieces: tuple[PathPiece, ...]
    starts_at_dead_point: bool

    @property
    def branches(self) -> tuple[CircuitBranch, ...]:
        """Its parts between dead points."""
        return split_at_dead_points(self.pieces)


def split_at_dead_points(pieces: Iterable[PathPiece]) -> tuple[CircuitBranch, ...]:
    """The branches to which the pieces of a curve belong, in their order."""
    branches: list[list[PathPiece]] = [[]]
    for piece in pieces:
        branches[-1].append(piece)
        if piece.dead_point is not None:
            branches.append([])
    return tuple(CircuitBranch(tuple(branch)) for branch in branches if branch and branch[0].start != branch[-1].stop)


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
    u, ending = tracker.end_inputs
    raise tracker.end_refusal(u, tracker.point, ending)
