"""The structure of a mechanism: blocks of links that can be solved one after the other, and where their numbers are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, count
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import (
    FRAME_BODY,
    BlockPair,
    BlockSignature,
    BlockType,
    find_block_type,
)
from planar.equations.block_decomposition import decompose_blocks
from planar.foundation.arrays import IntArray
from planar.foundation.geometry import frame_at
from planar.model.link_shapes import At, Link, LinkShape, link_shape
from planar.model.mechanism import Mechanism, check_mechanism, named_points
from planar.model.pairs import MeasureKind as Measure
from planar.model.pairs import Pair

MAX_BLOCK_LINKS = 8
"""Maximum number of links of a block: the general path solves mechanisms with larger ones."""
MAX_STRUCTURES = 1024
"""Number of structures that are kept."""


class NotPartitionable(Exception):
    """A mechanism that cannot be solved block after block; the text says why."""


class PartitionBlock(NamedTuple):
    """One block of a mechanism: its type; the places of its given links, inputs and inner links; where the numbers of
    its pairs are among those of the mechanism; and the names of its inner links."""

    block_type: BlockType
    link_indices: tuple[int, ...]
    number_indices: tuple[int, ...]
    inner_links: tuple[str, ...]


class BlockRows(NamedTuple):
    """The blocks of one type in a structure: `block_numbers` (blocks,), and arrays (blocks, ...) of what a
    `PartitionBlock` has."""

    block_numbers: IntArray
    link_indices: IntArray
    number_indices: IntArray


class PointLayout(NamedTuple):
    """Points of a structure (points,): the places of their links; and where x in the link and x in the world are among
    the numbers, before y."""

    link_index: IntArray
    coordinates: IntArray
    places: IntArray


@dataclass(frozen=True, eq=False)
class Structure:
    """What mechanisms have in common whose names, pair types, inputs and names in the sketch are equal.

    Places: 0 is the frame, then every input, then the links in the order in which they are solved; `link_index` maps
    the names of links to places. Blocks follow those that give them links.

    The numbers of a mechanism are x and y of all points in their links (m), link after link; then the numbers of those
    pairs that are not pins, `measured_pairs` (pair, first link, second link); then x and y of its sketch.
    `point_places` (points,) are the places of the points' links, `link_starts` the first point of each link that has
    points, `arms` (arms, 2) the pairs of points whose distance decides the angle of a link in its block. `members`: the
    points that lie together under a name, that on the link with the lowest place first. `sketch`: points of the sketch
    that move. `shown_points`: points of every link that the sketch shows, or that lie on the frame, if a block has no
    closed form.
    """

    link_index: dict[str, int]
    place_count: int
    blocks: list[PartitionBlock]
    block_rows: dict[BlockType, BlockRows]
    input_is_angle: list[bool]
    measured_pairs: list[tuple[int, int, int]]
    point_places: IntArray
    link_starts: IntArray
    arms: IntArray
    members: dict[str, list[int]]
    moving_points: tuple[str, ...]
    sketch: PointLayout
    shown_points: PointLayout


_PairKey = tuple[type[Pair], str, tuple[str, str], str, tuple[tuple[str, str], ...]]
"""Of a pair its type, its name, its links, the name of its entry, and the points that it keeps together."""
_structures: dict[object, Structure] = {}


def partition_mechanism(mechanism: Mechanism) -> tuple[Structure, list[float]]:
    """The structure of a mechanism, and its numbers (m, rad).

    Raises NotPartitionable where it can only be solved as a whole, BadInput and PointPlacementError for wrong
    arguments.
    """
    try:
        return _partition(mechanism)
    except (KeyError, AttributeError):
        check_mechanism(mechanism)
        raise NotPartitionable("something in it is not as its pairs expect it") from None


def _partition(mechanism: Mechanism) -> tuple[Structure, list[float]]:
    numbers: list[float] = []
    shapes: dict[str, LinkShape] = {}
    point_names = [_read_points(link, numbers, shapes) for link in mechanism.links]
    pairs = [(type(p), p.name, p.links, p.entry_name(), p.coincident_points()) for p in mechanism.pairs]
    links, inputs = [link.name for link in mechanism.links], [given.pair for given in mechanism.inputs]
    sketch = [name for name, _, _ in mechanism.sketch]
    key = mechanism.frame, tuple(links), tuple(point_names), tuple(pairs), tuple(inputs), tuple(sketch)
    structure = _structures.get(key)
    if structure is None:
        if len(_structures) >= MAX_STRUCTURES:
            _structures.clear()
        structure = _structures[key] = _Partitioner(mechanism, point_names, pairs).partition()
    for k, *ends in structure.measured_pairs:
        for link in ends:
            if links[link] not in shapes:
                shapes[links[link]] = link_shape(mechanism.links[link])
        numbers += mechanism.pairs[k].measure([shapes[links[link]] for link in ends])
    for _, x, y in mechanism.sketch:
        numbers += (x, y)
    return structure, numbers


def _read_points(link: Link, numbers: list[float], shapes: dict[str, LinkShape]) -> tuple[str, ...]:
    """The names of the points of a link; x and y of each are added to the numbers, and the shape of a link to
    the shapes that has to be worked out."""
    names, first = link.ends or (), len(numbers)
    if names:
        numbers += (0.0, 0.0, link.length, 0.0)  # type: ignore[arg-type]
    for name, place in link.points:
        if type(place) is not At or name in names or link.axis is not None:
            shape = shapes[link.name] = link_shape(link)
            numbers[first:] = [part for point in shape.points.values() for part in point]
            return tuple(shape.points)
        numbers += place
        names = (*names, name)
    return names


class _PairTypeFacts(NamedTuple):
    """The number of a pair type among all, how many motions it prevents, and whether it is a pin: its numbers are
    the coordinates of the points that it keeps together, and it is the same with the links exchanged."""

    number: int
    prevented_motions: int
    is_pin: bool


_pair_type_numbers = count()


@lru_cache
def _pair_type_facts(pair_type: type[Pair]) -> _PairTypeFacts | None:
    """The facts of a pair type; None for one that needs more than the places of its two links."""
    if pair_type.counts_turns or any(
        getattr(pair_type, name) is not getattr(Pair, name) for name in ("contact_gap", "bodies", "find_misfit")
    ):
        return None
    is_pin = False
    sample = pair_type.samples()[0]
    points = sample.pair.coincident_points()
    if len(points) == 2 and pair_type.number_kinds == (Measure.LENGTH,) * 4 and not pair_type.coordinate_kinds:
        rng = np.random.default_rng(0)
        numbers, frames = rng.uniform(-1.0, 1.0, 4).tolist(), [frame_at(*rng.uniform(-1.0, 1.0, 3)) for _ in range(2)]
        residual = np.array(sample.pair.residual(frames, numbers, ()))
        exchanged = sample.pair.residual(frames[::-1], numbers[2:] + numbers[:2], ())
        places = [part for shape, (_, point) in zip(sample.shapes, points, strict=True) for part in shape.points[point]]
        is_pin = bool(np.allclose(residual, np.negative(exchanged), atol=1e-12))
        is_pin &= list(sample.pair.measure(sample.shapes)) == places
    return _PairTypeFacts(next(_pair_type_numbers), pair_type.prevented_motion_count(), is_pin)


class _Partitioner:
    """Finds the structure of a mechanism."""

    def __init__(self, mechanism: Mechanism, point_names: Sequence[tuple[str, ...]], pairs: Sequence[_PairKey]):
        self.mechanism, self.pairs = mechanism, pairs
        self.names = [link.name for link in mechanism.links]
        self.frame = self.names.index(mechanism.frame)
        points = [(link, name) for link, names in zip(self.names, point_names, strict=True) for name in names]
        self.points = {point: k for k, point in enumerate(points)}
        self.point_links = [link for link, names in enumerate(point_names) for _ in names]
        self.number_count = 2 * len(points)
        self.measured_pairs: list[tuple[int, int, int]] = []
        self.ends: list[tuple[int, int]] = []
        "the links of every pair"
        self.pair_numbers: list[tuple[int, ...]] = []
        "where the numbers of every pair are"
        self.facts: list[_PairTypeFacts] = []
        self.is_symmetric: list[bool] = []
        self.neighbours: list[list[tuple[int, int]]] = [[] for _ in self.names]
        "for every link the links beside it, each with the pair between"
        self._add_pairs()
        self.input_of_pair: dict[int, int] = {}
        self.prevented_motions = [facts.prevented_motions for facts in self.facts]
        pair_indices = {pairs[k][1]: k for k in reversed(range(len(pairs)))}
        for k, given in enumerate(mechanism.inputs):
            index = pair_indices.get(given.pair)
            if index is None or index in self.input_of_pair:
                raise NotPartitionable(f"the input at {given.pair} is between links that no pair of their own joins")
            self.input_of_pair[index] = k
            self.is_symmetric[index] = False  # an input is of the second body against the first
            self.prevented_motions[index] += 1
        self.shared_pins = self._find_shared_pins()
        self.link_index = [-1] * len(self.names)
        self.link_index[self.frame] = 0
        self.blocks: list[PartitionBlock] = []
        self.arms: list[tuple[int, int]] = []
        self.place_count = 1 + len(mechanism.inputs)

    def _add_pairs(self) -> None:
        number = {name: k for k, name in enumerate(self.names)}
        numbers: tuple[int, ...]
        for k, (pair_type, name, links, _, points) in enumerate(self.pairs):
            facts = _pair_type_facts(pair_type)
            if facts is None:
                raise NotPartitionable(f"{name} ties more together than two links at one place")
            ends = number[links[0]], number[links[1]]
            if facts.is_pin:
                first, second = 2 * self.points[points[0]], 2 * self.points[points[1]]
                numbers = first, first + 1, second, second + 1
            else:
                self.measured_pairs.append((k, *ends))
                numbers = tuple(range(self.number_count, self.number_count + len(pair_type.number_kinds)))
                self.number_count += len(numbers)
            self.facts.append(facts)
            self.is_symmetric.append(facts.is_pin)
            self.pair_numbers.append(numbers)
            self.ends.append(ends)
            self._join(k)

    def _join(self, k: int) -> None:
        first, second = self.ends[k]
        self.neighbours[first].append((second, k))
        self.neighbours[second].append((first, k))

    def partition(self) -> Structure:
        """See `Structure`."""
        self._add_links_and_dyads()
        if len(self.blocks) == 0 or -1 in self.link_index:
            self._add_remaining_blocks()
        rows: dict[BlockType, list[int]] = {}
        for k, block in enumerate(self.blocks):
            rows.setdefault(block.block_type, []).append(k)
        if not all(block_type.has_closed_form or block_type.has_newton_functions for block_type in rows):
            raise NotPartitionable("formulas are too long to be compiled")
        block_rows = {
            block_type: BlockRows(
                np.array(own),
                *(np.array([self.blocks[k][part] for k in own], dtype=np.int64) for part in (1, 2)),
            )
            for block_type, own in rows.items()
        }
        kinds = {name: pair_type.input_kind for pair_type, name, *_ in self.pairs}
        point_places = [self.link_index[link] for link in self.point_links]
        members = {name: [self.points[point] for point in points] for name, points in named_points(self.mechanism)}
        for points in members.values():
            points.sort(key=point_places.__getitem__)
        starts = [k for k, link in enumerate(self.point_links) if k == 0 or link != self.point_links[k - 1]]
        sketch, shown = self._sketch_layouts(members, point_places, all(kind.has_closed_form for kind in rows))
        return Structure(
            dict(zip(self.names, self.link_index, strict=True)),
            self.place_count,
            self.blocks,
            block_rows,
            [kinds[given.pair] is not Measure.LENGTH for given in self.mechanism.inputs],
            self.measured_pairs,
            np.array(point_places, dtype=np.int64),
            np.array(starts, dtype=np.int64),
            np.array(self.arms, dtype=np.int64).reshape(-1, 2),
            members,
            tuple(name for name, points in members.items() if point_places[points[0]]),
            sketch,
            shown,
        )

    def _sketch_layouts(
        self, members: dict[str, list[int]], point_places: Sequence[int], has_closed_form: bool
    ) -> tuple[PointLayout, PointLayout]:
        """`sketch` and `shown_points` of the structure."""
        names = [name for name, _, _ in self.mechanism.sketch]
        if not all(name in members for name in names):
            raise NotPartitionable("the sketch names a point that is not there")
        in_sketch = {name: self.number_count + 2 * k for k, name in enumerate(names)}
        sketch = [(members[name][0], self.number_count + 2 * k) for k, name in enumerate(names)]
        shown: list[tuple[int, int]] = []
        for name, points in members.items() if not has_closed_form else ():
            place = in_sketch.get(name) if point_places[points[0]] else 2 * points[0]
            if place is not None:
                shown += [(point, place) for point in points]
        layouts = []
        for rows in (sketch, shown):
            moving = [(point_places[k], 2 * k, place) for k, place in rows if point_places[k]]
            layouts.append(PointLayout(*np.array(moving, dtype=np.int64).reshape(-1, 3).T))
        return layouts[0], layouts[1]

    def _find_shared_pins(self) -> dict[int, list[list[int]]]:
        """For every link the pins that it shares with two links or more, each as its pairs, all from one link."""
        pins: dict[str, list[int]] = {}
        for k, (_, _, _, entry, _) in enumerate(self.pairs):
            if self.is_symmetric[k]:
                pins.setdefault(entry, []).append(k)
        shared: dict[int, list[list[int]]] = {}
        for pairs in pins.values():
            if len(pairs) > 1:
                for link in {link for k in pairs for link in self.ends[k]}:
                    shared.setdefault(link, []).append(pairs)
        return shared

    def _base_links(self, pairs: list[int]) -> set[int]:
        """The link from which the pairs of a shared pin start."""
        return set(self.ends[pairs[0]]) & set(self.ends[pairs[1]])

    def _rebase_pin(self, pairs: list[int], link: int) -> None:
        """Let the pairs of a shared pin start from another of its links."""
        if all(link in self.ends[k] for k in pairs):
            return
        numbers = {}
        for k in pairs:
            for end, part in zip(self.ends[k], (slice(2), slice(2, 4)), strict=True):
                numbers[end] = self.pair_numbers[k][part]
            for end, other in (self.ends[k], self.ends[k][::-1]):
                self.neighbours[end].remove((other, k))
        links = list(numbers)
        ends = [pair for pair in combinations(links, 2) if link in pair]
        for k, (first, second) in zip(pairs, ends, strict=True):
            self.ends[k], self.pair_numbers[k] = (first, second), numbers[first] + numbers[second]
            self._join(k)

    def _add_links_and_dyads(self) -> None:
        """Add the links that follow at once from known ones: one alone, or two together."""
        prevented = [0] * len(self.link_index)
        waiting = [self.frame]
        while waiting:
            self._add_following_links(waiting, prevented)
            # two that share a pin with a third, which is not known, and are each joined to one known link
            for pairs in {id(pairs): pairs for pins in self.shared_pins.values() for pairs in pins}.values():
                links = dict.fromkeys(link for k in pairs for link in self.ends[k])
                ends = [link for link in links if self.link_index[link] < 0 and prevented[link] == 2]
                if len(ends) == 2 and all(self.link_index[link] < 0 for link in links):
                    self._rebase_pin(pairs, ends[0])
                    self._add_block(tuple(ends))
                    waiting += ends
                    break

    def _add_following_links(self, waiting: list[int], prevented: list[int]) -> None:
        """Add what follows at once from links that wait; `prevented`: how many motions known links prevent."""
        place, neighbours, weights = self.link_index, self.neighbours, self.prevented_motions
        while waiting:
            new = waiting.pop()
            for pairs in self.shared_pins.get(new, ()):
                if not any(place[link] >= 0 for link in self._base_links(pairs)):
                    self._rebase_pin(pairs, new)
            touched = []
            for link, k in neighbours[new]:
                if place[link] < 0:
                    prevented[link] += weights[k]
                    touched.append(link)
            for link in touched:
                if place[link] < 0:
                    waiting += self._add_block_with(link, prevented)

    def _add_block_with(self, link: int, prevented: list[int]) -> tuple[int, ...]:
        """Add the block of a link, alone or with another, if it follows from known links; return its links."""
        if prevented[link] == 3:
            self._add_block((link,))
            return (link,)
        if prevented[link] > 3:
            raise NotPartitionable(f"link {self.names[link]} is held more than once")
        between: dict[int, int] = {}
        for other, k in self.neighbours[link]:
            if self.link_index[other] < 0:
                between[other] = between.get(other, 0) + self.prevented_motions[k]
        for other, motions in between.items():
            total = prevented[link] + prevented[other] + motions
            if total == 6 and prevented[other] <= 3:
                self._add_block((link, other))
                return (link, other)
            if total > 6:
                raise NotPartitionable(f"links {self.names[link]} and {self.names[other]} are held more than once")
        return ()

    def _add_remaining_blocks(self) -> None:
        """Add the other links in the smallest blocks: Dulmage and Mendelsohn on links, each of three columns."""
        links = [link for link, place in enumerate(self.link_index) if place < 0]
        number = {link: k for k, link in enumerate(links)}
        rows: list[frozenset[int]] = []
        for ends, weight in zip(self.ends, self.prevented_motions, strict=True):
            unknown = [number[link] for link in ends if link in number]
            if unknown:
                rows += [frozenset(3 * k + part for k in unknown for part in range(3))] * weight
        if len(rows) != 3 * len(links):
            raise NotPartitionable("pairs and inputs leave links free, or hold them more than once")
        for block in decompose_blocks(rows, 3 * len(links)):
            if block.is_free or len(block.rows) != len(block.columns):
                raise NotPartitionable("pairs and inputs leave links free, or hold them more than once")
            inner = tuple(sorted({links[column // 3] for column in block.columns}))
            if len(inner) > MAX_BLOCK_LINKS:
                raise NotPartitionable(f"{len(inner)} links are solved together")
            self._add_block(inner)

    def _add_arms(self, inner: tuple[int, ...], pairs: Sequence[int]) -> None:
        """Note the arms between the pins that place inner links.

        An input turns its link exactly, and the pairs of later blocks need places only.
        """
        if len(inner) == 1 and any(k in self.input_of_pair for k in pairs):
            return
        points: dict[int, set[int]] = {link: set() for link in inner}
        for k in pairs:
            for link, number in zip(self.ends[k], self.pair_numbers[k][::2], strict=False):
                if self.facts[k].is_pin and link in points:
                    points[link].add(number // 2)
        self.arms += [arm for own in points.values() for arm in combinations(own, 2)]

    def _add_block(self, inner: tuple[int, ...]) -> None:
        """Add a block, its pairs in an order that does not depend on names."""
        place, driven = self.link_index, self.input_of_pair
        if len(inner) > 1:
            inner = tuple(sorted(inner, key=self._sort_key))
        local = {link: k for k, link in enumerate(inner)}
        rows = []
        for here, link in enumerate(inner):
            for other, k in self.neighbours[link]:
                there = local.get(other, -1)
                if place[other] >= 0 or there > here:
                    is_first = self.is_symmetric[k] or self.ends[k][0] == link
                    rows.append((self.facts[k].number, here, there, is_first, k in driven, k, other))
        rows.sort()
        given: list[int] = []
        numbers: list[int] = []
        pairs: list[BlockPair] = []
        inputs: list[int] = []
        for _, here, inside, is_first, is_driven, k, other in rows:
            there = inside
            if inside < 0:
                there = FRAME_BODY if is_driven and other == self.frame else -1 - len(given)
                if there != FRAME_BODY:
                    given.append(place[other])
            if is_driven:
                inputs.append(1 + driven[k])
            pairs.append(BlockPair(self.pairs[k][0], (here, there) if is_first else (there, here), is_driven))
            is_exchanged = self.is_symmetric[k] and self.ends[k][0] != inner[here]
            own = self.pair_numbers[k]
            numbers += own[2:] + own[:2] if is_exchanged else own
        self._add_arms(inner, [row[-2] for row in rows])
        block_type = find_block_type(BlockSignature(len(inner), len(given), tuple(pairs)))
        if not block_type.is_square:
            raise NotPartitionable("constraints hold each other more than once")
        inner_places = range(self.place_count, self.place_count + len(inner))
        for link, index in zip(inner, inner_places, strict=True):
            place[link] = index
        self.place_count += len(inner)
        names = tuple(self.names[link] for link in inner)
        self.blocks.append(PartitionBlock(block_type, (*given, *inputs, *inner_places), tuple(numbers), names))

    def _sort_key(self, link: int) -> tuple[int, list[tuple[int, bool, bool]]]:
        """The pairs between a link of a block and known links, so that equal blocks get the same order."""
        pairs = [
            (self.facts[k].number, self.is_symmetric[k] or self.ends[k][0] == link, k in self.input_of_pair)
            for other, k in self.neighbours[link]
            if self.link_index[other] >= 0
        ]
        return len(pairs), sorted(pairs)
