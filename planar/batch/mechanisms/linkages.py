"""Mechanisms of any structure as arrays of linkages that share their blocks."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import BlockType
from planar.batch.mechanisms.partition import NotPartitionable, Partition, partition_mechanism
from planar.batch.stop_checks import watched_links
from planar.foundation.errors import BadInput
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import Mechanism, named_points, running_input_index
from planar.model.pairs import MeasureKind as Measure

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class BlockBatch:
    """Blocks of one kind: `owner` (blocks,) whose they are, rising; `link_indices` (blocks, slots) where their links
    are; p (blocks, numbers) with the cosine and sine of angles, lengths in sizes; `block_numbers` (blocks,), through
    all linkages."""

    block_type: BlockType
    owner: Array
    link_indices: Array
    p: Array
    block_numbers: Array

    def state_indices(self, first: Array) -> Array:
        """The places among those of all linkages, of which each has its own from `first` on; 0 is the frame of all."""
        return np.where(self.link_indices > 0, self.link_indices + first[self.owner][:, None], 0)

    @property
    def inner_slots(self) -> slice:
        """Which of the slots are those of inner links."""
        return slice(self.block_type.slot_count - len(self.block_type.inner_links), self.block_type.slot_count)


class InputArrays(NamedTuple):
    """The inputs of all linkages: whose, their place, position (rad or sizes), whether an angle, velocity and
    acceleration of those that run, and which do."""

    owner: Array
    link_index: Array
    value: Array
    is_angle: Array
    runs: Array
    velocity: Array
    acceleration: Array

    def cos_and_sin(self) -> tuple[Array, Array]:
        """The cosines and sines of the positions; 1 and 0 for lengths."""
        return np.where(self.is_angle, np.cos(self.value), 1.0), np.where(self.is_angle, np.sin(self.value), 0.0)


class PointArrays(NamedTuple):
    """Points on links: whose, the place of the link, and numbers (points, any) of each."""

    owner: Array
    link_index: Array
    numbers: Array


@dataclass(frozen=True, eq=False)
class LinkageArrays:
    """Linkages as arrays. `link_counts` (linkages,): how many links and inputs each has beside the frame; lengths in
    units of `unit` (m).

    `batches`: one of each kind; the blocks of a linkage are solved in the order of their numbers. `sketch`: x and y in
    the link, and where it is shown (sizes). `points`: x and y in the link (m), of those that are wanted.
    `shown_points`: as `sketch`, for every link that has a point, and pins on the frame too.
    """

    link_counts: Array
    unit: Array
    tolerance: Array
    batches: Sequence[BlockBatch]
    inputs: InputArrays
    sketch: PointArrays
    points: PointArrays
    shown_points: PointArrays
    block_count: int

    def __len__(self) -> int:
        """How many linkages there are."""
        return len(self.link_counts)


class PartitionedLinkage(NamedTuple):
    """A parted linkage with what runs it: of every input position (rad or sizes), whether it is an angle, whether it
    runs, velocity and acceleration; points of the sketch, points that are wanted, and points that are
    shown, each with its place first: see `LinkageArrays`."""

    partition: Partition
    inputs: list[tuple[float, bool, bool, float, float]]
    sketch: list[tuple[float, ...]]
    points: list[tuple[float, ...]]
    shown_points: list[tuple[float, ...]]


_BlockRow = tuple[int, Sequence[int], Sequence[float], int]
"""A block: its owner, where its links are, the numbers of its pairs (m, rad), its number."""


def make_linkage_arrays(linkages: Sequence[PartitionedLinkage]) -> LinkageArrays:
    """Parted linkages as arrays."""
    unit = np.array([one.partition.unit for one in linkages])
    rows: dict[int, list[_BlockRow]] = {}
    kinds: dict[int, BlockType] = {}
    number = 0
    for owner, one in enumerate(linkages):
        for group in one.partition.blocks:
            kinds[id(group.block_type)] = group.block_type
            rows.setdefault(id(group.block_type), []).append((owner, group.link_indices, group.p, number))
            number += 1

    batches = []
    for key, own in rows.items():
        owners, places, p, block_numbers = zip(*own, strict=True)
        batches.append(make_batch(kinds[key], owners, places, p, block_numbers, unit))
    inputs = [(owner, 1 + k, *each) for owner, one in enumerate(linkages) for k, each in enumerate(one.inputs)]
    parts = zip(*inputs, strict=True)
    return LinkageArrays(
        np.array([one.partition.index_count - 1 for one in linkages]),
        unit,
        np.array([one.partition.tolerance for one in linkages]),
        batches,
        InputArrays(*(np.array(part) for part in parts)),
        _point_arrays([one.sketch for one in linkages], 4),
        _point_arrays([one.points for one in linkages], 2),
        _point_arrays([one.shown_points for one in linkages], 4),
        number,
    )


def make_batch(
    block_type: BlockType,
    owner: ArrayLike,
    link_indices: ArrayLike,
    p: ArrayLike,
    block_numbers: ArrayLike,
    unit: Array,
) -> BlockBatch:
    """Groups of a kind with the numbers of their pairs p (groups, measures), in m, as the kind's formulas take them."""
    owners = np.asarray(owner)
    numbers = np.array(p, dtype=float).reshape(len(owners), len(block_type.measures))
    numbers[:, block_type.length_measures] /= unit[owners][:, None]
    if block_type.angle_measures:
        own = numbers[:, block_type.angle_measures]
        both = np.stack([np.cos(own), np.sin(own)], axis=2).reshape(len(owners), -1)
        numbers = np.hstack([numbers, both])
    return BlockBatch(
        block_type,
        owners,
        np.asarray(link_indices).reshape(len(owners), block_type.slot_count),
        numbers,
        np.asarray(block_numbers),
    )


