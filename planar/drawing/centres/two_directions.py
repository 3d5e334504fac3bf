"""The centre of one link from the directions of two of its points' velocities, as a textbook constructs it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.drawing.paper import scales
from planar.drawing.paper.boxes import Box
from planar.drawing.paper.lines_on_paper import PARALLEL_TOLERANCE, PaperLine
from planar.drawing.paper.picture import (
    Arrow,
    Circle,
    Fill,
    Label,
    Mark,
    Pen,
    Picture,
    Polyline,
    extent,
    paper_point,
)
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme, space_scale
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.file_units import rate_length, unit_of_kind
from planar.model.mechanism import named_points
from planar.results.motion import State
from planar.results.records import PointState

WINDOW_RATIO = 2.5
"""Of the mechanism's greater extent: how far from its middle C is still drawn in its place."""
MAX_ARROW_LENGTH = 30.0
"""mm: the length of the longer velocity at the most."""
DRAWING_SIZE = 170.0, 130.0
"""mm that the mechanism and C take at the most."""
CENTRE_RADIUS, SHEET_MARGIN, LINE_OVERHANG = 0.9, 10.0, 3.0
"""mm: the mark of C; from all else to the end of lines that lead to it outside; how far lines go on beyond spots."""


class ConstructedCentre(NamedTuple):
    """The centre (m), how it was found, and whether the line through the arrows' heads served; None at infinity."""

    position: Array | None
    method: str
    "with {C} for its letter"
    by_heads: bool = False


def directions_picture(
    state: State,
    link: str,
    points: Sequence[str] | None = None,
    scale: Scale | None = None,
    speeds: Scale | None = None,
) -> Picture:
    """The construction of the centre C of a link against the frame from two of its points, on the scheme.

    Where the velocities differ in direction C is where the lines square to them meet; where they are parallel it is on
    the line through both points, which the line through the arrows' heads cuts. `points` left out: the two joints of
    the link that lie farthest apart. Strokes are `about` "velocity A", "normal A", "heads" and "centre". C is
    lettered I where a point has that name.

    Raises BadInput for a link or points that there are not, and for a link that is at rest.
    """
    names = tuple(points) if points else _farthest_points(state, link)
    one, other = (_point_of_link(state, link, name) for name in _check_two_names(names))
    found = construct_centre(one, other)
    return _TwoDirectionsDrawing(state, names, (one, other), found, scale, speeds).picture()


def construct_centre(one: PointState, other: PointState) -> ConstructedCentre:
    """Where the centre of the link of two points lies, from their places and velocities."""
    fastest = max(np.hypot(*one.velocity), np.hypot(*other.velocity))
    apart = other.position - one.position
    for point in (one, other):
        if np.hypot(*point.velocity) <= PARALLEL_TOLERANCE * fastest:
            return ConstructedCentre(point.position, "{C} is the point that is at rest")
    (ax, ay), (bx, by) = one.velocity, other.velocity
    sine = (ax * by - ay * bx) / np.hypot(ax, ay) / np.hypot(bx, by)
    if abs(sine) > 1e-7:
        # C = A + s (-v_Ay, v_Ax), square to v_B seen from B
        s = (apart @ other.velocity) / (-ay * bx + ax * by)
        return ConstructedCentre(
            one.position + s * np.array([-ay, ax]), "{C}: where the lines square to both velocities meet"
        )
    way = one.velocity / np.hypot(ax, ay)
    first, second = float(way @ one.velocity), float(way @ other.velocity)
    if abs(first - second) <= 1e-7 * fastest:
        return ConstructedCentre(None, "Equal velocities: {C} at infinity, square to them; the link does not turn")
    return ConstructedCentre(
        one.position + first / (first - second) * apart,
        "Parallel velocities: {C} on the line through both points, where the line through the arrows' heads cuts it",
        True,
    )


def _check_two_names(names: Sequence[str]) -> Sequence[str]:
    if len(names) != 2 or names[0] == names[1]:
        raise BadInput("points", "the construction needs two different points of the link")
    return names


def _point_of_link(state: State, link: str, name: str) -> PointState:
    """A point, if the link carries it. Raises BadInput."""
    known = _points_of_link(state, link)
    if name not in known:
        raise BadInput(name, f"{link} has no point of this name; its points are {', '.join(known) or 'none'}")
    return known[name]


def _points_of_link(state: State, link: str) -> dict[str, PointState]:
    if link not in state.frames:
        raise BadInput(link, f"there is no link of this name; links are {', '.join(state.frames)}")
    named = [each for each in named_points(state.mechanism) if any(owner == link for owner, _ in each.members)]
    return {each.name: state.point(each.name) for each in named}


def _farthest_points(state: State, link: str) -> tuple[str, str]:
    """The two joints of a link that lie farthest apart, else any two points."""
    known = _points_of_link(state, link)
    joints = [each.name for each in named_points(state.mechanism) if each.name in known and len(each.members) > 1]
    among = joints if len(joints) > 1 else list(known)
    pairs = [(a, b) for k, a in enumerate(among) for b in among[k + 1 :]]
    if not pairs:
        raise BadInput(link, "the construction needs a link with two points")
    return max(pairs, key=lambda two: float(np.hypot(*(known[two[0]].position - known[two[1]].position))))


