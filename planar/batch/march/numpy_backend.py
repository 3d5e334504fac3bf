"""The backend that is always there: the compiled program, step after step, over the designs of a block."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import March, NotMarched
from planar.batch.march.checks import Branches, Closed, Here
from planar.batch.march.design_functions import Columns
from planar.equations.functions import Rates, shapes, size
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet
from planar.solving.checks.residual_check import Gate

Array = np.ndarray

PREDICTED = ((), (1.0,), (2.0, -1.0), (3.0, -3.0, 1.0), (4.0, -6.0, 4.0, -1.0))
"""Weights of the last moves for the next: the polynomial through them."""


FEWER = 0.7
"""Where less than this part of the designs goes on, the others are left behind."""


class Row(NamedTuple):
    """All designs at one step: z (designs, unknowns), u (inputs, designs), w (coordinates, designs), which of them have
    passed the gate at this step and all before, and the slopes by which they were judged."""

    z: Array
    u: Array
    w: Array
    good: Array
    here: Here


def march(task: March, out: Array) -> Array:
    """See `Marching`. Raises NotMarched where groups hold more constraints than unknowns."""
    steps, designs = len(task.u), task.p.shape[1]
    good, some, first, part = np.zeros(designs, dtype=int), np.arange(designs), 0, task
    with np.errstate(all="ignore"):  # designs that have failed run on as what is no number
        while some.size and first < steps:
            first, row = _marched(part, first, some, out, good)
            # those that have failed are left behind; the others go on from the step where they are
            some, part = some[row.good], task.of(some[row.good], row.z[row.good].T)
    return good


def _marched(part: March, first: int, some: Array, out: Array, good: Array) -> tuple[int, Row]:
    """March some designs on from a step, to the end or to where most have failed: the step after it, or that itself."""
    columns = Columns(part.program, part.p)
    told, last = Told(part, columns), len(part.u) - 1
    whole = out.shape[2] == len(some)
    own = None if whole else np.empty((out.shape[1], len(some)))
    inputs = (part.u0 + each[:, None] for each in part.u[first:])
    for step, row in enumerate(rows(part, inputs, columns), start=first):
        into = out[step] if own is None else own
        fine = told.into(into, row)
        if own is not None:
            out[step][:, some] = own
        good[some] += row.good & fine & (good[some] == step)
        if step in (last, first):
            continue
        if np.count_nonzero(row.good) < FEWER * len(some):
            return step, row
    return last + 1, row


def rows(task: March, inputs: Iterable[Array], columns: Columns | None = None) -> Iterator[Row]:
    """The designs at inputs (inputs, designs), one step after the other, from the unknowns at the first."""
    if not task.program.square:
        raise NotMarched("constraints hold each other more than once")
    columns = columns or Columns(task.program, task.p)
    closed, branches = told_closed(task), Branches(columns, task.p)
    z, moves = np.ascontiguousarray(task.z0.T), []
    before, ahead, last_way = None, None, None
    good = np.ones(len(z), dtype=bool)
    for u in inputs:
        near = z.copy()
        for weight, move in zip(PREDICTED[min(len(moves), 4)], moves, strict=False):
            near += weight * move
        after = columns.advance(near, u.T)
        if before is not None:
            moves = [after - z, *moves[:3]]
        z = after
        w = columns.positions(z, u.T)
        good = good & (closed.left(w, u) <= task.tolerance) & closed.exact(w)
        here = branches.here(z, u.T)
        good = good & branches.regular(here)
        if before is not None:
            way = here.u - before.u
            same = last_way is not None and np.allclose(way, last_way, rtol=1e-9, atol=1e-12)
            keeps, ahead = branches.kept(before, here, ahead if same else None)
            good, last_way = good & keeps, way
        before = here
        yield Row(z, u, w, good, here)


def told_closed(task: March) -> Closed:
    """The first part of the gate for a march."""
    own = shapes(task.mechanism)
    return Closed(Gate(task.mechanism, own, size(task.mechanism, own)), task.mechanism, task.program, task.p)


class Told:
    """The points of a march, with their rates."""

    def __init__(self, task: March, columns: Columns):
        self.task, self.columns, self.closed = task, columns, told_closed(task)

    def into(self, out: Array, row: Row) -> Array:
        """Write the points of a step (rows, designs); whether their rates break no constraint (designs,)."""
        task = self.task
        if not task.rates:
            self._points(out, row.w)
            return np.ones(row.w.shape[1:] or row.good.shape, dtype=bool)
        found = self._rates(row)
        w = [Jet(*(np.ascontiguousarray(part[:, k]) for part in found)) for k in range(found[0].shape[1])]
        self._points(out, w)
        frames, own = self.closed.placed(w)
        inputs = [Jet(u, u1, u2) for u, u1, u2 in zip(row.u, task.u1, task.u2, strict=True)]
        gaps = self.closed.gate.rate_gaps(frames, own, inputs)
        return np.all([np.broadcast_to(gap, row.good.shape) <= 1e3 * task.tolerance for gap, _ in gaps], axis=0)

    def _rates(self, row: Row) -> tuple[Array, Array, Array]:
        """w with its first and second rates, each (designs, coordinates)."""
        task, none = self.task, np.zeros_like(row.z)
        y, u1, u2 = np.hstack([row.z, row.u.T]), task.u1.T, task.u2.T

        def at(z1: Array, z2: Array) -> Rates:
            return self.columns.kinematics(y, np.hstack([z1, u1]), np.hstack([z2, u2]))

        z1 = (row.here.gains @ u1[:, :, None])[..., 0]
        z2 = _solved(row.here.slopes, at(z1, none).F2)
        found = at(z1, z2)
        return found.w, found.w1, found.w2

    def _points(self, out: Array, w) -> None:  # noqa: ANN001 - arrays or jets alike
        frames, _ = self.closed.placed(w)
        many = 2 * len(self.task.links)
        for k, link in enumerate(self.task.links):
            place = frames[link].carry(Vector(*self.task.q[2 * k : 2 * k + 2]))
            for axis, value in enumerate(place):
                for order, part in enumerate(value.parts if isinstance(value, Jet) else (value,)):
                    np.multiply(part, self.task.unit, out=out[order * many + 2 * k + axis])


def _solved(slope: Array, left: Array) -> Array:
    """-slope^-1 left for each design (designs, unknowns); not numbers where a slope is singular."""
    if slope.shape[1] == 0:
        return np.zeros((len(slope), 0))
    if slope.shape[1] == 2:
        a, b, c, d = (slope[:, i, j] for i in (0, 1) for j in (0, 1))
        one, two = left.T
        return np.stack([b * two - d * one, c * one - a * two], axis=1) / (a * d - b * c)[:, None]
    regular = np.all(np.isfinite(slope), axis=(1, 2)) & (np.abs(np.linalg.det(slope)) > 1e-300)
    found = np.full(left.shape, np.nan)
    found[regular] = -np.linalg.solve(slope[regular], left[regular, :, None])[..., 0]
    return found
