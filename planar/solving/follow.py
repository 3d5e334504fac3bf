"""From one position to others along the branch on which it lies."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from types import MappingProxyType
from typing import NamedTuple, Protocol

import numpy as np

from planar.errors import Ending, NoAnswer
from planar.program import Program, length
from planar.roots import root
from planar.solving.branch import Branch, cancelling
from planar.solving.curve import Arc, Curve, Point, Traced
from planar.solving.periods import by_periods
from planar.solving.straight import STRAIGHT, Told, course
from planar.solving.walk import Missed, Passed, Walk

Array = np.ndarray

CORRECTIONS = 8
NEARLY = 0.1
"""A correction longer than this part of an arc has gone astray."""
RESTING = 1e-7
"""A rate of the inputs along the curve below this is none: the position is a dead point to rounding."""
NEAR = 0.125
"""rad or sizes from one position to the next, where few are asked for on a far way."""
SEAM = 1e-9
"""rad or sizes: so near to the end of a way a change point is at that end."""


class Followed(Traced, Protocol):
    """What following needs of a solver beyond that."""

    def ends(self, u: Array, tangent: Array, ending: Ending) -> NoAnswer:
        """What to say of a motion that ends at inputs u, towards which it went along a tangent."""


class Local(NamedTuple):
    """Rates where a slope is singular: first, second and third derivative of the unknowns (3, unknowns) by the distance
    of the inputs along a way; and how much rank the slope lacks at the change point."""

    rates: Array
    way: Array
    lost: int


class Met(NamedTuple):
    """A change point on the way: the unknowns and inputs there, what the walk knows of it, and along which way."""

    u: Array
    passed: Passed
    way: Array


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


class Piece(NamedTuple):
    """A part of an arc on which the inputs go one way: from and to where on its axis, from and to where on the way of
    the inputs, and the dead point at its end, if one is there."""

    arc: Arc
    first: float
    last: float
    start: float
    stop: float
    dead: Point | None

    def holds(self, place: float) -> bool:
        """Whether the inputs come to a place within this piece."""
        return min(self.start, self.stop) <= place <= max(self.start, self.stop)

    def at(self, curve: Curve, place: float) -> tuple[Array, Local | None]:
        """The unknowns where the inputs are at a place, with their rates where the slope is singular."""
        arc = self.arc
        if self.dead is not None and place == self.stop:
            return self.dead.y[:-1], None
        x = root(lambda x: float(arc.rough(x)[-1]) - place, self.first, self.last)
        rough = arc.rough(x)
        rough[-1] = place
        if arc.exact:
            return curve.closed(rough, arc.lost)[:-1], Local(derivatives(arc, x), curve.way, arc.lost)
        ahead = np.zeros_like(rough)
        ahead[-1] = 1.0
        y = curve.corrected(rough, ahead)
        if y is None or np.linalg.norm(y - rough) > NEARLY * abs(self.last - self.first) or not curve.closes(y):
            y = arc.y(curve, root(lambda x: float(arc.y(curve, x)[-1]) - place, self.first, self.last))
        return y[:-1], None


def pieces(walk: Walk) -> Iterator[Piece]:
    """A walk's arcs, parted at dead points."""
    curve = walk.curve
    if rests(walk.here) and walk.here.bend[-1] < 0.0:
        here = walk.here
        yield Piece(Arc(here, here, here.y, here.tangent, 1.0, here.y[None], 1), 0.0, 0.0, 0.0, 0.0, here)
    for arc in walk.arcs():
        (first, last), before = arc.ends, arc.before
        if rests(before) and rests(arc.after) and abs(arc.after.y[-1] - before.y[-1]) < SEAM:
            yield Piece(arc, first, first, float(before.y[-1]), float(before.y[-1]), before)
            return  # all else moves on while the inputs rest
        while True:
            dead = turning(curve, arc, before, first, last)
            if dead is None:
                break
            at = float(arc.axis @ (dead.y - arc.origin))
            if before is not arc.before and abs(at - first) <= STRAIGHT:
                break  # the dead point from which this part starts
            yield Piece(arc, first, at, float(before.y[-1]), float(dead.y[-1]), dead)
            first, before = at, dead
        yield Piece(arc, first, last, float(before.y[-1]), float(arc.after.y[-1]), None)


