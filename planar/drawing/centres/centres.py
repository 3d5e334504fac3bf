"""The scheme of a position with its instantaneous centres, and the lines of centres on which they were found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import combinations
from math import copysign, inf, isfinite
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.centres import Centre, Centres
from planar.analysis.centres.centres import CentreLine as Known
from planar.analysis.centres.pair_centres import primary_centres
from planar.analysis.rate_equations import rate_equations
from planar.drawing.centres.choice import CROWDED_CENTRES
from planar.drawing.centres.circle_diagram import circle_radius
from planar.drawing.paper.boxes import Box
from planar.drawing.paper.lines_on_paper import (
    COINCIDENCE_TOLERANCE,
    PAPER_SIZE,
    PARALLEL_TOLERANCE,
    PaperLine,
    sine_between,
)
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
from planar.drawing.paper.scales import Scale, round_scale
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme, space_scale
from planar.drawing.scheme.symbol_table import PIN_RADIUS
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.units import parse_unit
from planar.model.mechanism import relative_motions

DEFAULT_REACH = 3.0
"""Width and height up to which the view grows to show centres, in greater extents of the mechanism."""
CLOSE_REACH = 2.0
"""The view that fits the size of a drawing, in the same extents."""
SHEET_GROWTH = 1.7
"""How many times as large the drawing becomes, before its scale does, to show the centres in a larger view."""
ROUND_OFF_RATIO = 1e-9
"""A coordinate below this part of the other one, or of the view, is zero."""
DRAWING_SIZE = 211.0, 125.0
"""mm on paper that the mechanism and the centres in the window take at the most, the width less the circle's."""
WINDOW_MARGIN, ARROW_MARGIN = 4.0, 9.0
"""mm between those and the window's edge; where arrows stand at the edge."""
PAIR_CENTRE_RADIUS, FOUND_CENTRE_RADIUS = 0.3, 0.9
"""mm: the radius of the mark of a centre that a pair shows, and of one that was found."""
ARROW_LENGTH, LINE_OVERHANG = 6.0, 3.0
"""mm: the length of an arrow at the edge; how far a line of centres goes on beyond them."""
MAX_LISTED_NAMES = 6
"""Of more centres at one spot only the first few are lettered."""
FEW_NAMES = 3
LABEL_SIZE = 8.5
"""points"""
METHOD_WORDS = {
    "pair": "by pairs",
    "Kennedy": "by Kennedy's theorem",
    "ratio": "by ratios of wheels",
    "equations": "by loop equations",
}


def centres_picture(
    found: Centres, shown: Sequence[Centre], scale: Scale | None = None, reach: float = DEFAULT_REACH
) -> Picture:
    """The scheme with the centres shown: rings and dots, their lines, and arrows towards those far away.

    The view grows from the mechanism to the nearest centres, as long as its width and height are at most `reach` times
    the mechanism's greater extent. Strokes are `about` "centre I24",
    "line I12 I14" (or "normal at P"; several that coincide are one, their names parted by commas) and "arrow I34";
    letters "centre I24". Raises BadInput for a reach below 1.
    """
    if not (isfinite(reach) and reach >= 1.0):
        raise BadInput("reach", "a window is at least once as wide as the mechanism")
    return _CentresDrawing(found, shown, scale, reach).picture()


def _centres_in_view(centres: Sequence[Centre], low: Array, high: Array, reach: float) -> dict[str, Array]:
    """The places (m) of the centres, nearest first, to which a view from `low` to `high` (2,) grows within `reach`."""
    middle, limit = (low + high) / 2.0, reach * float((high - low).max())
    places = [(centre.name, centre.position) for centre in centres if centre.position is not None]
    near = {}
    for name, place in sorted(places, key=lambda item: float(np.abs(item[1] - middle).max())):
        larger = np.minimum(low, place), np.maximum(high, place)
        if (larger[1] - larger[0]).max() <= limit:
            low, high = larger
            near[name] = place
    return near


