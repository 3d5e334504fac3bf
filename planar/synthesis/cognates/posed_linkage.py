"""A linkage in one position as pins and guides in the plane, and Roberts' exchange of two of its links.

A bar p from A on a base link to B, and a coupler q from B by C to E. The vectors A to B and B to E add up to the place
of E in either order: a link as long as B to E, pinned at A and turning as q did, may carry one as long as A to B that
turns as p did. What guided C then has to guide the image of C by the stretch rotation about A with the complex factor
f = (E - B) / (C - B), which takes everything between C and the base with it: a rocker (which gives S. Roberts' and
P. L. Chebyshev's three four-bars), a slide, a whole linkage.

References: S. Roberts, Three-bar motion in plane space, Proceedings of the London Mathematical Society 7 (1875) 14;
E. A. Dijksman, Motion Geometry of Mechanisms (Cambridge, 1976), chapters 6 and 7.
"""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Mapping
from itertools import combinations
from typing import NamedTuple

from planar.foundation.errors import BadInput, join_names
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


class Tracer(NamedTuple):
    """The point whose path is to stay: the links that carry it, and where it stands."""

    links: frozenset[str]
    at: complex


class Exchange(NamedTuple):
    """A bar and a coupler that can be exchanged, seen from a base link.

    `pivot`, `joint`, `guided` and `carried` are where A, B, C and E stand; `scaled` are the links between C and the
    base.
    """

    base: str
    bar: str
    coupler: str
    pivot: complex
    joint: complex
    guided: complex
    carried: complex
    scaled: frozenset[str]

    @property
    def factor(self) -> complex:
        """By which what guides C becomes larger and turned, about the pivot."""
        return (self.carried - self.joint) / (self.guided - self.joint)


class Refusal(NamedTuple):
    """Why a bar and a coupler cannot be exchanged, and how far that is from what could."""

    nearness: int
    sentence: str


def exchanges(posed: PosedLinkage, mechanism: Mechanism, tracer: Tracer) -> tuple[list[Exchange], list[Refusal]]:
    """All that can be exchanged, and of what cannot the reasons."""
    found, refused = [], list[Refusal]()
    others = other_pairs(mechanism)
    bars = [link.name for link in mechanism.links if link.name != mechanism.frame and not posed.guides_of(link.name)]
    for bar in bars:
        if len(posed.pins_of(bar)) != 2:
            continue
        first, second = posed.pins_of(bar)
        if bar in tracer.links:
            refused.append(
                Refusal(1, f"it is on {bar!r}, which has two pins alone, so that it moves on a circle of it")
            )
            continue
        if any(bar in pair.bodies for pair in others):
            refused.append(Refusal(1, f"{bar!r} is held by more than its two pins"))
            continue
        for pivot, joint in ((first, second), (second, first)):
            (coupler,) = (link for link in joint.links if link != bar) if len(joint.links) == 2 else (None,)
            if coupler is None or coupler == mechanism.frame:
                continue
            for base in (link for link in pivot.links if link not in (bar, coupler)):
                one = _Exchanging(posed, mechanism.frame, others, tracer, base, bar, coupler).exchange(pivot, joint)
                if isinstance(one, Exchange):
                    found.append(one)
                else:
                    refused.append(one)
    return found, refused


