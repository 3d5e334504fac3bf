"""Designs fitted side by side: trial steps of their numbers and unknowns, with what is demanded of each.

What is demanded of a motion is an augmented Lagrangian. Every slack h adds (max(0, l - w h)^2 - l^2) / w to the sum of
squares, with a weight w and a multiplier l of its own, so that it is one row of the least squares more where it counts.
When the steps have come to rest l becomes max(0, l - w h): M. J. D. Powell, in R. Fletcher (ed.), Optimization,
Academic Press 1969, 283; R. T. Rockafellar, SIAM Journal on Control 12 (1974) 268.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.jets import TURN
from planar.synthesis.fitting.demand_rows import MARGIN, DemandGuard
from planar.synthesis.fitting.wanted_equations import (
    GlobalNumbers,
    InputChanges,
    LinearRows,
    WantedEquations,
    entry_moves,
    half_slopes,
    input_changes,
    normal_equations,
    predicted_residuals,
    solve_damped,
    tangents,
)
from planar.synthesis.task.synthesis_task import WantedFunction

LEAST_ORDERED = 3
"""Entries that have an order; two come one after the other, either way."""


class OrderSlacks:
    """Slacks of designs whose entries of some items are met in their order, either way; in one turn, if they turn.

    The sense of each design, and over which entries a new turn begins, is as it is at first. With no `is_kept` there
    are none.
    """

    def __init__(self, equations: Sequence[WantedEquations], unknowns: Sequence[Array], over_turn: bool, is_kept: bool):
        self.turns: list[Array] = []
        "of each ordered item what is added to the differences of inputs (designs, entries - 1)"
        self.senses: list[Array] = []
        self.over_turn = over_turn
        self.slices: list[slice] = []
        "of each ordered item among all entries"
        at = 0
        for item, y in zip(equations, unknowns, strict=True):
            wanted, many = item.rows.wanted, y.shape[1]
            if is_kept and not isinstance(wanted, WantedFunction) and wanted.in_order and many >= LEAST_ORDERED:
                self.slices.append(slice(at, at + many))
                self._add_item(np.diff(y[..., -1], axis=1))
            at += many

    def _add_item(self, steps: Array) -> None:
        if self.over_turn:
            onward, back = np.mod(steps, TURN), np.mod(-steps, TURN)
            sense = np.where(onward.sum(axis=1) <= back.sum(axis=1), 1.0, -1.0)
            gone = np.where(sense[:, None] > 0.0, onward, back)
            gone = np.where(gone > 0.75 * TURN, gone - TURN, gone)  # a little back, not nearly round
            self.turns.append(gone - sense[:, None] * steps)
        else:
            sense = np.where(steps.sum(axis=1) >= 0.0, 1.0, -1.0)
            self.turns.append(np.zeros_like(steps))
        self.senses.append(sense)

    def take(self, rows: IntArray) -> None:
        """Only these designs go on."""
        self.turns = [each[rows] for each in self.turns]
        self.senses = [each[rows] for each in self.senses]

    @property
    def count(self) -> int:
        """How many slacks a design has."""
        return sum(each.shape[1] + int(self.over_turn) for each in self.turns)

    def slacks(self, inputs: Array, rows: IntArray) -> Array:
        """How far the inputs (designs, entries) of designs go on from each entry to the next, and what is left of a
        turn after the last."""
        found = [np.zeros((len(rows), 0))]
        for own, sense, turns in zip(self.slices, self.senses, self.turns, strict=True):
            gone = sense[rows, None] * np.diff(inputs[:, own], axis=1) + turns[rows]
            found.append(gone)
            if self.over_turn:
                found.append(TURN - gone.sum(axis=1, keepdims=True))
        return np.concatenate(found, axis=1)

    def slopes(self, changes: Array, rows: IntArray) -> Array:
        """How slacks change (designs, slacks, ...) where inputs change by (designs, entries, ...)."""
        found = [np.zeros((len(rows), 0, *changes.shape[2:]))]
        for own, sense in zip(self.slices, self.senses, strict=True):
            gone = sense[rows].reshape(-1, *[1] * (changes.ndim - 1)) * np.diff(changes[:, own], axis=1)
            found.append(gone)
            if self.over_turn:
                found.append(-gone.sum(axis=1, keepdims=True))
        return np.concatenate(found, axis=1)


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
        inputs = np.concatenate([y[..., -1] for y in unknowns], axis=1)
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


@dataclass
class Trial:
    """Designs after a step (designs, ...)."""

    numbers: Array
    unknowns: list[Array]
    zeros: list[Array]
    tangents: list[Array]
    guarded: Array
    slack: Array
    is_good: BoolArray
    "(designs,): whether they go together at all that is looked at"
    is_shortened: BoolArray
    "(designs,): whether the step was made less than it was given"
    residuals: list[Array]

    @cached_property
    def misses(self) -> Array:
        """The sums of squares (designs,) of what is wanted alone."""
        return sum_squares(self.residuals)

    def replace(self, rows: IntArray, other: Trial, own: IntArray) -> None:
        """Designs (rows) as they are in another trial (own)."""
        for name, mine in vars(self).items():
            its = getattr(other, name)
            for here, there in zip(mine, its, strict=True) if isinstance(mine, list) else [(mine, its)]:
                here[rows] = there[own]


def sum_squares(residuals: Sequence[Array]) -> Array:
    """The sums (designs,) of squares of rows (designs, n, parts) of several kinds; infinite where one is not known."""
    found = np.zeros(len(residuals[0]))
    for residual in residuals:
        found += (residual**2).sum(axis=(1, 2))
    return np.where(np.isfinite(found), found, np.inf)


FIRST_DAMPING, LEAST_DAMPING, GREATEST_DAMPING = 1e-2, 1e-14, 1e8
"""Of the diagonal of the normal equations."""
CLOSING_STEPS = 4
MAX_CHANGE, MAX_MOVE = 0.3, 0.5
"""Of a free number, and of an entry's unknowns (rad, or of the size), in one step."""
ENOUGH_GAIN = 1e-7
"""Of the sum of squares: steps that win less, so often one after the other, are the last."""
IDLE_STEPS = 4
CURVED = 0.3
"""Of the change of the sum of squares: where rows differ from the first order by more, by the sum of squares of that, a
step is corrected by it."""
NEAR_DEAD_POINT = 0.02
"""Of the input beside all unknowns, along the path: where it is less a dead point is near."""
PERFECT = 1e-22
"""Of the sum of squares: there is nothing left to win."""
STRICTER, MOST_RETURNS = 30.0, 8
"""By how much a design is damped more that came not to go together between its positions, and how often it goes back to
where it did."""
SETTLED = 1e-6
"""Of the greatest multiplier of a demand: a change that is less is none."""
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class FitProblem:
    """Rows of several kinds of one structure, the bounds of its free numbers (scaled), and what is to be kept."""

    equations: tuple[WantedEquations, ...]
    lower: Array
    upper: Array
    guard: DemandGuard | None = None

    @cached_property
    def globals(self) -> GlobalNumbers:
        """The free numbers and zeros of scales."""
        return GlobalNumbers(self.equations, len(self.lower))


