"""The stops of a batch's designs: functions of a position that reach one where a pair meets its stop."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import BoolArray
from planar.model.mechanism import Mechanism, links_counting_turns
from planar.model.pairs import MeasureKind, Pair

Array = np.ndarray

NUMBERS_PER_STOP = 4
"""Numbers a, b, c, d of a pair's stops: see `StopLimits`."""
TURN = 2.0 * np.pi
NEAR_ANGLE = 0.5 * np.pi
"""rad: so near to a stop a sine tells on which side of it an angle is."""
WIDE_RANGE = 2.0 * 2.8
"""rad: a range of an angle from which on both of its stops are too near to each other from outside."""
LEAST_RANGES = (0.1, 0.02)
"""rad of an angle, and rad or sizes of what else there is: what moves in a narrower range is left to itself."""
SURE_DISTANCE = 1e-8
"""rad or sizes: what is so near to a stop is left to be judged by itself."""
SAME_END = 1e-10
"""rad or sizes: a range of the input that ends so near to a stop ends there, and is whole."""


class StopLimits(NamedTuple):
    """Stops of some pairs in many designs, in sizes and rad.

    low, high (stops, designs): between which the pairs can go, infinite where open, of angles that do not count turns
    (`is_periodic`) a turn on. numbers (4 a stop, designs): with a, b, c and d of a pair its room is a cos x + b sin x +
    c of such an angle x, (a x + b)(c + d x) of anything else, one at most in the middle where both ends are closed.
    input_low, input_high (designs,): between which the input can go that runs.
    """

    pairs: tuple[Pair, ...]
    is_periodic: tuple[bool, ...]
    low: Array
    high: Array
    numbers: Array
    input_low: Array
    input_high: Array

    def select(self, designs: Array | slice) -> StopLimits:
        """Those of some of the designs."""
        rows = (values[..., designs] for values in (self.low, self.high, self.numbers, self.input_low, self.input_high))
        return StopLimits(self.pairs, self.is_periodic, *rows)

    def cleared(self) -> StopLimits:
        """The same functions, of which none ever reaches one."""
        clear = np.array([[0.0, 0.0 if periodic else 1.0, 1.0, 0.0] for periodic in self.is_periodic]).reshape(-1, 1)
        return self._replace(numbers=np.broadcast_to(clear, self.numbers.shape).copy())

    def find_rooms(self, positions: Array) -> Array:
        """How far positions (stops, designs) are from the nearer stop (stops, designs), rad or sizes; negative outside.

        Of an angle that does not count turns, from the middle of the range to the opposite of it.
        """
        low, high = positions - self.low, self.high - positions
        with np.errstate(invalid="ignore"):  # of open ends, which no periodic angle has
            from_middle = np.remainder(0.5 * (low - high) + np.pi, TURN) - np.pi
        return np.where(self._periodic_rows, 0.5 * (low + high) - np.abs(from_middle), np.minimum(low, high))

    @property
    def _periodic_rows(self) -> Array:
        return np.array(self.is_periodic, dtype=bool)[:, None]

    @property
    def wide_ranges(self) -> BoolArray:
        """Which stops are of an angle with a range of about a turn (stops, designs)."""
        return np.asarray(self._periodic_rows & (self.high - self.low > WIDE_RANGE))

    def near_positions(self, positions: Array) -> StopLimits:
        """The same with functions for designs whose positions (stops, designs) are inside: where an angle has a wide
        range they have one sign on either side of the nearer stop, as far as a quarter of a turn from it."""
        wide = self.wide_ranges
        low, high = np.mod(positions - self.low, TURN), np.mod(self.high - positions, TURN)
        numbers = self.numbers.copy()
        for stop, sense, is_nearer in ((self.low, 1.0, low <= high), (self.high, -1.0, high < low)):
            replaced = wide & is_nearer & (np.minimum(low, high) < NEAR_ANGLE)
            sine = [-sense * np.sin(stop), sense * np.cos(stop), np.zeros_like(stop)]
            for k, value in enumerate(sine):
                numbers[k::NUMBERS_PER_STOP][replaced] = value[replaced]
        return self._replace(numbers=numbers)

    def turns_between(self, positions: Array) -> Array:
        """rad to add to positions (stops, designs) of angles that do not count turns, so that they are above the lower
        stop by less than a turn; inside they then lie between both."""
        with np.errstate(invalid="ignore"):
            above = self.low + np.mod(positions - self.low, TURN)
        return np.asarray(np.where(self._periodic_rows, above - positions, 0.0))

    def input_rooms(self, inputs: Array, lengths: Array) -> Array:
        """How far the input that runs may go on from where it is (designs,), as it is to go so far to either side."""
        return np.asarray(np.where(lengths >= 0.0, self.input_high - inputs, inputs - self.input_low))

    def have_room(self, inputs: Array, lengths: Array) -> BoolArray:
        """Whether the input that runs may begin to go from where it is to the side of these lengths (designs,)."""
        behind = self.input_rooms(inputs, -lengths)
        return np.asarray((self.input_rooms(inputs, lengths) > SURE_DISTANCE) & (behind >= -SAME_END))

    def is_at_stop(self, positions: Array, stop: Array) -> Array:
        """Whether positions (stops, designs) are where a stop of each design (designs,) is, to rounding of a search."""
        columns = np.arange(positions.shape[1])
        offsets = np.stack([positions - self.low, self.high - positions])[:, stop, columns]
        periodic = self._periodic_rows[stop, 0]
        offsets = np.where(periodic, np.remainder(offsets + np.pi, TURN) - np.pi, offsets)
        return np.asarray(np.abs(offsets).min(axis=0) < SURE_DISTANCE)


