"""Drawings of a mechanism over its motion: in equal divisions of its input, and the paths of its points."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from numbers import Integral

import numpy as np

from planar.drawing.diagrams.drawn_run import DrawnRun, closed_run, steady_run
from planar.drawing.labels.text_line import LETTER_PATTERN
from planar.drawing.paper.picture import Circle, Fill, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import DRAWING_HEIGHT, DRAWING_WIDTH, Scale, round_scale
from planar.drawing.scheme.ground import ground_marks
from planar.drawing.scheme.link_bodies import link_bodies, outline_point_names
from planar.drawing.scheme.link_strokes import body_marks
from planar.drawing.scheme.scheme import scheme
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.mechanism import (
    Drive,
    Mechanism,
    NamedPoint,
    named_points,
    relative_motions,
    replace_inputs,
    slot_centres,
)
from planar.model.pairs import MeasureKind
from planar.model.wording import amount
from planar.results.motion import Motion
from planar.solving.position import solve

MIN_PATH_STEPS = 360
"""Steps, at least, of a path that is drawn as a curve."""
MAX_POSITIONS = 72
"""Positions of one drawing."""
MAX_LABELS = 80
"""Letters of one drawing: of further points only the first position is lettered."""
SAME_POINT_TOLERANCE = 0.05
"""mm: spots nearer than this are one."""
JOINT_RADIUS, PATH_MARK_RADIUS = 0.45, 0.55
"""mm: radii of a joint in one of many positions, and of a position on a path."""
PATH_NAME_CLEARANCE = 6.0
"""mm from another letter's spot within which no path is named."""
SHEET_SIZE = 200.0, 150.0
"""mm that the position diagram takes at the most; it holds more letters than other drawings."""
DEAD_CENTRE_LINE = 9.0
"""mm from a guide to where its dead centre is named."""
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


def positions(
    motion: Motion | Mechanism,
    count: int = 12,
    points: Iterable[str] | None = None,
    scale: Scale | None = None,
) -> Picture:
    """The position diagram: the mechanism in `count` equal divisions of its input, position 0 drawn strongly.

    Over a whole turn position 0 is the top dead centre of the first slide on the frame that is not driven, if there is
    one (Machine Elements, 1.3.6 (ii)). Moving joints and tracer points, or those that `points` names, are lettered
    A_0, A_1 and so on, with their paths. Raises BadInput for a name that is not there, NoAnswer without a motion.
    """
    if isinstance(count, bool) or not isinstance(count, Integral) or not 1 <= count <= MAX_POSITIONS:
        raise BadInput("count", f"a whole number of positions from 1 to {MAX_POSITIONS} is wanted, not {count!r:.40}")
    count = int(count)
    run = steady_run(motion, steps=MIN_PATH_STEPS, count=count)
    mechanism, shapes = run.motion.mechanism, run.motion.shapes
    chosen = resolve_points(run, points) if points is not None else _moving_point_names(run)
    scale = scale or motion_scale(run, SHEET_SIZE)
    rows, made, travel = _division_rows(run, count), link_bodies(mechanism, shapes), run.slide_ranges
    marks: list[Mark] = [*ground_marks(mechanism, made, run.frames(rows[0]), shapes, scale, travel)]
    last = count if not run.is_periodic else count - 1
    for row in rows[1 : last + 1]:
        marks += body_marks(mechanism, made, run.frames(row), shapes, scale, Pen.POSITION, False)
    for name in chosen:
        at = run.point(name).position
        marks.append(_path_stroke(run, name, scale))
        marks += (
            Circle(paper_point(at[row] / scale.per_mm), JOINT_RADIUS, Pen.PIN, f"position of {name}", Fill.PAPER)
            for row in rows
        )
    centres = tuple(_dead_centre_marks(run, scale))
    marks += (mark for mark in centres if isinstance(mark, Polyline))
    marks += body_marks(mechanism, made, run.frames(rows[0]), shapes, scale)
    marks += _position_labels(run, chosen, rows, scale)
    marks += (mark for mark in centres if isinstance(mark, Label))
    notes = (
        _start_sentence(run),
        f"The next positions follow every {_travel_text(run, rows[0], rows[1])}",
        f"Space diagram, {scale}",
    )
    return Picture(tuple(marks), f"{mechanism.name}: {count} positions", notes)


