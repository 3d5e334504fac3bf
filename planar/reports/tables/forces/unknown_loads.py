"""The size of a load that holds a mechanism, as facts for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.analysis.efforts.unknown_load import UnknownLoad
from planar.dynamics.forces import Forces
from planar.reports.number_format import AMONG_POSITIONS, format_number, format_quantity, quantity_text


def unknown_load_facts(forces: Forces, found: UnknownLoad) -> Iterator[tuple[str, str]]:
    """What the load has to be, at the position or over the motion."""
    yield found.load, _size_sentence(forces, found)
    for sentence in (*_best_sentences(forces, found), *found.remarks):
        yield "", sentence


def _size_sentence(forces: Forces, found: UnknownLoad) -> str:
    units, kind = forces.mechanism.units, _size_kind(forces, found)
    effort = "force" if forces.is_force_input(found.input) else "torque"
    holds = f"{found.input!r} supplies {quantity_text(found.effort, effort, units)}"
    if found.has_friction:
        holds += ", moving on against its friction,"
    factor = np.atleast_1d(np.asarray(found.factor))
    known = factor[np.isfinite(factor)]
    if not len(known):
        return f"{holds} with no {found.what} that could be told"
    if len(factor) > 1 and not found.is_constant:
        low = format_quantity(float(known.min()) * found.value, kind, units)
        high = quantity_text(float(known.max()) * found.value, kind, units)
        return f"{holds} with a {found.what} from {low} to {high} over the motion{AMONG_POSITIONS}"
    over = " all over the motion" if len(factor) > 1 else ""
    return f"{holds}{over} with {_best_phrase(forces, found)}"


def _best_sentences(forces: Forces, found: UnknownLoad) -> Iterator[str]:
    """Which one comes nearest, where none holds everywhere."""
    if np.ndim(found.factor) and not found.is_constant and np.isfinite(found.left):
        effort = "force" if forces.is_force_input(found.input) else "torque"
        left = quantity_text(found.left, effort, forces.mechanism.units)
        yield f"{_best_phrase(forces, found)}, comes nearest{AMONG_POSITIONS}: it leaves up to {left}"


def _best_phrase(forces: Forces, found: UnknownLoad) -> str:
    size = quantity_text(found.best * found.value, _size_kind(forces, found), forces.mechanism.units)
    return f"a {found.what} of {size}, {format_number(found.best)} times what the file says"


def _size_kind(forces: Forces, found: UnknownLoad) -> str:
    """Which kind of quantity the size of the load is."""
    springs = forces.mechanism.springs
    is_torsional = found.what == "stiffness" and springs[int(found.load.rpartition(".")[2])].is_torsional
    return "torsional stiffness" if is_torsional else found.what


def record(found: UnknownLoad) -> dict[str, Any]:
    """The same as JSON values (SI); the factor of every row, null where the load does nothing."""
    factor = np.atleast_1d(np.asarray(found.factor))
    rows = [float(each) if np.isfinite(each) else None for each in factor]
    over = {name: each if np.isfinite(each) else None for name, each in (("best", found.best), ("left", found.left))}
    return found._asdict() | over | {"factor": rows if np.ndim(found.factor) else rows[0]}
