"""The piston of a crank and a rod: the two-term formulas of textbooks, what is exact, and how far they are apart."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import acos, atan2, cos, pi, sin, sqrt
from typing import NamedTuple, Protocol

import numpy as np

from planar.analysis.identity.kinematic_scheme import (
    LENGTH_TOLERANCE,
    KinematicScheme,
    SchemeJoint,
    kinematic_scheme,
    pin_distance,
)
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import State
from planar.solving.position import solve

COMPARISON_ANGLES = 3600
"""Of a turn, at which a formula is held against what is exact."""


class Deviation(NamedTuple):
    """How far a formula is off at the most over a turn, as a part of the greatest exact value, and where (rad)."""

    part: float
    theta: float


class RodPointMotion(NamedTuple):
    """A point of the rod: x from the crank's axis towards the piston, y to the left of that, with their rates (SI)."""

    position: Array
    velocity: Array
    acceleration: Array

    def __repr__(self) -> str:
        return short_repr(self)


class PistonFormulas(Protocol):
    """The motion of a piston as formulas of the crank angle theta (rad), floats or arrays.

    theta is measured anticlockwise from the way along the stroke from the crank's axis to the piston, so that it is 0
    at TDC where the stroke passes through the axis. Displacement (m), velocity (m/s) and acceleration (m/s^2) are from
    TDC and positive away from it, towards the crank; `rate` is d theta/dt (rad/s), which is steady.
    """

    def displacement(self, theta: Array | float) -> Array: ...

    def velocity(self, theta: Array | float, rate: float) -> Array: ...

    def acceleration(self, theta: Array | float, rate: float) -> Array: ...

    def rod_point(self, theta: float, rate: float, b: float) -> RodPointMotion: ...

    def angle_of_greatest_speed(self) -> float: ...


@dataclass(frozen=True)
class TwoTermFormulas:
    """The series of the chapters, cut after the first power of r/l, for a stroke through the crank's axis.

    Machine Elements, 1.3.7 (i), its acceleration put right: (r/2l) sin 2 theta has the derivative (r/l) cos 2 theta.
    """

    r: float
    l: float  # noqa: E741 - the letter of the textbooks

    def displacement(self, theta: Array | float) -> Array:
        """S = r [(1 - cos theta) + (r/4l)(1 - cos 2 theta)]."""
        return self.r * ((1.0 - np.cos(theta)) + self.r / (4.0 * self.l) * (1.0 - np.cos(2.0 * theta)))

    def velocity(self, theta: Array | float, rate: float) -> Array:
        """dS/dt = r w [sin theta + sin 2 theta / 2n], n = l/r."""
        return self.r * rate * (np.sin(theta) + self.r / (2.0 * self.l) * np.sin(2.0 * theta))

    def acceleration(self, theta: Array | float, rate: float) -> Array:
        """d2S/dt2 = r w^2 [cos theta + cos 2 theta / n], n = l/r, at a steady rate."""
        return self.r * rate**2 * (np.cos(theta) + self.r / self.l * np.cos(2.0 * theta))

    def rod_point(self, theta: float, rate: float, b: float) -> RodPointMotion:
        """The point of the rod at a distance b (m) from the piston, on the way to the crank.

        x = r cos theta + l - b - (1 - b/l)(r^2/4l)(1 - cos 2 theta), y = r (b/l) sin theta, and their derivatives.
        """
        r, l, far = self.r, self.l, 1.0 - b / self.l  # noqa: E741
        second = r / l * far
        x = r * cos(theta) + l - b - 0.25 * r * second * (1.0 - cos(2.0 * theta))
        vx = -r * rate * (sin(theta) + 0.5 * second * sin(2.0 * theta))
        ax = -r * rate**2 * (cos(theta) + second * cos(2.0 * theta))
        y, vy, ay = (r * b / l * each for each in (sin(theta), rate * cos(theta), -(rate**2) * sin(theta)))
        return RodPointMotion(np.array([x, y]), np.array([vx, vy]), np.array([ax, ay]))

    def angle_of_greatest_speed(self) -> float:
        """The crank angle of greatest speed (rad): 2 c^2 + n c - 1 = 0 for c = cos theta, n = l/r."""
        n = self.l / self.r
        return acos((sqrt(n * n + 8.0) - n) / 4.0)


