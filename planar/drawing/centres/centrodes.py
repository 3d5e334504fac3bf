"""The scheme of a position with fixed and moving centrode of two links, which touch in their pole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from numbers import Integral
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.centrodes import Centrodes, centre_name, centrodes, usual_links
from planar.analysis.centres.curvature import curvature
from planar.drawing.diagrams.drawn_run import DrawnRun, closed_run, steady_run
from planar.drawing.labels.text_metrics import format_tick
from planar.drawing.paper.clipping import clip_homogeneous_curve, remove_repeated_strokes
from planar.drawing.paper.picture import Circle, Fill, Label, Mark, Pen, Picture, Polyline, extent, paper_point
from planar.drawing.paper.scales import DECIMAL_STEPS, DEGREE_STEPS, Scale, round_scale, round_step
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme, space_scale
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Unknown
from planar.foundation.geometry import Vector
from planar.model.file_units import unit_of_kind
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.model.wording import amount
from planar.results.motion import Motion, State
from planar.solving.cycle import cycle
from planar.solving.position import solve

MIN_WINDOW_RATIO, MAX_WINDOW_RATIO = 2.0, 3.0
"""Of the mechanism's greater extent: how wide and high the window at least is in which the curves are drawn, and how
far it may grow to fill the paper."""
DRAWING_SIZE = 160.0, 140.0
"""mm on paper that the mechanism and the curves in the window take at the most."""
POLE_WINDOW_RATIO = 0.92
"""Part of the window within which a pole has room."""
STEP_PARTS, MAX_DIVIDED_STEPS = 4, 1500
"""Parts of each step of a run that are drawn, unless it has more steps than that."""
POLE_RADIUS, DOT_RADIUS = 0.9, 0.45
"""mm: the radius of the pole's mark, and of a position's."""
DEFAULT_MARKS, MAX_MARKS = 12, 72
"""Positions of the input that are marked."""


class _MechanismExtent(NamedTuple):
    """Where a mechanism is in a position: its corners and middle, each (2,), and its greater extent, m."""

    low: Array
    high: Array
    middle: Array
    extent: float

    def distance_from_middle(self, at: Array) -> float:
        """How far from the middle a place is, across or upwards (m)."""
        return float(np.abs(at - self.middle).max())

    def can_show(self, at: Array | None) -> bool:
        """Whether a window can have a place in it."""
        return (
            at is not None and self.distance_from_middle(at) <= POLE_WINDOW_RATIO * MAX_WINDOW_RATIO / 2.0 * self.extent
        )


def centrodes_picture(
    motion: Motion | Mechanism,
    link: str | None = None,
    other: str | None = None,
    scale: Scale | None = None,
    marks: int = DEFAULT_MARKS,
) -> Picture:
    """The scheme with both centrodes of a link against another (left out: the frame), touching in the pole.

    The fixed one, of `other`, is a full line, the moving one a dashed line where it is now; both as far as they lie in
    a window of some extents of the mechanism, with dots at about `marks` round positions of the input (0: none).
    Without a `link` those of the first coupler are drawn. The position is the file's, or where the pole is not in the
    window then, the nearest to it where it is. Raises BadInput for a link that does not exist or a number of marks that
    is none, NoAnswer where there is no motion.
    """
    if isinstance(marks, bool) or not isinstance(marks, Integral) or not 0 <= marks <= MAX_MARKS:
        raise BadInput("marks", f"write a whole number of marks from 0 to {MAX_MARKS}, not {marks!r:.40}")
    mechanism = motion.mechanism if isinstance(motion, Motion) else motion
    if link is None:
        link, other = usual_links(mechanism)
    run = _centrode_run(motion)
    try:
        found = centrodes(run.motion, link, other)
    except Unknown as problem:
        raise BadInput("links", str(problem)) from None
    state, pole, moved = _drawn_position(run, found)
    place, inside = _mechanism_extent(state), False
    half = np.full(2, MIN_WINDOW_RATIO / 2.0 * place.extent)
    corners = [np.stack([place.low, place.high])]
    if place.can_show(pole) and pole is not None:
        inside = True
        half = np.maximum(half, place.distance_from_middle(pole) / POLE_WINDOW_RATIO)
        corners.append(pole[None])
    curves = [] if found.reason else _centrode_curves(run, found, state)
    if scale is None:
        spread = np.ptp(np.concatenate([*corners, *_curves_in_window(curves, place, half)]), axis=0)
        scale = round_scale("length", mechanism.units.length, float(spread[0]), float(spread[1]), DRAWING_SIZE)
    room = np.array(DRAWING_SIZE) / 2.0 * scale.per_mm
    half = np.clip(room, half, np.maximum(half, MAX_WINDOW_RATIO / 2.0 * place.extent))
    pieces = [clip_homogeneous_curve(curve, place.middle - half, place.middle + half) for curve in curves]
    drawn = scheme(state, scale, travel=run.slide_ranges)
    strokes, names = _centrode_strokes(pieces, drawn, scale)
    name = centre_name(mechanism, found.link, found.other)
    dots = [] if found.reason else _position_marks(run, found, state, marks)
    circles, texts = _dot_marks([dot for dot in dots if (np.abs(dot.place - place.middle) <= half).all()], scale)
    names += texts
    picture_marks: list[Mark] = [*strokes, *(mark for mark in drawn.marks if not isinstance(mark, Label)), *circles]
    if inside and pole is not None:
        at = paper_point(pole / scale.per_mm)
        picture_marks.append(Circle(at, POLE_RADIUS, Pen.PIN, f"pole {name}", Fill.PAPER))
        names.append(Label(f"$I_{{{name[1:]}}}$", at, f"pole {name}", 9.0, POLE_RADIUS + 0.4, math=True))
    letters = [mark for mark in drawn.marks if isinstance(mark, Label)]
    against = "" if found.other == mechanism.frame else f" against {found.other}"
    told = (*_notes(run, found, name, inside, pole), *([_moved_note(run, state)] if moved else []))
    if circles:
        unit = unit_of_kind("length" if run.is_sliding_input else "angle", mechanism.units)[0]
        told = (*told, f"Dots: positions of the input {run.input.pair} in {unit}")
    title = f"{mechanism.name}: centrodes of {found.link}{against}"
    return Picture((*picture_marks, *letters, *names), title, (*told, *drawn.notes))


def _centrode_run(source: Motion | Mechanism) -> DrawnRun:
    """The run whose poles are drawn; that of a mechanism has the file's position in it where it has one."""
    run = closed_run(steady_run(source))
    if isinstance(source, Motion) or not run.makes_whole_turns or _covers_file_position(run):
        return run
    # geared links do not come back, and the run began where a slide turns back
    start, gone = run.input.position, float(run.position[-1] - run.position[0])
    motion = cycle(run.motion.mechanism, len(run.motion) - 1, start, start + gone, run.input.pair)
    return run._replace(motion=motion, stroke=None)


