"""Everything that acts on links from outside, and their inertia, as forces at places and couples.

By the mechanics of vectors alone, from positions, velocities and accelerations. Numbers may be arrays (n,), one for
each position, or jets, whose derivatives follow by the same lines.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.dynamics.load_attachment import Attachment, attachments
from planar.dynamics.load_variation import load_factors
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, Scalar, hypot, value_and_rates
from planar.foundation.short_repr import short_repr
from planar.model.link_shapes import LinkShape
from planar.model.loads import COINCIDENCE_TOLERANCE, Load, Spring
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import Pair
from planar.model.pairs.base import EffortAction
from planar.results.kinematic_result import KinematicResult


class ExternalAction(NamedTuple):
    """A force (n, 2) at a place (n, 2) of a link, a couple (n,), and their power, at n positions (N, N m, m, W).

    `kind` is "load", "weight", "spring", "input" or "inertia", and `name` what it is called in the file.
    """

    kind: str
    name: str
    link: str
    at: Array
    force: Array
    couple: Array | float
    power: Array | float = 0.0

    def __repr__(self) -> str:
        return short_repr(self)


class LinkAction(NamedTuple):
    """The same in any arithmetic: a force at a place of a link, and a couple."""

    kind: str
    name: str
    link: str
    place: Vector
    force: Vector
    couple: Scalar

    def as_arrays(self, count: int) -> ExternalAction:
        """The action at `count` positions."""
        arrays: list[Array] = [np.empty((count, 2)) for _ in range(2)]
        for array, vector in zip(arrays, (self.place, self.force), strict=True):
            array[:, 0], array[:, 1] = vector
        return ExternalAction(self.kind, self.name, self.link, arrays[0], arrays[1], np.zeros(count) + self.couple)


NO_FORCE = Vector(0.0, 0.0)


class LinkMotion(ABC):
    """Positions of links with two rates, in any arithmetic."""

    mechanism: Mechanism
    shapes: Mapping[str, LinkShape]

    @property
    @abstractmethod
    def size(self) -> float:
        """The mechanism's size (m)."""

    @abstractmethod
    def frame_rates(self, link: str) -> Sequence[Sequence[Scalar]] | Array:
        """The five numbers of a link's axes, x, y, cos, sin and angle, and their two rates (3, 5)."""

    def frame(self, link: str) -> Frame:
        """A link's axes, rates left out."""
        x, y, cosine, sine, angle = self.frame_rates(link)[0]
        return Frame(x, y, cosine, sine, angle, link == self.mechanism.frame)

    @cached_property
    def frames(self) -> dict[str, Frame]:
        """The axes of all links."""
        return {link: self.frame(link) for link in self.shapes}

    def place(self, link: str, local_point: Vector, rate: int = 0) -> Vector:
        """Where a place of a link is, or one of its rates."""
        x, y, cosine, sine, _ = self.frame_rates(link)[rate]  # a place goes with these as they go
        return Vector(x, y) + local_point.rotate(Vector(cosine, sine))

    def angle_rates(self, link: str, rate: int = 1) -> Scalar:
        """A link's angle or one of its rates."""
        return self.frame_rates(link)[rate][4]

    @cached_property
    def attachments(self) -> Mapping[str, Attachment]:
        """On which links loads and springs act."""
        return attachments(self.mechanism)

    @cached_property
    def relative_motions(self) -> Mapping[str, Pair]:
        """The relative motions of the mechanism by name."""
        return relative_motions(self.mechanism)


class KinematicArrays(LinkMotion):
    """The positions of a state or a motion (n), with rates, as arrays (n,)."""

    def __init__(self, moving: KinematicResult, size: float | None = None, at_rest: bool = False):
        """`size` is the mechanism's, needed where its numbers are arrays; `at_rest` leaves all rates out."""
        self.moving, self.shapes, self.at_rest = moving, moving.shapes, at_rest
        self.mechanism = moving.mechanism
        self._size = size
        parts = [np.size(part) for frame in moving.frames.values() for part in value_and_rates(frame.angle)]
        self.position_count = max(parts, default=1)
        self._known: dict[str, Array] = {}

    @cached_property
    def size(self) -> float:
        return mechanism_size(self.mechanism, self.shapes) if self._size is None else self._size

    def point_rates(self, link: str, local_point: Vector, rate: int = 0) -> Array:
        """Where a place of a link is, or one of its rates (n, 2)."""
        return np.stack(self.place(link, local_point, rate), axis=-1)

    def velocity_at(self, link: str, at: Array) -> Array:
        """The velocity of what of a link is at places (n, 2) of the world."""
        place, rate = self.frame_rates(link)[:2]
        return np.stack([rate[0] - rate[4] * (at[:, 1] - place[1]), rate[1] + rate[4] * (at[:, 0] - place[0])], axis=-1)

    def frame_rates(self, link: str) -> Array:
        """See `LinkMotion`: (3, 5, n)."""
        if link not in self._known:
            rates: Array = np.zeros((3, 5, self.position_count))
            for k, part in enumerate(self.moving.frames[link][:5]):
                for rate, value in enumerate(value_and_rates(part)[: 1 if self.at_rest else 3]):
                    rates[rate, k] = value
            self._known[link] = rates
        return self._known[link]

    def external_actions(self, actions: Iterable[LinkAction]) -> list[ExternalAction]:
        """Actions as arrays."""
        return [action.as_arrays(self.position_count) for action in actions]


