"""Designs fitted to what is wanted, side by side, by Levenberg and Marquardt's steps."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.synthesis.fitting.demand_guard import DemandGuard
from planar.synthesis.fitting.demand_polish import polish_demands
from planar.synthesis.fitting.moving_designs import FitProblem, MovingDesigns
from planar.synthesis.fitting.wanted_equations import WantedEquations

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
            for _ in range(PRESSINGS if state.demands.can_lack else 0):
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
