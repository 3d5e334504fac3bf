"""The scheme of a position with its instantaneous centres, and the lines of centres on which they were found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import combinations
from math import isfinite
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.centres import Centre, Centres
from planar.analysis.centres.centres import Line as Known
from planar.analysis.centres.pair_centres import primary
from planar.analysis.rate_equations import rates
from planar.drawing.centres.circle_diagram import radius
from planar.drawing.paper.boxes import Box
from planar.drawing.paper.lines_on_paper import AS_ONE, NOTHING, SIZE, Ray, crosses
from planar.drawing.paper.picture import (
    Arrow,
    Circle,
    Fill,
    Letter,
    Line,
    Mark,
    Pen,
    Picture,
    extent,
    spot,
)
from planar.drawing.paper.scales import Scale, fitting
from planar.drawing.scheme.scheme import scheme, space_scale, standing
from planar.drawing.scheme.symbols import PIN
from planar.foundation.errors import BadInput
from planar.foundation.units import unit
from planar.model.mechanism import motions

Array = np.ndarray
MANY, CROWDED = 28, 15
"""Of more centres than that only some are drawn; with more than the second the points' names are left out."""
REACH = 2.0
"""Of the mechanism's greater extent: how wide and high the window is in which centres are drawn."""
ROOM = 211.0, 125.0
"""mm on paper that the mechanism and the centres in the window take at the most, the width less the circle's."""
PAD, ARROWS = 4.0, 9.0
"""mm between those and the window's edge; where arrows stand at the edge."""
DOT, RING = 0.3, 0.9
"""mm: the radius of the mark of a centre that a pair shows, and of one that was found."""
ARROW, OVER = 6.0, 3.0
"""mm: the length of an arrow at the edge; how far a line of centres goes on beyond them."""
SHOWN = 6
"""Of more centres at one spot only the first few are lettered."""
FEW = 3
SIZE_OF_LETTERS = 8.5
"""points"""
HOWS = {
    "pair": "by pairs",
    "Kennedy": "by Kennedy's theorem",
    "ratio": "by ratios of wheels",
    "equations": "by loop equations",
}


def chosen(found: Centres, links: str | Sequence[str] | None = None) -> tuple[Centre, ...]:
    """The centres to be drawn, in the order in which they were found.

    Of one link: all its centres; of several: those between any two of them; always with the centres on whose lines
    they were found. Without `links` all of them, or of more than MANY those that pairs show and those against the
    frame. Raises BadInput for a link that there is not.
    """
    if links:
        links = [links] if isinstance(links, str) else links
        wanted = set(links)
        for link in links:
            if link not in found.numbers:
                raise BadInput(link, f"there is no link of this name; links are {', '.join(found.numbers)}")
        picked = [each for each in found if wanted & {*each.links} == (wanted if len(wanted) == 1 else {*each.links})]
        names = {name for each in picked for name in (each.name, *(n for line in each.lines for n in line.centres))}
        return tuple(each for each in found if each.name in names)
    frame = found.state.mechanism.frame
    few = len(found) <= MANY
    return tuple(each for each in found if few or each.how == "pair" or frame in each.links)


def centres_picture(
    found: Centres, shown: Sequence[Centre], scale: Scale | None = None, reach: float = REACH
) -> Picture:
    """The scheme with the centres shown: rings and dots, their lines, and arrows towards those far away.

    The window is square, `reach` times the mechanism's greater extent. Strokes are `about` "centre I24",
    "line I12 I14" (or "normal at P"; several that coincide are one, their names parted by commas) and "arrow I34";
    letters "centre I24". Raises BadInput for a reach below 1.
    """
    if not (isfinite(reach) and reach >= 1.0):
        raise BadInput("reach", "a window is at least once as wide as the mechanism")
    return _Sheet(found, shown, scale, reach).picture()


class _Far(NamedTuple):
    """The arrow at the window's edge towards a centre at infinity or outside: its tip (mm) and its direction."""

    centre: Centre
    tip: Array
    way: Array
    foot: Array | None = None
    "where a pair shows that direction (mm)"


