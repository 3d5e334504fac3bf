"""A catalogue: random designs of one structure with their motion, cached on disk.

Where links stand is drawn at random, and so are the free numbers; then numbers and places are changed together as
little as closes all equations (Newton's steps of least norm). Closure is linear in lengths and coordinates, so that
nearly every draw becomes a design, where hardly any set of random lengths can be assembled.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from math import log, pi

import numpy as np

from planar.document.writer import write_mechanism
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.private_cache import PrivateCache
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind
from planar.synthesis.fitting.wanted_equations import CLOSED, WantedEquations, tangents
from planar.synthesis.task.starts import FreeNumbers

STEPS = 72
"""Of a turn, or of as far as a slide may go."""
SLIDE_RANGE = 4.0
"""Of the mechanism's size: how far a slide that runs is followed."""
MAX_TURN = 0.35
"""rad, or of the size: how much any unknown changes in a step; shorter steps towards dead points."""
MAX_STEPS = 110
LEAST_RATE = 0.03
"""Of the input beside all unknowns, along the path: where it is less a dead point is near, and the branch ends."""


def follow_branches(equations: WantedEquations, x: Array, y: Array) -> tuple[Array, BoolArray]:
    """The unknowns (designs, steps, unknowns) along each design's branch, the input rising, NaN beyond its ends; and
    which designs turn fully (designs,)."""
    forward, is_whole = _follow(equations, x, y, 1.0)
    part = np.flatnonzero(~is_whole)
    back, _ = _follow(equations, x[part], y[part], -1.0)
    joined = np.full((len(x), 2 * MAX_STEPS + 1, y.shape[1]), np.nan)
    joined[:, MAX_STEPS:] = forward
    joined[part, : MAX_STEPS + 1] = back[:, ::-1]
    return joined, is_whole


def _follow(equations: WantedEquations, x: Array, y: Array, sense: float) -> tuple[Array, BoolArray]:
    turns = equations.design.equations.input_kinds[0] is not MeasureKind.LENGTH
    span = 2.0 * pi if turns else SLIDE_RANGE * equations.design.solver.unit / equations.input_scale
    found = np.full((len(x), MAX_STEPS + 1, y.shape[1]), np.nan)
    found[:, 0] = y
    rows, here = np.arange(len(x)), y[:, None]
    way = np.zeros_like(here)
    way[..., -1] = sense
    tangent = _along(equations, x, here, way)
    is_whole = np.zeros(len(x), bool)
    for step in range(1, MAX_STEPS + 1):
        if not len(rows):
            break
        rate = np.abs(tangent[:, 0, -1])
        left = span - np.abs(here[:, 0, -1] - y[rows, -1])
        length = np.minimum(span / STEPS, left) / np.maximum(rate, 1e-9)
        length = np.minimum(length, MAX_TURN / np.maximum(np.abs(tangent[:, 0]).max(axis=1), 1e-9))
        there = here + length[:, None, None] * tangent
        there, _ = equations.close(x[rows], there, tangent, 3)
        after = _along(equations, x[rows], there, tangent)
        F, _ = equations.closure_at(x[rows], there)
        good: BoolArray = np.asarray(np.abs(F).max(axis=(1, 2), initial=0.0) < CLOSED)
        good &= np.isfinite(there).all(axis=(1, 2))
        good &= sense * after[:, 0, -1] > LEAST_RATE
        good &= np.abs(there - here).max(axis=(1, 2)) < 2.0 * MAX_TURN
        found[rows[good], step] = there[good, 0]
        done = good & (np.abs(there[:, 0, -1] - y[rows, -1]) > span * (1.0 - 1e-6))
        is_whole[rows[done]] = turns
        on = good & ~done
        rows, here, tangent = rows[on], there[on], after[on]
    return found, is_whole


def _along(equations: WantedEquations, x: Array, y: Array, before: Array) -> Array:
    """Unit vectors along the path, in the sense of those before."""
    jacobian = equations.jacobians(x, y)
    if not jacobian.shape[2]:
        return np.broadcast_to(before, y.shape).copy()
    found = tangents(np.where(np.isfinite(jacobian), jacobian, 0.0))
    sense = np.where(np.sum(found * before, axis=-1, keepdims=True) < 0.0, -1.0, 1.0)
    told: Array = sense * found
    return told


