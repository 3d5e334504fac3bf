"""Where along a curve of positions a pair meets its stop: solved for, as dead points are."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.root_finding import find_first_passage
from planar.solving.continuation.pair_motions import pair_motions_at
from planar.solving.continuation.solution_curve import Arc, CurvePoint, SolutionCurve
from planar.solving.prepared_mechanism import PreparedMechanism
from planar.solving.stops import STOP_TOLERANCE, PairStops


class StopOnArc(NamedTuple):
    """The first stop on an arc: where on its axis, and the point there."""

    x: float
    point: CurvePoint


class StopSearch:
    """Looks for stops along one curve from its start; `rooms` are how far the pairs are from them."""

    def __init__(self, setup: PreparedMechanism, stops: PairStops, curve: SolutionCurve, start: CurvePoint):
        self.setup, self.stops, self.curve = setup, stops, curve
        self.turns = self.stops.turns(pair_motions_at(setup, self.stops.pairs, curve, start)[:, 0])

    def rooms_at(self, point: CurvePoint) -> Array:
        """How far lower and upper stops are, with the first derivative by arc length (2, stops, 2)."""
        motions = pair_motions_at(self.setup, self.stops.pairs, self.curve, point)
        rate = motions[:, 1] / self.stops.scale
        return np.stack([self.stops.rooms(motions[:, 0], self.turns), np.array([rate, -rate])], axis=2)

    def first_on(self, arc: Arc, first: float, last: float) -> StopOnArc | None:
        """The first stop on an arc between two places on its axis, in whose direction the curve runs."""
        ends = [self._point_at(arc, x) for x in (first, last)]
        before, after = (self.rooms_at(point) for point in ends)
        found = [
            x
            for side, k in np.ndindex(*before.shape[:2])
            if np.isfinite(before[side, k, 0])
            and (x := self._passed_at(arc, (first, last), (before[side, k], after[side, k]), (side, k))) is not None
        ]
        if not found:
            return None
        x = min(found, key=lambda x: abs(x - first))
        return StopOnArc(x, self._point_at(arc, x))

    def _point_at(self, arc: Arc, x: float) -> CurvePoint:
        for point, at in zip((arc.before, arc.after), arc.ends, strict=True):
            if x == at:
                return point
        return arc.point_at(self.curve, x)

    def _passed_at(
        self, arc: Arc, ends: tuple[float, float], rooms: tuple[Array, Array], which: tuple[int, int]
    ) -> float | None:
        """Where one stop is first passed between the ends, at which its rooms and their rates are known."""
        (first, last), ((g0, s0), (g1, s1)) = ends, rooms

        def room(x: float) -> float:
            return float(self.rooms_at(self._point_at(arc, x))[*which, 0])

        def rate(x: float) -> float:
            return float(self.rooms_at(self._point_at(arc, x))[*which, 1])

        sense = 1.0 if last >= first else -1.0
        if g0 <= STOP_TOLERANCE and (g0 < -STOP_TOLERANCE or s0 < 0.0 or (s0 == 0.0 and g1 < g0)):
            return first  # it stands at the stop, and goes on beyond
        return find_first_passage(room, lambda x: sense * rate(x), (first, last), ((g0, s0), (g1, s1)))


def stop_search(curve: SolutionCurve, start: CurvePoint) -> StopSearch | None:
    """What looks for stops along a curve; None where no pair has any."""
    setup = curve.solver
    if not isinstance(setup, PreparedMechanism) or setup.stops is None:
        return None
    return StopSearch(setup, setup.stops, curve, start)
