"""Many assembled linkages through all steps, kind after kind, and how far each of them is sure to have come."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import COS, POSE, SIN, X1, X2, X
from planar.batch.mechanisms.initial_assembly import MEETING, Started
from planar.batch.mechanisms.linkage_arrays import Lot
from planar.batch.mechanisms.newton_march import ORDER, followed
from planar.batch.mechanisms.points import told
from planar.codegen.block_formula import LANES, Walk, walked

Array = np.ndarray

ASTRAY, COARSE = 3e-3, 0.04
"""rad or sizes by which Newton's method may correct what was predicted, for steps of the second (rad) or less."""
FASTEST = 0.5
"""rad: no link may turn by more in a step, so that nothing is missed between two."""


class Ran(NamedTuple):
    """The points of all linkages, out (points, 2 or 6, steps), at so many steps of which `good` (linkages,) are sure;
    after these there is a `dead` point (linkages,) for those of which that is sure too, of the group `at`."""

    out: Array
    good: Array
    dead: Array
    at: Array


def ran(
    lot: Lot,
    start: Started,
    gone: Array,
    step: float,
    rates: bool,
    native: bool,
    polished: bool = False,
    quick: bool = False,
) -> Ran:
    """Run linkages whose running inputs go so far (steps,) from where they are, by `step` in each. See `Ran`.

    `polished`: every closed form is followed by a step of Newton's method. `quick`: only whether all steps are good is
    looked at, in machine code.
    """
    many, steps = len(lot), len(gone)
    first = np.concatenate([[0], np.cumsum(lot.places)])
    state = _state(lot, first, gone, step, rates, native)
    quick = quick and native
    good, dead, at = np.full(many, steps), np.zeros(many, dtype=bool), np.full(many, -1)
    wide = POSE + 6 if rates else POSE
    for batch in lot.turns if native else lot.levels:
        kind, index = batch.kind, batch.index(first)
        tolerance = lot.tolerance[batch.owner]
        if kind.direct:
            p = np.hstack([batch.p, start.signs[batch.ids, : kind.signs]])
            gives = tuple((slot, row) for slot in range(*batch.inner.indices(kind.slots)) for row in range(wide))
            walk = Walk(gives, p.shape[1], kind.slots, 2, quick)
            judged = walked(kind.run(rates, polished), walk, state, index, p, native)
            if quick:
                left, clear, bend, fastest = judged
                fine = (left <= tolerance) & (clear > np.maximum(bend, MEETING)) & (fastest <= FASTEST)
                good[batch.owner[~fine]] = 0
                continue
            come, ends = _come(judged[:, 0, :steps], judged[:, 1, :steps], tolerance)
        else:
            z = start.z[batch.ids, : len(kind.turning)]
            told_ = followed(kind, state, index, batch.p, z, rates, native)
            left = told_.left[:, :steps].copy()
            # what was not where it was predicted may be elsewhere
            left[:, ORDER + 1 :][told_.moved[:, ORDER + 1 : steps] > ASTRAY * max(1.0, step / COARSE) ** 2] = np.inf
            come, ends = _come(left, told_.regular[:, :steps], tolerance)
        for k in np.flatnonzero(come < good[batch.owner]):
            # of several groups of a linkage the first one that ends
            owner = batch.owner[k]
            if come[k] < good[owner]:
                good[owner], dead[owner], at[owner] = come[k], ends[k], batch.ids[k]
    if not quick:
        slow = _slow(state, first, steps, good)
        good[~slow], dead[~slow] = 0, False
    formula, walk = told(rates)
    points = lot.points
    index = np.where(points.place > 0, points.place + first[points.owner], 0)[:, None]
    numbers = np.hstack([points.numbers, lot.unit[points.owner][:, None]])
    return Ran(walked(formula, walk, state, index, numbers, native), good, dead, at)


def _come(left: Array, clear: Array, tolerance: Array) -> tuple[Array, Array]:
    """How many of the first steps of groups are sure (groups,), and whether there is a dead point then.

    What is left open is round-off, and no two assemblies meet: `clear` is above zero, between two steps too. It bends
    there by less than its second differences say.
    """
    with np.errstate(invalid="ignore"):
        fine = (left <= tolerance[:, None]) & (clear > MEETING)
        bends = np.zeros_like(clear)
        if clear.shape[1] > 2:
            bends[:, 1:-1] = np.nan_to_num(np.abs(clear[:, 2:] - 2.0 * clear[:, 1:-1] + clear[:, :-2]))
            bends[:, 0], bends[:, -1] = bends[:, 1], bends[:, -2]
        least = np.minimum(clear[:, 1:], clear[:, :-1])
        fine[:, 1:] &= least > np.maximum(bends[:, 1:], bends[:, :-1])
        come = np.where(fine.all(axis=1), fine.shape[1], np.argmin(fine, axis=1))
        every = np.arange(len(come))
        next_ = np.minimum(come, fine.shape[1] - 1)
        ends = (come > 2) & (come < fine.shape[1]) & (clear[every, next_] < 0.0)
    return come, ends


def _slow(state: Array, first: Array, steps: int, good: Array) -> Array:
    """Whether no link of a linkage turns too fast over its first steps that are good."""
    moved = np.abs(np.diff(state[1:, COS : SIN + 1, :steps], axis=2))
    if not moved.size:
        return np.ones(len(good), dtype=bool)
    with np.errstate(invalid="ignore"):
        worst = np.fmax.reduceat(np.fmax.reduce(np.fmax.reduce(moved, axis=2), axis=1), first[:-1])
    slow = worst <= FASTEST
    for k in np.flatnonzero(~slow):
        part = moved[first[k] : first[k + 1], :, : max(good[k] - 1, 0)]
        slow[k] = bool(np.all(part <= FASTEST))
    return slow


def _state(lot: Lot, first: Array, gone: Array, step: float, rates: bool, native: bool) -> Array:
    """Places (places, rows, steps) of which only the frame's and the inputs' are filled; steps go on to fill the
    lanes."""
    wide = -(-len(gone) // LANES) * LANES if native else len(gone)
    far = np.concatenate([gone, gone[-1] + step * np.arange(1, wide - len(gone) + 1)])
    state = np.empty((1 + first[-1], POSE + 6 if rates else POSE, wide))
    state[0], state[0, COS] = 0.0, 1.0
    inputs = lot.inputs
    where, runs, angle = first[inputs.owner] + inputs.place, inputs.runs, inputs.angle
    state[where] = 0.0
    state[where, X] = inputs.value[:, None] + runs[:, None] * far
    # cos and sin of a sum, so that there is one of each for all
    cos, sin = np.cos(far), np.sin(far)
    c, s = (np.where(angle, of(inputs.value), still)[:, None] for of, still in ((np.cos, 1.0), (np.sin, 0.0)))
    state[where, COS] = np.where(runs[:, None], c * cos - s * sin, c)
    state[where, SIN] = np.where(runs[:, None], s * cos + c * sin, s)
    if rates:
        state[where, X1] = (inputs.velocity * runs)[:, None]
        state[where, X2] = (inputs.acceleration * runs)[:, None]
    return state
