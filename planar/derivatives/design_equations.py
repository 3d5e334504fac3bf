"""A mechanism's equations with symbols for the numbers of its file: F(z, u, d) = 0, and what moves and acts by them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.enclosures import ImplicitSystem, ParametricSystem
from planar.derivatives.force_slopes import BalanceAtPositions, ForceBalance
from planar.derivatives.kinematic_slopes import (
    INPUT_RATES,
    CoordinateMotion,
    FileNumbers,
    Parameters,
    constraint_elements,
    kinematic_results,
)
from planar.dynamics.external_actions import effort_actions
from planar.dynamics.forces import Forces
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.equations.casadi_functions import BufferedFunction
from planar.equations.coordinates import FRAME_PARTS
from planar.equations.elimination import stack_expressions
from planar.equations.mechanism_numbers import scale_lengths
from planar.equations.rates import time_derivatives
from planar.equations.residuals import scalars
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.generalised_inverses import invert_matrices
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import PointMember
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.results.kinematic_result import KinematicResult
from planar.results.motion import Motion, State
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
        self.d = ca.SX.sym("d", len(self.dimensions))
        pairs = [pair.name for pair in mechanism.pairs]
        self.numbers = FileNumbers(self.parameters, pairs, scalars(self.d), lambda p: stack_expressions(p).T)
        self.work = LagrangianFunctions(self.numbers.mechanism, self.solver.unit)
        count = len(mechanism.inputs)
        self.u, self.u1, self.u2 = (ca.SX.sym(name, count) for name in ("u", "u1", "u2"))
        self.t = ca.vertcat(self.u, self.u1, self.u2, self.d)
        self.z = self.equations.z
        self.z1, self.z2 = (ca.SX.sym(name, self.z.numel()) for name in ("z1", "z2"))
        self.pair_numbers: list[Scalar] = [
            number
            for pair in mechanism.pairs
            for number in scale_lengths(self.numbers.measured[pair.name], pair.number_kinds, self.solver.unit)
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
        shapes, unit = self.numbers.shapes, self.solver.unit
        return [part / unit for link, point in members for part in shapes[link].position(point)]

    @cached_property
    def positions(self) -> CoordinateMotion:
        """The positions of the links, in symbols."""
        return self._motion(self._q)

    @cached_property
    def motion(self) -> CoordinateMotion:
        """The positions of the links with their rates, in symbols."""
        return self._motion(self._q, *self.rates(self._q))

    def _motion(self, *q: ca.SX) -> CoordinateMotion:
        return CoordinateMotion(self.work, self.numbers, self.solver.unit, Jet(*(part.T for part in q)))

    @property
    def _q(self) -> ca.SX:
        """The coordinates q of `LagrangianFunctions`, in the unknowns."""
        return self.w[self._columns]

    @cached_property
    def _columns(self) -> list[int]:
        """Where in w each of the coordinates q of `LagrangianFunctions` stands."""
        column = self.solver.column
        columns = [column[link, part] for link in self.work.links for part in FRAME_PARTS]
        return columns + [column[pair.name, part] for pair in self.mechanism.pairs for part, _ in pair.coordinate_kinds]

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


class OutputBalance:
    """The balance of weightless links under an effort of one at the pair of an output, `acting` = 0 in z, u and d.

    It is linear in the `unknowns`: the multipliers of the pairs' constraints, where teeth touch the force that drives,
    then the efforts of the inputs.
    """

    def __init__(self, design: DesignEquations, output: Pair):
        elements, motion = constraint_elements(design.mechanism), design.positions
        self.unknowns = ca.SX.sym("l", elements.row_count)
        self._balance = BalanceAtPositions(ForceBalance(elements, motion), motion, self.unknowns.T)
        self.acting = stack_expressions(self._balance.open_rows(effort_actions(motion, "load", output.name, 1.0)))

    def force_on(self, name: str, link: str) -> Vector:
        """The force of a pair on one of its moving links."""
        return self._balance.pair_wrench(name, link)[0]


MAX_NEWTON_STEPS = 20
CLOSED = 1e-10
"""Sizes or rad: by less a limit that is solved for moves in the last step."""


class LimitPoint(NamedTuple):
    """A limit that is solved for: the position of the running input and the output's value there (SI), and how both
    move with the parameters (parameters,)."""

    input: float
    value: float
    input_slopes: Array
    value_slopes: Array


class LimitEquations(NamedTuple):
    """A square system that a limit is solved from: the unknowns x, of which the running input is the last, equations
    and the output's value in x and the parameters t, those of `LimitSystem` and constants; a start, and the numbers
    of t."""

    unknowns: ca.SX
    parameters: ca.SX
    equations: ca.SX
    value: ca.SX
    start: Array
    numbers: Array


class LimitSystem:
    """The equations of one limit of a running input; parameters are the other inputs' positions, then dimensions."""

    def __init__(self, design: DesignEquations, running: str):
        inputs = [driven.pair for driven in design.mechanism.inputs]
        self.design, self.index = design, inputs.index(running)
        self.others = [k for k in range(len(inputs)) if k != self.index]
        self.u = design.u[self.index]
        self.parameters = ca.vertcat(*(design.u[k] for k in self.others), design.d)
        self.names = (
            *(f"{inputs[k]}.position" for k in self.others),
            *(dimension.name for dimension in design.dimensions),
        )
        "of the parameters"

    def dead_point_equations(self, motion: Motion, row: int) -> LimitEquations:
        """The equations where the input turns back near a row: a null vector v of dF/dz with c v = 1 beside F = 0."""
        design = self.design
        v, c = ca.SX.sym("v", design.z.numel()), ca.SX.sym("c", design.z.numel())
        equations = ca.vertcat(design.F, ca.jtimes(design.F, design.z, v), ca.dot(c, v) - 1.0)
        (z, *_), t = design.coordinates_at(motion)
        jacobian = ca.Function("jacobian", [design.z, design.t], [ca.jacobian(design.F, design.z)])
        null = np.linalg.svd(jacobian(z[row], t[row]).full())[2][-1]
        limit = self._limit([design.z, v], equations, self.u, [z[row], null], t[row])
        return limit._replace(parameters=ca.vertcat(limit.parameters, c), numbers=np.concatenate([limit.numbers, null]))

    def turning_point_equations(self, state: State, output: str) -> LimitEquations:
        """The equations where an output, a pair or else a link, turns back near a state: the first rate of F, and of
        the output, both 0 beside F = 0, where the input runs at 1."""
        design = self.design
        value = _first_result(design, state, output)
        unit = ca.DM.zeros(len(self.others) + 1)
        unit[self.index] = 1.0
        rates = ca.substitute(ca.vertcat(design.rates(design.F)[0], design.rates(value)[0]), design.u1, unit)
        z, t = design.coordinates_at(state)
        rate = t[0][len(self.others) + 1 + self.index]
        return self._limit([design.z, design.z1], ca.vertcat(design.F, rates), value, [z[0][0], z[1][0] / rate], t[0])

    def _limit(
        self, unknowns: Sequence[ca.SX], equations: ca.SX, value: ca.SX, start: Sequence[Array], t: Array
    ) -> LimitEquations:
        """The equations of a limit near a start of their unknowns at t (parameters of `DesignEquations`,)."""
        x0 = np.concatenate([*start, [t[self.index]]])
        numbers = np.concatenate([t[self.others], t[3 * (len(self.others) + 1) :]])
        return LimitEquations(ca.vertcat(*unknowns, self.u), self.parameters, equations, value, x0, numbers)

    def solve(self, limit: LimitEquations) -> LimitPoint | None:
        """The limit by Newton's method, with its derivatives; None where there is none so near."""
        unknowns, t, equations, value, start, numbers = limit
        results = ca.vertcat(self.u, value)
        system = ImplicitSystem(unknowns, t, equations, results, range(len(self.names)))
        x = start[None]
        for _ in range(MAX_NEWTON_STEPS):
            previous, (x, _) = x, system.newton(numbers[None], x, 1)
            if not np.isfinite(x).all():
                return None
            if np.abs(x - previous).max() < CLOSED:
                break
        else:
            return None
        by_x, by_parameters, result_by_x, result_by_parameters = (part.full() for part in system.slopes(x[0], numbers))
        inverse, is_singular = invert_matrices(by_x[None])
        slopes = result_by_parameters - result_by_x @ inverse[0] @ by_parameters
        slopes[:, :] = np.nan if is_singular[0] else slopes
        position, result = map(float, system.values(x[0], numbers)[1].full()[:, 0])
        return LimitPoint(position, result, slopes[0], slopes[1])


