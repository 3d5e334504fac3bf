"""Linkages of pinned bars solved: by their tapes, and what these leave open by others."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.batch.mechanisms.linkage_groups import SweepRequest
from planar.batch.mechanisms.results import Swept
from planar.batch.pinned.march import make_values, run_pinned_linkages
from planar.batch.pinned.results import PinnedPart
from planar.batch.pinned.told_pins import ToldPins, find_told_pins
from planar.model.mechanism import Mechanism
from planar.model.pin_linkages import PinnedLinkages

Array = np.ndarray


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
