"""All linkages of one structure that meet a task exactly."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations, permutations, product
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import ComplexArray
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import ComputationEnded, stop_if_over
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase
from planar.synthesis.design_search import DesignSearch
from planar.synthesis.exact.complete_synthesis import CompleteSynthesis, DyadCurve, ExactDesign
from planar.synthesis.exact.dyad_curves import dyad_curve, is_dyad
from planar.synthesis.exact.exact_linkage import ExactLinkage, NoLinkageError, exact_linkage
from planar.synthesis.exact.list_words import completeness, counted_class, file_difference, list_remarks, solution_count
from planar.synthesis.exact.relations.condition_count import count_parts
from planar.synthesis.exact.relations.exact_problem import Component, ExactProblem
from planar.synthesis.exact.tracking.member_homotopy import affine_solutions, homogeneous_solutions, reordered
from planar.synthesis.exact.tracking.member_solutions import (
    FAR,
    ComponentSolutions,
    Progress,
    alike_components,
    solve_components,
    with_tested_records,
)
from planar.synthesis.families import FamilySearch
from planar.synthesis.judgement.defects import Defect, refusal
from planar.synthesis.judgement.judgement import DesignJudge, Judgement, check_file
from planar.synthesis.task.freedom import has_open_numbers
from planar.synthesis.task.starts import start_mechanisms
from planar.synthesis.task.synthesis_task import (
    ChainStart,
    SynthesisTask,
    WantedPoses,
)

SAME_POSE = 1e-9
"""Of the size, or of how far it is: a point that differs less is the same."""
KEPT = "what was found of a random task is kept, and the same search goes on from there"
"""Of a list that is ended before its designs are proved."""
FAMILY_DESIGNS = 24
"""Designs that are listed of a family."""


def synthesise_all(
    task: SynthesisTask,
    progress: Progress | None = None,
    show: Callable[[CompleteSynthesis], None] | None = None,
) -> CompleteSynthesis:
    """All linkages of a task's start that meet it exactly. Raises BadInput where there is no such list.

    Where the trace test of a family is still to be made, the list goes to `show` before, and what ends
    the test leaves it as it is.
    """
    mechanism = _single_start(task)
    report = progress or (lambda _: None)

    def say(stage: str) -> None:
        stop_if_over(f"at this stage: {stage}", KEPT)
        report(stage)

    try:
        problem = ExactProblem(task, mechanism)
    except BadInput:
        if not has_open_numbers(task, mechanism):
            raise
        return _sampled_family(task, mechanism, None, say)
    if _leaves_numbers_open(problem):
        return _sampled_family(task, mechanism, problem, say)
    solved = solve_components(problem.components, say)
    result = _complete_list(problem, solved, say)
    if all(each.record.is_tested for each in solved):
        return result
    if show is not None:
        show(result)
    try:
        tested = with_tested_records(solved, say)
    except (KeyboardInterrupt, ComputationEnded):
        return replace(result, is_finished=False)
    if any(len(one.x) != len(other.x) for one, other in zip(tested, solved, strict=True)):
        return _complete_list(problem, tested, say)
    designs = [each for each in result.designs if isinstance(each, ExactDesign)]
    return replace(result, **_list_numbers(tested, designs))


def _complete_list(problem: ExactProblem, solved: Sequence[ComponentSolutions], say: Progress) -> CompleteSynthesis:
    """The list of all linkages, each judged."""
    judge = DesignJudge(problem.task, problem.size, is_exact=True)
    judged: list[_PosedDesign] = []
    for labelled, certified, is_far in _linkages(solved):
        found = _best_design(problem, judge, labelled, certified, len(judged) + 1)
        if found is not None:
            judged.append(_PosedDesign(replace(found.design, is_far=is_far), found.pose))
        say(f"{count_phrase(len(judged), 'linkage')} judged")
    designs = _distinct(sorted(judged, key=lambda each: _rank(each.design)))
    return CompleteSynthesis(problem.task, tuple(designs), (), problem.size, **_list_numbers(solved, designs))


class _PosedDesign(NamedTuple):
    """A design with the pose of its linkage at the first entry, see `ExactLinkage`; an empty one if it has no file."""

    design: ExactDesign
    pose: ComplexArray


def _distinct(designs: Sequence[_PosedDesign]) -> list[ExactDesign]:
    """The first of each linkage: two are one whose points and lines are the same at the first entry, to round-off.

    Two solutions may differ in how a link is drawn alone, as where either sense of a line turns alike, or where a point
    of a link has one of its coordinates given and two directions of the link's axes lead to it.
    """
    found: list[_PosedDesign] = []
    for own in designs:
        within = SAME_POSE * np.maximum(1.0, np.abs(own.pose))
        known = [each.pose for each in found if len(each.pose) == len(own.pose) > 0]
        if not any(bool((np.abs(own.pose - pose) < within).all()) for pose in known):
            found.append(own)
    return [each.design for each in found]


def _list_numbers(solved: Sequence[ComponentSolutions], designs: Sequence[ExactDesign]) -> dict[str, Any]:
    """What a list says of the whole."""
    return {
        "remarks": list_remarks(solved, designs),
        "expected": solution_count(solved, [len(each.record.classes) for each in solved]),
        "found": solution_count(solved, [each.whole.found for each in solved]),
        "complete": completeness(solved),
        "counted": counted_class(solved),
    }


def _rank(design: ExactDesign) -> tuple[bool, bool, bool, float]:
    """The sound ones first, then those that are nearly at infinity, and last those whose file differs."""
    error = design.error if np.isfinite(design.error) else np.inf
    return bool(design.file_difference), design.is_far, bool(design.defects), error


def _single_start(task: SynthesisTask) -> Mechanism:
    if isinstance(task.starts, ChainStart) or len(task.starts) != 1:
        raise BadInput("$.start", "a complete list is that of one mechanism; name one to start from")
    return next(iter(start_mechanisms(task)))


def _leaves_numbers_open(problem: ExactProblem) -> bool:
    """Whether numbers of some part stay open. Raises BadInput where a part cannot meet what is wanted."""
    unbalanced = [each for each in count_parts(problem) if each.excess or each.open]
    if any(each.excess for each in unbalanced):
        told = ", ".join(each.sentence for each in unbalanced)
        raise BadInput("$.wanted", f"what is wanted cannot be met exactly with the numbers that are free: {told}")
    return bool(unbalanced)


def _values(component: Component, x: ComplexArray) -> dict[int, complex]:
    """A real solution by its symbols."""
    half = len(x) // 2
    middle = 0.5 * (x[:half] + x[half:].conj())
    found: dict[int, complex] = {}
    for each, value in zip(component.unknowns, middle.tolist(), strict=True):
        found |= {each.own: value, each.conjugate: value.conjugate()}
    return found


def _linkages(solved: Sequence[ComponentSolutions]) -> Iterator[tuple[list[dict[int, complex]], bool, bool]]:
    """Every linkage as the values of its symbols, in all ways in which its links may bear their names; whether it is
    certified, and nearly at infinity."""
    groups = alike_components(solved)
    choices = [[*combinations(range(len(solved[own[0]].x)), len(own))] for own in groups]
    for chosen in product(*choices):
        certified, is_far = True, False
        ways: list[list[dict[int, complex]]] = []
        for own, rows in zip(groups, chosen, strict=True):
            certified &= all(bool(solved[k].proved[row]) for k, row in zip(own, rows, strict=True))
            is_far |= any(float(np.abs(solved[k].x[row]).max()) > FAR for k, row in zip(own, rows, strict=True))
            ways.append([_joined(solved, own, order) for order in permutations(rows)])
        labelled = [{key: value for part in way for key, value in part.items()} for way in product(*ways)]
        if len(solved) == 1:
            labelled = _exchanged(solved[0], chosen[0][0])
        yield labelled, certified, is_far


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
) -> _PosedDesign | None:
    """A linkage with its links named so that it has the fewest defects; None for a solution that is no linkage."""
    designs: list[_PosedDesign] = []
    for values in labelled:
        try:
            linkage = exact_linkage(problem, values, f"{problem.task.name}: {problem.mechanism.name} {number}")
        except NoLinkageError:
            continue
        except BadInput as error:
            unwritten = _unwritten(problem, certified, f"no file could say it: {error.sentence}")
            designs.append(_PosedDesign(unwritten, np.zeros(0, complex)))
            continue
        design = _judged(problem, judge, linkage, certified)
        designs.append(_PosedDesign(design, linkage.pose))
        if not design.defects and not design.file_difference:
            break
    return min(designs, key=lambda each: (bool(each.design.file_difference), len(each.design.defects)), default=None)


def _unwritten(problem: ExactProblem, certified: bool, why: str) -> ExactDesign:
    none = tuple(np.full(len(each.weights), np.nan) for each in problem.task.wanted)
    short, start = (Defect("a file's form", why),), problem.mechanism.name
    return ExactDesign(problem.mechanism, np.nan, np.nan, none, none, short, start, {}, certified=certified)


def _judged(problem: ExactProblem, judge: DesignJudge, linkage: ExactLinkage, certified: bool) -> ExactDesign:
    """A linkage judged by its own file; where that does not meet every entry, the fault is not the design's."""
    check = check_file(linkage.mechanism, problem.task.wanted, linkage.inputs, problem.size)
    found = Judgement(check.misses, linkage.inputs, ())
    difference = ""
    if check.is_met:
        found = judge.judge(check.mechanism, linkage.inputs, check.results)
    else:
        difference = file_difference(problem.task, check)
    every = np.concatenate(found.misses)
    return ExactDesign(
        check.mechanism,
        float(np.sqrt(np.mean(every**2))),
        float(every.max()),
        found.misses,
        found.inputs,
        found.defects,
        problem.mechanism.name,
        linkage.numbers,
        certified=certified and check.is_met,
        file_difference=difference,
        opposite=linkage.opposite,
    )


