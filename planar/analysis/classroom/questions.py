"""What a problem asks of a position, and the value of each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planar.analysis.worked.published import Comparison, compare_value
from planar.foundation.errors import BadInput, Unknown, suggest_name
from planar.model.mechanism import PUBLISHED_QUANTITIES, PublishedValue, relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import State

ASKED_KINDS = ("velocity", "acceleration", "angular velocity", "angular acceleration")
"""Kinds of quantity that are asked of a position."""


def problem_questions(state: State) -> tuple[PublishedValue, ...]:
    """What is asked of a position: what the mechanism's source asks, else the rates of what moves.

    Each is a published value without a value.
    """
    mechanism = state.mechanism
    own = [
        item._replace(value=None, slip=None, note=None, sense=None)
        for item in mechanism.published
        if not item.inputs and not item.start and PUBLISHED_QUANTITIES[item.quantity] in ASKED_KINDS
    ]
    return tuple(dict.fromkeys(own)) or tuple(_all_rates(state))


def _all_rates(state: State) -> Iterator[PublishedValue]:
    """The rates of links that turn, but for what the inputs turn, and of the points that the sketch shows."""
    mechanism = state.mechanism
    named = relative_motions(mechanism)
    driven = {
        link
        for given in mechanism.inputs
        if named[given.pair].input_kind is not MeasureKind.LENGTH
        for link in named[given.pair].bodies
    }
    points = [name for name, _, _ in mechanism.sketch]
    for order, (of_point, symbol), (of_link, greek) in (
        ("velocity", ("velocity", "v"), ("angular velocity", "ω")),
        ("acceleration", ("acceleration", "a"), ("angular acceleration", "α")),
    ):
        for name in points:
            if np.any(getattr(state.point(name), order)):
                yield PublishedValue(f"{symbol}_{name}", of_point, name)
        for name, link in state.links.items():
            if name not in driven and getattr(link, f"angular_{order}"):
                yield PublishedValue(f"{greek}_{name}", of_link, name)


def question_text(item: PublishedValue) -> str:
    """A question as it stands in lists of answers: `velocity of C`, `x of acceleration of B relative to A`."""
    text = f"{item.component + ' of ' if item.component else ''}{item.quantity} of {item.of}"
    return text + (f" relative to {item.relative_to}" if item.relative_to else "")


def read_question(text: str, questions: tuple[PublishedValue, ...]) -> PublishedValue:
    """The question that a text means, capitals and blanks left aside where that leaves one. Raises BadInput."""
    exact = {written: item for item in questions for written in (item.symbol, question_text(item))}
    found = exact.get(" ".join(text.split()))
    if found is not None:
        return found
    alike = {item for written, item in exact.items() if written.casefold() == " ".join(text.casefold().split())}
    if len(alike) == 1:
        return alike.pop()
    asked = [question_text(item) for item in questions]
    raise BadInput("quantity", f"{text[:60]!r} is not asked{suggest_name(text, asked, 'questions', 4)}")


def solve_question(state: State, item: PublishedValue) -> Comparison:
    """The value of a question at a position, beside what it says itself. Raises BadInput for what is not there."""
    try:
        return compare_value(item, state)
    except (Unknown, KeyError):
        raise BadInput(question_text(item), "the mechanism has nothing of that name") from None
