"""The size of a load that holds a mechanism, as facts for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.analysis.efforts.unknown_load import UnknownLoad
from planar.dynamics.forces import Forces
from planar.reports.number_format import format_number, format_quantity, quantity_text


def unknown_load_facts(forces: Forces, found: UnknownLoad) -> Iterator[tuple[str, str]]:
    """What the load has to be, at the position or over the motion."""
    units, kind = forces.mechanism.units, _size_kind(forces, found)
    effort = "force" if forces.is_force_input(found.input) else "torque"
    holds = f"{found.input!r} supplies {quantity_text(found.effort, effort, units)}"
    factor = np.atleast_1d(np.asarray(found.factor))
    known = factor[np.isfinite(factor)]
    one = f"a {found.what} of {quantity_text(found.best * found.value, kind, units)}"
    times = f"{format_number(found.best)} times what the file says"
    if len(factor) == 1:
        yield found.load, f"{holds} with {one}, {times}"
        return
    if found.is_constant:
        yield found.load, f"{holds} all over the motion with {one}, {times}"
        return
    low = format_quantity(float(known.min()) * found.value, kind, units)
    high = quantity_text(float(known.max()) * found.value, kind, units)
    yield found.load, f"{holds} with a {found.what} from {low} to {high} over the motion"
    yield "", f"{one}, {times}, comes nearest: it leaves up to {quantity_text(found.left, effort, units)}"


def _size_kind(forces: Forces, found: UnknownLoad) -> str:
    """Which kind of quantity the size of the load is."""
    springs = forces.mechanism.springs
    is_torsional = found.what == "stiffness" and springs[int(found.load.rpartition(".")[2])].is_torsional
    return "torsional stiffness" if is_torsional else found.what


def record(found: UnknownLoad) -> dict[str, Any]:
    """The same as JSON values (SI); the factor of every row, null where the load does nothing."""
    factor = np.atleast_1d(np.asarray(found.factor))
    rows = [float(each) if np.isfinite(each) else None for each in factor]
    return found._asdict() | {"factor": rows if np.ndim(found.factor) else rows[0]}
