"""How a compiled run is called, and how it says that it ended."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from ctypes import addressof, c_char
from struct import Struct
from typing import Any, NamedTuple

import numpy as np

from planar.batch.general_path import OUTCOMES
from planar.foundation.errors import Outcome

Array = np.ndarray

MAX_BOUND_NAMES = 64
"""Sequences of names that are known at once."""
Binding = tuple[Callable[..., bytes], Array, int]
"""What packs values, how many there are and where each of them goes, and the address of that."""

_view = c_char.from_buffer


def address_of(array: Array) -> int:
    """Where an array's numbers begin: what `array.ctypes.data` says, in a fifth of its time."""
    return addressof(_view(array))  # type: ignore[arg-type]


class RunCall(NamedTuple):
    """A compiled run as other compiled code calls it: the function, what it takes first, and how much room (numbers) it
    writes to, from where whole vectors begin; where in that its second array begins, if it takes two; and where in it
    the run's ending, with the position after it, and its rows stand, `stride` numbers apart."""

    function: Any
    context: int
    room: int
    second: int | None
    ending: int
    rows: int
    stride: int


class ValueBinder:
    """How values of these names are packed, kept from call to call, in which the names are mostly the same."""

    def __init__(self, index: Mapping[str, int]):
        """`index`: the place of each name that there is."""
        self._index = index
        self.bound: dict[tuple[str, ...], Binding] = {}
        "the bindings that are known"

    def bind(self, names: tuple[str, ...]) -> Binding:
        """The binding of names in an order. Raises KeyError for one that is not there."""
        found = self.bound.get(names)
        if found is None:
            places = np.array([len(names), *(self._index[name] for name in names)], dtype=np.int64)
            if len(self.bound) >= MAX_BOUND_NAMES:
                self.bound.clear()
            # packing keeps the order; bytes are read where they are
            found = self.bound[names] = Struct(f"{len(names)}d").pack, places, places.ctypes.data
        return found


ALL_SOLVED, UNSURE, CANNOT_BE_ASSEMBLED, DEAD_POINT, STOP = 0.0, 1.0, 2.0, 3.0, 4.0
"""At its end, nobody knows, at its start, at a dead point, or where a pair meets its stop."""
CLEARLY_OPEN = 1.0 + 1e-4
"""Of a block's coalescence: from there on it cannot be joined, whatever rounding does; a pair is beyond its stop."""
STATUS_OF_ENDING = {
    CANNOT_BE_ASSEMBLED: OUTCOMES.index(Outcome.CANNOT_BE_ASSEMBLED),
    DEAD_POINT: OUTCOMES.index(Outcome.DEAD_POINT),
    STOP: OUTCOMES.index(Outcome.STOP),
}
"""What stands in a status after a run has ended so."""
