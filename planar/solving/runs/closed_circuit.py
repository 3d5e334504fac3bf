"""A whole circuit: the closed curve of all positions that an assembly can reach, through its dead points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.errors import NoAnswer, Outcome
from planar.solving.continuation.path_pieces import Local, Piece, pieces, rests
from planar.solving.continuation.period import BACK, PIECES, closing, home
from planar.solving.continuation.predictor_corrector import OUT, Walk
from planar.solving.continuation.solution_curve import Curve
from planar.solving.position import Solver

Array = np.ndarray


class Stretch(NamedTuple):
    """A part of a circuit on which the input goes one way: to a dead point, or to the circuit's start."""

    pieces: tuple[Piece, ...]

    @property
    def ends(self) -> tuple[float, float]:
        """Where the input starts and stops on its way."""
        return self.pieces[0].start, self.pieces[-1].stop

    def at(self, curve: Curve, place: float) -> tuple[Array, Local | None]:
        """The unknowns where the input is at a place, with their rates where the slope is singular."""
        return next((each for each in self.pieces if each.holds(place)), self.pieces[-1]).at(curve, place)


class Circuit(NamedTuple):
    """The pieces of a closed curve in their order, and whether it starts in a dead point."""

    pieces: tuple[Piece, ...]
    from_dead: bool

    @property
    def stretches(self) -> tuple[Stretch, ...]:
        """Its parts between dead points."""
        found: list[list[Piece]] = [[]]
        for piece in self.pieces:
            found[-1].append(piece)
            if piece.dead is not None:
                found.append([])
        return tuple(Stretch(tuple(each)) for each in found if each and each[0].start != each[-1].stop)


def circuit(setup: Solver, walk: Walk) -> Circuit:
    """The circuit from where a walk stands. Raises NoAnswer where it is not found to close."""
    start, curve = walk.here, walk.curve
    turning = walk.turning
    found: list[Piece] = []
    for piece in pieces(walk):
        if piece.first == piece.last:
            continue
        if len(found) > 1:
            if piece.dead is not None and rests(start) and home(piece.dead.y, start, turning)[1] < BACK:
                return Circuit((*found, piece), True)
            last = closing(curve, piece, start, turning)
            if last is not None:
                return Circuit((*found, last), rests(start))
        found.append(piece)
        out = not turning[-1] and abs(piece.stop) > OUT
        if out or len(found) > PIECES:
            told = (
                "the input slides on without an end" if out else f"the motion does not come back within {PIECES} arcs"
            )
            raise NoAnswer(Outcome.BRANCH_LOST, f"{told}; name where the range starts and stops instead of the circuit")
    u, ending = walk.end
    raise setup.ends(u, walk.here.tangent, ending)
