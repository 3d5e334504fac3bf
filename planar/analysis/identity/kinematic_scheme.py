"""A mechanism as a kinematic scheme shows it: a pin of n links is one joint, a pin in a slot carries a block."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import NamedTuple

from planar.foundation.geometry import GROUND, Vector, frame_at
from planar.model.link_graph import Figure
from planar.model.link_shapes import Shape, shape
from planar.model.mechanism import Mechanism, entries
from planar.model.pairs import Kind, Pair

NEAR = 1e-6
"""Lengths are equal within this part of those beside them: dimensions in files are rounded."""


class Place(NamedTuple):
    """Where a link meets others, in its own axes (m): the centre of a pin, or a point and the way of a slide's line."""

    at: Vector
    way: Vector | None = None


class Joint(NamedTuple):
    """Links that meet in a pin (angle) or a slide (length), and where on each of them."""

    name: str
    kind: Kind
    places: Mapping[str, Place]

    @property
    def slides(self) -> bool:
        """Whether it is a sliding pair."""
        return self.kind is Kind.LENGTH


@dataclass(frozen=True)
class Scheme:
    """The joints of a mechanism that are lower pairs, and the higher pairs that have no scheme in lower ones."""

    frame: str
    links: tuple[str, ...]
    joints: tuple[Joint, ...]
    higher: tuple[Pair, ...]

    @property
    def figure(self) -> Figure:
        """Its graph."""
        return Figure(tuple((joint.kind, tuple(joint.places)) for joint in self.joints), self.frame)

    @property
    def pairs(self) -> int:
        """How many lower pairs it has, a pin of n links counted as n - 1."""
        return sum(len(joint.places) - 1 for joint in self.joints)

    def part(self, links: Iterable[str]) -> Scheme:
        """Some of its links, with the joints between them."""
        kept = frozenset(links)
        places = [{link: joint.places[link] for link in joint.places if link in kept} for joint in self.joints]
        joints = (joint._replace(places=here) for joint, here in zip(self.joints, places, strict=True))
        return Scheme(
            self.frame,
            tuple(link for link in self.links if link in kept),
            tuple(joint for joint in joints if len(joint.places) > 1),
            (),
        )


class Side(NamedTuple):
    """A link of a ring, between the joint that comes before it and the one after it."""

    link: str
    before: Place
    after: Place

    @property
    def length(self) -> float:
        """Between its two pins (m)."""
        return apart(self.before, self.after)


class Ring(NamedTuple):
    """A single closed loop, from the frame on; the first joint lies between the first two sides."""

    sides: tuple[Side, ...]
    joints: tuple[Joint, ...]


def scheme(mechanism: Mechanism) -> Scheme:
    """The scheme of a mechanism."""
    shapes = {link.name: shape(link) for link in mechanism.links}
    joints: list[Joint] = []
    higher: list[Pair] = []
    for group in entries(mechanism):
        pair = group[0]
        if pair.lower and pair.drive_kind is Kind.ANGLE:
            ends = [end for each in group for end in each.coincident()]
            joints.append(
                Joint(pair.entry_name(), Kind.ANGLE, {link: Place(shapes[link].at(point)) for link, point in ends})
            )
        elif pair.lower and pair.drive_kind is Kind.LENGTH:
            joints.append(_slide(pair, shapes))
        elif pair.drive_kind is Kind.LENGTH and not pair.counts_turns:
            joints += _block(pair, shapes)
        else:
            higher += group
    links = dict.fromkeys([link.name for link in mechanism.links] + [link for each in joints for link in each.places])
    return Scheme(mechanism.frame, tuple(links), tuple(joints), tuple(higher))


def _slide(pair: Pair, shapes: Mapping[str, Shape]) -> Joint:
    """A sliding pair: the second link's origin runs along a line of the first, found from the pair's own residual."""
    first, second = pair.links
    numbers = pair.measure([shapes[link] for link in pair.bodies])

    def gap(slide: float, angle: float) -> Sequence[float]:
        return pair.residual((GROUND, frame_at(0.0, 0.0, angle)), numbers, (slide,))

    turn = -gap(0.0, 0.0)[pair.constrains.index(Kind.ANGLE)]
    start, on = (Vector(*gap(slide, turn)[:2]) for slide in (0.0, 1.0))
    way, back = start - on, frame_at(0.0, 0.0, -turn)
    places = {first: Place(start * -1.0, way), second: Place(Vector(0.0, 0.0), back.turn(way))}
    return Joint(pair.name, Kind.LENGTH, places)


def _block(pair: Pair, shapes: Mapping[str, Shape]) -> tuple[Joint, Joint]:
    """A pin that runs along a line as a block on that line with the pin in it."""
    (link, point), guide = pair.rides()
    numbers = pair.measure([shapes[body] for body in pair.bodies])
    start, on = (Vector(*pair.residual((GROUND, GROUND), numbers, (slide,))[:2]) for slide in (0.0, 1.0))
    pin, block, origin = shapes[link].at(point), f"{pair.name}:block", Vector(0.0, 0.0)
    slide = {guide: Place(pin - start, start - on), block: Place(origin, Vector(1.0, 0.0))}
    turning = {block: Place(origin), link: Place(pin)}
    return Joint(pair.name, Kind.LENGTH, slide), Joint(f"{pair.name}:pin", Kind.ANGLE, turning)


def ring(chain: Scheme) -> Ring | None:
    """The loop that a chain is, if it is no more than one."""
    if chain.higher or any(len(joint.places) != 2 for joint in chain.joints):
        return None
    link, sides, joints, left = chain.frame, [chain.frame], [], list(chain.joints)
    while left:
        joint = next((joint for joint in left if link in joint.places), None)
        if joint is None:
            return None
        left.remove(joint)
        joints.append(joint)
        (link,) = joint.places.keys() - {link}
        sides.append(link)
    if sides.pop() != chain.frame or len(set(sides)) != len(sides) or len(sides) != len(chain.links):
        return None
    both = zip(sides, (joints[-1], *joints), joints, strict=False)
    return Ring(tuple(Side(link, a.places[link], b.places[link]) for link, a, b in both), tuple(joints))


def apart(a: Place, b: Place) -> float:
    """The distance of two pins of a link (m)."""
    way = b.at - a.at
    return hypot(way.x, way.y)


def alike(lengths: Sequence[float]) -> bool:
    """Whether lengths are equal but for rounding, and not nothing."""
    return max(lengths) - min(lengths) <= NEAR * max(lengths) and min(lengths) > 0.0
