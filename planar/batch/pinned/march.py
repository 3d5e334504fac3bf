"""All positions of linkages of pinned bars by their tapes, and how far each is sure."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from weakref import WeakKeyDictionary

import numpy as np

from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.results import Swept
from planar.batch.mechanisms.tape_runs import (
    FIRST_ROOM_SLOT,
    LEAST_COSINE,
    POINT_ROWS,
    TABLE,
    BlockKinds,
    TapedLinkages,
    clear_points,
    make_values,
    run_taped_linkages,
)
from planar.batch.pinned.formulas import PinStep, pin_formulas
from planar.batch.pinned.results import PinnedPart
from planar.batch.pinned.tape import PinTape, ToldPins, find_told_pins, frame_pins, make_tape
from planar.codegen.tape import compile_block
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.model.pin_linkages import PinnedLinkages

_tapes: WeakKeyDictionary[PinnedLinkages, PinTape] = WeakKeyDictionary()
"""What was found of linkages, as long as they are there."""


def solve_pinned(
    linkages: PinnedLinkages,
    request: SweepRequest,
    solve_blocks: Callable[[list[Mechanism]], list[Swept]],
    solve_general: Callable[[Mechanism], Swept],
    told: ToldPins | None = None,
    values: Array | None = None,
    mechanisms: Sequence[Mechanism] | None = None,
) -> PinnedPart:
    """All linkages. Those that are no crank and dyads go to `solve_blocks`, what is not sure to `solve_general`.

    `values` take the points that are told, where there is room for them. `mechanisms` are the linkages as such, where
    they are there.
    """
    steps, rates = request.steps, request.rates
    told = find_told_pins(linkages, request.points) if told is None else told
    values = make_values(len(told.pins), steps, rates) if values is None else values
    tape = _tapes.get(linkages)
    if tape is None:
        tape = _tapes[linkages] = make_tape(linkages)
    kinds = BlockKinds(
        lambda k, polished: compile_block(pin_formulas(rates, polished)[k], LEAST_COSINE), POINT_ROWS[rates]
    )
    run = run_taped_linkages(_taped_linkages(linkages, tape, told), kinds, values, steps, rates)
    if request.points is not None:
        _fill_frame_pins(linkages, told, values)
    stopped = np.flatnonzero(run.is_decided & (run.solved <= steps))
    clear_points(values, told.first, tape.which[stopped], run.solved[stopped])

    is_dyadic = np.zeros(len(linkages), dtype=bool)
    is_dyadic[tape.which] = True

    def mechanism(number: int) -> Mechanism:
        return linkages[number] if mechanisms is None else mechanisms[number]

    others = np.flatnonzero(~is_dyadic).tolist()
    found = dict(zip(others, solve_blocks([mechanism(k) for k in others]), strict=True)) if others else {}
    found |= {k: solve_general(mechanism(k)) for k in tape.which[~run.is_decided].tolist()}

    owner = np.repeat(np.arange(len(linkages)), np.diff(told.first))
    pins = told.pins - linkages.first_pin[owner]
    solved, bars = np.zeros(len(linkages), dtype=np.int64), np.zeros((len(linkages), 2), dtype=np.int64)
    near = np.zeros((len(linkages), 2))
    solved[tape.which], near[tape.which] = run.solved, run.near
    bars[tape.which] = tape.bars[run.block] - linkages.first_bar[tape.which, None]
    part = PinnedPart(values, steps, told.first, pins, linkages.crank_angles, solved, near, bars, found)
    for k, each in found.items():
        orders = [order for order in (each.position, each.velocity, each.acceleration) if order is not None]
        for point in range(told.first[k], told.first[k + 1]):
            for order, of in enumerate(orders):
                values[point, 2 * order : 2 * order + 2, : steps + 1] = of[f"P{pins[point]}"].T
    return part


def _taped_linkages(linkages: PinnedLinkages, tape: PinTape, told: ToldPins) -> TapedLinkages:
    """The tape with the rows of pins that are told, and for the others room that linkages share."""
    slots = FIRST_ROOM_SLOT - np.arange(len(linkages.positions))
    slots += np.repeat(linkages.first_pin[:-1], np.diff(linkages.first_pin))
    slots[told.pins] = np.arange(len(told.pins))
    own = np.empty((len(tape.placed), 3), dtype=np.int64)
    own[:, :2], own[:, 2] = slots[tape.given], slots[tape.placed]
    own[tape.kinds == PinStep.CRANK, 0] = TABLE
    blocks = np.arange(len(own))
    return TapedLinkages(tape.which, tape.first, tape.kinds, own, tape.p, blocks, tape.tolerance, tape.clearance)


def _fill_frame_pins(linkages: PinnedLinkages, told: ToldPins, values: Array) -> None:
    """Put points that are told though they are on the frame where they are."""
    is_fixed = np.zeros(len(linkages.positions), dtype=bool)
    is_fixed[frame_pins(linkages)] = True
    points = np.flatnonzero(is_fixed[told.pins])
    if len(points):
        values[points] = 0.0
        values[points, :2] = linkages.positions[told.pins[points]][:, :, None]
