"""Linear objectives over second-order cones: the one place that calls the conic solver."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput

NEEDS_SOLVER = 'counterweights, and what bodies can balance, need clarabel: pip install "planar-linkages[balance]"'
TOLERANCES = (1e-11, 1e-9, 1e-7)
"""The relative gap, and what constraints may be off by, that the solver is asked for, one after the other where it does
not get there: what it finds is judged by its user."""
SOLVED, INFEASIBLE = ("Solved", "AlmostSolved"), ("PrimalInfeasible", "AlmostPrimalInfeasible")
"""The solver's words."""


class ConeBlock(NamedTuple):
    """Numbers `matrix` (rows, variables) x + `offset` (rows,) that lie in a cone.

    "zero": all are zero; "nonnegative": none is below zero; "second-order": in groups of `group` rows, the first is at
    least the length of the others.
    """

    cone: Literal["zero", "nonnegative", "second-order"]
    matrix: Array
    offset: Array
    group: int = 1


class ConeSolution(NamedTuple):
    """Variables of least objective (variables,), and the multipliers of every block in their order.

    `is_solved` is False where there are none (`is_infeasible`; the multipliers then prove that), or the solver did not
    get there; `status` is its word.
    """

    x: Array
    multipliers: tuple[Array, ...]
    is_solved: bool
    is_infeasible: bool
    status: str


def solve_cone_program(objective: Array, blocks: Sequence[ConeBlock]) -> ConeSolution:
    """The least objective @ x with every block in its cone (Clarabel: an interior point method; P. J. Goulart and Y.
    Chen, 2024). Raises BadInput where the solver is not installed."""
    try:
        import clarabel
    except ImportError:
        raise BadInput("clarabel", NEEDS_SOLVER) from None
    from scipy.sparse import csc_matrix

    cones: list[object] = []
    for block in blocks:
        rows = len(block.offset)
        if block.cone == "zero":
            cones.append(clarabel.ZeroConeT(rows))
        elif block.cone == "nonnegative":
            cones.append(clarabel.NonnegativeConeT(rows))
        else:
            cones += [clarabel.SecondOrderConeT(block.group)] * (rows // block.group)
    many = len(objective)
    given = (
        csc_matrix((many, many)),
        objective,
        csc_matrix(-np.concatenate([block.matrix for block in blocks])),
        np.concatenate([block.offset for block in blocks]),
        cones,
    )
    for tolerance in TOLERANCES:
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        settings.max_threads = 1
        settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = tolerance
        found = clarabel.DefaultSolver(*given, settings).solve()
        status = str(found.status)
        if status in SOLVED or status in INFEASIBLE:
            break
    ends = np.cumsum([len(block.offset) for block in blocks])[:-1]
    multipliers = tuple(np.split(np.array(found.z), ends))
    return ConeSolution(np.array(found.x), multipliers, status in SOLVED, status in INFEASIBLE, status)
