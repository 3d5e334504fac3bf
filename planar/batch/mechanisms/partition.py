"""A mechanism parted into groups of links that can be solved one after the other, on the level of links and pairs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import combinations
from math import hypot, inf
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import GROUNDED, Joint, Signature
from planar.batch.mechanisms.solved_block_type import MOST, Kind, kind
from planar.equations.block_decomposition import decompose
from planar.foundation.geometry import Vector, frame_at
from planar.model.link_shapes import At, Link, Shape, shape
from planar.model.mechanism import Mechanism, check
from planar.model.pairs import Pair
from planar.solving.checks.residual_check import EPS, SHORT_ARM

LARGEST = 8
"""Links of a group: larger ones are left to the general path, which solves the whole."""
NONE = Vector(0.0, 0.0)
AHEAD = Vector(1.0, 0.0)


class Unparted(Exception):
    """A mechanism that cannot be solved group after group; the text says why."""


class Group(NamedTuple):
    """One group of a mechanism: its kind, the places of its given links, inputs and inner links, and its numbers p (m).

    `level`: after which it can be solved; `turn`: the same, where a kind may take what the same kind has given.
    `inner` are numbers of links.
    """

    kind: Kind
    places: tuple[int, ...]
    p: list[float]
    inner: tuple[int, ...]
    level: int
    turn: int


class Parted(NamedTuple):
    """A mechanism as data, its lengths in units of `unit` (m).

    Places: 0 is the frame, then every input, then the links as they are solved; `place_of` tells those of the links.
    """

    mechanism: Mechanism
    shapes: dict[str, Shape]
    unit: float
    tolerance: float
    groups: list[Group]
    place_of: dict[str, int]
    places: int


class _About(NamedTuple):
    """The number of a pair type among all, how many motions it prevents, and whether it says the same of its bodies
    the other way round, so that kinds need not tell the two apart."""

    number: int
    holds: int
    even: bool


@lru_cache
def _about(of: type[Pair]) -> _About | None:
    """What there is to know of a pair type; None for one that needs the whole."""
    whole = of.counts_turns or of.apart is not Pair.apart or of.bodies is not Pair.bodies
    if whole or of.misfit is not Pair.misfit:
        return None
    return _About(_number(of), of.holds(), _even(of))


def _even(of: type[Pair]) -> bool:
    """Whether the residual only changes its sign where the bodies and their halves of the numbers change places."""
    half = len(of.measures) // 2
    if of.coordinates or 2 * half != len(of.measures) or of.measures[:half] != of.measures[half:]:
        return False
    rng = np.random.default_rng(0)
    a, b = (frame_at(*rng.uniform(-1.0, 1.0, 3)) for _ in range(2))
    numbers, pair = list(rng.uniform(-1.0, 1.0, 2 * half)), of.samples()[0].pair
    one = np.array(pair.residual((a, b), numbers, ()))
    return bool(np.allclose(one, -np.array(pair.residual((b, a), numbers[half:] + numbers[:half], ())), atol=1e-12))


_NUMBERS: dict[type[Pair], int] = {}


def _number(of: type[Pair]) -> int:
    return _NUMBERS.setdefault(of, len(_NUMBERS))


def quick(link: Link) -> Shape:
    """The shape of a link."""
    points = link.points
    if link.axis is not None or any(type(point.place) is not At for point in points):
        return shape(link)
    drawn = {name: Vector(place.x, place.y) for name, place in points}  # type: ignore[union-attr]
    if link.ends is not None:
        drawn = {link.ends[0]: NONE, link.ends[1]: Vector(link.length, 0.0)} | drawn
    return Shape(drawn, NONE, AHEAD)


def parted(mechanism: Mechanism) -> Parted:
    """The groups of a mechanism. Raises Unparted where it needs the whole, BadInput and Unplaced where it is none."""
    try:
        return _Parting(mechanism).parted()
    except (KeyError, AttributeError):
        check(mechanism)
        raise Unparted("something in it is not as its pairs expect it") from None


class _Parting:
    def __init__(self, mechanism: Mechanism):
        self.mechanism = mechanism
        self.shapes = {link.name: quick(link) for link in mechanism.links}
        self.unit, self.reach = _size(self.shapes.values())
        number = {name: k for k, name in enumerate(self.shapes)}
        self.names = list(number)
        self.frame = number[mechanism.frame]
        many = len(number)
        self.beside: list[list[tuple[int, int]]] = [[] for _ in range(many)]
        "for every link the links beside it, each with the pair between"
        self.pairs, self.weights, self.ends, self.even = list(mechanism.pairs), [], [], []
        for k, pair in enumerate(self.pairs):
            about = _about(type(pair))
            if about is None:
                raise Unparted(f"{pair.name} ties more together than two links at one place")
            a, b = pair.links
            first, second = number[a], number[b]
            self.beside[first].append((second, k))
            self.beside[second].append((first, k))
            self.weights.append(about.holds)
            self.even.append(about.even)
            self.ends.append((first, second))
        self.driven: dict[int, int] = {}
        for k, given in enumerate(mechanism.inputs):
            place = next((i for i, pair in enumerate(self.pairs) if pair.name == given.pair), None)
            if place is None or place in self.driven:
                raise Unparted(f"the input at {given.pair} is between links that no pair of their own joins")
            self.driven[place] = k
            self.even[place] = False  # an input is of the second body against the first
            self.weights[place] += 1
        turned = {link for place in self.driven for link in self.ends[place]}
        for k, each in enumerate(self.shapes.values()):
            if k != self.frame and k not in turned and _shortest(each) < SHORT_ARM * self.unit:
                raise Unparted(f"link {self.names[k]} is so short that rounding takes digits")
        self.number = number
        self.shared = self._shared()
        self.place = [-1] * many
        self.place[self.frame] = 0
        self.level, self.turn = [0] * many, [0] * many
        self.of_kind: list[Kind | None] = [None] * many
        self.groups: list[Group] = []
        self.places = 1 + len(mechanism.inputs)

    def parted(self) -> Parted:
        """See `parted`."""
        self._peeled()
        if len(self.groups) == 0 or -1 in self.place:
            self._rest()
        # as the gate of the whole has it
        tolerance = 16.0 * EPS * (4 + len(self.names)) * max(1.0, self.reach / self.unit)
        places = dict(zip(self.names, self.place, strict=True))
        return Parted(self.mechanism, self.shapes, self.unit, tolerance, self.groups, places, self.places)

    def _shared(self) -> dict[int, list[list[int]]]:
        """Of every link the pins that it shares with two links or more, each as its pairs, all from one link."""
        pins: dict[str, list[int]] = {}
        for k, pair in enumerate(self.pairs):
            if self.even[k]:
                pins.setdefault(pair.entry_name(), []).append(k)
        found: dict[int, list[list[int]]] = {}
        for own in pins.values():
            if len(own) > 1:
                for link in {link for k in own for link in self.ends[k]}:
                    found.setdefault(link, []).append(own)
        return found

    def _started(self, own: list[int], link: int) -> None:
        """Let the pairs of a pin start from another of its links."""
        if all(link in self.ends[k] for k in own):
            return
        pairs = [self.pairs[k] for k in own]
        named = self.names[link]
        for k in own:
            first, second = self.ends[k]
            self.beside[first].remove((second, k))
            self.beside[second].remove((first, k))
        others = [pair for pair in type(pairs[0]).motions(pairs) if named in pair.links]
        for k, pair in zip(own, others, strict=True):
            self.pairs[k] = pair
            first, second = self.ends[k] = tuple(self.number[each] for each in pair.links)
            self.beside[first].append((second, k))
            self.beside[second].append((first, k))

    def _peeled(self) -> None:
        """Links that follow at once from known ones: one alone, or two together."""
        held = [0] * len(self.place)
        waiting = [self.frame]
        while waiting:
            self._follow(waiting, held)
            # two that share a pin with a third, which is not known, and hang by one end each
            for own in {id(own): own for pins in self.shared.values() for own in pins}.values():
                links = dict.fromkeys(link for k in own for link in self.ends[k])
                ends = [link for link in links if self.place[link] < 0 and held[link] == 2]
                if len(ends) == 2 and all(self.place[link] < 0 for link in links):
                    self._started(own, ends[0])
                    self._add(tuple(ends))
                    waiting += ends
                    break

    def _follow(self, waiting: list[int], held: list[int]) -> None:
        """Add what follows at once from links that wait to be looked at; `held`: motions that known links prevent."""
        place, beside, weights = self.place, self.beside, self.weights
        while waiting:
            new = waiting.pop()
            for own in self.shared.get(new, ()):
                if not any(place[link] >= 0 for link in self._middle(own)):
                    self._started(own, new)
            touched = []
            for link, k in beside[new]:
                if place[link] < 0:
                    held[link] += weights[k]
                    touched.append(link)
            for link in touched:
                if place[link] < 0:
                    waiting += self._joined(link, held)

    def _joined(self, link: int, held: list[int]) -> tuple[int, ...]:
        """The links of a group that a link is in, by itself or with another, if it follows from known ones: added."""
        if held[link] == 3:
            self._add((link,))
            return (link,)
        if held[link] > 3:
            raise Unparted(f"link {self.names[link]} is held more than once")
        between: dict[int, int] = {}
        for other, k in self.beside[link]:
            if self.place[other] < 0:
                between[other] = between.get(other, 0) + self.weights[k]
        for other, holds in between.items():
            whole = held[link] + held[other] + holds
            if whole == 6 and held[other] <= 3:
                self._add((link, other))
                return (link, other)
            if whole > 6:
                raise Unparted(f"links {self.names[link]} and {self.names[other]} are held more than once")
        return ()

    def _middle(self, own: list[int]) -> set[int]:
        """The link from which the pairs of a pin start."""
        return set(self.ends[own[0]]) & set(self.ends[own[1]])

    def _rest(self) -> None:
        """What is left, in the smallest groups: Dulmage and Mendelsohn on links, each of three columns."""
        left = [link for link, place in enumerate(self.place) if place < 0]
        number = {link: k for k, link in enumerate(left)}
        rows: list[frozenset[int]] = []
        for (a, b), weight in zip(self.ends, self.weights, strict=True):
            own = [number[link] for link in (a, b) if link in number]
            if own:
                rows += [frozenset(3 * k + part for k in own for part in range(3))] * weight
        if len(rows) != 3 * len(left):
            raise Unparted("pairs and inputs leave links free, or hold them more than once")
        for group in decompose(rows, 3 * len(left)):
            if group.free or len(group.rows) != len(group.columns):
                raise Unparted("pairs and inputs leave links free, or hold them more than once")
            links = tuple(sorted({left[column // 3] for column in group.columns}))
            if len(links) > LARGEST:
                raise Unparted(f"{len(links)} links are solved together")
            self._add(links)

    def _add(self, inner: tuple[int, ...]) -> None:
        """Add a group: its pairs in an order that does not depend on names."""
        place, pairs, driven = self.place, self.pairs, self.driven
        if len(inner) > 1:
            inner = tuple(sorted(inner, key=self._held_by))
        local = {link: k for k, link in enumerate(inner)}
        found = []
        for link in inner:
            for other, k in self.beside[link]:
                here, there = local[link], local.get(other, -1)
                if (place[other] >= 0) or there > here:
                    turned = self.even[k] or self.ends[k][0] == link
                    found.append((_NUMBERS[type(pairs[k])], here, there, turned, k in driven, k, other))
        found.sort()
        key, given, inputs, p = [], [], [], []
        level, turn = 0, []
        shapes, names = self.shapes, self.names
        for number, here, inside, turned, is_driven, k, other in found:
            there = inside
            if inside < 0:
                there = GROUNDED if is_driven and other == self.frame else -1 - len(given)
                if there != GROUNDED:
                    given.append(place[other])
                level = max(level, self.level[other])
                turn.append(other)
            if is_driven:
                inputs.append(1 + driven[k])
            key.append((number, (here, there) if turned else (there, here), is_driven))
            pair = pairs[k]
            first, second = self.ends[k]
            numbers = pair.measure((shapes[names[first]], shapes[names[second]]))
            if self.even[k] and first != inner[here]:
                half = len(numbers) // 2
                numbers = (*numbers[half:], *numbers[:half])
            p += numbers
        known = (len(inner), len(given), tuple(key))
        own = _KINDS.get(known) or _made(known, pairs, found)
        if not own.square:
            raise Unparted("constraints hold each other more than once")
        after = max((self.turn[other] + (self.of_kind[other] is not own) for other in turn), default=0)
        own_places = []
        for link in inner:
            place[link] = self.places
            own_places.append(self.places)
            self.places += 1
            self.level[link], self.turn[link], self.of_kind[link] = level + 1, after, own
        self.groups.append(Group(own, (*given, *inputs, *own_places), p, inner, level, after))

    def _held_by(self, link: int) -> tuple:
        """What a link of a group is held by, so that equal groups come out alike."""
        own = [
            (
                _NUMBERS[type(self.pairs[k])],
                self.even[k] or self.ends[k][0] == link,
                k in self.driven,
                self.place[other] < 0,
            )
            for other, k in self.beside[link]
            if self.place[other] >= 0
        ]
        return len(own), sorted(own)


_KINDS: dict[tuple, Kind] = {}


def _made(known: tuple, pairs: Sequence[Pair], found: Sequence[tuple]) -> Kind:
    inner, given, key = known
    joints = tuple(
        Joint(type(pairs[each[5]]), bodies, driven) for each, (_, bodies, driven) in zip(found, key, strict=True)
    )
    if len(_KINDS) >= MOST:
        _KINDS.clear()
    made = _KINDS[known] = kind(Signature(inner, given, joints))
    return made


def _size(shapes: Iterable[Shape]) -> tuple[float, float]:
    """The greatest extent of a link, and the greatest coordinate (m)."""
    greatest, reach = 0.0, 0.0
    for each in shapes:
        points = each.points
        if len(points) == 2:
            (ax, ay), (bx, by) = points.values()
            greatest = max(greatest, hypot(bx - ax, by - ay))
            reach = max(reach, abs(ax), abs(ay), abs(bx), abs(by))
        elif points:
            xs, ys = zip(*points.values(), strict=True)
            greatest = max(greatest, hypot(max(xs) - min(xs), max(ys) - min(ys)))
            reach = max(reach, *map(abs, xs), *map(abs, ys))
    return greatest or 1.0, reach


def _shortest(shape: Shape) -> float:
    """The least distance between two points of a link that do not coincide (m)."""
    apart = (hypot(b.x - a.x, b.y - a.y) for a, b in combinations(shape.points.values(), 2))
    return min(filter(None, apart), default=inf)
