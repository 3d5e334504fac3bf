"""A whole circuit: the closed curve of all positions that an assembly can reach, through its dead points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.solving.continuation.path_pieces import BranchRates, PathPiece, path_pieces
from planar.solving.continuation.period import CLOSED_TOLERANCE, MAX_PIECES, closing_piece, nearest_start
from planar.solving.continuation.predictor_corrector import SHOWN_SLIDE_EXTENT, CurveTracker
from planar.solving.continuation.solution_curve import SolutionCurve
from planar.solving.continuation.turning_points import is_dead_point
from planar.solving.position import PositionSolver


class CircuitBranch(NamedTuple):
    """A part of a circuit on which the input goes one way: to a dead point, or to the circuit's start."""

    pieces: tuple[PathPiece, ...]

    @property
    def ends(self) -> tuple[float, float]:
        """Where the input starts and stops on its way."""
        return self.pieces[0].start, self.pieces[-1].stop

    def unknowns_at(self, curve: SolutionCurve, position: float) -> tuple[Array, BranchRates | None]:
        """The unknowns where the input is at a place, with their rates where the Jacobian is singular."""
        return next((each for each in self.pieces if each.has_position(position)), self.pieces[-1]).unknowns_at(
            curve, position
        )


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
    found: list[list[PathPiece]] = [[]]
    for piece in pieces:
        found[-1].append(piece)
        if piece.dead_point is not None:
            found.append([])
    return tuple(CircuitBranch(tuple(each)) for each in found if each and each[0].start != each[-1].stop)


def moving_pieces(tracker: CurveTracker) -> Iterator[PathPiece]:
    """The pieces of a curve on which something moves."""
    return (piece for piece in path_pieces(tracker) if piece.first != piece.last)


def is_endless(tracker: CurveTracker, piece: PathPiece) -> bool:
    """Whether the input slides on so far at a piece's end that it is not followed further."""
    return not tracker.is_periodic[-1] and abs(piece.stop) > SHOWN_SLIDE_EXTENT


def follow_circuit(setup: PositionSolver, tracker: CurveTracker) -> ClosedCircuit:
    """The circuit from where a walk stands. Raises NoAnswer where it is not found to close."""
    start, curve = tracker.point, tracker.curve
    turning = tracker.is_periodic
    found: list[PathPiece] = []
    for piece in moving_pieces(tracker):
        if len(found) > 1:
            if (
                piece.dead_point is not None
                and is_dead_point(start)
                and nearest_start(piece.dead_point.y, start, turning)[1] < CLOSED_TOLERANCE
            ):
                return ClosedCircuit((*found, piece), True)
            last = closing_piece(curve, piece, start, turning)
            if last is not None:
                return ClosedCircuit((*found, last), is_dead_point(start))
        found.append(piece)
        out = is_endless(tracker, piece)
        if out or len(found) > MAX_PIECES:
            told = (
                "the input slides on without an end"
                if out
                else f"the motion does not come back within {MAX_PIECES} arcs"
            )
            raise NoAnswer(Outcome.BRANCH_LOST, f"{told}; name where the range starts and stops instead of the circuit")
    u, ending = tracker.end_inputs
    raise setup.end_refusal(u, tracker.point, ending)