CLOSING_STEPS, DRAW_RESIDUAL = 24, 1e-9
MOBILITY_OF_PLACES = 0.1
"""How readily places change to close a design, beside numbers."""
NEAR_SHARE, NEAR_SPREAD = 0.25, 0.25
"""Of designs near the start, and how far from it they are, of the numbers and the size."""
LENGTH_RANGE = (0.12, 1.6)
"""Of the mechanism's size: between which lengths are drawn, evenly by their logarithm."""
COORDINATE_RANGE = 0.9
"""Of the size: how far coordinates go, either way."""
LEAST_LENGTH = 0.02


def draw_designs(
    equations: WantedEquations, free: FreeNumbers, count: int, random: np.random.Generator
) -> tuple[Array, Array]:
    """Scaled free numbers (designs, free), and unknowns (designs, unknowns) at which each goes together; fewer than
    `count` of them."""
    lower, upper = free.lower / equations.scale, free.upper / equations.scale
    start = free.values / equations.scale
    unit = equations.design.solver.unit / equations.unit
    x = draw_numbers(equations, free, count, random, unit)
    y = draw_places(equations, count, random, 1.0)
    near = random.random(count) < NEAR_SHARE
    x[near] = start * (1.0 + NEAR_SPREAD * random.normal(size=(int(near.sum()), len(start))))
    x = np.clip(x, lower, upper)
    least = np.where(is_positive(free), np.maximum(lower, 2.0 * LEAST_LENGTH), lower)
    x, y = _close(equations, x, y, least, upper)
    F, _ = equations.closure_at(x, y[:, None])
    good: BoolArray = np.asarray(np.abs(F).max(axis=(1, 2), initial=0.0) < DRAW_RESIDUAL)
    good &= ((x >= lower - 1e-12) & (x <= upper + 1e-12)).all(axis=1)
    good &= (x[:, is_positive(free)] > LEAST_LENGTH).all(axis=1)
    return x[good], y[good]


def is_positive(free: FreeNumbers) -> BoolArray:
    """The numbers that are lengths of something, not coordinates: these are above zero."""
    return np.array(
        [
            kind == "length" and not name.endswith((".x", ".y"))
            for name, kind in zip(free.names, free.kinds, strict=True)
        ],
        dtype=bool,
    )


def draw_numbers(
    equations: WantedEquations, free: FreeNumbers, count: int, random: np.random.Generator, unit: float
) -> Array:
    """Random free numbers (designs, free), scaled, of designs of about the size `unit`."""
    lower, upper = free.lower / equations.scale, free.upper / equations.scale
    start = free.values / equations.scale
    found = np.empty((count, len(free.names)))
    for k, (positive, kind) in enumerate(zip(is_positive(free), free.kinds, strict=True)):
        if np.isfinite(lower[k]) and np.isfinite(upper[k]):
            found[:, k] = random.uniform(lower[k], upper[k], count)
        elif positive:
            found[:, k] = unit * np.exp(random.uniform(log(LENGTH_RANGE[0]), log(LENGTH_RANGE[1]), count))
        elif kind == "length":
            found[:, k] = start[k] * random.integers(0, 2, count) + unit * COORDINATE_RANGE * random.uniform(
                -1, 1, count
            )
        elif kind == "angle":
            found[:, k] = random.uniform(-pi, pi, count)
        else:
            found[:, k] = start[k] * np.exp(random.normal(0.0, 0.5, count))
    return found


def draw_places(equations: WantedEquations, count: int, random: np.random.Generator, unit: float) -> Array:
    """Random unknowns and inputs (designs, unknowns) of designs of about the size `unit`."""
    design = equations.design
    kinds = [design.equations.coordinates[k].kind for k in design.equations.unknowns]
    kinds.append(design.equations.input_kinds[0])
    found = np.empty((count, len(kinds)))
    for k, kind in enumerate(kinds):
        if kind is MeasureKind.LENGTH:
            found[:, k] = unit * random.uniform(-1.2, 1.2, count)
        else:
            found[:, k] = random.uniform(-pi, pi, count)
    return found


