"""The assembly that is taken: the one of a number, else the one nearest to the sketch, and its number."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.search_tree import AssemblyTree
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase
from planar.solving.position import solve, solved_mechanism

if TYPE_CHECKING:
    from planar.assemblies.modes import Mode, Modes

SAME_POINT_TOLERANCE = 1e-6
"""Places of points are the same within this part of the greatest coordinate."""

MAX_SOLVED_FOR_REMARK = 32
"""Dyads, or larger blocks by what they take, that are solved with every position for the sake of a remark."""

MAX_LINKS_FOR_REMARK = 150
"""Links of more than so many dyads, or larger blocks, whatever they are joined to."""


def with_assembly_number(mechanism: Mechanism, advice: str = "") -> Mechanism:
    """The mechanism with a remark of which assembly the sketch means, where that is told within some milliseconds.

    `advice` says how another assembly is chosen, and ends the remark. Where there is nothing to choose, or the numbers
    are not sure, the mechanism as it is.
    """
    if len(mechanism.links) > MAX_LINKS_FOR_REMARK:
        return mechanism
    known = solved_mechanism(mechanism)
    stages = known.solver.equations.blocks
    if len(stages) > MAX_SOLVED_FOR_REMARK or known.solver.equations.open_rows:
        return mechanism
    try:
        z = known.assembly.z
    except NoAnswer:
        return mechanism  # as it will be said
    tree = AssemblyTree(known.solver, certify=False)
    total = tree.count(MAX_SOLVED_FOR_REMARK)
    if total is None or total < 2:
        return mechanism
    path = tree.path_to(z)
    before = None if path is None else tree.count_before(path, MAX_SOLVED_FOR_REMARK)
    solved = (each for index in range(len(stages)) for each in tree.solved_roots(index))
    if before is None or any(each.complete is Completeness.NOT for each in solved):
        return mechanism
    number = f"assembly {before + 1} of {total} at the file's inputs, {selection_words(mechanism)}"
    remark = "; ".join(filter(None, (number, advice)))
    return replace(mechanism, remarks=(*mechanism.remarks, remark))


def selection_words(mechanism: Mechanism) -> str:
    """How the assembly that is solved is chosen, in words for solutions, lists and drawings."""
    return "the nearest to the sketch" if mechanism.sketch else "taken without a sketch"


def select_assembly(mechanism: Mechanism, number: int) -> Mechanism:
    """The mechanism with the assembly of a number as its sketch, and a remark that says so.

    What a book prints of another assembly is left out. Raises BadInput where there are not so many, NoAnswer where
    there is none.
    """
    from planar.assemblies.modes import modes

    found = modes(mechanism, certify=False)
    if not found:
        raise found.refusal()
    try:
        mode = found[number - 1]
    except IndexError:
        raise BadInput("--mode", f"{_count_sentence(found)}; see `planar modes`") from None
    near = found.nearest
    own = near is not None and near.choices == mode.choices
    told = f"assembly {number}: {_count_sentence(found)}, {found.complete.value}"
    if not own and near is not None and near.number is not None:
        told += f"; the sketch means number {near.number}"
    kept = mode.mechanism
    if not _is_solved_to(kept, mode):
        raise BadInput(
            "--mode",
            f"a sketch of assembly {number} is solved to another one: the two lie near each other, or differ in turns",
        )
    return replace(kept, remarks=(*kept.remarks, told), published=kept.published if own else ())


def _is_solved_to(kept: Mechanism, mode: Mode) -> bool:
    """Whether a mechanism is solved to the assembly that is its sketch; one whose angles count turns may not be."""
    try:
        state = solve(kept)
    except NoAnswer:
        return True  # as it will be said
    gaps = [np.abs(state.point(name).position - at).max() for name, at in mode.points.items()]
    return max(gaps, default=0.0) <= SAME_POINT_TOLERANCE * (
        max(float(np.abs(at).max()) for at in mode.points.values()) or 1.0
    )


def _count_sentence(found: Modes) -> str:
    if found.total is None:
        return "there are more than can be counted here"
    are = "is" if found.total == 1 else "are"
    return f"there {are} {count_phrase(found.total, 'assembly', 'assemblies')}"
