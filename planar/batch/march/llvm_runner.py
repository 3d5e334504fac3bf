"""Runs of many designs through the compiled function."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.kernel import Structure
from planar.batch.march.llvm_designs import KINDS, NAME, ORDER, Layout, march
from planar.codegen.aligned_arrays import is_room, room
from planar.codegen.instructions import NotPrinted
from planar.codegen.llvm_compile import compiled
from planar.equations.functions import Program, structure
from planar.model.mechanism import Mechanism

Array = np.ndarray

LANES = 16
"""Designs at once: two vectors of the widest machines, so that one waits while the other works."""
CORRECTIONS, FIRST = 1, 6
"""Steps of Newton's method where the run has come far enough to be predicted, and before."""
ASTRAY, MOST = 3e-3, 0.05
"""rad or sizes by which Newton's method may correct what was predicted for steps of the first of these, and at most."""
COARSE = (0.04, 0.12)
"""rad or sizes: where the inputs go farther in a step, what is predicted takes one more of Newton's, and another."""
COARSEST = 0.5
"""rad or sizes: farther apart positions do not show whether a group comes to a dead point between them."""
AHEAD = ((1,), (1,), (2, -1), (3, -3, 1), (4, -6, 4, -1), (5, -10, 10, -5, 1), (6, -15, 20, -15, 6, -1))
"""Weights of the last steps in the next: the polynomial through them, continued; ahead of the first there is its
start."""


@lru_cache(maxsize=256)
def printed(program: Program, of: Mechanism) -> Structure:
    """A structure ready to be printed. Raises NotPrinted."""
    return Structure(program.equations, of)


def layout(
    program: Program, of: Mechanism, links: tuple[str, ...], rates: bool, levels: tuple[int, ...] | None = None
) -> Layout:
    """The function for points on links of a structure, see `march`. Raises NotPrinted."""
    found = _layout(program, of, links, rates, levels)
    if isinstance(found, str):
        raise NotPrinted(found)
    return found


@lru_cache(maxsize=256)
def _layout(
    program: Program, of: Mechanism, links: tuple[str, ...], rates: bool, levels: tuple[int, ...] | None
) -> Layout | str:
    """The same, or why there is none: every block of a sweep would find that out again."""
    try:
        return march(printed(program, of), links, rates, LANES, levels)
    except NotPrinted as why:
        return str(why)


class Designs(NamedTuple):
    """What differs from design to design, lengths in sizes, each (rows, designs): p, the numbers of the pairs; q, the
    points' coordinates in their links; z, the unknowns where the run starts, closed; start, u1, u2, the inputs there
    and their rates."""

    p: Array
    q: Array
    z: Array
    start: Array
    u1: Array
    u2: Array


def run(
    program: Program,
    mechanism: Mechanism,
    designs: Designs,
    gone: Array,
    links: Sequence[str],
    rates: bool,
    tolerance: float,
    more: int = 0,
    scale: float = 1.0,
    out: Array | None = None,
) -> tuple[Array, Array]:
    """The places of points on links over a run of designs, and how many of its first steps every design did well.

    gone (steps, inputs): how far the inputs are from where they start at every step, the first none. `more` are further
    corrections at every step, for designs that are less well predicted. What is told is times `scale`.

    Returns (steps, rows, designs), in `out` if that is given: x and y of every point, then with `rates` all first and
    all second rates; and (designs,). Raises NotPrinted where the structure is not for this backend.
    """
    longest = float(np.max(np.abs(np.diff(gone, axis=0)), initial=0.0))
    if longest > COARSEST or len(gone) == 2:
        raise NotPrinted("steps so long do not show what lies between them")
    plan = layout(program, structure(mechanism), tuple(links), rates)
    table, counts = _table(gone)
    out, good = _called(plan, designs, rates, table, counts + more, (tolerance, _astray(longest), scale), out)
    # what is told of a step only at the next one condemns the step too
    return out, np.where((good > 1) & (good < len(gone)), good - 1, good)


def reached(
    program: Program, mechanism: Mechanism, designs: Designs, gone: Array, tolerance: float, more: int, at: Array
) -> Array:
    """The unknowns (unknowns, designs) of a run that came to these steps, at (designs,), of each design to one."""
    plan = layout(program, structure(mechanism), (), False, ())
    table, counts = _table(gone)
    astray = _astray(float(np.max(np.abs(np.diff(gone, axis=0)), initial=0.0)))
    found, _ = _called(plan, designs, False, table, counts + more, (tolerance, astray, 1.0), None)
    return _unknowns(plan, found[at, :, np.arange(len(at))].T, len(designs.z))


class Ends(NamedTuple):
    """Where designs are that were closed from near by: which are, and how regular the least regular is of the groups
    that Newton's method closed (the volume that the columns of its slope span), both (designs,); the unknowns
    (unknowns, designs); the points that were asked for, and the same in the other assembly of their group, infinite
    where that is
    not known (points, 2, designs)."""

    closed: Array
    regular: Array
    z: Array
    points: Array
    others: Array


