"""Drawing the polygons of a position as a pencil would: from what is known, point after point, each by two lines."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from planar.analysis.polygons.lettering import Lettering, joined
from planar.analysis.polygons.loop_equations import loops
from planar.analysis.polygons.polygon import (
    Factor,
    Meeting,
    Part,
    Polygon,
    Side,
    Simultaneous,
    Stage,
    Triangle,
    Turn,
    Unknown,
    Vector,
)
from planar.analysis.rate_equations import Pin, Rate, Slide, classes, moving, rates
from planar.analysis.vector_chains import NEAR, Known, Leg, Place, Walk, Walks
from planar.equations.functions import program
from planar.model.mechanism import named_points
from planar.model.wording import STILL, heading, turning
from planar.results.motion import State

Array = np.ndarray
NONE = 1e-10
"""A rate below this part of the greatest of its kind is none."""


def velocity_polygon(state: State) -> Polygon:
    """The velocity polygon of a position (m/s), with the order in which it can be drawn."""
    return _Pencil(state, 1).drawn()


def acceleration_polygon(state: State) -> Polygon:
    """The acceleration polygon of a position (m/s^2), with the order in which it can be drawn."""
    return _Pencil(state, 2).drawn()


class _Pencil:
    """One polygon while it is drawn; `order` 1 for velocities, 2 for accelerations."""

    def __init__(self, state: State, order: int):
        self.order = order
        self.state = state
        self.frame = state.mechanism.frame
        self.rates = rates(state)
        self.named = named_points(state.mechanism)
        self.names = {member: each.name for each in self.named for member in each.members}
        spots = np.array([self.rates.at(*each.members[0]) for each in self.named])
        self.size = float(np.ptp(spots, axis=0).max(initial=0.0)) or 1.0
        self.walks = Walks(self.rates, self.names, self.size)
        self.alike = classes(self.rates.ties)
        self.placed: dict[str, None] = {self.frame: None}
        self.known = {self._stands(Rate(self.frame))}
        self.lettering = Lettering(self.rates, self.named, self.frame, order)
        self.letters: dict[str, Array] = {}
        self.pole: list[str] = []
        self.stages: list[Stage] = []
        links = moving(state.mechanism)
        self.fastest = max((abs(self.rates.value(Rate(link))) for link in links), default=0.0)
        self.hardest = max((abs(self.rates.value(Rate(link), 2)) for link in links), default=0.0)
        self.hardest = max(self.hardest, self.fastest**2)

    def drawn(self) -> Polygon:
        """The whole polygon."""
        self._settle()
        while left := [link for link in moving(self.state.mechanism) if link not in self.placed]:
            walk = self.walks.best(self._known())
            if walk is None:
                self._together(self._group(left), left)
            else:
                self._walk(walk)
            self._settle()
        for each in self.named:
            moved = [member for member in each.members if member[0] != self.frame]
            if moved:
                self._locate(Place(moved[0][0], self.rates.local(*moved[0]), each.name))
        shown = {letter: point for letter, point in self.lettering.points.items() if letter in self.letters}
        kind = "velocity" if self.order == 1 else "acceleration"
        return Polygon(
            self.state, kind, tuple(self.pole), self.letters, shown, tuple(self.stages), self.lettering.below(shown)
        )

    def _stands(self, rate: Rate) -> Rate:
        return self.alike.get(rate, rate)

    def _known(self) -> Known:
        return Known(tuple(reversed(self.placed)), frozenset(self.known), self.alike)

    def _knows(self, rate: Rate) -> bool:
        return self._stands(rate) in self.known

    def _settle(self) -> None:
        """Rates that ties give, and links that are known as soon as their turning is."""
        changed = True
        while changed:
            changed = False
            for tie in self.rates.ties:
                slopes: dict[Rate, float] = {}
                for rate, slope in tie.slopes.items():
                    slopes[self._stands(rate)] = slopes.get(self._stands(rate), 0.0) + slope
                open_ones = [rate for rate, slope in slopes.items() if rate not in self.known and abs(slope) > NONE]
                if len(open_ones) == 1:
                    self.known.add(open_ones[0])
                    changed = True
                    self._tell(next(rate for rate in tie.slopes if self._stands(rate) == open_ones[0]), tie.pair)
            for link in moving(self.state.mechanism):
                if link not in self.placed and self._knows(Rate(link)) and self._hangs(link):
                    self.placed[link] = None
                    changed = True

    def _tell(self, rate: Rate, pair: str) -> None:
        if rate.turns:
            value = self.rates.value(rate, self.order)
            still = NONE * (self.fastest if self.order == 1 else self.hardest)
            self.stages.append(Turn(rate.owner, value, turning(value, still / STILL), by=pair))

    def _hangs(self, link: str) -> bool:
        """Whether a link whose turning is known hangs on a known one, by a pin or by a slide that is known too."""
        for joint in self.walks.joints(link):
            if not any(other in self.placed for other in joint.members):
                continue
            if isinstance(joint, Pin):
                return True
            if joint.line is not None and self._knows(joint.line[1]):
                self._slid(joint, link)
                return True
        return False

    def _slid(self, slide: Slide, link: str) -> None:
        """The point of a link at a slide from that of the other link, the rate along the slide being known."""
        rider = self.walks.end(slide, slide.rider)
        leg = Leg(self.walks.end(slide, slide.guide), rider, slide.rates[0], slide)
        leg = leg if link == slide.rider else leg.turned_back()
        self._meet((link,), ((leg.tail, (leg,)),), leg.head)

    def _walk(self, walk: Walk) -> None:
        """The point in which two lines meet, and all that is known by it."""
        first, second = walk.legs[: walk.meeting], tuple(leg.turned_back() for leg in walk.legs[walk.meeting :][::-1])
        sides = ((walk.start, first), (walk.stop, second))
        if len(first) == 1 and not second and walk.stop.link == self.frame:  # from the pole, as it is read
            sides = ((walk.stop, (first[0].turned_back(),)), (walk.start, ()))
        meeting = sides[0][1][-1].head if sides[0][1] else walk.start
        self._meet(walk.links, sides if walk.unknown else sides[:1], meeting)
        self.known |= walk.unknown
        self.placed |= dict.fromkeys(walk.links)
        for leg in walk.legs:
            if leg.slide is None and self._stands(leg.rate) in walk.unknown:
                self._measure(leg)

    def _meet(self, links: tuple[str, ...], sides: Sequence[tuple[Place, tuple[Leg, ...]]], meeting: Place) -> None:
        drawn = []
        for start, legs in sides:
            if not legs:
                self._locate(start)
        for start, legs in sides:
            tail, vectors = self._locate(start), []
            begin = tail
            for leg in legs:
                found, tail = self._vectors(leg, tail)
                vectors += found
            drawn += [] if self._repeats(drawn, begin, vectors) else [Side(begin, tuple(vectors))]
        if any(side.vectors for side in drawn):
            letter = self.lettering.letter(meeting)
            self.stages.append(Meeting(links, self.lettering.points[letter], letter, tuple(drawn)))

    @staticmethod
    def _repeats(drawn: Sequence[Side], begin: str, vectors: Sequence[Vector]) -> bool:
        """Whether vectors along a slide are those along another one on the same line, which are known."""
        heads = [vector.head for vector in vectors if vector.part in (Part.SLIDING, Part.CORIOLIS)]
        ways = [[vector.head for vector in side.vectors if vector.known] for side in drawn if side.start == begin]
        return len(heads) == len(vectors) > 0 and heads in ways

    def _locate(self, place: Place) -> str:
        """The letter of a place on a known link, drawn now if it is not yet."""
        letter = self.lettering.letter(place)
        if letter in self.letters:
            return letter
        spots = self.lettering.places[letter]
        if any(spot.link == self.frame for spot in spots):
            self.letters[letter] = np.zeros(2)
            self.pole.append(letter)
            return letter
        spot = next(spot for link in self.placed for spot in spots if spot.link == link)
        located = self.lettering.located(spot.link, self.letters)
        if not located:
            self._reached(spot.link)
            return self._locate(place)
        value = self.rates.carried(spot.link, spot.local, self.order)
        base = located[0]
        reach = max(float(np.hypot(*self.rates.carried(place.link, place.local, self.order))), self._turn(spot.link))
        if self._turn(spot.link) <= NONE * max(reach, self.hardest if self.order == 2 else self.fastest):
            self.letters[letter] = value
            moves_alike = self.lettering.points[base[0]]
            point = self.lettering.points[letter]
            self.stages.append(Triangle(spot.link, (moves_alike, moves_alike), point, 0.0, "same"))
        elif len(located) == 1:
            self._meet((spot.link,), ((base[1], (Leg(base[1], spot, Rate(spot.link)),)),), spot)
        else:
            self.letters[letter] = value
            self.stages.append(self._image(spot, located))
        return letter

    def _reached(self, link: str) -> None:
        """A first point of a known link: over a pin or a slide to a link that was known before it."""
        before = list(self.placed)[: list(self.placed).index(link)]
        joints = [joint for joint in self.walks.joints(link) if any(other in before for other in joint.members)]
        joint = next(joint for joint in joints if isinstance(joint, Pin) or joint.line is not None)
        if isinstance(joint, Pin):
            self._locate(self.walks.end(joint, next(other for other in joint.members if other in before)))
        else:
            self._slid(joint, link)

    def _turn(self, link: str) -> float:
        """How a link's image is magnified: by its angular velocity, or by what its accelerations come from (SI)."""
        rate = Rate(link)
        if self.order == 1:
            return abs(self.rates.value(rate))
        return float(np.hypot(self.rates.value(rate, 2), self.rates.value(rate) ** 2))

    def _image(self, place: Place, located: Sequence[tuple[str, Place]]) -> Triangle:
        """A point by its image, from the two drawn points of its link that are farthest apart."""
        spots = {letter: self.walks.at(each) for letter, each in located}
        a, b = max(combinations(spots, 2), key=lambda both: float(np.hypot(*(spots[both[0]] - spots[both[1]]))))
        base, reach = spots[b] - spots[a], self.walks.at(place) - spots[a]
        points = self.lettering.points
        cross = float(base[0] * reach[1] - base[1] * reach[0])
        point = points[self.lettering.letter(place)]
        if abs(cross) <= NEAR * self.size * float(np.hypot(*base)):
            return Triangle(place.link, (points[a], points[b]), point, float(reach @ base / (base @ base)), "")
        sense = "anticlockwise" if cross > 0.0 else "clockwise"
        return Triangle(place.link, (points[a], points[b]), point, self._turn(place.link), sense)

    def _measure(self, leg: Leg) -> None:
        """How fast a link turns, from the vector that was drawn for it."""
        value = self.rates.value(leg.rate, self.order)
        tail, head = (self.lettering.letter(place) for place in (leg.tail, leg.head))
        vectors = (
            v for stage in self.stages if isinstance(stage, Meeting) for side in stage.sides for v in side.vectors
        )
        drawn = next(v for v in vectors if {v.tail, v.head} & {tail, head} and self._is(v, leg))
        length = float(np.hypot(*(self.walks.at(leg.head) - self.walks.at(leg.tail))))
        still = NONE * (self.fastest if self.order == 1 else self.hardest)
        self.stages.append(
            Turn(
                leg.rate.owner,
                value,
                turning(value, still / STILL),
                (drawn.tail, drawn.head),
                abs(value) * length,
                drawn.line,
                length,
            )
        )

    def _is(self, vector: Vector, leg: Leg) -> bool:
        points = {self.lettering.shown(leg.tail), self.lettering.shown(leg.head)}
        return {vector.of, vector.against} == points and vector.part in (Part.ROTATION, Part.TANGENTIAL)

    def _vectors(self, leg: Leg, tail: str) -> tuple[list[Vector], str]:
        """The vectors of a leg, known ones first, from the letter at its tail; and the letter at its head."""
        if leg.slide is None and float(np.hypot(*self.walks.way(leg))) <= NEAR * self.size:
            self.lettering.same(leg.head, tail)
            return [], tail
        head = self.lettering.letter(leg.head)
        drawn = head in self.letters
        vectors = []
        parts = self._velocity(leg) if self.order == 1 else self._acceleration(leg)
        for index, vector in enumerate(parts):
            end = head
            if index < len(parts) - 1:
                end = self.lettering.between(leg.head, leg.tail)
                self.letters[end] = self.letters[tail] + vector.value
            vectors.append(vector._replace(tail=tail, head=end))
            tail = end
        if not drawn:
            self.letters[head] = self.rates.carried(leg.head.link, leg.head.local, self.order)
        return vectors, head

    def _velocity(self, leg: Leg) -> list[Vector]:
        rate = self.rates.value(leg.rate)
        if leg.slide is not None:
            vector = self._vector(leg, Part.SLIDING, rate * self.walks.way(leg))
            return [self._given(vector, leg, Factor(f"v at {leg.slide.name}", abs(rate), 1, "velocity"))]
        vector = self._vector(leg, Part.ROTATION, rate * self.walks.way(leg))
        turns = Factor(f"ω_{leg.rate.owner}", abs(rate), 1, "angular velocity")
        return [self._given(vector, leg, turns, self._length(leg))]

    def _acceleration(self, leg: Leg) -> list[Vector]:
        return self._of_slide(leg, leg.slide) if leg.slide is not None else self._of_turning(leg)

    def _of_turning(self, leg: Leg) -> list[Vector]:
        """Centripetal and tangential part."""
        rate, second = (self.rates.value(leg.rate, order) for order in (1, 2))
        length = self._length(leg)
        tangential = self._vector(leg, Part.TANGENTIAL, second * self.walks.way(leg))
        turns = Factor(f"α_{leg.rate.owner}", abs(second), 1, "angular acceleration")
        tangential = self._given(tangential, leg, turns, length)
        if abs(rate) <= NONE * self.fastest:
            return [tangential]
        if tangential.known:
            growing = rate * second > 0.0
            tangential = tangential._replace(towards=self.lettering.plain(leg.head if growing else leg.tail))
        speed = Factor(f"({self._chord(leg)})", abs(rate) * length.value, 2, "velocity")
        reach = self.walks.at(leg.head) - self.walks.at(leg.tail)
        centripetal = self._vector(leg, Part.CENTRIPETAL, -(rate**2) * reach)._replace(
            known=True,
            square=False,
            factors=(speed, length._replace(power=-1)),
            towards=self.lettering.shown(leg.tail),
        )
        if tangential.known and abs(second) <= NONE * self.hardest:
            return [centripetal]
        return [centripetal, tangential]

    def _of_slide(self, leg: Leg, slide: Slide) -> list[Vector]:
        """Coriolis part, where the line turns, and what is along the line."""
        rate, second = (self.rates.value(leg.rate, order) for order in (1, 2))
        way = self.walks.way(leg)
        sliding = self._vector(leg, Part.SLIDING, second * way)
        sliding = self._given(sliding, leg, Factor(f"a at {slide.name}", abs(second), 1, "acceleration"))
        turns = self.rates.value(Rate(slide.guide))
        if abs(turns) <= NONE * self.fastest:
            return [sliding]
        value = 2.0 * turns * rate * np.array([-way[1], way[0]])
        factors = (
            Factor("2", 2.0, 1, "pure"),
            Factor(f"ω_{slide.guide}", abs(turns), 1, "angular velocity"),
            Factor(f"({self._chord(leg)})", abs(rate), 1, "velocity"),
        )
        coriolis = self._vector(leg, Part.CORIOLIS, value)
        return [coriolis._replace(known=True, square=True, factors=factors, towards=heading(value)), sliding]

    def _chord(self, leg: Leg) -> str:
        """The vector of the velocity polygon between a leg's points."""
        return f"{self.lettering.plain(leg.tail)}{self.lettering.plain(leg.head)}"

    def _length(self, leg: Leg) -> Factor:
        length = float(np.hypot(*(self.walks.at(leg.head) - self.walks.at(leg.tail))))
        return Factor(joined(self.lettering.shown(leg.tail), self.lettering.shown(leg.head)), length)

    def _vector(self, leg: Leg, part: Part, value: Array) -> Vector:
        """A vector whose direction alone is known."""
        of, against = self.lettering.shown(leg.head), self.lettering.shown(leg.tail)
        if leg.slide is None:
            return Vector(part, of, against, "", "", value, False, True, joined(against, of))
        rider = of if leg.sign > 0.0 else against
        fixed = leg.slide.guide == self.frame
        line = f"line of motion of {rider}" if fixed else f"line on {leg.slide.guide}"
        return Vector(part, of, against, "", "", value, False, False, line)

    def _given(self, vector: Vector, leg: Leg, *factors: Factor) -> Vector:
        """The vector with its magnitude, where the rate behind it is known."""
        if not self._knows(leg.rate):
            return vector
        return vector._replace(known=True, factors=factors, towards=heading(vector.value))

    def _group(self, left: Sequence[str]) -> tuple[str, ...]:
        """The links that are solved together next: of the groups in which positions are solved, the first open one."""
        for stage in program(self.state.mechanism).equations.stages:
            group = tuple(link for link in left if link in stage.links)
            if group:
                return group
        return tuple(left)

    def _together(self, group: tuple[str, ...], left: Sequence[str]) -> None:
        """A group that no two lines locate: all its rates at once, then its pins."""
        found = loops(self.walks, group, self._known(), self.order)
        while len(found.equations) < len(found.unknowns):  # links beside it hold it too, whose turning is known
            joints = [joint for link in group for joint in self.walks.joints(link)]
            beside = [link for link in left if link not in group and any(link in joint.members for joint in joints)]
            if not beside:
                break
            group = (*group, *beside)
            found = loops(self.walks, group, self._known(), self.order)
        names = {rate: name for name, rate in found.unknowns.items()}
        unknowns = tuple(Unknown(name, self.rates.value(rate, self.order), rate.turns) for rate, name in names.items())
        for joint in (joint for link in group for joint in self.walks.joints(link)):
            for link in joint.members:
                if link in self.placed:
                    self._locate(self.walks.end(joint, link))
        self.known |= {self._stands(Rate(link)) for link in group} | set(found.unknowns.values())
        held = self._held(group)
        self.placed |= dict.fromkeys(held or group)
        letters = []
        for link in held or group:
            for joint in self.walks.joints(link):
                place = self.walks.end(joint, link)
                letter = self.lettering.letter(place)
                if letter not in self.letters:
                    self.letters[letter] = self.rates.carried(place.link, place.local, self.order)
                    letters.append(letter)
        self.stages.append(Simultaneous(group, found.equations, unknowns, tuple(letters)))

    def _held(self, group: tuple[str, ...]) -> list[str]:
        """The links of a group that hang on known ones; others only turn as these do, and are still free to slide."""
        held: dict[str, None] = {}
        changed = True
        while changed:
            changed = False
            for link in group:
                for joint in self.walks.joints(link) if link not in held else ():
                    firm = isinstance(joint, Pin) or all(map(self._knows, joint.rates))
                    if firm and any(other in self.placed or other in held for other in joint.members):
                        held[link] = None
                        changed = True
        return list(held)
