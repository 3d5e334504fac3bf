"""The exact designs of one start where numbers stay open: a sample of the family that keeps what is demanded."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.model.wording import count_phrase
from planar.synthesis.catalogue.matches import Match
from planar.synthesis.design_search import Candidate, DesignSearch
from planar.synthesis.families.exact_members import ExactMembers, MemberSampler, join_members
from planar.synthesis.families.member_screen import ENTRY_LACK, MemberScreen, Screening
from planar.synthesis.families.recombination import independent_parts, null_space, recombine
from planar.synthesis.judged_candidate import judge_candidate
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.synthesis import FamilyCount, SynthesisedDesign, least_transmission

DRAWS, DRAW_ROUNDS = 250, 8
"""Random draws of one round, and how many rounds there are while too few members keep the demands."""
RECOMBINATIONS, RECOMBINED_ROUNDS = 12_000, 24
"""Members put together from independent parts of others in one round, and how many rounds at most."""
PARENTS, CHILDREN = 40, 10
"""Members that lack least, where too few keep the demands, and how many are drawn near each of them in a round."""
SPREADS = (0.2, 0.1, 0.05, 0.02) * 3
"""Of the size or of the bounds' range: how far from their parents these are drawn, one round after the other."""
POOL = 4
"""Members that keep the demands, times the designs that are listed, at which no more are sought."""
CANDIDATES = 1.5
"""Members that are judged at most, times the designs that are listed."""
MAX_HOPELESS = 25_000
"""Members that are tried where not even the entries of any keep the demands; after these only the nearest go on."""
NEAREST = 3
"""Members that are judged where none keeps the demands, so that it is said what they lack."""


class FamilySample(NamedTuple):
    """Exact designs that keep the demands, the best transmission first, and those nearest to it where none does."""

    designs: tuple[SynthesisedDesign, ...]
    rejected: tuple[SynthesisedDesign, ...]
    family: FamilyCount

    @property
    def sentence(self) -> str:
        """What was tried, in words."""
        dimension, tried, met = self.family
        if not tried:
            return "no exact linkage was reached from random draws within the bounds"
        kind = f"a family with {count_phrase(dimension, 'open parameter')}" if dimension else "single linkages"
        counts = f"{count_phrase(tried, 'exact linkage was', 'exact linkages were')} tried, {met or 'none'} "
        counts += "meets all that is demanded" if met < 2 else "meet all that is demanded"
        listed = (
            f"; {len(self.designs)} of these, spread over the family, are listed" if len(self.designs) < met else ""
        )
        return f"{kind}: {counts}{listed}"


