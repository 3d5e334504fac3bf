"""What a complete list says of itself: how many are expected, what is counted, and how far it is complete."""

from __future__ import annotations

from collections.abc import Sequence
from math import comb, prod

import numpy as np

from planar.assemblies.polynomial.certification import is_available
from planar.model.wording import amount, count_phrase
from planar.synthesis.exact.complete_synthesis import ExactDesign
from planar.synthesis.exact.tracking.member_solutions import FAR, ComponentSolutions, alike_components
from planar.synthesis.judgement.judgement import FileCheck
from planar.synthesis.task.starts import wanted_miss_kind
from planar.synthesis.task.synthesis_task import SynthesisTask


def solution_count(solved: Sequence[ComponentSolutions], counts: Sequence[int]) -> int:
    """How many choices there are of one solution of each component, all different where components are alike."""
    return prod(comb(counts[own[0]], len(own)) for own in alike_components(solved))


def counted_class(solved: Sequence[ComponentSolutions]) -> str:
    """What is counted, in words."""
    parts = []
    for own in alike_components(solved):
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


def completeness(solved: Sequence[ComponentSolutions]) -> str:
    """How far a list is complete."""
    for own in alike_components(solved):
        if len(solved[own[0]].record.classes) < len(own):
            many = count_phrase(len(solved[own[0]].record.classes), "solution")
            return f"there is none in general: {len(own)} parts that are alike would have to differ, and have {many}"
    gap = _gap(solved)
    if gap:
        return f"incomplete: {gap}"
    is_traced = all(component.record.is_traced for component in solved)
    told = "numerically complete" if is_traced else "all of a number that is a lower bound"
    infinite = sum(component.whole.at_infinity for component in solved)
    if any(component.whole.singular for component in solved):
        told += " but for singular solutions, where several meet or a curve of them passes"
    elif infinite:
        told += f" but for {infinite} at infinity"
    if is_traced:
        return told
    if not all(component.record.is_tested for component in solved):
        return f"{told}: the trace test, which shows whether these are all, is not made yet"
    return f"{told}: the trace test does not show that these are all"


def _gap(solved: Sequence[ComponentSolutions]) -> str:
    """What is known to be wrong with the list as a whole."""
    if any(len(component.whole.x) > component.record.classes.size for component in solved):
        return "there are more solutions than a random task was known to have"
    lost = sum(component.whole.lost for component in solved)
    if lost:
        return f"paths to {lost} of {sum(each.whole.class_count for each in solved)} were lost"
    missing = sum(component.missing for component in solved)
    return f"{count_phrase(missing, 'cognate')} of real linkages were not reached" if missing else ""


def list_remarks(solved: Sequence[ComponentSolutions], designs: Sequence[ExactDesign]) -> tuple[str, ...]:
    """How the paths of each part ended, where their number is published, and how many linkages have a defect."""
    found = []
    for each in [solved[own[0]] for own in alike_components(solved)]:
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
        if each.nearly_singular:
            many = count_phrase(each.nearly_singular, "solution")
            found.append(
                f"{many} told by balls of many digits alone: near others or far out, the task is nearly singular"
            )
        if each.far_count:
            many = count_phrase(each.far_count, "solution")
            found.append(f"{many} of {FAR:,.0f} times the size of the task or more: nearly at infinity")
        if each.record.source:
            found.append(each.record.source)
    for link in dict.fromkeys(name for design in designs for name in design.opposite):
        count = sum(link in design.opposite for design in designs)
        found.append(
            f"{link!r} is drawn the opposite way, as its length is negative, in {count} of "
            f"{count_phrase(len(designs), 'real linkage')}: points stand for it"
        )
    differing = [number for number, design in enumerate(designs, start=1) if design.file_difference]
    if differing:
        told = f"design {differing[0]} is not called proved: {designs[differing[0] - 1].file_difference}"
        more = f"; the files of {count_phrase(len(differing) - 1, 'other design')} differ, too"
        found.append(told + more * (len(differing) > 1))
    marked = sum(bool(design.defects) for design in designs)
    if marked:
        found.append(f"with a defect: {marked} of {count_phrase(len(designs), 'real linkage')}")
    return tuple(found)


def file_difference(task: SynthesisTask, check: FileCheck) -> str:
    """How the file of a design differs from the solution of the equations."""
    item, entry = check.worst
    wanted, miss = task.wanted[item], float(check.misses[item][entry])
    named = f"entry {entry + 1} of {wanted.of}"
    if not np.isfinite(miss):
        told = f"its file cannot be assembled at {named}, which the solution of the equations meets"
    else:
        off = amount(miss, wanted_miss_kind(task, wanted), task.units)
        told = f"its file misses {named} by {off}, which the solution of the equations meets"
    if check.is_rounded:
        return f"{told}: the numbers of a file have too few digits for it"
    return f"{told}; this is a fault of planar, please report it with the task"
