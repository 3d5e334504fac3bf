"""Which contacts there are at every position: the one solution where that is proved, all of them where it is not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.dynamics.friction.all_solutions import find_all_solutions
from planar.dynamics.friction.contact_system import ContactSystem
from planar.dynamics.friction.frictionless_path import follow_from_frictionless
from planar.dynamics.friction.single_solution import has_single_solution, solve_contraction
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.short_repr import short_repr

SAME_SOLUTION_DISTANCE = 1e-6
"""Of the greatest contact."""


class ContactChoice(NamedTuple):
    """Contacts at n positions.

    `first` (n, m): of all solutions the one that goes over into that without friction as coefficients go to nothing,
    and where there is none such the one with the least forces; NaN where there is no solution. `others` by position
    (solutions, m). `solution_count` (n,) of all, `is_complete` (n,): whether these are proved to be all, `part` (n,):
    how far coefficients can grow on the way from the one without friction (1: as far as they are).
    """

    first: Array
    others: dict[int, Array]
    solution_count: IntArray
    is_complete: BoolArray
    part: Array

    def __repr__(self) -> str:
        return short_repr(self)


def solve_contacts(system: ContactSystem) -> ContactChoice:
    """The contacts at every position of a system."""
    many, width = system.loads.shape[:2]
    single = has_single_solution(system)
    first = np.full((many, width), np.nan)
    rows = np.flatnonzero(single)
    if rows.size:
        first[rows] = solve_contraction(system.at(rows))
    found = ContactChoice(first, {}, single.astype(int), np.ones(many, dtype=bool), np.ones(many))
    for row in np.flatnonzero(~single):
        _search(system.at(np.array([row])), int(row), found)
    return found


def _search(system: ContactSystem, row: int, found: ContactChoice) -> None:
    """Write down all solutions at one position."""
    every = find_all_solutions(system)
    end = follow_from_frictionless(system)
    order = sorted(every.y, key=lambda y: float(np.abs(y).max(initial=0.0)))
    if end.part == 1.0:
        size = max(float(np.abs(end.y).max(initial=0.0)), 1e-300)
        order = [y for y in order if np.abs(y - end.y).max() > SAME_SOLUTION_DISTANCE * size]
        order.insert(0, end.y)
    found.solution_count[row], found.is_complete[row], found.part[row] = len(order), every.is_complete, end.part
    if order:
        found.first[row] = order[0]
    if order[1:]:
        found.others[row] = np.array(order[1:])
