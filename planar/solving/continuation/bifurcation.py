"""Where branches of the motion cross: the point itself, the ways that lead through it, and the curve beside it.

At a change point the slope J (rows, n + 1) of the constraints has k > 1 null vectors N (n + 1, k) and left ones L.
Ways through it are v = N c with L^T F''(v, v) = 0, quadratic equations in c; their second derivatives w follow from
J w + F''(v, v) = 0 and, in the null space, from L^T (F'''(v, v, v) + 3 F''(v, w)) = 0. (A. Mueller, Higher-order
analysis of kinematic singularities of lower pair linkages and serial manipulators, J. Mech. Robotics 10, 2018.)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.solving.continuation.solution_curve import Arc, Curve, Point, fitted

Array = np.ndarray

REFINEMENTS = 12
SETTLED = 1e-13
FAINT = 0.1
"""A singular value below this part of the greatest may be one that vanishes near by."""
SINGULAR = 1e-6
"""A singular value below this part of the greatest is zero at a change point, which is found to about 1e-8 at first."""
TRULY = 1e-10
CLOSED = 1e-10
"""A quadratic form below this part of the greatest vanishes."""
STARTS = 12
"""Directions for each null vector from which ways are looked for."""
NEARLY = 1e-2
"""A point is on a way if it is no further from it than this part of its distance from the change point."""
ALIKE = 1e-6
"""Ways that are nearer to one another are one."""
ASIDE = 1e-6
"""rad or sizes: so far a position on a change point is from it at most, known to the root of rounding."""
RESTING = 1e-7
"""A rate of the inputs along a way below this is none."""
HALF, LEAST_HALF = 0.02, 1e-4
"""Half the length of the arc that is taken as a polynomial beside a change point, and where it is given up."""
AGREES = 1e-11
"""How well that polynomial must meet the curve between the points that it is laid through."""


class Near(NamedTuple):
    """The point nearest to which the slope has more than one null vector, those (n + 1, k), and what the constraints
    leave open there: nothing but rounding at a change point, more where the curve only comes near one."""

    y: Array
    null: Array
    open: float


class Crossing(NamedTuple):
    """A change point with the ways through it, points at one place whose tangents are the ways: first the one that
    leads from where the walk came.

    `whole` says whether these are all; where ways touch one another, or are many without an end, they are not told.
    `lost` is how much rank the slope lacks.
    """

    y: Array
    ways: tuple[Point, ...]
    whole: bool
    lost: int


def nearest(curve: Curve, here: Point) -> Iterator[Near]:
    """The points next to this one at which the slope has more than one null vector, those that Newton finds.

    Gauss and Newton's method for F = 0, J A = 0 with A0^T A = 1: regular wherever branches cross at an angle, and for
    any number of redundant constraints. Where several loops come near one at once, each is looked for.
    """
    size = len(here.y)
    _, values, rows = np.linalg.svd(curve.slope(here.y))
    for second in range(2, size + 1):
        if second > 2 and values[size - second] > FAINT * max(values[0], 1.0):
            return
        start = rows[[size - second, size - 1]].T
        y = here.y + min(here.clear, 0.1) * here.tangent
        found = _refined(curve, y, start)
        if found is not None and found.null.shape[1] > 2:
            found = _refined(curve, found.y, found.null)
        if found is not None:
            yield found


def _refined(curve: Curve, y: Array, start: Array) -> Near | None:
    """The point next to y at which the slope has null vectors next to these (n + 1, k)."""
    size, count = start.shape
    null = start
    for _ in range(REFINEMENTS):
        slope = curve.slope(y)
        rows = len(slope)
        left = [curve.left(y), *(slope @ null).T, (start.T @ null - np.eye(count)).ravel()]
        system = np.zeros((rows * (1 + count) + count * count, size * (1 + count)))
        system[:rows, :size] = slope
        for k in range(count):
            band = slice(rows * (1 + k), rows * (2 + k))
            system[band, :size] = curve.narrowed(
                curve.program.bend_along(curve.whole(y), curve.widened(null[:, k]), curve.p)
            )
            system[band, size * (1 + k) : size * (2 + k)] = slope
            # entry (j, k) of start^T null
            system[rows * (1 + count) + k :: count, size * (1 + k) : size * (2 + k)] = start.T
        step = _shortest(system, -np.concatenate(left))
        if not np.all(np.isfinite(step)) or np.max(np.abs(step)) > 1.0:
            return None
        y = y + step[:size]
        null = null + step[size:].reshape(count, size).T
        if np.max(np.abs(step[:size])) < SETTLED:
            break
    else:
        return None
    _, s, vt = np.linalg.svd(curve.slope(y))
    rank = int(np.sum(s > SINGULAR * max(s[0], 1.0)))
    if rank > size - 2:
        return None
    return Near(y, vt[rank:].T, float(np.max(np.abs(curve.left(y)), initial=0.0)))


def _shortest(system: Array, known: Array) -> Array:
    """The solution in the sense of least squares; where it is not determined, the shortest."""
    q, r = np.linalg.qr(system)
    diagonal = np.abs(np.diag(r))
    if len(system) >= system.shape[1] and diagonal.min() > 1e-8 * diagonal.max():
        return np.linalg.solve(r, q.T @ known)
    return np.linalg.lstsq(system, known, rcond=1e-12)[0]


class _Ways:
    """The conditions of second and third order for ways through one change point."""

    def __init__(self, curve: Curve, y: Array):
        self.curve, self.y = curve, y
        self.u, self.s, self.vt = np.linalg.svd(curve.slope(y))
        self.rank = int(np.sum(self.s > TRULY * max(self.s[0], 1.0)))
        self.null, self.idle = self.vt[self.rank :].T, self.u[:, self.rank :]
        whole, forms = curve.whole(y), []
        for rows in self.idle.T:
            bends = curve.program.bend_of(whole, rows, curve.p)
            forms.append(self.null.T @ curve.narrowed(curve.narrowed(bends).T) @ self.null)
        self.forms = np.array(forms).reshape(-1, *2 * [self.null.shape[1]])

    def root(self, c: Array) -> Array | None:
        """The direction next to c, |c| = 1, in which all quadratic forms vanish."""
        scale = float(np.max(np.abs(self.forms), initial=0.0))
        if scale < SINGULAR:
            return None
        forms = self.forms / scale
        c = c / np.linalg.norm(c)
        for _ in range(REFINEMENTS):
            left = np.append(np.einsum("fij,i,j->f", forms, c, c), 0.5 * (c @ c - 1.0))
            step = np.linalg.lstsq(np.vstack([2.0 * forms @ c, c]), -left, rcond=1e-10)[0]
            c = c + step
            if np.max(np.abs(step)) < SETTLED:
                break
        met = np.max(np.abs(np.einsum("fij,i,j->f", forms, c, c))) < CLOSED and abs(c @ c - 1.0) < ALIKE
        return c if met else None

    def way(self, c: Array) -> Point | None:
        """The way with tangent null c and its second derivative; None where the third order leaves it open."""
        curve, rank = self.curve, self.rank
        v = self.null @ c
        base = -self.vt[:rank].T @ ((self.u[:, :rank].T @ curve.second(self.y, v)) / self.s[:rank])
        # of the null space only what is normal to the tangent
        across = np.linalg.svd(c[None])[2][1:].T
        slope = 3.0 * (self.forms @ c) @ across
        if np.linalg.svd(slope, compute_uv=False)[-1] < SINGULAR:
            return None
        third = curve.program.third(curve.whole(self.y), curve.widened(v), curve.widened(base), curve.p)
        e = np.linalg.lstsq(slope, -(self.idle.T @ third), rcond=None)[0]
        return Point(self.y, v, base + self.null @ (across @ e), 0.0)


def crossing(curve: Curve, here: Point, y: Array) -> Crossing | None:
    """A change point with the ways through it, if one of them leads from a point beside it."""
    ways = _Ways(curve, y)
    first = ways.root(ways.null.T @ (y - here.y))
    came = None if first is None else ways.way(first)
    if first is None or came is None or not _leads(curve, here, came):
        return None
    found = _directions(ways, [first])
    others = [ways.way(c) for c in found[1:]]
    told = tuple(way for way in others if way is not None)
    return Crossing(y, (came, *told), len(told) == len(others), len(first) - 1)


def starting(curve: Curve, y: Array) -> Crossing | None:
    """The change point on which a position lies to rounding, with all ways on which the inputs move.

    First those on which the unknowns move least for the inputs, whichever way these go; None where the position is no
    such point.
    """
    size = len(y)
    start = np.linalg.svd(curve.slope(y))[2][size - 2 :].T
    near = _refined(curve, y, start)
    if near is not None and near.null.shape[1] > 2:
        near = _refined(curve, near.y, near.null)
    if near is None or np.linalg.norm(near.y - y) > ASIDE or near.open > curve.solver.tolerance:
        return None
    ways = _Ways(curve, near.y)
    found = _directions(ways, [])
    told = [way for way in map(ways.way, found) if way is not None]
    moving = [way if way.advance > 0.0 else way.turned() for way in told if abs(way.advance) > RESTING]
    if not moving:
        return None
    # as the inputs' own way goes, so that both ways from here count alike
    sense = np.sign(curve.way[np.argmax(np.abs(curve.way))])
    rates = [tuple(np.round(sense * way.tangent[:-1] / way.advance, 6)) for way in moving]
    order = sorted(range(len(moving)), key=lambda k: (round(float(np.linalg.norm(rates[k])), 6), rates[k]))
    return Crossing(near.y, tuple(moving[k] for k in order), len(told) == len(found), near.null.shape[1] - 1)


def _directions(ways: _Ways, found: list[Array]) -> list[Array]:
    """The directions in which the conditions of second order are met, beside those found already."""
    size = ways.null.shape[1]
    for start in np.random.default_rng(0).normal(size=(STARTS * size, size)):
        c = ways.root(start)
        if c is not None and all(min(np.linalg.norm(c - a), np.linalg.norm(c + a)) > ALIKE for a in found):
            found.append(c)
    return found


def _leads(curve: Curve, here: Point, way: Point) -> bool:
    """Whether a way through a change point leads to a point beside it."""
    gone = float(way.tangent @ (way.y - here.y))
    if gone * float(way.tangent @ here.tangent) <= 0.0:
        return False
    guess = curve.corrected(way.y - gone * way.tangent + 0.5 * gone**2 * way.bend, way.tangent)
    return guess is not None and float(np.linalg.norm(guess - here.y)) < NEARLY * abs(gone)


class Beside(NamedTuple):
    """The curve on either side of a change point along one way: the points where the polynomial ends."""

    before: Point
    middle: Point
    after: Point
    half: float
    shape: Array
    lost: int

    def arc(self, before: Point, after: Point) -> Arc:
        """A part of it."""
        return Arc(before, after, self.middle.y, self.middle.tangent, self.half, self.shape, self.lost)


def beside(curve: Curve, way: Point, lost: int) -> Beside | None:
    """The polynomial of eighth degree through a change point and a point on each side, along one way through it.

    Its error falls with the ninth power of its length; so far that rounding is all that is left.
    """
    half = min(HALF, 0.1 / max(float(np.linalg.norm(way.bend)), 1e-300))
    while half > LEAST_HALF:
        ends = []
        for x in (-half, half):
            y = curve.corrected(way.y + x * way.tangent + 0.5 * x**2 * way.bend, way.tangent)
            ends.append(None if y is None else curve.at(y, way.tangent))
        if all(end is not None and end.tangent @ way.tangent > 0.9 for end in ends):
            shape = fitted((ends[0], way, ends[1]), way.tangent, (-1.0, 0.0, 1.0), half)
            found = Beside(ends[0], way, ends[1], half, shape, lost)
            if _agrees(curve, found):
                return found
        half *= 0.5
    return None


def _agrees(curve: Curve, found: Beside) -> bool:
    arc = found.arc(found.before, found.after)
    for x in (-0.5 * found.half, 0.5 * found.half):
        rough = arc.rough(x)
        exact = curve.corrected(rough, arc.axis)
        if exact is None or np.max(np.abs(exact - rough)) > AGREES:
            return False
    return True
