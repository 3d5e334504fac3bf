"""From one position to others along the branch on which it lies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, pairwise
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np

from planar.equations.functions import Program, length
from planar.foundation.errors import Ending, NoAnswer
from planar.solving.checks.branch_check import Branch, cancelling
from planar.solving.continuation.fast_path import STRAIGHT, Told, course
from planar.solving.continuation.path_pieces import Local, Met, Piece, met, onwards, pieces
from planar.solving.continuation.period import Period, Round
from planar.solving.continuation.predictor_corrector import Missed, Walk, Work
from planar.solving.continuation.solution_curve import Curve, Point, Traced

Array = np.ndarray

CORRECTIONS = 8
LEAST_WINDOW = 8
"""Samples that are tried at once where none has passed before."""
AHEAD = 1000
"""Samples that one trip is to come to at most."""


class Followed(Traced, Protocol):
    """What following needs of a solver beyond that."""

    def ends(self, u: Array, tangent: Array, ending: Ending) -> NoAnswer:
        """What to say of a motion that ends at inputs u, towards which it went along a tangent."""


class Run(NamedTuple):
    """Unknowns at every sample that was reached (samples, unknowns), how many of them the general path had to solve,
    and why the rest was not reached, if not, with the last unknowns and inputs before that.

    `local` are rates by sample where the slope is singular; `met` the change points passed, `missed` those near by.
    """

    z: Array
    general: int
    stopped: NoAnswer | None = None
    last: tuple[Array, Array] | None = None
    local: Mapping[int, Local] = MappingProxyType({})
    met: tuple[Met, ...] = ()
    missed: tuple[Missed, ...] = ()
    told: Told | None = None


class Trip:
    """Goes along a straight way of the inputs to its first dead point, and tells the unknowns at places in their order.

    The way is one in which the fastest input goes one rad or size a unit.
    """

    def __init__(
        self,
        solver: Followed,
        p: Array,
        z: Array,
        start: Array,
        way: Array,
        branches: Sequence[int] = (),
        work: Work | None = None,
    ):
        reach = float(np.max(np.abs(way), initial=0.0)) or 1.0
        self.curve = Curve(solver, p, start, way / reach)
        numbers = list(branches)
        self.walk = Walk(self.curve, onwards(self.curve, np.append(z, 0.0), numbers), numbers, work)
        self.here = self.walk.here
        self.dead: Point | None = None
        self._pieces, self._round = pieces(self.walk), Round(self.walk)
        self._piece: Piece | None = None
        self._period: Period | None = None
        self._wanted = self._reached = 0.0

    def holds(self, place: float) -> bool:
        """Whether a place lies on what has been followed already."""
        return self._piece is not None and (place <= self._piece.stop or self._period is not None)

    @property
    def end(self) -> tuple[Array, Ending]:
        """The inputs beyond which it does not go, and why."""
        if self.dead is not None:
            return self.curve.inputs(self.dead.y), Ending.DEAD_POINT
        if self.walk.limit is not None and self._wanted < self.walk.limit:
            return self.curve.inputs(self.here.y), Ending.FAR
        return self.walk.end

    @property
    def last(self) -> tuple[Array, Array] | None:
        """Unknowns and inputs of the last position before that; where a slide goes out without an end, of one well out.
        None where it has been beyond that already."""
        here = self.here
        if self.end[1] is Ending.ENDLESS:
            here = self.walk.out or here
            if here.y[-1] <= self._reached:
                return None
        return here.y[:-1], self.curve.inputs(here.y)

    @property
    def start(self) -> tuple[Array, Local]:
        """The unknowns where it starts on a change point by a way that was asked for, with their rates along it."""
        found = self.to(0.0)
        assert found is not None
        assert found[1] is not None
        return found[0], found[1]

    def to(self, place: float) -> tuple[Array, Local | None] | None:
        """The unknowns so far along the way, with rates where the slope is singular; None if it ends before."""
        self._wanted = place
        while self._piece is None or not self.holds(place):
            if self.dead is not None:
                return None
            self._piece = next(self._pieces, None)
            if self._piece is None:
                return None
            self.dead = self._piece.dead
            self.here = self.dead or self._piece.arc.after
            self._period = self._round.after(self._piece)
        self._reached = place
        if self._period is not None and place > self._piece.stop:
            return self._period.at(self.curve, place)
        return self._piece.at(self.curve, place)

    def met(self, last: float) -> tuple[Met, ...]:
        """The change points passed up to a place that it has come to."""
        return met(self.walk, last) if self._period is None else tuple(self._period.met(self.curve, last))


def follow(solver: Followed, p: Array, z: Array, start: Array, stop: Array) -> Array:
    """The unknowns at inputs `stop`; see `followed`."""
    return followed(solver, p, z, start, stop).z[-1]


def followed(solver: Followed, p: Array, z: Array, start: Array, stop: Array) -> Run:
    """The unknowns at inputs `start` and `stop`, followed along the straight line between them.

    Smoothly through change points. Raises NoAnswer where a dead point is on the way, or the branch cannot be followed.
    """
    way = stop - start
    reach = float(np.max(np.abs(way), initial=0.0))
    if reach == 0.0:
        return Run(np.stack([z, z]), 0)
    trip = Trip(solver, p, z, start, way)
    found = trip.to(reach)
    if found is None:
        raise ended(solver, trip)
    local = {} if found[1] is None else {1: found[1]}
    return Run(np.stack([z, found[0]]), 1, None, None, local, trip.met(reach), tuple(trip.walk.missed))


def run(
    solver: Followed,
    p: Array,
    z: Array,
    u: Array,
    branches: Sequence[int] = (),
    rates: tuple[Array, Array] | None = None,
    work: Work | None = None,
) -> Run:
    """The unknowns at every sample of a run of inputs u (samples, inputs), from those of the first.

    The whole run is one call of the compiled program; every sample then passes both parts of the gate, and from
    one that does not the general path goes on until the compiled program can take over again. With first and second
    `rates` of the inputs the run tells those of its samples as well, so far as they are surely sound. What the general
    path does is counted in `work`.
    """
    samples, work = len(u), work or Work()
    found = np.empty((samples, z.size))
    found[0] = z
    done, general, window = 1, 0, samples
    local: dict[int, Local] = {}
    met_on_way: list[Met] = []
    told = _Sure(solver, samples) if rates is not None else None
    missed: list[Missed] = []
    trip: Trip | None = None
    steps: Iterator[tuple[float, float]] = iter(())
    before = 0
    while done < samples:
        first, last = done, min(done + window, samples)
        done = _at_once(solver, p, (found, u), slice(done - 1, last), rates, told, done - 1 in local)
        # of what comes after a sample that did not pass no more is tried than has passed before
        window = max(LEAST_WINDOW, 2 * (done - first))
        if done > first:
            steps = iter(())
        if done == last:
            continue
        at_once = next(steps, None)
        if trip is None or at_once is None:
            missed += trip.walk.missed if trip is not None else ()
            base = done - 1
            while base and base in local and (u[done] - u[done - 1]) @ local[base].way < 0.0:
                base -= 1  # what turns back on a change point comes back by the branch on which it came
            ahead = np.vstack([u[base], u[done : done + AHEAD]])
            trip, places = _trip(solver, p, found[base], ahead, branches[len(met_on_way) :], work)
            steps, before = pairwise([*places, np.inf]), len(met_on_way)
            at_once = next(steps)
            if trip.walk.leaves and base == done - 1:
                found[base], local[base] = trip.start
        for place, following in chain([at_once], steps):
            at = trip.to(place)
            if at is None:
                met_on_way[before:] = trip.met(place)
                known = told and told.of(done)
                stopped = ended(solver, trip)
                return Run(
                    found[:done],
                    general,
                    stopped,
                    trip.last,
                    local,
                    tuple(met_on_way),
                    (*missed, *trip.walk.missed),
                    known,
                )
            found[done] = at[0]
            if at[1] is not None:
                local[done] = at[1]
            done, general = done + 1, general + 1
            if at[1] is None and not trip.holds(following):
                break
        met_on_way[before:] = trip.met(place)
    missed += trip.walk.missed if trip is not None else ()
    return Run(found, general, None, None, local, tuple(met_on_way), tuple(missed), told and told.of(samples))


class _Sure:
    """What a run tells of its samples so far."""

    def __init__(self, solver: Followed, samples: int):
        many = len(solver.program.equations.coordinates)
        self.parts, self.sure, self.open = np.empty((samples, 3, many)), np.zeros(samples, dtype=bool), 0.0

    def of(self, samples: int) -> Told:
        """Of its first samples."""
        return Told(self.parts[:samples], self.sure[:samples], self.open)


def _at_once(
    solver: Followed,
    p: Array,
    samples: tuple[Array, Array],
    rest: slice,
    rates: tuple[Array, Array] | None,
    told: _Sure | None,
    beside: bool,
) -> int:
    """Fill in unknowns of the samples after the first of the `rest` in one call, as far as they pass both parts of the
    gate; how many are known then. Of a first one `beside` a change point more is known than can be read off its slope.
    """
    (found, u), first = samples, rest.start
    sure = course(solver, found[first], u[rest], *(each[rest] for each in rates)) if rates is not None else None
    if sure is not None and told is not None:
        through = len(sure.z)
        if not through:
            return first + 1
        same = slice(first + beside, first + through)
        found[same] = sure.z[beside:]
        told.parts[same], told.sure[same] = sure.parts[beside:], True
        told.open = max(told.open, sure.open)
        return first + through
    if not solver.program.square:
        return first + 1
    after = slice(first + 1, rest.stop)
    found[after] = solver.program.run(found[first], u[after], p)
    after = slice(first + 1, first + 1 + _passing(solver, p, found[rest], u[rest]))
    found[after] = _settled(solver.program, p, found[after], u[after])
    return after.stop


def _trip(
    solver: Followed, p: Array, z: Array, u: Array, branches: Sequence[int], work: Work
) -> tuple[Trip, list[float]]:
    """A trip from the first of these inputs towards the next, and the places of those that lie on the same way."""
    away = np.max(np.abs(u - u[0]), axis=1, initial=0.0)
    way = u[int(np.argmax(away > 0.0))] - u[0]
    reach = float(np.max(np.abs(way), initial=0.0))
    if reach == 0.0:
        return Trip(solver, p, z, u[0], way, (), work), [0.0]
    axis = way / reach
    gone = (u[1:] - u[0]) @ axis / float(axis @ axis)
    aside = np.max(np.abs(u[1:] - u[0] - gone[:, None] * axis), axis=1) > STRAIGHT
    back = np.diff(gone, prepend=0.0) < 0.0
    off = aside | back
    many = int(np.argmax(off)) if off.any() else len(gone)
    return Trip(solver, p, z, u[0], way, branches, work), gone[:many].tolist()


def ended(solver: Followed, trip: Trip) -> NoAnswer:
    """Why a trip goes no further."""
    u, ending = trip.end
    return solver.ends(u, trip.here.tangent, ending)


def _passing(solver: Followed, p: Array, z: Array, u: Array) -> int:
    """How many samples after the first pass both parts of the gate, up to the first that does not."""
    closed = solver.open_along(z, u) <= solver.tolerance
    whole = len(closed) if closed.all() else int(np.argmin(closed))
    if whole < 2:
        return 0
    keeps = Branch(solver.program, p).along(z[:whole], u[:whole])
    return len(keeps) if keeps.all() else int(np.argmin(keeps))


def _settled(program: Program, p: Array, z: Array, u: Array) -> Array:
    """Regular samples after one more of Newton's corrections: beside a change point the gate leaves room for an error
    in their unknowns, which grows with every rate."""
    if not z.size:
        return z
    none = np.zeros((len(z), z.shape[1] + u.shape[1]))
    there = program.kinematics(np.hstack([z, u]), none, none, p)
    return z + cancelling(there.slope, there.F[..., None])[..., 0]


def corrected(program: Program, p: Array, z: Array, u: Array, last: int | None = None) -> Array | None:
    """Newton's corrector, group after group (to the `last`), from unknowns near by; None where one does not close."""
    z = z.copy()
    for stage in program.equations.stages:
        if not length(stage.rows) or (last is not None and stage.level > last):
            continue
        closing = program.closed(stage)
        before = np.inf
        for _ in range(CORRECTIONS):
            left, slope = closing(z, u, p)
            gap = float(np.max(np.abs(left), initial=0.0))
            if not gap < before:
                break
            before = gap
            if slope.size:
                z[stage.unknowns] -= np.linalg.lstsq(slope.T, left[0], rcond=1e-12)[0]
        if not before <= 1e-10:
            return None
    return z
