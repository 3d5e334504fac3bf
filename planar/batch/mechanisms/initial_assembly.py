"""The assemblies nearest to their sketches of many linkages at once, block after block."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import is_at_sketch, is_surely_farther
from planar.batch.march.prediction import CLEAR_REGULARITY
from planar.batch.mechanisms.block_type import COS, MAX_SIGNS, POSE_ROWS, SIN, SKETCH_SUMS, BlockType, X
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
    the signs of all blocks (blocks, MAX_SIGNS), or the unknowns of those that Newton's method follows (blocks,
    MAX_UNKNOWNS)."""

    is_sure: BoolArray
    signs: Array
    z: Array


def find_start_assemblies(linkages: LinkageArrays) -> StartAssemblies:
    """See `StartAssemblies`.

    A way to assemble a block is taken where it is nearer to the sketch than any other by more than all blocks of the
    linkage together are away from it: whatever else were taken, the whole would lie farther off. Blocks that are not in
    closed form are solved from where they are shown: their points lie at the sketch, and the slope is so regular that
    no other assembly is near, see `BlockAssemblies`.
    """
    many = len(linkages)
    first = np.concatenate([[0], np.cumsum(linkages.link_counts)])
    state = np.zeros((1 + first[-1], POSE_ROWS, LANES))
    _fill_inputs(state, linkages, first)
    sums = _sketch_sums(linkages.sketch, first)
    shown: _ShownFrames | None = None
    starts: list[_BatchStart] = []
    for batch in linkages.batches:
        kind, index = batch.block_type, batch.state_indices(first)
        if kind.has_closed_form:
            p = np.hstack([batch.p, sums[index[:, batch.inner_slots]].reshape(len(index), -1)])
            rows = [(slot, row) for slot in range(kind.slot_count)[batch.inner_slots] for row in range(POSE_ROWS)]
            rows += [(kind.slot_count, row) for row in range(kind.sign_count + JUDGED_ROWS)]
            function = compile_block(TapeFormula(kind.start_formula, tuple(rows)))
            starts.append(_BatchStart(batch, index, p, function))
        else:
            shown = _shown_frames(linkages, first) if shown is None else shown
            z, is_shown = _unknowns_from_frames(kind, shown, index, batch.p)
            p = newton_numbers(kind, batch.p, z)
            starts.append(_BatchStart(batch, index, p, compile_newton_block(kind, False), z, is_shown))
    is_sure, judged = _run_starts(linkages, state, starts)

    cost = np.zeros(many)
    margins: list[tuple[Array, Array]] = []
    signs, z = np.ones((linkages.block_count, MAX_SIGNS)), np.zeros((linkages.block_count, MAX_UNKNOWNS))
    for start in starts:
        batch, kind, unknowns = start.batch, start.batch.block_type, start.unknowns
        inner = start.places[:, batch.inner_slots]
        if unknowns is None or start.is_shown is None:
            own = judged[batch.block_numbers, :, 0]
            signs[batch.block_numbers, : kind.sign_count] = own[:, : kind.sign_count]
            nearest, second, left, clear = own[:, kind.sign_count : kind.sign_count + JUDGED_ROWS].T
            with np.errstate(invalid="ignore"):
                good = left <= START_TOLERANCE_FACTOR * linkages.tolerance[batch.owner]
                good &= ~(clear < LEAST_CLEARANCE)
            # what can be assembled in one way alone may lie far off where others are
            distance = np.where(good, np.maximum(nearest, 0.0), 0.0)
            margins.append((batch.owner, second - nearest))
        else:
            z[batch.block_numbers, : unknowns.shape[1]] = unknowns
            distance, points = _distance_to_sketch(state[inner, :, 0], sums[inner]), sums[inner, 0].sum(axis=1)
            good = start.is_shown & (points > 0.0) & is_at_sketch(distance, points)
        is_sure[batch.owner[~good]] = False
        cost += np.bincount(batch.owner, distance, many)
    for owner, margin in margins:
        is_sure[owner[~is_surely_farther(margin, cost[owner], roundings=2)]] = False
    return StartAssemblies(is_sure, signs, z)


JUDGED_ROWS = 4
"""Rows that are told of a start in closed form after its signs: see `BlockType.start_formula`."""


class _BatchStart(NamedTuple):
    """How a batch of blocks starts: its places in the state, numbers and function; and for those that are not in closed
    form the unknowns (blocks, unknowns) from which they are solved, and which of them are shown (blocks,)."""

    batch: BlockBatch
    places: IntArray
    p: Array
    function: Any
    unknowns: Array | None = None
    is_shown: BoolArray | None = None