class _Sheet:
    """The marks of the centres of one position at a scale."""

    def __init__(self, found: Centres, shown: Sequence[Centre], scale: Scale | None, reach: float):
        self.found, self.shown, self.state = found, shown, found.state
        mechanism = self.state.mechanism
        whole = space_scale(mechanism, standing(self.state.frames), self.state.shapes)
        low, high = (np.array(each) * whole.per_mm for each in extent(scheme(self.state, whole, False, False).marks))
        half, middle = reach * float((high - low).max()) / 2.0, (low + high) / 2.0
        near = {
            each.name: each.position
            for each in shown
            if each.position is not None and np.abs(each.position - middle).max() <= half
        }
        if scale is None:
            width, height = map(float, np.ptp(np.array([low, high, *near.values()]), axis=0))
            room = ROOM[0] - 2.0 * radius(len(found.numbers)), ROOM[1]
            scale = fitting("length", whole.unit, width, height, room)
        self.scale = scale
        self.plain = scheme(self.state, scale, len(shown) <= CROWDED)
        self.spots = {name: at / scale.per_mm for name, at in near.items()}
        self.of = {each.name: each for each in shown}
        corners = np.array([*extent(self.plain.marks), *self.spots.values()])
        low, high = corners.min(axis=0), corners.max(axis=0)
        far = any(each.homogeneous is not None and each.name not in near for each in shown)
        pad = ARROWS if far else PAD
        self.window = Box(*map(float, (*(low - pad), *(high + pad))))
        self.middle = (low + high) / 2.0
        for name, at in ((each.name, self._spot(each.name)) for each in shown):
            if at is not None and (np.abs(at - self.middle) <= (high - low) / 2.0 + pad).all():
                self.spots.setdefault(name, at)

    def picture(self) -> Picture:
        """Lines below the scheme, marks above it."""
        arrows = list(self._arrows())
        marks: list[Mark] = [*self._lines(arrows), *self.plain.marks]
        for name, at in self.spots.items():
            shows = self.of[name].how == "pair"
            fill = Fill.NONE if shows else Fill.PAPER
            marks.append(Circle(spot(at), DOT if shows else RING, Pen.CENTRE, f"centre {name}", fill))
        for each in arrows:
            about = f"arrow {each.centre.name}"
            marks.append(Arrow(spot(each.tip - ARROW * each.way), spot(each.tip), Pen.CENTRE, about))
        groups = self._together()
        marks += (letter for group in groups for letter in self._letters(group))
        marks += self._arrow_letters(arrows)
        return Picture(tuple(marks), "Instantaneous centres", (str(self.scale), *self._notes(arrows, groups)))

    def _point(self, name: str) -> Array:
        """A centre as (x, y, w) of length one, x and y in SIZE from the window's middle."""
        x, y, w = self.of[name].homogeneous
        x, y = np.array([x, y]) / self.scale.per_mm - w * self.middle
        point = np.array([x / SIZE, y / SIZE, w])
        return point / np.linalg.norm(point)

    def _spot(self, name: str) -> Array | None:
        """A centre on paper (mm), also outside the window; None at infinity."""
        at = self.of[name].position
        return None if at is None else at / self.scale.per_mm

    @cached_property
    def rays(self) -> tuple[Ray, ...]:
        """The lines on which centres were found, once each, where all centres of a line are shown."""
        rays: list[Ray] = []
        for centre in self.shown:
            for line in centre.lines:
                ray = self._ray(centre, line)
                if ray is None:
                    continue
                index = next((k for k, each in enumerate(rays) if each.same(ray)), None)
                if index is None:
                    rays.append(ray)
                    continue
                known = rays[index]
                about = ", ".join(dict.fromkeys((*known.about.split(", "), ray.about)))
                rays[index] = known._replace(about=about, on=known.on | ray.on, spots=(*known.spots, *ray.spots))
        return tuple(rays)

    def _ray(self, centre: Centre, line: Known) -> Ray | None:
        """A line of centres on paper; None where it is at infinity, or one of its centres is not shown."""
        names = (*line.centres, centre.name)
        if any(name not in self.of or self.of[name].homogeneous is None for name in names):
            return None
        spots: tuple[Array, ...] = ()
        if line.pair:
            through = self._normals(centre, line.pair)
            spots = self._riders(centre)
        else:
            through = [np.cross(self._point(one), self._point(other)) for one, other in combinations(names, 2)]
        # of its three centres the two that lie farthest apart
        a, b, c = max(through, key=lambda each: float(np.linalg.norm(each)), default=np.zeros(3))
        length = float(np.hypot(a, b))
        if length <= NOTHING * max(1.0, abs(c)):
            return None
        about = f"normal at {line.pair}" if line.pair else f"line {' '.join(line.centres)}"
        normal = np.array([a, b]) / length
        foot = self.middle - SIZE * c / length * normal
        return Ray(foot, np.array([-normal[1], normal[0]]), about, frozenset(names), spots)

    def _normals(self, centre: Centre, pair: str) -> list[Array]:
        """The normal that a pair gives, as a line (3,) in SIZE from the window's middle."""
        size, middle = self.scale.per_mm * SIZE, self.middle * self.scale.per_mm
        normals = primary(rates(self.state), middle, size).normals.get(frozenset(centre.links), ())
        return [line for name, line in normals if name == pair]

    def _riders(self, centre: Centre) -> tuple[Array, ...]:
        """Where points of one of two links run along lines of the other (mm)."""
        found = []
        for pair in motions(self.state.mechanism).values():
            rides = pair.rides()
            if rides is not None and {*pair.links} == {*centre.links}:
                (link, point), _ = rides
                at = standing(self.state.frames)[link].carry(self.state.shapes[link].at(point))
                found.append(np.array(spot(at)) / self.scale.per_mm)
        return tuple(found)

    def _arrows(self) -> Iterator[_Far]:
        """Towards the centres that are not in the window: of one direction at infinity at one place."""
        done: list[_Far] = []
        for centre in self.shown:
            if centre.homogeneous is None or centre.name in self.spots:
                continue
            at, way = self._spot(centre.name), centre.direction
            alike = (far for far in done if at is None and crosses(far.way, way) < NOTHING)
            known = next((far for far in alike if far.centre.direction is not None), None)
            if known is not None:
                done.append(known._replace(centre=centre))
            elif at is None:
                done.append(self._towards_infinity(centre, np.array(way)))
            else:
                done.append(self._towards(centre, at))
        yield from done

    def _towards_infinity(self, centre: Centre, way: Array) -> _Far:
        """Along a line with the centre where there is one, through the block of a slide, else from the middle."""
        alike = [each for each in self.shown if each.direction is not None and crosses(each.direction, way) < NOTHING]
        shown = [at for each in alike if each.how == "pair" for at in self._riders(each)]
        lines = [ray.through for ray in self.rays if any(each.name in ray.on for each in alike)]
        for anchor in (*shown, *lines, self.middle):
            ray = Ray(anchor, way, "", frozenset())
            ends = ray.inside(self.window)
            if ends is not None and ends[1] - ends[0] > 2.0 * ARROW:
                break
        parts = [0.0, *(ray.part(at) for at in self.spots.values() if ray.off(at) < AS_ONE)]
        # the way in which the centres on its line lie; up, or to the right, where that tells nothing
        told = max(parts) + min(parts)
        up = way[1] > NOTHING or (abs(way[1]) <= NOTHING and way[0] > 0.0)
        forward = told > 0.0 if abs(told) > 1.0 else up
        foot = anchor if any(anchor is at for at in shown) else None
        return _Far(centre, ray.at(ends[1] if forward else ends[0]), way if forward else -way, foot)

    def _towards(self, centre: Centre, at: Array) -> _Far:
        """Along a line of centres that leads to it from the window, else from the middle."""
        for ray in self.rays:
            ends = ray.inside(self.window)
            if centre.name in ray.on and ends is not None and ends[1] - ends[0] > 2.0 * ARROW:
                tip = ray.at(ends[1] if ray.part(at) > ends[1] else ends[0])
                return _Far(centre, tip, (at - tip) / np.linalg.norm(at - tip))
        way = (at - self.middle) / np.linalg.norm(at - self.middle)
        ray = Ray(self.middle, way, "", frozenset())
        _, last = ray.inside(self.window) or (0.0, 0.0)
        return _Far(centre, ray.at(last), way)

    def _lines(self, arrows: Sequence[_Far]) -> Iterator[Line]:
        """Each line from the first to the last of its centres and a little on, as far as the window goes."""
        ways = {each.centre.name: each.way for each in arrows if each.centre.direction is not None}
        for ray in self.rays:
            ends = ray.inside(self.window)
            if ends is None:
                continue
            finite = [at for name in ray.on if (at := self._spot(name)) is not None]
            parts = [ray.part(at) for at in (*finite, *ray.spots)]
            parts += [np.copysign(np.inf, ray.way @ ways[name]) for name in ray.on if name in ways]
            low, high = max(ends[0], min(parts) - OVER), min(ends[1], max(parts) + OVER)
            if low < high:
                yield Line((spot(ray.at(low)), spot(ray.at(high))), Pen.CENTRE_LINE, ray.about)
        for far in arrows:
            alone = far.foot is not None and not any(
                ray.off(far.foot) < AS_ONE and crosses(ray.way, far.way) < NOTHING for ray in self.rays
            )
            if alone and far.centre.how == "pair":
                yield Line((spot(far.foot), spot(far.tip)), Pen.CENTRE_LINE, f"towards {far.centre.name}")

    def _together(self) -> list[list[str]]:
        """Names of the centres in the window by their spots."""
        groups: list[list[str]] = []
        for name, at in sorted(self.spots.items(), key=lambda item: self._number(item[0])):
            near = (group for group in groups if np.hypot(*(self.spots[group[0]] - at)) <= AS_ONE)
            group = next(near, None)
            if group is None:
                groups.append([name])
            else:
                group.append(name)
        return groups

    def _number(self, name: str) -> tuple[int, ...]:
        """The numbers of a centre's links."""
        return tuple(int(self.found.numbers[link]) for link in self.of[name].links)

    def _letters(self, names: Sequence[str]) -> Iterator[Letter]:
        """The names of centres at one spot."""
        text = ", ".join(map(_math, _few(names)))
        at = self.spots[names[0]]
        away = PIN + 0.6 if any(self.of[name].how == "pair" for name in names) else RING + 0.7
        about = ", ".join(f"centre {name}" for name in names)
        yield Letter(text, spot(at), about, SIZE_OF_LETTERS, away, math=True)

    def _arrow_letters(self, arrows: Sequence[_Far]) -> Iterator[Letter]:
        """Of every arrow the names of its centres, with a sign for infinity or with how far they are."""
        left = list(arrows)
        while left:
            first = left[0]
            here = [each for each in left if np.hypot(*(each.tip - first.tip)) <= AS_ONE]
            left = [each for each in left if not any(each is other for other in here)]
            endless = sorted((each.centre.name for each in here if each.centre.direction is not None), key=self._number)
            texts = [f"{', '.join(map(_math, _few(endless)))} $\\infty$"] if endless else []
            for each in here:
                at = self._spot(each.centre.name)
                if at is not None:
                    texts.append(f"{_math(each.centre.name)} at {self._length(float(np.hypot(*(at - each.tip))))}")
            about = ", ".join(f"centre {each.centre.name}" for each in here)
            yield Letter(", ".join(texts), spot(first.tip), about, SIZE_OF_LETTERS, 0.8, math=True)

    def _length(self, mm: float) -> str:
        """A length on paper as it really is, in the unit of the file."""
        written = self.scale.unit
        value = unit(written).from_si(mm * self.scale.per_mm)
        if written == "mm" and value >= 1000.0:
            value, written = value / 1000.0, "m"
        return f"{float(f'{value:.3g}'):g} {written}"

    def _notes(self, arrows: Sequence[_Far], groups: Sequence[Sequence[str]]) -> Iterator[str]:
        """How many there are and how they were found, what is left out, how the drawing is read."""
        counts = [(sum(each.how == how for each in self.found), told) for how, told in HOWS.items()]
        counts.append((sum(each.homogeneous is None for each in self.found), "of no place"))
        total = len(self.found)
        yield f"{total} centre{'s' * (total != 1)}: {', '.join(f'{count} {told}' for count, told in counts if count)}"
        if any(self.of[name].how != "pair" for name in self.spots):
            yield "Dots: shown by pairs; rings: found on lines of centres"
        if any(each.centre.direction is None for each in arrows):
            yield "Distances of centres outside: from their arrows' tips"
        out = total - len(self.shown)
        if out:
            yield f"{out} of {total} centres are left out, and the lines through them"
        for group in groups:
            if len(group) > SHOWN:
                yield f"At one place: {', '.join(group)}"
        none = [each.derivation for each in self.shown if each.homogeneous is None]
        yield from none[:FEW]
        if len(none) > FEW:
            yield f"and {len(none) - FEW} more of this kind"


def _few(names: Sequence[str]) -> list[str]:
    """Names, of very many the first few and the last."""
    return list(names) if len(names) <= SHOWN else [*names[:FEW], "…", names[-1]]


def _math(name: str) -> str:
    """A centre's name with its index set low."""
    return f"$I_{{{name[1:]}}}$" if name.startswith("I") else name
