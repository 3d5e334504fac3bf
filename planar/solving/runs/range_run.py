"""One input through its range while the others stand still: a turn, limit to limit, there and back, a circuit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import ceil, pi
from typing import NamedTuple

import numpy as np

from planar.foundation.errors import BadInput, Ending, NoAnswer, Outcome
from planar.model.mechanism import FARTHEST, Drive, Mechanism, running_input, with_inputs
from planar.model.wording import listed
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation import events as limits
from planar.solving.continuation.fast_path import Told, course
from planar.solving.continuation.path import Run, Trip, follow, run
from planar.solving.continuation.path_pieces import Local, met, onwards
from planar.solving.continuation.predictor_corrector import ARCS, OUT, Missed, Walk, Work
from planar.solving.continuation.solution_curve import Curve
from planar.solving.diagnosis import refusals
from planar.solving.position import known_of, stopped_at_start
from planar.solving.rates.regularity import moved_by
from planar.solving.rates.sample_rates import Given
from planar.solving.runs.closed_circuit import Circuit, circuit
from planar.solving.runs.samples import Rows, joined, motion, reversed_, rows, shortened, spliced

Array = np.ndarray

SEAM = 1e-9
"""Parts of a step: what rounding leaves of one."""
LEAST = 1e-5
"""rad or sizes: a range shorter than this is none."""
ARCS_PER_TURN = 100
"""Arcs by which what may be spent grows with each turn that is asked for, as far as a motion is followed at most."""

Progress = Callable[[float, float], None]


class _End(NamedTuple):
    """An end of a range: the unknowns and the position at its last row, why it ends, None where the input goes on; the
    inputs beyond which it does not go, and the links that move there."""

    z: Array
    position: float
    ending: Ending | None
    limit: Array
    links: tuple[str, ...] = ()
    missed: tuple[Missed, ...] = ()


class Ranged:
    """One input of a mechanism that runs while the others stand still.

    `progress(done, total)` is called now and then, in rad or m of the input's way.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        pair: str | None,
        branches: Sequence[int],
        third: bool,
        progress: Progress | None = None,
    ):
        names = [given.pair for given in mechanism.inputs]
        self.index = running_input(mechanism, pair)
        still = tuple(Drive(name, None, 0.0, 0.0) for k, name in enumerate(names) if k != self.index)
        self.known = known_of(with_inputs(mechanism, still))
        self.solver = self.known.solver
        self.pair = names[self.index]
        self.slides = self.solver.slides(self.pair)
        self.scale = self.solver.unit if self.slides else 1.0
        self.u, self.p = self.solver.station.u, self.solver.station.p
        self.branches, self.third = tuple(branches), third
        self.found = self.known.assembly
        self.progress = progress
        self.work = self.budget(0.0)

    def between(self, steps: int, start: float | None, stop: float | None, back: bool) -> Motion:
        """The run over a range, or over the one that the input has by itself; and back again if wanted."""
        here = float(self.u[self.index])
        if start is None and stop is None:
            return self._told(self._whole(steps, here), back)
        first = here if start is None else start / self.scale
        if stop is not None or not self.slides:
            last = first + 2.0 * pi if stop is None else stop / self.scale
            return self._told(self._run(steps, first, last), back)
        end = self._end(follow(self.solver, self.p, self.found.z, self.u, self._at(first)), first, 1.0)
        grid = np.linspace(first, end.position, steps + 1)
        found = self._through(grid[:-1])
        if found.stopped is not None:
            return self._told(self._stopped(found, self._given(grid)), back)
        whole = found._replace(z=np.vstack([found.z, end.z]), told=found.told and found.told.padded(0, 1))
        dead = (steps,) if end.ending is Ending.DEAD_POINT else ()
        return self._told(self._limited(rows(whole, self._given(grid), dead), (end,)), back)

    def round(self, steps: int, start: float | None) -> Motion:
        """The whole circuit of the assembly, through its dead points, back to where it starts."""
        here = float(self.u[self.index])
        first = here if start is None else start / self.scale
        work = self.budget(0.0)
        walk = self.walk(follow(self.solver, self.p, self.found.z, self.u, self._at(first)), first, work=work)
        if walk.here.clear < LEAST and not walk.leaves:
            told = "branches of the motion cross where the circuit would start; choose one by its number (`branches`,"
            raise BadInput("start", told + " --branch), or start it elsewhere")
        whole = circuit(self.solver, walk)
        turn = np.inf if self.slides else 2.0 * pi
        spacing = min(max(abs(each.ends[1] - each.ends[0]) for each in whole.stretches), turn) / steps
        z, places, senses, dead = [], [], [], []
        local: dict[int, Local] = {}
        for stretch in whole.stretches:
            begin, last = stretch.ends
            count = max(1, ceil(abs(last - begin) / spacing - SEAM))
            for place in np.linspace(begin, last, count + 1)[1 if z else 0 :]:
                known, singular = stretch.at(walk.curve, float(place))
                if singular is not None:
                    local[len(z)] = singular
                z.append(known)
                places.append(first + place)
                senses.append(1.0 if last > begin else -1.0)
            dead.append(len(z) - 1)
        ends = (0, *dead) if whole.from_dead else tuple(dead[:-1])
        given = self._given(np.array(places), np.array(senses))
        found = Rows(np.array(z), given, ends, local, met(walk), tuple(walk.missed))
        return motion(self.solver, self.found, found, self.third, _Course(self, found, (whole, walk)))

    def _told(self, found: Rows, back: bool) -> Motion:
        if back:
            found = joined(found, reversed_(found)._replace(met=(), missed=()))
        return motion(self.solver, self.found, found, self.third, _Course(self, found, None))

    def _run(self, steps: int, first: float, last: float) -> Rows:
        grid = np.linspace(first, last, steps + 1)
        given = self._given(grid)
        self.work = self.budget(abs(last - first) + abs(first - float(self.u[self.index])), first)
        found = self._through(grid)
        return rows(found, given) if found.stopped is None else self._stopped(found, given)

    def _through(self, grid: Array) -> Run:
        """The run through places of the input in their order, followed from the file's own position.

        Raises NoAnswer where it does not come to the first of them.
        """
        here = float(self.u[self.index])
        sense = 1.0 if grid[-1] >= grid[0] else -1.0
        before = sense * grid < sense * here
        if not before.any():
            found = self._from_here(grid)
            if len(found.z) < 2 and found.stopped is not None:
                raise self._problem(found, found.stopped)
            return shortened(found)
        down = self._from_here(grid[before][::-1])
        if down.stopped is not None:
            raise self._problem(down, down.stopped)
        return spliced(down, self._from_here(grid[~before]))

    def _problem(self, found: Run, problem: NoAnswer) -> NoAnswer:
        """What to say of a run that stopped: of one that did not start, if it is a change point that it stands on."""
        return stopped_at_start(self.solver, self.found.z, problem) if len(found.z) < 2 else problem

    def _from_here(self, grid: Array) -> Run:
        here = self.u[self.index]
        given = self._given(np.append(here, grid))
        rates = None if self.third else (given.u1, given.u2)
        return run(self.solver, self.p, self.found.z, given.u, self.branches, rates, self.work)

    def _whole(self, steps: int, here: float) -> Rows:
        """One turn on where the input makes it, else all between its limits."""
        key = self.index, self.branches
        if key not in self.known.ends:
            found = None if self.slides else self._turn(steps, here)
            if isinstance(found, Rows):
                return found
            high = found or self._end(self.found.z, here, 1.0)
            self.known.ends[key] = self._end(self.found.z, here, -1.0), high
        low, high = self.known.ends[key]
        if high.position - low.position < LEAST:
            self.solver.state(self.found.z)  # says why nothing goes on from a dead point or a change point
            at = self.solver.told(self.pair, here)
            if len(self.u) > 1:
                told = f"the input at {self.pair!r} cannot move from {at} while the other inputs stand still"
                raise NoAnswer(Outcome.TOO_MANY_INPUTS, told)
            told = f"the input at {self.pair!r} can all but not move from {at}, as its motion ends close by both ways"
            raise NoAnswer(Outcome.DEAD_POINT, f"{told}; change a dimension, or drive another pair")
        # from within to the limits: from a limit two branches lead inwards
        grid = np.linspace(low.position, high.position, steps + 1)
        inner = grid[1:-1]
        down, up = self._from_here(inner[inner < here][::-1]), self._from_here(inner[inner >= here])
        for part in (down, up):
            if part.stopped is not None:
                return self._stopped(shortened(part), self._given(inner[: len(part.z)]))
        found = spliced(down, up)
        local = {row + 1: each for row, each in found.local.items()}
        told = found.told and found.told.padded(1, 1)
        whole = found._replace(z=np.vstack([low.z, found.z, high.z]), local=local, told=told)
        dead = tuple(index for index, end in ((0, low), (steps, high)) if end.ending is Ending.DEAD_POINT)
        return self._limited(rows(whole, self._given(grid), dead), (low, high))

    def _turn(self, steps: int, here: float) -> Rows | _End | None:
        """One turn on, if the input makes it; else the end of its range, if that is known."""
        given = self._given(np.linspace(here, here + 2.0 * pi, steps + 1))
        sure = course(self.solver, self.found.z, *given[:3])
        if sure is not None and len(sure.z) == steps + 1 and not self.third:
            return Rows(sure.z, given, told=Told(sure.parts, np.ones(steps + 1, dtype=bool), sure.open))
        if sure is not None and len(sure.z) <= steps:
            end = self._end(self.found.z, here, 1.0)  # walking tells it sooner than a run would
            if end.ending is not None:
                return end
        found = self._run(steps, here, here + 2.0 * pi)
        return found if found.outcome is Outcome.SOLVED else None

    def _limited(self, found: Rows, ends: tuple[_End, ...]) -> Rows:
        """Rows of a range that ends by itself, with what there is to say of its ends."""
        if found.outcome is not Outcome.SOLVED:
            return found
        reasons = []
        for ending in dict.fromkeys(end.ending for end in ends):
            alike = [end for end in ends if end.ending is ending]
            where = listed([self.solver.told(self.pair, float(end.limit[self.index])) for end in alike])
            if ending is Ending.DEAD_POINT:
                reasons.append(f"the range of {self.pair!r} ends at {where}")
            elif ending is not None:
                links = list(dict.fromkeys(link for end in alike for link in end.links))
                problem = refusals.ended(self.solver, links, where, ending)
                found = found.stopped(problem)
                reasons.append(problem.reason)
            if ending is Ending.ENDLESS:
                last = listed([self.solver.told(self.pair, end.position) for end in alike])
                reasons.append(f"the rows go as far as {last}")
        dead = tuple(row % len(found.z) for row in found.dead)
        missed = (*found.missed, *(each for end in ends for each in end.missed))
        return found._replace(dead=dead, missed=missed, reason="; ".join(reasons))

    def _stopped(self, found: Run, given: Given) -> Rows:
        """A run that did not come to its end, with a last row where it stopped."""
        reached = rows(found, given)
        if found.last is None or found.stopped is None:
            return reached.stopped(found.stopped)
        z, u = found.last
        ends_there = Given(u[None], *(each[-1:] for each in reached.given[1:]))
        if np.max(np.abs(u - reached.given.u[-1]), initial=0.0) == 0.0:
            dead = (len(reached.z) - 1,) if found.stopped.outcome is Outcome.DEAD_POINT else ()
            return reached._replace(dead=dead).stopped(found.stopped)
        reached = reached._replace(
            z=np.vstack([reached.z, z]),
            given=Given(*(np.vstack(both) for both in zip(reached.given, ends_there, strict=True))),
            dead=(len(reached.z),),
            told=reached.told and reached.told.padded(0, 1),
        )
        return reached.stopped(found.stopped)

    def _given(self, positions: Array, senses: Array | float = 1.0) -> Given:
        """The inputs over a run, each row with the file's rates; backwards the velocity turns round."""
        s, many = self.solver.station, len(positions)
        u1, u2 = (np.repeat(rate[None], many, axis=0) for rate in (s.u1, s.u2))
        return Given(self._at(positions), u1 * np.reshape(senses, (-1, 1)), u2, np.zeros_like(u1))

    def _at(self, positions: Array | float) -> Array:
        """The inputs where the one that runs is at a position, or at positions (positions, inputs)."""
        inputs = np.tile(self.u, (*np.shape(positions), 1))
        inputs[..., self.index] = positions
        return inputs

    def budget(self, reach: float, first: float | None = None) -> Work:
        """What may be spent on so long a way of the input; who asked is told how far from `first` it has come."""
        tell = None
        if self.progress is not None and first is not None:
            inform, total = self.progress, reach * self.scale

            def tell(u: Array) -> None:
                inform(min(abs(float(u[self.index]) - first) * self.scale, total), total)

        return Work(ARCS + int(ARCS_PER_TURN * min(reach, FARTHEST) / (2.0 * pi)), tell)

    def walk(self, z: Array, first: float, way: float = 1.0, work: Work | None = None) -> Walk:
        """A walk from a position of the input, in the direction in which it goes on."""
        axis = np.zeros_like(self.u)
        axis[self.index] = way
        curve = Curve(self.solver, self.p, self._at(first), axis)
        numbers = list(self.branches)
        y = np.append(z, 0.0)
        return Walk(curve, onwards(curve, y, numbers), numbers, work)

    def _end(self, z: Array, here: float, sign: float) -> _End:
        """Where the range of the input ends, one way from a position with unknowns z."""
        far = OUT if self.slides else 2.0 * pi
        start = self._at(here)
        trip = Trip(self.solver, self.p, z, start, self._at(here + sign) - start, self.branches, self.budget(0.0))
        found = trip.to(far)
        if found is not None:
            if self.slides:
                told = "the slide goes on without a limit; name where the range starts and stops"
                raise BadInput(self.pair, told)
            return _End(found[0], here + sign * far, None, self._at(here + sign * far))
        limit, ending = trip.end
        last, u = trip.last or (z, start)
        links = tuple(moved_by(self.solver, trip.here.tangent[:-1]))
        return _End(last, float(u[self.index]), ending, limit, links, tuple(trip.walk.missed))


