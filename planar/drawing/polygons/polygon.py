"""Velocity and acceleration polygons as pictures: arrows from the pole, images of links, small letters."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import combinations, groupby, pairwise, takewhile
from math import atan2, hypot

import numpy as np

from planar.analysis.polygons.lettering import PRIME, legend
from planar.analysis.polygons.polygon import Meeting, Polygon, Simultaneous, Triangle, Vector
from planar.analysis.rate_equations import Rates, Slide, rates
from planar.drawing.labels.text_line import LETTER
from planar.drawing.paper.picture import Arrow, Circle, Letter, Line, Mark, Pen, Picture, spot
from planar.drawing.paper.scales import Scale, fitting
from planar.foundation.units import own
from planar.model.mechanism import named_points

SHORTEST = 0.05
"""mm within which two letters are at one spot, and what joins them is none."""
TICK, POLE = 2.2, 0.7
"""mm: the mark across a line where a point lies on it; the radius of the ring at the pole."""
NOTHING = 1e-10
"""Of what the motion of the links could bring with it: a polygon smaller than that is a point."""
MANY, FEW = 8, 3
"""Of more letters than that at the pole only the first few are shown, and the last."""
PENS = {"velocity": Pen.VELOCITY, "acceleration": Pen.ACCELERATION}
STILL = {"velocity": "everything is at rest", "acceleration": "nothing is accelerated"}
TURNING = {"velocity": "no lettered point moves", "acceleration": "no lettered point is accelerated"}
"""Of links that turn about their only points."""
SIMPLE = re.compile(f"{LETTER}+{PRIME}*")
"""A letter as textbooks have it, with digits and primes, or a word; any other text is shown as it stands."""
LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
Ends = tuple[str, str]
"""Two letters."""


def polygon_picture(polygon: Polygon, scale: Scale | None = None) -> Picture:
    """A polygon in mm on paper, its pole at the origin; at a round scale that fits the paper unless one is given.

    Of velocities every vector of the construction is an arrow. Of accelerations the parts are thin arrows, and the
    totals strong: arrows where they start at the pole or are of one part, else lines, which may be read both ways.
    Points that follow from others of their link stand in its image. Strokes are `about` "velocity B/A",
    "centripetal C/B", "acceleration C/B", "image BC", "tick e" or "pole", letters about "letter b_1".
    """
    values = np.array([(0.0, 0.0), *polygon.letters.values()])
    still = float(np.hypot(*values.T).max()) <= NOTHING * _most(polygon)
    if still:
        polygon = replace(polygon, letters={letter: np.zeros(2) for letter in polygon.letters})
        values = 0.0 * values
    if scale is None:
        width, height = np.ptp(values, axis=0)
        scale = fitting(polygon.kind, own(polygon.kind, polygon.state.mechanism.units)[0], float(width), float(height))
    said = (
        TURNING
        if any(link.angular_velocity or link.angular_acceleration for link in polygon.state.links.values())
        and _most(polygon)
        else STILL
    )[polygon.kind]
    notes = [f"{polygon.kind} polygon".capitalize(), *([said] if still else [str(scale), scale.mu])]
    if len(polygon.pole) > MANY:
        notes.append(f"at the pole: {', '.join(polygon.points[letter] for letter in polygon.pole)}")
    notes += [] if still else _legend(polygon)
    return Picture(_Sheet(polygon, scale).marks(), polygon.state.mechanism.name, tuple(notes))


def letter_text(polygon: Polygon, letter: str) -> tuple[str, bool]:
    """How a letter is written (b, b with index 1, b with index a), and whether that is mathtext."""
    base, index = _indexed(polygon, letter)
    if index and SIMPLE.fullmatch(base) and (index == "1" or SIMPLE.fullmatch(index)):
        return f"${base}_{{{index}}}$".replace(PRIME, "'"), True
    if index:
        base += index.translate(LOWERED) if index == "1" else f"_{index}"
    return _primed(base), False


def _primed(base: str) -> str:
    """A letter with its primes as one character."""
    return base.replace(PRIME * 3, "‴").replace(PRIME * 2, "″")


def _legend(polygon: Polygon) -> list[str]:
    """What letters stand for that are not those of points in the space diagram."""
    below = {_primed(_indexed(polygon, letter)[0]): at for letter, at in polygon.below.items()}
    parts = any(letter not in polygon.points for letter in polygon.letters)
    return legend(1 if polygon.kind == "velocity" else 2, below, polygon.state.mechanism.frame, parts)


def _indexed(polygon: Polygon, letter: str) -> Ends:
    """A letter without its index, and the index; points' names may have underscores of their own."""
    if polygon.kind == "velocity":
        return letter, ""
    if letter in polygon.points:
        return letter.removesuffix("_1"), "1"
    owner = next((vector.of for vector in _vectors(polygon) if vector.head == letter), None)
    bases = (each.removesuffix("_1") for each, point in polygon.points.items() if point == owner)
    base = next((each for each in bases if letter.startswith(f"{each}_")), letter)
    return base, letter[len(base) + 1 :]


