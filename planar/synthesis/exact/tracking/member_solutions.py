"""All solutions of one member of a family, followed from those of a random one, and what is proved of them.

Every linkage of every class is followed, so that a path that jumps to another one is seen: both come to one solution.
What paths do not reach is sought by way of other random members: there, a solution comes from another one of the random
member, and its whole class with it. So what is followed back on that detour, and its class forth again, gives the
linkages that move as one that is known does.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.assemblies.polynomial.path_tracker import (
    MAX_STEPS,
    SAME_SOLUTION_DISTANCE,
    SINGULAR_TOLERANCE,
    PathEnds,
    is_finite_solution,
    normalize,
    refine_ends,
)
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.model.wording import count_phrase
from planar.synthesis.exact.relations.exact_problem import Component
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.ball_paths import (
    FARTHEST,
    MOST_PATHS,
    ExactCertificates,
    certify_member,
    follow_in_balls,
)
from planar.synthesis.exact.tracking.family_names import FamilyName
from planar.synthesis.exact.tracking.generic_solutions import (
    CLOSER_STEPS,
    FamilyRecord,
    family_record,
    follow,
    tested_record,
)
from planar.synthesis.exact.tracking.member_homotopy import (
    MemberHomotopy,
    affine_solutions,
    bilinear_roots,
    exchange_images,
    first_of_same,
    homogeneous_solutions,
    representatives,
)

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
LAST_PART = 1e-5
"""Of the way: what balls follow of paths that doubles followed to an end where no solution is."""
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
    family: Family, record: FamilyRecord, rows: IntArray, member: Member, say: Progress, left: float = 1.0
) -> tuple[IntArray, ComplexArray, IntArray]:
    """What the paths from those solutions of the random member come to in balls, where that is proved: the number of
    each that does, its solution of the member (solutions, unknowns), and the numbers of those that go to infinity.

    Doubles follow them until only so much of the way is `left`.
    """
    say(f"{count_phrase(len(rows), 'path')} in balls")
    V, start = record.solutions.V[rows], record.solutions.member
    if left < 1.0:
        there = follow(family, start, V, start.towards(member, 1.0 - left), DETOUR_PRECISION, CLOSER_STEPS)
        V, rows = there.V[there.is_single], rows[there.is_single]
    x = follow_in_balls(family, start, affine_solutions(V), member, left)
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


REAL = 1e-7
"""Of a solution's size: one that differs from its own conjugate by less is real."""
FAR = 1e4
"""Sizes of the task: what is farther out is nearly at infinity."""


class ComponentSolutions(NamedTuple):
    """The real solutions x (solutions, unknowns) of a component, whether each is proved, and what is known of all."""

    component: Component
    record: FamilyRecord
    whole: MemberSolutions
    x: ComplexArray
    proved: BoolArray
    all_proved: int
    missing: int
    "of classes of real ones, linkages that were not reached"
    nearly_singular: int
    "how many solutions lie so near to others, or so far out, that doubles do not tell them"

    @property
    def far_count(self) -> int:
        """How many real ones are nearly at infinity."""
        return int((np.abs(self.x).max(axis=1, initial=0.0) > FAR).sum())


def solve_components(components: Sequence[Component], say: Progress) -> list[ComponentSolutions]:
    """The solutions of each component; those that are the same member of a family are solved once."""
    known: dict[tuple[str, bytes], ComponentSolutions] = {}
    solved = []
    for component in components:
        record = family_record(component.family, lambda many: say(f"{many} solutions of a random task"))
        key = _member_key(record.name, component.member)
        if key not in known:
            known[key] = _solve(component, record, say)
        solved.append(_in_order(known[key], record)._replace(component=component))
    return solved


def _in_order(solved: ComponentSolutions, record: FamilyRecord) -> ComponentSolutions:
    """Solutions of a member with their unknowns in the order of a family of the same name."""
    half = len(record.name.unknowns)
    order = np.empty(2 * half, dtype=int)
    for k, own in zip(record.name.unknowns, solved.record.name.unknowns, strict=True):
        order[[k, half + k]] = own, half + own
    whole = solved.whole._replace(x=solved.whole.x[:, order], doubtful=solved.whole.doubtful[:, order])
    return solved._replace(record=record, whole=whole, x=solved.x[:, order])


def with_tested_records(solved: Sequence[ComponentSolutions], say: Progress) -> list[ComponentSolutions]:
    """The same after the trace tests of their families; solved again where a test shows that some were missing."""
    records: dict[str, FamilyRecord] = {}
    tested = []
    for solution in solved:
        record = solution.record
        if not record.is_tested:
            if record.name.text not in records:
                say(f"trace test of {count_phrase(len(record.solutions.V), 'solution')} of a random task")
                records[record.name.text] = tested_record(solution.component.family, record)
            record = family_record(solution.component.family)
        has_more = len(record.solutions.V) > len(solution.record.solutions.V)
        tested.append(_solve(solution.component, record, say) if has_more else solution._replace(record=record))
    return tested


