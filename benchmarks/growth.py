"""How the time of each step of solving grows with the number of links."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from time import perf_counter

import numpy as np

import planar
from benchmarks import chain
from benchmarks.comparison import error
from benchmarks.timing import best
from benchmarks.ways.trial import CRANK
from planar.equations.functions import EquationFunctions
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.symbolic_equations import build_equations
from planar.solving.continuation.path import follow_samples
from planar.solving.position import PositionSolver
from planar.solving.structure import mechanism_structure

Array = np.ndarray

LINKS = (4, 10, 20, 40)


@dataclass(frozen=True)
class Growth:
    """Seconds of each step for one number of links, and the greatest errors of the last rocker (see `error`).

    `equations`: the mechanism to its equations; `program`: these to the program of a run; `assembly`: the sketch to an
    assembly; `position`: a known assembly to a gated state with its rates; `run`: a position of a gated run of a turn.
    """

    links: int
    equations: float
    program: float
    assembly: float
    position: float
    position_error: float
    run: float
    run_error: float


@dataclass(frozen=True)
class Far:
    """Seconds of the steps for many links, each done once."""

    links: int
    parsing: float
    equations: float
    assembly: float
    position: float
    run: float
    inspection: float


FAR = (100, 400, 1000)
"""Numbers of links."""
FAR_STEPS = 72
"""Of a run."""


def grow_far(links: int) -> Far:
    """Time a long row of four-bars, once."""
    taken = [perf_counter()]

    def done() -> None:
        taken.append(perf_counter())

    mechanism = planar.from_dict(chain.document(links))
    done()
    mechanism_structure(mechanism)
    done()
    solver = PositionSolver(mechanism)
    z = solver.find_assembly().z
    done()
    solver.state(z)
    done()
    planar.cycle(mechanism, FAR_STEPS)
    done()
    planar.inspect(mechanism)
    done()
    return Far(links, *(after - before for before, after in pairwise(taken)))


def grow(links: int) -> Growth:
    """Time a row of four-bars."""
    mechanism = planar.from_dict(chain.document(links))
    solver = PositionSolver(mechanism)
    z, u, p = solver.find_assembly().z, CRANK[:, None], solver.inputs.p
    steps = len(u) - 1
    equations = build_equations(equation_structure(mechanism))
    times = best(
        {
            "equations": lambda: build_equations(equation_structure(mechanism)),
            "program": lambda: EquationFunctions(equations).newton_function,
            "assembly": solver.find_assembly,
            "position": lambda: solver.state(z),
            "run": lambda: follow_samples(solver, p, z, u),
        }
    )
    exact = np.array(chain.motion(np, links, CRANK.astype(np.longdouble)))[..., None]
    rocker = chain.last_rocker(links)
    column = solver.column[rocker, "angle"]
    found = solver.functions.coordinate_function(follow_samples(solver, p, z, u).z.T, u.T, p).full()[column]
    state = solver.state(z).link(rocker)
    rates = np.array([state.angle, state.angular_velocity, state.angular_acceleration])
    return Growth(
        links=links,
        equations=times["equations"],
        program=times["program"],
        assembly=times["assembly"],
        position=times["position"],
        position_error=error(rates[:, None, None], exact[:, :1], [True], exact),
        run=times["run"] / steps,
        run_error=error(found[None, :, None], exact[:1], [True], exact),
    )
