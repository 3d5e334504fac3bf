"""Runs of many designs through the compiled function."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from planar.mechanism import Mechanism
from planar.native.compiled import compiled
from planar.native.march import ORDER, Layout, march
from planar.program import Program, structure

Array = np.ndarray

LANES = 16
"""Designs at once: two vectors of the widest machines, so that one waits while the other works."""
CORRECTIONS, FIRST = 1, 6
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
ASTRAY, MOST = 3e-3, 0.05
"""rad or sizes by which Newton's method may correct what was predicted for steps of the first of these, and at most."""
COARSE = (0.04, 0.12)
"""rad or sizes: where the inputs go farther in a step, what is predicted takes one more of Newton's, and another."""
AHEAD = ((), (1,), (2, -1), (3, -3, 1), (4, -6, 4, -1), (5, -10, 10, -5, 1))
"""Weights of the last steps in the next one: the polynomial through them, continued."""
KINDS = ("int", "int", *("array",) * 7, "float", "float", "array", "array")


@lru_cache(maxsize=64)
def layout(program: Program, of: Mechanism, links: tuple[str, ...], rates: bool) -> Layout:
    """The function for points on links of a structure. Raises NotPrinted."""
    return march(program.equations, of, links, rates, LANES)


def run(
    program: Program,
    p: Array,
    q: Array,
    z: Array,
    start: Array,
    gone: Array,
    u1: Array,
    u2: Array,
    mechanism: Mechanism,
    links: Sequence[str],
    rates: bool,
    tolerance: float,
    more: int = 0,
) -> tuple[Array, Array]:
    """The places of points on links over a run of designs, and how many of its first steps every design did well.

    p (numbers, designs): numbers of the pairs; q (2 points, designs): the points' coordinates in their links;
    z (unknowns, designs): where the run starts, closed; start, u1, u2 (inputs, designs): inputs there and their
    rates; gone (steps, inputs): how far the inputs are from there at every step, the first none. Lengths in sizes.

    `more` are further corrections at every step, for designs that are less well predicted.

    Returns (steps, rows, designs): x and y of every point, then with `rates` all first rates, then all second ones; and
    (designs,). Raises NotPrinted where the structure is not for this backend.
    """
    plan = layout(program, structure(mechanism), tuple(links), rates)
    function = compiled(plan.text, "march", *KINDS)
    designs, steps = z.shape[1], len(gone)
    blocks = -(-designs // plan.lanes)
    padded = blocks * plan.lanes

    def full(rows: Sequence[Array]) -> Array:
        found = np.zeros((max(len(rows), 1), padded))
        for row, values in zip(found, rows, strict=False):
            row[:designs], row[designs:] = values, values[-1]
        return found

    parts = {"c": np.cos, "s": np.sin, "z": lambda angle: angle}
    out, good = np.empty((steps, plan.out, padded)), np.empty(padded)
    table, counts = _table(gone)
    counts += more
    longest = float(np.max(np.abs(np.diff(gone, axis=0)), initial=0.0))
    astray = min(ASTRAY * max(1.0, longest / COARSE[0]) ** 2, MOST)
    arrays = (
        full(p),
        full(q),
        full([parts[part](z[k]) for part, k in plan.state]),
        full([parts[part](start[k]) for part, k in plan.drives]),
        full([*u1, *u2] if rates else []),
        table,
        counts,
    )
    function(
        blocks, steps, *(each.ctypes.data for each in arrays), tolerance, astray, out.ctypes.data, good.ctypes.data
    )
    return out[:, :, :designs], good[:designs].astype(int)


def _table(gone: Array) -> tuple[Array, Array]:
    """What every step needs to know: the weights of the steps before, and how far each input has gone."""
    steps, inputs = gone.shape
    table, counts = np.zeros((steps, ORDER + 3 * inputs)), np.full(steps, CORRECTIONS, dtype=np.int64)
    for step in range(steps):
        known = min(max(step - 1, 0), ORDER)
        table[step, :known] = AHEAD[known]
    longest = float(np.max(np.abs(np.diff(gone, axis=0)), initial=0.0))
    counts[:] = CORRECTIONS + sum(longest > each for each in COARSE)
    counts[: ORDER + 2] = FIRST
    for k in range(inputs):
        table[:, ORDER + 3 * k : ORDER + 3 * k + 3] = np.stack(
            [gone[:, k], np.cos(gone[:, k]), np.sin(gone[:, k])], axis=1
        )
    return table, counts