def collect_actions(field: KinematicArrays, time: Array | None, efforts: Array, inertia: bool) -> list[ExternalAction]:
    """All that acts, the inputs' efforts (n, inputs) among it, and the inertia of the links where wanted."""
    actions = [*passive_actions(field, action_factors(field, time).T)]
    for given, effort in zip(field.mechanism.inputs, efforts.T, strict=True):
        actions += effort_actions(field, "input", given.pair, effort)
    return field.external_actions([*actions, *(inertia_actions(field) if inertia else ())])


def action_factors(field: KinematicArrays, time: Array | None) -> Array:
    """The factors of the loads at the positions of the inputs, or at times (n, loads)."""
    inputs = {given.pair: _input_positions(field, given.pair) for given in field.mechanism.inputs}
    return load_factors(field.mechanism, inputs, time, field.position_count)


def passive_actions(
    field: LinkMotion, factors: Sequence[Scalar] | Array, spring_turns: Sequence[Scalar] | Array | None = None
) -> Iterator[LinkAction]:
    """Loads, multiplied by factors (loads,), weights, and springs with their dampers.

    `spring_turns` (springs,) are the turns of torsional springs, by default those of the first position of arrays: see
    `LinkCoordinates.initial_spring_turns`.
    """
    for load, factor in zip(field.mechanism.loads, factors, strict=True):
        yield from actions_of_load(field, load, factor)
    yield from _weight_actions(field)
    for number, spring in enumerate(field.mechanism.springs):
        turns = None if spring_turns is None else spring_turns[number]
        yield from _spring_actions(field, spring, f"spring {number + 1}", turns)


class ActionVelocities(NamedTuple):
    """How what something acts on moves: its place (acting, n, 2), m/s, and its link (acting, n), rad/s."""

    velocity: Array
    angular_velocity: Array


def action_velocities(field: KinematicArrays, all_of: Sequence[ExternalAction]) -> ActionVelocities:
    """Of all that acts at once."""
    velocity = [field.velocity_at(each.link, each.at) for each in all_of]
    turning = [field.angle_rates(each.link) for each in all_of]
    many = len(all_of), field.position_count
    return ActionVelocities(np.array(velocity).reshape(*many, 2), np.array(turning).reshape(many))


def action_powers(field: KinematicArrays, all_of: Sequence[ExternalAction], velocities: ActionVelocities) -> Array:
    """The power of each (acting, n), W."""
    rows = [
        each.force[:, 0] * velocity[:, 0] + each.force[:, 1] * velocity[:, 1] + each.couple * turning
        for each, velocity, turning in zip(all_of, *velocities, strict=True)
    ]
    return np.array(rows).reshape(len(all_of), field.position_count)


def actions_of_load(field: LinkMotion, load: Load, factor: Scalar) -> Iterator[LinkAction]:
    """What one load does to each link on which it acts, multiplied by a factor."""
    if load.point is not None and load.force is not None:
        link, point = field.attachments[load.point][:2]
        force = Vector(*load.force)
        if load.axes is not None:
            force = field.frame(load.axes).rotate_to_world(force)
        place = field.place(link, field.shapes[link].position(point))
        yield LinkAction("load", load.point, link, place, force * factor, 0.0)
    if load.link is not None and load.torque is not None:
        place = field.place(load.link, Vector(0.0, 0.0))
        yield LinkAction("load", load.link, load.link, place, NO_FORCE, load.torque * factor)
    if load.points is not None and load.effort is not None:
        line = _point_line(field, load.points)
        yield from line.actions("load", load.target, line.unit * (load.effort * factor))
    if load.pair is not None and load.effort is not None:
        yield from effort_actions(field, "load", load.pair, load.effort * factor)


def effort_actions(field: LinkMotion, kind: str, pair: str, effort: Scalar) -> Iterator[LinkAction]:
    """What drives a pair, on the one link and on the other."""
    unit_action = field.relative_motions[pair].effort_action(field.frames, field.shapes)
    return two_sided_actions(field, kind, pair, unit_action, effort)


