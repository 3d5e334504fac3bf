"""Variants of a problem and marks, as tables for a terminal and as JSON values."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from io import StringIO
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.classroom.marking import RIGHT, MarkedValue, Marks
from planar.analysis.classroom.questions import problem_questions, question_text, solve_question
from planar.analysis.classroom.variants import Variant
from planar.document.dimensions import file_dimensions
from planar.model.file_units import FileUnits, display_unit
from planar.model.mechanism import PUBLISHED_QUANTITIES
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import DIGITS
from planar.results.motion import State

FORMULA_SIGNS = ("=", "+", "-", "@")
"""What a spreadsheet takes for the beginning of a formula."""


def variants_tables(base: State, variants: Sequence[Variant], seed: int) -> RenderableType:
    """The numbers of all variants, then what is asked with the answers."""
    mechanism = base.mechanism
    names, known = list(variants[0].values), file_dimensions(mechanism)
    kinds = {name: display_unit(known[name].kind, mechanism.units) for name in names}
    numbers = plain_table("Numbers", "variant", *(f"{name} ({kinds[name][0]})" for name in names), keys=1)
    for each in variants:
        shown = (f"{kinds[name][1].from_si(value):.{DIGITS}g}" for name, value in each.values.items())
        numbers.add_row(str(each.number), *shown)
    questions = problem_questions(base)
    units = [display_unit(PUBLISHED_QUANTITIES[item.quantity], mechanism.units) for item in questions]
    heads = (f"{question_text(item)} ({name})" for item, (name, _) in zip(questions, units, strict=True))
    answers = plain_table("Answers", "variant", *heads, keys=1)
    for each in variants:
        solved = (solve_question(each.state, item).solved for item in questions)
        values = (f"{unit.from_si(value):.{DIGITS}g}" for value, (_, unit) in zip(solved, units, strict=True))
        answers.add_row(str(each.number), *values)
    return Group(Text(f"{mechanism.name}: problem {seed}", style="bold"), Text(), numbers, Text(), answers)


def variants_record(base: State, variants: Sequence[Variant], seed: int) -> dict[str, Any]:
    """The same as a JSON value (SI)."""
    questions = problem_questions(base)

    def record(variant: Variant) -> dict[str, Any]:
        answers = {question_text(item): solve_question(variant.state, item).solved for item in questions}
        return {"variant": variant.number, "values": variant.values, "answers": answers}

    return {"mechanism": base.mechanism.name, "seed": seed, "variants": [record(each) for each in variants]}


def marks_tables(marks: Marks, units: FileUnits) -> RenderableType:
    """How many answers of each student are right, then each that is not, and the lines that could not be read."""
    whole = plain_table("Marks", "student", "variant", "right", "of", "missing", left=(0,), keys=2)
    wrong = plain_table(
        "Not right", "student", "variant", "what", "handed in", "solved", "unit", "why", left=(0, 2, 5, 6)
    )
    for each in marks.students:
        whole.add_row(each.student, str(each.variant), str(each.right), str(each.asked), str(each.missing))
        for value in each.values:
            if value.verdict != RIGHT:
                wrong.add_row(each.student, str(each.variant), *_wrong_cells(value, units))
    unread = plain_table("Not read", "line", "why", left=(1,))
    for line in marks.unread:
        unread.add_row(str(line.line), line.sentence)
    shown: list[RenderableType] = [each for each in (whole, wrong, unread) if each.rows]
    shown += [Text(f" - {remark}") for remark in marks.remarks]
    return Group(*(part for each in shown for part in (each, Text()))) if shown else Text("nobody handed anything in")


def _wrong_cells(value: MarkedValue, units: FileUnits) -> tuple[str, ...]:
    name, unit = display_unit(PUBLISHED_QUANTITIES[value.question.quantity], units)
    handed_in = "-" if value.handed_in is None else f"{unit.from_si(value.handed_in):.{DIGITS}g}"
    solved = f"{unit.from_si(value.solved):.{DIGITS}g}"
    return question_text(value.question), handed_in, solved, name, value.verdict


def marks_record(marks: Marks) -> dict[str, Any]:
    """The same as a JSON value (SI)."""
    students = [
        {
            "student": each.student,
            "variant": each.variant,
            "right": each.right,
            "asked": each.asked,
            "values": [
                {
                    "quantity": question_text(value.question),
                    "handed_in": value.handed_in,
                    "solved": value.solved,
                    "verdict": value.verdict,
                }
                for value in each.values
            ],
        }
        for each in marks.students
    ]
    unread = [{"line": each.line, "why": each.sentence} for each in marks.unread]
    return {"students": students, "unread": unread, "remarks": list(marks.remarks)}


def marks_csv(marks: Marks) -> str:
    """A line for each student, for a spreadsheet: a name that would be a formula there is put in quotes of its own."""
    rows: list[tuple[str, ...]] = [("student", "variant", "right", "asked", "missing")]
    rows += [
        (f"'{each.student}" if each.student.startswith(FORMULA_SIGNS) else each.student, *map(str, numbers))
        for each in marks.students
        for numbers in [(each.variant, each.right, each.asked, each.missing)]
    ]
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()
