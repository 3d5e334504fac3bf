"""What depends on what among the constraints and inputs of a mechanism: the smallest sets that hold one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planar.solving.full_constraints import AWAY, Constraints, joined, motion_from, moved, null_space
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

NOTHING = 1e-7
"""A part of a unit vector that is zero but for rounding."""
MOST = 600
"""Coordinates: a larger mechanism is not searched for inputs that are stuck, or for how it moves in general."""


def smallest_sets(
    left: Array, owners: Sequence[str], order: Callable[[str], Sequence[str]]
) -> tuple[tuple[str, ...], ...]:
    """The smallest sets of owners of rows that depend on one another.

    `left` (rows, k) spans the combinations of rows that vanish; an owner is left out as long as a combination without
    it still holds the one that is asked for, in the order `order` gives for that one.
    """
    rows_of: dict[str, list[int]] = {}
    for row, owner in enumerate(owners):
        rows_of.setdefault(owner, []).append(row)
    found: dict[frozenset[str], None] = {}
    for owner, rows in rows_of.items():
        span = left
        if np.linalg.norm(span[rows]) < NOTHING:
            continue
        for other in order(owner):
            without = span @ _null(span[rows_of.get(other, [])])
            if without.size and np.linalg.norm(without[rows]) > NOTHING:
                span = without
        held = frozenset(name for name, each in rows_of.items() if np.linalg.norm(span[each]) > NOTHING)
        found[held] = None
    sets = [tuple(name for name in rows_of if name in held) for held in found]
    return tuple(sorted(sets, key=len))


def _null(rows: Array) -> Array:
    """Combinations of columns that vanish in these rows; the columns are orthonormal, so sizes mean something."""
    if not rows.size:
        return np.eye(rows.shape[1])
    _, values, vectors = np.linalg.svd(rows)
    return vectors[int(np.sum(values > NOTHING)) :].T


def stuck(setup: Setup) -> tuple[list[str], list[str]] | None:
    """Inputs that no motion of the pairs can move while others can: their names, and the links that are free.

    None where the mechanism cannot be joined, or every input moves.
    """
    names = tuple(given.pair for given in setup.mechanism.inputs)
    places = _anywhere(setup) if names else ()
    if not places:
        return None
    constraints = Constraints(setup)
    moves = np.zeros(len(names))
    for w in places:
        free = null_space(constraints.slope(w))
        moves = np.maximum(moves, np.abs(constraints.drive_slope(names, w) @ free).max(axis=1, initial=0.0))
    fast = [name for name, move in zip(names, moves, strict=True) if move < 100.0 * NOTHING]
    if not fast or not free.size:
        return None
    share = np.abs(free).max(axis=1)
    links = dict.fromkeys(
        coordinate.owner
        for coordinate, part in zip(constraints.coordinates, share, strict=True)
        if coordinate.of_link and part > 1e-4
    )
    return fast, list(links)


def ways_on(setup: Setup, w: Array) -> int | None:
    """In how many ways the mechanism can move on from a position w, inputs left aside; None where it is too large."""
    return motion_from(Constraints(setup), w)[0] if w.size <= MOST else None


def conflicting(setup: Setup) -> tuple[tuple[str, ...], ...]:
    """The smallest sets of inputs that move one another, or cannot move; none where the mechanism cannot be joined."""
    names = tuple(given.pair for given in setup.mechanism.inputs)
    places = _anywhere(setup)
    if not places:
        return ()
    w, constraints = places[-1], Constraints(setup)
    rates = constraints.drive_slope(names, w) @ null_space(constraints.slope(w))
    together = null_space(rates.T) if rates.size else np.eye(len(names))
    return smallest_sets(together, names, lambda name: [other for other in names if other != name])


def _anywhere(setup: Setup) -> tuple[Array, ...]:
    """A closed position, at the inputs if that can be, and one beside it, which is like most; none if none is found."""
    if len(setup.equations.coordinates) > MOST:
        return ()
    constraints = Constraints(setup)
    w = joined(constraints)
    if w is None:
        return ()
    free = null_space(constraints.slope(w))
    beside = constraints.closed(w + moved(free, np.random.default_rng(0), AWAY)) if free.size else None
    return (w,) if beside is None else (w, beside)
