"""The result of a sweep over mechanisms of any structure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple, overload

import numpy as np

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


@dataclass(frozen=True)
class Each(Sequence[Swept]):
    """Every mechanism of a sweep, in the order in which they were given.

    `general`: how many positions the general path solved, of how many mechanisms (`sent`). `said`: what there is to
    say. `outcomes`: what the numbers of a status stand for.
    """

    found: tuple[Swept, ...]
    general: int
    sent: int
    said: tuple[str, ...]
    outcomes: tuple[Outcome, ...] = tuple(Outcome)

    __repr__ = short_repr

    def __len__(self) -> int:
        """How many mechanisms there are."""
        return len(self.found)

    @overload
    def __getitem__(self, index: int) -> Swept: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Swept, ...]: ...

    def __getitem__(self, index: int | slice) -> Swept | tuple[Swept, ...]:
        """One of them, or a slice of them."""
        return self.found[index]

    def __iter__(self) -> Iterator[Swept]:
        """One after the other."""
        return iter(self.found)

    @property
    def whole(self) -> Array:
        """Those (mechanisms,) that were solved at every step."""
        return np.array([each.whole for each in self.found], dtype=bool)
