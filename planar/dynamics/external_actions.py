"""Everything that acts on links from outside, and their inertia, as forces at places and couples.

By the mechanics of vectors alone, from positions, velocities and accelerations. Numbers of the mechanism may be arrays
(n,), one for each position.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.dynamics.load_attachment import Attachment, attachments
from planar.dynamics.load_variation import load_factors
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import value_and_rates
from planar.foundation.short_repr import short_repr
from planar.model.loads import COINCIDENCE_TOLERANCE, Load, Spring
from planar.model.mechanism import relative_motions
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


class KinematicArrays:
    """The positions of a state or a motion (n), with rates, as arrays."""

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
        """The mechanism's size (m)."""
        return mechanism_size(self.mechanism, self.shapes) if self._size is None else self._size

    def frame(self, link: str) -> Frame:
        """A link's axes at every position, rates left out."""
        x, y, cosine, sine, angle = self._frame_rates(link)[0]
        return Frame(x, y, cosine, sine, angle, self.moving.frames[link].fixed)

    @property
    def frames(self) -> dict[str, Frame]:
        """The axes of all links."""
        return {link: self.frame(link) for link in self.moving.frames}

    def point_rates(self, link: str, local_point: Vector, rate: int = 0) -> Array:
        """Where a place of a link is, or one of its rates (n, 2)."""
        x, y, cosine, sine, _ = self._frame_rates(link)[rate]  # a place goes with these as they go
        across, up = cosine * local_point.x - sine * local_point.y, sine * local_point.x + cosine * local_point.y
        return np.stack([x + across, y + up], axis=-1)

    def angle_rates(self, link: str, rate: int = 1) -> Array:
        """A link's angle or one of its rates (n,)."""
        return self._frame_rates(link)[rate][4]

    @cached_property
    def attachments(self) -> Mapping[str, Attachment]:
        """On which links loads and springs act."""
        return attachments(self.mechanism)

    def velocity_at(self, link: str, at: Array) -> Array:
        """The velocity of what of a link is at places (n, 2) of the world."""
        place, rate = self._frame_rates(link)[:2]
        return np.stack([rate[0] - rate[4] * (at[:, 1] - place[1]), rate[1] + rate[4] * (at[:, 0] - place[0])], axis=-1)

    def _frame_rates(self, link: str) -> Array:
        """The five numbers of a link's axes, and their two rates (3, 5, n)."""
        if link not in self._known:
            rates: Array = np.zeros((3, 5, self.position_count))
            for k, part in enumerate(self.moving.frames[link][:5]):
                for rate, value in enumerate(value_and_rates(part)[: 1 if self.at_rest else 3]):
                    rates[rate, k] = value
            self._known[link] = rates
        return self._known[link]


def collect_actions(field: KinematicArrays, time: Array | None, efforts: Array, inertia: bool) -> list[ExternalAction]:
    """All that acts, the inputs' efforts (n, inputs) among it, and the inertia of the links where wanted."""
    actions = passive_actions(field, action_factors(field, time))
    for given, effort in zip(field.mechanism.inputs, efforts.T, strict=True):
        actions += effort_actions(field, "input", given.pair, effort)
    return actions + (list(inertia_actions(field)) if inertia else [])


def action_factors(field: KinematicArrays, time: Array | None) -> Array:
    """The factors of the loads at the positions of the inputs, or at times (n, loads)."""
    inputs = {given.pair: _input_positions(field, given.pair) for given in field.mechanism.inputs}
    return load_factors(field.mechanism, inputs, time, field.position_count)


def passive_actions(field: KinematicArrays, factors: Array, spring_turns: Array | None = None) -> list[ExternalAction]:
    """Loads, multiplied by factors (n, loads), weights, and springs with their dampers.

    `spring_turns` (springs, n) are the turns of torsional springs, by default those of the first position: see
    `LinkCoordinates.initial_spring_turns`.
    """
    actions: list[ExternalAction] = []
    for load, factor in zip(field.mechanism.loads, factors.T, strict=True):
        actions += actions_of_load(field, load, factor)
    actions += _weight_actions(field)
    for number, spring in enumerate(field.mechanism.springs):
        turns = None if spring_turns is None else spring_turns[number]
        actions += _spring_actions(field, spring, f"spring {number + 1}", turns)
    return actions


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


def actions_of_load(field: KinematicArrays, load: Load, factor: Array) -> Iterator[ExternalAction]:
    """What one load does to each link on which it acts, multiplied by a factor (n,)."""
    none = np.zeros((field.position_count, 2))
    if load.point is not None and load.force is not None:
        link, point = field.attachments[load.point][:2]
        place = field.shapes[link].position(point)
        force = Vector(*load.force)
        turned = field.frame(load.axes).rotate_to_world(force) if load.axes is not None else force
        wide = np.stack([factor * turned.x, factor * turned.y], axis=-1)
        yield ExternalAction("load", load.point, link, field.point_rates(link, place), wide, none[:, 0])
    if load.link is not None and load.torque is not None:
        yield ExternalAction(
            "load", load.link, load.link, field.point_rates(load.link, Vector(0.0, 0.0)), none, load.torque * factor
        )
    if load.points is not None and load.effort is not None:
        line = _point_line(field, load.points)
        yield from line.actions("load", load.target, (load.effort * factor)[:, None] * line.unit)
    if load.pair is not None and load.effort is not None:
        yield from effort_actions(field, "load", load.pair, load.effort * factor)


