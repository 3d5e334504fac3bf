"""Run linkages that are partitioned into blocks: inputs, blocks and points of a linkage are blocks of one tape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any

import casadi as ca
import numpy as np

from planar.batch.march.prediction import LEAST_COSINE
from planar.batch.march.stops import SURE_DISTANCE, TURN
from planar.batch.mechanisms.block_type import (
    COS,
    POSE_ROWS,
    SIN,
    TURN1,
    TURN2,
    X1,
    X2,
    Y1,
    Y2,
    BlockType,
    X,
    Y,
    write_formula,
)
from planar.batch.mechanisms.initial_assembly import LEAST_CLEARANCE, LinkageAssemblies
from planar.batch.mechanisms.linkages import LinkageArrays, LinkArrays, SweepRequest, watched_links
from planar.batch.mechanisms.newton_march import compile_newton_block, step_table
from planar.batch.mechanisms.results import PointTable, between, dead_point_reason
from planar.batch.mechanisms.tape_runs import (
    DEAD_POINT_NUMBER,
    FIRST_ROOM_SLOT,
    FRAME,
    POINT_ROWS,
    STEP_TABLE,
    TABLE,
    TABLE_ANGLE,
    TABLE_COS,
    TABLE_SIN,
    BlockKinds,
    Endings,
    LinkageEnding,
    TapedLinkages,
    run_taped_linkages,
)
from planar.batch.named_results.design_frames import DesignFrames
from planar.codegen.tape import FormulaInput, TapeFormula, compile_block
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.foundation.geometry import Vector
from planar.model.mechanism import links_counting_turns, running_input_index
from planar.solving.stops import PairStops

RUNNING_INPUT, STANDING_INPUT, POINT, FIRST_BLOCK_TYPE = range(4)
"""Kinds of the blocks of a tape: types of blocks of links come last."""
INPUT_NUMBERS = 5
"""Numbers of an input: its position (rad or sizes), cosine and sine of it, its velocity and acceleration."""


def run_blocks(
    arrays: LinkageArrays,
    assemblies: LinkageAssemblies,
    points: PointTable,
    values: Array,
    endings: Endings,
    request: SweepRequest,
) -> None:
    """Run linkages block after block; `points` says which are results, and their rows in values.

    Behind these rows are those of the points of links that decide where pairs with stops are.
    """
    results = arrays.points([points.names(k) for k in arrays.which.tolist()])
    first_result = part_offsets(np.bincount(results.owner, minlength=len(arrays)))
    rows = np.arange(len(results.owner)) + (points.first[arrays.which] - first_result[:-1])[results.owner]
    watched = arrays.watched_points
    first_watched = points.first[-1] + part_offsets(np.bincount(watched.owner, minlength=len(arrays)))
    rows = np.concatenate([rows, np.arange(first_watched[0], first_watched[-1])])
    tape_points = LinkArrays(
        np.concatenate([results.owner, watched.owner]),
        np.concatenate([results.link_index, watched.link_index]),
        np.concatenate([results.numbers, watched.numbers]),
    )
    taped = _make_tape(arrays, assemblies.block_numbers, tape_points, rows).select(np.flatnonzero(assemblies.is_sure))
    find_endings = {
        int(arrays.which[k]): partial(_find_ending, arrays, k, np.arange(*first_watched[k : k + 2]), request.pair)
        for k in np.flatnonzero(np.diff(first_watched)).tolist()
    }
    kinds = _block_kinds([batch.block_type for batch in arrays.batches], request.rates)
    run_taped_linkages(taped, kinds, values, request.steps, endings, find_endings)
    is_dead = (endings.solved >= 0) & (endings.outcome == DEAD_POINT_NUMBER)
    for number in arrays.which[is_dead[arrays.which]].tolist():
        links = arrays.links_of_block(int(endings.links[number, 0]))
        endings.reasons[number] = dead_point_reason(links, endings.start[number] + endings.near[number])


def _find_ending(
    arrays: LinkageArrays,
    k: int,
    rows: IntArray,
    running_pair: str | None,
    rotation: Array,
    point_places: Callable[[IntArray], Array],
    good: int,
) -> LinkageEnding | None:
    """How a linkage ends whose pairs have stops, by two points of each watched link in `rows`; None if that is not
    sure."""
    mechanism, unit = arrays.mechanisms[k], float(arrays.unit[k])
    stops, counted = PairStops(mechanism, unit), links_counting_turns(mechanism)
    u = {given.pair: np.full((good, 1), given.position) for given in mechanism.inputs}
    is_long = stops.high - stops.low > TURN + SURE_DISTANCE
    if any(
        not counted.isdisjoint(pair.bodies) or (pair_is_long and pair.name not in u)
        for pair, pair_is_long in zip(stops.pairs, is_long.tolist(), strict=True)
    ):
        return None
    positions = arrays.start[k] + rotation
    u[mechanism.inputs[running_input_index(mechanism, running_pair, "inputs")].pair] = positions[:good, None]
    places = np.moveaxis(point_places(rows)[..., :good], 1, 2)[:, None, :, :, None]
    points = {link: (places[2 * n], places[2 * n + 1]) for n, link in enumerate(watched_links(mechanism))}
    frames = DesignFrames(mechanism, shapes_of_links(mechanism), u, points, unit)
    if not frames.is_clear[0]:
        return None
    values = np.array([frames.pair_value(pair.name)[0][:, 0] for pair in stops.pairs])
    ending = _find_first_stop(stops, values, np.array([angle[:, 0] for angle in frames.angles.values()]))
    if ending is None or (ending.outcome is Outcome.SOLVED and good < len(positions)):
        return None  # beside a dead point it is not clear which comes first
    if ending.outcome is Outcome.SOLVED:
        return ending
    near = between(positions[[max(ending.solved_steps - 1, 0), ending.solved_steps]])
    return ending._replace(reason=f"{ending.reason}, {near}")


def _find_first_stop(stops: PairStops, values: Array, angles: Array) -> LinkageEnding | None:
    """The ending at the first stop, by the values of pairs with stops (stops, steps) and the angles of links (links,
    steps); None if that is not clear."""
    low, high, scale = (bound[:, None] for bound in (stops.low, stops.high, stops.scale))
    counted_values = values + stops.turns(values[:, 0])[:, None]
    distances = np.minimum(counted_values - low, high - counted_values) / scale
    nearest = distances.min(axis=0)
    if nearest[0] < -SURE_DISTANCE:
        return LinkageEnding(0, Outcome.STOP, stops.describe_met(values[:, 0]))
    is_sure = stops.sure_rows(values, np.vstack([angles, values / scale]).T)
    if is_sure.all():
        return LinkageEnding(len(is_sure))
    first = int(np.argmin(is_sure))
    if first < 2 or nearest[first - 1] < SURE_DISTANCE or nearest[first] > -SURE_DISTANCE:
        return None
    k = int(np.argmin(distances[:, first]))
    is_upper = bool(values[k, first] > values[k, first - 1])
    return LinkageEnding(first, Outcome.STOP, stops.side(is_upper, k).describe(stops.motions, stops.mechanism.units))


def _make_tape(
    arrays: LinkageArrays, block_numbers: Sequence[Array], points: LinkArrays, rows: IntArray
) -> TapedLinkages:
    """The tape of all linkages: the inputs of a linkage, then its blocks, then its points, each to its row."""
    linkage_count, inputs = len(arrays), arrays.inputs
    block_owner = np.repeat(np.arange(linkage_count), np.diff(arrays.first_block))
    owners = inputs.owner, block_owner, points.owner
    first = part_offsets(np.bincount(np.concatenate(owners), minlength=linkage_count))
    # the blocks of a linkage in the order inputs, blocks of links, points
    order = np.argsort(np.concatenate(owners), kind="stable")
    position = np.empty_like(order)
    position[order] = np.arange(len(order))
    at_input, at_block, at_point = np.split(position, np.cumsum([len(owner) for owner in owners])[:-1])
    slots = np.full((first[-1], 1 + max(batch.block_type.slot_count for batch in arrays.batches)), FRAME)
    p = np.zeros((first[-1], max(INPUT_NUMBERS, *(values.shape[1] for values in block_numbers))))
    kinds, blocks = np.empty(first[-1], dtype=np.int64), np.full((first[-1], 2), -1)
    kinds[at_input], kinds[at_point] = np.where(arrays.is_running, RUNNING_INPUT, STANDING_INPUT), POINT
    p[at_input, :INPUT_NUMBERS] = inputs.numbers
    slots[at_input, 0], slots[at_input, 1] = TABLE, _slot_numbers(inputs.link_index)
    p[at_point, :2], p[at_point, 2] = points.numbers, arrays.unit[points.owner]
    slots[at_point, 0], slots[at_point, 1] = _slot_numbers(points.link_index), rows
    blocks[at_block] = np.arange(arrays.block_count)[:, None]
    for number, (batch, values) in enumerate(zip(arrays.batches, block_numbers, strict=True)):
        indices, kind = at_block[batch.block_numbers], batch.block_type
        kinds[indices] = FIRST_BLOCK_TYPE + number
        slots[indices, : kind.slot_count], slots[indices, kind.slot_count] = (
            _slot_numbers(batch.link_indices),
            STEP_TABLE,
        )
        p[indices, : values.shape[1]] = values
    clearance = np.full(linkage_count, LEAST_CLEARANCE)
    return TapedLinkages(arrays.which, first, kinds, slots, p, blocks, arrays.tolerance, clearance)


def _slot_numbers(link_indices: IntArray) -> IntArray:
    return np.where(link_indices > 0, FIRST_ROOM_SLOT + 1 - link_indices, FRAME)


def _block_kinds(types: Sequence[BlockType], rates: bool) -> BlockKinds:
    def compile_kind(number: int, polished: bool) -> Any:
        if number == POINT:
            return compile_block(point_formula(rates))
        if number < FIRST_BLOCK_TYPE:
            return compile_block(input_formula(number == RUNNING_INPUT, rates))
        kind = types[number - FIRST_BLOCK_TYPE]
        if not kind.has_closed_form:
            return compile_newton_block(kind, rates)
        wide, inner = _pose_rows(rates), range(kind.slot_count - len(kind.inner_links), kind.slot_count)
        rows = tuple((slot, row) for slot in inner for row in range(wide))
        directions = tuple((wide * k + COS, wide * k + SIN, None) for k in range(len(inner)))
        formula = TapeFormula(kind.run_formula(rates, polished), rows, directions, is_checked=True)
        return compile_block(formula, LEAST_COSINE)

    has_newton_blocks = not all(kind.has_closed_form for kind in types)
    return BlockKinds(compile_kind, _pose_rows(rates), {COS: 1.0}, step_table if has_newton_blocks else None)


def _pose_rows(rates: bool) -> int:
    return POSE_ROWS + 6 if rates else POSE_ROWS


@lru_cache
def input_formula(is_running: bool, rates: bool) -> TapeFormula:
    """The position of an input, cosine and sine of it, and its rates, from its numbers and the rotation of
    the inputs."""

    def write(table: ca.SX, numbers: ca.SX) -> list[ca.SX]:
        if is_running:
            c, s = Vector(numbers[1], numbers[2]).rotate(Vector(table[TABLE_COS], table[TABLE_SIN]))
            return [numbers[0] + table[TABLE_ANGLE], c, s, numbers[3:]]
        return [numbers[:3], ca.SX.zeros(2)]

    rows = (X, COS, SIN, X1, X2) if rates else (X, COS, SIN)
    table = [FormulaInput("row", 0, row) for row in (TABLE_COS, TABLE_SIN, TABLE_ANGLE)]
    formula = write_formula([table, [FormulaInput("p", k) for k in range(INPUT_NUMBERS)]], write)
    return TapeFormula(formula, tuple((1, row) for row in rows))


@lru_cache
def point_formula(rates: bool) -> TapeFormula:
    """x and y of a point, then of its first and second rates, from its link's pose and rates.

    Numbers: the point in its link (m), then the unit of lengths of the linkage (m).
    """

    def write(link: ca.SX, numbers: ca.SX) -> list[ca.SX]:
        arm = ca.vertcat(*map(ca.SX, Vector(numbers[0], numbers[1]).rotate(Vector(link[COS], link[SIN]))))
        rows = [numbers[2] * link[[X, Y]] + arm]
        if rates:
            across = ca.vertcat(-arm[1], arm[0])
            rows.append(numbers[2] * link[[X1, Y1]] + link[TURN1] * across)
            rows.append(numbers[2] * link[[X2, Y2]] + link[TURN2] * across - link[TURN1] ** 2 * arm)
        return rows

    link = [FormulaInput("row", 0, row) for row in range(_pose_rows(rates))]
    formula = write_formula([link, [FormulaInput("p", k) for k in range(3)]], write)
    return TapeFormula(formula, tuple((1, row) for row in range(POINT_ROWS[rates])))
