"""All positions of linkages of pinned bars by their tapes, and how far each is sure."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import ceil, cos
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from planar.batch.march.prediction import MAX_TURN_PER_STEP
from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.results import Swept
from planar.batch.pinned.formulas import ROWS, TABLE_ROWS, PinStep, pin_formulas
from planar.batch.pinned.results import PinnedPart
from planar.batch.pinned.tape import PinTape, ToldPins, find_told_pins, frame_pins, make_tape
from planar.codegen.tape import (
    DEAD_POINT,
    LANES,
    UNDECIDED,
    Tape,
    TapeFormula,
    TapeResult,
    clear_rows,
    padded_steps,
    run_tape,
)
from planar.model.mechanism import Mechanism
from planar.model.pin_linkages import PinnedLinkages

Array = np.ndarray

FULL_TURN = 2.0 * np.pi
LONGEST_INPUT_STEP, REFINEMENT = 0.07, 8
"""rad: steps that are longer are divided, so that a position is never far from the one before; those that are not sure
once more, into so many."""
MAX_STATE_BYTES = 16 * 2**20
"""Bytes of pins' places that are worked on at once beside those that are told."""


LEAST_COSINE = cos(MAX_TURN_PER_STEP)
"""Of the angle by which a bar turns in a step."""


class _Attempt(NamedTuple):
    """How linkages are run: with steps so many times finer, and whether closed forms are polished."""

    refinement: int
    polished: bool


_ATTEMPTS = (_Attempt(1, False), _Attempt(1, True), _Attempt(REFINEMENT, True), _Attempt(REFINEMENT**2, True))
"""One after the other, each for those that the ones before left open."""


class PinRun(NamedTuple):
    """How far linkages came: of each whether it is a crank and dyads, whether it is decided, at how many of its steps
    it is solved, and for those that come to a dead point then between which turns of the crank, near (linkages, 2) in
    rad, and of which bars (linkages, 2), by their numbers through all linkages."""

    is_dyadic: Array
    is_decided: Array
    solved: Array
    near: Array
    bars: Array


def run_pinned_linkages(linkages: PinnedLinkages, told: ToldPins, values: Array, steps: int, rates: bool) -> PinRun:
    """Run all linkages through a turn of their cranks: values (points, rows, numbers) are filled, see `make_values`.

    What is not decided by any attempt is left to others.
    """
    many = len(linkages)
    decided, solved = np.zeros((2, many), dtype=bool), np.zeros(many, dtype=np.int64)
    run = PinRun(decided[0], decided[1], solved, np.zeros((many, 2)), np.zeros((many, 2), np.int64))
    whole = _tape(linkages)
    run.is_dyadic[whole.which] = True
    frame = _FramePins(linkages, told)
    left = np.arange(len(whole.which))
    for attempt in _ATTEMPTS:
        finer = step_division(steps) * attempt.refinement
        for some in _chunks(linkages, whole.which[left], steps * finer + 1, rates, finer > 1):
            tape = whole.select(left[some])
            _run_attempt(linkages, tape, told, values, steps, rates, attempt, run)
        left = left[~run.is_decided[whole.which[left]]]
        if not left.size:
            break
    frame.fill(values)
    stopped = np.flatnonzero(run.is_decided & (run.solved <= steps))
    clear_points(values, told, stopped, run.solved[stopped])
    return run


_tapes: WeakKeyDictionary[PinnedLinkages, PinTape] = WeakKeyDictionary()
"""What was found of linkages, as long as they are there."""


def _tape(linkages: PinnedLinkages) -> PinTape:
    found = _tapes.get(linkages)
    if found is None:
        found = _tapes[linkages] = make_tape(linkages)
    return found


def step_division(steps: int) -> int:
    """Into how many a step is divided."""
    return ceil(FULL_TURN / steps / LONGEST_INPUT_STEP)


