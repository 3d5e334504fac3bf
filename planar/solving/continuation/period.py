"""The period of a solution curve: where it comes back to its start, whole turns on."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.solving.continuation.path_pieces import (
    END_TOLERANCE,
    BranchRates,
    PathBifurcation,
    PathPiece,
    bifurcations_until,
)
from planar.solving.continuation.predictor_corrector import CurveTracker
from planar.solving.continuation.solution_curve import CurvePoint, SolutionCurve

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
    passed: tuple[PathBifurcation, ...]
    started: tuple[PathBifurcation, ...]

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
        z, local = self.pieces[index].unknowns_at(curve, within)
        if local is not None:
            return z + times * self.growth[:-1], local
        y = np.append(z + times * self.growth[:-1], position)
        ahead = np.zeros_like(y)
        ahead[-1] = 1.0
        # where many turns are counted, rounding of the place is more than that of the unknowns
        settled = curve.correct(y, ahead)
        return (y if settled is None else settled)[:-1], local

    def bifurcations_until(self, curve: SolutionCurve, last: float) -> Iterator[PathBifurcation]:
        """The change points passed up to a place of the inputs."""
        yield from self.started
        if not self.passed:
            return  # however many turns there are
        for times in range(int((last + END_TOLERANCE) / self.length) + 1):
            by = times * self.length * curve.input_direction
            for each in self.passed:
                if each.passed.bifurcation.y[-1] + times * self.length <= last + END_TOLERANCE:
                    yield each._replace(u=each.u + by)


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
        last = closing_piece(self.tracker.curve, piece, self.start, self.tracker.is_periodic)
        if last is None or not last.stop > ROUNDING_TOLERANCE:
            return None
        turns = (
            nearest_start(
                last.arc.curve_coordinates(self.tracker.curve, last.last), self.start, self.tracker.is_periodic
            )[0]
            - self.start.y
        )
        passed = tuple(
            each
            for each in bifurcations_until(self.tracker)
            if END_TOLERANCE < each.passed.bifurcation.y[-1] <= turns[-1] + END_TOLERANCE
        )
        started = tuple(each for each in bifurcations_until(self.tracker) if each.passed.is_start)
        found = Period((*self._pieces[:-1], last), turns, passed, started)
        return found if self._is_closed(found) else None

    def _is_closed(self, found: Period) -> bool:
        """Whether all of it, not its start alone, is closed whole turns on: where angles count turns it need not be."""
        solver = self.tracker.curve.solver
        some = found.pieces[:: max(1, len(found.pieces) // MAX_CHECKED_PIECES)]
        y = np.array([piece.arc.before.y for piece in some if not piece.arc.is_exact]) + found.growth
        open_ = solver.max_residuals(y[:, :-1], self.tracker.curve.inputs(y))
        return bool(np.all(open_ <= solver.tolerance))


def nearest_start(y: Array, start: CurvePoint, is_periodic: Array) -> tuple[Array, float]:
    """The start, whole turns away so as to be nearest to y, and how far it is."""
    turns = np.where(is_periodic, np.round((y - start.y) / (2.0 * np.pi)), 0.0)
    found = start.y + 2.0 * np.pi * turns
    return found, float(np.linalg.norm(y - found))


def closing_piece(curve: SolutionCurve, piece: PathPiece, start: CurvePoint, is_periodic: Array) -> PathPiece | None:
    """The piece up to a start, whole turns on, if that lies on it and the curve goes on from there as it did."""
    arc = piece.arc
    begin, end = arc.ends
    there, far = nearest_start(arc.after.y, start, is_periodic)
    # by the whole arc, to whose end that is: a piece before a dead point may be a small part of it
    if far > 2.0 * abs(end - begin) + CLOSED_TOLERANCE:
        return None
    x = float(arc.axis @ (there - arc.origin))
    low, high = sorted((piece.first, piece.last))
    if not low - ROUNDING_TOLERANCE <= x <= high + ROUNDING_TOLERANCE:
        return None
    here = arc.point_at(curve, x)
    if (
        np.linalg.norm(here.y - there) > CLOSED_TOLERANCE
        or here.tangent @ start.tangent < 0.5
        or not curve.is_closed(there)
    ):
        return None
    return PathPiece(arc, piece.first, x, piece.start, float(there[-1]), None)
