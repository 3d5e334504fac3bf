"""Velocities by instantaneous centres, without a Jacobian: from the given rate of an input on from link to link."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.centres import Centre, Centres, extent
from planar.analysis.rate_equations import RateEquation, RateEquations, SlideJoint, rate_equations
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Drive, replace_inputs

COINCIDENT_TOLERANCE = 1e-7
"""Homogeneous centres, of length one with lengths in sizes, that are no farther apart than this are one.

On a dead point a position is exact to the root of rounding only.
"""


class LinkByCentres(NamedTuple):
    """A link's motion against the frame (3,): w times its pole (x, y, 1) in rad/s and m; `by` is how it was found."""

    motion: Array
    by: tuple[str, ...]
    "the names of the three centres of which it follows from another link's, none for what an input gives"

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def angular_velocity(self) -> float:
        """rad/s, anticlockwise positive."""
        return float(self.motion[2])


class PointByCentre(NamedTuple):
    """A point's velocity (2,) (m/s) about the centre of a link that carries it.

    `radius` (m) is the distance to that centre; None where it lies at infinity, or where the link is the frame.
    """

    velocity: Array
    link: str
    angular_velocity: float
    centre: Centre | None
    radius: float | None
    by: tuple[str, ...]

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("Centres")
def velocity_by_centres(centres: Centres, point: str) -> PointByCentre:
    """v_P = w_k (P - I_kf) turned a quarter, w_k from an input's given rate and w_i through I_ik.

    Of the links that carry the point the first moving one is taken. Raises Unknown where there is no such point,
    and NoAnswer where the input's rate does not determine the velocity.

    >>> import planar
    >>> found = planar.centres(planar.load("four-bar"))
    >>> round(planar.velocity_by_centres(found, "C").angular_velocity, 3)
    -5.15
    """
    state = centres.state
    named = state._find_point(point)
    frame = state.mechanism.frame
    place = state.point(point).position
    carrying = [link for link, _ in named.members]
    if frame in carrying:
        return PointByCentre(np.zeros(2), frame, 0.0, None, None, ())
    link = carrying[0]
    found = links_by_centres(centres)[link]
    centre = centres[link, frame]
    position = centre.position
    x, y, turns = found.motion
    velocity = np.array([y - turns * place[1], turns * place[0] - x])
    radius = None if position is None else float(np.hypot(*(place - position)))
    return PointByCentre(velocity, link, found.angular_velocity, centre, radius, found.by)


def links_by_centres(centres: Centres) -> dict[str, LinkByCentres]:
    """The motion of every link from the first input that moves: w_k (I_kf x I_ik) = w_i (I_if x I_ik).

    The best conditioned three centres serve first. Where no input moves all links rest. Raises NoAnswer where centres
    are not determined, or where the input stands on a dead point.
    """
    state = centres.state
    frame = state.mechanism.frame
    inputs = state.mechanism.inputs
    given = next((each for each in inputs if each.velocity), None)
    if given is None and len(inputs) != 1:
        return {link: LinkByCentres(np.zeros(3), ()) for link in centres.numbers}
    if given is None:  # that the links rest is only so where the input drives them
        one = replace_inputs(state.mechanism, (Drive(inputs[0].pair, velocity=1.0),))
        moving = links_by_centres(replace(centres, state=replace(state, mechanism=one)))
        return {link: LinkByCentres(0.0 * each.motion, each.by) for link, each in moving.items()}
    here = _ScaledCentres(centres)
    found = {frame: LinkByCentres(np.zeros(3), ())} | here.input_motions(given.pair, given.velocity)
    links, ways = [*centres.numbers], list[str]()
    greatest, through = np.zeros(len(links)), np.zeros(len(links), dtype=int)

    def add_way(known: str) -> None:
        """Take a link as one through which others can be found."""
        separations = np.array([0.0 if link in found else here.separation(link, known) for link in links])
        is_better = separations > greatest
        greatest[is_better], through[is_better] = separations[is_better], len(ways)
        ways.append(known)

    for known in found:
        if known != frame:
            add_way(known)
    while len(found) < len(links):
        # of separations alike that of the link which was known first, then of the link which comes first
        rest = [k for k, link in enumerate(links) if link not in found and greatest[k] > COINCIDENT_TOLERANCE]
        if not rest:
            raise _undetermined_answer(centres, [link for link in links if link not in found], given.pair)
        best = min(rest, key=lambda k: (-greatest[k], through[k], k))
        link, known = links[best], ways[through[best]]
        found[link] = here.motion_through(link, known, found[known])
        add_way(link)
    return {link: each._replace(motion=here.in_metres(each.motion)) for link, each in found.items()}


