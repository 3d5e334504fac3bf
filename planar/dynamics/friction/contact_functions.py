"""The contacts of a mechanism's pairs as functions of its coordinates: what they do, and which forces they follow.

Columns are what forces of one put on the coordinates: those of the pairs' constraints, where teeth touch along the way
in which these drive, and efforts at pairs. A pair's own coordinates stand with the rest, and nothing acts on them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.friction.contact_rows import side_words
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.casadi_functions import BufferedFunction
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.model.pairs import Pair
from planar.model.pairs.base import EffortAction, RubbingContact, ToothContact
from planar.model.pairs.rubbing import ContactLoad, LoadLaw


class ContactValues(NamedTuple):
    """At one position: `columns` (coordinates, forces) of the constraints, `actions` (coordinates, m) of contacts at a
    positive rate of their pairs, `parts` (2, 2, m, k, forces) that they follow, in motion and at rest, at a positive
    and a negative rate; `rate_senses` (m,); `efforts` (coordinates, pairs) of one at each named pair; `push`
    (coordinates,) of loads, weights, springs and dampers on the links, less what inertia takes without accelerations;
    and of every rubbing pair the position (pairs,), what it changes by (pairs, coordinates), its rate, and the second
    rate without accelerations (pairs,).
    """

    columns: Array
    actions: Array
    parts: Array
    rate_senses: Array
    efforts: Array
    push: Array
    positions: Array
    slopes: Array
    rates: Array
    bends: Array

    def __repr__(self) -> str:
        return short_repr(self)


class ContactFunctions:
    """The contacts of one mechanism.

    `pairs` are those that rub, `effort_pairs` those at which efforts may act; of each contact (m,) its pair, whether
    it is as long as its parts, just its first part, or pushes teeth apart, and what its parts say of sides.
    """

    def __init__(self, work: LagrangianFunctions):
        self.work = work
        mechanism, every = work.mechanism, tuple(work.mechanism.pairs)
        self._teeth = _tooth_contacts(work, every)
        self._columns, first = {}, 0
        for pair in every:
            self._columns[pair.name] = self._pair_columns(pair, first)
            first += len(pair.residual_kinds)
        found: list[tuple[Pair, RubbingContact, RubbingContact]] = []
        for pair in every:
            moving, still = (pair.rubbing_contacts(work.frames, work.shapes, every, rest) for rest in (False, True))
            found += [(pair, *both) for both in zip(moving, still, strict=True)]
        self.pairs = tuple(dict.fromkeys(pair.name for pair, *_ in found))
        self.effort_pairs = effort_pairs(mechanism, self.pairs)
        apart = [each for each in self._teeth if found]
        self.contact_pairs = (*(pair.name for pair, *_ in found), *apart)
        self.pair_index = np.array(
            [self.pairs.index(name) if k < len(found) else -1 for k, name in enumerate(self.contact_pairs)], dtype=int
        )
        "of each contact: its pair among those that rub, -1 of teeth"
        self.is_friction: BoolArray = self.pair_index >= 0
        laws = [each.law for _, each, _ in found] + [LoadLaw.GREATEST] * len(apart)
        self.is_resultant: BoolArray = np.array([law is LoadLaw.RESULTANT for law in laws], dtype=bool)
        self.is_signed: BoolArray = np.array([law is LoadLaw.SIGNED for law in laws], dtype=bool)
        self.sides = tuple((side_words(each, 1.0), side_words(each, -1.0)) for _, each, _ in found)
        self._called = BufferedFunction(self._function(found, apart))

    def evaluate(self, q: Array, q1: Array, factors: Array, wound: Array) -> ContactValues:
        """Everything at coordinates with their rates."""
        columns, actions, parts, senses, efforts, push, positions, slopes, rates, bends = self._called(
            q, q1, factors, wound
        )
        many = len(self.contact_pairs)
        cases = parts.T.reshape(2, 2, many, -1, parts.shape[0]) if many else np.zeros((2, 2, 0, 1, parts.shape[0]))
        flat = push[0], positions[0], slopes.T, rates[0], bends[0]
        return ContactValues(columns.T, actions.T, cases, senses[0], efforts.T, *flat)

    def _function(
        self, found: Sequence[tuple[Pair, RubbingContact, RubbingContact]], apart: Sequence[str]
    ) -> ca.Function:
        work = self.work
        q, q1, many = work.q, work.q1, work.q.numel()
        actions = [_effort_on_links(work, each.action) for _, each, _ in found]
        cases = []
        for rest in (0, 1):
            for sense in (1.0, -1.0):
                rows = [self._parts(each[0], (each[1], each[2])[rest], sense) for each in found]
                cases.append(rows + [self._separation_parts(name) for name in apart])
        width = max((len(rows) for rows in cases[0]), default=1)
        count = sum(each.shape[1] for each in self._columns.values())
        empty = ca.SX(1, count)
        parts = ca.vertcat(
            ca.SX(0, count),
            *(row for case in cases for rows in case for row in (*rows, *[empty] * (width - len(rows)))),
        )
        for name in apart:
            actions.append(self._unit_force(name, self._teeth[name].separation_direction))
        senses = [each.rate_sense for _, each, _ in found] + [1.0] * len(apart)
        positions = ca.vertcat(ca.SX(0, 1), *work.relative_positions(self.pairs))
        slopes = ca.jacobian(positions, q)
        rates = ca.mtimes(slopes, q1)
        still = ca.substitute(work.inertia, work.q2, ca.SX.zeros(many))
        outputs = [
            ca.horzcat(ca.SX(many, 0), *self._columns.values()),
            ca.horzcat(ca.SX(many, 0), *actions),
            parts,
            ca.vertcat(ca.SX(0, 1), *senses),
            ca.horzcat(ca.SX(many, 0), *(work.unit_effort_on_links(name) for name in self.effort_pairs)),
            work.total_action_on_links - still,
            positions,
            slopes,
            rates,
            ca.jtimes(rates, q, q1),
        ]
        given = [q, q1, work.factors, work.spring_turns]
        return ca.Function("contacts", given, [ca.densify(each) for each in outputs])

    def _pair_columns(self, pair: Pair, first: int) -> ca.SX:
        """What a pair's constraints of one put on the coordinates (coordinates, rows).

        Teeth drive along their own way; a force at each of the pair's own coordinates stands for what holds these.
        """
        work = self.work
        if pair.name in self._teeth:
            own = work.own_slices[pair.name]
            holds = ca.SX.eye(work.q.numel())[:, own.start : own.stop]
            return ca.horzcat(self._unit_force(pair.name, self._teeth[pair.name].drive_direction), holds)
        return ca.jacobian(work.residuals[first : first + len(pair.residual_kinds)], work.q).T

    def _unit_force(self, name: str, way: Vector) -> ca.SX:
        """A force of one at a tooth contact on the second link, and its opposite on the first (coordinates,)."""
        pair = next(each for each in self.work.mechanism.pairs if each.name == name)
        senses = dict(zip(pair.links, (-1.0, 1.0), strict=True))
        return self.work.unit_action_on_links(senses, self._teeth[name].pitch_point, way)

    def _parts(self, pair: Pair, rubbing: RubbingContact, sense: float) -> list[ca.SX]:
        """What a contact follows of the constraint forces (forces,) each, at a sense of the pair's rate."""
        rows: list[ca.SX] = []
        for load in rubbing.loads:
            row = self._load_row(pair, load)
            if rubbing.law is not LoadLaw.GREATEST:
                rows.append(row * load.factor)
                continue
            opposed = load.factor if load.opposed is None else load.opposed
            along, against = (load.factor, opposed) if sense > 0.0 else (opposed, load.factor)
            rows += [row * along, -row * against]
        return rows

    def _separation_parts(self, name: str) -> list[ca.SX]:
        """How far teeth push each other off, whatever the sense of what they press by."""
        row = ca.SX.zeros(1, sum(each.shape[1] for each in self._columns.values()))
        row[self._first_column(name)] = self._teeth[name].pressure_tangent
        return [row, -row]

    def _load_row(self, pair: Pair, load: ContactLoad) -> ca.SX:
        """A part of what a pair's constraints exert on a link, of the constraint forces (1, forces)."""
        work = self.work
        if load.link in work.link_columns:
            functional = self._functional(load.link, load)
        else:  # the frame has what the other bodies have not
            others = [link for link in pair.bodies if link in work.link_columns]
            functional = -sum((self._functional(link, load) for link in others), ca.SX.zeros(work.q.numel()))
        own = self._columns[pair.name]
        row = ca.SX.zeros(1, sum(each.shape[1] for each in self._columns.values()))
        first = self._first_column(pair.name)
        row[first : first + own.shape[1]] = ca.mtimes(functional.T, own)
        return row

    def _first_column(self, name: str) -> int:
        names = list(self._columns)
        return sum(self._columns[each].shape[1] for each in names[: names.index(name)])

    def _functional(self, link: str, load: ContactLoad) -> ca.SX:
        """How a part of the force on a link comes from what acts on the coordinates (coordinates,)."""
        found, first, frame = ca.SX.zeros(self.work.q.numel()), self.work.link_columns[link], self.work.frames[link]
        if load.direction is not None:
            found[first], found[first + 1] = load.direction.x, load.direction.y
        elif load.place is not None:
            arm = load.place - Vector(frame.x, frame.y)
            found[first], found[first + 1], found[first + 2] = arm.y, -arm.x, 1.0
        return found


def effort_pairs(mechanism: Mechanism, rubbing: Sequence[str]) -> tuple[str, ...]:
    """The pairs at which inputs, stops or friction at rest may supply an effort."""
    inputs, stops = (given.pair for given in mechanism.inputs), (stop.pair for stop in mechanism.stops)
    return tuple(dict.fromkeys((*inputs, *stops, *rubbing)))


def _tooth_contacts(work: LagrangianFunctions, every: Sequence[Pair]) -> Mapping[str, ToothContact]:
    found = {pair.name: pair.tooth_contact(work.frames, work.shapes, every) for pair in every}
    return {name: contact for name, contact in found.items() if contact is not None}


def _effort_on_links(work: LagrangianFunctions, way: EffortAction) -> ca.SX:
    return work.unit_action_on_links({way.link: 1.0, way.reaction_link: -1.0}, way.point, way.direction)
