"""The real solutions of the parts of a structure, each a member of its family, and what is known of all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.assemblies.polynomial.path_tracker import SAME_SOLUTION_DISTANCE
from planar.foundation.arrays import BoolArray, ComplexArray, IntArray
from planar.model.wording import count_phrase
from planar.synthesis.exact.relations.exact_problem import Component
from planar.synthesis.exact.relations.family import Member
from planar.synthesis.exact.tracking.ball_paths import MOST_PATHS, ExactCertificates, certify_member
from planar.synthesis.exact.tracking.family_names import FamilyName
from planar.synthesis.exact.tracking.generic_store import FamilyRecord, family_record, tested_record
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions, bilinear_roots, homogeneous_solutions
from planar.synthesis.exact.tracking.member_solutions import (
    UNKNOWN,
    MemberSolutions,
    Progress,
    is_nearly_singular,
    proved_in_balls,
    solve_member,
)
from planar.synthesis.exact.tracking.symmetry import exchange_images

REAL = 1e-7
"""Of a solution's size: one that differs from its own conjugate by less is real."""
FAR = 1e4
"""Sizes of the task: what is farther out is nearly at infinity."""
FARTHEST = 1e11
"""What is farther out than this is at infinity."""


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
    for each in components:
        record = family_record(each.family, lambda many: say(f"{many} solutions of a random task"))
        key = _member_key(record.name, each.member)
        if key not in known:
            known[key] = _solve(each, record, say)
        solved.append(_in_order(known[key], record)._replace(component=each))
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
    for each in solved:
        record = each.record
        if not record.is_tested:
            if record.name.text not in records:
                say(f"trace test of {count_phrase(len(record.solutions.V), 'solution')} of a random task")
                records[record.name.text] = tested_record(each.component.family, record)
            record = family_record(each.component.family)
        has_more = len(record.solutions.V) > len(each.record.solutions.V)
        tested.append(_solve(each.component, record, say) if has_more else each._replace(record=record))
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
        proof = ExactCertificates(*(each[~goes] for each in proof))
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
    own, x, infinite = proved_in_balls(component.family, record, rows, component.member, say)
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
    alike = np.stack([affine_solutions(each) for each in images], axis=1)
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
    for k, each in enumerate(solved):
        groups.setdefault(_member_key(each.record.name, each.component.member), []).append(k)
    return [*groups.values()]


def _member_key(name: FamilyName, member: Member) -> tuple[str, bytes]:
    first = member.parts[0][:, list(name.given)]
    return name.text, b"".join((np.round(part, 12) + 0.0).tobytes() for part in (first, *member.parts[1:]))
