"""Last steps of a fit, in which what is demanded is kept to the last digit and misses are least beside.

Sequential quadratic programmes (R. B. Wilson, A Simplicial Algorithm for Concave Programming, Harvard 1963): a step dx
makes 1/2 dx^T N dx + g^T dx least, of the normal equations, with h + H dx >= 0 for the least slacks h. Its dual in the
multipliers l >= 0 is solved by projected relaxation (C. Hildreth, Naval Research Logistics Quarterly 4 (1957) 79).
"""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.synthesis.fitting.kept_demands import KEPT, lacks
from planar.synthesis.fitting.moving_designs import MovingDesigns
from planar.synthesis.fitting.normal_equations import damped_matrices

POLISHING_STEPS = 20
LEAST_SLACKS = 24
"""Of a design, that a step regards."""
NEAR = 1e-3
"""A slack that is less may bear on what is best."""
SWEEPS = 120
FIRST_DAMPING, GREATEST_DAMPING = 1e-6, 1e6
ENOUGH_DROP = 0.8
"""Of what is lacking: a step that leaves more is taken back."""
ENOUGH_GAIN = 1e-7
"""Of the sum of squares: a step that wins less is the last."""


def polish_demands(state: MovingDesigns) -> None:
    """Designs that keep their demands, where that is to be had near by."""
    demands = state.demands
    assert demands is not None
    demands.relocate(state.numbers, state.unknowns)
    many = len(state.numbers)
    squares = state.misses(state.numbers, state.unknowns, state.zeros)
    damping, is_moving = np.full(many, FIRST_DAMPING), np.asarray(demands.slack.min(axis=1) < NEAR)
    for _ in range(POLISHING_STEPS):
        rows = np.flatnonzero(is_moving)
        if not len(rows):
            break
        lines, normal, slope = state.linearise(rows)
        changes = state.input_changes(rows, lines)
        numbers, size = state.numbers[rows], slope.shape[1]
        slack, slopes = demands.least_rows(numbers, changes, rows, LEAST_SLACKS)
        ends, ways = _bounds(state, numbers, size)
        change = constrained_step(
            damped_matrices(normal, damping[rows]),
            slope,
            np.concatenate([slack, ends], axis=1),
            np.concatenate([slopes, np.broadcast_to(ways, (len(rows), *ways.shape))], axis=1),
        )
        trial = state.tried(rows, lines, change)
        lack = lacks(trial.slack)
        after, before = state.misses(trial.numbers, trial.unknowns, trial.zeros), demands.lack[rows]
        is_kept = lack <= KEPT
        is_better = trial.is_good & np.where(
            before > KEPT, is_kept | (lack < ENOUGH_DROP * before), is_kept & (after < squares[rows])
        )
        is_last = is_better & (before <= KEPT) & (squares[rows] - after <= ENOUGH_GAIN * squares[rows])
        state.accept(rows, is_better, trial)
        squares[rows[is_better]] = after[is_better]
        damping[rows] *= np.where(is_better, 0.3, 8.0)
        is_moving[rows] = ~is_last & (damping[rows] < GREATEST_DAMPING)
        demands.relocate(state.numbers, state.unknowns)


def _bounds(state: MovingDesigns, numbers: Array, size: int) -> tuple[Array, Array]:
    """How far numbers are from their bounds (designs, bounds), and the slopes of that (bounds, globals)."""
    lower, upper = np.isfinite(state.fit.lower), np.isfinite(state.fit.upper)
    ways = np.zeros((int(lower.sum() + upper.sum()), size))
    ways[np.arange(len(ways)), np.concatenate([np.flatnonzero(lower), np.flatnonzero(upper)])] = np.repeat(
        [1.0, -1.0], [int(lower.sum()), int(upper.sum())]
    )
    far = (numbers - state.fit.lower)[:, lower], (state.fit.upper - numbers)[:, upper]
    return np.concatenate(far, axis=1), ways


def constrained_step(normal: Array, slope: Array, slack: Array, slopes: Array) -> Array:
    """The steps dx (designs, size) that make 1/2 dx^T N dx + g^T dx least with h + H dx >= 0; NaN where N has none.

    N (designs, size, size), g (designs, size), h (designs, k), H (designs, k, size)."""
    is_known: BoolArray = np.asarray(np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1))
    normal = np.where(is_known[:, None, None], normal, np.eye(normal.shape[1]))
    right = np.concatenate([slope[:, :, None], slopes.swapaxes(1, 2)], axis=2)
    try:
        solved = np.linalg.solve(normal, np.nan_to_num(right))
    except np.linalg.LinAlgError:
        solved = np.linalg.pinv(normal, rcond=1e-14, hermitian=True) @ np.nan_to_num(right)
    free, ways = solved[..., 0], solved[..., 1:]
    matrix = slopes @ ways
    wanted = np.einsum("cki,ci->ck", slopes, free) - slack
    diagonal = np.einsum("ckk->ck", matrix)
    diagonal = np.maximum(diagonal, 1e-12 * diagonal.max(axis=1, initial=0.0, keepdims=True)) + np.finfo(float).tiny
    multipliers = np.zeros_like(slack)
    for _ in range(SWEEPS):
        for k in range(slack.shape[1]):
            left = wanted[:, k] - np.einsum("cj,cj->c", matrix[:, k], multipliers)
            multipliers[:, k] = np.maximum(multipliers[:, k] + left / diagonal[:, k], 0.0)
    found: Array = np.einsum("cik,ck->ci", ways, multipliers) - free
    found[~is_known] = np.nan
    return found
