"""The motion of a block type: its coordinates with their rates, and how regular it is, as one formula."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca
import numpy as np

from planar.equations.block_regularity import regular_distance, regularity_bound
from planar.equations.elimination import stack_expressions
from planar.equations.generic_evaluation import recorded_function
from planar.equations.rates import UnknownRates, first_and_second_rates
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.recorded_formula import RecordedFormula

MAX_CSE_NODES = 30_000
"""Of expressions in which what stands in several places is looked for: the time for that grows faster than they do, and
what it saves is little."""


def derive_block_motion(e: ConstraintEquations) -> RecordedFormula:
    """The formula of equations that are one block, of which u are the coordinates that are known ahead.

    (z, u, u1, u2, p, row scale, column floor) -> w, w1, w2, F, then the regularity (`solving.rates.regularity`) and the
    least singular value, no more than they are, by how much round-off is greater in the rates, and how far in such
    steps as u1 the block is regular, with the sign of its determinant.
    """
    u1, u2 = (ca.SX.sym(name, e.u.numel()) for name in ("u1", "u2"))
    row_scale, column_floor = ca.SX.sym("by", e.F.numel()), ca.SX.sym("least", e.z.numel())
    rates = UnknownRates(e)
    z1, z2 = rates.first_and_second(u1, u2)
    w1, w2 = first_and_second_rates(e.w, rates.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))
    regularity, least, loss, distance = ca.SX(1.0), ca.SX(1.0), ca.SX(1.0), ca.SX(np.inf)
    if e.z.numel():
        (jacobian,) = rates.jacobians
        regularity = ca.fmin(regularity, regularity_bound(jacobian, row_scale, column_floor))
        for k in range(jacobian.size2()):
            loss = ca.fmax(loss, 1.0 / (ca.norm_2(jacobian[:, k]) * regularity * regularity))
        least, distance = regular_distance(jacobian, rates.y, ca.vertcat(z1, u1))
    wanted = stack_expressions([e.w, w1, w2, e.F, regularity, ca.fmin(least, 1.0), loss, distance])
    return recorded_function(
        function_with_cse("motion", [e.z, e.u, u1, u2, e.p, row_scale, column_floor], [ca.densify(wanted)])
    )


def function_with_cse(name: str, given: Sequence[ca.SX], wanted: Sequence[ca.SX]) -> ca.Function:
    """A function in which what stands in several places is computed once, as far as it is not too long."""
    is_short = sum(ca.n_nodes(each) for each in wanted) <= MAX_CSE_NODES
    return ca.Function(name, given, ca.cse(list(wanted)) if is_short else list(wanted))
