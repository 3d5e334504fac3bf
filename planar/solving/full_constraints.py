"""All constraints of a mechanism in all its coordinates, nothing eliminated: what its pairs hold, inputs or not.

Lengths are divided by the mechanism's size. Columns by the complex step, so the pairs' own formulas are the only ones:
W. Squire, G. Trapp, Using Complex Variables to Estimate Derivatives of Real Functions, SIAM Review 40, 1998.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.equations.functions import placed, scaled
from planar.foundation.geometry import Frame
from planar.model.pairs import Kind, Pair
from planar.solving.assembly.sketch_start import sketched
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

STEP = 1e-30
CLOSED, ROUNDED = 1e-10, 1e-15
NEARLY = 1e-6
"""Damping above which a step need not be exact."""
LONGEST = 60
"""Iterations: where constraints only just touch, the error halves each time."""
TRIES = 4
"""Starts from which a linkage is joined that its inputs do not determine."""
AWAY = 0.02
"""How far (sizes, rad) a position is moved along what it allows, to see whether the motion goes on."""
LEAST_SEEDS, MOST_SEEDS = 3, 12
NEAR = 1e-3
"""How far its neighbours are from a position whose motions are counted; what bends back within it is none."""
SINGULAR = 1e-6
"""A singular value below this part of the greatest is zero: where constraints touch, rounding leaves about 1e-8."""


class Constraints:
    """The residuals of all pairs, or of some, at coordinates w (coordinates,), as `Equations.coordinates` has them."""

    def __init__(self, setup: Setup, pairs: Sequence[Pair] | None = None):
        self.setup = setup
        self.pairs = tuple(setup.mechanism.pairs if pairs is None else pairs)
        self.coordinates = setup.equations.coordinates
        self.pair_of_row = tuple(pair.name for pair in self.pairs for _ in pair.constrains)
        self._numbers = {
            pair.name: scaled(pair.measure([setup.shapes[link] for link in pair.bodies]), pair.measures, setup.unit)
            for pair in (*self.pairs, *setup.named.values())
        }

    def gaps(self, w: Array) -> Array:
        """What every constraint leaves open (rows,), of w (coordinates, many) of each (rows, many)."""
        left, (frames, own) = [], self._placed(w)
        for pair in self.pairs:
            for kind, value in zip(pair.constrains, pair.residual(*self._of(pair, frames, own)), strict=True):
                left.append(np.arctan2(np.sin(value), np.cos(value)) if self._wraps(kind, w) else value)
        return np.array(np.broadcast_arrays(*left)) if left else np.zeros((0, *w.shape[1:]))

    @staticmethod
    def _wraps(kind: Kind, w: Array) -> bool:
        return kind is Kind.ANGLE and not np.iscomplexobj(w)

    def slope(self, w: Array) -> Array:
        """(rows, coordinates)"""
        return np.imag(self.gaps(self._nudged(w))) / STEP

    def drives(self, names: tuple[str, ...], w: Array) -> Array:
        """The drives of these relative motions (names,)."""
        return np.array(self._drives(names, w))

    def drive_slope(self, names: tuple[str, ...], w: Array) -> Array:
        """(names, coordinates)"""
        nudged = self._nudged(w)
        rows = [np.broadcast_to(np.imag(drive), (w.size,)) for drive in self._drives(names, nudged)]
        return np.array(rows).reshape(len(names), w.size) / STEP

    def _drives(self, names: tuple[str, ...], w: Array) -> list[Array]:
        frames, own = self._placed(w)
        return [pair.drive(*self._of(pair, frames, own)) for pair in (self.setup.named[name] for name in names)]

    def _nudged(self, w: Array) -> Array:
        return np.repeat(w[:, None].astype(complex), w.size, axis=1) + 1j * STEP * np.eye(w.size)

    def _placed(self, w: Array) -> tuple[dict[str, Frame], dict[str, tuple[Array, ...]]]:
        return placed(w, self.setup.column, self.setup.shapes, self.setup.pairs)

    def _of(self, pair: Pair, frames: dict[str, Frame], own: dict[str, tuple[Array, ...]]) -> tuple[Any, Any, Any]:
        """What the pair's formulas take."""
        return [frames[link] for link in pair.bodies], self._numbers[pair.name], own.get(pair.name, ())

    def closed(self, w: Array, drives: tuple[str, ...] = (), at: Array | None = None) -> Array | None:
        """The nearest closed position by Gauss and Newton's method, some drives held; None where there is none."""
        left, slope = self._held(w, drives, at)
        damping = 1e-3
        for _ in range(LONGEST):
            if np.max(np.abs(left), initial=0.0) < ROUNDED or damping > 1e8:
                break
            tried = w + _damped(slope, left, damping)
            new = self._held(tried, drives, at)
            if np.sum(new[0] ** 2) < np.sum(left**2):
                w, (left, slope), damping = tried, new, 0.1 * damping
            else:
                damping *= 10.0
        return w if np.max(np.abs(left), initial=0.0) <= CLOSED else None

    def _held(self, w: Array, drives: tuple[str, ...], at: Array | None) -> tuple[Array, Array]:
        left, slope = self.gaps(w), self.slope(w)
        if drives and at is not None:
            left = np.concatenate([left, self.drives(drives, w) - at])
            slope = np.vstack([slope, self.drive_slope(drives, w)])
        return left, slope


