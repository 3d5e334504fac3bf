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
from planar.analysis.polygons.polygon import Meeting, PointImage, Polygon, PolygonVector, SimultaneousSolution
from planar.analysis.rate_equations import RateEquations, SlideJoint, rate_equations
from planar.drawing.labels.text_line import LETTER_PATTERN
from planar.drawing.paper.picture import Arrow, Circle, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import Scale, round_scale
from planar.drawing.scheme.link_bodies import outline_point_names
from planar.model.file_units import unit_of_kind
from planar.model.mechanism import named_points

SAME_POINT_DISTANCE = 0.05
"""mm within which two letters are at one spot, and what joins them is none."""
TICK_LENGTH, POLE_RADIUS = 2.2, 0.7
"""mm: the mark across a line where a point lies on it; the radius of the ring at the pole."""
ROUND_OFF_RATIO = 1e-10
"""Of what the motion of the links could bring with it: a polygon smaller than that is a point."""
MAX_POLE_LETTERS, FEW_POLE_LETTERS = 8, 3
"""Of more letters than that at the pole only the first few are shown, and the last."""
POLYGON_PENS = {"velocity": Pen.VELOCITY, "acceleration": Pen.ACCELERATION}
AT_REST_NOTES = {"velocity": "everything is at rest", "acceleration": "nothing is accelerated"}
POINTS_AT_REST_NOTES = {"velocity": "no lettered point moves", "acceleration": "no lettered point is accelerated"}
"""Of links that turn about their only points."""
SIMPLE_LETTER = re.compile(f"{LETTER_PATTERN}+{PRIME}*")
"""A letter as textbooks have it, with digits and primes, or a word; any other text is shown as it stands."""
SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
LetterPair = tuple[str, str]
"""Two letters."""


def polygon_picture(polygon: Polygon, scale: Scale | None = None) -> Picture:
    """A polygon in mm on paper, its pole at the origin; at a round scale that fits the paper unless one is given.

    Of velocities every vector of the construction is an arrow. Of accelerations the parts are thin arrows, and the
    totals strong: arrows where they start at the pole or are of one part, else lines, which may be read both ways.
    Points that follow from others of their link stand in its image. Strokes are `about` "velocity B/A",
    "centripetal C/B", "acceleration C/B", "image BC", "tick e" or "pole", letters about "letter b_1". Points of the
    outlines of links are left out.
    """
    polygon = _without_outlines(polygon)
    values = np.array([(0.0, 0.0), *polygon.letters.values()])
    still = float(np.hypot(*values.T).max()) <= ROUND_OFF_RATIO * _largest_possible(polygon)
    if still:
        polygon = replace(polygon, letters={letter: np.zeros(2) for letter in polygon.letters})
        values = 0.0 * values
    if scale is None:
        width, height = np.ptp(values, axis=0)
        scale = round_scale(
            polygon.kind, unit_of_kind(polygon.kind, polygon.state.mechanism.units)[0], float(width), float(height)
        )
    said = (
        POINTS_AT_REST_NOTES
        if any(link.angular_velocity or link.angular_acceleration for link in polygon.state.links.values())
        and _largest_possible(polygon)
        else AT_REST_NOTES
    )[polygon.kind]
    notes = [f"{polygon.kind} polygon".capitalize(), *([said] if still else [str(scale), scale.calculating_scale])]
    if len(polygon.pole) > MAX_POLE_LETTERS:
        notes.append(f"at the pole: {', '.join(polygon.points[letter] for letter in polygon.pole)}")
    notes += [] if still else _legend(polygon)
    return Picture(_PolygonDrawing(polygon, scale).marks(), polygon.state.mechanism.name, tuple(notes))


def _without_outlines(polygon: Polygon) -> Polygon:
    """The polygon without the points of the outlines of links, but for those by which other points are found."""
    images = [stage for stage in polygon.stages if isinstance(stage, PointImage)]
    hidden = outline_point_names(polygon.state.mechanism, polygon.state.shapes)
    hidden -= {point for stage in images if stage.point not in hidden for point in stage.base}
    letters = {letter for letter, point in polygon.points.items() if point in hidden}
    if not letters:
        return polygon
    return replace(
        polygon,
        pole=tuple(letter for letter in polygon.pole if letter not in letters),
        letters={letter: value for letter, value in polygon.letters.items() if letter not in letters},
        points={letter: point for letter, point in polygon.points.items() if letter not in letters},
        stages=tuple(
            stage for stage in polygon.stages if not (isinstance(stage, PointImage) and stage.point in hidden)
        ),
    )


