"""Mechanisms of any structure as arrays of linkages that share their blocks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot, pi
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
from planar.model.link_shapes import PointName, PointPlacementError
from planar.model.mechanism import Mechanism, relative_motions, running_input_index
from planar.solving.checks import SHORT_ARM, residual_tolerance


class SweepRequest(NamedTuple):
    """What is asked of every mechanism: points by their names, those that move if there are none, over `turn` (rad) of
    the input at `pair`."""

    steps: int
    points: tuple[PointName, ...] | None
    rates: bool
    pair: str | None
    turn: float = 2.0 * pi


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

    @property
    def inner_slots(self) -> slice:
        """Which of the slots are those of inner links."""
        return slice(self.block_type.slot_count - len(self.block_type.inner_links), self.block_type.slot_count)


class LinkArrays(NamedTuple):
    """Inputs, or points on links: the linkage, the place of the input or link, and numbers (rows, any) of each."""

    owner: IntArray
    link_index: IntArray
    numbers: Array


@dataclass(frozen=True, eq=False)
class LinkageArrays:
    """Linkages as arrays, lengths in units of `unit` (m).

    `which` (linkages,) are their numbers in a part, `numbers` those of all linkages, of linkage k after
    first_number[k]; `start` (linkages,) the position of the input that runs (rad), `tolerance` that of residuals,
    `has_short_arm` whether rounding takes digits of the angle of a link, `link_counts` how many links and inputs each
    has beside the frame. `batches`: one of each block type; the blocks of a linkage are solved in the order of their
    numbers. `inputs` have the position (rad or sizes), its cosine and sine (1 and 0 for lengths), velocity and
    acceleration; `is_running` (inputs,). `watched_points`: two of each link that decides where a pair with stops is, x
    and y in the link (m): the origin of its axes and the place at the size on the x-axis.
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
    has_short_arm: BoolArray
    batches: Sequence[BlockBatch]
    first_block: IntArray
    inputs: LinkArrays
    is_running: BoolArray
    watched_points: LinkArrays

    def __len__(self) -> int:
        """How many linkages there are."""
        return len(self.link_counts)

    @property
    def block_count(self) -> int:
        """How many blocks all linkages have."""
        return int(self.first_block[-1])

    def points(self, names: Sequence[Sequence[PointName]]) -> LinkArrays:
        """Points of every linkage by their names: x and y in the link (m)."""
        points = [
            np.array([structure.members[name][0] if isinstance(name, str) else -1 for name in names_of_linkage], int)
            for structure, names_of_linkage in zip(self.structures, names, strict=True)
        ]
        pairs = zip(self.structures, points, strict=True)
        rows = self._gather([structure.point_places[part] for structure, part in pairs], [2 * part for part in points])
        all_names = ((k, name) for k, names_of_linkage in enumerate(names) for name in names_of_linkage)
        for row, (k, name) in enumerate(all_names):
            if not isinstance(name, str):
                rows.link_index[row], rows.numbers[row] = self.structures[k].link_index[name.link], name.at
        return rows

    def sketch_points(self, layouts: Sequence[PointLayout]) -> LinkArrays:
        """Points of every linkage by a layout of its structure: x and y in the link, and in the world (sizes)."""
        link_index, *places = zip(*layouts, strict=True)
        points = self._gather(link_index, *places)
        return points._replace(numbers=points.numbers / self.unit[points.owner][:, None])

    def _gather(self, link_index: Sequence[IntArray], *places: Sequence[IntArray]) -> LinkArrays:
        """Pairs of coordinates from places among the numbers of every linkage."""
        owner, all_links = _concatenate(link_index)
        first = [np.concatenate(part) + self.first_number[owner] for part in places]
        return LinkArrays(owner, all_links, np.array([self.numbers[row + k] for row in first for k in (0, 1)]).T)

    def links_of_block(self, number: int) -> str:
        """The names of the inner links of a block."""
        owner = int(np.searchsorted(self.first_block, number, side="right")) - 1
        return ", ".join(self.structures[owner].blocks[number - self.first_block[owner]].inner_links)