def stop_limits(
    pairs: Sequence[Pair], is_periodic: Sequence[bool], low: Array, high: Array, inputs: tuple[Array, Array]
) -> StopLimits:
    """The limits of pairs between low and high (stops, designs), and of the input (designs,) below and above."""
    numbers = np.zeros((NUMBERS_PER_STOP * len(pairs), low.shape[1]))
    with np.errstate(all="ignore"):  # of open ends
        for k, periodic in enumerate(is_periodic):
            row, middle, half = NUMBERS_PER_STOP * k, 0.5 * (low[k] + high[k]), 0.5 * (high[k] - low[k])
            if periodic:
                scale = 1.0 / (1.0 - np.cos(half))
                values = [scale * np.cos(middle), scale * np.sin(middle), -scale * np.cos(half), np.zeros_like(half)]
            else:
                scale = np.where(np.isfinite(half), 1.0 / half**2, 1.0)
                is_upper = np.isinf(low[k])
                values = [
                    np.where(is_upper, -1.0, scale),
                    np.where(is_upper, high[k], -scale * low[k]),
                    np.where(np.isfinite(half), high[k], 1.0),
                    np.where(np.isfinite(half), -1.0, 0.0),
                ]
            numbers[row : row + NUMBERS_PER_STOP] = values
    return StopLimits(tuple(pairs), tuple(is_periodic), low, high, numbers, *inputs)


def stop_rooms(values: Sequence[Any], is_periodic: Sequence[bool], numbers: Sequence[Any], functions: Any) -> list[Any]:
    """The rooms of pairs at these values, in numbers or symbols; `functions` has cos and sin."""
    rooms = []
    for k, (x, periodic) in enumerate(zip(values, is_periodic, strict=True)):
        a, b, c, d = numbers[NUMBERS_PER_STOP * k : NUMBERS_PER_STOP * (k + 1)]
        rooms.append(a * functions.cos(x) + b * functions.sin(x) + c if periodic else (a * x + b) * (c + d * x))
    return rooms


def are_periodic(pairs: Sequence[Pair], mechanism: Mechanism) -> tuple[bool, ...]:
    """Of which pairs positions whole turns off are the same."""
    counting = links_counting_turns(mechanism)
    return tuple(pair.input_kind is MeasureKind.ANGLE and not counting.issuperset(pair.links) for pair in pairs)


def nearest_end(
    distance: Array, is_stopped: BoolArray, rooms: Array, lengths: Array | float
) -> tuple[Array, BoolArray]:
    """The distances of the ends of designs and which of them are stops (designs,): those given, or where the input
    meets a stop of its own within a range of these lengths if that is nearer; NaN if that is not clear."""
    nearest = np.fmin(distance, lengths)
    stops = rooms < lengths - SAME_END
    unclear = stops & (np.abs(rooms - nearest) < SURE_DISTANCE)
    first = stops & ~np.isnan(distance) & (rooms < nearest)
    return np.where(unclear, np.nan, np.where(first, rooms, distance)), is_stopped | first