class Trip:
    """Goes along a straight way of the inputs to its first dead point, and tells the unknowns at places in their order.

    The way is one in which the fastest input goes one rad or size a unit.
    """

    def __init__(self, solver: Followed, p: Array, z: Array, start: Array, way: Array, branches: Sequence[int] = ()):
        reach = float(np.max(np.abs(way), initial=0.0)) or 1.0
        self.curve = Curve(solver, p, start, way / reach)
        numbers = list(branches)
        self.walk = Walk(self.curve, onwards(self.curve, np.append(z, 0.0), numbers), numbers)
        self.here = self.walk.here
        self.dead: Point | None = None
        self._pieces = pieces(self.walk)
        self._piece: Piece | None = None

    def holds(self, place: float) -> bool:
        """Whether a place lies on what has been followed already."""
        return self._piece is not None and place <= self._piece.stop

    def to(self, place: float) -> tuple[Array, Local | None] | None:
        """The unknowns so far along the way, with rates where the slope is singular; None if it ends before."""
        while self._piece is None or not self.holds(place):
            if self.dead is not None:
                return None
            self._piece = next(self._pieces, None)
            if self._piece is None:
                return None
            self.dead = self._piece.dead
            self.here = self.dead or self._piece.arc.after
        return self._piece.at(self.curve, place)


def met(walk: Walk, last: float = np.inf) -> tuple[Met, ...]:
    """The change points that a walk has passed up to a place of the inputs on their way."""
    return tuple(
        Met(walk.curve.inputs(each.crossing.y), each, walk.curve.way)
        for each in walk.passed
        if each.crossing.y[-1] <= last + SEAM
    )


def rests(point: Point) -> bool:
    """Whether a point is a dead point to rounding."""
    return abs(point.advance) < RESTING


def onwards(curve: Curve, y: Array, branches: list[int]) -> Point:
    """The point at y, to be left so that the inputs go on.

    At a dead point two ways lead on: the first so that the most moved unknown grows; a number is taken off `branches`.
    """
    ahead = np.zeros_like(y)
    ahead[-1] = 1.0
    here = curve.at(y, ahead)
    if rests(here):
        most = int(np.argmax(np.abs(here.tangent)))
        second = bool(branches) and branches.pop(0) > 1
        return here if bool(here.tangent[most] > 0.0) is not second else here.turned()
    return here


def turning(curve: Curve, arc: Arc, before: Point, first: float, last: float) -> Point | None:
    """The first dead point on an arc between two places on its axis, at which the inputs turn back, if there is one."""
    g0 = before.advance
    # of a dead point that was found on the arc rounding may leave more, on a small curve, than is a rest anywhere
    from_dead = before is not arc.before or rests(before)
    if from_dead:
        g0 = RESTING * float(np.sign(before.bend[-1]))
    sense = float(np.sign(g0))
    g0, g1 = abs(g0), sense * arc.after.advance
    if rests(arc.after) and not from_dead and sense * arc.after.bend[-1] < 0.0:
        # at its very end, whichever sign rounding gives what is left of the rate
        left = arc.after.advance / abs(float(arc.after.bend[-1]))
        return arc.after if arc.exact else arc.at(curve, last + sense * left * float(np.sign(last - first)))
    if g1 > 0.0:
        # between two points that go on the inputs may have gone back in the meantime
        s0, s1, gone = sense * before.bend[-1], sense * arc.after.bend[-1], abs(last - first)
        if s0 >= 0.0 or s1 <= 0.0:
            return None
        least, part = min((cubic(g0, s0 * gone, g1, s1 * gone, part), part) for part in np.linspace(0.05, 0.95, 19))
        x = first + part * (last - first)
        if least > 0.0 or sense * arc.at(curve, x).advance > 0.0:
            return None
        last = x
    at = root(lambda x: sense * arc.at(curve, x).advance if x != first else g0, first, last)
    return arc.at(curve, at)


def cubic(g0: float, s0: float, g1: float, s1: float, part: float) -> float:
    """The cubic with these values and slopes at 0 and 1, at a part of the way between."""
    t = part
    return (2 * t**3 - 3 * t**2 + 1) * g0 + (t**3 - 2 * t**2 + t) * s0 + (3 * t**2 - 2 * t**3) * g1 + (t**3 - t**2) * s1


def derivatives(arc: Arc, x: float) -> Array:
    """The first three derivatives of the unknowns by the place of the inputs (3, unknowns), on an exact arc."""
    y1, y2, y3 = (arc.rough(x, order) for order in (1, 2, 3))
    t1, t2, t3 = y1[-1], y2[-1], y3[-1]
    # the chain rule, solved for the derivatives of the inverse
    x1 = 1.0 / t1
    x2 = -t2 * x1**3
    x3 = (3.0 * t2**2 / t1 - t3) * x1**4
    return np.array([y1 * x1, y2 * x1**2 + y1 * x2, y3 * x1**3 + 3.0 * y2 * x1 * x2 + y1 * x3])[:, :-1]


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
    whole = by_periods(solver, z, np.stack([start, stop]), partial(_near, solver, p))
    if whole is not None:
        return Run(whole, 1)
    trip = Trip(solver, p, z, start, way)
    found = trip.to(reach)
    if found is None:
        raise ended(solver, trip)
    local = {} if found[1] is None else {1: found[1]}
    return Run(np.stack([z, found[0]]), 1, None, None, local, met(trip.walk, reach), tuple(trip.walk.missed))