def _point_arrays(points: Sequence[list[tuple[float, ...]]], width: int) -> PointArrays:
    owner = np.repeat(np.arange(len(points)), [len(own) for own in points])
    flat = np.array([each for own in points for each in own], dtype=float).reshape(-1, 1 + width)
    return PointArrays(owner, flat[:, 0].astype(np.int64), flat[:, 1:])


class SweepRequest(NamedTuple):
    """What is asked of every mechanism, see `sweep_each`."""

    steps: int
    points: tuple[str, ...] | None
    rates: bool
    pair: str | None


class LinkageGroup(NamedTuple):
    """Linkages that can be solved group after group: their numbers, as arrays, names of their points, where each
    starts, and the links of all groups. Behind the points of a linkage stand two of each of its `watched` links, which
    tell where pairs with stops are: the origin of its axes, and the place at the size on the x-axis."""

    numbers: Array
    arrays: LinkageArrays
    names: Sequence[Sequence[str]]
    start: Array
    links_of_block: Callable[[int], str]
    mechanisms: Sequence[Mechanism]
    watched: Sequence[tuple[str, ...]]


def linkage_group(mechanisms: Sequence[Mechanism], request: SweepRequest) -> LinkageGroup | None:
    """Those of the mechanisms that are not for the general path; None where there are none."""
    ones: list[PartitionedLinkage] = []
    numbers: list[int] = []
    names: list[list[str]] = []
    starts: list[float] = []
    for k, mechanism in enumerate(mechanisms):
        made = _partition_linkage(mechanism, request)
        if made is not None:
            one, own_names, start = made
            ones.append(one)
            numbers.append(k)
            names.append(own_names)
            starts.append(start)
    if not ones:
        return None

    def block_links(number: int) -> str:
        for one in ones:
            if number < len(one.partition.blocks):
                links = list(one.partition.shapes)
                return ", ".join(links[k] for k in one.partition.blocks[number].inner_links)
            number -= len(one.partition.blocks)
        return ""

    own = [mechanisms[k] for k in numbers]
    watched, arrays = [watched_links(each) for each in own], make_linkage_arrays(ones)
    return LinkageGroup(np.array(numbers), arrays, names, np.array(starts), block_links, own, watched)


