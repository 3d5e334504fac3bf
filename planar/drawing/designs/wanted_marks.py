"""What a task wants, as marks on paper: places, curves, poses and regions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot

import numpy as np

from planar.drawing.paper.picture import Arrow, Label, Mark, Pen, Polyline, paper_point
from planar.drawing.scheme.link_bodies import RELATIVE_TOLERANCE, convex_hull
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.model.link_shapes import LinkShape
from planar.synthesis.task.synthesis_task import SynthesisTask, WantedFunction, WantedPath, WantedPoses

CROSS = 1.0
"""mm: half of the cross at a place."""
POSE_ARM = 6.0
"""mm of the arrow along a pose's x-axis."""
MAX_NUMBERED = 12
"""Entries that have crosses with their numbers; of more the drawing would be full of them."""
NUMBER_SIZE = 6.5
REGION = "region"
"""What the mark of the region is about in which all is to stay."""


def wanted_places(task: SynthesisTask) -> Array:
    """All places (n, 2) that are wanted of points and links (m)."""
    own = [each.places for each in task.wanted if not isinstance(each, WantedFunction)]
    return np.concatenate([np.empty((0, 2)), *own])


def wanted_outlines(task: SynthesisTask, shapes: Mapping[str, LinkShape]) -> Array:
    """All corners (n, 2) of links in the poses that are wanted of them (m)."""
    found: list[Array] = [np.empty((0, 2))]
    for wanted in task.wanted:
        if isinstance(wanted, WantedPoses) and wanted.link in shapes:
            found += placed_outline(shapes[wanted.link], np.column_stack([wanted.places, wanted.angles]))
    return np.concatenate(found)


def wanted_marks(task: SynthesisTask, per_mm: float) -> Iterator[Mark]:
    """What is wanted, as crosses joined in their order where there is one, and poses as crosses with arrows; the region
    in which all is to stay. `per_mm` (m) is the scale."""
    if task.demands.inside is not None:
        corners = tuple(paper_point(each) for each in task.demands.inside / per_mm)
        yield Polyline(corners, Pen.CONSTRUCTION, REGION, closed=True)
    for wanted in task.wanted:
        if isinstance(wanted, WantedFunction):
            continue
        spots = wanted.places / per_mm
        if isinstance(wanted, WantedPath) and (wanted.in_order or wanted.is_closed):
            points = tuple(map(paper_point, spots))
            yield Polyline(points, Pen.WANTED, f"wanted curve of {wanted.of}", closed=wanted.is_closed)
        if len(spots) > MAX_NUMBERED and isinstance(wanted, WantedPath) and (wanted.in_order or wanted.is_closed):
            continue  # the curve alone: crosses would hide it
        for number, spot in enumerate(spots, start=1):
            about = f"wanted {wanted.of} {number}"
            yield from _cross(spot, about)
            if isinstance(wanted, WantedPoses):
                angle = wanted.angles[number - 1]
                tip = spot + POSE_ARM * np.array([np.cos(angle), np.sin(angle)])
                yield Arrow(paper_point(spot), paper_point(tip), Pen.WANTED, about)
            if len(spots) <= MAX_NUMBERED:
                yield Label(str(number), paper_point(spot), about, NUMBER_SIZE)


def pose_outlines(task: SynthesisTask, shapes: Mapping[str, LinkShape], per_mm: float) -> Iterator[Polyline]:
    """The link at every pose that is wanted of it."""
    for wanted in task.wanted:
        if isinstance(wanted, WantedPoses) and wanted.link in shapes:
            poses = np.column_stack([wanted.places, wanted.angles])
            yield from link_outlines(shapes[wanted.link], poses, per_mm, Pen.WANTED, f"pose of {wanted.link}")


def link_outlines(shape: LinkShape, poses: Array, per_mm: float, pen: Pen, about: str) -> Iterator[Polyline]:
    """The line round a link's points in poses (n, 3): the place of its origin (m) and its angle (rad)."""
    for number, places in enumerate(placed_outline(shape, poses), start=1):
        if len(places) > 1:
            yield Polyline(tuple(map(paper_point, places / per_mm)), pen, f"{about} {number}", closed=len(places) > 2)


def placed_outline(shape: LinkShape, poses: Array) -> Iterator[Array]:
    """The corners (m,) of the line round a link's points in each of its poses (n, 3)."""
    points = [Vector(*paper_point(each)) for each in shape.points.values()]
    reach = max((hypot(*(one - points[0])) for one in points), default=0.0)
    # nothing where they lie on one line
    own: Array = np.array((convex_hull(points, RELATIVE_TOLERANCE * reach) if reach else ()) or points).reshape(-1, 2)
    for x, y, angle in poses:
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        yield (x, y) + own @ turn.T


def _cross(spot: Array, about: str) -> Iterator[Polyline]:
    for step in ((CROSS, CROSS), (CROSS, -CROSS)):
        yield Polyline((paper_point(spot - step), paper_point(spot + step)), Pen.WANTED, about)