def _solve(component: Component, record: FamilyRecord, say: Progress) -> ComponentSolutions:
    whole = _member_solutions(component, record, say)
    if is_available():
        whole = with_ball_paths(component, record, with_doubtful(component, record, whole), say)
    proved = np.zeros(len(whole.x), dtype=bool)
    x, is_real = whole.x, _is_real(whole.x)
    all_proved = 0
    if is_available() and len(x):
        say(f"{count_phrase(len(x), 'solution')} to be certified")
        proof = certify_member(component.family, component.member, x)
        # far ones that the file's own numbers do not have are at infinity: doubles are other numbers
        goes = ~proof.proved & (np.abs(x).max(axis=1) > FAR)
        whole = _with_infinite(whole, x[goes], whole.classes[goes])
        whole = whole._replace(x=x[~goes], classes=whole.classes[~goes])
        proof = ExactCertificates(*(part[~goes] for part in proof))
        x, is_real = proof.x, is_real[~goes]
        proved, all_proved = proof.proved & proof.is_real, int(proof.proved.sum())
        is_real = np.where(proof.proved, proof.is_real, is_real)
    wanted = whole.members * len({*whole.classes[is_real].tolist()} - {UNKNOWN})
    missing = max(0, wanted - int(is_real.sum()))
    near = int(is_nearly_singular(component.family, component.member, x).sum())
    return ComponentSolutions(component, record, whole, x[is_real], proved[is_real], all_proved, missing, near)


def _member_solutions(component: Component, record: FamilyRecord, say: Progress) -> MemberSolutions:
    """All solutions, in closed form where there is one, else followed from those of a random member."""
    count, members = record.classes.shape
    x = bilinear_roots(component.family, component.member, count) if members == 1 else None
    if x is not None:
        none = np.zeros(0, dtype=int)
        return MemberSolutions(x, np.arange(count), count, 1, x[:0], none, none.astype(bool), none)
    say(f"{count_phrase(record.classes.size, 'path')}")
    return solve_member(component.family, record, component.member, say)


def with_doubtful(component: Component, record: FamilyRecord, whole: MemberSolutions) -> MemberSolutions:
    """With ends that only look as if several met there, or as if they were at infinity, which balls of more digits tell
    from such."""
    near = np.flatnonzero(np.abs(whole.doubtful).max(axis=1, initial=0.0) < FARTHEST)
    proof = certify_member(component.family, component.member, whole.doubtful[near])
    return _with_new(record, whole, proof.x[proof.proved], whole.doubtful_classes[near[proof.proved]])


def with_ball_paths(
    component: Component, record: FamilyRecord, whole: MemberSolutions, say: Progress
) -> MemberSolutions:
    """With what the paths of classes that have no solution, or only some of real ones, come to in balls, where they are
    few and were not followed so before."""
    many, members = record.classes.shape
    count = np.bincount(whole.classes[whole.classes != UNKNOWN], minlength=many)
    open_classes = count < np.where(np.isin(np.arange(many), whole.classes[_is_real(whole.x)]), members, 1)
    class_of = {row: k for k in np.flatnonzero(open_classes).tolist() for row in record.classes[k].tolist()}
    rows = np.setdiff1d(record.classes[open_classes], whole.ball_rows)
    if (whole.members == 1 and whole.found >= many) or not 0 < len(rows) <= MOST_PATHS:
        return whole
    own, x, infinite = proved_in_balls(component.family, record, rows, component.member, say, LAST_PART)
    infinite_classes = np.array([class_of[k] for k in infinite.tolist()], dtype=int)
    whole = _with_infinite(whole, np.full((len(infinite), whole.x.shape[1]), np.inf, dtype=complex), infinite_classes)
    return _with_new(record, whole, x, np.array([class_of[k] for k in own.tolist()], dtype=int))


def _with_infinite(whole: MemberSolutions, x: ComplexArray, classes: IntArray) -> MemberSolutions:
    """With ends of paths (solutions, unknowns) that are at infinity."""
    return whole._replace(
        doubtful=np.concatenate([whole.doubtful, x]),
        doubtful_classes=np.append(whole.doubtful_classes, classes),
        is_doubtful_infinite=np.append(whole.is_doubtful_infinite, np.ones(len(x), dtype=bool)),
    )


def _with_new(record: FamilyRecord, whole: MemberSolutions, more: ComplexArray, of_class: IntArray) -> MemberSolutions:
    """With those solutions more (solutions, unknowns) that are new whatever the names of links."""
    images = exchange_images(record.name.exchanges)(homogeneous_solutions(more))
    alike = np.stack([affine_solutions(image) for image in images], axis=1)
    x, classes = whole.x, whole.classes
    for k in range(len(more)):
        off = np.abs(x[:, None] - alike[k]) / np.maximum(1.0, np.abs(alike[k]))
        if off.max(axis=2).min(initial=np.inf) > SAME_SOLUTION_DISTANCE:
            x, classes = np.concatenate([x, more[k : k + 1]]), np.append(classes, of_class[k])
    return whole._replace(x=x, classes=classes)


def _is_real(x: ComplexArray) -> BoolArray:
    half = x.shape[1] // 2
    off = np.abs(x[:, :half] - x[:, half:].conj()).max(axis=1, initial=0.0)
    found: BoolArray = off < REAL * np.maximum(1.0, np.abs(x).max(axis=1, initial=0.0))
    return found


def alike_components(solved: Sequence[ComponentSolutions]) -> list[list[int]]:
    """Components that are the same member of one family, together."""
    groups: dict[tuple[str, bytes], list[int]] = {}
    for k, solution in enumerate(solved):
        groups.setdefault(_member_key(solution.record.name, solution.component.member), []).append(k)
    return [*groups.values()]


def _member_key(name: FamilyName, member: Member) -> tuple[str, bytes]:
    first = member.parts[0][:, list(name.given)]
    return name.text, b"".join((np.round(part, 12) + 0.0).tobytes() for part in (first, *member.parts[1:]))
