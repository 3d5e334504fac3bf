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
EXPANSIONS = 2000
"""Groups solved before the search stops looking for a nearer assembly and takes the best way to an end."""


class Assembly(NamedTuple):
    """The unknowns of an assembly, and what is to be said of how it was chosen."""

    z: Array
    remarks: tuple[str, ...] = ()


class Failure(NamedTuple):
    """The group at which every way to assemble ends.

    `open`: how far its constraints stay open at the best (rows,); `z`: the unknowns, those of earlier groups filled in.
    """

    stage: Stage
    open: Array
    z: Array


def search(candidates: Candidates) -> Assembly | Failure:
    """Best first: of all assemblies the one with the least sum of squared distances to the sketch.

    The cost of a partial assembly never falls as it grows, so the first whole one is the nearest.
    """
    stages = candidates.equations.stages
    number = count()
    start = np.zeros(len(candidates.equations.unknowns))
    heap: list[tuple[float, int, tuple[int, ...], int, Array]] = [(0.0, 0, (), next(number), start)]
    worst: Failure | None = None
    chosen: tuple[float, tuple[int, ...], Array] | None = None
    for expansions in count():
        if not heap:
            break
        if expansions < EXPANSIONS:
            node = heapq.heappop(heap)
        else:
            node = heap.pop(min(range(len(heap)), key=lambda index: (-len(heap[index][2]), *heap[index][:4])))
        cost, behind, ranks, _, z = node
        if chosen is not None and (cost > chosen[0] or expansions > EXPANSIONS):
            break
        if len(ranks) == len(stages):
            if chosen is not None:
                return Assembly(chosen[2], (_tie(stages, chosen[1], ranks),))
            chosen = cost, ranks, z
            continue
        stage = stages[len(ranks)]
        found, gap = candidates.of(stage, z)
        if not found and (worst is None or stage.level > worst.stage.level):
            worst = Failure(stage, gap, z)
        for rank, each in enumerate(found):
            total = round((cost + each.distance) / ALIKE) * ALIKE
            heapq.heappush(heap, (total, behind + each.behind, (*ranks, rank), next(number), each.z))
    if chosen is None:
        assert worst is not None
        return worst
    return Assembly(chosen[2])


def _tie(stages: Sequence[Stage], ranks: tuple[int, ...], others: tuple[int, ...]) -> str:
    first = next(index for index, (a, b) in enumerate(zip(ranks, others, strict=True)) if a != b)
    links = ", ".join(stages[first].links)
    return (
        f"the sketch fits more than one assembly alike; taken is the one with its sliding points ahead of "
        f"'through', else the upper one: sketch a point of {links} to choose"
    )
