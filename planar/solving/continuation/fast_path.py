"""Along straight ways of the inputs in compiled functions alone, as far as everything there is surely sound."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

import numpy as np

from planar.equations.acceptance import Stride, Verdict
from planar.solving.checks.branch_check import CLOSE, allowed
from planar.solving.checks.residual_check import EPS, SURELY_KEPT, TOUCHING
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

STRONG = 1e-3
"""Strength of a group from which on its rates are taken as they come; what is weaker is looked at in doubles' whole
precision, see `freedom.SINGULAR`."""
CLEAR = 0.05
"""Least singular value (columns of one size) at both ends of a stride: no change point is near, not even of a
neighbouring linkage."""
SAFE = 3.0
"""How many strides the two ends of one are together from where a group could be singular; the gate asks for half."""
STRAIGHT = 1e-12
"""rad or sizes: inputs that are no further from a straight way are on it."""
STRIDE = 0.125
"""rad or sizes that the fastest input moves from one kept position to the next."""
MOST_WAYS = 8
MOST_NUMBERS, LEAST_KEPT = 20_000, 128
"""Numbers that are kept of positions along one way, and positions that are kept however many numbers they have."""


class Judgement:
    """A position that is surely sound, with its rates."""

    __slots__ = ("parts", "residual")

    def __init__(self, parts: Array, residual: float):
        self.parts, self.residual = parts, residual


def sound(setup: Setup, z: Array) -> Judgement | None:
    """The position with its rates (coordinates, orders), if it is surely sound."""
    judged = setup.judged
    if judged is None:
        return None
    s = setup.station
    parts, verdict, _, _ = judged.position(z, s.u1, s.u, s.u1, s.u2, s.p, setup.by, setup.least)
    told = Verdict(*verdict[0].tolist())
    passed = _passes(setup, told) and told.strength >= STRONG
    return Judgement(parts.T, told.open) if passed else None


def surely_determined(setup: Setup, z: Array) -> bool:
    """Whether every group is surely determined at a position."""
    if setup.judged is None:
        return False
    s = setup.station
    verdict = setup.judged.position(z, s.u1, s.u, s.u1, s.u2, s.p, setup.by, setup.least)[1]
    return bool(Verdict(*verdict[0].tolist()).strength >= STRONG)


class Told(NamedTuple):
    """Coordinates with their rates at the rows of a run (rows, 3, coordinates), which rows are surely sound (rows,),
    and what the worst constraint leaves open at those. Of the other rows nothing is told."""

    parts: Array
    sure: Array
    open: float

    def cut(self, rows: slice) -> Told:
        """Some of the rows."""
        return Told(self.parts[rows], self.sure[rows], self.open)

    def padded(self, before: int, after: int) -> Told:
        """With so many more rows at the ends of which nothing is told."""
        many = ((before, after), (0, 0), (0, 0))
        return Told(np.pad(self.parts, many), np.pad(self.sure, many[0]), self.open)

    def backwards(self) -> Told:
        """The rows in the opposite order, velocities turned round."""
        return Told(self.parts[::-1] * np.array([1.0, -1.0, 1.0])[:, None], self.sure[::-1], self.open)


def stacked(first: Told | None, second: Told | None) -> Told | None:
    """The rows of both."""
    if first is None or second is None:
        return None
    parts = np.concatenate([first.parts, second.parts])
    return Told(parts, np.concatenate([first.sure, second.sure]), max(first.open, second.open))


class Course(NamedTuple):
    """The first rows of a run, all of them surely sound: unknowns (rows, unknowns), coordinates with their rates (rows,
    3, coordinates), and what the worst constraint leaves open."""

    z: Array
    parts: Array
    open: float


def course(setup: Setup, z: Array, u: Array, u1: Array, u2: Array) -> Course | None:
    """A run along a straight way of inputs (rows, inputs) with rates u1, u2 from the unknowns of its first row, as far
    as it is surely sound: both parts of the gate, rates, contacts. None for what is no such run."""
    judged, p = setup.judged, setup.station.p
    if judged is None or not u.size:
        return None
    steps = u[1:] - u[:-1]
    sizes = np.abs(steps).max(axis=1, initial=0.0)
    most = int(np.argmax(sizes))
    axis = steps[most] / sizes[most] if sizes[most] > 0.0 else np.ones(u.shape[1])
    square = float(axis @ axis)
    gone = steps @ axis / square
    if np.abs(steps - gone[:, None] * axis).max(initial=0.0) > STRAIGHT:
        return None
    found = np.concatenate([z[None], setup.program.run(z, u[1:], p)])
    settled, parts, verdict, ways, distances = judged.row.over(len(u), found, axis, u, u1, u2, p, setup.by, setup.least)
    settled, told = settled[:, 0], Verdict(*verdict[:, 0].T)
    # what is not a number is not below anything
    fine = told.open <= setup.tolerance
    fine &= np.isfinite(told.whole)
    fine &= np.maximum(told.broken, told.broken_second) <= 1e3 * setup.tolerance
    fine &= told.apart <= TOUCHING
    fine &= told.strength >= STRONG
    fine &= EPS * told.amplified <= SURELY_KEPT
    if z.size:
        with np.errstate(invalid="ignore", over="ignore"):
            fine[1:] &= _keeps(judged.starts, settled, gone, ways[:, 0], distances[:, 0], square)
    many = len(fine) if fine.all() else int(np.argmin(fine))
    return Course(settled[:many], parts[:many], float(told.open[:many].max(initial=0.0)))


def _passes(setup: Setup, told: Verdict) -> bool:
    tolerance = setup.tolerance
    return (
        told.open <= tolerance
        and isfinite(told.whole)
        and told.broken <= 1e3 * tolerance
        and told.broken_second <= 1e3 * tolerance
        and told.apart <= TOUCHING
        and EPS * told.amplified <= SURELY_KEPT
    )


def _keeps(starts: Array, z: Array, gone: Array, ways: Array, distances: Array, square: float) -> Array:
    """For each step of a run whether it keeps to its branch; see `branch`.

    Steps have `gone` (steps,) along the axis of the inputs; rates `ways` (rows, unknowns) and distances (rows, stages)
    are along it too.
    """
    step = gone[:, None]
    before, after = ways[:-1] * step, ways[1:] * step
    turns = np.add.reduceat(before * after, starts, axis=1).min(axis=1) + gone * gone * square
    safe = (distances[:-1] + distances[1:]).min(axis=1) > CLOSE * np.abs(gone)
    return (turns >= 0.0) & safe & allowed(z[1:] - z[:-1], before, after).all(axis=1)


class Ways:
    """Positions at even distances along straight ways that lead away from one position, each made when it is needed.

    They depend on that position and the way alone, so that what is found by them does not depend on what was asked for
    before.
    """

    def __init__(self, setup: Setup, z: Array):
        self.setup, self.z, self.start = setup, z, setup.station.u
        self.room = max(MOST_NUMBERS // max(len(z), 1), LEAST_KEPT)
        self._kept: dict[tuple[float, ...], dict[int, Array | None]] = {}

    def to(self, stop: Array) -> Array | None:
        """The unknowns to which the straight way to other inputs leads; None where not all of it is surely sound."""
        if self.setup.judged is None:
            return None
        way = stop - self.start
        reach = max(map(abs, way.tolist()), default=0.0)
        if reach == 0.0:
            return self.z
        many = int(reach / STRIDE)
        if not many <= self.room:
            return None
        axis = way / reach
        key = tuple(axis.tolist())
        kept = self._kept.get(key)
        if kept is None:
            if len(self._kept) >= MOST_WAYS:
                self._kept.clear()
            kept = self._kept[key] = {0: self.z}
        known = many
        while known not in kept:
            known -= 1
        for k in range(known, many):
            z = kept[k]
            if z is None:
                return None
            kept[k + 1] = self._stride(z, self.start + k * STRIDE * axis, STRIDE * axis)
        z, here = kept[many], self.start + many * STRIDE * axis
        return None if z is None else self._stride(z, here, stop - here)

    def _stride(self, z: Array, u: Array, step: Array) -> Array | None:
        judged = self.setup.judged
        assert judged is not None
        after, verdict = judged.stride(z, u, step, self.setup.station.p)
        told = Stride(*verdict[0].tolist())
        passed = (
            told.open <= self.setup.tolerance
            and isfinite(told.whole)
            and told.astray <= 1.0
            and told.onwards >= 0.0
            and told.safe > SAFE
            and told.least > CLEAR
        )
        return after[0] if passed else None
