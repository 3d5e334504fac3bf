"""Where a curve of positions comes back to its start, whole turns on, so that what follows is known."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.solving.continuation.path_pieces import SEAM, Local, Met, Piece, met
from planar.solving.continuation.predictor_corrector import Walk
from planar.solving.continuation.solution_curve import Curve, Point

Array = np.ndarray

PIECES = 1500
"""A curve that is longer, as with wheels of many teeth, is not waited for."""
BACK = 1e-7
"""rad or sizes: a curve that comes so near to its start, in its direction, is closed."""
SAME = 1e-9
ROOM = 16
"""Pieces whose first points are tried at once, whole turns on."""


class Period(NamedTuple):
    """The pieces from a start to where the curve is back there, what y (n + 1,) has grown by: whole turns, the change
    points passed, and that on which it started."""

    pieces: tuple[Piece, ...]
    turns: Array
    passed: tuple[Met, ...]
    started: tuple[Met, ...]

    @property
    def length(self) -> float:
        """How far the inputs go in it (rad)."""
        return float(self.turns[-1])

    def at(self, curve: Curve, place: float) -> tuple[Array, Local | None]:
        """The unknowns where the inputs are at a place beyond the start, with rates as `Piece.at` has them."""
        times = float(np.floor(place / self.length))
        within = place - times * self.length
        index = min(bisect_left([piece.stop for piece in self.pieces], within), len(self.pieces) - 1)
        z, local = self.pieces[index].at(curve, within)
        if local is not None:
            return z + times * self.turns[:-1], local
        y = np.append(z + times * self.turns[:-1], place)
        ahead = np.zeros_like(y)
        ahead[-1] = 1.0
        # where many turns are counted, rounding of the place is more than that of the unknowns
        settled = curve.corrected(y, ahead)
        return (y if settled is None else settled)[:-1], local

    def met(self, curve: Curve, last: float) -> Iterator[Met]:
        """The change points passed up to a place of the inputs."""
        yield from self.started
        if not self.passed:
            return  # however many turns there are
        for times in range(int((last + SEAM) / self.length) + 1):
            by = times * self.length * curve.way
            for each in self.passed:
                if each.passed.crossing.y[-1] + times * self.length <= last + SEAM:
                    yield each._replace(u=each.u + by)


class Round:
    """Looks whether a walk on which one input turns comes back, as it goes on smoothly through change points."""

    def __init__(self, walk: Walk):
        self.walk, self.start = walk, walk.here
        self._pieces: list[Piece] | None = []
        if not walk.turning[-1] or np.count_nonzero(walk.curve.way) > 1 or walk.branches:
            self._pieces = None

    def after(self, piece: Piece) -> Period | None:
        """The period, if the next piece of the walk is its last."""
        if self._pieces is None:
            return None
        if piece.dead is not None or len(self._pieces) >= PIECES:
            self._pieces = None
            return None
        self._pieces.append(piece)
        last = closing(self.walk.curve, piece, self.start, self.walk.turning)
        if last is None or not last.stop > SAME:
            return None
        turns = home(last.arc.y(self.walk.curve, last.last), self.start, self.walk.turning)[0] - self.start.y
        passed = tuple(each for each in met(self.walk) if SEAM < each.passed.crossing.y[-1] <= turns[-1] + SEAM)
        started = tuple(each for each in met(self.walk) if each.passed.starts)
        found = Period((*self._pieces[:-1], last), turns, passed, started)
        return found if self._goes_on(found) else None

    def _goes_on(self, found: Period) -> bool:
        """Whether all of it, not its start alone, is closed whole turns on: where angles count turns it need not be."""
        solver = self.walk.curve.solver
        some = found.pieces[:: max(1, len(found.pieces) // ROOM)]
        y = np.array([piece.arc.before.y for piece in some if not piece.arc.exact]) + found.turns
        open_ = solver.open_along(y[:, :-1], self.walk.curve.inputs(y))
        return bool(np.all(open_ <= solver.tolerance))


def home(y: Array, start: Point, turning: Array) -> tuple[Array, float]:
    """The start, whole turns away so as to be nearest to y, and how far it is."""
    turns = np.where(turning, np.round((y - start.y) / (2.0 * np.pi)), 0.0)
    found = start.y + 2.0 * np.pi * turns
    return found, float(np.linalg.norm(y - found))


def closing(curve: Curve, piece: Piece, start: Point, turning: Array) -> Piece | None:
    """The piece up to a start, whole turns on, if that lies on it and the curve goes on from there as it did."""
    arc = piece.arc
    length = abs(piece.last - piece.first)
    there, far = home(arc.after.y, start, turning)
    if far > 2.0 * length + BACK:
        return None
    x = float(arc.axis @ (there - arc.origin))
    low, high = sorted((piece.first, piece.last))
    if not low - SAME <= x <= high + SAME:
        return None
    here = arc.at(curve, x)
    if np.linalg.norm(here.y - there) > BACK or here.tangent @ start.tangent < 0.5 or not curve.closes(there):
        return None
    return Piece(arc, piece.first, x, piece.start, float(there[-1]), None)
