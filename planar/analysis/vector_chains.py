"""Ways through a mechanism from what is known back to what is known, with few enough unknown rates for a pencil."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from planar.analysis.rate_equations import PinJoint, Rate, RateEquations, SlideJoint
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector

MAX_UNKNOWNS = 2
"""Two lines meet in a point: a pencil finds two magnitudes of known direction."""
MAX_CHAIN_LINKS = 8
"""Links on the way from known to known; two unknown rates seldom reach over more than four."""
COINCIDENT_TOLERANCE = 1e-9
"""Points nearer to each other than this part of the mechanism's size are one."""


class LinkPoint(NamedTuple):
    """A point of a link; `over` is the point of the mechanism that it lies on, where it is no named one itself."""

    link: str
    local: Vector
    over: str


class ChainVector(NamedTuple):
    """From one place to the next: two points of one link, or two coincident points of links that slide."""

    tail: LinkPoint
    head: LinkPoint
    rate: Rate
    slide: SlideJoint | None = None
    sign: float = 1.0
    "of a slide: 1 from the guide to what rides, else -1"

    def reverse(self) -> ChainVector:
        """The leg the other way round."""
        return ChainVector(self.head, self.tail, self.rate, self.slide, -self.sign)


class VectorChain(NamedTuple):
    """Legs from a known place to a known place; `meeting` is how many belong to the first side."""

    links: tuple[str, ...]
    start: LinkPoint
    stop: LinkPoint
    vectors: tuple[ChainVector, ...]
    meeting_index: int
    unknown: frozenset[Rate]


JointOfRates = PinJoint | SlideJoint


@dataclass(frozen=True)
class KnownRates:
    """What is known so far: links whose every point is, and rates. `alike` tells which link stands for a rate."""

    links: Collection[str]
    rates: AbstractSet[Rate]
    representatives: Mapping[Rate, Rate]

    def unknown_rate(self, rate: Rate) -> Rate | None:
        """The rate that stands for this one, if it is not known."""
        rate = self.representatives.get(rate, rate)
        return None if rate in self.rates else rate


