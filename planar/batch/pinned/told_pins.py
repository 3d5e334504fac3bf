"""Which pins of linkages are told."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.model.pin_linkages import PinnedLinkages

Array = np.ndarray


class ToldPins(NamedTuple):
    """The pins that are told, numbered through all linkages (points,), and where those of each linkage begin
    (linkages + 1,)."""

    pins: Array
    first: Array

    def select(self, linkages: PinnedLinkages, begin: int, end: int) -> ToldPins:
        """Those of linkages that follow one another."""
        points = slice(self.first[begin], self.first[end])
        first = self.first[begin : end + 1]
        return ToldPins(self.pins[points] - linkages.first_pin[begin], first - first[0])


def find_told_pins(linkages: PinnedLinkages, names: Sequence[str] | None) -> ToldPins:
    """Those of some names, of every linkage that has them; all that move, if there are none."""
    if names is None:
        moves = np.ones(len(linkages.positions), dtype=bool)
        moves[frame_pins(linkages)] = False
        pins = np.flatnonzero(moves)
        return ToldPins(pins, np.searchsorted(pins, linkages.first_pin))
    numbers = np.array([number for name in names if (number := pin_number(name)) is not None], dtype=np.int64)
    there = numbers < np.diff(linkages.first_pin)[:, None]
    named = (numbers + linkages.first_pin[:-1, None])[there]
    return ToldPins(named, np.concatenate([[0], np.cumsum(there.sum(axis=1))]))


def frame_pins(linkages: PinnedLinkages) -> Array:
    """The pins on the frame, numbered through all linkages."""
    owner = np.repeat(np.arange(len(linkages)), np.diff(linkages.first_frame_pin))
    found: Array = linkages.frame_pins + linkages.first_pin[owner]
    return found


def pin_number(name: str) -> int | None:
    """The number of a pin by its name; None for another name."""
    number = name[1:]
    return int(number) if name[:1] == "P" and number.isdecimal() and str(int(number)) == number else None