def letter_text(polygon: Polygon, letter: str) -> tuple[str, bool]:
    """How a letter is written (b, b with index 1, b with index a), and whether that is mathtext."""
    base, index = _split_index(polygon, letter)
    if index and SIMPLE_LETTER.fullmatch(base) and (index == "1" or SIMPLE_LETTER.fullmatch(index)):
        return f"${base}_{{{index}}}$".replace(PRIME, "'"), True
    if index:
        base += index.translate(SUBSCRIPTS) if index == "1" else f"_{index}"
    return _join_primes(base), False


def _join_primes(base: str) -> str:
    """A letter with its primes as one character."""
    return base.replace(PRIME * 3, "‴").replace(PRIME * 2, "″")


def _legend(polygon: Polygon) -> list[str]:
    """What letters stand for that are not those of points in the space diagram."""
    below = {_join_primes(_split_index(polygon, letter)[0]): at for letter, at in polygon.points_underneath.items()}
    parts = any(letter not in polygon.points for letter in polygon.letters)
    return legend(1 if polygon.kind == "velocity" else 2, below, polygon.state.mechanism.frame, parts)


def _split_index(polygon: Polygon, letter: str) -> LetterPair:
    """A letter without its index, and the index; points' names may have underscores of their own."""
    if polygon.kind == "velocity":
        return letter, ""
    if letter in polygon.points:
        return letter.removesuffix("_1"), "1"
    owner = next((vector.of for vector in _all_vectors(polygon) if vector.head == letter), None)
    bases = (each.removesuffix("_1") for each, point in polygon.points.items() if point == owner)
    base = next((each for each in bases if letter.startswith(f"{each}_")), letter)
    return base, letter[len(base) + 1 :]


def _all_vectors(polygon: Polygon) -> Iterator[PolygonVector]:
    """All vectors in the order of drawing."""
    for stage in polygon.stages:
        for side in stage.sides if isinstance(stage, Meeting) else ():
            yield from side.vectors


def _relative_motions(stage: Meeting) -> Iterator[tuple[PolygonVector, ...]]:
    """The vectors of a meeting, those of one relative motion together."""
    for side in stage.sides:
        for _, parts in groupby(side.vectors, key=lambda vector: (vector.of, vector.against)):
            yield tuple(parts)


def _largest_possible(polygon: Polygon) -> float:
    """What velocities (m/s) or accelerations (m/s^2) could be, as fast as links turn and points move."""
    points, links = polygon.state.points.values(), polygon.state.links.values()
    size = float(np.ptp([point.position for point in points], axis=0).max()) if points else 0.0
    turning = max((abs(link.angular_velocity) for link in links), default=0.0)
    if polygon.kind == "velocity":
        return turning * size
    fastest = max((hypot(*point.velocity) for point in points), default=0.0)
    hardest = max((abs(link.angular_acceleration) for link in links), default=0.0)
    return max(turning**2, hardest) * size + (fastest**2 / size if size else 0.0)


