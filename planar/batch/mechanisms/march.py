"""Many assembled linkages through all steps, kind after kind, and how far each of them is sure to have come."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import COS, POSE_ROWS, SIN, X1, X2, X
from planar.batch.mechanisms.initial_assembly import LEAST_CLEARANCE, StartAssemblies
from planar.batch.mechanisms.linkage_arrays import LinkageArrays
from planar.batch.mechanisms.newton_march import PREDICTOR_ORDER, run_newton
from planar.batch.mechanisms.points import point_formula
from planar.codegen.block_formula import LANES, KernelLayout, run_kernel

Array = np.ndarray

CORRECTION_LIMIT, COARSE_STEP = 3e-3, 0.04
"""rad or sizes by which Newton's method may correct what was predicted, for steps of the second (rad) or less."""
MAX_TURN_PER_STEP = 0.5
"""rad: no link may turn by more in a step, so that nothing is missed between two."""


class LinkageRuns(NamedTuple):
    """The points of all linkages, out (points, 2 or 6, steps), at so many steps of which `good` (linkages,) are sure;
    after these there is a `dead` point (linkages,) for those of which that is sure too, of the group `at`."""

    out: Array
    good_steps: Array
    ends_in_dead_point: Array
    dead_point_block: Array


def run_linkages(
    linkages: LinkageArrays,
    start: StartAssemblies,
    offsets: Array,
    step: float,
    rates: bool,
    native: bool,
    polished: bool = False,
    verdict_only: bool = False,
) -> LinkageRuns:
    """Run linkages whose running inputs go so far (steps,) from where they are, by `step` in each. See `LinkageRuns`.

    `polished`: every closed form is followed by a step of Newton's method. `quick`: only whether all steps are good is
    looked at, in machine code.
    """
    many, steps = len(linkages), len(offsets)
    first = np.concatenate([[0], np.cumsum(linkages.link_counts)])
    state = _initial_state(linkages, first, offsets, step, rates, native)
    verdict_only = verdict_only and native
    good, dead, at = np.full(many, steps), np.zeros(many, dtype=bool), np.full(many, -1)
    wide = POSE_ROWS + 6 if rates else POSE_ROWS
    for batch in linkages.merged_batches if native else linkages.batches:
        kind, index = batch.block_type, batch.state_indices(first)
        tolerance = linkages.tolerance[batch.owner]
        if kind.has_closed_form:
            p = np.hstack([batch.p, start.signs[batch.block_numbers, : kind.sign_count]])
            gives = tuple(
                (slot, row) for slot in range(*batch.inner_slots.indices(kind.slot_count)) for row in range(wide)
            )
            walk = KernelLayout(gives, p.shape[1], kind.slot_count, 2, verdict_only)
            judged = run_kernel(kind.run_formula(rates, polished), walk, state, index, p, native)
            if verdict_only:
                left, clear, bend, fastest = judged
                fine = (
                    (left <= tolerance) & (clear > np.maximum(bend, LEAST_CLEARANCE)) & (fastest <= MAX_TURN_PER_STEP)
                )
                good[batch.owner[~fine]] = 0
                continue
            come, ends = _count_good_steps(judged[:, 0, :steps], judged[:, 1, :steps], tolerance)
        else:
            z = start.z[batch.block_numbers, : len(kind.unknown_is_angle)]
            told_ = run_newton(kind, state, index, batch.p, z, rates, native)
            left = told_.residuals[:, :steps].copy()
            # what was not where it was predicted may be elsewhere
            left[:, PREDICTOR_ORDER + 1 :][
                told_.corrections[:, PREDICTOR_ORDER + 1 : steps] > CORRECTION_LIMIT * max(1.0, step / COARSE_STEP) ** 2
            ] = np.inf
            come, ends = _count_good_steps(left, told_.squared_regularity[:, :steps], tolerance)
        for k in np.flatnonzero(come < good[batch.owner]):
            # of several groups of a linkage the first one that ends
            owner = batch.owner[k]
            if come[k] < good[owner]:
                good[owner], dead[owner], at[owner] = come[k], ends[k], batch.block_numbers[k]
    if not verdict_only:
        slow = _has_slow_links(state, first, steps, good)
        good[~slow], dead[~slow] = 0, False
    formula, walk = point_formula(rates)
    points = linkages.points
    index = np.where(points.link_index > 0, points.link_index + first[points.owner], 0)[:, None]
    numbers = np.hstack([points.numbers, linkages.unit[points.owner][:, None]])
    return LinkageRuns(run_kernel(formula, walk, state, index, numbers, native), good, dead, at)


def _count_good_steps(residuals: Array, clearance: Array, tolerance: Array) -> tuple[Array, Array]:
    """How many of the first steps of groups are sure (groups,), and whether there is a dead point then.

    What is left open is round-off, and no two assemblies meet: `clear` is above zero, between two steps too. It bends
    there by less than its second differences say.
    """
    with np.errstate(invalid="ignore"):
        fine = (residuals <= tolerance[:, None]) & (clearance > LEAST_CLEARANCE)
        bends = np.zeros_like(clearance)
        if clearance.shape[1] > 2:
            bends[:, 1:-1] = np.nan_to_num(np.abs(clearance[:, 2:] - 2.0 * clearance[:, 1:-1] + clearance[:, :-2]))
            bends[:, 0], bends[:, -1] = bends[:, 1], bends[:, -2]
        least = np.minimum(clearance[:, 1:], clearance[:, :-1])
        fine[:, 1:] &= least > np.maximum(bends[:, 1:], bends[:, :-1])
        come = np.where(fine.all(axis=1), fine.shape[1], np.argmin(fine, axis=1))
        every = np.arange(len(come))
        next_ = np.minimum(come, fine.shape[1] - 1)
        ends = (come > 2) & (come < fine.shape[1]) & (clearance[every, next_] < 0.0)
    return come, ends


def _has_slow_links(state: Array, first: Array, steps: int, good: Array) -> Array:
    """Whether no link of a linkage turns too fast over its first steps that are good."""
    moved = np.abs(np.diff(state[1:, COS : SIN + 1, :steps], axis=2))
    if not moved.size:
        return np.ones(len(good), dtype=bool)
    with np.errstate(invalid="ignore"):
        worst = np.fmax.reduceat(np.fmax.reduce(np.fmax.reduce(moved, axis=2), axis=1), first[:-1])
    slow = worst <= MAX_TURN_PER_STEP
    for k in np.flatnonzero(~slow):
        part = moved[first[k] : first[k + 1], :, : max(good[k] - 1, 0)]
        slow[k] = bool(np.all(part <= MAX_TURN_PER_STEP))
    return slow


def _initial_state(
    linkages: LinkageArrays, first: Array, offsets: Array, step: float, rates: bool, native: bool
) -> Array:
    """Places (places, rows, steps) of which only the frame's and the inputs' are filled; steps go on to fill the
    lanes."""
    wide = -(-len(offsets) // LANES) * LANES if native else len(offsets)
    far = np.concatenate([offsets, offsets[-1] + step * np.arange(1, wide - len(offsets) + 1)])
    state = np.empty((1 + first[-1], POSE_ROWS + 6 if rates else POSE_ROWS, wide))
    state[0], state[0, COS] = 0.0, 1.0
    inputs = linkages.inputs
    where, runs, angle = first[inputs.owner] + inputs.link_index, inputs.runs, inputs.is_angle
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