def make_linkage_arrays(mechanisms: Mapping[int, Mechanism], pair: str | None) -> LinkageArrays | None:
    """Those of the mechanisms, by their numbers, that can be solved block after block, with the input that runs at
    `pair`; None if there are none."""
    which: list[int] = []
    structures: list[Structure] = []
    running_inputs: list[int] = []
    numbers: list[float] = []
    first: list[int] = []
    for k, mechanism in mechanisms.items():
        running = running_input_index(mechanism, pair, "inputs")
        try:
            structure, mechanism_numbers = partition_mechanism(mechanism)
        except (NotPartitionable, BadInput, PointPlacementError):
            continue
        if structure.input_is_angle[running]:
            which.append(k)
            structures.append(structure)
            running_inputs.append(running)
            first.append(len(numbers))
            numbers += mechanism_numbers
    if not which:
        return None
    solvable, values, first_number = [mechanisms[k] for k in which], np.array(numbers, dtype=float), np.array(first)
    unit, reach = _sizes(structures, first_number, values)
    first_block = part_offsets([len(structure.blocks) for structure in structures])
    return LinkageArrays(
        solvable,
        structures,
        np.array(which),
        values,
        first_number,
        np.array([one.inputs[running].position for one, running in zip(solvable, running_inputs, strict=True)]),
        np.array([structure.place_count - 1 for structure in structures]),
        unit,
        residual_tolerance(np.array([len(structure.link_index) for structure in structures]), reach / unit),
        _has_short_arm(structures, first_number, values, unit),
        list(_make_batches(structures, first_block, values, first_number, unit)),
        first_block,
        _input_arrays(solvable, structures, unit),
        np.concatenate([np.arange(len(one.inputs)) == k for one, k in zip(solvable, running_inputs, strict=True)]),
        _watched_points(solvable, structures, unit),
    )


def _concatenate(parts: Sequence[IntArray]) -> tuple[IntArray, IntArray]:
    """The part that every entry is from (entries,), and the entries of all parts."""
    return np.repeat(np.arange(len(parts)), [len(part) for part in parts]), np.concatenate(parts)


def _sizes(structures: Sequence[Structure], first_number: IntArray, values: Array) -> tuple[Array, Array]:
    """The greatest extent of a link of each linkage, and the greatest coordinate (m)."""
    counts = [len(structure.point_places) for structure in structures]
    owner, point = _concatenate([np.arange(count) for count in counts])
    first = first_number[owner] + 2 * point
    link_owner, starts = _concatenate([structure.link_starts for structure in structures])
    starts = starts + part_offsets(counts)[link_owner]
    unit, reach = np.zeros((2, len(structures)))
    if len(owner):
        sides = []
        for coordinates in (values[first], values[first + 1]):
            np.maximum.at(reach, owner, np.abs(coordinates))
            sides.append(np.maximum.reduceat(coordinates, starts) - np.minimum.reduceat(coordinates, starts))
        np.maximum.at(unit, link_owner, list(map(hypot, *(side.tolist() for side in sides))))
    return np.where(unit > 0.0, unit, 1.0), reach


def _has_short_arm(structures: Sequence[Structure], first_number: IntArray, values: Array, unit: Array) -> BoolArray:
    """Which linkages have a link whose arm between the pins that place it is so short that rounding takes digits of
    its angle (linkages,)."""
    owner, ends = _concatenate([structure.arms for structure in structures])
    first = 2 * ends + first_number[owner][:, None]
    x, y = (values[first + part] for part in (0, 1))
    length = np.hypot(x[:, 1] - x[:, 0], y[:, 1] - y[:, 0])
    is_short = np.zeros(len(structures), dtype=bool)
    is_short[owner[(length > 0.0) & (length < SHORT_ARM * unit[owner])]] = True
    return is_short


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


def _input_arrays(mechanisms: Sequence[Mechanism], structures: Sequence[Structure], unit: Array) -> LinkArrays:
    inputs = [
        (owner, 1 + k, is_angle, given.position, given.velocity, given.acceleration)
        for owner, (mechanism, structure) in enumerate(zip(mechanisms, structures, strict=True))
        for k, (given, is_angle) in enumerate(zip(mechanism.inputs, structure.input_is_angle, strict=True))
    ]
    owner, link_index, is_angle, position, velocity, acceleration = map(np.array, zip(*inputs, strict=True))
    value = np.where(is_angle, position, position / unit[owner])
    c, s = np.where(is_angle, np.cos(value), 1.0), np.where(is_angle, np.sin(value), 0.0)
    return LinkArrays(owner, link_index, np.stack([value, c, s, velocity, acceleration], axis=1))


def _watched_points(mechanisms: Sequence[Mechanism], structures: Sequence[Structure], unit: Array) -> LinkArrays:
    points = [
        (owner, structure.link_index[link], x, 0.0)
        for owner, (mechanism, structure) in enumerate(zip(mechanisms, structures, strict=True))
        for link in watched_links(mechanism)
        for x in (0.0, unit[owner])
    ]
    owner, link_index, *numbers = np.array(points, dtype=float).reshape(-1, 4).T
    return LinkArrays(owner.astype(np.int64), link_index.astype(np.int64), np.stack(numbers, axis=1))


def watched_links(mechanism: Mechanism) -> tuple[str, ...]:
    """The moving links whose places decide where the pairs with stops are."""
    motions = relative_motions(mechanism) if mechanism.stops else {}
    links = dict.fromkeys(link for stop in mechanism.stops for link in motions[stop.pair].bodies)
    return tuple(link for link in links if link != mechanism.frame)