class _TwoDirectionsDrawing:
    """The marks of one construction."""

    def __init__(
        self,
        state: State,
        names: tuple[str, ...],
        points: tuple[PointState, PointState],
        found: ConstructedCentre,
        scale: Scale | None,
        speeds: Scale | None,
    ):
        self.names, self.points, self.found, self.units = names, points, found, state.mechanism.units
        self.letter = "C" if "C" not in state.point_names else "I"
        fastest = max(float(np.hypot(*point.velocity)) for point in points)
        if fastest == 0.0:
            raise BadInput(names[0], f"{names[0]} and {names[1]} are at rest: no direction is known")
        whole = space_scale(state.mechanism, plain_frames(state.frames), state.shapes)
        low, high = (np.array(each) * whole.per_mm for each in extent(scheme(state, whole, False, False).marks))
        size, middle = float((high - low).max()), (low + high) / 2.0
        position = found.position
        if position is not None and not np.abs(position - middle).max() <= WINDOW_RATIO * size / 2.0:
            position = None
        both = np.array([low, high] if position is None else [low, high, position])
        width, height = map(float, np.ptp(both, axis=0))
        self.scale = scale or scales.round_scale("length", whole.unit, width, height, DRAWING_SIZE)
        self.speeds = speeds or scales.round_scale(
            "velocity",
            unit_of_kind("velocity", state.mechanism.units)[0],
            fastest,
            fastest,
            (MAX_ARROW_LENGTH, MAX_ARROW_LENGTH),
        )
        self.scheme_picture = scheme(state, self.scale, numbers=False)
        self.paper_points = [point.position / self.scale.per_mm for point in points]
        self.heads = [at + v.velocity / self.speeds.per_mm for at, v in zip(self.paper_points, points, strict=True)]
        self.centre = None if position is None else position / self.scale.per_mm
        shown = self.heads if self.centre is None else [*self.heads, self.centre]
        corners = np.array([*extent(self.scheme_picture.marks), *shown])
        self.window = Box(*map(float, (*(corners.min(axis=0) - SHEET_MARGIN), *(corners.max(axis=0) + SHEET_MARGIN))))

    def picture(self) -> Picture:
        """Lines below the scheme, arrows and C above."""
        marks: list[Mark] = [*self._construction_lines(), *self.scheme_picture.marks]
        for name, at, tip in zip(self.names, self.paper_points, self.heads, strict=True):
            if np.hypot(*(tip - at)) > 1e-6:
                marks.append(Arrow(paper_point(at), paper_point(tip), Pen.VELOCITY, f"velocity {name}"))
                marks.append(
                    Label(
                        f"$v_{{{name}}}$" if _is_simple(name) else f"v {name}",
                        paper_point(tip),
                        f"velocity {name}",
                        9.0,
                        0.8,
                        math=_is_simple(name),
                    )
                )
        if self.centre is not None:
            marks.append(Circle(paper_point(self.centre), CENTRE_RADIUS, Pen.CENTRE, "centre", Fill.PAPER))
            marks.append(Label(self.letter, paper_point(self.centre), "centre", 9.0, CENTRE_RADIUS + 0.7))
        return Picture(
            tuple(marks),
            "Instantaneous centre from two directions",
            (str(self.scale), str(self.speeds), *self._notes()),
        )

    def _construction_lines(self) -> Iterator[Mark]:
        """The normals at both points, to C or as far as the sheet goes, and the line through heads where it serves."""
        end = self.found.position if self.found.position is None else self.found.position / self.scale.per_mm
        for name, at, tip in zip(self.names, self.paper_points, self.heads, strict=True):
            along = tip - at if np.hypot(*(tip - at)) > 1e-6 else None
            if along is None:
                continue
            normal = np.array([-along[1], along[0]]) / np.hypot(*along)
            yield from self._line_to_centre(f"normal {name}", at, normal if end is None else end - at, end)
            if self.centre is not None and np.hypot(*(self.centre - at)) > 8.0:
                text = f"$r_{{{name}}}$" if _is_simple(name) else f"r {name}"
                yield Label(
                    text, paper_point((at + self.centre) / 2.0), f"radius {name}", 9.0, 0.8, math=_is_simple(name)
                )
        if self.found.by_heads and end is not None:
            yield from self._line_to_centre("heads", self.heads[0], end - self.heads[0], end, self.heads[1])

    def _line_to_centre(
        self, about: str, start: Array, way: Array, end: Array | None, also: Array | None = None
    ) -> Iterator[Polyline]:
        """A line from a spot to C, if it is on the sheet, else to the sheet's edge; through another spot as well."""
        length = float(np.hypot(*way))
        if length <= 1e-9:
            return
        ray = PaperLine(start, way / length, about, frozenset())
        low, high = ray.clip_to(self.window) or (0.0, 0.0)
        parts = [0.0, *([ray.coordinate_of(also)] if also is not None else [])]
        parts += [np.inf] if end is None else [ray.coordinate_of(end)]
        ends = max(low, min(parts) - LINE_OVERHANG), min(high, max(parts) + LINE_OVERHANG)
        if ends[0] < ends[1]:
            yield Polyline(tuple(paper_point(ray.point_at(part)) for part in ends), Pen.CENTRE_LINE, about)

    def _notes(self) -> Iterator[str]:
        """How C was found, and the angular velocity from each point."""
        yield self.found.method.format(C=self.letter)
        if self.found.position is None:
            return
        length, of = rate_length(self.units)
        for name, point in zip(self.names, self.points, strict=True):
            radius, speed = (float(np.hypot(*each)) for each in (point.position - self.found.position, point.velocity))
            if radius > 0.0 and speed > 0.0:
                v, r = speed * of.from_si(1.0), radius * of.from_si(1.0)
                yield f"ω = v / r at {name}: {v:.4g} {length}/s / {r:.4g} {length} = {speed / radius:.4g} rad/s"
        if self.centre is None:
            yield f"{self.letter} lies outside, where the lines lead"


def _is_simple(name: str) -> bool:
    """Whether a name can stand as an index in a formula."""
    return name.isalnum()