@dataclass(frozen=True)
class ExactFormulas:
    """The loop in closed form: x = r cos theta + sqrt(l^2 - (r sin theta - e)^2).

    The path of the piston's pin passes the crank's axis at the distance e, to the left of the way to the piston.
    """

    r: float
    l: float  # noqa: E741
    e: float = 0.0

    def displacement(self, theta: Array | float) -> Array:
        return sqrt((self.l + self.r) ** 2 - self.e**2) - self._pin_position(theta)[0]

    def velocity(self, theta: Array | float, rate: float) -> Array:
        return -rate * self._pin_position(theta)[1]

    def acceleration(self, theta: Array | float, rate: float) -> Array:
        return -(rate**2) * self._pin_position(theta)[2]

    def rod_point(self, theta: float, rate: float, b: float) -> RodPointMotion:
        """The point of the rod at a distance b (m) from the piston, on the way to the crank: a part b/l of the way."""
        r, part = self.r, b / self.l
        crank = np.array([[cos(theta), sin(theta)], [-sin(theta), cos(theta)], [-cos(theta), -sin(theta)]]) * r
        piston = np.array([[x, y] for x, y in zip(self._pin_position(theta), (self.e, 0.0, 0.0), strict=True)])
        position, first, second = piston + part * (crank - piston)
        return RodPointMotion(position, rate * first, rate**2 * second)

    def angle_of_greatest_speed(self) -> float:
        """The crank angle of greatest speed (rad) in a turn from 0 on, solved for; of two alike the first."""
        theta = np.linspace(0.0, 2.0 * pi, COMPARISON_ANGLES + 1)
        second = self._pin_position(theta)[2]
        changes = np.flatnonzero(np.sign(second[:-1]) != np.sign(second[1:]))
        found = [
            find_root(lambda at: float(self._pin_position(at)[2]), float(theta[k]), float(theta[k + 1]))
            for k in changes
        ]
        speeds = [abs(float(self._pin_position(at)[1])) for at in found]
        return next(
            at for at, speed in zip(found, speeds, strict=True) if speed >= max(speeds) * (1.0 - LENGTH_TOLERANCE**2)
        )

    def _pin_position(self, theta: Array | float) -> tuple[Array, Array, Array]:
        """x of the piston's pin from the crank's axis with its first and second derivative with respect to theta."""
        y, y1 = self.r * np.sin(theta) - self.e, self.r * np.cos(theta)
        q = np.sqrt(self.l**2 - y**2)
        y2 = -self.r * np.sin(theta)
        return y1 + q, y2 - y * y1 / q, -y1 - (y1**2 + y * y2) / q - (y * y1) ** 2 / q**3


@dataclass(frozen=True)
class Piston:
    """A slide on the frame that a rod joins to a crank which turns on the frame and is driven there.

    `r` and `l` are the lengths of crank and rod (m). The path of the piston's pin passes the crank's axis at the
    distance `offset` (m), to the left of the way to the piston, which is at the angle `heading` (rad). theta, see
    Formulas, is the input's position + `lead`. `tail` is the pin of the rod at the piston, in the rod's own axes (m),
    `head` that at the crank. The pair's displacement is slide[0] + slide[1] * S, where slide[1] is 1 or -1.
    """

    pair: str
    input: str
    crank: str
    rod: str
    r: float
    l: float  # noqa: E741
    offset: float
    heading: float
    lead: float
    tail: Vector
    head: Vector
    slide: tuple[float, float]

    @property
    def n(self) -> float:
        """l/r."""
        return self.l / self.r

    @property
    def is_in_line(self) -> bool:
        """Whether the path of the piston's pin passes through the crank's axis: only then the two terms hold."""
        return abs(self.offset) <= LENGTH_TOLERANCE * (self.r + self.l)

    @property
    def exact(self) -> ExactFormulas:
        """The exact formulas."""
        return ExactFormulas(self.r, self.l, self.offset)

    @property
    def two_terms(self) -> TwoTermFormulas:
        """The formulas of the chapters. Raises BadInput where the stroke does not pass through the crank's axis."""
        if not self.is_in_line:
            told = f"the two-term formula is for a stroke through the crank's axis; here it is {self.offset:.6g} m off"
            raise BadInput(self.pair, told)
        return TwoTermFormulas(self.r, self.l)

    def theta(self, position: float) -> float:
        """The crank angle (rad), between 0 and 2 pi, at a position of the input."""
        return (position + self.lead) % (2.0 * pi)

    def distance_from_piston(self, point: Vector) -> float | None:
        """b of a point of the rod, in the rod's own axes: how far from the piston on the way to the crank (m).

        None where it is not on the line of the two pins.
        """
        way, to = self.head - self.tail, point - self.tail
        return way.dot(to) / self.l if abs(way.cross(to)) <= LENGTH_TOLERANCE * self.l * (self.r + self.l) else None

    def deviation(self, order: int) -> Deviation:
        """How far the two-term displacement (order 0), velocity (1) or acceleration (2) is off at the most."""
        theta = np.linspace(0.0, 2.0 * pi, COMPARISON_ANGLES, endpoint=False)

        def values(formulas: PistonFormulas) -> Array:
            return (
                formulas.displacement(theta),
                formulas.velocity(theta, 1.0),
                formulas.acceleration(theta, 1.0),
            )[order]

        exact = values(self.exact)
        off = np.abs(values(self.two_terms) - exact)
        worst = int(np.argmax(off > off.max() * (1.0 - LENGTH_TOLERANCE)))  # of two alike the first
        return Deviation(float(off[worst] / np.abs(exact).max()), float(theta[worst]))


