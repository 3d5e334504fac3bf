"""How far a march of many steps may go: the prediction by the steps before, and how regular blocks have to be."""

from __future__ import annotations

from math import comb, cos
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
CORRECTIONS, FIRST_CORRECTIONS = 1, 6
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
COARSE_STEPS = (COARSE_STEP, 0.12)
"""rad or sizes: where the inputs go farther in a step, what is predicted takes one more of Newton's, and another."""
CORRECTION_LIMIT, MAX_CORRECTION_LIMIT = 3e-3, 0.05
"""rad or sizes by which Newton's method may correct what was predicted for steps of `COARSE_STEP`, and at most."""


def prediction_weights(steps: int) -> Array:
    """Weights of the positions before, the newest first, in that at every step (steps, PREDICTOR_ORDER): of the
    polynomial through those that are known; of the start at the first step."""
    weights = np.zeros((steps, PREDICTOR_ORDER))
    for count in range(1, PREDICTOR_ORDER + 1):
        weights[count:, :count] = [(-1.0) ** k * comb(count, k + 1) for k in range(count)]
    weights[:1, 0] = 1.0
    return weights


def correction_limit(step: float) -> float:
    """rad or sizes by which Newton's method may correct what was predicted, where inputs go so far in a step."""
    return min(CORRECTION_LIMIT * max(1.0, step / COARSE_STEP) ** 2, MAX_CORRECTION_LIMIT)


def longest_step(offsets: Array) -> float:
    """How far an input goes in a step at most, by positions (steps + 1, inputs)."""
    return float(np.max(np.abs(np.diff(offsets, axis=0)), initial=0.0))


def correction_counts(steps: int, longest: float) -> Array:
    """How many of Newton's steps each step of a run takes (steps,), where inputs go so far in one at most."""
    counts = np.full(steps, CORRECTIONS + sum(longest > step for step in COARSE_STEPS), dtype=np.int64)
    counts[: PREDICTOR_ORDER + 1] = FIRST_CORRECTIONS
    return counts


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
