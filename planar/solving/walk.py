"""Walking along the curve of positions, arc after arc, through dead points and smoothly through change points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.pairs import Kind
from planar.roots import root
from planar.solving.change_point import Beside, Crossing, beside, crossing, nearest, starting
from planar.solving.curve import Arc, Curve, Point, between

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
ARCS = 50_000
ENDLESS = 100.0
"""Lengths of the size: what slides out so far goes out without an end."""


class Passed(NamedTuple):
    """A change point that a walk went through: the ways, by the first of which it came, and by which it went on; or
    on which it started."""

    crossing: Crossing
    went: int
    starts: bool = False

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


class Walk:
    """One walk along a curve from a point: its arcs, one after the other, and what it met on the way.

    `branches` are the numbers of the ways taken at change points, in the order in which they are met: 1 goes on
    smoothly, 2 takes the way nearest to that, and so on; 1 where the list ends. Of a start on one see `starting`.
    """

    def __init__(self, curve: Curve, start: Point, branches: Sequence[int] = ()):
        self.curve, self.here = curve, start
        self.branches = list(branches)
        self.passed: list[Passed] = []
        self.missed: list[Missed] = []
        self.step = FIRST
        self._looked, self._approaching = np.inf, False
        self.endless = False
        self._out_of: Beside | None = None
        coordinates, unknowns = curve.program.equations.coordinates, curve.program.equations.unknowns
        self._leave()
        self._slides = np.array([coordinates[column].kind is Kind.LENGTH for column in unknowns], dtype=bool)

    def arcs(self) -> Iterator[Arc]:
        """The arcs of the curve; they end where it cannot be followed further."""
        farthest = max(ENDLESS, 2.0 * self._out(self.here.y))
        if self._out_of is not None:
            self.here = self._out_of.after
            yield self._out_of.arc(self._out_of.middle, self._out_of.after)
        for _ in range(ARCS):
            here = self.here
            if self._approaching and here.clear < min(SUSPECTED, AGAIN * self._looked, self.step):
                through = list(self._through())
                if through:
                    yield from through
                    self.step, self._looked, self._approaching = FIRST, np.inf, False
                    continue
            elif here.clear > SUSPECTED:
                self._looked = np.inf
            after = self._next()
            if after is None:
                return
            self._note(after)
            self._approaching = after.clear < here.clear
            arc = between(here, after)
            if self._out(after.y) > farthest:
                first, last = arc.ends
                x = root(lambda x, arc=arc: self._out(arc.y(self.curve, x)) - farthest, first, last)
                self.here, self.endless = arc.at(self.curve, x), True
                yield between(here, self.here)
                return
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
        went = min(self.branches[0], len(found.ways)) - 1 if found else 0
        out = found and beside(self.curve, found.ways[went], found.lost)
        if found is not None and out is not None:
            del self.branches[0]
            self.here, self._out_of = out.middle, out
            self.passed.append(Passed(found, went, True))

    def _out(self, y: Array) -> float:
        """How far the farthest slide is out (sizes)."""
        return float(np.max(np.abs(y[:-1][self._slides]), initial=0.0))

    def _next(self) -> Point | None:
        """The next point: a predictor of second order, Newton's corrector, and the second part of the gate."""
        here, curve = self.here, self.curve
        bent = float(np.linalg.norm(here.bend))
        step = min(self.step, LONGEST, 1.2 * here.clear, 0.8 * BENT / max(bent, 1e-300))
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
        went, onwards = self._taken(found, here)
        inwards, outwards = self._sided(found, 0, here), self._sided(found, went, onwards)
        if inwards is None or outwards is None:
            return
        if float(inwards.middle.tangent @ (here.y - inwards.before.y)) < 0.0:
            yield between(here, inwards.before)
            here = inwards.before
        self.passed.append(Passed(found, went))
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

    def _taken(self, found: Crossing, here: Point) -> tuple[int, Point]:
        """The way to go on by, and a point in whose sense: smoothly, or as asked for."""
        number = self.branches.pop(0) if self.branches else 1
        options = outgoing(found, here)
        index, tangent = options[min(number, len(options)) - 1]
        return index, found.ways[index]._replace(tangent=tangent)

    def _note(self, after: Point) -> None:
        """How near the walk comes to change points of neighbouring linkages."""
        for k, each in enumerate(self.missed):
            self.missed[k] = each._replace(distance=min(each.distance, float(np.linalg.norm(after.y - each.y))))


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
