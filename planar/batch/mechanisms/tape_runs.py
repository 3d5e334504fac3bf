"""Run linkages of any structure as tapes: a sequence of blocks for every linkage, over one turn of the inputs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from planar.codegen.tape import DEAD_POINT, LANES, UNDECIDED, Tape, padded_steps, run_tape
from planar.foundation.arrays import Array, BoolArray, IntArray, part_offsets
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
    """Linkages, `which` (taped,) by their numbers in a part, as sequences of blocks on a tape: those of linkage k from
    first[k] to first[k + 1]; of every block the number of its kind, its `slots` (blocks, slots), its numbers p (blocks,
    numbers), and its number in `blocks`; the `tolerance` of residuals and the least `clearance` (taped,)."""

    which: IntArray
    first: IntArray
    kinds: IntArray
    slots: IntArray
    p: Array
    blocks: IntArray
    tolerance: Array
    clearance: Array

    def select(self, numbers: IntArray) -> TapedLinkages:
        """The linkages of these indices (rising)."""
        if len(numbers) == len(self.which):
            return self
        counts = np.diff(self.first)[numbers]
        first = part_offsets(counts)
        indices = np.repeat(self.first[numbers] - first[:-1], counts) + np.arange(first[-1])
        kinds, slots, p, blocks = (values[indices] for values in (self.kinds, self.slots, self.p, self.blocks))
        tolerance, clearance = self.tolerance[numbers], self.clearance[numbers]
        return TapedLinkages(self.which[numbers], first, kinds, slots, p, blocks, tolerance, clearance)


class LinkageEnding(NamedTuple):
    """The number of solved steps, the outcome that ends them, and a sentence."""

    solved_steps: int
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""


class FineRun(NamedTuple):
    """A linkage at the steps of an attempt: the number of good steps; the rotation of the inputs (steps,); and a
    function that returns x and y of result points (points, 2, steps)."""

    good: int
    rotation: Array
    places: Callable[[IntArray], Array]


FindEnding = Callable[[FineRun], LinkageEnding | None]
"""Says how a linkage with stops ends; None if that is not sure."""


class PartRun(NamedTuple):
    """How far the linkages of a part came (linkages,): whether that is decided, the number of solved steps, the number
    of the outcome that ends them; for dead points between which rotations of the inputs (linkages, 2), in rad, and in
    which block; and sentences by the numbers of linkages."""

    is_decided: BoolArray
    solved: IntArray
    outcome: IntArray
    near: Array
    block: IntArray
    reasons: dict[int, str]

    @classmethod
    def undecided(cls, linkage_count: int) -> PartRun:
        """The run of a part before anything is decided."""
        solved, outcome, block = np.zeros((3, linkage_count), dtype=np.int64)
        return cls(np.zeros(linkage_count, dtype=bool), solved, outcome, np.zeros((linkage_count, 2)), block, {})


OUTCOME_NUMBERS = {outcome: number for number, outcome in enumerate(Outcome)}
DEAD_POINT_NUMBER = OUTCOME_NUMBERS[Outcome.DEAD_POINT]


def run_taped_linkages(
    taped: TapedLinkages,
    kinds: BlockKinds,
    values: Array,
    steps: int,
    run: PartRun,
    find_endings: Mapping[int, FindEnding] = {},
) -> None:
    """Run linkages through a turn of their inputs: values (points, `POINT_ROWS`, numbers), see `make_values`, and
    the `run` are filled. Other solvers take what no attempt decides. `find_endings` are those of linkages with stops.
    """
    undecided = np.arange(len(taped.which))
    for attempt in _ATTEMPTS if len(undecided) else ():
        finer = step_division(steps) * attempt.refinement
        for indices in _chunks(taped, undecided, padded_steps(steps * finer + 1) * values.shape[1] * 8, finer > 1):
            _AttemptRun(taped.select(indices), kinds, attempt.polished, values, steps, finer).note(run, find_endings)
        undecided = undecided[~run.is_decided[taped.which[undecided]]]
        if not undecided.size:
            break


def step_division(steps: int) -> int:
    """The number of parts into which a step is divided."""
    return ceil(FULL_TURN / steps / LONGEST_INPUT_STEP)


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


class _AttemptRun:
    """Linkages run once, with steps divided by a factor."""

    def __init__(self, taped: TapedLinkages, kinds: BlockKinds, polished: bool, values: Array, steps: int, finer: int):
        self.taped, self.finer, self.count = taped, finer, steps * finer + 1
        stride = padded_steps(self.count)
        self.rotation = np.arange(stride) * (FULL_TURN / (self.count - 1))
        self.rows: IntArray | None = None
        refs, points = taped.slots, values
        if finer > 1:
            is_result = refs >= 0
            self.rows, places = np.unique(refs[is_result], return_inverse=True)
            points, refs = np.empty((len(self.rows), values.shape[1], stride)), refs.copy()
            refs[is_result] = places
        self.points = points
        room = np.empty((max(-int(refs.min()), -1 - FIRST_ROOM_SLOT), max(kinds.room_rows, 1 + TABLE_ANGLE), stride))
        room[-1 - TABLE, : 1 + TABLE_ANGLE] = np.cos(self.rotation), np.sin(self.rotation), self.rotation
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

    def note(self, run: PartRun, find_endings: Mapping[int, FindEnding]) -> None:
        """Store the decided linkages in the run of the part."""
        good_counts, outcome, last_blocks = self.result
        which, is_sure, is_dead = self.taped.which, outcome != UNDECIDED, outcome == DEAD_POINT
        run.is_decided[which[is_sure]] = True
        run.solved[which[is_sure]] = (good_counts[is_sure] - 1) // self.finer + 1
        good, dead = good_counts[is_dead], which[is_dead]
        run.outcome[dead], run.block[dead] = DEAD_POINT_NUMBER, self.taped.blocks[last_blocks[is_dead]]
        run.near[dead] = np.stack([self.rotation[good - 1], self.rotation[good]], axis=1)
        for k, number in enumerate(which.tolist()) if find_endings else ():
            if number not in find_endings or not good_counts[k]:
                continue
            ending = find_endings[number](FineRun(int(good_counts[k]), self.rotation[: self.count], self._places))
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
