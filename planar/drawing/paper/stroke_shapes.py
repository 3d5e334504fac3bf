"""The shape of strokes on paper: heads of arrows, points along arcs, and the straight pieces that letters keep off."""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, cos, degrees, hypot, pi, radians, sin, sqrt
from typing import NamedTuple

import numpy as np

from planar.drawing.paper.pens import HEAD_LENGTH, HEAD_WIDTH, INK
from planar.drawing.paper.picture import Arrow, Circle, Letter, Line, Mark, Pen, Spot
from planar.foundation.errors import BadInput

SAG = 0.04
"""mm by which a chord may leave its arc where letters are kept off it."""
INSIDE = 0.75
"""The part of a head's length, from the tip, at which the line ends: there the head is wider than any line."""
LIGHT = {Pen.HATCH, Pen.CONSTRUCTION, Pen.POSITION, Pen.LEADER}
"""Pens whose strokes a letter would rather cross than others."""


class Head(NamedTuple):
    """An arrow's head: tip and both barbs, where its line ends, and how wide that line may be (mm)."""

    corners: tuple[Spot, Spot, Spot]
    end: Spot
    line: float


class Pieces(NamedTuple):
    """Straight pieces of strokes: ends (n, 4) as x, y, x, y, half their widths (n,) and how much they matter (n,)."""

    ends: np.ndarray
    half: np.ndarray
    weight: np.ndarray

    def chosen(self, which: np.ndarray) -> Pieces:
        """Those that a mask or indices choose."""
        return Pieces(self.ends[which], self.half[which], self.weight[which])


def check(mark: Line | Arrow | Circle | Letter) -> None:
    """Refuse a mark that has no place on paper. Raises BadInput."""
    if isinstance(mark, Line):
        numbers = [each for spot in mark.spots for each in spot]
    elif isinstance(mark, Arrow):
        numbers = [*mark.tail, *mark.head]
    elif isinstance(mark, Circle):
        numbers = [*mark.centre, mark.radius, mark.start, mark.stop]
    else:
        numbers = [*mark.at, mark.size, mark.away]
    if not np.isfinite(numbers).all():
        raise BadInput("drawing", f"{mark.about or 'a mark'} has no place on paper")


def head(tail: Spot, tip: Spot, room: float) -> Head | None:
    """The head at the tip of a line that comes from the tail and is `room` long (mm), or none where that is zero."""
    x, y = tip[0] - tail[0], tip[1] - tail[1]
    far = hypot(x, y)
    if far < 1e-9 or room < 1e-9:
        return None
    x, y = x / far, y / far
    length = min(HEAD_LENGTH, room / 2.0)
    half = length * HEAD_WIDTH / HEAD_LENGTH / 2.0
    foot = tip[0] - length * x, tip[1] - length * y
    barbs = (foot[0] - half * y, foot[1] + half * x), (foot[0] + half * y, foot[1] - half * x)
    return Head((tip, *barbs), (tip[0] - INSIDE * length * x, tip[1] - INSIDE * length * y), 1.2 * half)


def sweep(circle: Circle) -> float:
    """Degrees, anticlockwise, that an arc goes from its start: 360 for a whole circle, 0 for none."""
    turn = circle.stop - circle.start
    return 360.0 if abs(turn) >= 360.0 - 1e-9 else turn % 360.0


def on(circle: Circle, angle: float) -> Spot:
    """The spot of a circle at an angle (degrees)."""
    at = radians(angle)
    return circle.centre[0] + circle.radius * cos(at), circle.centre[1] + circle.radius * sin(at)


def pointed(circle: Circle) -> tuple[Head, float, float] | None:
    """The head of an arc that ends in one, and the angles (degrees) between which its line is then drawn."""
    turn, radius = sweep(circle), abs(circle.radius)
    room = radius * radians(turn)
    if not circle.pointed or room < 1e-9:
        return None
    back = degrees(min(HEAD_LENGTH, room / 2.0) / radius)
    start, stop = circle.start, circle.start + turn
    if circle.pointed > 0:
        made = head(on(circle, stop - back), on(circle, stop), room)
        stop -= INSIDE * back
    else:
        made = head(on(circle, start + back), on(circle, start), room)
        start += INSIDE * back
    return None if made is None else (made, start, stop)


def along(circle: Circle) -> np.ndarray:
    """Points (n, 2) along a circle or an arc, so close that chords leave it by SAG at the most."""
    radius, turn = abs(circle.radius), radians(sweep(circle))
    step = 2.0 * sqrt(2.0 * SAG / radius) if radius > SAG else pi / 2.0
    angles = radians(circle.start) + np.linspace(0.0, turn, max(2, ceil(turn / min(step, pi / 4.0)) + 1))
    return np.array(circle.centre) + circle.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _chains(mark: Mark) -> list[np.ndarray]:
    """The strokes of a mark as chains of points (n, 2)."""
    if isinstance(mark, Line):
        points = np.array(mark.spots, dtype=float).reshape(-1, 2)
        return [np.concatenate([points, points[:1]]) if mark.closed else points]
    if isinstance(mark, Arrow):
        made = head(mark.tail, mark.head, hypot(mark.head[0] - mark.tail[0], mark.head[1] - mark.tail[1]))
        return [] if made is None else [np.array([mark.tail, mark.head]), np.array([*made.corners, made.corners[0]])]
    if isinstance(mark, Circle):
        tip = pointed(mark)
        return [along(mark), *([] if tip is None else [np.array([*tip[0].corners, tip[0].corners[0]])])]
    return []


def pieces(marks: Iterable[Mark]) -> Pieces:
    """The straight pieces of everything but letters."""
    ends, half, weight = [np.empty((0, 4))], [np.empty(0)], [np.empty(0)]
    for mark in marks:
        for chain in _chains(mark):
            if len(chain) < 2:
                continue
            ends.append(np.concatenate([chain[:-1], chain[1:]], axis=1))
            half.append(np.full(len(chain) - 1, INK[mark.pen].width / 2.0))
            weight.append(np.full(len(chain) - 1, 0.6 if mark.pen in LIGHT else 1.0))
    return Pieces(np.concatenate(ends), np.concatenate(half), np.concatenate(weight))
