"""One input through its range while the others stand still: a turn, limit to limit, there and back, a circuit."""

from __future__ import annotations

from math import ceil, pi
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, TrackingEnd
from planar.foundation.time_limit import time_is_over
from planar.model.wording import join_all_names
from planar.results.motion import Motion
from planar.solving.continuation.fast_path import FastSamples, fast_run
from planar.solving.continuation.path import FollowedSamples, PathFollower, follow_samples, follow_to
from planar.solving.continuation.path_pieces import BranchRates, bifurcations_until
from planar.solving.continuation.predictor_corrector import (
    SHOWN_SLIDE_EXTENT,
    NearbyBifurcation,
)
from planar.solving.diagnosis import refusals
from planar.solving.position import stopped_at_start
from planar.solving.rates.regularity import moved_links
from planar.solving.rates.sample_rates import InputRates
from planar.solving.runs.closed_circuit import follow_circuit
from planar.solving.runs.range_limits import STEP_ROUNDING, RangeLimits
from planar.solving.runs.running_input import RunningInput
from planar.solving.runs.samples import (
    RunSamples,
    build_motion,
    drop_first,
    join_runs,
    reverse_run,
    run_samples,
    splice_runs,
)

RANGE_SAMPLES = 73
"""Places of a turn, or of the greatest travel of a slide, between which the range of an input ends."""
MIN_RANGE = 1e-5
"""rad or sizes: a range shorter than this is none."""


class _RangeEnd(NamedTuple):
    """An end of a range: the unknowns and the position at its last row, why it ends, None where the input goes on; the
    inputs beyond which it does not go, and the links that move there."""

    z: Array
    position: float
    ending: TrackingEnd | None
    limit: Array
    links: tuple[str, ...] = ()
    nearby: tuple[NearbyBifurcation, ...] = ()


