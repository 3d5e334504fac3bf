"""A run in time: every input by its own law, or at the file's velocity and acceleration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.jets import value_and_rates
from planar.foundation.root_finding import find_root
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation.events import STANDING_RATE, change_point_remark, watched_outputs
from planar.solving.continuation.path import follow_samples
from planar.solving.continuation.predictor_corrector import END_TOLERANCE, PassedBifurcation
from planar.solving.continuation.run_samples import RunSamples
from planar.solving.position import PositionSolver, solved_mechanism, stopped_at_start
from planar.solving.runs.continuous_run import ContinuousRun, timed_inputs
from planar.solving.runs.samples import build_motion


def run_in_time(
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
    return build_motion(solver, known.remarks, run, with_jerk, time, _TimeLimits(solver, run, time).find)


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


@dataclass(eq=False)
class _TimeLimits:
    """Looks for the limits of a run in time between its rows."""

    solver: PositionSolver
    run: RunSamples
    time: Array

    def find(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        solver, run = self.solver, self.run
        passages = list(self._change_point_times())
        limits = list(self._stroke_ends(motion, [time for time, passed in passages if passed.is_switched]))
        for time, passed in passages:
            pair = solver.mechanism.inputs[int(np.flatnonzero(passed.input_direction)[0])].pair
            limits.append(Limit("change point", pair, time, time, None, change_point_remark(solver, passed)))
        for row in run.dead_points:
            index = int(np.argmax(np.abs(run.inputs.u[row] - run.inputs.u[row - 1])))
            pair = solver.mechanism.inputs[index].pair
            position = float(run.inputs.u[row, index]) * (solver.unit if solver.is_sliding(pair) else 1.0)
            limits.append(Limit("input dead point", pair, float(self.time[row]), position))
        if run.outcome is Outcome.STOP:
            for stop in solver.stops_at(run.z[-1], run.inputs.u[-1]):
                limits.append(Limit("stop", stop.pair, float(self.time[-1]), stop.position))
        return tuple(sorted(limits, key=lambda limit: limit.input))

    def _change_point_times(self) -> Iterator[tuple[float, PassedBifurcation]]:
        """The change points passed, each with its time (s)."""
        row = 0
        for passed in self.run.passed:
            distance = (self.run.inputs.u - passed.u) @ passed.input_direction
            for k in range(row, len(distance)):
                after = distance[k + 1] if k + 1 < len(distance) else 0.0
                if abs(distance[k]) < END_TOLERANCE:
                    time = float(self.time[k])
                elif distance[k] * after < 0.0 and abs(after) >= END_TOLERANCE:
                    time = _time_at(self.solver, passed.u, passed.input_direction, self.time[k], self.time[k + 1])
                else:
                    continue
                yield time, passed
                row = k + 1
                break

    def _stroke_ends(self, motion: Motion, switch_times: list[float]) -> Iterator[Limit]:
        """The ends of the strokes of all outputs."""
        if len(motion) < 2:
            return
        run = ContinuousRun(motion)
        for output in watched_outputs(self.solver):

            def velocity(motion: Motion, output: Pair = output) -> Array:
                return _output_rates(motion, output)[1]

            of_rows = velocity(motion)
            threshold = STANDING_RATE * max(float(np.nanmax(np.abs(of_rows), initial=0.0)), STANDING_RATE)
            brackets = [
                (before, after)
                for before, after in pairwise(np.flatnonzero(np.abs(of_rows) > threshold).tolist())
                # a rest in between is no end of a stroke at one time
                if of_rows[before] * of_rows[after] <= 0.0
                and after - before <= 2
                # nor is a change of the branch, which is what turns there
                and not any(self.time[before] <= time <= self.time[after] for time in switch_times)
            ]
            if brackets:
                rows = np.array(brackets).T
                times = run.roots(velocity, tuple(self.time[rows]), tuple(of_rows[rows]), np.zeros(len(brackets)))
                positions = _output_rates(run.motion_at(times), output)[0]
                yield from (
                    Limit("stroke end", output.name, time, position)
                    for time, position in zip(times.tolist(), positions.tolist(), strict=True)
                )


def _output_rates(motion: Motion, output: Pair) -> list[Array]:
    """Position, velocity and acceleration of an output at all rows of a motion (rows,)."""
    rates = value_and_rates(output.input_position_at(motion.shapes, motion.frames, motion.own))
    return [np.broadcast_to(rate, (len(motion),)) for rate in rates]
