"""Synthesis of linkages for a task: the search, start after start, catalogue after catalogue, or a complete list."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, overload

import numpy as np

from planar import __version__
from planar.foundation.errors import BadInput, NoAnswer, PlanarError
from planar.foundation.time_limit import ComputationEnded, returns_part_in_time, stop_if_over, time_is_over
from planar.model.mechanism import Mechanism
from planar.model.run_arguments import check_whole_number
from planar.model.wording import amount
from planar.synthesis.catalogue import Catalogue, Match
from planar.synthesis.cognates.cognates import task_cognates
from planar.synthesis.design_search import Candidate, DesignSearch, judge_candidate
from planar.synthesis.families import DRAWS as DRAWS_OF_MEMBERS
from planar.synthesis.families import RECOMBINATIONS, FamilySearch
from planar.synthesis.judgement.defects import ONE_BRANCH, ORDER, REACH, WHOLE_TURN, refusal
from planar.synthesis.judgement.judgement import EXACT, DesignJudge
from planar.synthesis.synthesis import SearchFolder, Synthesis, SynthesisedDesign, rank_designs
from planar.synthesis.task.freedom import count_freedom, exactness_in_excess
from planar.synthesis.task.starts import miss_kind, start_mechanisms
from planar.synthesis.task.synthesis_task import ChainStart, SynthesisTask, WantedFunction
from planar.synthesis.task.task_reader import read_task

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


DRAWS = 6000
"""Of designs at random for a catalogue."""
MATCHES = 96
"""Of a catalogue that are fitted."""
FEWEST_ROUNDS, ROUNDS = 2, 4
"""Catalogues, each of other designs, where those before led to nothing good: so many at least, and at most."""
GOOD = 2e-3
"""Root mean square of the misses beside the extent of what is wanted, at which no other catalogue is looked at."""
FAIR, IDLE_ROUNDS = 1e-2, 2
"""The same of a fair design, at which no other one is looked at after so many that led to nothing better."""
FUNCTION_SHARE = 0.1
"""Of the widest range of values, that counts as extent where functions alone are wanted: they are met more closely."""
SETTLED, SAME = 3, 1e-3
"""Fits that lead to a fair best design, to this part of its error, at which no other is looked at: where several
of many starts at random lead to the best of their optima, a better one is not likely to have been missed (C. G. E.
Boender, A. H. G. Rinnooy Kan, Bayesian stopping rules for multistart global optimization methods, Mathematical
Programming 37 (1987) 59)."""
ALIKE_SPARE = 4
"""Sound designs beyond those wanted after which no more are judged: some turn out to be alike."""
KEPT_SHARE = 4
"""Of each start so many times as many designs as are wanted are judged."""


class TaskSearch:
    """The search for designs for a task, start after start; `result` may be asked for at any time.

    `folder` keeps each round that is done, and gives those done before. Raises BadInput where it holds something else.
    """

    def __init__(  # many: what a search is made of
        self,
        task: SynthesisTask,
        many: int,
        seed: int,
        folder: Path | None = None,
        progress: Callable[[SearchProgress], None] | None = None,
    ):
        self.task, self.many, self.seed = task, many, seed
        self.folder = None if folder is None else SearchFolder(folder, task, _plan(many, seed))
        self.progress = progress
        self.count = None if isinstance(task.starts, ChainStart) else len(task.starts)
        self.sound: list[SynthesisedDesign] = []
        self.rejected: list[SynthesisedDesign] = []
        self.starts: dict[str, Mechanism] = {}
        "those that designs were made from"
        self.remarks: list[str] = []
        self.size = 1.0
        self.is_finished = False
        self.ended_by = ""
        "why time was over, where it was"
        self._at = "", 0, 0
        "the start, its number, and the round"

    def run(self) -> None:
        """Search every start, as far as the time goes."""
        try:
            for number, start in enumerate(start_mechanisms(self.task), start=1):
                self.add_start(start, number)
        except ComputationEnded:
            self.ended_by = time_is_over()
        else:
            self.is_finished = True

    def best_error(self, before: int = 0) -> float:
        """The least error of a sound design, of those that came after so many."""
        return min((design.error for design in self.sound[before:]), default=float("inf"))

    def add_start(self, mechanism: Mechanism, number: int) -> None:
        """Search the designs of one start. Raises ComputationEnded."""
        search: DesignSearch | None = None
        before = len(self.sound)
        bests: list[float] = []
        for turn in range(ROUNDS + 1):
            self._at = mechanism.name, number, turn
            kept = None if self.folder is None else self.folder.read(number, turn)
            if kept is not None:
                self.size, designs, remarks = kept
                self.starts[mechanism.name] = mechanism
                self.remarks += remarks
                self.sound += [design for design in designs if not design.defects]
                self.rejected += [design for design in designs if design.defects]
            else:
                self._stop_if_over()
                search = self._begin(mechanism) if search is None else search
                if search is None:
                    return
                self.size = search.size
                self.starts[mechanism.name] = mechanism
                if turn:
                    self._search_round(search, turn - 1, before)
                else:
                    self._exact_round(search)
            if turn:
                bests.append(self.best_error(before))
            if self._is_settled(before, bests) if turn else len(self.sound) - before >= self.many:
                break

    def _begin(self, mechanism: Mechanism) -> DesignSearch | None:
        """The search of a start; None where it is none, which a remark says."""
        try:
            search, excess = DesignSearch(self.task, mechanism), exactness_in_excess(self.task, mechanism)
        except BadInput:
            raise
        except PlanarError as problem:
            excess = str(problem)
        if excess is not None:
            self.remarks.append(f"{mechanism.name} is no start: {excess}")
            return None
        return search

    def _exact_round(self, search: DesignSearch) -> None:
        """The designs that meet all exactly, where a start has numbers enough: these need no fit."""
        first = len(self.sound), len(self.rejected), len(self.remarks)
        if not count_freedom(self.task, search.mechanism).excess:
            sample = FamilySearch(search, self.many, self.seed, lambda _: self._tell("exact")).run()
            self.remarks.append(f"{search.mechanism.name}: {sample.sentence}")
            self.sound += sample.designs
            self.rejected += sample.rejected
        self._stop_if_over()
        if self.folder is not None:
            self._keep_round(search, 0, first)

    def _keep_round(self, search: DesignSearch, turn: int, first: tuple[int, int, int]) -> None:
        """Keep in the folder what a round has added to so many designs and remarks."""
        assert self.folder is not None
        designs = [*self.sound[first[0] :], *self.rejected[first[1] :]]
        self.folder.write(self._at[1], turn, search.size, designs, self.remarks[first[2] :])

    def _is_settled(self, before: int, bests: list[float]) -> bool:
        """Whether no other catalogue is looked at: the best design of a start is good; or it is fair, and several fits
        led to it or catalogues since led to none that is better. `bests` are the least errors after each."""
        best, extent = bests[-1], self.size if self.task.wants_places else FUNCTION_SHARE * _widest_range(self.task)
        if best <= GOOD * extent:
            return True
        alike = sum(design.error <= (1.0 + SAME) * best for design in self.sound[before:])
        idle = sum(error <= (1.0 + SAME) * best for error in bests) - 1
        is_fair = len(bests) >= FEWEST_ROUNDS and best <= FAIR * extent
        return is_fair and (alike >= SETTLED or idle >= IDLE_ROUNDS)

    def _search_round(self, search: DesignSearch, turn: int, before: int) -> None:
        """The designs of one more catalogue, kept when all are judged; so many were sound `before` this start."""
        first = len(self.sound), len(self.rejected), len(self.remarks)
        self._tell("catalogue")
        catalogue = search.catalogue(DRAWS, self.seed + 1000 * turn)
        self._tell("matches")
        matches = search.matches(catalogue, MATCHES)
        self._fit_round(search, catalogue, matches, before, turn)
        if self.folder is not None:
            self._keep_round(search, turn + 1, first)

    def _fit_round(
        self, search: DesignSearch, catalogue: Catalogue, matches: list[Match], before: int, turn: int
    ) -> None:
        """The matches fitted and judged: a whole turn, and an order, are kept all the way only where a fit without
        leads to what lacks them, as a better optimum may lie beyond designs that do."""
        judge, most = DesignJudge(self.task, search.size), (self.many + ALIKE_SPARE) * (turn + 1)

        def judged(wanted: list[Match], keeps_turn: bool, keeps_order: bool) -> list[tuple[Candidate, set[str]]]:
            self._tell("fit")
            found = []
            for each in search.fit(catalogue, wanted, KEPT_SHARE * self.many, keeps_turn, keeps_order):
                self._tell("judgement")
                values = tuple(search.shown(k, each) for k in range(len(search.equations)))
                if judge.fit_error(values) > self._worst_wanted(before):
                    continue
                design = self._judge(search, judge, each)
                if design is not None:
                    found.append((each, {one.demand for one in design.shortages}))
                if len(self.sound) - before >= most:
                    break
            return found

        found = judged(matches, keeps_turn=False, keeps_order=False)
        if self.task.needs_whole_turn:
            best = min((each.squares for each, short in found if not short), default=np.inf)
            short_of_turn = [
                each.match for each, short in found if short & {WHOLE_TURN, ONE_BRANCH, REACH} and each.squares < best
            ]
            if short_of_turn:
                found += judged(short_of_turn, keeps_turn=True, keeps_order=False)
        if all(short for _, short in found) and any(ORDER in short for _, short in found):
            judged(matches, keeps_turn=True, keeps_order=True)

    def _tell(self, stage: str) -> None:
        """Say what is being done, and end it where time is over: exact designs once those drawn are judged."""
        if stage != "exact":
            self._stop_if_over()
        if self.progress is not None:
            start, number, turn = self._at
            best = self.best_error()
            share = best / self.size if self.task.wants_places else best
            self.progress(SearchProgress(start, number, self.count, turn, stage, best, share))

    def _stop_if_over(self) -> None:
        """End the search where time is over. Raises ComputationEnded."""
        stop_if_over(f"at {self._place()}")

    def _worst_wanted(self, before: int) -> float:
        """The error beyond which a design does not come among the best of its start, before which so many were sound;
        a judged one is never less than that of its fit."""
        best = self._ranked(self.sound[before:])
        return best[-1].error if len(best) == self.many else float("inf")

    def _judge(self, search: DesignSearch, judge: DesignJudge, candidate: Candidate) -> SynthesisedDesign | None:
        """A candidate judged; None where no file can describe it."""
        design = judge_candidate(search, judge, candidate, len(self.sound) + len(self.rejected) + 1)
        if design is not None:
            (self.rejected if design.defects else self.sound).append(design)
        return design

    def _ranked(self, designs: Sequence[SynthesisedDesign]) -> tuple[SynthesisedDesign, ...]:
        """The best designs; round-off of what is exact does not count."""
        return rank_designs(designs, self.many, EXACT * (self.size if self.task.wants_places else 1.0))

    def result(self) -> Synthesis:
        """All that was found so far."""
        remarks = [*self.remarks]
        if not self.is_finished:
            remarks.append(self._unfinished())
        sound = tuple(
            replace(design, cognates=task_cognates(design.mechanism, self.task)) for design in self._ranked(self.sound)
        )
        rejected = self._ranked(self.rejected)
        for design in (sound or rejected)[:1]:
            remarks.append(f"{design.start}: {count_freedom(self.task, self.starts[design.start]).sentence}")
        if not sound and (self.rejected or self.is_finished):
            remarks.append(refusal([design.shortages for design in self.rejected], self.task.units))
        return Synthesis(self.task, sound, rejected, self.size, tuple(remarks), self.seed, self.is_finished)

    def _unfinished(self) -> str:
        """How far a search came that did not search every start."""
        return f"{self.ended_by or 'the search was interrupted'} at {self._place()}: designs found by then are listed"

    def _place(self) -> str:
        """Where the search is."""
        start, number, turn = self._at
        stage = f"catalogue {turn} of {ROUNDS}" if turn else "exact designs"
        return f"start {number}{f' of {self.count}' if self.count else ''} ({start}), {stage}"


def _widest_range(task: SynthesisTask) -> float:
    """Of the values of functions, rad or m."""
    return max(float(np.ptp(item.values)) for item in task.wanted if isinstance(item, WantedFunction))


def _plan(many: int, seed: int) -> dict[str, Any]:
    """What makes a search what it is, beside its task."""
    settings = {
        "draws": DRAWS,
        "matches": MATCHES,
        "rounds": [FEWEST_ROUNDS, ROUNDS],
        "good": [GOOD, FAIR, IDLE_ROUNDS, FUNCTION_SHARE],
        "settled": SETTLED,
        "same": SAME,
    }
    settings |= {"exact": [DRAWS_OF_MEMBERS, RECOMBINATIONS]}
    settings |= {"spare": ALIKE_SPARE, "kept": KEPT_SHARE}
    return {"version": __version__, "many": many, "seed": seed, "settings": settings}


@overload
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: Literal[True],
    timeout: float | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
) -> CompleteSynthesis: ...
@overload
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: Literal[False] = False,
    many: int = 10,
    seed: int = 0,
    timeout: float | None = None,
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
) -> Synthesis: ...
@returns_part_in_time
def synthesise(
    task: Mapping[str, Any] | str | os.PathLike[str] | SynthesisTask,
    *,
    complete: bool = False,
    many: int = 10,
    seed: int = 0,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
    folder: str | os.PathLike[str] | None = None,
    progress: Callable[[SearchProgress], None] | None = None,
    time_limit: float | None = None,
) -> Synthesis:
    """The linkages that do best what a task wants, each judged by the general path.

    `task` is a file, what stands in one as a dict, or a SynthesisTask. Of each start designs are drawn at random and
    run through their motions (kept on disk); those nearest to what is wanted, wherever, however large and however
    turned they are, are fitted by least squares on exact derivatives. `many` is how many designs are told; the same
    `seed` gives the same ones. After `timeout` s, or a Ctrl-C, the designs found by then are returned, with
    `is_finished` False. In a `folder` what is done is kept: the same call goes on where it was interrupted to the same
    designs. `progress` is told what is being done.

    Where a start can meet all that is wanted exactly, exact designs are sampled first, those that transmit best first.

    With `complete` all linkages of one start are found that meet exactly as much as it can meet, each certified where
    python-flint is there; where numbers stay open, a sample of the family. `many`, `seed` and `folder` are not for
    that. For a kind of task that was never solved before, a test that these are all follows: `progress` gets the list
    before, and where it is ended meanwhile the list is returned with `is_finished` False.

    Raises BadInput with the place in the task's file, for a folder that holds something else, and where no complete
    list can be made; NoAnswer where one is ended before its designs are proved.

    >>> import planar
    >>> task = {"planar": 1, "units": {"length": "mm", "angle": "deg"}, "start": "four-bar", "wanted": [{"point": "E",
    ...     "through": [[0, 0], [20, 12], [42, 15], [63, 8], [80, -6]], "in_order": True}]}
    >>> found = planar.synthesise(task, many=1)
    >>> found[0].greatest_miss < 1e-5, found[0].defects
    (True, ())
    """
    if time_limit is not None:
        warnings.warn("synthesise: the argument 'time_limit' is called 'timeout' now", DeprecationWarning, stacklevel=3)
        return synthesise(task, many=many, seed=seed, timeout=time_limit, folder=folder, progress=progress)
    known = read_task(task)
    if complete:
        from planar.synthesis.exact.exact_synthesis import synthesise_all

        if (many, seed, folder) != (10, 0, None):
            raise BadInput("complete", "a complete list is one, whole: leave many, seed and folder out")
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
    search = TaskSearch(known, many, seed, None if folder is None else Path(folder), progress)
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
