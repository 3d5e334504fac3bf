"""Results of a run that are made when they are read."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, overload

import numpy as np

Array = np.ndarray


class KeptPoints(Mapping[str, Array]):
    """Points by name, each (positions, 2), of one order of a run's rows (rows, positions)."""

    __slots__ = ("_first", "_index", "_rows")

    def __init__(self, rows: Array, index: Mapping[str, int], first: int):
        """`index`: the row of each point's x beside the order's `first` row."""
        self._rows, self._index, self._first = rows, index, first

    def __getitem__(self, name: str) -> Array:
        row = self._first + self._index[name]
        return self._rows[row : row + 2].T

    def __iter__(self) -> Iterator[str]:
        return iter(self._index)

    def __len__(self) -> int:
        return len(self._index)

    def __repr__(self) -> str:
        return repr(dict(self))


class LateSentences(Sequence[str]):
    """Sentences as a tuple, made once they are read."""

    __slots__ = ("_make", "_sentences")

    def __init__(self, make: Callable[[], Sequence[str]]):
        self._make = make
        self._sentences: tuple[str, ...] | None = None

    def _all(self) -> tuple[str, ...]:
        if self._sentences is None:
            self._sentences = tuple(self._make())
        return self._sentences

    @overload
    def __getitem__(self, at: int) -> str: ...

    @overload
    def __getitem__(self, at: slice) -> Sequence[str]: ...

    def __getitem__(self, at: int | slice) -> str | Sequence[str]:
        return self._all()[at]

    def __len__(self) -> int:
        return len(self._all())

    def __eq__(self, other: object) -> bool:
        return self._all() == (other._all() if isinstance(other, LateSentences) else other)

    def __hash__(self) -> int:
        return hash(self._all())

    def __repr__(self) -> str:
        return repr(self._all())

    def __reduce__(self) -> tuple[Any, ...]:
        return tuple, (self._all(),)
