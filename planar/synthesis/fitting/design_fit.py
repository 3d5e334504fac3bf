"""Least-squares fit of many designs at once, and its last steps, which keep demands to the last digit.

The last steps are sequential quadratic programmes (R. B. Wilson, A Simplicial Algorithm for Concave Programming,
Harvard 1963): a step dx makes 1/2 dx^T N dx + g^T dx least, of the normal equations, with h + H dx >= 0 for the least
slacks h. Its dual in the multipliers l >= 0 is solved by their active set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.fitting.demand_rows import DemandGuard
from planar.synthesis.fitting.moving_designs import KEPT, STRICTER, FitProblem, MovingDesigns, lacks
from planar.synthesis.fitting.wanted_equations import WantedEquations, damped_matrices, exact_rows

POLISHING_STEPS = 20
LEAST_SLACKS = 24
"""Of a design, that a step regards."""
NEAR = 1e-3
"""A slack that is less may bear on what is best."""
SETTLED, REGULAR = 1e-12, 1e-12
"""Of the greatest: a number that is less is none; and of a matrix: what keeps rows apart that are alike."""
TINY = float(np.finfo(float).tiny)
FIRST_DAMPING, GREATEST_DAMPING = 1e-6, 1e6
EXACT = 1e-11
"""Of the size, or rad: what is missed by no more is met exactly."""
ENOUGH_DROP = 0.8
"""Of what is lacking: a step that leaves more is taken back."""
ENOUGH_GAIN = 1e-7
"""Of the sum of squares: a step that wins less is the last."""


def polish_demands(state: MovingDesigns) -> None:
    """Designs that keep their demands, where that is to be had near by, and meet what is to be met exactly."""
    demands = state.demands
    assert demands is not None
    state.relocate_demands()
    squares = state.misses(state.numbers, state.unknowns, state.zeros)
    short = _shortage(demands.slack, state.inexactness(state.numbers, state.unknowns, state.zeros))
    is_exact = any(item.rows.wanted.tolerance == 0.0 for item in state.fit.equations)
    damping = np.full(len(squares), FIRST_DAMPING)
    is_moving: BoolArray = np.asarray(is_exact | (demands.slack < NEAR).any(axis=1))
    for _ in range(POLISHING_STEPS):
        rows = np.flatnonzero(is_moving)
        if not len(rows):
            break
        lines, normal, slope = state.linearise(rows)
        numbers, size = state.numbers[rows], slope.shape[1]
        slack, slopes = demands.least_rows(numbers, state.input_changes(rows, lines), rows, LEAST_SLACKS)
        ends, ways = _bounds(state, numbers, size)
        change = constrained_step(
            damped_matrices(normal, damping[rows]),
            slope,
            np.concatenate([slack, ends], axis=1),
            np.concatenate([slopes, np.broadcast_to(ways, (len(rows), *ways.shape))], axis=1),
            *exact_rows(state.fit.equations, lines, state.fit.globals),
        )
        trial = state.tried(rows, lines, change)
        tried = trial.numbers, trial.unknowns, trial.zeros
        after, left, before = trial.misses, _shortage(trial.slack, state.inexactness(*tried)), short[rows]
        is_better = trial.is_good & np.where(
            before > KEPT, (left <= KEPT) | (left < ENOUGH_DROP * before), (left <= KEPT) & (after < squares[rows])
        )
        is_last = is_better & (before <= KEPT) & (squares[rows] - after <= ENOUGH_GAIN * squares[rows])
        state.accept(rows, is_better, trial)
        squares[rows[is_better]] = after[is_better]
        damping[rows] *= np.where(is_better, 0.3, 8.0)
        is_moving[rows] = ~is_last & (damping[rows] < GREATEST_DAMPING)
        is_broken = ~state.relocate_demands()
        if is_broken.any():
            damping[is_broken] *= STRICTER
            squares = state.misses(state.numbers, state.unknowns, state.zeros)
        short = _shortage(demands.slack, state.inexactness(state.numbers, state.unknowns, state.zeros))


def _shortage(slack: Array, inexactness: Array) -> Array:
    """What designs are short of by slacks, or by what is to be met exactly (designs,); KEPT where that is enough."""
    found: Array = np.maximum(lacks(slack), inexactness * (KEPT / EXACT))
    return found


def _bounds(state: MovingDesigns, numbers: Array, size: int) -> tuple[Array, Array]:
    """How far numbers are from their bounds (designs, bounds), and the slopes of that (bounds, globals)."""
    lower, upper = np.isfinite(state.fit.lower), np.isfinite(state.fit.upper)
    ways = np.zeros((int(lower.sum() + upper.sum()), size))
    ways[np.arange(len(ways)), np.concatenate([np.flatnonzero(lower), np.flatnonzero(upper)])] = np.repeat(
        [1.0, -1.0], [int(lower.sum()), int(upper.sum())]
    )
    far = (numbers - state.fit.lower)[:, lower], (state.fit.upper - numbers)[:, upper]
    return np.concatenate(far, axis=1), ways


def constrained_step(normal: Array, slope: Array, slack: Array, slopes: Array, rows: Array, ways: Array) -> Array:
    """The steps dx (designs, size) that make 1/2 dx^T N dx + g^T dx least with h + H dx >= 0 and r + R dx = 0, or as
    near as can be; NaN where N has none.

    N (designs, size, size), g (designs, size), h (designs, k), H (designs, k, size), r (designs, m), R (designs, m,
    size)."""
    is_known: BoolArray = np.asarray(np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1))
    normal, slope = np.where(is_known[:, None, None], normal, np.eye(normal.shape[1])), np.nan_to_num(slope)
    first = np.zeros_like(slope)
    if rows.shape[1]:
        rows, ways = np.nan_to_num(rows), np.nan_to_num(ways)
        inverse = np.linalg.pinv(ways, rcond=1e-10)
        first = -np.einsum("cik,ck->ci", inverse, rows)
        held = inverse @ ways  # dx = first + (1 - held) of what is free
        free = np.eye(normal.shape[1]) - held
        slope = np.einsum("cij,cj->ci", free, slope + np.einsum("cij,cj->ci", normal, first))
        slack = slack + np.einsum("cki,ci->ck", slopes, first)
        slopes = slopes @ free
        scale = np.einsum("cii->c", normal) / normal.shape[1]
        normal = free @ normal @ free + scale[:, None, None] * held
    found = first + _step_within(normal, slope, slack, slopes)
    found[~is_known] = np.nan
    return found


def _step_within(normal: Array, slope: Array, slack: Array, slopes: Array) -> Array:
    """The same without equations."""
    right = np.concatenate([slope[:, :, None], slopes.swapaxes(1, 2)], axis=2)
    try:
        solved = np.linalg.solve(normal, right)
    except np.linalg.LinAlgError:
        solved = np.linalg.pinv(normal, rcond=1e-14, hermitian=True) @ right
    free, ways = solved[..., 0], solved[..., 1:]
    matrices, wanted = slopes @ ways, np.einsum("cki,ci->ck", slopes, free) - slack
    multipliers = np.array([least_multipliers(*each) for each in zip(matrices, wanted, strict=True)])
    found: Array = np.einsum("cik,ck->ci", ways, multipliers.reshape(slack.shape)) - free
    return found


def least_multipliers(matrix: Array, wanted: Array) -> Array:
    """The l >= 0 (k,) with M l >= w, and M l = w where l > 0: C. L. Lawson, R. J. Hanson, Solving Least Squares
    Problems, Prentice-Hall 1974, ch. 23, by the normal equations."""
    count = len(wanted)
    scale = max(float(np.trace(matrix)), TINY)
    matrix = matrix + REGULAR * scale * np.eye(count)
    found, bears = np.zeros(count), np.zeros(count, bool)
    most = float(np.abs(wanted).max(initial=0.0))
    for _ in range(3 * count):
        short = np.where(bears, -np.inf, wanted - matrix @ found)
        k = int(np.argmax(short)) if count else 0
        if not count or not short[k] > SETTLED * most:
            break
        bears[k] = True
        while bears.any():
            own = np.flatnonzero(bears)
            tried = np.linalg.solve(matrix[np.ix_(own, own)], wanted[own])
            if (tried > 0.0).all():
                found[own] = tried
                break
            out = tried <= 0.0
            share = float((found[own][out] / np.maximum(found[own][out] - tried[out], TINY)).min())
            found[own] += share * (tried - found[own])
            bears[own[out & (found[own] <= SETTLED * np.abs(found).max())]] = False
            if share == 0.0:
                bears[own[out]] = False
            found[~bears] = 0.0
    return found


MAX_STEPS = 400
HALVING_STEPS = (10, 20, 40)
"""Steps after which only the better half goes on, where there are many."""
VALLEY_STEPS, ENOUGH_FALL = 10, 0.01
"""Steps, after the halvings, in which the sum of squares is to fall by so much of it: along a valley that is flatter
nothing is won that would be worth its time."""
LONG_STEPS, NEAR_BEST = 100, 4.0
"""Steps after which only designs go on whose sum of squares is at most so many times the least."""
FEW = 4
WATCH_STEPS = 10
"""Steps after which it is looked anew where demands are kept least."""
PRESSINGS, PRESSED_STEPS = 4, 15
"""How often multipliers of demands are changed, and steps between."""


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
    lacks: Array
    "(designs,): by how much the demand is missed that is kept least, rad or of the size; 0 where all are kept"


class DesignFit:
    """A fit of designs of one structure to rows of several kinds; free numbers stay between bounds (scaled).

    With a `guard` no step is taken after which a design does not go together any more at one of its positions, and what
    it demands is kept in the end.
    """

    def __init__(
        self, equations: Sequence[WantedEquations], lower: Array, upper: Array, guard: DemandGuard | None = None
    ):
        self.problem = FitProblem(tuple(equations), lower, upper, guard)

    def fit(
        self,
        numbers: Array,
        unknowns: Sequence[Array],
        zeros: Sequence[Array],
        keep: int,
        guarded: tuple[Array, Array] | None = None,
    ) -> FittedDesigns:
        """The designs fitted from given ones (designs, ...), of which the best so many go on to the end; `guarded` are
        the guard's unknowns (designs, positions, unknowns) and its shares of the range (designs, positions)."""
        state = MovingDesigns(self.problem, numbers, list(unknowns), list(zeros), guarded)
        before: float | Array = np.inf

        def rest(step: int) -> None:
            """Let rest what leads to nothing better, and look anew where demands are kept least."""
            nonlocal before
            is_late = step > HALVING_STEPS[-1]
            if is_late and step % VALLEY_STEPS == 0:
                state.is_moving &= state.squares <= (1.0 - ENOUGH_FALL) * before
            if state.demands is not None and step % WATCH_STEPS == 0 and state.demands.guard.rows:
                state.relocate_demands()
            if is_late and step % VALLEY_STEPS == 0:
                before = state.squares.copy()
            if step >= LONG_STEPS:
                state.is_moving &= state.squares <= NEAR_BEST * state.squares.min()
            if step in HALVING_STEPS:
                state.keep_best(max(keep, FEW, (len(state.numbers) + 1) // 2))

        state.run(MAX_STEPS, rest)
        if state.demands is not None:
            state.keep_best(max(keep, FEW))
            can_lack = bool(state.demands.guard.rows) or state.demands.order.count > 0
            for _ in range(PRESSINGS if can_lack else 0):
                if not state.press():
                    break
                state.run(PRESSED_STEPS)
            polish_demands(state)
        return _result(state, keep)


def _result(state: MovingDesigns, keep: int) -> FittedDesigns:
    """The best so many, those first that keep what is demanded."""
    squares, lacks = state.misses(state.numbers, state.unknowns, state.zeros), np.zeros(len(state.numbers))
    if state.demands is not None:
        lacks = np.where(state.demands.is_kept, 0.0, state.demands.lack)
    best = np.lexsort([squares, lacks])[:keep]
    state.take(best)
    unknowns, zeros = tuple(state.unknowns), tuple(state.zeros)
    return FittedDesigns(state.numbers, unknowns, zeros, squares[best], state.order, lacks[best])
