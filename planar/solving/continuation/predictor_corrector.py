"""Walking along the curve of positions, arc after arc, through dead points and smoothly through change points."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.errors import Ending
from planar.foundation.root_finding import root
from planar.model.pairs import Kind
from planar.solving.continuation.bifurcation import (
    Beside,
    Crossing,
    beside,
    crossing,
    nearest,
    starting,
)
from planar.solving.continuation.solution_curve import Arc, Curve, Point, between

Array = np.ndarray

FIRST, LONGEST, SHORTEST = 0.05, 0.25, 1e-9
"""Steps of arc length (rad, lengths of the size): the first, the longest, and one at which the curve ends."""
BENT = 0.4
"""rad by which the tangent may turn in a step."""
CLOSE = 1.5
"""How many times shorter than the distances from singular slopes at its two ends a step must be."""
SUSPECTED, AGAIN = 0.15, 0.2
"""Where to look for a change point: so near to a singular slope, and again where it is so many times nearer."""
AT = 1e-5
"""So near to a singular slope a start may be a change point, known to the root of rounding."""
AHEAD = 10.0
"""A change point farther ahead than so many times the distance within which there is none is another one."""
ARCS = 5_000
"""Arcs that are walked for one answer; a turn of a usual linkage has some fifty."""
NEAR_BY = 4.0
"""Lengths of the size: where a slide is farther out than this, steps along it grow with how far it is."""
OUT = 100.0
"""Lengths of the size, or times the greatest number of a pair: so far out a slide is shown that goes out without an
end."""
FARTHEST = 6e6
"""Lengths of the size: farther out than this the gate tells nothing."""
CONVERGES = 0.25
"""Where a slide goes out without an end the inputs tend to a limit with a power of the slide's inverse; beyond half of
the square root, which is the lowest that lines becoming parallel give, they do."""
STANDS = 1e-12
"""rad or sizes: inputs that move less than this stand still."""


class Passed(NamedTuple):
    """A change point that a walk went through: the ways, by the first of which it came, and by which it went on; or
    on which it started."""

    crossing: Crossing
    went: int
    starts: bool = False
    beyond: bool = False
    """Whether a higher number was asked for than there are ways, so that it took the last."""

    @property
    def switches(self) -> bool:
        """Whether it went on by another way than smoothly."""
        return self.went != 0 and not self.starts


class Missed(NamedTuple):
    """A change point of a neighbouring linkage that a walk came near: where, how near, and by how much this linkage's
    constraints do not close there (lengths of the size)."""

    y: Array
    distance: float
    open: float


class Work:
    """What may be spent on one answer, counted in arcs, and who is told of each: where the inputs are."""

    def __init__(self, most: int = ARCS, tell: Callable[[Array], None] | None = None):
        self.left, self._tell = most, tell

    def spend(self, u: Array) -> bool:
        """Count an arc from inputs u (inputs,); False where nothing is left to spend."""
        self.left -= 1
        if self._tell is not None:
            self._tell(u)
        return self.left >= 0


class Walk:
    """One walk along a curve from a point: its arcs, one after the other, and what it met on the way.

    `branches` are the numbers of the ways taken at change points, in the order in which they are met: 1 goes on
    smoothly, 2 takes the way nearest to that, and so on; 1 where the list ends. Of a start on one see `starting`.
    """

    def __init__(self, curve: Curve, start: Point, branches: Sequence[int] = (), work: Work | None = None):
        self.curve, self.here, self.work = curve, start, work or Work()
        self.branches = list(branches)
        self.passed: list[Passed] = []
        self.missed: list[Missed] = []
        self.step = FIRST
        self._looked, self._approaching = np.inf, False
        self._out_of: Beside | None = None
        self._leave()
        self.ending = Ending.LOST
        self.limit: float | None = None
        "the place of the inputs to which the curve tends while a slide goes out without an end"
        self.out: Point | None = None
        "where a slide has come out far, and went on"
        equations = curve.program.equations
        kinds = [equations.coordinates[column].kind for column in equations.unknowns]
        self._slides = np.array([kind is Kind.LENGTH for kind in kinds], dtype=bool)
        turns = any(kind is not Kind.LENGTH for kind, way in zip(equations.drives, curve.way, strict=True) if way)
        self.turning = np.append(~self._slides, turns)
        "which entries of y come back after whole turns: angles, and the place of inputs that turn"

    def arcs(self) -> Iterator[Arc]:
        """The arcs of the curve; they end where it cannot be followed further, `ending` and `limit` say why."""
        shown = OUT * max(1.0, float(np.max(np.abs(self.curve.p), initial=0.0)))
        farthest = max(FARTHEST, 2.0 * self._out(self.here.y))
        if self._out_of is not None:
            self.here = self._out_of.after
            yield self._out_of.arc(self._out_of.middle, self._out_of.after)
        while True:
            here = self.here
            if not self.work.spend(self.curve.inputs(here.y)):
                self.ending = Ending.SPENT
                return
            if self._approaching and here.clear < min(SUSPECTED, AGAIN * self._looked, self.step):
                through = list(self._through())
                if through:
                    yield from through
                    self.step, self._looked, self._approaching = FIRST, np.inf, False
                    continue
            elif here.clear > SUSPECTED:
                self._looked = np.inf
            out = self._out(here.y)
            after = None if out > farthest else self._next()
            if after is None:
                self.limit = _limit(here, int(np.argmax(np.abs(here.y[:-1]) * self._slides))) if out > OUT else None
                if self.limit is not None:
                    self.ending = Ending.ENDLESS
                elif out > farthest:
                    self.ending = Ending.FAR
                return
            self._note(after)
            self._approaching = after.clear < here.clear
            arc = between(here, after)
            if self.out is None and self._out(after.y) > shown:
                first, last = arc.ends
                x = root(lambda x, arc=arc: self._out(arc.y(self.curve, x)) - shown, first, last)
                self.out = arc.at(self.curve, x)
            self.here = after
            yield arc

    @property
    def leaves(self) -> bool:
        """Whether it starts on a change point, by a way that was asked for."""
        return self._out_of is not None

    def _leave(self) -> None:
        """Start by the way of the next number where that is asked for and the start is a change point."""
        if not (self.branches and self.here.clear < AT):
            return
        found = starting(self.curve, self.here.y)
        number = self.branches[0]
        went = min(number, len(found.ways)) - 1 if found else 0
        out = found and beside(self.curve, found.ways[went], found.lost)
        if found is not None and out is not None:
            del self.branches[0]
            self.here, self._out_of = out.middle, out
            self.passed.append(Passed(found, went, True, number > len(found.ways)))

    @property
    def end(self) -> tuple[Array, Ending]:
        """The inputs beyond which the arcs do not go, and why."""
        y = self.here.y if self.limit is None else np.append(self.here.y[:-1], self.limit)
        return self.curve.inputs(y), self.ending

    def _out(self, y: Array) -> float:
        """How far the farthest slide is out (sizes)."""
        return float(np.max(np.abs(y[:-1][self._slides]), initial=0.0))

    def _next(self) -> Point | None:
        """The next point: a predictor of second order, Newton's corrector, and the second part of the gate."""
        here, curve = self.here, self.curve
        bent = float(np.linalg.norm(here.bend))
        # far out a step of a slide may be longer, but not that of an angle
        out = max(self._out(here.y), 0.0 if self.turning[-1] else abs(float(here.y[-1])))
        turning = float(np.max(np.abs(here.tangent[self.turning]), initial=0.0))
        longest = LONGEST / max(turning, min(1.0, NEAR_BY / max(out, 1.0)))
        step = min(self.step, longest, 1.2 * here.clear, 0.8 * BENT / max(bent, 1e-300))
        while step > SHORTEST:
            y = curve.corrected(here.y + step * here.tangent + 0.5 * step**2 * here.bend, here.tangent)
            if y is not None:
                after = curve.at(y, here.tangent)
                gone = float(np.linalg.norm(y - here.y))
                onwards = after.tangent @ here.tangent > np.cos(BENT)
                if onwards and CLOSE * gone < here.clear + after.clear and gone < 2.0 * step:
                    self.step = 1.6 * step
                    return after
            step *= 0.5
        return None

    def _through(self) -> Iterator[Arc]:
        """The arcs through a change point that lies just ahead, if one does."""
        here = self.here
        self._looked = here.clear
        found = self._crossing(here)
        if found is None:
            return
        went, onwards, beyond = self._taken(found, here)
        inwards, outwards = self._sided(found, 0, here), self._sided(found, went, onwards)
        if inwards is None or outwards is None:
            return
        if float(inwards.middle.tangent @ (here.y - inwards.before.y)) < 0.0:
            yield between(here, inwards.before)
            here = inwards.before
        self.passed.append(Passed(found, went, beyond=beyond))
        yield inwards.arc(here, inwards.middle)
        yield outwards.arc(outwards.middle, outwards.after)
        self.here = outwards.after

    def _crossing(self, here: Point) -> Crossing | None:
        """The change point that lies just ahead; those of neighbouring linkages are noted."""
        curve = self.curve
        for near in nearest(curve, here):
            away = float(np.linalg.norm(near.y - here.y))
            if not float(here.tangent @ (near.y - here.y)) > 0.0 or away > max(AHEAD * here.clear, SUSPECTED):
                continue
            if near.open > curve.solver.tolerance or not curve.closes(near.y):
                self.missed = [each for each in self.missed if np.linalg.norm(each.y - near.y) > 1e-6]
                self.missed.append(Missed(near.y, away, near.open))
                continue
            found = crossing(curve, here, near.y)
            if found is not None:
                return found
        return None

    def _sided(self, found: Crossing, index: int, towards: Point) -> Beside | None:
        """The curve beside a change point along one of its ways, in the sense of a point on it."""
        way = found.ways[index]
        return beside(self.curve, way if way.tangent @ towards.tangent >= 0.0 else way.turned(), found.lost)

    def _taken(self, found: Crossing, here: Point) -> tuple[int, Point, bool]:
        """The way to go on by, and a point in whose sense: smoothly, or as asked for; and whether it is but the last,
        as there are not so many."""
        number = self.branches.pop(0) if self.branches else 1
        options = outgoing(found, here)
        index, tangent = options[min(number, len(options)) - 1]
        return index, found.ways[index]._replace(tangent=tangent), number > len(options)

    def _note(self, after: Point) -> None:
        """How near the walk comes to change points of neighbouring linkages."""
        for k, each in enumerate(self.missed):
            self.missed[k] = each._replace(distance=min(each.distance, float(np.linalg.norm(after.y - each.y))))


