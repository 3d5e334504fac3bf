"""The solutions of a random member of a family, found from those of random linkages by loops in the family.

Members, or slices of one, are the nodes of a graph; along every edge each solution is followed once, those of all edges
side by side. T. Duff, C. Hill, A. Jensen, K. Lee, A. Leykin, J. Sommars, Solving polynomial systems via homotopy
continuation and monodromy, IMA J. Numer. Anal. 39, 2019.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import permutations
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from planar.assemblies.polynomial.path_tracker import MAX_STEPS, Homotopy, PathEnds, normalize, track_paths
from planar.foundation.arrays import BoolArray, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.first_solution import first_solution
from planar.synthesis.exact.tracking.member_homotopy import EdgeHomotopy, MemberHomotopy, homogeneous_solutions
from planar.synthesis.exact.tracking.symmetry import Images, first_of_same, representatives

BLOCK, FEW = 4096, 128
"""Paths that are followed side by side, at most, and so few that more of them cost no more time."""
PREDICTION, CORRECTION, STEPS = 3e-2, 1e-4, 600
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
        """Follow what has not been followed along all edges, each in the direction with the more of it, or in both
        where that is few; False where there is none."""
        edges = list(permutations([k for k in range(len(self.nodes)) if k not in self.leaves], 2))
        open_rows = {edge: self._open(*edge) for edge in edges}
        if sum(map(len, open_rows.values())) > FEW:
            edges = [max(edge, edge[::-1], key=lambda one: len(open_rows[one])) for edge in edges if edge[0] < edge[1]]
        batch, room = [], BLOCK
        for i, j in edges:
            rows = open_rows[i, j][:room]
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


FIRST_NODES, IDLE_NODES = 4, 2
"""Members at first, each with a linkage of its own, and how many more must bring nothing new."""
KEPT_FROM = 64
"""Solutions from which on every edge that was followed is kept, so that a search may go on from there."""
CLOSER_STEPS = 20 * MAX_STEPS
"""Of a path that is followed with the digits of long doubles: near members with solutions that meet it takes many."""
FOLLOWED_CORRECTION = 1e-7
"""What Newton's second step may still move a solution by: paths that leap for it are seen, as two come to one."""


class GenericSolutions(NamedTuple):
    """A random member with the solutions V that were found of it."""

    member: Member
    V: ComplexArray


class GraphStore(Protocol):
    """Where a search that is not at its end is kept."""

    def read(self) -> dict[str, Any] | None:
        """What was kept, None where nothing was."""

    def write(self, content: dict[str, Any]) -> None:
        """Keep it."""


def find_generic_solutions(
    family: Family,
    images: Images | None = None,
    seed: int = 5,
    enough: int | None = None,
    progress: Callable[[int], None] | None = None,
    store: GraphStore | None = None,
) -> GenericSolutions:
    """The solutions of a random member, one of those that are `images` of each other; no more than are `enough`. With a
    `store` the search goes on from where it was."""
    search = GenericSearch(family, images, seed, progress, store)
    search.close(enough)
    return search.solutions


class GenericSearch:
    """A search for the solutions of a random member, which can be extended."""

    def __init__(
        self,
        family: Family,
        images: Images | None = None,
        seed: int = 5,
        progress: Callable[[int], None] | None = None,
        store: GraphStore | None = None,
    ):
        self.family, self.seed, self.progress, self.store = family, seed, progress, store
        self.graph: SolutionGraph[Member] = SolutionGraph(
            lambda nodes, edges: EdgeHomotopy(family, nodes, edges), images
        )
        kept = None if store is None else store.read()
        if kept is not None:
            take_arrays(self.graph, len(family.parts), kept)

    @property
    def solutions(self) -> GenericSolutions:
        """The member with the most solutions that are known."""
        best = max(range(len(self.graph.nodes)), key=lambda k: len(self.graph.solutions[k]))
        return GenericSolutions(self.graph.nodes[best], self.graph.solutions[best])

    def extend(self, known: GenericSolutions) -> GenericSolutions:
        """The solutions of a member with those that members of this search lead to."""
        self.graph.add_node(known.member, known.V)
        self.close()
        return GenericSolutions(self.graph.nodes[0], self.graph.solutions[0])

    def close(self, enough: int | None = None) -> None:
        """Go round between the members until linkages of others bring nothing new, or so many are known."""
        graph = self.graph
        while len(graph.nodes) < FIRST_NODES:
            self.add_linkage()
        before = -1
        while len(graph.solutions[0]) > before:
            while graph.follow_open_edges():
                if self.progress is not None:
                    self.progress(graph.most)
                if self.store is not None and graph.most >= KEPT_FROM:
                    self.store.write(to_arrays(graph))
                if enough is not None and len(graph.solutions[0]) >= enough:
                    return
            before = len(graph.solutions[0])
            # linkages more, at the first member
            rngs = [np.random.default_rng([self.seed, 1, len(graph.nodes), graph.most, k]) for k in range(IDLE_NODES)]
            members, x = zip(*(first_solution(self.family, rng) for rng in rngs), strict=True)
            edges = np.stack([1 + np.arange(IDLE_NODES), np.zeros(IDLE_NODES, dtype=int)], axis=1)
            between = EdgeHomotopy(self.family, [graph.nodes[0], *members], edges)
            ends = track_paths(between, homogeneous_solutions(np.array(x)), PREDICTION, CORRECTION)
            graph.add_solutions(0, ends.V[ends.is_single])

    def add_linkage(self) -> None:
        """A member more, with the linkage that it was made for."""
        member, x = first_solution(self.family, np.random.default_rng([self.seed, len(self.graph.nodes)]))
        self.graph.add_node(member, homogeneous_solutions(x[None]))


def to_arrays(graph: SolutionGraph[Member]) -> dict[str, Any]:
    """A graph by names, to be kept."""
    content: dict[str, Any] = {"nodes": np.array(len(graph.nodes))}
    for k, (member, V) in enumerate(zip(graph.nodes, graph.solutions, strict=True)):
        content |= {f"V {k}": V} | {f"part {k} {n}": part for n, part in enumerate(member.parts)}
    return content | {f"followed {i} {j}": done for (i, j), done in graph.followed.items()}


def take_arrays(graph: SolutionGraph[Member], part_count: int, content: dict[str, Any]) -> None:
    """Go on from what was kept."""
    for k in range(int(content["nodes"])):
        graph.nodes.append(Member(tuple(content[f"part {k} {n}"] for n in range(part_count))))
        graph.solutions.append(content[f"V {k}"])
    for name, done in content.items():
        if name.startswith("followed"):
            i, j = map(int, name.split()[1:])
            graph.followed[i, j] = done


def follow(
    family: Family, begin: Member, V: ComplexArray, end: Member, near: float, long_steps: int | None = None
) -> PathEnds:
    """Solutions of one member followed to another, many at a time; in at most so many `long_steps` with the digits of
    long doubles, where any are given."""
    between = MemberHomotopy(family, begin, end)
    start = V if long_steps is None else V.astype(np.clongdouble)
    blocks = [
        track_paths(between, start[k : k + BLOCK], near, FOLLOWED_CORRECTION, long_steps or MAX_STEPS)
        for k in range(0, max(len(V), 1), BLOCK)
    ]
    ends = PathEnds(*(np.concatenate(each) for each in zip(*blocks, strict=True)))
    return ends._replace(V=ends.V.astype(complex))