class _Course:
    """The curve along which an input runs: what it meets between the first row and the last."""

    def __init__(self, ranged: Ranged, found: Rows, whole: tuple[Circuit, Walk] | None):
        self.ranged, self.found, self.whole = ranged, found, whole
        self.singular = frozenset(found.local)
        self.forks = tuple(float(each.u[ranged.index]) * ranged.scale for each in found.met if each.passed.switches)

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        ranged, found = self.ranged, self.found
        u = found.given.u[:, ranged.index]
        if len(u) < 2:
            return ()
        if self.whole is not None:
            parts, walk = self.whole
            told = limits.along(ranged.solver, ranged.pair, float(u[0]), 1.0, walk, parts.pieces)
            return limits.limits(ranged.solver, ranged.pair, walk.curve, told)
        # from where the rows were followed from, so that the same ways are taken at change points
        back = self._turns_back(u)
        first, last = float(u[0]), float(u[(len(u) - 1) // 2 if back else -1])
        here, sense = float(ranged.u[ranged.index]), 1.0 if last >= first else -1.0
        down = self._over(here, first, -sense)
        up = self._over(here, last, sense)
        low, high = sorted((first * ranged.scale, last * ranged.scale))
        room = SEAM * ranged.scale
        told = [each for each in (*down[::-1], *up) if low - room <= each.limit.input <= high + room]
        curve = ranged.walk(ranged.found.z, here).curve
        return limits.limits(ranged.solver, ranged.pair, curve, told)

    def _turns_back(self, u: Array) -> bool:
        return len(u) > 2 and u[0] == u[-1] and u[1] == u[-2]

    def _over(self, here: float, last: float, way: float) -> list[limits.Found]:
        """What is met from the file's own position to another, if that lies that way."""
        ranged, far = self.ranged, way * (last - here)
        if far <= 0.0:
            return []
        walk = ranged.walk(ranged.found.z, here, way, work=ranged.budget(far, here))
        met_there = limits.over(ranged.solver, ranged.pair, here, way, walk, far)
        # all with the input on its way up, whichever way it was followed
        return [each.turned(way) for each in met_there]
