"""Which demand is in the way, where no design does what a task wants."""

from __future__ import annotations

from collections.abc import Sequence

from planar.model.file_units import FileUnits
from planar.model.wording import amount, count_phrase
from planar.synthesis.judgement.defects import Defect


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
