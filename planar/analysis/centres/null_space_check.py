"""The proof of instantaneous centres: the null space of all constraints, nothing eliminated, and two laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.kennedy import Two
from planar.analysis.rate_equations import part
from planar.analysis.rate_ratios import chosen
from planar.results.motion import State
from planar.solving.full_constraints import Constraints, null_space
from planar.solving.position import Solver
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray
AS_ONE = 1e-7
"""Links that move this little against each other, beside the greatest motion, move as one.

On a dead point a position is exact to the root of rounding only.
"""


class Proof(NamedTuple):
    """The worst of three figures over all centres, on homogeneous points with lengths in the mechanism's size.

    `routes`: between the centre and that of the null vector of the whole Jacobian (of each, where the inputs do not
    tell one motion of several). `collinear`: the determinant of the centres of any three links. `velocities`: between
    the velocities that both links have in their centre, beside the greatest. None where nothing can move.
    """

    routes: float | None
    collinear: float
    velocities: float | None


class Ways(NamedTuple):
    """The motions of a position: of every link w times its pole (x, y, 1), in sizes about the middle, (ways, 3).

    One where the inputs tell it, else all that are independent; none where nothing can move. The greatest is of length
    one.
    """

    links: Mapping[str, Array]
    count: int


class Stand(NamedTuple):
    """A position in all coordinates w (coordinates,), and the motions that it allows (coordinates, ways)."""

    setup: Setup
    constraints: Constraints
    w: Array
    free: Array


def stand(state: State) -> Stand:
    """A position in all coordinates, nothing eliminated.

    Where constraints hold all along a motion to second order what they leave free to first order, that is no motion.
    """
    setup = Solver(state.mechanism)
    constraints = Constraints(setup)
    w = setup.coordinates(state.frames, state.own)
    free = null_space(constraints.slope(w)) if w.size else np.zeros((0, 0))
    regular = setup.regular(w[list(setup.equations.unknowns)]) if free.shape[1] > 1 else None
    if regular is not None:
        free = _moving(*regular)
    return Stand(setup, constraints, w, free)


def _moving(solver: Solver, z: Array) -> Array:
    """The motions at unknowns z (coordinates, ways), inputs left aside."""
    y = np.concatenate([z, solver.station.u])
    slope = np.hstack([each[0] for each in solver.program.slopes(z[None], solver.station.u[None], solver.station.p)])
    ways = null_space(slope)
    found = [solver.program.kinematics(y, way, 0.0 * y, solver.station.p).w1 for way in ways.T]
    return np.linalg.qr(np.array(found).T)[0]


def poles(state: State, here: Stand, free: Array, middle: Array, size: float) -> dict[str, Array]:
    """Of every link w times its pole (x, y, 1) for each of some motions (coordinates, ways): (ways, 3)."""
    coordinates = here.setup.equations.coordinates
    moving = {(c.owner, c.part): row for c, row in zip(coordinates, free * here.setup.scale[:, None], strict=True)}
    found, still = {}, np.zeros(free.shape[1])
    for link, frame in state.frames.items():
        vx, vy, turning = (moving.get((link, which), still) for which in ("x", "y", "angle"))
        x, y = (np.array([part(frame.x, 0), part(frame.y, 0)]) - middle) / size
        found[link] = np.stack([turning * x - vy / size, turning * y + vx / size, turning], axis=1)
    return found


def ways(state: State, middle: Array, size: float) -> Ways:
    """The motions by the null space of all constraints in all coordinates, at the rates of the inputs if need be."""
    here = stand(state)
    free = here.free
    names = tuple(given.pair for given in state.mechanism.inputs)
    choice = chosen(free, here.constraints.drive_slope(names, here.w), here.setup.station.u1)
    if choice.way is not None:
        free = choice.way[:, None] if np.any(choice.way) else np.zeros((here.w.size, 0))
    found, count = poles(state, here, free, middle, size), free.shape[1]
    most = np.max([np.linalg.norm(pole, axis=1) for pole in found.values()], axis=0) if count else np.ones(0)
    return Ways({link: pole / most[:, None] for link, pole in found.items()}, count)


def proved(found: Mapping[Two, Array], links: Sequence[str], ways: Ways) -> Proof:
    """The proof of homogeneous centres (3,), each of length one, in sizes about the middle."""
    place = {link: index for index, link in enumerate(links)}
    at = np.full((len(links), len(links), 3), np.nan)
    for two, one in found.items():
        a, b = (place[link] for link in two)
        at[a, b] = at[b, a] = one
    stands = {link: group[0] for group in as_one(links, ways) for link in group}
    threes = [
        [place[link] for link in three]
        for three in combinations(links, 3)
        if len({stands.get(link, link) for link in three}) > 1
    ]
    a, b, c = np.array(threes, dtype=int).reshape(-1, 3).T
    triples = np.stack([at[a, b], at[b, c], at[a, c]], axis=1)
    known = ~np.isnan(triples).any(axis=(1, 2))
    collinear = float(np.abs(np.linalg.det(triples[known])).max(initial=0.0))
    if not ways.count or not found:
        return Proof(None, collinear, None)
    centres = np.array(list(found.values()))[:, None]
    relative = np.array([ways.links[b] - ways.links[a] for a, b in map(tuple, found)])
    lengths = np.linalg.norm(relative, axis=2)
    moving = lengths > AS_ONE
    apart = np.linalg.norm(np.cross(centres, relative), axis=2)
    x, y, w = np.moveaxis(centres, 2, 0)
    mx, my, turning = np.moveaxis(relative, 2, 0)
    velocities = np.hypot(turning * y - my * w, turning * x - mx * w)
    routes = (apart[moving] / lengths[moving]).max(initial=0.0)
    return Proof(float(routes), collinear, float(velocities.max(initial=0.0)))


def as_one(links: Sequence[str], ways: Ways) -> tuple[tuple[str, ...], ...]:
    """Links that move as one here whatever moves, in groups of two or more."""
    groups: list[list[str]] = []
    for link in links:
        for group in groups:
            apart = ways.links[link] - ways.links[group[0]]
            if np.linalg.norm(apart, axis=1).max(initial=0.0) <= AS_ONE:
                group.append(link)
                break
        else:
            groups.append([link])
    return tuple(tuple(group) for group in groups if len(group) > 1)