def make_values(points: int, steps: int, rates: bool, dtype: str = "float64") -> Array:
    """Room for points (points, rows, numbers), the rows of which are longer than there are steps, and whole vectors."""
    shape = points, ROWS[rates], padded_steps(steps + 1)
    size = int(np.prod(shape))
    made = np.empty(size + LANES, dtype)
    first = -(made.ctypes.data // made.itemsize) % LANES
    return made[first : first + size].reshape(shape)


def clear_points(values: Array, told: ToldPins, which: Array, first: Array) -> None:
    """The points of some linkages are NaN from a step of each on."""
    counts = np.diff(told.first)[which]
    begin = np.cumsum(counts) - counts
    points = np.repeat(told.first[which] - begin, counts) + np.arange(counts.sum())
    steps = np.repeat(first, counts)
    rows = values.ctypes.data + points[:, None] * values.strides[0] + np.arange(values.shape[1]) * values.strides[1]
    clear_rows(rows.ravel(), np.repeat(steps, values.shape[1]), values.shape[2])


class _FramePins:
    """Points that are told though they stand on the frame."""

    def __init__(self, linkages: PinnedLinkages, told: ToldPins):
        is_fixed = np.zeros(len(linkages.positions), dtype=bool)
        is_fixed[frame_pins(linkages)] = True
        self.points = np.flatnonzero(is_fixed[told.pins])
        self.at = linkages.positions[told.pins[self.points]]

    def fill(self, values: Array) -> None:
        """Put them where they stand."""
        if len(self.points):
            values[self.points] = 0.0
            values[self.points, :2] = self.at[:, :, None]


def _chunks(linkages: PinnedLinkages, which: Array, steps: int, rates: bool, apart: bool) -> Iterator[Array]:
    """So many at a time that the places of their pins, if these are worked on apart from what is told, fit into memory
    near the processor."""
    if not apart:
        if len(which):
            yield np.arange(len(which))
        return
    each = padded_steps(steps) * ROWS[rates] * 8
    ends = np.cumsum(np.diff(linkages.first_pin)[which] * each)
    first = 0
    while first < len(which):
        before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, before + MAX_STATE_BYTES, side="right")), first + 1)
        yield np.arange(first, last)
        first = last


def _run_attempt(  # many: one attempt with all that it takes and fills
    linkages: PinnedLinkages,
    tape: PinTape,
    told: ToldPins,
    values: Array,
    steps: int,
    rates: bool,
    attempt: _Attempt,
    run: PinRun,
) -> None:
    """Run some linkages, and note those that are decided."""
    finer = step_division(steps) * attempt.refinement
    count = steps * finer + 1
    formulas = pin_formulas(rates, attempt.polished)
    far = np.arange(padded_steps(count)) * (FULL_TURN / (count - 1))
    table = np.stack([np.cos(far), np.sin(far)])
    point = np.full(len(linkages.positions), -1)
    point[told.pins] = np.arange(len(told.pins))
    if finer == 1:
        result = _run_in_place(linkages, tape, point, values, formulas, count, table)
    else:
        state, slot = _make_state(linkages, tape, far, rates, table)
        slots = _tape_rows(tape, slot, len(state) - 1)
        arrays = Tape(tape.first, tape.kinds, slots, tape.p, tape.tolerance, tape.clearance)
        result = run_tape(
            formulas, LEAST_COSINE, count, arrays._replace(slots=state.ctypes.data + slots * state.strides[0])
        )
        placed = tape.placed[point[tape.placed] >= 0]
        values[point[placed], :, : steps + 1] = state[slot[placed], :, :count:finer]
    _note(tape, result, finer, far, run)