class FamilySearch:
    """Samples the exact designs of one search, the same for the same `seed`; `say` is told what is done, and nothing
    new is begun once `is_over`."""

    def __init__(
        self,
        search: DesignSearch,
        count: int,
        seed: int,
        say: Callable[[str], None] = lambda _: None,
        is_over: Callable[[], bool] = lambda: False,
    ):
        self.search, self.count, self.say, self.is_over = search, count, say, is_over
        self.sampler, self.screen = MemberSampler(search, seed), MemberScreen(search)
        self.dimension = self.tried = self.met = 0
        self.members: list[ExactMembers] = []
        self.screenings: list[Screening] = []
        "of the members that are kept: those that keep the demands, and the nearest of the others"

    def run(self) -> FamilySample:
        """Sample the family, and judge the members chosen."""
        basis: list[ExactMembers] = []
        for _ in range(DRAW_ROUNDS):
            self.say("exact members of the family")
            drawn = self.sampler.draw(DRAWS)
            if len(drawn.numbers):
                self._add(drawn)
                basis.append(drawn)
                self._recombine(join_members(basis))
            if self._is_enough() or self._is_hopeless() or self.is_over() or (basis and not self.dimension):
                break
        if self.tried and self.dimension and not self._is_enough():
            self._improve()
        return self._judged()

    def _is_enough(self) -> bool:
        return self.met >= POOL * self.count

    def _is_hopeless(self) -> bool:
        return self.tried > MAX_HOPELESS and min(part.violation.min() for part in self.screenings) >= ENTRY_LACK

    def _recombine(self, members: ExactMembers) -> None:
        """Exchange parts of members that vary independently, while too few keep the demands."""
        directions = null_space(self.sampler, members.take(np.array([0])))
        self.dimension = directions.shape[1]
        parts = independent_parts(directions)
        if len(parts) < 2:
            return
        for _ in range(RECOMBINED_ROUNDS // DRAW_ROUNDS):
            if self._is_enough() or self._is_hopeless() or self.is_over():
                break
            combined = recombine(self.sampler, members, parts, RECOMBINATIONS)
            if len(combined.numbers):
                self._add(combined)

    def _improve(self) -> None:
        """Draw members near those that lack least; each of these gives way to the best drawn near it alone, so that
        all parts of the family go on."""
        members, violation, _ = self._known()
        best = np.argsort(violation, kind="stable")[:PARENTS]
        parents, violation = members.take(best), violation[best]
        for spread in SPREADS:
            if self._is_enough() or self.is_over():
                break
            self.say("members near those that lack least")
            starts = np.repeat(np.arange(len(violation)), CHILDREN)
            children, origins = self.sampler.perturb(parents.take(starts), spread)
            if not len(origins):
                continue
            both = join_members([parents, children])
            lacks = np.concatenate([violation, self._add(children).violation])
            owner = np.concatenate([np.arange(len(violation)), starts[origins]])
            order = np.lexsort([lacks, owner])
            rows = order[np.unique(owner[order], return_index=True)[1]]
            parents, violation = both.take(rows), lacks[rows]

    def _add(self, members: ExactMembers) -> Screening:
        """Screen members, and keep those that meet the demands and the nearest of the others."""
        screening = self.screen.screen(members)
        self.tried += len(members.numbers)
        is_met = screening.violation == 0.0
        self.met += int(is_met.sum())
        others = np.argsort(np.where(is_met, np.inf, screening.violation), kind="stable")[:PARENTS]
        rows = np.union1d(np.flatnonzero(is_met), others)
        self.members.append(members.take(rows))
        self.screenings.append(Screening(screening.violation[rows], screening.transmission[rows]))
        return screening

    def _known(self) -> tuple[ExactMembers, Array, Array]:
        """The members that are kept, their violations and their least transmission angles."""
        violation, transmission = (np.concatenate(parts) for parts in zip(*self.screenings, strict=True))
        return join_members(self.members), violation, transmission

    def _judged(self) -> FamilySample:
        """The members chosen, judged by the general path."""
        if not self.tried:
            return FamilySample((), (), FamilyCount(self.dimension, 0, 0))
        members, violation, transmission = self._known()
        judge = DesignJudge(self.search.task, self.search.size)
        sound: list[SynthesisedDesign] = []
        rejected: list[SynthesisedDesign] = []
        most = max(NEAREST, int(CANDIDATES * self.count))
        chosen = self._spread(members.numbers, np.flatnonzero(violation == 0.0), transmission, most)
        nearest = np.argsort(np.where(violation > 0.0, violation, np.inf), kind="stable")[:NEAREST]
        for row in [*chosen, *nearest.tolist()]:
            if len(sound) >= self.count or (sound and violation[row] > 0.0):
                break
            self.say(f"{count_phrase(len(sound), 'design')} judged")
            number = len(sound) + len(rejected) + 1
            design = judge_candidate(self.search, judge, self._candidate(members, row), number)
            if design is not None:
                (rejected if design.defects else sound).append(design)
        sound.sort(key=lambda design: -least_transmission(design))
        met = max(self.met, len(sound)) if sound else 0
        count = FamilyCount(self.dimension, self.tried, met)
        return FamilySample(tuple(sound), () if sound else tuple(rejected), count)

    def _spread(self, numbers: Array, rows: IntArray, transmission: Array, count: int) -> list[int]:
        """So many of some rows, each the farthest from those before; the third that transmits best is taken where
        there are enough."""
        if not len(rows):
            return []
        rows = rows[np.argsort(-transmission[rows], kind="stable")]
        rows = rows[: max(2 * count, len(rows) // 3)]
        places = numbers[rows]
        places = places / np.maximum(places.std(axis=0), 1e-9)
        chosen = [0]
        distance = np.linalg.norm(places - places[0], axis=1)
        while len(chosen) < min(count, len(rows)):
            chosen.append(int(np.argmax(distance)))
            distance = np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1))
        return [int(rows[k]) for k in chosen]

    def _candidate(self, members: ExactMembers, row: int) -> Candidate:
        numbers = members.numbers[row] * self.search.equations[0].scale
        names = self.search.free.names
        return Candidate(
            self.search.mechanism,
            dict(zip(names, numbers.tolist(), strict=True)),
            tuple(y[row] for y in members.unknowns),
            0.0,
            0.0,
            Match(row, 0.0, 1.0 + 0.0j, 0.0j, ()),
        )
