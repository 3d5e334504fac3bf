"""How long the steps of solving a mechanism take on this machine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import numpy as np

from planar.mechanism import Mechanism
from planar.program import Program, structure
from planar.solving.follow import run
from planar.solving.position import Solver

STEPS = 360


@dataclass(frozen=True)
class Speed:
    """Seconds, the best of several rounds each.

    `equations`: file data to equations; `assembly`: from the sketch to a gated assembly; `position`: one position
    with velocities and accelerations, the equations and the assembly being known; `run`: a position of a run of 360
    steps through the gate; `span`: what the first input ran through (rad or m).
    """

    name: str
    links: int
    unknowns: int
    equations: float
    assembly: float
    position: float
    run: float
    span: float

    def record(self) -> dict[str, Any]:
        return asdict(self)


def measure(mechanism: Mechanism, rounds: int = 5) -> Speed:
    """Time a mechanism. Raises NoAnswer where it cannot be solved."""
    from planar.equations import build

    equations = _best(lambda: Program(build(structure(mechanism))), rounds)
    solver = Solver(mechanism)
    z = solver.assembly().z
    assembly = _best(solver.assembly, rounds)
    position = _best(lambda: solver.state(z), 4 * rounds)
    span, inputs = _inputs(solver, z)
    each = _best(lambda: run(solver, solver.station.p, z, inputs), rounds) / STEPS if span else float("nan")
    unknowns = len(solver.equations.unknowns)
    return Speed(mechanism.name, len(mechanism.links), unknowns, equations, assembly, position, each, span)


def _inputs(solver: Solver, z: np.ndarray) -> tuple[float, np.ndarray]:
    """A run of the first input: a whole turn where the linkage makes it, else the half of it that it does, or less."""
    start = solver.station.u
    for halvings in range(8):
        for sign in (1.0, -1.0):
            inputs = np.repeat(start[None], STEPS + 1, axis=0)
            if start.size:
                inputs[:, 0] += sign * 2.0 * np.pi / 2.0**halvings * np.linspace(0.0, 1.0, STEPS + 1)
            if run(solver, solver.station.p, z, inputs).stopped is not None:
                continue
            return sign * 2.0 * np.pi / 2.0**halvings, inputs
    return 0.0, np.empty((0, start.size))


def _best(task: Callable[[], object], rounds: int) -> float:
    times = []
    for _ in range(rounds):
        start = perf_counter()
        task()
        times.append(perf_counter() - start)
    return min(times)
