"""Where designs in closed form come to a dead point: looked at ahead of where a march left them, all at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.closed_form.joined_blocks import BlockJoiner, DeadPoints, FollowedBlocks, InputRanges
from planar.batch.march.backend import DesignBatch

Array = np.ndarray

MAX_WINDOWS = 40
"""Windows of positions that are looked at of a design that is not decided, each with finer or coarser steps."""
LEAST_INTERVALS, MOST_INTERVALS, POSITIONS_AT_ONCE = 3, 64, 4096
"""Intervals of a window; as many as make so many positions of all designs."""
REFINEMENT = 4.0
"""By how much steps are divided where it is not clear what lies between."""
LEAST_STEP_RATIO = 1e-4
"""Of the march's steps: what finer steps do not decide is left open."""
MAX_SECANTS, SECANTS_BEFORE_HALVING = 16, 8
"""Steps of the search for a zero, and after how many of them the bracket is halved."""
CUBIC_STEPS = 3
"""Steps of Newton's method to a cubic's root."""
ZERO_TOLERANCE, BRACKET_TOLERANCE = 4e-15, 1e-15
"""Coalescence from one, and rad or sizes, at which a dead point is found."""
FOUND_TOLERANCE = 1e-12
"""Coalescence from one at which it is taken for found."""
OTHER_PLACES = (0.25, 1e-10)
"""Parts of the way to a dead point that are left where other blocks are looked at."""


def find_dead_points(joiner: BlockJoiner, batch: DesignBatch, signs: Array, ranges: InputRanges) -> DeadPoints:
    """See `BlockJoiner.find_dead_points`, by what it joins (`BlockJoiner.follow`)."""
    found = DeadPoints(np.full(signs.shape[1], np.nan), np.full(signs.shape[1], -1))
    for sense in (1.0, -1.0):
        which = np.flatnonzero(np.sign(ranges.lengths) == sense)
        if which.size:
            direction = np.where(np.arange(len(batch.u0)) == ranges.running, sense, 0.0)
            own, span = np.take(signs, which, axis=1), np.abs(ranges.lengths)[which]
            with np.errstate(all="ignore"):  # beyond a dead point there is no number
                search = _DeadPointSearch(joiner, batch.select(which), own, direction, span)
                found.distance[which], found.block[which] = search.search(ranges.reached[which], ranges.step[which])
    return found


class _Brackets(NamedTuple):
    """Intervals (brackets,) in which a block of a design comes to a dead point: how far the block's coalescence is from
    one at both ends; where about it is one, and how fast it gets there."""

    design: Array
    block: Array
    x0: Array
    x1: Array
    f0: Array
    f1: Array
    guess: Array
    slope: Array


def _cubic_root(values: Array) -> tuple[Array, Array]:
    """Where cubics through values (4, ...) at -1, 0, 1, 2 are zero between 0 and 1, about, and their slopes there."""
    before, left, right, after = values
    middle = 0.5 * (before + right) - left
    third = (after - 3.0 * right + 3.0 * left - before) / 6.0
    linear = 0.5 * (right - before) - third
    x = left / (left - right)
    slope = linear
    for _ in range(CUBIC_STEPS):
        slope = linear + x * (2.0 * middle + 3.0 * third * x)
        x = x - (left + x * (linear + x * (middle + x * third))) / slope
    return x, slope


