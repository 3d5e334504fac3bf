"""The proof of instantaneous centres: the null space of all constraints, nothing eliminated, and two laws."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.analysis.centres.kennedy import LinkPair, cross_products
from planar.analysis.rate_equations import derivative
from planar.analysis.rate_ratios import choose_motion
from planar.foundation.arrays import Array
from planar.model.wording import REST_TOLERANCE
from planar.results.motion import State
from planar.solving.checks import null_space
from planar.solving.full_constraints import FullConstraints
from planar.solving.position import PositionSolver
from planar.solving.prepared_mechanism import PreparedMechanism

AS_ONE_RATIO = 1e-7
"""Links that move this little against each other, beside the greatest motion, move as one on a dead point.

There a position is exact to the root of rounding only; elsewhere see `AllowedMotions.as_one_ratio`.
"""


class CentresProof(NamedTuple):
    """The worst of three figures over all centres, on homogeneous points with lengths in the mechanism's size.

    `routes`: between the centre and that of the null vector of the whole Jacobian (of each, where the inputs do not
    tell one motion of several). `collinear`: the determinant of the centres of any three links. `velocities`: between
    the velocities that both links have in their centre, beside the greatest. None where nothing can move.
    """

    routes: float | None
    collinear: float
    velocities: float | None


class AllowedMotions(NamedTuple):
    """The motions of a position: of every link w times its pole (x, y, 1), in sizes about the middle, (ways, 3).

    One where the inputs tell it, else all that are independent; none where nothing can move. The greatest is of length
    one. `as_one_ratio`: links that move so little against each other, beside the greatest, move as one.
    """

    poles: Mapping[str, Array]
    mobility: int
    as_one_ratio: float


class FullPosition(NamedTuple):
    """A position in all coordinates w (coordinates,), and the motions that it allows (coordinates, ways)."""

    prepared: PreparedMechanism
    constraints: FullConstraints
    w: Array
    motions: Array


def full_position(state: State) -> FullPosition:
    """A position in all coordinates, nothing eliminated.

    Where constraints hold all along a motion to second order what they leave free to first order, that is no motion.
    """
    setup = PositionSolver(state.mechanism)
    constraints = FullConstraints(setup)
    w = setup.coordinates(state.frames, state.own)
    if setup.equations.open_rows:  # what the pairs allow but for their misfits
        return FullPosition(setup, constraints, w, motions_at(setup, w[list(setup.equations.unknowns)]))
    free = null_space(constraints.jacobian(w)) if w.size else np.zeros((0, 0))
    regular = setup.regularized(w[list(setup.equations.unknowns)]) if free.shape[1] > 1 else None
    if regular is not None:
        free = motions_at(*regular)
    return FullPosition(setup, constraints, w, free)


def motions_at(solver: PositionSolver, z: Array) -> Array:
    """The motions at unknowns z (coordinates, ways), inputs left aside."""
    y = np.concatenate([z, solver.inputs.u])
    slope = np.hstack([each[0] for each in solver.functions.jacobians(z[None], solver.inputs.u[None], solver.inputs.p)])
    ways = null_space(slope)
    found = [solver.functions.kinematics(y, way, 0.0 * y, solver.inputs.p).w1 for way in ways.T]
    return np.linalg.qr(np.array(found).T)[0]


def poles_of_motions(
    state: State, position: FullPosition, motions: Array, middle: Array, size: float
) -> dict[str, Array]:
    """Of every link w times its pole (x, y, 1) for each of some motions (coordinates, ways): (ways, 3)."""
    coordinates = position.prepared.equations.coordinates
    moving = {
        (c.owner, c.part): row for c, row in zip(coordinates, motions * position.prepared.scale[:, None], strict=True)
    }
    found, still = {}, np.zeros(motions.shape[1])
    for link, frame in state.frames.items():
        vx, vy, turning = (moving.get((link, which), still) for which in ("x", "y", "angle"))
        x, y = (np.array([derivative(frame.x, 0), derivative(frame.y, 0)]) - middle) / size
        found[link] = np.stack([turning * x - vy / size, turning * y + vx / size, turning], axis=1)
    return found


def allowed_motions(state: State, middle: Array, size: float) -> AllowedMotions:
    """The motions by the null space of all constraints in all coordinates, at the rates of the inputs if need be."""
    here = full_position(state)
    free = here.motions
    names = tuple(given.pair for given in state.mechanism.inputs)
    choice = choose_motion(free, here.constraints.relative_jacobian(names, here.w), here.prepared.inputs.u1)
    if choice.motion is not None:
        free = choice.motion[:, None] if np.any(choice.motion) else np.zeros((here.w.size, 0))
    found, count = poles_of_motions(state, here, free, middle, size), free.shape[1]
    most = np.max([np.linalg.norm(pole, axis=1) for pole in found.values()], axis=0) if count else np.ones(0)
    return AllowedMotions({link: pole / most[:, None] for link, pole in found.items()}, count, _as_one_ratio(here))


def _as_one_ratio(here: FullPosition) -> float:
    """What rounding leaves of no motion at a position: the more, the nearer to a dead point or a change point it is."""
    setup = here.prepared
    strength = setup.block_regularity(here.w[list(setup.equations.unknowns)])
    return min(AS_ONE_RATIO, REST_TOLERANCE / max(float(strength.min(initial=1.0)), REST_TOLERANCE))


def prove_centres(found: Mapping[LinkPair, Array], links: Sequence[str], motions: AllowedMotions) -> CentresProof:
    """The proof of homogeneous centres (3,), each of length one, in sizes about the middle."""
    place = {link: index for index, link in enumerate(links)}
    at = np.full((len(links), len(links), 3), np.nan)
    for two, one in found.items():
        a, b = (place[link] for link in two)
        at[a, b] = at[b, a] = one
    stands = {link: group[0] for group in links_moving_as_one(links, motions) for link in group}
    kinds = np.array([place[stands.get(link, link)] for link in links], dtype=int)
    collinear = 0.0
    for first in range(len(links) - 2):
        known = first + 1 + np.flatnonzero(np.isfinite(at[first, first + 1 :, 2]))
        second, third = (known[index] for index in np.triu_indices(len(known), 1))
        apart = (kinds[second] != kinds[first]) | (kinds[third] != kinds[first])
        second, third = second[apart], third[apart]
        # of three links that are known; what is not a number is passed over
        volumes = np.einsum("ij,ij->i", cross_products(at[first, second], at[second, third]), at[first, third])
        collinear = max(collinear, float(np.nanmax(np.abs(volumes), initial=0.0)))
    if not motions.mobility or not found:
        return CentresProof(None, collinear, None)
    centres = np.array(list(found.values()))[:, None]
    relative = np.array([motions.poles[b] - motions.poles[a] for a, b in map(tuple, found)])
    lengths = np.linalg.norm(relative, axis=2)
    moving = lengths > motions.as_one_ratio
    apart = np.linalg.norm(np.cross(centres, relative), axis=2)
    x, y, w = np.moveaxis(centres, 2, 0)
    mx, my, turning = np.moveaxis(relative, 2, 0)
    velocities = np.hypot(turning * y - my * w, turning * x - mx * w)
    routes = (apart[moving] / lengths[moving]).max(initial=0.0)
    return CentresProof(float(routes), collinear, float(velocities.max(initial=0.0)))


def links_moving_as_one(links: Sequence[str], motions: AllowedMotions) -> tuple[tuple[str, ...], ...]:
    """Links that move as one here whatever moves, in groups of two or more."""
    groups: list[list[str]] = []
    poles = np.array([motions.poles[link] for link in links])
    firsts: list[int] = []
    for index, link in enumerate(links):
        apart = np.linalg.norm(poles[index] - poles[firsts], axis=-1).max(axis=-1, initial=0.0)
        alike = np.flatnonzero(apart <= motions.as_one_ratio)
        if alike.size:
            groups[alike[0]].append(link)
        else:
            groups.append([link])
            firsts.append(index)
    return tuple(tuple(group) for group in groups if len(group) > 1)
