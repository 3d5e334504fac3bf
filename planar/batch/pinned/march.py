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
    result_pins: ToldPins | None = None,
    values: Array | None = None,
    mechanisms: Sequence[Mechanism] | None = None,
) -> PinnedPart:
    """All linkages. Those that are no crank and dyads go to `solve_blocks`, what is not sure to `solve_general`.

    The result points are written to `values` if it is given. `mechanisms`: the linkages as mechanisms, if the caller
    has them.
    """
    steps, rates = request.steps, request.rates
    result_pins = find_told_pins(linkages, request.points) if result_pins is None else result_pins
    values = make_values(len(result_pins.pins), steps, rates) if values is None else values
    tape = _tapes.get(linkages)
    if tape is None:
        tape = _tapes[linkages] = make_tape(linkages)
    kinds = BlockKinds(
        lambda k, polished: compile_block(pin_formulas(rates, polished)[k], LEAST_COSINE), POINT_ROWS[rates]
    )
    run = run_taped_linkages(_taped_linkages(linkages, tape, result_pins), kinds, values, steps, rates)
    if request.points is not None:
        _fill_frame_pins(linkages, result_pins, values)
    stopped = np.flatnonzero(run.is_decided & (run.solved <= steps))
    clear_points(values, result_pins.first, tape.which[stopped], run.solved[stopped])

    is_dyadic = np.zeros(len(linkages), dtype=bool)
    is_dyadic[tape.which] = True

    def mechanism(number: int) -> Mechanism:
        return linkages[number] if mechanisms is None else mechanisms[number]

    others = np.flatnonzero(~is_dyadic).tolist()
    swept = dict(zip(others, solve_blocks([mechanism(k) for k in others]), strict=True)) if others else {}
    swept |= {k: solve_general(mechanism(k)) for k in tape.which[~run.is_decided].tolist()}

    owner = np.repeat(np.arange(len(linkages)), np.diff(result_pins.first))
    pins = result_pins.pins - linkages.first_pin[owner]
    solved, bars = np.zeros(len(linkages), dtype=np.int64), np.zeros((len(linkages), 2), dtype=np.int64)
    near = np.zeros((len(linkages), 2))
    solved[tape.which], near[tape.which] = run.solved, run.near
    bars[tape.which] = tape.bars[run.block] - linkages.first_bar[tape.which, None]
    part = PinnedPart(values, steps, result_pins.first, pins, linkages.crank_angles, solved, near, bars, swept)
    for k, result in swept.items():
        orders = [order for order in (result.position, result.velocity, result.acceleration) if order is not None]
        for point in range(result_pins.first[k], result_pins.first[k + 1]):
            for order, of in enumerate(orders):
                values[point, 2 * order : 2 * order + 2, : steps + 1] = of[f"P{pins[point]}"].T
    return part


def _taped_linkages(linkages: PinnedLinkages, tape: PinTape, result_pins: ToldPins) -> TapedLinkages:
    """The tape with a result row for every result pin; other pins have temporary slots that linkages share."""
    slots = FIRST_ROOM_SLOT - np.arange(len(linkages.positions))
    slots += np.repeat(linkages.first_pin[:-1], np.diff(linkages.first_pin))
    slots[result_pins.pins] = np.arange(len(result_pins.pins))
    block_slots = np.empty((len(tape.placed), 3), dtype=np.int64)
    block_slots[:, :2], block_slots[:, 2] = slots[tape.given], slots[tape.placed]
    block_slots[tape.kinds == PinStep.CRANK, 0] = TABLE
    blocks = np.arange(len(block_slots))
    return TapedLinkages(
        tape.which, tape.first, tape.kinds, block_slots, tape.p, blocks, tape.tolerance, tape.clearance
    )


def _fill_frame_pins(linkages: PinnedLinkages, result_pins: ToldPins, values: Array) -> None:
    """Fill the result points that belong to the frame."""
    is_fixed = np.zeros(len(linkages.positions), dtype=bool)
    is_fixed[frame_pins(linkages)] = True
    points = np.flatnonzero(is_fixed[result_pins.pins])
    if len(points):
        values[points] = 0.0
        values[points, :2] = linkages.positions[result_pins.pins[points]][:, :, None]