def _run_in_place(  # many: what is run, and where it is told
    linkages: PinnedLinkages,
    tape: PinTape,
    point: Array,
    values: Array,
    formulas: tuple[TapeFormula, ...],
    count: int,
    table: Array,
) -> TapeResult:
    """Write what is told where it is told, and what else is needed into room that linkages share."""
    own = np.arange(len(point)) - np.repeat(linkages.first_pin[:-1], np.diff(linkages.first_pin))
    addresses = values.ctypes.data + point * values.strides[0]
    apart = point < 0
    shared = np.empty((int(own.max()) + 1, *values.shape[1:]))
    addresses[apart] = shared.ctypes.data + own[apart] * shared.strides[0]
    slots = _tape_rows(tape, addresses, table.ctypes.data)
    return run_tape(
        formulas,
        LEAST_COSINE,
        count,
        Tape(tape.first, tape.kinds, slots, tape.p, tape.tolerance, tape.clearance),
    )


def _tape_rows(tape: PinTape, rows: Array, table: int) -> Array:
    """Where each step finds the pins that it takes, and puts the one that it gives (steps, 3)."""
    found = np.empty((len(tape.placed), 3), dtype=np.int64)
    found[:, :2], found[:, 2] = rows[tape.given], rows[tape.placed]
    found[tape.kinds == PinStep.CRANK, 0] = table
    return found


def _make_state(linkages: PinnedLinkages, tape: PinTape, far: Array, rates: bool, table: Array) -> tuple[Array, Array]:
    """Room for all pins of some linkages (pins + 1, rows, numbers), the last with the table of cranks, and where each
    pin is."""
    slot = np.zeros(len(linkages.positions), dtype=np.int64)
    slot[tape.placed] = np.arange(len(tape.placed))
    state = np.empty((len(tape.placed) + 1, ROWS[rates], len(far)))
    state[-1, :TABLE_ROWS] = table
    return state, slot


def _note(tape: PinTape, result: TapeResult, finer: int, far: Array, run: PinRun) -> None:
    """Put down what is decided."""
    sure = np.flatnonzero(result.outcome != UNDECIDED)
    which, good = tape.which[sure], result.good[sure]
    run.is_decided[which] = True
    run.solved[which] = (good - 1) // finer + 1
    dead = result.outcome[sure] == DEAD_POINT
    run.near[which[dead]] = np.stack([far[good[dead] - 1], far[good[dead]]], axis=1)
    run.bars[which[dead]] = tape.bars[result.at[sure[dead]]]


def solve_pinned(
    linkages: PinnedLinkages,
    request: SweepRequest,
    solve_blocks: Callable[[list[Mechanism]], list[Swept]],
    solve_general: Callable[[Mechanism], Swept],
    told: ToldPins | None = None,
    values: Array | None = None,
) -> PinnedPart:
    """All linkages. Those that are no crank and dyads go to `solve_blocks`, what is not sure to `solve_general`.

    `values` take the points that are told, where there is room for them.
    """
    told = find_told_pins(linkages, request.points) if told is None else told
    values = make_values(len(told.pins), request.steps, request.rates) if values is None else values
    run = run_pinned_linkages(linkages, told, values, request.steps, request.rates)
    left = np.flatnonzero(~run.is_decided)
    others = [k for k in left.tolist() if not run.is_dyadic[k]]
    found = dict(zip(others, solve_blocks([linkages[k] for k in others]), strict=True)) if others else {}
    found |= {k: solve_general(linkages[k]) for k in left.tolist() if run.is_dyadic[k]}
    owner = np.repeat(np.arange(len(linkages)), np.diff(told.first))
    pins = told.pins - linkages.first_pin[owner]
    bars = run.bars - linkages.first_bar[:-1, None]
    part = PinnedPart(values, request.steps, told.first, pins, linkages.crank_angles, run.solved, run.near, bars, found)
    for k, each in found.items():
        orders = [order for order in (each.position, each.velocity, each.acceleration) if order is not None]
        for point in range(told.first[k], told.first[k + 1]):
            for order, of in enumerate(orders):
                values[point, 2 * order : 2 * order + 2, : request.steps + 1] = of[f"P{pins[point]}"].T
    return part
