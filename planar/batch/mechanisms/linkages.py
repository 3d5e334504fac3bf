"""Mechanisms of any structure as arrays of linkages that share their blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.block_type import BlockType
from planar.batch.mechanisms.partition import (
    BlockRows,
    NotPartitionable,
    PointLayout,
    Structure,
    partition_mechanism,
)
from planar.foundation.arrays import Array, BoolArray, IntArray, part_offsets
from planar.foundation.errors import BadInput
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import Mechanism, relative_motions, running_input_index
from planar.solving.checks.residual_check import SHORT_ARM, residual_tolerance


class SweepRequest(NamedTuple):
    """What `sweep_each` asks of every mechanism."""

    steps: int
    points: tuple[str, ...] | None
    rates: bool
    pair: str | None


@dataclass(frozen=True, eq=False)
class BlockBatch:
    """Blocks of one type: `owner` (blocks,) the linkage of each, rising; `link_indices` (blocks, slots) the places of
    their links; p (blocks, numbers) with the cosine and sine of angles, lengths in sizes; `block_numbers` (blocks,)
    among those of all linkages."""

    block_type: BlockType
    owner: IntArray
    link_indices: IntArray
    p: Array
    block_numbers: IntArray

    def state_indices(self, first: IntArray) -> IntArray:
        """The places among those of all linkages, of which linkage k has those after first[k]; 0 is the frame of
        all."""
        return np.where(self.link_indices > 0, self.link_indices + first[self.owner][:, None], 0)

    @property
    def inner_slots(self) -> slice:
        """Which of the slots are those of inner links."""
        return slice(self.block_type.slot_count - len(self.block_type.inner_links), self.block_type.slot_count)


class InputArrays(NamedTuple):
    """The inputs of all linkages: linkage, place, position (rad or sizes), whether it is an angle, whether it runs,
    velocity and acceleration."""

    owner: IntArray
    link_index: IntArray
    value: Array
    is_angle: BoolArray
    runs: BoolArray
    velocity: Array
    acceleration: Array

    def cos_and_sin(self) -> tuple[Array, Array]:
        """The cosines and sines of the positions; 1 and 0 for lengths."""
        return np.where(self.is_angle, np.cos(self.value), 1.0), np.where(self.is_angle, np.sin(self.value), 0.0)


class PointArrays(NamedTuple):
    """Points on links: the linkage, the place of the link, and numbers (points, any) of each."""

    owner: IntArray
    link_index: IntArray
    numbers: Array

    def followed_by(self, others: PointArrays) -> PointArrays:
        """These points, then others."""
        owner, link_index = (np.concatenate([self[part], others[part]]) for part in (0, 1))
        return PointArrays(owner, link_index, np.concatenate([self.numbers, others.numbers]))


@dataclass(frozen=True, eq=False)
class LinkageArrays:
    """Linkages as arrays, lengths in units of `unit` (m).

    `which` (linkages,) are their numbers in a part, `numbers` those of all linkages, of linkage k after
    first_number[k]; `start` (linkages,) the position of the input that runs (rad), `tolerance` that of residuals,
    `link_counts` how many links and inputs each has beside the frame. `batches`: one of each block type; the blocks of
    a linkage are solved in the order of their numbers. `watched_points`: two of each link that decides where a pair
    with stops is, x and y in the link (m): the origin of its axes and the place at the size on the x-axis.
    """

    mechanisms: Sequence[Mechanism]
    structures: Sequence[Structure]
    which: IntArray
    numbers: Array
    first_number: IntArray
    start: Array
    link_counts: IntArray
    unit: Array
    tolerance: Array
    batches: Sequence[BlockBatch]
    first_block: IntArray
    inputs: InputArrays
    watched_points: PointArrays

    def __len__(self) -> int:
        """How many linkages there are."""
        return len(self.link_counts)

    @property
    def block_count(self) -> int:
        """How many blocks all linkages have."""
        return int(self.first_block[-1])

    def points(self, names: Sequence[Sequence[str]]) -> PointArrays:
        """Points of every linkage by their names: x and y in the link (m)."""
        parts = [[one.members[name][0] for name in own] for one, own in zip(self.structures, names, strict=True)]
        owner, point = _concatenate([np.array(part, dtype=np.int64) for part in parts])
        link_index = np.concatenate([one.point_places[part] for one, part in zip(self.structures, parts, strict=True)])
        first = 2 * point + self.first_number[owner]
        return PointArrays(owner, link_index, np.array([self.numbers[first], self.numbers[first + 1]]).T)

    def sketch_points(self, layouts: Sequence[PointLayout]) -> PointArrays:
        """Points of every linkage by a layout of its structure: x and y in the link, and in the world (sizes)."""
        owner, link_index = _concatenate([layout.link_index for layout in layouts])
        places = (np.concatenate(parts) for parts in zip(*(layout[1:] for layout in layouts), strict=True))
        first = [part + self.first_number[owner] for part in places]
        coordinates = np.array([self.numbers[row + part] for row in first for part in (0, 1)])
        return PointArrays(owner, link_index, (coordinates / self.unit[owner]).T)

    def links_of_block(self, number: int) -> str:
        """The names of the inner links of a block."""
        owner = int(np.searchsorted(self.first_block, number, side="right")) - 1
        return ", ".join(self.structures[owner].blocks[number - self.first_block[owner]].inner_links)


class _Row(NamedTuple):
    """A mechanism by its number, its structure, which input runs, and where its numbers begin."""

    number: int
    mechanism: Mechanism
    structure: Structure
    running: int
    first: int


def make_linkage_arrays(mechanisms: Mapping[int, Mechanism], pair: str | None) -> LinkageArrays | None:
    """Those of the mechanisms, by their numbers, that can be solved block after block, with the input that runs at
    `pair`; None if there are none."""
    rows: list[_Row] = []
    numbers: list[float] = []
    for k, mechanism in mechanisms.items():
        running = running_input_index(mechanism, pair, "inputs")
        try:
            structure, mechanism_numbers = partition_mechanism(mechanism)
        except (NotPartitionable, BadInput, PointPlacementError):
            continue
        if structure.input_is_angle[running]:
            rows.append(_Row(k, mechanism, structure, running, len(numbers)))
            numbers += mechanism_numbers
    if not rows:
        return None
    values = np.array(numbers, dtype=float)
    unit, reach = _sizes(rows, values)
    has_short_arm = _has_short_arm(rows, values, unit)
    if has_short_arm.any():
        kept = np.flatnonzero(~has_short_arm)
        rows, unit, reach = [rows[k] for k in kept.tolist()], unit[kept], reach[kept]
    return _make_arrays(rows, values, unit, reach) if rows else None


def _concatenate(parts: Sequence[IntArray]) -> tuple[IntArray, IntArray]:
    """The part that every entry is from (entries,), and the entries of all parts."""
    return np.repeat(np.arange(len(parts)), [len(part) for part in parts]), np.concatenate(parts)


def _sizes(rows: Sequence[_Row], values: Array) -> tuple[Array, Array]:
    """The greatest extent of a link of each linkage, and the greatest coordinate (m)."""
    counts = [len(row.structure.point_places) for row in rows]
    owner, point = _concatenate([np.arange(count) for count in counts])
    first = np.array([row.first for row in rows])[owner] + 2 * point
    link_owner, starts = _concatenate([row.structure.link_starts for row in rows])
    starts = starts + part_offsets(counts)[link_owner]
    unit, reach = np.zeros((2, len(rows)))
    if len(owner):
        sides = []
        for coordinates in (values[first], values[first + 1]):
            np.maximum.at(reach, owner, np.abs(coordinates))
            sides.append(np.maximum.reduceat(coordinates, starts) - np.minimum.reduceat(coordinates, starts))
        np.maximum.at(unit, link_owner, list(map(hypot, *(side.tolist() for side in sides))))
    return np.where(unit > 0.0, unit, 1.0), reach


def _has_short_arm(rows: Sequence[_Row], values: Array, unit: Array) -> BoolArray:
    """Which linkages have a link whose arm between the pins that place it is so short that rounding takes digits of
    its angle (linkages,)."""
    owner, ends = _concatenate([row.structure.arms for row in rows])
    first = 2 * ends + np.array([row.first for row in rows])[owner][:, None]
    x, y = (values[first + part] for part in (0, 1))
    length = np.hypot(x[:, 1] - x[:, 0], y[:, 1] - y[:, 0])
    is_short = np.zeros(len(rows), dtype=bool)
    is_short[owner[(length > 0.0) & (length < SHORT_ARM * unit[owner])]] = True
    return is_short


def _make_arrays(rows: Sequence[_Row], values: Array, unit: Array, reach: Array) -> LinkageArrays:
    structures, first = [row.structure for row in rows], np.array([row.first for row in rows])
    first_block = part_offsets([len(structure.blocks) for structure in structures])

    return LinkageArrays(
        [row.mechanism for row in rows],
        structures,
        np.array([row.number for row in rows]),
        values,
        first,
        np.array([row.mechanism.inputs[row.running].position for row in rows]),
        np.array([one.place_count - 1 for one in structures]),
        unit,
        residual_tolerance(np.array([len(one.link_index) for one in structures]), reach / unit),
        list(_make_batches(structures, first_block, values, first, unit)),
        first_block,
        _input_arrays(rows, unit),
        _watched_points(rows, unit),
    )


def _make_batches(
    structures: Sequence[Structure], first_block: IntArray, values: Array, first: IntArray, unit: Array
) -> Iterator[BlockBatch]:
    """The blocks of all linkages, type after type; the numbers of linkage k begin at first[k]."""
    parts: dict[BlockType, list[tuple[int, BlockRows]]] = {}
    for k, structure in enumerate(structures):
        for block_type, rows in structure.block_rows.items():
            parts.setdefault(block_type, []).append((k, rows))
    for block_type, owned in parts.items():
        owner = np.repeat([k for k, _ in owned], [len(rows.block_numbers) for _, rows in owned])
        blocks, links, indices = (np.concatenate(part) for part in zip(*(rows for _, rows in owned), strict=True))
        numbers = values[indices + first[owner][:, None]]
        numbers[:, block_type.length_measures] /= unit[owner][:, None]
        if block_type.angle_measures:
            angles = numbers[:, block_type.angle_measures]
            both = np.stack([np.cos(angles), np.sin(angles)], axis=2).reshape(len(owner), -1)
            numbers = np.hstack([numbers, both])
        yield BlockBatch(block_type, owner, links, numbers, blocks + first_block[owner])


def _input_arrays(rows: Sequence[_Row], unit: Array) -> InputArrays:
    inputs = [
        (owner, 1 + k, given.position, is_angle, k == row.running, given.velocity, given.acceleration)
        for owner, row in enumerate(rows)
        for k, (given, is_angle) in enumerate(zip(row.mechanism.inputs, row.structure.input_is_angle, strict=True))
    ]
    arrays = InputArrays(*map(np.array, zip(*inputs, strict=True)))
    return arrays._replace(value=np.where(arrays.is_angle, arrays.value, arrays.value / unit[arrays.owner]))


def _watched_points(rows: Sequence[_Row], unit: Array) -> PointArrays:
    points = [
        (owner, row.structure.link_index[link], x, 0.0)
        for owner, row in enumerate(rows)
        for link in watched_links(row.mechanism)
        for x in (0.0, unit[owner])
    ]
    owner, link_index, *numbers = np.array(points, dtype=float).reshape(-1, 4).T
    return PointArrays(owner.astype(np.int64), link_index.astype(np.int64), np.stack(numbers, axis=1))


def watched_links(mechanism: Mechanism) -> tuple[str, ...]:
    """The moving links whose places decide where the pairs with stops are."""
    motions = relative_motions(mechanism) if mechanism.stops else {}
    links = dict.fromkeys(link for stop in mechanism.stops for link in motions[stop.pair].bodies)
    return tuple(link for link in links if link != mechanism.frame)
