"""What comes near to what while the mechanism runs: plates and pins, at every position of a run."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame, Vector
from planar.foundation.jets import value_and_rates
from planar.manufacture.plates import Place, convex_hull

Rows = Array
"""Places over the positions of a run, (positions, places, 2) in mm."""


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


def least_distance(one: Rows, other: Rows) -> float:
    """The least distance of two convex hulls over the run; 0 where they meet. Points are corners in order."""
    least = min(_corner_distance(one, other), _corner_distance(other, one))
    return 0.0 if least == 0.0 or _edges_cross(one, other) else least


def hull_rows(core: tuple[Place, ...]) -> tuple[Place, ...]:
    """The corners of a plate's core in order."""
    return tuple(convex_hull(core))


def _edges(rows: Rows) -> tuple[Array, Array]:
    """Starts and ways of the edges, (positions, edges, 2); of one point an edge without length."""
    ends = np.roll(rows, -1, axis=1)
    many = rows.shape[1] if rows.shape[1] > 2 else 1
    return rows[:, :many], (ends - rows)[:, :many]


def _corner_distance(corners: Rows, rows: Rows) -> float:
    """The least distance of corners from a hull; 0 where one lies in it."""
    start, way = _edges(rows)
    apart = corners[:, :, None] - start[:, None]
    size = np.maximum((way**2).sum(axis=2), 1e-300)[:, None]
    along = np.clip((apart * way[:, None]).sum(axis=3) / size, 0.0, 1.0)
    least = np.linalg.norm(apart - along[..., None] * way[:, None], axis=3).min()
    if rows.shape[1] > 2:
        left = way[:, None, :, 0] * apart[..., 1] - way[:, None, :, 1] * apart[..., 0]
        if np.any(np.all(left >= 0.0, axis=2)):
            return 0.0
    return float(least)


def _edges_cross(one: Rows, other: Rows) -> bool:
    """Whether an edge of one crosses an edge of the other at any position."""
    (p, r), (q, s) = _edges(one), _edges(other)
    p, r, q, s = p[:, :, None], r[:, :, None], q[:, None], s[:, None]

    def cross(a: Array, b: Array) -> Array:
        return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]

    along, between = cross(r, s), q - p
    with np.errstate(divide="ignore", invalid="ignore"):
        t, u = cross(between, s) / along, cross(between, r) / along
    return bool(np.any((along != 0.0) & (t >= 0.0) & (t <= 1.0) & (u >= 0.0) & (u <= 1.0)))