def _special(curves: Sequence[DyadCurve], solved: Sequence[ComponentSolutions]) -> Iterator[str]:
    """Where poses are special, in words."""
    for each in curves:
        if each.dimension == 1 and not len(each.circle_points) + len(each.centre_points):
            yield f"the poses are special: dyads {each.joint}, {each.pivot} have no curve, or any place will do"
    if any(len(each.whole.x) < each.whole.class_count for each in solved):
        yield "the poses are special: a dyad that others leave one of has none, or more"


def _sampled_family(
    task: SynthesisTask, mechanism: Mechanism, problem: ExactProblem | None, say: Progress
) -> CompleteSynthesis:
    """A sample of the linkages of a task that leaves numbers open, and the curves of dyads where poses leave them.

    `problem` is None for structures that have no polynomials here."""
    search = DesignSearch(task, mechanism)
    sample = FamilySearch(search, FAMILY_DESIGNS, 0, say).run()
    curves, special = ((), ()) if problem is None else _dyad_curves(problem, say)
    remarks = () if sample.designs else (refusal([each.shortages for each in sample.rejected], task.units),)
    return CompleteSynthesis(
        task,
        sample.designs,
        sample.rejected,
        search.size,
        remarks,
        expected=None,
        complete="; ".join([sample.sentence, *["dyads that do it stand in curves"] * bool(curves), *special]),
        counted="",
        curves=curves,
        family=sample.family,
    )


def _dyad_curves(problem: ExactProblem, say: Progress) -> tuple[tuple[DyadCurve, ...], tuple[str, ...]]:
    """The curves of the dyads that poses leave, and where these are special; none of other structures."""
    if len(problem.items) > 1 or not isinstance(problem.items[0], WantedPoses):
        return (), ()
    open_parts = [each for each in problem.components if each.freedom > 0]
    if not all(is_dyad(problem, each) for each in open_parts):
        return (), ()
    solved = solve_components([each for each in problem.components if each.freedom == 0], say)
    curves = [dyad_curve(problem, each) for each in open_parts]
    for each in solved:
        curves += [dyad_curve(problem, each.component, x) for x in each.x]
    return tuple(curves), tuple(_special(curves, solved))
