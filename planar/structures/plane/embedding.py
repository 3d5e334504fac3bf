"""A chain in the plane without lengths: the order of joints round each link, and the faces between the links."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, islice, pairwise, permutations
from random import Random
from typing import Any, NamedTuple

from planar.structures.rigid_parts import Joint

Node = tuple[str, int]
Crossings = tuple[tuple[int, int], ...]
"""Two binary links each that cross, in the order in which a link meets them from its first joint on."""
MAX_CROSSINGS = 2
"""Of more crossings no choice is looked for."""
MAX_CHOICES = 6
"""Choices of crossings that are tried."""


class PlaneEmbedding(NamedTuple):
    """Spots are the joints by their numbers, and after them the points where two bars cross, if any do.

    `rotations` are the joints of each link in their order round it, `faces` the spots round each face between links;
    `ties` are two spots each between which nothing is drawn, which hold parts together that one joint joins.
    `crossings` are the binary links that cross.
    """

    rotations: tuple[tuple[int, ...], ...]
    faces: tuple[tuple[int, ...], ...]
    ties: tuple[Joint, ...]
    crossings: Crossings

    @property
    def spots(self) -> int:
        """How many joints and crossings there are."""
        return 1 + max(map(max, self.rotations)) + len(self.crossings)

    def bar_path(self, link: int) -> tuple[int, ...]:
        """The spots on a bar: its joints, and its crossings between them."""
        first, last = self.rotations[link]
        joints = self.spots - len(self.crossings)
        return first, *(joints + k for k, both in enumerate(self.crossings) if link in both), last

    def sides(self) -> list[Joint]:
        """The lines to be drawn, by their spots, each once: of bars from spot to spot, of other links those round."""
        found = []
        for link, round_it in enumerate(self.rotations):
            path = self.bar_path(link) if len(round_it) == 2 else (*round_it, round_it[0])
            found += [(min(ends), max(ends)) for ends in pairwise(path)]
        return sorted(found)


def plane_embeddings(links: int, joints: Sequence[Sequence[int]], count: int) -> Iterator[PlaneEmbedding]:
    """Some embeddings of a chain, with as few crossings of bars as there are choices of; nothing where it has none.

    The chain's nodes are given in other orders each time, so that where it has several embeddings others may be found.
    """
    random = Random(0)
    for crossed in range(MAX_CROSSINGS + 1):
        fitting = (each for each in _crossing_choices(links, joints, crossed) if _is_planar(joints, each))
        found = False
        for crossings in islice(fitting, MAX_CHOICES):
            for _ in range(count):
                found = True
                yield _embed(links, joints, crossings, random)
        if found:
            return


def _crossing_choices(links: int, joints: Sequence[Sequence[int]], count: int) -> Iterator[Crossings]:
    """So many choices of two bars without a common joint; where a bar has several crossings in all their orders."""
    known = {pair for joint in joints for pair in combinations(joint, 2)}
    bars = [link for link in range(links) if sum(link in joint for joint in joints) == 2]
    pairs = [pair for pair in combinations(bars, 2) if pair not in known]
    for chosen in combinations(pairs, count):
        several = len({link for pair in chosen for link in pair}) < 2 * len(chosen)
        yield from permutations(chosen) if several else (chosen,)


def _nodes_and_edges(joints: Sequence[Sequence[int]], crossings: Crossings) -> list[tuple[Node, Node]]:
    """Links and joints as nodes; where bars cross is one, too."""
    found: list[tuple[Node, Node]] = []
    crossed = {link for both in crossings for link in both}
    for number, joint in enumerate(joints):
        found += [(("joint", number), ("link", link)) for link in joint if link not in crossed]
    for link in sorted(crossed):
        first, last = (number for number, joint in enumerate(joints) if link in joint)
        between = [("crossing", k) for k, both in enumerate(crossings) if link in both]
        path = [("joint", first), *between, ("joint", last)]
        found += pairwise(path)
    return found


def _is_planar(joints: Sequence[Sequence[int]], crossings: Crossings) -> bool:
    from networkx import Graph, check_planarity

    return bool(check_planarity(Graph(_nodes_and_edges(joints, crossings)))[0])


def _embed(links: int, joints: Sequence[Sequence[int]], crossings: Crossings, random: Random) -> PlaneEmbedding:
    """One embedding of a chain that has one."""
    from networkx import Graph, check_planarity

    edges = _nodes_and_edges(joints, crossings)
    random.shuffle(edges)
    graph = Graph(edges)
    ties = _ties_over_bridges(graph, joints)
    graph.add_edges_from((("joint", a), ("joint", b)) for a, b in ties)
    _, found = check_planarity(graph)
    rotations = []
    for link in range(links):
        if ("link", link) in graph:
            around = found.neighbors_cw_order(("link", link))
            round_it = tuple(number for what, number in around if what == "joint")
            rotations.append(round_it if len(round_it) > 2 else tuple(sorted(round_it)))
        else:
            rotations.append(tuple(number for number, joint in enumerate(joints) if link in joint))
    seen: set[tuple[Any, Any]] = set()
    faces = []
    for edge in found.edges:
        if edge not in seen:
            walk = found.traverse_face(*edge, mark_half_edges=seen)
            spots = [number + len(joints) * (what == "crossing") for what, number in walk if what != "link"]
            faces.append(tuple(spots))
    return PlaneEmbedding(tuple(rotations), tuple(faces), ties, crossings)


def _ties_over_bridges(graph: Any, joints: Sequence[Sequence[int]]) -> tuple[Joint, ...]:
    """For each joint that alone joins two parts, two joints beside it, one of each part."""
    from networkx import articulation_points

    found = []
    for what, number in [*articulation_points(graph)]:
        if what == "joint":
            sides = [
                sorted(k for k, joint in enumerate(joints) if link in joint and k != number) for link in joints[number]
            ]
            found.append((sides[0][0], sides[1][0]))
    return tuple(found)
