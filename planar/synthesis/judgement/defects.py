"""What is wrong with a design, and which demand is in the way where no design is sound."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from planar.model.file_units import FileUnits
from planar.model.wording import amount, count_phrase

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


def refusal(designs: Sequence[Sequence[Defect]], units: FileUnits) -> str:
    """A sentence from the defects of all designs that were judged.

    In the way is the demand of which most designs are short; of several alike the one that the best design, with the
    fewest defects, is short of."""
    if not designs:
        return "no design comes near: another start, or more free numbers, may"
    short = [dict.fromkeys(each.demand for each in own) for own in designs]
    count = {demand: sum(demand in own for own in short) for own in short for demand in own}
    fewest = min(range(len(designs)), key=lambda k: len(short[k]))
    demand = max(count, key=lambda name: (count[name], name in short[fewest]))
    worst = [
        max((each for each in own if each.demand == demand), key=lambda each: each.shortage)
        for own, demands in zip(designs, short, strict=True)
        if demand in demands
    ]
    best = min(worst, key=lambda each: each.shortage)
    many, short_of = count_phrase(len(designs), "design"), "is" if count[demand] == 1 else "are"
    return (
        f"no design without a defect; in the way is {demand}{_outcome(best, units)} "
        f"({count[demand]} of {many} {short_of} short of it)"
    )


def _outcome(best: Defect, units: FileUnits) -> str:
    """How near the best design comes."""
    if best.reached is None or best.asked is None:
        return f": {best.sentence}"
    reached, asked, left = (amount(each, best.quantity, units) for each in (best.reached, best.asked, best.shortage))
    if not best.asked:
        return f": the best design {best.verb} {reached}"
    return f" of {asked}: the best design {best.verb} {reached}, {left} {'less' if best.more else 'more'}"