def run(
    solver: Followed,
    p: Array,
    z: Array,
    u: Array,
    branches: Sequence[int] = (),
    rates: tuple[Array, Array] | None = None,
) -> Run:
    """The unknowns at every sample of a run of inputs u (samples, inputs), from those of the first.

    The whole run is one call of the compiled program; every sample then passes both parts of the gate, and from
    one that does not the general path goes on until the compiled program can take over again. With first and second
    `rates` of the inputs the run tells those of its samples as well, so far as they are surely sound.
    """
    samples = len(u)
    found = by_periods(solver, z, u, partial(_near, solver, p))
    if found is not None:
        return Run(found, samples - 1)
    found = np.vstack([z, np.empty((samples - 1, z.size))])
    done, general = 1, 0
    local: dict[int, Local] = {}
    met_on_way: list[Met] = []
    missed: list[Missed] = []
    told = _untold(solver, samples) if rates is not None else None
    while done < samples:
        rest = slice(done - 1, None)
        sure = course(solver, found[done - 1], u[rest], *(each[rest] for each in rates)) if rates is not None else None
        if sure is not None and told is not None:
            through = len(sure.z)
            if through:
                # of what is beside a change point more is known than can be read off its slope
                first = int(done - 1 in local)
                same = slice(done - 1 + first, done - 1 + through)
                found[same] = sure.z[first:]
                told.parts[same], told.sure[same] = sure.parts[first:], True
                told = told._replace(open=max(told.open, sure.open))
                done += through - 1
        elif solver.program.square:
            found[done:] = solver.program.run(found[done - 1], u[done:], p)
            passed = _passing(solver, p, found[done - 1 :], u[done - 1 :])
            found[done : done + passed] = _settled(solver.program, p, found[done : done + passed], u[done:][:passed])
            done += passed
        if done == samples:
            break
        base = done - 1
        while base and base in local and (u[done] - u[done - 1]) @ local[base].way < 0.0:
            base -= 1  # what turns back on a change point comes back by the branch on which it came
        ahead = np.vstack([u[base], u[done:]])
        trip, places = _trip(solver, p, found[base], ahead, branches[len(met_on_way) :])
        before = len(met_on_way)
        for place, following in pairwise([*places, np.inf]):
            at = trip.to(place)
            met_on_way[before:] = met(trip.walk, place)
            if at is None:
                missed += trip.walk.missed
                last = trip.here.y[:-1], trip.curve.inputs(trip.here.y)
                stopped = ended(solver, trip)
                known = told and told.cut(slice(done))
                return Run(found[:done], general, stopped, last, local, tuple(met_on_way), tuple(missed), known)
            found[done] = at[0]
            if at[1] is not None:
                local[done] = at[1]
            done, general = done + 1, general + 1
            if at[1] is None and not trip.holds(following):
                break
        missed += trip.walk.missed
    return Run(found, general, None, None, local, tuple(met_on_way), tuple(missed), told)


def _near(solver: Followed, p: Array, z: Array, start: Array, u: Array) -> Array | None:
    """The unknowns at inputs u (samples, inputs) that are reached one after the other from others; None where a change
    point is met. Raises NoAnswer where the motion ends."""
    most = max(int(np.abs(np.diff(np.vstack([start, u]), axis=0)).max() / NEAR), 1)
    ways = [np.linspace(a, b, most + 1)[1:] for a, b in pairwise(np.vstack([start, u]))]
    found = run(solver, p, z, np.vstack([start, *ways]))
    if found.stopped is not None:
        raise found.stopped
    return None if found.met or found.missed else found.z[most::most]


def _untold(solver: Followed, samples: int) -> Told:
    many = len(solver.program.equations.coordinates)
    return Told(np.empty((samples, 3, many)), np.zeros(samples, dtype=bool), 0.0)


def _trip(solver: Followed, p: Array, z: Array, u: Array, branches: Sequence[int]) -> tuple[Trip, list[float]]:
    """A trip from the first of these inputs towards the next, and the places of those that lie on the same way."""
    way = u[1] - u[0]
    reach = float(np.max(np.abs(way), initial=0.0))
    if reach == 0.0:
        return Trip(solver, p, z, u[0], way), [0.0]
    axis = way / reach
    gone = (u[1:] - u[0]) @ axis / float(axis @ axis)
    aside = np.max(np.abs(u[1:] - u[0] - gone[:, None] * axis), axis=1) > STRAIGHT
    back = np.diff(gone, prepend=0.0) < 0.0
    off = aside | back
    many = int(np.argmax(off)) if off.any() else len(gone)
    return Trip(solver, p, z, u[0], way, branches), gone[:many].tolist()


def ended(solver: Followed, trip: Trip) -> NoAnswer:
    """Why a trip goes no further."""
    here = trip.here
    ending = Ending.ENDLESS if trip.walk.endless else Ending.LOST if trip.dead is None else Ending.DEAD_POINT
    return solver.ends(trip.curve.inputs(here.y), here.tangent, ending)


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
