"""The stops of a block's designs where they start: of which designs a march can watch them, and which are outside."""

from __future__ import annotations

from typing import NamedTuple

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


class InputStops(NamedTuple):
    """How far inputs are from their stops, rad or sizes, how many steps there are up to these, and whether that is
    clear, each (designs,)."""

    distance: Array
    solved_steps: Array
    is_clear: Array


def stop_ranges(reference: ReferenceDesign, designs: Mechanism, many: int) -> tuple[list[Pair], Array, Array, Array]:
    """The pairs with stops, which of them are angles that do not count turns (stops,), and between which positions they
    can go (stops, designs), in sizes and rad; infinite where open, of such angles a turn on."""
    low, high = (
        stack_rows([open_ if end is None else end for end in ends], many)
        for ends, open_ in (
            ([each.low for each in designs.stops], -np.inf),
            ([each.high for each in designs.stops], np.inf),
        )
    )
    pairs = [reference.motions[each.pair] for each in designs.stops]
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
        self.reference, many = reference, u.shape[1]
        inputs = [given.pair for given in reference.mechanism.inputs]
        pairs, periodic, low, high = stop_ranges(reference, designs, many)
        self.is_outside, self.is_fit = np.zeros(many, dtype=bool), np.all(low < high, axis=0)
        ends = np.full(many, -np.inf), np.full(many, np.inf)
        for k, pair in enumerate(pairs):
            if pair.name in inputs:
                index = inputs.index(pair.name)
                found = self._watch_input(u[index], low[k], high[k], bool(periodic[k]))
                ends = found if index == reference.running_index else ends
        own = [k for k, pair in enumerate(pairs) if pair.name not in inputs]
        for k in own:
            least = LEAST_RANGES[0 if periodic[k] else 1]
            self.is_fit &= high[k] - low[k] >= least
            # farther it is to be known how many turns there were
            self.is_fit &= (high[k] - low[k] <= TURN + SURE_DISTANCE) if periodic[k] else True
        self.limits = stop_limits([pairs[k] for k in own], periodic[own].tolist(), low[own], high[own], ends)

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
        some = np.flatnonzero(np.isfinite(batch.z0).all(axis=0) & np.isfinite(u).all(axis=0))
        own = batch._replace(stops=self.limits).select(some)
        positions = DesignEvaluation(own).pair_positions(own.z0, u[:, some])
        rooms = self.limits.select(some).find_rooms(positions).min(axis=0)
        self.is_outside[some] |= self.is_fit[some] & (rooms < -SURE_DISTANCE)
        self.is_fit[some] &= rooms > SURE_DISTANCE

    def have_room(self, march: DesignBatch, lengths: Array) -> Array:
        """Whether the input that runs may begin to go the way that it is to go (designs,) from where a march starts."""
        u = march.u0[self.reference.running_index]
        rooms = self.limits.input_rooms(u, lengths)
        return np.asarray((rooms > SURE_DISTANCE) & (self.limits.input_rooms(u, -lengths) >= -SAME_END))

    def find_input_stops(self, march: DesignBatch, lengths: Array) -> InputStops:
        """Where the input that runs meets a stop of its own in a march to either side (designs,); a step at the stop
        itself is solved."""
        index = self.reference.running_index
        distances = np.abs(march.input_offsets[:, index])
        rooms, last = self.limits.input_rooms(march.u0[index], lengths), distances[-1]
        ends = rooms < last - SAME_END
        solved = np.where(ends, np.maximum(np.searchsorted(distances, rooms + SAME_END), 1), len(distances))
        off = np.array([np.abs(distances[np.clip(solved - k, 0, len(distances) - 1)] - rooms) for k in (0, 1)])
        unclear = ends & ((off > SAME_END) & (off < SURE_DISTANCE * max(last, 1.0))).any(axis=0)
        return InputStops(rooms, solved, ~unclear)

    def needed_steps(self, march: DesignBatch, lengths: Array, fit: Array) -> int:
        """How many steps of a march show how far the input can go in any design that is fit (designs,)."""
        every = len(march.input_offsets)
        if not fit.any():
            return every
        return min(every, int(self.find_input_stops(march, lengths).solved_steps[fit].max()) + STEPS_BEYOND_STOP)
