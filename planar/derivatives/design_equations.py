"""A mechanism's equations with symbols for the numbers of its file: F(z, u, d) = 0, and what moves and acts by them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property, lru_cache

import casadi as ca
import numpy as np

from planar.derivatives.kinematic_slopes import GROUND_RATES, RatedMotion
from planar.derivatives.parameters import INPUT_RATES, Parameters
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.coordinates import FRAME_PARTS, frames_from_coordinates
from planar.equations.elimination import stack_expressions
from planar.equations.mechanism_numbers import scale_lengths
from planar.equations.rates import time_derivatives
from planar.equations.residuals import input_positions, pair_residuals, scalars
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import PointMember
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
        file_count = len(self.parameters.file_dimensions)
        self.d = ca.SX.sym("d", len(self.dimensions))
        symbols = scalars(self.d)
        self.work = LagrangianFunctions(self.parameters.mechanism_with(symbols[:file_count]), self.solver.unit)
        pairs = {pair.name: pair for pair in mechanism.pairs}
        for k, name in enumerate(offsets):
            offset = Vector(*symbols[file_count + 2 * k : file_count + 2 * k + 2])
            self.work.numbers[name] = pairs[name].offset_pin(self.work.numbers[name], offset)
        count = len(mechanism.inputs)
        self.u, self.u1, self.u2 = (ca.SX.sym(name, count) for name in ("u", "u1", "u2"))
        self.t = ca.vertcat(self.u, self.u1, self.u2, self.d)
        self.z = self.equations.z
        self.z1, self.z2 = (ca.SX.sym(name, self.z.numel()) for name in ("z1", "z2"))
        self.pair_numbers: list[Scalar] = [
            number
            for pair in mechanism.pairs
            for number in scale_lengths(self.work.numbers[pair.name], pair.number_kinds, self.solver.unit)
        ]
        "p, lengths in sizes"
        scaled_inputs = self.u / ca.DM(self.input_scale)
        self.F, w = self.equations.as_function()(self.z, scaled_inputs, stack_expressions(self.pair_numbers))
        self.w = w * ca.DM(self.solver.scale)

    @cached_property
    def input_scale(self) -> Array:
        """What inputs are in units of (inputs,): m, rad."""
        kinds = self.equations.input_kinds
        return np.array([self.solver.unit if kind is MeasureKind.LENGTH else 1.0 for kind in kinds])

    def rates(self, value: ca.SX) -> tuple[ca.SX, ca.SX]:
        """The first and second rates of what is made of z, u and d."""
        y, y1 = ca.vertcat(self.z, self.u), ca.vertcat(self.z1, self.u1)
        first, second = time_derivatives(value, y, y1, ca.vertcat(self.z2, self.u2))
        return first, second

    def point_numbers(self, members: Iterable[PointMember]) -> list[Scalar]:
        """q: x and y of points of links in the axes of these, in sizes."""
        shapes, unit = self.work.shapes, self.solver.unit
        return [part / unit for link, point in members for part in shapes[link].position(point)]

    @cached_property
    def placed(self) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
        """The links' frames and the pairs' own coordinates, in symbols."""
        solver = self.solver
        return frames_from_coordinates(scalars(self.w), solver.column, list(solver.shapes), solver.pairs)

    @cached_property
    def motion(self) -> SymbolicMotion:
        """The positions of the links with their rates, in symbols."""
        return SymbolicMotion(self)

    @cached_property
    def _columns(self) -> list[int]:
        """Where in w each of the coordinates q of `LagrangianFunctions` stands."""
        column = self.solver.column
        columns = [column[link, part] for link in self.work.links for part in FRAME_PARTS]
        return columns + [column[pair.name, part] for pair in self.mechanism.pairs for part, _ in pair.coordinate_kinds]

    def in_unknowns(self, value: ca.SX) -> ca.SX:
        """An expression in the coordinates q of `LagrangianFunctions`, in the unknowns."""
        return ca.substitute(value, self.work.q, self.w[self._columns])

    def coordinates_at(self, moving: KinematicResult) -> tuple[list[Array], Array]:
        """z, z', z'' (n, unknowns) and t (n, parameters) at a state or a motion."""
        inputs = [moving.inputs[driven.pair] for driven in self.mechanism.inputs]
        input_rates = [np.asarray(getattr(motion, rate), float) for rate in INPUT_RATES for motion in inputs]
        coordinates = self.work.coordinates(moving)
        count = max(len(coordinates[0]), *(rate.size for rate in input_rates), 1)
        unknowns = list(self.equations.unknowns)
        z: list[Array] = []
        for rate in coordinates:
            w: Array = np.empty((count, len(self._columns)))
            w[:, self._columns] = rate
            z.append(w[:, unknowns] / self.solver.scale[unknowns])
        t: Array = np.empty((count, len(self.names)))
        for column, rate in enumerate(input_rates):
            t[:, column] = rate
        t[:, len(input_rates) :] = [dimension.value for dimension in self.dimensions]
        return z, t


