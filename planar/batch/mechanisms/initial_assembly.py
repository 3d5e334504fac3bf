"""The assemblies nearest to their sketches of many linkages at once, block after block."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import is_at_sketch, is_surely_farther
from planar.batch.march.prediction import CLEAR_REGULARITY
from planar.batch.mechanisms.block_type import COS, MAX_SIGNS, POSE_ROWS, SIN, SKETCH_SUMS, BlockType, X, Y
from planar.batch.mechanisms.linkages import BlockBatch, LinkageArrays, PointArrays
from planar.batch.mechanisms.newton_march import compile_newton_block, newton_numbers, step_table
from planar.codegen.tape import LANES, Tape, TapeFormula, compile_block, run_tape
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.geometry import GROUND, Frame

LEAST_CLEARANCE = 1e-4
"""Nearer than this to where two assemblies meet neither is taken."""
START_TOLERANCE_FACTOR = 100.0
"""How much more may be left open at a start, which is looked at again in the run."""
MAX_UNKNOWNS = 24
"""Unknowns of a group at most."""
LEAST_SPREAD = 1e-12
"""Squared sizes: points of a link that are no farther apart show no angle."""


class StartAssemblies(NamedTuple):
    """For every linkage whether its assembly is surely the one that the search of the whole would take (linkages,), and
    the signs of all groups (groups, SIGNS), or the unknowns of those that Newton's method follows (groups, MOST)."""

    is_sure: BoolArray
    signs: Array
    z: Array


def find_start_assemblies(linkages: LinkageArrays) -> StartAssemblies:
    """See `Started`.

    A way to assemble a group is taken where it is nearer to the sketch than any other by more than all groups of the
    linkage together are away from it: whatever else were taken, the whole would lie farther off.
    """
    many = len(linkages)
    first = np.concatenate([[0], np.cumsum(linkages.link_counts)])
    state = np.zeros((1 + first[-1], POSE_ROWS, LANES))
    _fill_inputs(state, linkages, first)
    stats = _sketch_sums(linkages.sketch, first)
    seen: Array | None = None
    sure, cost = np.ones(many, dtype=bool), np.zeros(many)
    margins: list[tuple[Array, Array]] = []
    signs, z = np.ones((linkages.block_count, MAX_SIGNS)), np.zeros((linkages.block_count, MAX_UNKNOWNS))
    for batch in linkages.batches:
        kind, index, groups = batch.block_type, batch.state_indices(first), len(batch.owner)
        inner, every = index[:, batch.inner_slots], np.arange(groups)
        if not kind.has_closed_form:
            seen = _sketch_sums(linkages.shown_points, first) if seen is None else seen
            found, distance, good = _correct_from_sketch(
                batch, state, index, (stats[inner], seen[inner]), linkages.tolerance
            )
            sure[batch.owner[~good]] = False
            z[batch.block_numbers, : found.shape[1]] = found
            cost += np.bincount(batch.owner, np.where(good, distance, 0.0), many)
            continue
        p = np.hstack([batch.p, stats[inner].reshape(groups, -1)])
        ways, width = 2**kind.sign_count, POSE_ROWS * len(kind.inner_links) + 3
        found = _evaluate_starts(kind, state, index, p, ways * width).reshape(groups, ways, width)
        left, clear, distance = (found[:, :, k] for k in (-3, -2, -1))
        distance = np.where(np.isfinite(left), distance, np.inf)
        best = np.argmin(distance, axis=1)
        nearest = distance[every, best]
        with np.errstate(invalid="ignore"):
            good = left[every, best] <= START_TOLERANCE_FACTOR * linkages.tolerance[batch.owner]
            good &= np.all(~(np.abs(clear) < LEAST_CLEARANCE), axis=1)
        sure[batch.owner[~good]] = False
        # what can be assembled in one way alone may lie far off where others are
        nearest = np.where(np.isfinite(nearest), nearest, 0.0)
        cost += np.bincount(batch.owner, np.maximum(nearest, 0.0), many)
        if ways > 1:
            distance[every, best] = np.inf
            margins.append((batch.owner, distance.min(axis=1) - nearest))
            table = np.array(list(product((1.0, -1.0), repeat=kind.sign_count)))
            signs[batch.block_numbers, : kind.sign_count] = table[best]
        poses = found[every, best, :-3].reshape(groups, len(kind.inner_links), POSE_ROWS)
        state[inner] = poses[:, :, :, None]
    for owner, margin in margins:
        sure[owner[~is_surely_farther(margin, cost[owner], roundings=2)]] = False
    return StartAssemblies(sure, signs, z)


