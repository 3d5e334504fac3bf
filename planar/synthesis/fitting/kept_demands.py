"""What is demanded of a motion as an augmented Lagrangian of a fit, for designs side by side.

Every slack h adds (max(0, l - w h)^2 - l^2) / w to the sum of squares, with a weight w and a multiplier l of its own,
so that it is one row of the least squares more where it counts. When the steps have come to rest l becomes
max(0, l - w h): M. J. D. Powell, in R. Fletcher (ed.), Optimization, Academic Press 1969, 283; R. T. Rockafellar, SIAM
Journal on Control 12 (1974) 268.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.fitting.demand_guard import MARGIN, DemandGuard
from planar.synthesis.fitting.normal_equations import InputChanges
from planar.synthesis.fitting.order_slacks import OrderSlacks

FIRST_WEIGHT, GREATEST_WEIGHT, WEIGHT_GROWTH = 1.0, 1e5, 5.0
"""Of a slack of one rad, or of the size, beside a miss of the size."""
ENOUGH_DROP = 0.3
"""Of what is lacking: where more is left after a change of the multipliers the weight grows."""
KEPT = 0.25 * MARGIN
"""What may lack of a slack, margin included, that is kept."""
REFINEMENT = 4
"""Positions for one of those spread over a motion, among which the least slacks are looked for."""
MINIMA = 3
"""Of each slack over a motion, beside which positions are placed."""


class KeptDemands:
    """The guard's positions of designs, with all slacks, those of positions first, their multipliers and weights."""

    def __init__(
        self, guard: DemandGuard, order: OrderSlacks, numbers: Array, unknowns: Sequence[Array], y: Array, shares: Array
    ):
        self.guard, self.order, self.shares, self.spread_count = guard, order, shares, y.shape[1]
        every = np.arange(len(y))
        self.y = y
        self.y, self.slack, self.is_closed = self.place(numbers, unknowns, every)
        self.multipliers = np.zeros_like(self.slack)
        self.weight = np.full(len(y), FIRST_WEIGHT)
        self.lack_before = self.lack

    @property
    def can_lack(self) -> bool:
        """Whether anything is demanded but that designs go together."""
        return bool(self.guard.rows) or self.order.count > 0

    def take(self, rows: IntArray) -> None:
        """Only these designs go on."""
        for name in ("shares", "y", "is_closed", "slack", "multipliers", "weight", "lack_before"):
            setattr(self, name, getattr(self, name)[rows])
        self.order.take(rows)

    @property
    def lack(self) -> Array:
        """By how much the demand is missed that is kept least (designs,)."""
        return lacks(self.slack)

    @property
    def is_kept(self) -> BoolArray:
        """Which designs keep all that is demanded at their positions."""
        return np.asarray(self.lack <= KEPT)

    def place(self, numbers: Array, unknowns: Sequence[Array], rows: IntArray) -> tuple[Array, Array, BoolArray]:
        """Of designs (rows) with changed numbers the unknowns and the slacks, and which still go together."""
        y, is_closed = self.guard.close(numbers, self.y[rows], self.shares[rows], unknowns)
        return y, self._slacks(numbers, y, unknowns, rows), is_closed

    def _slacks(self, numbers: Array, y: Array, unknowns: Sequence[Array], rows: IntArray) -> Array:
        inputs = np.concatenate([each[..., -1] for each in unknowns], axis=1)
        own = self.guard.slacks(numbers, y)
        return np.concatenate([own, self.order.slacks(inputs, rows)], axis=1)

    def accept(self, rows: IntArray, y: Array, slack: Array) -> None:
        """Designs go to where they were placed."""
        self.y[rows], self.slack[rows] = y, slack

    def put(self, rows: IntArray, numbers: Array, unknowns: Sequence[Array], y: Array, shares: Array) -> None:
        """Designs go to positions where they were before."""
        self.y[rows], self.shares[rows] = y, shares
        self.slack[rows] = self._slacks(numbers, y, unknowns, rows)

    def penalty(self, slack: Array, rows: IntArray) -> Array:
        """What slacks add to the sum of squares (designs,)."""
        weight, own = self.weight[rows, None], self.multipliers[rows]
        found: Array = (np.maximum(own / weight - slack, 0.0) ** 2 * weight).sum(axis=1)
        return found

    def add_rows(self, normal: Array, slope: Array, numbers: Array, changes: InputChanges, rows: IntArray) -> None:
        """Add to normal equations what slacks that count contribute."""
        weight = self.weight[rows]
        short = self.multipliers[rows] / weight[:, None] - self.slack[rows]
        is_near = short > 0.0
        if not is_near.any():
            return
        design, which, moved, whole = self._slopes(numbers, changes, rows, is_near)
        left, root = short[design, which] - moved, weight[design]
        np.add.at(normal, design, root[:, None, None] * whole[:, :, None] * whole[:, None, :])
        np.add.at(slope, design, -(root * left)[:, None] * whole)

    def _slopes(
        self, numbers: Array, changes: InputChanges, rows: IntArray, is_near: BoolArray
    ) -> tuple[IntArray, IntArray, Array, Array]:
        """Of near slacks (designs, slacks), in their order: design, which one, how it changes by itself as inputs of
        entries do, and with the globals (k, globals)."""
        design, which = np.nonzero(is_near)
        moved, whole = np.zeros(len(design)), np.zeros((len(design), changes.slopes.shape[2]))
        count = self.slack.shape[1] - self.order.count
        is_ordered = which >= count
        if is_ordered.any():
            own = design[is_ordered], which[is_ordered] - count
            moved[is_ordered] = self.order.slopes(changes.own, rows)[own]
            whole[is_ordered] = self.order.slopes(changes.slopes, rows)[own]
        if not is_ordered.all():
            shaped = is_near[:, :count].reshape(len(rows), self.y.shape[1], self.guard.row_count)
            found = self.guard.slopes(numbers, self.y[rows], shaped)
            whole[~is_ordered, : found.by_numbers.shape[1]] = found.by_numbers
            if self.guard.over_range:
                by_range, slopes = changes.between(found.designs, self.shares[rows][found.designs, found.positions])
                moved[~is_ordered] = found.by_input * by_range
                whole[~is_ordered] += found.by_input[:, None] * slopes
        return design, which, moved, whole

    def least_rows(self, numbers: Array, changes: InputChanges, rows: IntArray, many: int) -> tuple[Array, Array]:
        """The least slacks of designs (designs, many), and their slopes in the globals (designs, many, globals)."""
        slack = self.slack[rows]
        many = min(many, slack.shape[1])
        if not many:
            return np.zeros((len(rows), 0)), np.zeros((len(rows), 0, changes.slopes.shape[2]))
        is_near = np.zeros(slack.shape, bool)
        np.put_along_axis(is_near, np.argpartition(slack, many - 1, axis=1)[:, :many], True, axis=1)
        design, which, moved, whole = self._slopes(numbers, changes, rows, is_near)
        found = slack[design, which] + moved
        return found.reshape(len(rows), many), whole.reshape(len(rows), many, -1)

    def press(self) -> None:
        """Multipliers by what is lacking, and more weight where that has not fallen."""
        self.multipliers = np.maximum(self.multipliers - self.weight[:, None] * self.slack, 0.0)
        lack = self.lack
        slow = (lack > ENOUGH_DROP * self.lack_before) & (lack > KEPT)
        self.weight = np.where(slow, np.minimum(self.weight * WEIGHT_GROWTH, GREATEST_WEIGHT), self.weight)
        self.lack_before = lack

    def relocate(self, numbers: Array, unknowns: Sequence[Array]) -> BoolArray:
        """Positions where slacks are least beside those spread over the motion, and multipliers anew; which designs go
        together everywhere between."""
        if not self.guard.rows:
            return np.ones(len(numbers), bool)
        every = np.linspace(0, self.spread_count - 1, REFINEMENT * (self.spread_count - 1) + 1)
        y, shares = (
            _between(self.y[:, : self.spread_count], every),
            _between(self.shares[:, : self.spread_count, None], every),
        )
        y, is_whole = self.guard.close(numbers, y, shares[..., 0], unknowns)
        at = _least_places(self.guard.slacks(numbers, y).reshape(len(y), -1, self.guard.row_count))
        near = np.concatenate([_between(each, at) for each in (y, shares)], axis=2)
        own, is_closed = self.guard.close(numbers, near[..., :-1], near[..., -1], unknowns)
        own = np.where(is_closed[:, None, None], own, near[..., :-1])
        own[~is_closed] = y[np.flatnonzero(~is_closed)[:, None], np.rint(at[~is_closed]).astype(int)]
        self.y = np.concatenate([self.y[:, : self.spread_count], own], axis=1)
        self.shares = np.concatenate([self.shares[:, : self.spread_count], near[..., -1]], axis=1)
        self.slack = self._slacks(numbers, self.y, unknowns, np.arange(len(numbers)))
        self.multipliers = np.zeros_like(self.slack)
        return is_whole


