"""The transmission angle of an output link as an expression beside the balance of a load on that link alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import INPUT_RATES, design_equations
from planar.derivatives.force_equations import ForceEquations
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.model.loads import Load
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.results.motion import Motion, State

FOLD = 1e-9
"""rad: so near to a right angle it is one, beyond which it is told as falling again: there it has no derivative."""


class TransmissionSystem:
    """The balance of weightless links under an effort at the output's pair; see `planar.transmission`."""

    def __init__(self, mechanism: Mechanism, link: str, pair: Pair, through: tuple[str, ...]):
        load = Load(pair=pair.name, effort=1.0)
        unloaded = replace(mechanism, loads=(load,), masses=(), springs=(), gravity=(0.0, 0.0), published=())
        self.design = design_equations(unloaded)
        self.balance = ForceEquations(self.design, inertia=False)
        self.link, self.pair, self.through = link, pair, through
        is_ours = {each.name: each.path[0] in ("links", "pairs") for each in self.design.dimensions}
        rates = {f"{given.pair}.{rate}" for given in mechanism.inputs for rate in INPUT_RATES}
        self.names = tuple(name for name in self.design.names if name in rates or is_ours.get(name))

    def slopes(self, moving: State | Motion, angle: Array) -> dict[str, Array]:
        """The derivatives of the angles (n,) by the names of inputs and dimensions (n,)."""
        system = self.balance.system
        values, parameters, constants = self.balance.values_at(moving)
        jacobians = system.result_jacobians(self.balance.in_unknowns(self.angle))
        found = system.slopes(jacobians, values, parameters, constants)
        is_told = ~found.is_singular & (np.abs(angle - 0.5 * np.pi) > FOLD) & (angle > FOLD)
        told = np.where(is_told[:, None], found.slopes[:, 0], np.nan)
        return {name: told[:, k] for k, name in enumerate(self.design.names) if name in {*self.names}}

    @property
    def angle(self) -> ca.SX:
        """Between the force of the other moving links on the output and its lever, or across its way."""
        forces = [self.balance.force_on(name, self.link) for name in self.through]
        force = Vector(sum(each.x for each in forces), sum(each.y for each in forces))
        way = self._way()
        cross, dot = ca.SX(ca.fabs(way.cross(force))), ca.SX(ca.fabs(way.dot(force)))
        found: Any = ca.atan2(dot, cross) if self.pair.input_kind is MeasureKind.LENGTH else ca.atan2(cross, dot)
        return ca.SX(found)

    def _way(self) -> Vector:
        """Along the slide, or from the fixed pin to where the force acts."""
        work = self.balance.work
        if self.pair.input_kind is MeasureKind.LENGTH:
            way = work.relative_motions[self.pair.name].effort_action(work.frames, work.shapes).direction
            assert way is not None
            return way
        pairs = {each.name: each for each in work.mechanism.pairs}
        driving = pairs[self.through[0]]
        rides = driving.point_on_line()
        own = [member for member in driving.coincident_points() if member[0] == self.link]
        place = own[0] if own else rides and rides[0]
        pin = next(each for each in self.pair.coincident_points() if each[0] == work.mechanism.frame)
        assert place is not None
        at, fixed = (work.frames[link].to_world(work.shapes[link].position(point)) for link, point in (place, pin))
        return at - fixed
