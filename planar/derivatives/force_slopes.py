"""Derivatives of forces: the balance of all links as equations in the forces of the constraints, efforts and friction.

The unknowns are the multipliers of the pairs' constraints, where teeth touch the force between them, then the efforts
of the inputs, and with friction how much rubs in each contact. The balance is evaluated on jets: along the unknowns it
is solved, along the parameters its derivatives follow from the kinematics' by one solution with the same matrix.

Friction acts in the sense of the motion, and every contact is as great as what its pair's constraints exert: a pin's is
the length of a vector, a guide's or a mesh's the greatest of some parts (see `planar.dynamics.friction`). Which part
that is, and in which sense each pair rubs, is known of a solution, and stays so under small changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.derivatives.kinematic_slopes import (
    CoordinateMotion,
    KinematicSlopes,
    NamedResult,
    element_arguments,
    slopes_of_order,
    take_entries,
    variable_jet,
)
from planar.dynamics.external_actions import (
    LinkAction,
    action_on_link,
    effort_actions,
    inertia_actions,
    passive_actions,
    two_sided_actions,
)
from planar.dynamics.forces import Forces
from planar.dynamics.load_variation import course_piece
from planar.dynamics.reaction_solver import bearing_point
from planar.equations.elements import ElementGroup, group_elements
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.generalised_inverses import invert_matrices
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet, Scalar, sqrt
from planar.model.pairs import MeasureKind, Pair
from planar.model.pairs.base import RubbingContact, ToothContact
from planar.model.pairs.rubbing import ContactLoad, LoadLaw
from planar.results.motion import Motion, State

FIXED_FRICTION_STEPS, MAX_FRICTION_STEPS = 2, 7
"""With contacts as the solution has them, and in all."""
SETTLED = 1e-7
"""Of the greatest force: what is further from the solution is another."""
TIE = 1e-9
"""Of the greatest part: two parts as near as that are both the greatest, and such a kink has no derivatives."""

ROUNDING = 1e-12
"""Of the greatest change with the factors of loads: a lesser one is none."""

LinkForces = dict[str, list[Scalar]]
"""By link what acts on its coordinates x, y and angle (N, N, N m about its origin)."""


@dataclass
class ForceConstants:
    """What stays under small changes, at positions (n, ...): the full turns of springs, in which sense teeth press, in
    which sense each pair rubs, and one for the part that each contact follows, zero for others."""

    spring_turns: Array
    pressing: Array
    senses: Array
    leading: Array


class _Contact(NamedTuple):
    """A contact at positions of any arithmetic, with its pair's index among those that rub, and the places of its parts
    among all."""

    pair: Pair
    rubbing: RubbingContact
    pair_index: int
    parts: range


class BalanceAtPositions:
    """The balance at positions of any arithmetic, from coordinates, numbers of the file and forces y."""

    def __init__(self, of: ForceSlopes, motion: CoordinateMotion, y: Scalar, factors: Sequence[Scalar], order: int = 1):
        """`order` is that of the jets, 1 without any."""
        self.of, self.motion, self.y, self.factors, self.order = of, motion, y, factors, order
        self.pairs = {pair.name: pair for pair in motion.mechanism.pairs}
        self._constraint_forces: dict[str, tuple[list[Scalar], int]] = {}
        for group, names in of.groups:
            exerted = self._exerted(group)
            self._constraint_forces |= {name: (exerted, place) for place, name in enumerate(names)}

    def _exerted(self, group: ElementGroup) -> list[Scalar]:
        """What the constraints of a group of pairs do on their local coordinates."""
        element = group.element
        positions = self.motion.q.parts[0]
        results = element.slopes.evaluate(element_arguments(group, positions, self.motion.numbers.p, 0))
        exerted: list[Scalar] = [0.0] * element.coordinate_count
        multipliers = [take_entries(self.y, group.rows[:, row]) for row in range(element.row_count)]
        for row, factors in enumerate(element.factors):
            for column, factor in factors.items():
                exerted[column] = exerted[column] + multipliers[row] * factor
        for (row, column), slope in zip(element.slope_entries, results[element.row_count :], strict=True):
            exerted[column] = exerted[column] + multipliers[row] * slope
        return exerted

    def _constant(self, name: str, index: int) -> Array:
        """One of `ForceConstants` (n, 1), or (n, 1, 1) beside jets of the second order."""
        column: Array = getattr(self.of.constants, name)[:, index]
        return column.reshape(-1, *((1,) * self.order))

    @cached_property
    def contacts(self) -> dict[str, ToothContact]:
        """Where teeth touch, by the name of the pair."""
        pairs = self.motion.mechanism.pairs
        contacts = {
            name: self.pairs[name].tooth_contact(self.motion.frames, self.motion.shapes, pairs)
            for name in self.of.toothed
        }
        return {name: contact for name, contact in contacts.items() if contact is not None}

    @cached_property
    def rubbing_contacts(self) -> list[_Contact]:
        """Where pairs rub."""
        pairs, contacts, first = self.motion.mechanism.pairs, [], 0
        names: list[str] = []
        for pair in pairs if self.of.rubs else ():
            for rubbing in pair.rubbing_contacts(self.motion.frames, self.motion.shapes, pairs, False):
                if pair.name not in names:
                    names.append(pair.name)
                count = len(rubbing.loads) * (2 if rubbing.law is LoadLaw.GREATEST else 1)
                contacts.append(_Contact(pair, rubbing, len(names) - 1, range(first, first + count)))
                first += count
        return contacts

    def forces_on_links(self, actions: Iterable[LinkAction]) -> LinkForces:
        """The sums of actions on the coordinates of moving links."""
        total: LinkForces = {}
        for action in actions:
            if action.link in self.of.elements.link_columns:
                _add_forces(total, action.link, action_on_link(self.motion, action))
        return total

    def _tooth_actions(self, name: str, apart: bool) -> Iterator[LinkAction]:
        """Teeth drive, and push each other apart, in whichever sense they press."""
        contact, (first, second) = self.contacts[name], self.pairs[name].links
        press = take_entries(self.y, self.of.elements.pair_rows[name].start)
        force = contact.drive_direction * press
        if apart:
            sense = self._constant("pressing", self.of.toothed.index(name))
            force = force + contact.separation_direction * (press * sense * contact.pressure_tangent)
        for link, sign in ((second, 1.0), (first, -1.0)):
            yield LinkAction("pair", name, link, contact.pitch_point, force * sign, 0.0)

    def constraint_forces(self, name: str, apart: bool = True) -> LinkForces:
        """What the constraints of a pair do; teeth push each other `apart`, or only drive."""
        if name in self.contacts:
            return self.forces_on_links(self._tooth_actions(name, apart))
        exerted, place = self._constraint_forces[name]
        total: LinkForces = {}
        moving = [link for link in self.pairs[name].bodies if link in self.of.elements.link_columns]
        for body, link in enumerate(moving):
            _add_forces(total, link, [_take_place(exerted[3 * body + k], place) for k in range(3)])
        return total

    def _friction_size(self, index: int) -> Scalar:
        return take_entries(self.y, self.of.first_friction + index)

    def _friction(self, index: int) -> Scalar:
        """What friction in a contact does in the positive sense of its action (N, N m)."""
        contact = self.rubbing_contacts[index]
        sense = -contact.rubbing.rate_sense * self._constant("senses", contact.pair_index)
        return self._friction_size(index) * sense

    def _friction_actions(self, name: str | None = None) -> Iterator[LinkAction]:
        """What friction in a pair, or in all, does on links."""
        for index, contact in enumerate(self.rubbing_contacts):
            pair = contact.pair.name
            if name in (None, pair):
                yield from two_sided_actions(
                    self.motion, "friction", pair, contact.rubbing.action, self._friction(index)
                )

    def pair_forces(self, name: str) -> LinkForces:
        """What a pair does on the links that move, with its friction."""
        total = self.constraint_forces(name)
        for link, parts in self.forces_on_links(self._friction_actions(name)).items():
            _add_forces(total, link, parts)
        return total

    def effort(self, index: int) -> Scalar:
        """What an input supplies (N, N m)."""
        return take_entries(self.y, self.of.elements.constraint_count + index)

    def open_balance(self, orders: Sequence[int], shapes: Sequence[tuple[int, ...]]) -> list[Array]:
        """By how much the balance is open (n, coordinates and contacts, ...): values, for an order of 0, or the
        derivatives of an order, in these shapes."""
        totals: list[Array] = [np.zeros(shape) for shape in shapes]

        def add(column: int, value: Scalar) -> None:
            for total, order in zip(totals, orders, strict=True):
                total[:, column] += slopes_of_order(value, order)

        for group, names in self.of.groups:
            exerted, _ = self._constraint_forces[names[0]]
            for column, value in enumerate(exerted):
                for place, coordinate in enumerate(group.coordinates[:, column]):  # a link may be in several
                    add(int(coordinate), _take_place(value, place))
        turns = [self._constant("spring_turns", k) for k in range(len(self.motion.mechanism.springs))]
        actions = [*passive_actions(self.motion, self.factors, turns)]
        actions += inertia_actions(self.motion) if self.of.with_inertia else ()
        for index, name in enumerate(self.of.inputs):
            actions += effort_actions(self.motion, "input", name, self.effort(index))
        for name in self.contacts:
            actions += self._tooth_actions(name, True)
        for link, parts in self.forces_on_links([*actions, *self._friction_actions()]).items():
            first = self.of.elements.link_columns[link]
            for k, part in enumerate(parts):
                add(first + k, part)
        for index, contact in enumerate(self.rubbing_contacts):
            add(self.of.elements.coordinate_count + index, self._friction_size(index) - self._required_size(contact))
        return totals

    def _required_size(self, contact: _Contact) -> Scalar:
        """How great a contact is by what its pair's constraints exert."""
        parts = self.parts(contact)
        if contact.rubbing.law is LoadLaw.RESULTANT:
            return sqrt(sum((part * part for part in parts[1:]), parts[0] * parts[0]))
        leading = (self._constant("leading", index) for index in contact.parts)
        return sum((part * is_leading for part, is_leading in zip(parts, leading, strict=True)), 0.0)

    def parts(self, contact: _Contact) -> list[Scalar]:
        """What a contact follows: of forces along ways or couples, each times its factor."""
        sense = self._constant("senses", contact.pair_index)
        parts: list[Scalar] = []
        for load in contact.rubbing.loads:
            value = self._load(contact.pair, load)
            if contact.rubbing.law is not LoadLaw.GREATEST:
                parts.append(value * load.factor)
                continue
            opposed = load.factor if load.opposed is None else load.opposed
            mean, half = (load.factor + opposed) * 0.5, (load.factor - opposed) * 0.5 * sense
            parts += [value * (mean + half), -value * (mean - half)]
        return parts

    def _load(self, pair: Pair, load: ContactLoad) -> Scalar:
        """A part of what a pair's constraints exert on a link."""
        force, moment = self._wrench(self.constraint_forces(pair.name, apart=False), load.link)
        if load.direction is not None:
            return load.direction.dot(force)
        assert load.place is not None
        return moment - load.place.cross(force)

    def _wrench(self, forces: LinkForces, link: str) -> tuple[Vector, Scalar]:
        """What a pair exerts on a link by its forces on moving links: the force, and the moment about the world's
        origin; on the frame acts what adds up to nothing."""
        wrenches: dict[str, tuple[Scalar, Scalar, Scalar]] = {}
        for body, (x, y, moment) in forces.items():
            frame = self.motion.frame(body)
            wrenches[body] = x, y, moment + (frame.x * y - frame.y * x)
        if link in wrenches:
            x, y, moment = wrenches[link]
        else:
            x, y, moment = (-sum((wrench[k] for wrench in wrenches.values()), 0.0) for k in range(3))
        return Vector(x, y), moment

    # results

    def results(self, name: str) -> list[NamedResult]:
        """The results of forces of a name: the effort of an input with its power, the force and couple of a pair,
        friction."""
        results = []
        motions = self.motion.relative_motions
        slides = name in motions and motions[name].input_kind is MeasureKind.LENGTH
        effort_kind = "force" if slides else "torque"
        if name in self.of.inputs:
            effort = self.effort(self.of.inputs.index(name))
            velocity = self.motion.input_position(motions[name]).parts[1]
            results.append(NamedResult("effort", effort_kind, (effort,)))
            results.append(NamedResult("power", "power", (velocity * effort,)))
        if name in self.pairs:
            force, moment = self._wrench(self.pair_forces(name), self.pairs[name].links[1])
            place = self._reaction_point(self.pairs[name])
            couple = moment if place is None else moment - place.cross(force)
            results.append(NamedResult("force", "force", tuple(force)))
            results.append(NamedResult("couple", "torque", (couple,)))
        for index, contact in enumerate(self.rubbing_contacts):
            if contact.pair.name == name:
                results.append(NamedResult("friction", effort_kind, (self._friction(index),)))
                break
        return results

    def _reaction_point(self, pair: Pair) -> Vector | None:
        """Where the force of a pair is told."""
        if pair.name in self.contacts:
            return self.contacts[pair.name].pitch_point
        end = bearing_point(pair)
        return self.motion.place(end[0], self.motion.shapes[end[0]].position(end[1])) if end else None


