"""pylinkage: dyads in order, by its solver that numba compiles; designs through its own batch."""

from __future__ import annotations

import math

import numpy as np
from pylinkage.actuators import Crank
from pylinkage.bridge.solver_conversion import linkage_to_solver_data
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRRDyad
from pylinkage.population._batch_sim import simulate_batch
from pylinkage.simulation import Linkage
from pylinkage.solver.simulation import simulate, simulate_with_kinematics

from benchmarks.entry import Array, Entry
from benchmarks.limit import Tape
from benchmarks.swept import RATES
from benchmarks.swept.base import Swept, crank_pin, dyad_pin, fixed
from benchmarks.swept.six_bars import BELL

SYSTEM = "pylinkage (numba)"
FEW = {False: 2000, True: 500}
"""Its time a position does not change with their number: so many designs at most, without and with rates."""


def entries(swept: Swept, d: Array, theta: Array, many: bool) -> list[Entry]:
    """Positions, and positions with rates, of designs d (dimensions, designs), where it has the dyads for it."""
    if swept.limit not in _SET_UP:
        return []
    template, constraints, positions, asked = _SET_UP[swept.limit](d, theta)
    # its crank turns first and solves then, so that the first position it gives is the second
    steps, turn = len(theta) - 1, float(theta[1] - theta[0])
    crank = np.array([2], dtype=np.int32)
    constraints[:, int(template.constraint_offsets[2]) + 1] = turn
    arrays = (template.joint_types, template.parent_indices, template.constraint_offsets, template.solve_order)
    rates = [np.array([rate]) for rate in RATES]
    several, few = min(d.shape[1], FEW[False]), min(d.shape[1], FEW[True])

    def batch() -> Array:
        return simulate_batch(template, constraints[:several], positions[:several], steps)

    def one() -> Array:
        return simulate(positions[0].copy(), constraints[0], *arrays, steps, 1.0)[None]

    def moving() -> list[tuple[Array, Array, Array]]:
        found = []
        for design in range(few):
            start = positions[design].copy()
            still = np.zeros_like(start), np.zeros_like(start)
            found.append(
                simulate_with_kinematics(start, *still, constraints[design], *arrays, *rates, crank, steps, 1.0)
            )
        return found

    def read(found: Array) -> Array:
        return np.moveaxis(found[:, :, asked], (0, 1, 2), (2, 1, 0))

    def read_moving(found: list[tuple[Array, Array, Array]]) -> Array:
        return np.concatenate([read(np.stack([each[order] for each in found])) for order in range(3)])

    known = np.arange(1, len(theta))
    return [
        Entry(SYSTEM, False, np.arange(several), known, batch if many else one, read),
        Entry(SYSTEM, True, np.arange(few), known, moving, read_moving),
    ]


def _four_bar(d: Array, theta: Array) -> tuple:
    a, b, c, g = d
    B = crank_pin(a, theta[:1, None])
    C = dyad_pin(B, fixed(g, 0.0 * g), b, c)
    A, D = Ground(0.0, 0.0), Ground(1.0, 0.0)
    crank = Crank(A, radius=0.3)
    parts = [A, D, crank, RRRDyad(crank.output, D, 0.8, 0.7)]
    at = [(0.0 * a, 0.0 * a), (g, 0.0 * g), B.p, C.p]
    return _model(parts, (a, 0.0 * a, b, c), at, 3)


def _watt(d: Array, theta: Array) -> tuple:
    a, b, c, g, f, first, second, x, y = d
    B = crank_pin(a, theta[:1, None])
    C = dyad_pin(B, fixed(g, 0.0 * g), b, c)
    co, si = f / c * np.cos(BELL), f / c * np.sin(BELL)
    px, py = C.p[0][0] - g, C.p[1][0]
    F = fixed(g + co * px - si * py, si * px + co * py)
    G = dyad_pin(F, fixed(x, y), first, second)
    A, D, H = Ground(0.0, 0.0), Ground(1.0, 0.0), Ground(2.0, 0.1)
    crank = Crank(A, radius=0.3)
    rocker = RRRDyad(crank.output, D, 0.8, 0.7)
    along = FixedDyad(D, rocker, distance=0.45, angle=BELL)
    parts = [A, D, crank, H, rocker, along, RRRDyad(along, H, 1.05, 0.6)]
    at = [(0.0 * a, 0.0 * a), (g, 0.0 * g), B.p, (x, y), C.p, F.p, G.p]
    return _model(parts, (a, 0.0 * a, b, c, f, 0.0 * a + BELL, first, second), at, 6)


