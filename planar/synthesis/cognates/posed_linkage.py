"""A linkage as it stands in one position: where its pins and guides are in the plane, by complex numbers."""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Mapping
from typing import NamedTuple

from planar.foundation.errors import BadInput
from planar.foundation.geometry import Vector
from planar.foundation.jets import Jet
from planar.model.mechanism import Mechanism, pair_entries
from planar.model.pairs import Pair
from planar.model.pairs.guide_line import GuidedPair
from planar.results.motion import State

SAME_PLACE = 1e-9
"""Of the linkage's size: places that are nearer are one."""


class PosedPin(NamedTuple):
    """A pin of the file, or a part of one: where it stands and the links that it holds."""

    name: str
    at: complex
    links: tuple[str, ...]


class PosedGuide(NamedTuple):
    """A pair of the file in which a point of one link, the rider, moves along a line of another, the carrier.

    `scale` is by how much its displacements are larger than those of the file's.
    """

    pair: str
    carrier: str
    rider: str
    through: complex
    way: complex
    point: complex
    holds_angle: bool
    scale: float = 1.0


class LinkAxes(NamedTuple):
    """Where a link's own axes lie: their origin and the angle of its x-axis (rad)."""

    origin: complex
    angle: float

    def to_link(self, place: complex) -> Vector:
        """A place of the plane in the link's own axes."""
        own = (place - self.origin) * rect(1.0, -self.angle)
        return Vector(own.real, own.imag)


class PosedLinkage(NamedTuple):
    """A linkage in one position, with what came of each link of the file it was made from.

    `turns` names for every link that link of the file which turns as it does, but for a constant angle; `factors` by
    how much a link is larger and turned (one complex number); `remade` are the links that are not those of the file,
    `bars` of these the ones with other axes, from the first to the second of two places.
    """

    size: float
    pins: tuple[PosedPin, ...]
    guides: tuple[PosedGuide, ...]
    axes: Mapping[str, LinkAxes]
    turns: Mapping[str, str]
    factors: Mapping[str, complex]
    remade: frozenset[str] = frozenset()
    bars: Mapping[str, tuple[complex, complex]] = {}

    def is_same(self, one: complex, other: complex) -> bool:
        """Whether two places are one."""
        return abs(one - other) <= SAME_PLACE * self.size

    def pins_of(self, link: str) -> list[PosedPin]:
        """The pins that hold a link."""
        return [pin for pin in self.pins if link in pin.links]

    def guides_of(self, link: str) -> list[PosedGuide]:
        """The guides of which a link is one side."""
        return [guide for guide in self.guides if link in (guide.carrier, guide.rider)]

    def looks_like(self, other: PosedLinkage) -> bool:
        """Whether all pins and guides are at the same places, whatever they are called."""
        rest = [pin.at for pin in other.pins]
        for pin in self.pins:
            near = next((at for at in rest if self.is_same(at, pin.at)), None)
            if near is None:
                return False
            rest.remove(near)
        lines = [(guide.through, guide.way) for guide in other.guides]
        return not rest and all(
            any(self.is_same(guide.through, at) and abs(guide.way - way) <= SAME_PLACE for at, way in lines)
            for guide in self.guides
        )


def pose_linkage(state: State) -> PosedLinkage:
    """The linkage of a solved position."""
    mechanism = state.mechanism
    axes = {link: _axes(state, link) for link in state.frames}
    pins, guides = [], []
    for group in pair_entries(mechanism):
        members = dict.fromkeys(member for pair in group for member in pair.coincident_points())
        if members:
            link, point = next(iter(members))
            at = _place(axes, link, state.shapes[link].position(point))
            pins.append(PosedPin(group[0].entry_name(), at, tuple(link for link, _ in members)))
        elif isinstance(group[0], GuidedPair) and is_guide(group[0]):
            guides.append(_guide(state, axes, group[0]))
    places = [pin.at for pin in pins] + [guide.point for guide in guides]
    size = max((abs(one - other) for one in places for other in places), default=0.0)
    if mechanism.closes_within is not None or size == 0.0:
        raise BadInput(
            mechanism.name,
            "pairs stay open ('closes_within'), so that its links have no sure places"
            if mechanism.closes_within is not None
            else "all pins are at one place",
        )
    names = [link.name for link in mechanism.links]
    return PosedLinkage(
        size, tuple(pins), tuple(guides), axes, {name: name for name in names}, dict.fromkeys(names, 1.0 + 0.0j)
    )


def is_guide(pair: Pair) -> bool:
    """Whether a pair only keeps a point on a line, with or without the angle between them."""
    return isinstance(pair, GuidedPair) and not pair.counts_turns


def other_pairs(mechanism: Mechanism) -> list[Pair]:
    """The pairs that are neither a pin nor a guide."""
    return [pair for pair in mechanism.pairs if not pair.coincident_points() and not is_guide(pair)]


def _axes(state: State, link: str) -> LinkAxes:
    frame = state.frames[link]
    x, y, angle = (each.parts[0] if isinstance(each, Jet) else each for each in (frame.x, frame.y, frame.angle))
    return LinkAxes(complex(float(x), float(y)), float(angle))


def _place(axes: Mapping[str, LinkAxes], link: str, own: Vector) -> complex:
    return axes[link].origin + complex(float(own.x), float(own.y)) * rect(1.0, axes[link].angle)


def _guide(state: State, axes: Mapping[str, LinkAxes], pair: GuidedPair) -> PosedGuide:
    carrier, rider = pair.links
    x, y, *way = map(float, pair.line.measure_line(state.shapes[carrier]))
    at = _place(axes, carrier, Vector(x, y))
    return PosedGuide(
        pair.name,
        carrier,
        rider,
        at,
        rect(1.0, axes[carrier].angle + phase(complex(*way))),
        _place(axes, rider, state.shapes[rider].position(pair.point)),
        pair.prevented_motion_count() > 1,
    )
