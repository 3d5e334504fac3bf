"""The assembly of least misfit of a linkage that is held more than once, by lengths that do not quite agree.

Gauss and Newton's method finds it block by block in what elimination leaves, where misfits are those of a few pairs
alone; from there Newton's method shares them among all pairs, so that the weighed sum of their squares is least.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.misfit_refusals import misfit_beyond, not_least_misfit
from planar.solving.assembly.nearest_assembly import Assembly, AssemblySearchFailure, find_nearest_assembly
from planar.solving.checks.singular_values import MIN_REGULARITY
from planar.solving.newton import correct, shortest_step
from planar.solving.prepared_mechanism import PreparedMechanism

SEARCH_RATIO = 10.0
"""By how many times the misfit that may be told a few pairs may be open before it is shared among all."""
MAX_CORRECTIONS = 30
SHARED_TOLERANCE = 1e-11
"""Sizes: by how much what is least may be missed; the residual check asks for more afterwards."""


def find_least_misfit(
    solver: PreparedMechanism, exact: PreparedMechanism, is_regular: Callable[[Array], bool] | None = None
) -> Assembly | AssemblySearchFailure:
    """The assembly nearest to the sketch, whatever its misfit, or where no such assembly is found.

    `exact` is the same mechanism without a misfit, `is_regular` says of its unknowns whether they are determined.
    """
    within = solver.mechanism.closes_within or 0.0
    search = BlockAssemblies(exact, SEARCH_RATIO * within / solver.unit)
    found = find_nearest_assembly(search, is_regular)
    if isinstance(found, AssemblySearchFailure):
        return found
    w = exact.functions.coordinates(found.z, exact.inputs.u, exact.inputs.p)
    start = np.zeros(len(solver.equations.coordinates))
    start[: len(w)] = w
    s = solver.inputs

    def here(z: Array) -> tuple[Array, Array]:
        left, slope = solver.functions.residuals_and_jacobian(z, s.u, s.p)
        return left, slope[:, : len(z)]

    z, gap = correct(here, shortest_step(MIN_REGULARITY**2), start[list(solver.equations.unknowns)], MAX_CORRECTIONS)
    if gap > SHARED_TOLERANCE:
        return AssemblySearchFailure(exact.equations.blocks[0], found.z)
    return Assembly(z)


def refuse_misfit(solver: PreparedMechanism, z: Array, u: Array) -> None:
    """Raise NoAnswer where a pair is open by more than may be, at unknowns z (unknowns,) and inputs u."""
    refusal = misfit_refusal(solver, z[None], u[None], 0)
    if refusal is not None:
        raise refusal


def misfit_refusal(solver: PreparedMechanism, z: Array, u: Array, row: int) -> NoAnswer | None:
    """What to say of a row of samples at which a pair is open by more than may be; None where none is."""
    misfits = {name: float(each[row]) for name, each in solver.pair_misfits(z, u).items()}
    worst = max(misfits, key=lambda name: misfits[name])
    within = solver.mechanism.closes_within
    if not solver.is_least_misfit(z[row : row + 1], u[row : row + 1])[0]:
        return not_least_misfit(worst, f"at {solver.describe_inputs(u[row])}")
    if within is None or misfits[worst] <= within:
        return None
    return misfit_beyond(solver, worst, misfits[worst], f"at {solver.describe_inputs(u[row])}")
