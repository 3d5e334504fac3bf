"""Blocks without closed form marched by Newton's method, by numpy."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.prediction import extrapolation_weights
from planar.batch.mechanisms.block_type import POSE_ROWS
from planar.batch.mechanisms.solved_block_type import BlockType
from planar.codegen.block_formula import BlockFormula, FormulaInput

Array = np.ndarray

PREDICTOR_ORDER = 5
"""Moves before from which the next is predicted."""
CORRECTIONS, FIRST_CORRECTIONS = 2, 10
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
CHECK_ROWS = 3
"""Rows that are told outside the links' places: what is left open, the square of how regular, how far corrected."""


class NewtonRun(NamedTuple):
    """What is told of groups (groups, steps): left open, the square of how regular, how far from where predicted."""

    residuals: Array
    squared_regularity: Array
    corrections: Array


def cos_or_length(kind: BlockType, z: Array) -> Array:
    """Of unknowns (groups, unknowns) the cosines of angles, and lengths."""
    return np.where(kind.unknown_is_angle, np.cos(z), z)


def sin_or_zero(kind: BlockType, z: Array) -> Array:
    """Of unknowns (groups, unknowns) the sines of angles, and zero for lengths."""
    return np.where(kind.unknown_is_angle, np.sin(z), 0.0)


def step_table(steps: int) -> tuple[Array, Array]:
    """Of every step the weights of those before, and how often it is corrected."""
    table, counts = np.zeros((steps, PREDICTOR_ORDER)), np.full(steps, CORRECTIONS, dtype=np.int64)
    for step in range(steps):
        known = min(max(step - 1, 0), PREDICTOR_ORDER)
        table[step, :known] = extrapolation_weights(known)
    counts[: PREDICTOR_ORDER + 2] = FIRST_CORRECTIONS
    return table, counts


def formula_inputs(
    formula: BlockFormula, block_type: BlockType, rows: Any, p: Array, z: Array
) -> dict[FormulaInput, Array]:
    """What a formula takes: `rows` tells a row of a slot; p (groups, numbers), z (groups, unknowns)."""
    parts = cos_or_length(block_type, z), sin_or_zero(block_type, z)
    found = {}
    for leaf in formula.inputs.values():
        if leaf.source == "p":
            found[leaf] = p[:, leaf.place]
        elif leaf.source == "z":
            found[leaf] = parts[leaf.part][:, leaf.place]
        else:
            found[leaf] = rows(leaf.place, leaf.part)
    return found


def correct_blocks(block_type: BlockType, rows: Any, p: Array, z: Array, count: int) -> tuple[Array, Array, Array]:
    """So many steps of Newton's method: the unknowns, the square of how regular they are, how far they moved."""
    formula, moved, regular = block_type.newton_formulas.step, np.zeros_like(z), np.ones(len(z))
    for _ in range(count):
        *step, regular = formula.evaluate_numpy(formula_inputs(formula, block_type, rows, p, z))
        back = np.stack([np.broadcast_to(each, len(z)) for each in step], axis=1)
        z, moved = z - back, moved - back
    return z, np.broadcast_to(regular, len(z)), moved


def run_newton(block_type: BlockType, state: Array, index: Array, p: Array, start: Array, rates: bool) -> NewtonRun:
    """Follow groups (many,) of a kind through all steps by numpy, from unknowns start (many, unknowns).

    Their places index (many, slots) in state (slots, rows, steps) are filled; p (many, numbers).
    """
    z, checks = start, np.empty((len(index), CHECK_ROWS, state.shape[2]))
    table, counts = step_table(state.shape[2])
    inner = index[:, block_type.slot_count - len(block_type.inner_links) :]
    before = [np.zeros_like(z) for _ in range(PREDICTOR_ORDER)]
    formula = block_type.newton_formulas.poses_and_rates if rates else block_type.newton_formulas.poses
    wide = POSE_ROWS + 6 if rates else POSE_ROWS
    for k in range(state.shape[2]):

        def rows(slot: int, row: int, k: int = k) -> Array:
            return state[index[:, slot], row, k]

        ahead: Any = sum(weight * move for weight, move in zip(table[k], before, strict=True))
        z, regular, moved = correct_blocks(block_type, rows, p, z + ahead, int(counts[k]))
        *told, left = formula.evaluate_numpy(formula_inputs(formula, block_type, rows, p, z))
        for number, value in enumerate(told):
            state[inner[:, number // wide], number % wide, k] = value
        checks[:, 0, k], checks[:, 1, k] = left, regular
        checks[:, 2, k] = np.sum(np.abs(moved), axis=1)
        before = [ahead + moved, *before[:-1]]
    return NewtonRun(checks[:, 0], checks[:, 1], checks[:, 2])
