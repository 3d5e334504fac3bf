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
    are_periodic,
    stop_limits,
)
from planar.batch.reference_design import ReferenceDesign, stack_rows
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.solving.stops import STOP_TOLERANCE

Array = np.ndarray

STEPS_BEYOND_STOP = 3
"""Steps beyond the stop of an input that are looked at, so that it is sure how it comes there."""


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


class DesignStops:
    """The stops of designs at their own inputs u (inputs, designs).

    `limits`: those of pairs that are no inputs, and of the input that runs, inside of which it is. `is_fit` (designs,):
    whose stops a march can watch; `is_outside` (designs,): of which a pair surely is beyond its stop.
    """

    def __init__(self, reference: ReferenceDesign, designs: Mechanism, u: Array):
        self.reference, count = reference, u.shape[1]
        inputs = [driven.pair for driven in reference.mechanism.inputs]
        pairs, periodic, low, high = stop_ranges(reference, designs, count)
        self.is_outside, self.is_fit = np.zeros(count, dtype=bool), np.all(low < high, axis=0)
        running_range = np.full(count, -np.inf), np.full(count, np.inf)
        others = []
        for k, pair in enumerate(pairs):
            if pair.name in inputs:
                index = inputs.index(pair.name)
                input_range = self._watch_input(u[index], low[k], high[k], bool(periodic[k]))
                running_range = input_range if index == reference.running_index else running_range
                continue
            others.append(k)
            self.is_fit &= high[k] - low[k] >= LEAST_RANGES[0 if periodic[k] else 1]
            # farther it is to be known how many turns there were
            self.is_fit &= (high[k] - low[k] <= TURN + SURE_DISTANCE) if periodic[k] else True
        other_pairs = [pairs[k] for k in others]
        self.limits = stop_limits(other_pairs, periodic[others].tolist(), low[others], high[others], running_range)

    def _watch_input(self, u: Array, low: Array, high: Array, is_periodic: bool) -> tuple[Array, Array]:
        """Between which positions an input can go (designs,) from where it is, as `PairStops.turns` has it."""
        if is_periodic:
            below, above = np.ceil((low - STOP_TOLERANCE - u) / TURN), np.ceil((u - high - STOP_TOLERANCE) / TURN)
            turns = TURN * np.where(below > 0.0, below, np.where(above > 0.0, -above, 0.0))
            low, high = low - turns, high - turns
        room = np.minimum(u - low, high - u)
        self.is_outside |= self.is_fit & (room < -SURE_DISTANCE)
        self.is_fit &= room >= -SAME_END
        return low, high

    def watch_start(self, batch: DesignBatch, u: Array) -> None:
        """Look at where other pairs are in the assemblies z0 of a batch at inputs u (inputs, designs)."""
        if not self.limits.pairs:
            return
        placed = np.flatnonzero(np.isfinite(batch.z0).all(axis=0) & np.isfinite(u).all(axis=0))
        batch = batch._replace(stops=self.limits).select(placed)
        positions = DesignEvaluation(batch).pair_positions(batch.z0, u[:, placed])
        rooms = self.limits.select(placed).find_rooms(positions).min(axis=0)
        self.is_outside[placed] |= self.is_fit[placed] & (rooms < -SURE_DISTANCE)
        self.is_fit[placed] &= rooms > SURE_DISTANCE

    def have_room(self, march: DesignBatch, lengths: Array) -> Array:
        """Whether the input that runs may begin to go the way that it is to go (designs,) from where a march starts."""
        u = march.u0[self.reference.running_index]
        rooms = self.limits.input_rooms(u, lengths)
        return np.asarray((rooms > SURE_DISTANCE) & (self.limits.input_rooms(u, -lengths) >= -SAME_END))

    def find_input_stops(self, march: DesignBatch, lengths: Array) -> tuple[Array, Array, Array]:
        """Where the input that runs meets a stop of its own in a march to either side: how far the stops are, rad or
        sizes, how many steps are solved up to there, and whether that is clear, each (designs,); a step at the stop
        itself is solved."""
        index = self.reference.running_index
        distances = np.abs(march.input_offsets[:, index])
        rooms, last = self.limits.input_rooms(march.u0[index], lengths), distances[-1]
        ends = rooms < last - SAME_END
        solved = np.where(ends, np.maximum(np.searchsorted(distances, rooms + SAME_END), 1), len(distances))
        off = np.array([np.abs(distances[np.clip(solved - k, 0, len(distances) - 1)] - rooms) for k in (0, 1)])
        unclear = ends & ((off > SAME_END) & (off < SURE_DISTANCE * max(last, 1.0))).any(axis=0)
        return rooms, solved, ~unclear

    def needed_steps(self, march: DesignBatch, lengths: Array, fit: Array) -> int:
        """How many steps of a march show how far the input can go in any design that is fit (designs,)."""
        step_count = len(march.input_offsets)
        if not fit.any():
            return step_count
        _, solved, _ = self.find_input_stops(march, lengths)
        return min(step_count, int(solved[fit].max()) + STEPS_BEYOND_STOP)