class RangeRun(RunningInput):
    """The runs of one input while the others stand still."""

    def run_range(self, steps: int, start: float | None, stop: float | None, back: bool) -> Motion:
        """The run over a range, or over the one that the input has by itself; and back again if wanted."""
        here = float(self.u[self.index])
        if start is None and stop is None:
            return self._to_motion(self._whole_range(steps, here), back)
        first = here if start is None else start / self.scale
        if stop is not None or not self.is_sliding:
            last = first + 2.0 * pi if stop is None else stop / self.scale
            return self._to_motion(self._run(steps, first, last), back)
        end = self._range_end(
            follow_to(self.solver, self.p, self.assembly.z, self.u, self.inputs_at(first)), first, 1.0
        )
        grid = np.linspace(first, end.position, steps + 1)
        found = self._follow_positions(grid[:-1])
        if found.stopped is not None:
            return self._to_motion(self._with_stop_row(found, self.input_rates(grid)), back)
        whole = found._replace(
            z=np.vstack([found.z, end.z]), fast_samples=found.fast_samples and found.fast_samples.padded(0, 1)
        )
        dead = (steps,) if end.ending is TrackingEnd.DEAD_POINT else ()
        return self._to_motion(self._with_range_ends(run_samples(whole, self.input_rates(grid), dead), (end,)), back)

    def run_circuit(self, steps: int, start: float | None) -> Motion:
        """The whole circuit of the assembly, through its dead points, back to where it starts."""
        here = float(self.u[self.index])
        first = here if start is None else start / self.scale
        work = self.arc_budget(0.0)
        walk = self.curve_tracker(
            follow_to(self.solver, self.p, self.assembly.z, self.u, self.inputs_at(first)), first, work=work
        )
        if walk.point.regular_distance < MIN_RANGE and not walk.starts_on_bifurcation:
            told = "branches of the motion cross where the circuit would start; choose one by its number (`branches`,"
            raise BadInput("start", told + " --branch), or start it elsewhere")
        whole = follow_circuit(self.solver, walk)
        turn = np.inf if self.is_sliding else 2.0 * pi
        spacing = min(max(abs(each.ends[1] - each.ends[0]) for each in whole.branches), turn) / steps
        z: list[Array] = []
        places: list[float] = []
        senses: list[float] = []
        dead: list[int] = []
        local: dict[int, BranchRates] = {}
        for stretch in whole.branches:
            begin, last = stretch.ends
            count = max(1, ceil(abs(last - begin) / spacing - STEP_ROUNDING))
            for place in np.linspace(begin, last, count + 1)[1 if z else 0 :]:
                known, singular = stretch.unknowns_at(walk.curve, float(place))
                if singular is not None:
                    local[len(z)] = singular
                z.append(known)
                places.append(first + place)
                senses.append(1.0 if last > begin else -1.0)
            dead.append(len(z) - 1)
        ends = (0, *dead) if whole.starts_at_dead_point else tuple(dead[:-1])
        given = self.input_rates(np.array(places), np.array(senses))
        found = RunSamples(np.array(z), given, ends, local, bifurcations_until(walk), tuple(walk.nearby))
        limits = RangeLimits(self, found, (whole, walk))
        return build_motion(self.solver, self.known.remarks, found, self.with_jerk, limits)

    def _to_motion(self, found: RunSamples, back: bool) -> Motion:
        if back:
            found = join_runs(found, reverse_run(found)._replace(passed=(), nearby=()))
        return build_motion(self.solver, self.known.remarks, found, self.with_jerk, RangeLimits(self, found, None))

    def _run(self, steps: int, first: float, last: float) -> RunSamples:
        grid = np.linspace(first, last, steps + 1)
        given = self.input_rates(grid)
        self.current_budget = self.arc_budget(abs(last - first) + abs(first - float(self.u[self.index])), first)
        found = self._follow_positions(grid)
        return run_samples(found, given) if found.stopped is None else self._with_stop_row(found, given)

    def _follow_positions(self, grid: Array) -> FollowedSamples:
        """The run through places of the input in their order, followed from the file's own position.

        Raises NoAnswer where it does not come to the first of them.
        """
        here = float(self.u[self.index])
        sense = 1.0 if grid[-1] >= grid[0] else -1.0
        before = sense * grid < sense * here
        if not before.any():
            found = self._follow_from_file(grid)
            if len(found.z) < 2 and found.stopped is not None:
                raise self._stop_reason(found, found.stopped)
            return drop_first(found)
        down = self._follow_from_file(grid[before][::-1])
        if down.stopped is not None:
            raise self._stop_reason(down, down.stopped)
        return splice_runs(down, self._follow_from_file(grid[~before]))

    def _stop_reason(self, found: FollowedSamples, problem: NoAnswer) -> NoAnswer:
        """What to say of a run that stopped: of one that did not start, if it is a change point that it stands on."""
        return stopped_at_start(self.solver, self.assembly.z, problem) if len(found.z) < 2 else problem

    def _follow_from_file(self, grid: Array) -> FollowedSamples:
        here = self.u[self.index]
        given = self.input_rates(np.append(here, grid))
        rates = None if self.with_jerk else (given.u1, given.u2)
        return follow_samples(self.solver, self.p, self.assembly.z, given.u, self.branches, rates, self.current_budget)

    def _whole_range(self, steps: int, here: float) -> RunSamples:
        """One turn on where the input makes it, else all between its limits."""
        key = self.index, self.branches
        ends = self.known.range_ends.get(key)
        if ends is None:
            turn = None if self.is_sliding else self._one_turn(steps, here)
            if isinstance(turn, RunSamples):
                return turn
            high = turn or self._range_end(self.assembly.z, here, 1.0)
            ends = self._range_end(self.assembly.z, here, -1.0), high
            if not time_is_over():
                self.known.range_ends[key] = ends
        low, high = ends
        if high.position - low.position < MIN_RANGE:
            if TrackingEnd.INTERRUPTED in (low.ending, high.ending):
                raise refusals.motion_ended(
                    self.solver, (), self.solver.describe_input(self.pair, here), TrackingEnd.INTERRUPTED
                )
            self.solver.state(self.assembly.z)  # says why nothing goes on from a dead point or a change point
            at = self.solver.describe_input(self.pair, here)
            told = f"the input at {self.pair!r} can all but not move from {at}, as its motion ends close by both ways"
            raise NoAnswer(Outcome.DEAD_POINT, f"{told}; change a dimension, or drive another pair")
        # from within to the limits: from a limit two branches lead inwards
        grid = np.linspace(low.position, high.position, steps + 1)
        inner = grid[1:-1]
        found = self._quick_run(inner, here)
        if found is None:
            below, above = inner[inner < here][::-1], inner[inner >= here]
            down, up = self._follow_from_file(below), self._follow_from_file(above)
            for part, places in ((down, below), (up, above)):
                if part.stopped is not None and len(part.z) < 2:
                    raise self._stop_reason(part, part.stopped)
                if part.stopped is not None:
                    return self._with_stop_row(drop_first(part), self.input_rates(places[: len(part.z)]))
            found = splice_runs(down, up)
        local = {row + 1: each for row, each in found.branch_rates.items()}
        known = found.fast_samples and found.fast_samples.padded(1, 1)
        whole = found._replace(z=np.vstack([low.z, found.z, high.z]), branch_rates=local, fast_samples=known)
        dead = tuple(index for index, end in ((0, low), (steps, high)) if end.ending is TrackingEnd.DEAD_POINT)
        return self._with_range_ends(run_samples(whole, self.input_rates(grid), dead), (low, high))

    def _quick_run(self, places: Array, here: float) -> FollowedSamples | None:
        """A run through places on both sides of the file's own position, if all of it is surely sound."""
        at = int(np.searchsorted(places, here))
        sure = fast_run(self.solver, self.assembly.z, *self.input_rates(np.insert(places, at, here))[:3], at)
        if sure is None or len(sure.z) <= len(places):
            return None
        rows = np.arange(len(sure.z)) != at
        samples = FastSamples(sure.coordinate_rates[rows], sure.is_sure[rows], sure.residual)
        return FollowedSamples(sure.z[rows], 0, fast_samples=None if self.with_jerk else samples)

    def _one_turn(self, steps: int, here: float) -> RunSamples | _RangeEnd | None:
        """One turn on, if the input makes it; else the end of its range, if that is known."""
        places = np.linspace(here, here + 2.0 * pi, steps + 1)
        given = self.input_rates(places)
        sure = fast_run(self.solver, self.assembly.z, *given[:3])
        if sure is not None and len(sure.z) == steps + 1 and sure.is_sure.all() and not self.with_jerk:
            return RunSamples(
                sure.z, given, fast_samples=FastSamples(sure.coordinate_rates, sure.is_sure, sure.residual)
            )
        if sure is not None and len(sure.z) <= steps:
            # walking tells it sooner than a run would
            end = (
                self._end_beyond(sure.z, places)
                if self.solver.functions.is_sparse and len(sure.z)
                else self._find_range_end(self.assembly.z, here, 1.0, 2.0 * pi)
            )
            if end.ending is not None:
                return end
        found = self._run(steps, here, here + 2.0 * pi)
        return found if found.outcome in (Outcome.SOLVED, Outcome.INTERRUPTED) else None

    def _with_range_ends(self, found: RunSamples, ends: tuple[_RangeEnd, ...]) -> RunSamples:
        """Rows of a range that ends by itself, with what there is to say of its ends."""
        if found.outcome is not Outcome.SOLVED:
            return found
        reasons = []
        for ending in dict.fromkeys(end.ending for end in ends):
            alike = [end for end in ends if end.ending is ending]
            where = join_all_names(
                [self.solver.describe_input(self.pair, float(end.limit[self.index])) for end in alike]
            )
            if ending is TrackingEnd.DEAD_POINT:
                reasons.append(f"the range of {self.pair!r} ends at {where}")
            elif ending is TrackingEnd.STOP and self.solver.stops is not None:
                for end in alike:
                    where = self.solver.describe_input(self.pair, end.position)
                    met = self.solver.stops.describe_met(self.solver.stop_positions(end.z, end.limit))
                    reasons.append(f"the range of {self.pair!r} ends at {where}, where {met}")
            elif ending is not None:
                links = list(dict.fromkeys(link for end in alike for link in end.links))
                problem = refusals.motion_ended(self.solver, links, where, ending)
                found = found.with_problem(problem)
                reasons.append(problem.reason)
            if ending is TrackingEnd.ENDLESS:
                last = join_all_names([self.solver.describe_input(self.pair, end.position) for end in alike])
                reasons.append(f"the rows go as far as {last}")
        dead = tuple(row % len(found.z) for row in found.dead_points)
        missed = (*found.nearby, *(each for end in ends for each in end.nearby))
        return found._replace(dead_points=dead, nearby=missed, reason="; ".join(reasons))

    def _with_stop_row(self, found: FollowedSamples, given: InputRates) -> RunSamples:
        """A run that did not come to its end, with a last row where it stopped."""
        reached = run_samples(found, given)
        if found.last_position is None or found.stopped is None:
            return reached.with_problem(found.stopped)
        z, u = found.last_position
        ends_there = InputRates(u[None], *(each[-1:] for each in reached.inputs[1:]))
        if np.max(np.abs(u - reached.inputs.u[-1]), initial=0.0) == 0.0:
            dead = (len(reached.z) - 1,) if found.stopped.outcome is Outcome.DEAD_POINT else ()
            return reached._replace(dead_points=dead).with_problem(found.stopped)
        reached = reached._replace(
            z=np.vstack([reached.z, z]),
            inputs=InputRates(*(np.vstack(both) for both in zip(reached.inputs, ends_there, strict=True))),
            dead_points=(len(reached.z),),
            fast_samples=reached.fast_samples and reached.fast_samples.padded(0, 1),
        )
        return reached.with_problem(found.stopped)

    def _range_end(self, z: Array, here: float, sign: float) -> _RangeEnd:
        """Where the range of the input ends, one way from a position with unknowns z.

        Steps along a curve of many unknowns are short: it is followed only where samples are not surely sound.
        """
        far = SHOWN_SLIDE_EXTENT if self.is_sliding else 2.0 * pi
        if self.solver.functions.is_sparse:
            places = here + sign * np.linspace(0.0, far, RANGE_SAMPLES)
            u = np.array([self.inputs_at(place) for place in places])
            found = fast_run(self.solver, z, u, np.zeros_like(u), np.zeros_like(u))
            if found is not None and len(found.z):
                return self._end_beyond(found.z, places)
        return self._find_range_end(z, here, sign, far)

    def _end_beyond(self, samples: Array, places: Array) -> _RangeEnd:
        """The same beyond samples (samples, unknowns) that are surely sound, the first at some places of the input."""
        last = max(len(samples) - 2, 0)
        far = float(places[-1] - places[last])
        return self._find_range_end(samples[last], float(places[last]), 1.0 if far > 0.0 else -1.0, abs(far))

    def _find_range_end(self, z: Array, here: float, sign: float, far: float) -> _RangeEnd:
        """The same by following the curve so far."""
        start = self.inputs_at(here)
        trip = PathFollower(
            self.solver, self.p, z, start, self.inputs_at(here + sign) - start, self.branches, self.arc_budget(0.0)
        )
        found = trip.unknowns_at(far)
        if found is not None:
            if self.is_sliding:
                told = "the slide goes on without a limit; name where the range starts and stops"
                raise BadInput(self.pair, told)
            return _RangeEnd(found[0], here + sign * far, None, self.inputs_at(here + sign * far))
        limit, ending = trip.end_inputs
        last, u = trip.last_position or (z, start)
        links = tuple(moved_links(self.solver, trip.point.tangent[:-1]))
        return _RangeEnd(last, float(u[self.index]), ending, limit, links, tuple(trip.tracker.nearby))
