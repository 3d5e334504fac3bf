"""What is wrong with a design, and how near it comes to what is asked of it."""

from __future__ import annotations

from typing import NamedTuple

REACH, ORDER, WHOLE_TURN = "the reach", "the order", "the whole turn"
ONE_BRANCH, ONE_CIRCUIT = "one branch", "one circuit"
"""Names of demands."""


class Defect(NamedTuple):
    """A sentence, and which demand it is short of: a demand's name, in the words of a file, or of a table.

    `reached` is how far the design comes (SI; `quantity` is its kind), and `asked` how far it is to come; `more` tells
    whether more is better. None of what is met or is not.
    """

    demand: str
    sentence: str
    reached: float | None = None
    asked: float | None = None
    quantity: str = "angle"
    more: bool = True
    verb: str = "reaches"

    @property
    def shortage(self) -> float:
        """By how much (SI) it is short; infinite where that is no number."""
        if self.reached is None or self.asked is None:
            return float("inf")
        return self.asked - self.reached if self.more else self.reached - self.asked
