"""How the limits of a motion move with the numbers of the file: dead points, strokes, swings and time ratios."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import nan
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.output import Extreme, Output
from planar.analysis.motion.time_ratio import Passage, TimeRatio, find_time_ratio
from planar.derivatives.design_equations import LimitEquations, LimitPoint, LimitSystem, design_equations
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.results.motion import Motion, State

NEAR = 1e-6
"""rad or sizes: a limit that is solved for anew is the same where it is so near."""


TIE = 1e-7
"""Ends that differ by less than this part tie, and so do passages: the greater of two has no derivative there."""


class LimitSlopes(NamedTuple):
    """A limit, and how it moves with each number: `kind` is "input dead point", "least" or "greatest" of the output.

    `input` is the position of the running input there and `value` the output's (rad or m), `input_slopes` and
    `value_slopes` their derivatives by the names of the numbers (SI).
    """

    kind: str
    of: str
    input: float
    value: float
    input_slopes: Mapping[str, float]
    value_slopes: Mapping[str, float]

    def __repr__(self) -> str:
        return short_repr(self)


class TravelSlopes(NamedTuple):
    """The stroke or swing of an output (m or rad), its two ends, and its time ratio where it returns, each with its
    derivatives by the names of the numbers (SI).

    Where two ends tie that move apart, or both passages take as long, there is no derivative: NaN, or None.
    """

    of: str
    travel: float
    travel_slopes: Mapping[str, float]
    ends: tuple[LimitSlopes, LimitSlopes]
    time_ratio: float | None = None
    time_ratio_slopes: Mapping[str, float] | None = None

    def __repr__(self) -> str:
        return short_repr(self)


def dead_point_slopes(motion: Motion, offsets: tuple[str, ...] = ()) -> tuple[LimitSlopes, ...]:
    """The dead points of the running input between the ends of a motion, or at these; `offsets` as of
    `DesignEquations`."""
    running = motion.running_input
    design = design_equations(motion.mechanism, offsets)
    system = LimitSystem(design, running)
    found = []
    for limit in motion.limits:
        if limit.kind != "input dead point" or limit.of != running:
            continue
        row = int(np.argmin(np.abs(motion.inputs[running].position - limit.input)))
        point = system.solve(system.dead_point_equations(motion, row))
        if point is not None and abs(point.input - limit.input) <= NEAR * max(1.0, design.solver.unit):
            found.append(_limit_slopes("input dead point", running, limit.input, limit.value, system, point))
    return tuple(found)


def travel_slopes(motion: Motion, of: str, offsets: tuple[str, ...] = ()) -> TravelSlopes | None:
    """The stroke of a slide, or the swing of a rocker; None of what does not turn back at both ends."""
    try:
        run = InterpolatedRun(motion)
        output = Output(run, of)
        if output.turning_extremes() is None:
            return None
        return _TravelDerivatives(run, output, offsets).travel()
    except (BadInput, NoAnswer):  # a run in time, or an end at which there is no derivative
        return None


def travel_end_equations(
    motion: Motion, of: str, offsets: tuple[str, ...] = ()
) -> tuple[LimitSystem, list[tuple[LimitEquations, ...]]]:
    """The equations of the ends of a travel: of all places of the least value, and of the greatest."""
    run = InterpolatedRun(motion)
    output = Output(run, of)
    ends = _TravelDerivatives(run, output, offsets)
    found = [tuple(map(ends.equations, each)) for each in output.all_turning_extremes()]
    return ends.system, found


def dead_point_equations(motion: Motion, offsets: tuple[str, ...] = ()) -> tuple[LimitSystem, list[LimitEquations]]:
    """The equations of the dead points that `dead_point_slopes` tells of."""
    system = LimitSystem(design_equations(motion.mechanism, offsets), motion.running_input)
    at = motion.inputs[motion.running_input].position
    places = (each.input for each in dead_point_slopes(motion, offsets))
    return system, [system.dead_point_equations(motion, int(np.argmin(np.abs(at - each)))) for each in places]


class _TravelDerivatives:
    """The ends between which an output goes, each solved for with its derivatives."""

    def __init__(self, run: InterpolatedRun, output: Output, offsets: tuple[str, ...] = ()):
        self.run, self.output = run, output
        self.system = LimitSystem(design_equations(run.mechanism, offsets), run.pair)

    def travel(self) -> TravelSlopes:
        """The travel with the slopes of its ends, and of the time ratio. Raises NoAnswer."""
        least, greatest = self.output.all_turning_extremes()
        low, high = self._tied_ends("least", least), self._tied_ends("greatest", greatest)
        slopes = {name: high.value_slopes[name] - low.value_slopes[name] for name in self.system.names}
        ratio = find_time_ratio(self.output)
        return TravelSlopes(
            self.output.name,
            high.value - low.value,
            slopes,
            (low, high),
            ratio and ratio.ratio,
            ratio and self._time_ratio_slopes(ratio),
        )

    def _time_ratio_slopes(self, ratio: TimeRatio) -> dict[str, float] | None:
        out, back = (self._passage_slopes(passage) for passage in (ratio.out, ratio.back))
        passages = [(ratio.out.travel, out), (ratio.back.travel, back)]
        (quick, by_quick), (slow, by_slow) = sorted(passages, key=lambda each: each[0])
        if slow - quick <= TIE * slow:
            return None
        return {name: (by_slow[name] - ratio.ratio * by_quick[name]) / quick for name in self.system.names}

    def _passage_slopes(self, passage: Passage) -> dict[str, float]:
        """How far the input runs from one end to the other, by the names of the numbers."""
        sense = 1.0 if self.run.rate > 0.0 else -1.0
        ahead, behind = (self._end("", end).input_slopes for end in (passage.stop, passage.start))
        return {name: sense * (ahead[name] - behind[name]) for name in self.system.names}

    def _tied_ends(self, kind: str, ends: Sequence[Extreme]) -> LimitSlopes:
        """An end that is reached at several positions: where these move apart it has no derivative."""
        first, *others = (self._end(kind, end) for end in ends)
        largest = max(map(abs, first.value_slopes.values()), default=0.0)
        apart = {
            name
            for other in others
            for name, slope in other.value_slopes.items()
            if abs(slope - first.value_slopes[name]) > TIE * largest
        }
        known = {name: nan if name in apart else slope for name, slope in first.value_slopes.items()}
        return first._replace(value_slopes=known)

    def _state(self, end: Extreme) -> State:
        place = self.run.wrap_position(end.input)
        return self.run.state_at(end.input if place is None else place)

    def equations(self, end: Extreme) -> LimitEquations:
        """What an end is solved from."""
        return self.system.turning_point_equations(self._state(end), self.output.name)

    def _end(self, kind: str, end: Extreme) -> LimitSlopes:
        point = self.system.solve(self.equations(end))
        if point is None:
            raise NoAnswer(Outcome.CHANGE_POINT, "an end of the travel does not move smoothly with the dimensions")
        return _limit_slopes(kind, self.output.name, end.input, end.value, self.system, point)


def _limit_slopes(  # many: a limit, its name, and how it moves
    kind: str, of: str, at: float, value: float, system: LimitSystem, point: LimitPoint
) -> LimitSlopes:
    by_input, by_value = (
        dict(zip(system.names, map(float, slopes), strict=True)) for slopes in (point.input_slopes, point.value_slopes)
    )
    return LimitSlopes(kind, of, at, value, by_input, by_value)
