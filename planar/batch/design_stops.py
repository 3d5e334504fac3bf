"""The stops of a block's designs where they start: of which designs a march can watch them, and which are outside."""

from __future__ import annotations

import numpy as np

from planar.batch.march.checks import DesignEvaluation
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.stops import (
    LEAST_RANGES,
    SAME_END,
    SURE_DISTANCE,
    TURN,
    StopLimits,
    are_periodic,
    stop_limits,
)
from planar.batch.reference_design import ReferenceDesign, stack_rows
from planar.foundation.arrays import BoolArray
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.solving.stops import STOP_TOLERANCE

Array = np.ndarray

STEPS_BEYOND_STOP = 3
"""Steps beyond the stop of an input that are computed to judge how the input reaches it."""


def stop_ranges(reference: ReferenceDesign, designs: Mechanism, count: int) -> tuple[list[Pair], Array, Array, Array]:
    """The pairs with stops, which of them are angles that do not count turns (stops,), and between which positions they
    can go (stops, designs), in sizes and rad; infinite where open, of such angles a turn on."""
    low = stack_rows([-np.inf if stops.low is None else stops.low for stops in designs.stops], count)
    high = stack_rows([np.inf if stops.high is None else stops.high for stops in designs.stops], count)
    pairs = [reference.motions[stops.pair] for stops in designs.stops]
    periodic = np.array(are_periodic(pairs, reference.mechanism), dtype=bool)
    scale = np.array([reference.unit if pair.input_kind is MeasureKind.LENGTH else 1.0 for pair in pairs])
    low, high = low / scale[:, None], high / scale[:, None]
    low, high = (
        np.where(periodic[:, None] & np.isinf(low), high - TURN, low),
        np.where(periodic[:, None] & np.isinf(high), low + TURN, high),
    )
    return pairs, periodic, low, high


def watch_stops(
    reference: ReferenceDesign, designs: Mechanism, batch: DesignBatch, u: Array
) -> tuple[StopLimits, BoolArray, BoolArray]:
    """The stops of designs at their own inputs u (inputs, designs), in the assemblies z0 of a batch.

    Returns the limits of pairs that are not inputs, and of the input that runs; the designs whose stops a march can
    watch, which start inside all of them (designs,); and the designs that surely start beyond a stop (designs,).
    """
    count, inputs = u.shape[1], [driven.pair for driven in reference.mechanism.inputs]
    pairs, periodic, low, high = stop_ranges(reference, designs, count)
    is_fit, is_outside = np.all(low < high, axis=0), np.zeros(count, dtype=bool)
    running_range, others = (np.full(count, -np.inf), np.full(count, np.inf)), []
    for k, pair in enumerate(pairs):
        if pair.name not in inputs:
            others.append(k)
            width = high[k] - low[k]
            is_fit &= width >= LEAST_RANGES[0 if periodic[k] else 1]
            if periodic[k]:  # a wider range asks how many turns there were
                is_fit &= width <= TURN + SURE_DISTANCE
            continue
        index = inputs.index(pair.name)
        if periodic[k]:  # the stops at the input's own turn, as `PairStops.turns` defines it
            below = np.ceil((low[k] - STOP_TOLERANCE - u[index]) / TURN)
            above = np.ceil((u[index] - high[k] - STOP_TOLERANCE) / TURN)
            turns = TURN * np.where(below > 0.0, below, np.where(above > 0.0, -above, 0.0))
            low[k], high[k] = low[k] - turns, high[k] - turns
        room = np.minimum(u[index] - low[k], high[k] - u[index])
        is_outside |= is_fit & (room < -SURE_DISTANCE)
        is_fit &= room >= -SAME_END
        if index == reference.running_index:
            running_range = low[k], high[k]
    other_pairs = [pairs[k] for k in others]
    limits = stop_limits(other_pairs, periodic[others].tolist(), low[others], high[others], running_range)
    if other_pairs:
        placed = np.flatnonzero(np.isfinite(batch.z0).all(axis=0) & np.isfinite(u).all(axis=0))
        batch = batch._replace(stops=limits).select(placed)
        positions = DesignEvaluation(batch).pair_positions(batch.z0, u[:, placed])
        rooms = limits.select(placed).find_rooms(positions).min(axis=0)
        is_outside[placed] |= is_fit[placed] & (rooms < -SURE_DISTANCE)
        is_fit[placed] &= rooms > SURE_DISTANCE
    return limits, is_fit, is_outside


def find_input_stops(march: DesignBatch, index: int, lengths: Array) -> tuple[Array, Array, BoolArray]:
    """Where the running input `index` meets a stop of its own in a march of these lengths, of either sign (designs,).

    Returns the distances of the stops (rad or sizes), how many steps are solved up to there, a step at the stop itself
    among them, and whether that is clear, each (designs,).
    """
    assert march.stops is not None
    distances = np.abs(march.input_offsets[:, index])
    rooms, last = march.stops.input_rooms(march.u0[index], lengths), distances[-1]
    ends = rooms < last - SAME_END
    solved = np.where(ends, np.maximum(np.searchsorted(distances, rooms + SAME_END), 1), len(distances))
    off = np.array([np.abs(distances[np.clip(solved - k, 0, len(distances) - 1)] - rooms) for k in (0, 1)])
    unclear = ends & ((off > SAME_END) & (off < SURE_DISTANCE * max(last, 1.0))).any(axis=0)
    return rooms, solved, ~unclear
