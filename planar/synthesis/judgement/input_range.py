"""The range of a design's input, and the positions in it at which entries are met in their order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import isclose

import numpy as np

from planar.dynamics.flywheel import whole_turns
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.jets import TURN
from planar.model.mechanism import Mechanism, links_counting_turns, relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion
from planar.solving.cycle import cycle

WITHOUT_END = 0.5
"""Of the span of the entries: how much more of a range that has no end is looked at, to both sides."""
ON_END = 1e-6
"""Of the range: an entry so little beyond the end of a branch is on it."""


@dataclass(frozen=True)
class InputRange:
    """The running input goes from `low` to `high` (rad or m).

    `is_whole_turn`: no dead point ends it. `is_cyclic`: after a turn all is as it was, so that positions a turn apart
    are the same; where gears bring it back after several turns only, it is followed over all entries. `turns` tells an
    angle from a length, `counts_turns` whether gears make positions a turn apart others.
    """

    pair: str
    low: float
    high: float
    is_whole_turn: bool
    is_cyclic: bool
    turns: bool
    counts_turns: bool

    @property
    def margin(self) -> float:
        """How far inside its ends positions are looked at: there a branch ends."""
        return 0.0 if self.is_whole_turn else ON_END * max(self.high - self.low, 1e-3)

    @property
    def kind(self) -> str:
        """Of the quantity."""
        return "angle" if self.turns else "length"

    def are_beyond(self, inputs: Array) -> BoolArray:
        """Which positions (n,) lie beyond an end."""
        if self.is_whole_turn:
            return np.zeros(len(inputs), bool)
        inputs = self._turned(inputs)
        beyond: BoolArray = np.asarray((inputs < self.low - self.margin) | (inputs > self.high + self.margin))
        return beyond

    def bring(self, inputs: Array) -> Array:
        """Positions (n,) by whole turns, or from a hair beyond its ends, within it."""
        brought: Array = np.clip(self._turned(inputs), self.low, self.high)
        return brought

    def _turned(self, inputs: Array) -> Array:
        """Angles by whole turns where they are in the range, or nearest to its middle, unless they count turns."""
        turned: Array = inputs
        if self.is_cyclic:
            turned = self.low + np.mod(inputs - self.low, TURN)
        elif self.turns and not self.counts_turns:
            turned = inputs - TURN * np.round((inputs - 0.5 * (self.low + self.high)) / TURN)
        return turned

    def is_in_order(self, inputs: Array) -> bool:
        """Whether positions (n,) rise or fall all the way; once round at most where it is cyclic."""
        if len(inputs) < 3:
            return True
        steps = np.diff(inputs)
        if not self.is_cyclic:
            return bool((steps > -1e-9).all() or (steps < 1e-9).all())
        rounds = float(np.mod(steps, TURN).sum()) / TURN, float(np.mod(-steps, TURN).sum()) / TURN
        return min(rounds) < 1.0 + 1e-9


def range_motion(mechanism: Mechanism, inputs: Sequence[Array], steps: int) -> Motion:
    """The motion through all of the running input's range; where that has no end, from the first of its positions (n,)
    to the last, and some more if it goes so far. Raises NoAnswer."""
    pair = mechanism.inputs[0].pair
    try:
        return cycle(mechanism, steps, pair=pair)
    except BadInput:
        every = np.concatenate(inputs)
    low, high = float(every.min()), float(every.max())
    room = WITHOUT_END * max(high - low, 1e-6)
    try:
        return cycle(mechanism, steps, low - room, high + room, pair)
    except NoAnswer:
        return cycle(mechanism, steps, low, high, pair)


def input_range(motion: Motion, inputs: Sequence[Array]) -> InputRange:
    """The range of the running input of a motion through all of it, for entries at positions of it (n,)."""
    pair = motion.mechanism.inputs[0].pair
    given = motion.inputs[pair].position
    low, high = float(given.min()), float(given.max())
    turns = relative_motions(motion.mechanism)[pair].input_kind is not MeasureKind.LENGTH
    counts_turns = bool(links_counting_turns(motion.mechanism))
    is_whole = turns and isclose(high - low, TURN, rel_tol=1e-9)
    is_cyclic = is_whole and whole_turns(motion, pair) == 1
    if is_whole and not is_cyclic:
        every = np.concatenate(inputs)
        low, high = min(low, float(every.min())), max(high, float(every.max()))
    return InputRange(pair, low, high, is_whole, is_cyclic, turns, counts_turns)


SAMPLES, CUTS = 360, 60
"""Positions of the range that are looked at, and those of a turn after which the first entry may come."""
REFINEMENTS, FINER = 4, 4
"""How often, and by how much, positions are looked at more closely."""


def ordered_inputs(misses_at: Callable[[Array], Array], low: float, high: float, is_whole: bool) -> Array:
    """The inputs (n,) between `low` and `high`, rising or falling from entry to entry, of least sum of squared misses.

    `misses_at` tells for inputs (m,) how far each entry is missed there (m, n). Of a whole turn entries may go on over
    its end, once round at most. The assignment of samples is found by dynamic programming.
    """
    span = high - low
    given = np.linspace(low, high, SAMPLES + 1)
    square = misses_at(given) ** 2
    best = np.inf
    inputs: Array = given
    for cut in range(0, SAMPLES, SAMPLES // CUTS) if is_whole else (0,):
        samples = np.arange(SAMPLES + 1) + cut  # of a whole turn beyond its end
        for order in (samples, samples[::-1]):
            total, steps = _least_rising(square[order % SAMPLES if is_whole else order])
            if total < best:
                best, inputs = total, low + order[steps] * (span / SAMPLES)
    if not is_whole:
        return _refined(misses_at, inputs, span / SAMPLES, (low, high), np.inf)

    def turned(beyond: Array) -> Array:
        within: Array = low + np.mod(beyond - low, span)
        return within

    endless = -np.inf, np.inf
    return turned(_refined(lambda tried: misses_at(turned(tried)), inputs, span / SAMPLES, endless, span))


def _least_rising(square: Array) -> tuple[float, IntArray]:
    """Rising rows (n,) of squared misses (rows, n), one a column, of the least sum, and that sum."""
    rows = np.arange(len(square))
    total, back = square[:, 0].copy(), []
    for column in square.T[1:]:
        least = np.minimum.accumulate(total)
        back.append(np.maximum.accumulate(np.where(total <= least, rows, 0)))
        total = least + column
    row = int(np.argmin(total))
    sum_of_squares, steps = float(total[row]), [row]
    for each in reversed(back):
        steps.append(int(each[steps[-1]]))
    return sum_of_squares, np.array(steps[::-1])


def _refined(
    misses_at: Callable[[Array], Array], inputs: Array, width: float, ends: tuple[float, float], most: float
) -> Array:
    """Each input moved to where it is nearest between the ends, less far than half of the way to its neighbours; from
    the first to the last it is so far at most."""
    every = np.arange(len(inputs))
    for _ in range(REFINEMENTS):
        left = most - abs(inputs[-1] - inputs[0])
        apart = np.abs(np.diff(inputs))
        apart = np.concatenate([[left], apart, [left]])
        room = np.minimum(width, 0.5 * np.minimum(apart[:-1], apart[1:]))
        offsets = np.linspace(-1.0, 1.0, 2 * FINER + 1)
        tried = np.clip(inputs[:, None] + offsets * room[:, None], *ends)
        off = misses_at(tried.ravel()).reshape(*tried.shape, len(inputs))[every, :, every]
        inputs = tried[every, np.argmin(off, axis=1)]
        width /= FINER
    return inputs
