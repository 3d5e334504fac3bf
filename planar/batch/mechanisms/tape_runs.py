"""Run linkages of any structure as tapes: a sequence of blocks for every linkage, over one turn of the inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import ceil, cos
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.prediction import MAX_TURN_PER_STEP
from planar.codegen.tape import DEAD_POINT, LANES, UNDECIDED, Tape, clear_rows, padded_steps, run_tape
from planar.foundation.arrays import Array, BoolArray, IntArray, part_offsets
from planar.foundation.errors import Outcome

FULL_TURN = 2.0 * np.pi
LONGEST_INPUT_STEP, REFINEMENT = 0.07, 8
"""Longest input step (rad) that is not divided, so that a position stays near the previous one; and the factor by which
the steps of undecided linkages are divided again."""
MAX_FINE_BYTES = 16 * 2**20
"""Maximum size in bytes of the result points at divided steps that are computed at once."""
LEAST_COSINE = cos(MAX_TURN_PER_STEP)
"""Of the angle by which a link turns in a step."""
POINT_ROWS = {False: 2, True: 6}
"""Rows of a point, without and with rates: x and y, then their first rates, then the second ones."""
TABLE, FRAME, STEP_TABLE = -1, -2, -3
"""Slots that all linkages of a tape share: the rotation of the inputs, as cosine, sine and angle in its rows; the
frame; and the table of steps for Newton's method. Slots below them are temporary, and every linkage overwrites them;
slots from 0 on are the result points."""
FIRST_ROOM_SLOT = -4
TABLE_COS, TABLE_SIN, TABLE_ANGLE = range(3)
"""Rows of the table."""


class _Attempt(NamedTuple):
    """The factor by which steps are divided, and whether closed forms are followed by a Newton step."""

    refinement: int
    polished: bool


_ATTEMPTS = (_Attempt(1, False), _Attempt(1, True), _Attempt(REFINEMENT, True), _Attempt(REFINEMENT**2, True))
"""In this order; every attempt runs the linkages that the previous ones did not decide."""


class BlockKinds(NamedTuple):
    """The kinds of the blocks of a tape: the function of a kind by its number, polished or not; how many rows a slot of
    room has; the frame's rows; and the table of steps that Newton's method solves, by how many there are and how long
    they are."""

    compile: Callable[[int, bool], Any]
    room_rows: int
    frame_rows: Mapping[int, float] = {}
    step_table: Callable[[int, float], Array] | None = None


class TapedLinkages(NamedTuple):
    """Some linkages, `which` (taped,) by their numbers, as sequences of blocks on a tape: those of one from first[k] to
    first[k + 1]; of every block the number of its kind, its `slots` (blocks, slots) and numbers p (blocks, numbers);
    `blocks`: the blocks' own numbers. `tolerance` of what is left open and least `clearance` (taped,)."""

    which: IntArray
    first: IntArray
    kinds: IntArray
    slots: IntArray
    p: Array
    blocks: IntArray
    tolerance: Array
    clearance: Array

    def select(self, numbers: IntArray) -> TapedLinkages:
        """Some of the linkages (numbers, rising)."""
        if len(numbers) == len(self.which):
            return self
        counts = np.diff(self.first)[numbers]
        first = part_offsets(counts)
        indices = np.repeat(self.first[numbers] - first[:-1], counts) + np.arange(first[-1])
        kinds, slots, p, blocks = (values[indices] for values in (self.kinds, self.slots, self.p, self.blocks))
        tolerance, clearance = self.tolerance[numbers], self.clearance[numbers]
        return TapedLinkages(self.which[numbers], first, kinds, slots, p, blocks, tolerance, clearance)


class LinkageEnding(NamedTuple):
    """So many of the first steps are solved; why no more, and what there is to say of it."""

    solved_steps: int
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""


class FineRun(NamedTuple):
    """A linkage at the steps of an attempt: the number of good steps; the rotation of the inputs (steps,); and a
    function that returns x and y of result points (points, 2, steps)."""

    good: int
    turned: Array
    places: Callable[[IntArray], Array]


