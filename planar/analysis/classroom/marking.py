"""Marks for what students hand in: each value beside that of the student's own variant."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from difflib import SequenceMatcher
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

from planar.analysis.classroom.questions import problem_questions, question_text, read_question, solve_question
from planar.analysis.classroom.variants import Variant, problem_variants
from planar.document.answer_lists import AnswerList, HandedInValue, UnreadLine, read_answers
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput, join_names
from planar.foundation.time_limit import stops_in_time
from planar.foundation.units import UnitError, parse_unit
from planar.model.file_units import unit_of_kind
from planar.model.mechanism import PUBLISHED_QUANTITIES, Mechanism, PublishedValue
from planar.solving.position import solve

READING_TOLERANCE = 0.05
"""The part of a value by which what is read off a drawing may be off, unless said."""
PART_OF_LARGEST = 0.2
"""What counts of the largest value of a kind: what is small beside it is read off the same drawing."""
POWERS = tuple(10.0**k for k in (-3, -2, -1, 1, 2, 3))
"""Factors by which a value in a wrong unit is off."""
LIKENESS_OF_NAMES, MAX_NAMES_COMPARED = 0.85, 40
"""From where on two names may be one, and of how many each is laid beside each."""
RIGHT, WRONG_SENSE, WRONG_UNIT, WRONG, NO_NUMBER = "right", "sense", "power of ten", "wrong", "no number"


class MarkedValue(NamedTuple):
    """One value that was handed in (SI), the solved one, and what comes of it: `right`, `sense` (the other way round),
    `power of ten` (as in a wrong unit), `wrong`, `no number`."""

    question: PublishedValue
    handed_in: float | None
    solved: float
    verdict: str


class StudentMarks(NamedTuple):
    """What one `student` handed in for a `variant`: the `values` in their order, and how many questions are `asked`."""

    student: str
    variant: int
    values: tuple[MarkedValue, ...]
    asked: int

    @property
    def right(self) -> int:
        """How many are right."""
        return sum(value.verdict == RIGHT for value in self.values)

    @property
    def missing(self) -> int:
        """How many questions have no answer."""
        return self.asked - len(self.values)


class Marks(NamedTuple):
    """The marks of all `students`, in the order in which they are first named; the lines that could not be read and
    count for nobody; and remarks on names that may be those of one student."""

    students: tuple[StudentMarks, ...]
    unread: tuple[UnreadLine, ...]
    remarks: tuple[str, ...]


@takes_mechanism
@stops_in_time
def mark_answers(
    mechanism: Mechanism,
    answers: AnswerList | str | Path,
    tolerance: float = READING_TOLERANCE,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Marks:
    """The marks for a list of answers.

    `answers` is a CSV file: `seed 7`, the seed of `problem_variants`, in its first line, then the columns student,
    variant, quantity (as `velocity of C`), value and unit; without one the value is in that of the sheet. A value is
    right within `tolerance` of the solved one's size, or within a fifth of that of the largest one of its kind, to
    whose scale a polygon is drawn: of vectors the size counts, of angular rates anticlockwise is above zero. A question
    that stands twice counts as it stands last; capitals and blanks of names do not count. Lines that cannot be read are
    told in `unread`. Raises BadInput where the file is no such list, NoAnswer after `timeout` s or a Ctrl-C, with the
    outcome "interrupted".

    >>> import planar, tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp(), "answers.csv")
    >>> _ = path.write_text("seed 7\\nstudent,variant,quantity,value,unit\\nAnn,1,velocity of C,630,mm/s\\n")
    >>> marks = planar.mark_answers("four-bar", path)
    >>> [(each.student, each.right, each.values[0].verdict) for each in marks.students]
    [('Ann', 1, 'right')]
    """
    if not isinstance(answers, AnswerList):
        answers = read_answers(Path(answers))
    greatest = max((value.variant for value in answers.values), default=0)
    known = problem_variants(mechanism, greatest, answers.seed) if greatest else ()
    variants = {each.number: each for each in known}
    questions = problem_questions(solve(mechanism))
    unread = list(answers.unread)
    names: dict[str, str] = {}
    held: dict[tuple[str, int], dict[PublishedValue, MarkedValue]] = {}
    for value in answers.values:
        try:
            marked = _mark_value(value, variants, questions, tolerance)
        except BadInput as problem:
            unread.append(UnreadLine(value.line, problem.sentence))
            continue
        student = names.setdefault(value.student.casefold(), value.student)
        held.setdefault((student, value.variant), {})[marked.question] = marked
    students = tuple(
        StudentMarks(student, variant, tuple(marked.values()), len(questions))
        for (student, variant), marked in held.items()
    )
    return Marks(students, tuple(sorted(unread)), tuple(_name_remarks(list(held))))


def _name_remarks(handed_in: list[tuple[str, int]]) -> Iterator[str]:
    """What there is to say of names that hand in two variants, or are all but alike beside one variant."""
    variants: dict[str, list[int]] = {}
    students: dict[int, list[str]] = {}
    for student, variant in handed_in:
        variants.setdefault(student, []).append(variant)
        students.setdefault(variant, []).append(student)
    for student, numbers in variants.items():
        if len(numbers) > 1:
            yield f"{student} hands in variants {join_names(map(str, numbers))}"
    for variant, names in students.items():
        for first, second in combinations(names[:MAX_NAMES_COMPARED], 2):
            alike = SequenceMatcher(None, first.casefold(), second.casefold()).ratio()
            same_digits = re.findall(r"\d", first) == re.findall(r"\d", second)  # else they are two by their numbers
            if alike >= LIKENESS_OF_NAMES and same_digits:
                yield f"{first} and {second}, who hand in variant {variant}, may be one student"


def _mark_value(
    value: HandedInValue, variants: Mapping[int, Variant], questions: tuple[PublishedValue, ...], tolerance: float
) -> MarkedValue:
    """Raises BadInput where the question or the unit is none."""
    question = read_question(value.quantity, questions)
    state = variants[value.variant].state
    solved = solve_question(state, question).solved
    if value.number is None:
        return MarkedValue(question, None, solved, NO_NUMBER)
    kind = PUBLISHED_QUANTITIES[question.quantity]
    try:
        unit = parse_unit(value.unit) if value.unit else unit_of_kind(kind, state.mechanism.units)[1]
    except UnitError as problem:
        raise BadInput("unit", str(problem)) from None
    if unit.kind != kind:
        told = f"{value.unit!r} is a unit of {unit.kind}, and that of {question_text(question)} is one of {kind}"
        raise BadInput("unit", told)
    number = unit.to_si(value.number)
    alike = (each for each in questions if PUBLISHED_QUANTITIES[each.quantity] == kind)
    largest = max(abs(solve_question(state, each).solved) for each in alike)
    return MarkedValue(question, number, solved, _verdict(number, solved, tolerance, largest))


def _verdict(number: float, solved: float, tolerance: float, largest: float) -> str:
    """What comes of a number beside the solved one and the `largest` of its kind."""
    own = tolerance * abs(solved)
    most_off = max(own, tolerance * PART_OF_LARGEST * largest)
    if abs(number - solved) <= most_off:
        return RIGHT
    if abs(-number - solved) <= most_off:
        return WRONG_SENSE
    by_powers = (sign * number * power for power in POWERS for sign in (1.0, -1.0))
    return WRONG_UNIT if any(abs(value - solved) <= own for value in by_powers) else WRONG