class MovingDesigns:
    """Designs of a fit, one row each."""

    def __init__(
        self,
        fit: FitProblem,
        numbers: Array,
        unknowns: list[Array],
        zeros: list[Array],
        guarded: tuple[Array, Array] | None,
    ):
        self.fit = fit
        self.numbers = np.clip(numbers, fit.lower, fit.upper)
        self.zeros = zeros
        self.tangents: list[Array] = [np.zeros_like(y) for y in unknowns]
        "along the path, the input rising"
        self.headings: list[Array] = [np.zeros(y.shape[:2]) for y in unknowns]
        "in which sense each entry went along its path last"
        self.unknowns = unknowns
        self.order: IntArray = np.arange(len(numbers))
        is_closed: BoolArray = np.ones(len(numbers), bool)
        for k, item in enumerate(fit.equations):
            way = tangents(item.jacobians(self.numbers, self.unknowns[k]))
            self.unknowns[k], own = item.close(self.numbers, self.unknowns[k], way, 2 * CLOSING_STEPS)
            way = tangents(np.nan_to_num(item.jacobians(self.numbers, self.unknowns[k])))
            self.tangents[k] = np.where(way[..., -1:] < 0.0, -way, way)
            is_closed &= own
        self.demands: KeptDemands | None = None
        self.whole: list[Array] | None = None
        "where designs were when they last went together everywhere between their positions"
        if fit.guard is not None and guarded is not None:
            order = OrderSlacks(fit.equations, self.unknowns, not fit.guard.over_range, fit.guard.keeps_order)
            self.demands = KeptDemands(fit.guard, order, self.numbers, self.unknowns, *guarded)
            is_closed &= self.demands.is_closed
        self.squares = np.full(len(numbers), np.inf)
        self.damping = np.full(len(numbers), FIRST_DAMPING)
        self.idle = np.zeros(len(numbers), int)
        self.returns = np.zeros(len(numbers), int)
        self.is_moving = is_closed
        self.squares[is_closed] = self.merits()[is_closed]
        self.take(np.flatnonzero(is_closed))

    def inexactness(self, numbers: Array, unknowns: Sequence[Array], zeros: Sequence[Array]) -> Array:
        """The greatest part of a miss (designs,) of what is to be met exactly."""
        found = np.zeros(len(numbers))
        for item, y, zero in zip(self.fit.equations, unknowns, zeros, strict=True):
            if item.rows.wanted.tolerance == 0.0:
                off = np.abs(item.residuals(numbers, y, zero)).max(axis=(1, 2), initial=0.0)
                found = np.maximum(found, np.where(np.isfinite(off), off, np.inf))
        return found

    def run(self, steps: int, before_step: Callable[[int], None] | None = None) -> None:
        """So many steps, or until none wins anything more."""
        for step in range(steps):
            if not self.is_moving.any():
                break
            if before_step is not None:
                before_step(step)
            self.advance()

    def take(self, rows: IntArray) -> None:
        """Only these designs go on."""
        for name in ("numbers", "squares", "damping", "idle", "returns", "is_moving", "order"):
            setattr(self, name, getattr(self, name)[rows])
        for many in (self.unknowns, self.zeros, self.tangents, self.headings):
            many[:] = [part[rows] for part in many]
        if self.demands is not None:
            self.demands.take(rows)
        if self.whole is not None:
            self.whole = [part[rows] for part in self.whole]

    def keep_best(self, many: int) -> None:
        """Only the best so many go on."""
        self.take(np.argsort(self.squares, kind="stable")[:many])

    def relocate_demands(self) -> BoolArray:
        """Watch designs where they keep demands least; those that do not go together everywhere between go back to
        where they last did, or are out where they never did. Which of them went together (designs,)."""
        assert self.demands is not None
        is_whole = self.demands.relocate(self.numbers, self.unknowns)
        own, known = np.flatnonzero(is_whole), self.whole is not None
        broken = np.flatnonzero(~is_whole)
        if self.whole is None:
            self.whole = self._places()
        self._put(broken, self.whole)
        self.squares = self.merits()
        if known:
            self.damping[broken] = np.maximum(self.damping[broken], FIRST_DAMPING) * STRICTER
            self.returns[broken] += 1
            self.idle[broken], self.is_moving[broken] = 0, self.returns[broken] <= MOST_RETURNS
        else:
            self.squares[broken], self.is_moving[broken] = np.inf, False
        for k, each in enumerate(self._places()):
            self.whole[k][own] = each[own]
        return is_whole

    def _places(self) -> list[Array]:
        """What tells where designs are."""
        assert self.demands is not None
        every = [self.numbers, *self.unknowns, *self.zeros, *self.tangents, self.demands.y, self.demands.shares]
        return [each.copy() for each in every]

    def _put(self, rows: IntArray, places: Sequence[Array]) -> None:
        """Designs (rows) to where they were."""
        assert self.demands is not None
        many, parts = len(self.unknowns), [place[rows] for place in places]
        self.numbers[rows] = parts[0]
        for own, first in ((self.unknowns, 1), (self.zeros, 1 + many), (self.tangents, 1 + 2 * many)):
            for k, each in enumerate(own):
                each[rows] = parts[first + k]
        self.demands.put(rows, self.numbers[rows], [y[rows] for y in self.unknowns], *parts[-2:])

    def press(self) -> bool:
        """Begin anew with multipliers by which demands are kept better; whether there is anything to be won."""
        assert self.demands is not None
        before = self.demands.multipliers
        self.demands.press()
        changed = np.abs(self.demands.multipliers - before).max(axis=1, initial=0.0)
        self.is_moving = changed > SETTLED * self.demands.multipliers.max(axis=1, initial=0.0)
        self.damping[self.is_moving], self.idle[self.is_moving] = FIRST_DAMPING, 0
        self.squares = self.merits()
        return bool(self.is_moving.any())

    def merits(self) -> Array:
        """The sums of squares, with what demands add to them."""
        found = self.misses(self.numbers, self.unknowns, self.zeros)
        if self.demands is not None:
            found = found + self.demands.penalty(self.demands.slack, np.arange(len(found)))
        return found

    def misses(self, numbers: Array, unknowns: Sequence[Array], zeros: Sequence[Array]) -> Array:
        """The sums of squares (designs,) of what is wanted alone."""
        return sum_squares(self._residuals(numbers, unknowns, zeros))

    def _residuals(self, numbers: Array, unknowns: Sequence[Array], zeros: Sequence[Array]) -> list[Array]:
        every = zip(self.fit.equations, unknowns, zeros, strict=True)
        return [each.residuals(numbers, y, zero) for each, y, zero in every]

    def linearise(self, rows: IntArray) -> tuple[list[LinearRows], Array, Array]:
        """The rows of designs to the first order, and their normal equations, without what is demanded."""
        fit = self.fit
        lines = []
        for k, item in enumerate(fit.equations):
            line = item.linearise(
                self.numbers[rows], self.unknowns[k][rows], self.zeros[k][rows], self.tangents[k][rows]
            )
            lines.append(line if item.is_timed else self._held_at_dead_points(line, self.headings[k][rows]))
        return lines, *normal_equations(fit.equations, lines, fit.globals)

    def input_changes(self, rows: IntArray, lines: Sequence[LinearRows]) -> InputChanges:
        """How the inputs of all entries change in a step."""
        unknowns = [y[rows] for y in self.unknowns]
        return input_changes(self.fit.equations, lines, unknowns, self.fit.globals)

    def advance(self) -> None:
        """One step of every design that still moves; one that wins nothing is taken back."""
        rows = np.flatnonzero(self.is_moving)
        numbers = self.numbers[rows]
        lines, normal, slope = self.linearise(rows)
        if self.demands is not None:
            self.demands.add_rows(normal, slope, numbers, self.input_changes(rows, lines), rows)
        change = solve_damped(normal, slope, self.damping[rows], numbers, self.fit.lower, self.fit.upper)
        trial = self.tried(rows, lines, change)
        self._correct_curved(rows, lines, (normal, slope), change, trial)
        squares = self._merits(trial, rows)
        is_better = trial.is_good & (squares < self.squares[rows])
        gain = (self.squares[rows] - squares)[is_better] / np.maximum(self.squares[rows][is_better], TINY)
        self.accept(rows, is_better, trial)
        own = rows[is_better]
        self.squares[own] = squares[is_better]
        self.idle[rows[~is_better]] += 1
        self.idle[own] = np.where(gain < ENOUGH_GAIN, self.idle[own] + 1, 0)
        factor = np.where(is_better, 0.2, 6.0)
        self.damping[rows] = np.clip(self.damping[rows] * factor, LEAST_DAMPING, None)
        is_stuck = self.damping > GREATEST_DAMPING
        self.is_moving &= ~is_stuck & (self.squares > PERFECT)
        self.is_moving &= self.idle < np.where(self.damping < 1.0, 12, IDLE_STEPS)

    def _merits(self, trial: Trial, rows: IntArray) -> Array:
        """The sums of squares after a trial, with what demands add to them."""
        return trial.misses if self.demands is None else trial.misses + self.demands.penalty(trial.slack, rows)

    def _correct_curved(
        self, rows: IntArray, lines: Sequence[LinearRows], system: tuple[Array, Array], change: Array, trial: Trial
    ) -> None:
        """Replace designs of a trial whose rows differ much from the first order by those after a step that regards the
        difference, where these are better.

        In narrow curved valleys that makes steps longer by far: M. K. Transtrum, B. B. Machta, J. P. Sethna, Physical
        Review E 83 (2011) 036701; the second order is taken from the trial itself here."""
        fit, squares = self.fit, self._merits(trial, rows)
        off = [
            residual - predicted_residuals(item, line, change[:, fit.globals.columns(k)])
            for k, (item, line, residual) in enumerate(zip(fit.equations, lines, trial.residuals, strict=True))
        ]
        is_curved = sum_squares(off) > CURVED * np.abs(self.squares[rows] - squares)
        own = np.flatnonzero(trial.is_good & ~trial.is_shortened & np.isfinite(squares) & is_curved)
        if not len(own):
            return
        few, left = rows[own], [each[own] for each in off]
        bent = [LinearRows(*(part[own] for part in line)) for line in lines]
        normal, slope = (each[own] for each in system)
        slope = slope + half_slopes(fit.equations, bent, left, fit.globals)
        bent = [line._replace(residual=line.residual + each) for line, each in zip(bent, left, strict=True)]
        change = solve_damped(normal, slope, self.damping[few], self.numbers[few], fit.lower, fit.upper)
        other = self.tried(few, bent, change)
        better = np.flatnonzero(other.is_good & (self._merits(other, few) < squares[own]))
        trial.replace(own[better], other, better)

    def tried(self, rows: IntArray, lines: Sequence[LinearRows], change: Array) -> Trial:
        """Designs after a change (designs, globals) of their free numbers and zeros, shortened where it is great."""
        fit = self.fit
        moves = [
            entry_moves(item, line, change[:, fit.globals.columns(k)])
            for k, (item, line) in enumerate(zip(fit.equations, lines, strict=True))
        ]
        shortened = self._shortening(change, moves)
        after = np.clip(self.numbers[rows] + shortened[:, None] * change[:, : fit.globals.free], fit.lower, fit.upper)
        is_good: BoolArray = np.asarray(np.isfinite(change).all(axis=1))
        unknowns: list[Array] = []
        zeros: list[Array] = []
        ways: list[Array] = []
        for k, each in enumerate(fit.equations):
            before = self.tangents[k][rows]
            moved = self.unknowns[k][rows] + shortened[:, None, None] * moves[k]
            y, is_closed = each.close(after, moved, before, CLOSING_STEPS)
            way = each.tangents_near(after, y, before)
            if not each.is_timed:
                is_closed &= (way[..., -1] > 0.0).all(axis=1)  # not beyond a dead point
            is_good = np.asarray(is_good & is_closed)
            unknowns.append(y)
            zeros.append(self.zeros[k][rows] + shortened[:, None] * change[:, fit.globals.zero_columns[k]])
            ways.append(way)
        guarded: Array = np.zeros((len(rows), 0))
        slack = guarded
        if self.demands is not None:
            guarded, slack, is_closed = self.demands.place(after, unknowns, rows)
            is_good = np.asarray(is_good & is_closed)
        residuals = self._residuals(after, unknowns, zeros)
        return Trial(after, unknowns, zeros, ways, guarded, slack, is_good, shortened < 1.0, residuals)

    def accept(self, rows: IntArray, is_better: BoolArray, trial: Trial) -> None:
        """Designs (rows) that are better after a trial go on from there."""
        own = rows[is_better]
        self.numbers[own] = trial.numbers[is_better]
        for k, y in enumerate(trial.unknowns):
            gone = np.sum((y[is_better] - self.unknowns[k][own]) * trial.tangents[k][is_better], axis=-1)
            self.headings[k][own] = np.sign(gone)
            self.unknowns[k][own], self.zeros[k][own] = y[is_better], trial.zeros[k][is_better]
            self.tangents[k][own] = trial.tangents[k][is_better]
        if self.demands is not None:
            self.demands.accept(own, trial.guarded[is_better], trial.slack[is_better])

    def _held_at_dead_points(self, line: LinearRows, heading: Array) -> LinearRows:
        """Entries that would go on towards a dead point which they have come to stay where they are along the path."""
        towards = -np.sign(np.einsum("cnp,cnp->cn", line.along, line.residual))
        rate = line.tangent[..., -1] / np.linalg.norm(line.tangent, axis=-1)
        is_held = (np.abs(rate) < NEAR_DEAD_POINT) & (towards == heading)
        return line._replace(along=np.where(is_held[..., None], 0.0, line.along))

    def _shortening(self, change: Array, moves: Sequence[Array]) -> Array:
        """By how much steps are shortened (designs,), to stay where the first order tells something."""
        greatest = np.abs(change[:, : self.fit.globals.free]).max(axis=1, initial=0.0) / MAX_CHANGE
        for move in moves:
            greatest = np.maximum(greatest, np.abs(move).max(axis=(1, 2), initial=0.0) / MAX_MOVE)
        found: Array = 1.0 / np.maximum(np.nan_to_num(greatest, nan=1.0), 1.0)
        return found
