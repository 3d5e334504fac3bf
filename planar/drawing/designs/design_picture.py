"""A design as a textbook draws it, over what was wanted of it, with the paths of its points."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from planar.drawing.designs.wanted_marks import (
    MAX_NUMBERED,
    REGION,
    link_outlines,
    pose_outlines,
    wanted_marks,
    wanted_outlines,
    wanted_places,
)
from planar.drawing.diagrams.drawn_run import DrawnRun, closed_run, steady_run
from planar.drawing.diagrams.positions import JOINT_RADIUS, MIN_PATH_STEPS
from planar.drawing.paper.clipping import clip_homogeneous_curve
from planar.drawing.paper.picture import Circle, Fill, Label, Mark, Pen, Picture, Polyline, extent, paper_point
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.scheme import scheme
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.jets import value_and_rates
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.input_grid import motion_over_input
from planar.solving.position import solve
from planar.synthesis.synthesis import SynthesisedDesign
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath
from planar.synthesis.task.wanted_results import carried_name

ROOM = (84.0, 66.0)
"""mm that the strokes of one among many take at the most."""
CLOSEUP_ROOM, CLOSEUP_SHARE, CLOSEUP_MARGIN = (84.0, 50.0), 0.4, 8.0
"""mm of what is wanted, enlarged; drawn where it takes less than this part of a drawing; mm about it."""
CLOSEUP_STEPS = 1440
MAX_LETTERED_POINTS = 12
"""Points: of more a small drawing would be full of letters."""


def design_picture(
    design: SynthesisedDesign, task: SynthesisTask, room: tuple[float, float] = ROOM, title: str = ""
) -> Picture:
    """A design where it stands, over what is wanted; its points' paths, and small circles where its entries are.

    What of it cannot be solved is left out. The drawing is as large as its room takes.
    """
    mechanism = design.mechanism
    try:
        run = closed_run(steady_run(mechanism, steps=MIN_PATH_STEPS))
        state = solve(mechanism)
    except (NoAnswer, BadInput):
        scale = _fitting_scale([wanted_places(task)], mechanism, room)
        return Picture(tuple(wanted_marks(task, scale.per_mm)), title)
    paths = {each.of: _path(run, mechanism, each) for each in task.wanted if not isinstance(each, WantedFunction)}
    places = [np.array([each.position for each in state.points.values()]), wanted_places(task), *paths.values()]
    places.append(wanted_outlines(task, state.shapes))
    scale = _fitting_scale(places, mechanism, room)
    drawn = scheme(state, scale, len(state.points) <= MAX_LETTERED_POINTS, numbers=False, travel=run.slide_ranges)
    strokes = [mark for mark in drawn.marks if not isinstance(mark, Label)]
    letters = [mark for mark in drawn.marks if isinstance(mark, Label) and not mark.about.startswith("input ")]
    below = [*wanted_marks(task, scale.per_mm), *pose_outlines(task, state.shapes, scale.per_mm)]
    numbers = [mark for mark in below if isinstance(mark, Label)]
    marks: list[Mark] = [mark for mark in below if not isinstance(mark, Label)]
    for of, path in paths.items():
        marks.append(Polyline(tuple(map(paper_point, path / scale.per_mm)), Pen.PATH, f"path {of}"))
    marks += _entry_marks(design, task, scale)
    return Picture((*marks, *strokes, *letters, *numbers), title)


def closeup_picture(
    design: SynthesisedDesign, task: SynthesisTask, drawn: Picture, room: tuple[float, float] = CLOSEUP_ROOM
) -> Picture | None:
    """What is wanted with the paths there, enlarged; None where the drawing of the design shows it large enough."""
    wanted = [mark for mark in drawn.marks if isinstance(mark, Polyline) and mark.pen is Pen.WANTED]
    places = wanted_places(task)
    if not wanted or len(places) < 2 or _greatest_side(wanted) > CLOSEUP_SHARE * _greatest_side(drawn.marks):
        return None
    mechanism = design.mechanism
    scale = _fitting_scale([places], mechanism, room)
    marks = [mark for mark in wanted_marks(task, scale.per_mm) if mark.about != REGION]
    try:
        run = closed_run(steady_run(mechanism, steps=CLOSEUP_STEPS))
    except (NoAnswer, BadInput):
        return None
    margin = CLOSEUP_MARGIN * scale.per_mm
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    for each in task.wanted:
        if isinstance(each, WantedFunction):
            continue
        path = _path(run, mechanism, each)
        for piece in clip_homogeneous_curve(np.column_stack([path, np.ones(len(path))]), low, high):
            marks.append(Polyline(tuple(map(paper_point, piece / scale.per_mm)), Pen.PATH, f"path {each.of}"))
    return Picture((*marks, *_entry_marks(design, task, scale, with_links=False)), "Enlarged")


def _greatest_side(marks: Iterable[Mark]) -> float:
    """The longer side of the box about marks (mm)."""
    low, high = extent(marks)
    return max(high[0] - low[0], high[1] - low[1])


def _fitting_scale(places: list[Array], mechanism: Mechanism, room: tuple[float, float]) -> Scale:
    """The scale at which places (n, 2) take a room (mm)."""
    every = np.concatenate([np.empty((0, 2)), *places])
    width, height = np.ptp(every, axis=0) if len(every) else (0.0, 0.0)
    per_mm = max(float(width) / room[0], float(height) / room[1])
    return Scale("length", per_mm or 1e-3, mechanism.units.length)


def _path(run: DrawnRun, mechanism: Mechanism, wanted: Wanted) -> Array:
    """The path (n, 2) of a wanted point, or of the origin of a wanted link (m)."""
    if isinstance(wanted, WantedPath):
        return run.path(carried_name(mechanism, wanted.point))
    return link_poses(run.motion, wanted.of)[:, :2]


def link_poses(motion: Motion, link: str) -> Array:
    """Place and angle (n, 3) of a link over a motion (m, rad)."""
    frame = motion.frames[link]
    parts = (np.asarray(value_and_rates(getattr(frame, part))[0], float) for part in ("x", "y", "angle"))
    found: Array = np.stack([np.broadcast_to(each, (len(motion),)) for each in parts], axis=1)
    return found


def _entry_marks(
    design: SynthesisedDesign, task: SynthesisTask, scale: Scale, with_links: bool = True
) -> Iterator[Mark]:
    """Where the design is at each entry: a circle on its path; of a pose also its link there."""
    for wanted, inputs in zip(task.wanted, design.inputs, strict=True):
        if isinstance(wanted, WantedFunction):
            continue
        try:
            motion = motion_over_input(design.mechanism, inputs)
        except (NoAnswer, BadInput):
            continue  # the design does not come there, as its defects say
        if isinstance(wanted, WantedPath):
            places = motion.point(carried_name(design.mechanism, wanted.point)).position
        else:
            poses = link_poses(motion, wanted.link)
            places = poses[:, :2]
            about = f"link {wanted.link}"
            if with_links:
                yield from link_outlines(motion.shapes[wanted.link], poses, scale.per_mm, Pen.POSITION, about)
        if len(places) > MAX_NUMBERED:
            continue  # circles would hide the curve
        for number, at in enumerate(places / scale.per_mm, start=1):
            about = f"entry {number} of {wanted.of}"
            yield Circle(paper_point(at), JOINT_RADIUS, Pen.PATH, about, Fill.PAPER)
