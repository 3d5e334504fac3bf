"""The size of a load that holds a mechanism, as facts for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.analysis.efforts.unknown_load import UnknownLoad
from planar.dynamics.forces import Forces
from planar.reports.number_format import format_number

UNITS = {"stiffness": ("N/m", "N·m/rad"), "mass": ("kg", "kg"), "force": ("N", "N"), "torque": ("N·m", "N·m")}
"""Of sizes of loads; of a spring between points, and of one between links."""


def unknown_load_facts(forces: Forces, found: UnknownLoad) -> Iterator[tuple[str, str]]:
    """What the load has to be, at the position or over the motion."""
    unit, effort = _unit(forces, found), "N" if forces.is_force_input(found.input) else "N·m"
    holds = f"{found.input!r} supplies {format_number(found.effort)} {effort}"
    factor = np.atleast_1d(np.asarray(found.factor))
    known = factor[np.isfinite(factor)]
    one = f"a {found.what} of {format_number(found.best * found.value)} {unit}"
    times = f"{format_number(found.best)} times what the file says"
    if len(factor) == 1:
        yield found.load, f"{holds} with {one}, {times}"
        return
    if found.is_constant:
        yield found.load, f"{holds} all over the motion with {one}, {times}"
        return
    low, high = (format_number(float(each) * found.value) for each in (known.min(), known.max()))
    yield found.load, f"{holds} with a {found.what} from {low} to {high} {unit} over the motion"
    yield "", f"{one}, {times}, comes nearest: it leaves up to {format_number(found.left)} {effort}"


def _unit(forces: Forces, found: UnknownLoad) -> str:
    mechanism = forces.mechanism
    torsional = found.what == "stiffness" and mechanism.springs[int(found.load.rpartition(".")[2])].is_torsional
    return UNITS[found.what][torsional]


def record(found: UnknownLoad) -> dict[str, Any]:
    """The same as JSON values (SI); the factor of every row, null where the load does nothing."""
    factor = np.atleast_1d(np.asarray(found.factor))
    rows = [float(each) if np.isfinite(each) else None for each in factor]
    return found._asdict() | {"factor": rows if np.ndim(found.factor) else rows[0]}
