"""All positions of linkages that are partitioned into blocks: inputs, blocks and points of each on one tape."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

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
from planar.batch.mechanisms.initial_assembly import LEAST_CLEARANCE, StartAssemblies, find_linkage_assemblies
from planar.batch.mechanisms.linkages import BlockBatch, LinkageArrays, SweepRequest, make_linkage_arrays
from planar.batch.mechanisms.newton_march import compile_newton_block, newton_numbers, step_table
from planar.batch.mechanisms.results import Swept, swept_from_rows
from planar.batch.mechanisms.tape_runs import (
    DEAD_POINT_NUMBER,
    FIRST_ROOM_SLOT,
    FRAME,
    FULL_TURN,
    LEAST_COSINE,
    POINT_ROWS,
    STEP_TABLE,
    TABLE,
    TABLE_ANGLE,
    TABLE_COS,
    TABLE_SIN,
    BlockKinds,
    FineRun,
    LinkageEnding,
    TapedLinkages,
    clear_points,
    make_values,
    run_taped_linkages,
)
from planar.batch.stop_checks import find_first_stop, watched_links
from planar.codegen.tape import FormulaInput, TapeFormula, compile_block
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.foundation.geometry import Vector
from planar.model.mechanism import Mechanism, running_input_index

RUNNING_INPUT, STANDING_INPUT, POINT, FIRST_BLOCK_TYPE = range(4)
"""Kinds of the blocks of a tape: types of blocks of links come last."""
INPUT_NUMBERS = 5
"""Numbers of an input: its position (rad or sizes), cosine and sine of it, its velocity and acceleration."""


def solve_by_blocks(mechanisms: Sequence[Mechanism], request: SweepRequest) -> dict[int, Swept]:
    """Of mechanisms, by their numbers, all those that can be partitioned into blocks of links, and are sure."""
    arrays = make_linkage_arrays(mechanisms, request)
    if arrays is None:
        return {}
    start = find_linkage_assemblies(arrays)
    names = [request.point_names(structure) for structure in arrays.structures]
    first_point = part_offsets([len(own) for own in names])
    first_watched = first_point[-1] + part_offsets(np.bincount(arrays.watched_points.owner, minlength=len(arrays)))
    values = make_values(int(first_watched[-1]), request.steps, request.rates)
    taped = _make_tape(arrays, start).select(np.flatnonzero(start.is_sure))
    kinds = _block_kinds([batch.block_type for batch in arrays.batches], request.rates)

    def find_ending(number: int, run: FineRun) -> LinkageEnding | None:
        places = run.places(np.arange(first_watched[number], first_watched[number + 1]))
        return _find_ending(arrays, number, run, places, request)

    watched = np.diff(first_watched)[taped.which] > 0
    run = run_taped_linkages(taped, kinds, values, request.steps, request.rates, find_ending, watched)
    stopped = np.flatnonzero(run.is_decided & (run.solved <= request.steps))
    clear_points(values, first_point, taped.which[stopped], run.solved[stopped])
    turned = np.linspace(0.0, 1.0, request.steps + 1) * FULL_TURN
    swept = {}
    for k in np.flatnonzero(run.is_decided).tolist():
        number = int(taped.which[k])
        reason = run.reasons.get(k, "")
        if run.outcome[k] == DEAD_POINT_NUMBER:
            links, near = arrays.links_of_block(int(run.block[k])), arrays.start[number] + run.near[k]
            reason = f"links {links} come to a dead point {_between(near)}"
        ending = int(run.solved[k]), int(run.outcome[k]), reason
        rows = values[first_point[number] : first_point[number + 1], :, : request.steps + 1]
        swept[int(arrays.which[number])] = swept_from_rows(names[number], rows, arrays.start[number] + turned, *ending)
    return swept


def _find_ending(
    arrays: LinkageArrays, number: int, run: FineRun, places: Array, request: SweepRequest
) -> LinkageEnding | None:
    """How a linkage ends whose pairs have stops; None where that is not sure. places (two of each watched link, 2,
    steps)."""
    mechanism, step_count = arrays.mechanisms[number], run.good
    point_places = np.moveaxis(places[..., :step_count], 1, 2)
    pair = mechanism.inputs[running_input_index(mechanism, request.pair, "inputs")].pair
    links = watched_links(mechanism)
    link_places = {link: (point_places[2 * k], point_places[2 * k + 1]) for k, link in enumerate(links)}
    positions = arrays.start[number] + run.turned
    met = find_first_stop(mechanism, float(arrays.unit[number]), pair, positions[:step_count], link_places)
    if met is None or (met.step is None and step_count < len(positions)):
        return None  # beside a dead point it is not clear which comes first
    if met.step is None:
        return LinkageEnding(step_count)
    near = _between(positions[[max(met.step - 1, 0), met.step]])
    return LinkageEnding(met.step, Outcome.STOP, f"{met.reason}, {near}")


def _between(inputs: Array) -> str:
    return f"at an input of {inputs[0]:.6g} to {inputs[1]:.6g} rad"


def _make_tape(arrays: LinkageArrays, start: StartAssemblies) -> TapedLinkages:
    """The tape of all linkages: the inputs of a linkage, then its blocks, then its result points."""
    linkage_count, inputs = len(arrays), arrays.inputs
    points = arrays.points.followed_by(arrays.watched_points)
    block_owner = np.repeat(np.arange(linkage_count), np.diff(arrays.first_block))
    owners = inputs.owner, block_owner, points.owner
    first = part_offsets(np.bincount(np.concatenate(owners), minlength=linkage_count))
    # the blocks of a linkage in the order inputs, blocks of links, points
    order = np.argsort(np.concatenate(owners), kind="stable")
    position = np.empty_like(order)
    position[order] = np.arange(len(order))
    at_input, at_block, at_point = np.split(position, np.cumsum([len(owner) for owner in owners])[:-1])
    numbers = [_block_numbers(batch, start) for batch in arrays.batches]
    slots = np.full((first[-1], 1 + max(batch.block_type.slot_count for batch in arrays.batches)), FRAME)
    p = np.zeros((first[-1], max(INPUT_NUMBERS, *(values.shape[1] for values in numbers))))
    kinds, blocks = np.empty(first[-1], dtype=np.int64), np.full(first[-1], -1)
    kinds[at_input], kinds[at_point] = np.where(inputs.runs, RUNNING_INPUT, STANDING_INPUT), POINT
    p[at_input, :INPUT_NUMBERS] = np.stack(
        [inputs.value, *inputs.cos_and_sin(), inputs.velocity, inputs.acceleration], axis=1
    )
    slots[at_input, 0], slots[at_input, 1] = TABLE, _slot_numbers(inputs.link_index)
    p[at_point, :2], p[at_point, 2] = points.numbers, arrays.unit[points.owner]
    slots[at_point, 0], slots[at_point, 1] = _slot_numbers(points.link_index), np.arange(len(at_point))
    blocks[at_block] = np.arange(arrays.block_count)
    for number, (batch, values) in enumerate(zip(arrays.batches, numbers, strict=True)):
        indices, kind = at_block[batch.block_numbers], batch.block_type
        kinds[indices] = FIRST_BLOCK_TYPE + number
        slots[indices, : kind.slot_count], slots[indices, kind.slot_count] = (
            _slot_numbers(batch.link_indices),
            STEP_TABLE,
        )
        p[indices, : values.shape[1]] = values
    clearance = np.full(linkage_count, LEAST_CLEARANCE)
    return TapedLinkages(np.arange(linkage_count), first, kinds, slots, p, blocks, arrays.tolerance, clearance)


def _slot_numbers(link_indices: IntArray) -> IntArray:
    return np.where(link_indices > 0, FIRST_ROOM_SLOT + 1 - link_indices, FRAME)


def _block_numbers(batch: BlockBatch, start: StartAssemblies) -> Array:
    """The numbers of blocks as the functions of their kind take them."""
    kind = batch.block_type
    if kind.has_closed_form:
        return np.hstack([batch.p, start.signs[batch.block_numbers, : kind.sign_count]])
    return newton_numbers(kind, batch.p, start.z[batch.block_numbers, : len(kind.unknown_is_angle)])


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

    return BlockKinds(compile_kind, _pose_rows(rates), {COS: 1.0}, step_table)


def _pose_rows(rates: bool) -> int:
    return POSE_ROWS + 6 if rates else POSE_ROWS


@lru_cache
def input_formula(is_running: bool, rates: bool) -> TapeFormula:
    """The position of an input, cosine and sine of it, and its rates, from its numbers and how far inputs have
    turned."""

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

    Numbers: the point in its link (m), then what the link's own lengths are multiplied by.
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
