"""Contracted graphs: links with three and more joints as vertices, the chains of binary links between them as edges."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

from planar.foundation.time_limit import stop_if_over
from planar.structures.canonical_form import Counts, Numbering, greatest_numberings


class ContractedGraph(NamedTuple):
    """A contracted graph in its canonical numbering, with its automorphisms, the identity among them.

    `degrees` fall; `word` is the greatest one of its edge counts. A loop counts twice in its vertex's degree.
    """

    counts: Counts
    degrees: tuple[int, ...]
    word: tuple[int, ...]
    automorphisms: tuple[Numbering, ...]

    @property
    def bundles(self) -> tuple[tuple[int, int, int], ...]:
        """The vertices that edges join, the lower one first, and how many edges do, in the order of the word."""
        size = len(self.counts)
        return tuple((i, j, self.counts[i][j]) for i in range(size) for j in range(i, size) if self.counts[i][j])


def canonical_graph(counts: Counts) -> ContractedGraph:
    """A graph in the numbering of its greatest word, vertices of higher degree first."""
    degrees = vertex_degrees(counts)
    word, numberings = greatest_numberings(counts, degrees)
    order = numberings[0]
    place = {vertex: index for index, vertex in enumerate(order)}
    return ContractedGraph(
        tuple(tuple(counts[a][b] for b in order) for a in order),
        tuple(degrees[a] for a in order),
        word,
        tuple(tuple(place[vertex] for vertex in each) for each in numberings),
    )


def vertex_degrees(counts: Counts) -> tuple[int, ...]:
    """How many edges end at each vertex, a loop with both its ends."""
    return tuple(sum(row) + row[index] for index, row in enumerate(counts))


@lru_cache(maxsize=16)
def contracted_graphs(loops: int, fractionated: bool) -> tuple[ContractedGraph, ...]:
    """All connected graphs of two and more independent loops whose vertices have degree three and more.

    In order: those first that no single vertex parts; then by their degrees, the smaller word first; then by the word
    of their edges, the greater first.
    Without `fractionated` those alone that no single vertex parts. Each comes of a cubic one by drawing together edges:
    a vertex of higher degree can be split, and that without a new vertex that parts the graph.
    """
    level = {each.word: each for each in _cubic_graphs(loops, fractionated)}
    found = [*level.values()]
    while level:
        smaller: dict[tuple[int, ...], ContractedGraph] = {}
        for each in level.values():
            stop_if_over(f"after {len(found)} contracted graphs")
            for drawn in _merge_each_edge(each, fractionated):
                graph = canonical_graph(drawn)
                smaller[(*graph.degrees, *graph.word)] = graph
        found += smaller.values()
        level = smaller
    return tuple(
        sorted(
            found, key=lambda each: (has_cut_vertex(each.counts), each.degrees, tuple(-count for count in each.word))
        )
    )


def _cubic_graphs(loops: int, fractionated: bool) -> tuple[ContractedGraph, ...]:
    """Those of degree three throughout: of each with a loop less, two edges joined, or a loop hung on an edge."""
    if loops == 2:
        starts: list[Counts] = [((0, 3), (3, 0)), *([((1, 1), (1, 1))] if fractionated else [])]
        return tuple(canonical_graph(each) for each in starts)
    found: dict[tuple[int, ...], ContractedGraph] = {}
    for smaller in _cubic_graphs(loops - 1, fractionated):
        for larger in _extend_cubic(smaller, fractionated):
            graph = canonical_graph(larger)
            found[graph.word] = graph
    return tuple(found.values())


def _extend_cubic(graph: ContractedGraph, fractionated: bool) -> Iterator[Counts]:
    size = len(graph.counts)
    edges = [(i, j) for i, j, count in graph.bundles for _ in range(min(count, 2))]
    for index, (a, b) in enumerate(edges):
        split = _with_edges(graph.counts, 2, ((a, b, -1), (a, size, 1)))
        yield _with_edges(split, 0, ((size, size + 1, 2), (size + 1, b, 1)))
        if fractionated:
            yield _with_edges(split, 0, ((size, b, 1), (size, size + 1, 1), (size + 1, size + 1, 1)))
        for c, d in edges[index + 1 :]:
            halved = _with_edges(split, 0, ((size, b, 1), (c, d, -1), (c, size + 1, 1), (size + 1, d, 1)))
            yield _with_edges(halved, 0, ((size, size + 1, 1),))


def _with_edges(counts: Counts, more: int, changes: tuple[tuple[int, int, int], ...]) -> Counts:
    """A graph with so many more vertices, and other numbers of edges."""
    rows = [[*row, *[0] * more] for row in counts] + [[0] * (len(counts) + more) for _ in range(more)]
    for i, j, change in changes:
        rows[i][j] += change
        if i != j:
            rows[j][i] += change
    return tuple(map(tuple, rows))


def _merge_each_edge(graph: ContractedGraph, fractionated: bool) -> Iterator[Counts]:
    """The graphs that drawing two vertices together gives, the other edges between them becoming loops."""
    for i, j, count in graph.bundles:
        if i == j or (count > 1 and not fractionated):
            continue
        rows = [list(row) for row in graph.counts]
        loops = rows[i][i] + rows[j][j] + count - 1
        for k in range(len(rows)):
            rows[i][k] += rows[j][k]
            rows[k][i] = rows[i][k]
        rows[i][i] = loops
        drawn = tuple(tuple(row[:j] + row[j + 1 :]) for row in (*rows[:j], *rows[j + 1 :]))
        if fractionated or not has_cut_vertex(drawn):
            yield drawn


def has_cut_vertex(counts: Counts) -> bool:
    """Whether a vertex parts the graph: what is between any two others goes through it, or it has a loop of its own."""
    if len(counts) == 1:
        return counts[0][0] > 1
    if any(row[index] for index, row in enumerate(counts)):
        return True
    return len(counts) > 2 and any(not _is_connected_without(counts, vertex) for vertex in range(len(counts)))


def _is_connected_without(counts: Counts, left_out: int) -> bool:
    start = 0 if left_out else 1
    reached, waiting = {left_out, start}, [start]
    while waiting:
        for other, count in enumerate(counts[waiting.pop()]):
            if count and other not in reached:
                reached.add(other)
                waiting.append(other)
    return len(reached) == len(counts)
