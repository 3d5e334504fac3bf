"""Plates where their links are in a run, and whether two of them meet, by polygons."""

from math import cos, sin

import numpy as np
from matplotlib.path import Path as Polygon

import planar
from planar.manufacture.plates import Plate, sampled
from planar.results.motion import Motion


def drawn(plate: Plate, motion: Motion, row: int) -> list[np.ndarray]:
    """A plate's outline where its link is in a row of a run, by the places of two of the link's points (mm)."""
    frame = motion.frames[plate.link]
    x, y, angle = (
        np.broadcast_to(getattr(each, "parts", (each,))[0], (len(motion),))[row]
        for each in (frame.x, frame.y, frame.angle)
    )
    start = planar.solve(motion.mechanism).frames[plate.link]
    u, v, first = (float(getattr(each, "parts", (each,))[0]) for each in (start.x, start.y, start.angle))
    points = np.array(sampled(plate.outline)) / 1e3
    c, s = cos(angle - first), sin(angle - first)
    return np.column_stack(
        [x + c * (points[:, 0] - u) - s * (points[:, 1] - v), y + s * (points[:, 0] - u) + c * (points[:, 1] - v)]
    )


def meet(one, other):
    """Whether two polygons meet: a corner of one in the other, or edges that cross."""
    return bool(Polygon(one, closed=False).intersects_path(Polygon(other, closed=False), filled=True))
