"""The result of a sweep over mechanisms of any structure."""

from __future__ import annotations

import operator
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol, overload

import numpy as np

from planar.foundation.arrays import part_offsets
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


def swept_from_rows(names: Sequence[str], rows: Array, inputs: Array, solved: int, outcome: int, reason: str) -> Swept:
    """One mechanism by rows of its points (points, 2 or 6, steps + 1): x and y, then their first and second rates.
    The status after the `solved` steps is the number of an outcome."""
    orders = [PointMapping(names, rows[:, row : row + 2].swapaxes(1, 2)) for row in range(0, rows.shape[1], 2)]
    status = np.zeros(len(inputs), dtype=np.int8)
    status[solved:] = outcome
    position, velocity, acceleration = orders if len(orders) > 1 else (orders[0], None, None)
    return Swept(position, velocity, acceleration, inputs, status, reason, False)


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


class SweptPart(Protocol):
    """Some mechanisms of a sweep, one after the other."""

    def __len__(self) -> int:
        """How many mechanisms there are."""

    @property
    def last_status(self) -> Array:
        """The status at the last step (mechanisms,): 0 where all are solved."""

    @property
    def others(self) -> Iterable[Swept]:
        """Those that were not solved as most are: they alone may be of the general path, or have remarks."""

    def swept(self, k: int) -> Swept:
        """One of them."""

    def rows(self) -> PointRows:
        """All their points."""

    def point_rows(self, name: str) -> Array:
        """The rows of a point in these (mechanisms,), -1 where a mechanism has no such point."""

    def astype(self, dtype: str) -> SweptPart:
        """The same with numbers of another type."""


@dataclass(frozen=True, eq=False)
class SweptList:
    """Mechanisms each of which was read already."""

    found: tuple[Swept, ...]

    def __len__(self) -> int:
        """See `SweptPart`, as for all others."""
        return len(self.found)

    @property
    def last_status(self) -> Array:
        return np.array([each.status[-1] for each in self.found], dtype=np.int8)

    @property
    def others(self) -> Iterable[Swept]:
        return self.found

    def swept(self, k: int) -> Swept:
        return self.found[k]

    def point_rows(self, name: str) -> Array:
        found, row = [], 0
        for each in self.found:
            found.append(row + list(each.position).index(name) if name in each.position else -1)
            row += len(each.position)
        return np.array(found, dtype=np.int64)

    def astype(self, dtype: str) -> SweptList:
        return SweptList(tuple(each.astype(dtype) for each in self.found))

    def rows(self) -> PointRows:
        first = part_offsets([len(each.position) for each in self.found])
        orders = []
        for order in ("position", "velocity", "acceleration"):
            rows = [values for each in self.found for values in (getattr(each, order) or {}).values()]
            orders.append(np.array(rows) if rows else None)
        steps = len(self.found[0].status) if self.found else 0
        return PointRows(first, np.zeros((0, steps, 2)) if orders[0] is None else orders[0], *orders[1:])


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
            values, rows = getattr(part.rows(), order), part.point_rows(name)
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
        kept = [part for part in parts if len(part.position)] or parts[:1]
        whole = [
            np.concatenate([each for part in kept if (each := part[1 + order]) is not None])
            if kept and kept[0][1 + order] is not None
            else None
            for order in range(3)
        ]
        position = np.zeros((0, 0, 2)) if whole[0] is None else whole[0]
        return PointRows(part_offsets(counts), position, whole[1], whole[2])