def _correct_from_sketch(
    batch: BlockBatch,
    state: Array,
    index: IntArray,
    sketch_sums: tuple[Array, Array],
    tolerance: Array,
) -> tuple[Array, Array, BoolArray]:
    """Groups that are not in closed form, solved from where they are shown, the points of the sketch and what is shown
    in `sketch_sums`: unknowns there, squared distances to the sketch, and for which of them no other assembly can be
    meant.

    Their points lie at the sketch, and the slope is so regular that no other assembly is near: see `BlockAssemblies`.
    """
    sketch, seen = sketch_sums
    kind, groups = batch.block_type, len(batch.owner)
    frames, known = [], np.ones(groups, dtype=bool)
    for k in range(len(kind.inner_links)):
        many, px, py, tx, ty, along, across, _ = seen[:, k].T
        least = np.maximum(many, 1.0)
        turn = along - (px * tx + py * ty) / least, across - (px * ty - py * tx) / least
        known &= (many > 1.0) & (np.hypot(*turn) > LEAST_SPREAD)
        angle = np.arctan2(turn[1], turn[0])
        c, s = np.cos(angle), np.sin(angle)
        frames.append(Frame((tx - c * px + s * py) / least, (ty - s * px - c * py) / least, c, s, angle))

    def rows(slot: int, row: int) -> Array:
        return state[index[:, slot], row, 0]

    z = _unknowns_from_frames(kind, frames, rows, batch.p)
    table = step_table(1, 0.0)
    slots = np.column_stack([_addresses(state, index), np.full(groups, table.ctypes.data)])
    tolerances = START_TOLERANCE_FACTOR * tolerance[batch.owner], np.full(groups, CLEAR_REGULARITY**2)
    every, one = np.arange(groups + 1), np.zeros(groups, dtype=np.int64)
    tape = Tape(every, one, slots, newton_numbers(kind, batch.p, z), *tolerances)
    closed = run_tape([compile_newton_block(kind, False)], 1, tape).good > 0
    x, y, c, s = (state[index[:, batch.inner_slots], row, 0] for row in (X, Y, COS, SIN))
    many, px, py, tx, ty, along, across, squares = np.moveaxis(sketch, 2, 0)
    with np.errstate(invalid="ignore", over="ignore"):
        mixed = x * (c * px - s * py - tx) + y * (s * px + c * py - ty) - c * along - s * across
        distance = np.maximum(np.sum(many * (x * x + y * y) + 2.0 * mixed + squares, axis=1), 0.0)
        points = many.sum(axis=1)
        good = known & closed & (points > 0.0) & is_at_sketch(distance, points)
    return z, distance, good


def _evaluate_starts(kind: BlockType, state: Array, index: IntArray, p: Array, width: int) -> Array:
    """What the formula of starts gives of blocks (blocks, width), whose slots are those of an index in a state."""
    groups = len(index)
    found = np.empty((groups, width, LANES))
    slots = np.column_stack([_addresses(state, index), found.ctypes.data + np.arange(groups) * found.strides[0]])
    formula = TapeFormula(kind.start_formula, tuple((kind.slot_count, row) for row in range(width)))
    nothing = np.zeros(groups)
    run_tape(
        [compile_block(formula)], 1, Tape(np.arange(groups + 1), nothing.astype(np.int64), slots, p, nothing, nothing)
    )
    return found[:, :, 0]


def _addresses(state: Array, index: IntArray) -> IntArray:
    """Where the rows of slots begin."""
    return state.ctypes.data + index * state.strides[0]


def _unknowns_from_frames(
    block_type: BlockType, frames: list[Frame], rows: Callable[[int, int], Array], p: Array
) -> Array:
    """The unknowns (groups, unknowns) of groups whose inner links are shown about these frames.

    `rows` gives a row of a slot (groups,), p (groups, numbers). Lengths of slides are read off the frames, in which
    they are linear.
    """
    given = [  # angles are asked of no pair here
        Frame(rows(slot, X), rows(slot, Y), rows(slot, COS), rows(slot, SIN), np.zeros(len(p)))
        for slot in range(len(block_type.given_links))
    ]
    of = dict(zip((*block_type.given_links, *block_type.inner_links), (*given, *frames), strict=True)) | {
        "frame": GROUND
    }
    own: dict[tuple[str, str], Array] = {}
    first = 0
    for pair in block_type.mechanism.pairs:
        numbers = [p[:, first + k] for k in range(len(pair.number_kinds))]
        first += len(numbers)
        bodies, many = [of[link] for link in pair.bodies], len(pair.coordinate_kinds)
        if not many:
            continue
        still = np.array(pair.residual(bodies, numbers, [0.0] * many)[:2])
        for k, (part, _) in enumerate(pair.coordinate_kinds):
            unit = [float(j == k) for j in range(many)]
            way = np.array(pair.residual(bodies, numbers, unit)[:2]) - still
            own[pair.name, part] = -np.sum(way * still, axis=0) / np.sum(way * way, axis=0)
    own |= {(name, "angle"): frame.angle for name, frame in zip(block_type.inner_links, frames, strict=True)}
    e = block_type.equations
    names = [(e.coordinates[column].owner, e.coordinates[column].part) for column in e.unknowns]
    return np.stack([own[name] for name in names], axis=1)


def _fill_inputs(state: Array, linkages: LinkageArrays, first: Array) -> None:
    """Put the frame and the inputs into the places (places, rows, steps)."""
    state[0, COS] = 1.0
    where, value = first[linkages.inputs.owner] + linkages.inputs.link_index, linkages.inputs.value
    state[where, X] = value[:, None]
    state[where, COS] = np.where(linkages.inputs.is_angle, np.cos(value), 1.0)[:, None]
    state[where, SIN] = np.where(linkages.inputs.is_angle, np.sin(value), 0.0)[:, None]


def _sketch_sums(points: PointArrays, first: Array) -> Array:
    """The sums of points of every place (places, STATISTICS)."""
    px, py, tx, ty = points.numbers.T
    along, across = px * tx + py * ty, px * ty - py * tx
    squares = px * px + py * py + tx * tx + ty * ty
    where = first[points.owner] + points.link_index
    parts = (np.ones_like(px), px, py, tx, ty, along, across, squares)
    stats = [np.bincount(where, part, 1 + first[-1]) for part in parts]
    assert len(stats) == SKETCH_SUMS
    return np.stack(stats, axis=1)
