"""All linkages of one structure that meet a task exactly."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, permutations, product
from math import comb, prod
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.foundation.arrays import Array, BoolArray, ComplexArray
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase
from planar.synthesis.design_motion import design_motion
from planar.synthesis.exact.complete_synthesis import CompleteSynthesis, DyadCurve, ExactDesign
from planar.synthesis.exact.dyad_curves import dyad_curve, is_dyad
from planar.synthesis.exact.exact_linkage import ExactLinkage, exact_linkage
from planar.synthesis.exact.relations.exact_problem import Component, ExactProblem
from planar.synthesis.exact.relations.family import Member
from planar.synthesis.exact.tracking.exact_certificates import certify_member
from planar.synthesis.exact.tracking.generic_store import FamilyRecord, family_record
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions, homogeneous_solutions
from planar.synthesis.exact.tracking.member_solutions import MemberSolutions, solve_member
from planar.synthesis.exact.tracking.monodromy import first_of_same
from planar.synthesis.exact.tracking.other_ways import UNKNOWN
from planar.synthesis.exact.tracking.symmetry import FamilyName, reordered
from planar.synthesis.judgement.defects import Defect
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.task.starts import start_mechanisms
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    SynthesisTask,
    Wanted,
    WantedFunction,
    WantedPath,
    WantedPoses,
)

REAL = 1e-7
"""Of a solution's size: one that differs from its own conjugate by less is real."""
MET = 1e-6
"""Of the extent of what is wanted, or rad: an exact linkage that misses more is in another assembly there."""
Progress = Callable[[str], None]


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


def synthesise_all(task: SynthesisTask, progress: Progress | None = None) -> CompleteSynthesis:
    """All linkages of a task's start that meet it exactly. Raises BadInput where there is no such list."""
    mechanism = _single_start(task)
    problem = ExactProblem(task, mechanism)
    _check_freedom(problem)
    say = progress or (lambda _: None)
    solved = _solve_all([each for each in problem.components if each.freedom == 0], say)
    if any(each.freedom for each in problem.components):
        return _with_curves(problem, solved)
    judge = DesignJudge(task, problem.size)
    designs: list[ExactDesign] = []
    for labelled, certified in _linkages(solved):
        designs.append(_best_design(problem, judge, labelled, certified, len(designs) + 1))
        say(f"{count_phrase(len(designs), 'linkage')} judged")
    told = [each for each in designs if each is not None]
    told.sort(key=lambda each: (bool(each.defects), each.error if np.isfinite(each.error) else np.inf))
    return CompleteSynthesis(
        task,
        tuple(told),
        (),
        problem.size,
        _remarks(solved, told),
        expected=_count(solved, [len(each.record.classes) for each in solved]),
        found=_count(solved, [each.whole.found for each in solved]),
        complete=_completeness(solved),
        counted=_counted(solved),
    )


def _single_start(task: SynthesisTask) -> Mechanism:
    if isinstance(task.starts, ChainStart) or len(task.starts) != 1:
        raise BadInput("$.start", "a complete list is that of one mechanism; name one to start from")
    return next(iter(start_mechanisms(task)))


def _check_freedom(problem: ExactProblem) -> None:
    least = min((each.freedom for each in problem.components), default=0)
    if least < 0:
        told = f"{count_phrase(-least, 'condition')} more than {problem.mechanism.name!r} can meet exactly"
        raise BadInput("$.wanted", f"what is wanted sets {told} with the numbers that are free")
    left = [each for each in problem.components if each.freedom > 0]
    is_for_poses = len(problem.items) == 1 and isinstance(problem.items[0], WantedPoses)
    if left and not (is_for_poses and all(is_dyad(problem, each) for each in left)):
        most = max(each.freedom for each in left)
        raise BadInput(
            "$.wanted",
            f"{count_phrase(most, 'number')} of {problem.mechanism.name!r} would stay open, so that there is no list; "
            "want more, or give some of the numbers by leaving them out of 'free'",
        )


def _solve_all(components: Sequence[Component], say: Progress) -> list[ComponentSolutions]:
    known: dict[tuple[str, bytes], ComponentSolutions] = {}
    solved = []
    for each in components:
        record = family_record(each.family, lambda many: say(f"{many} solutions of a random task"))
        key = _member_key(record.name, each.member)
        found = known.get(key)
        if found is None or found.record.name != record.name:
            found = _solve(each, record, say)
            known[key] = found
        solved.append(found._replace(component=each))
    return solved


