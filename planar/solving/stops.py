"""The stops of a mechanism's pairs at its positions: how far each is, which are met, which are passed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import NoAnswer, Outcome, join_names
from planar.foundation.geometry import Frame
from planar.foundation.jets import value_and_rates
from planar.model.file_units import FileUnits
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, links_counting_turns, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import amount

STOP_TOLERANCE = 1e-9
"""rad or sizes: so near to its stop, or beyond it, a pair is at its stop."""
TURN = 2.0 * np.pi
MIN_SURE_ROWS, MAX_SURE_MOVE = 4, 0.3
"""Rows from which on, and how far apart (rad or sizes), those of a run tell what lies between them."""


class MetStop(NamedTuple):
    """A stop that a pair meets: its position (rad or m), whether it is the upper one, and the restitution there."""

    pair: str
    position: float
    is_upper: bool
    restitution: float = 0.0

    def describe(self, motions: Mapping[str, Pair], units: FileUnits) -> str:
        """It in words: pair 'B' meets its upper stop at 95 deg."""
        kind = motions[self.pair].input_quantity_kinds()[0]
        which = "upper" if self.is_upper else "lower"
        return f"pair {self.pair!r} meets its {which} stop at {amount(self.position, kind, units)}"


class PairStops:
    """The stops of a mechanism; lengths in m, angles in rad."""

    def __init__(self, mechanism: Mechanism, size: float):
        """`size`: of the mechanism, in parts of which lengths are compared (m)."""
        motions = relative_motions(mechanism)
        counting = links_counting_turns(mechanism)
        self.mechanism, self.motions = mechanism, motions
        self.pairs = tuple(motions[stop.pair] for stop in mechanism.stops)
        self.low = np.array([-np.inf if stop.low is None else stop.low for stop in mechanism.stops])
        self.high = np.array([np.inf if stop.high is None else stop.high for stop in mechanism.stops])
        self.scale = np.array([size if pair.input_kind is MeasureKind.LENGTH else 1.0 for pair in self.pairs])
        self.is_periodic = np.array(
            [pair.input_kind is MeasureKind.ANGLE and not counting.issuperset(pair.links) for pair in self.pairs]
        )
        "whether positions whole turns off are the same"
        # what stops a pin one way is there from the other side too, a turn on
        self.low = np.where(self.is_periodic & np.isinf(self.low), self.high - TURN, self.low)
        self.high = np.where(self.is_periodic & np.isinf(self.high), self.low + TURN, self.high)
        self.initial_turns: Array | None = None
        "whole turns (rad) to add to the positions of the mechanism's own assembly"

    def positions(
        self, shapes: Mapping[str, LinkShape], frames: Mapping[str, Frame], own: Mapping[str, Sequence[Any]]
    ) -> Array:
        """The positions of the pairs that have stops (stops,); (stops, rows) where frames are arrays."""
        positions = [value_and_rates(pair.input_position_at(shapes, frames, own))[0] for pair in self.pairs]
        return np.array(np.broadcast_arrays(*positions), dtype=float)

    def turns(self, positions: Array) -> Array:
        """Whole turns (rad) to add to positions (stops,) so that they lie between their stops; as few as can be, or
        those of the mechanism's own assembly where these do."""
        low, high = self.low - STOP_TOLERANCE, self.high + STOP_TOLERANCE
        up, down = TURN * np.ceil((low - positions) / TURN), TURN * np.ceil((positions - high) / TURN)
        turns: Array = np.zeros(len(positions))
        for choice in (np.where(positions < low, up, np.where(positions > high, -down, 0.0)), self.initial_turns):
            if choice is not None:
                is_inside = (low <= positions + choice) & (positions + choice <= high)
                turns = np.where(self.is_periodic & is_inside, choice, turns)
        return turns

    def rooms(self, positions: Array, turns: Array | None = None) -> Array:
        """How far positions (stops,) are from their lower and upper stops (2, stops), rad or sizes; negative beyond."""
        turned = positions + (self.turns(positions) if turns is None else turns)
        return np.array([turned - self.low, self.high - turned]) / self.scale

    def sure_rows(self, positions: Array, z: Array) -> BoolArray:
        """Which rows of a run surely come before any stop (rows,): positions (stops, rows), unknowns (rows, unknowns).

        Between two rows a smooth motion leaves the stretch between them by an eighth of its second difference; eight
        times that is allowed for, and rows that are far apart are not judged.
        """
        row_count = positions.shape[1]
        if row_count < MIN_SURE_ROWS:
            return np.zeros(row_count, dtype=bool)
        scaled = (positions + self.turns(positions[:, 0])[:, None]) / self.scale[:, None]
        low, high = ((limit / self.scale)[:, None] for limit in (self.low, self.high))
        room = np.minimum(scaled - low, high - scaled)
        second_differences = np.pad(np.abs(np.diff(scaled, 2, axis=1)), ((0, 0), (1, 1)), mode="edge")
        steps = np.maximum(second_differences[:, :-1], second_differences[:, 1:])
        clear = np.minimum(room[:, :-1], room[:, 1:]) > steps + STOP_TOLERANCE
        near = np.abs(np.diff(z, axis=0)).max(axis=1, initial=0.0) <= MAX_SURE_MOVE
        return np.append(room[:, 0].min() > STOP_TOLERANCE, clear.all(axis=0) & near)

    def side(self, is_upper: bool, index: int) -> MetStop:
        """One stop."""
        stop = self.mechanism.stops[index]
        return MetStop(stop.pair, float((self.high if is_upper else self.low)[index]), bool(is_upper), stop.restitution)

    def met_at(self, positions: Array) -> tuple[MetStop, ...]:
        """The stops at which positions (stops,) are, or beyond which."""
        near = np.argwhere(self.rooms(positions) <= STOP_TOLERANCE)
        return tuple(self.side(bool(side), int(k)) for side, k in near)

    def describe_met(self, positions: Array) -> str:
        """The stops that are met, in words."""
        return join_names([stop.describe(self.motions, self.mechanism.units) for stop in self.met_at(positions)])

    def refusal_outside(self, positions: Array, where: str) -> NoAnswer | None:
        """What to say of a position that lies outside of stops; None of one that does not."""
        rooms = self.rooms(positions)
        beyond = np.flatnonzero(rooms.min(axis=0) < -STOP_TOLERANCE)
        if not beyond.size:
            return None
        k, units = int(beyond[np.argmin(rooms.min(axis=0)[beyond])]), self.mechanism.units
        kind = self.pairs[k].input_quantity_kinds()[0]
        low, high = (amount(float(limit), kind, units) for limit in (self.low[k], self.high[k]))
        if not np.isfinite(self.low[k]):
            allowed, side = f"its stop at {high}", "above"
        elif not np.isfinite(self.high[k]):
            allowed, side = f"its stop at {low}", "below"
        else:
            allowed, side = f"its stops at {low} and {high}", "outside of"
        name, position = self.pairs[k].name, amount(float(positions[k]), kind, units)
        return NoAnswer(
            Outcome.STOP,
            f"{where} pair {name!r} is at {position}, {side} {allowed}; move the input, let the sketch choose another "
            f"assembly, or move the stop",
        )
