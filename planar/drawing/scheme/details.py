"""Parts of a scheme in which symbols lie upon each other, drawn once more beside it and larger."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot

import numpy as np

from planar.drawing.labels.placement import SAME_POINT_TOLERANCE
from planar.drawing.paper.boxes import nearby_points
from planar.drawing.paper.picture import Label, Mark, PaperPoint, Pen, Picture, Polyline, extent, paper_point
from planar.drawing.paper.scales import Scale, round_scale
from planar.drawing.scheme import symbol_table
from planar.drawing.scheme.link_bodies import all_marks
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import CROWDED_PIN_DISTANCE, scheme, scheme_scale
from planar.foundation.geometry import Vector
from planar.model.mechanism import named_points
from planar.model.pairs.symbols import PinMark, SliderMark
from planar.model.wording import join_all_names
from planar.results.motion import State

APART = 24.0
"""mm: the two nearest points of a detail are at the most so far apart, and four tenths of it at the least."""
LARGEST = 50.0
"""How much larger than the usual scheme a detail may be."""
AROUND = 14.0
"""mm of the scheme about the points of a detail."""
MOST = 3
"""Details of a drawing, the most crowded ones."""
PART = 0.5
"""Of the mechanism that a detail may show: a larger one would be the drawing again."""


def scheme_with_details(state: State, scale: Scale | None = None) -> list[Picture]:
    """The scheme of a position, and each part of it that is crowded at its scale, framed there, at a larger one.

    Crowded are points whose pins or blocks lie upon each other. Raises BadInput for a scale that is none.
    """
    usual = scheme_scale(state)
    chosen = scale or usual
    whole = scheme(state, chosen)
    points = _symbols(state)
    most = PART * max(
        (max(each) - min(each) for each in zip(*(at for at, _ in points.values()), strict=True)), default=0.0
    )
    frames: list[Mark] = []
    pictures: list[Picture] = []
    for names, places, nearest in _clusters(points, chosen):
        apart = min(APART, LARGEST * usual.on_paper(nearest))
        larger = round_scale("length", state.mechanism.units.length, nearest, nearest, (apart, apart))
        by = chosen.per_mm / larger.per_mm
        window = _window(places, larger.per_mm)
        wide = max(b - a for a, b in zip(*window, strict=True)) * larger.per_mm
        if by <= 1.0 or wide > most or len(pictures) == MOST:
            continue
        title = f"Detail: {join_all_names(names)}"
        (left, low_), (right, up) = (paper_point(Vector(*corner) * (1.0 / by)) for corner in window)
        frames.append(Polyline(((left, low_), (right, low_), (right, up), (left, up)), Pen.CIRCLE, title, closed=True))
        marks = tuple(mark for mark in scheme(state, larger).marks if _meets(mark, window))
        pictures.append(Picture(marks, title, (str(larger),), window))
    return [whole._replace(marks=(*whole.marks, *frames)), *pictures]


def _symbols(state: State) -> dict[str, tuple[Vector, float]]:
    """The place (m) of every pin and block by its point's name, and how far its symbol reaches (mm)."""
    frames, found = plain_frames(state.frames), {}
    marks = all_marks(state.mechanism, state.shapes)
    pins = {mark.name for mark in marks if isinstance(mark, PinMark)}
    blocks = {mark.name for mark in marks if isinstance(mark, SliderMark)}
    riders = {on[0] for pair in state.mechanism.pairs if pair.name in blocks and (on := pair.point_on_line())}
    for each in named_points(state.mechanism):
        block = not riders.isdisjoint(each.members)
        if block or each.name in pins:
            link, point = each.members[0]
            reach = hypot(*symbol_table.BLOCK_SIZE) / 2.0 if block else CROWDED_PIN_DISTANCE / 2.0
            found[each.name] = frames[link].to_world(state.shapes[link].position(point)), reach
    return found


def _clusters(
    points: Mapping[str, tuple[Vector, float]], scale: Scale
) -> Iterator[tuple[list[str], list[Vector], float]]:
    """Points whose symbols lie upon each other: their names, their places (m), and how far the nearest two are (m)."""
    names_of, places_of = list(points), [place for place, _ in points.values()]
    at = np.array([(place.x, place.y) for place in places_of]).reshape(-1, 2) / scale.per_mm
    near: dict[tuple[str, str], float] = {}
    for one, other in nearby_points(at, np.array([reach for _, reach in points.values()])).tolist():
        apart = hypot(*(places_of[one] - places_of[other]))
        if scale.on_paper(apart) > SAME_POINT_TOLERANCE:
            near[names_of[one], names_of[other]] = apart
    left = set(near)
    for first in sorted(near, key=lambda pair: near[pair]):
        if first not in left:
            continue
        group = set(first)
        while more := {pair for pair in left if not group.isdisjoint(pair)}:
            group.update(*more)
            left -= more
        names = [name for name in points if name in group]
        yield names, [points[name][0] for name in names], near[first]


def _window(places: list[Vector], per_mm: float) -> tuple[PaperPoint, PaperPoint]:
    """The corners of what is shown of a scheme with so many metres to a millimetre."""
    xs, ys = zip(*places, strict=True)
    return (
        (min(xs) / per_mm - AROUND, min(ys) / per_mm - AROUND),
        (max(xs) / per_mm + AROUND, max(ys) / per_mm + AROUND),
    )


def _meets(mark: Mark, window: tuple[PaperPoint, PaperPoint]) -> bool:
    """Whether a mark is to be seen in a window; letters by their spots, rates of inputs only in the whole drawing."""
    if isinstance(mark, Label) and mark.about.startswith("input "):
        return False
    (left, low), (right, up) = window
    (a, b), (c, d) = extent([mark])
    return a <= right and c >= left and b <= up and d >= low
