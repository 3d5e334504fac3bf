"""The solutions of a random member of a family, found from one of them by going round in the family.

Members are the nodes of a graph; along every edge each solution is followed once. T. Duff, C. Hill, A. Jensen, K. Lee,
A. Leykin, J. Sommars, Solving polynomial systems via homotopy continuation and monodromy, IMA J. Numer. Anal. 39, 2019.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple, Protocol

import numpy as np

from planar.assemblies.polynomial.path_tracker import MAX_STEPS, PathEnds, track_paths
from planar.foundation.arrays import ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.first_solution import first_solution
from planar.synthesis.exact.tracking.member_graph import BLOCK, MemberGraph
from planar.synthesis.exact.tracking.member_homotopy import MemberHomotopy, homogeneous_solutions
from planar.synthesis.exact.tracking.symmetry import Images

FIRST_NODES, IDLE_NODES = 4, 2
"""Members at first, and how many more must bring nothing new."""
KEPT_FROM = 64
"""Solutions from which on every edge that was followed is kept, so that a search may go on from there."""
CLOSER_STEPS = 20 * MAX_STEPS
"""Of a path that is followed with the digits of long doubles: near members with solutions that meet it takes many."""
CORRECTION = 1e-7
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
    graph = MemberGraph(family, images)
    kept = None if store is None else store.read()
    idle, before = 0, 0
    if kept is not None:
        graph.take_arrays(kept)
        idle, before = int(kept["idle"]), int(kept["before"])
    else:
        member, x = first_solution(family, np.random.default_rng(seed))
        graph.add_node(member, homogeneous_solutions(x[None]))
        while len(graph.nodes) < FIRST_NODES:
            _add_random_node(graph, seed)
        before = graph.most
    while True:
        while graph.follow_one_edge():
            if progress is not None:
                progress(graph.most)
            if enough is not None and len(graph.solutions[0]) >= enough:
                return GenericSolutions(graph.nodes[0], graph.solutions[0])
            if store is not None and graph.most >= KEPT_FROM:
                store.write(graph.to_arrays() | {"idle": np.array(idle), "before": np.array(before)})
        idle = idle + 1 if graph.most == before else 0
        if idle > IDLE_NODES:
            best = max(range(len(graph.nodes)), key=lambda k: len(graph.solutions[k]))
            return GenericSolutions(graph.nodes[best], graph.solutions[best])
        before = graph.most
        _add_random_node(graph, seed)


def _add_random_node(graph: MemberGraph, seed: int) -> None:
    rng = np.random.default_rng([seed, len(graph.nodes)])
    graph.add_node(graph.family.random_member(rng), graph.solutions[0][:0])


def follow(
    family: Family, begin: Member, V: ComplexArray, end: Member, near: float, long_steps: int | None = None
) -> PathEnds:
    """Solutions of one member followed to another, many at a time; in at most so many `long_steps` with the digits of
    long doubles, where any are given."""
    between = MemberHomotopy(family, begin, end)
    start = V if long_steps is None else V.astype(np.clongdouble)
    blocks = [
        track_paths(between, start[k : k + BLOCK], near, CORRECTION, long_steps or MAX_STEPS)
        for k in range(0, max(len(V), 1), BLOCK)
    ]
    ends = PathEnds(*(np.concatenate(each) for each in zip(*blocks, strict=True)))
    return ends._replace(V=ends.V.astype(complex))
