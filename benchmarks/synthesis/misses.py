"""By how much a path misses places: the one metric in which all linkages of this benchmark are compared.

The miss of a place is its distance from the path, which may be met anywhere; what is stated is the root mean square of
the misses and the greatest, both in % of the diagonal of the places' bounding box.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import planar
from planar.foundation.jets import TURN
from planar.solving.input_grid import motion_over_input

Array = np.ndarray

STEPS = 3600
"""Of a path: its chords are off a smooth one by 4e-7 of its extent or so."""
WHOLE = 1e-9
CLOSES = 1e-7
"""Of the path's extent: after a turn that ends so near its beginning it repeats itself."""
ON_END = 1e-5
"""Of the range: beside a dead point no position of the input is asked for but that of the end itself."""


class Misses(NamedTuple):
    """Of places (n, 2) from a path: root mean square and greatest, in % of the places' extent."""

    rms: float
    greatest: float


def extent(places: Array) -> float:
    """The diagonal of the bounding box of places (n, 2)."""
    return float(np.hypot(*np.ptp(places, axis=0)))


def path_of(mechanism: planar.Mechanism, point: str, steps: int = STEPS, most_turns: int = 1) -> Array:
    """The path (n, 2) of a point over all of the motion that the first input makes, from end to end on one branch.

    So many positions stand at equal ways along it, where it is fast beside the input, too; half as many are even in the
    input, for its cusps. Where gears let it close after several turns only, it is followed over so many at most.
    """
    running = mechanism.inputs[0].pair
    motion = planar.cycle(mechanism, steps // 2, pair=running)
    given, path = motion.inputs[running].position, np.asarray(motion.point(point).position)
    ends = None
    if is_whole_turn(mechanism, motion):
        if most_turns > 1 and np.hypot(*(path[-1] - path[0])) > CLOSES * np.ptp(path, axis=0).max():
            given = _over_turns(mechanism, motion, most_turns)
            path = np.asarray(motion_over_input(mechanism, given).point(point).position)
    else:  # close at both ends, which are dead points
        low, high = float(given.min()), float(given.max())
        inner = 0.5 - (0.5 - ON_END) * np.cos(np.linspace(0.0, np.pi, steps // 2 + 1))
        ends, given = path[[0, -1]] if given[-1] > given[0] else path[[-1, 0]], low + (high - low) * inner
        path = np.asarray(motion_over_input(mechanism, given).point(point).position)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    if way[-1] == 0.0:
        return path
    fast = np.interp(np.linspace(0.0, way[-1], steps + 1)[1:-1], way, given)
    every = np.unique(np.concatenate([given, fast]))
    found = np.asarray(motion_over_input(mechanism, every).point(point).position)
    return found if ends is None else np.concatenate([ends[:1], found, ends[1:]])


def _over_turns(mechanism: planar.Mechanism, motion: planar.Motion, most: int) -> Array:
    """Positions of the first input over so many turns, those of a motion of one among them, as far as it goes each way.

    What gears hold together may have dead points in a later turn only.
    """
    given = motion.inputs[mechanism.inputs[0].pair].position
    first, last, step = float(given.min()), float(given.max()), TURN / (len(given) - 1)
    for way in (1.0, -1.0):
        stride = TURN
        while stride > 1e-4 * TURN and last - first < most * TURN:
            ends = (first, last + stride) if way > 0.0 else (first - stride, last)
            try:
                motion_over_input(mechanism, np.linspace(*ends, round((ends[1] - ends[0]) / step) + 1))
            except planar.PlanarError:
                stride *= 0.5
            else:
                first, last = ends
    return np.linspace(first, last, round((last - first) / step) + 1)


def is_whole_turn(mechanism: planar.Mechanism, motion: planar.Motion) -> bool:
    """Whether the first input of a motion makes a whole turn: between dead points it may go further than one."""
    running = mechanism.inputs[0].pair
    turns = not any(isinstance(pair, planar.SlidingPair) and pair.name == running for pair in mechanism.pairs)
    return turns and abs(float(np.ptp(motion.inputs[running].position)) - TURN) < TURN * WHOLE


def distances(path: Array, places: Array) -> Array:
    """How far places (n, 2) are from a path of straight chords (m, 2): (n,), and (n, chords) for each chord."""
    return chord_distances(path, places).min(axis=1)


def chord_distances(path: Array, places: Array) -> Array:
    """How far each of places (n, 2) is from each chord of a path (m, 2): (n, m - 1)."""
    first, along = path[:-1], np.diff(path, axis=0)
    squares = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    apart = places[:, None] - first
    share = np.clip(np.sum(apart * along, axis=2) / squares, 0.0, 1.0)
    return np.linalg.norm(apart - share[..., None] * along, axis=2)


def misses(path: Array, places: Array) -> Misses:
    """Of places (n, 2) from a path (m, 2)."""
    off = distances(path, places) / extent(places) * 100.0
    return Misses(float(np.sqrt(np.mean(off**2))), float(off.max()))
