"""A run in time: every input by its own law, or at the file's velocity and acceleration."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from planar.algebra import Jet
from planar.errors import BadInput
from planar.mechanism import Input, Mechanism
from planar.motion import Motion
from planar.program import placed
from planar.results import Limit
from planar.roots import root
from planar.solving.follow import follow, run
from planar.solving.limits import STILL, Outputs, outputs
from planar.solving.passing import crossed
from planar.solving.position import Solver
from planar.solving.rates import Given, rates
from planar.solving.rows import Rows, motion, rows

Array = np.ndarray


class Timed:
    """All inputs of a mechanism at once, in time."""

    def __init__(self, mechanism: Mechanism, branches: Sequence[int], third: bool):
        self.solver = Solver(mechanism)
        self.branches, self.third = tuple(branches), third
        self.scale = np.array([self.solver.unit if self.solver.slides(g.pair) else 1.0 for g in mechanism.inputs])
        self.found = self.solver.assembly()

    def over(self, steps: int, duration: float | None) -> Motion:
        """The run from the start of the laws to the end of the longest, or for a duration (s)."""
        laws = [given.law.duration for given in self.solver.mechanism.inputs if given.law is not None]
        if duration is None:
            if not laws:
                raise BadInput("duration", "no input has a law; say for how long (s) they run")
            duration = max(laws)
        time = np.linspace(0.0, duration, steps + 1)
        given = self.given(time)
        found = run(self.solver, self.solver.station.p, self.found.z, given.u, self.branches)
        told = rows(found, given).stopped(found.stopped)
        time = time[: len(found.z)]
        return motion(self.solver, self.found, told, self.third, _Course(self, told, time), time)

    def given(self, time: Array) -> Given:
        """The inputs at times (s)."""
        parts = np.array([_by_law(each, time) for each in self.solver.mechanism.inputs])
        return Given(*(part.T / self.scale for part in parts.transpose(1, 0, 2)))


def _by_law(given: Input, time: Array) -> Array:
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

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        solver, found = self.timed.solver, self.found
        watched = outputs(solver)
        told = list(self._turns(motion, watched))
        for each in found.met:
            gone = (found.given.u - each.u) @ each.way
            row = int(np.argmin(np.abs(gone)))
            told.append(
                Limit("change point", "", float(self.time[row]), float(self.time[row]), None, crossed(solver, each))
            )
        return tuple(sorted(told, key=lambda each: each.input))

    def _turns(self, motion: Motion, watched: Outputs) -> Iterator[Limit]:
        rates_of = [np.asarray(list(motion.pair(pair.name).values())[1], dtype=float) for pair in watched.pairs]
        for pair, velocity in zip(watched.pairs, rates_of, strict=True):
            least = STILL * max(float(np.nanmax(np.abs(velocity), initial=0.0)), STILL)
            sure = np.flatnonzero(np.abs(velocity) > least)
            for before, after in pairwise(sure.tolist()):
                if velocity[before] * velocity[after] > 0.0 or after - before > 2:
                    continue  # a rest in between is no end of a stroke at one time
                first, last = float(self.time[before]), float(self.time[after])
                at = root(lambda t, row=int(before), pair=pair: self._at(row, t, pair.name)[1], first, last)
                value = self._at(int(before), at, pair.name)[0]
                yield Limit("stroke end", pair.name, at, value)

    def _at(self, row: int, time: float, pair: str) -> tuple[float, float]:
        """Position and velocity of an output at a time after a row."""
        solver = self.timed.solver
        given = self.timed.given(np.array([time]))
        z = follow(solver, solver.station.p, self.found.z[row], self.found.given.u[row], given.u[0])
        parts = [part[0] * solver.scale for part in rates(solver, z[None], given, {}, False)]
        jets = [Jet(*(float(part[column]) for part in parts)) for column in range(len(parts[0]))]
        frames, own = placed(jets, solver.column, solver.shapes, solver.pairs)
        named = solver.named[pair]
        numbers = named.measure([solver.shapes[link] for link in named.bodies])
        drive = named.drive([frames[link] for link in named.bodies], numbers, own.get(pair, ()))
        return (float(drive.parts[0]), float(drive.parts[1])) if isinstance(drive, Jet) else (float(drive), 0.0)
