"""A whole circuit: the closed curve of all positions that an assembly can reach, through its dead points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.errors import NoAnswer, Outcome
from planar.pairs import Kind
from planar.solving.curve import Curve, Point
from planar.solving.follow import Local, Piece, pieces, rests
from planar.solving.position import Solver
from planar.solving.setup import Setup
from planar.solving.walk import OUT, Walk

Array = np.ndarray

PIECES = 1500
"""Linkages whose circuit is longer, as with wheels of many teeth, are followed over a range instead."""
BACK = 1e-7
"""rad or sizes: a curve that comes so near to its start, in its direction, is closed."""
SAME = 1e-9


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
    counts = _turning(setup)
    found: list[Piece] = []
    for piece in pieces(walk):
        if piece.first == piece.last:
            continue
        if len(found) > 1:
            if piece.dead is not None and rests(start) and _home(piece.dead.y, start, counts)[1] < BACK:
                return Circuit((*found, piece), True)
            closing = _closing(curve, piece, start, counts)
            if closing is not None:
                return Circuit((*found, closing), rests(start))
        found.append(piece)
        out = not counts[-1] and abs(piece.stop) > OUT
        if out or len(found) > PIECES:
            told = "the input slides on without an end" if out else "the motion does not come back within so many turns"
            raise NoAnswer(Outcome.BRANCH_LOST, f"{told}; name where the range starts and stops instead of the circuit")
    u, ending = walk.end
    raise setup.ends(u, walk.here.tangent, ending)


def _turning(setup: Setup) -> Array:
    """Which entries of y come back after whole turns: angles, and the input if it turns."""
    kinds = [setup.equations.coordinates[column].kind for column in setup.equations.unknowns]
    driven = [setup.slides(given.pair) for given in setup.mechanism.inputs]
    return np.array([kind is Kind.ANGLE for kind in kinds] + [not any(driven)])


def _home(y: Array, start: Point, counts: Array) -> tuple[Array, float]:
    """The start, whole turns away so as to be nearest to y, and how far it is."""
    turns = np.where(counts, np.round((y - start.y) / (2.0 * np.pi)), 0.0)
    home = start.y + 2.0 * np.pi * turns
    return home, float(np.linalg.norm(y - home))


def _closing(curve: Curve, piece: Piece, start: Point, counts: Array) -> Piece | None:
    """The piece up to the circuit's start, if that lies on it and the curve goes on from there as it did."""
    arc = piece.arc
    length = abs(piece.last - piece.first)
    home, far = _home(arc.after.y, start, counts)
    if far > 2.0 * length + BACK:
        return None
    x = float(arc.axis @ (home - arc.origin))
    low, high = sorted((piece.first, piece.last))
    if not low - SAME <= x <= high + SAME:
        return None
    here = arc.at(curve, x)
    if np.linalg.norm(here.y - home) > BACK or here.tangent @ start.tangent < 0.5 or not curve.closes(home):
        return None
    return Piece(arc, piece.first, x, piece.start, float(home[-1]), None)
