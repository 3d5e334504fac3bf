"""The result of a sweep over mechanisms of any structure."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, overload

import numpy as np

from planar.batch.mechanisms.tape_runs import FULL_TURN, Endings
from planar.foundation.arrays import IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.foundation.short_repr import short_repr
from planar.model.link_shapes import PointName

Array = np.ndarray

ORDERS = ("position", "velocity", "acceleration")


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
    labels: tuple[PointName, ...] | None = None

    @classmethod
    def of_names(cls, names: Sequence[Sequence[PointName]]) -> PointTable:
        """The table of the names of the points of every mechanism."""
        codes: dict[PointName, int] = {}
        flat = [codes.setdefault(name, len(codes)) for point_names in names for name in point_names]
        return cls(part_offsets(list(map(len, names))), np.array(flat, dtype=np.int64), tuple(codes))

    def names(self, k: int) -> list[PointName]:
        """The names of the points of a mechanism."""
        codes = self.codes[self.first[k] : self.first[k + 1]].tolist()
        return [pin_name(code) if self.labels is None else self.labels[code] for code in codes]

    def rows_of(self, name: PointName) -> IntArray:
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


def pin_number(name: PointName) -> int | None:
    """The number of a pin by its name; None for another point."""
    if not isinstance(name, str):
        return None
    number = name[1:]
    return int(number) if number.isdecimal() and pin_name(int(number)) == name else None


@dataclass(frozen=True, eq=False)
class SweptPart:
    """Mechanisms of a sweep, one after the other: x and y of all points, then their first and second rates, `values`
    (points, 2 or 6, numbers) of which the first `steps` + 1 count."""

    values: Array
    steps: int
    points: PointTable
    endings: Endings

    def __len__(self) -> int:
        """How many mechanisms there are."""
        return len(self.endings.start)

    @property
    def last_status(self) -> IntArray:
        """The status at the last step (mechanisms,): 0 where all are solved."""
        return np.where(self.endings.solved > self.steps, 0, self.endings.outcome).astype(np.int8)

    @property
    def general_designs(self) -> int:
        """The number of mechanisms that the general path solved."""
        return len(self.endings.general_inputs)

    @property
    def general_positions(self) -> int:
        """The number of positions that the general path solved."""
        return sum(int(self.endings.solved[k]) for k in self.endings.general_inputs)

    @property
    def ending_counts(self) -> tuple[tuple[int, int, str], ...]:
        """The number of each outcome, how many mechanisms it ends, and the reason of the first of them; for solved ones
        how many lack rates, or digits of them."""
        status = self.last_status
        counts = np.bincount(status)
        first_ones = sorted((int(np.argmax(status == code)), code) for code in np.flatnonzero(counts).tolist() if code)
        remarks = [self.reason(k) for k in self.endings.general_inputs if not status[k] and self.reason(k)]
        endings = tuple((code, int(counts[code]), self.reason(first)) for first, code in first_ones)
        return (*endings, *((0, len(remarks), remark) for remark in remarks[:1]))

    def present_points(self, names: Iterable[PointName]) -> set[PointName]:
        """Those of some names that points of the mechanisms have."""
        return {name for name in names if np.any(self.points.rows_of(name) >= 0)}

    def orders(self, first: int | None = None, end: int | None = None) -> list[Array | None]:
        """Position, velocity and acceleration of points (points, steps + 1, 2), the latter two None without rates."""
        return point_orders(self.values[first:end], self.steps)

    def swept(self, k: int) -> Swept:
        """One of them."""
        names, endings = [*map(str, self.points.names(k))], self.endings
        orders = self.orders(self.points.first[k], self.points.first[k + 1])
        position, velocity, acceleration = (
            None if values is None else dict(zip(names, values, strict=True)) for values in orders
        )
        status = np.zeros(self.steps + 1, dtype=np.int8)
        status[endings.solved[k] :] = endings.outcome[k]
        inputs = endings.general_inputs.get(k)
        if inputs is None:
            inputs = endings.start[k] + np.linspace(0.0, 1.0, self.steps + 1) * FULL_TURN
        is_general = k in endings.general_inputs
        return Swept(position or {}, velocity, acceleration, inputs, status, self.reason(k), is_general)

    def reason(self, k: int) -> str:
        """Why a mechanism ends before its last step, or a remark on its rates; empty where there is neither."""
        if k in self.endings.reasons:
            return self.endings.reasons[k]
        if self.endings.solved[k] > self.steps:
            return ""
        links = ", ".join(f"bar{bar}" for bar in sorted(self.endings.links[k]))
        return dead_point_reason(links, self.endings.start[k] + self.endings.near[k])


def point_orders(values: Array, steps: int) -> list[Array | None]:
    """Position, velocity and acceleration (points, steps + 1, 2) of values (points, 2 or 6, numbers); None for rates
    that are not there."""
    rows = values[:, :, : steps + 1]
    orders = [rows[:, row : row + 2].swapaxes(1, 2) for row in range(0, rows.shape[1], 2)]
    return [*orders, None, None][:3]


def dead_point_reason(links: str, inputs: Array) -> str:
    """Why a mechanism stops whose links come to a dead point between two positions of its input (rad)."""
    return f"links {links} come to a dead point {between(inputs)}"


def between(inputs: Array) -> str:
    """Between which positions of the input (rad)."""
    return f"at an input of {inputs[0]:.6g} to {inputs[1]:.6g} rad"


@dataclass(frozen=True)
class Each(Sequence[Swept]):
    """Every mechanism of a sweep, in the order in which they were given; one is read when it is asked for.

    `general`: how many positions the general path solved, of how many mechanisms (`sent`). `remarks`: what there is to
    say. `outcomes`: what the numbers of a status stand for. `reason` says why a time limit or a Ctrl-C ended the sweep
    after the first mechanisms, which then are all; it is empty where none did.
    """

    _parts: tuple[SweptPart, ...]
    _values: Array | None
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
        of_parts = []
        for part in self._parts:
            values, rows = (
                part.orders()[("position", "velocity", "acceleration").index(order)],
                part.points.rows_of(name),
            )
            assert values is not None
            of_part = np.full((len(rows), *values.shape[1:]), np.nan)
            of_part[rows >= 0] = values[rows[rows >= 0]]
            of_parts.append(of_part)
        return np.concatenate(of_parts) if of_parts else np.zeros((0, 0, 2))

    def rows(self) -> PointRows:
        """The points of all mechanisms in one array each. Those of a sweep over `planar.pinned_linkages` are not
        copied."""
        counts = np.concatenate([np.zeros(0, dtype=np.int64), *(np.diff(part.points.first) for part in self._parts)])
        parts = [part.values for part in self._parts]
        values = parts[0] if len(parts) == 1 else self._values
        if values is None:
            values = np.concatenate(parts) if parts else np.zeros((0, 2, 0))
        position, *rates = point_orders(values, self._parts[0].steps if parts else -1)
        assert position is not None
        return PointRows(part_offsets(counts), position, *rates)
