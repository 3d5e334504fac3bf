"""A mechanism's equations with symbols for the numbers of its file: F(z, u, d) = 0, and the links' frames by them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from planar.derivatives.parameters import INPUT_RATES, Parameters
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.coordinates import FRAME_PARTS, frames_from_coordinates
from planar.equations.elimination import stack_expressions
from planar.equations.mechanism_numbers import scale_lengths
from planar.equations.rates import time_derivatives
from planar.equations.residuals import scalars
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Scalar, value_and_rates
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.results.kinematic_result import KinematicResult
from planar.solving.position import PositionSolver, solved_mechanism


class DesignEquations:
    """The equations of one mechanism over t = (u, u', u'', d): inputs with two rates, and dimensions (SI).

    They determine the unknowns z, and their rates with them two rates of z. `offsets` and errors are those of
    `Parameters`.
    """

    def __init__(self, mechanism: Mechanism, offsets: tuple[str, ...] = ()):
        self.parameters = Parameters(mechanism, offsets)
        self.solver: PositionSolver = solved_mechanism(mechanism).solver
        self.mechanism, self.equations = mechanism, self.solver.equations
        self.dimensions, self.names = self.parameters.dimensions, self.parameters.names
        own = len(self.parameters.file_dimensions)
        self.d = ca.SX.sym("d", len(self.dimensions))
        symbols = [self.d[k] for k in range(own)]
        self.work = LagrangianFunctions(self.parameters.mechanism_with(symbols), self.solver.unit)
        for k, pair in enumerate(each for name in offsets for each in mechanism.pairs if each.name == name):
            at = own + 2 * k
            self.work.numbers[pair.name] = pair.offset_pin(
                self.work.numbers[pair.name], Vector(self.d[at], self.d[at + 1])
            )
        count = len(mechanism.inputs)
        self.u, self.u1, self.u2 = (ca.SX.sym(name, count) for name in ("u", "u1", "u2"))
        self.t = ca.vertcat(self.u, self.u1, self.u2, self.d)
        self.z = self.equations.z
        self.z1, self.z2 = (ca.SX.sym(name, self.z.numel()) for name in ("z1", "z2"))
        self.F, self.w = self._equations_of_design()

    def _equations_of_design(self) -> tuple[ca.SX, ca.SX]:
        """F, and w in m and rad."""
        unit = self.solver.unit
        numbers = [
            number
            for pair in self.mechanism.pairs
            for number in scale_lengths(self.work.numbers[pair.name], pair.number_kinds, unit)
        ]
        p = ca.vertcat(ca.SX(0, 1), *numbers)
        scaled = self.u / ca.DM(self.input_scale)
        F, w = self.equations.as_function()(self.z, scaled, p)
        return F, w * ca.DM(self.solver.scale)

    @cached_property
    def input_scale(self) -> Array:
        """What inputs are in units of (inputs,): m, rad."""
        kinds = self.equations.input_kinds
        return np.array([self.solver.unit if kind is MeasureKind.LENGTH else 1.0 for kind in kinds])

    @property
    def scale(self) -> Array:
        """What each of t is in units of (parameters,): see `Parameters.scale`."""
        return self.parameters.scale

    def rates(self, value: ca.SX) -> tuple[ca.SX, ca.SX]:
        """The first and second rates of what is made of z, u and d."""
        y, y1 = ca.vertcat(self.z, self.u), ca.vertcat(self.z1, self.u1)
        first, second = time_derivatives(value, y, y1, ca.vertcat(self.z2, self.u2))
        return first, second

    @cached_property
    def placed(self) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
        """The links' frames and the pairs' own coordinates, in symbols."""
        solver = self.solver
        return frames_from_coordinates(scalars(self.w), solver.column, list(solver.shapes), solver.pairs)

    @cached_property
    def link_coordinates(self) -> ca.SX:
        """The coordinates of `LagrangianFunctions` (q,) in the unknowns."""
        frames, own = self.placed
        parts = [getattr(frames[link], part) for link in self.work.links for part in FRAME_PARTS]
        parts += [each for pair in self.mechanism.pairs for each in own[pair.name]]
        return stack_expressions(parts)

    def in_link_coordinates(self, value: ca.SX) -> ca.SX:
        """An expression in the coordinates q of `LagrangianFunctions`, in the unknowns."""
        return ca.Function("value", [self.work.q, self.d], [value])(self.link_coordinates, self.d)

    def coordinates_at(self, moving: KinematicResult) -> tuple[list[Array], Array]:
        """z, z', z'' (n, unknowns) and t (n, parameters) at a state or a motion."""
        inputs = [moving.inputs[given.pair] for given in self.mechanism.inputs]
        given = [[np.asarray(getattr(each, rate), float) for each in inputs] for rate in INPUT_RATES]
        z = self.unknowns_at(moving)
        many = max(len(z[0]), *(np.size(part) for each in given for part in each), 1)
        z = [np.broadcast_to(each, (many, each.shape[1])) for each in z]
        values = np.array([[np.broadcast_to(part, (many,)) for part in each] for each in given])
        t = np.concatenate(
            [values.reshape(-1, many).T, np.tile([each.value for each in self.dimensions], (many, 1))], 1
        )
        return z, t

    def unknowns_at(self, moving: KinematicResult) -> list[Array]:
        """z, z', z'' (n, unknowns) at positions that have rates."""
        parts = [_parts_of(moving, each.owner, each.part, self.solver.pairs) for each in self.equations.coordinates]
        many = max((np.size(part) for each in parts for part in each), default=1)
        w = np.array([[np.broadcast_to(part, (many,)) for part in each] for each in parts]).reshape(-1, 3, many)
        unknown = list(self.equations.unknowns)
        return list((w[unknown] / self.solver.scale[unknown, None, None]).transpose(1, 2, 0))


def _parts_of(moving: KinematicResult, owner: str, part: str, pairs: Mapping[str, Pair]) -> tuple[Any, ...]:
    """A coordinate with its two rates."""
    if part in FRAME_PARTS and owner in moving.frames:
        return value_and_rates(getattr(moving.frames[owner], part))[:3]
    names = [name for name, _ in pairs[owner].coordinate_kinds]
    return value_and_rates(moving.own[owner][names.index(part)])[:3]


@lru_cache(maxsize=32)
def design_equations(mechanism: Mechanism, offsets: tuple[str, ...] = ()) -> DesignEquations:
    """The equations of a mechanism, kept for the next time."""
    return DesignEquations(mechanism, offsets)
