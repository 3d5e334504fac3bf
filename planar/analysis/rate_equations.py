"""Linear equations between the rates of links and slides, read from the pairs' own residuals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, Scalar
from planar.model.mechanism import Mechanism, pair_entries, relative_motions
from planar.model.pairs import Pair
from planar.results.motion import State

LEAST_COEFFICIENT = 1e-12
"""A slope below this is none: the residuals' slopes are of order one, or of the links' lengths."""


class Rate(NamedTuple):
    """A rate that a mechanism has: a link's angular one, or that of a coordinate of a pair's own."""

    owner: str
    coordinate: int | None = None

    @property
    def is_angular(self) -> bool:
        """Whether it is a link's angular rate."""
        return self.coordinate is None


class RateEquation(NamedTuple):
    """A linear equation between rates, of a pair or of the input at it (whose right side is given)."""

    pair: str
    coefficients: Mapping[Rate, float]
    is_input: bool = False


class PinJoint(NamedTuple):
    """A point at which links meet: their names with the point's name on each."""

    name: str
    members: Mapping[str, str]


class SlideJoint(NamedTuple):
    """A point of one link that moves along a line of another, which carries it along the `ways` at own rates."""

    name: str
    guide: str
    rider: str
    point: str
    directions: tuple[Array, ...]
    rates: tuple[Rate, ...]
    turns_as_one: bool
    "both links turn alike"

    @property
    def line(self) -> tuple[Array, Rate] | None:
        """The way along which it is free to move, with the rate; None where it is not just one."""
        return (self.directions[0], self.rates[0]) if len(self.directions) == 1 else None

    @property
    def members(self) -> tuple[str, str]:
        """The two links."""
        return self.guide, self.rider


@dataclass(frozen=True)
class RateEquations:
    """All that ties the rates of a position: pins and slides, at which points move together, and linear ties."""

    state: State
    pins: tuple[PinJoint, ...]
    slides: tuple[SlideJoint, ...]
    equations: tuple[RateEquation, ...]

    def value(self, rate: Rate, order: int = 1) -> float:
        """A rate (order 1) or its derivative (order 2), rad or m, per s or s^2."""
        if rate.coordinate is None:
            return derivative(self.state.frames[rate.owner].angle, order)
        return derivative(self.state.own[rate.owner][rate.coordinate], order)

    def point_position(self, link: str, point: str) -> Array:
        """Where a point of a link is (m)."""
        return self.point_motion(link, self.local_point(link, point))

    def local_point(self, link: str, point: str) -> Vector:
        """A named point in its link's own axes (m)."""
        return self.state.shapes[link].position(point)

    def local_point_at(self, link: str, position: Array) -> Vector:
        """The point of a link that lies at a place of the plane, in the link's own axes (m)."""
        return without_rates(self.state.frames[link]).to_local(Vector(float(position[0]), float(position[1])))

    def point_motion(self, link: str, local: Vector, order: int = 0) -> Array:
        """Position (order 0), velocity (1) or acceleration (2) of a point of a link, (2,), SI."""
        carried = self.state.frames[link].to_world(local)
        return np.array([derivative(carried.x, order), derivative(carried.y, order)])


def rate_equations(state: State) -> RateEquations:
    """What ties the rates of a position."""
    mechanism = state.mechanism
    pins, slides, ties = [], [], []
    for group in pair_entries(mechanism):
        together = {link: point for pair in group for link, point in pair.coincident_points()}
        if together:
            pins.append(PinJoint(group[0].entry_name(), together))
        for pair in group:
            slopes = _pair_rates(state, pair)
            ties += [RateEquation(pair.name, tie) for tie in slopes.equations]
            rides = pair.point_on_line()
            if rides is not None:
                (rider, point), guide = rides
                tied = any(set(tie) == {Rate(guide), Rate(rider)} and _is_equality(tie) for tie in slopes.equations)
                free = [index for index in range(len(pair.coordinate_kinds)) if index not in slopes.held]
                ways, own = (
                    tuple(each)
                    for each in zip(*((slopes.directions[k], Rate(pair.name, k)) for k in free), strict=True)
                )
                slides.append(SlideJoint(pair.name, guide, rider, point, ways, own, tied))
    named = relative_motions(mechanism)
    for given in mechanism.inputs:
        ties.append(RateEquation(given.pair, _input_coefficients(state, named[given.pair]), is_input=True))
    return RateEquations(state, tuple(pins), tuple(slides), tuple(ties))


def turning_classes(equations: Iterable[RateEquation]) -> dict[Rate, Rate]:
    """For every link that always turns like others the one that stands for them all."""
    stands: dict[Rate, Rate] = {}

    def of(rate: Rate) -> Rate:
        while rate in stands and stands[rate] != rate:
            rate = stands[rate]
        return rate

    for tie in equations:
        if (
            not tie.is_input
            and len(tie.coefficients) == 2
            and all(rate.is_angular for rate in tie.coefficients)
            and _is_equality(tie.coefficients)
        ):
            first, second = (of(rate) for rate in tie.coefficients)
            stands[second] = first
    return {rate: of(rate) for rate in stands}