def _covers_file_position(run: DrawnRun) -> bool:
    """Whether the file's position is one of the run."""
    low, high = float(run.position.min()), float(run.position.max())
    return low <= run.input.position <= high or (run.makes_whole_turns and run.is_periodic)


def _centrode_strokes(
    pieces: Sequence[Sequence[Array]], drawn: Picture, scale: Scale
) -> tuple[list[Polyline], list[Label]]:
    """The strokes of the fixed and of the moving centrode, each with its name beside it."""
    strokes: list[Polyline] = []
    names: list[Label] = []
    for both, pen in zip(pieces, (Pen.FIXED_CENTRODE, Pen.MOVING_CENTRODE), strict=False):
        lines = remove_repeated_strokes([piece / scale.per_mm for piece in both])
        strokes += (Polyline(tuple(map(paper_point, line.tolist())), pen, pen.value) for line in lines)
        if lines:
            names.append(Label(pen.value, _clearest_point(lines, drawn, names), pen.value, 8.0))
    return strokes, names


def _drawn_position(run: DrawnRun, found: Centrodes) -> tuple[State, Array | None, bool]:
    """The position that is drawn, the pole in it (2,), m, in the frame's axes, and whether it is not the file's."""
    within = _covers_file_position(run)
    here = run.input.position if within else float(run.position[len(run.position) // 2])
    first = _solve_with_pole(run, found, here)
    if found.reason or (first is not None and _mechanism_extent(first[0]).can_show(first[1])):
        return (*(first or _any_solvable_position(run, found)), not within)
    base = run.motion.frames[found.other]
    seen = base.to_world(Vector(*found.fixed.position.T))
    poles = np.stack([np.broadcast_to(getattr(each, "parts", (each,))[0], len(run.motion)) for each in seen], axis=1)
    points = np.array([run.motion.point(name).position for name in run.motion.point_names])
    corners = points.max(axis=0), points.min(axis=0)
    half = MAX_WINDOW_RATIO / 2.0 * np.ptp(points, axis=0).max(axis=1)
    with np.errstate(invalid="ignore"):
        inside = np.abs(poles - (corners[0] + corners[1]) / 2.0).max(axis=1) <= POLE_WINDOW_RATIO * half
    positions = found.fixed.inputs
    away = np.abs(positions - here)
    if run.makes_whole_turns and run.is_periodic:
        away = np.abs(np.mod(positions - here + np.pi, 2.0 * np.pi) - np.pi)
    for row in np.flatnonzero(inside)[np.argsort(away[inside], kind="stable")]:
        there = _solve_with_pole(run, found, float(positions[row]))
        if there is not None and there[1] is not None:
            return (*there, True)
    return (*(first or _any_solvable_position(run, found)), not within)


def _any_solvable_position(run: DrawnRun, found: Centrodes) -> tuple[State, Array | None]:
    """A position in which the mechanism can be solved, where that of the file is none."""
    for row in range(1, len(run.motion) - 1):
        there = _solve_with_pole(run, found, float(found.fixed.inputs[row]))
        if there is not None:
            return there
    raise BadInput("inputs", "there is no position of this motion in which it could be drawn")


def _solve_with_pole(run: DrawnRun, found: Centrodes, position: float) -> tuple[State, Array | None] | None:
    """The mechanism at a position of the input, as the file drives it, with the pole; None where there is none."""
    pair = run.input.pair
    try:
        state = solve(run.motion.mechanism, {pair: position})
    except NoAnswer:
        return None
    pole = curvature(state, found.link, found.other).pole
    if pole is not None:
        pole = np.array(plain_frames(state.frames)[found.other].to_world(Vector(*pole)))
    as_given = replace_inputs(state.mechanism, (Drive(pair, None, run.input.velocity, run.input.acceleration),))
    return replace(state, mechanism=as_given), pole


def _mechanism_extent(state: State) -> _MechanismExtent:
    """Where the mechanism is, by the scheme's own strokes."""
    whole = space_scale(state.mechanism, plain_frames(state.frames), state.shapes)
    corners = extent(scheme(state, whole, letters=False, numbers=False).marks)
    low, high = (np.array(each) * whole.per_mm for each in corners)
    return _MechanismExtent(low, high, (low + high) / 2.0, float((high - low).max()))


def _centrode_curves(run: DrawnRun, found: Centrodes, state: State) -> list[Array]:
    """Both centrodes where they are in a position, homogeneous (places, 3), m, in the frame's axes."""
    parts, curves = STEP_PARTS if len(run.motion) <= MAX_DIVIDED_STEPS else 1, []
    for curve, link in ((found.fixed, found.other), (found.moving, found.link)):
        frame = plain_frames(state.frames)[link]
        c, s = frame.cos, frame.sin
        curves.append(curve.curve(found.known, parts) @ np.array([[c, -s, frame.x], [s, c, frame.y], [0, 0, 1]]).T)
    return curves


def _curves_in_window(curves: Sequence[Array], place: _MechanismExtent, half: Array) -> Iterator[Array]:
    """The pieces of curves in a window."""
    for curve in curves:
        yield from clip_homogeneous_curve(curve, place.middle - half, place.middle + half)


def _clearest_point(lines: Sequence[Array], drawn: Picture, names: Sequence[Label]) -> tuple[float, float]:
    """The spot of some lines that is farthest from all letters so far."""
    spots = np.concatenate(lines)
    taken = [mark.at for mark in (*drawn.marks, *names) if isinstance(mark, Label)]
    (left, low), (right, high) = extent(drawn.marks)
    taken.append(((left + right) / 2.0, (low + high) / 2.0))
    away = np.hypot(*(spots[:, None] - np.array(taken)[None]).transpose(2, 0, 1)).min(axis=1)
    return paper_point(spots[int(np.argmax(away))].tolist())


class _PositionMark(NamedTuple):
    """A dot on a centrode: its place (m) in the axes of the frame, and its text, empty on the moving centrode."""

    place: Array
    text: str
    pen: Pen
    about: str


def _dot_marks(dots: Sequence[_PositionMark], scale: Scale) -> tuple[list[Circle], list[Label]]:
    """The dots on paper, and the texts of those that have one."""
    spots = [paper_point(dot.place / scale.per_mm) for dot in dots]
    circles = [
        Circle(spot, DOT_RADIUS, dot.pen, dot.about, Fill.PAPER if dot.text else Fill.NONE)
        for dot, spot in zip(dots, spots, strict=True)
    ]
    texts = [
        Label(dot.text, spot, dot.about, 7.0, DOT_RADIUS + 0.3)
        for dot, spot in zip(dots, spots, strict=True)
        if dot.text
    ]
    return circles, texts


def _position_marks(run: DrawnRun, found: Centrodes, state: State, count: int) -> list[_PositionMark]:
    """Dots on both centrodes, where they are in a position, at round positions of the input."""
    if not count:
        return []
    unit, of = unit_of_kind("length" if run.is_sliding_input else "angle", run.motion.mechanism.units)
    low, high = (of.from_si(float(end)) for end in (run.position.min(), run.position.max()))
    step = round_step((high - low) / count, DEGREE_STEPS if unit == "deg" else DECIMAL_STEPS)
    # the end of a run that closes is its start
    closes = run.makes_whole_turns and run.is_periodic
    last = high - 1e-6 * step if closes else high
    turn = of.from_si(2.0 * np.pi * run.turns)
    values = step * np.arange(np.ceil(low / step - 1e-9), np.floor(last / step + 1e-9) + 1)
    dots = []
    for curve, link, pen in (
        (found.fixed, found.other, Pen.FIXED_CENTRODE),
        (found.moving, found.link, Pen.MOVING_CENTRODE),
    ):
        frame = plain_frames(state.frames)[link]
        for value in values:
            x, y, w = curve.homogeneous_at(float(np.clip(of.to_si(value), run.position.min(), run.position.max())))
            if w != 0.0 and np.isfinite(w):
                place = np.array(frame.to_world(Vector(x / w, y / w)))
                text = format_tick(value % turn if closes else value)
                about = f"{pen.value} at {text}"
                dots.append(_PositionMark(place, text if curve is found.fixed else "", pen, about))
    return dots


def _notes(run: DrawnRun, found: Centrodes, name: str, inside: bool, pole: Array | None) -> Iterator[str]:
    """What the curves are, and where the pole is."""
    if found.reason:
        yield found.reason[0].upper() + found.reason[1:]
        return
    gone = amount(
        float(run.input_travel[-1]), "length" if run.is_sliding_input else "angle", run.motion.mechanism.units
    )
    yield f"Fixed centrode (full) in {found.other}, moving centrode (dashed) in {found.link}"
    yield f"Over {gone} of the input {found.pair}; they roll on each other without slipping"
    if len(found.arcs) > 1:
        yield "They pass through infinity; what lies near the mechanism is drawn"
    if not inside:
        yield f"The pole {name} is {'at infinity' if pole is None else 'far away'} in this position"


def _moved_note(run: DrawnRun, state: State) -> str:
    """Where the input is, as that is not where the file has it."""
    position = state.inputs[run.input.pair].position
    if run.makes_whole_turns and run.is_periodic:
        position %= 2.0 * np.pi
    at = amount(position, "length" if run.is_sliding_input else "angle", state.mechanism.units)
    return f"Drawn with the input {run.input.pair} at {at}"
