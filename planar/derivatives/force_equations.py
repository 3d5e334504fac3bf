"""The balance of a mechanism's links as equations over the numbers of its file, without friction, at rest."""

from __future__ import annotations

from functools import cached_property

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations
from planar.equations.residuals import pair_residuals
from planar.foundation.geometry import Vector
from planar.model.pairs import Pair


class ForceEquations:
    """The balance of a design, linear in its `unknowns`.

    These are the multipliers of the pairs' constraints, where teeth touch the force between them, then the efforts of
    the inputs; the constants are whole turns of springs, and with which sense teeth press.
    """

    def __init__(self, design: DesignEquations):
        self.design, self.work = design, design.work
        mechanism, work = self.work.mechanism, self.work
        pairs = mechanism.pairs
        contacts = {pair.name: pair.tooth_contact(work.frames, work.shapes, pairs) for pair in pairs}
        self.contacts = {name: contact for name, contact in contacts.items() if contact is not None}
        self.pressing = ca.SX.sym("s", len(self.contacts))
        counts = [len(pair.residual_kinds) for pair in pairs]
        self.multipliers, self.efforts = ca.SX.sym("l", sum(counts)), ca.SX.sym("e", len(mechanism.inputs))
        ends = np.cumsum([0, *counts])
        self.first_multipliers = {pair.name: int(first) for pair, first in zip(pairs, ends, strict=False)}
        self.unknowns = ca.vertcat(self.multipliers, self.efforts)
        self.constants = ca.vertcat(work.spring_turns, self.pressing)
        self.acting = sum(self.pair_actions.values(), work.total_action_on_links)
        for k, given in enumerate(mechanism.inputs):
            self.acting += self.efforts[k] * work.unit_effort_on_links(given.pair)

    @cached_property
    def pair_actions(self) -> dict[str, ca.SX]:
        """What each pair does on the coordinates of the links, and on its own (coordinates,)."""
        work = self.work
        values: dict[str, list[ca.SX]] = {pair.name: [] for pair in work.mechanism.pairs}
        for row, value in pair_residuals(work.mechanism.pairs, work.frames, work.numbers, work.own):
            values[row.pair].append(value)
        actions = {}
        for pair in work.mechanism.pairs:
            first, rows = self.first_multipliers[pair.name], values[pair.name]
            if pair.name in self.contacts:
                actions[pair.name] = self._tooth_action(pair, self.multipliers[first])
            else:
                multipliers = self.multipliers[first : first + len(rows)]
                actions[pair.name] = ca.jtimes(ca.vertcat(*rows), work.q, multipliers, True)
        return actions

    def _tooth_action(self, pair: Pair, press: ca.SX) -> ca.SX:
        """Teeth push each other off, whichever way they press."""
        contact, (first, second) = self.contacts[pair.name], pair.links
        sense = self.pressing[list(self.contacts).index(pair.name)]
        drive, push = (
            self.work.unit_action_on_links({second: 1.0, first: -1.0}, contact.pitch_point, direction)
            for direction in (contact.drive_direction, contact.separation_direction)
        )
        return press * (drive + sense * contact.pressure_tangent * push)

    def force_on(self, name: str, link: str) -> Vector:
        """The force of a pair on one of its moving links."""
        first, action = self.work.link_columns[link], self.pair_actions[name]
        return Vector(action[first], action[first + 1])

    def in_unknowns(self, value: ca.SX) -> ca.SX:
        """An expression in q and its rates, in the unknowns of the kinematics."""
        design, work = self.design, self.work
        q = design.link_coordinates
        first, second = design.rates(q)
        variables = [work.q, work.q1, work.q2]
        others = [design.d, self.unknowns, work.factors, self.constants]
        return ca.Function("value", [*variables, *others], [value])(q, first, second, *others)
