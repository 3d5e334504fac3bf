"""The scheme of a position with fixed and moving centrode of two links, which touch in their pole."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.centrodes import Centrodes, centrodes, usual_links
from planar.analysis.centres.curvature import curvature
from planar.drawing.diagrams.drawn_run import DrawnRun, closed_run, steady_run
from planar.drawing.paper.clipping import clip_homogeneous_curve, remove_repeated_strokes
from planar.drawing.paper.picture import Circle, Fill, Label, Pen, Picture, Polyline, extent, paper_point
from planar.drawing.paper.scales import Scale, round_scale
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme, space_scale
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Unknown
from planar.foundation.geometry import Vector
from planar.model.link_graph import link_numbers, number_separator
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
POLE_RADIUS = 0.9
"""mm: the radius of the pole's mark."""


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
    motion: Motion | Mechanism, link: str | None = None, other: str | None = None, scale: Scale | None = None
) -> Picture:
    """The scheme with both centrodes of a link against another (left out: the frame), touching in the pole.

    The fixed one, of `other`, is a full line, the moving one a dashed line where it is now; both as far as they lie in
    a window of some extents of the mechanism. Without a `link` those of the first coupler are drawn. The position is
    the file's, or where the pole is not in the window then, the nearest to it where it is. Raises BadInput for a link
    that is not there, NoAnswer where there is no motion.
    """
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
    name = _pole_name(found, mechanism)
    marks = [*strokes, *(mark for mark in drawn.marks if not isinstance(mark, Label))]
    if inside and pole is not None:
        at = paper_point(pole / scale.per_mm)
        marks.append(Circle(at, POLE_RADIUS, Pen.PIN, f"pole {name}", Fill.PAPER))
        names.append(Label(f"$I_{{{name[1:]}}}$", at, f"pole {name}", 9.0, POLE_RADIUS + 0.4, math=True))
    letters = [mark for mark in drawn.marks if isinstance(mark, Label)]
    against = "" if found.other == mechanism.frame else f" against {found.other}"
    told = (*_notes(run, found, name, inside, pole), *([_moved_note(run, state)] if moved else []))
    title = f"{mechanism.name}: centrodes of {found.link}{against}"
    return Picture((*marks, *letters, *names), title, (*told, *drawn.notes))


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


def _pole_name(found: Centrodes, mechanism: Mechanism) -> str:
    """The pole by the numbers of its links: I24."""
    numbers = link_numbers(mechanism)
    both = sorted((numbers[found.link], numbers[found.other]), key=int)
    return "I" + number_separator(numbers).join(both)


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
