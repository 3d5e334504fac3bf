"""All solutions of one member of a family, followed from those of a random one.

Every linkage of every class is followed, so that a path that jumps to another one is seen: both come to one solution.
What paths do not reach is sought by way of other random members: there, a solution comes from another one of the random
member, and its whole class with it. So what is followed back on that detour, and its class forth again, gives the
linkages that move as one that is known does.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.assemblies.polynomial.path_tracker import (
    MAX_STEPS,
    SINGULAR_TOLERANCE,
    PathEnds,
    is_finite_solution,
    normalize,
    refine_ends,
)
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.model.wording import count_phrase
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.ball_paths import MOST_PATHS, certify_member, follow_in_balls
from planar.synthesis.exact.tracking.generic_store import FamilyRecord
from planar.synthesis.exact.tracking.member_homotopy import MemberHomotopy, affine_solutions, homogeneous_solutions
from planar.synthesis.exact.tracking.monodromy import CLOSER_STEPS, follow
from planar.synthesis.exact.tracking.symmetry import exchange_images, first_of_same, representatives

DETOUR_PRECISION = 1e-5
"""How far predictions may be off."""
UNKNOWN = -1
"""The class of a solution to which paths of several came."""


class ClassedSolutions(NamedTuple):
    """Solutions V of a member, the same order of links for all that are one, with the class of each."""

    V: ComplexArray
    classes: IntArray

    @property
    def known_classes(self) -> IntArray:
        """The classes that are known, each as often as it has solutions."""
        known: IntArray = self.classes[self.classes != UNKNOWN]
        return known

    def merge(self, other: ClassedSolutions) -> ClassedSolutions:
        """With others of the same numbers of classes; a class that is known stays."""
        both, known = np.concatenate([self.V, other.V]), len(self.V)
        first = first_of_same(both)
        classes = np.concatenate([self.classes, other.classes])
        for k, own in enumerate(first.tolist()):
            if k >= known and classes[own] == UNKNOWN:
                classes[own] = classes[k]
        kept = first == np.arange(len(both))
        return ClassedSolutions(both[kept], classes[kept])


def with_members(
    family: Family,
    record: FamilyRecord,
    member: Member,
    found: ClassedSolutions,
    wanted: BoolArray,
    rng: np.random.Generator,
) -> ClassedSolutions:
    """What was found with all linkages of those wanted classes (classes,) of which there is one."""
    images, known = exchange_images(record.name.exchanges), record.solutions
    chosen = [k for k in np.unique(found.classes, return_index=True)[1].tolist() if found.classes[k] != UNKNOWN]
    chosen = [k for k in chosen if wanted[found.classes[k]]]
    if record.classes.shape[1] < 2 or not chosen:
        return found
    between = family.random_member(rng)
    V, rows = _by_way(family, member, found.V[chosen], between, known.member)
    start = representatives(known.V, images)
    own = first_of_same(np.concatenate([start, representatives(V, images)]))[len(start) :]
    class_of = np.empty(len(start), dtype=int)
    class_of[record.classes] = np.arange(len(record.classes))[:, None]
    pairs = [(int(k), chosen[row]) for k, row in zip(own, rows.tolist(), strict=True) if k < len(start)]
    begin = [other for k, _ in pairs for other in record.classes[class_of[k]].tolist() if other != k]
    classes = np.repeat([found.classes[row] for _, row in pairs], record.classes.shape[1] - 1).astype(int)
    gone, rows = _by_way(family, known.member, known.V[begin], between, member)
    return found.merge(ClassedSolutions(representatives(gone, images), classes[rows]))


def with_new_classes(
    family: Family, record: FamilyRecord, member: Member, found: ClassedSolutions, rng: np.random.Generator
) -> ClassedSolutions:
    """What was found with what one of each class of the random member comes to by way of another."""
    begin, between = record.representatives, family.random_member(rng)
    V, _ = _by_way(family, begin.member, begin.V, between, member)
    V = representatives(V, exchange_images(record.name.exchanges))
    first = first_of_same(np.concatenate([found.V, V]))[len(found.V) :]
    new = V[first == len(found.V) + np.arange(len(V))]
    # classes have other numbers there
    return found.merge(ClassedSolutions(new, np.full(len(new), UNKNOWN)))


def _by_way(
    family: Family, begin: Member, V: ComplexArray, between: Member, end: Member
) -> tuple[ComplexArray, IntArray]:
    """Solutions at the end that come by way of another member, and the number of the one that each comes from."""
    there = follow(family, begin, V, between, DETOUR_PRECISION)
    first = np.flatnonzero(there.is_single)
    gone = follow(family, between, there.V[first], end, DETOUR_PRECISION)
    lost = ~gone.is_single
    if lost.any():
        again = follow(family, between, there.V[first[lost]], end, DETOUR_PRECISION, CLOSER_STEPS)
        for whole, part in zip(gone, again, strict=True):
            whole[lost] = part
    return gone.V[gone.is_single], first[gone.is_single]


PRECISION = 1e-4
"""How far predictions may be off."""
CLOSER_PASSES = ((1e-5, MAX_STEPS), (1e-7, CLOSER_STEPS))
"""The same, and how many steps, for paths that are lost or come to one solution: they are followed again with more
digits; by the second where there are too many for balls."""
OTHER_WAYS = 3
"""By way of how many random members linkages that are missing are sought."""
INFINITY = 1e-6
"""Of homogeneous coordinates of length one."""
Progress = Callable[[str], None]


class MemberSolutions(NamedTuple):
    """`x` (solutions, unknowns): those at finite places that count once, and the class of each (solutions,), UNKNOWN
    where paths of several came to it; there are `class_count` classes with so many `members` each.

    `doubtful` are ends of paths where several solutions seem to meet, or that seem to be at infinity
    (`is_doubtful_infinite`), with their classes. `ball_rows`: solutions of the random member whose paths were followed
    in balls.
    """

    x: ComplexArray
    classes: IntArray
    class_count: int
    members: int
    doubtful: ComplexArray
    doubtful_classes: IntArray
    is_doubtful_infinite: BoolArray
    ball_rows: IntArray

    @property
    def found(self) -> int:
        """How many classes have a solution."""
        return len(self._known) if self.members > 1 else len(self.x)

    @property
    def singular(self) -> int:
        """How many classes without one have paths that end where several meet."""
        return min(len(self._singular), self._without_solution)

    @property
    def at_infinity(self) -> int:
        """How many of the rest have paths that end at infinity."""
        infinite = {*self.doubtful_classes.tolist()} - self._known - self._singular
        return min(len(infinite), self._without_solution - self.singular)

    @property
    def lost(self) -> int:
        """How many are left."""
        return self._without_solution - self.singular - self.at_infinity

    @property
    def _without_solution(self) -> int:
        return max(0, self.class_count - self.found)

    @property
    def _known(self) -> set[int]:
        return {*self.classes.tolist()} - {UNKNOWN}

    @property
    def _singular(self) -> set[int]:
        return {*self.doubtful_classes[~self.is_doubtful_infinite].tolist()} - self._known


class _Ends(NamedTuple):
    """Where paths ended (each (paths,)): at single solutions, those to which several came among them; where several
    meet; at infinity; or nowhere. `in_balls`: which were followed in balls."""

    V: ComplexArray
    is_single: BoolArray
    is_shared: BoolArray
    is_singular: BoolArray
    is_infinite: BoolArray
    in_balls: BoolArray


def solve_member(
    family: Family, record: FamilyRecord, member: Member, say: Progress = lambda _: None, seed: int = 3
) -> MemberSolutions:
    """The solutions of a member. Paths that are lost, or come to one solution, are followed more closely, and where
    they are few in balls; what is missing then is sought by other ways."""
    rng = np.random.default_rng(seed)
    many, members = record.classes.shape
    class_of = np.empty(record.classes.size, dtype=int)
    class_of[record.classes] = np.arange(many)[:, None]
    ends = _follow_all(family, record, member, say)
    kept = np.flatnonzero(ends.is_single)
    kept = kept[first_of_same(ends.V[kept]) == np.arange(len(kept))]
    # a solution that several paths came to is one of their classes, and the only one of it where each has one
    is_unknown = ends.is_shared & (members > 1)
    found = ClassedSolutions(ends.V[kept], np.where(is_unknown, UNKNOWN, class_of)[kept])
    doubtful = np.flatnonzero(ends.is_singular | ends.is_infinite)
    settled = class_of[doubtful]
    for _ in range(OTHER_WAYS):
        count = np.bincount(np.concatenate([found.known_classes, settled]), minlength=many)
        if not (count < members).any() or (members == 1 and len(found.V) + len({*settled.tolist()}) >= many):
            break
        if not count.all():
            found = with_new_classes(family, record, member, found, rng)
        found = with_members(family, record, member, found, count < members, rng)
    return MemberSolutions(
        affine_solutions(found.V),
        found.classes,
        many,
        members,
        affine_solutions(ends.V[doubtful]),
        settled,
        ends.is_infinite[doubtful],
        np.flatnonzero(ends.in_balls),
    )


def _follow_all(family: Family, record: FamilyRecord, member: Member, say: Progress) -> _Ends:
    """All solutions of the random member followed to another."""
    images, begin = exchange_images(record.name.exchanges), record.solutions

    def parts(ends: PathEnds) -> tuple[ComplexArray, BoolArray, BoolArray, Array]:
        return representatives(ends.V, images), ends.is_single, ends.is_near_end, ends.regularity

    V, is_single, is_near, regularity = parts(follow(family, begin.member, begin.V, member, PRECISION))
    for near, steps in CLOSER_PASSES:
        again = ~is_single | _is_shared(V, is_single)
        if steps == CLOSER_STEPS:
            again &= is_single | ~is_near  # else it came to the end twice, where several meet
            if is_available() and again.sum() <= MOST_PATHS:
                break
        if not again.any():
            break
        closer = parts(follow(family, begin.member, begin.V[again], member, near, steps))
        take = closer[1] | ~is_single[again]
        better = np.flatnonzero(again)[take]
        for whole, part in zip((V, is_single, is_near, regularity), closer, strict=True):
            whole[better] = part[take]
    in_balls = np.zeros(len(V), dtype=bool)
    while is_available():
        # one that leapt may be seen only where the path that belongs to its solution comes there, too
        again = (_is_shared(V, is_single) | ~(is_single | is_near)) & ~in_balls
        if not 0 < again.sum() <= MOST_PATHS:
            break
        in_balls |= again
        rows, x, infinite = proved_in_balls(family, record, np.flatnonzero(again), member, say)
        V[infinite, 0], is_near[infinite], is_single[infinite] = 0.0, True, False
        # what is proved is at a finite place, however far out
        V[rows], is_single[rows], is_near[rows] = representatives(homogeneous_solutions(x), images), True, True
    finite = is_finite_solution(V, INFINITY)
    is_singular = is_near & finite & ~is_single & (regularity < 1e3 * SINGULAR_TOLERANCE)
    single = is_single & finite
    return _Ends(V, single, _is_shared(V, single), is_singular, is_near & ~finite, in_balls)


def proved_in_balls(
    family: Family, record: FamilyRecord, rows: IntArray, member: Member, say: Progress
) -> tuple[IntArray, ComplexArray, IntArray]:
    """What the paths from those solutions of the random member come to in balls, where that is proved: the number of
    each that does, its solution of the member (solutions, unknowns), and the numbers of those that go to infinity."""
    say(f"{count_phrase(len(rows), 'path')} in balls")
    begin = affine_solutions(record.solutions.V[rows])
    x = follow_in_balls(family, record.solutions.member, begin, member)
    came = np.flatnonzero(np.isfinite(x).all(axis=1))
    proof = certify_member(family, member, x[came])
    return rows[came[proof.proved]], proof.x[proof.proved], rows[np.isinf(x).all(axis=1)]


def is_nearly_singular(family: Family, member: Member, x: ComplexArray) -> BoolArray:
    """Which solutions (solutions, unknowns) lie so near to others, or so far out, that doubles do not tell them."""
    V = normalize(homogeneous_solutions(x))
    ends = refine_ends(MemberHomotopy(family, member, member), V, np.ones(len(x), dtype=bool))
    return (ends.regularity <= SINGULAR_TOLERANCE) | ~is_finite_solution(V, INFINITY)


def _is_shared(V: ComplexArray, among: BoolArray) -> BoolArray:
    """Which solutions among some several paths came to."""
    found = np.zeros(len(V), dtype=bool)
    own = np.flatnonzero(among)
    first = first_of_same(V[own])
    counts = np.bincount(first, minlength=len(own))
    found[own] = counts[first] > 1
    return found
