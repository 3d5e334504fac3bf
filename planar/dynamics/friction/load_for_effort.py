"""The size of a load with which an input supplies a given effort, where pairs rub in the sense of the motion.

Friction follows the forces, so that efforts are not linear in a load. Its size takes the place of the effort among what
balances the links, and every solution of that is found as those of forces are.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.frictional_forces import solve_friction
from planar.dynamics.reaction_solver import ReactionSolver, fill_balance
from planar.dynamics.reactions import input_efforts
from planar.dynamics.virtual_work import VirtualWorkBalance, balance_equations
from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion, State


class EffortBesideFriction(NamedTuple):
    """Numbers of positions (n,), NaN where they are not determined, whether anything rubs, and what to say of that."""

    values: Array
    rubs: bool
    remarks: tuple[str, ...]

    def __repr__(self) -> str:
        return short_repr(self)


class LoadWithFriction:
    """A load whose size is in question, in a state or motion of a mechanism with friction.

    `doubled` is the mechanism with twice that load; `column` the number of the input.
    """

    def __init__(self, moving: State | Motion, doubled: Mechanism, column: int, inertia: bool):
        equations = balance_equations(moving.mechanism)
        time = moving.time if isinstance(moving, Motion) else np.zeros(1)
        self.equations, self.column = equations, column
        self.field = KinematicArrays(moving)
        more = KinematicArrays(replace(moving, mechanism=doubled))
        self.own = fill_balance(self.field, time, inertia).balance
        twice = fill_balance(more, time, inertia).balance
        self.loads, self.inertia = twice.loads - self.own.loads, twice.inertia - self.own.inertia

    def efforts(self, factor: float) -> EffortBesideFriction:
        """What the input supplies with so many times the load. Raises NoAnswer where a position jams."""
        more = factor - 1.0
        own = self.own._replace(
            loads=self.own.loads + more * self.loads, inertia=self.own.inertia + more * self.inertia
        )
        return self._solve(own)

    def factors(self, effort: float) -> EffortBesideFriction:
        """What the load has to be multiplied by so that the input supplies so much. Raises NoAnswer as `efforts`."""
        directions = self.own.input_directions.copy()
        driven = directions[:, self.column] * effort
        directions[:, self.column] = self.loads - self.inertia
        exchanged = self.own._replace(
            loads=self.own.loads - self.loads + driven,
            inertia=self.own.inertia - self.inertia,
            input_directions=directions,
        )
        return self._solve(exchanged)

    def _solve(self, balance: VirtualWorkBalance) -> EffortBesideFriction:
        reactions = ReactionSolver(self.equations, balance, self.field)
        without = reactions.solve()
        result = solve_friction(reactions, self.field, without)
        solved = without if result.solution is None else result.solution.forces
        rubs = result.solution is not None
        return EffortBesideFriction(input_efforts(solved)[0][:, self.column], rubs, result.remarks)
