"""Friction in the sense of the motion as equations: every contact is as great as what its pair's constraints exert.

A pin's is the length of a vector, a guide's or a mesh's the greatest of some parts (see `planar.dynamics.friction`).
Which part that is, and in which sense each pair rubs, is known of a solution, and stays so under small changes.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.dynamics.forces import Forces
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.model.pairs import Pair
from planar.model.pairs.base import RubbingContact
from planar.model.pairs.rubbing import ContactLoad, LoadLaw

TIE = 1e-9
"""Of the greatest part: two parts as near as that are both the greatest, and such a kink has no derivatives."""


class _Contact(NamedTuple):
    """A contact, the parts that it follows (k,), their place among all, and its pair's among those that rub."""

    pair: Pair
    rubbing: RubbingContact
    parts: list[ca.SX]
    rows: slice
    pair_index: int


class RubbingEquations:
    """The contacts of a design: their `sizes` (m,) as unknowns, `equations` (m,), and `actions` of the pairs by name.

    `constants` are the senses of the pairs that rub, then one for the greatest part of each contact, zero for others.
    """

    def __init__(self, work: LagrangianFunctions, exerted: Mapping[str, ca.SX]):
        """`exerted` is what the constraints of each pair do on the coordinates, where teeth touch along these alone."""
        self.work, self.exerted = work, exerted
        pairs = work.mechanism.pairs
        found = [
            (pair, each) for pair in pairs for each in pair.rubbing_contacts(work.frames, work.shapes, pairs, False)
        ]
        self.pairs = tuple(dict.fromkeys(pair.name for pair, _ in found))
        self.senses = ca.SX.sym("sense", len(self.pairs))
        self.contacts: list[_Contact] = []
        first = 0
        for pair, each in found:
            index = self.pairs.index(pair.name)
            parts = self._parts(pair, each, self.senses[index])
            self.contacts.append(_Contact(pair, each, parts, slice(first, first + len(parts)), index))
            first += len(parts)
        self.sizes, self.greatest = ca.SX.sym("y", len(found)), ca.SX.sym("greatest", first)
        self.constants = ca.vertcat(self.senses, self.greatest)

    @property
    def parts(self) -> ca.SX:
        """All parts of all contacts (parts,)."""
        return ca.vertcat(ca.SX(0, 1), *(part for each in self.contacts for part in each.parts))

    @property
    def equations(self) -> ca.SX:
        """What each contact is more than it has to be (m,)."""
        return self.sizes - ca.vertcat(ca.SX(0, 1), *map(self._size, self.contacts))

    def _size(self, contact: _Contact) -> ca.SX:
        if contact.rubbing.law is LoadLaw.RESULTANT:
            return ca.norm_2(ca.vertcat(*contact.parts))
        return ca.dot(self.greatest[contact.rows], ca.vertcat(*contact.parts))

    @property
    def actions(self) -> dict[str, ca.SX]:
        """What friction in each pair does on the coordinates."""
        found: dict[str, ca.SX] = {}
        for k, each in enumerate(self.contacts):
            way = each.rubbing.action
            unit = self.work.unit_action_on_links({way.link: 1.0, way.reaction_link: -1.0}, way.point, way.direction)
            action = -self.senses[each.pair_index] * each.rubbing.rate_sense * self.sizes[k] * unit
            found[each.pair.name] = found.get(each.pair.name, 0.0) + action
        return found

    def effort(self, name: str) -> ca.SX:
        """Friction of a pair in the positive sense of its input position, of teeth the couple between the wheels."""
        k = next(k for k, each in enumerate(self.contacts) if each.pair.name == name)
        return ca.SX(-self.senses[self.contacts[k].pair_index] * self.contacts[k].rubbing.rate_sense * self.sizes[k])

    def senses_of(self, forces: Forces, many: int) -> Array:
        """The senses of the pairs that rub (n, pairs), of a solution."""
        rows = [np.broadcast_to(forces.friction[name].sense, (many,)) for name in self.pairs]
        return np.stack([np.zeros(many), *rows], axis=1)[:, 1:]

    def acts(self, senses: Array) -> BoolArray:
        """Which contacts a solution tells (n, m): the first of each pair that rubs, by the senses (n, pairs)."""
        places = [each.pair_index for each in self.contacts]
        is_first = np.array([k == 0 or places[k - 1] != place for k, place in enumerate(places)], dtype=bool)
        found: BoolArray = is_first & (senses[:, places] != 0.0)
        return found

    def first_sizes(self, forces: Forces, many: int) -> Array:
        """The contacts (n, m), as great as the first one of each pair is."""
        sizes = [np.broadcast_to(np.abs(forces.friction[each.pair.name].effort), (many,)) for each in self.contacts]
        return np.stack(sizes, axis=1)

    def choose_greatest(self, parts: Array) -> tuple[Array, BoolArray]:
        """Which part each contact follows (n, parts), from all of them, and where two are the greatest (n,)."""
        chosen, is_tie = np.zeros_like(parts), np.zeros(len(parts), bool)
        for each in self.contacts:
            own = parts[:, each.rows]
            leading = np.argmax(own, axis=1) if each.rubbing.law is LoadLaw.GREATEST else np.zeros(len(own), int)
            chosen[np.arange(len(own)), each.rows.start + leading] = 1.0
            if each.rubbing.law is LoadLaw.GREATEST:
                ordered = np.sort(own, axis=1)
                is_tie |= ordered[:, -1] - ordered[:, -2] <= TIE * np.abs(own).max(axis=1)
        return chosen, is_tie

    def _parts(self, pair: Pair, rubbing: RubbingContact, sense: ca.SX) -> list[ca.SX]:
        found: list[ca.SX] = []
        for load in rubbing.loads:
            value = self._load(pair, load)
            if rubbing.law is not LoadLaw.GREATEST:
                found.append(value * load.factor)
                continue
            opposed = load.factor if load.opposed is None else load.opposed
            mean, half = 0.5 * (load.factor + opposed), 0.5 * (load.factor - opposed) * sense
            found += [value * (mean + half), -value * (mean - half)]
        return found

    def _load(self, pair: Pair, load: ContactLoad) -> ca.SX:
        """A part of what a pair's constraints exert on a link; the frame has what the other bodies have not."""
        columns = self.work.link_columns
        if load.link in columns:
            return self._load_on(load.link, pair, load)
        return -sum((self._load_on(link, pair, load) for link in pair.bodies if link in columns), ca.SX(0.0))

    def _load_on(self, link: str, pair: Pair, load: ContactLoad) -> ca.SX:
        action, first, frame = self.exerted[pair.name], self.work.link_columns[link], self.work.frames[link]
        force = Vector(action[first], action[first + 1])
        if load.direction is not None:
            return ca.SX(force.dot(load.direction))
        assert load.place is not None
        return ca.SX(action[first + 2] - (load.place - Vector(frame.x, frame.y)).cross(force))