def _add_forces(total: LinkForces, link: str, parts: Sequence[Scalar]) -> None:
    """Add forces on the coordinates of a link."""
    total[link] = [one + other for one, other in zip(total.get(link, [0.0] * 3), parts, strict=True)]


def _take_place(value: Scalar, place: int) -> Scalar:
    return value if isinstance(value, float) else take_entries(value, place)


class ForceSlopes:
    """The derivatives of forces at positions (n), in the parameters and then in the factors of the loads."""

    def __init__(
        self, kinematics: KinematicSlopes, forces: Forces | None, rows: slice, factors: Array, spring_turns: Array
    ):
        """`rows` are the positions among those of the forces, of which friction and inertia are taken, `factors`
        (n, loads) those of the loads there."""
        self.kinematics, self.elements = kinematics, kinematics.elements
        parameters = kinematics.parameters
        self.inputs, self.rubs = parameters.inputs, forces is not None and bool(forces.friction)
        self.with_inertia = forces is not None and any(action.kind == "inertia" for action in forces.acting)
        self.factors = factors
        self._balances: dict[int, BalanceAtPositions] = {}
        constants = [rates[..., None] for rates in kinematics.rates]
        self.motion = CoordinateMotion(self.elements, kinematics.numbers(0), parameters.unit, Jet(*constants))
        count = len(factors)
        pairs = parameters.mechanism.pairs
        self.toothed = [
            pair.name for pair in pairs if pair.tooth_contact(self.motion.frames, self.motion.shapes, pairs) is not None
        ]
        placed = {name: element for name, element in self.elements.placed_pairs.items() if name not in self.toothed}
        by_rows = {element.rows.start: name for name, element in placed.items()}
        self.groups = [
            (group, [by_rows[int(row)] for row in group.rows[:, 0]]) for group in group_elements(placed.values())
        ]
        self.first_friction = self.elements.row_count
        none: Array = np.zeros((count, 0))
        self.constants = ForceConstants(spring_turns, np.zeros((count, len(self.toothed))), none, none)
        contacts = self._values(np.zeros((count, self.first_friction))).rubbing_contacts
        self.unknown_count = self.first_friction + len(contacts)
        self.is_unknown: BoolArray = np.zeros(count, bool)
        "(n,): where the solution is on a kink of friction, or no forces are known"
        if forces is not None and contacts:
            self.y = self._solve_with_friction(forces, rows, contacts)
        else:
            for _ in range(2 if self.toothed else 1):  # first which way teeth press
                opening, slopes = self._linearise(np.zeros((count, self.unknown_count)))
                self.y = _close_balance(slopes, invert_matrices(slopes)[0], opening)[..., 0]
                self.constants.pressing = np.sign(self.y[:, self._pressing_rows])

    @property
    def _pressing_rows(self) -> list[int]:
        return [self.elements.pair_rows[name].start for name in self.toothed]

    def _values(self, y: Array) -> BalanceAtPositions:
        """The balance of numbers, at forces y (n, unknowns)."""
        return BalanceAtPositions(self, self.motion, y[..., None], list(self.factors.T[..., None]))

    def _linearise(self, y: Array) -> tuple[Array, Array]:
        """By how much the balance is open (n, rows, 1), and its Jacobian (n, rows, unknowns) in the forces."""
        count = self.unknown_count
        unit: Array = np.broadcast_to(np.eye(count), (len(y), count, count))
        balance = BalanceAtPositions(self, self.motion, variable_jet(y, unit), list(self.factors.T[..., None]))
        rows = self.elements.coordinate_count + count - self.first_friction
        with np.errstate(all="ignore"):  # what is not defined is not a number
            opening, slopes = balance.open_balance([0, 1], [(len(y), rows, 1), (len(y), rows, count)])
        return opening, slopes

    def _solve_with_friction(self, forces: Forces, rows_of_all: slice, contacts: list[_Contact]) -> Array:
        """The forces with friction, by Newton's method from the friction of the solution, on its side of all kinks."""
        count, first_friction = len(self.factors), self.first_friction
        names = list(dict.fromkeys(contact.pair.name for contact in contacts))

        def columns(values: Sequence[Array | float]) -> Array:
            """Values at all positions, or alike at all, as columns (n, values) at these."""
            rows = [value if np.ndim(value) == 0 else np.asarray(value)[rows_of_all] for value in values]
            return np.stack([np.broadcast_to(row, (count,)) for row in rows], axis=1)

        senses = columns([forces.friction[name].sense for name in names])
        first_of_pair = np.array(
            [k == 0 or contacts[k - 1].pair_index != contact.pair_index for k, contact in enumerate(contacts)]
        )
        acts = first_of_pair & (senses[:, [contact.pair_index for contact in contacts]] != 0.0)
        known = columns([np.abs(forces.friction[contact.pair.name].effort) for contact in contacts])
        y: Array = np.concatenate([np.zeros((count, first_friction)), np.nan_to_num(known) * acts], axis=1)
        self.constants.senses = senses.astype(float)
        self.constants.leading = np.zeros((count, contacts[-1].parts.stop))
        is_tie: BoolArray = np.zeros(count, bool)
        for step in range(MAX_FRICTION_STEPS):
            opening, slopes = self._linearise(y)
            is_fixed = step < FIXED_FRICTION_STEPS
            rows = slice(0, -len(contacts)) if is_fixed else slice(None)
            free = slice(0, first_friction) if is_fixed else slice(None)
            inverse, _ = invert_matrices(np.nan_to_num(slopes[:, rows, free]))
            change = (inverse @ np.nan_to_num(opening[:, rows]))[..., 0]
            y[:, free] -= change
            self.constants.pressing = np.sign(y[:, self._pressing_rows])
            is_tie = self._choose_greatest(y)
        tolerance, last_change = SETTLED * np.abs(y).max(axis=1), np.abs(change).max(axis=1)
        deviation = (np.abs(y[:, first_friction:] - known) * acts).max(axis=1, initial=0.0)
        self.is_unknown = is_tie | ~(last_change <= tolerance) | ~(deviation <= tolerance)
        return y

    def _choose_greatest(self, y: Array) -> BoolArray:
        """Choose which part each contact follows; where two are the greatest (n,)."""
        balance = self._values(y)
        leading, is_tie = np.zeros_like(self.constants.leading), np.zeros(len(y), bool)
        for contact in balance.rubbing_contacts:
            if contact.rubbing.law is not LoadLaw.GREATEST:
                leading[:, contact.parts.start] = 1.0
                continue
            parts = np.stack([np.broadcast_to(part[:, 0], (len(y),)) for part in balance.parts(contact)], axis=1)
            leading[np.arange(len(y)), contact.parts.start + np.argmax(parts, axis=1)] = 1.0
            ordered = np.sort(parts, axis=1)
            is_tie |= ordered[:, -1] - ordered[:, -2] <= TIE * np.abs(parts).max(axis=1)
        self.constants.leading = leading
        return is_tie

    @cached_property
    def _closing_matrices(self) -> tuple[Array, Array]:
        """The Jacobian of the balance in the forces that were solved for, and its inverse."""
        _, slopes = self._linearise(self.y)
        return slopes, invert_matrices(slopes)[0]

    def balance(self, order: int) -> BalanceAtPositions:
        """The balance with the derivatives of all forces of an order, to be asked for results."""
        if order not in self._balances:
            self._balances[order] = self._derive(order)
        return self._balances[order]

    def _derive(self, order: int) -> BalanceAtPositions:
        motion = self.kinematics.motion if order == 1 else self.kinematics.second_motion
        slopes, inverse = self._closing_matrices
        shape = [self.kinematics.count] * order
        lower = [] if order == 1 else [slopes_of_order(self.balance(1).y, 1)]

        def balance_with(derivatives: Array) -> BalanceAtPositions:
            """The balance with these derivatives of the highest order (n, unknowns, parameters, ...)."""
            y = variable_jet(self.y, *lower, derivatives)
            return BalanceAtPositions(self, motion, y, self._factor_jets(order), order)

        none: Array = np.zeros((len(self.y), self.unknown_count, *shape))
        with np.errstate(all="ignore"):  # what is not defined is not a number
            (opening,) = balance_with(none).open_balance([order], [(len(self.y), slopes.shape[1], *shape)])
        columns = opening.reshape(*opening.shape[:2], self.kinematics.count**order)
        return balance_with(_close_balance(slopes, inverse, columns).reshape(none.shape))

    def _factor_jets(self, order: int) -> list[Scalar]:
        """The factors of the loads, the parameters that follow those of the kinematics."""
        if order > 1:
            return list(self.factors.T[..., None, None])
        first = self.kinematics.count - self.factors.shape[1]
        units = np.eye(self.kinematics.count)[first:]
        return [Jet(factor[:, None], unit) for factor, unit in zip(self.factors.T, units, strict=True)]


