"""The time ratio of a quick return: how long an output goes one way, and how long the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import CLOSED_TOLERANCE, InterpolatedRun
from planar.analysis.motion.output import Axis, Extreme, Output
from planar.document.first_argument import takes_result
from planar.results.motion import Motion


class Passage(NamedTuple):
    """From one end to the other: both ends (rad or m), how far the input runs meanwhile (rad) and how long (s)."""

    start: Extreme
    stop: Extreme
    travel: float
    time: float


class TimeRatio(NamedTuple):
    """The time of the slower passage by that of the quicker, 1 or more, with both passages.

    `out` goes from the output's least value to its greatest, `back` from there to the next least.
    """

    of: str
    ratio: float
    out: Passage
    back: Passage


@takes_result("Motion")
def time_ratio(motion: Motion, of: str, axis: Axis | None = None) -> TimeRatio | None:
    """The time ratio of a pair, a link or (with an axis, "x", "y" or a direction in rad) a point.

    Between the ends of its stroke or swing, solved for to round-off, while the input turns steadily at the file's
    velocity, in its sense; at 1 rad/s where that is zero. The position of the input at an end is told in the range of
    the motion. None where the output has no such ends, or the motion does not come back to where it started, so that
    there is no return. Raises Unknown, BadInput where there is nothing of that name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> round(planar.time_ratio(motion, "stroke").ratio, 3)
    1.0
    """
    return find_time_ratio(Output(InterpolatedRun(motion), of, axis))


def find_time_ratio(output: Output) -> TimeRatio | None:
    """See `time_ratio`; of an output that is made already."""
    steady = output.run
    if not steady.closed or output.turning_extremes() is None:
        return None
    least, greatest = output.all_turning_extremes()
    sense, period = float(np.sign(steady.rate)), steady.period

    def on(end: Extreme) -> float:
        """How far the input has run to an end since the first of the least."""
        far = sense * (end.input - least[0].input) % period
        return 0.0 if period - far < CLOSED_TOLERANCE else far

    lows, highs = sorted((on(end), end) for end in least), sorted((on(end), end) for end in greatest)
    again = [*lows[1:], (period, lows[0][1])]
    top = highs[0]
    low = max(each for each in lows if each[0] < top[0])
    next_low = min(each for each in again if each[0] > top[0])
    last_top = max(each for each in highs if each[0] < next_low[0])

    def passage(start: tuple[float, Extreme], stop: tuple[float, Extreme]) -> Passage:
        travel = stop[0] - start[0]
        return Passage(start[1], stop[1], travel, travel / abs(steady.rate))

    out, back = passage(low, top), passage(last_top, next_low)
    ratio = max(out.travel, back.travel) / min(out.travel, back.travel)
    return TimeRatio(output.name, ratio, out, back)
