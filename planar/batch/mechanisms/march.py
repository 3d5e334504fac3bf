"""All positions of many assembled linkages, block type after block type: how far each is sure, and why it ends."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planar.batch.march.prediction import MAX_TURN_PER_STEP, correction_limit
from planar.batch.mechanisms.block_type import COS, POSE_ROWS, SIN, TURN1, TURN2, X1, X2, Y1, Y2, X, Y
from planar.batch.mechanisms.initial_assembly import LEAST_CLEARANCE, StartAssemblies
from planar.batch.mechanisms.linkages import BlockBatch, LinkageArrays, LinkageGroup, SweepRequest
from planar.batch.mechanisms.newton_march import PREDICTOR_ORDER, run_newton
from planar.batch.stop_checks import find_first_stop
from planar.codegen.block_formula import LANES, BlockFormula, FormulaInput, KernelLayout, run_kernel
from planar.foundation.errors import Outcome
from planar.foundation.instruction_list import InstructionList
from planar.model.mechanism import running_input_index


@lru_cache
def point_formula(rates: bool) -> tuple[BlockFormula, KernelLayout]:
    """x and y of a point, then of its first and second rates, from its link's pose and rates.

    Numbers: the point in its link (m), then what the link's own lengths are multiplied by.
    """
    listing: InstructionList[FormulaInput] = InstructionList()
    leaves: dict[int, FormulaInput] = {}

    def leaf(what: str, first: int, second: int = 0) -> int:
        key = FormulaInput(what, first, second)
        number = listing.add_input(key)
        leaves[number] = key
        return number

    def times(a: int, b: int) -> int:
        return listing.add("mul", a, b)

    px, py, unit = (leaf("p", k) for k in range(3))
    c, s = leaf("row", 0, COS), leaf("row", 0, SIN)
    rx = listing.add("sub", times(c, px), times(s, py))
    ry = listing.add("add", times(s, px), times(c, py))
    wanted = [listing.add("add", times(leaf("row", 0, row), unit), r) for row, r in ((X, rx), (Y, ry))]
    if rates:
        turn1, turn2 = leaf("row", 0, TURN1), leaf("row", 0, TURN2)
        square = times(turn1, turn1)
        wanted.append(listing.add("sub", times(leaf("row", 0, X1), unit), times(turn1, ry)))
        wanted.append(listing.add("add", times(leaf("row", 0, Y1), unit), times(turn1, rx)))
        along = listing.add("add", times(turn2, ry), times(square, rx))
        across = listing.add("sub", times(turn2, rx), times(square, ry))
        wanted.append(listing.add("sub", times(leaf("row", 0, X2), unit), along))
        wanted.append(listing.add("add", times(leaf("row", 0, Y2), unit), across))
    return BlockFormula(listing, tuple(wanted), leaves), KernelLayout((), 3, 1, len(wanted))


Array = np.ndarray


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
    polished: bool = False,
    verdict_only: bool = False,
) -> LinkageRuns:
    """Run linkages whose running inputs go so far (steps,) from where they are, by `step` in each. See `LinkageRuns`.

    `polished`: every closed form is followed by a step of Newton's method. `verdict_only`: of blocks in closed form
    only whether all steps are good is looked at.
    """
    many, steps = len(linkages), len(offsets)
    first = np.concatenate([[0], np.cumsum(linkages.link_counts)])
    state = _initial_state(linkages, first, offsets, step, rates, LANES)
    good, dead, at = np.full(many, steps), np.zeros(many, dtype=bool), np.full(many, -1)
    for batch in linkages.merged_batches:
        index, tolerance = batch.state_indices(first), linkages.tolerance[batch.owner]
        if batch.block_type.has_closed_form:
            found = _run_closed_form(batch, start, state, index, rates, polished, verdict_only)
            if verdict_only:
                left, clear, bend, fastest = found
                fine = (left <= tolerance) & (clear > np.maximum(bend, LEAST_CLEARANCE))
                good[batch.owner[~(fine & (fastest <= MAX_TURN_PER_STEP))]] = 0
                continue
            residuals, clearance = found[:, 0, :steps], found[:, 1, :steps]
        else:
            z = start.z[batch.block_numbers, : len(batch.block_type.unknown_is_angle)]
            run = run_newton(batch.block_type, state, index, batch.p, z, rates)
            residuals, clearance = run.residuals[:, :steps].copy(), run.squared_regularity[:, :steps]
            # what was not where it was predicted may be elsewhere
            far = run.corrections[:, PREDICTOR_ORDER + 1 : steps] > correction_limit(step)
            residuals[:, PREDICTOR_ORDER + 1 :][far] = np.inf
        come, ends = _count_good_steps(residuals, clearance, tolerance)
        for k in np.flatnonzero(come < good[batch.owner]):
            # of several groups of a linkage the first one that ends
            owner = batch.owner[k]
            if come[k] < good[owner]:
                good[owner], dead[owner], at[owner] = come[k], ends[k], batch.block_numbers[k]
    if not verdict_only:
        slow = _has_slow_links(state, first, steps, good)
        good[~slow], dead[~slow] = 0, False
    return LinkageRuns(_run_points(linkages, first, state, rates), good, dead, at)


def _run_closed_form(
    batch: BlockBatch,
    start: StartAssemblies,
    state: Array,
    index: Array,
    rates: bool,
    polished: bool,
    verdict_only: bool,
) -> Array:
    """What is left open and how clear of dead points blocks are (blocks, 2, steps), or the extremes of these."""
    kind, wide = batch.block_type, POSE_ROWS + 6 if rates else POSE_ROWS
    p = np.hstack([batch.p, start.signs[batch.block_numbers, : kind.sign_count]])
    rows = tuple((slot, row) for slot in range(*batch.inner_slots.indices(kind.slot_count)) for row in range(wide))
    layout = KernelLayout(rows, p.shape[1], kind.slot_count, 2, verdict_only)
    return run_kernel(kind.run_formula(rates, polished), layout, state, index, p)


def _run_points(linkages: LinkageArrays, first: Array, state: Array, rates: bool) -> Array:
    formula, layout = point_formula(rates)
    points = linkages.points
    index = np.where(points.link_index > 0, points.link_index + first[points.owner], 0)[:, None]
    numbers = np.hstack([points.numbers, linkages.unit[points.owner][:, None]])
    return run_kernel(formula, layout, state, index, numbers)


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
    linkages: LinkageArrays, first: Array, offsets: Array, step: float, rates: bool, lanes: int
) -> Array:
    """Places (places, rows, steps) of which only the frame's and the inputs' are filled; steps go on to fill the
    lanes."""
    wide = -(-len(offsets) // lanes) * lanes
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


class LinkageEnding(NamedTuple):
    """So many of the first fine steps are solved; why no more, and what there is to say of it."""

    solved_steps: int
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""


def find_ending(  # many: what a mechanism is run by
    group: LinkageGroup, one: int, runs: LinkageRuns, run: int, places: Array, gone: Array, request: SweepRequest
) -> LinkageEnding | None:
    """How the mechanism `one` of a group ends by its `run` of the runs, whose input has gone so far (steps,); None
    where that is not sure. places (two a watched link, 2, steps)."""
    good = int(runs.good_steps[run])
    if group.watched[one] and good:
        mechanism, at = group.mechanisms[one], np.moveaxis(places[..., :good], 1, 2)
        pair = mechanism.inputs[running_input_index(mechanism, request.pair, "inputs")].pair
        found = {link: (at[2 * k], at[2 * k + 1]) for k, link in enumerate(group.watched[one])}
        unit, positions = float(group.arrays.unit[one]), group.start[one] + gone[:good]
        met = find_first_stop(mechanism, unit, pair, positions, found)
        if met is None or (met.step is None and good < len(gone)):
            return None  # beside a dead point it is not clear which comes first
        if met.step is not None:
            return LinkageEnding(met.step, Outcome.STOP, f"{met.reason}, {_where(group, one, gone, met.step)}")
    if good == len(gone):
        return LinkageEnding(good)
    if not runs.ends_in_dead_point[run]:
        return None
    links = group.links_of_block(int(runs.dead_point_block[run]))
    told = f"links {links} come to a dead point {_where(group, one, gone, good)}"
    return LinkageEnding(good, Outcome.DEAD_POINT, told)


def _where(group: LinkageGroup, one: int, gone: Array, step: int) -> str:
    """Between which inputs a step ends."""
    before, after = group.start[one] + gone[[max(step - 1, 0), step]]
    return f"at an input of {before:.6g} to {after:.6g} rad"
