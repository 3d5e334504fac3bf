"""Designs on their way to what is wanted, side by side: what a step of each would be, and where it leads."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.fitting.demand_guard import DemandGuard
from planar.synthesis.fitting.kept_demands import KeptDemands
from planar.synthesis.fitting.normal_equations import (
    GlobalNumbers,
    InputChanges,
    entry_moves,
    half_slopes,
    input_changes,
    normal_equations,
    predicted_residuals,
    solve_damped,
)
from planar.synthesis.fitting.order_slacks import OrderSlacks
from planar.synthesis.fitting.trial import Trial, sum_squares
from planar.synthesis.fitting.wanted_equations import LinearRows, WantedEquations, tangents

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
        self.tangents: list[Array] = [np.zeros_like(each) for each in unknowns]
        "along the path, the input rising"
        self.headings: list[Array] = [np.zeros(each.shape[:2]) for each in unknowns]
        "in which sense each entry went along its path last"
        self.unknowns = unknowns
        self.order: IntArray = np.arange(len(numbers))
        is_closed: BoolArray = np.ones(len(numbers), bool)
        for k, each in enumerate(fit.equations):
            way = tangents(each.jacobians(self.numbers, self.unknowns[k]))
            self.unknowns[k], own = each.close(self.numbers, self.unknowns[k], way, 2 * CLOSING_STEPS)
            way = tangents(np.nan_to_num(each.jacobians(self.numbers, self.unknowns[k])))
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
        for each, y, zero in zip(self.fit.equations, unknowns, zeros, strict=True):
            if each.rows.wanted.tolerance == 0.0:
                off = np.abs(each.residuals(numbers, y, zero)).max(axis=(1, 2), initial=0.0)
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
            many[:] = [each[rows] for each in many]
        if self.demands is not None:
            self.demands.take(rows)
        if self.whole is not None:
            self.whole = [each[rows] for each in self.whole]

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
        many, parts = len(self.unknowns), [each[rows] for each in places]
        self.numbers[rows] = parts[0]
        for own, first in ((self.unknowns, 1), (self.zeros, 1 + many), (self.tangents, 1 + 2 * many)):
            for k, each in enumerate(own):
                each[rows] = parts[first + k]
        self.demands.put(rows, self.numbers[rows], [each[rows] for each in self.unknowns], *parts[-2:])

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
        for k, each in enumerate(fit.equations):
            line = each.linearise(
                self.numbers[rows], self.unknowns[k][rows], self.zeros[k][rows], self.tangents[k][rows]
            )
            lines.append(line if each.is_timed else self._held_at_dead_points(line, self.headings[k][rows]))
        return lines, *normal_equations(fit.equations, lines, fit.globals)

    def input_changes(self, rows: IntArray, lines: Sequence[LinearRows]) -> InputChanges:
        """How the inputs of all entries change in a step."""
        unknowns = [each[rows] for each in self.unknowns]
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
            residual - predicted_residuals(each, line, change[:, fit.globals.columns(k)])
            for k, (each, line, residual) in enumerate(zip(fit.equations, lines, trial.residuals, strict=True))
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
            entry_moves(each, line, change[:, fit.globals.columns(k)])
            for k, (each, line) in enumerate(zip(fit.equations, lines, strict=True))
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
        for each in moves:
            greatest = np.maximum(greatest, np.abs(each).max(axis=(1, 2), initial=0.0) / MAX_MOVE)
        found: Array = 1.0 / np.maximum(np.nan_to_num(greatest, nan=1.0), 1.0)
        return found
