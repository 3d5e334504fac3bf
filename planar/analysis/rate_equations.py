"""How the rates of links and slides hang together: what ties them, read from the pairs' own formulas."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet
from planar.model.mechanism import Mechanism, entries, motions
from planar.model.pairs import Pair
from planar.results.motion import State

Array = np.ndarray
NOTHING = 1e-12
"""A slope below this is none: the residuals' slopes are of order one, or of the links' lengths."""


class Rate(NamedTuple):
    """A rate that a mechanism has: a link's angular one, or that of a coordinate of a pair's own."""

    owner: str
    own: int | None = None

    @property
    def turns(self) -> bool:
        """Whether it is a link's angular rate."""
        return self.own is None


class Tie(NamedTuple):
    """A linear equation between rates, of a pair or of the input at it (whose right side is given)."""

    pair: str
    slopes: Mapping[Rate, float]
    given: bool = False


class Pin(NamedTuple):
    """A point at which links meet: their names with the point's name on each."""

    name: str
    members: Mapping[str, str]


class Slide(NamedTuple):
    """A point of one link that moves along a line of another, which carries it along the `ways` at own rates."""

    name: str
    guide: str
    rider: str
    point: str
    ways: tuple[Array, ...]
    rates: tuple[Rate, ...]
    tied: bool
    "both links turn alike"

    @property
    def line(self) -> tuple[Array, Rate] | None:
        """The way along which it is free to move, with the rate; None where it is not just one."""
        return (self.ways[0], self.rates[0]) if len(self.ways) == 1 else None

    @property
    def members(self) -> tuple[str, str]:
        """The two links."""
        return self.guide, self.rider


@dataclass(frozen=True)
class Rates:
    """All that ties the rates of a position: pins and slides, at which points move together, and linear ties."""

    state: State
    pins: tuple[Pin, ...]
    slides: tuple[Slide, ...]
    ties: tuple[Tie, ...]

    def value(self, rate: Rate, order: int = 1) -> float:
        """A rate (order 1) or its derivative (order 2), rad or m, per s or s^2."""
        if rate.own is None:
            return part(self.state.frames[rate.owner].angle, order)
        return part(self.state.own[rate.owner][rate.own], order)

    def at(self, link: str, point: str) -> Array:
        """Where a point of a link is (m)."""
        return self.carried(link, self.local(link, point))

    def local(self, link: str, point: str) -> Vector:
        """A named point in its link's own axes (m)."""
        return self.state.shapes[link].at(point)

    def pinned(self, link: str, spot: Array) -> Vector:
        """The point of a link that lies at a place of the plane, in the link's own axes (m)."""
        return still(self.state.frames[link]).local(Vector(float(spot[0]), float(spot[1])))

    def carried(self, link: str, local: Vector, order: int = 0) -> Array:
        """Position (order 0), velocity (1) or acceleration (2) of a point of a link, (2,), SI."""
        carried = self.state.frames[link].carry(local)
        return np.array([part(carried.x, order), part(carried.y, order)])


def rates(state: State) -> Rates:
    """What ties the rates of a position."""
    mechanism = state.mechanism
    pins, slides, ties = [], [], []
    for group in entries(mechanism):
        together = {link: point for pair in group for link, point in pair.coincident()}
        if together:
            pins.append(Pin(group[0].entry_name(), together))
        for pair in group:
            slopes = _slopes(state, pair)
            ties += [Tie(pair.name, tie) for tie in slopes.ties]
            rides = pair.rides()
            if rides is not None:
                (rider, point), guide = rides
                tied = any(set(tie) == {Rate(guide), Rate(rider)} and _equal(tie) for tie in slopes.ties)
                free = [index for index in range(len(pair.coordinates)) if index not in slopes.held]
                ways, own = (
                    tuple(each) for each in zip(*((slopes.ways[k], Rate(pair.name, k)) for k in free), strict=True)
                )
                slides.append(Slide(pair.name, guide, rider, point, ways, own, tied))
    named = motions(mechanism)
    for given in mechanism.inputs:
        ties.append(Tie(given.pair, _drive(state, named[given.pair]), given=True))
    return Rates(state, tuple(pins), tuple(slides), tuple(ties))


def classes(ties: Iterable[Tie]) -> dict[Rate, Rate]:
    """For every link that always turns like others the one that stands for them all."""
    stands: dict[Rate, Rate] = {}

    def of(rate: Rate) -> Rate:
        while rate in stands and stands[rate] != rate:
            rate = stands[rate]
        return rate

    for tie in ties:
        if not tie.given and len(tie.slopes) == 2 and all(rate.turns for rate in tie.slopes) and _equal(tie.slopes):
            first, second = (of(rate) for rate in tie.slopes)
            stands[second] = first
    return {rate: of(rate) for rate in stands}


