"""Cognates on paper: up to three in one picture with the path that they share, as S. Roberts drew them, else each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, combinations

import numpy as np

from planar.drawing.diagrams.drawn_run import closed_run, steady_run
from planar.drawing.diagrams.positions import MIN_PATH_STEPS
from planar.drawing.paper.picture import Fill, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import DRAWING_HEIGHT, DRAWING_WIDTH, Scale, round_scale
from planar.drawing.scheme.ground import fixed_marks
from planar.drawing.scheme.link_bodies import link_bodies
from planar.drawing.scheme.link_strokes import moving_marks
from planar.drawing.scheme.scene import Scene, plain_frames
from planar.drawing.scheme.scheme import point_labels
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame
from planar.model.link_shapes import LinkShape
from planar.results.motion import State
from planar.solving.position import solve
from planar.synthesis.cognates.cognates import Cognate, Cognates

MAX_TOGETHER = 3
"""Linkages that are drawn in one picture; of more each has its own."""
MAX_PICTURES = 12
TOGETHER_PENS = (Pen.LINK, Pen.FIRST_COGNATE, Pen.SECOND_COGNATE)
PEN_WORDS = ("Black", "Blue", "Orange, dashed")
SMALL_DRAWING = 80.0, 60.0
"""mm that each of many may take."""
SAME_SPOT = 0.05
"""mm: letters nearer than this are one."""


def cognate_pictures(found: Cognates, scale: Scale | None = None) -> list[Picture]:
    """The mechanism and its cognates where it stands, with the path of the point."""
    shown = found[:MAX_PICTURES]
    states = [solve(each.mechanism) for each in shown]
    if len(found) > MAX_TOGETHER:
        scale = scale or _fitting_scale(found, states, SMALL_DRAWING)
        return [_single_picture(found, k, state, scale) for k, state in enumerate(states)]
    scale = scale or _fitting_scale(found, states, (DRAWING_WIDTH, DRAWING_HEIGHT))
    marks: list[Mark] = [_path_stroke(found, scale), *_pivot_triangle(found, states, scale)]
    scenes = [_scene(state, scale) for state in states]
    links = [[*map(_without_plate, moving_marks(*each))] for each in zip(scenes, TOGETHER_PENS, strict=False)]
    supports = set[str]()
    for scene in scenes:
        ground = [mark for mark in fixed_marks(scene, chain(*links)) if mark.about not in supports]
        supports |= {mark.about for mark in ground if mark.about.startswith("ground ")}
        marks += ground
    marks += chain(*links[::-1])
    letters: list[Label] = []
    for scene in scenes:
        for label in point_labels(scene):
            if not any(label.text == each.text and _distance(label, each) < SAME_SPOT for each in letters):
                letters.append(label)
    notes = [
        f"{word}: {f'cognate {number}' if number else 'the mechanism itself'}, {_driven(each, number)}"
        for number, (word, each) in enumerate(zip(PEN_WORDS, found, strict=False))
    ]
    return [Picture((*marks, *letters), "", (*notes, f"Space diagram, {scale}"))]


def _single_picture(found: Cognates, number: int, state: State, scale: Scale) -> Picture:
    scene = _scene(state, scale)
    marks = (_path_stroke(found, scale), *fixed_marks(scene), *moving_marks(scene), *point_labels(scene, 7.0))
    cognate = found[number]
    title = "The mechanism itself" if number == 0 else f"Cognate {number}"
    left = len(found) - MAX_PICTURES
    more = (f"{left} more are not drawn",) if number == 0 and left > 0 else ()
    return Picture(
        marks, title, (_driven(cognate, number), *more, *((f"Space diagram, {scale}",) if number == 0 else ()))
    )


def _scene(state: State, scale: Scale) -> Scene:
    bodies = link_bodies(state.mechanism, state.shapes)
    frames: Mapping[str, Frame] = plain_frames(state.frames)
    shapes: Mapping[str, LinkShape] = state.shapes
    return Scene(state.mechanism, bodies, frames, shapes, scale)


def _fitting_scale(found: Cognates, states: Sequence[State], room: tuple[float, float]) -> Scale:
    places = np.concatenate([found.path, *(_places(state) for state in states)])
    width, height = map(float, np.ptp(places, axis=0))
    return round_scale("length", found.mechanism.units.length, width, height, room)


def _places(state: State) -> Array:
    return np.array([each.position for each in state.points.values()])


def _path_stroke(found: Cognates, scale: Scale) -> Polyline:
    run = closed_run(steady_run(found.mechanism, steps=MIN_PATH_STEPS))
    spots = tuple(paper_point(each) for each in run.path(found.point) / scale.per_mm)
    return Polyline(spots, Pen.PATH, f"path of {found.point}")


def _pivot_triangle(found: Cognates, states: Sequence[State], scale: Scale) -> Iterator[Polyline]:
    """The sides between the fixed pivots, where these are three: alike to the coupler with its point."""
    places: list[Array] = []
    for state in states:
        fixed = {link.name: link for link in state.mechanism.links}[state.mechanism.frame]
        pinned = {own for pair in state.mechanism.pairs for link, own in pair.coincident_points() if link == fixed.name}
        for name in fixed.names:
            at = state.point(f"{fixed.name}.{name}").position
            if name in pinned and not any(np.hypot(*(at - each)) < SAME_SPOT * scale.per_mm for each in places):
                places.append(at)
    if len(places) == 3 and len(found) == 3:
        for one, other in combinations(places, 2):
            ends = paper_point(one / scale.per_mm), paper_point(other / scale.per_mm)
            yield Polyline(ends, Pen.CONSTRUCTION, "between pivots")


def _without_plate(mark: Mark) -> Mark:
    """A link as its outline, so that it hides no other."""
    return mark._replace(fill=Fill.NONE) if isinstance(mark, Polyline) and mark.fill is Fill.LINK else mark


def _distance(one: Label, other: Label) -> float:
    return float(np.hypot(one.at[0] - other.at[0], one.at[1] - other.at[1]))


def _driven(cognate: Cognate, number: int) -> str:
    timing = ("", ", with the same timing" if cognate.is_timed else ", with another timing")[number > 0]
    return f"driven at {', '.join(each.driven for each in cognate.inputs)}{timing}"