def _quick_return(d: Array, theta: Array) -> tuple:
    """The lever as a point at a fixed distance on the way from its pivot through the crank's pin."""
    r, q, end = d
    B = crank_pin(r, theta[:1, None])
    far = np.hypot(B.p[0], B.p[1] - q)
    pivot, Q = Ground(0.0, 0.0), Ground(0.0, -0.3)
    crank = Crank(pivot, radius=0.15)
    parts = [pivot, Q, crank, FixedDyad(Q, crank.output, distance=0.6, angle=0.0)]
    at = [(0.0 * r, 0.0 * r), (0.0 * r, q), B.p, (end * B.p[0] / far, q + end * (B.p[1] - q) / far)]
    return _model(parts, (r, 0.0 * r, end, 0.0 * r), at, 3)


def _model(parts: list, constraints: tuple[Array, ...], at: list, asked: int) -> tuple:
    template = linkage_to_solver_data(Linkage(parts))
    many = len(constraints[0])
    positions = np.empty((many, len(at), 2))
    for joint, (x, y) in enumerate(at):
        positions[:, joint, 0], positions[:, joint, 1] = np.ravel(x), np.ravel(y)
    if template.n_constraints != len(constraints) or list(template.joint_types).index(template.joint_types[2]) != 2:
        raise RuntimeError("this version of pylinkage orders its numbers in another way")
    return template, np.ascontiguousarray(np.stack(constraints, axis=1)), positions, asked


_SET_UP = {"four_bar": _four_bar, "watt": _watt, "quick_return": _quick_return}


def mixed(tape: Tape, places: list[Array], steps: int) -> list[tuple]:
    """Random linkages of dyads, one after the other: solved, solved with rates, and solved with what building takes."""
    turn = 2.0 * np.pi / steps

    def build() -> list[tuple]:
        return [_build(tape, places, k, turn) for k in range(len(places))]

    built = build()
    rates = [np.array([rate]) for rate in RATES]

    def positions(ready: list) -> list[Array]:
        return [simulate(start.copy(), constraints, *arrays, steps, 1.0) for start, constraints, arrays, _ in ready]

    def moving(ready: list) -> list[tuple[Array, Array, Array]]:
        found = []
        for start, constraints, arrays, crank in ready:
            still = np.zeros_like(start), np.zeros_like(start)
            found.append(
                simulate_with_kinematics(start.copy(), *still, constraints, *arrays, *rates, crank, steps, 1.0)
            )
        return found

    def read(found: list[Array], k: int) -> Array:
        return np.moveaxis(found[k], 0, 2)

    def read_moving(found: list[tuple[Array, Array, Array]], k: int) -> Array:
        return np.concatenate([np.moveaxis(order, 0, 2) for order in found[k]], axis=1)

    return [
        (SYSTEM, False, lambda: positions(built), read, 1),
        (f"{SYSTEM}, with building", False, lambda: positions(build()), read, 1),
        (SYSTEM, True, lambda: moving(built), read_moving, 1),
        (f"{SYSTEM}, with building", True, lambda: moving(build()), read_moving, 1),
    ]


def _build(tape: Tape, places: list[Array], linkage: int, turn: float) -> tuple:
    """One linkage as its solver takes it: places, constraints, structure, its crank's joint."""
    part, parts, crank = slice(tape.first[linkage], tape.first[linkage + 1]), [], 0
    at = places[linkage]
    size = tape.size[part].tolist()
    for joint, (kind, (p, q)) in enumerate(zip(tape.kind[part].tolist(), tape.of[part].tolist(), strict=True)):
        x, y = at[joint].tolist()
        if kind == 0:
            parts.append(Ground(x, y))
        elif kind == 1:
            crank = joint
            parts.append(Crank(parts[p], radius=size[joint][0], angular_velocity=turn))
        else:
            first, second = (parts[k].output if isinstance(parts[k], Crank) else parts[k] for k in (p, q))
            parts.append(RRRDyad(first, second, math.sqrt(size[joint][0]), math.sqrt(size[joint][1])))
    data = linkage_to_solver_data(Linkage(parts))
    constraints = data.constraints.copy()
    constraints[int(data.constraint_offsets[crank]) + 1] = turn
    arrays = (data.joint_types, data.parent_indices, data.constraint_offsets, data.solve_order)
    return np.ascontiguousarray(at), constraints, arrays, np.array([crank], dtype=np.int32)