def _close_balance(slopes: Array, inverse: Array, opening: Array) -> Array:
    """The changes of forces (n, unknowns, k) that close what is open of the balance (n, rows, k), refined once."""
    changes = -inverse @ opening
    closed: Array = changes - inverse @ (opening + slopes @ changes)
    return closed


def factor_slopes(moving: State | Motion, parameters: Sequence[str]) -> Array:
    """How the factors of loads change with the parameters at positions (n, loads, parameters), by the inputs that they
    follow; NaN where two pieces of their course meet at an angle."""
    mechanism = moving.mechanism
    count = max((np.size(driven.position) for driven in moving.inputs.values()), default=1)
    slopes: Array = np.zeros((count, len(mechanism.loads), len(parameters)))
    for k, load in enumerate(mechanism.loads):
        if load.varies is None or load.varies.input is None:
            continue
        name = load.varies.input
        if f"{name}.position" not in parameters:
            continue
        turns = moving._relative_motions[name].input_kind is MeasureKind.ANGLE
        positions = np.broadcast_to(moving.inputs[name].position, (count,))
        ahead, behind = (
            np.array([course_piece(load.varies, float(position), sense, turns).slope for position in positions])
            for sense in (1.0, -1.0)
        )
        slopes[:, k, parameters.index(f"{name}.position")] = np.where(ahead == behind, ahead, np.nan)
    return slopes


def slopes_by_factors(by_factors: Array, slopes: Array) -> Array:
    """What results (n, results, loads) that change with the factors of loads do by the parameters (n, results,
    parameters), from the slopes of `factor_slopes`."""
    known = by_factors @ np.where(np.isnan(slopes), 0.0, slopes)
    least = ROUNDING * np.abs(by_factors).max(initial=0.0)
    is_kink = (np.abs(by_factors) > least).astype(float) @ np.isnan(slopes).astype(float) > 0.0
    return np.where(is_kink, np.nan, known)