def part(value: object, order: int) -> float:
    """A derivative of a jet; a plain number is at rest."""
    if isinstance(value, Jet):
        return float(value.parts[order])
    return float(value) if order == 0 else 0.0  # type: ignore[arg-type]


def _equal(slopes: Mapping[Rate, float]) -> bool:
    return abs(sum(slopes.values())) <= NOTHING


class _Slopes(NamedTuple):
    ties: tuple[dict[Rate, float], ...]
    ways: tuple[Array, ...]
    held: frozenset[int]
    "own coordinates that stay as they are, because a contact that the others keep closed has no other"


class Gradients(NamedTuple):
    """How a pair's residual changes with each coordinate of its bodies, and with its own: columns (rows,)."""

    bodies: Mapping[tuple[str, str], Array]
    "(link, `x`, `y` or `angle`)"
    own: tuple[Array, ...]
    held: frozenset[int]
    "own coordinates that stay as they are, because a contact that the others keep closed has no other"


def gradients(state: State, pair: Pair) -> Gradients:
    """The slopes of a pair's residual at a position, from the residual itself."""
    frames = [still(state.frames[link]) for link in pair.bodies]
    own = [part(each, 0) for each in state.own.get(pair.name, ())]
    numbers = pair.measure([state.shapes[link] for link in pair.bodies])

    def slope(frames_along: list[Frame], own_along: list[Jet]) -> Array:
        return np.array([part(row, 1) for row in pair.residual(frames_along, numbers, own_along)])

    still_frames, still_own = [_along(frame) for frame in frames], [Jet(value, 0.0) for value in own]
    ways = [[Jet(value, float(k == index)) for k, value in enumerate(own)] for index in range(len(own))]
    bodies = {}
    for index, link in enumerate(pair.bodies):
        for which in ("x", "y", "angle"):
            moved = list(still_frames)
            moved[index] = _along(frames[index], which)
            bodies[link, which] = slope(moved, still_own)
    held = frozenset(index for index, way in enumerate(ways) if part(pair.apart(numbers, way), 1))
    return Gradients(bodies, tuple(slope(still_frames, way) for way in ways), held)


def _slopes(state: State, pair: Pair) -> _Slopes:
    """Rows of a residual that know no place are ties; of the others, the ways of own coordinates."""
    found = gradients(state, pair)
    placed = sum(np.abs(column) for (_, which), column in found.bodies.items() if which != "angle") > NOTHING
    columns = {Rate(link): column for (link, which), column in found.bodies.items() if which == "angle"}
    columns |= {Rate(pair.name, index): column for index, column in enumerate(found.own)}
    ties = [
        {rate: float(column[row]) for rate, column in columns.items() if abs(column[row]) > NOTHING}
        for row in np.flatnonzero(~placed)
    ]
    # the residual is the second's point minus the place along the first's line
    return _Slopes(tuple(ties), tuple(-column[placed] for column in found.own), found.held)


def _drive(state: State, pair: Pair) -> dict[Rate, float]:
    frames = [still(state.frames[link]) for link in pair.bodies]
    own = [part(each, 0) for each in state.own.get(pair.name, ())]
    numbers = pair.measure([state.shapes[link] for link in pair.bodies])
    found = {}
    for index, link in enumerate(pair.bodies):
        moved = [_along(frame, "angle" if k == index else "") for k, frame in enumerate(frames)]
        found[Rate(link)] = part(pair.drive(moved, numbers, [Jet(value, 0.0) for value in own]), 1)
    for index in range(len(own)):
        moved_own = [Jet(value, float(k == index)) for k, value in enumerate(own)]
        found[Rate(pair.name, index)] = part(pair.drive([_along(frame) for frame in frames], numbers, moved_own), 1)
    return {rate: value for rate, value in found.items() if abs(value) > NOTHING}


def still(frame: Frame) -> Frame:
    """A frame without its rates."""
    return Frame(*(part(value, 0) for value in frame[:5]), frame.fixed)


def _along(frame: Frame, which: str = "") -> Frame:
    """A frame whose x, y or angle moves at unit rate."""
    turns = float(which == "angle")
    return Frame(
        Jet(frame.x, float(which == "x")),
        Jet(frame.y, float(which == "y")),
        Jet(frame.cos, -frame.sin * turns),
        Jet(frame.sin, frame.cos * turns),
        Jet(frame.angle, turns),
        frame.fixed,
    )


def moving(mechanism: Mechanism) -> tuple[str, ...]:
    """All links but the frame."""
    return tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
