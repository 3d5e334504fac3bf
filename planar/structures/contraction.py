"""A chain of numbered links from its contracted graph, and back: so each chain has one numbering of its links."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain as joined
from typing import NamedTuple

from planar.structures.canonical_form import greatest_numberings
from planar.structures.contracted_graphs import ContractedGraph, vertex_degrees
from planar.structures.rigid_parts import Joint
from planar.structures.symmetry import neighbour_sets


class CanonicalChain(NamedTuple):
    """A chain in its own numbering: its joints by the numbers of their links, and the number of each link given.

    `word` is that of its contracted graph, `row` how many binary links are on each of its edges.
    """

    joints: tuple[Joint, ...]
    numbers: tuple[int, ...]
    word: tuple[int, ...] = ()
    row: tuple[int, ...] = ()


def expand_graph(graph: ContractedGraph, row: Sequence[int]) -> tuple[Joint, ...]:
    """The joints of a chain: links with three and more joints first, as the vertices, then binary ones edge by edge."""
    ends = [(i, j) for i, j, count in graph.bundles for _ in range(count)]
    following = len(graph.counts)
    paths = []
    for (i, j), binary in zip(ends, row, strict=True):
        paths.append([i, *range(following, following + int(binary)), j])
        following += int(binary)
    return _joints_of_paths(paths)


def ring_joints(links: int) -> tuple[Joint, ...]:
    """The joints of a single loop."""
    return _joints_of_paths([[*range(links), 0]])


def _joints_of_paths(paths: Iterable[Sequence[int]]) -> tuple[Joint, ...]:
    steps = ((path[k], path[k + 1]) for path in paths for k in range(len(path) - 1))
    return tuple(sorted((min(step), max(step)) for step in steps))


def canonical_chain(links: int, joints: Sequence[Joint]) -> CanonicalChain:
    """A connected chain, each of whose links has two and more joints, in the numbering that all of its kind share.

    The links with three and more joints are numbered so that the word of the contracted graph is greatest, and of
    such numberings so that the numbers of binary links, edge by edge, make the greatest word.
    """
    beside = neighbour_sets(links, joints)
    many = [link for link in range(links) if len(beside[link]) > 2]
    if not many:
        order = _ring_order(beside)
        return CanonicalChain(ring_joints(links), tuple(order.index(link) for link in range(links)))
    place = {link: index for index, link in enumerate(many)}
    counts = [[0] * len(many) for _ in many]
    paths: dict[Joint, list[list[int]]] = {}
    for path in _paths_between(beside, many):
        i, j = place[path[0]], place[path[-1]]
        counts[i][j] += 1
        if i != j:
            counts[j][i] += 1
        paths.setdefault((min(i, j), max(i, j)), []).append(path if i <= j else path[::-1])
    for bundle in paths.values():
        bundle.sort(key=len, reverse=True)
    table = tuple(map(tuple, counts))
    word, numberings = greatest_numberings(table, vertex_degrees(table))

    def ordered(numbering: Sequence[int]) -> Iterator[list[int]]:
        for k, a in enumerate(numbering):
            for b in numbering[k:]:
                for path in paths.get((min(a, b), max(a, b)), ()):
                    yield path if a <= b else path[::-1]

    best = max(numberings, key=lambda numbering: [len(path) for path in ordered(numbering)])
    first = [many[index] for index in best]
    order = [*first, *joined.from_iterable(path[1:-1] for path in ordered(best))]
    number = {link: index for index, link in enumerate(order)}
    named = sorted((min(pair), max(pair)) for pair in ((number[a], number[b]) for a, b in joints))
    row = tuple(len(path) - 2 for path in ordered(best))
    return CanonicalChain(tuple(named), tuple(number[link] for link in range(links)), word, row)


def _ring_order(beside: Sequence[set[int]]) -> list[int]:
    order = [0, min(beside[0])]
    while len(order) < len(beside):
        order.append(next(link for link in beside[order[-1]] if link != order[-2]))
    return order


def _paths_between(beside: Sequence[set[int]], many: Sequence[int]) -> Iterator[list[int]]:
    """Each chain of binary links once, with the links at its ends."""
    ends = {*many}
    for start in many:
        for step in sorted(beside[start]):
            path = [start, step]
            while path[-1] not in ends:
                path.append(next(link for link in beside[path[-1]] if link != path[-2]))
            back = (path[-1], path[-2], len(path))
            if (start, step, len(path)) <= back:  # of the two ways along it one
                yield path