def loci(motion: Motion | Mechanism, points: Iterable[str] | None = None, scale: Scale | None = None) -> Picture:
    """The mechanism once, with the paths of points as smooth curves and small marks at twelve equal divisions.

    `points` left out: all that are on no link pinned to the frame, tracer points first. Over a whole turn of geared
    links that are not back after it, as many turns are drawn as that takes. Raises BadInput for a name that is not
    there, NoAnswer where there is no motion.
    """
    run = closed_run(steady_run(motion, steps=MIN_PATH_STEPS))
    mechanism = run.motion.mechanism
    chosen = resolve_points(run, points) if points is not None else coupler_points(run)
    scale = scale or motion_scale(run)
    here, low, high = run.input.position, float(run.position.min()), float(run.position.max())
    within = run.makes_whole_turns or low <= here <= high
    state = solve(mechanism, {} if within else {run.input.pair: float(run.position[len(run.position) // 2])})
    # as the file drives it: the run's own speed may be one that stands for none
    as_given = replace_inputs(mechanism, (Drive(run.input.pair, None, run.input.velocity, run.input.acceleration),))
    drawn = scheme(replace(state, mechanism=as_given), scale, numbers=False, travel=run.slide_ranges)
    rows = _division_rows(run, 12)
    letters = [mark for mark in drawn.marks if isinstance(mark, Label)]
    paths: list[Mark] = []
    names: list[Label] = []
    for name in chosen:
        at = run.point(name).position
        paths.append(_path_stroke(run, name, scale))
        paths += (
            Circle(paper_point(at[row] / scale.per_mm), PATH_MARK_RADIUS, Pen.PATH, f"mark of {name}", Fill.PAPER)
            for row in rows
        )
        names.append(
            Label(f"path of {name}", _path_name_point(run, at / scale.per_mm, scale, letters), f"path {name}", 8.0)
        )
    strokes = tuple(mark for mark in drawn.marks if not isinstance(mark, Label))
    notes = (f"Paths over {_travel_text(run, 0, -1)}, marked at 12 equal divisions", *drawn.notes)
    return Picture((*paths, *strokes, *letters, *names), f"{mechanism.name}: loci", notes)


def resolve_points(run: DrawnRun, points: Iterable[str]) -> tuple[str, ...]:
    """The points asked for, under their result names. Raises BadInput."""
    asked = [points] if isinstance(points, str) else list(points)
    if not asked:
        raise BadInput("points", f"name one point at least; points are {', '.join(run.motion.point_names)}")
    known = {f"{link}.{own}": each.name for each in named_points(run.motion.mechanism) for link, own in each.members}
    known |= {name: name for name in run.motion.point_names}
    for name in asked:
        run.point(str(name))  # refuses what there is not
    return tuple(dict.fromkeys(known[str(name)] for name in asked))


def _joint_members(mechanism: Mechanism) -> frozenset[tuple[str, str]]:
    """The (link, point) in which links meet."""
    met = {member for pair in mechanism.pairs for member in pair.coincident_points()}
    return frozenset(met | {rides[0] for pair in mechanism.pairs if (rides := pair.point_on_line()) is not None})


def _moving_point_names(run: DrawnRun) -> tuple[str, ...]:
    """Points that move, those of the driven link first, then those that slide on the frame, tracers, other joints."""
    mechanism = run.motion.mechanism
    driving = relative_motions(mechanism)[run.input.pair].links
    on_frame = {rides[0] for pair in mechanism.pairs if (rides := pair.point_on_line()) and rides[1] == mechanism.frame}
    joints = _joint_members(mechanism)

    def rank(point: NamedPoint) -> int:
        members = set(point.members)
        if members & joints and any(link in driving for link, _ in members):
            return 0
        return 1 if members & on_frame else 3 if members & joints else 2

    return tuple(point.name for point in sorted(_moving_points(run), key=rank))


def _moving_points(run: DrawnRun) -> list[NamedPoint]:
    """The points that do not stand still, but for those of outlines."""
    spans = {name: np.ptp(run.motion.point(name).position, axis=0).max() for name in run.motion.point_names}
    least = 1e-9 * max(spans.values(), default=0.0)
    outlines = outline_point_names(run.motion.mechanism, run.motion.shapes)
    centres = slot_centres(run.motion.mechanism)
    moving = [
        point
        for point in named_points(run.motion.mechanism)
        if spans[point.name] > least and centres.isdisjoint(point.members)
    ]
    return [point for point in moving if point.name not in outlines] or moving


def coupler_points(run: DrawnRun) -> tuple[str, ...]:
    """Points on no link that is pinned to the frame, tracers first; all moving ones where there is none."""
    mechanism = run.motion.mechanism
    pinned = {
        link
        for pair in mechanism.pairs
        if pair.is_lower_pair and pair.input_kind is MeasureKind.ANGLE and mechanism.frame in pair.links
        for link in pair.links
    }
    moving, joints = _moving_points(run), _joint_members(mechanism)
    free = [point for point in moving if not any(link in pinned for link, _ in point.members)] or moving
    return tuple(point.name for point in sorted(free, key=lambda point: bool(set(point.members) & joints)))


def _division_rows(run: DrawnRun, count: int) -> Sequence[int]:
    """The rows at equal divisions; where a run stopped early, those nearest to them."""
    rows = run.equal_divisions(count)
    if rows is None:
        wanted = np.linspace(0.0, run.time[-1], count + 1)
        rows = np.abs(run.time[None, :] - wanted[:, None]).argmin(axis=1)
    return [int(row) for row in rows]


def motion_scale(run: DrawnRun, room: tuple[float, float] = (DRAWING_WIDTH, DRAWING_HEIGHT)) -> Scale:
    """The round scale at which the whole motion fits the paper."""
    low, high = run.bounds
    width, height = map(float, high - low)
    return round_scale("length", run.motion.mechanism.units.length, width, height, room)


def _path_stroke(run: DrawnRun, name: str, scale: Scale) -> Polyline:
    return Polyline(tuple(paper_point(each) for each in run.path(name) / scale.per_mm), Pen.PATH, f"path {name}")


def _path_name_point(run: DrawnRun, spots: Array, scale: Scale, letters: Sequence[Label]) -> tuple[float, float]:
    """The spot of a path that is farthest from the middle of everything, if it can be not beside another letter's."""
    low, high = run.bounds
    out = np.hypot(*(spots - (low + high) / 2.0 / scale.per_mm).T)
    taken = np.array([letter.at for letter in letters]).reshape(-1, 2)
    near = (
        np.hypot(*(spots[:, None] - taken[None]).transpose(2, 0, 1)).min(axis=1, initial=np.inf) < PATH_NAME_CLEARANCE
    )
    return paper_point(spots[int(np.argmax(np.where(near, out - 1e6, out)))])


def _position_labels(run: DrawnRun, chosen: Sequence[str], rows: Sequence[int], scale: Scale) -> Iterator[Label]:
    """A_0, A_1 and so on; where several are at one spot they stand together; fixed points by their names."""
    pinned = {
        point.name
        for point in named_points(run.motion.mechanism)
        if set(point.members) & _joint_members(run.motion.mechanism)
    }
    left = MAX_LABELS
    for name in chosen:
        spots = run.point(name).position[list(rows)] / scale.per_mm
        groups: list[list[int]] = []
        for index, at in enumerate(spots):
            beside = next(
                (group for group in groups if np.hypot(*(spots[group[0]] - at)) <= SAME_POINT_TOLERANCE), None
            )
            if beside is None:
                groups.append([index])
            else:
                beside.append(index)
        shown = groups if len(groups) <= left else groups[:1]
        left -= len(shown)
        for group in shown:
            strong = group[0] == 0
            away = 1.8 if strong and name in pinned else 0.9
            text, math = _numbered_name(name, group)
            yield Label(
                text, paper_point(spots[group[0]]), f"{name} {group[0]}", 9.0 if strong else 7.0, away, math=math
            )
    frame, centres = run.motion.mechanism.frame, slot_centres(run.motion.mechanism)
    for point in named_points(run.motion.mechanism):
        if any(link == frame for link, _ in point.members) and centres.isdisjoint(point.members):
            at = run.motion.point(point.name).position[0] / scale.per_mm
            yield Label(point.name, paper_point(at), f"point {point.name}", 9.0, 1.8)


def _numbered_name(name: str, indices: Sequence[int]) -> tuple[str, bool]:
    """A name with the numbers of its positions, and whether that is mathtext: a name of letters and digits is."""
    if re.fullmatch(f"(?![0-9]){LETTER_PATTERN}+", name):
        base = name if len(name) == 1 else f"\\mathit{{{name}}}"
        return ", ".join(f"${base}_{{{index}}}$" for index in indices), True
    return ", ".join(f"{name}{str(index).translate(SUBSCRIPTS)}" for index in indices), False


def _dead_centre_marks(run: DrawnRun, scale: Scale) -> Iterator[Mark]:
    """TDC and BDC named at the ends of the slide, each at a thin line across its guide."""
    if run.stroke is None:
        return
    pair = relative_motions(run.motion.mechanism)[run.stroke.pair]
    rides = pair.point_on_line()
    if rides is None or rides[1] != run.motion.mechanism.frame:
        return
    at = run.motion.point(".".join(rides[0])).position / scale.per_mm
    went = np.asarray(run.motion.pair(pair.name)[next(iter(pair.result_kinds))])
    far = int(np.argmax(np.abs(went - went[0])))
    slope = (at[far] - at[0]) / (went[far] - went[0])
    across = np.array([-slope[1], slope[0]]) / np.hypot(*slope)
    low, high = run.bounds
    middle = (low + high) / 2.0 / scale.per_mm
    if float((middle - at[0]) @ across) > 1e-6 or (abs(float((middle - at[0]) @ across)) <= 1e-6 and across[1] > 0.0):
        across = -across
    for name, end in (("TDC", run.stroke.top), ("BDC", run.stroke.bottom)):
        here = at[0] + slope * (end.value - went[0])
        yield Polyline(
            (paper_point(here), paper_point(here + DEAD_CENTRE_LINE * across)),
            Pen.CONSTRUCTION,
            f"{name} of {pair.name}",
        )
        yield Label(name, paper_point(here + DEAD_CENTRE_LINE * across), f"{name} of {pair.name}", 8.0, 0.5)


def _travel_text(run: DrawnRun, first: int, last: int) -> str:
    """What lies between two rows: a time, or how far the input goes."""
    if run.is_time_run:
        return f"{run.time[last] - run.time[first]:.6g} s"
    gone = amount(
        float(run.input_travel[last] - run.input_travel[first]),
        "length" if run.is_sliding_input else "angle",
        run.motion.mechanism.units,
    )
    return f"{gone} of the input {run.input.pair}"


def _start_sentence(run: DrawnRun) -> str:
    """Where position 0 is."""
    kind = "length" if run.is_sliding_input else "angle"
    at = f"the input {run.input.pair} at {amount(run.start_position, kind, run.motion.mechanism.units)}"
    return (
        f"Position 0: top dead centre (TDC) of {run.stroke.pair}, {at}"
        if run.starts_at_top and run.stroke
        else f"Position 0: {at}"
    )
