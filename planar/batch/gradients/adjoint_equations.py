"""The adjoint of one position as expressions: a weighed sum of what a run tells, derived in the numbers that it takes.

With positions F(z, u, p) = 0, and F' = 0 and F'' = 0 for the rates z' and z'' of the unknowns, and the weighed sum
S(z, z', z'', u, u', u'', q), the multipliers of the levels solve, the last one first,

    A^T l2 = dS/dz''    A^T l1 = d(S - l2 F'')/dz'    A^T l0 = d(S - l2 F'' - l1 F')/dz    with A = dF/dz

and the derivatives are those of S - l2 F'' - l1 F' - l0 F in p, q, u, u' and u'' (A. Griewank, A. Walther, Evaluating
Derivatives, SIAM 2008, ch. 15). A has blocks below its diagonal alone, so that each is solved by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca

from planar.batch.march.kernel import KernelInstructions
from planar.equations.linear import solve_by_determinants
from planar.equations.rates import block_jacobian, time_derivatives
from planar.equations.symbolic_equations import ConstraintEquations, slice_length


class WeighedRow(NamedTuple):
    """Of what order of a point (0: its position), by its number among the kernel's, a sum takes x and y."""

    order: int
    point: int


class Adjoint(NamedTuple):
    """A weighed sum (sizes, s) and its derivatives, as expressions; those in rates are empty where none are told."""

    value: ca.SX
    in_numbers: ca.SX
    in_points: ca.SX
    in_inputs: ca.SX
    in_input_rates: ca.SX

    @property
    def outputs(self) -> list[ca.SX]:
        """All of them."""
        return list(self)


def adjoint_expressions(kernel: KernelInstructions, weighed: Sequence[WeighedRow], weights: ca.SX) -> Adjoint:
    """The adjoint of rows with weights (2 rows,), in the symbols of a kernel's instructions."""
    e, s = kernel.equations.equations, kernel.symbols
    depth = 1 + max(row.order for row in weighed)
    y = [e.y, ca.vertcat(s["z1"], s["u1"]), ca.vertcat(s["z2"], s["u2"])][:depth]
    orders = _with_rates(kernel.point_coordinates(range(len(kernel.links))), y)
    told = ca.vertcat(*(orders[row.order][2 * row.point : 2 * row.point + 2] for row in weighed))
    value = ca.dot(weights, told)
    levels, unknowns = _with_rates(e.F, y), [s["z"], s["z1"], s["z2"]][:depth]
    rest, names, values = value, [], []
    for level, unknown in reversed(list(zip(levels, unknowns, strict=True))):
        multipliers = ca.SX.sym("l", e.z.numel())
        names.append(multipliers)
        values.append(_solve_transposed(e, ca.gradient(rest, unknown)))
        rest = rest - ca.dot(multipliers, level)
    rates = ca.vertcat(s["u1"], s["u2"]) if depth > 1 else ca.SX(0, 1)
    slopes = [ca.gradient(rest, of) for of in (s["p"], s["q"], e.u, rates)]
    known: list[ca.SX] = []
    if depth > 1:
        known = list(kernel.equations.rates(s["u1"], s["u2"]))[: depth - 1]
    # rates first, then the multipliers, each of which the later ones take
    every = [*unknowns[1:], *names]
    found = ca.substitute_inplace(every, [*known, *values], [value, *slopes])[1]
    return Adjoint(*found)


def _with_rates(value: ca.SX, y: Sequence[ca.SX]) -> list[ca.SX]:
    """What is made of y, and its rates, as many as y has."""
    return [value, *time_derivatives(value, *y)] if len(y) > 1 else [value]


def _solve_transposed(e: ConstraintEquations, right_side: ca.SX) -> ca.SX:
    """The Jacobian's transposed inverse times a right side, from the last block to the first."""
    found = ca.SX.zeros(e.z.numel())
    for block in reversed(e.blocks):
        if slice_length(block.unknowns):
            later = slice(block.rows.stop, e.F.numel())
            known = right_side[block.unknowns]
            if later.start < later.stop:
                known = known - ca.jtimes(e.F[later], e.z[block.unknowns], found[later], True)
            own = block_jacobian(e, block.rows, block.unknowns)
            found[block.rows] = solve_by_determinants(own.T, ca.densify(known))
    return found
