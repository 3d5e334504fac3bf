"""The balance of a mechanism's links as equations over the numbers of its file, and what pairs and inputs do by it."""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations
from planar.derivatives.implicit_system import ImplicitSystem, Level, invert_matrices
from planar.derivatives.rubbing_equations import RubbingEquations
from planar.dynamics.forces import Forces
from planar.dynamics.load_variation import course_piece, load_factors
from planar.dynamics.reaction_solver import bearing_point
from planar.equations.casadi_call import BufferedFunction
from planar.equations.residuals import pair_residuals
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.model.pairs import MeasureKind, Pair
from planar.results.motion import Motion, State

FIXED_FRICTION_STEPS, MAX_FRICTION_STEPS = 2, 7
"""With contacts as the solution tells them, and in all."""
SETTLED = 1e-7
"""Of the greatest force: what is further from the solution is another."""


class ForceEquations:
    """The balance as a level above the kinematics of a design.

    Its unknowns are the multipliers of the pairs' constraints, where teeth touch the force between them, then the
    efforts of the inputs, and with `forces` that have friction what rubs. Factors of loads are parameters beside t; the
    constants are whole turns of springs, with which sense teeth press, and which contacts rub how.
    """

    def __init__(self, design: DesignEquations, inertia: bool, forces: Forces | None = None):
        self.design, self.work = design, design.work
        self.forces = forces if forces is not None and forces.friction else None
        mechanism, work = self.work.mechanism, self.work
        pairs = mechanism.pairs
        contacts = {pair.name: pair.tooth_contact(work.frames, work.shapes, pairs) for pair in pairs}
        self.contacts = {name: contact for name, contact in contacts.items() if contact is not None}
        self.pressing = ca.SX.sym("s", len(self.contacts))
        counts = [len(pair.residual_kinds) for pair in pairs]
        self.multipliers, self.efforts = ca.SX.sym("l", sum(counts)), ca.SX.sym("e", len(mechanism.inputs))
        ends = np.cumsum([0, *counts])
        self.first_multipliers = {pair.name: int(first) for pair, first in zip(pairs, ends, strict=False)}
        self.rubbing = None if self.forces is None else RubbingEquations(work, self._constraint_actions(False))
        sizes, senses = (ca.SX(0, 1),) * 2 if self.rubbing is None else (self.rubbing.sizes, self.rubbing.constants)
        self.unknowns = ca.vertcat(self.multipliers, self.efforts, sizes)
        self.is_unknown: BoolArray = np.zeros(0, bool)
        "of the positions asked for last: where the solution is on a kink of friction, or no forces are known (n,)"
        self.constants = ca.vertcat(work.spring_turns, self.pressing, senses)
        acting = work.total_action_on_links - (work.inertia if inertia else 0.0)
        for each in self.pair_actions.values():
            acting += each
        for k, given in enumerate(mechanism.inputs):
            acting += self.efforts[k] * work.unit_effort_on_links(given.pair)
        self.acting = acting

    @cached_property
    def pair_actions(self) -> dict[str, ca.SX]:
        """What each pair does on the coordinates of the links, and on its own (coordinates,)."""
        found = self._constraint_actions(True)
        for name, action in ({} if self.rubbing is None else self.rubbing.actions).items():
            found[name] += action
        return found

    def _constraint_actions(self, apart: bool) -> dict[str, ca.SX]:
        """What the constraints of each pair do; teeth push each other `apart`, or only drive."""
        work = self.work
        values: dict[str, list[ca.SX]] = {pair.name: [] for pair in work.mechanism.pairs}
        for row, value in pair_residuals(work.mechanism.pairs, work.frames, work.numbers, work.own):
            values[row.pair].append(value)
        found = {}
        for name, rows in values.items():
            first = self.first_multipliers[name]
            if name in self.contacts:
                found[name] = self._tooth_action(name, self.multipliers[first], apart)
            else:
                own = self.multipliers[first : first + len(rows)]
                found[name] = ca.jtimes(ca.vertcat(*rows), work.q, own, True)
        return found

    def _tooth_action(self, name: str, press: ca.SX, apart: bool) -> ca.SX:
        """Teeth push each other off, whichever way they press."""
        contact, (first, second) = self.contacts[name], self._pair(name).links
        sense = self.pressing[list(self.contacts).index(name)]
        drive, push = (
            self.work.unit_action_on_links({second: 1.0, first: -1.0}, contact.pitch_point, way)
            for way in (contact.drive_direction, contact.separation_direction)
        )
        return press * (drive + sense * contact.pressure_tangent * push if apart else drive)

    def _pair(self, name: str) -> Pair:
        return next(pair for pair in self.work.mechanism.pairs if pair.name == name)

    def reaction(self, name: str) -> ca.SX:
        """The force (x, y) of a pair on its second link, and its couple about where the force is told."""
        pair, action = self._pair(name), self.pair_actions[name]
        work, zero = self.work, ca.SX(0.0)
        second = pair.links[1]
        wrenches: dict[str, tuple[ca.SX, ...]] = {}
        for link in dict.fromkeys(pair.bodies):
            if link in work.link_columns:
                at, frame = work.link_columns[link], work.frames[link]
                x, y = action[at], action[at + 1]
                wrenches[link] = (x, y, action[at + 2] + frame.x * y - frame.y * x)
        if second not in wrenches:  # on the frame acts what adds up to nothing
            wrenches[second] = tuple(-sum((each[k] for each in wrenches.values()), zero) for k in range(3))
        x, y, moment = wrenches[second]
        place = self._reaction_point(pair)
        return ca.vertcat(x, y, moment if place is None else moment - place.x * y + place.y * x)

    def force_on(self, name: str, link: str) -> Vector:
        """The force of a pair on one of its moving links."""
        at, action = self.work.link_columns[link], self.pair_actions[name]
        return Vector(action[at], action[at + 1])

    def _reaction_point(self, pair: Pair) -> Vector | None:
        if pair.name in self.contacts:
            return self.contacts[pair.name].pitch_point
        end = bearing_point(pair)
        return self.work.frames[end[0]].to_world(self.work.shapes[end[0]].position(end[1])) if end else None

    def in_unknowns(self, value: ca.SX) -> ca.SX:
        """An expression in q and its rates, in the unknowns of the kinematics."""
        design, work = self.design, self.work
        q = design.link_coordinates
        first, second = design.rates(q)
        given = [work.q, work.q1, work.q2]
        rest = [design.d, self.unknowns, work.factors, self.constants]
        return ca.Function("value", [*given, *rest], [value])(q, first, second, *rest)

    @cached_property
    def system(self) -> ImplicitSystem:
        """The balance above the kinematics; parameters are t, then the factors of the loads."""
        open_by = self.acting if self.rubbing is None else ca.vertcat(self.acting, self.rubbing.equations)
        level = Level(self.unknowns, self.in_unknowns(open_by), is_determinate=False)
        parameters = ca.vertcat(self.design.t, self.work.factors)
        return ImplicitSystem([*self.design.kinematics.levels, level], parameters, self.constants)

    def values_at(self, moving: State | Motion) -> tuple[list[Array], Array, Array]:
        """The unknowns of all levels, parameters and constants (n, ...) at a state or a motion."""
        values, t = self.design.coordinates_at(moving)
        many = len(t)
        inputs = {name: np.broadcast_to(each.position, (many,)) for name, each in moving.inputs.items()}
        factors = load_factors(self.design.mechanism, inputs, getattr(moving, "time", None), many)
        turns = self.work.initial_spring_turns(self.work.coordinates(moving)[0][0], self.design.mechanism.springs)
        parameters = np.concatenate([t, factors], axis=1)
        self.is_unknown = np.zeros(many, bool)
        senses = np.zeros((many, len(self.contacts)))
        if self.rubbing is not None:
            return self._values_with_friction(self.rubbing, values, parameters, turns)
        for _ in range(2 if self.contacts else 1):  # first which way teeth press
            constants = np.concatenate([np.broadcast_to(turns, (many, len(turns))), senses], axis=1)
            found = self._solve_balance(values, parameters, constants)
            senses = np.sign(found[:, [self.first_multipliers[name] for name in self.contacts]])
        return [*values, found], parameters, constants

    def _values_with_friction(
        self, rubbing: RubbingEquations, values: list[Array], parameters: Array, turns: Array
    ) -> tuple[list[Array], Array, Array]:
        """The same with friction, by Newton's method from what the solution tells, on its side of all kinks."""
        assert self.forces is not None
        many, own = len(parameters), self.unknowns.numel() - len(rubbing.contacts)
        senses = rubbing.senses_of(self.forces, many)
        sizes = np.nan_to_num(rubbing.first_sizes(self.forces, many)) * rubbing.acts(senses)
        found = np.concatenate([np.zeros((many, own)), sizes], axis=1)
        pressed = [self.first_multipliers[name] for name in self.contacts]
        parts = BufferedFunction(ca.Function("parts", self.system.given, [ca.densify(self.in_unknowns(rubbing.parts))]))
        chosen: Array = np.zeros((many, rubbing.greatest.numel()))
        press: Array = np.zeros((many, len(pressed)))
        wound = np.broadcast_to(turns, (many, len(turns)))
        for step in range(MAX_FRICTION_STEPS):
            constants = np.concatenate([wound, press, senses, chosen], axis=1)
            slopes, open_by = (
                each.transpose(0, 2, 1)
                for each in self._linear_balance.evaluate_batch(many, *values, found, parameters, constants)
            )
            rows = slice(0, -len(rubbing.contacts)) if step < FIXED_FRICTION_STEPS else slice(None)
            free = slice(0, own) if step < FIXED_FRICTION_STEPS else slice(None)
            inverse, _ = invert_matrices(np.nan_to_num(slopes[:, rows, free]))
            change = inverse @ np.nan_to_num(open_by[:, rows])
            found[:, free] -= change[..., 0]
            press = np.sign(found[:, pressed])
            every = parts.evaluate_batch(many, *values, found, parameters, constants)[0].reshape(many, -1)
            chosen, is_tie = rubbing.choose_greatest(every)
        size = np.abs(found).max(axis=1)
        moved = np.abs(change[..., 0]).max(axis=1)
        off = np.abs(found[:, own:] - rubbing.first_sizes(self.forces, many)) * rubbing.acts(senses)
        self.is_unknown = is_tie | ~(moved <= SETTLED * size) | ~(off.max(axis=1, initial=0.0) <= SETTLED * size)
        return [*values, found], parameters, np.concatenate([wound, press, senses, chosen], axis=1)

    def factor_slopes(self, moving: State | Motion) -> Array:
        """How the factors of loads change with t at positions (n, loads, parameters), with the inputs that they follow;
        NaN where two pieces of their course meet at an angle."""
        names = [given.pair for given in self.design.mechanism.inputs]
        many = max(np.size(each.position) for each in moving.inputs.values()) if names else 1
        found = np.zeros((many, len(self.design.mechanism.loads), self.design.t.numel()))
        for k, load in enumerate(self.design.mechanism.loads):
            if load.varies is None or load.varies.input is None:
                continue
            name = load.varies.input
            turns = self.work.relative_motions[name].input_kind is MeasureKind.ANGLE
            at = np.broadcast_to(moving.inputs[name].position, (many,))
            pieces = ([course_piece(load.varies, float(each), way, turns).slope for each in at] for way in (1.0, -1.0))
            ahead, behind = map(np.array, pieces)
            found[:, k, names.index(name)] = np.where(ahead == behind, ahead, np.nan)
        return found

    def slopes_by_factors(self, by_factors: Array, moving: State | Motion) -> Array:
        """What results (n, results, loads) that change with the factors of loads do by these (n, results, t)."""
        slopes = self.factor_slopes(moving)
        known = by_factors @ np.where(np.isnan(slopes), 0.0, slopes)
        is_kink = (np.abs(by_factors) > 0.0).astype(float) @ np.isnan(slopes).astype(float) > 0.0
        return np.where(is_kink, np.nan, known)

    def _solve_balance(self, values: list[Array], parameters: Array, constants: Array) -> Array:
        none = np.zeros((len(parameters), self.unknowns.numel()))
        slopes, open_by = (
            each.transpose(0, 2, 1)
            for each in self._linear_balance.evaluate_batch(len(none), *values, none, parameters, constants)
        )
        inverse, _ = invert_matrices(slopes)
        found = -inverse @ open_by
        found -= inverse @ (open_by + slopes @ found)
        return found[..., 0]

    @cached_property
    def _linear_balance(self) -> BufferedFunction:
        """What the balance is short of, and its Jacobian in the unknown forces, in which it is linear."""
        acting = self.system.levels[-1].equations
        outputs = [ca.densify(ca.jacobian(acting, self.unknowns)), ca.densify(acting)]
        return BufferedFunction(ca.Function("balance", self.system.given, outputs))
