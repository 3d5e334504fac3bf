"""Tasks that are known to be possible: places of a point of a random linkage, rounded to 1 % of their size.

The search is given another linkage of the same structure, of other random dimensions.
"""

from __future__ import annotations

from time import process_time
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.judged import design_faults
from benchmarks.synthesis.misses import Array, is_whole_turn, path_of
from benchmarks.synthesis.random_makers import Structure, random_structure

KINDS = {"four": 4, "six": 6, "eight": 8}
POINT = "wanted"
ROUNDED = 0.01
"""Of the greater side of the places' bounding box."""
ALLOWED = 0.015
FEWEST, MOST = 10, 20
"""Places."""
SHORTEST = 0.15
"""A path is at least so long on each side beside the mechanism's frame of joints, or it is no task."""


class RandomTask(NamedTuple):
    """A task as a file's value, with its wanted places (n, 2) in m."""

    structure: str
    value: dict[str, Any]
    places: Array
    closed: bool


def random_task(kind: str, seed: int) -> RandomTask:
    """The task of a kind and seed."""
    rng = np.random.default_rng([KINDS[kind], seed])
    while True:
        structure = random_structure(KINDS[kind], rng)
        own, other = (int(each) for each in rng.choice(10_000, 2, replace=False))
        try:
            maker = with_point(structure.linkage(own), structure.carrier, rng)
            start = structure.linkage(other)
            start_path = path_of(with_point(start, structure.carrier, rng), POINT, 90)
            places, closed = _places(maker, rng)
        except planar.PlanarError:
            continue
        if len(places) >= FEWEST and np.ptp(start_path, axis=0).max() > 0.0:
            return RandomTask(structure.name, _value(kind, seed, start, structure, places, closed), places, closed)


def with_point(mechanism: planar.Mechanism, link: str, rng: np.random.Generator) -> planar.Mechanism:
    """The mechanism with a point at random about those of one of its links."""
    value = planar.to_dict(mechanism)
    own = next(each for each in mechanism.links if each.name == link)
    scale = _reach(mechanism, own.names)
    at = rng.uniform(-1.0, 1.0, 2) * scale
    points = dict(value["links"][link].get("points", {}))
    value["links"][link]["points"] = points | {POINT: [f"{float(each)} m" for each in at]}
    return planar.from_dict(value)


def _reach(mechanism: planar.Mechanism, points: tuple[str, ...]) -> float:
    state = planar.solve(mechanism)
    there = np.array([state.point(name).position for name in points])
    every = np.array([state.point(name).position for name in state.point_names])
    return float(np.hypot(*np.ptp(there, axis=0))) or 0.5 * float(np.hypot(*np.ptp(every, axis=0)))


def _places(maker: planar.Mechanism, rng: np.random.Generator) -> tuple[Array, bool]:
    """Places (n, 2) at equal ways along a good part of the path, rounded; and whether they go round it all."""
    path = path_of(maker, POINT)
    size = float(np.ptp(path, axis=0).max())
    state = planar.solve(maker)
    every = np.array([state.point(name).position for name in state.point_names if name != POINT])
    if size < SHORTEST * float(np.ptp(every, axis=0).max()):
        return np.empty((0, 2)), False
    whole = is_whole_turn(maker, planar.cycle(maker, 90, pair=maker.inputs[0].pair))
    closes = whole and bool(np.hypot(*(path[-1] - path[0])) < 1e-6 * size)
    closed = closes and bool(rng.random() < 0.5)
    many = int(rng.integers(FEWEST, MOST + 1))
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    share = 1.0 if closed else float(rng.uniform(0.5, 0.9))
    first = float(rng.uniform(0.0, 1.0 - share)) if not closed else 0.0
    along = (first + share * np.linspace(0.0, 1.0, many, endpoint=not closed)) * way[-1]
    places = np.stack([np.interp(along, way, path[:, k]) for k in range(2)], axis=1)
    grid = ROUNDED * float(np.ptp(places, axis=0).max())
    return np.round(places / grid) * grid, closed


def _value(
    kind: str, seed: int, start: planar.Mechanism, structure: Structure, places: Array, closed: bool
) -> dict[str, Any]:
    through = [[f"{x} m", f"{y} m"] for x, y in places.tolist()]
    wanted = {"point": POINT, "on": structure.carrier, "through": through, "in_order": True}
    if closed:
        wanted["closed"] = True
    return {
        "planar": 1,
        "name": f"{kind} {seed}",
        "units": {"length": "mm", "angle": "deg"},
        "start": planar.to_dict(start),
        "wanted": [wanted],
    }


def measure(kind: str, seed: int) -> dict[str, Any]:
    """What the search makes of a task: its best design's misses beside the size, time, and faults found anew."""
    task = random_task(kind, seed)
    size = float(np.ptp(task.places, axis=0).max())
    begun = process_time()
    try:
        found = planar.synthesise(task.value, many=3)
    except planar.PlanarError as problem:
        return _record(kind, seed, task, process_time() - begun) | {"refused": str(problem)}
    record = _record(kind, seed, task, process_time() - begun)
    if not found:
        return record | {
            "remarks": list(found.remarks),
            "rejected": [list(each.defects) for each in found.rejected[:3]],
        }
    best = min(found, key=lambda each: each.greatest_miss)
    faults = [design_faults(each.mechanism, POINT, task.places, each.greatest_miss, task.closed) for each in found]
    return record | {
        "greatest": best.greatest_miss / size,
        "rms": best.error / size,
        "designs": len(found),
        "faults": faults,
    }


def _record(kind: str, seed: int, task: RandomTask, seconds: float) -> dict[str, Any]:
    told = {"kind": kind, "seed": seed, "structure": task.structure, "places": len(task.places)}
    return told | {"closed": task.closed, "seconds": round(seconds, 2)}


def is_met(record: dict[str, Any]) -> bool:
    """Whether the best design misses by what is allowed at most."""
    return record.get("greatest", np.inf) <= ALLOWED