@dataclass(frozen=True)
class VectorChains:
    """All ways through one position of a mechanism."""

    equations: RateEquations
    names: Mapping[tuple[str, str], str]
    "result name of (link, point)"
    size: float

    @cached_property
    def _joints(self) -> dict[str, list[JointOfRates]]:
        joints: dict[str, list[JointOfRates]] = {}
        every: tuple[JointOfRates, ...] = (*self.equations.pins, *self.equations.slides)
        for joint in every:
            for link in joint.members:
                joints.setdefault(link, []).append(joint)
        return joints

    def joints(self, link: str) -> list[JointOfRates]:
        """The pins and slides of a link."""
        return self._joints.get(link, [])

    def shortest_chain(self, known: KnownRates) -> VectorChain | None:
        """The way over the fewest links, of several the one found first."""
        found: VectorChain | None = None
        for links, joints in self._paths_between_known(known):
            if found is not None and len(links) >= len(found.links) + 2:
                continue
            walk = self._make_chain(links, joints, known)
            if walk is not None:
                found = walk
        return found

    def _paths_between_known(self, known: KnownRates) -> Iterator[tuple[tuple[str, ...], tuple[JointOfRates, ...]]]:
        """Ways from a placed link over others to a placed link, shorter ones first."""
        waiting: list[tuple[tuple[str, ...], tuple[JointOfRates, ...], frozenset[Rate]]] = [
            ((link,), (), frozenset()) for link in known.links
        ]
        while waiting:
            longer = []
            for links, joints, unknown in waiting:
                for joint in self.joints(links[-1]):
                    if joint in joints:
                        continue
                    met = unknown | self._unknown_slide_rates(joint, known)
                    for link in joint.members:
                        if link in links[1:] or link == links[-1]:
                            continue
                        if link in known.links:
                            if len(links) > 1 and len(met) <= MAX_UNKNOWNS + 1:
                                yield (*links, link), (*joints, joint)
                            continue
                        turning = known.unknown_rate(Rate(link))
                        more = met | ({turning} if turning else frozenset())
                        # a link that is pinned and ridden in one point adds a turning that no line needs
                        if len(more) <= MAX_UNKNOWNS + 1 and len(links) < MAX_CHAIN_LINKS:
                            longer.append(((*links, link), (*joints, joint), more))
            waiting = longer

    def _unknown_slide_rates(self, joint: JointOfRates, known: KnownRates) -> frozenset[Rate]:
        rates = joint.rates if isinstance(joint, SlideJoint) else ()
        return frozenset(rate for rate in rates if known.unknown_rate(rate))

    def _make_chain(
        self, links: tuple[str, ...], joints: tuple[JointOfRates, ...], known: KnownRates
    ) -> VectorChain | None:
        """The legs of a way, if two lines or fewer find all that is unknown on it."""
        if any(isinstance(joint, SlideJoint) and joint.line is None for joint in joints):
            return None
        runs = self._split_into_sliding_groups(links, joints)
        for orders in product(*(self._slide_orders(run) for run in runs)):
            legs, start, stop = self._make_vectors(runs, orders)
            open_ones = [(k, rate) for k, leg in enumerate(legs) if (rate := self._unknown_rate(leg, known))]
            unknown = frozenset(rate for _, rate in open_ones)
            if len(open_ones) > MAX_UNKNOWNS or len(unknown) < len(open_ones):
                return None
            if len(open_ones) < MAX_UNKNOWNS or open_ones[1][0] == open_ones[0][0] + 1:
                if len(open_ones) == MAX_UNKNOWNS and not self._is_crossing(*(legs[k] for k, _ in open_ones)):
                    return None
                meeting = open_ones[0][0] + 1 if open_ones else len(legs)
                if meeting == len(legs) > 1:  # at the stop, which is known: one point before
                    meeting -= 1
                return VectorChain(links[1:-1], start, stop, tuple(legs), meeting, unknown)
        return None

    def _unknown_rate(self, leg: ChainVector, known: KnownRates) -> Rate | None:
        """The unknown rate of a leg; two points in one place need none."""
        if leg.slide is None and not self._is_apart(leg.tail, leg.head):
            return None
        return known.unknown_rate(leg.rate)

    def _is_crossing(self, first: ChainVector, second: ChainVector) -> bool:
        a, b = (self.unit_rate_velocity(leg) for leg in (first, second))
        return bool(abs(a[0] * b[1] - a[1] * b[0]) > 1e-7 * float(np.hypot(*a) * np.hypot(*b)))

    def unit_rate_velocity(self, leg: ChainVector) -> Array:
        """The velocity that a leg has by its rate of one, (2,)."""
        if leg.slide is not None:
            return leg.sign * leg.slide.directions[leg.slide.rates.index(leg.rate)]
        x, y = self.point_position(leg.head) - self.point_position(leg.tail)
        return np.array([-y, x])

    def point_position(self, place: LinkPoint) -> Array:
        """Where a place is (m), (2,)."""
        return self.equations.point_motion(place.link, place.local)

    def _split_into_sliding_groups(
        self, links: tuple[str, ...], joints: tuple[JointOfRates, ...]
    ) -> list[_SlidingGroup]:
        """Links that slide in one another without turning, between the points at which they meet others."""
        runs, members, slides, entry = [], [links[0]], [], None
        for link, joint in zip(links[1:], joints, strict=True):
            if isinstance(joint, SlideJoint) and joint.turns_as_one:
                slides.append(joint)
                members.append(link)
                continue
            before, after = (self.joint_point(joint, side) for side in (members[-1], link))
            runs.append(_SlidingGroup(tuple(members), tuple(slides), entry, before))
            if isinstance(joint, SlideJoint):  # in which the links turn against each other
                runs[-1] = runs[-1]._replace(exit_slot=joint)
            members, slides, entry = [link], [], after
        return [*runs, _SlidingGroup(tuple(members), tuple(slides), entry, None)]

    def joint_point(self, joint: JointOfRates, link: str) -> LinkPoint:
        """Where a joint is on one of its links."""
        if isinstance(joint, PinJoint):
            point = joint.members[link]
            return LinkPoint(link, self.equations.local_point(link, point), self.names[link, point])
        name = self.names[joint.rider, joint.point]
        if link == joint.rider:
            return LinkPoint(link, self.equations.local_point(link, joint.point), name)
        return self.point_under(link, self.equations.point_position(joint.rider, joint.point), name)

    def point_under(self, link: str, spot: Array, name: str) -> LinkPoint:
        """The point of a link that lies where a named point is."""
        return LinkPoint(link, self.equations.local_point_at(link, spot), name)

    def _slide_orders(self, run: _SlidingGroup) -> tuple[bool, ...]:
        """Whether slides come before the turning: where what slides has its own point there, both ways else."""
        if not run.slides or run.entry is None or run.exit is None:
            return (False,)
        riders = {self.names[slide.rider, slide.point] for slide in run.slides}
        return (False, True) if run.exit.over in riders else (True, False)

    def _make_vectors(
        self, runs: list[_SlidingGroup], orders: tuple[bool, ...]
    ) -> tuple[list[ChainVector], LinkPoint, LinkPoint]:
        legs: list[ChainVector] = []
        ends: list[LinkPoint] = []
        for index, (run, slides_first) in enumerate(zip(runs, orders, strict=True)):
            inside = self._sliding_group_vectors(run, slides_first)
            legs += inside.vectors
            ends += [inside.start, inside.stop]
            slot = run.exit_slot
            onwards = None if slot is None else runs[index + 1].entry
            if slot is not None and slot.line is not None and onwards is not None:
                # a pin in a slot: from its place on the guide to itself, or back
                forth = slot.rider == runs[index + 1].links[0]
                legs.append(ChainVector(inside.stop, onwards, slot.line[1], slot, 1.0 if forth else -1.0))
        return legs, ends[0], ends[-1]

    def _sliding_group_vectors(self, run: _SlidingGroup, slides_first: bool) -> _GroupVectors:
        """The legs of a run, all its slides at one point: where it is left, or where it is entered."""
        entry, leave = run.entry, run.exit
        if entry is not None and (leave is None or slides_first):
            anchor = entry
        elif leave is not None:
            anchor = leave
        else:
            anchor = entry = leave = self.joint_point(run.slides[0], run.slides[0].rider)
        here = [
            anchor if link == anchor.link else self.point_under(link, self.point_position(anchor), anchor.over)
            for link in run.links
        ]
        slid = [
            ChainVector(tail, head, slide.rates[0], slide, 1.0 if slide.rider == head.link else -1.0)
            for slide, tail, head in zip(run.slides, here, here[1:], strict=False)
        ]
        if entry is None or leave is None or (entry.over == leave.over and not self._is_apart(entry, leave)):
            return _GroupVectors(slid, here[0], here[-1])
        if anchor is entry:
            return _GroupVectors([*slid, ChainVector(here[-1], leave, Rate(leave.link))], entry, leave)
        return _GroupVectors([ChainVector(entry, here[0], Rate(entry.link)), *slid], entry, leave)

    def _is_apart(self, one: LinkPoint, other: LinkPoint) -> bool:
        return (
            float(np.hypot(*(self.point_position(one) - self.point_position(other)))) > COINCIDENT_TOLERANCE * self.size
        )


class _SlidingGroup(NamedTuple):
    """Links on a way that turn alike, joined by slides; where it is entered and left, and by which slot."""

    links: tuple[str, ...]
    slides: tuple[SlideJoint, ...]
    entry: LinkPoint | None
    exit: LinkPoint | None
    exit_slot: SlideJoint | None = None


class _GroupVectors(NamedTuple):
    vectors: list[ChainVector]
    start: LinkPoint
    stop: LinkPoint
