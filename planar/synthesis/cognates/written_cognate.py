"""A linkage in a position as a mechanism of the file's form; links and points that are unchanged are kept."""

from __future__ import annotations

from cmath import phase
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from functools import cached_property
from math import cos, sin
from typing import Any, NamedTuple

from planar.foundation.angles import wrap_angle
from planar.foundation.geometry import Vector
from planar.model.link_shapes import At, Link, Point
from planar.model.mechanism import Mechanism, named_points, pair_entries, relative_motions
from planar.model.pairs import Pair
from planar.model.pairs.guide_line import GuidedPair, LinkLine
from planar.model.pin_linkage import turning_pair_type
from planar.results.motion import State
from planar.synthesis.cognates.posed_linkage import LinkAxes, PosedGuide, PosedLinkage, PosedPin, Tracer, pose_linkage

PIVOT_LETTERS = "GHKMNPQRSTUVWXYZABCDEFJLIO"
"""What new pins of links that stay are called, the first that is free."""


class CognateNames:
    """Gives names: those of the file to what stays, and one to what is at the same place in several cognates."""

    def __init__(self, mechanism: Mechanism, posed: PosedLinkage):
        self.original = posed
        self.taken = {pair.entry_name() for pair in mechanism.pairs}
        self.taken |= {name for link in mechanism.links for name in (link.name, *link.names)}
        self.pivots: list[tuple[str, complex, str]] = []
        "new pins of links that stay in some of the cognates: the link, the place in the first position, and the name"

    def pin_names(self, posed: PosedLinkage, number: int) -> dict[PosedPin, str]:
        """The name of every pin of a cognate of this number."""
        places = {pin.name: pin.at for pin in self.original.pins}
        used, found = set[str](), {}
        for pin in posed.pins:
            stays = [link for link in pin.links if link not in posed.remade]
            if posed.is_same(pin.at, places[pin.name]) and pin.name not in used:
                name = pin.name
            elif stays:
                name = self._pivot_name(posed, stays[0], pin.at, used)
            else:
                name = self._free((_numbered(pin.name, number), *_primed(_numbered(pin.name, number))), used)
            used.add(name)
            found[pin] = name
        return found

    def _pivot_name(self, posed: PosedLinkage, link: str, at: complex, used: set[str]) -> str:
        for other, place, name in self.pivots:
            if other == link and posed.is_same(place, at) and name not in used:
                return name
        name = self._free((*PIVOT_LETTERS, *_primed("G")), used | {name for _, _, name in self.pivots})
        self.pivots.append((link, at, name))
        return name

    def _free(self, names: tuple[str, ...] | Iterator[str], used: set[str]) -> str:
        return next(name for name in names if name not in self.taken and name not in used)


def link_name(old: str, renamed: dict[str, str], taken: set[str]) -> str:
    """The name of a link whose pins have other names: it follows them where it is made of them, as AB, or block B."""
    ends = [(one, other) for one in renamed for other in renamed if one != other and one + other == old]
    head, _, last = old.rpartition(" ")
    if ends:
        found = "".join(renamed[each] for each in ends[0])
    elif head and last in renamed:
        found = f"{head} {renamed[last]}"
    else:
        return old
    return found if found not in taken else old


def _numbered(name: str, number: int) -> str:
    return f"{name}-{number}" if name[-1:].isdigit() else f"{name}{number}"


def _primed(name: str) -> tuple[str, ...]:
    return tuple(f"{name}-{k}" for k in range(2, 100))


class Spot(NamedTuple):
    """A point of a link by its name there, and where it stands."""

    name: str
    at: complex


