"""The equations of the position of least misfit, of constraints that are held more than once and do not quite agree.

An eliminated row leaves its misfit, which is an unknown; one that remains has for a misfit its residual. The weighed
sum of their squares is least where its derivatives by all unknowns vanish (C. F. Gauss, Theoria combinationis 1823); a
row that has to close, as an input's, has a multiplier (J.-L. Lagrange). Angles count as arcs at the mechanism's size.
"""

from __future__ import annotations

from collections.abc import Mapping

import casadi as ca

from planar.equations.coordinates import Coordinate
from planar.equations.elimination import expression_unknowns, stack_expressions
from planar.equations.residuals import ConstraintRow
from planar.equations.symbolic_equations import ConstraintEquations, ConstraintExpressions, EliminatedStructure
from planar.model.pairs import MeasureKind

HELD, UNRELATED = -1, -2
"""Rows that are no derivatives of the sum of squares of misfits: that have to close beside it, and the rest."""


def least_misfit_equations(
    structure: EliminatedStructure, expressions: ConstraintExpressions, misfits: Mapping[int, ca.SX]
) -> ConstraintEquations:
    """Equations whose rows may stay open by their misfits, made those of the position of least misfit.

    F first has the derivatives by the unknowns that misfits move, by the misfits of rows that were eliminated, and of
    multipliers the rows that are held; then the rows that are unrelated to misfits. w has the misfits of all rows and
    the multipliers behind it, p what the squares count.
    """
    z, u, p, w, F = expressions
    rows, last_rows, unknowns = structure.rows, structure.remaining_rows, structure.unknowns
    remaining = [misfits[row] for row in last_rows if row in misfits]
    if remaining:
        F, w = ca.substitute([F, w], [stack_expressions(remaining)], [ca.SX.zeros(len(remaining))])
    loose = {column for group in structure.groups if misfits.keys() & set(group.rows) for column in group.columns}
    tied = [k for k, column in enumerate(unknowns) if column in loose]
    untied = [k for k in range(len(unknowns)) if k not in {*tied}]
    touched = expression_unknowns(F, z)
    # a row that must close is held where it rests on unknowns that the misfits move, and on these alone
    closing = [k for k, row in enumerate(last_rows) if row not in misfits]
    closing_rows = [k for k in closing if touched[k] and touched[k] <= {*tied}]
    unrelated = [k for k in closing if k not in closing_rows]
    residual_of = {row: F[k] for k, row in enumerate(last_rows)}
    free = [row for row in misfits if row not in residual_of]
    multipliers = [ca.SX.sym(f"multiplier {k}") for k in closing_rows]
    weights = stack_expressions(ca.SX.sym(f"weight {row}") for row in misfits)
    values = stack_expressions(residual_of.get(row, symbol) for row, symbol in misfits.items())
    moved = stack_expressions([*(z[k] for k in tied), *(misfits[row] for row in free), *multipliers])
    # J^T W r by itself: the derivative of a sum of squares would take the squares first
    slope = ca.jtimes(values, moved, weights * values, True)
    if closing_rows:
        residuals = stack_expressions(F[k] for k in closing_rows)
        slope += ca.jtimes(residuals, moved, stack_expressions(multipliers), True)
        slope = ca.vertcat(slope[: -len(closing_rows)], residuals)
    first = len(structure.coordinates)
    added = [Coordinate(rows[row].pair, f"misfit {row}", rows[row].kind, False) for row in misfits]
    added += [Coordinate(rows[last_rows[k]].pair, "multiplier", MeasureKind.LENGTH, False) for k in closing_rows]
    column_of = {row: first + k for k, row in enumerate(misfits)}
    names = [rows[row].pair for row in last_rows if row in misfits] or [rows[row].pair for row in misfits]
    labels = [ConstraintRow(names[k % len(names)], MeasureKind.ANGLE) for k in range(len(tied))]
    labels += [rows[row] for row in free]
    labels += [rows[last_rows[k]] for k in (*closing_rows, *unrelated)]
    variables = [*(unknowns[k] for k in tied), *(column_of[row] for row in free)]
    multiplier_columns = range(first + len(misfits), first + len(added))
    with_misfits = ConstraintExpressions(
        ca.vertcat(moved, *(z[k] for k in untied)),
        u,
        ca.vertcat(p, weights),
        ca.vertcat(w, values, *multipliers),
        ca.vertcat(slope, *(F[k] for k in unrelated)),
    )
    return ConstraintEquations(
        coordinates=(*structure.coordinates, *added),
        unknowns=(*variables, *multiplier_columns, *(unknowns[k] for k in untied)),
        rows=tuple(labels),
        blocks=(),
        known_after_block=(),
        input_kinds=structure.input_kinds,
        make_expressions=lambda: with_misfits,
        open_rows=tuple(misfits),
        misfit_columns=tuple(column_of.values()),
        row_variables=(*variables, *([HELD] * len(closing_rows)), *([UNRELATED] * len(unrelated))),
    )
