"""A mechanism as a kinematic scheme shows it: a pin of n links is one joint, a pin in a slot carries a block."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import NamedTuple

from planar.foundation.geometry import GROUND, Vector, frame_at
from planar.model.link_graph import JointDiagram
from planar.model.link_shapes import LinkShape, link_shape
from planar.model.mechanism import Mechanism, pair_entries
from planar.model.pairs import MeasureKind, Pair

LENGTH_TOLERANCE = 1e-6
"""Lengths are equal within this part of those beside them: dimensions in files are rounded."""


class JointLocation(NamedTuple):
    """Where a link meets others, in its own axes (m): the centre of a pin, or a point and the way of a slide's line."""

    point: Vector
    direction: Vector | None = None

    @property
    def line_direction(self) -> Vector:
        """The way of its slide's line. Raises ValueError at a pin, which has none."""
        if self.direction is None:
            raise ValueError("a pin has no line")
        return self.direction


class SchemeJoint(NamedTuple):
    """Links that meet in a pin (angle) or a slide (length), and where on each of them."""

    name: str
    kind: MeasureKind
    locations: Mapping[str, JointLocation]

    @property
    def slides(self) -> bool:
        """Whether it is a sliding pair."""
        return self.kind is MeasureKind.LENGTH


@dataclass(frozen=True)
class KinematicScheme:
    """The joints of a mechanism that are lower pairs, and the higher pairs that have no scheme in lower ones."""

    frame: str
    links: tuple[str, ...]
    joints: tuple[SchemeJoint, ...]
    higher: tuple[Pair, ...]

    @property
    def joint_diagram(self) -> JointDiagram:
        """Its graph."""
        return JointDiagram(tuple((joint.kind, tuple(joint.locations)) for joint in self.joints), self.frame)

    @property
    def lower_pair_count(self) -> int:
        """How many lower pairs it has, a pin of n links counted as n - 1."""
        return sum(len(joint.locations) - 1 for joint in self.joints)

    def subscheme(self, links: Iterable[str]) -> KinematicScheme:
        """Some of its links, with the joints between them."""
        kept = frozenset(links)
        places = [{link: joint.locations[link] for link in joint.locations if link in kept} for joint in self.joints]
        joints = (joint._replace(locations=here) for joint, here in zip(self.joints, places, strict=True))
        return KinematicScheme(
            self.frame,
            tuple(link for link in self.links if link in kept),
            tuple(joint for joint in joints if len(joint.locations) > 1),
            (),
        )


class LoopLink(NamedTuple):
    """A link of a ring, between the joint that comes before it and the one after it."""

    link: str
    before: JointLocation
    after: JointLocation

    @property
    def length(self) -> float:
        """Between its two pins (m)."""
        return pin_distance(self.before, self.after)


class KinematicLoop(NamedTuple):
    """A single closed loop, from the frame on; the first joint lies between the first two sides."""

    links: tuple[LoopLink, ...]
    joints: tuple[SchemeJoint, ...]


def kinematic_scheme(mechanism: Mechanism) -> KinematicScheme:
    """The scheme of a mechanism."""
    shapes = {link.name: link_shape(link) for link in mechanism.links}
    joints: list[SchemeJoint] = []
    higher: list[Pair] = []
    for group in pair_entries(mechanism):
        pair = group[0]
        if pair.is_lower_pair and pair.input_kind is MeasureKind.ANGLE:
            ends = [end for each in group for end in each.coincident_points()]
            joints.append(
                SchemeJoint(
                    pair.entry_name(),
                    MeasureKind.ANGLE,
                    {link: JointLocation(shapes[link].position(point)) for link, point in ends},
                )
            )
        elif pair.is_lower_pair and pair.input_kind is MeasureKind.LENGTH:
            joints.append(_slide_joint(pair, shapes))
        elif (
            pair.input_kind is MeasureKind.LENGTH
            and not pair.counts_turns
            and (rides := pair.point_on_line()) is not None
        ):
            joints += _slot_joints(pair, rides, shapes)
        else:
            higher += group
    links = dict.fromkeys(
        [link.name for link in mechanism.links] + [link for each in joints for link in each.locations]
    )
    return KinematicScheme(mechanism.frame, tuple(links), tuple(joints), tuple(higher))


def _slide_joint(pair: Pair, shapes: Mapping[str, LinkShape]) -> SchemeJoint:
    """A sliding pair: the second link's origin runs along a line of the first, found from the pair's own residual."""
    first, second = pair.links
    numbers = pair.measure([shapes[link] for link in pair.bodies])

    def gap(slide: float, angle: float) -> Sequence[float]:
        return pair.residual((GROUND, frame_at(0.0, 0.0, angle)), numbers, (slide,))

    turn = -gap(0.0, 0.0)[pair.residual_kinds.index(MeasureKind.ANGLE)]
    start, on = (Vector(*gap(slide, turn)[:2]) for slide in (0.0, 1.0))
    way, back = start - on, frame_at(0.0, 0.0, -turn)
    places = {
        first: JointLocation(start * -1.0, way),
        second: JointLocation(Vector(0.0, 0.0), back.rotate_to_world(way)),
    }
    return SchemeJoint(pair.name, MeasureKind.LENGTH, places)


def _slot_joints(
    pair: Pair, rides: tuple[tuple[str, str], str], shapes: Mapping[str, LinkShape]
) -> tuple[SchemeJoint, SchemeJoint]:
    """A pin, the (link, point) that rides along a line of another link, as a block on that line with the pin in it."""
    (link, point), guide = rides
    numbers = pair.measure([shapes[body] for body in pair.bodies])
    start, on = (Vector(*pair.residual((GROUND, GROUND), numbers, (slide,))[:2]) for slide in (0.0, 1.0))
    pin, block, origin = shapes[link].position(point), f"{pair.name}:block", Vector(0.0, 0.0)
    slide = {guide: JointLocation(pin - start, start - on), block: JointLocation(origin, Vector(1.0, 0.0))}
    turning = {block: JointLocation(origin), link: JointLocation(pin)}
    return SchemeJoint(pair.name, MeasureKind.LENGTH, slide), SchemeJoint(
        f"{pair.name}:pin", MeasureKind.ANGLE, turning
    )


def find_single_loop(scheme: KinematicScheme) -> KinematicLoop | None:
    """The loop that a chain is, if it is no more than one."""
    if scheme.higher or any(len(joint.locations) != 2 for joint in scheme.joints):
        return None
    link, sides, joints, left = scheme.frame, [scheme.frame], [], list(scheme.joints)
    while left:
        joint = next((joint for joint in left if link in joint.locations), None)
        if joint is None:
            return None
        left.remove(joint)
        joints.append(joint)
        (link,) = joint.locations.keys() - {link}
        sides.append(link)
    if sides.pop() != scheme.frame or len(set(sides)) != len(sides) or len(sides) != len(scheme.links):
        return None
    both = zip(sides, (joints[-1], *joints), joints, strict=False)
    return KinematicLoop(
        tuple(LoopLink(link, a.locations[link], b.locations[link]) for link, a, b in both), tuple(joints)
    )


def pin_distance(a: JointLocation, b: JointLocation) -> float:
    """The distance of two pins of a link (m)."""
    way = b.point - a.point
    return hypot(way.x, way.y)


def has_equal_lengths(lengths: Sequence[float]) -> bool:
    """Whether lengths are equal but for rounding, and not nothing."""
    return max(lengths) - min(lengths) <= LENGTH_TOLERANCE * max(lengths) and min(lengths) > 0.0
