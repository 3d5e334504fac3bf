"""On along the curves of many designs at once, from where a backend left them to their dead points."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import March, Reaching
from planar.batch.march.checks import Branches
from planar.batch.march.design_functions import Columns
from planar.batch.march.numpy_backend import Row, Told, rows, told_closed

Array = np.ndarray

FIRST, LONGEST, SHORTEST = 0.05, 0.25, 1e-6
"""Steps of arc length (rad, sizes), as in `solving.walk`."""
BENT, CLOSE = 0.4, 1.5
"""How far a tangent may turn in a step, and how far singular slopes must be: as in `solving.walk`."""
CROSSING = 0.01
"""So near to where branches cross a design is left to be followed by itself."""
NUDGE = 1e-6
CLOSED = 1e-10
ARCS = 120
AT_END = 1e-8
"""Parts of the run: so near to a dead point a step is left to be judged by itself."""
HALVINGS = 60
TOGETHER = 6


class Stopped(NamedTuple):
    """Which designs are settled (designs,), how many of their steps are solved (designs,), and the steps that were
    solved here: design, step (solved,) and the points there, out (rows, solved)."""

    settled: Array
    solved: Array
    design: Array
    step: Array
    out: Array


class _Points(NamedTuple):
    """Points of the curves y = (unknowns, place of the inputs), (designs, n + 1), tangents, bends, how far clear."""

    y: Array
    tangent: Array
    bend: Array
    clear: Array

    def of(self, which: Array) -> _Points:
        return _Points(*(part[which] for part in self))


class _Arcs(NamedTuple):
    """Arcs of the curves: the design, and both ends with their tangents."""

    design: Array
    y0: Array
    t0: Array
    y1: Array
    t1: Array

    def of(self, which: Array) -> _Arcs:
        return _Arcs(*(part[which] for part in self))

    def rough(self, x: Array) -> Array:
        """Near the arc, at parts x of the chord: Hermite's cubic."""
        x = x[:, None]
        chord = np.linalg.norm(self.y1 - self.y0, axis=1)[:, None]
        a, b = (1 + 2 * x) * (1 - x) ** 2, x * x * (3 - 2 * x)
        return a * self.y0 + b * self.y1 + chord * (x * (1 - x) ** 2 * self.t0 + x * x * (x - 1) * self.t1)


class _Curves:
    """The curves of some designs; `Curve` in `solving` is that of one."""

    def __init__(self, march: March, design: Array, way: Array):
        self.columns = Columns(march.program, march.p[:, design])
        self.start, self.way = march.u0.T[design], way

    def inputs(self, y: Array) -> Array:
        return self.start + y[:, -1:] * self.way

    def whole(self, y: Array, tangent: bool = False) -> Array:
        return np.hstack([y[:, :-1], y[:, -1:] * self.way if tangent else self.inputs(y)])

    def slope(self, y: Array) -> Array:
        dz, du = self.columns.slopes(y[:, :-1], self.inputs(y))
        return np.concatenate([dz, (du @ self.way)[..., None]], axis=2)

    def corrected(self, y: Array, normal: Array) -> tuple[Array, Array]:
        """The points near y in the planes with these normals, and which of them Newton's method found."""
        gap = np.full(len(y), np.inf)
        for _ in range(6):
            whole = self.whole(y)
            found = self.columns.kinematics(whole, 0.0 * whole, 0.0 * whole)
            gap = np.max(np.abs(found.F), axis=1, initial=0.0)
            if np.all(gap <= 1e-15):
                break
            slope = np.concatenate([found.slope, (found.drive_slope @ self.way)[..., None]], axis=2)
            y = y + _bordered(slope, normal, -found.F, 0.0)
        return y, gap <= CLOSED

    def at(self, y: Array, towards: Array, whole: bool = True) -> _Points:
        """The points at y, with tangents towards; without bends if not the whole is wanted."""
        slope = self.slope(y)
        tangent = _bordered(slope, towards, np.zeros(slope.shape[:2]), 1.0)
        tangent = tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
        if not whole:
            return _Points(y, tangent, tangent, np.zeros(len(y)))
        wide = self.whole(tangent, True)
        second = self.columns.kinematics(self.whole(y), wide, 0.0 * wide).F2
        bend = _bordered(slope, tangent, -second, 0.0)
        sizes = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-6)
        change = np.linalg.norm((self.slope(y + NUDGE * tangent) - slope) / sizes, axis=(1, 2)) / NUDGE
        least = np.linalg.svd(np.nan_to_num(slope / sizes), compute_uv=False)[:, -1]
        return _Points(y, tangent, bend, least / np.maximum(change, 1e-300))


