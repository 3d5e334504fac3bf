"""Dwells: stretches of the input over which an output all but stands still."""

from __future__ import annotations

from math import inf, isfinite
from numbers import Real
from typing import NamedTuple

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.output import Axis, Extreme, Output
from planar.document.first_argument import takes_result
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.root_finding import find_root
from planar.results.motion import Motion

DEFAULT_TOLERANCE = 0.01
"""Of the stroke: an output that stays so near to a value dwells, if nothing else is told."""
DEFAULT_LEAST_TRAVEL = 1.0 / 12.0
"""Of the input's range, 30 degrees of a turn: shorter stretches are no dwells, if nothing else is told."""


class Dwell(NamedTuple):
    """A stretch of the input over which an output stays `within` (m or rad) of the value at which it stands still.

    `at` is that value and the input's position there; `start` and `stop` are the input's positions (rad or m) at which
    the output is off by `within`, or ends of the range; `stop` is beyond the range where the stretch goes over the end
    of a closed one. `travel` is their distance, `time` (s) how long it takes.
    """

    of: str
    at: Extreme
    within: float
    start: float
    stop: float
    travel: float
    time: float


@takes_result("Motion")
def dwells(
    motion: Motion, of: str, within: float | None = None, least: float | None = None, axis: Axis | None = None
) -> tuple[Dwell, ...]:
    """The dwells of a pair, a link or (with an axis, "x", "y" or a direction in rad) a point, in the input's order.

    A dwell is about a place where the output stands still, at an end of its stroke or elsewhere, and as long as it is
    off by no more than `within` (m or rad; 1 % of all that it moves if left out). Its ends are solved for to round-off.
    Of stretches that overlap the longest is told, and only those of `least` (rad or m of the input; 1/12 of its range,
    30 degrees of a turn, if left out) or more: of a harmonic motion 1 % is 23 degrees. The input runs at the file's
    velocity, or 1 rad/s or 1 m/s where that is zero. What moves slowly without ever standing still does not dwell.

    Raises Unknown, BadInput where there is nothing of that name, or for a `within` or `least` that is none.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> len(planar.dwells(motion, "stroke"))
    0
    """
    for name, value in (("within", within), ("least", least)):
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, Real) or not (isfinite(value) and value >= 0.0):
            raise BadInput(name, f"a number that is not negative (m or rad) is wanted, not {value!r:.40}")
    return find_dwells(Output(InterpolatedRun(motion), of, axis), within, least)


def find_dwells(output: Output, within: float | None = None, least: float | None = None) -> tuple[Dwell, ...]:
    """See `dwells`; of an output that is made already."""
    low, high = output.range
    period = output.run.period
    within = DEFAULT_TOLERANCE * max(high - low, abs(output.gain_per_period)) if within is None else within
    least = DEFAULT_LEAST_TRAVEL * period if least is None else least
    if not output.is_moving or within <= output.tolerance:
        return ()
    found = [_dwell_about(output, index, within) for index in range(len(output.standstills))]
    kept: list[Dwell] = []
    for each in sorted((each for each in found if each is not None), key=lambda each: (-each.travel, each.start)):
        if each.travel >= least and not any(_is_overlapping(each, other, output) for other in kept):
            kept.append(each)
    return tuple(sorted(kept, key=lambda each: each.start))


def _dwell_about(output: Output, index: int, within: float) -> Dwell | None:
    """The stretch about a place where the output stands still; None where it cannot be followed."""
    at, steady = output.standstills[index], output.run
    try:
        start, stop = (_find_edge(output, index, way, within) for way in (-1, 1))
    except NoAnswer:
        return None
    if stop - start >= steady.period:  # it never leaves
        start, stop = steady.lowest, steady.highest
    if steady.closed and start < steady.lowest:
        start, stop = start + steady.period, stop + steady.period
    travel = stop - start
    return Dwell(output.name, at, within, start, stop, travel, travel / abs(steady.rate))


def _find_edge(output: Output, index: int, direction: int, within: float) -> float:
    """Where the output is off by so much for the first time, one way from a place where it stands still.

    Between places where it stands still it goes one way only, so that nothing is missed. Without end it is infinite.
    """
    stations, steady = output.standstills, output.run
    many, value = len(stations), stations[index].value
    before = stations[index].input
    for step in range(1, many + 1):
        turns, which = divmod(index + direction * step, many)
        if steady.closed:
            place = stations[which].input + turns * steady.period
            there = stations[which].value + turns * output.gain_per_period
        elif turns == 0:
            place, there = stations[which]
        else:
            place, there = output.range_ends[(direction + 1) // 2]
        if abs(there - value) > within:
            edge = value + within if there > value else value - within
            return find_root(lambda at: output.evaluate(at)[0] - edge, *sorted((before, place)))  # noqa: B023 - called at once
        if turns != 0 and not steady.closed:
            return place
        before = place
    return direction * inf


def _is_overlapping(one: Dwell, other: Dwell, output: Output) -> bool:
    shifts = (-output.run.period, 0.0, output.run.period) if output.run.closed else (0.0,)
    return any(one.start + by < other.stop and other.start < one.stop + by for by in shifts)
