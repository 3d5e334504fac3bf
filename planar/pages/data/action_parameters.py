"""The numbers of what acts on a mechanism that a page lets be changed: loads, springs, dampers, masses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from planar.document.dimensions import Dimension, file_dimensions
from planar.model.mechanism import Mechanism

LOAD_KINDS = frozenset({"force", "torque"})
NONNEGATIVE_KINDS = frozenset(
    {"mass", "moment of inertia", "stiffness", "damping", "torsional stiffness", "torsional damping"}
)
NONZERO_KEYS = frozenset({"damping", "free_length"})
RANGE_RATIO = 2.0
"""By how much more than the file has, or the greatest of its kind, a slider goes."""


def action_parameters(mechanism: Mechanism) -> Iterator[Dimension]:
    """Forces, torques, stiffnesses, dampings, free lengths, masses and moments of inertia, in the order of the file.

    Not where they act, how they vary, nor the free angle of a torsional spring, off which its turns are counted; nor a
    damping or a free length of none, without which a spring has a force even where its ends meet.
    """
    for each in file_dimensions(mechanism).values():
        where = each.path[0]
        is_load = where == "loads" and each.kind in LOAD_KINDS
        is_mass = where == "masses" and each.kind in NONNEGATIVE_KINDS
        is_spring = where == "springs" and (
            each.path[-1] == "stiffness" or (each.path[-1] in NONZERO_KEYS and each.value)
        )
        if is_load or is_spring or is_mass:
            yield each


def parameter_data(each: Dimension, mechanism: Mechanism, parameters: Sequence[Dimension]) -> dict[str, Any]:
    """What a page has of a parameter: `most` is how far its slider goes.

    A force goes to both sides; what is zero in the file goes as far as the greatest of its kind.
    """
    greatest = max((abs(other.value) for other in parameters if other.kind == each.kind), default=0.0) or 1.0
    own = abs(each.value) if each.kind in NONNEGATIVE_KINDS or each.kind == "length" else greatest
    return {
        "name": each.name,
        "label": _label(each, mechanism),
        "kind": each.kind,
        "value": float(each.value),
        "most": RANGE_RATIO * float(own or greatest),
        "positive": each.kind not in LOAD_KINDS,
        "path": list(each.path),
    }


def _label(each: Dimension, mechanism: Mechanism) -> str:
    """In words: force on D along x, stiffness of spring 1, mass of rod."""
    what, index = str(each.path[2]).replace("_", " "), int(each.path[1])
    if each.path[0] == "loads":
        load = mechanism.loads[index]
        along = f" along {'xy'[int(each.path[3])]}" if len(each.path) > 3 else ""
        axes = f" of {load.axes}" if load.axes is not None and along else ""
        target = f"between {' and '.join(load.points)}" if load.points is not None else f"on {load.target}"
        return f"{what} {target}{along}{axes}"
    if each.path[0] == "springs":
        ends = " and ".join(mechanism.springs[index].ends)
        return f"{what}, spring between {ends}"
    link = mechanism.masses[index].link
    own = [k for k, mass in enumerate(mechanism.masses) if mass.link == link]
    return f"{what} of {link}" + (f", {own.index(index) + 1}" if len(own) > 1 else "")
