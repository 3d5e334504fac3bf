"""A motion: positions along the curve on which an assembly lies, or in time by the laws of its inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from numbers import Integral

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.time_limit import report_progress, returns_part_in_time
from planar.model.mechanism import LARGEST_COUNTED_ANGLE, Mechanism
from planar.model.run_arguments import check_number, check_steps
from planar.model.wording import quote_names
from planar.results.motion import Motion
from planar.solving.position import SolvedMechanism, solved_mechanism
from planar.solving.runs.range_run import Progress, RangeRun
from planar.solving.runs.time_run import run_in_time

MAX_DURATION = 1e6
"""s"""


@takes_mechanism
@returns_part_in_time
# many: what callers may choose of a run; # long: the docstring
def cycle(
    mechanism: Mechanism,
    steps: int = 360,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
    *,
    there_and_back: bool = False,
    circuit: bool = False,
    branches: Sequence[int] = (),
    duration: float | None = None,
    jerk: bool = False,
    progress: Progress | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Motion:
    """The motion of the assembly nearest to the sketch while one input runs from `start` to `stop` (rad or m).

    `steps` divide the range, so there are steps + 1 positions unless it ends before. Left out, the range is one turn on
    from the file's position where the input makes it, else from dead point to dead point; a slide's is always that.
    `pair` names the input that runs, where there are several; the others stand still. Every row has the file's velocity
    and acceleration of the input that runs, as the chapters do; it is no run in time.

    `there_and_back` runs the range and comes back by the same positions, with the velocity turned round. `circuit` goes
    through dead points along the closed curve of positions back to the start; `steps` then divide its longest
    stretch between dead points (a turn, if that is longer), and each stretch is divided about as finely.

    Where branches of the motion cross, it goes on smoothly; `branches` are the numbers of the ways taken at the first,
    second ... change point instead, counted from the file's position each way: 1 smoothly, 2 the next by the angle from
    that. At a start on a dead point they tell the two ways apart; at one on a change point the ways that lead through
    it, first that on which the rest moves least for the input, and without a number nothing goes on from there.

    Where an input has a law, or a `duration` (s) is given, the run is one in time: every input follows its law, else
    the file's constant acceleration, for the longest law or the duration; `steps` divide the time.

    With `jerk` the motion has third rates too (beside a change point, where they come from a polynomial through the
    branch, to about 1e-5 of the greatest). `motion.limits` are the dead points, change points and ends of strokes.
    A motion that ends before `stop` says so in its `outcome` and `reason`; its last row is the dead point itself, where
    no velocity is determined: rates are NaN there. One that takes too much work ends as well: more than 5,000 arcs of
    the curve of positions, and 100 more for each turn of the range. `progress(done, total)` is called while a long
    range is followed, in rad or m of the input's way. After `timeout` s, or a Ctrl-C, the motion ends where it is, with
    the outcome "interrupted". Raises BadInput for an input or a range that is not there, NoAnswer where there is no
    position to start from or nothing can move (see `planar.inspect`).

    >>> import planar
    >>> len(planar.cycle(planar.load("slider-crank"), steps=12))
    13
    """
    check_steps(steps)
    check_number("start", start, LARGEST_COUNTED_ANGLE)
    check_number("stop", stop, LARGEST_COUNTED_ANGLE)
    check_number("duration", duration, MAX_DURATION, "s")
    if duration is not None and not duration > 0.0:
        raise BadInput("duration", f"a time from zero on is wanted, not {duration!r:.40}")
    if not isinstance(branches, Iterable) or not all(_is_count(number) for number in branches):
        raise BadInput("branches", f"a list of numbers of branches from 1 on is wanted, not {branches!r:.60}")
    ranged = (start is not None, stop is not None, pair is not None, there_and_back, circuit)
    lawful = any(driven.law is not None for driven in mechanism.inputs)
    is_timed = duration is not None or (lawful and not any(ranged))
    known, count = solved_mechanism(mechanism), len(mechanism.inputs)
    if not count or known.is_rigid or (count > 1 and pair is None and not is_timed):
        known.check_motion(pair)
    if is_timed:
        if any(ranged):
            raise BadInput("duration", "a run in time has no range of one input; give the one or the other")
        return _explained_run(known, pair, lambda: run_in_time(mechanism, int(steps), duration, branches, jerk))
    if circuit and (stop is not None or there_and_back):
        raise BadInput("circuit", "a circuit goes all round; it has no end to stop at, and comes back by itself")

    def run() -> Motion:
        runner = RangeRun(mechanism, pair, branches, jerk, progress or report_progress)
        if circuit:
            return runner.run_circuit(int(steps), start)
        return runner.run_range(int(steps), start, stop, there_and_back)

    return _explained_run(known, pair, run)


def _is_count(number: object) -> bool:
    """Whether an argument is a number from 1 on, and no truth value."""
    return isinstance(number, Integral) and not isinstance(number, bool) and int(number) >= 1


def _explained_run(known: SolvedMechanism, pair: str | None, run: Callable[[], Motion]) -> Motion:
    """A run; where no input can run from the position, `motion_refusal` says why.

    Of a run in which every input stands still a remark says so.
    """
    try:
        motion = run()
    except NoAnswer as problem:
        raise known.motion_refusal(pair) or problem from None
    positions = [driven.position for driven in motion.inputs.values()]
    if any(np.ptp(position) for position in positions):
        return motion
    subject = "inputs" if len(positions) > 1 else "input"
    remark = f"nothing moves over the whole run, as the {subject} at {quote_names(list(motion.inputs))} "
    remark += f"stand{'' if len(positions) > 1 else 's'} still; give a velocity, a law or a range"
    return replace(motion, remarks=(*motion.remarks, remark))
