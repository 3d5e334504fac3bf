"""What can go wrong, and the sentence in which it is said."""

from enum import StrEnum
from typing import Any


class Outcome(StrEnum):
    """How an attempt at a mechanism ended; the value is the phrase shown."""

    SOLVED = "solved"
    CANNOT_BE_ASSEMBLED = "cannot be assembled"
    DEAD_POINT = "dead point"
    CHANGE_POINT = "change point"
    TOO_FEW_INPUTS = "too few inputs"
    TOO_MANY_INPUTS = "too many inputs"
    INPUT_JAMMED = "input jammed"
    BRANCH_LOST = "branch lost"
    TOO_INEXACT = "too inexact"


class Ending(StrEnum):
    """How a motion ends that cannot be followed further."""

    DEAD_POINT = "dead point"
    ENDLESS = "endless"
    LOST = "lost"


def _shown(text: str, longest: int) -> str:
    """The text as one line that a screen can show, whatever a file put into it."""
    if len(text) > longest:
        text = f"{text[: longest * 3 // 5]} … {text[-longest * 3 // 10 :]}"
    return "".join(each if each.isprintable() else repr(each)[1:-1] for each in text)


class PlanarError(Exception):
    """Anything that planar refuses; its text is one sentence for a person."""


class BadInput(PlanarError):
    """A mechanism file or an argument says something that cannot be meant.

    `place` is a JSON path such as `$.pairs[2].links[0]`, or a file's name.
    """

    def __init__(self, place: str, sentence: str):
        self.place = _shown(place, 200)
        self.sentence = _shown(sentence, 300)
        super().__init__(f"{self.place}: {self.sentence}")


class NoAnswer(PlanarError):
    """The mechanism is well described but has no answer here; `outcome` says which kind, `more` what a program asks."""

    def __init__(self, outcome: Outcome, reason: str):
        super().__init__(f"{outcome.value}: {reason}")
        self.outcome = outcome
        self.reason = reason
        self.more: dict[str, Any] = {}
