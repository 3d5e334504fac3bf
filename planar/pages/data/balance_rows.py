"""The rows and places that a page's function of the balance gives, while they are put together."""

from __future__ import annotations

import casadi as ca

from planar.dynamics.lagrangian import LagrangianFunctions
from planar.foundation.geometry import Vector
from planar.model.pairs import Pair
from planar.model.pairs.base import ToothContact


class BalanceRows:
    """Rows over the coordinates q, and places in the world, that the page's function `balance` gives."""

    def __init__(self, work: LagrangianFunctions):
        self.work, self.mechanism = work, work.mechanism
        self.rows: list[ca.SX] = []
        self.places: list[ca.SX] = []

    def add(self, rows: ca.SX) -> list[int]:
        """From which row on, and to which one."""
        first = self.count
        self.rows.append(rows)
        return [first, self.count]

    @property
    def count(self) -> int:
        """How many rows there are."""
        return sum(each.size1() for each in self.rows)

    def add_place(self, at: Vector) -> int:
        """The number of a place."""
        self.places.append(ca.vertcat(ca.SX(at.x), ca.SX(at.y)))
        return len(self.places) - 1

    def add_origin(self, link: str) -> int:
        """The number of the place where a link's axes start."""
        return self.add_place(self.work.frames[link].to_world(Vector(0.0, 0.0)))

    def point_in_world(self, link: str, point: str) -> Vector:
        """Where a point of a link is."""
        return self.work.frames[link].to_world(self.work.shapes[link].position(point))

    def add_contact_force(self, pair: Pair, contact: ToothContact, direction: Vector) -> int:
        """The row of a force of one along a way at a contact, on the second link, and its opposite on the first."""
        senses = dict(zip(pair.links, (-1.0, 1.0), strict=True))
        return self.add(self.work.unit_action_on_links(senses, contact.pitch_point, direction).T)[0]
