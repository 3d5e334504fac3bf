"""Boxes of letters on paper: how strokes cut them, how they meet, and where they stand about a spot."""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np


class Box(NamedTuple):
    """An upright rectangle on paper (mm)."""

    left: float
    bottom: float
    right: float
    top: float


def surrounding_positions(width: float, height: float, distance: float) -> tuple[np.ndarray, np.ndarray]:
    """Middles of a box so far from the origin all around (n, 2), and the directions it lies in (n, 2)."""
    half = np.array([width, height]) / 2.0
    count = int(np.clip(ceil(distance), 3, 11))
    angles = np.arange(1, count + 1) * (np.pi / 2.0) / (count + 1)
    corner = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    across = np.linspace(-1.0, 1.0, int(np.clip(2 * ceil(width / 3.0) + 1, 3, 9)))
    upright = np.array([-1.0, 0.0, 1.0])
    ways, middles = [], []
    for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        way = corner * (sx, sy)
        ways.append(way)
        middles.append(distance * way + half * (sx, sy))
    for side in (1.0, -1.0):
        ways += [np.tile([0.0, side], (len(across), 1)), np.tile([side, 0.0], (3, 1))]
        middles.append(np.stack([across * half[0], np.full(len(across), side * (distance + half[1]))], axis=1))
        middles.append(np.stack([np.full(3, side * (distance + half[0])), upright * half[1]], axis=1))
    return np.concatenate(middles), np.concatenate(ways)


def lengths_inside_boxes(boxes: np.ndarray, segments: np.ndarray, padding: np.ndarray | float) -> np.ndarray:
    """The length of pieces (..., 4) inside boxes (..., 4) grown by `pad`, -1 where they stay outside.

    A piece is cut by the two strips of a box (Liang and Barsky, 1984).
    """
    enter, leave, square = np.array(0.0), np.array(1.0), np.array(0.0)
    for axis in (0, 1):
        start, way = segments[..., axis], segments[..., axis + 2] - segments[..., axis]
        steep = 1.0 / np.where(np.abs(way) < 1e-9, 1e-9, way)
        one = (boxes[..., axis] - (padding + start)) * steep
        other = (boxes[..., axis + 2] + (padding - start)) * steep
        enter = np.maximum(enter, np.minimum(one, other))
        leave = np.minimum(leave, np.maximum(one, other))
        square = square + way**2
    part = leave - enter
    return np.where(part >= 0.0, part * np.sqrt(square), -1.0)


def are_crossing(lines: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """Whether lines (..., 4) cross pieces (..., 4); NaN crosses nothing, nor does what only touches."""

    def side(of: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (of[..., 2] - of[..., 0]) * (y - of[..., 1]) - (of[..., 3] - of[..., 1]) * (x - of[..., 0])

    parted = side(lines, segments[..., 0], segments[..., 1]) * side(lines, segments[..., 2], segments[..., 3]) < 0.0
    return parted & (side(segments, lines[..., 0], lines[..., 1]) * side(segments, lines[..., 2], lines[..., 3]) < 0.0)


def bounding_boxes(segments: np.ndarray) -> np.ndarray:
    """The upright boxes (n, 4) around pieces (n, 4)."""
    return np.concatenate(
        [np.minimum(segments[:, :2], segments[:, 2:]), np.maximum(segments[:, :2], segments[:, 2:])], axis=1
    )


def nearby_pairs(boxes: np.ndarray, others: np.ndarray, gap: float) -> tuple[np.ndarray, np.ndarray]:
    """The pairs (i, j) of boxes (n, 4) and others (m, 4) that are no farther apart than a gap along both axes."""
    apart = boxes[:, None, 0] > others[:, 2] + gap
    apart |= boxes[:, None, 2] < others[:, 0] - gap
    apart |= boxes[:, None, 1] > others[:, 3] + gap
    apart |= boxes[:, None, 3] < others[:, 1] - gap
    box, other = np.nonzero(~apart)
    return box, other


def nearby_points(points: np.ndarray, reach: np.ndarray | float) -> np.ndarray:
    """The pairs (pairs, 2) of points (n, 2) that are nearer to each other than the sum of their reaches (n,)."""
    far = np.broadcast_to(reach, len(points))
    boxes = np.concatenate([points, points], axis=1)
    one, other = nearby_pairs(boxes, boxes, 2.0 * float(np.max(far, initial=0.0)))
    later = one < other
    one, other = one[later], other[later]
    near = np.hypot(*(points[one] - points[other]).T) < far[one] + far[other]
    return np.stack([one[near], other[near]], axis=1)


def overlap_depths(boxes: np.ndarray, others: np.ndarray, gap: float) -> np.ndarray:
    """How deep boxes (n, 4) reach into others (m, 4) grown by a gap (mm), as (n, m); 0 where they stay apart."""
    deep = np.inf
    for axis in (0, 1):
        end = np.minimum(boxes[:, None, axis + 2], others[:, axis + 2])
        deep = np.minimum(deep, end - np.maximum(boxes[:, None, axis], others[:, axis]))
    return np.maximum(deep + gap, 0.0)


def distances_from_boxes(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """From boxes (n, 4) to spots (m, 2), as (n, m)."""
    out = np.maximum(boxes[:, None, :2] - points, points - boxes[:, None, 2:])
    return np.linalg.norm(np.maximum(out, 0.0), axis=2)
