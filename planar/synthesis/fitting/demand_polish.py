"""Last steps of a fit, in which what is demanded is kept to the last digit and misses are least beside.

Sequential quadratic programmes (R. B. Wilson, A Simplicial Algorithm for Concave Programming, Harvard 1963): a step dx
makes 1/2 dx^T N dx + g^T dx least, of the normal equations, with h + H dx >= 0 for the least slacks h. Its dual in the
multipliers l >= 0 is solved by their active set.
"""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.synthesis.fitting.kept_demands import KEPT, lacks
from planar.synthesis.fitting.moving_designs import STRICTER, MovingDesigns
from planar.synthesis.fitting.normal_equations import damped_matrices, exact_rows

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
    is_exact = any(each.rows.wanted.tolerance == 0.0 for each in state.fit.equations)
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