def _run_starts(linkages: LinkageArrays, state: Array, starts: Sequence[_BatchStart]) -> tuple[BoolArray, Array]:
    """Fill the state, linkage after linkage: which of them are closed, and what is told of blocks (blocks, rows)."""
    many, blocks = len(linkages), linkages.block_count
    judged = np.zeros((blocks, MAX_SIGNS + JUDGED_ROWS, LANES))
    table, owner, kinds = step_table(1, 0.0), *np.zeros((2, blocks), dtype=np.int64)
    slots = np.zeros((blocks, 1 + max(start.batch.block_type.slot_count for start in starts)), dtype=np.int64)
    p = np.zeros((blocks, max(start.p.shape[1] for start in starts)))
    for number, (batch, index, own, _, unknowns, _) in enumerate(starts):
        at, last = batch.block_numbers, batch.block_type.slot_count
        owner[at], kinds[at], p[at, : own.shape[1]] = batch.owner, number, own
        slots[at, :last] = state.ctypes.data + index * state.strides[0]
        slots[at, last] = judged.ctypes.data + at * judged.strides[0] if unknowns is None else table.ctypes.data
    first = np.concatenate([[0], np.cumsum(np.bincount(owner, minlength=many))])
    tolerance, clearance = START_TOLERANCE_FACTOR * linkages.tolerance, np.full(many, CLEAR_REGULARITY**2)
    result = run_tape([start.function for start in starts], 1, Tape(first, kinds, slots, p, tolerance, clearance))
    return result.good > 0, judged


def _distance_to_sketch(poses: Array, sums: Array) -> Array:
    """Squared distances of points of inner links (blocks, links) to the sketch, from their sums there."""
    x, y, c, s = np.moveaxis(poses, 2, 0)
    many, px, py, tx, ty, along, across, squares = np.moveaxis(sums, 2, 0)
    with np.errstate(invalid="ignore", over="ignore"):
        mixed = x * (c * px - s * py - tx) + y * (s * px + c * py - ty) - c * along - s * across
        return np.maximum(np.sum(many * (x * x + y * y) + 2.0 * mixed + squares, axis=1), 0.0)


class _ShownFrames(NamedTuple):
    """Where links are shown (places,), and which of them are."""

    frame: Frame
    is_known: BoolArray


def _shown_frames(linkages: LinkageArrays, first: IntArray) -> _ShownFrames:
    """By the points of links, two at least that lie apart; the mechanism's frame is where it is."""
    many, px, py, tx, ty, along, across, _ = _sketch_sums(linkages.shown_points, first).T
    least = np.maximum(many, 1.0)
    turn = along - (px * tx + py * ty) / least, across - (px * ty - py * tx) / least
    is_known = (many > 1.0) & (np.hypot(*turn) > LEAST_SPREAD)
    angle = np.arctan2(turn[1], turn[0])
    angle[0], is_known[0] = 0.0, True
    c, s = np.cos(angle), np.sin(angle)
    x, y = (tx - c * px + s * py) / least, (ty - s * px - c * py) / least
    x[0] = y[0] = 0.0
    return _ShownFrames(Frame(x, y, c, s, angle), is_known)


def _unknowns_from_frames(
    block_type: BlockType, shown: _ShownFrames, index: IntArray, p: Array
) -> tuple[Array, BoolArray]:
    """The unknowns (blocks, unknowns) of blocks whose links are shown so, and which of them are (blocks,); p (blocks,
    numbers). Lengths of slides are read off the frames, in which they are linear.
    """
    given_count, inner_count = len(block_type.given_links), len(block_type.inner_links)
    slots = [*range(given_count), *range(block_type.slot_count)[-inner_count:]]
    of = {"frame": GROUND}
    for name, slot in zip((*block_type.given_links, *block_type.inner_links), slots, strict=True):
        of[name] = Frame(*(part[index[:, slot]] for part in shown.frame[:5]))
    needed = slots if not all(block_type.unknown_is_angle) else slots[given_count:]
    is_shown = np.all(shown.is_known[index[:, needed]], axis=1)
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
    own |= {(name, "angle"): of[name].angle for name in block_type.inner_links}
    e = block_type.equations
    names = [(e.coordinates[column].owner, e.coordinates[column].part) for column in e.unknowns]
    return np.stack([own[name] for name in names], axis=1), is_shown


def _fill_inputs(state: Array, linkages: LinkageArrays, first: IntArray) -> None:
    """Put the frame and the inputs into the places (places, rows, steps)."""
    state[0, COS] = 1.0
    where, value = first[linkages.inputs.owner] + linkages.inputs.link_index, linkages.inputs.value
    state[where, X] = value[:, None]
    state[where, COS] = np.where(linkages.inputs.is_angle, np.cos(value), 1.0)[:, None]
    state[where, SIN] = np.where(linkages.inputs.is_angle, np.sin(value), 0.0)[:, None]


def _sketch_sums(points: PointArrays, first: IntArray) -> Array:
    """The sums of points of every place (places, STATISTICS)."""
    px, py, tx, ty = points.numbers.T
    along, across = px * tx + py * ty, px * ty - py * tx
    squares = px * px + py * py + tx * tx + ty * ty
    where = first[points.owner] + points.link_index
    parts = (np.ones_like(px), px, py, tx, ty, along, across, squares)
    stats = [np.bincount(where, part, 1 + first[-1]) for part in parts]
    assert len(stats) == SKETCH_SUMS
    return np.stack(stats, axis=1)
