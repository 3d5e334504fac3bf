"""The equations of the position of least misfit, of constraints that are held more than once and do not quite agree.

An eliminated row leaves its misfit, which is an unknown; one that remains has for a misfit its residual. The weighed
sum of their squares is least where its derivatives by all unknowns vanish (C. F. Gauss, Theoria combinationis 1823); a
row that has to close, as an input's, has a multiplier (J.-L. Lagrange). Angles count as arcs at the mechanism's size.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca

from planar.equations.elimination import expression_unknowns, stack_expressions

HELD, UNRELATED = -1, -2
"""Rows that are no derivatives of the sum of squares of misfits: that have to close beside it, and the rest."""


class LeastMisfitEquations(NamedTuple):
    """F first has the derivatives by the `unknowns`: those that misfits move, the misfits of the rows `free`, and of
    multipliers the rows `held`, by their places among those left, then the rows `unrelated`. w has the misfits of all
    rows and the multipliers behind it; `weights` are the symbols of what the squares count."""

    F: ca.SX
    w: ca.SX
    unknowns: ca.SX
    weights: ca.SX
    free: tuple[int, ...]
    held: tuple[int, ...]
    unrelated: tuple[int, ...]


def least_misfit_equations(
    every: ca.SX, z: ca.SX, left: Sequence[int], misfits: Mapping[int, ca.SX], tied: Sequence[int]
) -> LeastMisfitEquations:
    """Of the rows that elimination leaves, by their numbers `left`, and w below them, in z and symbols of misfits."""
    remaining = [misfits[row] for row in left if row in misfits]
    if remaining:
        every = ca.substitute(every, stack_expressions(remaining), ca.SX.zeros(len(remaining)))
    F, w = every[: len(left)], every[len(left) :]
    own = {row: F[k] for k, row in enumerate(left)}
    touched = expression_unknowns(F, z)
    # a row that must close is held where it rests on unknowns that the misfits move, and on these alone
    held = tuple(k for k, row in enumerate(left) if row not in misfits and touched[k] and touched[k] <= {*tied})
    free = tuple(row for row in misfits if row not in own)
    multipliers = [ca.SX.sym(f"multiplier {k}") for k in held]
    weights = stack_expressions(ca.SX.sym(f"weight {row}") for row in misfits)
    values = stack_expressions(own.get(row, symbol) for row, symbol in misfits.items())
    unknowns = stack_expressions([*(z[k] for k in tied), *(misfits[row] for row in free), *multipliers])
    # J^T W r by itself: the derivative of a sum of squares would take the squares first
    slope = ca.jtimes(values, unknowns, weights * values, True)
    if held:
        closing = stack_expressions(F[k] for k in held)
        slope += ca.jtimes(closing, unknowns, stack_expressions(multipliers), True)
        slope = ca.vertcat(slope[: -len(held)], closing)
    unrelated = tuple(k for k, row in enumerate(left) if row not in misfits and k not in held)
    return LeastMisfitEquations(
        ca.vertcat(slope, *(F[k] for k in unrelated)),
        ca.vertcat(w, values, *multipliers),
        unknowns,
        weights,
        free,
        held,
        unrelated,
    )