def _close(equations: WantedEquations, x: Array, y: Array, lower: Array, upper: Array) -> tuple[Array, Array]:
    """Numbers between bounds, and unknowns, that keep the equations: steps of least norm, and back to the bounds."""
    for _ in range(CLOSING_STEPS):
        F, F_y, F_x = (each[:, 0] for each in equations.closure_slopes_at(x, y[:, None]))
        if not F.shape[1]:
            break
        slopes = np.concatenate([F_x, MOBILITY_OF_PLACES * F_y], axis=2)
        square = slopes @ slopes.swapaxes(1, 2)
        square += 1e-13 * np.eye(square.shape[1])
        step = -(slopes.swapaxes(1, 2) @ np.linalg.solve(square, F[..., None]))[..., 0]
        step = np.nan_to_num(np.clip(step, -2.0, 2.0))
        x = np.clip(x + step[:, : x.shape[1]], lower, upper)
        y = y + MOBILITY_OF_PLACES * step[:, x.shape[1] :]
    return x, y


LEAST_STEPS = 8
"""Positions that a design's branch has at least, to be of use."""


@dataclass(frozen=True)
class Catalogue:
    """Designs (designs, ...): scaled free numbers, and along each one's branch its unknowns and results."""

    numbers: Array
    "(designs, free)"
    unknowns: Array
    "(designs, steps, unknowns), NaN beyond the ends of a branch"
    values: tuple[Array, ...]
    "of each wanted item (designs, steps, parts), in units of its scales"
    is_whole: BoolArray
    "(designs,)"

    def __len__(self) -> int:
        """How many designs there are."""
        return len(self.numbers)

    def take(self, designs: IntArray) -> Catalogue:
        """Those designs (n,) of it."""
        values = tuple(each[designs] for each in self.values)
        return Catalogue(self.numbers[designs], self.unknowns[designs], values, self.is_whole[designs])


def build_catalogue(equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int = 0) -> Catalogue:
    """A catalogue from so many draws, the same for the same seed."""
    first = equations[0]
    x, y = draw_designs(first, free, count, np.random.default_rng([seed, count]))
    unknowns, is_whole = follow_branches(first, x, y)
    steps = np.isfinite(unknowns[..., 0] if unknowns.shape[2] else unknowns[..., -1]).sum(axis=1)
    kept = steps >= LEAST_STEPS
    x, unknowns, is_whole = x[kept], unknowns[kept], is_whole[kept]
    told = tuple(each.values(x, unknowns) for each in equations)
    return Catalogue(x, unknowns, told, is_whole)


def catalogue_key(
    start: Mechanism, equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int
) -> str:
    """What tells one catalogue from another: the file, what is wanted of it, free numbers, bounds, count and seed."""
    told = [
        write_mechanism(start),
        [str(each.rows.wanted.of) for each in equations],
        [*free.names],
        [*map(repr, (*free.lower, *free.upper))],
        count,
        seed,
    ]
    return hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode()).hexdigest()


CACHE = PrivateCache("catalogues", ".npz", b"planar catalogue 1\n", 2 * 2**30)


def kept_catalogue(
    start: Mechanism, equations: tuple[WantedEquations, ...], free: FreeNumbers, count: int, seed: int
) -> Catalogue:
    """The catalogue of so many draws, from disk where it is kept there, else made and kept.

    The `equations` may be of a mechanism similar to the `start`: a catalogue is without a size."""
    key = catalogue_key(start, equations, free, count, seed)
    content = CACHE.read(key)
    if content is not None:
        with np.load(io.BytesIO(content), allow_pickle=False) as file:
            numbers, unknowns, is_whole = (file[name] for name in ("numbers", "unknowns", "is_whole"))
        values = tuple(each.values(numbers, unknowns) for each in equations)
        return Catalogue(numbers, unknowns, values, is_whole)
    found = build_catalogue(equations, free, count, seed)
    if CACHE.is_writable():
        told = io.BytesIO()
        np.savez(told, numbers=found.numbers, unknowns=found.unknowns, is_whole=found.is_whole)
        CACHE.write(key, told.getvalue())
    return found
