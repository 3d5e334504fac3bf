"""All solutions of one member of a family, followed from those of a random one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.path_tracker import SINGULAR_TOLERANCE, is_finite_solution
from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.generic_store import FamilyRecord
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions
from planar.synthesis.exact.tracking.monodromy import GenericSolutions, first_of_same, follow
from planar.synthesis.exact.tracking.symmetry import Images, exchange_images, representatives

PRECISIONS = (1e-4, 1e-6, 1e-8)
"""How far predictions may be off; paths that are lost are followed again with the next."""
NEARBY_WAYS, OFFSET = 2, 0.1
"""Ways beside the straight one for paths that are lost, and how far off."""
DETOURS = 2
"""Other random members by way of which all paths are followed again."""
INFINITY = 1e-6
"""Of homogeneous coordinates of length one."""


class MemberSolutions(NamedTuple):
    """`x` (solutions, unknowns): those at finite places that count once; how many paths were followed, ended where
    several meet or at infinity, and were lost. `doubtful` are those of `singular` where they ended."""

    x: ComplexArray
    followed: int
    singular: int
    at_infinity: int
    lost: int
    doubtful: ComplexArray

    @property
    def is_whole(self) -> bool:
        """Whether every path ended at a solution of its own, or was seen to end elsewhere."""
        return self.lost == 0


def solve_member(family: Family, record: FamilyRecord, member: Member, seed: int = 3) -> MemberSolutions:
    """The solutions of a member, one of each class. Where paths end singly at places that are few, they are followed
    more closely, from other solutions of their classes, and by other ways."""
    rng = np.random.default_rng(seed)
    images = exchange_images(record.name.exchanges)
    starts = [record.solutions._replace(V=record.solutions.V[own]) for own in record.classes.T]
    found, whole = _followed(family, starts, member, starts[0].V[:0], images)
    if record.classes.shape[1] > 1:
        return whole  # by other ways they would come to others of their classes
    many = len(record.classes)
    for _ in range(DETOURS):
        if len(found) >= many or whole.is_whole:
            break
        between = family.random_member(rng)
        ends = follow(family, record.solutions.member, record.solutions.V, between, PRECISIONS[0])
        begin = [GenericSolutions(between, ends.V[ends.is_single])]
        found, other = _followed(family, begin, member, found, images)
        whole = min(whole, other, key=lambda each: each.lost)._replace(x=affine_solutions(found))
    if len(found) >= many:
        whole = whole._replace(singular=0, at_infinity=0, lost=0, doubtful=whole.doubtful[:0])
    return whole._replace(followed=many, lost=min(whole.lost, max(0, many - len(found))))


def _followed(
    family: Family, starts: Sequence[GenericSolutions], member: Member, found: ComplexArray, images: Images
) -> tuple[ComplexArray, MemberSolutions]:
    """What was found before with what paths from a random member come to, and how they ended; `starts` after the first
    have others of the same classes, in the same order."""
    begin = starts[0]
    ends = follow(family, begin.member, begin.V, member, PRECISIONS[0])
    V, is_single, is_near = ends.V.copy(), ends.is_single.copy(), ends.is_near_end.copy()
    regularity = ends.regularity.copy()
    rng = np.random.default_rng(4)
    ways = [(each, near, False) for near in PRECISIONS[1:] for each in starts]
    ways += [(begin, PRECISIONS[1], True)] * NEARBY_WAYS
    for number, (from_, near, is_beside) in enumerate(ways):
        again = ~(is_single & is_near) | _is_shared(V, is_single)
        if number >= len(starts):
            again &= ~(is_near & ~is_single)  # it came to the end more than once, where several meet
        if not again.any():
            break
        beginning, start = from_.V[again], from_.member
        if is_beside:  # round what is in the way, which seldom leads elsewhere
            beside = _member_beside(family, start.towards(member, 0.5), rng)
            beginning, start = follow(family, start, beginning, beside, near).V, beside
        closer = follow(family, start, beginning, member, near)
        better = np.flatnonzero(again)[closer.is_single | ~is_single[again]]
        take = closer.is_single | ~is_single[again]
        V[better], is_single[better], is_near[better] = closer.V[take], closer.is_single[take], closer.is_near_end[take]
        regularity[better] = closer.regularity[take]
    finite = is_finite_solution(V, INFINITY)
    single = is_single & finite
    shared = _is_shared(V, single)
    is_singular = is_near & finite & ~is_single & (regularity < 1e3 * SINGULAR_TOLERANCE)
    singular = int(np.sum(is_singular))
    infinite = int(np.sum(is_near & ~finite))
    both = np.concatenate([found, representatives(V[single], images)])
    kept = both[first_of_same(both) == np.arange(len(both))] if len(both) else both
    lost = len(V) - int(np.sum(single & ~shared)) - len({*first_of_same(V[shared]).tolist()}) - singular - infinite
    doubtful = affine_solutions(V[is_singular])
    return kept, MemberSolutions(affine_solutions(kept), len(V), singular, infinite, max(lost, 0), doubtful)


def _member_beside(family: Family, member: Member, rng: np.random.Generator) -> Member:
    """A member a little off one."""
    other = family.random_member(rng)
    return Member(tuple(a + OFFSET * b for a, b in zip(member.parts, other.parts, strict=True)))


def _is_shared(V: ComplexArray, among: BoolArray) -> BoolArray:
    """Which solutions among some several paths came to."""
    found = np.zeros(len(V), dtype=bool)
    own = np.flatnonzero(among)
    first = first_of_same(V[own])
    counts = np.bincount(first, minlength=len(own))
    found[own] = counts[first] > 1
    return found
