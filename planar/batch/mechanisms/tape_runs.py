"""Linkages of any structure run as tapes: each a sequence of blocks, all through the same turn of their inputs."""

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
"""rad: steps that are longer are divided, so that a position is never far from the one before; those that are not sure
once more, into so many."""
MAX_FINE_BYTES = 16 * 2**20
"""Bytes of finer steps of what is told that are worked on at once."""
LEAST_COSINE = cos(MAX_TURN_PER_STEP)
"""Of the angle by which a link turns in a step."""
POINT_ROWS = {False: 2, True: 6}
"""Rows of a point, without and with rates: x and y, then their first rates, then the second ones."""
TABLE, FRAME, STEP_TABLE = -1, -2, -3
"""Slots of a tape that all linkages share: how far inputs have turned, as cosine, sine and angle in its rows; the
frame; and what blocks need to know of steps that Newton's method solves. Below them are slots of room, which every
linkage fills anew; from 0 on are the points that are told."""
FIRST_ROOM_SLOT = -4
TABLE_COS, TABLE_SIN, TABLE_ANGLE = range(3)
"""Rows of the table."""


class _Attempt(NamedTuple):
    """How linkages are run: with steps so many times finer, and whether closed forms are polished."""

    refinement: int
    polished: bool


_ATTEMPTS = (_Attempt(1, False), _Attempt(1, True), _Attempt(REFINEMENT, True), _Attempt(REFINEMENT**2, True))
"""One after the other, each for those that the ones before left open."""


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

    def select(self, some: IntArray) -> TapedLinkages:
        """Some of the linkages (numbers, rising)."""
        if len(some) == len(self.which):
            return self
        counts = np.diff(self.first)[some]
        first = part_offsets(counts)
        own = np.repeat(self.first[some] - first[:-1], counts) + np.arange(first[-1])
        kinds, slots, p, blocks = (each[own] for each in (self.kinds, self.slots, self.p, self.blocks))
        tolerance, clearance = self.tolerance[some], self.clearance[some]
        return TapedLinkages(self.which[some], first, kinds, slots, p, blocks, tolerance, clearance)


class LinkageEnding(NamedTuple):
    """So many of the first steps are solved; why no more, and what there is to say of it."""

    solved_steps: int
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""


class FineRun(NamedTuple):
    """A linkage at the steps of an attempt: how many of them are good; how far the inputs have turned (steps,); and
    what gives x and y of points that are told (points, 2, steps)."""

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
    many = len(taped.which)
    solved, outcome, block = np.zeros((3, many), dtype=np.int64)
    run = TapeRun(np.zeros(many, dtype=bool), solved, outcome, np.zeros((many, 2)), block, {})
    left = np.arange(many)
    for attempt in _ATTEMPTS if many else ():
        finer = step_division(steps) * attempt.refinement
        for some in _chunks(taped, left, steps * finer + 1, rates, finer > 1):
            attempted = _AttemptRun(taped.select(some), kinds, attempt.polished, values, steps, finer)
            attempted.note(run, some, find_ending, watched)
        left = left[~run.is_decided[left]]
        if not left.size:
            break
    return run


def step_division(steps: int) -> int:
    """Into how many a step is divided."""
    return ceil(FULL_TURN / steps / LONGEST_INPUT_STEP)


def make_values(points: int, steps: int, rates: bool, dtype: str = "float64") -> Array:
    """Room for points (points, rows, numbers), the rows of which are longer than there are steps, and whole vectors."""
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


def _chunks(taped: TapedLinkages, left: IntArray, steps: int, rates: bool, apart: bool) -> Iterator[IntArray]:
    """So many at a time that what is told of finer steps fits into memory near the processor."""
    if not apart:
        yield left
        return
    told = np.add.reduceat((taped.slots >= 0).sum(axis=1), taped.first[:-1])
    ends = np.cumsum(told[left] * (padded_steps(steps) * POINT_ROWS[rates] * 8))
    first = 0
    while first < len(left):
        before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, before + MAX_FINE_BYTES, side="right")), first + 1)
        yield left[first:last]
        first = last


class _AttemptRun:
    """Linkages run once, in steps that are so many times finer than those that are told."""

    def __init__(self, taped: TapedLinkages, kinds: BlockKinds, polished: bool, values: Array, steps: int, finer: int):
        self.taped, self.finer, self.count = taped, finer, steps * finer + 1
        stride = padded_steps(self.count)
        self.turned = np.arange(stride) * (FULL_TURN / (self.count - 1))
        self.rows: IntArray | None = None
        refs, told = taped.slots, values
        if finer > 1:
            is_told = refs >= 0
            self.rows, places = np.unique(refs[is_told], return_inverse=True)
            told, refs = np.empty((len(self.rows), values.shape[1], stride)), refs.copy()
            refs[is_told] = places
        self.told = told
        room = np.empty((max(-int(refs.min()), -1 - FIRST_ROOM_SLOT), max(kinds.room_rows, 1 + TABLE_ANGLE), stride))
        room[-1 - TABLE, : 1 + TABLE_ANGLE] = np.cos(self.turned), np.sin(self.turned), self.turned
        if kinds.frame_rows:
            room[-1 - FRAME] = 0.0
            for row, value in kinds.frame_rows.items():
                room[-1 - FRAME, row] = value
        addresses = np.where(
            refs >= 0, told.ctypes.data + refs * told.strides[0], room.ctypes.data + (-1 - refs) * room.strides[0]
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
            values[self.rows, :, : steps + 1] = told[:, :, : self.count : finer]

    def note(
        self,
        run: TapeRun,
        some: IntArray,
        find_ending: Callable[[int, FineRun], LinkageEnding | None] | None,
        watched: BoolArray | None,
    ) -> None:
        """Put down what is decided of linkages, `some` by their numbers on the whole tape."""
        good, outcome, at = self.result
        sure = np.flatnonzero(outcome != UNDECIDED)
        own = some[sure]
        run.is_decided[own] = True
        run.solved[own] = (good[sure] - 1) // self.finer + 1
        dead = sure[outcome[sure] == DEAD_POINT]
        run.outcome[some[dead]] = DEAD_POINT_NUMBER
        run.near[some[dead]] = np.stack([self.turned[good[dead] - 1], self.turned[good[dead]]], axis=1)
        run.block[some[dead]] = self.taped.blocks[at[dead]]
        if find_ending is None or watched is None:
            return
        for k in np.flatnonzero(watched[some] & (good > 0)).tolist():
            fine = FineRun(int(good[k]), self.turned[: self.count], self._places)
            ending = find_ending(int(self.taped.which[k]), fine)
            number = int(some[k])
            run.is_decided[number] = ending is not None
            if ending is not None:
                run.solved[number] = (ending.solved_steps - 1) // self.finer + 1
                run.outcome[number] = OUTCOME_NUMBERS[ending.outcome]
                if ending.reason:
                    run.reasons[number] = ending.reason

    def _places(self, rows: IntArray) -> Array:
        """x and y at rows that are told (rows, 2, steps)."""
        own = rows if self.rows is None else np.searchsorted(self.rows, rows)
        return self.told[own, :2, : self.count]
