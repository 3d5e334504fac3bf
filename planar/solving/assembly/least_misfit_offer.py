"""What a linkage that is held more than once, and does not close, is offered: the position of its least misfit."""

from __future__ import annotations

from dataclasses import replace
from math import floor, log10

from planar.foundation.units import parse_unit
from planar.model.mechanism import Mechanism
from planar.model.wording import amount
from planar.solving.assembly.least_misfit import find_least_misfit
from planar.solving.assembly.nearest_assembly import AssemblySearchFailure
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_OFFERED_RATIO = 0.02
"""Of the mechanism's size: lengths that are rounded leave less open than that."""
ROUND_NUMBERS = (1, 2, 5, 10)


def offer_least_misfit(mechanism: Mechanism) -> str:
    """By how much the pair that is open most is open at least, and what to write to go on with that; empty where it is
    more than rounding of lengths leaves."""
    exact = PreparedMechanism(replace(mechanism, closes_within=None))
    most = MAX_OFFERED_RATIO * exact.unit
    solver = PreparedMechanism(replace(mechanism, closes_within=most))
    if not solver.equations.open_rows:
        return ""
    found = find_least_misfit(solver, exact)
    if isinstance(found, AssemblySearchFailure):
        return ""
    misfits = {name: float(each[0]) for name, each in solver.pair_misfits(found.z[None], solver.inputs.u[None]).items()}
    worst = max(misfits, key=lambda name: misfits[name])
    if not misfits[worst] <= most:
        return ""
    unit = parse_unit(mechanism.units.length)
    return (
        f"the links are held more than once, with a misfit of {amount(misfits[worst], 'length', mechanism.units)} "
        f'at pair {worst!r} at the least: "closes_within": "{_round_up(unit.from_si(misfits[worst])):.6g} '
        f'{mechanism.units.length}" would take that position'
    )


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, ... above a number, with room for other positions."""
    decade = 10.0 ** floor(log10(value))
    return next(step * decade for step in (*ROUND_NUMBERS, 20) if step * decade >= 1.2 * value)
