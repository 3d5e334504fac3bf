"""Many linkages as arrays: which groups they have, what drives them, what is known of their sketches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from planar.batch.mechanisms.partition import Parted
from planar.batch.mechanisms.solved_block_type import Kind

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class Batch:
    """Groups of one kind: `owner` (groups,) whose they are, rising; `places` (groups, slots) where their links are;
    p (groups, numbers) with the cosine and sine of angles, lengths in sizes; `ids` (groups,): their numbers."""

    kind: Kind
    owner: Array
    places: Array
    p: Array
    ids: Array

    def of(self, number: Array) -> Batch | None:
        """Those of some owners: their new numbers, -1 for the others; None where there are none."""
        owner = number[self.owner]
        keep = owner >= 0
        if keep.all():
            return replace(self, owner=owner)
        if not keep.any():
            return None
        return Batch(self.kind, owner[keep], self.places[keep], self.p[keep], self.ids[keep])

    def index(self, first: Array) -> Array:
        """The places among those of all linkages, of which each has its own from `first` on; 0 is the frame of all."""
        return np.where(self.places > 0, self.places + first[self.owner][:, None], 0)

    @property
    def inner(self) -> slice:
        """Which of the slots are those of inner links."""
        return slice(self.kind.slots - len(self.kind.inner), self.kind.slots)


class Inputs(NamedTuple):
    """The inputs of all linkages: whose, their place, position (rad or sizes), whether an angle, velocity and
    acceleration of those that run, and which do."""

    owner: Array
    place: Array
    value: Array
    angle: Array
    runs: Array
    velocity: Array
    acceleration: Array


class Marked(NamedTuple):
    """Points on links: whose, the place of the link, and numbers (points, any) of each."""

    owner: Array
    place: Array
    numbers: Array

    def of(self, number: Array) -> Marked:
        """Those of some owners: their new numbers, -1 for the others."""
        owner = number[self.owner]
        keep = owner >= 0
        return Marked(owner[keep], self.place[keep], self.numbers[keep])


@dataclass(frozen=True, eq=False)
class Lot:
    """Linkages as arrays. `places` (linkages,): how many each has beside the frame; lengths in units of `unit` (m).

    `levels` are batches that are solved one after the other; `turns` the same, where groups of a batch may take what
    others in it have given. `sketch`: x and y in the link, and where it is shown (sizes). `points`: x and y in the link
    (m), of those that are wanted. `shown`: as `sketch`, for every link that has a point, and pins on the frame too.
    """

    places: Array
    unit: Array
    tolerance: Array
    levels: Sequence[Batch]
    turns: Sequence[Batch]
    inputs: Inputs
    sketch: Marked
    points: Marked
    shown: Marked
    groups: int

    def __len__(self) -> int:
        """How many linkages there are."""
        return len(self.places)

    def of(self, which: Array) -> Lot:
        """Some of the linkages (numbers, rising)."""
        if len(which) == len(self):
            return self
        number = np.full(len(self), -1)
        number[which] = np.arange(len(which))
        keep = number[self.inputs.owner] >= 0
        inputs = Inputs(*(part[keep] for part in self.inputs))
        inputs = inputs._replace(owner=number[inputs.owner])
        levels = [part for each in self.levels if (part := each.of(number)) is not None]
        if self.turns is self.levels:
            turns = levels
        else:
            turns = [part for each in self.turns if (part := each.of(number)) is not None]
        return Lot(
            self.places[which],
            self.unit[which],
            self.tolerance[which],
            levels,
            turns,
            inputs,
            self.sketch.of(number),
            self.points.of(number),
            self.shown.of(number),
            self.groups,
        )


class One(NamedTuple):
    """A parted linkage with what runs it: of every input position (rad or sizes), whether it is an angle, whether it
    runs, velocity and acceleration; points of the sketch, points that are wanted, and points that are
    shown, each with its place first: see `Lot`."""

    parted: Parted
    inputs: list[tuple[float, bool, bool, float, float]]
    sketch: list[tuple[float, ...]]
    points: list[tuple[float, ...]]
    shown: list[tuple[float, ...]]


def lot_of(ones: Sequence[One]) -> Lot:
    """Parted linkages as arrays."""
    unit = np.array([one.parted.unit for one in ones])
    levels: dict[tuple[int, int], list] = {}
    turns: dict[tuple[int, int], list] = {}
    kinds: dict[int, Kind] = {}
    number = 0
    for owner, one in enumerate(ones):
        for group in one.parted.groups:
            kinds[id(group.kind)] = group.kind
            row = (owner, group.places, group.p, number)
            levels.setdefault((group.level, id(group.kind)), []).append(row)
            turns.setdefault((group.turn, id(group.kind)), []).append(row)
            number += 1

    def batches(of: dict[tuple[int, int], list]) -> list[Batch]:
        return [batch(kinds[key[1]], *map(list, zip(*of[key], strict=True)), unit) for key in sorted(of)]

    inputs = [(owner, 1 + k, *each) for owner, one in enumerate(ones) for k, each in enumerate(one.inputs)]
    parts = zip(*inputs, strict=True)
    return Lot(
        np.array([one.parted.places - 1 for one in ones]),
        unit,
        np.array([one.parted.tolerance for one in ones]),
        batches(levels),
        batches(turns),
        Inputs(*(np.array(part) for part in parts)),
        _marked([one.sketch for one in ones], 4),
        _marked([one.points for one in ones], 2),
        _marked([one.shown for one in ones], 4),
        number,
    )


def batch(kind: Kind, owner: Sequence[int], places: Sequence, p: Sequence, ids: Sequence[int], unit: Array) -> Batch:
    """Groups of a kind with the numbers of their pairs p (groups, measures), in m, as the kind's formulas take them."""
    owners = np.asarray(owner)
    numbers = np.array(p, dtype=float).reshape(len(owners), len(kind.measures))
    numbers[:, kind.lengths] /= unit[owners][:, None]
    if kind.angles:
        own = numbers[:, kind.angles]
        both = np.stack([np.cos(own), np.sin(own)], axis=2).reshape(len(owners), -1)
        numbers = np.hstack([numbers, both])
    return Batch(kind, owners, np.asarray(places).reshape(len(owners), kind.slots), numbers, np.asarray(ids))


def _marked(points: Sequence[list[tuple[float, ...]]], wide: int) -> Marked:
    owner = np.repeat(np.arange(len(points)), [len(own) for own in points])
    flat = np.array([each for own in points for each in own], dtype=float).reshape(-1, 1 + wide)
    return Marked(owner, flat[:, 0].astype(np.int64), flat[:, 1:])