def _first_result(design: DesignEquations, state: State, output: str) -> ca.SX:
    """What is told first of a pair, else the angle of a link."""
    results = kinematic_results(design.positions, state._point_members, output)
    motions = design.work.relative_motions
    key = next(iter(motions[output].result_kinds)) if output in motions else "angle"
    value: ca.SX = next(named.parts[0] for named in reversed(results) if named.name == key)
    return value


class PositionResult:
    """A result of a mechanism that follows from its position alone. Raises BadInput of any other."""

    def __init__(self, source: State | Motion | Forces, offsets: tuple[str, ...], of: str, result: str):
        refusal = f"guaranteed bands are told of places, angles and lengths, and not of {result!r}"
        if isinstance(source, Forces):
            raise BadInput("guaranteed", refusal)
        self.design = design = design_equations(source.mechanism, offsets)
        results = kinematic_results(design.motion, source._point_members, of)
        self.value = stack_expressions(next(named.parts for named in results if named.name == result))
        rates = ca.vertcat(design.z1, design.z2, design.u1, design.u2)
        if rates.numel() and ca.depends_on(self.value, rates):
            raise BadInput("guaranteed", refusal)
        if design.F.numel() != design.z.numel():
            message = (
                "guaranteed bands are told of mechanisms without redundant constraints, which deviations contradict"
            )
            raise BadInput("guaranteed", message)

    def moving(self, names: Iterable[str]) -> list[str]:
        """Those of the names of t on which it depends."""
        columns = {*ca.jacobian_sparsity(ca.vertcat(self.design.F, self.value), self.design.t).get_col()}
        return [name for name in names if self.design.names.index(name) in columns]

    def over_boxes(self, columns: list[int]) -> ParametricSystem:
        """The equations with the result, where some columns of t vary. Raises BadInput."""
        return ParametricSystem(self.design.z, self.design.t, self.design.F, self.value, columns)


