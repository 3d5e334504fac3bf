"""A mechanism partitioned into blocks of links that can be solved one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from itertools import combinations
from math import hypot, inf
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import (
    FRAME_BODY,
    MAX_BLOCK_TYPES,
    BlockPair,
    BlockSignature,
    BlockType,
    find_block_type,
)
from planar.equations.block_decomposition import decompose_blocks
from planar.foundation.geometry import Vector, frame_at
from planar.model.link_shapes import At, Link, LinkShape, link_shape
from planar.model.mechanism import Mechanism, check_mechanism
from planar.model.pairs import Pair
from planar.solving.checks.residual_check import SHORT_ARM, residual_tolerance

MAX_BLOCK_LINKS = 8
"""Links of a group: larger ones are left to the general path, which solves the whole."""
ORIGIN = Vector(0.0, 0.0)
X_AXIS = Vector(1.0, 0.0)


class NotPartitionable(Exception):
    """A mechanism that cannot be solved group after group; the text says why."""


class PartitionBlock(NamedTuple):
    """One group of a mechanism: its kind, the places of its given links, inputs and inner links, and its numbers p (m).

    `inner_links` are numbers of links; blocks follow those that give them links.
    """

    block_type: BlockType
    link_indices: tuple[int, ...]
    p: list[float]
    inner_links: tuple[int, ...]


class Partition(NamedTuple):
    """A mechanism as data, its lengths in units of `unit` (m).

    Places: 0 is the frame, then every input, then the links as they are solved; `link_index` tells those of the links.
    """

    mechanism: Mechanism
    shapes: dict[str, LinkShape]
    unit: float
    tolerance: float
    blocks: list[PartitionBlock]
    link_index: dict[str, int]
    index_count: int


class _PairTypeFacts(NamedTuple):
    """The number of a pair type among all, how many motions it prevents, and whether it says the same of its bodies
    the other way round, so that kinds need not tell the two apart."""

    number: int
    holds: int
    is_symmetric: bool


@lru_cache
def _pair_type_facts(pair_type: type[Pair]) -> _PairTypeFacts | None:
    """What there is to know of a pair type; None for one that needs the whole."""
    whole = (
        pair_type.counts_turns or pair_type.contact_gap is not Pair.contact_gap or pair_type.bodies is not Pair.bodies
    )
    if whole or pair_type.find_misfit is not Pair.find_misfit:
        return None
    return _PairTypeFacts(_pair_type_number(pair_type), pair_type.prevented_motion_count(), _is_symmetric(pair_type))


def _is_symmetric(pair_type: type[Pair]) -> bool:
    """Whether the residual only changes its sign where the bodies and their halves of the numbers change places."""
    half = len(pair_type.number_kinds) // 2
    if (
        pair_type.coordinate_kinds
        or 2 * half != len(pair_type.number_kinds)
        or pair_type.number_kinds[:half] != pair_type.number_kinds[half:]
    ):
        return False
    rng = np.random.default_rng(0)
    a, b = (frame_at(*rng.uniform(-1.0, 1.0, 3)) for _ in range(2))
    numbers, pair = list(rng.uniform(-1.0, 1.0, 2 * half)), pair_type.samples()[0].pair
    one = np.array(pair.residual((a, b), numbers, ()))
    return bool(np.allclose(one, -np.array(pair.residual((b, a), numbers[half:] + numbers[:half], ())), atol=1e-12))


_PAIR_TYPE_NUMBERS: dict[type[Pair], int] = {}


def _pair_type_number(pair_type: type[Pair]) -> int:
    return _PAIR_TYPE_NUMBERS.setdefault(pair_type, len(_PAIR_TYPE_NUMBERS))


def quick_link_shape(link: Link) -> LinkShape:
    """The shape of a link."""
    points = link.points
    if link.axis is not None:
        return link_shape(link)
    drawn: dict[str, Vector] = {}
    for name, place in points:
        if type(place) is not At:
            return link_shape(link)
        drawn[name] = Vector(place.x, place.y)
    if link.ends is not None:
        drawn = {link.ends[0]: ORIGIN, link.ends[1]: Vector(link.length, 0.0)} | drawn
    return LinkShape(drawn, ORIGIN, X_AXIS)


def partition_mechanism(mechanism: Mechanism) -> Partition:
    """The groups of a mechanism. Raises NotPartitionable where it needs the whole, BadInput and PointPlacementError
    where it is none."""
    try:
        return _Partitioner(mechanism).partition()
    except (KeyError, AttributeError):
        check_mechanism(mechanism)
        raise NotPartitionable("something in it is not as its pairs expect it") from None


class _Partitioner:
    def __init__(self, mechanism: Mechanism):
        self.mechanism = mechanism
        self.shapes = {link.name: quick_link_shape(link) for link in mechanism.links}
        self.unit, self.reach = _size_and_reach(self.shapes.values())
        number = {name: k for k, name in enumerate(self.shapes)}
        self.names = list(number)
        self.frame = number[mechanism.frame]
        many = len(number)
        self.neighbours: list[list[tuple[int, int]]] = [[] for _ in range(many)]
        "for every link the links beside it, each with the pair between"
        self.pairs = list(mechanism.pairs)
        self.pair_points = [pair.coincident_points() for pair in self.pairs]
        self.prevented_motions: list[int] = []
        self.ends: list[tuple[int, int]] = []
        self.is_symmetric: list[bool] = []
        for k, pair in enumerate(self.pairs):
            about = _pair_type_facts(type(pair))
            if about is None:
                raise NotPartitionable(f"{pair.name} ties more together than two links at one place")
            a, b = pair.links
            first, second = number[a], number[b]
            self.neighbours[first].append((second, k))
            self.neighbours[second].append((first, k))
            self.prevented_motions.append(about.holds)
            self.is_symmetric.append(about.is_symmetric)
            self.ends.append((first, second))
        self.input_of_pair: dict[int, int] = {}
        for k, given in enumerate(mechanism.inputs):
            place = next((i for i, pair in enumerate(self.pairs) if pair.name == given.pair), None)
            if place is None or place in self.input_of_pair:
                raise NotPartitionable(f"the input at {given.pair} is between links that no pair of their own joins")
            self.input_of_pair[place] = k
            self.is_symmetric[place] = False  # an input is of the second body against the first
            self.prevented_motions[place] += 1
        self.number = number
        self.shared_pins = self._find_shared_pins()
        self.link_index = [-1] * many
        self.link_index[self.frame] = 0
        self.blocks: list[PartitionBlock] = []
        self.index_count = 1 + len(mechanism.inputs)

    def partition(self) -> Partition:
        """See `partition_mechanism`."""
        self._add_links_and_dyads()
        if len(self.blocks) == 0 or -1 in self.link_index:
            self._add_remaining_blocks()
        tolerance = float(residual_tolerance(len(self.names), self.reach / self.unit))
        places = dict(zip(self.names, self.link_index, strict=True))
        return Partition(self.mechanism, self.shapes, self.unit, tolerance, self.blocks, places, self.index_count)

    def _find_shared_pins(self) -> dict[int, list[list[int]]]:
        """Of every link the pins that it shares with two links or more, each as its pairs, all from one link."""
        pins: dict[str, list[int]] = {}
        for k, pair in enumerate(self.pairs):
            if self.is_symmetric[k]:
                pins.setdefault(pair.entry_name(), []).append(k)
        found: dict[int, list[list[int]]] = {}
        for own in pins.values():
            if len(own) > 1:
                for link in {link for k in own for link in self.ends[k]}:
                    found.setdefault(link, []).append(own)
        return found

    def _rebase_pin(self, own: list[int], link: int) -> None:
        """Let the pairs of a pin start from another of its links."""
        if all(link in self.ends[k] for k in own):
            return
        pairs = [self.pairs[k] for k in own]
        named = self.names[link]
        for k in own:
            first, second = self.ends[k]
            self.neighbours[first].remove((second, k))
            self.neighbours[second].remove((first, k))
        others = [pair for pair in type(pairs[0]).relative_motions(pairs) if named in pair.links]
        for k, pair in zip(own, others, strict=True):
            self.pairs[k], self.pair_points[k] = pair, pair.coincident_points()
            one, other = pair.links
            first, second = self.ends[k] = self.number[one], self.number[other]
            self.neighbours[first].append((second, k))
            self.neighbours[second].append((first, k))

    def _add_links_and_dyads(self) -> None:
        """Links that follow at once from known ones: one alone, or two together."""
        held = [0] * len(self.link_index)
        waiting = [self.frame]
        while waiting:
            self._add_following_links(waiting, held)
            # two that share a pin with a third, which is not known, and hang by one end each
            for own in {id(own): own for pins in self.shared_pins.values() for own in pins}.values():
                links = dict.fromkeys(link for k in own for link in self.ends[k])
                ends = [link for link in links if self.link_index[link] < 0 and held[link] == 2]
                if len(ends) == 2 and all(self.link_index[link] < 0 for link in links):
                    self._rebase_pin(own, ends[0])
                    self._add_block(tuple(ends))
                    waiting += ends
                    break

    def _add_following_links(self, waiting: list[int], held: list[int]) -> None:
        """Add what follows at once from links that wait to be looked at; `held`: motions that known links prevent."""
        place, beside, weights = self.link_index, self.neighbours, self.prevented_motions
        while waiting:
            new = waiting.pop()
            for own in self.shared_pins.get(new, ()):
                if not any(place[link] >= 0 for link in self._base_links(own)):
                    self._rebase_pin(own, new)
            touched = []
            for link, k in beside[new]:
                if place[link] < 0:
                    held[link] += weights[k]
                    touched.append(link)
            for link in touched:
                if place[link] < 0:
                    waiting += self._add_block_with(link, held)

    def _add_block_with(self, link: int, held: list[int]) -> tuple[int, ...]:
        """The links of a group that a link is in, by itself or with another, if it follows from known ones: added."""
        if held[link] == 3:
            self._add_block((link,))
            return (link,)
        if held[link] > 3:
            raise NotPartitionable(f"link {self.names[link]} is held more than once")
        between: dict[int, int] = {}
        for other, k in self.neighbours[link]:
            if self.link_index[other] < 0:
                between[other] = between.get(other, 0) + self.prevented_motions[k]
        for other, holds in between.items():
            whole = held[link] + held[other] + holds
            if whole == 6 and held[other] <= 3:
                self._add_block((link, other))
                return (link, other)
            if whole > 6:
                raise NotPartitionable(f"links {self.names[link]} and {self.names[other]} are held more than once")
        return ()

    def _base_links(self, own: list[int]) -> set[int]:
        """The link from which the pairs of a pin start."""
        return set(self.ends[own[0]]) & set(self.ends[own[1]])

    def _add_remaining_blocks(self) -> None:
        """What is left, in the smallest groups: Dulmage and Mendelsohn on links, each of three columns."""
        left = [link for link, place in enumerate(self.link_index) if place < 0]
        number = {link: k for k, link in enumerate(left)}
        rows: list[frozenset[int]] = []
        for (a, b), weight in zip(self.ends, self.prevented_motions, strict=True):
            own = [number[link] for link in (a, b) if link in number]
            if own:
                rows += [frozenset(3 * k + part for k in own for part in range(3))] * weight
        if len(rows) != 3 * len(left):
            raise NotPartitionable("pairs and inputs leave links free, or hold them more than once")
        for group in decompose_blocks(rows, 3 * len(left)):
            if group.is_free or len(group.rows) != len(group.columns):
                raise NotPartitionable("pairs and inputs leave links free, or hold them more than once")
            links = tuple(sorted({left[column // 3] for column in group.columns}))
            if len(links) > MAX_BLOCK_LINKS:
                raise NotPartitionable(f"{len(links)} links are solved together")
            self._add_block(links)

    def _refuse_short_arms(self, inner: tuple[int, ...], pairs: Sequence[int]) -> None:
        """Links whose arm between the pairs that place them is so short that rounding takes digits of their angles.

        What the input turns is turned exactly, and the pairs of later groups ask for places alone.
        """
        if len(inner) == 1 and any(k in self.input_of_pair for k in pairs):
            return
        for link in inner:
            name = self.names[link]
            shape = self.shapes[name].points
            places = [shape[at] for at in {at for k in pairs for owner, at in self.pair_points[k] if owner == name}]
            arms = (hypot(b.x - a.x, b.y - a.y) for a, b in combinations(places, 2))
            if min(filter(None, arms), default=inf) < SHORT_ARM * self.unit:
                raise NotPartitionable(f"link {name} is so short that rounding takes digits")

    def _add_block(self, inner: tuple[int, ...]) -> None:
        """Add a group: its pairs in an order that does not depend on names."""
        place, pairs, driven = self.link_index, self.pairs, self.input_of_pair
        if len(inner) > 1:
            inner = tuple(sorted(inner, key=self._sort_key))
        local = {link: k for k, link in enumerate(inner)}
        found = []
        for link in inner:
            for other, k in self.neighbours[link]:
                here, there = local[link], local.get(other, -1)
                if (place[other] >= 0) or there > here:
                    turned = self.is_symmetric[k] or self.ends[k][0] == link
                    found.append((_PAIR_TYPE_NUMBERS[type(pairs[k])], here, there, turned, k in driven, k, other))
        found.sort()
        given: list[int] = []
        p: list[float] = []
        key, inputs = [], []
        shapes, names = self.shapes, self.names
        for number, here, inside, turned, is_driven, k, other in found:
            there = inside
            if inside < 0:
                there = FRAME_BODY if is_driven and other == self.frame else -1 - len(given)
                if there != FRAME_BODY:
                    given.append(place[other])
            if is_driven:
                inputs.append(1 + driven[k])
            key.append((number, (here, there) if turned else (there, here), is_driven))
            pair = pairs[k]
            first, second = self.ends[k]
            numbers = pair.measure((shapes[names[first]], shapes[names[second]]))
            if self.is_symmetric[k] and first != inner[here]:
                half = len(numbers) // 2
                numbers = (*numbers[half:], *numbers[:half])
            p += numbers
        self._refuse_short_arms(inner, [each[-2] for each in found])
        known = (len(inner), len(given), tuple(key))
        own = _BLOCK_TYPES.get(known) or _make_block_type(known, [type(pairs[each[5]]) for each in found])
        if not own.is_square:
            raise NotPartitionable("constraints hold each other more than once")
        own_places = []
        for link in inner:
            place[link] = self.index_count
            own_places.append(self.index_count)
            self.index_count += 1
        self.blocks.append(PartitionBlock(own, (*given, *inputs, *own_places), p, inner))

    def _sort_key(self, link: int) -> tuple[int, list[tuple[int, bool, bool, bool]]]:
        """What a link of a group is held by, so that equal groups come out alike."""
        own = [
            (
                _PAIR_TYPE_NUMBERS[type(self.pairs[k])],
                self.is_symmetric[k] or self.ends[k][0] == link,
                k in self.input_of_pair,
                self.link_index[other] < 0,
            )
            for other, k in self.neighbours[link]
            if self.link_index[other] >= 0
        ]
        return len(own), sorted(own)


_SignatureKey = tuple[int, int, tuple[tuple[int, tuple[int, int], bool], ...]]
_BLOCK_TYPES: dict[_SignatureKey, BlockType] = {}


def _make_block_type(signature_key: _SignatureKey, pair_types: Sequence[type[Pair]]) -> BlockType:
    inner, given, key = signature_key
    joints = tuple(BlockPair(each, bodies, driven) for each, (_, bodies, driven) in zip(pair_types, key, strict=True))
    if len(_BLOCK_TYPES) >= MAX_BLOCK_TYPES:
        _BLOCK_TYPES.clear()
    made = _BLOCK_TYPES[signature_key] = find_block_type(BlockSignature(inner, given, joints))
    return made


def _size_and_reach(shapes: Iterable[LinkShape]) -> tuple[float, float]:
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