def find_piston(mechanism: Mechanism, pair: str) -> Piston | None:
    """The piston that a slide is, if it is one, wherever in the mechanism it stands; told from structure alone.

    A slide on the frame, a rod from a pin of what slides to a crank, which turns fully (r + |e| < l) on a pin of the
    frame that is driven. Raises BadInput where there is no such pair, NoAnswer where the mechanism cannot be solved.
    """
    if pair not in relative_motions(mechanism):
        raise BadInput(pair, f"there is no pair {pair!r}{suggest_name(pair, relative_motions(mechanism), 'pairs')}")
    chain = kinematic_scheme(mechanism)
    slide = next((joint for joint in chain.joints if joint.slides and joint.name == pair), None)
    if slide is None or mechanism.frame not in slide.locations:
        return None
    chains = list(_rod_and_crank_chains(mechanism, chain, slide))
    if not chains:
        return None
    state = solve(mechanism)
    found = (
        _measure_piston(state, chain, (slide, a, b, c), rod, crank, given) for a, rod, b, crank, c, given in chains
    )
    return next((each for each in found if each is not None), None)


def _rod_and_crank_chains(
    mechanism: Mechanism, scheme: KinematicScheme, slide: SchemeJoint
) -> Iterator[tuple[SchemeJoint, str, SchemeJoint, str, SchemeJoint, str]]:
    """Every way from what slides by a rod to a driven crank: pin, rod, pin, crank, pin on the frame, input."""
    fixed = {mechanism.frame}
    slider = set(slide.locations) - fixed
    pins = [joint for joint in scheme.joints if not joint.slides]
    for a in (pin for pin in pins if slider & set(pin.locations)):
        for rod in [link for link in a.locations if link not in slider | fixed]:
            for b in (pin for pin in pins if rod in pin.locations and pin is not a and not fixed & set(pin.locations)):
                for crank in [link for link in b.locations if link != rod and link not in slider]:
                    for c in (pin for pin in pins if crank in pin.locations and fixed <= set(pin.locations)):
                        given = _driving_input(mechanism, c, crank)
                        if given is not None:
                            yield a, rod, b, crank, c, given


def _driving_input(mechanism: Mechanism, pin: SchemeJoint, crank: str) -> str | None:
    """The input at a pin of the frame that turns a crank."""
    named = relative_motions(mechanism)
    for given in mechanism.inputs:
        pair = named[given.pair]
        turns = pair.is_lower_pair and pair.input_kind is MeasureKind.ANGLE and pair.entry_name() == pin.name
        if turns and {*pair.links} == {mechanism.frame, crank}:
            return given.pair
    return None


def _measure_piston(
    state: State,
    scheme: KinematicScheme,
    joints: tuple[SchemeJoint, SchemeJoint, SchemeJoint, SchemeJoint],
    rod: str,
    crank: str,
    given: str,
) -> Piston | None:
    """The dimensions of a piston, if its crank turns fully; `joints` from the slide to the crank's pin on the frame."""
    slide, a, b, c = joints
    frame = scheme.frame
    r, l = pin_distance(b.locations[crank], c.locations[crank]), pin_distance(a.locations[rod], b.locations[rod])  # noqa: E741
    axis, pin = c.locations[frame].point, _world_point(state, rod, a.locations[rod].point)
    way = slide.locations[frame].line_direction
    forwards = 1.0 if way.dot(pin - axis) >= 0.0 else -1.0
    way = way * forwards
    e = float(way.cross(pin - axis))
    if min(r, l) <= 0.0 or r + abs(e) >= l * (1.0 - LENGTH_TOLERANCE):
        return None
    arm = b.locations[crank].point - c.locations[crank].point
    heading = atan2(way.y, way.x)
    # the way on a link is that of greater displacement for its second link, which the frame may be
    first = next(iter(slide.locations)) == frame
    away = -forwards if first else forwards
    here = sqrt((l + r) ** 2 - e**2) - float(way.dot(pin - axis))
    displacement = float(next(iter(state.pair(slide.name).values())) or 0.0)
    return Piston(
        pair=slide.name,
        input=given,
        crank=crank,
        rod=rod,
        r=r,
        l=l,
        offset=e,
        heading=heading,
        lead=atan2(arm.y, arm.x) - heading,
        tail=a.locations[rod].point,
        head=b.locations[rod].point,
        slide=(displacement - away * here, away),
    )


def _world_point(state: State, link: str, place: Vector) -> Vector:
    """Where a place of a link is (m)."""
    x, y = (each.parts[0] if isinstance(each, Jet) else each for each in state.frames[link].to_world(place))
    return Vector(float(x), float(y))
