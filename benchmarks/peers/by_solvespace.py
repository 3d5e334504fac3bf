"""SolveSpace's solver of constraints: pins and distances, solved again from the last position."""

from __future__ import annotations

import numpy as np
from python_solvespace import ResultFlag, SolverSystem

from benchmarks.entry import Array, Entry
from benchmarks.peers.bodies import Bodies, bodies
from benchmarks.swept.base import Swept

SYSTEM = "SolveSpace"


def entries(swept: Swept, theta: Array) -> list[Entry]:
    """Positions of the file's own design; it has no rates."""
    told = bodies(swept.document())
    system = SolverSystem()
    plane = system.create_2d_base()
    pivot, end, length = told.crank
    pins = {pin: system.add_point_2d(*at, plane) for pin, at in told.pins.items() if pin in told.fixed or pin == end}
    system.set_group(2)
    others = {p: at for p, at in _places(told).items() if p not in pins}
    pins |= {pin: system.add_point_2d(*at, plane) for pin, at in others.items()}
    for first, second, distance in told.distances:
        system.distance(pins[first], pins[second], distance, plane)
    centre = np.array(told.pins[pivot])
    path = (centre + length * np.column_stack([np.cos(theta), np.sin(theta)])).tolist()
    moved, asked = pins[end].params, pins[swept.point].params

    def solve() -> list:
        found = []
        for at in path:
            system.set_params(moved, at)
            found.append(system.params(asked) if system.solve() == ResultFlag.OKAY else (np.nan, np.nan))
        return found

    return [
        Entry(SYSTEM, False, np.arange(1), np.arange(len(theta)), solve, lambda found: np.array(found).T[..., None])
    ]


def _places(told: Bodies) -> dict[str, tuple[float, float]]:
    """All points at the file's position."""
    places = {}
    for point, (body, (x, y)) in told.points.items():
        if body in told.places:
            ox, oy, angle = told.places[body]
            c, s = np.cos(angle), np.sin(angle)
            places[point] = (ox + c * x - s * y, oy + s * x + c * y)
    return places
