"""A run in time: every input by its own law, or at the file's velocity and acceleration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from planar.equations.functions import placed
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.jets import Jet
from planar.foundation.root_finding import root
from planar.model.mechanism import Input, Mechanism
from planar.results.motion import Motion
from planar.results.records import Limit
from planar.solving.continuation.change_point_remarks import crossed
from planar.solving.continuation.events import STILL, Outputs, outputs
from planar.solving.continuation.path import Run, followed, run
from planar.solving.continuation.path_pieces import SEAM, Met
from planar.solving.position import known_of, stopped_at_start
from planar.solving.rates.sample_rates import Given, rates
from planar.solving.runs.samples import Rows, motion, rows

Array = np.ndarray


class Timed:
    """All inputs of a mechanism at once, in time."""

    def __init__(self, mechanism: Mechanism, branches: Sequence[int], third: bool):
        known = known_of(mechanism)
        self.solver = known.solver
        self.branches, self.third = tuple(branches), third
        self.scale = np.array([self.solver.unit if self.solver.slides(g.pair) else 1.0 for g in mechanism.inputs])
        self.found = known.assembly

    def over(self, steps: int, duration: float | None) -> Motion:
        """The run from the start of the laws to the end of the longest, or for a duration (s)."""
        laws = [given.law.duration for given in self.solver.mechanism.inputs if given.law is not None]
        if duration is None:
            if not laws:
                raise BadInput("duration", "no input has a law; say for how long (s) they run")
            duration = max(laws)
        time = np.linspace(0.0, duration, steps + 1)
        given = self.given(time)
        known = None if self.third else (given.u1, given.u2)
        found = run(self.solver, self.solver.station.p, self.found.z, given.u, self.branches, known)
        if found.stopped is not None and len(found.z) < 2:
            problem = stopped_at_start(self.solver, self.found.z, found.stopped)
            if problem is not found.stopped:
                raise problem
        told = rows(found, given).stopped(found.stopped)
        last = self._dead(found, given, time)
        time = time[: len(found.z)]
        if last is not None and found.last is not None:
            ends = self.given(np.array([last]))._replace(u=found.last[1][None])
            whole = Given(*(np.vstack(both) for both in zip(told.given, ends, strict=True)))
            sure = told.told and told.told.padded(0, 1)
            told = told._replace(z=np.vstack([told.z, found.last[0]]), given=whole, dead=(len(told.z),), told=sure)
            time = np.append(time, last)
        return motion(self.solver, self.found, told, self.third, _Course(self, told, time), time)

    def _dead(self, found: Run, given: Given, time: Array) -> float | None:
        """When a run comes to its dead point (s). Of several inputs that move there at once no time is told: between
        samples they are followed along a straight way, which is not theirs."""
        if found.last is None or found.stopped is None or found.stopped.outcome is not Outcome.DEAD_POINT:
            return None
        row = len(found.z) - 1
        moving = np.flatnonzero(given.u[row + 1] != given.u[row])
        if len(moving) != 1 or np.all(found.last[1] == given.u[row]):
            return None
        place = float(found.last[1][moving[0]])

        def left(t: float) -> float:
            return float(self.given(np.array([t])).u[0, moving[0]]) - place

        return root(left, float(time[row]), float(time[row + 1]))

    def given(self, time: Array) -> Given:
        """The inputs at times (s)."""
        parts = np.array([by_law(each, time) for each in self.solver.mechanism.inputs])
        return Given(*(part.T / self.scale for part in parts.transpose(1, 0, 2)))


def by_law(given: Input, time: Array) -> Array:
    """Position and first, second and third rate of an input (4, times)."""
    if given.law is not None:
        return np.asarray(given.law.at(time, given.position, given.velocity))
    velocity = given.velocity + given.acceleration * time
    position = given.position + given.velocity * time + 0.5 * given.acceleration * time**2
    return np.array([position, velocity, np.full_like(time, given.acceleration), np.zeros_like(time)])


class _Course:
    """A run in time between its rows."""

    def __init__(self, timed: Timed, found: Rows, time: Array):
        self.timed, self.found, self.time = timed, found, time
        self.singular = frozenset(found.local)
        self.forks: tuple[float, ...] = ()

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        solver, found = self.timed.solver, self.found
        watched = outputs(solver)
        met = list(self._crossings())
        switched = [at for at, each in met if each.passed.switches]
        told = list(self._turns(motion, watched, switched))
        for at, each in met:
            pair = next(g.pair for g, w in zip(solver.mechanism.inputs, each.way, strict=True) if w)
            told.append(Limit("change point", pair, at, at, None, crossed(solver, each)))
        for row in found.dead:
            moved = int(np.argmax(np.abs(found.given.u[row] - found.given.u[row - 1])))
            pair = solver.mechanism.inputs[moved].pair
            place = float(found.given.u[row, moved] * self.timed.scale[moved])
            told.append(Limit("input dead point", pair, float(self.time[row]), place))
        return tuple(sorted(told, key=lambda each: each.input))

    def _crossings(self) -> Iterator[tuple[float, Met]]:
        """The change points passed, each with its time (s)."""
        row = 0
        for each in self.found.met:
            gone = (self.found.given.u - each.u) @ each.way
            for k in range(row, len(gone)):
                if abs(gone[k]) < SEAM:
                    yield float(self.time[k]), each
                elif k + 1 < len(gone) and gone[k] * gone[k + 1] < 0.0 and abs(gone[k + 1]) >= SEAM:

                    def left(t: float, each: Met = each) -> float:
                        return float((self.timed.given(np.array([t])).u[0] - each.u) @ each.way)

                    yield root(left, float(self.time[k]), float(self.time[k + 1])), each
                else:
                    continue
                row = k + 1
                break

    def _turns(self, motion: Motion, watched: Outputs, switched: list[float]) -> Iterator[Limit]:
        rates_of = [np.asarray(list(motion.pair(pair.name).values())[1], dtype=float) for pair in watched.pairs]
        for pair, velocity in zip(watched.pairs, rates_of, strict=True):
            least = STILL * max(float(np.nanmax(np.abs(velocity), initial=0.0)), STILL)
            sure = np.flatnonzero(np.abs(velocity) > least)
            for before, after in pairwise(sure.tolist()):
                if velocity[before] * velocity[after] > 0.0 or after - before > 2:
                    continue  # a rest in between is no end of a stroke at one time
                first, last = float(self.time[before]), float(self.time[after])
                if any(first <= at <= last for at in switched):
                    continue  # it is the branch that turns, not the output
                base = after if before in self.found.local else before
                at = root(lambda t, row=base, pair=pair: self._at(row, t, pair.name)[1], first, last)
                value = self._at(base, at, pair.name)[0]
                yield Limit("stroke end", pair.name, at, value)

    def _at(self, row: int, time: float, pair: str) -> tuple[float, float]:
        """Position and velocity of an output at a time after a row."""
        solver = self.timed.solver
        given = self.timed.given(np.array([time]))
        while row and row in self.singular:
            row -= 1  # from a change point several ways lead on
        way = followed(solver, solver.station.p, self.found.z[row], self.found.given.u[row], given.u[0])
        local = {0: way.local[1]} if 1 in way.local else {}
        parts = [part[0] * solver.scale for part in rates(solver, way.z[-1:], given, local, False).parts]
        jets = [Jet(*(float(part[column]) for part in parts)) for column in range(len(parts[0]))]
        frames, own = placed(jets, solver.column, solver.shapes, solver.pairs)
        named = solver.named[pair]
        numbers = named.measure([solver.shapes[link] for link in named.bodies])
        drive = named.drive([frames[link] for link in named.bodies], numbers, own.get(pair, ()))
        return (float(drive.parts[0]), float(drive.parts[1])) if isinstance(drive, Jet) else (float(drive), 0.0)
