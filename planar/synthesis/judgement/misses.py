"""How far entries are missed."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.jets import TURN
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath


def _wrapped(angles: Array) -> Array:
    """Angles by less than half a turn."""
    within: Array = angles - TURN * np.round(angles / TURN)
    return within


def result_differences(wanted: Wanted, shown: Array, other: Array, size: float, turns: bool = True) -> Array:
    """How far results (n, parts) are from others (n,), m or rad: of a pose the angle counts by the size (m).

    `turns` tells whether the values of a function are angles, which are the same a turn apart.
    """
    apart: Array = shown - other
    if isinstance(wanted, WantedFunction):
        return np.abs(_wrapped(apart[:, 0]) if turns else apart[:, 0])
    if not isinstance(wanted, WantedPath):
        apart = np.concatenate([apart[:, :2], size * _wrapped(apart[:, 2:])], axis=1)
    distances: Array = np.linalg.norm(apart, axis=1)
    return distances


def function_zero(wanted: WantedFunction, shown: Array, turns: bool = True) -> float:
    """What results (n, 1) of a function differ by on average from its values; 0 of an absolute one."""
    if wanted.is_absolute:
        return 0.0
    apart = shown[:, 0] - wanted.values
    steps = apart - apart[0]  # the zero may be about half a turn
    return float(apart[0] + np.mean(_wrapped(steps) if turns else steps))


def entry_misses(wanted: Wanted, shown: Array, size: float, zero: float | None = None, *, turns: bool = True) -> Array:
    """How far each entry is missed (n,): m, of functions rad or m; of a pose the angle counts by the size.

    `zero` is where the scale of a function's values begins, that of the results where it is not given.
    """
    if isinstance(wanted, WantedFunction):
        zero = function_zero(wanted, shown, turns) if zero is None else zero
        return result_differences(wanted, shown, wanted.values[:, None] + zero, size, turns)
    return result_differences(wanted, shown, wanted_results(wanted), size)


def wanted_results(wanted: Wanted) -> Array:
    """The results (n, parts) that are wanted: places, poses, or values of a function."""
    if isinstance(wanted, WantedFunction):
        return wanted.values[:, None]
    if isinstance(wanted, WantedPath):
        return wanted.places
    return np.concatenate([wanted.places, wanted.angles[:, None]], axis=1)


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