def _damped(slope: Array, left: Array, damping: float) -> Array:
    top = float(np.linalg.norm(slope)) or 1.0
    if damping > NEARLY:
        # far away the normal equations will do, at a fraction of the cost
        square = slope.T @ slope + (damping * top) ** 2 * np.eye(slope.shape[1])
        return -np.linalg.solve(square, slope.T @ left)
    u, s, vt = np.linalg.svd(slope, full_matrices=False)
    gain = np.where(s > 1e-13 * top, s / np.maximum(s * s + (damping * top) ** 2, 1e-300), 0.0)
    return -vt.T @ (gain * (u.T @ left))


def rank(slope: Array) -> int:
    """The rank of a slope, rounding apart."""
    values = np.linalg.svd(slope, compute_uv=False) if slope.size else np.zeros(0)
    return int(np.sum(values > SINGULAR * max(values[0], 1e-300))) if values.size else 0


def null_space(slope: Array) -> Array:
    """Orthonormal columns that the slope takes to zero (columns, nullity)."""
    if not slope.size:
        return np.eye(slope.shape[1])
    return np.linalg.svd(slope)[2][rank(slope) :].T


def moved(free: Array, rng: np.random.Generator, far: float) -> Array:
    """A random move of a length within the columns of `free`."""
    way = free @ rng.normal(size=free.shape[1])
    return way * (far / np.linalg.norm(way))


def joined(constraints: Constraints) -> Array | None:
    """A closed position near the sketch, with the inputs where they are if that can be; None where none is found."""
    setup = constraints.setup
    names = tuple(given.pair for given in setup.mechanism.inputs)
    for held, at in ((names, setup.station.u), ((), None)):
        for seed in range(TRIES):
            found = constraints.closed(sketched(setup, seed), held, at)
            if found is not None:
                return found
        if not names:
            break
    return None


def motion_from(constraints: Constraints, w: Array) -> tuple[int, Array]:
    """The dimension of the motion that leads away from a position, and a position on it."""
    free = null_space(constraints.slope(w))
    found, place, held = 0, w, -1
    for seed in range(MOST_SEEDS if free.size else 0):
        rng = np.random.default_rng(seed)
        away = constraints.closed(w + moved(free, rng, AWAY))
        if away is not None:
            ways, holds = _ways(constraints, away, rng), rank(constraints.slope(away))
            # of places that move alike the one where nothing is singular: some fall back beside w
            if (ways, holds) > (found, held):
                found, place, held = ways, away, holds
        if seed >= LEAST_SEEDS and found + held == w.size:
            break
    return found, place


def _ways(constraints: Constraints, w: Array, rng: np.random.Generator) -> int:
    """In how many directions the closed positions next to one spread."""
    free = null_space(constraints.slope(w))
    many = 2 * free.shape[1] + 2
    moves = []
    for _ in range(many if free.size else 0):
        beside = constraints.closed(w + moved(free, rng, NEAR))
        if beside is not None:
            moves.append((beside - w) / NEAR)
    if not moves:
        return 0
    values = np.linalg.svd(np.array(moves), compute_uv=False)
    return int(np.sum(values > 0.1 * np.sqrt(len(moves) / free.shape[1])))
