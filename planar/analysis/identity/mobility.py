"""How many ways a mechanism can move: by count, here, and in general; and where pairs hold more than they need to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.foundation.arrays import Array
from planar.model.link_graph import pairs_farthest_first
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase, join_all_names
from planar.solving.assembly.nearest_assembly import Assembly, AssemblySearchFailure
from planar.solving.checks import null_space, rank
from planar.solving.full_constraints import (
    FullConstraints,
    find_closed_position,
    motion_dimension,
    smallest_dependent_sets,
)
from planar.solving.position import PositionSolver, SolvedMechanism, solved_mechanism


@dataclass(frozen=True)
class Mobility:
    """The three mobilities of a mechanism, inputs left aside.

    `gruebler`: 3 (links - 1) less what the pairs hold, by count (Gruebler, Kutzbach); `instantaneous`: by the rank of
    the constraints in this position; `finite`: the dimension of the motion that leads away from it. `surplus`
    constraints of the motion follow from the others; each of `redundant` is a smallest set of pairs of which one
    constraint is superfluous. `why` says in sentences where the three differ.
    """

    gruebler: int
    instantaneous: int
    finite: int
    surplus: int
    redundant: tuple[tuple[str, ...], ...]
    why: tuple[str, ...]


@takes_mechanism
def mobility(mechanism: Mechanism) -> Mobility:
    """The mobility of a mechanism in the position of its file. Raises NoAnswer where it cannot be assembled.

    >>> import planar
    >>> planar.mobility(planar.load("four-bar")).finite
    1
    """
    known = solved_mechanism(mechanism)
    setup = known.plain_solver
    if setup.equations.open_rows:
        return _mobility_of_least_misfit(setup)
    constraints = FullConstraints(setup)
    w, inputs = closed_position(known, constraints), len(mechanism.inputs)
    if inputs == gruebler(mechanism) > 0 and setup.functions.is_square:
        z = w[list(setup.equations.unknowns)]
        if setup.max_residual(z, setup.inputs.u) <= setup.tolerance and setup.is_surely_regular(z):
            return Mobility(inputs, inputs, inputs, 0, (), ())  # all is determined, and nothing held twice
    return mobility_at(constraints, w)


def _mobility_of_least_misfit(solver: PositionSolver) -> Mobility:
    """The mobility of the motion of least misfit: that of lengths which agree."""
    z, u = solver.find_assembly().z, solver.inputs.u
    slopes = solver.functions.jacobians(z[None], u[None], solver.inputs.p)
    finite, count = null_space(np.hstack([each[0] for each in slopes])).shape[1], gruebler(solver.mechanism)
    surplus = max(0, finite - count)
    told = (
        f"{count_phrase(surplus, 'constraint')} of the pairs would follow from the others if the lengths agreed; they "
        "are met within the misfit"
    )
    return Mobility(count, finite, finite, surplus, (), (told,) if surplus else ())


def gruebler(mechanism: Mechanism) -> int:
    """3 (links - 1) less what the pairs hold: three for each link that moves, none for what is held twice.

    M. Gruebler 1883, K. Kutzbach 1929; two for a lower pair in the plane, one for a higher one.
    """
    return 3 * (len(mechanism.links) - 1) - sum(pair.prevented_motion_count() for pair in mechanism.pairs)


def mobility_at(constraints: FullConstraints, w: Array) -> Mobility:
    """The mobility at a position w (coordinates,)."""
    mechanism = constraints.setup.mechanism
    count = gruebler(mechanism)
    slope = constraints.jacobian(w)
    here = w.size - rank(slope)
    finite, place = here, w
    if here != count:
        finite, place = motion_dimension(constraints, w)
    left = null_space(constraints.jacobian(place).T)
    surplus = max(0, finite - count)
    everywhere = finite < null_space(constraints.jacobian(place)).shape[1]
    sets: tuple[tuple[str, ...], ...] = ()
    if surplus and left.shape[1] == surplus:
        sets = smallest_dependent_sets(
            left, constraints.pair_of_row, lambda name: pairs_farthest_first(mechanism, name)
        )
    return Mobility(
        count, here, finite, surplus, sets, tuple(_explain_differences(count, here, finite, sets, everywhere))
    )


def closed_position(known: SolvedMechanism, constraints: FullConstraints) -> Array:
    """A closed position w of a mechanism, the one of its inputs if they determine one. Raises NoAnswer."""
    solver, nearest = known.plain_solver, known.nearest
    if isinstance(nearest, Assembly):
        return solver.functions.coordinates(nearest.z, solver.inputs.u, solver.inputs.p)
    found = find_closed_position(constraints)
    if found is None:
        raise solver.unassembled(nearest) if isinstance(nearest, AssemblySearchFailure) else nearest
    return found


def _explain_differences(
    count: int, here: int, finite: int, sets: tuple[tuple[str, ...], ...], everywhere: bool
) -> list[str]:
    told = []
    if here > finite and finite and everywhere:
        told.append(
            f"in every position of the motion the pairs allow {count_phrase(here - finite, 'more way')}, but "
            "to first order "
            f"only: to second order they hold it, so that a little play lets it move far"
        )
    elif here > finite:
        what = "nothing moves on from here" if finite == 0 else "branches of the motion cross here, or it turns back"
        told.append(
            f"in this position the pairs allow {count_phrase(here - finite, 'more way')}, but to first order "
            f"only: {what}"
        )
    if finite > count:
        follows = "follows" if finite - count == 1 else "follow"
        told.append(
            f"{count_phrase(finite - count, 'constraint')} of the pairs {follows} from the others, so the "
            "links move in "
            f"{count_phrase(finite, 'way')} where the count gives {count}"
        )
        told += [
            f"of the pairs {join_all_names([repr(name) for name in each])} one holds what the others hold"
            for each in sets
        ]
    if finite < count:
        told.append(
            f"the count gives {count}, but from here the links move in {count_phrase(finite, 'way')}: their "
            "dimensions only "
            f"just allow this position, or some of them hold others fast while the rest is freer"
        )
    return told
