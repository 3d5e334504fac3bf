"""Designs fitted to what is wanted, side by side, by Levenberg and Marquardt's steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.fitting.wanted_equations import DAMPING_ALONG, LinearRows, WantedEquations, tangents

FIRST_DAMPING, LEAST_DAMPING, GREATEST_DAMPING = 1e-2, 1e-14, 1e8
"""Of the diagonal of the normal equations."""
MAX_STEPS = 150
CLOSING_STEPS = 4
GUARD_STEPS, MAX_GUARD_MOVE = 6, 0.7
"""Newton's steps, and how far unknowns may go in them: farther is another assembly."""
MAX_CHANGE, MAX_MOVE = 0.3, 0.5
"""Of a free number, and of an entry's unknowns (rad, or of the size), in one step."""
ENOUGH_GAIN = 1e-10
"""Of the sum of squares: steps that win less, so often one after the other, are the last."""
IDLE_STEPS = 4
HALVING_STEPS = (10, 20, 40)
"""Steps after which only the better half goes on, where there are many."""
FEW = 4
NEAR_DEAD_POINT = 0.02
"""Of the input beside all unknowns, along the path: where it is less a dead point is near."""
PERFECT = 1e-22
"""Of the sum of squares: there is nothing left to win."""


@dataclass(frozen=True)
class FittedDesigns:
    """Designs (designs, ...): scaled free numbers, unknowns of every entry by the wanted rows, zeros of scales."""

    numbers: Array
    unknowns: tuple[Array, ...]
    zeros: tuple[Array, ...]
    squares: Array
    "(designs,): sum of squares of the rows"
    order: IntArray
    "(designs,): which of those given each is, the best first"


