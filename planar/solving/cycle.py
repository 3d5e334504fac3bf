"""A motion: one input through its range while the others stand still, or all inputs in time by their laws."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import ceil, pi
from numbers import Integral
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, NoAnswer, Outcome, TrackingEnd
from planar.foundation.jets import value_and_rates
from planar.foundation.root_finding import find_root
from planar.foundation.time_limit import report_progress, returns_part_in_time, time_is_over
from planar.model.mechanism import (
    LARGEST_COUNTED_ANGLE,
    LARGEST_INPUT_POSITION,
    Drive,
    Mechanism,
    replace_inputs,
    running_input_index,
)
from planar.model.pairs import Pair
from planar.model.run_arguments import check_number, check_steps
from planar.model.wording import join_all_names, quote_names
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation.events import (
    STANDING_RATE,
    LimitSearch,
    LocatedLimit,
    change_point_remark,
    distinct_limits,
    watched_outputs,
)
from planar.solving.continuation.fast_path import (
    BranchRates,
    InputRates,
    RunSamples,
    fast_run,
    join_runs,
    resting_inputs,
    unjudged_rows,
)
from planar.solving.continuation.path import PathFollower, follow_circuit, follow_samples, follow_to, piece_at
from planar.solving.continuation.predictor_corrector import (
    END_TOLERANCE,
    MAX_ARCS,
    SHOWN_SLIDE_EXTENT,
    ArcBudget,
    CurveTracker,
    NearbyBifurcation,
    PassedBifurcation,
)
from planar.solving.diagnosis import refusals
from planar.solving.position import PositionSolver, solved_mechanism, stopped_at_start
from planar.solving.samples import ContinuousRun, build_motion, timed_inputs

MAX_DURATION = 1e6
"""s"""
RANGE_SAMPLES = 73
"""Places of a turn, or of the greatest travel of a slide, between which the range of an input ends."""
MIN_RANGE = 1e-5
"""rad or sizes: a range shorter than this is none."""
ARCS_PER_TURN = 100
"""Arcs by which what may be spent grows with each turn that is asked for, as far as a motion is followed at most."""
STEP_ROUNDING = 1e-9
"""Parts of a step: what rounding leaves of one."""
Progress = Callable[[float, float], None]


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

    Where branches of the motion cross, it goes on smoothly; `branches` are the numbers of those taken at the first,
    second ... change point instead, counted from the file's position in each direction: 1 smoothly, 2 the next by the
    angle from that. At a start on a dead point they number its two branches, at one on a change point those through
    it, first that on which the rest moves least for the input, and without a number nothing goes on from there.

    Where an input has a law, or a `duration` (s) is given, the run is one in time: every input follows its law, else
    the file's constant acceleration, for the longest law or the duration; `steps` divide the time.

    With `jerk` the motion has third rates too (beside a change point, where they come from a polynomial through the
    branch, to about 1e-5 of the greatest). `motion.limits` are the dead points, change points and ends of strokes.
    A motion that ends before `stop` says so in its `outcome` and `reason`; its last row is the dead point itself, where
    no velocity is determined: rates are NaN there. One that takes too much work ends as well: more than 5,000 arcs of
    the curve of positions, and 100 more for each turn of the range. `progress(done, total)` is called while a long
    range is followed, in rad or m of the input's travel. After `timeout` s, or a Ctrl-C, the motion ends where it is,
    with the outcome "interrupted". Raises BadInput for an input or a range that is not there, NoAnswer where there is
    no position to start from or nothing can move (see `planar.inspect`).

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


class _RangeEnd(NamedTuple):
    """An end of a range: the unknowns and the position at its last row, why it ends, None where the input goes on; the
    inputs beyond which it does not go, and how the unknowns move there."""

    z: Array
    position: float
    ending: TrackingEnd | None
    limit: Array
    rates: Array
    nearby: tuple[NearbyBifurcation, ...] = ()


class RangeRun:
    """The runs of one input while the others stand still.

    `progress(done, total)` is called now and then, in rad or m of the input's travel.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        pair: str | None,
        branches: Sequence[int],
        with_jerk: bool,
        progress: Progress | None = None,
    ):
        names = [driven.pair for driven in mechanism.inputs]
        self.index = running_input_index(mechanism, pair)
        still = tuple(Drive(name, None, 0.0, 0.0) for k, name in enumerate(names) if k != self.index)
        self.known = solved_mechanism(replace_inputs(mechanism, still))
        self.solver = self.known.solver
        self.pair = names[self.index]
        self.is_sliding = self.solver.is_sliding(self.pair)
        self.scale = self.solver.unit if self.is_sliding else 1.0
        self.u = self.solver.inputs.u
        self.position = float(self.u[self.index])
        "the file's own, from which all others are followed"
        self.branches, self.with_jerk = tuple(branches), with_jerk
        self.z = self.known.assembly.z
        self.progress = progress
        self.current_budget = self.arc_budget(0.0)

    def input_rates(self, positions: Array, senses: Array | float = 1.0) -> InputRates:
        """The inputs over a run, each row with the file's rates; backwards the velocity turns round."""
        s, count = self.solver.inputs, len(positions)
        u1, u2 = (np.repeat(rate[None], count, axis=0) for rate in (s.u1, s.u2))
        return InputRates(self.inputs_at(positions), u1 * np.reshape(senses, (-1, 1)), u2, np.zeros_like(u1))

    def inputs_at(self, positions: Array | float) -> Array:
        """The inputs where the one that runs is at a position, or at positions (positions, inputs)."""
        inputs = np.tile(self.u, (*np.shape(positions), 1))
        inputs[..., self.index] = positions
        return inputs

    def arc_budget(self, reach: float, first: float | None = None) -> ArcBudget:
        """What may be spent on a travel of the input; reports how far from `first` it has come."""
        report = None
        if self.progress is not None and first is not None:
            inform, total = self.progress, reach * self.scale

            def report(u: Array) -> None:
                inform(min(abs(float(u[self.index]) - first) * self.scale, total), total)

        return ArcBudget(MAX_ARCS + int(ARCS_PER_TURN * min(reach, LARGEST_INPUT_POSITION) / (2.0 * pi)), report)

    def curve_tracker(
        self, z: Array, first: float, sense: float = 1.0, budget: ArcBudget | None = None
    ) -> CurveTracker:
        """A tracker from a position of the input, in the direction in which it goes on."""
        axis = np.zeros_like(self.u)
        axis[self.index] = sense
        return CurveTracker(self.solver, z, self.inputs_at(first), axis, self.branches, budget)

    def run_range(self, steps: int, start: float | None, stop: float | None, back: bool) -> Motion:
        """The run over a range, or over all that the input can make; and back again if `back`."""
        run = self._range(steps, start, stop)
        if back:
            run = join_runs([run, run.reversed().from_row(1)._replace(passed=(), nearby=())])
        return self._motion(run, lambda: self._range_limits(run.inputs.u[:, self.index]))

    def _range(self, steps: int, start: float | None, stop: float | None) -> RunSamples:
        if start is None and stop is None:
            return self._total_range(steps)
        first = self.position if start is None else start / self.scale
        if stop is not None or not self.is_sliding:
            return self._run(np.linspace(first, first + 2.0 * pi if stop is None else stop / self.scale, steps + 1))
        end = self._range_end(follow_to(self.solver, self.z, self.u, self.inputs_at(first)), first, 1.0)
        grid = np.linspace(first, end.position, steps + 1)
        run = self._follow_positions(grid[:-1])
        return self._with_stop_row(run) if run.stopped is not None else self._with_range_ends(run, None, end)

    def run_circuit(self, steps: int, start: float | None) -> Motion:
        """The circuit of the assembly, through its dead points, back to where it starts."""
        first = self.position if start is None else start / self.scale
        z = follow_to(self.solver, self.z, self.u, self.inputs_at(first))
        tracker = self.curve_tracker(z, first, budget=self.arc_budget(0.0))
        if tracker.point.regular_distance < MIN_RANGE and not tracker.starts_on_bifurcation:
            problem = "branches of the motion cross where the circuit would start; choose one by its number"
            raise BadInput("start", f"{problem} (`branches`, --branch), or start it elsewhere")
        circuit = follow_circuit(tracker)
        turn = np.inf if self.is_sliding else 2.0 * pi
        spacing = min(max(abs(branch[-1].stop - branch[0].start) for branch in circuit.branches), turn) / steps
        rows: list[tuple[Array, float, float]] = []
        branch_rates: dict[int, BranchRates] = {}
        dead_points = [0] if circuit.starts_at_dead_point else []
        for branch in circuit.branches:
            begin, last = branch[0].start, branch[-1].stop
            count = max(1, ceil(abs(last - begin) / spacing - STEP_ROUNDING))
            for place in np.linspace(begin, last, count + 1)[1 if rows else 0 :].tolist():
                z, rates = piece_at(branch, place).unknowns_at(tracker.curve, place)
                if rates is not None:
                    branch_rates[len(rows)] = rates
                rows.append((z, first + place, 1.0 if last > begin else -1.0))
            dead_points.append(len(rows) - 1)
        z, positions, senses = (np.array(column) for column in zip(*rows, strict=True))
        run = unjudged_rows(self.solver, z, self.input_rates(positions, senses))._replace(
            dead_points=tuple(dead_points if circuit.starts_at_dead_point else dead_points[:-1]),
            branch_rates=branch_rates,
            passed=tracker.passed_until(),
            nearby=tuple(tracker.nearby),
        )

        def find_limits() -> tuple[Limit, ...]:
            search = LimitSearch(self.pair, first, 1.0, tracker)
            return distinct_limits(self.pair, tracker.curve, search.along(circuit.pieces))

        return self._motion(run, find_limits)

    def _motion(self, run: RunSamples, find_limits: Callable[[], tuple[Limit, ...]]) -> Motion:
        """The motion of a run, and what searches for its limits."""
        forks = tuple(float(passed.u[self.index]) * self.scale for passed in run.passed if passed.is_switched)
        limits = find_limits if len(run.z) > 1 else tuple
        return build_motion(self.solver, self.known.remarks, run, self.with_jerk, None, lambda _: limits(), forks)

    def _range_limits(self, positions: Array) -> tuple[Limit, ...]:
        """The limits between the first row and the last, followed from the same position as these: by the same branches
        at change points."""
        is_there_and_back = len(positions) > 2 and positions[0] == positions[-1] and positions[1] == positions[-2]
        last = float(positions[(len(positions) - 1) // 2 if is_there_and_back else -1])
        first, sense = float(positions[0]), 1.0 if last >= positions[0] else -1.0
        down, up = self._limits_until(first, -sense), self._limits_until(last, sense)
        low, high = sorted((first * self.scale, last * self.scale))
        room = STEP_ROUNDING * self.scale
        between = [located for located in (*down[::-1], *up) if low - room <= located.limit.input <= high + room]
        return distinct_limits(self.pair, self.curve_tracker(self.z, self.position).curve, between)

    def _limits_until(self, last: float, sense: float) -> list[LocatedLimit]:
        """The limits from the file's position to one in this direction; at the file's position its stops."""
        reach = sense * (last - self.position)
        if reach < -STEP_ROUNDING or (reach <= 0.0 and self.solver.stops is None):
            return []
        reach = max(reach, 0.0)
        tracker = self.curve_tracker(self.z, self.position, sense, self.arc_budget(reach, self.position))
        # all with the input increasing, in whichever direction it was followed
        search = LimitSearch(self.pair, self.position, sense, tracker)
        return [located.in_direction(sense) for located in search.until(reach)]

    def _run(self, grid: Array) -> RunSamples:
        first, last = float(grid[0]), float(grid[-1])
        self.current_budget = self.arc_budget(abs(last - first) + abs(first - self.position), first)
        run = self._follow_positions(grid)
        return run if run.stopped is None else self._with_stop_row(run)

    def _follow_positions(self, grid: Array) -> RunSamples:
        """The run through places of the input in their order, followed from the file's own position.

        Raises NoAnswer where it does not come to the first of them.
        """
        sense = 1.0 if grid[-1] >= grid[0] else -1.0
        is_before = sense * grid < sense * self.position
        if not is_before.any():
            return self._rows(self._follow_from_file(grid))
        back = self._follow_from_file(grid[is_before][::-1])
        if back.stopped is not None:
            self._rows(back)
            raise back.stopped
        return _spliced(back, self._follow_from_file(grid[~is_before]))

    def _rows(self, run: RunSamples) -> RunSamples:
        """A run without its first position, which is no row. Raises NoAnswer where there is no other."""
        if len(run.z) < 2 and run.stopped is not None:
            raise stopped_at_start(self.solver, self.z, run.stopped)
        return run.from_row(1)

    def _follow_from_file(self, grid: Array) -> RunSamples:
        inputs = self.input_rates(np.append(self.position, grid))
        return follow_samples(self.solver, self.z, inputs, self.branches, self.current_budget)

    def _total_range(self, steps: int) -> RunSamples:
        """One turn on where the input makes it, else all between its limits."""
        key = self.index, self.branches
        ends = self.known.range_ends.get(key)
        if ends is None:
            turn = None if self.is_sliding else self._one_turn(steps)
            if isinstance(turn, RunSamples):
                return turn
            high = turn or self._range_end(self.z, self.position, 1.0)
            ends = self._range_end(self.z, self.position, -1.0), high
            if not time_is_over():
                self.known.range_ends[key] = ends
        low, high = ends
        if high.position - low.position < MIN_RANGE:
            self._refuse_short_range(low, high)
        # from within to the limits: from a limit two branches lead inwards
        grid = np.linspace(low.position, high.position, steps + 1)
        inner = grid[1:-1]
        run = self._quick_run(inner)
        if run is None:
            is_below = inner < self.position
            down, up = (self._follow_from_file(places) for places in (inner[is_below][::-1], inner[~is_below]))
            for part in (down, up):
                if part.stopped is not None:
                    return self._with_stop_row(self._rows(part))
            run = _spliced(down, up)
        return self._with_range_ends(run, low, high)

    def _refuse_short_range(self, low: _RangeEnd, high: _RangeEnd) -> None:
        """Raise NoAnswer for a range whose ends are all but one."""
        place = self.solver.describe_input(self.pair, self.position)
        if TrackingEnd.INTERRUPTED in (low.ending, high.ending):
            raise refusals.motion_ended(self.solver, (), place, TrackingEnd.INTERRUPTED)
        self.solver.state(self.z)  # says why nothing goes on from a dead point or a change point
        problem = f"the input at {self.pair!r} can all but not move from {place}, as its motion ends close by both ways"
        raise NoAnswer(Outcome.DEAD_POINT, f"{problem}; change a dimension, or drive another pair")

    def _quick_run(self, places: Array) -> RunSamples | None:
        """A run through places on both sides of the file's own position, if all of it is surely sound."""
        start = int(np.searchsorted(places, self.position))
        run = fast_run(self.solver, self.z, self.input_rates(np.insert(places, start, self.position)), start)
        if run is None or len(run.z) <= len(places):
            return None
        return run.select(np.delete(np.arange(len(run.z)), start))

    def _one_turn(self, steps: int) -> RunSamples | _RangeEnd | None:
        """One turn on, if the input makes it; else the end of its range, if that is known."""
        places = np.linspace(self.position, self.position + 2.0 * pi, steps + 1)
        quick = fast_run(self.solver, self.z, self.input_rates(places))
        if quick is not None and len(quick.z) == steps + 1 and quick.is_sure.all():
            return quick
        if quick is not None and len(quick.z) <= steps:
            # the curve shows it sooner than a run would
            end = self._find_range_end(quick if self.solver.functions.is_sparse else None, self.z, places)
            if end.ending is not None:
                return end
        run = self._run(places)
        return run if run.outcome in (Outcome.SOLVED, Outcome.INTERRUPTED) else None

    def _with_range_ends(self, run: RunSamples, low: _RangeEnd | None, high: _RangeEnd) -> RunSamples:
        """The rows between the ends of a range with those at the ends, and what there is to say of these; without the
        lower one the range does not start there by itself."""
        ends = [end for end in (low, high) if end is not None]
        parts = [
            unjudged_rows(self.solver, end.z[None], self.input_rates(np.array([end.position])))._replace(
                dead_points=(0,) if end.ending is TrackingEnd.DEAD_POINT else ()
            )
            for end in ends
        ]
        run = join_runs([*parts[:-1], run, parts[-1]])
        reasons = []
        for ending in dict.fromkeys(end.ending for end in ends):
            alike = [end for end in ends if end.ending is ending]
            positions = [self.solver.describe_input(self.pair, float(end.limit[self.index])) for end in alike]
            last_rows = [self.solver.describe_input(self.pair, end.position) for end in alike]
            where = join_all_names(positions)
            if ending is TrackingEnd.DEAD_POINT:
                reasons.append(f"the range of {self.pair!r} ends at {where}")
            elif ending is TrackingEnd.STOP and self.solver.stops is not None:
                for end, place in zip(alike, last_rows, strict=True):
                    met = self.solver.stops.describe_met(self.solver.stop_positions(end.z, end.limit))
                    reasons.append(f"the range of {self.pair!r} ends at {place}, where {met}")
            elif ending is not None:
                problem = refusals.motion_ended(self.solver, [end.rates for end in alike], where, ending)
                run = run._replace(stopped=problem)
                reasons.append(problem.reason)
            if ending is TrackingEnd.ENDLESS:
                reasons.append(f"the rows go as far as {join_all_names(last_rows)}")
        nearby = (*run.nearby, *(near for end in ends for near in end.nearby))
        return run._replace(nearby=nearby, reason="; ".join(reasons))

    def _with_stop_row(self, run: RunSamples) -> RunSamples:
        """A run that did not come to its end, with a last row where it stopped."""
        if run.last_position is None or run.stopped is None:
            return run
        z, u = run.last_position
        if np.max(np.abs(u - run.inputs.u[-1]), initial=0.0) == 0.0:
            is_dead_point = run.stopped.outcome is Outcome.DEAD_POINT
            return run._replace(dead_points=(len(run.z) - 1,) if is_dead_point else ())
        return run.with_last_row(z, InputRates(u[None], *(rate[-1:] for rate in run.inputs[1:])), True)

    def _range_end(self, z: Array, first: float, sense: float) -> _RangeEnd:
        """Where the range of the input ends in one direction from a position with unknowns z.

        Steps along a curve of many unknowns are short: it is followed only where samples are not surely sound.
        """
        reach = SHOWN_SLIDE_EXTENT if self.is_sliding else 2.0 * pi
        places = first + sense * np.linspace(0.0, reach, RANGE_SAMPLES)
        is_sparse = self.solver.functions.is_sparse
        quick = fast_run(self.solver, z, resting_inputs(self.inputs_at(places))) if is_sparse else None
        return self._find_range_end(quick, z, places)

    def _find_range_end(self, quick: RunSamples | None, z: Array, places: Array) -> _RangeEnd:
        """The same towards the last of some places of the input, from unknowns z at the first, or from the last rows of
        a run through them that are surely sound."""
        row = 0
        if quick is not None and len(quick.z):
            row = max(len(quick.z) - 2, 0)
            z = quick.z[row]
        first, last = float(places[row]), float(places[-1])
        start, sense = self.inputs_at(first), 1.0 if last > first else -1.0
        direction = self.inputs_at(first + sense) - start
        follower = PathFollower(self.solver, z, start, direction, self.branches, self.arc_budget(0.0))
        end = follower.unknowns_at(abs(last - first))
        if end is not None:
            if self.is_sliding:
                problem = "the slide goes on without a limit; name where the range starts and stops"
                raise BadInput(self.pair, problem)
            return _RangeEnd(end[0], last, None, self.inputs_at(last), np.zeros(len(z)))
        limit, ending = follower.tracker.end_inputs
        z, u = follower.last_position or (z, start)
        point, nearby = follower.tracker.point, tuple(follower.tracker.nearby)
        return _RangeEnd(z, float(u[self.index]), ending, limit, point.tangent[:-1], nearby)


def _spliced(back: RunSamples, ahead: RunSamples) -> RunSamples:
    """Two runs from one position, which is no row, as one through it: the first backwards, then the second."""
    backwards: IntArray = np.arange(len(back.z) - 1, 0, -1)
    first = back.select(backwards)._replace(passed=back.passed[::-1])
    return join_runs([first, ahead.from_row(1)])
