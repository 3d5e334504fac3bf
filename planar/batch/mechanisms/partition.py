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
    its pairs are among those of the mechanism; and the names of its inner links, in the order of the mechanism."""

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


class _Joint(NamedTuple):
    """What a pin or another pair holds together: its pair type and the number of that among all, the links, where the
    numbers of each are (of other pairs than pins all at the first link), and which input drives it.

    `prevented_motions`: of a link, against one of the others. `is_symmetric`: the same with its links exchanged, as
    undriven pins, which may have more than two links.
    """

    pair_type: type[Pair]
    type_number: int
    links: list[int]
    numbers: dict[int, tuple[int, ...]]
    input: int | None
    prevented_motions: int
    is_pin: bool
    is_symmetric: bool


class _Partitioner:
    """Finds the structure of a mechanism."""

    def __init__(self, mechanism: Mechanism, point_names: Sequence[tuple[str, ...]], pairs: Sequence[_PairKey]):
        self.mechanism, self.pairs = mechanism, pairs
        self.names = [link.name for link in mechanism.links]
        points = [(link, name) for link, names in zip(self.names, point_names, strict=True) for name in names]
        self.points = {point: k for k, point in enumerate(points)}
        self.point_links = [link for link, names in enumerate(point_names) for _ in names]
        self.number_count = 2 * len(points)
        self.measured_pairs: list[tuple[int, int, int]] = []
        self.joints = self._find_joints()
        self.joints_of: list[list[int]] = [[] for _ in self.names]
        for number, joint in enumerate(self.joints):
            for link in joint.links:
                self.joints_of[link].append(number)
        self.link_index = [-1] * len(self.names)
        self.holders = [-1] * len(self.joints)
        "of every joint the first of its links that has a place, -1 as long as none has"
        self.prevented = [0] * len(self.names)
        "how many motions of each link the links that have a place prevent"
        self.waiting: list[int] = []
        self.blocks: list[PartitionBlock] = []
        self.arms: list[tuple[int, int]] = []
        self.place_count = 1 + len(mechanism.inputs)
        self._place(self.names.index(mechanism.frame), 0)

    def _find_joints(self) -> list[_Joint]:
        number = {name: k for k, name in enumerate(self.names)}
        inputs = {given.pair: k for k, given in reversed(list(enumerate(self.mechanism.inputs)))}
        joints: list[_Joint] = []
        pins: dict[str, _Joint] = {}
        driven = set[int]()
        for k, (pair_type, name, (first, second), entry, points) in enumerate(self.pairs):
            facts = _pair_type_facts(pair_type)
            if facts is None:
                raise NotPartitionable(f"{name} ties more together than two links at one place")
            links, input_number = [number[first], number[second]], inputs.pop(name, None)
            if input_number is not None:
                driven.add(input_number)
            numbers: dict[int, tuple[int, ...]]
            if facts.is_pin:
                first_number, second_number = 2 * self.points[points[0]], 2 * self.points[points[1]]
                numbers = {links[0]: (first_number, first_number + 1), links[1]: (second_number, second_number + 1)}
            else:
                self.measured_pairs.append((k, links[0], links[1]))
                first_number, self.number_count = self.number_count, self.number_count + len(pair_type.number_kinds)
                numbers = {links[0]: tuple(range(first_number, self.number_count)), links[1]: ()}
            is_driven = input_number is not None
            motions, is_symmetric = facts.prevented_motions + is_driven, facts.is_pin and not is_driven
            joint = _Joint(pair_type, facts.number, links, numbers, input_number, motions, facts.is_pin, is_symmetric)
            if not is_symmetric or pins.setdefault(entry, joint) is joint:
                joints.append(joint)
                continue
            pin = pins[entry]
            pin.links.extend(link for link in links if link not in pin.links)
            pin.numbers.update(numbers)
        for k, given in enumerate(self.mechanism.inputs):
            if k not in driven:
                raise NotPartitionable(f"the input at {given.pair} is between links that no pair of their own joins")
        return joints

    def partition(self) -> Structure:
        """See `Structure`."""
        while self.waiting:
            link = self.waiting.pop()
            if self.link_index[link] < 0:
                self._add_block_with(link)
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

    def _place(self, link: int, place: int) -> None:
        """Give a link its place; the links that it holds wait to be looked at."""
        self.link_index[link] = place
        for number in self.joints_of[link]:
            if self.holders[number] < 0:
                self.holders[number] = link
                joint = self.joints[number]
                for other in joint.links:
                    if self.link_index[other] < 0:
                        self.prevented[other] += joint.prevented_motions
                        self.waiting.append(other)

    def _add_block_with(self, link: int) -> None:
        """Add the block of a link, alone or with another, if it follows from links that have a place."""
        prevented = self.prevented
        if prevented[link] == 3:
            self._add_block((link,))
            return
        if prevented[link] > 3:
            raise NotPartitionable(f"link {self.names[link]} is held more than once")
        between: dict[int, int] = {}
        for number in self.joints_of[link]:
            if self.holders[number] < 0:
                for other in self.joints[number].links:
                    between[other] = between.get(other, 0) + self.joints[number].prevented_motions
        between.pop(link, None)
        for other, motions in between.items():
            total = prevented[link] + prevented[other] + motions
            if total == 6 and prevented[other] <= 3:
                self._add_block((link, other))
                return
            if total > 6:
                raise NotPartitionable(f"links {self.names[link]} and {self.names[other]} are held more than once")

    def _add_remaining_blocks(self) -> None:
        """Add the other links in the smallest blocks: Dulmage and Mendelsohn on links, each of three columns."""
        links = [link for link, place in enumerate(self.link_index) if place < 0]
        number = {link: k for k, link in enumerate(links)}
        rows: list[frozenset[int]] = []
        for joint, holder in zip(self.joints, self.holders, strict=True):
            unknown = [number[link] for link in joint.links if link in number]
            groups = [{unknown[0], k} for k in unknown[1:]] if holder < 0 else [{k} for k in unknown]
            for group in groups:
                columns = frozenset(3 * k + part for k in group for part in range(3))
                rows += [columns] * joint.prevented_motions
        if len(rows) != 3 * len(links):
            raise NotPartitionable("pairs and inputs leave links free, or hold them more than once")
        for block in decompose_blocks(rows, 3 * len(links)):
            if block.is_free or len(block.rows) != len(block.columns):
                raise NotPartitionable("pairs and inputs leave links free, or hold them more than once")
            inner = tuple(sorted({links[column // 3] for column in block.columns}))
            if len(inner) > MAX_BLOCK_LINKS:
                raise NotPartitionable(f"{len(inner)} links are solved together")
            self._add_block(inner)

    def _ties(self, inner: tuple[int, ...]) -> list[tuple[int, int, int, bool, bool, int, int, int]]:
        """The pairs of links that joints of a block tie together, in an order that does not depend on names: the number
        of the pair type, the inner link, the other one if that is an inner link (else -1), whether the inner link is
        the first or either may be, whether it is driven; then the joint, and the links by their numbers."""
        local = {link: k for k, link in enumerate(inner)}
        ties = []
        for here, link in enumerate(inner):
            for number in self.joints_of[link]:
                joint, holder = self.joints[number], self.holders[number]
                pairs = [(here, -1, link, holder)]
                if holder < 0:
                    # the first of them is tied to every other
                    first, *others = [one for one in joint.links if one in local]
                    pairs = [min((here, local[one], link, one), (local[one], here, one, link)) for one in others]
                    if link != first:
                        continue
                for one_place, other_place, one, other in pairs:
                    is_first = joint.is_symmetric or joint.links[0] == one
                    key = joint.type_number, one_place, other_place, is_first, joint.input is not None
                    ties.append((*key, number, one, other))
        ties.sort()
        return ties

    def _add_block(self, inner: tuple[int, ...]) -> None:
        """Add a block."""
        if len(inner) > 1:
            inner = tuple(sorted(inner, key=self._sort_key))
        given: list[int] = []
        numbers: list[int] = []
        pairs: list[BlockPair] = []
        inputs: list[int] = []
        arm_points: list[set[int]] = [set() for _ in inner]
        for _, here, inside, is_first, is_driven, number, link, other in self._ties(inner):
            joint, there = self.joints[number], inside
            if inside < 0:
                there = FRAME_BODY if is_driven and self.link_index[other] == 0 else -1 - len(given)
                if there != FRAME_BODY:
                    given.append(self.link_index[other])
            if joint.input is not None:
                inputs.append(1 + joint.input)
            pairs.append(BlockPair(joint.pair_type, (here, there) if is_first else (there, here), is_driven))
            first, second = (link, other) if joint.is_symmetric else joint.links
            numbers += joint.numbers[first] + joint.numbers[second]
            if joint.is_pin:
                arm_points[here].add(joint.numbers[link][0] // 2)
                if inside >= 0:
                    arm_points[inside].add(joint.numbers[other][0] // 2)
        # an input turns its link exactly, and the pairs of later blocks need places only
        if len(inner) > 1 or not inputs:
            self.arms += [arm for points in arm_points for arm in combinations(points, 2)]
        block_type = find_block_type(BlockSignature(len(inner), len(given), tuple(pairs)))
        if not block_type.is_square:
            raise NotPartitionable("constraints hold each other more than once")
        inner_places = range(self.place_count, self.place_count + len(inner))
        self.place_count += len(inner)
        for link, place in zip(inner, inner_places, strict=True):
            self._place(link, place)
        names = tuple(self.names[link] for link in sorted(inner))
        self.blocks.append(PartitionBlock(block_type, (*given, *inputs, *inner_places), tuple(numbers), names))

    def _sort_key(self, link: int) -> tuple[int, list[tuple[int, bool, bool]]]:
        """The pairs between a link of a block and known links, so that equal blocks get the same order."""
        joints = [self.joints[number] for number in self.joints_of[link] if self.holders[number] >= 0]
        pairs = [(one.type_number, one.is_symmetric or one.links[0] == link, one.input is not None) for one in joints]
        return len(pairs), sorted(pairs)
