"""A motion: positions along the curve on which an assembly lies, or in time by the laws of its inputs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from numbers import Integral

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.jets import value_and_rates
from planar.foundation.root_finding import find_root
from planar.foundation.time_limit import report_progress, returns_part_in_time
from planar.model.mechanism import LARGEST_COUNTED_ANGLE, Mechanism
from planar.model.pairs import Pair
from planar.model.run_arguments import check_number, check_steps
from planar.model.wording import quote_names
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation.events import STANDING_RATE, change_point_remark, watched_outputs
from planar.solving.continuation.fast_path import RunSamples
from planar.solving.continuation.path import follow_samples
from planar.solving.continuation.predictor_corrector import END_TOLERANCE, PassedBifurcation
from planar.solving.position import PositionSolver, solved_mechanism, stopped_at_start
from planar.solving.runs.range_run import Progress, RangeRun
from planar.solving.runs.samples import ContinuousRun, build_motion, timed_inputs

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
    if is_timed and any(ranged):
        raise BadInput("duration", "a run in time has no range of one input; give the one or the other")
    if circuit and (stop is not None or there_and_back):
        raise BadInput("circuit", "a circuit goes all round; it has no end to stop at, and comes back by itself")
    try:
        if is_timed:
            motion = _run_in_time(mechanism, int(steps), duration, branches, jerk)
        else:
            runner = RangeRun(mechanism, pair, branches, jerk, progress or report_progress)
            motion = (
                runner.run_circuit(int(steps), start)
                if circuit
                else runner.run_range(int(steps), start, stop, there_and_back)
            )
    except NoAnswer as problem:
        raise known.motion_refusal(pair) or problem from None
    names = list(motion.inputs)
    if any(np.ptp(driven.position) for driven in motion.inputs.values()):
        return motion
    remark = f"nothing moves over the whole run, as the input{'s' * (len(names) > 1)} at {quote_names(names)} "
    remark += f"stand{'' if len(names) > 1 else 's'} still; give a velocity, a law or a range"
    return replace(motion, remarks=(*motion.remarks, remark))


def _is_count(number: object) -> bool:
    """Whether an argument is a number from 1 on, and no truth value."""
    return isinstance(number, Integral) and not isinstance(number, bool) and int(number) >= 1


def _run_in_time(
    mechanism: Mechanism, steps: int, duration: float | None, branches: Sequence[int], with_jerk: bool
) -> Motion:
    """The run from the start of the laws to the end of the longest, or for a duration (s)."""
    known = solved_mechanism(mechanism)
    solver, z = known.solver, known.assembly.z
    laws = [driven.law.duration for driven in mechanism.inputs if driven.law is not None]
    if duration is None:
        if not laws:
            raise BadInput("duration", "no input has a law; say for how long (s) they run")
        duration = max(laws)
    time = np.linspace(0.0, duration, steps + 1)
    run = follow_samples(solver, z, timed_inputs(solver, time), tuple(branches))
    if run.stopped is not None and len(run.z) < 2:
        problem = stopped_at_start(solver, z, run.stopped)
        if problem is not run.stopped:
            raise problem
    last = _stop_time(solver, run, time)
    time = time[: len(run.z)]
    if last is not None and run.last_position is not None:
        z, u = run.last_position
        inputs = timed_inputs(solver, np.array([last]))._replace(u=u[None])
        run = run.with_last_row(z, inputs, run.outcome is Outcome.DEAD_POINT)
        time = np.append(time, last)
    return build_motion(solver, known.remarks, run, with_jerk, time, partial(_time_limits, solver, run, time))


def _stop_time(solver: PositionSolver, run: RunSamples, time: Array) -> float | None:
    """When a run comes to its dead point or stop (s). Of several inputs that move there at once no time is reported:
    between samples they are followed along a straight line, which is not their path."""
    if run.last_position is None or run.outcome not in (Outcome.DEAD_POINT, Outcome.STOP):
        return None
    row, (_, u) = len(run.z) - 1, run.last_position
    moves = timed_inputs(solver, time[row : row + 2]).u[1] != run.inputs.u[row]
    if np.count_nonzero(moves) != 1 or np.all(u == run.inputs.u[row]):
        return None
    return _time_at(solver, u, moves.astype(float), time[row], time[row + 1])


def _time_at(solver: PositionSolver, u: Array, direction: Array, first: float, last: float) -> float:
    """When between two times (s) the inputs are at u along a direction."""

    def distance(t: float) -> float:
        return float((timed_inputs(solver, np.array([t])).u[0] - u) @ direction)

    return find_root(distance, float(first), float(last))


def _time_limits(solver: PositionSolver, run: RunSamples, time: Array, motion: Motion) -> tuple[Limit, ...]:
    """The limits of a run in time, between its rows too; see `Motion.limits`."""
    passages = list(_change_point_times(solver, run, time))
    limits = list(_stroke_ends(solver, motion, [moment for moment, passed in passages if passed.is_switched]))
    for moment, passed in passages:
        pair = solver.mechanism.inputs[int(np.flatnonzero(passed.input_direction)[0])].pair
        limits.append(Limit("change point", pair, moment, moment, None, change_point_remark(solver, passed)))
    for row in run.dead_points:
        index = int(np.argmax(np.abs(run.inputs.u[row] - run.inputs.u[row - 1])))
        position = float(run.inputs.u[row, index] * solver.input_scale[index])
        limits.append(Limit("input dead point", solver.mechanism.inputs[index].pair, float(time[row]), position))
    if run.outcome is Outcome.STOP:
        for stop in solver.stops_at(run.z[-1], run.inputs.u[-1]):
            limits.append(Limit("stop", stop.pair, float(time[-1]), stop.position))
    return tuple(sorted(limits, key=lambda limit: limit.input))


def _change_point_times(
    solver: PositionSolver, run: RunSamples, time: Array
) -> Iterator[tuple[float, PassedBifurcation]]:
    """The change points passed, each with its time (s)."""
    row = 0
    for passed in run.passed:
        distance = np.append((run.inputs.u - passed.u) @ passed.input_direction, 0.0)
        for k in range(row, len(distance) - 1):
            if abs(distance[k]) < END_TOLERANCE:
                moment = float(time[k])
            elif distance[k] * distance[k + 1] < 0.0 and abs(distance[k + 1]) >= END_TOLERANCE:
                moment = _time_at(solver, passed.u, passed.input_direction, time[k], time[k + 1])
            else:
                continue
            yield moment, passed
            row = k + 1
            break


def _stroke_ends(solver: PositionSolver, motion: Motion, switch_times: list[float]) -> Iterator[Limit]:
    """The ends of the strokes of all outputs."""
    if len(motion) < 2:
        return
    run = ContinuousRun(motion)
    for output in watched_outputs(solver):

        def velocity(motion: Motion, output: Pair = output) -> Array:
            return _output_rates(motion, output)[1]

        speeds = velocity(motion)
        threshold = STANDING_RATE * max(float(np.nanmax(np.abs(speeds), initial=0.0)), STANDING_RATE)
        brackets = [
            (before, after)
            for before, after in pairwise(np.flatnonzero(np.abs(speeds) > threshold).tolist())
            # a rest in between is no end of a stroke at one time
            if speeds[before] * speeds[after] <= 0.0
            and after - before <= 2
            # nor is a change of the branch, which is what turns there
            and not any(run.rows[before] <= moment <= run.rows[after] for moment in switch_times)
        ]
        if brackets:
            rows = np.array(brackets).T
            times = run.roots(velocity, tuple(run.rows[rows]), tuple(speeds[rows]), np.zeros(len(brackets)))
            positions = _output_rates(run.motion_at(times), output)[0]
            for moment, position in zip(times.tolist(), positions.tolist(), strict=True):
                yield Limit("stroke end", output.name, moment, position)


def _output_rates(motion: Motion, output: Pair) -> list[Array]:
    """Position, velocity and acceleration of an output at all rows of a motion (rows,)."""
    rates = value_and_rates(output.input_position_at(motion.shapes, motion.frames, motion.own))
    return [np.broadcast_to(rate, (len(motion),)) for rate in rates]
