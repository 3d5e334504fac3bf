"""Drawing the polygons of a position as a pencil would: from what is known, point after point, each by two lines."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from planar.analysis.polygons.lettering import Lettering
from planar.analysis.polygons.loop_equations import loop_equations
from planar.analysis.polygons.polygon import (
    DrawingStage,
    Meeting,
    MeetingSide,
    PointImage,
    Polygon,
    PolygonVector,
    SimultaneousSolution,
    SolvedRate,
    TurningRate,
    VectorPart,
)
from planar.analysis.polygons.vector_parts import NEGLIGIBLE_RATIO, VectorParts
from planar.analysis.rate_equations import PinJoint, Rate, SlideJoint, moving_links, rate_equations, turning_classes
from planar.analysis.vector_chains import (
    COINCIDENT_TOLERANCE,
    ChainVector,
    KnownRates,
    LinkPoint,
    VectorChain,
    VectorChains,
)
from planar.equations.functions import equation_functions
from planar.foundation.arrays import Array
from planar.model.mechanism import named_points
from planar.model.wording import REST_TOLERANCE, turning_sense
from planar.results.motion import State


def velocity_polygon(state: State) -> Polygon:
    """The velocity polygon of a position (m/s), with the order in which it can be drawn."""
    return _PolygonConstruction(state, 1).draw()


def acceleration_polygon(state: State) -> Polygon:
    """The acceleration polygon of a position (m/s^2), with the order in which it can be drawn."""
    return _PolygonConstruction(state, 2).draw()


class _PolygonConstruction:
    """One polygon while it is drawn; `order` 1 for velocities, 2 for accelerations."""

    def __init__(self, state: State, order: int):
        self.order = order
        self.state = state
        self.frame = state.mechanism.frame
        self.equations = rate_equations(state)
        self.named_points = named_points(state.mechanism)
        self.names = {member: each.name for each in self.named_points for member in each.members}
        spots = np.array([self.equations.point_position(*each.members[0]) for each in self.named_points])
        self.size = float(np.ptp(spots, axis=0).max(initial=0.0)) or 1.0
        self.chains = VectorChains(self.equations, self.names, self.size)
        self.representatives = turning_classes(self.equations.equations)
        self.known_links: dict[str, None] = {self.frame: None}
        self.known_rates = {self._representative(Rate(self.frame))}
        self.lettering = Lettering(self.equations, self.named_points, self.frame, order, self.size)
        self.letters: dict[str, Array] = {}
        self.pole: list[str] = []
        self.stages: list[DrawingStage] = []
        self.parts = VectorParts(state, self.equations, self.chains, self.lettering, self._is_known)

    def draw(self) -> Polygon:
        """The whole polygon."""
        self._propagate_known()
        while left := [link for link in moving_links(self.state.mechanism) if link not in self.known_links]:
            walk = self.chains.shortest_chain(self._known_so_far())
            if walk is None:
                self._solve_block(self._next_block(left), left)
            else:
                self._draw_chain(walk)
            self._propagate_known()
        for each in self.named_points:
            moved = [member for member in each.members if member[0] != self.frame]
            if moved:
                self._draw_point(LinkPoint(moved[0][0], self.equations.local_point(*moved[0]), each.name))
        shown = {letter: point for letter, point in self.lettering.points.items() if letter in self.letters}
        kind = "velocity" if self.order == 1 else "acceleration"
        return Polygon(
            self.state,
            kind,
            tuple(self.pole),
            self.letters,
            shown,
            tuple(self.stages),
            self.lettering.points_underneath(shown),
        )

    def _representative(self, rate: Rate) -> Rate:
        return self.representatives.get(rate, rate)

    def _known_so_far(self) -> KnownRates:
        return KnownRates(tuple(reversed(self.known_links)), frozenset(self.known_rates), self.representatives)

    def _is_known(self, rate: Rate) -> bool:
        return self._representative(rate) in self.known_rates

    def _propagate_known(self) -> None:
        """Rates that ties give, and links that are known as soon as their turning is."""
        changed = True
        while changed:
            changed = False
            for tie in self.equations.equations:
                slopes: dict[Rate, float] = {}
                for rate, slope in tie.coefficients.items():
                    slopes[self._representative(rate)] = slopes.get(self._representative(rate), 0.0) + slope
                open_ones = [
                    rate
                    for rate, slope in slopes.items()
                    if rate not in self.known_rates and abs(slope) > NEGLIGIBLE_RATIO
                ]
                if len(open_ones) == 1:
                    self.known_rates.add(open_ones[0])
                    changed = True
                    self._record_given_turning(
                        next(rate for rate in tie.coefficients if self._representative(rate) == open_ones[0]), tie.pair
                    )
            for link in moving_links(self.state.mechanism):
                if link not in self.known_links and self._is_known(Rate(link)) and self._is_joined_to_known(link):
                    self.known_links[link] = None
                    changed = True

    def _record_given_turning(self, rate: Rate, pair: str) -> None:
        if rate.is_angular:
            value = self.equations.value(rate, self.order)
            still = NEGLIGIBLE_RATIO * (
                self.parts.greatest_angular_velocity if self.order == 1 else self.parts.greatest_angular_acceleration
            )
            self.stages.append(TurningRate(rate.owner, value, turning_sense(value, still / REST_TOLERANCE), by=pair))

    def _is_joined_to_known(self, link: str) -> bool:
        """Whether a link whose turning is known hangs on a known one, by a pin or by a slide that is known too."""
        for joint in self.chains.joints(link):
            if not any(other in self.known_links for other in joint.members):
                continue
            if isinstance(joint, PinJoint):
                return True
            if joint.line is not None and self._is_known(joint.line[1]):
                self._draw_slide(joint, link)
                return True
        return False

    def _draw_slide(self, slide: SlideJoint, link: str) -> None:
        """The point of a link at a slide from that of the other link, the rate along the slide being known."""
        rider = self.chains.joint_point(slide, slide.rider)
        leg = ChainVector(self.chains.joint_point(slide, slide.guide), rider, slide.rates[0], slide)
        leg = leg if link == slide.rider else leg.reverse()
        self._draw_meeting((link,), ((leg.tail, (leg,)),), leg.head)

    def _draw_chain(self, chain: VectorChain) -> None:
        """The point in which two lines meet, and all that is known by it."""
        first, second = (
            chain.vectors[: chain.meeting_index],
            tuple(leg.reverse() for leg in chain.vectors[chain.meeting_index :][::-1]),
        )
        sides = ((chain.start, first), (chain.stop, second))
        if len(first) == 1 and not second and chain.stop.link == self.frame:  # from the pole, as it is read
            sides = ((chain.stop, (first[0].reverse(),)), (chain.start, ()))
        meeting = sides[0][1][-1].head if sides[0][1] else chain.start
        self._draw_meeting(chain.links, sides if chain.unknown else sides[:1], meeting)
        self.known_rates |= chain.unknown
        self.known_links |= dict.fromkeys(chain.links)
        for leg in chain.vectors:
            if leg.slide is None and self._representative(leg.rate) in chain.unknown:
                self._record_measured_turning(leg)

    def _draw_meeting(
        self, links: tuple[str, ...], sides: Sequence[tuple[LinkPoint, tuple[ChainVector, ...]]], meeting: LinkPoint
    ) -> None:
        drawn: list[MeetingSide] = []
        for start, legs in sides:
            if not legs:
                self._draw_point(start)
        for start, legs in sides:
            tail, vectors = self._draw_point(start), []
            begin = tail
            for leg in legs:
                found, tail = self._draw_vectors(leg, tail)
                vectors += found
            drawn += [] if self._is_repeated(drawn, begin, vectors) else [MeetingSide(begin, tuple(vectors))]
        if any(side.vectors for side in drawn):
            letter = self.lettering.letter(meeting)
            self.stages.append(Meeting(links, self.lettering.points[letter], letter, tuple(drawn)))

    @staticmethod
    def _is_repeated(drawn: Sequence[MeetingSide], begin: str, vectors: Sequence[PolygonVector]) -> bool:
        """Whether vectors along a slide are those along another one on the same line, which are known."""
        heads = [vector.head for vector in vectors if vector.part in (VectorPart.SLIDING, VectorPart.CORIOLIS)]
        ways = [[vector.head for vector in side.vectors if vector.known] for side in drawn if side.start == begin]
        return len(heads) == len(vectors) > 0 and heads in ways

    def _draw_point(self, place: LinkPoint) -> str:
        """The letter of a place on a known link, drawn now if it is not yet."""
        letter = self.lettering.letter(place)
        if letter in self.letters:
            return letter
        spots = self.lettering.places[letter]
        if any(spot.link == self.frame for spot in spots):
            self.letters[letter] = np.zeros(2)
            self.pole.append(letter)
            return letter
        spot = next(spot for link in self.known_links for spot in spots if spot.link == link)
        located = self.lettering.drawn_points(spot.link, self.letters)
        if not located:
            self._draw_first_point(spot.link)
            return self._draw_point(place)
        value = self.equations.point_motion(spot.link, spot.local, self.order)
        base = located[0]
        reach = max(
            float(np.hypot(*self.equations.point_motion(place.link, place.local, self.order))),
            self._image_scale(spot.link),
        )
        if self._image_scale(spot.link) <= NEGLIGIBLE_RATIO * max(
            reach, self.parts.greatest_angular_acceleration if self.order == 2 else self.parts.greatest_angular_velocity
        ):
            self.letters[letter] = value
            moves_alike = self.lettering.points[base[0]]
            point = self.lettering.points[letter]
            self.stages.append(PointImage(spot.link, (moves_alike, moves_alike), point, 0.0, "same"))
        elif len(located) == 1:
            self._draw_meeting((spot.link,), ((base[1], (ChainVector(base[1], spot, Rate(spot.link)),)),), spot)
        else:
            self.letters[letter] = value
            self.stages.append(self._make_image(spot, located))
        return letter

    def _draw_first_point(self, link: str) -> None:
        """A first point of a known link: over a pin or a slide to a link that was known before it."""
        before = list(self.known_links)[: list(self.known_links).index(link)]
        joints = [joint for joint in self.chains.joints(link) if any(other in before for other in joint.members)]
        joint = next(joint for joint in joints if isinstance(joint, PinJoint) or joint.line is not None)
        if isinstance(joint, PinJoint):
            self._draw_point(self.chains.joint_point(joint, next(other for other in joint.members if other in before)))
        else:
            self._draw_slide(joint, link)

    def _image_scale(self, link: str) -> float:
        """How a link's image is magnified: by its angular velocity, or by what its accelerations come from (SI)."""
        rate = Rate(link)
        if self.order == 1:
            return abs(self.equations.value(rate))
        return float(np.hypot(self.equations.value(rate, 2), self.equations.value(rate) ** 2))

    def _make_image(self, place: LinkPoint, located: Sequence[tuple[str, LinkPoint]]) -> PointImage:
        """A point by its image, from the two drawn points of its link that are farthest apart."""
        spots = {letter: self.chains.point_position(each) for letter, each in located}
        a, b = max(combinations(spots, 2), key=lambda both: float(np.hypot(*(spots[both[0]] - spots[both[1]]))))
        base, reach = spots[b] - spots[a], self.chains.point_position(place) - spots[a]
        points = self.lettering.points
        cross = float(base[0] * reach[1] - base[1] * reach[0])
        point = points[self.lettering.letter(place)]
        if abs(cross) <= COINCIDENT_TOLERANCE * self.size * float(np.hypot(*base)):
            return PointImage(place.link, (points[a], points[b]), point, float(reach @ base / (base @ base)), "")
        sense = "anticlockwise" if cross > 0.0 else "clockwise"
        return PointImage(place.link, (points[a], points[b]), point, self._image_scale(place.link), sense)

    def _record_measured_turning(self, leg: ChainVector) -> None:
        """How fast a link turns, from the vector that was drawn for it."""
        value = self.equations.value(leg.rate, self.order)
        tail, head = (self.lettering.letter(place) for place in (leg.tail, leg.head))
        vectors = (
            v for stage in self.stages if isinstance(stage, Meeting) for side in stage.sides for v in side.vectors
        )
        drawn = next(v for v in vectors if {v.tail, v.head} & {tail, head} and self._is_vector_of(v, leg))
        length = float(np.hypot(*(self.chains.point_position(leg.head) - self.chains.point_position(leg.tail))))
        still = NEGLIGIBLE_RATIO * (
            self.parts.greatest_angular_velocity if self.order == 1 else self.parts.greatest_angular_acceleration
        )
        self.stages.append(
            TurningRate(
                leg.rate.owner,
                value,
                turning_sense(value, still / REST_TOLERANCE),
                (drawn.tail, drawn.head),
                abs(value) * length,
                drawn.line,
                length,
            )
        )

    def _is_vector_of(self, vector: PolygonVector, leg: ChainVector) -> bool:
        points = {self.lettering.point_name(leg.tail), self.lettering.point_name(leg.head)}
        return {vector.of, vector.against} == points and vector.part in (VectorPart.ROTATION, VectorPart.TANGENTIAL)

    def _draw_vectors(self, leg: ChainVector, tail: str) -> tuple[list[PolygonVector], str]:
        """The vectors of a leg, known ones first, from the letter at its tail; and the letter at its head."""
        if (
            leg.slide is None
            and float(np.hypot(*self.chains.unit_rate_velocity(leg))) <= COINCIDENT_TOLERANCE * self.size
        ):
            self.lettering.share_letter(leg.head, tail)
            head = self.lettering.letter(leg.head)
            self.letters.setdefault(head, self.letters[tail])  # one that had a letter before is in its place
            return [], head
        head = self.lettering.letter(leg.head)
        drawn = head in self.letters
        vectors = []
        parts = self.parts.velocity_parts(leg) if self.order == 1 else self.parts.acceleration_parts(leg)
        for index, vector in enumerate(parts):
            end = head
            if index < len(parts) - 1:
                end = self.lettering.part_letter(leg.head, leg.tail)
                self.letters[end] = self.letters[tail] + vector.value
            vectors.append(vector._replace(tail=tail, head=end))
            tail = end
        if not drawn:
            self.letters[head] = self.equations.point_motion(leg.head.link, leg.head.local, self.order)
        return vectors, head

    def _next_block(self, left: Sequence[str]) -> tuple[str, ...]:
        """The links that are solved together next: of the groups in which positions are solved, the first open one."""
        for stage in equation_functions(self.state.mechanism).equations.blocks:
            group = tuple(link for link in left if link in stage.links)
            if group:
                return group
        return tuple(left)

    def _solve_block(self, block: tuple[str, ...], left: Sequence[str]) -> None:
        """A group that no two lines locate: all its rates at once, then its pins."""
        found = loop_equations(self.chains, block, self._known_so_far(), self.order)
        while len(found.equations) < len(found.unknowns):  # links beside it hold it too, whose turning is known
            joints = [joint for link in block for joint in self.chains.joints(link)]
            beside = [link for link in left if link not in block and any(link in joint.members for joint in joints)]
            if not beside:
                break
            block = (*block, *beside)
            found = loop_equations(self.chains, block, self._known_so_far(), self.order)
        names = {rate: name for name, rate in found.unknowns.items()}
        unknowns = tuple(
            SolvedRate(name, self.equations.value(rate, self.order), rate.is_angular) for rate, name in names.items()
        )
        for joint in (joint for link in block for joint in self.chains.joints(link)):
            for link in joint.members:
                if link in self.known_links:
                    self._draw_point(self.chains.joint_point(joint, link))
        self.known_rates |= {self._representative(Rate(link)) for link in block} | set(found.unknowns.values())
        held = self._located_links(block)
        self.known_links |= dict.fromkeys(held or block)
        letters = []
        for link in held or block:
            for joint in self.chains.joints(link):
                place = self.chains.joint_point(joint, link)
                letter = self.lettering.letter(place)
                if letter not in self.letters:
                    self.letters[letter] = self.equations.point_motion(place.link, place.local, self.order)
                    letters.append(letter)
        self.stages.append(SimultaneousSolution(block, found.equations, unknowns, tuple(letters)))

    def _located_links(self, group: tuple[str, ...]) -> list[str]:
        """The links of a group that hang on known ones; others only turn as these do, and are still free to slide."""
        held: dict[str, None] = {}
        changed = True
        while changed:
            changed = False
            for link in group:
                for joint in self.chains.joints(link) if link not in held else ():
                    firm = isinstance(joint, PinJoint) or all(map(self._is_known, joint.rates))
                    if firm and any(other in self.known_links or other in held for other in joint.members):
                        held[link] = None
                        changed = True
        return list(held)