class _CentreArrow(NamedTuple):
    """The arrow at the window's edge towards a centre at infinity or outside: its tip (mm) and its direction."""

    centre: Centre
    tip: Array
    direction: Array
    foot: Array | None = None
    "where a pair shows that direction (mm)"


class _CentresDrawing:
    """The marks of the centres of one position at a scale."""

    def __init__(self, found: Centres, shown: Sequence[Centre], scale: Scale | None, reach: float):
        self.found, self.shown, self.state = found, shown, found.state
        mechanism = self.state.mechanism
        whole = space_scale(mechanism, plain_frames(self.state.frames), self.state.shapes)
        low, high = (np.array(each) * whole.per_mm for each in extent(scheme(self.state, whole, False, False).marks))
        near = _centres_in_view(shown, low, high, reach)
        if scale is None:
            room = DRAWING_SIZE[0] - 2.0 * circle_radius(len(found.numbers)), DRAWING_SIZE[1]
            close = _centres_in_view(shown, low, high, min(reach, CLOSE_REACH))
            candidates = []
            for places, growth in ((close, 1.0), (near, SHEET_GROWTH)):
                width, height = map(float, np.ptp(np.array([low, high, *places.values()]), axis=0))
                limits = growth * room[0], growth * room[1]
                candidates.append(round_scale("length", whole.unit, width, height, limits))
            scale = max(candidates, key=lambda candidate: candidate.per_mm)
        self.scale = scale
        self.scheme_picture = scheme(self.state, scale, len(shown) <= CROWDED_CENTRES)
        self.paper_points = {name: at / scale.per_mm for name, at in near.items()}
        self.centres_by_name = {each.name: each for each in shown}
        corners = np.array([*extent(self.scheme_picture.marks), *self.paper_points.values()])
        low, high = corners.min(axis=0), corners.max(axis=0)
        far = any(each.homogeneous is not None and each.name not in near for each in shown)
        pad = ARROW_MARGIN if far else WINDOW_MARGIN
        self.window = Box(*map(float, (*(low - pad), *(high + pad))))
        self.middle = (low + high) / 2.0
        for name, at in ((each.name, self._paper_point(each.name)) for each in shown):
            if at is not None and (np.abs(at - self.middle) <= (high - low) / 2.0 + pad).all():
                self.paper_points.setdefault(name, at)

    def picture(self) -> Picture:
        """Lines below the scheme, marks above it."""
        arrows = list(self._centre_arrows())
        marks: list[Mark] = [*self._line_strokes(arrows), *self.scheme_picture.marks]
        for name, at in self.paper_points.items():
            shows = self.centres_by_name[name].how == "pair"
            fill = Fill.NONE if shows else Fill.PAPER
            marks.append(
                Circle(
                    paper_point(at),
                    PAIR_CENTRE_RADIUS if shows else FOUND_CENTRE_RADIUS,
                    Pen.CENTRE,
                    f"centre {name}",
                    fill,
                )
            )
        for each in arrows:
            about = f"arrow {each.centre.name}"
            marks.append(
                Arrow(paper_point(each.tip - ARROW_LENGTH * each.direction), paper_point(each.tip), Pen.CENTRE, about)
            )
        groups = self._group_names()
        marks += (letter for group in groups for letter in self._centre_labels(group))
        marks += self._arrow_labels(arrows)
        return Picture(tuple(marks), "Instantaneous centres", (str(self.scale), *self._notes(arrows, groups)))

    def _normalized_point(self, homogeneous: Array) -> Array:
        """A centre as (x, y, w) of length one, x and y in SIZE from the window's middle."""
        x, y, w = homogeneous
        x, y = np.array([x, y]) / self.scale.per_mm - w * self.middle
        point = np.array([x / PAPER_SIZE, y / PAPER_SIZE, w])
        return point / np.linalg.norm(point)

    def _paper_point(self, name: str) -> Array | None:
        """A centre on paper (mm), also outside the window; None at infinity."""
        at = self.centres_by_name[name].position
        return None if at is None else at / self.scale.per_mm

    @cached_property
    def centre_lines(self) -> tuple[PaperLine, ...]:
        """The lines on which centres were found, once each, where all centres of a line are shown."""
        rays: list[PaperLine] = []
        for centre in self.shown:
            for line in centre.lines:
                ray = self._centre_line(centre, line)
                if ray is None:
                    continue
                index = next((k for k, each in enumerate(rays) if each.is_same_line(ray)), None)
                if index is None:
                    rays.append(ray)
                    continue
                known = rays[index]
                about = ", ".join(dict.fromkeys((*known.about.split(", "), ray.about)))
                rays[index] = known._replace(
                    about=about, centre_names=known.centre_names | ray.centre_names, points=(*known.points, *ray.points)
                )
        return tuple(rays)

    def _centre_line(self, centre: Centre, line: Known) -> PaperLine | None:
        """A line of centres on paper; None where it is at infinity, or one of its centres is not shown."""
        names = (*line.centres, centre.name)
        known = [self.centres_by_name[name] for name in names if name in self.centres_by_name]
        places = [each.homogeneous for each in known if each.homogeneous is not None]
        if len(places) < len(names):
            return None
        spots: tuple[Array, ...] = ()
        if line.pair:
            through = self._pair_normals(centre, line.pair)
            spots = self._running_points(centre)
        else:
            through = [
                np.cross(self._normalized_point(one), self._normalized_point(other))
                for one, other in combinations(places, 2)
            ]
        # of its three centres the two that lie farthest apart
        a, b, c = max(through, key=lambda each: float(np.linalg.norm(each)), default=np.zeros(3))
        length = float(np.hypot(a, b))
        if length <= PARALLEL_TOLERANCE * max(1.0, abs(c)):
            return None
        about = f"normal at {line.pair}" if line.pair else f"line {' '.join(line.centres)}"
        normal = np.array([a, b]) / length
        foot = self.middle - PAPER_SIZE * c / length * normal
        return PaperLine(foot, np.array([-normal[1], normal[0]]), about, frozenset(names), spots)

    def _pair_normals(self, centre: Centre, pair: str) -> list[Array]:
        """The normal that a pair gives, as a line (3,) in SIZE from the window's middle."""
        size, middle = self.scale.per_mm * PAPER_SIZE, self.middle * self.scale.per_mm
        normals = primary_centres(rate_equations(self.state), middle, size).normals.get(frozenset(centre.links), ())
        return [line for name, line in normals if name == pair]

    def _running_points(self, centre: Centre) -> tuple[Array, ...]:
        """Where points of one of two links run along lines of the other (mm)."""
        found = []
        for pair in relative_motions(self.state.mechanism).values():
            rides = pair.point_on_line()
            if rides is not None and {*pair.links} == {*centre.links}:
                (link, point), _ = rides
                at = plain_frames(self.state.frames)[link].to_world(self.state.shapes[link].position(point))
                found.append(np.array(paper_point(at)) / self.scale.per_mm)
        return tuple(found)

    def _centre_arrows(self) -> Iterator[_CentreArrow]:
        """Towards the centres that are not in the window: of one direction at infinity at one place."""
        done: list[_CentreArrow] = []
        for centre in self.shown:
            if centre.homogeneous is None or centre.name in self.paper_points:
                continue
            at, way = self._paper_point(centre.name), centre.direction
            if at is not None:
                done.append(self._towards_point(centre, at))
            elif way is not None:
                alike = (far for far in done if sine_between(far.direction, way) < PARALLEL_TOLERANCE)
                known = next((far for far in alike if far.centre.direction is not None), None)
                done.append(self._towards_infinity(centre, way) if known is None else known._replace(centre=centre))
        yield from done

    def _towards_infinity(self, centre: Centre, way: Array) -> _CentreArrow:
        """Along a line with the centre where there is one, through the block of a slide, else from the middle."""
        alike = [
            each
            for each in self.shown
            if each.direction is not None and sine_between(each.direction, way) < PARALLEL_TOLERANCE
        ]
        shown = [at for each in alike if each.how == "pair" for at in self._running_points(each)]
        lines = [ray.through for ray in self.centre_lines if any(each.name in ray.centre_names for each in alike)]
        for anchor in (*shown, *lines, self.middle):
            ray = PaperLine(anchor, way, "", frozenset())
            ends = ray.clip_to(self.window) or (0.0, 0.0)
            if ends[1] - ends[0] > 2.0 * ARROW_LENGTH:
                break
        parts = [
            0.0,
            *(
                ray.coordinate_of(at)
                for at in self.paper_points.values()
                if ray.distance_to(at) < COINCIDENCE_TOLERANCE
            ),
        ]
        # the way in which the centres on its line lie; up, or to the right, where that tells nothing
        told = max(parts) + min(parts)
        up = way[1] > PARALLEL_TOLERANCE or (abs(way[1]) <= PARALLEL_TOLERANCE and way[0] > 0.0)
        forward = told > 0.0 if abs(told) > 1.0 else up
        foot = anchor if any(anchor is at for at in shown) else None
        return _CentreArrow(centre, ray.point_at(ends[1] if forward else ends[0]), way if forward else -way, foot)

    def _towards_point(self, centre: Centre, at: Array) -> _CentreArrow:
        """Along a line of centres that leads to it from the window, else from the middle."""
        for ray in self.centre_lines:
            ends = ray.clip_to(self.window)
            if centre.name in ray.centre_names and ends is not None and ends[1] - ends[0] > 2.0 * ARROW_LENGTH:
                tip = ray.point_at(ends[1] if ray.coordinate_of(at) > ends[1] else ends[0])
                return _CentreArrow(centre, tip, (at - tip) / np.linalg.norm(at - tip))
        way = (at - self.middle) / np.linalg.norm(at - self.middle)
        ray = PaperLine(self.middle, way, "", frozenset())
        _, last = ray.clip_to(self.window) or (0.0, 0.0)
        return _CentreArrow(centre, ray.point_at(last), way)

    def _line_strokes(self, arrows: Sequence[_CentreArrow]) -> Iterator[Polyline]:
        """Each line from the first to the last of its centres and a little on, as far as the window goes."""
        ways = {each.centre.name: each.direction for each in arrows if each.centre.direction is not None}
        for ray in self.centre_lines:
            ends = ray.clip_to(self.window)
            if ends is None:
                continue
            finite = [at for name in ray.centre_names if (at := self._paper_point(name)) is not None]
            parts = [ray.coordinate_of(at) for at in (*finite, *ray.points)]
            parts += [copysign(inf, ray.direction @ ways[name]) for name in ray.centre_names if name in ways]
            low, high = max(ends[0], min(parts) - LINE_OVERHANG), min(ends[1], max(parts) + LINE_OVERHANG)
            if low < high:
                yield Polyline(
                    (paper_point(ray.point_at(low)), paper_point(ray.point_at(high))), Pen.CENTRE_LINE, ray.about
                )
        for far in arrows:
            if far.foot is None or far.centre.how != "pair":
                continue
            if not any(
                ray.distance_to(far.foot) < COINCIDENCE_TOLERANCE
                and sine_between(ray.direction, far.direction) < PARALLEL_TOLERANCE
                for ray in self.centre_lines
            ):
                yield Polyline(
                    (paper_point(far.foot), paper_point(far.tip)), Pen.CENTRE_LINE, f"towards {far.centre.name}"
                )

    def _group_names(self) -> list[list[str]]:
        """Names of the centres in the window by their spots."""
        groups: list[list[str]] = []
        for name, at in sorted(self.paper_points.items(), key=lambda item: self._link_numbers(item[0])):
            near = (group for group in groups if np.hypot(*(self.paper_points[group[0]] - at)) <= COINCIDENCE_TOLERANCE)
            group = next(near, None)
            if group is None:
                groups.append([name])
            else:
                group.append(name)
        return groups

    def _link_numbers(self, name: str) -> tuple[int, ...]:
        """The numbers of a centre's links."""
        return tuple(int(self.found.numbers[link]) for link in self.centres_by_name[name].links)

    def _centre_labels(self, names: Sequence[str]) -> Iterator[Label]:
        """The names of centres at one spot."""
        text = ", ".join(map(_centre_mathtext, _shorten_names(names)))
        at = self.paper_points[names[0]]
        away = (
            PIN_RADIUS + 0.6
            if any(self.centres_by_name[name].how == "pair" for name in names)
            else FOUND_CENTRE_RADIUS + 0.7
        )
        about = ", ".join(f"centre {name}" for name in names)
        yield Label(text, paper_point(at), about, LABEL_SIZE, away, math=True)

    def _arrow_labels(self, arrows: Sequence[_CentreArrow]) -> Iterator[Label]:
        """Of every arrow the names of its centres, with a sign for infinity or with their coordinates."""
        left = list(arrows)
        while left:
            first = left[0]
            here = [each for each in left if np.hypot(*(each.tip - first.tip)) <= COINCIDENCE_TOLERANCE]
            left = [each for each in left if not any(each is other for other in here)]
            endless = sorted(
                (each.centre.name for each in here if each.centre.direction is not None), key=self._link_numbers
            )
            texts = [f"{', '.join(map(_centre_mathtext, _shorten_names(endless)))} $\\infty$"] if endless else []
            for each in here:
                at = self._paper_point(each.centre.name)
                if at is not None:
                    texts.append(f"{_centre_mathtext(each.centre.name)} {self._coordinate_text(at)}")
            about = ", ".join(f"centre {each.centre.name}" for each in here)
            yield Label(", ".join(texts), paper_point(first.tip), about, LABEL_SIZE, 0.8, math=True)

    def _coordinate_text(self, place: Array) -> str:
        """The coordinates of a place on paper (mm) in the frame's axes, in the unit of the file."""
        unit = self.scale.unit
        least = ROUND_OFF_RATIO * max(float(np.abs(place).max()), PAPER_SIZE)
        lengths = np.where(np.abs(place) > least, place, 0.0) * self.scale.per_mm
        values = [parse_unit(unit).from_si(float(length)) for length in lengths]
        if unit == "mm" and max(map(abs, values)) >= 10000.0:
            values, unit = [value / 1000.0 for value in values], "m"
        x, y = (f"{float(f'{value:.4g}'):g}".replace("-", "−") for value in values)
        return f"({x}, {y}) {unit}"

    def _notes(self, arrows: Sequence[_CentreArrow], groups: Sequence[Sequence[str]]) -> Iterator[str]:
        """How many there are and how they were found, what is left out, how the drawing is read."""
        counts = [(sum(each.how == how for each in self.found), told) for how, told in METHOD_WORDS.items()]
        counts.append((sum(each.homogeneous is None for each in self.found), "of no place"))
        total = len(self.found)
        yield f"{total} centre{'s' * (total != 1)}: {', '.join(f'{count} {told}' for count, told in counts if count)}"
        if any(self.centres_by_name[name].how != "pair" for name in self.paper_points):
            yield "Dots: shown by pairs; rings: found on lines of centres"
        if any(each.centre.direction is None for each in arrows):
            yield "Centres outside: coordinates in the axes of the frame"
        out = total - len(self.shown)
        if out:
            yield f"{out} of {total} centres are left out, and the lines through them"
        for group in groups:
            if len(group) > MAX_LISTED_NAMES:
                yield f"At one place: {', '.join(group)}"
        none = [each.derivation for each in self.shown if each.homogeneous is None]
        yield from none[:FEW_NAMES]
        if len(none) > FEW_NAMES:
            yield f"and {len(none) - FEW_NAMES} more of this kind"


def _shorten_names(names: Sequence[str]) -> list[str]:
    """Names, of very many the first few and the last."""
    return list(names) if len(names) <= MAX_LISTED_NAMES else [*names[:FEW_NAMES], "…", names[-1]]


def _centre_mathtext(name: str) -> str:
    """A centre's name with its index set low."""
    return f"$I_{{{name[1:]}}}$" if name.startswith("I") else name