def _solve(component: Component, record: FamilyRecord, say: Progress) -> ComponentSolutions:
    say(f"{count_phrase(record.classes.size, 'path')}")
    whole = solve_member(component.family, record, component.member)
    if is_available() and len(whole.doubtful):
        whole = _with_doubtful(component, whole)
    proved = np.zeros(len(whole.x), dtype=bool)
    x, is_real = whole.x, _is_real(whole.x)
    all_proved = 0
    if is_available() and len(x):
        say(f"{count_phrase(len(x), 'solution')} to be certified")
        proof = certify_member(component.family, component.member, x)
        x, proved, all_proved = proof.x, proof.proved & proof.is_real, int(proof.proved.sum())
        is_real = np.where(proof.proved, proof.is_real, is_real)
    wanted = whole.members * len({*whole.classes[is_real].tolist()} - {UNKNOWN})
    missing = max(0, wanted - int(is_real.sum()))
    return ComponentSolutions(component, record, whole, x[is_real], proved[is_real], all_proved, missing)


def _with_doubtful(component: Component, whole: MemberSolutions) -> MemberSolutions:
    """Ends that only look as if several met there, which balls of more digits tell from such, beside the others."""
    proof = certify_member(component.family, component.member, whole.doubtful)
    both = np.concatenate([whole.x, proof.x[proof.proved]])
    classes = np.concatenate([whole.classes, whole.doubtful_classes[proof.proved]])
    kept = first_of_same(homogeneous_solutions(both)) == np.arange(len(both))
    told = whole._replace(x=both[kept], classes=classes[kept])
    return told._replace(singular=max(0, whole.singular - (told.found - whole.found)))


def _is_real(x: ComplexArray) -> BoolArray:
    half = x.shape[1] // 2
    off = np.abs(x[:, :half] - x[:, half:].conj()).max(axis=1, initial=0.0)
    found: BoolArray = off < REAL * np.maximum(1.0, np.abs(x).max(axis=1, initial=0.0))
    return found


def _values(component: Component, x: ComplexArray) -> dict[int, complex]:
    """A real solution by its symbols."""
    half = len(x) // 2
    middle = 0.5 * (x[:half] + x[half:].conj())
    found: dict[int, complex] = {}
    for each, value in zip(component.unknowns, middle.tolist(), strict=True):
        found |= {each.own: value, each.conjugate: value.conjugate()}
    return found


def _linkages(solved: Sequence[ComponentSolutions]) -> Iterator[tuple[list[dict[int, complex]], bool]]:
    """Every linkage as the values of its symbols, in all ways in which its links may bear their names."""
    groups = _alike(solved)
    choices = [[*combinations(range(len(solved[own[0]].x)), len(own))] for own in groups]
    for chosen in product(*choices):
        certified = True
        ways: list[list[dict[int, complex]]] = []
        for own, rows in zip(groups, chosen, strict=True):
            certified &= all(bool(solved[k].proved[row]) for k, row in zip(own, rows, strict=True))
            ways.append([_joined(solved, own, order) for order in permutations(rows)])
        labelled = [{key: value for part in way for key, value in part.items()} for way in product(*ways)]
        if len(solved) == 1:
            labelled = _exchanged(solved[0], chosen[0][0])
        yield labelled, certified


def _alike(solved: Sequence[ComponentSolutions]) -> list[list[int]]:
    """Components that are the same member of one family, together."""
    groups: dict[tuple[str, bytes], list[int]] = {}
    for k, each in enumerate(solved):
        groups.setdefault(_member_key(each.record.name, each.component.member), []).append(k)
    return [*groups.values()]


def _member_key(name: FamilyName, member: Member) -> tuple[str, bytes]:
    return name.text, b"".join(np.round(part, 12).tobytes() for part in member.parts)


def _joined(solved: Sequence[ComponentSolutions], own: Sequence[int], rows: Sequence[int]) -> dict[int, complex]:
    found: dict[int, complex] = {}
    for k, row in zip(own, rows, strict=True):
        found |= _values(solved[k].component, solved[k].x[row])
    return found


def _exchanged(one: ComponentSolutions, row: int) -> list[dict[int, complex]]:
    V = homogeneous_solutions(one.x[row][None])
    return [_values(one.component, affine_solutions(reordered(V, each))[0]) for each in one.record.name.exchanges]


def _best_design(
    problem: ExactProblem, judge: DesignJudge, labelled: list[dict[int, complex]], certified: bool, number: int
) -> ExactDesign:
    """A linkage with its links named so that it has the fewest defects."""
    found: list[ExactDesign] = []
    for each in labelled:
        try:
            linkage = exact_linkage(problem, each, f"{problem.task.name}: {problem.mechanism.name} {number}")
        except BadInput as problem_found:
            found.append(_unwritten(problem, certified, f"no file could say it: {problem_found.sentence}"))
            continue
        found.append(_judged(problem, judge, linkage, certified))
        if not found[-1].defects:
            break
    best = min(found, key=lambda each: len(each.defects))
    return replace(best, motion=design_motion(best.mechanism, best.inputs) if best.numbers else None)


def _unwritten(problem: ExactProblem, certified: bool, why: str) -> ExactDesign:
    none = tuple(np.full(len(each.weights), np.nan) for each in problem.task.wanted)
    short, start = (Defect("a file's form", why),), problem.mechanism.name
    return ExactDesign(problem.mechanism, np.nan, np.nan, none, none, short, start, {}, certified=certified)


