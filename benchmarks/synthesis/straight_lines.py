"""Straight lines beside the famous ones: the longest stretch of each that is straight to 0.1 %, and a line as long.

The line is sought by a four-bar with links no longer than the famous one's longest. Both are measured in the same way:
the greatest distance of the path from the line of least distance, in % of its length.
"""

from __future__ import annotations

from time import process_time
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.misses import Array, chord_distances, path_of

STRAIGHT = 0.001
PLACES = 15
FAMOUS = {
    "Watt": ("watt-parallel-motion", "P"),
    "Chebyshev": ("chebyshev-straight-line", "P"),
    "Roberts": ("roberts-straight-line", "P"),
    "Hoeken": ("hoeken-straight-line", "P"),
    "Evans": ("evans-grasshopper", "P"),
}
"""The models and the point that goes straight."""


class LineResult(NamedTuple):
    """The line's length (of the famous linkage's longest link), and both departures in % of the line's length."""

    name: str
    length: float
    famous: float
    own: float | None
    seconds: float
    remarks: tuple[str, ...]


class Line(NamedTuple):
    """A stretch of a path from one place to another (m), and its departure from a straight line (of its length)."""

    start: Array
    end: Array
    departure: float


def longest_line(path: Array, straight: float = STRAIGHT) -> Line:
    """The longest stretch of a path (n, 2) that departs by so much of its length at most.

    >>> longest_line(np.stack([np.linspace(0, 1, 50), np.zeros(50)], axis=1)).departure
    0.0
    """
    best = Line(path[0], path[0], 0.0)
    coarse = path[:: max(len(path) // 120, 1)]
    for first in range(len(coarse) - 2):
        for last in range(len(coarse) - 1, first + 2, -1):
            length = float(np.hypot(*(coarse[last] - coarse[first])))
            if length <= float(np.hypot(*(best.end - best.start))):
                continue
            off = departure(coarse[first : last + 1])
            if off <= straight:
                best = Line(coarse[first], coarse[last], off)
    return best


def departure(stretch: Array) -> float:
    """The departure of a stretch (n, 2) from its line of least squares, of its length; infinite where it turns back."""
    middle = stretch - stretch.mean(axis=0)
    along, across = np.linalg.svd(middle, full_matrices=False)[2]
    way = middle @ along
    if np.abs(np.sum(np.sign(np.diff(way)))) < len(way) - 1:
        return np.inf
    return 0.5 * float(np.ptp(middle @ across)) / float(np.ptp(way))


def line_task(line: Line, longest: float) -> dict[str, Any]:
    """The task of a four-bar for a line, with links up to so long (m)."""
    share = np.linspace(0.0, 1.0, PLACES)[:, None]
    places = ((1.0 - share) * line.start + share * line.end) * 1e3
    within = {f"{link}.length": [0.02 * longest * 1e3, longest * 1e3] for link in ("AB", "BC", "DC")}
    wanted = [{"point": "E", "through": places.tolist(), "in_order": True}]
    units = {"length": "mm", "angle": "deg"}
    return {"planar": 1, "name": "line", "units": units, "start": "four-bar", "wanted": wanted, "within": within}


def measure(name: str) -> LineResult:
    """A famous linkage, and a four-bar for a line as long."""
    model, point = FAMOUS[name]
    famous = planar.load(model)
    line = longest_line(path_of(famous, point, 960))
    length, longest = float(np.hypot(*(line.end - line.start))), longest_link(famous)
    begun = process_time()
    found = planar.synthesise(line_task(line, longest), many=3)
    seconds = process_time() - begun
    own = line_departure(found[0].mechanism, line) if found else None
    remarks = found[0].defects if found else found.remarks
    return LineResult(name, length / longest, 100.0 * line.departure, own, seconds, remarks)


def longest_link(mechanism: planar.Mechanism) -> float:
    """The greatest distance of two points of a link (m)."""
    state = planar.solve(mechanism)
    found = 0.0
    for link in mechanism.links:
        there = np.array([state.point(name).position for name in link.names if name in state.point_names])
        found = max(found, float(np.hypot(*(there[:, None] - there).T).max()))
    return found


def line_departure(mechanism: planar.Mechanism, line: Line) -> float:
    """The greatest distance of a line from the path of the design's file, % of the line's length."""
    path = path_of(planar.loads(planar.dumps(mechanism)), "E")
    share = np.linspace(0.0, 1.0, 200)[:, None]
    places = (1.0 - share) * line.start + share * line.end
    return 100.0 * float(chord_distances(path, places).min(axis=1).max() / np.hypot(*(line.end - line.start)))