def lacks(slack: Array) -> Array:
    """By how much slacks (designs, slacks) are below zero at most (designs,)."""
    found: Array = np.maximum(-slack, 0.0).max(axis=1, initial=0.0)
    return found


def _between(values: Array, at: Array) -> Array:
    """Values (designs, positions, parts) at places between, (k,) or (designs, k), by the positions' numbers."""
    at = np.broadcast_to(at, (len(values), at.shape[-1]))
    first = np.clip(at.astype(int), 0, max(values.shape[1] - 2, 0))
    every = np.arange(len(values))[:, None]
    low, high = values[every, first], values[every, np.minimum(first + 1, values.shape[1] - 1)]
    found: Array = low + (at - first)[..., None] * (high - low)
    return found


def _least_places(slack: Array) -> Array:
    """Where each slack (designs, positions, rows) has its lowest minima, by a parabola (designs, rows * MINIMA)."""
    last = slack.shape[1] - 1
    beyond = np.concatenate([np.full_like(slack[:, :1], np.inf), slack, np.full_like(slack[:, :1], np.inf)], axis=1)
    is_least = (beyond[:, :-2] >= slack) & (beyond[:, 2:] >= slack)
    order = np.argsort(np.where(is_least, slack, np.inf), axis=1, kind="stable")[:, :MINIMA]
    is_own = np.take_along_axis(is_least, order, axis=1)
    at = np.where(is_own, order, order[:, :1])
    low, here, high = (np.take_along_axis(slack, np.clip(at + step, 0, last), axis=1) for step in (-1, 0, 1))
    bend = low - 2.0 * here + high
    off = np.where(bend > 0.0, 0.5 * (low - high) / np.where(bend > 0.0, bend, 1.0), 0.0)
    off = np.where((at > 0) & (at < last), np.clip(off, -0.5, 0.5), 0.0)
    found: Array = (at + off).reshape(len(slack), -1)
    return found
