"""Burmester's curves on paper: where a joint may be at the first pose, and its fixed pivot, with the poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planar.drawing.paper.picture import Arrow, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import DRAWING_HEIGHT, DRAWING_WIDTH, Scale, parse_scales, round_scale
from planar.drawing.polygons.panels import ScaleTexts
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.synthesis.exact.complete_synthesis import CompleteSynthesis, DyadCurve
from planar.synthesis.task.synthesis_task import WantedPoses

WINDOW = 2.0
"""Of the extent of the poses: how far from their middle curves are shown."""
AXIS_LENGTH = 0.16
"""Of that extent: the axes that stand for a pose."""
CIRCLE, CENTRE = "circle points", "centre points"


def dyad_pictures(found: CompleteSynthesis, scale: ScaleTexts = None) -> tuple[list[Picture], str]:
    """A picture for each curve of dyads, those that are the same once, and their heading.

    Raises BadInput where there is none."""
    if not isinstance(found, CompleteSynthesis):
        raise BadInput("found", f"a complete list, as of synthesise(..., complete=True), is wanted, not {found!r:.60}")
    known = parse_scales(scale, ["length"], found.task.units).get("length")
    curves = drawn_curves(found)
    if not curves:
        raise BadInput("found", "there is no curve of dyads; four poses of a link leave one, three where it slides")
    return [_picture(found, each, known) for each in curves], f"{found.task.name}: dyads for the poses"


def drawn_curves(found: CompleteSynthesis) -> list[DyadCurve]:
    """The curves that can be drawn, those that are the same once."""
    curves: list[DyadCurve] = []
    for each in found.curves:
        if each.dimension == 1 and not any(_is_same(each, other) for other in curves):
            curves.append(each)
    return curves


def _is_same(one: DyadCurve, other: DyadCurve) -> bool:
    scale = float(np.abs(one.rows).max(initial=0.0))
    return one.rows.shape == other.rows.shape and bool(np.allclose(one.rows, other.rows, rtol=0.0, atol=1e-9 * scale))


def _picture(found: CompleteSynthesis, curve: DyadCurve, scale: Scale | None) -> Picture:
    (poses,) = (each for each in found.task.wanted if isinstance(each, WantedPoses))
    middle = 0.5 * (poses.places.min(axis=0) + poses.places.max(axis=0))
    half = WINDOW * found.size
    scale = scale or round_scale(
        "length", found.task.units.length, 2.0 * half, 2.0 * half, (DRAWING_WIDTH, DRAWING_HEIGHT)
    )
    marks: list[Mark] = []
    for places, pen, about in (
        (curve.centre_points, Pen.FIXED_CENTRODE, CENTRE),
        (curve.circle_points, Pen.MOVING_CENTRODE, CIRCLE),
    ):
        for piece in _pieces(places, middle, half):
            marks.append(Polyline(tuple(paper_point(each / scale.per_mm) for each in piece), pen, about))
    marks += _pose_marks(poses, AXIS_LENGTH * found.size, scale)
    same = [each for each in found.curves if _is_same(each, curve)]
    between = "about" if not curve.has_slide else "on" if len(curve.circle_points) else "through"
    names = " and ".join(f"{each.joint} {between} {each.pivot}" for each in same)
    told = {
        CENTRE: f"Full: {CENTRE}, where the pivot may be fixed.",
        CIRCLE: f"Dashed: {CIRCLE}, where the joint is at pose 1.",
    }
    drawn = [each for each, places in ((CENTRE, curve.centre_points), (CIRCLE, curve.circle_points)) if len(places)]
    slides = [" Through each goes a line of its own, on which it stays."] * curve.has_slide
    notes = (f"Dyads {names}", " ".join(told[each] for each in drawn) + "".join(slides), f"{scale}")
    return Picture(tuple(marks), "", notes)


def _pose_marks(poses: WantedPoses, length: float, scale: Scale) -> Iterator[Mark]:
    for number, (at, angle) in enumerate(zip(poses.places, poses.angles, strict=True), start=1):
        spot = paper_point(at / scale.per_mm)
        for turned in (0.0, 0.5 * np.pi):
            way = np.array([np.cos(angle + turned), np.sin(angle + turned)])
            yield Arrow(spot, paper_point((at + length * way) / scale.per_mm), Pen.VELOCITY, f"pose {number}")
        yield Label(str(number), spot, f"pose {number}")


def _pieces(places: Array, middle: Array, half: float) -> Iterator[Sequence[Array]]:
    """The parts of a polyline that lie in a window."""
    inside = np.all(np.abs(np.nan_to_num(places, nan=np.inf) - middle) <= half, axis=1)
    piece: list[Array] = []
    for place, is_inside in zip(places, inside, strict=True):
        if is_inside:
            piece.append(place)
            continue
        if len(piece) > 1:
            yield piece
        piece = []
    if len(piece) > 1:
        yield piece
