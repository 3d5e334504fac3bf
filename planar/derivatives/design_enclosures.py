"""A mechanism's equations over boxes of its inputs and dimensions: of results of positions, and of its dead points."""

from __future__ import annotations

from collections.abc import Iterable

import casadi as ca

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.enclosures import ParametricSystem
from planar.derivatives.kinematic_slopes import kinematic_results
from planar.dynamics.forces import Forces
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.foundation.errors import BadInput
from planar.results.motion import Motion, State


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
