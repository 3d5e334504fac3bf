"""Where branches of the motion cross: the point itself, the ways that lead through it, and the curve beside it.

At a change point the slope J (rows, n + 1) of the constraints has k > 1 null vectors N (n + 1, k) and left ones L.
Ways through it are v = N c with L^T F''(v, v) = 0, quadratic equations in c; their second derivatives w follow from
J w + F''(v, v) = 0 and, in the null space, from L^T (F'''(v, v, v) + 3 F''(v, w)) = 0. (A. Mueller, Higher-order
analysis of kinematic singularities of lower pair linkages and serial manipulators, J. Mech. Robotics 10, 2018.)
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.solving.curve import Arc, Curve, Point, fitted

Array = np.ndarray

REFINEMENTS = 12
SETTLED = 1e-13
SINGULAR = 1e-6
"""A singular value below this part of the greatest is zero at a change point, which is found to about 1e-8 at first."""
TRULY = 1e-10
ALIKE = 1e-6
"""Ways that are nearer to one another are one."""
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
    """A change point with the ways through it: points at one place, whose tangents are the ways."""

    y: Array
    ways: tuple[Point, ...]


def nearest(curve: Curve, here: Point) -> Near | None:
    """The point next to this one at which the slope has more than one null vector; None where Newton finds none.

    Gauss and Newton's method for F = 0, J A = 0 with A0^T A = 1: regular wherever branches cross at an angle, and for
    any number of redundant constraints.
    """
    many = len(here.y)
    count = 2
    y = here.y + min(here.clear, 0.1) * here.tangent
    for _ in range(2):
        found = _refined(curve, y, count)
        if found is None or found.null.shape[1] == count:
            return found
        y, count = found.y, min(found.null.shape[1], many)
    return None


def _refined(curve: Curve, y: Array, count: int) -> Near | None:
    size = len(y)
    start = null = np.linalg.svd(curve.slope(y))[2][size - count :].T
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
        step = np.linalg.lstsq(system, -np.concatenate(left), rcond=1e-12)[0]
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


def crossing(curve: Curve, y: Array) -> Crossing | None:
    """A change point with all ways through it; None where third order does not tell them, as where branches touch."""
    u, s, vt = np.linalg.svd(curve.slope(y))
    rank = int(np.sum(s > TRULY * max(s[0], 1.0)))
    null, idle = vt[rank:].T, u[:, rank:]
    whole = curve.whole(y)
    quadratics = []
    for rows in idle.T:
        bends = curve.program.bend_of(whole, rows, curve.p)
        quadratics.append(null.T @ curve.narrowed(curve.narrowed(bends).T) @ null)
    ways = []
    for c in _roots(np.array(quadratics)):
        found = _way(curve, y, null, idle, np.array(quadratics), c, (u, s, vt, rank))
        if found is None:
            return None
        ways.append(found)
    return Crossing(y, tuple(ways))


def _roots(quadratics: Array) -> list[Array]:
    """The directions c, |c| = 1, one of each pair c and -c, in which all quadratic forms (forms, k, k) vanish."""
    size = quadratics.shape[-1]
    scale = np.max(np.abs(quadratics), initial=0.0)
    if scale < SINGULAR:
        return []
    forms = quadratics / scale
    rng = np.random.default_rng(0)
    found: list[Array] = []
    for start in rng.normal(size=(16 * size * size, size)):
        c = start / np.linalg.norm(start)
        for _ in range(40):
            left = np.append(np.einsum("fij,i,j->f", forms, c, c), 0.5 * (c @ c - 1.0))
            slope = np.vstack([2.0 * forms @ c, c])
            step = np.linalg.lstsq(slope, -left, rcond=1e-10)[0]
            c = c + step
            if np.max(np.abs(step)) < 1e-15:
                break
        if np.max(np.abs(np.einsum("fij,i,j->f", forms, c, c))) > 1e-10 or abs(c @ c - 1.0) > 1e-6:
            continue
        if all(min(np.linalg.norm(c - each), np.linalg.norm(c + each)) > ALIKE for each in found):
            found.append(c)
    return found


def _way(
    curve: Curve,
    y: Array,
    null: Array,
    idle: Array,
    quadratics: Array,
    c: Array,
    parts: tuple[Array, Array, Array, int],
) -> Point | None:
    """The way with tangent null c and its second derivative; None where the third order leaves it open."""
    u, s, vt, rank = parts
    v = null @ c
    base = -vt[:rank].T @ ((u[:, :rank].T @ curve.second(y, v)) / s[:rank])
    # of the null space only what is normal to the tangent
    across = np.linalg.svd(c[None])[2][1:].T
    slope = 3.0 * (quadratics @ c) @ across
    wide = curve.widened(v)
    third = curve.program.third(curve.whole(y), wide, curve.widened(base), curve.p)
    if np.linalg.svd(slope, compute_uv=False)[-1] < SINGULAR:
        return None
    e = np.linalg.lstsq(slope, -(idle.T @ third), rcond=None)[0]
    return Point(y, v, base + null @ (across @ e), 0.0)


def lead(curve: Curve, here: Point, crossed: Crossing) -> int | None:
    """Which of the ways through a change point leads from a point beside it; its index."""
    best, way = 0.1, None
    for index, point in enumerate(crossed.ways):
        gone = float(point.tangent @ (crossed.y - here.y))
        if gone * float(point.tangent @ here.tangent) <= 0.0:
            continue
        guess = curve.corrected(point.y - gone * point.tangent + 0.5 * gone**2 * point.bend, point.tangent)
        apart = np.inf if guess is None else float(np.linalg.norm(guess - here.y)) / abs(gone)
        if apart < best:
            best, way = apart, index
    return way


class Beside(NamedTuple):
    """The curve on either side of a change point along one way: the points where the polynomial ends."""

    before: Point
    middle: Point
    after: Point
    half: float
    shape: Array

    def arc(self, before: Point, after: Point) -> Arc:
        """A part of it."""
        return Arc(before, after, self.middle.y, self.middle.tangent, self.half, self.shape, True)


def beside(curve: Curve, way: Point) -> Beside | None:
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
            found = Beside(ends[0], way, ends[1], half, shape)
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