class TapeRun(NamedTuple):
    """How far linkages came: of each whether it is decided, at how many of its steps it is solved, the number of its
    outcome then, between which turns of the input, near (linkages, 2) in rad, at which block, and what there is to say
    of those that end otherwise than at a dead point."""

    is_decided: BoolArray
    solved: IntArray
    outcome: IntArray
    near: Array
    block: IntArray
    reasons: dict[int, str]


OUTCOME_NUMBERS = {each: number for number, each in enumerate(Outcome)}
DEAD_POINT_NUMBER = OUTCOME_NUMBERS[Outcome.DEAD_POINT]


def run_taped_linkages(
    taped: TapedLinkages,
    kinds: BlockKinds,
    values: Array,
    steps: int,
    rates: bool,
    find_ending: Callable[[int, FineRun], LinkageEnding | None] | None = None,
    watched: BoolArray | None = None,
) -> TapeRun:
    """Run linkages through a turn of their inputs: values (points, `POINT_ROWS`, numbers), see `make_values`, are
    filled. Entries of the result are those of `taped.which`.

    What is not decided by any attempt is left to others. `find_ending` says how the `watched` ones (taped,) end, None
    where that is not sure.
    """
    linkage_count = len(taped.which)
    solved, outcome, block = np.zeros((3, linkage_count), dtype=np.int64)
    run = TapeRun(np.zeros(linkage_count, dtype=bool), solved, outcome, np.zeros((linkage_count, 2)), block, {})
    undecided = np.arange(linkage_count)
    for attempt in _ATTEMPTS if linkage_count else ():
        finer = step_division(steps) * attempt.refinement
        for numbers in _chunks(taped, undecided, steps * finer + 1, rates, finer > 1):
            attempted = _AttemptRun(taped.select(numbers), kinds, attempt.polished, values, steps, finer)
            attempted.note(run, numbers, find_ending, watched)
        undecided = undecided[~run.is_decided[undecided]]
        if not undecided.size:
            break
    return run


def step_division(steps: int) -> int:
    """Into how many a step is divided."""
    return ceil(FULL_TURN / steps / LONGEST_INPUT_STEP)


def make_values(points: int, steps: int, rates: bool, dtype: str = "float64") -> Array:
    """Allocate points (points, rows, numbers); rows are padded to a multiple of LANES."""
    shape = points, POINT_ROWS[rates], padded_steps(steps + 1)
    size = int(np.prod(shape))
    made = np.empty(size + LANES, dtype)
    first = -(made.ctypes.data // made.itemsize) % LANES
    return made[first : first + size].reshape(shape)


def clear_points(values: Array, first_point: IntArray, which: IntArray, first_step: IntArray) -> None:
    """The points of some linkages, from first_point[k] to first_point[k + 1], are NaN from a step of each on."""
    if not len(which):
        return
    counts = np.diff(first_point)[which]
    begin = np.cumsum(counts) - counts
    points = np.repeat(first_point[which] - begin, counts) + np.arange(counts.sum())
    steps = np.repeat(first_step, counts)
    rows = values.ctypes.data + points[:, None] * values.strides[0] + np.arange(values.shape[1]) * values.strides[1]
    clear_rows(rows.ravel(), np.repeat(steps, values.shape[1]), values.shape[2])


def _chunks(taped: TapedLinkages, numbers: IntArray, steps: int, rates: bool, apart: bool) -> Iterator[IntArray]:
    """Yield parts of the linkages whose result points at divided steps fit into `MAX_FINE_BYTES`."""
    if not apart:
        yield numbers
        return
    point_counts = np.add.reduceat((taped.slots >= 0).sum(axis=1), taped.first[:-1])
    ends = np.cumsum(point_counts[numbers] * (padded_steps(steps) * POINT_ROWS[rates] * 8))
    first = 0
    while first < len(numbers):
        size_before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, size_before + MAX_FINE_BYTES, side="right")), first + 1)
        yield numbers[first:last]
        first = last