def _bordered(slope: Array, normal: Array, left: Array, last: float) -> Array:
    """x with slope x = left and normal x = last, for each design; not numbers where that is singular."""
    whole = np.concatenate([slope, normal[:, None]], axis=1)
    right = np.concatenate([left, np.full((len(left), 1), last)], axis=1)
    fine = np.all(np.isfinite(whole), axis=(1, 2)) & (np.abs(np.linalg.det(whole)) > 1e-12)
    found = np.full(right.shape, np.nan)
    found[fine] = np.linalg.solve(whole[fine], right[fine, :, None])[..., 0]
    return found


def stopped(march: March, index: int, good: Array, reach: Reaching | None) -> Stopped:
    """Go on from the last of the `good` steps of each design, which are one at least; `reach` tells where that was.

    Each step is under the conditions of `solving.walk`; a design that does not keep them is not settled. `index` is the
    input that runs.
    """
    with np.errstate(all="ignore"):  # what leads astray ends as what is no number
        stopping = _Stopping(march, index, good)
        return stopping.stopped(reach(march, good).T if reach else stopping.reached())


class _Stopping:
    def __init__(self, march: March, index: int, good: Array):
        self.march, self.good = march, good
        self.steps = len(march.u) - 1
        length = float(march.u[-1, index])
        self.way = np.where(np.arange(len(march.u0)) == index, np.sign(length), 0.0)
        self.places = np.abs(march.u[:, index])
        self.many = len(good)
        self.arcs: list[_Arcs] = []
        self.dead: list[_Arcs] = []
        self.settled = np.zeros(self.many, dtype=bool)
        self.stop = np.full(self.many, np.inf)
        "the place of the dead point"

    def stopped(self, z: Array) -> Stopped:
        """See `stopped`; z (designs, unknowns) at the last good steps."""
        self._walk(z)
        if self.dead:
            self._dead_points()
        return self._told()

    def reached(self) -> Array:
        """The unknowns at the last good step of each design (designs, unknowns)."""
        found = np.full((self.many, self.march.z0.shape[0]), np.nan)
        # those that come about as far are led together
        for some in np.array_split(np.argsort(self.good), min(TOGETHER, self.many)):
            part, good = self.march.of(some), self.good[some]
            inputs = (part.u0 + each[:, None] for each in part.u[: int(good.max())])
            for k, row in enumerate(rows(part, inputs)):
                last = (good == k + 1) & row.good
                found[some[last]] = row.z[last]
        return found

    def _walk(self, z: Array) -> None:
        active = np.flatnonzero(np.all(np.isfinite(z), axis=1))
        y = np.hstack([z[active], self.places[self.good[active] - 1][:, None]])
        curves = _Curves(self.march, active, self.way)
        ahead = np.zeros_like(y)
        ahead[:, -1] = 1.0
        here, step = curves.at(y, ahead), np.full(len(active), FIRST)
        for _ in range(ARCS):
            going = (here.clear > CROSSING) & (step > SHORTEST) & ~self.settled[active]
            going &= np.isfinite(here.bend).all(axis=1) & (np.abs(here.y).max(axis=1) < 1e3)
            if not going.all():
                here, step, active = here.of(going), step[going], active[going]
                if not active.size:
                    return
                curves = _Curves(self.march, active, self.way)
            bent = np.linalg.norm(here.bend, axis=1)
            step = np.minimum.reduce([step, np.full(len(step), LONGEST), 1.2 * here.clear, 0.8 * BENT / bent])
            ahead = here.y + step[:, None] * here.tangent + 0.5 * step[:, None] ** 2 * here.bend
            y, fine = curves.corrected(ahead, here.tangent)
            after = curves.at(y, here.tangent)
            gone = np.linalg.norm(y - here.y, axis=1)
            fine &= np.sum(after.tangent * here.tangent, axis=1) > np.cos(BENT)
            fine &= (CLOSE * gone < here.clear + after.clear) & (gone < 2.0 * step)
            # an input that may have gone back and on again within the step
            dips = (here.bend[:, -1] < 0.0) & (after.bend[:, -1] > 0.0) & (after.tangent[:, -1] > 0.0)
            low = np.minimum(here.tangent[:, -1], after.tangent[:, -1])
            fine &= ~(dips & (low < gone * np.maximum(np.abs(here.bend[:, -1]), np.abs(after.bend[:, -1]))))
            self._note(active, here, after, fine)
            step = np.where(fine, 1.6 * step, 0.5 * step)
            here = _Points(
                *(
                    np.where(fine.reshape(-1, *[1] * (new.ndim - 1)), new, old)
                    for new, old in zip(after, here, strict=True)
                )
            )

    def _note(self, active: Array, here: _Points, after: _Points, fine: Array) -> None:
        """Keep what was gone through; a design is settled at its dead point, or at its last step."""
        arcs = _Arcs(active, here.y, here.tangent, after.y, after.tangent)
        dead = fine & (after.tangent[:, -1] <= 0.0)
        on = fine & ~dead
        self.settled[active[dead | (on & (after.y[:, -1] >= self.places[-1]))]] = True
        if dead.any():
            self.dead.append(arcs.of(dead))
        if on.any():
            self.arcs.append(arcs.of(on))

    def _root(self, arcs: _Arcs, value) -> tuple[Array, Array]:  # noqa: ANN001
        """Where on each arc a value of its points falls through zero: the points, and which of them surely do."""
        curves, chord = _Curves(self.march, arcs.design, self.way), arcs.y1 - arcs.y0
        a, b = np.zeros(len(chord)), np.ones(len(chord))
        fa, fb = value(curves, arcs.y0), value(curves, arcs.y1)
        fine, y = (fa >= 0.0) & (fb <= 0.0), arcs.y0
        for k in range(HALVINGS):
            x = np.clip((a * fb - b * fa) / (fb - fa), a, b) if k % 3 else 0.5 * (a + b)
            x = np.where(np.isfinite(x), x, 0.5 * (a + b))
            y, found = curves.corrected(arcs.rough(x), chord)
            fine &= found
            f = value(curves, y)
            up = f > 0.0
            a, fa, b, fb = np.where(up, x, a), np.where(up, f, fa), np.where(up, b, x), np.where(up, fb, f)
            if np.all((np.abs(f) < 1e-10) | (b - a < 1e-13) | ~fine):
                break
        return y, fine & (np.abs(value(curves, y)) < 1e-7)

    def _dead_points(self) -> None:
        arcs = _Arcs(*(np.concatenate(parts) for parts in zip(*self.dead, strict=True)))
        y, fine = self._root(arcs, lambda curves, y: curves.at(y, arcs.t0, False).tangent[:, -1])
        self.settled[arcs.design[~fine]] = False
        self.stop[arcs.design] = y[:, -1]
        near = np.abs(self.places[None] - y[:, -1:]).min(axis=1) < AT_END * self.places[-1]
        self.settled[arcs.design[near]] = False
        ahead = arcs.y1 - arcs.y0
        curves = _Curves(self.march, arcs.design, self.way)
        self.arcs.append(arcs._replace(y1=y, t1=curves.at(y, ahead, False).tangent))

    def _told(self) -> Stopped:
        solved = np.where(self.settled, np.searchsorted(self.places, np.minimum(self.stop, 2 * self.places[-1])), 0)
        arcs = [np.concatenate(parts) for parts in zip(*self.arcs, strict=True)] if self.arcs else None
        wide = self.march.rows
        if arcs is None:
            none = np.zeros(0, dtype=int)
            return Stopped(self.settled, solved, none, none, np.zeros((wide, 0)))
        whole = _Arcs(*arcs)
        first, last = (np.searchsorted(self.places, each[:, -1], side="right") for each in (whole.y0, whole.y1))
        first = np.maximum(first, self.good[whole.design])
        count = np.where(self.settled[whole.design], np.maximum(np.minimum(last, self.steps + 1) - first, 0), 0)
        arc = np.repeat(np.arange(len(count)), count)
        step = first[arc] + np.arange(len(arc)) - np.repeat(np.cumsum(count) - count, count)
        out, fine = self._at(whole.of(arc), step)
        design = whole.design[arc]
        self.settled[design[~fine]] = False
        # every step of a design once, no more and no less
        held = np.bincount(design, minlength=self.many)
        self.settled &= held == np.maximum(solved - self.good, 0)
        kept = self.settled[design]
        return Stopped(self.settled, solved, design[kept], step[kept], out[:, kept])

    def _at(self, arcs: _Arcs, step: Array) -> tuple[Array, Array]:
        """The points (rows, steps) where arcs come to steps, and which of them pass the gate."""
        march = self.march
        wide = march.rows
        if not len(step):
            return np.zeros((wide, 0)), np.zeros(0, dtype=bool)
        place = self.places[step]
        y, fine = self._root(arcs, lambda _, y: place - y[:, -1])
        own = march.of(arcs.design, y[:, :-1].T)
        columns = Columns(march.program, own.p)
        u = own.u0 + place * self.way[:, None]
        z = columns.advance(y[:, :-1], u.T)
        fine &= np.max(np.abs(z - y[:, :-1]), axis=1, initial=0.0) < 1e-3
        w = columns.positions(z, u.T)
        branches, closed = Branches(columns, own.p), told_closed(own)
        here = branches.here(z, u.T)
        fine &= (closed.left(w, u) <= march.tolerance) & branches.regular(here)
        out = np.empty((wide, len(step)))
        fine &= Told(own, columns).into(out, Row(z, u, w, fine, here))
        return out, fine
