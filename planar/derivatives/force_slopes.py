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
from functools import cached_property

import numpy as np

from planar.derivatives.kinematic_slopes import (
    ConstraintElements,
    CoordinateMotion,
    KinematicSlopes,
    NamedResult,
    element_arguments,
    slopes_of_order,
    stack_results,
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
from planar.model.pairs.rubbing import LoadLaw
from planar.results.motion import Motion, State

FIXED_FRICTION_STEPS, MAX_FRICTION_STEPS = 2, 7
"""With contacts as the solution has them, and in all."""
SETTLED = 1e-7
"""Of the greatest force: what is further from the solution is another."""
TIE = 1e-9
"""Of the greatest part: two parts as near as that are both the greatest, and such a kink has no derivatives."""

ROUNDING = 1e-12
"""Of the greatest change with the factors of loads: a lesser one is none."""


class ForceBalance:
    """The balance of all links in their forces y, and what does not change with small changes: in which sense teeth
    press (n, toothed pairs) and each pair rubs (n,), and one for the greatest part of each contact's loads, zero for
    the others (n, parts)."""

    def __init__(self, elements: ConstraintElements, motion: CoordinateMotion, count: int = 1):
        """`motion` are the `count` positions."""
        self.elements = elements
        pairs = motion.mechanism.pairs
        self.inputs = tuple(driven.pair for driven in motion.mechanism.inputs)
        self.toothed = [
            pair.name for pair in pairs if pair.tooth_contact(motion.frames, motion.shapes, pairs) is not None
        ]
        placed = {name: element for name, element in elements.placed_pairs.items() if name not in self.toothed}
        by_rows = {element.rows.start: name for name, element in placed.items()}
        self.groups = [
            (group, [by_rows[int(row)] for row in group.rows[:, 0]]) for group in group_elements(placed.values())
        ]
        self.first_friction = elements.row_count
        self.rubs = False
        self.pressing: Array = np.zeros((count, len(self.toothed)))
        self.senses: dict[str, Array] = {}
        self.leading: dict[int, Array] = {}


class BalanceAtPositions:
    """The balance at positions of any arithmetic, from coordinates, numbers of the file and forces y."""

    def __init__(self, of: ForceBalance, motion: CoordinateMotion, y: Scalar, order: int = 1):
        """`order` is that of the jets, 1 without any."""
        self.of, self.motion, self.y, self.order = of, motion, y, order
        self.pairs = {pair.name: pair for pair in motion.mechanism.pairs}
        self._exerted: dict[str, list[Scalar]] = {}
        "by pair, what its constraints do on its local coordinates"
        for group, names in of.groups:
            exerted = self._exerted_by_group(group)
            for place, name in enumerate(names):
                self._exerted[name] = [
                    value if isinstance(value, float) else take_entries(value, place) for value in exerted
                ]

    def _exerted_by_group(self, group: ElementGroup) -> list[Scalar]:
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

    def _constant(self, column: Array) -> Array:
        """A number at every position (n,) as (n, 1), or (n, 1, 1) beside jets of the second order."""
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
    def rubbing_contacts(self) -> list[tuple[Pair, RubbingContact]]:
        """Where pairs rub."""
        pairs = self.motion.mechanism.pairs
        return [
            (pair, contact)
            for pair in (pairs if self.of.rubs else ())
            for contact in pair.rubbing_contacts(self.motion.frames, self.motion.shapes, pairs, False)
        ]

    # actions of pairs and inputs

    def _tooth_actions(self, name: str, apart: bool) -> Iterator[LinkAction]:
        """Teeth drive, and push each other apart, in whichever sense they press."""
        contact, (first, second) = self.contacts[name], self.pairs[name].links
        press = take_entries(self.y, self.of.elements.pair_rows[name].start)
        force = contact.drive_direction * press
        if apart:
            sense = self._constant(self.of.pressing[:, self.of.toothed.index(name)])
            force = force + contact.separation_direction * (press * sense * contact.pressure_tangent)
        for link, sign in ((second, 1.0), (first, -1.0)):
            yield LinkAction("pair", name, link, contact.pitch_point, force * sign, 0.0)

    def _constraint_actions(self, name: str, apart: bool = True) -> Iterator[LinkAction]:
        """What the constraints of a pair do to moving links; teeth push each other `apart`, or only drive."""
        if name in self.contacts:
            yield from self._tooth_actions(name, apart)
            return
        moving = [link for link in self.pairs[name].bodies if link in self.of.elements.link_columns]
        for body, link in enumerate(moving):
            frame, (x, y, couple) = self.motion.frame(link), self._exerted[name][3 * body : 3 * body + 3]
            yield LinkAction("pair", name, link, Vector(frame.x, frame.y), Vector(x, y), couple)

    def _friction_size(self, index: int) -> Scalar:
        return take_entries(self.y, self.of.first_friction + index)

    def _friction(self, index: int) -> Scalar:
        """What friction in a contact does in the positive sense of its action (N, N m)."""
        pair, contact = self.rubbing_contacts[index]
        return self._friction_size(index) * (-contact.rate_sense * self._constant(self.of.senses[pair.name]))

    def _friction_actions(self, name: str | None = None) -> Iterator[LinkAction]:
        """What friction in a pair, or in all, does on links."""
        for index, (pair, contact) in enumerate(self.rubbing_contacts):
            if name in (None, pair.name):
                yield from two_sided_actions(self.motion, "friction", pair.name, contact.action, self._friction(index))

    def effort(self, index: int) -> Scalar:
        """What an input supplies (N, N m)."""
        return take_entries(self.y, self.of.elements.constraint_count + index)

    def pair_wrench(self, name: str, link: str) -> tuple[Vector, Scalar]:
        """The force of a pair on a link, with its friction, and the moment about the world's origin."""
        return self._wrench([*self._constraint_actions(name), *self._friction_actions(name)], link)

    def _wrench(self, actions: Iterable[LinkAction], link: str) -> tuple[Vector, Scalar]:
        """The sum of a pair's actions on a link; the action on the frame balances those on the moving links."""
        moving = self.of.elements.link_columns
        terms = [
            (action.force.x, action.force.y, action.place.cross(action.force) + action.couple)
            for action in actions
            if (action.link == link if link in moving else action.link in moving)
        ]
        sign = 1.0 if link in moving else -1.0
        x, y, moment = (sum(parts, 0.0) * sign for parts in zip(*terms, strict=True))
        return Vector(x, y), moment

    # the equations

    def open_rows(self, actions: Iterable[LinkAction]) -> list[Scalar]:
        """By how much the balance is open under some actions on the links: of every coordinate, then of contacts."""
        elements = self.of.elements
        rows: list[Scalar] = [0.0] * elements.coordinate_count
        for name, exerted in self._exerted.items():  # a link may be two bodies of a pair
            for column, value in zip(elements.placed_pairs[name].coordinates, exerted, strict=True):
                rows[column] = rows[column] + value
        actions = [*actions, *self._friction_actions()]
        for index, name in enumerate(self.of.inputs):
            actions += effort_actions(self.motion, "input", name, self.effort(index))
        for name in self.contacts:
            actions += self._tooth_actions(name, True)
        for action in actions:
            if action.link in elements.link_columns:
                first = elements.link_columns[action.link]
                for column, part in enumerate(action_on_link(self.motion, action), first):
                    rows[column] = rows[column] + part
        contacts = range(len(self.rubbing_contacts))
        return [*rows, *(self._friction_size(index) - self._required_size(index) for index in contacts)]

    def _required_size(self, index: int) -> Scalar:
        """How great the friction of a contact is by what its pair's constraints exert."""
        law, parts = self.rubbing_contacts[index][1].law, self.load_parts(index)
        if law is LoadLaw.RESULTANT:
            return sqrt(sum((part * part for part in parts[1:]), parts[0] * parts[0]))
        if law is LoadLaw.SIGNED:
            return parts[0]
        leading = self.of.leading[index].T
        return sum((part * self._constant(is_leading) for part, is_leading in zip(parts, leading, strict=True)), 0.0)

    def load_parts(self, index: int) -> list[Scalar]:
        """The parts of forces, or couples, that a contact follows, each times its factor."""
        pair, contact = self.rubbing_contacts[index]
        parts: list[Scalar] = []
        for load in contact.loads:
            force, moment = self._wrench(self._constraint_actions(pair.name, apart=False), load.link)
            if load.direction is not None:
                value = load.direction.dot(force)
            else:
                assert load.place is not None
                value = moment - load.place.cross(force)
            if contact.law is not LoadLaw.GREATEST:
                parts.append(value * load.factor)
                continue
            opposed = load.factor if load.opposed is None else load.opposed
            sense = self._constant(self.of.senses[pair.name])
            mean, half = (load.factor + opposed) * 0.5, (load.factor - opposed) * 0.5 * sense
            parts += [value * (mean + half), -value * (mean - half)]
        return parts

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
            force, moment = self.pair_wrench(name, self.pairs[name].links[1])
            place = self._reaction_point(self.pairs[name])
            couple = moment if place is None else moment - place.cross(force)
            results.append(NamedResult("force", "force", tuple(force)))
            results.append(NamedResult("couple", "torque", (couple,)))
        for index, (pair, _) in enumerate(self.rubbing_contacts):
            if pair.name == name:
                results.append(NamedResult("friction", effort_kind, (self._friction(index),)))
                break
        return results

    def _reaction_point(self, pair: Pair) -> Vector | None:
        """Where the force of a pair is told."""
        if pair.name in self.contacts:
            return self.contacts[pair.name].pitch_point
        end = bearing_point(pair)
        return self.motion.place(end[0], self.motion.shapes[end[0]].position(end[1])) if end else None


class ForceSlopes(ForceBalance):
    """The derivatives of forces at positions (n), in the parameters and then in the factors of the loads."""

    def __init__(
        self, kinematics: KinematicSlopes, forces: Forces | None, rows: slice, factors: Array, spring_turns: Array
    ):
        """`rows` are the positions among those of the forces, of which friction and inertia are taken, `factors`
        (n, loads) those of the loads there."""
        self.kinematics, count = kinematics, len(factors)
        self._balances: dict[int, BalanceAtPositions] = {}
        unit, constants = kinematics.parameters.unit, [rates[..., None] for rates in kinematics.rates]
        self.motion = CoordinateMotion(kinematics.elements, kinematics.numbers(0), unit, Jet(*constants))
        super().__init__(kinematics.elements, self.motion, count)
        self.rubs = forces is not None and bool(forces.friction)
        self.with_inertia = forces is not None and any(action.kind == "inertia" for action in forces.acting)
        self.factors, self.spring_turns = factors, spring_turns
        contacts = self._at(np.zeros((count, self.first_friction, 1))).rubbing_contacts
        self.unknown_count = self.first_friction + len(contacts)
        self.is_unknown: BoolArray = np.zeros(count, bool)
        "(n,): where the solution is on a kink of friction, or no forces are known"
        if forces is not None and contacts:
            self.y = self._solve_with_friction(forces, rows, contacts)
        else:
            for _ in range(2 if self.toothed else 1):  # first which way teeth press
                opening, slopes = self._linearise(np.zeros((count, self.unknown_count)))
                self.y = _close_balance(slopes, invert_matrices(slopes)[0], opening)[..., 0]
                self._set_pressing(self.y)
        self._jacobian = self._linearise(self.y)[1]
        self._inverse = invert_matrices(self._jacobian)[0]

    def _set_pressing(self, y: Array) -> None:
        self.pressing = np.sign(y[:, [self.elements.pair_rows[name].start for name in self.toothed]])

    def _at(self, y: Scalar) -> BalanceAtPositions:
        """The balance at forces y, numbers (n, unknowns, 1) or jets along some changes of these."""
        return BalanceAtPositions(self, self.motion, y)

    def _open(self, balance: BalanceAtPositions, factors: Sequence[Scalar]) -> list[Scalar]:
        """By how much a balance is open under loads with these factors, weights, springs and inertia."""
        turns = [column.reshape(-1, *((1,) * balance.order)) for column in self.spring_turns.T]
        actions = [*passive_actions(balance.motion, factors, turns)]
        with np.errstate(all="ignore"):  # what is not defined is not a number
            return balance.open_rows([*actions, *(inertia_actions(balance.motion) if self.with_inertia else ())])

    def _linearise(self, y: Array) -> tuple[Array, Array]:
        """By how much the balance is open (n, rows, 1), and its Jacobian (n, rows, unknowns) in the forces."""
        count = self.unknown_count
        unit: Array = np.broadcast_to(np.eye(count), (len(y), count, count))
        rows = self._open(self._at(variable_jet(y, unit)), list(self.factors.T[..., None]))
        return stack_results(rows, 0, (len(y),))[..., None], stack_results(rows, 1, (len(y), count))

    def _solve_with_friction(
        self, forces: Forces, rows_of_all: slice, contacts: Sequence[tuple[Pair, RubbingContact]]
    ) -> Array:
        """The forces with friction, by Newton's method from the friction of the solution, on its side of all kinks."""
        count, first_friction = len(self.factors), self.first_friction

        def at_positions(value: Array | float) -> Array:
            """A value at all positions, or the same at all, at these (n,)."""
            rows = value if np.ndim(value) == 0 else np.asarray(value)[rows_of_all]
            return np.broadcast_to(np.asarray(rows, dtype=float), (count,))

        names = [pair.name for pair, _ in contacts]
        self.senses = {name: at_positions(forces.friction[name].sense) for name in names}
        is_first = np.array([names.index(name) == k for k, name in enumerate(names)])
        acts = is_first & (np.stack([self.senses[name] for name in names], axis=1) != 0.0)
        known = np.stack([np.abs(at_positions(forces.friction[name].effort)) for name in names], axis=1)
        y: Array = np.concatenate([np.zeros((count, first_friction)), np.nan_to_num(known) * acts], axis=1)
        is_tie = self._choose_greatest(y)
        for step in range(MAX_FRICTION_STEPS):
            opening, slopes = self._linearise(y)
            is_fixed = step < FIXED_FRICTION_STEPS
            rows = slice(0, -len(contacts)) if is_fixed else slice(None)
            free = slice(0, first_friction) if is_fixed else slice(None)
            inverse, _ = invert_matrices(np.nan_to_num(slopes[:, rows, free]))
            change = (inverse @ np.nan_to_num(opening[:, rows]))[..., 0]
            y[:, free] -= change
            self._set_pressing(y)
            is_tie = self._choose_greatest(y)
        tolerance, last_change = SETTLED * np.abs(y).max(axis=1), np.abs(change).max(axis=1)
        deviation = (np.abs(y[:, first_friction:] - known) * acts).max(axis=1, initial=0.0)
        self.is_unknown = is_tie | ~(last_change <= tolerance) | ~(deviation <= tolerance)
        return y

    def _choose_greatest(self, y: Array) -> BoolArray:
        """Choose which part each contact follows; where two are the greatest (n,)."""
        balance, is_tie = self._at(y[..., None]), np.zeros(len(y), bool)
        for index, (_, contact) in enumerate(balance.rubbing_contacts):
            if contact.law is LoadLaw.GREATEST:
                columns = [np.broadcast_to(part[:, 0], (len(y),)) for part in balance.load_parts(index)]
                parts = np.stack(columns, axis=1)
                self.leading[index] = np.eye(parts.shape[1])[np.argmax(parts, axis=1)]
                ordered = np.sort(parts, axis=1)
                is_tie |= ordered[:, -1] - ordered[:, -2] <= TIE * np.abs(parts).max(axis=1)
        return is_tie

    def balance(self, order: int) -> BalanceAtPositions:
        """The balance with the derivatives of all forces of an order, to be asked for results."""
        if order not in self._balances:
            self._balances[order] = self._derive(order)
        return self._balances[order]

    def _derive(self, order: int) -> BalanceAtPositions:
        motion = self.kinematics.motion if order == 1 else self.kinematics.second_motion
        shape = [self.kinematics.count] * order
        lower = [] if order == 1 else [slopes_of_order(self.balance(1).y, 1)]

        def balance_with(derivatives: Array) -> BalanceAtPositions:
            """The balance with these derivatives of the highest order (n, unknowns, parameters, ...)."""
            return BalanceAtPositions(self, motion, variable_jet(self.y, *lower, derivatives), order)

        none: Array = np.zeros((len(self.y), self.unknown_count, *shape))
        rows = self._open(balance_with(none), self._factor_jets(order))
        opening = stack_results(rows, order, (len(self.y), *shape))
        columns = opening.reshape(*opening.shape[:2], self.kinematics.count**order)
        return balance_with(_close_balance(self._jacobian, self._inverse, columns).reshape(none.shape))

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
