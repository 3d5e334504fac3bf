"""The limits of a run of one input: dead points, ends of strokes, change points between its first row and its last."""

from __future__ import annotations

from planar.foundation.arrays import Array
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation import events
from planar.solving.continuation.events import LocatedLimit
from planar.solving.continuation.predictor_corrector import CurveTracker
from planar.solving.runs.closed_circuit import ClosedCircuit
from planar.solving.runs.running_input import RunningInput
from planar.solving.runs.samples import RunSamples

STEP_ROUNDING = 1e-9
"""Parts of a step: what rounding leaves of one."""


class RangeLimits:
    """The curve along which an input runs: what it meets between the first row and the last."""

    def __init__(self, ranged: RunningInput, found: RunSamples, whole: tuple[ClosedCircuit, CurveTracker] | None):
        self.ranged, self.found, self.whole = ranged, found, whole
        self.singular_rows = frozenset(found.branch_rates)
        self.fork_positions = tuple(
            float(each.u[ranged.index]) * ranged.scale for each in found.passed if each.passed.is_switched
        )

    @property
    def unknowns(self) -> Array:
        """See `FollowedPath.unknowns`."""
        return self.found.z

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        ranged, found = self.ranged, self.found
        u = found.inputs.u[:, ranged.index]
        if len(u) < 2:
            return ()
        if self.whole is not None:
            parts, walk = self.whole
            told = events.limits_along(ranged.solver, ranged.pair, float(u[0]), 1.0, walk, parts.pieces)
            return events.distinct_limits(ranged.solver, ranged.pair, walk.curve, told)
        # from where the rows were followed from, so that the same ways are taken at change points
        back = self._is_there_and_back(u)
        first, last = float(u[0]), float(u[(len(u) - 1) // 2 if back else -1])
        here, sense = float(ranged.u[ranged.index]), 1.0 if last >= first else -1.0
        down = self._limits_until(here, first, -sense)
        up = self._limits_until(here, last, sense)
        low, high = sorted((first * ranged.scale, last * ranged.scale))
        room = STEP_ROUNDING * ranged.scale
        between = [each for each in (*down[::-1], *up) if low - room <= each.limit.input <= high + room]
        curve = ranged.curve_tracker(ranged.assembly.z, here).curve
        return events.distinct_limits(ranged.solver, ranged.pair, curve, between)

    def _is_there_and_back(self, u: Array) -> bool:
        return len(u) > 2 and u[0] == u[-1] and u[1] == u[-2]

    def _limits_until(self, here: float, last: float, way: float) -> list[LocatedLimit]:
        """The limits from the file's position to another one, if it lies that way; at the file's position its stops."""
        ranged, far = self.ranged, way * (last - here)
        if far < -STEP_ROUNDING or (far <= 0.0 and ranged.solver.stops is None):
            return []
        far = max(far, 0.0)
        walk = ranged.curve_tracker(ranged.assembly.z, here, way, work=ranged.arc_budget(far, here))
        met_there = events.limits_until(ranged.solver, ranged.pair, here, way, walk, far)
        # all with the input on its way up, whichever way it was followed
        return [each.in_direction(way) for each in met_there]
