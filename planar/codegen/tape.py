"""Tapes: blocks of several formulas that are worked off one after the other, over all steps of each."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.codegen.block_formula import BlockFormula

Array = np.ndarray

LANES = 8
"""Steps that machine code works on at once; rows of numbers are multiples of so many."""
GOOD, DEAD_POINT, UNDECIDED = range(3)
"""Outcomes of a sequence: good to the end, until a dead point, until a step that is not sure."""


class TapeFormula(NamedTuple):
    """A formula of a tape: what it gives are so many rows of a point, then, where it is checked, the cosines and
    sines of so many links, which may not turn fast, what is left open, and how clear of a dead point it is."""

    formula: BlockFormula
    row_count: int
    direction_count: int = 0

    @property
    def is_checked(self) -> bool:
        """Whether it tells more than rows."""
        return len(self.formula.outputs) > self.row_count


def padded_steps(steps: int) -> int:
    """How many numbers a row of so many steps has: whole vectors."""
    return LANES * -(-steps // LANES)


class Tape(NamedTuple):
    """Sequences of blocks: where each sequence begins in the blocks, first (sequences + 1,); of every block the number
    of its formula in `kinds` (blocks,), the rows that it takes and, last, those that it gives, `slots` (blocks, slots),
    numbers p (blocks, numbers), and a `level` (blocks,) above those of the blocks that it needs; by how much
    constraints may be open, tolerance (sequences,), and how clear of a dead point steps are at least, clearance
    (sequences,)."""

    first: Array
    kinds: Array
    slots: Array
    p: Array
    level: Array
    tolerance: Array
    clearance: Array


class TapeResult(NamedTuple):
    """Of every sequence how many of its first steps are good in all its blocks, the outcome after these, and at which
    block (sequences,)."""

    good: Array
    outcome: Array
    at: Array


def run_tape_numpy(
    formulas: tuple[TapeFormula, ...], least_cosine: float, steps: int, tape: Tape, state: Array
) -> TapeResult:
    """Work off a tape level by level: state (slots, rows, numbers) is filled by all blocks.

    `least_cosine` is that of the angle by which a link turns in a step.
    """
    many, owner = len(tape.tolerance), np.repeat(np.arange(len(tape.tolerance)), np.diff(tape.first))
    result = TapeResult(np.full(many, steps), np.zeros(many, dtype=np.int64), np.zeros(many, dtype=np.int64))
    key = tape.level * len(formulas) + tape.kinds
    for value in np.unique(key):
        blocks = np.flatnonzero(key == value)
        own = formulas[value % len(formulas)]
        slots, p = tape.slots[blocks], tape.p[blocks]
        taken = {
            leaf: p[:, leaf.place, None] if leaf.source == "p" else state[slots[:, leaf.place], leaf.part]
            for leaf in own.formula.inputs.values()
        }
        found = [np.broadcast_to(each, (len(blocks), state.shape[2])) for each in own.formula.evaluate_numpy(taken)]
        for row in range(own.row_count):
            state[slots[:, -1], row] = found[row]
        if own.is_checked:
            told = [each[:, :steps] for each in found[own.row_count :]]
            _judge(result, tape, least_cosine, owner[blocks], blocks, told)
    return result


def _judge(result: TapeResult, tape: Tape, least_cosine: float, owner: Array, blocks: Array, told: list[Array]) -> None:
    """Put into the result where blocks end that end before the others of their sequences did."""
    *directions, left, clear = told
    with np.errstate(invalid="ignore"):
        good = left <= tape.tolerance[owner, None]
        for c, s in zip(directions[::2], directions[1::2], strict=True):
            # where a step is no position nothing turns
            good[:, 1:] &= ~(c[:, 1:] * c[:, :-1] + s[:, 1:] * s[:, :-1] < least_cosine)
        clear = np.where(good | (clear < 0.0), clear, np.nan)
        least, needed = np.full_like(clear, np.inf), np.zeros_like(clear)
        least[:, 1:] = np.fmin(clear[:, :-1], np.hstack([least[:, :1], clear[:, :-2]]))
        needed[:, 2:] = np.nan_to_num(np.abs(clear[:, 2:] - 2.0 * clear[:, 1:-1] + clear[:, :-2]))
        needed = np.maximum(needed, tape.clearance[owner, None])
        fine = np.minimum(least, clear) > needed
    come = np.where(fine.all(axis=1), clear.shape[1], np.argmin(fine, axis=1))
    earlier = np.flatnonzero(come < result.good[owner])
    end, k = come[earlier], owner[earlier]
    with np.errstate(invalid="ignore"):
        dead = (clear[earlier, end] < 0.0) & (least[earlier, end] > needed[earlier, end]) & (end > 0)
    # of several blocks of a sequence on one level the first one that ends
    order = np.lexsort((end, k))
    chosen = order[np.concatenate([[True], k[order][1:] != k[order][:-1]])] if len(order) else order
    result.good[k[chosen]], result.at[k[chosen]] = end[chosen], blocks[earlier[chosen]]
    result.outcome[k[chosen]] = np.where(dead[chosen], DEAD_POINT, UNDECIDED)
