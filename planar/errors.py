"""What can go wrong, and the sentence in which it is said."""

from enum import StrEnum


class Outcome(StrEnum):
    """How an attempt at a mechanism ended; the value is the phrase shown."""

    SOLVED = "solved"
    CANNOT_BE_ASSEMBLED = "cannot be assembled"
    DEAD_POINT = "dead point"
    CHANGE_POINT = "change point"
    TOO_FEW_INPUTS = "too few inputs"
    TOO_MANY_INPUTS = "too many inputs"
    BRANCH_LOST = "branch lost"


class PlanarError(Exception):
    """Anything that planar refuses; its text is one sentence for a person."""


class BadInput(PlanarError):
    """A mechanism file or an argument says something that cannot be meant.

    `place` is a JSON path such as `$.pairs[2].links[0]`, or a file's name.
    """

    def __init__(self, place: str, sentence: str):
        super().__init__(f"{place}: {sentence}")
        self.place = place
        self.sentence = sentence


class NoAnswer(PlanarError):
    """The mechanism is well described but has no answer here; `outcome` says which kind."""

    def __init__(self, outcome: Outcome, reason: str):
        super().__init__(f"{outcome.value}: {reason}")
        self.outcome = outcome
        self.reason = reason
