"""The contacts of a mechanism's pairs: what friction does to the links, and what of the pairs' forces it follows."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.contact_system import ContactSystem
from planar.dynamics.reaction_solver import LinkActions, ReactionSolver
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.foundation.jets import value_and_rates
from planar.foundation.short_repr import short_repr
from planar.model.pairs import Pair
from planar.model.pairs.base import EffortAction, RubbingContact
from planar.model.pairs.rubbing import ContactLoad, LoadLaw

RATE_TOLERANCE = 1e-11
"""A relative rate below this part of the greatest, at an arm of the mechanism's size, is none."""
DETERMINED_TOLERANCE = 1e-7
"""What a force of one held otherwise changes by more than this is not determined."""


class Contact(NamedTuple):
    """One contact of a pair at n positions.

    `action` (n, links) what a force or couple of one, against the positive sense of the pair's input position, puts on
    the coordinates of the links; `parts` (n, k, forces) what it is as great as, by the law, of the constraint forces.
    For each sense of the pair's rate: `parts[s]` where that is positive (0), and negative (1).
    """

    pair: str
    action: Array
    parts: tuple[Array, Array]
    law: LoadLaw
    is_friction: bool
    rate_sense: Array
    sides: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())
    "what each part says of where the pair bears, or which side drives, at both senses"

    def __repr__(self) -> str:
        return short_repr(self)


class ContactState(NamedTuple):
    """How a pair rubs at n positions: the sense of its rate (1, -1, 0), friction in the positive sense of the effort
    of its input (N or N m), of teeth the couple between the wheels; what it takes of the power (W) by what it puts on
    the links; and what `side` it bears on, or drives, in words.
    """

    sense: Array
    effort: Array
    heat: Array
    side: tuple[str, ...]

    def __repr__(self) -> str:
        return short_repr(self)