class DesignFit:
    """A fit of designs of one structure to rows of several kinds; free numbers stay between bounds (scaled).

    With `guard`, the equations of positions all round a turn of the input, no step is taken after which one of them
    does not go together any more.
    """

    def __init__(
        self, equations: Sequence[WantedEquations], lower: Array, upper: Array, guard: WantedEquations | None = None
    ):
        self.equations, self.lower, self.upper, self.guard = tuple(equations), lower, upper, guard
        self.many_free = len(lower)
        at = self.many_free
        self.zero_columns: list[IntArray] = []
        for each in equations:
            self.zero_columns.append(np.arange(at, at + each.zero_count))
            at += each.zero_count
        self.size = at

    def fit(
        self,
        numbers: Array,
        unknowns: Sequence[Array],
        zeros: Sequence[Array],
        keep: int,
        guarded: Array | None = None,
    ) -> FittedDesigns:
        """The designs fitted from given ones (designs, ...), of which the best so many go on to the end; `guarded` are
        the guard's unknowns (designs, positions, unknowns)."""
        state = _Designs(self, numbers, list(unknowns), list(zeros), guarded)
        for step in range(MAX_STEPS):
            if not state.is_moving.any():
                break
            if step in HALVING_STEPS:
                state.keep_best(max(keep, FEW, (len(state.numbers) + 1) // 2))
            state.advance()
        state.keep_best(keep)
        return FittedDesigns(state.numbers, tuple(state.unknowns), tuple(state.zeros), state.squares, state.order)


class _Designs:
    """Designs on their way, one row each."""

    def __init__(
        self, fit: DesignFit, numbers: Array, unknowns: list[Array], zeros: list[Array], guarded: Array | None
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
        self.guarded = np.zeros((len(numbers), 0, 1)) if guarded is None else guarded
        is_closed: BoolArray = np.ones(len(numbers), bool)
        for k, each in enumerate(fit.equations):
            way = tangents(each.jacobians(self.numbers, self.unknowns[k]))
            self.unknowns[k], own = each.close(self.numbers, self.unknowns[k], way, 2 * CLOSING_STEPS)
            way = tangents(np.nan_to_num(each.jacobians(self.numbers, self.unknowns[k])))
            self.tangents[k] = np.where(way[..., -1:] < 0.0, -way, way)
            is_closed &= own
        self.guarded, own = self._guard(self.numbers, self.guarded)
        is_closed &= own
        self.squares = np.full(len(numbers), np.inf)
        self.damping = np.full(len(numbers), FIRST_DAMPING)
        self.idle = np.zeros(len(numbers), int)
        self.is_moving = is_closed
        self.squares[is_closed] = self._squares(self.numbers, self.unknowns, self.zeros)[is_closed]
        self._take(np.flatnonzero(is_closed))

    def _take(self, rows: IntArray) -> None:
        for name in ("numbers", "squares", "damping", "idle", "is_moving", "order", "guarded"):
            setattr(self, name, getattr(self, name)[rows])
        for many in (self.unknowns, self.zeros, self.tangents, self.headings):
            many[:] = [each[rows] for each in many]

    def _guard(self, numbers: Array, before: Array) -> tuple[Array, BoolArray]:
        """The guard's unknowns of changed designs, and which designs still go together at all of its positions."""
        guard = self.fit.guard
        if guard is None:
            return before, np.ones(len(numbers), bool)
        found, is_closed = guard.close(numbers, before, np.zeros_like(before), GUARD_STEPS)
        return found, is_closed & (np.abs(found - before).max(axis=(1, 2), initial=0.0) < MAX_GUARD_MOVE)

    def keep_best(self, many: int) -> None:
        """Only the best so many go on."""
        self._take(np.argsort(self.squares, kind="stable")[:many])

    def _squares(self, numbers: Array, unknowns: Sequence[Array], zeros: Sequence[Array]) -> Array:
        found = np.zeros(len(numbers))
        for each, y, zero in zip(self.fit.equations, unknowns, zeros, strict=True):
            found += (each.residuals(numbers, y, zero) ** 2).sum(axis=(1, 2))
        return np.where(np.isfinite(found), found, np.inf)

    def advance(self) -> None:
        """One step of every design that still moves; one that wins nothing is taken back."""
        rows = np.flatnonzero(self.is_moving)
        numbers, zeros = self.numbers[rows], [each[rows] for each in self.zeros]
        unknowns, before = [each[rows] for each in self.unknowns], [each[rows] for each in self.tangents]
        lines = [
            each.linearise(numbers, y, zero, tangent)
            for each, y, zero, tangent in zip(self.fit.equations, unknowns, zeros, before, strict=True)
        ]
        lines = [
            line if each.is_timed else self._held_at_dead_points(line, self.headings[k][rows])
            for k, (each, line) in enumerate(zip(self.fit.equations, lines, strict=True))
        ]
        normal, slope = self._normal_equations(lines)
        change = self._solve(normal, slope, numbers, self.damping[rows])
        moves = [
            self._moves(each, line, change, k)
            for k, (each, line) in enumerate(zip(self.fit.equations, lines, strict=True))
        ]
        shortened = self._shortening(change, moves)
        after = np.clip(numbers + shortened[:, None] * change[:, : self.fit.many_free], self.fit.lower, self.fit.upper)
        is_good: BoolArray = np.asarray(np.isfinite(change).all(axis=1))
        told_unknowns, told_zeros = [], []
        for k, each in enumerate(self.fit.equations):
            y, is_closed = each.close(
                after, unknowns[k] + shortened[:, None, None] * moves[k], before[k], CLOSING_STEPS
            )
            tangent = each.tangents_near(after, y, before[k])
            if not each.is_timed:
                is_closed &= (tangent[..., -1] > 0.0).all(axis=1)  # not beyond a dead point
            is_good = np.asarray(is_good & is_closed)
            told_unknowns.append(y)
            told_zeros.append(zeros[k] + shortened[:, None] * change[:, self.fit.zero_columns[k]])
            before[k] = tangent
        guarded, is_whole = self._guard(after, self.guarded[rows])
        is_good = np.asarray(is_good & is_whole)
        squares = self._squares(after, told_unknowns, told_zeros)
        is_better = is_good & (squares < self.squares[rows])
        self.guarded[rows[is_better]] = guarded[is_better]
        self._accept(rows, is_better, after, told_unknowns, told_zeros, before, squares)

    def _accept(
        self,
        rows: IntArray,
        is_better: BoolArray,
        numbers: Array,
        unknowns: Sequence[Array],
        zeros: Sequence[Array],
        directions: Sequence[Array],
        squares: Array,
    ) -> None:
        own = rows[is_better]
        gain = (self.squares[own] - squares[is_better]) / np.maximum(self.squares[own], np.finfo(float).tiny)
        self.idle[rows[~is_better]] += 1
        self.idle[own] = np.where(gain < ENOUGH_GAIN, self.idle[own] + 1, 0)
        self.numbers[own], self.squares[own] = numbers[is_better], squares[is_better]
        for k in range(len(unknowns)):
            gone = np.sum((unknowns[k][is_better] - self.unknowns[k][own]) * directions[k][is_better], axis=-1)
            self.headings[k][own] = np.sign(gone)
            self.unknowns[k][own], self.zeros[k][own] = unknowns[k][is_better], zeros[k][is_better]
            self.tangents[k][own] = directions[k][is_better]
        factor = np.where(is_better, 0.2, 6.0)
        self.damping[rows] = np.clip(self.damping[rows] * factor, LEAST_DAMPING, None)
        is_stuck = self.damping > GREATEST_DAMPING
        self.is_moving &= ~is_stuck & (self.squares > PERFECT)
        self.is_moving &= self.idle < np.where(self.damping < 1.0, 12, IDLE_STEPS)

    def _held_at_dead_points(self, line: LinearRows, heading: Array) -> LinearRows:
        """Entries that would go on towards a dead point which they have come to stay where they are along the path."""
        towards = -np.sign(np.einsum("cnp,cnp->cn", line.along, line.residual))
        rate = line.tangent[..., -1] / np.linalg.norm(line.tangent, axis=-1)
        is_held = (np.abs(rate) < NEAR_DEAD_POINT) & (towards == heading)
        return line._replace(along=np.where(is_held[..., None], 0.0, line.along))

    def _normal_equations(self, lines: Sequence[LinearRows]) -> tuple[Array, Array]:
        """Of the free numbers and the zeros of scales (designs, size, size) and (designs, size), entries eliminated."""
        many, size, free = len(lines[0].residual), self.fit.size, self.fit.many_free
        normal, slope = np.zeros((many, size, size)), np.zeros((many, size))
        for k, (each, line) in enumerate(zip(self.fit.equations, lines, strict=True)):
            at = np.concatenate([np.arange(free), self.fit.zero_columns[k]])
            own = np.einsum("cnpi,cnpj->cij", line.slopes, line.slopes, optimize=True)
            towards = np.einsum("cnpi,cnp->ci", line.slopes, line.residual)
            if not each.is_timed:
                size_along = np.sum(line.along**2, axis=-1) + DAMPING_ALONG
                across = np.einsum("cnpi,cnp->cni", line.slopes, line.along)
                off = np.einsum("cnp,cnp->cn", line.along, line.residual) / size_along
                own -= np.einsum("cni,cnj,cn->cij", across, across, 1.0 / size_along, optimize=True)
                towards -= np.einsum("cni,cn->ci", across, off)
            normal[:, at[:, None], at] += own
            slope[:, at] += towards
        return normal, slope

    def _solve(self, normal: Array, slope: Array, numbers: Array, damping: Array) -> Array:
        """The change of the free numbers and zeros; a number on its bound that would leave it stays."""
        free = self.fit.many_free
        held = np.zeros(slope.shape, bool)
        diagonal = np.einsum("cii->ci", normal).copy()
        floor = 1e-9 * diagonal.max(axis=1, keepdims=True) + np.finfo(float).tiny
        bad = ~(np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1))
        normal[bad], slope[bad] = np.eye(normal.shape[1]), 0.0
        for _ in range(2):
            matrix = normal + (damping[:, None] * np.maximum(diagonal, floor))[:, :, None] * np.eye(normal.shape[1])
            right = np.where(held, 0.0, -slope)
            matrix = np.where(held[:, :, None] | held[:, None, :], 0.0, matrix)
            matrix += held[:, :, None] * np.eye(normal.shape[1])
            change: Array = np.linalg.solve(matrix, right[..., None])[..., 0]
            wanted = numbers + change[:, :free]
            out = ((wanted < self.fit.lower) & (numbers <= self.fit.lower)) | (
                (wanted > self.fit.upper) & (numbers >= self.fit.upper)
            )
            if not (out & ~held[:, :free]).any():
                break
            held[:, :free] |= out
        change[bad] = np.nan
        return change

    def _moves(self, equations: WantedEquations, line: LinearRows, change: Array, k: int) -> Array:
        """How each entry's unknowns change (designs, n, unknowns)."""
        at = np.concatenate([np.arange(self.fit.many_free), self.fit.zero_columns[k]])
        own = change[:, at]
        moves: Array = line.own + np.einsum("cnyi,ci->cny", line.own_slopes, own)
        if not equations.is_timed:
            left = line.residual + np.einsum("cnpi,ci->cnp", line.slopes, own)
            along = -np.einsum("cnp,cnp->cn", line.along, left) / (np.sum(line.along**2, axis=-1) + DAMPING_ALONG)
            moves = moves + line.tangent * along[..., None]
        return moves

    def _shortening(self, change: Array, moves: Sequence[Array]) -> Array:
        """By how much steps are shortened (designs,), to stay where the first order tells something."""
        greatest = np.abs(change[:, : self.fit.many_free]).max(axis=1, initial=0.0) / MAX_CHANGE
        for each in moves:
            greatest = np.maximum(greatest, np.abs(each).max(axis=(1, 2), initial=0.0) / MAX_MOVE)
        found: Array = 1.0 / np.maximum(np.nan_to_num(greatest, nan=1.0), 1.0)
        return found
