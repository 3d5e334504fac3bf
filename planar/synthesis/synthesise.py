"""From what a linkage must do to the linkages that do it best."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from planar import __version__
from planar.document.dimensions import file_dimensions
from planar.foundation.errors import BadInput, NoAnswer, PlanarError
from planar.model.mechanism import Mechanism
from planar.model.run_arguments import check_whole_number
from planar.synthesis.cognates.task_cognates import task_cognates
from planar.synthesis.design_motion import design_motion
from planar.synthesis.design_search import Candidate, DesignSearch
from planar.synthesis.judgement.judgement import ORDER, DesignJudge
from planar.synthesis.judgement.refusal import refusal
from planar.synthesis.judgement.written_design import DIGITS, EXACT_DIGITS, write_design
from planar.synthesis.search_folder import SearchFolder
from planar.synthesis.search_progress import SearchProgress, progress_of_list
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign, rank_designs
from planar.synthesis.task.freedom import count_freedom, exactness_in_excess
from planar.synthesis.task.starts import start_mechanisms
from planar.synthesis.task.synthesis_task import ChainStart, SynthesisTask
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
SETTLED, SAME = 3, 1e-3
"""Fits that lead to the best design, to this part of its error, at which no other catalogue is looked at: where several
of many starts at random lead to the best of their optima, a better one is not likely to have been missed (C. G. E.
Boender, A. H. G. Rinnooy Kan, Bayesian stopping rules for multistart global optimization methods, Mathematical
Programming 37 (1987) 59)."""
ALIKE_SPARE = 4
"""Sound designs beyond those wanted after which no more are judged: some turn out to be alike."""
KEPT_SHARE = 4
"""Of each start so many times as many designs as are wanted are judged."""


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

    With `complete` all linkages of one start are found that meet exactly as much as it can meet, each certified where
    python-flint is there; `many`, `seed`, `time_limit` and `folder` are not for that.

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
        return synthesise_all(known, progress and (lambda said: progress(progress_of_list(said))))
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


class TaskSearch:
    """The search for designs for a task, start after start; `result` may be asked for at any time.

    `folder` keeps each round that is done, and gives those done before. Raises BadInput where it holds something else.
    """

    def __init__(  # many: what a search is made of
        self,
        task: SynthesisTask,
        many: int,
        seed: int,
        time_limit: float | None = None,
        folder: Path | None = None,
        progress: Callable[[SearchProgress], None] | None = None,
    ):
        self.task, self.many, self.seed, self.time_limit = task, many, seed, time_limit
        self.end = None if time_limit is None else monotonic() + time_limit
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
        self._at = "", 0, 0
        "the start, its number, and the round"

    def run(self) -> None:
        """Search every start, as far as the time goes."""
        for number, start in enumerate(start_mechanisms(self.task), start=1):
            if not self.add_start(start, number):
                return
        self.is_finished = True

    def is_over(self) -> bool:
        """Whether the time is up."""
        return self.end is not None and monotonic() > self.end

    def best_error(self) -> float:
        """The least error of a sound design."""
        return min((each.error for each in self.sound), default=float("inf"))

    def add_start(self, mechanism: Mechanism, number: int) -> bool:
        """Search the designs of one start; whether that was finished."""
        search: DesignSearch | None = None
        before = len(self.sound)
        for turn in range(ROUNDS):
            self._at = mechanism.name, number, turn + 1
            kept = None if self.folder is None else self.folder.read(number, turn + 1)
            if kept is not None:
                self.size, designs = kept
                self.starts[mechanism.name] = mechanism
                self.sound += [each for each in designs if not each.defects]
                self.rejected += [each for each in designs if each.defects]
            elif self.is_over():
                return False
            else:
                search = self._begin(mechanism) if search is None else search
                if search is None:
                    return True
                self.size = search.size
                self.starts[mechanism.name] = mechanism
                self._search_round(search, turn, before)
            if self._is_settled(before):
                break
        return True

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

    def _is_settled(self, before: int) -> bool:
        """Whether no other catalogue is looked at: the best design of a start is good, or several fits led to it."""
        errors = np.array([each.error for each in self.sound[before:]])
        best = float(errors.min(initial=np.inf))
        return best <= GOOD * self.size or int(np.sum(errors <= (1.0 + SAME) * best)) >= SETTLED

    def _search_round(self, search: DesignSearch, turn: int, before: int) -> None:
        """The designs of one more catalogue, kept when all are judged; so many were sound `before` this start."""
        first = len(self.sound), len(self.rejected)
        self._tell("catalogue")
        catalogue = search.catalogue(DRAWS, self.seed + 1000 * turn)
        self._tell("matches")
        matches = search.matches(catalogue, MATCHES)
        judge = DesignJudge(self.task, search.size)
        for keeps_order in (False, True):  # the second only where the first leads to none in order
            self._tell("fit")
            for each in search.fit(catalogue, matches, KEPT_SHARE * self.many, keeps_order):
                self._tell("judgement")
                self._judge(search, judge, each)
                if len(self.sound) - before >= (self.many + ALIKE_SPARE) * (turn + 1):
                    break
            short = {one.demand for each in self.rejected[first[1] :] for one in each.shortages}
            if len(self.sound) > first[0] or ORDER not in short:
                break
        if self.folder is not None:
            designs = [*self.sound[first[0] :], *self.rejected[first[1] :]]
            self.folder.write(self._at[1], turn + 1, search.size, designs)

    def _tell(self, stage: str) -> None:
        """Say what is being done."""
        if self.progress is not None:
            start, number, turn = self._at
            best = self.best_error()
            share = best / self.size if self.task.wants_places else best
            self.progress(SearchProgress(start, number, self.count, turn, stage, best, share))

    def _judge(self, search: DesignSearch, judge: DesignJudge, candidate: Candidate) -> None:
        design = search.equations[0].design
        number = len(self.sound) + len(self.rejected) + 1
        name = f"{self.task.name}: {search.mechanism.name} {number}"
        inputs = [y[:, -1] * each.input_scale for each, y in zip(search.equations, candidate.unknowns, strict=True)]
        values = [search.shown(k, candidate) for k in range(len(search.equations))]
        y = search.most_regular(candidate)
        try:
            at, digits = float(y[-1] * search.equations[0].input_scale), EXACT_DIGITS if self.task.exact else DIGITS
            mechanism = write_design(design, candidate.numbers, y, at, name, digits)
        except BadInput:
            return  # no file could say it
        found = judge.judge(mechanism, inputs, values)
        every = np.concatenate(found.misses)
        error, worst = float(np.sqrt(np.mean(every**2))), float(every.max())
        written = file_dimensions(mechanism)
        numbers = {each: float(written[each].value) for each in candidate.numbers}
        told = SynthesisedDesign(
            mechanism, error, worst, found.misses, found.inputs, found.defects, search.mechanism.name, numbers
        )
        (self.rejected if found.defects else self.sound).append(told)

    def _freedom(self, start: str) -> str:
        """What of the task a start can meet exactly."""
        return f"{start}: {count_freedom(self.task, self.starts[start]).sentence}"

    def result(self) -> Synthesis:
        """All that was found so far."""
        remarks = [*self.remarks]
        if not self.is_finished:
            remarks.append(self._unfinished())
        sound = tuple(map(self._complete, rank_designs(self.sound, self.many)))
        rejected = tuple(
            replace(each, motion=design_motion(each.mechanism, each.inputs))
            for each in rank_designs(self.rejected, self.many)
        )
        remarks += [self._freedom(each.start) for each in (sound or rejected)[:1]]
        if not sound and (self.rejected or self.is_finished):
            remarks.append(refusal([each.shortages for each in self.rejected], self.task.units))
        return Synthesis(self.task, sound, rejected, self.size, tuple(remarks), self.seed, self.is_finished)

    def _complete(self, design: SynthesisedDesign) -> SynthesisedDesign:
        """A sound design with how it moves, and its cognates."""
        moving = design_motion(design.mechanism, design.inputs)
        return replace(design, motion=moving, cognates=task_cognates(design.mechanism, self.task))

    def _unfinished(self) -> str:
        """How far a search came that did not search every start."""
        start, number, turn = self._at
        where = f"start {number}{f' of {self.count}' if self.count else ''} ({start}), catalogue {turn} of {ROUNDS}"
        why = f"the time limit of {self.time_limit:g} s was up" if self.is_over() else "the search was interrupted"
        return f"{why} at {where}: what is told was found till then"


def _plan(many: int, seed: int) -> dict[str, Any]:
    """What makes a search what it is, beside its task."""
    settings = {"draws": DRAWS, "matches": MATCHES, "rounds": ROUNDS, "good": GOOD, "settled": SETTLED, "same": SAME}
    settings |= {"spare": ALIKE_SPARE, "kept": KEPT_SHARE}
    return {"version": __version__, "many": many, "seed": seed, "settings": settings}
