"""How far a search for designs is."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from planar.model.wording import amount
from planar.synthesis.task.synthesis_task import SynthesisTask
from planar.synthesis.task.task_numbers import miss_kind

if TYPE_CHECKING:
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis


class SearchProgress(NamedTuple):
    """How far a search is: at which `start`, the `start_number`-th (from 1) of `start_count` (None: not known).

    `stage` is "catalogue", "matches", "fit" or "judgement" of the `round`-th catalogue of the start, or "exact" (round
    0) where exact designs are sampled.
    `best` is the least error of a sound design so far (m, or rad where functions of angles alone are wanted; infinite
    where there is none) and `best_share` the same beside the extent of the places that are wanted, where there are
    some. Of a complete list `stage` says what is done, and the rest nothing; `result` is the list where its designs
    are proved and what is left is the test that they are all.
    """

    start: str
    start_number: int
    start_count: int | None
    round: int
    stage: str
    best: float
    best_share: float
    result: CompleteSynthesis | None = None


def progress_of_list(stage: str, result: CompleteSynthesis | None = None) -> SearchProgress:
    """How far a complete list is, in words."""
    return SearchProgress("", 0, None, 0, stage, float("inf"), float("inf"), result)


def progress_words(done: SearchProgress, task: SynthesisTask) -> str:
    """How far a search is, in a line."""
    number = f"start {done.start_number}" + (f" of {done.start_count}" if done.start_count else "")
    where = f"{number} ({done.start}), " + (f"catalogue {done.round}: {done.stage}" if done.round else "exact designs")
    if done.best == float("inf"):
        return where
    share = f"{100.0 * done.best_share:.3g} % of the size"
    best = share if task.wants_places else amount(done.best, miss_kind(task), task.units)
    return f"{where}; best error so far {best}"
