"""Marks for what students hand in: each value beside that of the student's own variant."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from planar.analysis.classroom.questions import problem_questions, question_text, read_question, solve_question
from planar.analysis.classroom.variants import Variant, problem_variants
from planar.document.answer_lists import AnswerList, HandedInValue, read_answers
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput
from planar.foundation.units import UnitError, parse_unit
from planar.model.file_units import unit_of_kind
from planar.model.mechanism import PUBLISHED_QUANTITIES, Mechanism, PublishedValue
from planar.solving.position import solve

READING_TOLERANCE = 0.05
"""The part of a value by which what is read off a drawing may be off, unless said."""
POWERS = tuple(10.0**k for k in (-3, -2, -1, 1, 2, 3))
"""Factors by which a value in a wrong unit is off."""
RIGHT, WRONG_SENSE, WRONG_UNIT, WRONG, NO_NUMBER = "right", "sense", "power of ten", "wrong", "no number"


class MarkedValue(NamedTuple):
    """One value that was handed in (SI), the solved one, and what comes of it: `right`, `sense` (the other way round),
    `power of ten` (as in a wrong unit), `wrong`, `no number`."""

    question: PublishedValue
    handed_in: float | None
    solved: float
    verdict: str


class StudentMarks(NamedTuple):
    """What one student handed in for a variant: the values in their order, and how many questions there were."""

    student: str
    variant: int
    values: tuple[MarkedValue, ...]
    asked: int

    @property
    def right(self) -> int:
        """How many are right."""
        return sum(value.verdict == RIGHT for value in self.values)


@takes_mechanism
def mark_answers(
    mechanism: Mechanism, answers: AnswerList | str | Path, tolerance: float = READING_TOLERANCE
) -> tuple[StudentMarks, ...]:
    """The marks of all students, in the order in which they are first named.

    `answers` is a CSV file: `seed 7`, the seed of `problem_variants`, in its first line, then the columns student,
    variant, quantity (as `velocity of C`), value and unit; without one the value is in that of the sheet. It is right
    within `tolerance` of the solved one's size: of vectors the size, of angular rates anticlockwise above zero. A
    question that stands twice counts as it stands last. Raises BadInput with the line of what cannot be read.
    """
    if not isinstance(answers, AnswerList):
        answers = read_answers(Path(answers))
    greatest = max((value.variant for value in answers.values), default=0)
    known = problem_variants(mechanism, greatest, answers.seed) if greatest else ()
    variants = {each.number: each for each in known}
    questions = problem_questions(solve(mechanism))
    held: dict[tuple[str, int], dict[PublishedValue, MarkedValue]] = {}
    for value in answers.values:
        marked = _mark_value(value, variants, questions, tolerance)
        held.setdefault((value.student, value.variant), {})[marked.question] = marked
    return tuple(
        StudentMarks(student, variant, tuple(marked.values()), len(questions))
        for (student, variant), marked in held.items()
    )


def _mark_value(
    value: HandedInValue, variants: Mapping[int, Variant], questions: tuple[PublishedValue, ...], tolerance: float
) -> MarkedValue:
    state = variants[value.variant].state
    try:
        question = read_question(value.quantity, questions)
    except BadInput as problem:
        raise BadInput(value.place, str(problem)) from None
    solved = solve_question(state, question).solved
    if value.number is None:
        return MarkedValue(question, None, solved, NO_NUMBER)
    kind = PUBLISHED_QUANTITIES[question.quantity]
    try:
        unit = parse_unit(value.unit) if value.unit else unit_of_kind(kind, state.mechanism.units)[1]
    except UnitError as problem:
        raise BadInput(value.place, str(problem)) from None
    if unit.kind != kind:
        raise BadInput(value.place, f"{value.unit!r} is a unit of {unit.kind}, and {question_text(question)} is {kind}")
    number = unit.to_si(value.number)
    return MarkedValue(question, number, solved, _verdict(number, solved, tolerance))


def _verdict(number: float, solved: float, tolerance: float) -> str:
    def fits(value: float) -> bool:
        return abs(value - solved) <= tolerance * abs(solved)

    if fits(number):
        return RIGHT
    if fits(-number):
        return WRONG_SENSE
    off_by_powers = any(fits(sign * number * power) for power in POWERS for sign in (1.0, -1.0))
    return WRONG_UNIT if off_by_powers else WRONG