def effort_actions(field: KinematicArrays, kind: str, pair: str, effort: Array) -> list[ExternalAction]:
    """What drives a pair, on the one link and on the other."""
    way = relative_motions(field.mechanism)[pair].effort_action(field.frames, field.shapes)
    actions = []
    for link, sense in ((way.link, 1.0), (way.reaction_link, -1.0)):
        force, couple, at = (
            np.zeros((field.position_count, 2)),
            sense * effort,
            field.point_rates(link, Vector(0.0, 0.0)),
        )
        if way.point is not None and way.direction is not None:
            at = np.stack(np.broadcast_arrays(*way.point, effort)[:2], axis=-1)
            force, couple = np.stack([part * sense * effort for part in way.direction], axis=-1), 0.0 * effort
        actions.append(ExternalAction(kind, pair, link, at, force, couple))
    return actions


def _input_positions(field: KinematicArrays, pair: str) -> Array:
    given = next(each for each in field.mechanism.inputs if each.pair == pair)
    inputs = getattr(field.moving, "inputs", {})
    position = inputs[pair].position if pair in inputs else given.position
    return np.broadcast_to(np.asarray(position, dtype=float), (field.position_count,))


def _weight_actions(field: KinematicArrays) -> Iterator[ExternalAction]:
    gravity = field.mechanism.gravity
    if not any(np.any(part) for part in gravity):
        return
    for mass in field.mechanism.masses:
        place = field.shapes[mass.link].position(mass.at)
        weight = np.empty((field.position_count, 2))
        for k, part in enumerate(gravity):
            weight[:, k] = mass.mass * part
        at = field.point_rates(mass.link, place)
        yield ExternalAction("weight", f"weight of {mass.link}", mass.link, at, weight, 0.0 * weight[:, 0])


def inertia_actions(field: KinematicArrays) -> Iterator[ExternalAction]:
    """D'Alembert's forces: minus mass times acceleration, at the centre of mass."""
    for mass in field.mechanism.masses:
        place = field.shapes[mass.link].position(mass.at)
        force = -np.reshape(mass.mass, (-1, 1)) * field.point_rates(mass.link, place, 2)
        couple = -mass.inertia * field.angle_rates(mass.link, 2)
        at = field.point_rates(mass.link, place)
        yield ExternalAction("inertia", f"inertia of {mass.link}", mass.link, at, force, couple)


def _spring_actions(field: KinematicArrays, spring: Spring, name: str, turns: Array | None) -> list[ExternalAction]:
    """A spring with its damper on both its ends: it pulls where it is longer than free, or grows."""
    first, second = spring.ends
    if spring.is_torsional:
        angle = field.angle_rates(second, 0) - field.angle_rates(first, 0)
        if turns is None:
            start = angle[0] - (spring.free if abs(spring.free) <= np.pi else 0.0)
            turns = 2.0 * np.pi * np.round(start / (2.0 * np.pi))
        wound = angle - turns - spring.free
        couple = spring.stiffness * wound + spring.damping * (field.angle_rates(second) - field.angle_rates(first))
        none = np.zeros((field.position_count, 2))
        return [
            ExternalAction("spring", name, link, field.point_rates(link, Vector(0.0, 0.0)), none, sense * couple)
            for link, sense in ((first, 1.0), (second, -1.0))
        ]
    line = _point_line(field, spring.ends)
    pull = np.reshape(spring.stiffness, (-1, 1)) * (line.places[1] - line.places[0])
    if np.any(spring.free):
        pull = pull - np.reshape(spring.stiffness * spring.free, (-1, 1)) * line.unit
    if np.any(spring.damping):
        velocities = [field.point_rates(*end, 1) for end in line.ends]
        growth = ((velocities[1] - velocities[0]) * line.unit).sum(axis=1)
        pull = pull + (spring.damping * growth)[:, None] * line.unit
    return line.actions("spring", name, -pull)


class _PointLine(NamedTuple):
    """The line from one point to another: their links with the places there, where they are (2, n, 2), and its
    direction (n, 2), NaN where the points coincide."""

    ends: list[tuple[str, Vector]]
    places: list[Array]
    unit: Array

    def actions(self, kind: str, name: str, push: Array) -> list[ExternalAction]:
        """A force (n, 2) on the second point, and its opposite on the first."""
        none = np.zeros(len(push))
        return [
            ExternalAction(kind, name, link, place, sense * push, none)
            for (link, _), place, sense in zip(self.ends, self.places, (-1.0, 1.0), strict=True)
        ]


def _point_line(field: KinematicArrays, points: tuple[str, str]) -> _PointLine:
    attached = [field.attachments[point] for point in points]
    ends = [(each.link, field.shapes[each.link].position(each.point)) for each in attached]
    places = [field.point_rates(*end, 0) for end in ends]
    apart = places[1] - places[0]
    distance = np.hypot(*apart.T)
    coincide = distance <= COINCIDENCE_TOLERANCE * field.size
    return _PointLine(ends, places, apart / np.where(coincide, np.nan, distance)[:, None])
