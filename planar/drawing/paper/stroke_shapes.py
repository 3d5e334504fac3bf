"""The shape of strokes on paper: heads of arrows, points along arcs, and the straight pieces that letters keep off."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import ceil, cos, degrees, hypot, pi, radians, sin, sqrt
from typing import Any, NamedTuple

import numpy as np

from planar.drawing.paper.pens import ARROW_HEAD_LENGTH, ARROW_HEAD_WIDTH, PEN_STYLES
from planar.drawing.paper.picture import Arrow, Circle, Label, Mark, PaperPoint, Pen, Polyline, Stroke
from planar.foundation.errors import BadInput

MAX_CHORD_SAG = 0.04
"""mm by which a chord may leave its arc where letters are kept off it."""
LINE_END_IN_HEAD = 0.75
"""The part of a head's length, from the tip, at which the line ends: there the head is wider than any line."""
LIGHT_PENS = {Pen.HATCH, Pen.CONSTRUCTION, Pen.POSITION, Pen.LEADER}
"""Pens whose strokes a letter would rather cross than others."""


class ArrowHead(NamedTuple):
    """An arrow's head: tip and both barbs, where its line ends, and how wide that line may be (mm)."""

    corners: tuple[PaperPoint, PaperPoint, PaperPoint]
    line_end: PaperPoint
    max_line_width: float


class StrokeSegments(NamedTuple):
    """Straight pieces of strokes: ends (n, 4) as x, y, x, y, half their widths (n,) and how much they matter (n,)."""

    ends: np.ndarray
    half_widths: np.ndarray
    weights: np.ndarray

    def select(self, selection: np.ndarray) -> StrokeSegments:
        """Those that a mask or indices choose."""
        return StrokeSegments(self.ends[selection], self.half_widths[selection], self.weights[selection])


def check_finite(mark: Polyline | Arrow | Circle | Label) -> None:
    """Refuse a mark that has no place on paper. Raises BadInput."""
    if isinstance(mark, Polyline):
        numbers = [each for spot in mark.points for each in spot]
    elif isinstance(mark, Arrow):
        numbers = [*mark.tail, *mark.head]
    elif isinstance(mark, Circle):
        numbers = [*mark.centre, mark.radius, mark.start, mark.stop]
    else:
        numbers = [*mark.at, mark.size, mark.clearance]
    if not np.isfinite(numbers).all():
        raise BadInput("drawing", f"{mark.about or 'a mark'} has no place on paper")


def arrow_head(tail: PaperPoint, tip: PaperPoint, length_available: float) -> ArrowHead | None:
    """The head at the tip of a line that comes from the tail and is so long (mm), or none where that is zero."""
    x, y = tip[0] - tail[0], tip[1] - tail[1]
    far = hypot(x, y)
    if far < 1e-9 or length_available < 1e-9:
        return None
    return head_of_length(tip, (x / far, y / far), head_length(length_available))


def head_length(length_available: Any, mm: Any = 1.0, least: Callable[[Any, Any], Any] = min) -> Any:
    """How long the head of a line is that is so long, where a millimetre of paper has so many units.

    It takes numbers, or symbols with their `least`.
    """
    return least(ARROW_HEAD_LENGTH * mm, length_available / 2.0)


def head_of_length(tip: Sequence[Any], direction: Sequence[Any], length: Any) -> ArrowHead:
    """The head so long at a tip, where its line comes in a unit direction: of numbers, or of symbols."""
    x, y = direction[0], direction[1]
    half = length * ARROW_HEAD_WIDTH / ARROW_HEAD_LENGTH / 2.0
    foot = tip[0] - length * x, tip[1] - length * y
    barbs = (foot[0] - half * y, foot[1] + half * x), (foot[0] + half * y, foot[1] - half * x)
    line_end = tip[0] - LINE_END_IN_HEAD * length * x, tip[1] - LINE_END_IN_HEAD * length * y
    return ArrowHead(((tip[0], tip[1]), *barbs), line_end, 1.2 * half)


def sweep_angle(circle: Circle) -> float:
    """Degrees, anticlockwise, that an arc goes from its start: 360 for a whole circle, 0 for none."""
    turn = circle.stop - circle.start
    return 360.0 if abs(turn) >= 360.0 - 1e-9 else turn % 360.0


def point_on_circle(circle: Circle, angle: float) -> PaperPoint:
    """The spot of a circle at an angle (degrees)."""
    at = radians(angle)
    return circle.centre[0] + circle.radius * cos(at), circle.centre[1] + circle.radius * sin(at)


def arc_arrow_head(circle: Circle) -> tuple[ArrowHead, float, float] | None:
    """The head of an arc that ends in one, and the angles (degrees) between which its line is then drawn."""
    turn, radius = sweep_angle(circle), abs(circle.radius)
    room = radius * radians(turn)
    if not circle.arrow_end or room < 1e-9:
        return None
    back = degrees(head_length(room) / radius)
    start, stop = circle.start, circle.start + turn
    if circle.arrow_end > 0:
        made = arrow_head(point_on_circle(circle, stop - back), point_on_circle(circle, stop), room)
        stop -= LINE_END_IN_HEAD * back
    else:
        made = arrow_head(point_on_circle(circle, start + back), point_on_circle(circle, start), room)
        start += LINE_END_IN_HEAD * back
    return None if made is None else (made, start, stop)


def arc_points(circle: Circle) -> np.ndarray:
    """Points (n, 2) along a circle or an arc, so close that chords leave it by SAG at the most."""
    radius, turn = abs(circle.radius), radians(sweep_angle(circle))
    step = 2.0 * sqrt(2.0 * MAX_CHORD_SAG / radius) if radius > MAX_CHORD_SAG else pi / 2.0
    angles = radians(circle.start) + np.linspace(0.0, turn, max(2, ceil(turn / min(step, pi / 4.0)) + 1))
    return np.array(circle.centre) + circle.radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _polylines(mark: Stroke) -> list[np.ndarray]:
    """The strokes of a mark as chains of points (n, 2)."""
    if isinstance(mark, Polyline):
        points = np.array(mark.points, dtype=float).reshape(-1, 2)
        return [np.concatenate([points, points[:1]]) if mark.closed else points]
    if isinstance(mark, Arrow):
        made = arrow_head(mark.tail, mark.head, hypot(mark.head[0] - mark.tail[0], mark.head[1] - mark.tail[1]))
        return [] if made is None else [np.array([mark.tail, mark.head]), np.array([*made.corners, made.corners[0]])]
    tip = arc_arrow_head(mark)
    return [arc_points(mark), *([] if tip is None else [np.array([*tip[0].corners, tip[0].corners[0]])])]


def stroke_segments(marks: Iterable[Mark]) -> StrokeSegments:
    """The straight pieces of everything but letters."""
    ends, half, weight = [np.empty((0, 4))], [np.empty(0)], [np.empty(0)]
    for mark in marks:
        if isinstance(mark, Label):
            continue
        for chain in _polylines(mark):
            if len(chain) < 2:
                continue
            ends.append(np.concatenate([chain[:-1], chain[1:]], axis=1))
            half.append(np.full(len(chain) - 1, PEN_STYLES[mark.pen].width / 2.0))
            weight.append(np.full(len(chain) - 1, 0.6 if mark.pen in LIGHT_PENS else 1.0))
    return StrokeSegments(np.concatenate(ends), np.concatenate(half), np.concatenate(weight))
