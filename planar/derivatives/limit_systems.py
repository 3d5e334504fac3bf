"""Where a running input turns back, and where an output does, as equations of which the input itself is an unknown."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations
from planar.derivatives.result_expressions import kinematic_expressions
from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array
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
    and the output's value in x, the parameters of `LimitSystem` and constants; a start, and the numbers of both."""

    unknowns: ca.SX
    equations: ca.SX
    value: ca.SX
    constants: ca.SX
    start: Array
    numbers: Array
    known: Array


class LimitSystem:
    """The equations of one limit of a running input; parameters are the other inputs' positions, then dimensions."""

    def __init__(self, design: DesignEquations, running: str):
        inputs = [given.pair for given in design.mechanism.inputs]
        self.design, self.index = design, inputs.index(running)
        self.others = [k for k in range(len(inputs)) if k != self.index]
        self.u = design.u[self.index]
        self.parameters = ca.vertcat(*(design.u[k] for k in self.others), design.d)
        self.names = (
            *(f"{inputs[k]}.position" for k in self.others),
            *(each.name for each in design.dimensions),
        )
        "of the parameters"

    def dead_point(self, motion: Motion, row: int) -> LimitPoint | None:
        """Where the input turns back near a row."""
        return self._solve(self.dead_point_equations(motion, row))

    def turning_point(self, state: State, output: str) -> LimitPoint | None:
        """Where an output, a pair or else a link, turns back near a state."""
        return self._solve(self.turning_point_equations(state, output))

    def dead_point_equations(self, motion: Motion, row: int) -> LimitEquations:
        """A null vector v of dF/dz with c v = 1 beside F = 0."""
        design = self.design
        v, c = ca.SX.sym("v", design.z.numel()), ca.SX.sym("c", design.z.numel())
        equations = ca.vertcat(design.F, ca.jtimes(design.F, design.z, v), ca.dot(c, v) - 1.0)
        (z, *_), t = design.coordinates_at(motion)
        slope = ca.Function("slope", [design.z, design.t], [ca.jacobian(design.F, design.z)])(z[row], t[row]).full()
        null = np.linalg.svd(slope)[2][-1]
        return self._of_limit([design.z, v], equations, self.u, [z[row], null], t[row], c, null)

    def turning_point_equations(self, state: State, output: str) -> LimitEquations:
        """The first rate of F, and of the output, both 0 beside F = 0, where the input runs at 1."""
        design = self.design
        first = _first_result(design, state, output)
        rates = ca.substitute(ca.vertcat(*design.rates(design.F)[:1], *design.rates(first)[:1]), design.u1, self._unit)
        z, t = design.coordinates_at(state)
        rate = t[0][len(self.others) + 1 + self.index]
        equations = ca.vertcat(design.F, rates)
        return self._of_limit([design.z, design.z1], equations, first, [z[0][0], z[1][0] / rate], t[0])

    @property
    def _unit(self) -> ca.DM:
        unit = ca.DM.zeros(len(self.others) + 1)
        unit[self.index] = 1.0
        return unit

    def _of_limit(  # many: a square system, what it tells, and where it is solved from
        self,
        unknowns: Sequence[ca.SX],
        equations: ca.SX,
        value: ca.SX,
        start: Sequence[Array],
        t: Array,
        constants: ca.SX | None = None,
        known: Array | None = None,
    ) -> LimitEquations:
        x = ca.vertcat(*unknowns, self.u)
        held = ca.SX(0, 1) if constants is None else constants
        here = np.concatenate([*start, [t[self.index]]])
        numbers = np.concatenate([t[self.others], t[3 * (len(self.others) + 1) :]])
        return LimitEquations(x, equations, value, held, here, numbers, np.zeros(0) if known is None else known)

    def _solve(self, limit: LimitEquations) -> LimitPoint | None:
        """The limit by Newton's method, with its derivatives; None where there is none so near."""
        x, equations, value, held, here, numbers, kept = limit
        given = [x, self.parameters, held]
        step = BufferedFunction(ca.Function("limit", given, [ca.densify(ca.jacobian(equations, x)), equations]))
        for _ in range(MAX_NEWTON_STEPS):
            slopes, open_by = step.evaluate_batch(1, here[None], numbers[None], kept[None])
            inverse, is_singular = invert_matrices(slopes.transpose(0, 2, 1))
            change = (inverse @ open_by.transpose(0, 2, 1))[0, :, 0]
            here = here - change
            if is_singular[0] or not np.isfinite(here).all():
                return None
            if np.abs(change).max() < CLOSED:
                break
        else:
            return None
        results = ca.vertcat(self.u, value)
        jacobians = [ca.jacobian(of, by) for of in (equations, results) for by in (x, self.parameters)]
        linear = ca.Function("linear", given, [ca.densify(output) for output in (*jacobians, value)])
        by_x, by_parameters, result_by_x, result_by_parameters, at = (
            part.full() for part in linear(here, numbers, kept)
        )
        inverse, is_singular = invert_matrices(by_x[None])
        slopes = result_by_parameters - result_by_x @ inverse[0] @ by_parameters
        slopes[:, :] = np.nan if is_singular[0] else slopes
        return LimitPoint(float(here[-1]), float(at[0, 0]), slopes[0], slopes[1])


def _first_result(design: DesignEquations, state: State, output: str) -> ca.SX:
    """What is told first of a pair, else the angle of a link."""
    found = list(kinematic_expressions(design, state, output))
    motions = design.work.relative_motions
    key = next(iter(motions[output].result_kinds)) if output in motions else "angle"
    return next(each.value for each in reversed(found) if each.name == key)