def ended(
    program: Program,
    mechanism: Mechanism,
    designs: Designs,
    links: Sequence[str],
    levels: Sequence[int],
    tolerance: float,
    corrections: int,
) -> Ends:
    """Designs closed from unknowns near by, at the inputs where they start; points on `links` that these groups place.

    Raises NotPrinted.
    """
    plan = layout(program, structure(mechanism), tuple(links), False, tuple(levels))
    gone = np.zeros((1, len(designs.start)))
    table, counts = _table(gone)
    counts[:] = corrections
    out, good = _called(plan, designs, False, table, counts, (tolerance, np.inf, 1.0), None)
    rows, places = out[0], 2 * len(links)
    z = _unknowns(plan, rows[2 * places :], len(designs.z))
    both = rows[: 2 * places].reshape(2, len(links), 2, rows.shape[1])
    return Ends(good > 0, np.sqrt(np.maximum(rows[-1], 0.0)), z, *both)


def _unknowns(plan: Layout, rows: Array, many: int) -> Array:
    """The unknowns (unknowns, designs) of a state (rows, designs)."""
    state = dict(zip(plan.state, rows, strict=False))
    z = np.empty((many, rows.shape[1]))
    for k in range(many):
        z[k] = state["z", k] if ("z", k) in state else np.arctan2(state["zs", k], state["zc", k])
    return z


def _astray(longest: float) -> float:
    return min(ASTRAY * max(1.0, longest / COARSE[0]) ** 2, MOST)


def _called(
    plan: Layout,
    designs: Designs,
    rates: bool,
    table: Array,
    counts: Array,
    numbers: tuple[float, float, float],
    out: Array | None,
) -> tuple[Array, Array]:
    function = compiled(plan.text, NAME, *KINDS)
    many, steps, lanes = designs.p.shape[1], len(table), plan.lanes
    rows = (
        designs.p,
        designs.q,
        _stated(plan.state, designs.z),
        _stated(plan.drives, designs.start),
        np.concatenate([designs.u1, designs.u2]) if rates else np.zeros((0, many)),
    )
    given = out
    if out is None or not is_room(out):
        out = room(steps, plan.out, many)
    good = np.empty(-(-many // lanes) * lanes)
    whole = many // lanes * lanes
    if whole:
        _call(function, plan, rows, whole, (table, counts), numbers, out, good)
    if whole < many:
        # those that do not fill the lanes, with copies of the last beside them
        which = np.minimum(np.arange(whole, whole + lanes), many - 1)
        last = room(steps, plan.out, lanes)
        _call(function, plan, [row[:, which] for row in rows], lanes, (table, counts), numbers, last, good[whole:])
        out[:, :, whole:] = last[:, :, : many - whole]
    if given is not None and given is not out:
        given[...] = out
    return out, good[:many].astype(int)


def _call(
    function: Any,
    plan: Layout,
    rows: Sequence[Array],
    many: int,
    tables: tuple[Array, Array],
    numbers: tuple[float, float, float],
    out: Array,
    good: Array,
) -> None:
    arrays = [np.ascontiguousarray(row) for row in (*rows, *tables)]
    width = rows[0].shape[1]
    strides = (out.strides[1] // out.itemsize, out.strides[0] // out.itemsize)
    function(
        many // plan.lanes,
        len(tables[0]),
        width,
        *strides,
        *(each.ctypes.data for each in arrays),
        *numbers,
        out.ctypes.data,
        good.ctypes.data,
    )


def _stated(leaves: Sequence[tuple[str, int]], values: Array) -> Array:
    """Cosines, sines and values of rows, as leaves say."""
    found = np.empty((len(leaves), values.shape[1]))
    for row, (part, k) in zip(found, leaves, strict=True):
        of = values[k]
        # designs mostly start at one input
        alike = of.size and of[0] == of[-1] and np.all(of == of[0])
        row[:] = {"c": np.cos, "s": np.sin}.get(part[1:], np.positive)(of[:1] if alike else of)
    return found


def _table(gone: Array) -> tuple[Array, Array]:
    """What every step needs to know: the weights of the steps before, and how far each input has gone."""
    steps, inputs = gone.shape
    table, counts = np.zeros((steps, ORDER + 3 * inputs)), np.full(steps, CORRECTIONS, dtype=np.int64)
    for step in range(min(steps, ORDER)):
        table[step, : len(AHEAD[step])] = AHEAD[step]
    table[ORDER:, :ORDER] = AHEAD[ORDER]
    longest = float(np.max(np.abs(np.diff(gone, axis=0)), initial=0.0))
    counts[:] = CORRECTIONS + sum(longest > each for each in COARSE)
    counts[: ORDER + 1] = FIRST
    for k in range(inputs):
        table[:, ORDER + 3 * k : ORDER + 3 * k + 3] = np.stack(
            [gone[:, k], np.cos(gone[:, k]), np.sin(gone[:, k])], axis=1
        )
    return table, counts
