"""Members of a family as the nodes of a graph, with the solutions that are known of each, and what was followed."""

from __future__ import annotations

from typing import Any

import numpy as np

from planar.assemblies.polynomial.path_tracker import normalize, track_paths
from planar.foundation.arrays import BoolArray, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.member_homotopy import MemberHomotopy
from planar.synthesis.exact.tracking.same_solutions import first_of_same
from planar.synthesis.exact.tracking.symmetry import Images, representatives

BLOCK = 4096
"""Paths that are followed side by side."""


class MemberGraph:
    """Nodes and solutions; of solutions that are `images` of each other one stands for all."""

    def __init__(self, family: Family, images: Images | None):
        self.family, self.images = family, images
        self.nodes: list[Member] = []
        self.solutions: list[ComplexArray] = []
        self.followed: dict[tuple[int, int], BoolArray] = {}
        "which solutions of the first node have been followed to the second, or met from there"

    @property
    def most(self) -> int:
        """The greatest number of solutions at any node."""
        return max(map(len, self.solutions))

    def add_node(self, member: Member, V: ComplexArray) -> None:
        """A member more, with solutions that are known of it."""
        self.nodes.append(member)
        self.solutions.append(normalize(representatives(V, self.images)))

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

    def to_arrays(self) -> dict[str, Any]:
        """All of it by names, to be kept."""
        found: dict[str, Any] = {"nodes": np.array(len(self.nodes))}
        for k, (member, V) in enumerate(zip(self.nodes, self.solutions, strict=True)):
            found |= {f"V {k}": V} | {f"part {k} {n}": part for n, part in enumerate(member.parts)}
        return found | {f"followed {i} {j}": done for (i, j), done in self.followed.items()}

    def take_arrays(self, kept: dict[str, Any]) -> None:
        """Go on from what was kept."""
        for k in range(int(kept["nodes"])):
            self.nodes.append(Member(tuple(kept[f"part {k} {n}"] for n in range(len(self.family.parts)))))
            self.solutions.append(kept[f"V {k}"])
        for name, done in kept.items():
            if name.startswith("followed"):
                i, j = map(int, name.split()[1:])
                self.followed[i, j] = done