class _PolygonDrawing:
    """The marks of one polygon at a scale."""

    def __init__(self, polygon: Polygon, scale: Scale):
        self.polygon = polygon
        self.pen = POLYGON_PENS[polygon.kind]
        self.paper_points = {letter: paper_point(value / scale.per_mm) for letter, value in polygon.letters.items()}
        self.pole_letters = frozenset(polygon.pole)
        self.letter_of = {point: letter for letter, point in polygon.points.items()}
        self.joined_pairs: set[frozenset[str]] = set()
        "letters between which there is a stroke"

    def marks(self) -> tuple[Mark, ...]:
        """Images below parts, parts below totals; the letters last."""
        strong = [*self._total_strokes()]
        thin = [*self._image_strokes(), *self._part_arrows()]
        return (Circle((0.0, 0.0), POLE_RADIUS, self.pen, "pole"), *thin, *strong, *self._letter_labels())

    def _total_strokes(self) -> Iterator[Mark]:
        """Velocities as they are, accelerations by their totals; of links found together those about fixed pins."""
        for stage in self.polygon.stages:
            if isinstance(stage, Meeting):
                for parts in _relative_motions(stage):
                    ends = parts[0].tail, parts[-1].head
                    alone = len(self._visible_parts(parts)) < 2
                    yield from self._total_stroke(
                        ends, parts[0].of, parts[0].against, alone or ends[0] in self.pole_letters
                    )
            elif isinstance(stage, SimultaneousSolution):
                for link in stage.links:
                    yield from self._strokes_about_pins(link, stage)
                yield from self._slide_strokes(stage)

    def _strokes_about_pins(self, link: str, stage: SimultaneousSolution) -> Iterator[Mark]:
        """Of a link that was found together with others what turns about a fixed pin of it."""
        letters = self._letters_of_link(link, stage)
        pin = next((letter for letter in letters if letter in self.pole_letters), None)
        if not pin:
            return
        for letter in letters:
            of, against = (self.polygon.points[each] for each in (letter, pin))
            yield from self._total_stroke((pin, letter), of, against, True)

    def _slide_strokes(self, stage: SimultaneousSolution) -> Iterator[Mark]:
        """What slides among links that were found together: from the point below to the point that slides."""
        known = self._known_letters(stage)
        for slide in self._rate_equations.slides:
            head = self.letter_of.get(self._point_names[slide.rider, slide.point])
            tail = next((each for each in known if self._lies_below(each, slide)), None)
            if head not in known or tail is None or not {*slide.members} & {*stage.links}:
                continue
            if head in self.pole_letters:
                head, tail = tail, head
            of, against = (self.polygon.points[each] for each in (head, tail))
            yield from self._total_stroke(
                (tail, head), of, against, tail in self.pole_letters or self.polygon.kind == "velocity"
            )

    def _lies_below(self, letter: str, slide: SlideJoint) -> bool:
        """Whether a letter is that of the guide's point where a slide is; of fixed ones any will do."""
        point = self.polygon.points[letter]
        if point in self._point_names.values():
            return False
        if slide.guide == self.polygon.state.mechanism.frame:
            return letter in self.pole_letters
        return (
            point.rstrip(PRIME) == self._point_names[slide.rider, slide.point] and slide.guide in self._carriers[letter]
        )

    def _total_stroke(self, ends: LetterPair, of: str, against: str, pointed: bool) -> Iterator[Mark]:
        if self._join(*ends):
            about = f"{self.polygon.kind} {of}/{against}"
            tail, head = (self.paper_points[each] for each in ends)
            yield Arrow(tail, head, self.pen, about) if pointed else Polyline((tail, head), self.pen, about)

    def _part_arrows(self) -> Iterator[Mark]:
        """The parts of accelerations, where a total has more than one that can be seen."""
        done: set[LetterPair] = set()
        for stage in self.polygon.stages:
            for parts in _relative_motions(stage) if isinstance(stage, Meeting) else ():
                seen = self._visible_parts(parts)
                for each in seen if len(seen) > 1 else ():
                    if (each.tail, each.head) not in done:
                        done.add((each.tail, each.head))
                        about = f"{each.part.value} {each.of}/{each.against}"
                        yield Arrow(self.paper_points[each.tail], self.paper_points[each.head], Pen.PART, about)

    def _visible_parts(self, parts: Sequence[PolygonVector]) -> list[PolygonVector]:
        return [each for each in parts if self._are_apart(each.tail, each.head)]

    def _image_strokes(self) -> Iterator[Mark]:
        for stage in self.polygon.stages:
            if isinstance(stage, PointImage) and stage.sense != "same":
                yield from self._point_image(stage)
            elif isinstance(stage, SimultaneousSolution):
                for link in stage.links:
                    yield from self._link_image(link, self._letters_of_link(link, stage))

    def _point_image(self, stage: PointImage) -> Iterator[Mark]:
        """A point of a link by its triangle, or by a tick on its line, which is drawn on to it."""
        one, other, found = (self.letter_of[point] for point in (*stage.base, stage.point))
        yield from self._image_side(one, other, stage.link)
        if stage.sense:
            yield from self._image_side(one, found, stage.link)
            yield from self._image_side(other, found, stage.link)
        elif 0.0 <= stage.ratio <= 1.0:
            yield from self._tick_mark(found, (one, other))
        else:
            yield from self._image_side(one if stage.ratio < 0.0 else other, found, stage.link)

    def _link_image(self, link: str, letters: Sequence[str]) -> Iterator[Mark]:
        """A link by all its letters: a line with ticks, or its outline."""
        if len(letters) < 2:
            return
        base = max(combinations(letters, 2), key=lambda ends: self._distance(*ends))
        if all(self._distance_from_base(letter, base) <= SAME_POINT_DISTANCE for letter in letters):
            along = sorted(letters, key=lambda letter: self.paper_points[letter])
            if not all(self._is_joined(*ends) for ends in pairwise(along)):
                yield from self._image_side(*base, link)
            for letter in letters:
                yield from self._tick_mark(letter, base)
            return
        middle = np.mean([self.paper_points[letter] for letter in letters], axis=0)
        about = sorted(letters, key=lambda letter: atan2(*(np.array(self.paper_points[letter]) - middle)))
        for one, other in pairwise([*about, about[0]]):
            yield from self._image_side(one, other, link)

    def _image_side(self, one: str, other: str, link: str) -> Iterator[Mark]:
        if self._join(one, other):
            yield Polyline((self.paper_points[one], self.paper_points[other]), Pen.IMAGE, f"image {link}")

    def _tick_mark(self, letter: str, base: LetterPair) -> Iterator[Mark]:
        if self._are_apart(*base) and all(self._are_apart(letter, end) for end in base):
            (x, y), (left, low), (right, high) = self.paper_points[letter], *(self.paper_points[end] for end in base)
            half = TICK_LENGTH / 2.0 / self._distance(*base)
            across, up = half * (low - high), half * (right - left)
            yield Polyline(((x - across, y - up), (x + across, y + up)), Pen.IMAGE, f"tick {letter}")

    def _letter_labels(self) -> Iterator[Label]:
        """Every letter at its spot, those of the pole first and clear of its ring; of very many there a few."""
        for letter in dict.fromkeys((*self.polygon.pole, *self.polygon.letters)):
            away = POLE_RADIUS + 0.4 if self._distance(letter) <= POLE_RADIUS else 0.7
            place = self.paper_points[letter], f"letter {letter}"
            text, math = letter_text(self.polygon, letter)
            if letter not in self.polygon.pole[FEW_POLE_LETTERS:-1] or len(self.polygon.pole) <= MAX_POLE_LETTERS:
                yield Label(text, *place, clearance=away, slanted=not math, math=math)
            elif letter == self.polygon.pole[FEW_POLE_LETTERS]:
                yield Label("…", *place, clearance=away, slanted=not math)

    def _distance(self, one: str, other: str | None = None) -> float:
        """From one letter to another, or to the pole (mm)."""
        (x, y), (u, v) = self.paper_points[one], self.paper_points[other] if other else (0.0, 0.0)
        return hypot(x - u, y - v)

    def _are_apart(self, one: str, other: str) -> bool:
        return self._distance(one, other) > SAME_POINT_DISTANCE

    def _distance_from_base(self, letter: str, base: LetterPair) -> float:
        """The distance of a letter from the line through two others (mm)."""
        (x, y), (left, low), (right, high) = self.paper_points[letter], *(self.paper_points[end] for end in base)
        length = self._distance(*base)
        return abs((right - left) * (y - low) - (high - low) * (x - left)) / length if length else 0.0

    def _join(self, one: str, other: str) -> bool:
        """Whether a stroke between two letters is still to be drawn; it is from now on."""
        if self._is_joined(one, other):
            return False
        self.joined_pairs.add(frozenset((one, other)))
        return True

    def _is_joined(self, one: str, other: str) -> bool:
        return frozenset((one, other)) in self.joined_pairs or not self._are_apart(one, other)

    def _letters_of_link(self, link: str, stage: SimultaneousSolution) -> list[str]:
        """The letters of a link that are there when it is found together with others."""
        return [each for each in self._known_letters(stage) if link in self._carriers[each]]

    def _known_letters(self, stage: SimultaneousSolution) -> list[str]:
        """Letters of points that are there as soon as links are found together."""
        known = {*self.polygon.pole, *stage.letters}
        for before in takewhile(lambda each: each is not stage, self.polygon.stages):
            if isinstance(before, Meeting):
                known |= {before.letter, *(vector.head for side in before.sides for vector in side.vectors)}
            elif isinstance(before, PointImage):
                known.add(self.letter_of[before.point])
            elif isinstance(before, SimultaneousSolution):
                known |= set(before.letters)
        return [each for each in self.polygon.points if each in known]

    @cached_property
    def _carriers(self) -> Mapping[str, frozenset[str]]:
        """The links that have a letter's point; where that only lies below another (A′), those that move as it does."""
        state, order = self.polygon.state, 1 if self.polygon.kind == "velocity" else 2
        sliding = {link for slide in self._rate_equations.slides for link in slide.members}
        found = dict.fromkeys(self.polygon.letters, frozenset[str]())
        for letter, point in self.polygon.points.items():
            below = point.rstrip(PRIME)
            if point in self._point_names.values():
                found[letter] = frozenset(link for (link, _), name in self._point_names.items() if name == point)
            elif below in self._point_names.values():
                place, value = state.point(below).position, self.polygon.letters[letter]
                moved = {
                    link: self._rate_equations.point_motion(
                        link, self._rate_equations.local_point_at(link, place), order
                    )
                    for link in sliding
                }
                reach = 1e-9 * max(hypot(*each) for each in self.polygon.letters.values())
                found[letter] = frozenset(link for link, each in moved.items() if hypot(*(each - value)) <= reach)
        return found

    @cached_property
    def _rate_equations(self) -> RateEquations:
        return rate_equations(self.polygon.state)

    @cached_property
    def _point_names(self) -> Mapping[LetterPair, str]:
        """The result name of every (link, point)."""
        return {member: each.name for each in named_points(self.polygon.state.mechanism) for member in each.members}
