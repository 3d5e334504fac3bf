"""Systems of equations of a design: its positions and dead points over boxes, and where an input or output turns back.

Where a running input turns back, and where an output does, the input itself is an unknown.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.enclosures import ParametricSystem
from planar.derivatives.kinematic_slopes import kinematic_results
from planar.dynamics.forces import Forces
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.generalised_inverses import invert_matrices
from planar.results.motion import Motion, State

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
        x, t, equations, value, position, numbers = limit
        step = BufferedFunction(ca.Function("limit", [x, t], [ca.densify(ca.jacobian(equations, x)), equations]))
        for _ in range(MAX_NEWTON_STEPS):
            jacobian, residual = step.evaluate_batch(1, position[None], numbers[None])
            inverse, is_singular = invert_matrices(jacobian.transpose(0, 2, 1))
            change = (inverse @ residual.transpose(0, 2, 1))[0, :, 0]
            position = position - change
            if is_singular[0] or not np.isfinite(position).all():
                return None
            if np.abs(change).max() < CLOSED:
                break
        else:
            return None
        results = ca.vertcat(self.u, value)
        jacobians = [ca.jacobian(of, by) for of in (equations, results) for by in (x, self.parameters)]
        linear = ca.Function("linear", [x, t], [ca.densify(output) for output in (*jacobians, value)])
        by_x, by_parameters, result_by_x, result_by_parameters, result = (
            part.full() for part in linear(position, numbers)
        )
        inverse, is_singular = invert_matrices(by_x[None])
        slopes = result_by_parameters - result_by_x @ inverse[0] @ by_parameters
        slopes[:, :] = np.nan if is_singular[0] else slopes
        return LimitPoint(float(position[-1]), float(result[0, 0]), slopes[0], slopes[1])


def _first_result(design: DesignEquations, state: State, output: str) -> ca.SX:
    """What is told first of a pair, else the angle of a link."""
    results = kinematic_results(design.motion, state._point_members, output)
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
