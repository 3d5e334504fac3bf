"""The result of a sweep over mechanisms of any structure."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, overload

import numpy as np

from planar.batch.mechanisms.tape_runs import FULL_TURN
from planar.foundation.arrays import IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.foundation.short_repr import short_repr

Array = np.ndarray


class PointMapping(Mapping[str, Array]):
    """Arrays (steps + 1, 2) by the names of points."""

    __slots__ = ("_names", "_values")

    def __init__(self, names: Sequence[str], values: Array):
        self._names, self._values = names, values

    def __getitem__(self, name: str) -> Array:
        """The array of a point."""
        try:
            found: Array = self._values[self._names.index(name)]
        except ValueError:
            raise KeyError(name) from None
        return found

    def __iter__(self) -> Iterator[str]:
        """The names."""
        return iter(self._names)

    def __len__(self) -> int:
        """How many points there are."""
        return len(self._names)


class Swept(NamedTuple):
    """One mechanism at every step: SI.

    `position`, `velocity` and `acceleration` map names of points to arrays (steps + 1, 2); the two latter are None
    where no rates were asked for. NaN where a position is refused. `status` (steps + 1,): 0 is solved, any other
    number k is `outcomes[k]` of the whole; `reason` says why, or what the rates lack, `input` (steps + 1,) where the
    running input is, and `general` whether the general path solved it.
    """

    position: Mapping[str, Array]
    velocity: Mapping[str, Array] | None
    acceleration: Mapping[str, Array] | None
    input: Array
    status: Array
    reason: str
    general: bool

    def __repr__(self) -> str:
        return short_repr(self)

    @property
    def whole(self) -> bool:
        """Whether it was solved at every step."""
        return not self.status.any()

    def astype(self, dtype: str) -> Swept:
        """The same with points of another type."""

        def rounded(points: Mapping[str, Array]) -> Mapping[str, Array]:
            return {name: values.astype(dtype) for name, values in points.items()}

        rates = [points and rounded(points) for points in (self.velocity, self.acceleration)]
        return self._replace(position=rounded(self.position), velocity=rates[0], acceleration=rates[1])


class PointRows(NamedTuple):
    """Points of many mechanisms one after the other: those of mechanism k from first[k] to first[k + 1], in the order
    of its `Swept`; position, velocity and acceleration (points, steps + 1, 2), SI, the latter two None without rates.
    """

    first: Array
    position: Array
    velocity: Array | None
    acceleration: Array | None

    def __repr__(self) -> str:
        return short_repr(self)


class PointTable(NamedTuple):
    """The points of mechanisms one after the other: those of mechanism k from first[k] to first[k + 1], each by its
    number in `labels`, or without labels by the number of its pin."""

    first: IntArray
    codes: IntArray
    labels: tuple[str, ...] | None = None

    @classmethod
    def of_names(cls, names: Sequence[Sequence[str]]) -> PointTable:
        """The table of the names of the points of every mechanism."""
        codes: dict[str, int] = {}
        flat = [codes.setdefault(name, len(codes)) for point_names in names for name in point_names]
        return cls(part_offsets(list(map(len, names))), np.array(flat, dtype=np.int64), tuple(codes))

    def names(self, k: int) -> list[str]:
        """The names of the points of a mechanism."""
        codes = self.codes[self.first[k] : self.first[k + 1]].tolist()
        return [pin_name(code) if self.labels is None else self.labels[code] for code in codes]

    def rows_of(self, name: str) -> IntArray:
        """The row of a point (mechanisms,), -1 where a mechanism has no such point."""
        rows = np.full(len(self.first) - 1, -1)
        code = pin_number(name) if self.labels is None else {label: k for k, label in enumerate(self.labels)}.get(name)
        if code is not None:
            matches = np.flatnonzero(self.codes == code)
            rows[np.searchsorted(self.first, matches, side="right") - 1] = matches
        return rows


def pin_name(number: int) -> str:
    """The name of a pin by its number."""
    return f"P{number}"


def pin_number(name: str) -> int | None:
    """The number of a pin by its name; None for another name."""
    number = name[1:]
    return int(number) if number.isdecimal() and pin_name(int(number)) == name else None


class Endings(NamedTuple):
    """How mechanisms ended (mechanisms,): at which position of its input each starts (rad), the number of solved steps,
    the number of the outcome that ends them; for dead points of bars which bars (mechanisms, 2) and between which
    rotations of the input (mechanisms, 2), in rad; for others a sentence by the number of the mechanism."""

    start: Array
    solved: IntArray
    outcome: IntArray
    bars: IntArray
    near: Array
    reasons: Mapping[int, str]


@dataclass(frozen=True, eq=False)
class SweptPart:
    """Mechanisms of a sweep, one after the other: x and y of all points, then their first and second rates, `values`
    (points, 2 or 6, numbers) of which the first `steps` + 1 count. `general`: those that the general path solved.
    """

    values: Array
    steps: int
    points: PointTable
    endings: Endings
    general: Mapping[int, Swept]

    def __len__(self) -> int:
        """How many mechanisms there are."""
        return len(self.endings.start)

    @property
    def last_status(self) -> IntArray:
        """The status at the last step (mechanisms,): 0 where all are solved."""
        status = np.where(self.endings.solved > self.steps, 0, self.endings.outcome).astype(np.int8)
        for k, swept in self.general.items():
            status[k] = swept.status[-1]
        return status

    def present_points(self, names: Iterable[str]) -> set[str]:
        """Those of some names that points of the mechanisms have."""
        return {name for name in names if np.any(self.points.rows_of(name) >= 0)}

    def rows(self) -> PointRows:
        """All their points."""
        rows = self.values[:, :, : self.steps + 1]
        orders = [rows[:, row : row + 2].swapaxes(1, 2) for row in range(0, rows.shape[1], 2)]
        return PointRows(self.points.first, orders[0], *(orders[1:] or (None, None)))

    def astype(self, dtype: str, values: Array | None = None) -> SweptPart:
        """The same with numbers of another type, in `values` if they are given."""
        values = np.empty(self.values.shape, dtype) if values is None else values
        with np.errstate(over="ignore", invalid="ignore"):  # numbers behind the last step are arbitrary
            values[...] = self.values
        return replace(self, values=values, general={k: swept.astype(dtype) for k, swept in self.general.items()})

    def swept(self, k: int) -> Swept:
        """One of them."""
        if k in self.general:
            return self.general[k]
        names, first = self.points.names(k), self.points.first
        rows = self.values[first[k] : first[k + 1], :, : self.steps + 1]
        orders = [PointMapping(names, rows[:, row : row + 2].swapaxes(1, 2)) for row in range(0, rows.shape[1], 2)]
        position, velocity, acceleration = orders if len(orders) > 1 else (orders[0], None, None)
        start, solved, outcome, *_ = (part[k] for part in self.endings[:3])
        status = np.zeros(self.steps + 1, dtype=np.int8)
        status[solved:] = outcome
        inputs = start + np.linspace(0.0, 1.0, self.steps + 1) * FULL_TURN
        return Swept(position, velocity, acceleration, inputs, status, self.reason(k), False)

    def reason(self, k: int) -> str:
        """Why a mechanism ends before its last step; empty where it does not."""
        if k in self.general:
            return self.general[k].reason
        if self.endings.solved[k] > self.steps:
            return ""
        if k in self.endings.reasons:
            return self.endings.reasons[k]
        links = ", ".join(f"bar{bar}" for bar in self.endings.bars[k])
        return dead_point_reason(links, self.endings.start[k] + self.endings.near[k])


def dead_point_reason(links: str, inputs: Array) -> str:
    """Why a mechanism stops whose links come to a dead point between two positions of its input (rad)."""
    return f"links {links} come to a dead point {between(inputs)}"


def between(inputs: Array) -> str:
    """Between which positions of the input (rad)."""
    return f"at an input of {inputs[0]:.6g} to {inputs[1]:.6g} rad"


def join_parts(parts: Sequence[SweptPart], values: Array) -> SweptPart:
    """One part of parts of pinned bars that follow one another, whose points are in one array."""
    if len(parts) == 1:
        return parts[0]
    sizes = part_offsets([len(part) for part in parts]).tolist()
    points = part_offsets([part.points.first[-1] for part in parts])
    first = np.concatenate([part.points.first[:-1] + k for part, k in zip(parts, points, strict=False)])
    table = PointTable(np.append(first, points[-1]), np.concatenate([part.points.codes for part in parts]))
    start, solved, outcome, bars, near = map(np.concatenate, zip(*(part.endings[:-1] for part in parts), strict=True))
    reasons: dict[int, str] = {}
    general: dict[int, Swept] = {}
    for part, begin in zip(parts, sizes, strict=False):
        reasons |= {begin + k: reason for k, reason in part.endings.reasons.items()}
        general |= {begin + k: swept for k, swept in part.general.items()}
    endings = Endings(start, solved, outcome, bars, near, reasons)
    return SweptPart(values, parts[0].steps, table, endings, general)


@dataclass(frozen=True)
class Each(Sequence[Swept]):
    """Every mechanism of a sweep, in the order in which they were given; one is read when it is asked for.

    `general`: how many positions the general path solved, of how many mechanisms (`sent`). `remarks`: what there is to
    say. `outcomes`: what the numbers of a status stand for. `reason` says why a time limit or a Ctrl-C ended the sweep
    after the first mechanisms, which then are all; it is empty where none did.
    """

    _parts: tuple[SweptPart, ...]
    general: int
    sent: int
    remarks: tuple[str, ...]
    outcomes: tuple[Outcome, ...] = tuple(Outcome)
    reason: str = ""

    __repr__ = short_repr

    def __len__(self) -> int:
        """How many mechanisms there are."""
        return sum(map(len, self._parts))

    @property
    def outcome(self) -> Outcome:
        """Whether the sweep came to its end: solved, else interrupted; how a mechanism ended says its status."""
        return Outcome.INTERRUPTED if self.reason else Outcome.SOLVED

    @overload
    def __getitem__(self, index: int) -> Swept: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Swept, ...]: ...

    def __getitem__(self, index: int | slice) -> Swept | tuple[Swept, ...]:
        """One of them, or a slice of them."""
        if isinstance(index, slice):
            return tuple(self[k] for k in range(*index.indices(len(self))))
        number = operator.index(index)
        if not -len(self) <= number < len(self):
            raise IndexError(f"there are {len(self)} mechanisms, and no number {index}")
        number %= len(self)
        for part in self._parts:
            if number < len(part):
                return part.swept(number)
            number -= len(part)
        raise AssertionError

    def __iter__(self) -> Iterator[Swept]:
        """One after the other."""
        for part in self._parts:
            for k in range(len(part)):
                yield part.swept(k)

    @property
    def last_status(self) -> Array:
        """The status of every mechanism at its last step (mechanisms,): 0 where it was solved at all of them, else the
        number of the outcome that ended it."""
        return np.concatenate([np.zeros(0, dtype=np.int8), *(part.last_status for part in self._parts)])

    @property
    def whole(self) -> Array:
        """Those (mechanisms,) that were solved at every step."""
        found: Array = self.last_status == 0
        return found

    def of_point(self, order: str, name: str) -> Array:
        """A point's "position", "velocity" or "acceleration" (mechanisms, steps + 1, 2), SI.

        Not a number where a mechanism has no such point."""
        found = []
        for part in self._parts:
            values, rows = getattr(part.rows(), order), part.points.rows_of(name)
            own = np.full((len(rows), *values.shape[1:]), np.nan)
            own[rows >= 0] = values[rows[rows >= 0]]
            found.append(own)
        return np.concatenate(found) if found else np.zeros((0, 0, 2))

    def rows(self) -> PointRows:
        """The points of all mechanisms in one array each. Those of a sweep over `planar.pinned_linkages` are not
        copied."""
        parts = [part.rows() for part in self._parts]
        if len(parts) == 1:
            return parts[0]
        counts = np.concatenate([np.zeros(0, dtype=np.int64), *(np.diff(part.first) for part in parts)])
        orders = [
            np.concatenate([values for part in parts if (values := part[1 + order]) is not None])
            if parts and parts[0][1 + order] is not None
            else None
            for order in range(3)
        ]
        position = np.zeros((0, 0, 2)) if orders[0] is None else orders[0]
        return PointRows(part_offsets(counts), position, orders[1], orders[2])
