"""Polynomial systems of one kind as the nodes of a graph, with the solutions that are known of each.

Nodes are members of a family, or slices of one. Along every edge each solution is followed once, those of all edges
side by side.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import combinations
from typing import Generic, TypeVar

import numpy as np

from planar.assemblies.polynomial.path_tracker import Homotopy, normalize, track_paths
from planar.foundation.arrays import BoolArray, ComplexArray, IntArray
from planar.synthesis.exact.tracking.same_solutions import first_of_same
from planar.synthesis.exact.tracking.symmetry import Images, representatives

BLOCK = 4096
"""Paths that are followed side by side."""
PREDICTION, CORRECTION, STEPS = 1e-2, 1e-5, 600
"""How far predictions and first corrections may be off, and most steps: a path that is lost, or leaps to another, comes
to a solution or to none all the same."""

Node = TypeVar("Node")


class SolutionGraph(Generic[Node]):
    """Nodes and solutions; of solutions that are `images` of each other one stands for all. `between` gives the
    homotopy of paths along edges (paths, 2) between some nodes."""

    def __init__(self, between: Callable[[Sequence[Node], IntArray], Homotopy], images: Images | None):
        self.between, self.images = between, images
        self.nodes: list[Node] = []
        self.solutions: list[ComplexArray] = []
        self.followed: dict[tuple[int, int], BoolArray] = {}
        "which solutions of the first node have been followed to the second, or met from there"
        self.leaves: set[int] = set()
        "nodes that edges do not go to unless asked for"

    @property
    def most(self) -> int:
        """The greatest number of solutions at any node."""
        return max(map(len, self.solutions))

    def add_node(self, node: Node, V: ComplexArray) -> int:
        """A node more, with solutions that are known of it; its number."""
        self.nodes.append(node)
        self.solutions.append(normalize(representatives(V, self.images)))
        return len(self.nodes) - 1

    def add_solutions(self, k: int, V: ComplexArray) -> IntArray:
        """Solutions of a node, known or not; their numbers there."""
        known = len(self.solutions[k])
        both = np.concatenate([self.solutions[k], normalize(representatives(V, self.images))])
        first = first_of_same(both)
        is_kept = first == np.arange(len(both))
        self.solutions[k] = both[is_kept]
        rows: IntArray = (np.cumsum(is_kept) - 1)[first[known:]]
        return rows

    def follow_edge(self, i: int, j: int) -> bool:
        """Follow those solutions of a node to another that have not been; whether all came there."""
        rows = self._open(i, j)
        return not len(rows) or self._follow([(i, j, rows)])

    def follow_open_edges(self) -> bool:
        """Follow what has not been followed along all edges, each in the direction with the more of it; False where
        there is none."""
        batch, room = [], BLOCK
        for pair in combinations([k for k in range(len(self.nodes)) if k not in self.leaves], 2):
            i, j = max((pair, pair[::-1]), key=lambda edge: len(self._open(*edge)))
            rows = self._open(i, j)[:room]
            if len(rows):
                batch.append((i, j, rows))
                room -= len(rows)
        if batch:
            self._follow(batch)
        return bool(batch)

    def _open(self, i: int, j: int) -> IntArray:
        return np.flatnonzero(~self._followed(i, j))

    def _followed(self, i: int, j: int) -> BoolArray:
        """Which solutions of a node were followed to another, as many as there are now."""
        done = self.followed.get((i, j), np.zeros(0, dtype=bool))
        done = np.concatenate([done, np.zeros(len(self.solutions[i]) - len(done), dtype=bool)])
        self.followed[i, j] = done
        return done

    def _follow(self, batch: Sequence[tuple[int, int, IntArray]]) -> bool:
        edges = np.concatenate([np.tile([[i, j]], (len(rows), 1)) for i, j, rows in batch])
        start = np.concatenate([self.solutions[i][rows] for i, _, rows in batch])
        ends = track_paths(self.between(self.nodes, edges), start, PREDICTION, CORRECTION, STEPS)
        first = 0
        for i, j, rows in batch:
            own = slice(first, first + len(rows))
            first = own.stop
            self._followed(i, j)[rows] = True
            arrived = self.add_solutions(j, ends.V[own][ends.is_single[own]])
            self._followed(j, i)[arrived] = True
        return bool(ends.is_single.all())
