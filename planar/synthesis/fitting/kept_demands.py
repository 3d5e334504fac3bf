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
from planar.synthesis.fitting.demand_guard import MARGIN, DemandGuard, DemandSlopes
from planar.synthesis.fitting.normal_equations import RangeChanges

FIRST_WEIGHT, GREATEST_WEIGHT, WEIGHT_GROWTH = 1.0, 1e5, 5.0
"""Of a slack of one rad, or of the size, beside a miss of the size."""
ENOUGH_DROP = 0.3
"""Of what is lacking: where more is left after a change of the multipliers the weight grows."""
KEPT = 0.5 * MARGIN
"""What may lack of a slack, margin included, that is kept."""
REFINEMENT = 4
"""Positions for one of those spread over a motion, among which the least slacks are looked for."""
MINIMA = 3
"""Of each slack over a motion, beside which positions are placed."""


class KeptDemands:
    """The guard's positions of designs with slacks, multipliers and weights."""

    def __init__(self, guard: DemandGuard, numbers: Array, unknowns: Sequence[Array], y: Array, shares: Array):
        self.guard, self.shares, self.spread_count = guard, shares, y.shape[1]
        self.y, self.is_closed = guard.close(numbers, y, shares, unknowns)
        self.slack = guard.slacks(numbers, self.y)
        self.multipliers = np.zeros_like(self.slack)
        self.weight = np.full(len(y), FIRST_WEIGHT)
        self.lack_before = self.lack

    def take(self, rows: IntArray) -> None:
        """Only these designs go on."""
        for name in ("shares", "y", "is_closed", "slack", "multipliers", "weight", "lack_before"):
            setattr(self, name, getattr(self, name)[rows])

    @property
    def lack(self) -> Array:
        """By how much the demand is missed that is kept least (designs,)."""
        found: Array = np.maximum(-self.slack, 0.0).max(axis=(1, 2), initial=0.0)
        return found

    @property
    def is_kept(self) -> BoolArray:
        """Which designs keep all that is demanded at their positions."""
        return np.asarray(self.lack <= KEPT)

    def place(self, numbers: Array, unknowns: Sequence[Array], rows: IntArray) -> tuple[Array, Array, BoolArray]:
        """Of designs (rows) with changed numbers the unknowns and the slacks, and which still go together."""
        y, is_closed = self.guard.close(numbers, self.y[rows], self.shares[rows], unknowns)
        return y, self.guard.slacks(numbers, y), is_closed

    def accept(self, rows: IntArray, y: Array, slack: Array) -> None:
        """Designs go to where they were placed."""
        self.y[rows], self.slack[rows] = y, slack

    def penalty(self, slack: Array, rows: IntArray) -> Array:
        """What slacks add to the sum of squares (designs,)."""
        weight, own = self.weight[rows, None, None], self.multipliers[rows]
        found: Array = (np.maximum(own / weight - slack, 0.0) ** 2 * weight).sum(axis=(1, 2))
        return found

    def add_rows(self, normal: Array, slope: Array, numbers: Array, changes: RangeChanges, rows: IntArray) -> None:
        """Add to normal equations what slacks that count contribute."""
        weight = self.weight[rows]
        short = self.multipliers[rows] / weight[:, None, None] - self.slack[rows]
        is_near = short > 0.0
        if not is_near.any():
            return
        found = self.guard.slopes(numbers, self.y[rows], is_near)
        design = found.designs
        moved, whole = self._with_range(found, changes, slope.shape[1], rows)
        left = short[design, found.positions, found.rows] - moved
        root = weight[design]
        np.add.at(normal, design, root[:, None, None] * whole[:, :, None] * whole[:, None, :])
        np.add.at(slope, design, -(root * left)[:, None] * whole)

    def press(self) -> None:
        """Multipliers by what is lacking, and more weight where that has not fallen."""
        self.multipliers = np.maximum(self.multipliers - self.weight[:, None, None] * self.slack, 0.0)
        lack = self.lack
        slow = (lack > ENOUGH_DROP * self.lack_before) & (lack > KEPT)
        self.weight = np.where(slow, np.minimum(self.weight * WEIGHT_GROWTH, GREATEST_WEIGHT), self.weight)
        self.lack_before = lack

    def _with_range(self, found: DemandSlopes, changes: RangeChanges, size: int, rows: IntArray) -> tuple[Array, Array]:
        """How slacks change by themselves (k,), as the range of the entries does, and with the globals (k, size)."""
        whole = np.zeros((len(found.designs), size))
        whole[:, : found.by_numbers.shape[1]] = found.by_numbers
        if not self.guard.over_range:
            return np.zeros(len(whole)), whole
        own, slopes = changes.between(found.designs, self.shares[rows][found.designs, found.positions])
        return found.by_input * own, whole + found.by_input[:, None] * slopes

    def least_rows(
        self, numbers: Array, changes: RangeChanges, size: int, rows: IntArray, many: int
    ) -> tuple[Array, Array]:
        """The least slacks of designs (designs, many), and their slopes in the globals (designs, many, size)."""
        slack = self.slack[rows]
        flat = slack.reshape(len(rows), -1)
        many = min(many, flat.shape[1])
        least = np.argpartition(flat, many - 1, axis=1)[:, :many]
        is_near = np.zeros(flat.shape, bool)
        np.put_along_axis(is_near, least, True, axis=1)
        found = self.guard.slopes(numbers, self.y[rows], is_near.reshape(slack.shape))
        moved, whole = self._with_range(found, changes, size, rows)
        own = slack[found.designs, found.positions, found.rows] + moved  # of each design as many, in their order
        return own.reshape(len(rows), many), whole.reshape(len(rows), many, size)

    def relocate(self, numbers: Array, unknowns: Sequence[Array]) -> None:
        """Positions where slacks are least beside those spread over the motion, and multipliers anew."""
        every = np.linspace(0, self.spread_count - 1, REFINEMENT * (self.spread_count - 1) + 1)
        y, shares = (
            _between(self.y[:, : self.spread_count], every),
            _between(self.shares[:, : self.spread_count, None], every),
        )
        y, _ = self.guard.close(numbers, y, shares[..., 0], unknowns)
        at = _least_places(self.guard.slacks(numbers, y))
        near = np.concatenate([_between(each, at) for each in (y, shares)], axis=2)
        own, is_closed = self.guard.close(numbers, near[..., :-1], near[..., -1], unknowns)
        own = np.where(is_closed[:, None, None], own, near[..., :-1])
        own[~is_closed] = y[np.flatnonzero(~is_closed)[:, None], np.rint(at[~is_closed]).astype(int)]
        self.y = np.concatenate([self.y[:, : self.spread_count], own], axis=1)
        self.shares = np.concatenate([self.shares[:, : self.spread_count], near[..., -1]], axis=1)
        self.slack = self.guard.slacks(numbers, self.y)
        self.multipliers = np.zeros_like(self.slack)


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