def derivative(value: Scalar, order: int) -> float:
    """A derivative of a jet; a plain number is at rest."""
    if isinstance(value, Jet):
        return float(value.parts[order])
    return float(value) if order == 0 else 0.0


def _is_equality(slopes: Mapping[Rate, float]) -> bool:
    return abs(sum(slopes.values())) <= LEAST_COEFFICIENT


class _PairRates(NamedTuple):
    equations: tuple[dict[Rate, float], ...]
    directions: tuple[Array, ...]
    held: frozenset[int]
    "own coordinates that stay as they are, because a contact that the others keep closed has no other"


class PairGradients(NamedTuple):
    """How a pair's residual changes with each coordinate of its bodies, and with its own: columns (rows,)."""

    bodies: Mapping[tuple[str, str], Array]
    "(link, `x`, `y` or `angle`)"
    own: tuple[Array, ...]
    held: frozenset[int]
    "own coordinates that stay as they are, because a contact that the others keep closed has no other"


def pair_gradients(state: State, pair: Pair) -> PairGradients:
    """The slopes of a pair's residual at a position, from the residual itself."""
    frames = [without_rates(state.frames[link]) for link in pair.bodies]
    own = [derivative(each, 0) for each in state.own.get(pair.name, ())]
    numbers = pair.measure([state.shapes[link] for link in pair.bodies])

    def slope(frames_along: list[Frame], own_along: list[Jet]) -> Array:
        return np.array([derivative(row, 1) for row in pair.residual(frames_along, numbers, own_along)])

    still_frames, still_own = [_at_unit_rate(frame) for frame in frames], [Jet(value, 0.0) for value in own]
    ways = [[Jet(value, float(k == index)) for k, value in enumerate(own)] for index in range(len(own))]
    bodies = {}
    for index, link in enumerate(pair.bodies):
        for which in ("x", "y", "angle"):
            moved = list(still_frames)
            moved[index] = _at_unit_rate(frames[index], which)
            bodies[link, which] = slope(moved, still_own)
    held = frozenset(index for index, way in enumerate(ways) if derivative(pair.contact_gap(numbers, way), 1))
    return PairGradients(bodies, tuple(slope(still_frames, way) for way in ways), held)


def _pair_rates(state: State, pair: Pair) -> _PairRates:
    """Rows of a residual that know no place are ties; of the others, the ways of own coordinates."""
    found = pair_gradients(state, pair)
    placed = sum(np.abs(column) for (_, which), column in found.bodies.items() if which != "angle") > LEAST_COEFFICIENT
    columns = {Rate(link): column for (link, which), column in found.bodies.items() if which == "angle"}
    columns |= {Rate(pair.name, index): column for index, column in enumerate(found.own)}
    ties = [
        {rate: float(column[row]) for rate, column in columns.items() if abs(column[row]) > LEAST_COEFFICIENT}
        for row in np.flatnonzero(~placed)
    ]
    # the residual is the second's point minus the place along the first's line
    return _PairRates(tuple(ties), tuple(-column[placed] for column in found.own), found.held)


def _input_coefficients(state: State, pair: Pair) -> dict[Rate, float]:
    frames = [without_rates(state.frames[link]) for link in pair.bodies]
    own = [derivative(each, 0) for each in state.own.get(pair.name, ())]
    numbers = pair.measure([state.shapes[link] for link in pair.bodies])
    found = {}
    for index, link in enumerate(pair.bodies):
        moved = [_at_unit_rate(frame, "angle" if k == index else "") for k, frame in enumerate(frames)]
        found[Rate(link)] = derivative(pair.input_position(moved, numbers, [Jet(value, 0.0) for value in own]), 1)
    for index in range(len(own)):
        moved_own = [Jet(value, float(k == index)) for k, value in enumerate(own)]
        found[Rate(pair.name, index)] = derivative(
            pair.input_position([_at_unit_rate(frame) for frame in frames], numbers, moved_own), 1
        )
    return {rate: value for rate, value in found.items() if abs(value) > LEAST_COEFFICIENT}


def without_rates(frame: Frame) -> Frame:
    """A frame without its rates."""
    x, y, cosine, sine, angle = (derivative(value, 0) for value in frame[:5])
    return Frame(x, y, cosine, sine, angle, frame.fixed)


def _at_unit_rate(frame: Frame, which: str = "") -> Frame:
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


def moving_links(mechanism: Mechanism) -> tuple[str, ...]:
    """All links but the frame."""
    return tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