def _partition_linkage(
    mechanism: Mechanism, request: SweepRequest
) -> tuple[PartitionedLinkage, list[str], float] | None:
    """A mechanism parted into groups, with the names of its points and where it starts; None where it is for the
    general path."""
    running = running_input_index(mechanism, request.pair, "inputs")
    try:
        own = partition_mechanism(mechanism)
    except (NotPartitionable, BadInput, PointPlacementError):
        return None
    kinds = {pair.name: pair.input_kind for pair in mechanism.pairs}
    angles = [kinds[given.pair] is not Measure.LENGTH for given in mechanism.inputs]
    if not angles[running] or not all(
        group.block_type.has_closed_form or group.block_type.has_newton_formulas for group in own.blocks
    ):
        return None
    unit = own.unit
    inputs = [
        (given.position if angle else given.position / unit, angle, k == running, given.velocity, given.acceleration)
        for k, (given, angle) in enumerate(zip(mechanism.inputs, angles, strict=True))
    ]
    members = _point_members(mechanism, request.points)
    shown = (
        [] if all(group.block_type.has_closed_form for group in own.blocks) else _shown_points(mechanism, own, members)
    )
    sketch: list[tuple[float, ...]] = []
    for name, x, y in mechanism.sketch:
        if name not in members:
            return None
        place, link, point = min((own.link_index[link], link, point) for link, point in members[name])
        if place:
            at = own.shapes[link].points[point]
            sketch.append((place, at.x / unit, at.y / unit, x / unit, y / unit))
    names: list[str] = []
    points: list[tuple[float, ...]] = []
    for name in wanted_points(mechanism, members, request.points):
        place, link, point = min((own.link_index[link], link, point) for link, point in members[name])
        names.append(name)
        points.append((place, *own.shapes[link].points[point]))
    for link in watched_links(mechanism):
        points += [(own.link_index[link], x, 0.0) for x in (0.0, unit)]
    return PartitionedLinkage(own, inputs, sketch, points, shown), names, mechanism.inputs[running].position


def _shown_points(
    mechanism: Mechanism, partition: Partition, members: Mapping[str, Sequence[tuple[str, str]]]
) -> list[tuple[float, ...]]:
    """Points of every link that the sketch shows, or that lie on the frame: see `Lot.shown`."""
    at = {name: (x, y) for name, x, y in mechanism.sketch}
    found: list[tuple[float, ...]] = []
    for name, both in members.items():
        on = next((point for link, point in both if link == mechanism.frame), None)
        place = at.get(name) if on is None else partition.shapes[mechanism.frame].points[on]
        if place is not None:
            for link, point in both:
                if partition.link_index[link]:
                    local = partition.shapes[link].points[point]
                    found.append((partition.link_index[link], *(part / partition.unit for part in (*local, *place))))
    return found


def _point_members(mechanism: Mechanism, points: tuple[str, ...] | None) -> Mapping[str, Sequence[tuple[str, str]]]:
    """The (link, point) of named points: of all, or of those that pairs keep together where no other is asked for."""
    together: dict[str, list[tuple[str, str]]] = {}
    for pair in mechanism.pairs:
        own = pair.coincident_points()
        if own:
            together.setdefault(pair.entry_name(), []).extend(own)
    wanted = (*(points or ()), *(name for name, _, _ in mechanism.sketch))
    if points is not None and all(name in together for name in wanted):
        return together
    return {each.name: each.members for each in named_points(mechanism)}


def wanted_points(
    mechanism: Mechanism, members: Mapping[str, Sequence[tuple[str, str]]], points: tuple[str, ...] | None
) -> list[str]:
    """The names of the points that are wanted of a mechanism."""
    if points is not None:
        return [name for name in points if name in members]
    return [name for name, own in members.items() if all(link != mechanism.frame for link, _ in own)]
