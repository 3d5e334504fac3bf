"""pylinkage's synthesis beside planar's: a four-bar through four and five points, both measured by their paths."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable
from importlib.util import find_spec
from multiprocessing.connection import Connection
from time import process_time
from typing import NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.misses import Array, misses, path_of

TASKS = {
    "four points": np.array([[0.0, 25.0], [52.0, 10.0], [80.0, 4.0], [95.0, -20.0]]),
    "five points": np.array([[0.0, 0.0], [20.0, 12.0], [42.0, 15.0], [63.0, 8.0], [80.0, -6.0]]),
}
LIMIT = 120.0
"""Seconds after which a search is ended."""
TURN_STEPS = 3600
POINT = "E"


class Beside(NamedTuple):
    """Of one system: the greatest miss in % of the extent (none: no design), and processor seconds (or the limit)."""

    task: str
    system: str
    greatest: float | None
    seconds: float
    remark: str = ""


def is_there() -> bool:
    """Whether pylinkage can be imported."""
    return find_spec("pylinkage") is not None


def by_planar(task: str) -> Beside:
    """planar with the model `four-bar`."""
    places = TASKS[task]
    wanted = [{"point": POINT, "through": places.tolist()}]
    value = {"planar": 1, "units": {"length": "mm"}, "start": "four-bar", "wanted": wanted}
    begun = process_time()
    found = planar.synthesise(value, many=1)
    seconds = process_time() - begun
    if not found:
        return Beside(task, "planar", None, seconds)
    path = path_of(planar.loads(planar.dumps(found[0].mechanism)), POINT) * 1e3
    return Beside(task, "planar", misses(path, places).greatest, seconds)


def by_pylinkage(task: str) -> Beside:
    """pylinkage's path_generation, asked for one design, in a process that is ended at the limit."""
    return _in_process(_search, task)


def _in_process(search: Callable[[str, Connection], None], task: str) -> Beside:
    here, there = multiprocessing.get_context("spawn").Pipe()
    process = multiprocessing.get_context("spawn").Process(target=search, args=(task, there))
    process.start()
    found = here.recv() if here.poll(LIMIT) else Beside(task, "pylinkage", None, LIMIT, "not waited for")
    process.terminate()
    process.join()
    return found


def _search(task: str, there: Connection) -> None:
    from pylinkage.synthesis import path_generation

    places = TASKS[task]
    begun = process_time()
    found = path_generation([tuple(each) for each in places.tolist()], max_solutions=1)
    seconds = process_time() - begun
    if not found.solutions:
        there.send(Beside(task, "pylinkage", None, seconds, "no design"))
        return
    there.send(Beside(task, "pylinkage", misses(_path(found.solutions[0]), places).greatest, seconds))


def _path(linkage: object) -> Array:
    """The path of its last joint over a turn of its crank."""
    steps = linkage.step(iterations=TURN_STEPS)  # type: ignore[attr-defined]
    path = np.array([joints[-1] for joints in steps], float)
    return path[np.isfinite(path).all(axis=1)]
