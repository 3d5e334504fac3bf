"""Many linkages of pinned bars as arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import chain, pairwise
from typing import Any, overload

import numpy as np

from planar.foundation.arrays import part_offsets
from planar.foundation.errors import BadInput
from planar.model.mechanism import LARGEST_INPUT_POSITION
from planar.model.pin_linkage import PinLayout, PinnedMechanism

Array = np.ndarray

ABSENT = -1
"""In arrays of pin numbers: no pin."""


def pinned_linkages(
    places: Any,
    bars: Any,
    frame: Any,
    crank: Any = 0,
    *,
    velocity: Any = 1.0,
    acceleration: Any = 0.0,
) -> PinnedLinkages:
    """Many linkages as `planar.pinned` makes one, from arrays with an entry for each linkage first.

    `places` (linkages, pins, 2), in m; rows of NaN at the end where a linkage has fewer pins. `bars` (linkages, bars,
    pins of a bar): numbers of pins of the same linkage, -1 at the end where a bar has fewer pins, or a linkage fewer
    bars. `frame` (linkages, pins): the pins on the frame, -1 likewise. `crank`: the number of the bar that is driven,
    `velocity` and `acceleration` of it (rad/s, rad/s^2): numbers, or arrays (linkages,).

    Nothing is made for each linkage by itself, until one is asked for by its number. Raises BadInput, with the place
    among the arguments, as `pinned` does, and for a pin that is on the frame twice.

    >>> import planar
    >>> places = [[(0, 0), (0, 1), (3, 2), (4, 0)]] * 2
    >>> len(planar.pinned_linkages(places, [[(0, 1), (1, 2), (2, 3)]] * 2, [[0, 3]] * 2))
    2
    """
    at, pin_counts = _read_positions(places)
    many = len(at)
    held = _read_numbers(bars, "bars", 3, many)
    fixed = _read_numbers(frame, "frame", 2, many)
    _check_pins(held, "bars", pin_counts)
    _check_pins(fixed, "frame", pin_counts)
    bar_sizes, frame_counts = _count_present(held), _count_present(fixed)
    bar_counts = np.sum(bar_sizes > 0, axis=1)
    driven = np.broadcast_to(_read_numbers(crank, "crank", np.ndim(crank), many), many).astype(np.int64)
    rates = [_read_rates(each, name, many) for each, name in ((velocity, "velocity"), (acceleration, "acceleration"))]
    _refuse((bar_sizes == 0) & (np.arange(held.shape[1]) < bar_counts[:, None]), "bars", "a bar without a pin is none")
    _refuse((bar_sizes == 1) | _has_twice(held), "bars", "two pins or more are wanted, each once")
    _refuse(_has_twice(fixed), "frame", "each pin is wanted once")
    _refuse(bar_counts == 0, "bars", "a linkage without a bar is none")
    _refuse(frame_counts == 0, "frame", "no pin is on the frame")
    _refuse((driven < 0) | (driven >= bar_counts), "crank", "the number of a bar is wanted")
    made = PinnedLinkages(
        at[np.arange(at.shape[1]) < pin_counts[:, None]],
        part_offsets(pin_counts),
        held[held >= 0],
        part_offsets(bar_sizes[bar_sizes > 0]),
        part_offsets(bar_counts),
        fixed[fixed >= 0],
        part_offsets(frame_counts),
        driven,
        *rates,
    )
    _check_joined(made)
    return made


@dataclass(frozen=True, eq=False, repr=False)
class PinnedLinkages(Sequence[PinnedMechanism]):
    """Linkages of pinned bars, made by `pinned_linkages`; one of them, by its number, is a mechanism.

    Flat arrays, in which those of linkage k stand from first[k] to first[k + 1]: `positions` (pins, 2) in m, the
    entries of bars in `bar_pins`, each bar's from `first_entry`, `frame_pins`; numbers of pins are those of the
    linkage. crank, velocity, acceleration (linkages,).
    """

    positions: Array
    first_pin: Array
    bar_pins: Array
    first_entry: Array
    first_bar: Array
    frame_pins: Array
    first_frame_pin: Array
    crank: Array
    velocity: Array
    acceleration: Array

    def __post_init__(self) -> None:
        for each in fields(self):
            getattr(self, each.name).setflags(write=False)

    @classmethod
    def from_layouts(cls, layouts: Sequence[PinLayout]) -> PinnedLinkages:
        """Linkages that have been checked."""
        positions, bars, frames, cranks, velocities, accelerations = zip(*layouts, strict=True)
        all_bars = list(chain.from_iterable(bars))
        return cls(
            np.concatenate(positions),
            part_offsets(list(map(len, positions))),
            np.array(list(chain.from_iterable(all_bars))),
            part_offsets(list(map(len, all_bars))),
            part_offsets(list(map(len, bars))),
            np.array(list(chain.from_iterable(frames))),
            part_offsets(list(map(len, frames))),
            np.array(cranks),
            np.array(velocities),
            np.array(accelerations),
        )

    @property
    def crank_angles(self) -> Array:
        """The angles of the cranks (linkages,), from the first pins of their bars to the second ones (rad)."""
        entries = self.first_entry[self.first_bar[:-1] + self.crank]
        first, second = (self.positions[self.first_pin[:-1] + self.bar_pins[entries + k]] for k in (0, 1))
        way = second - first
        return np.asarray(np.arctan2(way[:, 1], way[:, 0]))

    def __repr__(self) -> str:
        return f"PinnedLinkages(<{len(self)} linkages>)"

    def __len__(self) -> int:
        """How many linkages there are."""
        return len(self.crank)

    @overload
    def __getitem__(self, index: int) -> PinnedMechanism: ...

    @overload
    def __getitem__(self, index: slice) -> PinnedLinkages: ...

    def __getitem__(self, index: int | slice) -> PinnedMechanism | PinnedLinkages:
        """One of them as a mechanism, or several that follow one another."""
        if isinstance(index, slice):
            begin, end, by = index.indices(len(self))
            if by != 1:
                raise BadInput("linkages", "linkages that follow one another are wanted")
            return self if end - begin == len(self) else self._part(begin, max(begin, end))
        if not -len(self) <= index < len(self):
            raise IndexError(f"there are {len(self)} linkages, and no number {index}")
        own = self._part(index % len(self), index % len(self) + 1)
        entries = own.bar_pins.tolist()
        ends = own.first_entry.tolist()
        bars = [tuple(entries[a:b]) for a, b in pairwise(ends)]
        positions = own.positions.copy()
        positions.flags.writeable = False
        rates = float(own.velocity[0]), float(own.acceleration[0])
        layout = PinLayout(positions, bars, tuple(own.frame_pins.tolist()), int(own.crank[0]), *rates)
        return PinnedMechanism.from_layout("", layout)

    def _part(self, begin: int, end: int) -> PinnedLinkages:
        pins, bars, fixed = (each[begin : end + 1] for each in (self.first_pin, self.first_bar, self.first_frame_pin))
        entries = self.first_entry[bars[0] : bars[-1] + 1]
        return PinnedLinkages(
            self.positions[pins[0] : pins[-1]],
            pins - pins[0],
            self.bar_pins[entries[0] : entries[-1]],
            entries - entries[0],
            bars - bars[0],
            self.frame_pins[fixed[0] : fixed[-1]],
            fixed - fixed[0],
            *(each[begin:end] for each in (self.crank, self.velocity, self.acceleration)),
        )

    def __reduce__(self) -> Any:
        return PinnedLinkages, tuple(getattr(self, each.name) for each in fields(self))


def _read_positions(places: Any) -> tuple[Array, Array]:
    """The places, and how many pins each linkage has."""
    try:
        at = np.array(places, dtype=float)
    except (TypeError, ValueError):
        raise BadInput("places", "an array (linkages, pins, 2) of numbers (m) is wanted") from None
    if at.ndim != 3 or at.shape[2] != 2 or at.shape[1] < 2:
        raise BadInput("places", "an array (linkages, pins, 2) is wanted, of two pins at least")
    present = ~(np.isnan(at[:, :, 0]) & np.isnan(at[:, :, 1]))
    counts = np.sum(present, axis=1)
    expected = np.arange(at.shape[1]) < counts[:, None]
    with np.errstate(invalid="ignore"):
        within = np.abs(at) <= LARGEST_INPUT_POSITION
        wrong = (present != expected) | (expected & ~(within[:, :, 0] & within[:, :, 1]))
    _refuse(wrong, "places", f"numbers up to {LARGEST_INPUT_POSITION:g} m are wanted, NaN at the end alone")
    _refuse(counts < 2, "places", "two pins at least are wanted")
    return at, counts


def _read_numbers(values: Any, name: str, dimensions: int, many: int) -> Array:
    """Whole numbers, with an entry for each linkage first."""
    shape = {0: "", 1: " (linkages,)", 2: " (linkages, pins)", 3: " (linkages, bars, pins of a bar)"}.get(dimensions)
    found = np.asarray(values)
    if shape is None or found.dtype.kind not in "iu" or found.ndim != dimensions:
        raise BadInput(name, f"an array{shape or ' (linkages,)'} of whole numbers is wanted")
    if dimensions and (found.shape[0] != many or 0 in found.shape[1:]):
        raise BadInput(name, f"there are {many} linkages, but {found.shape[0]} entries")
    return found.astype(np.int64, copy=False)


def _read_rates(values: Any, name: str, many: int) -> Array:
    """Finite numbers (linkages,)."""
    try:
        found = np.array(values, dtype=float)
        whole = np.broadcast_to(found, many).copy()
    except (TypeError, ValueError):
        raise BadInput(name, "a finite number is wanted, or an array (linkages,) of these") from None
    _refuse(~np.isfinite(whole), name, "a finite number is wanted")
    return whole


def _check_pins(numbers: Array, name: str, pin_counts: Array) -> None:
    """Refuse numbers of pins that are not there, and those that stand behind none."""
    wrong = (numbers < ABSENT) | (numbers >= pin_counts.reshape(-1, *[1] * (numbers.ndim - 1)))
    wrong[..., 1:] |= (numbers[..., 1:] >= 0) & (numbers[..., :-1] < 0)
    _refuse(wrong, name, "the number of a pin of the linkage is wanted, -1 at the end alone")


def _count_present(numbers: Array) -> Array:
    """How many are there in each row."""
    found = np.zeros(numbers.shape[:-1], dtype=np.int64)
    for k in range(numbers.shape[-1]):
        found += numbers[..., k] >= 0
    return found


def _has_twice(numbers: Array) -> Array:
    """Whether a row has a pin twice."""
    if numbers.shape[-1] == 2:
        return np.asarray((numbers[..., 0] == numbers[..., 1]) & (numbers[..., 0] >= 0))
    ordered = np.sort(numbers, axis=-1)
    return np.asarray(np.any((ordered[..., 1:] == ordered[..., :-1]) & (ordered[..., 1:] >= 0), axis=-1))


def _check_joined(made: PinnedLinkages) -> None:
    """Refuse bars of no length, pins on nothing, and cranks that are not pinned to the frame at one point."""
    x, y = made.positions.T
    bar_owner = np.repeat(np.arange(len(made)), np.diff(made.first_bar))
    sizes = np.diff(made.first_entry)
    entries = made.bar_pins + np.repeat(made.first_pin[bar_owner], sizes)
    first, second = entries[made.first_entry[:-1]], entries[made.first_entry[:-1] + 1]
    flat = np.flatnonzero((x[first] == x[second]) & (y[first] == y[second]))
    if len(flat):
        owner = bar_owner[flat[0]]
        place = f"bars[{owner}][{flat[0] - made.first_bar[owner]}]"
        raise BadInput(place, "its first two pins are at one place, so the bar has no length")
    frame_owner = np.repeat(np.arange(len(made)), np.diff(made.first_frame_pin))
    on_frame, on_bar = np.zeros((2, len(x)), dtype=bool)
    on_frame[made.frame_pins + made.first_pin[frame_owner]] = True
    on_bar[entries] = True
    alone = np.flatnonzero(~(on_frame | on_bar))
    if len(alone):
        owner = int(np.searchsorted(made.first_pin, alone[0], side="right")) - 1
        place = f"places[{owner}][{alone[0] - made.first_pin[owner]}]"
        raise BadInput(place, "the pin is on no bar, and not on the frame")
    times = np.add.reduceat(on_frame[entries].astype(np.int64), made.first_entry[:-1])[made.first_bar[:-1] + made.crank]
    _refuse(times == 0, "crank", "the bar is not pinned to the frame")
    _refuse(times > 1, "crank", "the bar is pinned to the frame twice, so it cannot turn")


def _refuse(wrong: Array, name: str, told: str) -> None:
    """Raises BadInput at the first place where something is wrong."""
    if wrong.any():
        place = np.unravel_index(int(np.argmax(wrong)), wrong.shape)
        raise BadInput(f"{name}{''.join(f'[{int(k)}]' for k in place)}", told)