class WrittenCognate:
    """Writes one cognate of a mechanism in a solved position, without its inputs."""

    def __init__(
        self, state: State, posed: PosedLinkage, tracer: Tracer, tracer_point: str, names: dict[PosedPin, str]
    ):
        self.state, self.posed, self.tracer, self.tracer_point = state, posed, tracer, tracer_point
        self.source = state.mechanism
        self.pin_names = names

    @cached_property
    def links(self) -> dict[str, str]:
        """The names of the links by those of the file."""
        taken = {link.name for link in self.source.links}
        found = {}
        for link in self.posed.axes:
            renamed = {pin.name: self.pin_names[pin] for pin in self.posed.pins_of(link)}
            found[link] = link_name(link, renamed, taken) if link in self.posed.remade else link
            taken.add(found[link])
        return found

    @cached_property
    def axes(self) -> dict[str, LinkAxes]:
        """Where every link's own axes lie."""
        found = dict(self.posed.axes)
        for link in self.posed.remade:
            ends = self._ends(link)
            if ends is not None:
                found[link] = LinkAxes(ends[0].at, phase(ends[1].at - ends[0].at))
        return found

    def mechanism(self, name: str, note: str) -> Mechanism:
        """The mechanism, and what of the file it does not have in a note."""
        bare = replace(
            self.source,
            name=name,
            links=tuple(self._links()),
            pairs=tuple(self._pairs()),
            inputs=(),
            loads=(),
            springs=(),
            masses=(),
            stops=(),
            sketch=(),
            ids=(),
            about=None,
            source=None,
            geometry=None,
            notes=(note,),
            published=(),
            remarks=(),
            pair_stiffness=(),
            tolerances=None,
        )
        known = self._kept_names(bare)
        kept = {
            each: tuple(item for item in getattr(self.source, each) if {*_texts(item)} <= known)
            for each in ("loads", "springs", "masses", "stops")
        }
        lost = [each for each, items in kept.items() if len(items) < len(getattr(self.source, each))]
        lost += ["tolerances"] if self.source.tolerances is not None else []
        notes = (note, f"Left out, as they belong to other links: {', '.join(lost)}") if lost else (note,)
        return replace(bare, **kept, notes=notes, sketch=tuple(self._sketch(bare)))  # type: ignore[arg-type]

    def point_name(self, mechanism: Mechanism) -> str:
        """What results of the mechanism call the point."""
        ends = {
            (self.links[link], spot.name)
            for link in self.tracer.links
            for spot in self._spots(link)
            if self.posed.is_same(spot.at, self.tracer.at)
        }
        return next(point.name for point in named_points(mechanism) if ends & {*point.members})

    @cached_property
    def _original(self) -> PosedLinkage:
        return pose_linkage(self.state)

    @cached_property
    def _groups(self) -> dict[str, tuple[Pair, ...]]:
        return {group[0].entry_name(): group for group in pair_entries(self.source)}

    def _stays(self, pin: PosedPin) -> bool:
        """Whether a pin is that of the file, with the same links."""
        return pin in self._original.pins and not self.posed.remade & {*pin.links}

    def _member_point(self, pin: PosedPin, link: str) -> str:
        """What a link calls a pin: as in the file where link and pin are as they were, else by the pin's name."""
        if link not in self.posed.remade and self.pin_names[pin] == pin.name:
            members = {member for pair in self._groups[pin.name] for member in pair.coincident_points()}
            return next(point for own, point in members if own == link)
        return self.pin_names[pin]

    def _spots(self, link: str) -> list[Spot]:
        """The points of a link that pairs need, and the tracer."""
        found = [Spot(self._member_point(pin, link), pin.at) for pin in self.posed.pins_of(link)]
        more = [Spot(self._rider_point(guide), guide.point) for guide in self.posed.guides if guide.rider == link]
        if link in self.tracer.links:
            more.append(Spot(self.tracer_point, self.tracer.at))
        for spot in more:
            if not any(self.posed.is_same(spot.at, each.at) for each in found):
                found.append(spot)
        return found

    def _rider_point(self, guide: PosedGuide) -> str:
        """The point of its rider that a guide leads."""
        if guide.rider not in self.posed.remade:
            return self._guided(guide).point
        at_pin = (pin for pin in self.posed.pins_of(guide.rider) if self.posed.is_same(pin.at, guide.point))
        pin = next(at_pin, None)
        return self._guided(guide).point if pin is None else self.pin_names[pin]

    def _guided(self, guide: PosedGuide) -> GuidedPair:
        pair = self._groups[guide.pair][0]
        assert isinstance(pair, GuidedPair)
        return pair

    def _ends(self, link: str) -> tuple[Spot, Spot] | None:
        """The points from which to which a link's axis goes, where it is one that has ends."""
        places = self.posed.bars.get(link)
        own = next(each for each in self.source.links if each.name == link)
        if places is None and own.ends is not None:
            axes, factor = self.posed.axes[link], abs(self.posed.factors[link])
            shape = self.state.shapes[link]
            first, second = (complex(*map(float, shape.position(end))) for end in own.ends)
            turn = complex(*_unit(axes.angle))
            places = axes.origin + factor * first * turn, axes.origin + factor * second * turn
        if places is None:
            return None
        spots = self._spots(link)
        ends = [next((spot for spot in spots if self.posed.is_same(spot.at, at)), None) for at in places]
        return None if None in ends else (ends[0], ends[1])  # type: ignore[return-value]

    def _links(self) -> Iterator[Link]:
        for link in self.source.links:
            yield self._remade(link) if link.name in self.posed.remade else self._kept(link)

    def _remade(self, link: Link) -> Link:
        ends, axes = self._ends(link.name), self.axes[link.name]
        spots = [spot for spot in self._spots(link.name) if ends is None or spot not in ends]
        points = tuple(Point(spot.name, At(*self._tidy(axes.to_link(spot.at)))) for spot in spots)
        if ends is None:
            return Link(self.links[link.name], points)
        names = ends[0].name, ends[1].name
        return Link(self.links[link.name], points, names, abs(ends[1].at - ends[0].at))

    def _kept(self, link: Link) -> Link:
        """The link of the file with the points that it needs more, and without those that it had for other places."""
        needed = self._spots(link.name)
        points = list(link.points)
        points += [Point(spot.name, self._drawn(link.name, spot.at)) for spot in needed if spot.name not in link.names]
        had = {
            point
            for pin in self._original.pins
            if link.name in pin.links and pin not in self.posed.pins
            for pair in self._groups[pin.name]
            for own, point in pair.coincident_points()
            if own == link.name
        }
        words = {*_texts([point.place for point in link.points]), *(link.ends or ()), *(link.axis or ())}
        words |= {spot.name for spot in needed}
        words |= {text for guide in self.posed.guides for text in _texts(self._guided(guide).line)}
        words |= {*_texts([self.source.loads, self.source.springs, self.source.masses])}
        return replace(link, points=tuple(point for point in points if point.name not in had - words))

    def _drawn(self, link: str, at: complex) -> At:
        """A place of a kept link in the axes in which it was drawn."""
        shape = self.state.shapes[link]
        drawn = self.axes[link].to_link(at).rotate(shape.axis) + shape.origin
        return At(*self._tidy(drawn))

    def _tidy(self, at: Vector) -> tuple[float, float]:
        """Coordinates without what rounding leaves of none."""
        least = 1e-15 * self.posed.size
        return tuple(0.0 if abs(each) < least else float(each) for each in at)  # type: ignore[return-value]

    def _pairs(self) -> Iterator[Pair]:
        guides = {guide.pair: guide for guide in self.posed.guides}
        make: Any = turning_pair_type()
        for name, group in self._groups.items():
            if name in guides:
                yield self._guide(guides[name])
                continue
            pins = [pin for pin in self.posed.pins if pin.name == name]
            if not pins or all(map(self._stays, pins)):
                yield from group
                continue
            for pin in pins:
                own = self.pin_names[pin]
                ends = [(self.links[link], self._member_point(pin, link)) for link in pin.links]
                for other in ends[1:]:
                    motion = own if len(ends) == 2 else f"{own}:{ends[0][0]},{other[0]}"
                    yield make(motion, (ends[0][0], other[0]), (ends[0][1], other[1]), own)

    def _guide(self, guide: PosedGuide) -> Pair:
        pair = self._guided(guide)
        if guide in self._original.guides and not {guide.carrier, guide.rider} & self.posed.remade:
            return pair
        spots = self._spots(guide.carrier)
        line = pair.line.through
        if guide not in self._original.guides or guide.carrier in self.posed.remade or not isinstance(line, str):
            at = next((spot.name for spot in spots if self.posed.is_same(spot.at, guide.through)), None)
            line = at or self._place(guide.carrier, guide.through)
        way = wrap_angle(phase(guide.way) - self.axes[guide.carrier].angle)
        sizes = ("friction", "guide_length", "guide_width")
        more: dict[str, Any] = {each.name: None for each in fields(pair) if each.name in sizes}
        if guide.holds_angle:
            more["block_angle"] = wrap_angle(self.axes[guide.rider].angle - phase(guide.way))
        links = self.links[guide.carrier], self.links[guide.rider]
        return replace(pair, links=links, line=LinkLine(line, None, way), point=self._rider_point(guide), **more)

    def _place(self, link: str, at: complex) -> tuple[float, float]:
        """A place of a link as lines take it."""
        if link in self.posed.remade:
            return self._tidy(self.axes[link].to_link(at))
        x, y = self._drawn(link, at)
        return x, y

    def _sketch(self, mechanism: Mechanism) -> Iterator[tuple[str, float, float]]:
        """Where every point stands that is not on the frame."""
        back = {new: old for old, new in self.links.items()}
        for each in named_points(mechanism):
            if all(link != mechanism.frame for link, _ in each.members):
                link, point = each.members[0]
                at = self._world(back[link], point)
                yield each.name, at.real, at.imag

    def _world(self, link: str, point: str) -> complex:
        known = next((spot.at for spot in self._spots(link) if spot.name == point), None)
        if known is not None:
            return known
        own, axes = self.state.shapes[link].position(point), self.axes[link]
        return axes.origin + complex(float(own.x), float(own.y)) * complex(*_unit(axes.angle))

    def _kept_names(self, mechanism: Mechanism) -> set[str]:
        """Names by which something that acts on the mechanism can go on to mean what it meant."""
        kept = {link for link in self.posed.axes if link not in self.posed.remade}
        found = set(kept)
        old = {point.name: {*point.members} for point in named_points(self.source)}
        for each in named_points(mechanism):
            if any(member in old.get(each.name, ()) and member[0] in kept for member in each.members):
                found.add(each.name)
                found |= {f"{link}.{point}" for link, point in each.members if link in kept}
                found |= {point for _, point in each.members}
        found.add(self.point_name(mechanism))
        motions = relative_motions(self.source)
        for name, pair in relative_motions(mechanism).items():
            if {*pair.links} <= kept and name in motions and motions[name].links == pair.links:
                found.add(name)
        return found


def _unit(angle: float) -> tuple[float, float]:
    return cos(angle), sin(angle)


def _texts(item: Any) -> Iterator[str]:
    """Every text in nested data."""
    if isinstance(item, str):
        yield item
    elif isinstance(item, Mapping):
        for each in item.values():
            yield from _texts(each)
    elif isinstance(item, tuple | list):
        for each in item:
            yield from _texts(each)
