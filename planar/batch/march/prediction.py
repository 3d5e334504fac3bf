"""How far a march of many steps may go: the prediction by the steps before, and how regular blocks have to be."""

from __future__ import annotations

from math import comb, cos, inf
from typing import TypeVar

import numpy as np

Array = np.ndarray

MAX_TURN_PER_STEP = 0.5
"""rad that a link may turn from one step to the next: farther apart they do not show what lies between."""
LEAST_COSINE = cos(MAX_TURN_PER_STEP)
"""Of the angle by which a link turns in a step."""
LONGEST_STEP = 0.5
"""rad or sizes that an input may go in a step: positions that are farther apart do not show whether a block comes to a
dead point between them."""
COARSE_STEP = 0.04
"""rad or sizes: up to this step of the inputs the limit of what may be corrected stays as it is."""
PREDICTOR_ORDER = 6
"""Steps before from which the next is predicted."""
CORRECTIONS_COLUMN, LIMIT_COLUMN, TABLE_COLUMNS = PREDICTOR_ORDER, PREDICTOR_ORDER + 1, PREDICTOR_ORDER + 2
"""Columns of the `step_table` after the weights: the count of corrections, and the maximum of their sum; the total."""
CORRECTION_LIMIT, MAX_CORRECTION_LIMIT = 3e-3, 0.05
"""rad or sizes by which Newton's method may correct what was predicted for steps of `COARSE_STEP`, and at most."""


CORRECTIONS, FIRST_CORRECTIONS = 2, 10
"""Steps of Newton's method where there are enough earlier positions for a prediction, and before."""


def correction_limit(step: float) -> float:
    """rad or sizes by which Newton's method may correct what was predicted, where inputs go so far in a step."""
    return min(CORRECTION_LIMIT * max(1.0, step / COARSE_STEP) ** 2, MAX_CORRECTION_LIMIT)


def longest_step(offsets: Array) -> float:
    """How far an input goes in a step at most, by positions (steps + 1, inputs)."""
    return float(np.max(np.abs(np.diff(offsets, axis=0)), initial=0.0))


def step_table(
    steps: int, step: float, corrections: int = CORRECTIONS, first_corrections: int = FIRST_CORRECTIONS
) -> Array:
    """The row of every step (steps, TABLE_COLUMNS), whose inputs go as far as `step` in one.

    The weights are those of the polynomial through the positions before, the newest first, as many as there are. The
    first steps, which fewer positions predict, take `first_corrections` of Newton's steps, of any length.
    """
    table = np.zeros((steps, TABLE_COLUMNS))
    for count in range(1, PREDICTOR_ORDER + 1):
        table[count:, :count] = [(-1.0) ** k * comb(count, k + 1) for k in range(count)]
    table[:1, 0] = 1.0
    table[:, CORRECTIONS_COLUMN], table[:, LIMIT_COLUMN] = corrections, correction_limit(step)
    table[: PREDICTOR_ORDER + 1, CORRECTIONS_COLUMN], table[:PREDICTOR_ORDER, LIMIT_COLUMN] = first_corrections, inf
    return table


Number = TypeVar("Number", float, Array)

LEAST_START_REGULARITY = 1e-4
"""Below it a design does not start."""
LEAST_KERNEL_REGULARITY = 1e-2
"""Below it a march does not go on, so that between steps too no two assemblies meet."""
CLEAR_REGULARITY = 0.2
"""From it on no other assembly is near."""


def least_regularity(base: Number, unknowns: int) -> Number:
    """The least volume of a block of so many unknowns; `base` is that of one or two, or of each design's."""
    return base if unknowns <= 2 else base**1.5
