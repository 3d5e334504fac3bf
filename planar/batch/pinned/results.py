"""What was found of linkages of pinned bars: arrays, from which one linkage is read when it is asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from planar.batch.mechanisms.results import PointRows, Swept, swept_from_rows
from planar.batch.mechanisms.tape_runs import DEAD_POINT_NUMBER, FULL_TURN
from planar.batch.pinned.tape import pin_number
from planar.foundation.arrays import part_offsets

Array = np.ndarray


@dataclass(frozen=True, eq=False)
class PinnedPart:
    """Linkages of pinned bars: points (points, rows, numbers), of which those from first[k] to first[k + 1] are of
    linkage k and have the numbers `pins` there; at so many steps, `solved` (linkages,), from a `start` (rad) on. Those
    that stop there come to a dead point of `bars` (linkages, 2), `near` (linkages, 2) these turns of the crank (rad).
    """

    values: Array
    steps: int
    first: Array
    pins: Array
    start: Array
    solved: Array
    near: Array
    bars: Array
    found_elsewhere: Mapping[int, Swept]

    def __len__(self) -> int:
        """How many linkages there are."""
        return len(self.start)

    @property
    def last_status(self) -> Array:
        """The status at the last step (linkages,)."""
        found = np.where(self.solved > self.steps, 0, DEAD_POINT_NUMBER).astype(np.int8)
        for k, each in self.found_elsewhere.items():
            found[k] = each.status[-1]
        return found

    @property
    def others(self) -> Iterable[Swept]:
        """See `SweptPart`."""
        return self.found_elsewhere.values()

    def rows(self) -> PointRows:
        """See `SweptPart`."""
        own = self.values[:, :, : self.steps + 1]
        orders = [own[:, row : row + 2].swapaxes(1, 2) for row in range(0, own.shape[1], 2)]
        return PointRows(self.first, orders[0], *(orders[1:] or (None, None)))

    def point_rows(self, name: str) -> Array:
        """See `SweptPart`."""
        found = np.full(len(self), -1)
        number = pin_number(name)
        if number is not None:
            rows = np.flatnonzero(self.pins == number)
            found[np.searchsorted(self.first, rows, side="right") - 1] = rows
        return found

    def astype(self, dtype: str, room: Array | None = None) -> PinnedPart:
        """See `SweptPart`; where there is `room` for the values, there."""
        found = {k: each.astype(dtype) for k, each in self.found_elsewhere.items()}
        room = np.empty(self.values.shape, dtype) if room is None else room
        with np.errstate(over="ignore", invalid="ignore"):  # rows that were solved elsewhere hold anything
            room[...] = self.values
        return replace(self, values=room, found_elsewhere=found)

    def swept(self, k: int) -> Swept:
        """One linkage."""
        if k in self.found_elsewhere:
            return self.found_elsewhere[k]
        begin, end = int(self.first[k]), int(self.first[k + 1])
        names = [f"P{pin}" for pin in self.pins[begin:end].tolist()]
        rows = self.values[begin:end, :, : self.steps + 1]
        inputs = self.start[k] + np.linspace(0.0, 1.0, self.steps + 1) * FULL_TURN
        return swept_from_rows(names, rows, inputs, int(self.solved[k]), DEAD_POINT_NUMBER, self._reason(k))

    def _reason(self, k: int) -> str:
        """Why a linkage stops; nothing where it does not."""
        if self.solved[k] > self.steps:
            return ""
        links = ", ".join(f"bar{bar}" for bar in self.bars[k])
        near = self.start[k] + self.near[k]
        return f"links {links} come to a dead point at an input of {near[0]:.6g} to {near[1]:.6g} rad"


def join_parts(parts: Sequence[PinnedPart], values: Array) -> PinnedPart:
    """Parts that follow one another, whose points are in one array."""
    if len(parts) == 1:
        return parts[0]
    sizes = part_offsets([len(part) for part in parts])
    points = part_offsets([part.first[-1] for part in parts])
    first = np.concatenate([*(part.first[:-1] + at for part, at in zip(parts, points, strict=False)), points[-1:]])
    names = ("pins", "start", "solved", "near", "bars")
    pins, start, solved, near, bars = (np.concatenate([getattr(part, name) for part in parts]) for name in names)
    found = {
        k + int(at): each for part, at in zip(parts, sizes, strict=False) for k, each in part.found_elsewhere.items()
    }
    return PinnedPart(values, parts[0].steps, first, pins, start, solved, near, bars, found)