class _Exchanging(NamedTuple):
    """A base, a bar and a coupler of which it is to be seen whether they can be exchanged."""

    posed: PosedLinkage
    frame: str
    others: list[Pair]
    tracer: Tracer
    base: str
    bar: str
    coupler: str

    def exchange(self, pivot: PosedPin, joint: PosedPin) -> Exchange | Refusal:
        """The exchange, or why there is none."""
        guides = self.posed.guides_of(self.coupler)
        if any(self.coupler in pair.bodies for pair in self.others) or any(
            self.coupler == guide.carrier or guide.holds_angle for guide in guides
        ):
            return Refusal(2, f"the coupler {self.coupler!r} is held by more than pins, so that its angle matters")
        parts = self._parts()
        places = self._attachments(joint, parts)
        if places is None:
            return Refusal(2, f"{self.coupler!r} is pinned to {self.base!r} itself")
        if self.coupler in self.tracer.links and not any(self.posed.is_same(self.tracer.at, at) for at in places):
            places[self.tracer.at] = frozenset()
        if len(places) != 2:
            return Refusal(
                2 if len(places) > 2 else 1,
                f"{self.coupler!r} holds on to the rest at {len(places)} points beside {joint.name}, not at two",
            )
        (one, held), (other, holding) = places.items()
        both = [(one, other, held, holding), (other, one, holding, held)]
        fits = [part for part in both if self._may_scale(part[0], part[2])]
        if not fits or held & holding:
            return Refusal(
                2,
                f"what guides {self.coupler!r} cannot be made larger alone: it holds on to the frame, to what it "
                "carries, or to wheels and cams",
            )
        guided, carried, scaled, _ = fits[0]
        if any(self.posed.is_same(one, other) for one, other in combinations((carried, guided, joint.at), 2)):
            return Refusal(3, f"it is at a pin of {self.coupler!r}, or two pins of that are at one place")
        return Exchange(self.base, self.bar, self.coupler, pivot.at, joint.at, guided, carried, scaled)

    def _may_scale(self, guided: complex, scaled: frozenset[str]) -> bool:
        """Whether these links may be larger: not the frame, nor what carries the tracer, nor what has wheels."""
        if self.coupler in self.tracer.links and self.posed.is_same(guided, self.tracer.at):
            return False
        kept = {self.frame, *(self.tracer.links - {self.coupler, self.base})} - {self.base}
        return not scaled & kept and not any(scaled & {*pair.bodies} for pair in self.others)

    def _parts(self) -> dict[str, frozenset[str]]:
        """Of every other link all that hold together with it, but by the base, the bar and the coupler."""
        apart = {self.base, self.bar, self.coupler}
        joined = [set(pin.links) - apart for pin in self.posed.pins if self.base not in pin.links]
        joined += [{guide.carrier, guide.rider} - apart for guide in self.posed.guides]
        joined += [{*pair.bodies} - apart for pair in self.others]
        found = {link: frozenset([link]) for link in self.posed.axes if link not in apart}
        for links in joined:
            whole = frozenset[str]().union(*(found[link] for link in links))
            found |= dict.fromkeys(whole, whole)
        return found

    def _attachments(self, joint: PosedPin, parts: dict[str, frozenset[str]]) -> dict[complex, frozenset[str]] | None:
        """The places of the coupler beside its joint with the bar, with all links that hold on to it there; None where
        the base itself is pinned to it."""
        held: list[tuple[complex, set[str]]] = []
        for pin in self.posed.pins_of(self.coupler):
            if pin is joint:
                continue
            if self.base in pin.links:
                return None
            held.append((pin.at, {*pin.links} - {self.coupler}))
        for guide in self.posed.guides_of(self.coupler):
            held.append((guide.point, {guide.carrier} - {self.base}))
        found: dict[complex, frozenset[str]] = {}
        for at, links in held:
            place = next((each for each in found if self.posed.is_same(each, at)), at)
            found[place] = found.get(place, frozenset()).union(*(parts[link] for link in links))
        return found


def exchanged(posed: PosedLinkage, change: Exchange) -> PosedLinkage:
    """The linkage with bar and coupler exchanged."""
    pivot, factor, scaled = change.pivot, change.factor, change.scaled

    def image(place: complex) -> complex:
        return pivot + factor * (place - pivot)

    joint = pivot + change.carried - change.joint
    pins: list[PosedPin] = []
    for pin in posed.pins:
        if {change.bar, change.coupler} <= {*pin.links}:
            pins.append(pin._replace(at=joint))
        elif not scaled & {*pin.links} or posed.is_same(image(pin.at), pin.at):
            pins.append(pin)
        elif change.base in pin.links:
            moved = tuple(link for link in pin.links if link == change.base or link in scaled)
            kept = tuple(link for link in pin.links if link not in scaled)
            pins += [pin._replace(links=kept)] if len(kept) > 1 else []
            pins.append(pin._replace(at=image(pin.at), links=moved))
        else:
            pins.append(pin._replace(at=image(pin.at)))
    way = factor / abs(factor)
    guides = [
        guide._replace(
            through=image(guide.through),
            way=guide.way * way,
            point=image(guide.point),
            scale=guide.scale * abs(factor),
        )
        if _is_scaled(posed, guide, change)
        else guide
        for guide in posed.guides
    ]
    axes = {
        link: LinkAxes(image(own.origin), own.angle + phase(factor)) if link in scaled else own
        for link, own in posed.axes.items()
    }
    bars = {
        link: (image(one), image(other)) if link in scaled else (one, other)
        for link, (one, other) in posed.bars.items()
    }
    return posed._replace(
        pins=tuple(pins),
        guides=tuple(guides),
        axes=axes,
        turns={**posed.turns, change.bar: posed.turns[change.coupler], change.coupler: posed.turns[change.bar]},
        factors={link: own * factor if link in scaled else own for link, own in posed.factors.items()},
        remade=posed.remade | scaled | {change.bar, change.coupler},
        bars=bars | {change.bar: (pivot, joint), change.coupler: (joint, image(change.guided))},
    )


def _is_scaled(posed: PosedLinkage, guide: PosedGuide, change: Exchange) -> bool:
    """Whether a guide belongs to what becomes larger: to a link of it, or to the coupler on the base."""
    rides = guide.rider == change.coupler and posed.is_same(guide.point, change.guided)
    return rides or bool({guide.carrier, guide.rider} & change.scaled)


def refusal_sentence(name: str, refused: list[Refusal]) -> str:
    """Why the path of a point has no cognates."""
    most = max((refusal.nearness for refusal in refused), default=0)
    why = [*dict.fromkeys(refusal.sentence for refusal in refused if refusal.nearness == most)]
    least = "no moving link with two pins alone carries a coupler with this point and a third joint"
    told = join_names(why[:2], last_joiner="; ") if most > 1 else least
    return f"no cognates of the path of {name!r} are known: {told}"
