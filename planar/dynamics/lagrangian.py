"""Virtual work: what pairs, inputs, loads, springs and masses do in every small motion of the links, as casadi.

Nothing is eliminated: the coordinates q are x, y, angle of every moving link, then the pairs' own (m, rad). From the
kinetic energy T, the potential V of weights and springs and the dissipation R of dampers (J. W. Strutt, 1873) Lagrange
has for every q, with the work of the loads Q, the multipliers of the constraints C q' = 0 and the efforts e of the
inputs, whose drives are D q',

    d/dt dT/dq' - dT/dq = Q - dV/dq - dR/dq' + C^T lambda + D^T e
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from planar.dynamics.link_coordinates import LinkCoordinates
from planar.dynamics.load_attachment import Attachment, attachments
from planar.equations.coordinates import FRAME_PARTS, frames_from_coordinates
from planar.equations.elimination import stack_expressions
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.equations.residuals import input_positions, pair_residuals, scalars
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar
from planar.model.loads import COINCIDENCE_TOLERANCE, Load, Mass, Spring
from planar.model.mechanism import Mechanism, relative_motions


class LagrangianFunctions(LinkCoordinates):
    """The functions of one mechanism."""

    def __init__(self, mechanism: Mechanism, unit: float | None = None):
        """Dimensions may be symbols; then `unit` is the mechanism's size (m)."""
        super().__init__(mechanism)
        self.shapes = shapes_of_links(mechanism)
        self.size = mechanism_size(mechanism, self.shapes) if unit is None else unit
        self.relative_motions = relative_motions(mechanism)
        self.attachments = attachments(mechanism)
        self.q, self.q1, self.q2 = (ca.SX.sym(name, self.coordinate_count) for name in ("q", "q1", "q2"))
        self.factors = ca.SX.sym("f", len(mechanism.loads))
        self.spring_turns = ca.SX.sym("t", len(mechanism.springs))
        columns = {(link, part): at + k for link, at in self.link_columns.items() for k, part in enumerate(FRAME_PARTS)}
        for pair in mechanism.pairs:
            first = self.own_slices[pair.name].start
            columns |= {(pair.name, part): first + k for k, (part, _) in enumerate(pair.coordinate_kinds)}
        pairs = {pair.name: pair for pair in mechanism.pairs}
        links = [link.name for link in mechanism.links]
        self.frames, self.own = frames_from_coordinates(scalars(self.q), columns, links, pairs)
        self.numbers = {
            pair.name: pair.measure([self.shapes[link] for link in pair.bodies])
            for pair in (*mechanism.pairs, *self.relative_motions.values())
        }

    @cached_property
    def residuals(self) -> ca.SX:
        """What every constraint leaves open (rows,), m or rad."""
        rows = pair_residuals(self.mechanism.pairs, self.frames, self.numbers, self.own)
        return ca.vertcat(ca.SX(0, 1), *(value for _, value in rows))

    @cached_property
    def input_positions(self) -> ca.SX:
        """The positions of the inputs (inputs,)."""
        return ca.vertcat(ca.SX(0, 1), *self.relative_positions(given.pair for given in self.mechanism.inputs))

    @cached_property
    def momentum(self) -> ca.SX:
        """dT/dq'."""
        return ca.gradient(self.energies[0], self.q1)

    @cached_property
    def inertia(self) -> ca.SX:
        """d/dt dT/dq' - dT/dq."""
        rate = ca.jtimes(self.momentum, self.q, self.q1) + ca.jtimes(self.momentum, self.q1, self.q2)
        return rate - ca.gradient(self.energies[0], self.q)

    @cached_property
    def conservative_forces(self) -> ca.SX:
        """-dV/dq: weights and springs."""
        return -ca.gradient(self.energies[1], self.q)

    @cached_property
    def applied_forces(self) -> tuple[ca.SX, ca.SX]:
        """Loads and dampers on the coordinates, and efforts between the links of pairs."""
        loads, efforts = -ca.gradient(self.energies[2], self.q1), ca.SX.zeros(self.q.numel())
        for k, load in enumerate(self.mechanism.loads):
            at, relative = self._load_forces(load)
            loads, efforts = loads + at * self.factors[k], efforts + relative * self.factors[k]
        return loads, efforts

    def relative_positions(self, names: Iterable[str]) -> list[ca.SX]:
        """The positions of relative motions."""
        motions = [self.relative_motions[name] for name in names]
        return input_positions(motions, self.frames, self.numbers, self.own)

    @cached_property
    def energies(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Kinetic energy, potential of weights and springs (J), and what dampers take up, halved (W)."""
        kinetic = potential = lost = ca.SX(0.0)
        centres = [coordinate for mass in self.mechanism.masses for coordinate in self.mass_centre(mass)]
        velocities = self._time_derivative(stack_expressions(centres))
        for k, mass in enumerate(self.mechanism.masses):
            potential += self._weight_potential(mass)
            if mass.link in self.link_columns:
                v = velocities[2 * k : 2 * k + 2]
                turning = self.q1[self.link_columns[mass.link] + 2]
                kinetic += 0.5 * mass.mass * ca.dot(v, v) + 0.5 * mass.inertia * turning**2
        for number, spring in enumerate(self.mechanism.springs):
            stored, taken = self._spring_energy_and_dissipation(spring, number)
            potential, lost = potential + stored, lost + taken
        return kinetic, potential, lost

    @cached_property
    def actions_on_links(self) -> ca.SX:
        """What each load, weight and spring puts on the links (coordinates, loads + masses + springs)."""
        q, q1 = self.q, self.q1
        loads = [self.load_on_links(load) * self.factors[k] for k, load in enumerate(self.mechanism.loads)]
        weights = [-ca.gradient(self._weight_potential(mass), q) for mass in self.mechanism.masses]
        energies = [
            self._spring_energy_and_dissipation(spring, number) for number, spring in enumerate(self.mechanism.springs)
        ]
        springs = [-ca.gradient(stored, q) - ca.gradient(taken, q1) for stored, taken in energies]
        return ca.horzcat(ca.SX(q.numel(), 0), *loads, *weights, *springs)

    @cached_property
    def total_action_on_links(self) -> ca.SX:
        """What all of them put on the links (coordinates,)."""
        loads = [self.load_on_links(load) * self.factors[k] for k, load in enumerate(self.mechanism.loads)]
        _, stored, dissipated = self.energies
        return sum(loads, -ca.gradient(stored, self.q) - ca.gradient(dissipated, self.q1))

    def load_on_links(self, load: Load) -> ca.SX:
        """What a load puts on the links (coordinates,) where its course has the factor one."""
        effort: ca.SX | float = 0.0
        if load.pair is not None and load.effort is not None:
            effort = self.unit_effort_on_links(load.pair) * load.effort
        return self._load_forces(load)[0] + effort

    def unit_effort_on_links(self, name: str) -> ca.SX:
        """What an effort of one at a pair puts on the links (coordinates,), the pairs' own coordinates left alone."""
        way = self.relative_motions[name].effort_action(self.frames, self.shapes)
        return self.unit_action_on_links({way.link: 1.0, way.reaction_link: -1.0}, way.point, way.direction)

    def unit_action_on_links(self, senses: Mapping[str, float], at: Vector | None, way: Vector | None) -> ca.SX:
        """A force of one along a way at a place of the world, or a couple of one, on links (coordinates,)."""
        found = ca.SX.zeros(self.q.numel())
        for link, sense in senses.items():
            if link in self.link_columns:
                parts = (0.0, 0.0, 1.0)
                if at is not None and way is not None:
                    frame = self.frames[link]
                    parts = (way.x, way.y, (at - Vector(frame.x, frame.y)).cross(way))
                for k, part in enumerate(parts):
                    found[self.link_columns[link] + k] += sense * part
        return found

    def mass_centre(self, mass: Mass) -> Vector:
        """Where a mass is centred."""
        return self.frames[mass.link].to_world(self.shapes[mass.link].position(mass.at))

    def _weight_potential(self, mass: Mass) -> ca.SX:
        """The potential energy of a weight (J)."""
        at, gravity = self.mass_centre(mass), self.mechanism.gravity
        return ca.SX(-mass.mass * (gravity[0] * at.x + gravity[1] * at.y))

    def _spring_energy_and_dissipation(self, spring: Spring, number: int) -> tuple[ca.SX, ca.SX]:
        """What a spring stores (J), and half of what its damper takes up (W)."""
        first, second = spring.ends
        if spring.is_torsional:
            way = self.frames[second].angle - self.frames[first].angle - spring.free - self.spring_turns[number]
            return 0.5 * spring.stiffness * way**2, 0.5 * spring.damping * self._time_derivative(way) ** 2
        apart, distance, known = self._distance(spring.ends)
        square = ca.dot(apart, apart)
        stored = (
            0.5 * spring.stiffness * ((distance - spring.free) ** 2 * known if _may_be_nonzero(spring.free) else square)
        )
        taken = ca.SX(0.0)
        if _may_be_nonzero(spring.damping):
            taken = 0.5 * spring.damping * (ca.dot(apart, self._time_derivative(apart)) / distance) ** 2 * known
        return stored, taken

    def _distance(self, points: tuple[str, str]) -> tuple[ca.SX, ca.SX, ca.SX]:
        """From one point to another: the vector (2,) and its length, m, and a factor: NaN where the points coincide.

        As a factor of a force along the line it makes Jacobians NaN too.
        """
        first, second = (self.attachment_position(self.attachments[point]) for point in points)
        apart = stack_expressions(second - first)
        square = ca.dot(apart, apart)
        coincide = square <= (COINCIDENCE_TOLERANCE * self.size) ** 2
        return apart, ca.sqrt(square), ca.if_else(coincide, np.nan, 1.0)

    def _load_forces(self, load: Load) -> tuple[ca.SX, ca.SX]:
        """A load on the coordinates, and an effort between the links of a pair."""
        q = self.q
        found, effort = ca.SX.zeros(q.numel()), ca.SX.zeros(q.numel())
        if load.point is not None and load.force is not None:
            force = Vector(*load.force)
            at = ca.vertcat(*self.attachment_position(self.attachments[load.point]))
            turned = self.frames[load.axes].rotate_to_world(force) if load.axes is not None else force
            found += ca.jtimes(at, q, ca.vertcat(*turned), True)
        if load.link is not None and load.torque is not None and load.link in self.link_columns:
            found[self.link_columns[load.link] + 2] += load.torque
        if load.points is not None and load.effort is not None:
            _, distance, known = self._distance(load.points)
            found += load.effort * ca.gradient(distance, q) * known
        if load.pair is not None and load.effort is not None:
            (position,) = self.relative_positions([load.pair])
            effort += load.effort * ca.gradient(position, q)
        return found, effort

    def attachment_position(self, at: Attachment) -> Vector:
        """Where something acts."""
        return self.frames[at.link].to_world(self.shapes[at.link].position(at.point))

    def _time_derivative(self, value: ca.SX) -> ca.SX:
        return ca.jtimes(value, self.q, self.q1)


def _may_be_nonzero(number: Scalar) -> bool:
    """Whether a number is not zero, or a symbol."""
    return isinstance(number, ca.SX) or bool(number)


@lru_cache(maxsize=32)
def lagrangian_functions(mechanism: Mechanism) -> LagrangianFunctions:
    """The functions of a mechanism, kept for the next time."""
    return LagrangianFunctions(mechanism)
