"""The assembly of a mechanism that lies nearest to a rough sketch, found group after group."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

from planar.equations import Stage
from planar.solving.candidates import Candidates

Array = np.ndarray

ALIKE = 1e-9
"""Assemblies whose sums of squared distances to the sketch (sizes squared) agree to this fit alike."""
EXPANSIONS = 1000
"""Groups solved before the search stops looking for a nearer assembly and takes the best way to an end."""


class Assembly(NamedTuple):
    """The unknowns of an assembly, and what is to be said of how it was chosen."""

    z: Array
    remarks: tuple[str, ...] = ()


class Failure(NamedTuple):
    """The group at which every way to assemble ends.

    `z`: the unknowns where it is nearest to closing, those of earlier groups filled in.
    """

    stage: Stage
    z: Array


class _Node(NamedTuple):
    """A partial assembly, in the order in which the search takes them up."""

    cost: float
    behind: int
    ranks: tuple[int, ...]
    number: int
    z: Array
    ties: tuple[int, ...]
    "groups in which another choice lies as near to the sketch"


def search(candidates: Candidates) -> Assembly | Failure:
    """Best first: of all assemblies the one with the least sum of squared distances to the sketch.

    The cost of a partial assembly never falls as it grows, so the first whole one is the nearest. After EXPANSIONS
    groups the search only goes on to an end, and says so.
    """
    stages = candidates.equations.stages
    number = count()
    heap = [_Node(0.0, 0, (), next(number), np.zeros(len(candidates.equations.unknowns)), ())]
    worst: Failure | None = None
    chosen: _Node | None = None
    for expansions in count():
        if not heap or (chosen is not None and expansions > EXPANSIONS):
            break
        if expansions < EXPANSIONS:
            node = heapq.heappop(heap)
        else:
            node = heap.pop(min(range(len(heap)), key=lambda index: (-len(heap[index].ranks), *heap[index][:4])))
        if chosen is not None and node.cost > chosen.cost:
            return Assembly(chosen.z)
        if len(node.ranks) == len(stages):
            if chosen is not None:
                return Assembly(chosen.z, (_tie(stages, chosen.ties),))
            chosen = node
            continue
        found, nearest = candidates.of(stages[len(node.ranks)], node.z)
        if not found and (worst is None or stages[len(node.ranks)].level > worst.stage.level):
            worst = Failure(stages[len(node.ranks)], nearest)
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
        assert worst is not None
        return worst
    return Assembly(chosen.z, (_stopped(stages, chosen.ties),) if expansions >= EXPANSIONS else ())


def _tie(stages: Sequence[Stage], ties: Sequence[int]) -> str:
    return (
        f"the sketch fits more than one assembly alike; taken is the one with its sliding points ahead of "
        f"'through', else the upper one: sketch a point of {_open(stages, ties)} to choose"
    )


def _stopped(stages: Sequence[Stage], ties: Sequence[int]) -> str:
    return (
        f"the search for the assembly nearest to the sketch stopped after {EXPANSIONS} groups and took the nearest on "
        f"its way; sketch a point of {_open(stages, ties)} to be sure of the one that is meant"
    )


def _open(stages: Sequence[Stage], ties: Sequence[int]) -> str:
    """The links of the groups whose place the sketch leaves open."""
    named = [", ".join(stages[index].links) for index in ties] or ["further links"]
    return "; of ".join(named[:6]) + ("; and of the others" if len(named) > 6 else "")
