"""Curves of homogeneous points as strokes inside a window, each stretch drawn once."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planar.foundation.arrays import Array

POINT_SPACING = 0.15
"""mm between the points of a stroke."""
CELL_SIZE, CELL_EDGE = 0.5, 0.1
"""mm: strokes in one cell, of about one direction, are one; so far from its edge a place is in both cells."""
DIRECTION_SECTORS = 24
RECENT_LENGTH = 5.0
"""mm: what was drawn along a curve less than that ago is not what comes now."""


def clip_homogeneous_curve(homogeneous: Array, low: Array, high: Array) -> tuple[Array, ...]:
    """The pieces (k, 2), inside a window, of the polygon through (x, y, w), (n, 3); it parts where w changes sign."""
    w = homogeneous[:, 2]
    cuts = np.flatnonzero(np.sign(w[1:]) != np.sign(w[:-1])) + 1
    found: list[Array] = []
    for part in np.split(homogeneous, cuts):
        if np.all(part[:, 2] != 0.0) and len(part) > 1:
            found += _clip_polyline(part[:, :2] / part[:, 2:], low, high)
    return tuple(found)


def _clip_polyline(points: Array, low: Array, high: Array) -> Iterator[Array]:
    """The pieces of a polygon inside a window, by the parts of its sides (Liang and Barsky, 1984)."""
    start, way = points[:-1], np.diff(points, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([(low - start) / way, (high - start) / way])
    # a side along an edge of the window is inside it or not, all of it
    along = np.abs(way) < 1e-300
    within = (start >= low) & (start <= high)
    enter = np.where(along, np.where(within, -np.inf, np.inf), ends.min(axis=0)).max(axis=1)
    leave = np.where(along, np.where(within, np.inf, -np.inf), ends.max(axis=0)).min(axis=1)
    enter, leave = np.maximum(enter, 0.0), np.minimum(leave, 1.0)
    piece: list[Array] = []
    for k in np.flatnonzero(enter <= leave):
        if not piece or enter[k] > 0.0 or not np.array_equal(piece[-1], points[k]):
            if len(piece) > 1:
                yield np.array(piece)
            piece = [start[k] + enter[k] * way[k]]
        piece.append(points[k + 1] if leave[k] == 1.0 else start[k] + leave[k] * way[k])
    if len(piece) > 1:
        yield np.array(piece)


def remove_repeated_strokes(pieces: Sequence[Array]) -> tuple[Array, ...]:
    """Pieces (mm) without what runs again where one of them has run before, at even spacing.

    A closed curve is often run through several times, and dashes drawn twice are no dashes.
    """
    seen: dict[tuple[int, int, int], float] = {}
    gone = 0.0
    found: list[Array] = []
    for piece in pieces:
        spots = _thin_points(piece)
        ways = np.diff(spots, axis=0)
        turned = (
            np.floor(np.arctan2(ways[:, 1], ways[:, 0]) / (2.0 * np.pi) * DIRECTION_SECTORS).astype(int)
            % DIRECTION_SECTORS
        )
        middles = (spots[1:] + spots[:-1]) / 2.0
        lengths = np.hypot(*ways.T)
        fresh = []
        for (x, y), direction, length in zip(middles.tolist(), turned.tolist(), lengths.tolist(), strict=True):
            keys = {
                (round((x + a) / CELL_SIZE), round((y + b) / CELL_SIZE))
                for a in (-CELL_EDGE, CELL_EDGE)
                for b in (-CELL_EDGE, CELL_EDGE)
            }
            # a direction at the edge of its sector may be found in the next
            near = [(*key, (direction + by) % DIRECTION_SECTORS) for key in keys for by in (-1, 0, 1)]
            fresh.append(all(gone - seen.get(key, gone) <= RECENT_LENGTH for key in near))
            key = (round(x / CELL_SIZE), round(y / CELL_SIZE), direction)
            seen.setdefault(key, gone)
            gone += length
        found += _fresh_stretches(spots, np.array(fresh))
    return tuple(found)


def _fresh_stretches(points: Array, fresh: Array) -> Iterator[Array]:
    """The stretches of sides that are fresh."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], fresh.astype(int), [0]])))
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        if stop - start > 1 or len(fresh) == 1:
            yield points[start : stop + 1]


def _thin_points(piece: Array) -> Array:
    """A polygon by points about as far apart, its ends among them."""
    sides = np.hypot(*np.diff(piece, axis=0).T)
    length = np.concatenate([[0.0], np.cumsum(sides)])
    kept = np.flatnonzero(np.diff(np.floor(length / POINT_SPACING), prepend=-1.0))
    kept = np.unique(np.append(kept, len(piece) - 1))
    return piece[kept]
