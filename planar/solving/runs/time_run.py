"""A run in time: every input by its own law, or at the file's velocity and acceleration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.jets import Jet, value_and_rates
from planar.foundation.root_finding import find_root
from planar.model.mechanism import Input, Mechanism
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation.change_point_remarks import change_point_remark
from planar.solving.continuation.events import STANDING_RATE, WatchedOutputs, watched_outputs
from planar.solving.continuation.path import FollowedSamples, follow_samples, follow_straight
from planar.solving.continuation.path_pieces import END_TOLERANCE, PathBifurcation
from planar.solving.position import solved_mechanism, stopped_at_start
from planar.solving.rates.sample_rates import InputRates, sample_rates
from planar.solving.runs.samples import RunSamples, build_motion, run_samples


class TimeRun:
    """All inputs of a mechanism at once, in time."""

    def __init__(self, mechanism: Mechanism, branches: Sequence[int], third: bool):
        self.known = solved_mechanism(mechanism)
        self.solver = self.known.solver
        self.branches, self.with_jerk = tuple(branches), third
        self.scale = np.array([self.solver.unit if self.solver.is_sliding(g.pair) else 1.0 for g in mechanism.inputs])
        self.assembly = self.known.assembly

    def run(self, steps: int, duration: float | None) -> Motion:
        """The run from the start of the laws to the end of the longest, or for a duration (s)."""
        laws = [given.law.duration for given in self.solver.mechanism.inputs if given.law is not None]
        if duration is None:
            if not laws:
                raise BadInput("duration", "no input has a law; say for how long (s) they run")
            duration = max(laws)
        time = np.linspace(0.0, duration, steps + 1)
        given = self.input_rates(time)
        known = None if self.with_jerk else (given.u1, given.u2)
        found = follow_samples(self.solver, self.solver.inputs.p, self.assembly.z, given.u, self.branches, known)
        if found.stopped is not None and len(found.z) < 2:
            problem = stopped_at_start(self.solver, self.assembly.z, found.stopped)
            if problem is not found.stopped:
                raise problem
        told = run_samples(found, given).with_problem(found.stopped)
        last = self._dead_point_time(found, given, time)
        time = time[: len(found.z)]
        if last is not None and found.last_position is not None:
            ends = self.input_rates(np.array([last]))._replace(u=found.last_position[1][None])
            whole = InputRates(*(np.vstack(both) for both in zip(told.inputs, ends, strict=True)))
            sure = told.fast_samples and told.fast_samples.padded(0, 1)
            told = told._replace(
                z=np.vstack([told.z, found.last_position[0]]),
                inputs=whole,
                dead_points=(len(told.z),) if told.outcome is Outcome.DEAD_POINT else (),
                fast_samples=sure,
            )
            time = np.append(time, last)
        return build_motion(self.solver, self.known.remarks, told, self.with_jerk, _TimeCourse(self, told, time), time)

    def _dead_point_time(self, found: FollowedSamples, given: InputRates, time: Array) -> float | None:
        """When a run comes to its dead point (s). Of several inputs that move there at once no time is told: between
        samples they are followed along a straight way, which is not theirs."""
        if (
            found.last_position is None
            or found.stopped is None
            or found.stopped.outcome
            not in (
                Outcome.DEAD_POINT,
                Outcome.STOP,
            )
        ):
            return None
        row = len(found.z) - 1
        moving = np.flatnonzero(given.u[row + 1] != given.u[row])
        if len(moving) != 1 or np.all(found.last_position[1] == given.u[row]):
            return None
        place = float(found.last_position[1][moving[0]])

        def left(t: float) -> float:
            return float(self.input_rates(np.array([t])).u[0, moving[0]]) - place

        return find_root(left, float(time[row]), float(time[row + 1]))

    def input_rates(self, time: Array) -> InputRates:
        """The inputs at times (s)."""
        parts = np.array([input_law_rates(each, time) for each in self.solver.mechanism.inputs])
        return InputRates(*(part.T / self.scale for part in parts.transpose(1, 0, 2)))


def input_law_rates(given: Input, time: Array) -> Array:
    """Position and first, second and third rate of an input (4, times)."""
    if given.law is not None:
        return np.asarray(given.law.evaluate(time, given.position, given.velocity))
    velocity = given.velocity + given.acceleration * time
    position = given.position + given.velocity * time + 0.5 * given.acceleration * time**2
    return np.array([position, velocity, np.full_like(time, given.acceleration), np.zeros_like(time)])


class _TimeCourse:
    """A run in time between its rows."""

    def __init__(self, timed: TimeRun, found: RunSamples, time: Array):
        self.timed, self.found, self.time = timed, found, time
        self.singular_rows = frozenset(found.branch_rates)
        self.fork_positions: tuple[float, ...] = ()

    @property
    def unknowns(self) -> Array:
        """See `FollowedPath.unknowns`."""
        return self.found.z

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        solver, found = self.timed.solver, self.found
        watched = watched_outputs(solver)
        met = list(self._change_point_times())
        switched = [at for at, each in met if each.passed.is_switched]
        told = list(self._stroke_ends(motion, watched, switched))
        for at, each in met:
            pair = next(g.pair for g, w in zip(solver.mechanism.inputs, each.input_direction, strict=True) if w)
            told.append(Limit("change point", pair, at, at, None, change_point_remark(solver, each)))
        for row in found.dead_points:
            moved = int(np.argmax(np.abs(found.inputs.u[row] - found.inputs.u[row - 1])))
            pair = solver.mechanism.inputs[moved].pair
            place = float(found.inputs.u[row, moved] * self.timed.scale[moved])
            told.append(Limit("input dead point", pair, float(self.time[row]), place))
        if found.outcome is Outcome.STOP:
            z, u, at = found.z[-1], found.inputs.u[-1], float(self.time[-1])
            told += [Limit("stop", each.pair, at, each.position) for each in solver.stops_at(z, u)]
        return tuple(sorted(told, key=lambda each: each.input))

    def _change_point_times(self) -> Iterator[tuple[float, PathBifurcation]]:
        """The change points passed, each with its time (s)."""
        row = 0
        for each in self.found.passed:
            gone = (self.found.inputs.u - each.u) @ each.input_direction
            for k in range(row, len(gone)):
                if abs(gone[k]) < END_TOLERANCE:
                    yield float(self.time[k]), each
                elif k + 1 < len(gone) and gone[k] * gone[k + 1] < 0.0 and abs(gone[k + 1]) >= END_TOLERANCE:

                    def left(t: float, each: PathBifurcation = each) -> float:
                        return float((self.timed.input_rates(np.array([t])).u[0] - each.u) @ each.input_direction)

                    yield find_root(left, float(self.time[k]), float(self.time[k + 1])), each
                else:
                    continue
                row = k + 1
                break

    def _stroke_ends(self, motion: Motion, watched: WatchedOutputs, switched: list[float]) -> Iterator[Limit]:
        rates_of = [np.asarray(list(motion.pair(pair.name).values())[1], dtype=float) for pair in watched.pairs]
        for pair, velocity in zip(watched.pairs, rates_of, strict=True):
            least = STANDING_RATE * max(float(np.nanmax(np.abs(velocity), initial=0.0)), STANDING_RATE)
            sure = np.flatnonzero(np.abs(velocity) > least)
            for before, after in pairwise(sure.tolist()):
                if velocity[before] * velocity[after] > 0.0 or after - before > 2:
                    continue  # a rest in between is no end of a stroke at one time
                first, last = float(self.time[before]), float(self.time[after])
                if any(first <= at <= last for at in switched):
                    continue  # it is the branch that turns, not the output
                base = after if before in self.found.branch_rates else before

                def output_velocity(t: float, row: int = base, name: str = pair.name) -> float:
                    return self._output_at(row, t, name)[1]

                at = find_root(output_velocity, first, last)
                value = self._output_at(base, at, pair.name)[0]
                yield Limit("stroke end", pair.name, at, value)

    def _output_at(self, row: int, time: float, pair: str) -> tuple[float, float]:
        """Position and velocity of an output at a time after a row."""
        solver = self.timed.solver
        given = self.timed.input_rates(np.array([time]))
        while row and row in self.singular_rows:
            row -= 1  # from a change point several ways lead on
        way = follow_straight(solver, solver.inputs.p, self.found.z[row], self.found.inputs.u[row], given.u[0])
        local = {0: way.branch_rates[1]} if 1 in way.branch_rates else {}
        parts = [
            part[0] * solver.scale for part in sample_rates(solver, way.z[-1:], given, local, False).coordinate_rates
        ]
        jets = [Jet(*(float(part[column]) for part in parts)) for column in range(len(parts[0]))]
        frames, own = frames_from_coordinates(jets, solver.column, solver.shapes, solver.pairs)
        position, velocity, *_ = value_and_rates(
            solver.relative_motions[pair].input_position_at(solver.shapes, frames, own)
        )
        return float(position), float(velocity)