class _AttemptRun:
    """Linkages run once, with steps divided by a factor."""

    def __init__(self, taped: TapedLinkages, kinds: BlockKinds, polished: bool, values: Array, steps: int, finer: int):
        self.taped, self.finer, self.count = taped, finer, steps * finer + 1
        stride = padded_steps(self.count)
        self.turned = np.arange(stride) * (FULL_TURN / (self.count - 1))
        self.rows: IntArray | None = None
        refs, points = taped.slots, values
        if finer > 1:
            is_told = refs >= 0
            self.rows, places = np.unique(refs[is_told], return_inverse=True)
            points, refs = np.empty((len(self.rows), values.shape[1], stride)), refs.copy()
            refs[is_told] = places
        self.points = points
        room = np.empty((max(-int(refs.min()), -1 - FIRST_ROOM_SLOT), max(kinds.room_rows, 1 + TABLE_ANGLE), stride))
        room[-1 - TABLE, : 1 + TABLE_ANGLE] = np.cos(self.turned), np.sin(self.turned), self.turned
        if kinds.frame_rows:
            room[-1 - FRAME] = 0.0
            for row, value in kinds.frame_rows.items():
                room[-1 - FRAME, row] = value
        addresses = np.where(
            refs >= 0, points.ctypes.data + refs * points.strides[0], room.ctypes.data + (-1 - refs) * room.strides[0]
        )
        if kinds.step_table is not None:
            table = np.ascontiguousarray(kinds.step_table(self.count, FULL_TURN / (self.count - 1)))
            addresses[refs == STEP_TABLE] = table.ctypes.data
        present = np.flatnonzero(np.bincount(taped.kinds))
        functions = [kinds.compile(k, polished) for k in present.tolist()]
        number = np.zeros(present[-1] + 1, dtype=np.int64)
        number[present] = np.arange(len(present))
        self.result = run_tape(
            functions,
            self.count,
            Tape(taped.first, number[taped.kinds], addresses, taped.p, taped.tolerance, taped.clearance),
        )
        if self.rows is not None:
            values[self.rows, :, : steps + 1] = points[:, :, : self.count : finer]

    def note(
        self,
        run: TapeRun,
        numbers: IntArray,
        find_ending: Callable[[int, FineRun], LinkageEnding | None] | None,
        watched: BoolArray | None,
    ) -> None:
        """Store the decided linkages in the run; `numbers` are their indices on the complete tape."""
        good_counts, outcome, last_blocks = self.result
        sure_indices = np.flatnonzero(outcome != UNDECIDED)
        decided = numbers[sure_indices]
        run.is_decided[decided] = True
        run.solved[decided] = (good_counts[sure_indices] - 1) // self.finer + 1
        dead = sure_indices[outcome[sure_indices] == DEAD_POINT]
        run.outcome[numbers[dead]] = DEAD_POINT_NUMBER
        run.near[numbers[dead]] = np.stack([self.turned[good_counts[dead] - 1], self.turned[good_counts[dead]]], axis=1)
        run.block[numbers[dead]] = self.taped.blocks[last_blocks[dead]]
        if find_ending is None or watched is None:
            return
        for k in np.flatnonzero(watched[numbers] & (good_counts > 0)).tolist():
            fine = FineRun(int(good_counts[k]), self.turned[: self.count], self._places)
            ending = find_ending(int(self.taped.which[k]), fine)
            number = int(numbers[k])
            run.is_decided[number] = ending is not None
            if ending is not None:
                run.solved[number] = (ending.solved_steps - 1) // self.finer + 1
                run.outcome[number] = OUTCOME_NUMBERS[ending.outcome]
                if ending.reason:
                    run.reasons[number] = ending.reason

    def _places(self, rows: IntArray) -> Array:
        """Return x and y of result points (rows, 2, steps)."""
        indices = rows if self.rows is None else np.searchsorted(self.rows, rows)
        return self.points[indices, :2, : self.count]
