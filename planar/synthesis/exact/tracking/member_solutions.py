"""All solutions of one member of a family, followed from those of a random one."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.path_tracker import SINGULAR_TOLERANCE, is_finite_solution
from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions
from planar.synthesis.exact.tracking.monodromy import GenericSolutions, first_of_same, follow
from planar.synthesis.exact.tracking.symmetry import Images, representatives

PRECISIONS = (1e-4, 1e-6, 1e-8)
"""How far predictions may be off; paths that are lost are followed again with the next."""
DETOURS = 2
"""Other random members by way of which paths are followed again."""
INFINITY = 1e-6
"""Of homogeneous coordinates of length one."""


class MemberSolutions(NamedTuple):
    """`x` (solutions, unknowns): those at finite places that count once; how many paths were followed, ended where
    several meet or at infinity, and were lost."""

    x: ComplexArray
    followed: int
    singular: int
    at_infinity: int
    lost: int

    @property
    def is_whole(self) -> bool:
        """Whether every path ended at a solution of its own, or was seen to end elsewhere."""
        return self.lost == 0


def solve_member(
    family: Family, known: GenericSolutions, member: Member, images: Images | None, seed: int = 3
) -> MemberSolutions:
    """The solutions of a member. Where paths end singly at places that are few, they are followed by other ways."""
    rng = np.random.default_rng(seed)
    found, best = known.V[:0], None
    begin = known
    for detour in range(DETOURS + 1):
        if detour:
            between = family.random_member(rng)
            ends = follow(family, known.member, known.V, between, PRECISIONS[0])
            begin = GenericSolutions(between, ends.V[ends.is_single])
        told = _followed(family, begin, member, found, images)
        found = told[0]
        if best is None or told[1].lost < best.lost:
            best = told[1]
        finite = len(found)
        if finite >= len(known.V) or (best.is_whole and finite + best.singular + best.at_infinity >= len(known.V)):
            break
    assert best is not None
    is_all = len(found) >= len(known.V)
    lost = 0 if is_all else max(0, min(best.lost, len(known.V) - len(found)))
    return MemberSolutions(
        affine_solutions(found),
        len(known.V),
        0 if is_all else best.singular,
        0 if is_all else best.at_infinity,
        lost,
    )


def _followed(
    family: Family, begin: GenericSolutions, member: Member, found: ComplexArray, images: Images | None
) -> tuple[ComplexArray, MemberSolutions]:
    """What was found before with what paths from a random member come to, and how they ended."""
    ends = follow(family, begin.member, begin.V, member, PRECISIONS[0])
    V, is_single, is_near = ends.V.copy(), ends.is_single.copy(), ends.is_near_end.copy()
    regularity = ends.regularity.copy()
    for near in PRECISIONS[1:]:
        again = ~(is_single & is_near) | _is_shared(V, is_single)
        again &= ~(is_near & ~is_single)  # it came to the end, where several meet
        if not again.any():
            break
        closer = follow(family, begin.member, begin.V[again], member, near)
        V[again], is_single[again], is_near[again] = closer.V, closer.is_single, closer.is_near_end
        regularity[again] = closer.regularity
    finite = is_finite_solution(V, INFINITY)
    single = is_single & finite
    shared = _is_shared(V, single)
    singular = int(np.sum(is_near & finite & ~is_single & (regularity < 1e3 * SINGULAR_TOLERANCE)))
    infinite = int(np.sum(is_near & ~finite))
    both = np.concatenate([found, representatives(V[single], images)])
    kept = both[first_of_same(both) == np.arange(len(both))] if len(both) else both
    lost = len(V) - int(np.sum(single & ~shared)) - len({*first_of_same(V[shared]).tolist()}) - singular - infinite
    return kept, MemberSolutions(affine_solutions(kept), len(V), singular, infinite, max(lost, 0))


def _is_shared(V: ComplexArray, among: BoolArray) -> BoolArray:
    """Which solutions among some several paths came to."""
    found = np.zeros(len(V), dtype=bool)
    own = np.flatnonzero(among)
    first = first_of_same(V[own])
    counts = np.bincount(first, minlength=len(own))
    found[own] = counts[first] > 1
    return found
