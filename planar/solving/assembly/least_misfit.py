"""The assembly of least misfit of a linkage that is held more than once, by lengths that do not quite agree.

Gauss and Newton's method finds it block by block in what elimination leaves, where misfits are those of a few pairs
alone; from there Newton's method shares them among all pairs, so that the weighed sum of their squares is least.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import floor, log10

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.units import parse_unit
from planar.model.mechanism import Mechanism
from planar.model.wording import amount
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.nearest_assembly import Assembly, AssemblySearchFailure, find_nearest_assembly
from planar.solving.checks import MIN_REGULARITY
from planar.solving.newton import correct_position
from planar.solving.prepared_mechanism import PreparedMechanism

SEARCH_RATIO = 10.0
"""By how many times the allowed misfit a few pairs may be open before it is shared among all."""
MAX_CORRECTIONS = 30
SHARED_TOLERANCE = 1e-11
"""Sizes: by how much what is least may be missed; the residual check asks for more afterwards."""
MAX_OFFERED_RATIO = 0.02
"""Of the mechanism's size: lengths that are rounded leave less open than that."""


def find_least_misfit(
    solver: PreparedMechanism, exact: PreparedMechanism, is_regular: Callable[[Array], bool] | None = None
) -> Assembly | AssemblySearchFailure:
    """The assembly nearest to the sketch, whatever its misfit, or where no such assembly is found.

    `exact` is the same mechanism without a misfit, `is_regular` says of its unknowns whether they are determined.
    """
    within = solver.mechanism.closes_within or 0.0
    assembly = find_nearest_assembly(BlockAssemblies(exact, SEARCH_RATIO * within / solver.unit), is_regular)
    if isinstance(assembly, AssemblySearchFailure):
        return assembly
    w = exact.functions.coordinates(assembly.z, exact.inputs.u, exact.inputs.p)
    start = np.zeros(len(solver.equations.coordinates))
    start[: len(w)] = w
    start, s = start[list(solver.equations.unknowns)], solver.inputs
    z, gap = correct_position(solver.functions, (start, s.u, s.p), len(start), MIN_REGULARITY**2, MAX_CORRECTIONS)
    if gap > SHARED_TOLERANCE:
        return AssemblySearchFailure(exact.equations.blocks[0], assembly.z)
    return Assembly(z[: len(start)])


def refuse_misfit(solver: PreparedMechanism, z: Array, u: Array) -> None:
    """Raise NoAnswer where a pair is open by more than may be, at unknowns z (unknowns,) and inputs u."""
    refusal = misfit_refusal(solver, z, u)
    if refusal is not None:
        raise refusal


def misfit_refusal(solver: PreparedMechanism, z: Array, u: Array) -> NoAnswer | None:
    """Why a position is refused whose misfit is not the least, or at which a pair is open by more than may be."""
    pair, misfit = _worst_misfit(solver, z, u)
    place, within, units = f"at {solver.describe_inputs(u)}", solver.mechanism.closes_within, solver.mechanism.units
    if not solver.is_least_misfit(z[None], u[None])[0]:
        return NoAnswer(
            Outcome.CHANGE_POINT,
            f"{place} the misfits, as that of pair {pair!r}, balance but are not the least: the links give way to one "
            "side or the other, as beside a change point; move the input, or give lengths that agree",
        )
    if within is None or misfit <= within:
        return None
    return NoAnswer(
        Outcome.CANNOT_BE_ASSEMBLED,
        f"{place} the least misfit leaves pair {pair!r} open by {amount(misfit, 'length', units)}, beyond the "
        f"{amount(within, 'length', units)} of `closes_within`; change a length, or let it be more",
    )


def _worst_misfit(solver: PreparedMechanism, z: Array, u: Array) -> tuple[str, float]:
    """The pair that is open most, and by how much (m)."""
    misfits = {name: float(rows[0]) for name, rows in solver.pair_misfits(z[None], u[None]).items()}
    worst = max(misfits, key=lambda name: misfits[name])
    return worst, misfits[worst]


def offer_least_misfit(mechanism: Mechanism) -> str:
    """The least misfit of the pair that is open most, and what to write to go on with it; empty where it is more than
    rounding of lengths leaves."""
    exact = PreparedMechanism(replace(mechanism, closes_within=None))
    maximum = MAX_OFFERED_RATIO * exact.unit
    solver = PreparedMechanism(replace(mechanism, closes_within=maximum))
    if not solver.equations.open_rows:
        return ""
    assembly = find_least_misfit(solver, exact)
    if isinstance(assembly, AssemblySearchFailure):
        return ""
    pair, misfit = _worst_misfit(solver, assembly.z, solver.inputs.u)
    if not misfit <= maximum:
        return ""
    unit = parse_unit(mechanism.units.length)
    return (
        f"the links are held more than once, with a misfit of {amount(misfit, 'length', mechanism.units)} "
        f'at pair {pair!r} at the least: "closes_within": "{_round_up(unit.from_si(misfit)):.6g} '
        f'{mechanism.units.length}" would take that position'
    )


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20 times a power of ten above a number, with room for other positions."""
    decade = 10.0 ** floor(log10(value))
    return next(step * decade for step in (1, 2, 5, 10, 20) if step * decade >= 1.2 * value)
