"""How far entries are missed."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.jets import TURN
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath


def _difference(own: Array, other: Array, wanted: Wanted) -> Array:
    """Of results (n, parts), angles by less than half a turn."""
    apart: Array = own - other
    if isinstance(wanted, WantedPath):
        return apart
    turned = apart[:, -1] - TURN * np.round(apart[:, -1] / TURN)
    told: Array = np.concatenate([apart[:, :-1], turned[:, None]], axis=1)
    return told


def entry_misses(wanted: Wanted, shown: Array, size: float) -> Array:
    """How far each entry is missed (n,): m, of functions rad or m; of a pose the angle counts by the size."""
    if isinstance(wanted, WantedPath):
        found: Array = np.linalg.norm(shown - wanted.places, axis=1)
        return found
    if isinstance(wanted, WantedFunction):
        off = _difference(shown, wanted.values[:, None], wanted)[:, 0]
        return np.abs(off if wanted.is_absolute else off - off.mean())
    target = np.concatenate([wanted.places, wanted.angles[:, None]], axis=1)
    apart = _difference(shown, target, wanted) * np.array([1.0, 1.0, size])
    missed: Array = np.linalg.norm(apart, axis=1)
    return missed


def repeat_entry(wanted: Wanted, entry: int, many: int) -> Wanted:
    """A path or poses, so many times this entry."""
    assert not isinstance(wanted, WantedFunction)
    places = np.broadcast_to(wanted.places[entry], (many, 2))
    if isinstance(wanted, WantedPath):
        return wanted._replace(places=places)
    return wanted._replace(places=places, angles=np.broadcast_to(wanted.angles[entry], (many,)))


def resting_misses(wanted: Wanted, size: float) -> Array:
    """How far each entry is missed (n,) by one that does not move, where it misses least."""
    if isinstance(wanted, WantedFunction):
        apart: Array = np.abs(wanted.values - wanted.values.mean())
        return apart
    middle = wanted.places.mean(axis=0)
    if not isinstance(wanted, WantedPath):
        middle = np.append(middle, wanted.angles.mean())
    return entry_misses(wanted, np.broadcast_to(middle, (len(wanted.places), len(middle))), size)
