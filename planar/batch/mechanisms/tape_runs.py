"""Linkages of any structure as tapes, one sequence of blocks for every linkage, and their runs over one turn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache
from math import ceil
from typing import Any, NamedTuple

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
from planar.codegen.tape import (
    DEAD_POINT,
    LANES,
    UNDECIDED,
    FormulaInput,
    Tape,
    TapeFormula,
    TapeResult,
    compile_block,
    padded_steps,
    run_tape,
)
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.foundation.geometry import Vector

FULL_TURN = 2.0 * np.pi
LONGEST_INPUT_STEP, REFINEMENT = 0.07, 8
"""Longest input step (rad) that is not divided, so that a position stays near the previous one; and the factor by which
the steps of undecided linkages are divided again."""
MAX_FINE_BYTES = 16 * 2**20
"""Maximum size in bytes of the result points at divided steps that are computed at once."""
POINT_ROWS = {False: 2, True: 6}
"""Rows of a point, without and with rates: x and y, then their first rates, then the second ones."""
TABLE, FRAME, STEP_TABLE = -1, -2, -3
"""Slots that all linkages of a tape share: the rotation of the inputs, as cosine, sine and angle in its rows; the
frame; and the table of steps for Newton's method. Slots below them are temporary, and every linkage overwrites them;
slots from 0 on are the result points."""
FIRST_ROOM_SLOT = -4
TABLE_COS, TABLE_SIN, TABLE_ANGLE = range(3)
"""Rows of the table."""


ATTEMPTS = (1, False), (1, True), (REFINEMENT, True), (REFINEMENT**2, True)
"""By which factor steps are divided, and whether closed forms are followed by a Newton step; each attempt runs the
linkages that the previous ones did not decide."""


class BlockKinds(NamedTuple):
    """The kinds of the blocks of a tape: the function of a kind by its number, polished or not; how many rows a slot of
    room has; the frame's rows; and the table of steps that Newton's method solves, by how many there are and how long
    they are."""

    compile: Callable[[int, bool], Any]
    room_rows: int
    frame_rows: Mapping[int, float] = {}
    step_table: Callable[[int, float], Array] | None = None


class TapedLinkages(NamedTuple):
    """Linkages, `which` (taped,) by their numbers in a part, as sequences of blocks on a tape: those of linkage k from
    first[k] to first[k + 1]; of every block the number of its kind, its `slots` (blocks, slots), its numbers p (blocks,
    numbers), and which `links` (blocks, 2) it places; the `tolerance` of residuals and the least `clearance`
    (taped,)."""

    which: IntArray
    first: IntArray
    kinds: IntArray
    slots: IntArray
    p: Array
    links: IntArray
    tolerance: Array
    clearance: Array

    def select(self, numbers: IntArray) -> TapedLinkages:
        """The linkages of these indices (rising)."""
        if len(numbers) == len(self.which):
            return self
        counts = np.diff(self.first)[numbers]
        first = part_offsets(counts)
        indices = np.repeat(self.first[numbers] - first[:-1], counts) + np.arange(first[-1])
        kinds, slots, p, links = (values[indices] for values in (self.kinds, self.slots, self.p, self.links))
        tolerance, clearance = self.tolerance[numbers], self.clearance[numbers]
        return TapedLinkages(self.which[numbers], first, kinds, slots, p, links, tolerance, clearance)


class Endings(NamedTuple):
    """How the linkages of a part end (linkages,): where the input of each starts (rad), the number of solved steps (-1
    until it is decided), and the number of the outcome that ends them. For dead points also the `links` of the tape
    that come to it (linkages, 2), and between which rotations of the input (linkages, 2), in rad; for others the
    reasons by the numbers of linkages. `general_inputs`: where the input is (steps + 1,) of those that the general path
    solved."""

    start: Array
    solved: IntArray
    outcome: IntArray
    links: IntArray
    near: Array
    reasons: dict[int, str]
    general_inputs: dict[int, Array]

    @classmethod
    def undecided(cls, start: Array) -> Endings:
        """The endings of a part before anything is decided."""
        solved, outcome = np.full(len(start), -1), np.zeros(len(start), dtype=np.int64)
        links, near = np.zeros((len(start), 2), dtype=np.int64), np.zeros((len(start), 2))
        return cls(start, solved, outcome, links, near, {}, {})


FindStop = Callable[[Array, Callable[[IntArray], Array], int], tuple[int, str] | None]
"""Returns the number of solved steps of a linkage with stops, and the stop that ends it in words, empty if there is
none; None if that is not sure. The arguments are the rotations of its inputs (steps,), a function that returns x and y
of result points (points, 2, steps), and the number of good steps."""


class PreparedTape(NamedTuple):
    """Linkages on a tape whose result points are rows of a part, the kinds of its blocks without and with rates, and
    functions for the linkages with stops by their numbers."""

    taped: TapedLinkages
    make_kinds: Callable[[bool], BlockKinds]
    find_stops: Mapping[int, FindStop] = {}


def run_taped_linkages(
    tape: PreparedTape, values: Array, steps: int, endings: Endings, turn: float = FULL_TURN
) -> None:
    """Run linkages while their inputs turn (rad): values (points, `POINT_ROWS`, numbers), see `make_values`, and the
    `endings` are filled. Other solvers take what no attempt decides."""
    taped, kinds = tape.taped, tape.make_kinds(values.shape[1] == POINT_ROWS[True])
    undecided = np.arange(len(taped.which))
    for refinement, polished in ATTEMPTS if len(undecided) else ():
        finer = max(ceil(abs(turn) / steps / LONGEST_INPUT_STEP), 1) * refinement
        for indices in _chunks(taped, undecided, padded_steps(steps * finer + 1) * values.shape[1] * 8, finer > 1):
            part = tape._replace(taped=taped.select(indices))
            _run_once(part, kinds, polished, values, steps, finer, endings, turn)
        undecided = undecided[endings.solved[taped.which[undecided]] < 0]
        if not undecided.size:
            break


def make_values(points: int, steps: int, rates: bool, dtype: str = "float64") -> Array:
    """Allocate points (points, rows, numbers); rows are padded to a multiple of LANES."""
    shape = points, POINT_ROWS[rates], padded_steps(steps + 1)
    size = int(np.prod(shape))
    made = np.empty(size + LANES, dtype)
    first = -(made.ctypes.data // made.itemsize) % LANES
    return made[first : first + size].reshape(shape)


def _chunks(taped: TapedLinkages, indices: IntArray, point_bytes: int, is_divided: bool) -> Iterator[IntArray]:
    """Yield parts of the linkages whose result points at divided steps fit into `MAX_FINE_BYTES`."""
    if not is_divided:
        yield indices
        return
    point_counts = np.add.reduceat((taped.slots >= 0).sum(axis=1), taped.first[:-1])
    ends = np.cumsum(point_counts[indices] * point_bytes)
    first = 0
    while first < len(indices):
        size_before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, size_before + MAX_FINE_BYTES, side="right")), first + 1)
        yield indices[first:last]
        first = last


def run_steps(
    taped: TapedLinkages, kinds: BlockKinds, polished: bool, points: Array, rotation: Array, count: int
) -> TapeResult:
    """Compute the result points (points, rows, numbers) of linkages at `count` `rotations` of their inputs."""
    stride, slots = padded_steps(count), taped.slots
    room = np.empty((max(-int(slots.min()), -1 - FIRST_ROOM_SLOT), max(kinds.room_rows, 1 + TABLE_ANGLE), stride))
    room[-1 - TABLE, : 1 + TABLE_ANGLE] = np.cos(rotation), np.sin(rotation), rotation
    if kinds.frame_rows:
        room[-1 - FRAME] = 0.0
        for row, value in kinds.frame_rows.items():
            room[-1 - FRAME, row] = value
    addresses = np.where(
        slots >= 0, points.ctypes.data + slots * points.strides[0], room.ctypes.data + (-1 - slots) * room.strides[0]
    )
    if kinds.step_table is not None:
        table = np.ascontiguousarray(kinds.step_table(count, float(rotation[1])))
        addresses[slots == STEP_TABLE] = table.ctypes.data
    present = np.flatnonzero(np.bincount(taped.kinds))
    numbers = np.zeros(present[-1] + 1, dtype=np.int64)
    numbers[present] = np.arange(len(present))
    tape = Tape(taped.first, numbers[taped.kinds], addresses, taped.p, taped.tolerance, taped.clearance)
    return run_tape([kinds.compile(k, polished) for k in present.tolist()], count, tape)


def rotations(count: int, turn: float) -> Array:
    """How far the inputs are turned at `count` steps, padded (rad)."""
    return np.arange(padded_steps(count)) * (turn / max(count - 1, 1))


def _run_once(
    tape: PreparedTape,
    kinds: BlockKinds,
    polished: bool,
    values: Array,
    steps: int,
    finer: int,
    endings: Endings,
    turn: float,
) -> None:
    """Run linkages with steps divided by a factor, and note the endings of those that this decides."""
    taped, count, points = tape.taped, steps * finer + 1, values
    if finer > 1:
        is_result = taped.slots >= 0
        rows, places = np.unique(taped.slots[is_result], return_inverse=True)
        points, slots = np.empty((len(rows), values.shape[1], padded_steps(count))), taped.slots.copy()
        slots[is_result] = places
        taped = taped._replace(slots=slots)
    rotation = rotations(count, turn)
    good, outcome, last_blocks = run_steps(taped, kinds, polished, points, rotation, count)
    if finer > 1:
        values[rows, :, : steps + 1] = points[:, :, :count:finer]
    which, is_sure, is_dead = taped.which, outcome != UNDECIDED, outcome == DEAD_POINT
    endings.solved[which[is_sure]] = (good[is_sure] - 1) // finer + 1
    first_bad, dead = good[is_dead], which[is_dead]
    endings.outcome[dead], endings.links[dead] = Outcome.DEAD_POINT.code, taped.links[last_blocks[is_dead]]
    endings.near[dead] = np.stack([rotation[first_bad - 1], rotation[first_bad]], axis=1)

    def point_places(result_rows: IntArray) -> Array:
        indices = np.searchsorted(rows, result_rows) if finer > 1 else result_rows
        return points[indices, :2, :count]

    for k, number in enumerate(which.tolist()) if tape.find_stops else ():
        if number not in tape.find_stops or not good[k]:
            continue
        ending = tape.find_stops[number](rotation[:count], point_places, int(good[k]))
        if ending is None:
            endings.solved[number] = -1
            continue
        endings.solved[number] = (ending[0] - 1) // finer + 1
        if ending[1]:
            endings.outcome[number], endings.reasons[number] = Outcome.STOP.code, ending[1]


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