def dead_points_over_boxes(design: DesignEquations) -> ParametricSystem:
    """F(z, t + f e) = 0, F_z v = 0 and c v = 1: for z, v and the factor f, over t, e and c."""
    v, factor = ca.SX.sym("v", design.z.numel()), ca.SX.sym("factor")
    e, c = ca.SX.sym("e", design.t.numel()), ca.SX.sym("c", design.z.numel())
    both = ca.Function("both", [design.z, design.t, v], [design.F, ca.jtimes(design.F, design.z, v)])
    residual = ca.vertcat(*both(design.z, design.t + factor * e, v), ca.dot(c, v) - 1.0)
    return ParametricSystem(ca.vertcat(design.z, v, factor), ca.vertcat(design.t, e, c), residual, ca.SX(0, 1), ())


def fold_function(design: DesignEquations) -> BufferedFunction:
    """(z, t, v) -> F_z, F_t and F_zz v v, by which two assemblies meet."""
    v = ca.SX.sym("v", design.z.numel())
    curvature = ca.jtimes(ca.jtimes(design.F, design.z, v), design.z, v)
    slopes = [ca.densify(ca.jacobian(design.F, variable)) for variable in (design.z, design.t)]
    return BufferedFunction(ca.Function("fold", [design.z, design.t, v], [*slopes, ca.densify(curvature)]))
