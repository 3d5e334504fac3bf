"""Far motions of an input that turns: whole turns that lead back to where they began are not followed again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.errors import NoAnswer, Outcome
from planar.mechanism import FARTHEST
from planar.solving.setup import Setup

Array = np.ndarray

TURN = 2.0 * np.pi
FAR, COARSE = 2.0 * TURN, 0.5
"""rad: a motion that is longer than the first, in steps longer than the second, is looked at."""
MOST_TURNS = 12
"""Turns after which a motion that has not come back is followed all the way."""
BACK = 1e-9
"""rad or sizes: unknowns that are no further from where they began are there, but for rounding."""


def by_periods(
    setup: Setup, z: Array, u: Array, followed: Callable[[Array, Array, Array], Array | None]
) -> Array | None:
    """The unknowns at inputs u (samples, inputs) from those of the first, one input turning; None where not so simple.

    A motion that comes back to a position without a change point on the way goes on as it went before: then only the
    first period is followed, and each sample found in it. `followed` gives the unknowns at the last of some inputs
    (samples, inputs) and all before, from those of the first; None where a change point is met. Raises NoAnswer where
    the motion is too long to be followed step by step.
    """
    gone = u - u[0]
    if not (np.abs(gone).max(initial=0.0) > FAR and np.abs(np.diff(u, axis=0)).max() > COARSE):
        return None
    moving = np.flatnonzero(np.abs(gone).max(axis=0))
    far = float(np.abs(gone).max())
    if len(moving) == 1 and not setup.outline.slide[moving[0]] and not setup.outline.counts:
        axis = np.zeros(u.shape[1])
        axis[moving[0]] = 1.0
        way = gone[:, moving[0]]
        try:
            back = _period(setup, z, u[0], axis * np.sign(way[np.argmax(np.abs(way))]), followed)
        except NoAnswer:
            return None  # it ends within a few turns, and is followed to there
        if back is not None:
            many, winding = back
            period = many * TURN
            # the quotient is rounded, the remainder is exact but for the last digit of the angle itself
            times = np.floor(way / period)
            rest = way - times * period
            order = np.argsort(rest, kind="stable")
            found = followed(z, u[0], u[0] + rest[order, None] * axis)
            if found is not None:
                whole = np.empty_like(found)
                whole[order] = found
                return whole + times[:, None] * winding
    if far > FARTHEST:
        raise NoAnswer(
            Outcome.BRANCH_LOST,
            f"from {setup.where(u[0])} to {setup.where(u[int(np.argmax(np.abs(gone).max(axis=1)))])} is further than "
            f"{FARTHEST:g} rad or lengths of the mechanism, the most that is followed step by step; start nearer",
        )
    return None


def _period(
    setup: Setup, z: Array, u: Array, way: Array, followed: Callable[[Array, Array, Array], Array | None]
) -> tuple[int, Array] | None:
    """After how many turns a motion comes back, and by how much its unknowns have gone on by then."""
    e = setup.equations
    lengths = np.array([setup.outline.lengths[column] for column in e.unknowns], dtype=bool)
    here = z
    for many in range(1, MOST_TURNS + 1):
        after = followed(here, u + (many - 1) * TURN * way, (u + many * TURN * way)[None])
        if after is None:
            return None
        here = after[-1]
        turns = np.where(lengths, 0.0, np.round((here - z) / TURN))
        if np.all(np.abs(here - z - turns * TURN) <= BACK):
            # backwards a period has gone by the other way
            return many, turns * TURN * float(way.sum())
    return None