class ContactRows:
    """The contacts of one mechanism at n positions."""

    def __init__(self, reactions: ReactionSolver, field: KinematicArrays, at_rest: bool = False):
        self.reactions, self.field, self.at_rest = reactions, field, at_rest
        self.count = reactions.position_count

    @cached_property
    def contacts(self) -> tuple[Contact, ...]:
        """All contacts: friction pair by pair, then what pushes teeth apart."""
        pairs = tuple(self.reactions.pairs.values())
        found: list[Contact] = []
        for pair in pairs:
            own = pair.rubbing_contacts(self.reactions.frames, self.reactions.shapes, pairs, self.at_rest)
            if pair.has_friction and not own:
                raise BadInput(pair.name, "its friction follows a size that is not given, as the radius of a pin")
            found += [self._contact(pair, rubbing) for rubbing in own]
        return (*found, *self._separations())

    @cached_property
    def drive_rates(self) -> dict[str, Array]:
        """The rate of the input position of each pair that rubs (n,), in the motion as it is."""
        return {name: self.rates_along(name, self._link_rates) for name in self.rubbing_pairs}

    @property
    def rubbing_pairs(self) -> tuple[str, ...]:
        """The names of the pairs that have friction."""
        return tuple(dict.fromkeys(each.pair for each in self.contacts if each.is_friction))

    def senses(self) -> dict[str, Array]:
        """The sense in which each pair rubs (n,), 1 or -1; 0 where it does not, now and next.

        Where a rate passes through zero it is the sense in which that goes on.
        """
        found = {}
        arm = self.reactions.arm
        speed = np.abs(self._link_rates * np.tile([1.0, 1.0, arm], self._link_rates.shape[1] // 3))
        most = speed.max(axis=1, initial=0.0)
        for name, rate in self.drive_rates.items():
            pair = self.reactions.pairs[name]
            unit = 1.0 if self.is_length(name) else 1.0 / arm
            sense = np.where(np.abs(rate) > RATE_TOLERANCE * most * unit, np.sign(rate), 0.0)
            if not sense.all():
                moving = self.field.moving
                position = pair.input_position_at(self.reactions.shapes, moving.frames, moving.own)
                second = np.broadcast_to(value_and_rates(position)[2], sense.shape)
                strong = np.abs(second) * unit > RATE_TOLERANCE * np.maximum(most**2 / arm, 1e-300)
                sense = np.where((sense == 0.0) & strong & (most > 0.0), np.sign(second), sense)
            found[name] = sense
        return found

    def rates_along(self, name: str, link_rates: Array) -> Array:
        """The rate of a pair's input position (n,) where the coordinates of the links have these (n, links)."""
        way = self.reactions.pairs[name].effort_action(self.reactions.frames, self.reactions.shapes)
        return np.einsum("nl,nl->n", self._action_on_links(way), link_rates)

    def is_determined(self) -> BoolArray:
        """Where equilibrium tells all that friction follows (n,)."""
        ways = self.reactions.undetermined_forces
        found = np.ones(self.count, dtype=bool)
        for part in (part for each in self.contacts if each.is_friction for part in each.parts):
            found &= np.abs(part @ ways).max(axis=(1, 2), initial=0.0) <= DETERMINED_TOLERANCE
        return found

    def system(self, senses: dict[str, Array]) -> tuple[ContactSystem, Array]:
        """The equations of contacts at given senses of the pairs' rates (n,), and what each of them does to the links
        where it is one (n, links, m)."""
        contacts = self.contacts
        equilibrium = self.reactions.equilibrium
        width = max((each.parts[0].shape[1] for each in contacts), default=1)
        _, links, forces = equilibrium.matrix.shape
        parts = np.zeros((self.count, len(contacts), width, forces))
        actions = np.zeros((self.count, links, len(contacts)))
        for index, each in enumerate(contacts):
            sense = senses[each.pair] if each.is_friction else np.ones(self.count)
            chosen = np.where((sense < 0.0)[:, None, None], each.parts[1], each.parts[0])
            parts[:, index, : chosen.shape[1]] = chosen
            against = -sense * each.rate_sense if each.is_friction else sense
            actions[:, :, index] = each.action * against[:, None]
        scaled = actions * self.reactions.coordinate_scale[:, None]
        base = equilibrium.solve(self.reactions.required_forces[:, :, None])[:, :, 0]
        system = ContactSystem(
            np.einsum("nakf,nf->nak", parts, base),
            np.einsum("nakf,nfm->nakm", parts, equilibrium.solve(scaled)),
            np.array([each.law is LoadLaw.RESULTANT for each in contacts], dtype=bool),
            np.array([each.law is LoadLaw.SIGNED for each in contacts], dtype=bool),
            np.array([each.is_friction for each in contacts], dtype=bool),
        )
        return system, actions

    def pair_actions(self, actions: Array, y: Array) -> dict[str, LinkActions]:
        """What contacts y (n, m) of every pair put on the coordinates of its links."""
        totals: dict[str, Array] = {}
        for index, each in enumerate(self.contacts):
            totals[each.pair] = totals.get(each.pair, 0.0) + actions[:, :, index] * y[:, index, None]
        columns = self.reactions.work.link_columns
        return {
            name: {
                link: total[:, columns[link] : columns[link] + 3]
                for link in self.reactions.moving_bodies(self.reactions.pairs[name])
            }
            for name, total in totals.items()
        }

    def states(self, system: ContactSystem, senses: dict[str, Array], y: Array) -> dict[str, ContactState]:
        """How every pair rubs with contacts y (n, m)."""
        found: dict[str, ContactState] = {}
        parts = system.parts(np.nan_to_num(y))
        for index, each in enumerate(self.contacts):
            if not each.is_friction or each.pair in found:
                continue
            sense, leading = senses[each.pair], np.argmax(parts[:, index], axis=1)
            side = ("",) * self.count
            if each.law is LoadLaw.GREATEST:
                side = tuple(
                    each.sides[int(s < 0.0)][k] if s and height > 0.0 else ""
                    for s, k, height in zip(sense, leading, y[:, index], strict=True)
                )
            lost = np.einsum("nl,nl->n", each.action, self._link_rates) * sense * each.rate_sense * y[:, index]
            found[each.pair] = ContactState(sense, -sense * each.rate_sense * y[:, index], lost, side)
        return found

    @cached_property
    def _link_rates(self) -> Array:
        return self.reactions.work.coordinates(self.field.moving)[1][:, : self.reactions.work.link_coordinate_count]

    def is_length(self, name: str) -> bool:
        """Whether the input position of a pair is a length."""
        return self.reactions.pairs[name].input_quantity_kinds()[0] == "length"

    def _contact(self, pair: Pair, rubbing: RubbingContact) -> Contact:
        positive, negative = (self._parts(pair, rubbing, sense) for sense in (1.0, -1.0))
        sense = np.broadcast_to(np.asarray(rubbing.rate_sense, dtype=float), (self.count,))
        action = self._action_on_links(rubbing.action)
        sides = side_words(rubbing, 1.0), side_words(rubbing, -1.0)
        return Contact(pair.name, action, (positive, negative), rubbing.law, True, sense, sides)

    def _parts(self, pair: Pair, rubbing: RubbingContact, sense: float) -> Array:
        """What a contact follows of the constraint forces (n, k, forces), at a sense of the pair's rate."""
        rows: list[Array] = []
        for load in rubbing.loads:
            row = self._load_row(pair, load)
            if rubbing.law is not LoadLaw.GREATEST:
                rows.append(row * self._column(load.factor))
                continue
            opposed = load.factor if load.opposed is None else load.opposed
            along, against = (load.factor, opposed) if sense > 0.0 else (opposed, load.factor)
            rows += [row * self._column(along), -row * self._column(against)]
        return np.stack(rows, axis=1)

    def _column(self, factor: object) -> Array:
        return np.broadcast_to(np.asarray(factor, dtype=float), (self.count,))[:, None]

    def _load_row(self, pair: Pair, load: ContactLoad) -> Array:
        """A part of what a pair's constraints exert on a link, of the constraint forces (n, forces)."""
        own = self.reactions.pair_rows[pair.name]
        if load.link in self.reactions.work.link_columns:
            row = self._functional(load.link, load)
        else:  # the frame has what the other bodies have not
            others = [link for link in pair.bodies if link in self.reactions.work.link_columns]
            row = -sum((self._functional(link, load) for link in others), np.zeros(()))
        matrix = self.reactions.equilibrium_matrix[:, :, own] / self.reactions.coordinate_scale[:, None]
        found = np.zeros((self.count, self.reactions.equilibrium_matrix.shape[2]))
        found[:, own] = np.einsum("nl,nlf->nf", row, matrix)
        return found

    def _functional(self, link: str, load: ContactLoad) -> Array:
        """How a part of the force on a link comes from what acts on the link's coordinates (n, links)."""
        found = np.zeros((self.count, self.reactions.work.link_coordinate_count))
        first, frame = self.reactions.work.link_columns[link], self.reactions.frames[link]
        if load.direction is not None:
            found[:, first], found[:, first + 1] = load.direction.x, load.direction.y
        elif load.place is not None:
            arm = load.place - Vector(frame.x, frame.y)
            found[:, first], found[:, first + 1], found[:, first + 2] = arm.y, -arm.x, 1.0
        return found

    def _action_on_links(self, way: EffortAction) -> Array:
        """What a force or couple of one puts on the coordinates of the links (n, links)."""
        found = np.zeros((self.count, self.reactions.work.link_coordinate_count))
        for link, sense in ((way.link, 1.0), (way.reaction_link, -1.0)):
            if link in self.reactions.work.link_columns:
                first, frame = self.reactions.work.link_columns[link], self.reactions.frames[link]
                if way.point is None or way.direction is None:
                    found[:, first + 2] += sense
                    continue
                arm = way.point - Vector(frame.x, frame.y)
                found[:, first] += sense * way.direction.x
                found[:, first + 1] += sense * way.direction.y
                found[:, first + 2] += sense * arm.cross(way.direction)
        return found

    def _separations(self) -> Sequence[Contact]:
        """What pushes teeth off each other, however they press."""
        found = []
        for name, contact in self.reactions.contacts.items():
            pair, solver = self.reactions.pairs[name], self.reactions
            action = solver.on_coordinates(solver.unit_force_on_pair(pair, contact, contact.separation_direction))
            rows = solver.pair_rows[name]
            part = np.zeros((self.count, 2, solver.equilibrium_matrix.shape[2]))
            press = contact.pressure_tangent / solver.column_scale[:, rows]
            part[:, 0, rows], part[:, 1, rows] = press, -press
            found.append(Contact(name, action, (part, part), LoadLaw.GREATEST, False, np.ones(self.count)))
        return found


def side_words(rubbing: RubbingContact, sense: float) -> tuple[str, ...]:
    """What each part of a contact says of its side, in the order of the parts."""
    if rubbing.law is not LoadLaw.GREATEST:
        return ("",) * len(rubbing.loads)
    found: list[str] = []
    for load in rubbing.loads:
        is_turned = load.opposed is not None and sense < 0.0
        found += reversed(load.sides) if is_turned else load.sides
    return tuple(found)
