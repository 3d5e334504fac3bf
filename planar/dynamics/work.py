"""Virtual work: what pairs, inputs, loads, springs and masses do in every small motion of the links, as casadi.

Nothing is eliminated: the coordinates q are x, y, angle of every moving link, then the pairs' own (m, rad). From the
kinetic energy T, the potential V of weights and springs and the dissipation R of dampers (J. W. Strutt, 1873) Lagrange
has for every q, with the work of the loads Q, the multipliers of the constraints C q' = 0 and the efforts e of the
inputs, whose drives are D q',

    d/dt dT/dq' - dT/dq = Q - dV/dq - dR/dq' + C^T lambda + D^T e
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.applied import Load, Spring
from planar.called import Called
from planar.dynamics.acting import carriers
from planar.mechanism import Mechanism, motions
from planar.motion import Moving
from planar.pairs import Pair
from planar.plane import GROUND, Frame, Vector, frame_at
from planar.program import shapes

Array = np.ndarray


class Balance(NamedTuple):
    """Everything at positions (n, ...), over the coordinates of the links alone (links: 3 per moving link).

    `constraints` (n, rows, links) with the pairs' own coordinates gone, `drives` (n, inputs, links), `loads` (n, links)
    what loads, weights, springs and dampers put on them, `inertia` (n, links) the left side above.
    """

    constraints: Array
    drives: Array
    loads: Array
    inertia: Array


class Work:
    """The functions of one mechanism."""

    def __init__(self, mechanism: Mechanism):
        self.mechanism = mechanism
        self.shapes = shapes(mechanism)
        self.links = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
        self.column = {link: 3 * k for k, link in enumerate(self.links)}
        self.named = motions(mechanism)
        self.carriers = carriers(mechanism)
        own = {pair.name: len(pair.coordinates) for pair in mechanism.pairs}
        self.many = 3 * len(self.links)
        self.q, self.q1, self.q2 = (ca.SX.sym(name, self.many + sum(own.values())) for name in ("q", "q1", "q2"))
        self.factors = ca.SX.sym("f", len(mechanism.loads))
        self.turns = ca.SX.sym("t", len(mechanism.springs))
        self.frames = {mechanism.frame: GROUND} | {
            link: frame_at(*(self.q[at + k] for k in range(3))) for link, at in self.column.items()
        }
        self._own: dict[str, slice] = {}
        at = self.many
        for name, count in own.items():
            self._own[name] = slice(at, at + count)
            at += count
        self.rows: dict[str, slice] = {}
        "of every pair: its rows of the constraints once its own coordinates are gone"
        at = 0
        for pair in mechanism.pairs:
            self.rows[pair.name] = slice(at, at + len(pair.constrains) - len(pair.coordinates))
            at = self.rows[pair.name].stop
        self._called = Called(self._function())

    def at(self, moving: Moving, factors: Array) -> Balance:
        """Everything at the positions of a state or a motion; factors of its loads (n, loads)."""
        q, q1, q2 = self.coordinates(moving)
        return self.over(q, q1, q2, factors, self.wound(q[0]))

    def wound(self, q: Array) -> Array:
        """The whole turns (rad) by which links stand apart whose torsional springs do not count them (springs,).

        Nothing says in a file how often a spring is wound up: where its links stand at coordinates q it is the least.
        """
        found = np.zeros(len(self.mechanism.springs))
        for number, spring in enumerate(self.mechanism.springs):
            if spring.turns:
                first, second = (q[self.column[link] + 2] if link in self.column else 0.0 for link in spring.ends)
                found[number] = 2.0 * np.pi * np.round((second - first - spring.free) / (2.0 * np.pi))
        return found

    def over(self, q: Array, q1: Array, q2: Array, factors: Array, wound: Array) -> Balance:
        """Everything at coordinates with their rates (n, coordinates), each alike; `wound` as above."""
        slopes, drives, loads, inertia, efforts = self._called.over(len(q), q, q1, q2, factors, wound)
        slopes, drives, efforts = (each.transpose(0, 2, 1) for each in (slopes, drives, efforts))
        constraints = np.zeros((len(q), max((rows.stop for rows in self.rows.values()), default=0), self.many))
        carried, pushed = drives[:, :, : self.many].copy(), efforts[:, :, : self.many].copy()
        first = 0
        for pair in self.mechanism.pairs:
            rows, own = slice(first, first + len(pair.constrains)), self._own[pair.name]
            first = rows.stop
            of_links, of_own = slopes[:, rows, : self.many], slopes[:, rows, own]
            if of_own.shape[2]:
                # what follows of its own coordinates from those of the links, and what is left to hold these
                basis, upper = np.linalg.qr(of_own, mode="complete")
                count = of_own.shape[2]
                turned = basis.transpose(0, 2, 1) @ of_links
                follows = -np.linalg.solve(upper[:, :count], turned[:, :count])
                of_links = turned[:, count:]
                carried += drives[:, :, own] @ follows
                pushed += efforts[:, :, own] @ follows
            constraints[:, self.rows[pair.name]] = of_links
        return Balance(constraints, carried, loads[:, 0, : self.many] + pushed.sum(axis=1), inertia[:, 0, : self.many])

    def coordinates(self, moving: Moving) -> tuple[Array, Array, Array]:
        """The coordinates of a state or a motion with their two rates (n, coordinates)."""
        values = [getattr(moving.frames[link], part) for link in self.links for part in ("x", "y", "angle")]
        values += [each for pair in self.mechanism.pairs for each in moving.own.get(pair.name, ())]
        parts = [value.parts[:3] if hasattr(value, "parts") else (value, 0.0, 0.0) for value in values]
        many = max((np.size(part) for each in parts for part in each), default=1)
        found = np.array([[np.broadcast_to(part, (many,)) for part in each] for each in parts], dtype=float)
        return tuple(found.reshape(-1, 3, many).transpose(1, 2, 0))  # type: ignore[return-value]

    def _function(self) -> ca.Function:
        q, q1, q2 = self.q, self.q1, self.q2
        gaps = [row for pair in self.mechanism.pairs for row in pair.residual(*self.of(pair))]
        drives = [self.named[given.pair].drive(*self.of(self.named[given.pair])) for given in self.mechanism.inputs]
        kinetic, potential, lost = self.energies()
        momentum = ca.gradient(kinetic, q1)
        inertia = ca.jtimes(momentum, q, q1) + ca.jtimes(momentum, q1, q2) - ca.gradient(kinetic, q)
        loads = -ca.gradient(potential, q) - ca.gradient(lost, q1)
        efforts = []
        for k, load in enumerate(self.mechanism.loads):
            at, relative = self._load(load)
            loads += at * self.factors[k]
            if relative is not None:
                efforts.append(relative * self.factors[k])
        outputs = [
            ca.jacobian(ca.vertcat(*gaps) if gaps else ca.SX.zeros(0), q),
            ca.jacobian(ca.vertcat(*drives) if drives else ca.SX.zeros(0), q),
            loads,
            inertia,
            ca.vertcat(*efforts) if efforts else ca.SX.zeros(1, q.numel()),
        ]
        return ca.Function("balance", [q, q1, q2, self.factors, self.turns], [ca.densify(each) for each in outputs])

    def of(self, pair: Pair) -> tuple[list[Frame], Sequence[float], list[ca.SX]]:
        """What a pair's formulas take."""
        own = self._own[pair.name] if pair.name in self._own else slice(0, 0)
        numbers = pair.measure([self.shapes[link] for link in pair.bodies])
        return [self.frames[link] for link in pair.bodies], numbers, ca.vertsplit(self.q[own]) if own.stop else []

    def energies(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Kinetic energy, potential of weights and springs (J), and what dampers take up, halved (W)."""
        kinetic = potential = lost = ca.SX(0.0)
        gravity = self.mechanism.gravity
        for mass in self.mechanism.masses:
            at = self.frames[mass.link].carry(self.shapes[mass.link].at(mass.at))
            potential -= mass.mass * (gravity[0] * at.x + gravity[1] * at.y)
            if mass.link in self.column:
                v = self._rate(ca.vertcat(at.x, at.y))
                turning = self.q1[self.column[mass.link] + 2]
                kinetic += 0.5 * mass.mass * ca.dot(v, v) + 0.5 * mass.inertia * turning**2
        for number, spring in enumerate(self.mechanism.springs):
            stored, taken = self._spring(spring, number)
            potential, lost = potential + stored, lost + taken
        return kinetic, potential, lost

    def _spring(self, spring: Spring, number: int) -> tuple[ca.SX, ca.SX]:
        """What a spring stores (J), and half of what its damper takes up (W)."""
        first, second = spring.ends
        if spring.turns:
            way = self.frames[second].angle - self.frames[first].angle - spring.free - self.turns[number]
            return 0.5 * spring.stiffness * way**2, 0.5 * spring.damping * self._rate(way) ** 2
        apart = ca.vertcat(*(self.point(second) - self.point(first)))
        square = ca.dot(apart, apart)
        away = ca.sqrt(square)
        # without a free length the ends may meet, where the root has no slope
        stored = 0.5 * spring.stiffness * ((away - spring.free) ** 2 if spring.free else square)
        taken = 0.5 * spring.damping * (ca.dot(apart, self._rate(apart)) / away) ** 2 if spring.damping else ca.SX(0.0)
        return stored, taken

    def _load(self, load: Load) -> tuple[ca.SX, ca.SX | None]:
        """A load on the coordinates; an effort between the links of a pair as a row of its own."""
        q = self.q
        found = ca.SX.zeros(q.numel())
        if load.point is not None and load.force is not None:
            force = Vector(*load.force)
            at = ca.vertcat(*self.point(load.point))
            turned = self.frames[load.axes].turn(force) if load.axes is not None else force
            found += ca.jtimes(at, q, ca.vertcat(*turned), True)
        if load.link is not None and load.torque is not None and load.link in self.column:
            found[self.column[load.link] + 2] += load.torque
        if load.pair is None or load.effort is None:
            return found, None
        pair = self.named[load.pair]
        return found, load.effort * ca.jacobian(pair.drive(*self.of(pair)), q)

    def point(self, name: str) -> Vector:
        """Where a named point is."""
        link, point = self.carriers[name]
        return self.frames[link].carry(self.shapes[link].at(point))

    def _rate(self, value: ca.SX) -> ca.SX:
        return ca.jtimes(value, self.q, self.q1)


@lru_cache(maxsize=32)
def work(mechanism: Mechanism) -> Work:
    """The functions of a mechanism, kept for the next time."""
    return Work(mechanism)
