"""Solutions of a member that paths did not reach, by way of other random members.

Round about, a solution comes from another one of the random member, and its whole class with it. So what is followed
back that way, and its class forth again, brings the linkages that move as one that is known does.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import BoolArray, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.generic_store import FamilyRecord
from planar.synthesis.exact.tracking.monodromy import CLOSER_STEPS, follow
from planar.synthesis.exact.tracking.same_solutions import first_of_same
from planar.synthesis.exact.tracking.symmetry import exchange_images, representatives

PRECISION = 1e-5
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
    there = follow(family, begin, V, between, PRECISION)
    first = np.flatnonzero(there.is_single)
    gone = follow(family, between, there.V[first], end, PRECISION)
    lost = ~gone.is_single
    if lost.any():
        again = follow(family, between, there.V[first[lost]], end, PRECISION, CLOSER_STEPS)
        for whole, part in zip(gone, again, strict=True):
            whole[lost] = part
    return gone.V[gone.is_single], first[gone.is_single]
