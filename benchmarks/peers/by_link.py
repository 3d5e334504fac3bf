"""LInK's published solver, numpy's form of it, from a copy of its repository in the folder that LINK_FOLDER names.

Its licence (CC BY-NC-SA 4.0) keeps it out of here. It takes linkages of dyads as adjacency and places, all with the
same angles of the crank, tells positions alone, and NaN where a dyad does not close; nothing is asked of the way
between.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from benchmarks.entry import Array
from benchmarks.limit import Tape

SYSTEM = "LInK's solver, numpy"
FOLDER = "LINK_FOLDER"
FRAME = 0


def is_there() -> bool:
    """Whether a copy is named."""
    return _source().is_file()


def _source() -> Path:
    return Path(os.environ.get(FOLDER, os.devnull)) / "LInK" / "Solver.py"


def _solver() -> Callable[[Array, Array, Array, Array], Array]:
    """Its function; the libraries that its other forms want stand empty where they are not installed."""
    for name in ("torch", "jax", "jax.numpy"):
        try:
            __import__(name)
        except ImportError:
            sys.modules[name] = ModuleType(name)
            if name == "jax.numpy":
                sys.modules["jax"].numpy = sys.modules[name]  # type: ignore[attr-defined]
    spec = spec_from_file_location("link_solver", _source())
    assert spec is not None and spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.solve_rev_vectorized_batch_CPU


def entry(tape: Tape, places: list[Array], turned: Array) -> tuple[Any, ...]:
    """The system's name, whether it has rates, a call, and how to read a linkage (2 rows of every joint)."""
    solve, many, most = _solver(), len(places), max(map(len, places))
    adjacency, at = np.zeros((many, most, most)), np.zeros((many, most, 2))
    fixed = np.ones((many, most, 1))
    turns = np.zeros(many)
    for k, own in enumerate(places):
        first = tape.first[k]
        turns[k] = np.arctan2(*(own[1] - own[0])[::-1])
        at[k, : len(own)] = _turn(own, -turns[k])
        for joint in range(len(own)):
            fixed[k, joint] = tape.kind[first + joint] == FRAME
            for other in tape.of[first + joint] if joint > 1 and not fixed[k, joint, 0] else ():
                adjacency[k, joint, other] = adjacency[k, other, joint] = 1.0

    def read(found: Array, k: int) -> Array:
        return np.moveaxis(_turn(found[k, : len(places[k])], turns[k]), -1, 1)

    def call() -> Array:
        with np.errstate(all="ignore"):
            return solve(adjacency, at, fixed, turned)

    return SYSTEM, False, call, read


def _turn(points: Array, angle: float) -> Array:
    """Points (..., 2) turned about the origin."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([c * points[..., 0] - s * points[..., 1], s * points[..., 0] + c * points[..., 1]], axis=-1)
