"""Linkages that are partitioned into blocks as tapes: inputs, blocks of links and points are the blocks of a tape."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from planar.batch.march.prediction import step_table
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
from planar.batch.mechanisms.linkages import LinkageArrays, LinkArrays
from planar.batch.mechanisms.tape_runs import (
    FIRST_ROOM_SLOT,
    FRAME,
    POINT_ROWS,
    TABLE,
    TABLE_ANGLE,
    TABLE_COS,
    TABLE_SIN,
    BlockKinds,
    TapedLinkages,
)
from planar.codegen.tape import FormulaInput, TapeFormula, compile_block
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.geometry import Vector

RUNNING_INPUT, STANDING_INPUT, POINT, FIRST_BLOCK_TYPE = range(4)
"""Kinds of the blocks of a tape: types of blocks of links come last."""
INPUT_NUMBERS = 5
"""Numbers of an input: its position (rad or sizes), cosine and sine of it, its velocity and acceleration."""
LEAST_CLEARANCE = 1e-4
"""Minimum distance measure from a dead point of an assembly that is taken."""


def make_tape(
    arrays: LinkageArrays,
    block_numbers: Sequence[Array],
    link_slots: Callable[[IntArray, IntArray], IntArray],
    last_slots: Sequence[IntArray | int],
    points: LinkArrays,
    point_rows: IntArray,
) -> TapedLinkages:
    """The tape of all linkages: the inputs of a linkage, then its blocks, then its points.

    `link_slots` returns the slots of links by the numbers of linkages and the places of links in them. Of every batch
    there are the numbers (blocks, numbers) and the slots after those of links; of points their rows in the results.
    """
    linkage_count, inputs = len(arrays), arrays.inputs
    block_owner = np.repeat(np.arange(linkage_count), np.diff(arrays.first_block))
    owners = np.concatenate([inputs.owner, block_owner, points.owner])
    first = part_offsets(np.bincount(owners, minlength=linkage_count))
    position = np.empty_like(owners)
    position[np.argsort(owners, kind="stable")] = np.arange(len(owners))
    at_input, at_block, at_point = np.split(position, np.cumsum([len(inputs.owner), len(block_owner)]))
    slots = np.full((first[-1], 1 + max(batch.block_type.slot_count for batch in arrays.batches)), FRAME)
    p = np.zeros((first[-1], max(INPUT_NUMBERS, *(values.shape[1] for values in block_numbers))))
    kinds, links = np.empty(first[-1], dtype=np.int64), np.full((first[-1], 2), -1)
    kinds[at_input], kinds[at_point] = np.where(arrays.is_running, RUNNING_INPUT, STANDING_INPUT), POINT
    p[at_input, :INPUT_NUMBERS] = inputs.numbers
    slots[at_input, 0], slots[at_input, 1] = TABLE, link_slots(inputs.owner, inputs.link_index)
    p[at_point, :2], p[at_point, 2] = points.numbers, arrays.unit[points.owner]
    slots[at_point, 0], slots[at_point, 1] = link_slots(points.owner, points.link_index), point_rows
    links[at_block] = np.arange(arrays.block_count)[:, None]
    for number, (batch, values, last) in enumerate(zip(arrays.batches, block_numbers, last_slots, strict=True)):
        indices, slot_count = at_block[batch.block_numbers], batch.block_type.slot_count
        kinds[indices] = FIRST_BLOCK_TYPE + number
        slots[indices, :slot_count] = link_slots(batch.owner[:, None], batch.link_indices)
        slots[indices, slot_count] = last
        p[indices, : values.shape[1]] = values
    clearance = np.full(linkage_count, LEAST_CLEARANCE)
    return TapedLinkages(arrays.which, first, kinds, slots, p, links, arrays.tolerance, clearance)


def temporary_slots(_owner: IntArray, link_index: IntArray) -> IntArray:
    """The slots of links that linkages share, one linkage after the other."""
    return np.where(link_index > 0, FIRST_ROOM_SLOT + 1 - link_index, FRAME)


def make_block_kinds(types: Sequence[BlockType], rates: bool, is_start: bool = False) -> BlockKinds:
    """The functions of inputs, points and blocks of these types; at the start closed forms choose the assembly."""

    def compile_kind(number: int, polished: bool) -> Any:
        if number == POINT:
            return compile_block(point_formula(rates))
        if number < FIRST_BLOCK_TYPE:
            return compile_block(input_formula(number == RUNNING_INPUT, rates))
        kind = types[number - FIRST_BLOCK_TYPE]
        return kind.start_function if is_start and kind.has_closed_form else kind.run_function(rates, polished)

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
