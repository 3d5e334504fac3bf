"""What is wanted of a mechanism, as a catalogue is searched for it: places, poses and functions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray


class PathEntries(NamedTuple):
    """Places (n,) x + iy (m) that a point comes to; with `inputs` (n,) given, of the running input (rad or m), unless
    `is_absolute` by their differences. `in_order`: one after the other, either way. `is_closed`: round a curve."""

    point: str
    places: ComplexArray
    weights: Array
    inputs: Array | None = None
    in_order: bool = True
    is_closed: bool = False
    is_absolute: bool = False


class PoseEntries(NamedTuple):
    """Poses (n,) of a link: places x + iy (m) of its origin, and its angles (rad)."""

    link: str
    places: ComplexArray
    angles: Array
    weights: Array
    inputs: Array | None = None
    in_order: bool = False
    is_absolute: bool = False


class FunctionEntries(NamedTuple):
    """Positions (n,) of a pair (rad or m) at positions of another, or of the running input; unless `is_absolute` both
    by their differences."""

    from_pair: str
    to_pair: str
    given: Array
    values: Array
    weights: Array
    is_absolute: bool = False


Entries = PathEntries | PoseEntries | FunctionEntries


def entry_weights(entries: Entries) -> Array:
    """Weights (n,) whose sum is 1."""
    found: Array = entries.weights / np.sum(entries.weights)
    return found


def entries_size(wanted: tuple[Entries, ...], otherwise: float) -> float:
    """How large what is wanted is (m): twice the root mean square distance of all places from their middle, which of a
    circle is the diameter; or `otherwise` where it has no size."""
    places = [each.places for each in wanted if not isinstance(each, FunctionEntries)]
    if not places:
        return otherwise
    every = np.concatenate(places)
    return 2.0 * float(np.sqrt(np.mean(np.abs(every - every.mean()) ** 2))) or otherwise
