"""From what a linkage must do to the linkages that do it best."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from time import monotonic
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

import numpy as np

from planar.foundation.errors import BadInput, PlanarError
from planar.model.mechanism import Mechanism
from planar.model.run_arguments import check_whole_number
from planar.synthesis.catalogue.catalogue_store import kept_catalogue
from planar.synthesis.cognates.task_cognates import task_cognates
from planar.synthesis.design_search import Candidate, DesignSearch
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.judgement.written_design import write_design
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign, rank_designs
from planar.synthesis.task.freedom import count_freedom
from planar.synthesis.task.starts import start_mechanisms
from planar.synthesis.task.synthesis_task import SynthesisTask
from planar.synthesis.task.task_reader import read_task

if TYPE_CHECKING:
    from planar.synthesis.exact.complete_synthesis import CompleteSynthesis

DRAWS = 6000
"""Of designs at random for a catalogue."""
MATCHES = 96
"""Of a catalogue that are fitted."""
ROUNDS = 4
"""Catalogues at most, each of other designs, where those before led to nothing sound or good."""
GOOD = 2e-3
"""Root mean square of the misses beside the extent of what is wanted, at which no other catalogue is looked at."""
ALIKE_SPARE = 4
"""Sound designs beyond those wanted after which no more are judged: some turn out to be alike."""
KEPT_SHARE = 4
"""Of each start so many times as many designs as are wanted are judged."""


class SearchProgress(NamedTuple):
    """How far a search is: starts done, of how many (None: not known), and the best error so far (m or rad)."""

    start: str
    done: int
    best: float


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
    progress: Callable[[SearchProgress], None] | None = None,
) -> Synthesis: ...
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: bool = False,
    many: int = 10,
    seed: int = 0,
    time_limit: float | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
) -> Synthesis:
    """The linkages that do best what a task wants, each judged by the general path.

    `task` is a file, what stands in one as a dict, or a SynthesisTask. Of each start designs are drawn at random and
    run through their motions (kept on disk); those nearest to what is wanted, wherever, however large and however
    turned they are, are fitted by least squares on exact derivatives. `many` is how many designs are told; the same
    `seed` gives the same ones. A search that has taken the `time_limit` (s) begins nothing new.

    With `complete` all linkages of one start are found that meet exactly as much as it can meet, each certified where
    python-flint is there; `many`, `seed` and `time_limit` are not for that.

    Raises BadInput with the place in the task's file, and where no complete list can be made.

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

        if (many, seed, time_limit) != (10, 0, None):
            raise BadInput("complete", "a complete list is one, whole: leave many, seed and time_limit out")
        return synthesise_all(known, progress and (lambda said: progress(SearchProgress(said, 0, 0.0))))
    count = check_whole_number("many", many, 1, 1000)
    end = None if time_limit is None else monotonic() + time_limit
    search = _TaskSearch(known, count, check_whole_number("seed", seed, 0), end)
    for done, start in enumerate(start_mechanisms(known)):
        if search.is_over():
            break
        search.add_start(start)
        if progress is not None:
            progress(SearchProgress(start.name, done + 1, search.best_error()))
    return search.result()


class _TaskSearch:
    def __init__(self, task: SynthesisTask, many: int, seed: int, end: float | None):
        self.task, self.many, self.seed, self.end = task, many, seed, end
        self.sound: list[SynthesisedDesign] = []
        self.rejected: list[SynthesisedDesign] = []
        self.starts: dict[str, Mechanism] = {}
        "those that designs were made from"
        self.remarks: list[str] = []
        self.size = 1.0

    def is_over(self) -> bool:
        """Whether the time is up."""
        return self.end is not None and monotonic() > self.end

    def best_error(self) -> float:
        """The least error of a sound design."""
        return min((each.error for each in self.sound), default=float("inf"))

    def add_start(self, mechanism: Mechanism) -> None:
        """Search the designs of one start."""
        try:
            search = DesignSearch(self.task, mechanism)
        except BadInput:
            raise
        except PlanarError as problem:
            self.remarks.append(f"{mechanism.name} is no start: {problem}")
            return
        self.size = search.size
        self.starts[mechanism.name] = mechanism
        judge = DesignJudge(self.task, search.size)
        before = len(self.sound)
        for turn in range(ROUNDS):
            catalogue = kept_catalogue(search.equations, search.free, DRAWS, self.seed + 1000 * turn)
            candidates = search.fit(catalogue, search.matches(catalogue, MATCHES), KEPT_SHARE * self.many)
            for each in candidates:
                self._judge(search, judge, each)
                if len(self.sound) - before >= (self.many + ALIKE_SPARE) * (turn + 1):
                    break
            own = self.sound[before:]
            best = min((each.error for each in own), default=np.inf)
            if best <= GOOD * search.size or self.is_over():
                break

    def _judge(self, search: DesignSearch, judge: DesignJudge, candidate: Candidate) -> None:
        design = search.equations[0].design
        number = len(self.sound) + len(self.rejected) + 1
        name = f"{self.task.name}: {search.mechanism.name} {number}"
        inputs = [y[:, -1] * each.input_scale for each, y in zip(search.equations, candidate.unknowns, strict=True)]
        values = [search.shown(k, candidate) for k in range(len(search.equations))]
        y = search.most_regular(candidate)
        try:
            mechanism = write_design(design, candidate.numbers, y, float(y[-1] * search.equations[0].input_scale), name)
        except BadInput:
            return  # no file could say it
        found = judge.judge(mechanism, inputs, values)
        every = np.concatenate(found.misses)
        error, worst = float(np.sqrt(np.mean(every**2))), float(every.max())
        told = SynthesisedDesign(
            mechanism, error, worst, found.misses, found.inputs, found.defects, search.mechanism.name
        )
        (self.rejected if found.defects else self.sound).append(told)

    def _freedom(self, start: str) -> str:
        """What of the task a start can meet exactly."""
        return f"{start}: {count_freedom(self.task, self.starts[start]).sentence}"

    def result(self) -> Synthesis:
        """All that was found."""
        remarks = [*self.remarks]
        if self.is_over():
            remarks.append("the time was up before every start had been searched")
        ranked = rank_designs(self.sound, self.many)
        sound = tuple(replace(each, cognates=task_cognates(each.mechanism, self.task)) for each in ranked)
        remarks += [self._freedom(each.start) for each in (sound or self.rejected)[:1]]
        if not sound:
            remarks.append(_refusal(self.rejected))
        return Synthesis(self.task, sound, rank_designs(self.rejected, self.many), self.size, tuple(remarks))


def _refusal(rejected: list[SynthesisedDesign]) -> str:
    """Which demand is in the way."""
    if not rejected:
        return "no design comes near: another start, or more free numbers, may"
    kinds: dict[str, int] = {}
    for each in rejected:
        for sentence in each.defects:
            kind = sentence.split(":")[0] if "defect" in sentence or "turn" in sentence else sentence.split(" of ")[0]
            kinds[kind] = kinds.get(kind, 0) + 1
    worst = max(kinds, key=lambda kind: kinds[kind])
    return f"no design without a defect: {kinds[worst]} of {len(rejected)} have this one: {worst}"
