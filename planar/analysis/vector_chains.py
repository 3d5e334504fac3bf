"""Ways through a mechanism from what is known back to what is known, with few enough unknown rates for a pencil."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np

from planar.analysis.rate_equations import Pin, Rate, Rates, Slide
from planar.foundation.geometry import Vector

MOST_UNKNOWN = 2
"""Two lines meet in a point: a pencil finds two magnitudes of known direction."""
LONGEST = 8
"""Links on the way from known to known; two unknown rates seldom reach over more than four."""
NEAR = 1e-9
"""Points nearer to each other than this part of the mechanism's size are one."""


class Place(NamedTuple):
    """A point of a link; `over` is the point of the mechanism that it lies on, where it is no named one itself."""

    link: str
    local: Vector
    over: str


class Leg(NamedTuple):
    """From one place to the next: two points of one link, or two coincident points of links that slide."""

    tail: Place
    head: Place
    rate: Rate
    slide: Slide | None = None
    sign: float = 1.0
    "of a slide: 1 from the guide to what rides, else -1"

    def turned_back(self) -> Leg:
        """The leg the other way round."""
        return Leg(self.head, self.tail, self.rate, self.slide, -self.sign)


class Walk(NamedTuple):
    """Legs from a known place to a known place; `meeting` is how many belong to the first side."""

    links: tuple[str, ...]
    start: Place
    stop: Place
    legs: tuple[Leg, ...]
    meeting: int
    unknown: frozenset[Rate]


Joint = Pin | Slide


@dataclass(frozen=True)
class Known:
    """What is known so far: links whose every point is, and rates. `alike` tells which link stands for a rate."""

    placed: Collection[str]
    rates: AbstractSet[Rate]
    alike: Mapping[Rate, Rate]

    def unknown(self, rate: Rate) -> Rate | None:
        """The rate that stands for this one, if it is not known."""
        rate = self.alike.get(rate, rate)
        return None if rate in self.rates else rate