def _vectors(polygon: Polygon) -> Iterator[Vector]:
    """All vectors in the order of drawing."""
    for stage in polygon.stages:
        for side in stage.sides if isinstance(stage, Meeting) else ():
            yield from side.vectors


def _totals(stage: Meeting) -> Iterator[tuple[Vector, ...]]:
    """The vectors of a meeting, those of one relative motion together."""
    for side in stage.sides:
        for _, parts in groupby(side.vectors, key=lambda vector: (vector.of, vector.against)):
            yield tuple(parts)


def _most(polygon: Polygon) -> float:
    """What velocities (m/s) or accelerations (m/s^2) could be, as fast as links turn and points move."""
    points, links = polygon.state.points.values(), polygon.state.links.values()
    size = float(np.ptp([point.position for point in points], axis=0).max()) if points else 0.0
    turning = max((abs(link.angular_velocity) for link in links), default=0.0)
    if polygon.kind == "velocity":
        return turning * size
    fastest = max((hypot(*point.velocity) for point in points), default=0.0)
    hardest = max((abs(link.angular_acceleration) for link in links), default=0.0)
    return max(turning**2, hardest) * size + (fastest**2 / size if size else 0.0)


class _Sheet:
    """The marks of one polygon at a scale."""

    def __init__(self, polygon: Polygon, scale: Scale):
        self.polygon = polygon
        self.pen = PENS[polygon.kind]
        self.spots = {letter: spot(value / scale.per_mm) for letter, value in polygon.letters.items()}
        self.fixed = frozenset(polygon.pole)
        self.letter_of = {point: letter for letter, point in polygon.points.items()}
        self.joined: set[frozenset[str]] = set()
        "letters between which there is a stroke"

    def marks(self) -> tuple[Mark, ...]:
        """Images below parts, parts below totals; the letters last."""
        strong = [*self._strong()]
        thin = [*self._images(), *self._parts()]
        return (Circle((0.0, 0.0), POLE, self.pen, "pole"), *thin, *strong, *self._letters())

    def _strong(self) -> Iterator[Mark]:
        """Velocities as they are, accelerations by their totals; of links found together those about fixed pins."""
        for stage in self.polygon.stages:
            if isinstance(stage, Meeting):
                for parts in _totals(stage):
                    ends = parts[0].tail, parts[-1].head
                    alone = len(self._seen(parts)) < 2
                    yield from self._total(ends, parts[0].of, parts[0].against, alone or ends[0] in self.fixed)
            elif isinstance(stage, Simultaneous):
                for link in stage.links:
                    yield from self._about_pins(link, stage)
                yield from self._slides(stage)

    def _about_pins(self, link: str, stage: Simultaneous) -> Iterator[Mark]:
        """Of a link that was found together with others what turns about a fixed pin of it."""
        letters = self._of_link(link, stage)
        pin = next((letter for letter in letters if letter in self.fixed), None)
        for letter in letters if pin else ():
            of, against = (self.polygon.points[each] for each in (letter, pin))
            yield from self._total((pin, letter), of, against, True)

    def _slides(self, stage: Simultaneous) -> Iterator[Mark]:
        """What slides among links that were found together: from the point below to the point that slides."""
        known = self._known(stage)
        for slide in self._rates.slides:
            head = self.letter_of.get(self._names[slide.rider, slide.point])
            tail = next((each for each in known if self._lies_below(each, slide)), None)
            if head not in known or tail is None or not {*slide.members} & {*stage.links}:
                continue
            if head in self.fixed:
                head, tail = tail, head
            of, against = (self.polygon.points[each] for each in (head, tail))
            yield from self._total((tail, head), of, against, tail in self.fixed or self.polygon.kind == "velocity")

    def _lies_below(self, letter: str, slide: Slide) -> bool:
        """Whether a letter is that of the guide's point where a slide is; of fixed ones any will do."""
        point = self.polygon.points[letter]
        if point in self._names.values():
            return False
        if slide.guide == self.polygon.state.mechanism.frame:
            return letter in self.fixed
        return point.rstrip(PRIME) == self._names[slide.rider, slide.point] and slide.guide in self._carriers[letter]

    def _total(self, ends: Ends, of: str, against: str, pointed: bool) -> Iterator[Mark]:
        if self._joins(*ends):
            about = f"{self.polygon.kind} {of}/{against}"
            tail, head = (self.spots[each] for each in ends)
            yield Arrow(tail, head, self.pen, about) if pointed else Line((tail, head), self.pen, about)

    def _parts(self) -> Iterator[Mark]:
        """The parts of accelerations, where a total has more than one that can be seen."""
        done: set[Ends] = set()
        for stage in self.polygon.stages:
            for parts in _totals(stage) if isinstance(stage, Meeting) else ():
                seen = self._seen(parts)
                for each in seen if len(seen) > 1 else ():
                    if (each.tail, each.head) not in done:
                        done.add((each.tail, each.head))
                        about = f"{each.part.value} {each.of}/{each.against}"
                        yield Arrow(self.spots[each.tail], self.spots[each.head], Pen.PART, about)

    def _seen(self, parts: Sequence[Vector]) -> list[Vector]:
        return [each for each in parts if self._apart(each.tail, each.head)]

    def _images(self) -> Iterator[Mark]:
        for stage in self.polygon.stages:
            if isinstance(stage, Triangle) and stage.sense != "same":
                yield from self._image(stage)
            elif isinstance(stage, Simultaneous):
                for link in stage.links:
                    yield from self._whole(link, self._of_link(link, stage))

    def _image(self, stage: Triangle) -> Iterator[Mark]:
        """A point of a link by its triangle, or by a tick on its line, which is drawn on to it."""
        one, other, found = (self.letter_of[point] for point in (*stage.base, stage.point))
        yield from self._side(one, other, stage.link)
        if stage.sense:
            yield from self._side(one, found, stage.link)
            yield from self._side(other, found, stage.link)
        elif 0.0 <= stage.ratio <= 1.0:
            yield from self._tick(found, (one, other))
        else:
            yield from self._side(one if stage.ratio < 0.0 else other, found, stage.link)

    def _whole(self, link: str, letters: Sequence[str]) -> Iterator[Mark]:
        """A link by all its letters: a line with ticks, or its outline."""
        if len(letters) < 2:
            return
        base = max(combinations(letters, 2), key=lambda ends: self._distance(*ends))
        if all(self._beside(letter, base) <= SHORTEST for letter in letters):
            along = sorted(letters, key=lambda letter: self.spots[letter])
            if not all(self._is_joined(*ends) for ends in pairwise(along)):
                yield from self._side(*base, link)
            for letter in letters:
                yield from self._tick(letter, base)
            return
        middle = np.mean([self.spots[letter] for letter in letters], axis=0)
        about = sorted(letters, key=lambda letter: atan2(*(np.array(self.spots[letter]) - middle)))
        for one, other in pairwise([*about, about[0]]):
            yield from self._side(one, other, link)

    def _side(self, one: str, other: str, link: str) -> Iterator[Mark]:
        if self._joins(one, other):
            yield Line((self.spots[one], self.spots[other]), Pen.IMAGE, f"image {link}")

    def _tick(self, letter: str, base: Ends) -> Iterator[Mark]:
        if self._apart(*base) and all(self._apart(letter, end) for end in base):
            (x, y), (left, low), (right, high) = self.spots[letter], *(self.spots[end] for end in base)
            half = TICK / 2.0 / self._distance(*base)
            across, up = half * (low - high), half * (right - left)
            yield Line(((x - across, y - up), (x + across, y + up)), Pen.IMAGE, f"tick {letter}")

    def _letters(self) -> Iterator[Letter]:
        """Every letter at its spot, those of the pole first and clear of its ring; of very many there a few."""
        for letter in dict.fromkeys((*self.polygon.pole, *self.polygon.letters)):
            away = POLE + 0.4 if self._distance(letter) <= POLE else 0.7
            place = self.spots[letter], f"letter {letter}"
            text, math = letter_text(self.polygon, letter)
            if letter not in self.polygon.pole[FEW:-1] or len(self.polygon.pole) <= MANY:
                yield Letter(text, *place, away=away, slanted=not math, math=math)
            elif letter == self.polygon.pole[FEW]:
                yield Letter("…", *place, away=away, slanted=not math)

    def _distance(self, one: str, other: str | None = None) -> float:
        """From one letter to another, or to the pole (mm)."""
        (x, y), (u, v) = self.spots[one], self.spots[other] if other else (0.0, 0.0)
        return hypot(x - u, y - v)

    def _apart(self, one: str, other: str) -> bool:
        return self._distance(one, other) > SHORTEST

    def _beside(self, letter: str, base: Ends) -> float:
        """The distance of a letter from the line through two others (mm)."""
        (x, y), (left, low), (right, high) = self.spots[letter], *(self.spots[end] for end in base)
        length = self._distance(*base)
        return abs((right - left) * (y - low) - (high - low) * (x - left)) / length if length else 0.0

    def _joins(self, one: str, other: str) -> bool:
        """Whether a stroke between two letters is still to be drawn; it is from now on."""
        if self._is_joined(one, other):
            return False
        self.joined.add(frozenset((one, other)))
        return True

    def _is_joined(self, one: str, other: str) -> bool:
        return frozenset((one, other)) in self.joined or not self._apart(one, other)

    def _of_link(self, link: str, stage: Simultaneous) -> list[str]:
        """The letters of a link that are there when it is found together with others."""
        return [each for each in self._known(stage) if link in self._carriers[each]]

    def _known(self, stage: Simultaneous) -> list[str]:
        """Letters of points that are there as soon as links are found together."""
        known = {*self.polygon.pole, *stage.letters}
        for before in takewhile(lambda each: each is not stage, self.polygon.stages):
            if isinstance(before, Meeting):
                known |= {before.letter, *(vector.head for side in before.sides for vector in side.vectors)}
            elif isinstance(before, Triangle):
                known.add(self.letter_of[before.point])
            elif isinstance(before, Simultaneous):
                known |= set(before.letters)
        return [each for each in self.polygon.points if each in known]

    @cached_property
    def _carriers(self) -> Mapping[str, frozenset[str]]:
        """The links that have a letter's point; where that only lies below another (A′), those that move as it does."""
        state, order = self.polygon.state, 1 if self.polygon.kind == "velocity" else 2
        sliding = {link for slide in self._rates.slides for link in slide.members}
        found = dict.fromkeys(self.polygon.letters, frozenset[str]())
        for letter, point in self.polygon.points.items():
            below = point.rstrip(PRIME)
            if point in self._names.values():
                found[letter] = frozenset(link for (link, _), name in self._names.items() if name == point)
            elif below in self._names.values():
                place, value = state.point(below).position, self.polygon.letters[letter]
                moved = {link: self._rates.carried(link, self._rates.pinned(link, place), order) for link in sliding}
                reach = 1e-9 * max(hypot(*each) for each in self.polygon.letters.values())
                found[letter] = frozenset(link for link, each in moved.items() if hypot(*(each - value)) <= reach)
        return found

    @cached_property
    def _rates(self) -> Rates:
        return rates(self.polygon.state)

    @cached_property
    def _names(self) -> Mapping[Ends, str]:
        """The result name of every (link, point)."""
        return {member: each.name for each in named_points(self.polygon.state.mechanism) for member in each.members}
