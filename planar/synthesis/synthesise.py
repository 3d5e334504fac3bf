"""From what a linkage must do to the linkages that do it best."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, overload

from planar.foundation.errors import BadInput, NoAnswer
from planar.model.run_arguments import check_whole_number
from planar.synthesis.synthesis import Synthesis
from planar.synthesis.task.freedom import exactness_in_excess
from planar.synthesis.task.starts import start_mechanisms
from planar.synthesis.task.synthesis_task import ChainStart, SynthesisTask
from planar.synthesis.task.task_reader import read_task
from planar.synthesis.task_search import SearchProgress, TaskSearch, progress_of_list

if TYPE_CHECKING:
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis


@overload
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: Literal[True],
    progress: Callable[[SearchProgress], None] | None = None,
) -> CompleteSynthesis: ...
@overload
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: Literal[False] = False,
    many: int = 10,
    seed: int = 0,
    time_limit: float | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
) -> Synthesis: ...
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: bool = False,
    many: int = 10,
    seed: int = 0,
    time_limit: float | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
) -> Synthesis:
    """The linkages that do best what a task wants, each judged by the general path.

    `task` is a file, what stands in one as a dict, or a SynthesisTask. Of each start designs are drawn at random and
    run through their motions (kept on disk); those nearest to what is wanted, wherever, however large and however
    turned they are, are fitted by least squares on exact derivatives. `many` is how many designs are told; the same
    `seed` gives the same ones. A search that has taken the `time_limit` (s) begins nothing new. In a `folder` what is
    done is kept: the same call goes on where it was interrupted, or its time was up, to the same designs. `progress`
    is told what is being done.

    Where a start can meet all that is wanted exactly, exact designs are sampled first, those that transmit best first.

    With `complete` all linkages of one start are found that meet exactly as much as it can meet, each certified where
    python-flint is there; where numbers stay open, a sample of the family. `many`, `seed`, `time_limit` and `folder`
    are not for that. For a kind of task that was never solved before, a test that these are all follows: `progress`
    gets the list before, and a KeyboardInterrupt meanwhile returns it with `is_finished` False.

    Raises BadInput with the place in the task's file, for a folder that holds something else, and where no complete
    list can be made.

    >>> import planar
    >>> task = {"planar": 1, "units": {"length": "mm", "angle": "deg"}, "start": "four-bar", "wanted": [{"point": "E",
    ...     "through": [[0, 0], [20, 12], [42, 15], [63, 8], [80, -6]], "in_order": True}]}
    >>> found = planar.synthesise(task, many=1)
    >>> found[0].greatest_miss < 1e-5, found[0].defects
    (True, ())
    """
    known = read_task(task)
    if complete:
        from planar.synthesis.exact.exact_synthesis import synthesise_all

        if (many, seed, time_limit, folder) != (10, 0, None, None):
            raise BadInput("complete", "a complete list is one, whole: leave many, seed, time_limit and folder out")
        if progress is None:
            return synthesise_all(known)
        report = progress
        return synthesise_all(
            known,
            lambda stage: report(progress_of_list(stage)),
            lambda result: report(progress_of_list("trace test", result)),
        )
    check_whole_number("many", many, 1, 1000)
    check_whole_number("seed", seed, 0)
    _refuse_excess(known)
    search = TaskSearch(known, many, seed, time_limit, None if folder is None else Path(folder), progress)
    search.run()
    return search.result()


def _refuse_excess(task: SynthesisTask) -> None:
    """Refuse what no start can meet exactly."""
    if isinstance(task.starts, ChainStart) or not task.exact:
        return
    try:
        told = [exactness_in_excess(task, start) for start in start_mechanisms(task)]
    except NoAnswer:
        return  # a start that cannot move is told of in the search
    if told[0] is not None and None not in told:
        raise BadInput("$.wanted", told[0])