@dataclass(frozen=True)
class Walks:
    """All ways through one position of a mechanism."""

    rates: Rates
    names: Mapping[tuple[str, str], str]
    "result name of (link, point)"
    size: float

    def __post_init__(self) -> None:
        joints: dict[str, list[Joint]] = {}
        for joint in (*self.rates.pins, *self.rates.slides):
            for link in joint.members:
                joints.setdefault(link, []).append(joint)
        object.__setattr__(self, "_joints", joints)

    def joints(self, link: str) -> list[Joint]:
        """The pins and slides of a link."""
        return self._joints.get(link, [])  # type: ignore[attr-defined]

    def best(self, known: Known) -> Walk | None:
        """The way over the fewest links, of several the one found first."""
        found: Walk | None = None
        for links, joints in self._ways(known):
            if found is not None and len(links) >= len(found.links) + 2:
                continue
            walk = self._walked(links, joints, known)
            if walk is not None:
                found = walk
        return found

    def _ways(self, known: Known) -> Iterator[tuple[tuple[str, ...], tuple[Joint, ...]]]:
        """Ways from a placed link over others to a placed link, shorter ones first."""
        waiting: list[tuple[tuple[str, ...], tuple[Joint, ...], frozenset[Rate]]] = [
            ((link,), (), frozenset()) for link in known.placed
        ]
        while waiting:
            longer = []
            for links, joints, unknown in waiting:
                for joint in self.joints(links[-1]):
                    if joint in joints:
                        continue
                    met = unknown | self._of_slide(joint, known)
                    for link in joint.members:
                        if link in links[1:] or link == links[-1]:
                            continue
                        if link in known.placed:
                            if len(links) > 1 and len(met) <= MOST_UNKNOWN + 1:
                                yield (*links, link), (*joints, joint)
                            continue
                        turning = known.unknown(Rate(link))
                        more = met | ({turning} if turning else frozenset())
                        # a link that is pinned and ridden in one point adds a turning that no line needs
                        if len(more) <= MOST_UNKNOWN + 1 and len(links) < LONGEST:
                            longer.append(((*links, link), (*joints, joint), more))
            waiting = longer

    def _of_slide(self, joint: Joint, known: Known) -> frozenset[Rate]:
        rates = joint.rates if isinstance(joint, Slide) else ()
        return frozenset(rate for rate in rates if known.unknown(rate))

    def _walked(self, links: tuple[str, ...], joints: tuple[Joint, ...], known: Known) -> Walk | None:
        """The legs of a way, if two lines or fewer find all that is unknown on it."""
        if any(isinstance(joint, Slide) and joint.line is None for joint in joints):
            return None
        runs = self._runs(links, joints)
        for orders in product(*(self._orders(run) for run in runs)):
            legs, start, stop = self._legs(runs, orders)
            open_ones = [(k, self._open(leg, known)) for k, leg in enumerate(legs) if self._open(leg, known)]
            unknown = frozenset(rate for _, rate in open_ones)
            if len(open_ones) > MOST_UNKNOWN or len(unknown) < len(open_ones):
                return None
            if len(open_ones) < MOST_UNKNOWN or open_ones[1][0] == open_ones[0][0] + 1:
                if len(open_ones) == MOST_UNKNOWN and not self._cross(*(legs[k] for k, _ in open_ones)):
                    return None
                meeting = open_ones[0][0] + 1 if open_ones else len(legs)
                if meeting == len(legs) > 1:  # at the stop, which is known: one point before
                    meeting -= 1
                return Walk(links[1:-1], start, stop, tuple(legs), meeting, unknown)
        return None

    def _open(self, leg: Leg, known: Known) -> Rate | None:
        """The unknown rate of a leg; two points in one place need none."""
        if leg.slide is None and not self._apart(leg.tail, leg.head):
            return None
        return known.unknown(leg.rate)

    def _cross(self, first: Leg, second: Leg) -> bool:
        a, b = (self.way(leg) for leg in (first, second))
        return abs(a[0] * b[1] - a[1] * b[0]) > 1e-7 * float(np.hypot(*a) * np.hypot(*b))

    def way(self, leg: Leg) -> np.ndarray:
        """The velocity that a leg has by its rate of one, (2,)."""
        if leg.slide is not None:
            return leg.sign * leg.slide.ways[leg.slide.rates.index(leg.rate)]
        x, y = self.at(leg.head) - self.at(leg.tail)
        return np.array([-y, x])

    def at(self, place: Place) -> np.ndarray:
        """Where a place is (m), (2,)."""
        return self.rates.carried(place.link, place.local)

    def _runs(self, links: tuple[str, ...], joints: tuple[Joint, ...]) -> list[_Run]:
        """Links that slide in one another without turning, between the points at which they meet others."""
        runs, members, slides, entry = [], [links[0]], [], None
        for link, joint in zip(links[1:], joints, strict=True):
            if isinstance(joint, Slide) and joint.tied:
                slides.append(joint)
                members.append(link)
                continue
            before, after = (self.end(joint, side) for side in (members[-1], link))
            runs.append(_Run(tuple(members), tuple(slides), entry, before))
            if isinstance(joint, Slide):  # in which the links turn against each other
                runs[-1] = runs[-1]._replace(leaving=joint)
            members, slides, entry = [link], [], after
        return [*runs, _Run(tuple(members), tuple(slides), entry, None)]

    def end(self, joint: Joint, link: str) -> Place:
        """Where a joint is on one of its links."""
        if isinstance(joint, Pin):
            point = joint.members[link]
            return Place(link, self.rates.local(link, point), self.names[link, point])
        name = self.names[joint.rider, joint.point]
        if link == joint.rider:
            return Place(link, self.rates.local(link, joint.point), name)
        return self.over(link, self.rates.at(joint.rider, joint.point), name)

    def over(self, link: str, spot: np.ndarray, name: str) -> Place:
        """The point of a link that lies where a named point is."""
        return Place(link, self.rates.pinned(link, spot), name)

    def _orders(self, run: _Run) -> tuple[bool, ...]:
        """Whether slides come before the turning: where what slides has its own point there, both ways else."""
        if not run.slides or run.entry is None or run.leave is None:
            return (False,)
        riders = {self.names[slide.rider, slide.point] for slide in run.slides}
        return (False, True) if run.leave.over in riders else (True, False)

    def _legs(self, runs: list[_Run], orders: tuple[bool, ...]) -> tuple[list[Leg], Place, Place]:
        legs: list[Leg] = []
        ends: list[Place] = []
        for index, (run, slides_first) in enumerate(zip(runs, orders, strict=True)):
            inside = self._inside(run, slides_first)
            legs += inside.legs
            ends += [inside.start, inside.stop]
            if run.leaving is not None:
                # a pin in a slot: from its place on the guide to itself, or back
                forth = run.leaving.rider == runs[index + 1].links[0]
                way = run.leaving.line
                legs.append(Leg(inside.stop, runs[index + 1].entry, way[1], run.leaving, 1.0 if forth else -1.0))
        return legs, ends[0], ends[-1]

    def _inside(self, run: _Run, slides_first: bool) -> _Inside:
        """The legs of a run, all its slides at one point: where it is left, or where it is entered."""
        entry, leave = run.entry, run.leave
        if entry is None and leave is None:
            entry = leave = self.end(run.slides[0], run.slides[0].rider)
            anchor = entry
        else:
            anchor = entry if leave is None or (slides_first and entry is not None) else leave
        here = [anchor if link == anchor.link else self.over(link, self.at(anchor), anchor.over) for link in run.links]
        slid = [
            Leg(tail, head, slide.rates[0], slide, 1.0 if slide.rider == head.link else -1.0)
            for slide, tail, head in zip(run.slides, here, here[1:], strict=False)
        ]
        if entry is None or leave is None or (entry.over == leave.over and not self._apart(entry, leave)):
            return _Inside(slid, here[0], here[-1])
        if anchor is entry:
            return _Inside([*slid, Leg(here[-1], leave, Rate(leave.link))], entry, leave)
        return _Inside([Leg(entry, here[0], Rate(entry.link)), *slid], entry, leave)

    def _apart(self, one: Place, other: Place) -> bool:
        return float(np.hypot(*(self.at(one) - self.at(other)))) > NEAR * self.size


class _Run(NamedTuple):
    """Links on a way that turn alike, joined by slides; where it is entered and left, and by which slot."""

    links: tuple[str, ...]
    slides: tuple[Slide, ...]
    entry: Place | None
    leave: Place | None
    leaving: Slide | None = None


class _Inside(NamedTuple):
    legs: list[Leg]
    start: Place
    stop: Place
