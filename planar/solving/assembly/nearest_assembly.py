"""The assembly nearest to the sketch, found block after block."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array, BoolArray
from planar.solving.assembly.block_assemblies import (
    CLEAR_SKETCH_DISTANCE,
    BlockAssemblies,
    BlockAssembly,
    block_dependencies,
)

EQUAL_DISTANCE_TOLERANCE = 1e-9
"""Assemblies whose sums of squared distances to the sketch (sizes squared) agree to this fit alike."""
MAX_TIED = 64
"""Assemblies that fit alike among which one is looked for whose rates are determined."""
MAX_BEST_FIRST_EFFORT = 3000.0
"""The effort (steps of Newton's method) on blocks that were solved before, with earlier blocks elsewhere, up to which
the search looks for a nearer assembly; beyond it takes the best partial one to an end."""
MAX_REPEATED_EFFORT = 1.2 * MAX_BEST_FIRST_EFFORT
"""The same effort at which the search stops without an assembly: combinations of earlier blocks grow exponentially."""


def is_at_sketch(
    squared_distance: Array, point_count: int | Array, reach: float | Array = CLEAR_SKETCH_DISTANCE
) -> BoolArray:
    """Whether points lie where the sketch shows them, by the sum of their squared distances (squared sizes)."""
    return np.asarray(squared_distance <= point_count * reach**2)


def is_surely_farther(other: Array, total: Array, roundings: int = 1) -> BoolArray:
    """Whether another assembly of a block, taken alone, lies farther from the sketch than the total that was taken.

    Squared distances never fall as blocks are added, so there is then no nearer assembly.
    """
    return np.asarray(other > total + roundings * EQUAL_DISTANCE_TOLERANCE)


class Assembly(NamedTuple):
    """The unknowns of an assembly, the blocks that may as well stand otherwise, and whether the search was cut off."""

    z: Array
    ties: tuple[int, ...] = ()
    is_cut_off: bool = False


class AssemblySearchFailure(NamedTuple):
    """The block at which every way to assemble ends.

    `z`: the unknowns where it is nearest to closing, those of earlier blocks filled in; `effort`: that of the search
    (see `BlockAssemblies.effort`); `is_cut_off`: whether it stopped before it had tried all combinations.
    """

    stage: Block
    z: Array
    effort: float = 0.0
    is_cut_off: bool = False


class _BlockSearch:
    """The candidates of blocks, and where there are none: whatever the blocks do on which one does not hang, at the
    same places of those on which it hangs there are none again."""

    def __init__(self, candidates: BlockAssemblies):
        self.candidates = candidates
        self.last_failure: AssemblySearchFailure | None = None
        "the last block that could not be assembled"
        self.is_hopeless = False
        "whether one cannot be assembled that hangs on no other"
        self._dependencies: list[list[int]] | None = None
        self._dead_ends: dict[int, set[bytes]] = {}

    def find_assemblies(self, stage: Block, z: Array) -> list[BlockAssembly]:
        """Those of a block, the unknowns before it in z; none as well where a later one would have none for these."""
        if self._is_dead_end(z, stage.unknowns.start):
            return []
        is_farthest = self.last_failure is None or stage.block_index > self.last_failure.stage.block_index
        assemblies, nearest = self.candidates.near_sketch(stage, z, needs_nearest=is_farthest)
        if not assemblies:
            if is_farthest:
                self.last_failure = AssemblySearchFailure(stage, nearest)
            self._dependencies = self._dependencies or [
                sorted(columns) for columns in block_dependencies(self.candidates.setup)
            ]
            self._dead_ends.setdefault(stage.block_index, set()).add(z[self._dependencies[stage.block_index]].tobytes())
            self.is_hopeless = not self._dependencies[stage.block_index]
        return assemblies

    def _is_dead_end(self, z: Array, known: int) -> bool:
        columns = self._dependencies or []
        return any(
            columns[level][-1] < known and z[columns[level]].tobytes() in places
            for level, places in self._dead_ends.items()
        )


class _Node(NamedTuple):
    """A partial assembly, in the order in which the search takes them up."""

    cost: float
    slides_behind: float
    ranks: tuple[int, ...]
    number: int
    z: Array
    ties: tuple[int, ...]
    "blocks in which another choice lies as near to the sketch"


def _deepest_index(heap: Sequence[_Node]) -> int:
    """The partial assembly of most blocks, of several the best."""
    return min(range(len(heap)), key=lambda index: (-len(heap[index].ranks), *heap[index][:4]))


def find_nearest_assembly(
    candidates: BlockAssemblies, is_regular: Callable[[Array], bool] | None = None
) -> Assembly | AssemblySearchFailure:
    """Best first: of all assemblies the one with the least sum of squared distances to the sketch.

    The cost of a partial assembly never falls as it grows, so the first whole one is the nearest. Of several that fit
    alike one is taken that `is_regular`, whose rates are determined, if there is one among the first. After
    `MAX_BEST_FIRST_EFFORT` the search only goes on to an end, and says so; after `MAX_REPEATED_EFFORT` it stops.
    """
    stages = candidates.equations.blocks
    number, groups = count(), _BlockSearch(candidates)
    heap = [_Node(0.0, 0, (), next(number), np.zeros(len(candidates.equations.unknowns)), ())]
    nearest: list[_Node] = []  # whole assemblies, of equal cost
    regular: _Node | None = None
    while heap:
        is_best_first = candidates.repeated_effort < MAX_BEST_FIRST_EFFORT
        if candidates.repeated_effort >= MAX_REPEATED_EFFORT or (nearest and not is_best_first):
            break
        node = heapq.heappop(heap) if is_best_first else heap.pop(_deepest_index(heap))
        if nearest and node.cost > nearest[0].cost:
            heap.clear()
            break
        if len(node.ranks) == len(stages):
            nearest.append(node)
            if regular is None and (is_regular is None or is_regular(node.z)):
                regular = node
            if len(nearest) > 1 and (regular is not None or len(nearest) > MAX_TIED + 1):
                heap.clear()
            continue
        assemblies = groups.find_assemblies(stages[len(node.ranks)], node.z)
        if groups.is_hopeless:
            break
        for rank, part in enumerate(assemblies):
            alike = sum(abs(other.distance - part.distance) <= EQUAL_DISTANCE_TOLERANCE for other in assemblies) > 1
            heapq.heappush(
                heap,
                _Node(
                    round((node.cost + part.distance) / EQUAL_DISTANCE_TOLERANCE) * EQUAL_DISTANCE_TOLERANCE,
                    node.slides_behind + part.slides_behind,
                    (*node.ranks, rank),
                    next(number),
                    part.z,
                    (*node.ties, len(node.ranks)) if alike else node.ties,
                ),
            )
    if not groups.is_hopeless and not nearest:  # cut off: what is whole already will do
        nearest = sorted(node for node in heap if len(node.ranks) == len(stages))[:1]
    if nearest:
        chosen = regular or nearest[0]
        return Assembly(chosen.z, chosen.ties if len(nearest) > 1 else (), bool(heap))
    failure = groups.last_failure
    if failure is None:  # cut off before any block failed
        farthest = max(heap, key=lambda node: len(node.ranks))
        failure = AssemblySearchFailure(stages[len(farthest.ranks)], farthest.z)
    return failure._replace(effort=candidates.effort, is_cut_off=bool(heap) and not groups.is_hopeless)