@dataclass(frozen=True)
class _ScaledCentres:
    """The centres in lengths of the mechanism's size about its middle, as they are best told apart."""

    centres: Centres

    @cached_property
    def _extent(self) -> tuple[Array, float]:
        """The mechanism's middle and size."""
        return extent(self.centres.state)

    @cached_property
    def _at(self) -> dict[frozenset[str], Array | None]:
        middle, size = self._extent
        return {frozenset(each.links): self._scale_centre(each, middle, size) for each in self.centres}

    @staticmethod
    def _scale_centre(centre: Centre, middle: Array, size: float) -> Array | None:
        if centre.homogeneous is None:
            return None
        x, y, w = centre.homogeneous
        at = np.array([(x - w * middle[0]) / size, (y - w * middle[1]) / size, w])
        found: Array = at / np.linalg.norm(at)
        return found

    def centre_point(self, one: str, other: str) -> Array | None:
        """(3,), of length one; None where they move as one, or it is not determined."""
        return self._at[frozenset((one, other))]

    def in_metres(self, motion: Array) -> Array:
        """A motion of poles in sizes about the middle as one of poles in metres."""
        x, y, w = motion
        middle, size = self._extent
        return np.array([size * x + w * middle[0], size * y + w * middle[1], w])

    def separation(self, link: str, known: str) -> float:
        """How far a link's centre against the frame lies from that against a link which is known."""
        frame = self.centres.state.mechanism.frame
        pole, between = self.centre_point(link, frame), self.centre_point(link, known)
        if between is None:
            return 1.0 if self._is_one_with(link, known) else 0.0
        if pole is None:
            return 1.0 if self._is_one_with(link, frame) else 0.0
        return float(np.linalg.norm(np.cross(pole, between)))

    def motion_through(self, link: str, known: str, found: LinkByCentres) -> LinkByCentres:
        """The motion of a link from that of another."""
        frame = self.centres.state.mechanism.frame
        pole, between = self.centre_point(link, frame), self.centre_point(link, known)
        if between is None:
            return LinkByCentres(found.motion, ())
        if pole is None:
            return LinkByCentres(np.zeros(3), ())
        line, known_line = np.cross(pole, between), np.cross(found.motion, between)
        by = tuple(self.centres[two].name for two in ((known, frame), (link, known), (link, frame)))
        return LinkByCentres(pole * float(line @ known_line / (line @ line)), by)

    def _is_one_with(self, one: str, other: str) -> bool:
        return self.centres[one, other].how == "as one"

    def input_motions(self, name: str, rate: float) -> dict[str, LinkByCentres]:
        """The motions of the links at an input from its rate."""
        found = rate_equations(self.centres.state)
        tie = next(tie for tie in found.equations if tie.is_input and tie.pair == name)
        first, second, motion = self._relative_input_motion(found, tie, rate)
        frame = self.centres.state.mechanism.frame
        if frame in (first, second):
            link, sign = (second, 1.0) if first == frame else (first, -1.0)
            return {link: LinkByCentres(sign * motion, ())}
        # between moving links: m_second - m_first is known, and where both poles lie
        poles = self.centre_point(first, frame), self.centre_point(second, frame)
        for held, moves, sign in ((first, second, 1.0), (second, first, -1.0)):
            if self._is_one_with(held, frame):  # at rest here
                return {held: LinkByCentres(np.zeros(3), ()), moves: LinkByCentres(sign * motion, ())}
        if poles[0] is None or poles[1] is None:
            raise _undetermined_answer(self.centres, [first, second], name)
        matrix = np.stack([-poles[0], poles[1]], axis=1)
        if np.linalg.svd(matrix, compute_uv=False)[-1] <= COINCIDENT_TOLERANCE:
            raise _undetermined_answer(self.centres, [first, second], name)
        sizes = np.linalg.lstsq(matrix, motion, rcond=None)[0]
        by = (self.centres[first, frame].name, self.centres[first, second].name, self.centres[second, frame].name)
        both = zip((first, second), sizes, poles, strict=True)
        return {link: LinkByCentres(size * pole, by) for link, size, pole in both}

    def _relative_input_motion(self, found: RateEquations, tie: RateEquation, rate: float) -> tuple[str, str, Array]:
        """Two links at an input, and the motion of the second against the first from the input's rate."""
        turns = {each.owner: slope for each, slope in tie.coefficients.items() if each.is_angular}
        if turns:
            second, first = sorted(turns, key=lambda link: -turns[link])
            at = self.centre_point(first, second)
            if at is None or at[2] == 0.0:
                raise _undetermined_answer(self.centres, [first, second], tie.pair)
            return first, second, at * (rate / turns[second] / at[2])
        (own,) = tie.coefficients
        slide: SlideJoint = next(each for each in found.slides if own in each.rates)
        middle, size = self._extent
        way = slide.directions[slide.rates.index(own)] * rate / tie.coefficients[own] / size
        at = self.centre_point(slide.guide, slide.rider)
        x, y = (found.point_position(slide.rider, slide.point) - middle) / size
        if at is None:
            raise _undetermined_answer(self.centres, [slide.guide, slide.rider], tie.pair)
        carried = np.array([at[1] - at[2] * y, at[2] * x - at[0]])
        return slide.guide, slide.rider, at * float(carried @ way / (carried @ carried))


def _undetermined_answer(centres: Centres, links: Sequence[str], pair: str) -> NoAnswer:
    unknown = [each for each in centres if each.how == "open"]
    if unknown:
        return NoAnswer(Outcome.CHANGE_POINT, unknown[0].derivation)
    told = " and ".join(map(repr, links))
    return NoAnswer(Outcome.DEAD_POINT, f"the rate of the input at {pair!r} does not determine those of {told} here")
