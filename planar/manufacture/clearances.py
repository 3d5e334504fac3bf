"""What comes near to what while the mechanism runs: plates and pins, at positions of a run and between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import value_and_rates
from planar.foundation.time_limit import MORE_TIME, stop_if_over
from planar.manufacture.plates import Place, convex_hull

Rows = Array
"""Places over the positions of a run, (positions, places, 2) in mm."""
PlacesOf = Callable[[str, tuple[Place, ...], int], Rows]
"""Where points of a link (mm where it was drawn) are over the run with 2^level times as many steps."""
LEVELS = 7
"""Runs that are tried, each with twice as many steps as the one before."""
BLOCK = 512
"""Positions at which distances are taken at a time."""
SAFETY = 4.0
"""Of the sagitta of a way between positions, as found from those beside it: 3.4 is what it takes from a dead point on,
where a way goes by the square root of the input's."""


class Body(NamedTuple):
    """What moves with a link: the corners of a convex hull in order, or a point."""

    link: str
    corners: tuple[Place, ...]


def body_of(link: str, points: tuple[Place, ...]) -> Body:
    """The convex hull of points of a link."""
    return Body(link, tuple(convex_hull(points)))


def keep_apart(one: Body, other: Body, room: float, places: PlacesOf) -> bool:
    """Whether two bodies are at least so far apart (mm) all over a run, between its positions too.

    Seen from the other body, a corner is between two positions taken to be no further from its chord than four times
    its sagitta there, as the second differences of the positions beside tell it: so the distance is no less than what
    a line between the bodies leaves at both positions, less that. Where this does not settle it the run is taken with
    twice as many steps; bodies that are nearer than the last can tell count as meeting.
    """
    still = np.array(other.corners, dtype=float)[None]
    for level in range(LEVELS):
        stop_if_over("while the clearances of plates and pins were checked", f"{MORE_TIME}, or ask for fewer steps")
        rows = _seen_from(one, other, places, level)
        blocks = np.array_split(rows, -(-len(rows) // BLOCK))
        ways = np.concatenate([ways_apart(block, still) for block in blocks])
        if np.linalg.norm(ways, axis=1).min() < room:
            return False
        if len(rows) > 2 and _least_between(rows, still, ways) >= room:
            return True
    return False


def _least_between(rows: Rows, still: Rows, ways: Array) -> float:
    """A lower bound of the distance between positions: the widest strip across one of the ways from body to body."""
    units = ways / np.linalg.norm(ways, axis=1, keepdims=True)
    between = units[:-1] + units[1:]
    between /= np.maximum(np.linalg.norm(between, axis=1, keepdims=True), 1e-300)
    widths = []
    for unit in (units[:-1], units[1:], between):
        near = np.minimum(*((each * unit[:, None]).sum(axis=2).min(axis=1) for each in (rows[:-1], rows[1:])))
        widths.append(near - (still * unit[:, None]).sum(axis=2).max(axis=1))
    bends = np.linalg.norm(np.diff(rows, n=2, axis=0), axis=2).max(axis=1) / 8.0
    padded = np.concatenate([bends[:1], bends, bends[-1:]])
    return float((np.max(widths, axis=0) - SAFETY * np.maximum(padded[:-1], padded[1:])).min())


def _seen_from(one: Body, other: Body, places: PlacesOf, level: int) -> Rows:
    """The corners of a body in the axes of the other's link."""
    rows = places(one.link, one.corners, level)
    axes = places(other.link, ((0.0, 0.0), (1.0, 0.0)), level)
    off, (c, s) = rows - axes[:, :1], np.moveaxis(axes[:, 1] - axes[:, 0], 1, 0)[:, :, None]
    return np.stack([c * off[..., 0] + s * off[..., 1], c * off[..., 1] - s * off[..., 0]], axis=2)


def places_over(points: tuple[Place, ...], drawn: Frame, frame: Frame, millimetre: float, positions: int) -> Rows:
    """Points of a link (mm where it was drawn) at every position of a run, mm; `millimetre` is one in m, scaled."""
    x, y, c, s = (
        np.broadcast_to(value_and_rates(each)[0], (positions,)) for each in (frame.x, frame.y, frame.cos, frame.sin)
    )
    found = np.empty((positions, len(points), 2))
    for number, (u, v) in enumerate(points):
        own = drawn.to_local(Vector(u * millimetre, v * millimetre))
        found[:, number, 0] = (x + c * own.x - s * own.y) / millimetre
        found[:, number, 1] = (y + s * own.x + c * own.y) / millimetre
    return found


def ways_apart(one: Rows, other: Rows) -> Array:
    """The shortest way from the other of two convex hulls to the first at every position, (positions, 2).

    It is zero where they meet. Points are corners in order.
    """
    there, back = _ways_to_corners(one, other), -_ways_to_corners(other, one)
    nearer = np.linalg.norm(there, axis=1) <= np.linalg.norm(back, axis=1)
    ways = np.where(nearer[:, None], there, back)
    return np.asarray(np.where(_edges_cross(one, other)[:, None], 0.0, ways))


def _edges(rows: Rows) -> tuple[Array, Array]:
    """Starts and ways of the edges, (positions, edges, 2); of one point an edge without length."""
    ends = np.roll(rows, -1, axis=1)
    many = rows.shape[1] if rows.shape[1] > 2 else 1
    return rows[:, :many], (ends - rows)[:, :many]


def _ways_to_corners(corners: Rows, rows: Rows) -> Array:
    """The way from a hull to the nearest corner at every position; zero where one lies in it."""
    start, way = _edges(rows)
    apart = corners[:, :, None] - start[:, None]
    size = np.maximum((way**2).sum(axis=2), 1e-300)[:, None]
    along = np.clip((apart * way[:, None]).sum(axis=3) / size, 0.0, 1.0)
    off = apart - along[..., None] * way[:, None]
    every = off.reshape(len(off), -1, 2)
    nearest = np.linalg.norm(every, axis=2).argmin(axis=1)
    found: Array = every[np.arange(len(every)), nearest]
    if rows.shape[1] > 2:
        left = way[:, None, :, 0] * apart[..., 1] - way[:, None, :, 1] * apart[..., 0]
        inside = np.all(left >= 0.0, axis=2).any(axis=1)
        return np.asarray(np.where(inside[:, None], 0.0, found))
    return found


def _edges_cross(one: Rows, other: Rows) -> Array:
    """Whether an edge of one crosses an edge of the other, at every position."""
    (p, r), (q, s) = _edges(one), _edges(other)
    p, r, q, s = p[:, :, None], r[:, :, None], q[:, None], s[:, None]

    def cross(a: Array, b: Array) -> Array:
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    along, between = cross(r, s), q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t, u = cross(between, s) / along, cross(between, r) / along
    hits = (along != 0.0) & (t >= 0.0) & (t <= 1.0) & (u >= 0.0) & (u <= 1.0)
    return np.asarray(hits.any(axis=(1, 2)))
