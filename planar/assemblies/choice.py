"""One of all assemblies by its number, in place of the one nearest to the sketch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planar.assemblies.modes import Mode, Modes, modes
from planar.errors import BadInput, NoAnswer
from planar.mechanism import Mechanism
from planar.solving.position import solve
from planar.words import many

NEAR = 1e-6
"""Places of points are the same within this part of the greatest coordinate."""


def chosen(mechanism: Mechanism, number: int) -> Mechanism:
    """The mechanism with the assembly of a number as its sketch, and a remark that says so.

    What a book prints of another assembly is left out. Raises BadInput where there are not so many, NoAnswer where
    there is none.
    """
    found = modes(mechanism, certify=False)
    if not found:
        raise found.refusal()
    try:
        mode = found[number - 1]
    except IndexError:
        raise BadInput("--mode", f"{_of(found)}; see `planar modes`") from None
    near = found.nearest
    own = near is not None and near.choices == mode.choices
    told = f"assembly {number}: {_of(found)}, {found.complete.value}"
    if not own and near is not None and near.number is not None:
        told += f"; the sketch means number {near.number}"
    kept = mode.mechanism
    if not _leads_back(kept, mode):
        raise BadInput(
            "--mode",
            f"a sketch of assembly {number} is solved to another one: the two lie near each other, or differ in turns",
        )
    return replace(kept, remarks=(*kept.remarks, told), published=kept.published if own else ())


def _leads_back(kept: Mechanism, mode: Mode) -> bool:
    """Whether a mechanism is solved to the assembly that is its sketch; one whose angles count turns may not be."""
    try:
        state = solve(kept)
    except NoAnswer:
        return True  # as it will be said
    gaps = [np.abs(state.point(name).position - at).max() for name, at in mode.points.items()]
    return max(gaps, default=0.0) <= NEAR * (max(float(np.abs(at).max()) for at in mode.points.values()) or 1.0)


def _of(found: Modes) -> str:
    if found.total is None:
        return "there are more than can be counted here"
    are = "is" if found.total == 1 else "are"
    return f"there {are} {many(found.total, 'assembly', 'assemblies')}"
