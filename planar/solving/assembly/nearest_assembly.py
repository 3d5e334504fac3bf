"""The assembly of a mechanism that lies nearest to a rough sketch, found group after group."""

from __future__ import annotations

import heapq
from collections.abc import Callable
from itertools import count
from typing import NamedTuple

import numpy as np

from planar.equations.constraint_equations import Stage
from planar.solving.assembly.block_assemblies import Candidate, Candidates, hanging

Array = np.ndarray

ALIKE = 1e-9
"""Assemblies whose sums of squared distances to the sketch (sizes squared) agree to this fit alike."""
MOST_TIED = 64
"""Assemblies that fit alike among which one is looked for whose rates are determined."""
EXPANSIONS = 1000
"""Groups solved before the search stops looking for a nearer assembly and takes the best way to an end."""


class Assembly(NamedTuple):
    """The unknowns of an assembly, the groups that may as well stand otherwise, and whether the search was cut off."""

    z: Array
    ties: tuple[int, ...] = ()
    stopped: bool = False


class Failure(NamedTuple):
    """The group at which every way to assemble ends.

    `z`: the unknowns where it is nearest to closing, those of earlier groups filled in; `groups`: how many were solved
    in search of it.
    """

    stage: Stage
    z: Array
    groups: int = 0


class _Groups:
    """The candidates of groups, and where there are none: whatever the groups do on which one does not hang, at the
    same places of those on which it hangs there are none again."""

    def __init__(self, candidates: Candidates):
        self.candidates = candidates
        self.worst: Failure | None = None
        "the last group that could not be assembled"
        self.hopeless = False
        "whether one cannot be assembled that hangs on no other"
        self._hanging: list[list[int]] | None = None
        self._ends: dict[int, set[bytes]] = {}

    def of(self, stage: Stage, z: Array) -> list[Candidate]:
        """Those of a group, the unknowns before it in z; none as well where a later one would have none for these."""
        if self._leads_to_an_end(z, stage.unknowns.start):
            return []
        found, nearest = self.candidates.of(stage, z)
        if not found:
            if self.worst is None or stage.level > self.worst.stage.level:
                self.worst = Failure(stage, nearest)
            self._hanging = self._hanging or [sorted(columns) for columns in hanging(self.candidates.setup)]
            self._ends.setdefault(stage.level, set()).add(z[self._hanging[stage.level]].tobytes())
            self.hopeless = not self._hanging[stage.level]
        return found

    def _leads_to_an_end(self, z: Array, known: int) -> bool:
        columns = self._hanging or []
        ends = self._ends.items()
        return any(columns[level][-1] < known and z[columns[level]].tobytes() in places for level, places in ends)


class _Node(NamedTuple):
    """A partial assembly, in the order in which the search takes them up."""

    cost: float
    behind: int
    ranks: tuple[int, ...]
    number: int
    z: Array
    ties: tuple[int, ...]
    "groups in which another choice lies as near to the sketch"


def search(candidates: Candidates, sound: Callable[[Array], bool] | None = None) -> Assembly | Failure:
    """Best first: of all assemblies the one with the least sum of squared distances to the sketch.

    The cost of a partial assembly never falls as it grows, so the first whole one is the nearest. Of several that fit
    alike a `sound` one is taken, whose rates are determined, if there is one among the first. After EXPANSIONS groups
    the search only goes on to an end, and says so.
    """
    stages = candidates.equations.stages
    number, groups = count(), _Groups(candidates)
    heap = [_Node(0.0, 0, (), next(number), np.zeros(len(candidates.equations.unknowns)), ())]
    chosen: _Node | None = None
    taken: _Node | None = None
    tied = 0
    for expansions in count():
        if not heap or (chosen is not None and expansions > EXPANSIONS):
            break
        if expansions < EXPANSIONS:
            node = heapq.heappop(heap)
        else:
            node = heap.pop(min(range(len(heap)), key=lambda index: (-len(heap[index].ranks), *heap[index][:4])))
        if chosen is not None and node.cost > chosen.cost:
            return Assembly((taken or chosen).z, (taken or chosen).ties if tied else ())
        if len(node.ranks) == len(stages):
            tied += chosen is not None
            chosen = chosen or node
            if taken is None and (sound is None or sound(node.z)):
                taken = node
            if tied and (taken is not None or tied > MOST_TIED):
                return Assembly((taken or chosen).z, (taken or chosen).ties)
            continue
        found = groups.of(stages[len(node.ranks)], node.z)
        if groups.hopeless:
            break
        for rank, each in enumerate(found):
            alike = sum(abs(other.distance - each.distance) <= ALIKE for other in found) > 1
            heapq.heappush(
                heap,
                _Node(
                    round((node.cost + each.distance) / ALIKE) * ALIKE,
                    node.behind + each.behind,
                    (*node.ranks, rank),
                    next(number),
                    each.z,
                    (*node.ties, len(node.ranks)) if alike else node.ties,
                ),
            )
    if chosen is None:
        assert groups.worst is not None
        return groups.worst._replace(groups=expansions)
    return Assembly((taken or chosen).z, (taken or chosen).ties if tied else (), expansions >= EXPANSIONS)