def two_sided_actions(
    field: LinkMotion, kind: str, name: str, unit_action: EffortAction, size: Scalar
) -> Iterator[LinkAction]:
    """A force or couple of this size on a link, and its opposite on another."""
    for link, sense in ((unit_action.link, 1.0), (unit_action.reaction_link, -1.0)):
        if unit_action.point is not None and unit_action.direction is not None:
            force = unit_action.direction * (sense * size)
            yield LinkAction(kind, name, link, unit_action.point, force, 0.0)
        else:
            yield LinkAction(kind, name, link, field.place(link, Vector(0.0, 0.0)), NO_FORCE, sense * size)


def action_on_link(field: LinkMotion, action: LinkAction) -> tuple[Scalar, Scalar, Scalar]:
    """What an action puts on the coordinates x, y and angle of its link."""
    frame = field.frame(action.link)
    arm = action.place - Vector(frame.x, frame.y)
    return action.force.x, action.force.y, arm.cross(action.force) + action.couple


def _input_positions(field: KinematicArrays, pair: str) -> Array:
    given = next(each for each in field.mechanism.inputs if each.pair == pair)
    inputs = getattr(field.moving, "inputs", {})
    position = inputs[pair].position if pair in inputs else given.position
    return np.broadcast_to(np.asarray(position, dtype=float), (field.position_count,))


def _may_be_nonzero(number: Scalar) -> bool:
    """Whether a number is not zero, or has derivatives."""
    return isinstance(number, Jet) or bool(np.any(number))


def _weight_actions(field: LinkMotion) -> Iterator[LinkAction]:
    gravity = field.mechanism.gravity
    if not any(map(_may_be_nonzero, gravity)):
        return
    for mass in field.mechanism.masses:
        place = field.place(mass.link, field.shapes[mass.link].position(mass.at))
        weight = Vector(*(mass.mass * part for part in gravity))
        yield LinkAction("weight", f"weight of {mass.link}", mass.link, place, weight, 0.0)


def inertia_actions(field: LinkMotion) -> Iterator[LinkAction]:
    """D'Alembert's forces: minus mass times acceleration, at the centre of mass."""
    for mass in field.mechanism.masses:
        centre = field.shapes[mass.link].position(mass.at)
        force = field.place(mass.link, centre, 2) * -mass.mass
        couple = -mass.inertia * field.angle_rates(mass.link, 2)
        yield LinkAction("inertia", f"inertia of {mass.link}", mass.link, field.place(mass.link, centre), force, couple)


def _spring_actions(field: LinkMotion, spring: Spring, name: str, turns: Scalar | None) -> Iterator[LinkAction]:
    """A spring with its damper on both its ends: it pulls where it is longer than free, or grows."""
    first, second = spring.ends
    if spring.is_torsional:
        angle = field.angle_rates(second, 0) - field.angle_rates(first, 0)
        if turns is None:
            start = angle[0] - (spring.free if abs(spring.free) <= np.pi else 0.0)
            turns = 2.0 * np.pi * np.round(start / (2.0 * np.pi))
        wound = angle - turns - spring.free
        couple = spring.stiffness * wound + spring.damping * (field.angle_rates(second) - field.angle_rates(first))
        for link, sense in ((first, 1.0), (second, -1.0)):
            yield LinkAction("spring", name, link, field.place(link, Vector(0.0, 0.0)), NO_FORCE, sense * couple)
        return
    line = _point_line(field, spring.ends)
    pull = (line.places[1] - line.places[0]) * spring.stiffness
    if _may_be_nonzero(spring.free):
        pull = pull - line.unit * (spring.stiffness * spring.free)
    if _may_be_nonzero(spring.damping):
        velocities = [field.place(*end, 1) for end in line.ends]
        pull = pull + line.unit * (spring.damping * (velocities[1] - velocities[0]).dot(line.unit))
    yield from line.actions("spring", name, pull * -1.0)


class _PointLine(NamedTuple):
    """The line from one point to another: their links with the places there, where they are, and its direction, NaN
    where the points coincide."""

    ends: list[tuple[str, Vector]]
    places: list[Vector]
    unit: Vector

    def actions(self, kind: str, name: str, push: Vector) -> Iterator[LinkAction]:
        """A force on the second point, and its opposite on the first."""
        for (link, _), place, sense in zip(self.ends, self.places, (-1.0, 1.0), strict=True):
            yield LinkAction(kind, name, link, place, push * sense, 0.0)


def _point_line(field: LinkMotion, points: tuple[str, str]) -> _PointLine:
    attached = [field.attachments[point] for point in points]
    ends = [(each.link, field.shapes[each.link].position(each.point)) for each in attached]
    places = [field.place(*end) for end in ends]
    apart = places[1] - places[0]
    distance = hypot(*apart)
    is_apart = distance > COINCIDENCE_TOLERANCE * field.size
    known = np.where(is_apart, 1.0, np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        return _PointLine(ends, places, Vector(apart.x / distance * known, apart.y / distance * known))
