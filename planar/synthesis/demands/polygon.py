"""How far places are inside a polygon."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array


def polygon_depths(places: Array, corners: Array) -> tuple[Array, Array]:
    """How far places (n, 2) are from the border of a polygon (corners, 2), below zero outside; and in which direction
    (n, 2) that grows the most."""
    first, second = corners, np.roll(corners, -1, axis=0)
    along = second - first
    x, y = places[:, 0, None], places[:, 1, None]
    crosses = (first[:, 1] > y) != (second[:, 1] > y)
    rise = np.where(crosses, along[:, 1], 1.0)
    right = first[:, 0] + (y - first[:, 1]) / rise * along[:, 0]
    is_inside = np.sum(crosses & (x < right), axis=1) % 2 == 1
    share = np.clip(np.sum((places[:, None] - first) * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    off = places[:, None] - first - share[..., None] * along
    distance = np.linalg.norm(off, axis=2)
    distance = np.where(np.isfinite(distance), distance, np.inf)
    nearest = np.argmin(distance, axis=1)
    every = np.arange(len(places))
    least, off, side = distance[every, nearest], off[every, nearest], along[nearest]
    turned = 1.0 if np.sum(first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]) > 0.0 else -1.0
    inward = turned * np.stack([-side[:, 1], side[:, 0]], axis=1) / np.linalg.norm(side, axis=1, keepdims=True)
    sense = np.where(is_inside, 1.0, -1.0)
    apart = least > 1e-9 * np.ptp(corners, axis=0).max()
    ways = np.where(apart[:, None], sense[:, None] * off / np.where(apart, least, 1.0)[:, None], inward)
    return np.where(np.isfinite(places).all(axis=1), sense * least, np.nan), ways
