"""A design judged anew from its written file: by planar.cycle alone, with nothing of what the search knows."""

from __future__ import annotations

import json

import numpy as np

import planar
from benchmarks.synthesis.misses import Array, chord_distances, is_whole_turn, path_of

ROUNDING = 2e-5
"""Of the extent: a place may lie further off than the search says by so much."""
CHORDS = 5400
MOST_TURNS = 8
"""Of the input, where gears let a path close after several only."""


def design_faults(mechanism: planar.Mechanism, point: str, places: Array, told: float, closed: bool) -> list[str]:
    """What is wrong with a design of which a search tells the greatest miss (m): sentences, none where all is well.

    The places (n, 2) are to lie within that of the path of one branch, one after the other, either way round.
    """
    again = planar.from_dict(json.loads(planar.dumps(mechanism)))
    try:
        path = path_of(again, point, CHORDS, MOST_TURNS)
        whole = is_whole_turn(again, planar.cycle(again, 90, pair=again.inputs[0].pair))
    except planar.PlanarError as problem:
        return [f"its file cannot be solved: {problem}"]
    size = float(np.ptp(places, axis=0).max())
    off = chord_distances(path, places)
    allowed = told + ROUNDING * size
    greatest = float(off.min(axis=1).max())
    faults = [] if greatest <= allowed else [f"it misses by {greatest / size:.2%} of the size"]
    if closed and not whole:
        faults.append("it makes no whole turn")
    if not faults and not any(are_in_order(way, allowed, whole) for way in (off, off[::-1])):
        faults.append("it does not meet the places one after the other on one branch")
    return faults


def are_in_order(off: Array, allowed: float, whole: bool) -> bool:
    """Whether places whose distances from chords are known (n, chords) can be met with chords that go forward.

    Where the motion is a whole turn it may begin anywhere.
    """
    near = off <= allowed
    chords = near.shape[1]
    for start in np.flatnonzero(near[0]) if whole else np.zeros(1, int):
        at = 0
        for row in near if start == 0 else np.roll(near, -start, axis=1):
            ahead = np.flatnonzero(row[at:])
            if not len(ahead):
                break
            at += int(ahead[0])
        else:
            return chords > 0
    return False