def _limit(here: Point, slide: int) -> float | None:
    """The place to which the inputs tend as a slide goes out without an end; None where they go on with it.

    Far out t = limit + c s^-k, of which the first and second derivative by s tell k and the rest of the way.
    """
    s, s1, s2 = here.y[slide], here.tangent[slide], here.bend[slide]
    t, t1, t2 = here.y[-1], here.tangent[-1], here.bend[-1]
    if s * s1 <= 0.0:
        return None
    first, second = t1 / s1, (t2 * s1 - t1 * s2) / s1**3
    if abs(s * first) < STANDS:
        return float(t)
    power = -s * second / first - 1.0
    return float(t + s * first / power) if power > CONVERGES else None


def outgoing(found: Crossing, here: Point) -> list[tuple[int, Array]]:
    """The ways on from a change point with their directions: the smooth one first, then by the angle from it.

    Of another way the direction in which the inputs go on as they came; both where they rest on it.
    """
    smooth = found.ways[0].tangent
    smooth = smooth if smooth @ here.tangent >= 0.0 else -smooth
    options = []
    for index, way in enumerate(found.ways):
        for tangent in (way.tangent, -way.tangent):
            same = index == 0
            onwards = tangent @ smooth > 0.0 if same else tangent[-1] * smooth[-1] >= -1e-9
            if onwards:
                options.append((index, tangent))
    return sorted(options, key=lambda each: -float(each[1] @ smooth))
