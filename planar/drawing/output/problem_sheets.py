"""A problem on printed pages: a page for each variant to hand out, and the answers with every worked solution."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from planar.analysis.classroom.questions import problem_questions, question_text, solve_question
from planar.analysis.classroom.variants import Variant
from planar.analysis.rich_text import format_number
from planar.analysis.worked.givens import given_data
from planar.analysis.worked.solution import asked_phrases
from planar.drawing.output.matplotlib_figure import MATPLOTLIB_SETTINGS
from planar.drawing.output.page_layout import PageColumn, Strip, lay_out_pages, paragraph, table_strips
from planar.drawing.output.solution_pages import (
    TITLE_STYLE,
    TOPIC_STYLE,
    picture_strips,
    shorten_notes,
    solution_pages,
    space_diagram_scale,
)
from planar.drawing.paper.pens import require_matplotlib
from planar.drawing.scheme.scheme import scheme
from planar.foundation.time_limit import all_within_time
from planar.model.file_units import display_unit
from planar.model.mechanism import PUBLISHED_QUANTITIES, PublishedValue
from planar.results.motion import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURE_SIZE = 115.0, 110.0
"""mm that the strokes of a problem's figure may take."""
NAME_LINE = "_" * 40


def problem_pages(base: State, variants: Sequence[Variant], seed: int) -> list[Figure]:
    """A page for each variant: what is given, what is to be found, the figure. Raises BadInput without matplotlib."""
    require_matplotlib()
    from matplotlib import rc_context

    questions = problem_questions(base)
    pages: list[Figure] = []
    with rc_context(MATPLOTLIB_SETTINGS):
        for variant in all_within_time(variants, "pages"):
            pages += lay_out_pages(_problem_strips(variant, seed, questions))
    return pages


def answer_pages(base: State, variants: Sequence[Variant], seed: int) -> list[Figure]:
    """The answers of all variants in tables, then the worked solution of each. Raises BadInput as `problem_pages`."""
    require_matplotlib()
    from matplotlib import rc_context

    with rc_context(MATPLOTLIB_SETTINGS):
        pages = lay_out_pages(_answer_strips(base, variants, seed))
    for variant in all_within_time(variants, "solutions"):
        mechanism = variant.state.mechanism
        pages += solution_pages(variant.state, title=f"{mechanism.name}, variant {variant.number}")
    return pages


def _problem_strips(variant: Variant, seed: int, questions: Sequence[PublishedValue]) -> Iterator[Strip]:
    state = variant.state
    yield from paragraph((f"{state.mechanism.name}, variant {variant.number}",), TITLE_STYLE)
    yield from paragraph((f"Problem {seed}.   Name: {NAME_LINE}",), space_before=2.0)
    yield from paragraph(("Given",), TOPIC_STYLE, space_before=4.0, keep_with_next=True)
    for phrase in given_data(state):
        yield from paragraph(phrase, indent=4.0)
    yield from paragraph(("To find",), TOPIC_STYLE, space_before=3.0, keep_with_next=True)
    for phrase in asked_phrases(questions):
        yield from paragraph(phrase, indent=4.0)
    figure = scheme(state, space_diagram_scale(state, FIGURE_SIZE))._replace(title="Figure")
    yield from picture_strips([shorten_notes(figure)])


def _answer_strips(base: State, variants: Sequence[Variant], seed: int) -> Iterator[Strip]:
    yield from paragraph((f"{base.mechanism.name}: answers of problem {seed}",), TITLE_STYLE)
    for item in problem_questions(base):
        name, unit = display_unit(PUBLISHED_QUANTITIES[item.quantity], base.mechanism.units)
        heads = [PageColumn("Variant", True), PageColumn(name, True), PageColumn("Sense")]
        answers = [(variant, solve_question(variant.state, item)) for variant in variants]
        cells = [
            ((str(variant.number),), (format_number(unit.from_si(answer.solved)),), (answer.sense,))
            for variant, answer in answers
        ]
        title = question_text(item)
        yield from table_strips(heads, cells, title=title[0].upper() + title[1:], space_before=5.0)