class _DeadPointSearch:
    def __init__(self, joiner: BlockJoiner, batch: DesignBatch, signs: Array, direction: Array, span: Array):
        self.joiner, self.batch, self.signs, self.direction, self.span = joiner, batch, signs, direction, span
        self.watched_count = len(signs) + len(batch.stop_pairs)
        "blocks, and pairs with stops"

    def search(self, reached: Array, step: Array) -> DeadPoints:
        """See `find_dead_points`; how far each came, and the steps in which it went."""
        count = len(reached)
        distance, block = np.full(count, np.nan), np.full(count, -1)
        active, x, longest, h = np.arange(count), reached.copy(), step, step.copy()
        brackets: list[_Brackets] = []
        own, signs = self.batch, self.signs
        most = float(np.max((self.span - reached) / step, initial=0.0))
        for _ in range(MAX_WINDOWS + int(most / LEAST_INTERVALS)):
            intervals = int(np.clip(POSITIONS_AT_ONCE // max(active.size, 1), LEAST_INTERVALS, MOST_INTERVALS))
            safe, crossing, first, found = self._look_ahead(own, signs, active, x, h, intervals)
            brackets.append(found)
            x = x + first * h
            ended = x >= self.span[active]
            distance[active[ended]] = np.inf
            h = np.where(safe, np.minimum(2.0 * h, longest[active]), h / REFINEMENT)
            on = ~ended & ~crossing & (h > LEAST_STEP_RATIO * longest[active])
            if not on.any():
                break
            if not on.all():
                which = np.flatnonzero(on)
                active, x, h = active[which], x[which], h[which]
                own, signs = own.select(which), np.take(signs, which, axis=1)
        self._find_zeros(_Brackets(*(np.concatenate(parts) for parts in zip(*brackets, strict=True))), distance, block)
        return DeadPoints(distance, block)

    def _evaluate(self, batch: DesignBatch, signs: Array, x: Array) -> FollowedBlocks:
        return self.joiner.follow(batch, signs, batch.u0 + x * self.direction[:, None])

    def _distances_from_meeting(self, batch: DesignBatch, signs: Array, x: Array) -> Array:
        """How far the coalescences are from one (positions, blocks, designs), at positions x (positions, designs)."""
        positions, designs = x.shape
        if x.size > POSITIONS_AT_ONCE:
            return np.array([1.0 - self._evaluate(batch, signs, each).coalescences for each in x])
        every = np.tile(np.arange(designs), positions)  # fewer calls, each of more
        found = self._evaluate(batch.select(every), signs[:, every], x.ravel()).coalescences
        return 1.0 - found.reshape(-1, positions, designs).transpose(1, 0, 2)

    def _look_ahead(
        self, batch: DesignBatch, signs: Array, active: Array, x: Array, h: Array, intervals: int
    ) -> tuple[Array, Array, Array, _Brackets]:
        """Which designs are safe all along a window, which surely come to a dead point in it, in how many intervals
        they are safe, and the intervals where they are not any more."""
        f = self._distances_from_meeting(batch, signs, x + np.arange(-1, intervals + 2)[:, None] * h)
        bend = np.abs(f[2:] - 2.0 * f[1:-1] + f[:-2])
        # of an interval that of both its ends, or of the one where it is known
        bend, left, right = np.fmax(bend[:-1], bend[1:]), f[1:-2], f[2:-1]
        safe = np.minimum(left, right) > 0.5 * bend
        falls = (left > 0.0) & (right <= 0.0) & (left - right > 2.0 * bend)
        whole = np.vstack([safe.all(axis=1), np.zeros((1, len(x)), dtype=bool)])
        first = np.argmin(whole, axis=0)
        every = first == intervals
        at, columns = np.minimum(first, intervals - 1), np.arange(len(x))
        block = np.argmin(safe[at, :, columns], axis=1)
        crossing = ~every & falls[at, block, columns]
        which = np.flatnonzero(crossing)
        begin, own = x[which] + first[which] * h[which], h[which]
        near = np.array([f[at[which] + k, block[which], which] for k in range(4)])
        root, slope = _cubic_root(near)
        guess = begin + root * own, slope / own
        found = active[which], block[which], begin, begin + own, near[1], near[2], guess[0], guess[1]
        return every, crossing, first, _Brackets(*found)

    def _find_zeros(self, brackets: _Brackets, distance: Array, block: Array) -> None:
        """The dead points, to round-off, of designs with brackets: secants, kept within the brackets."""
        if not brackets.design.size:
            return
        own, signs = self.batch.select(brackets.design), np.take(self.signs, brackets.design, axis=1)
        columns = np.arange(len(brackets.design))
        _, of, a, b, fa, fb, x, slope = brackets
        found, least, f, before, f_before = b, -fb, fb, b, fb
        for k in range(MAX_SECANTS):
            # the first by a cubic, then by its slope, then by secants; ever again the middle
            if k > 0:
                x, before, f_before = x - f / (slope if k == 1 else (f - f_before) / (x - before)), x, f
            if k % SECANTS_BEFORE_HALVING == SECANTS_BEFORE_HALVING - 1:
                x = 0.5 * (a + b)
            x = np.where((x > a) & (x < b), x, (a * fb - b * fa) / (fb - fa))
            f = 1.0 - self._evaluate(own, signs, x).coalescences[of, columns]
            nearer = np.abs(f) < least
            found, least = np.where(nearer, x, found), np.where(nearer, np.abs(f), least)
            up = f > 0.0
            a, fa, b, fb = np.where(up, x, a), np.where(up, f, fa), np.where(up, b, x), np.where(up, fb, f)
            if np.all((least <= ZERO_TOLERANCE) | (b - a <= BRACKET_TOLERANCE)):
                break
        sure = (least <= FOUND_TOLERANCE) & self._keep_apart(own, signs, of, brackets.x0, found)
        distance[brackets.design[sure]] = found[sure]
        block[brackets.design[sure]] = of[sure]

    def _keep_apart(self, batch: DesignBatch, signs: Array, of: Array, begin: Array, end: Array) -> Array:
        """Whether other blocks surely keep apart up to where one comes to its dead point.

        They change as the root of the way that is left: three places, evenly spread in that.
        """
        if self.watched_count == 1:
            return np.ones(len(of), dtype=bool)
        places = (begin, *(end - part * (end - begin) for part in OTHER_PLACES))
        f = np.array([1.0 - self._evaluate(batch, signs, x).coalescences for x in places])
        bend = np.abs(f[0] - 2.0 * f[1] + f[2])
        fine = f.min(axis=0) > 0.5 * bend
        fine[of, np.arange(len(of))] = True
        return np.asarray(fine.all(axis=0))
