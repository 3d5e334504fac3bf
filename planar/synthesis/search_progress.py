"""How far a search for designs is."""

from __future__ import annotations

from typing import NamedTuple


class SearchProgress(NamedTuple):
    """How far a search is: at which `start`, the `start_number`-th (from 1) of `start_count` (None: not known).

    `stage` is "catalogue", "matches", "fit" or "judgement" of the `round`-th catalogue of the start.
    `best` is the least error of a sound design so far (m, or rad where functions of angles alone are wanted; infinite
    where there is none) and `best_share` the same beside the extent of the places that are wanted, where there are
    some. Of a complete list `stage` says what is done, and the rest nothing.
    """

    start: str
    start_number: int
    start_count: int | None
    round: int
    stage: str
    best: float
    best_share: float


def progress_of_list(stage: str) -> SearchProgress:
    """How far a complete list is, in words."""
    return SearchProgress("", 0, None, 0, stage, float("inf"), float("inf"))