def _judged(problem: ExactProblem, judge: DesignJudge, linkage: ExactLinkage, certified: bool) -> ExactDesign:
    values = [_wanted_values(each) for each in problem.task.wanted]
    found = judge.judge(linkage.mechanism, linkage.inputs, values)
    every = np.concatenate(found.misses)
    defects = found.defects
    scale = 1.0 if all(isinstance(each, WantedFunction) for each in problem.task.wanted) else problem.size
    if not defects and float(every.max()) > MET * scale:
        defects = (Defect("one circuit", "circuit defect: not every entry is met in the assembly of the first"),)
    return ExactDesign(
        linkage.mechanism,
        float(np.sqrt(np.mean(every**2))),
        float(every.max()),
        found.misses,
        found.inputs,
        defects,
        problem.mechanism.name,
        linkage.numbers,
        certified=certified,
    )


def _wanted_values(wanted: Wanted) -> Array:
    if isinstance(wanted, WantedFunction):
        return wanted.values[:, None]
    if isinstance(wanted, WantedPath):
        return wanted.places
    return np.concatenate([wanted.places, wanted.angles[:, None]], axis=1)


def _count(solved: Sequence[ComponentSolutions], counts: Sequence[int]) -> int:
    """How many choices there are of one solution of each component, all different where components are alike."""
    return prod(comb(counts[own[0]], len(own)) for own in _alike(solved))


def _counted(solved: Sequence[ComponentSolutions]) -> str:
    """What is counted, in words."""
    parts = []
    for own in _alike(solved):
        record = solved[own[0]].record
        many, members = record.classes.shape
        told = count_phrase(many, "complex solution")
        if members > 1:
            told = f"{many} classes of {members} linkages each, which move alike"
        if len(record.name.exchanges) > 1:
            told += ", those that differ in the names of links alone counted once"
        if len(own) > 1:
            told = f"choices of {len(own)} of {told}"
        parts.append(told)
    return ", each with each of ".join(parts)


def _completeness(solved: Sequence[ComponentSolutions]) -> str:
    for own in _alike(solved):
        if len(solved[own[0]].record.classes) < len(own):
            many = count_phrase(len(solved[own[0]].record.classes), "solution")
            return f"there is none in general: {len(own)} parts that are alike would have to differ, and have {many}"
    gap = _gap(solved)
    if gap:
        return f"incomplete: {gap}"
    if any(each.whole.singular for each in solved):
        return "numerically complete but for singular solutions, where several meet or a curve of them passes"
    if not all(each.record.is_traced for each in solved):
        return "all of a number that is a lower bound: it was found by monodromy without a trace test"
    return "numerically complete"


def _gap(solved: Sequence[ComponentSolutions]) -> str:
    """What is known to be wrong with the list as a whole."""
    if any(len(each.whole.x) > each.record.classes.size for each in solved):
        return "there are more solutions than a random task was known to have"
    lost = sum(each.whole.lost for each in solved)
    if lost:
        return f"paths to {lost} of {sum(each.whole.class_count for each in solved)} were lost"
    missing = sum(each.missing for each in solved)
    return f"{count_phrase(missing, 'cognate')} of real linkages were not reached" if missing else ""


def _remarks(solved: Sequence[ComponentSolutions], designs: Sequence[ExactDesign]) -> tuple[str, ...]:
    found = []
    for each in [solved[own[0]] for own in _alike(solved)]:
        whole = each.whole
        ends = [count_phrase(len(whole.x), "solution") + " at finite places"]
        ends += [f"{whole.at_infinity} at infinity"] * bool(whole.at_infinity)
        ends += [f"{whole.singular} where several meet or a curve passes"] * bool(whole.singular)
        ends += [f"{whole.lost} lost"] * bool(whole.lost)
        classes = f" of {whole.class_count} classes" if whole.members > 1 else ""
        told = f"{count_phrase(each.record.classes.size, 'path')}{classes}: {', '.join(ends)}"
        if is_available():
            told += f"; {each.all_proved} proved, each to be the only one in a box of its own"
        else:
            told += "; python-flint is not there to certify them"
        found.append(told)
        if each.record.source:
            found.append(each.record.source)
    marked = sum(bool(each.defects) for each in designs)
    if marked:
        found.append(f"{marked} of {count_phrase(len(designs), 'real linkage')} have a defect")
    return tuple(found)


def _with_curves(problem: ExactProblem, solved: Sequence[ComponentSolutions]) -> CompleteSynthesis:
    curves: list[DyadCurve] = [dyad_curve(problem, each) for each in problem.components if each.freedom > 0]
    for each in solved:
        curves += [dyad_curve(problem, each.component, x) for x in each.x]
    return CompleteSynthesis(
        problem.task,
        (),
        (),
        problem.size,
        (),
        expected=None,
        complete="a family of linkages with parameters; its dyads stand in curves",
        counted="",
        curves=tuple(curves),
    )
