"""Run linkages of any structure as tapes: a sequence of blocks for every linkage, over one turn of the inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.tape import DEAD_POINT, LANES, UNDECIDED, Tape, TapeResult, padded_steps, run_tape
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.errors import Outcome

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


class LinkageEnding(NamedTuple):
    """The number of solved steps, the outcome that ends them, and a sentence."""

    solved_steps: int
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""


FindEnding = Callable[[Array, Callable[[IntArray], Array], int], LinkageEnding | None]
"""Returns how a linkage with stops ends, by the rotations of its inputs (steps,), a function that returns x and y of
result points (points, 2, steps), and the number of good steps; None if that is not sure."""

OUTCOME_NUMBERS = {outcome: number for number, outcome in enumerate(Outcome)}
DEAD_POINT_NUMBER = OUTCOME_NUMBERS[Outcome.DEAD_POINT]


class PreparedTape(NamedTuple):
    """Linkages on a tape whose result points are rows of a part, the kinds of its blocks without and with rates, and
    functions for the linkages with stops by their numbers."""

    taped: TapedLinkages
    make_kinds: Callable[[bool], BlockKinds]
    find_endings: Mapping[int, FindEnding] = {}


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
            _run_once(taped.select(indices), kinds, polished, values, steps, finer, endings, tape.find_endings, turn)
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


def clear_points(values: Array, first: IntArray, which: IntArray, first_step: IntArray) -> None:
    """Set the points of linkages, of linkage k from first[k] to first[k + 1], to NaN from a step of each on."""
    for begin, end, step in zip(first[which].tolist(), first[which + 1].tolist(), first_step.tolist(), strict=True):
        values[begin:end, :, step:] = np.nan


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
    taped: TapedLinkages,
    kinds: BlockKinds,
    polished: bool,
    values: Array,
    steps: int,
    finer: int,
    endings: Endings,
    find_endings: Mapping[int, FindEnding],
    turn: float,
) -> None:
    """Run linkages with steps divided by a factor, and note the endings of those that this decides."""
    count, points = steps * finer + 1, values
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
    endings.outcome[dead], endings.links[dead] = DEAD_POINT_NUMBER, taped.links[last_blocks[is_dead]]
    endings.near[dead] = np.stack([rotation[first_bad - 1], rotation[first_bad]], axis=1)

    def point_places(result_rows: IntArray) -> Array:
        indices = np.searchsorted(rows, result_rows) if finer > 1 else result_rows
        return points[indices, :2, :count]

    for k, number in enumerate(which.tolist()) if find_endings else ():
        if number not in find_endings or not good[k]:
            continue
        ending = find_endings[number](rotation[:count], point_places, int(good[k]))
        if ending is None:
            endings.solved[number] = -1
            continue
        endings.solved[number] = (ending.solved_steps - 1) // finer + 1
        endings.outcome[number] = OUTCOME_NUMBERS[ending.outcome]
        if ending.reason:
            endings.reasons[number] = ending.reason
