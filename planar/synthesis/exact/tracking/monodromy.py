"""The solutions of a random member of a family, found from one of them by going round in the family.

Members are the nodes of a graph; along every edge each solution is followed once. T. Duff, C. Hill, A. Jensen, K. Lee,
A. Leykin, J. Sommars, Solving polynomial systems via homotopy continuation and monodromy, IMA J. Numer. Anal. 39, 2019.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.path_tracker import PathEnds, normalize, track_paths
from planar.foundation.arrays import BoolArray, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.first_solution import first_solution
from planar.synthesis.exact.tracking.member_homotopy import MemberHomotopy, homogeneous_solutions
from planar.synthesis.exact.tracking.symmetry import Images, representatives, solution_keys

FIRST_NODES, IDLE_NODES = 4, 2
"""Members at first, and how many more must bring nothing new."""
SAME = 1e-7
"""Of directions of length one: solutions nearer to each other are one. Two that are nearly real are no farther apart
than their imaginary parts."""
BLOCK = 4096
"""Paths that are followed side by side."""
CORRECTION = 1e-7
"""What Newton's second step may still move a solution by: paths that leap for it are seen, as two come to one."""


class GenericSolutions(NamedTuple):
    """A random member with the solutions V that were found of it."""

    member: Member
    V: ComplexArray


def find_generic_solutions(
    family: Family,
    images: Images | None = None,
    seed: int = 5,
    enough: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> GenericSolutions:
    """The solutions of a random member, one of those that are `images` of each other; no more than are `enough`."""
    rng = np.random.default_rng(seed)
    member, x = first_solution(family, rng)
    graph = _MemberGraph(family, member, homogeneous_solutions(x[None]), images)
    for _ in range(FIRST_NODES - 1):
        graph.add_node(family.random_member(rng))
    idle = 0
    while True:
        before = graph.most
        while graph.follow_one_edge():
            if progress is not None:
                progress(graph.most)
            if enough is not None and len(graph.solutions[0]) >= enough:
                return GenericSolutions(graph.nodes[0], graph.solutions[0])
        idle = idle + 1 if graph.most == before else 0
        if idle > IDLE_NODES:
            best = max(range(len(graph.nodes)), key=lambda k: len(graph.solutions[k]))
            return GenericSolutions(graph.nodes[best], graph.solutions[best])
        graph.add_node(family.random_member(rng))


class _MemberGraph:
    def __init__(self, family: Family, member: Member, V: ComplexArray, images: Images | None):
        self.family, self.images = family, images
        self.nodes: list[Member] = [member]
        self.solutions: list[ComplexArray] = [normalize(representatives(V, images))]
        self.followed: dict[tuple[int, int], BoolArray] = {}
        "which solutions of the first node have been followed to the second, or met from there"

    @property
    def most(self) -> int:
        """The greatest number of solutions at any node."""
        return max(map(len, self.solutions))

    def add_node(self, member: Member) -> None:
        """A member more."""
        self.nodes.append(member)
        self.solutions.append(self.solutions[0][:0])

    def _open(self, i: int, j: int) -> IntArray:
        done = self.followed.get((i, j), np.zeros(0, dtype=bool))
        done = np.concatenate([done, np.zeros(len(self.solutions[i]) - len(done), dtype=bool)])
        self.followed[i, j] = done
        return np.flatnonzero(~done)

    def follow_one_edge(self) -> bool:
        """Follow what has not been followed yet along the edge with the most of it; False where there is none."""
        many = len(self.nodes)
        edges = [(i, j) for i in range(many) for j in range(many) if i != j]
        i, j = max(edges, key=lambda edge: len(self._open(*edge)))
        rows = self._open(i, j)[:BLOCK]
        if not len(rows):
            return False
        ends = track_paths(MemberHomotopy(self.family, self.nodes[i], self.nodes[j]), self.solutions[i][rows])
        self.followed[i, j][rows] = True
        arrived = normalize(representatives(ends.V[ends.is_single], self.images))
        known = len(self.solutions[j])
        both = np.concatenate([self.solutions[j], arrived])
        first = first_of_same(both)
        new = np.flatnonzero(first[known:] == np.arange(known, len(both)))
        self.solutions[j] = np.concatenate([self.solutions[j], arrived[new]])
        self._open(j, i)
        place = {int(k): n for n, k in enumerate([*range(known), *(known + new)])}
        self.followed[j, i][[place[int(k)] for k in first[known:]]] = True
        return True


def first_of_same(V: ComplexArray) -> IntArray:
    """Of each solution the first that is the same (solutions,)."""
    found: IntArray = np.arange(len(V))
    if len(V) < 2:
        return found
    half, key = V.shape[1] // 2, solution_keys(V)
    parts = V[:, :half], V[:, half:]
    order = np.argsort(key.real, kind="stable")
    unit = [each / np.linalg.norm(each, axis=1, keepdims=True) for each in parts]
    room = 1e3 * SAME * np.maximum(1.0, np.abs(key))
    for at, k in enumerate(order.tolist()):
        for other in order[at + 1 :].tolist():
            if key[other].real - key[k].real > room[k]:
                break
            apart = max(np.linalg.norm(each[other] - np.vdot(each[k], each[other]) * each[k]) for each in unit)
            if apart < SAME:
                low = min(found[k], found[other])
                found[k] = found[other] = low
    return found


def follow(
    family: Family, begin: Member, V: ComplexArray, end: Member, near: float, has_more_digits: bool = False
) -> PathEnds:
    """Solutions of one member followed to another, many at a time; with the digits of long doubles where asked for."""
    between = MemberHomotopy(family, begin, end)
    start = V.astype(np.clongdouble) if has_more_digits else V
    blocks = [track_paths(between, start[k : k + BLOCK], near, CORRECTION) for k in range(0, max(len(V), 1), BLOCK)]
    ends = PathEnds(*(np.concatenate(each) for each in zip(*blocks, strict=True)))
    return ends._replace(V=ends.V.astype(complex))