@lru_cache(maxsize=32)
def design_equations(mechanism: Mechanism, offsets: tuple[str, ...] = ()) -> DesignEquations:
    """The equations of a mechanism, kept for the next time."""
    return DesignEquations(mechanism, offsets)


def with_rates(value: ca.SX, y: Sequence[ca.SX]) -> list[ca.SX]:
    """An expression in y, and its rates, as many as y has."""
    return [value, *time_derivatives(value, *y)] if len(y) > 1 else [value]


class SymbolicMotion(RatedMotion):
    """Positions of links with two rates, as expressions in the unknowns, the inputs, their rates and the numbers."""

    orders = 3

    def __init__(self, design: DesignEquations):
        self.design, self.mechanism, self.shapes = design, design.work.mechanism, design.work.shapes
        self._rates: dict[str, Sequence[Sequence[Scalar]]] = {}

    @property
    def size(self) -> float:
        return self.design.solver.unit

    def frame(self, link: str) -> Frame:
        return self.design.placed[0][link]

    def frame_rates(self, link: str) -> Sequence[Sequence[Scalar]]:
        if link == self.mechanism.frame:
            return GROUND_RATES
        if link not in self._rates:
            parts = stack_expressions(self.frame(link)[:5])
            self._rates[link] = [scalars(rate) for rate in (parts, *self.design.rates(parts))]
        return self._rates[link]

    def input_position(self, pair: Pair) -> Jet:
        """The position of a relative motion with its rates."""
        (position,) = input_positions([pair], self.frames, self.design.work.numbers, self.design.placed[1])
        position = ca.SX(position)
        return Jet(position, *self.design.rates(position))


class OutputBalance:
    """The balance of weightless links under an effort of one at the pair of an output, `acting` = 0 in z, u and d.

    It is linear in the `unknowns`: the multipliers of the pairs' constraints, where teeth touch the force that drives,
    then the efforts of the inputs.
    """

    def __init__(self, design: DesignEquations, output: Pair):
        self.design = design
        work, pairs = design.work, design.work.mechanism.pairs
        residuals: dict[str, list[ca.SX]] = {pair.name: [] for pair in pairs}
        for row, residual in pair_residuals(pairs, work.frames, work.numbers, work.own):
            residuals[row.pair].append(residual)
        actions, multipliers = {}, []
        for pair in pairs:
            own_multipliers = ca.SX.sym("l", len(residuals[pair.name]))
            multipliers.append(own_multipliers)
            contact = pair.tooth_contact(work.frames, work.shapes, pairs)
            if contact is None:
                action = ca.jtimes(ca.vertcat(*residuals[pair.name]), work.q, own_multipliers, True)
            else:
                senses = dict(zip(pair.links, (-1.0, 1.0), strict=True))
                unit = work.unit_action_on_links(senses, contact.pitch_point, contact.drive_direction)
                action = own_multipliers[0] * unit
            actions[pair.name] = design.in_unknowns(action)
        efforts = ca.SX.sym("e", len(design.mechanism.inputs))
        acting = work.unit_effort_on_links(output.name)
        for k, driven in enumerate(design.mechanism.inputs):
            acting += efforts[k] * work.unit_effort_on_links(driven.pair)
        self.unknowns, self._actions = stack_expressions([*multipliers, efforts]), actions
        self.acting = sum(actions.values(), design.in_unknowns(acting))

    def force_on(self, name: str, link: str) -> Vector:
        """The force of a pair on one of its moving links."""
        first, action = self.design.work.link_columns[link], self._actions[name]
        return Vector(action[first], action[first + 1])
