"""A chain of numbered links from its contracted graph, and back: so each chain has one numbering of its links."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain as joined
from itertools import groupby, permutations, product
from typing import NamedTuple

from planar.structures.canonical_form import Counts, Numbering, greatest_numberings
from planar.structures.contracted_graphs import ContractedGraph, vertex_degrees
from planar.structures.rigid_parts import Joint
from planar.structures.symmetry import Automorphism, neighbour_sets


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


class _Contraction(NamedTuple):
    """The links with three and more joints, how many paths join each two, and those paths, longer ones first.

    A path begins at the end whose place is lower, and holds its ends. What is marked stands for no other.
    """

    many: list[int]
    counts: Counts
    paths: dict[Joint, list[list[int]]]
    marked: tuple[bool, ...]

    def bundles(self, numbering: Sequence[int]) -> Iterator[list[list[int]]]:
        """The paths between each two that some join, in the order of the word for a numbering, from the lower to the
        higher number."""
        number = {link: k for k, link in enumerate(numbering)}
        ends = sorted(sorted((number[a], number[b])) for a, b in self.paths)
        for low, high in ends:
            a, b = numbering[low], numbering[high]
            yield [path if a <= b else path[::-1] for path in self.paths[min(a, b), max(a, b)]]

    def row(self, numbering: Sequence[int]) -> list[int]:
        """How many binary links are on each edge."""
        return [len(path) - 2 for bundle in self.bundles(numbering) for path in bundle]

    def best_numberings(self) -> tuple[tuple[int, ...], list[Numbering]]:
        """The greatest word, and those of its numberings that give the greatest row."""
        degrees = vertex_degrees(self.counts)
        ranks = [2 * degree + mark for degree, mark in zip(degrees, self.marked, strict=True)]
        word, numberings = greatest_numberings(self.counts, ranks)
        rows = [self.row(each) for each in numberings]
        greatest = max(rows)
        return word, [each for each, row in zip(numberings, rows, strict=True) if row == greatest]

    def link_order(self, numbering: Sequence[int], paths: Iterable[Sequence[int]]) -> list[int]:
        """All links in the order of their numbers, with the paths in an order that keeps the row."""
        return [*(self.many[index] for index in numbering), *joined.from_iterable(path[1:-1] for path in paths)]


def canonical_chain(links: int, joints: Sequence[Joint], marked: int = 0) -> CanonicalChain:
    """A connected chain, each of whose links has two and more joints, in the numbering that all of its kind share.

    The links with three and more joints are numbered so that the word of the contracted graph is greatest, and of
    such numberings so that the numbers of binary links, edge by edge, make the greatest word. The last ones are
    `marked`, so many, each with three joints or more: they are told from others, and stand before those with as many.
    """
    beside = neighbour_sets(links, joints)
    if max(map(len, beside)) == 2:
        order = _ring_order(beside)
        return CanonicalChain(ring_joints(links), tuple(order.index(link) for link in range(links)))
    found = _contract(beside, marked)
    word, (best, *_) = found.best_numberings()
    order = found.link_order(best, joined.from_iterable(found.bundles(best)))
    number = {link: index for index, link in enumerate(order)}
    named = sorted((min(pair), max(pair)) for pair in ((number[a], number[b]) for a, b in joints))
    return CanonicalChain(tuple(named), tuple(number[link] for link in range(links)), word, tuple(found.row(best)))


def automorphisms(links: int, joints: Sequence[Joint], marked: int = 0) -> Iterator[Automorphism]:
    """Every exchange of the links of a connected chain that keeps its joints and the last, `marked` ones, first none.

    An automorphism of the contracted graph that keeps the row, with any order of paths that are equally long between
    the same links, and any sense of a path that comes back to its link.
    """
    beside = neighbour_sets(links, joints)
    if max(map(len, beside)) == 2:
        ring = _ring_order(beside)
        orders: Iterable[list[int]] = (
            turned[k:] + turned[:k] for turned in (ring, ring[::-1]) for k in range(len(ring))
        )
        first = ring
    else:
        found = _contract(beside, marked)
        _, numberings = found.best_numberings()
        orders = (
            found.link_order(each, joined.from_iterable(paths))
            for each in numberings
            for paths in product(*map(_arrangements, found.bundles(each)))
        )
        first = found.link_order(numberings[0], joined.from_iterable(found.bundles(numberings[0])))
    place = {link: index for index, link in enumerate(first)}
    for order in orders:
        yield tuple(order[place[link]] for link in range(links))


def _arrangements(bundle: Sequence[Sequence[int]]) -> list[list[Sequence[int]]]:
    """Orders and senses of the paths between two links that keep how long they are one after the other."""
    ways: list[list[Sequence[int]]] = [[]]
    for _, alike in groupby(bundle, key=len):
        orders = [*permutations(alike)]
        if bundle[0][0] == bundle[0][-1]:
            orders = [turned for order in orders for turned in product(*((path, path[::-1]) for path in order))]
        ways = [[*way, *order] for way in ways for order in orders]
    return ways


def _contract(beside: Sequence[set[int]], marked: int) -> _Contraction:
    many = [link for link in range(len(beside)) if len(beside[link]) > 2]
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
    return _Contraction(many, tuple(map(tuple, counts)), paths, tuple(link >= len(beside) - marked for link in many))


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
