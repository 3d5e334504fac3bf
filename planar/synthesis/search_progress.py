"""How far a search for designs is."""

from __future__ import annotations

from typing import NamedTuple


class SearchProgress(NamedTuple):
    """How far a search is: at which start, by its number from 1 and of how many (None: not known), and at what.

    `stage` is "catalogue", "matches", "fit", "judgement" or "cognates" of the `round`-th catalogue of the start.
    `best` is the least error of a sound design so far (m, or rad where functions of angles alone are wanted; infinite
    where there is none) and `best_share` the same beside the extent of what is wanted.
    """

    start: str
    start_number: int
    start_count: int | None
    round: int
    stage: str
    best: float
    best_share: float
