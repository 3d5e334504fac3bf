"""Curves by formula that four-bars do not draw: some wind twice, some have straight sides, some are letters or feet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from benchmarks.synthesis.misses import Array

SIZE = 100.0
"""mm, the greater side of a curve's bounding box."""
MANY = 40
"""Places of a curve at equal ways along it."""
D = ((0, 0), (0.45, 0), (0.7, 0.3), (0.7, 0.7), (0.45, 1), (0, 1))
L = ((0, 0), (0.7, 0), (0.7, 0.3), (0.3, 0.3), (0.3, 1), (0, 1))
S = ((0.6, 0.9), (0.1, 1), (0, 0.6), (0.6, 0.45), (0.6, 0), (0, 0.1))
U = ((0, 1), (0, 0), (0.6, 0), (0.6, 1))


class Shape(NamedTuple):
    """A curve by places (n, 2) in mm, one after the other; closed: back to the first."""

    name: str
    places: Array
    closed: bool


def shapes() -> list[Shape]:
    """All of them."""
    turn = np.linspace(0.0, 2.0 * np.pi, 2000)
    s, c = np.sin(turn), np.cos(turn)
    loop = 1.0 + 2.0 * c
    return [
        shape("figure eight (Gerono)", np.stack([s * c, s], axis=1), True),
        shape("double loop (limacon), winds twice", np.stack([loop * c, loop * s], axis=1), True),
        shape("double circle, winds twice", _double_circle(), True),
        shape("letter D", rounded(D, 0.12, True), True),
        shape("letter L, round it", rounded(L, 0.1, True), True),
        shape("letter S", rounded(S, 0.25, False), False),
        shape("letter U", rounded(U, 0.25, False), False),
        shape("foot: straight step, round return", _foot(), True),
    ]


def shape(name: str, curve: Array, closed: bool, many: int = MANY) -> Shape:
    """A dense curve (m, 2), brought to the size, by so many places at equal ways along it."""
    scaled = (curve - curve[0]) * (SIZE / float(np.ptp(curve, axis=0).max()))
    return Shape(name, np.round(along(scaled, many, closed), 4), closed)


def along(curve: Array, many: int, closed: bool) -> Array:
    """So many places (n, 2) at equal ways along a dense curve (m, 2); of a closed one the first not again."""
    if closed and np.hypot(*(curve[-1] - curve[0])) > 0.0:
        curve = np.concatenate([curve, curve[:1]])
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))])
    at = np.linspace(0.0, way[-1], many, endpoint=not closed)
    return np.stack([np.interp(at, way, curve[:, k]) for k in range(2)], axis=1)


def rounded(corners: Sequence[tuple[float, float]], reach: float, closed: bool) -> Array:
    """A polyline (m, 2) whose corners are replaced by parabolas that begin and end `reach` before and behind them."""
    points = np.array(corners, float)
    many = len(points)
    parts = [] if closed else [points[:1]]
    t = np.linspace(0.0, 1.0, 30)[:, None]
    for k in range(many) if closed else range(1, many - 1):
        before, at, behind = points[k - 1], points[k], points[(k + 1) % many]
        first, last = (at + (end - at) * min(reach / np.hypot(*(end - at)), 0.5) for end in (before, behind))
        parts.append((1 - t) ** 2 * first + 2 * t * (1 - t) * at + t**2 * last)
    return np.concatenate(parts if closed else [*parts, points[-1:]])


def _double_circle() -> Array:
    """Twice round, once wide and once narrow: its radius swells once in two turns."""
    turn = np.linspace(0.0, 4.0 * np.pi, 4000)
    radius = 1.0 + 0.3 * np.cos(turn / 2.0)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def _foot() -> Array:
    """A straight step on the ground and half an ellipse back."""
    turn = np.linspace(0.0, np.pi, 600)
    back = np.stack([np.cos(turn), 0.5 * np.sin(turn)], axis=1)
    return np.concatenate([np.stack([np.linspace(-1.0, 1.0, 600), np.zeros(600)], axis=1), back])
