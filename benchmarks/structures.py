"""How long it takes to list all kinematic chains, link by link, beside the way without symmetry: every set of joints.

    python -m benchmarks.structures [MOST]

For each number of links, up to MOST (12), of freedom 1: how many chains there are and how long they take, then their
inversions and mechanisms with Assur groups, and the chains in which one and two joints slide. Beside it, where that
ends in time, the way by networkx: every graph with so many links and joints whose parts move, each compared with those
that are alike.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import combinations
from time import perf_counter
from typing import Any

import networkx as nx

import planar
from planar.structures.rigid_parts import has_rigid_part

MOST = 12
MOST_BY_GRAPHS = 6
"""Links; by all graphs eight of them take hours."""
MOST_MECHANISMS, MOST_WITH_SLIDES = 10, 8
"""Links of which mechanisms are listed, and chains with slides."""


def chains_by_graphs(links: int) -> int:
    """How many chains of freedom 1 there are, by every set of joints."""
    every = [*combinations(range(links), 2)]
    kinds: dict[Any, list[nx.Graph]] = {}
    for joints in combinations(every, 3 * links // 2 - 2):
        graph = nx.Graph(joints)
        if graph.number_of_nodes() < links or min(dict(graph.degree).values()) < 2 or not nx.is_connected(graph):
            continue
        if has_rigid_part(links, [*joints]):
            continue
        far = dict(nx.all_pairs_shortest_path_length(graph))
        alike = kinds.setdefault(tuple(sorted((graph.degree[k], *sorted(far[k].values())) for k in graph)), [])
        if not any(nx.is_isomorphic(graph, each) for each in alike):
            alike.append(graph)
    return sum(map(len, kinds.values()))


def timed(task: Callable[[], Any]) -> tuple[Any, float]:
    """What a task gives, and the seconds that it takes."""
    start = perf_counter()
    return task(), perf_counter() - start


def count_mechanisms(found: Iterable[planar.Chain]) -> tuple[int, int]:
    """How many inversions and how many mechanisms chains have."""
    counts = [(len(each.inversions), len(each.mechanisms())) for each in found]
    return sum(each for each, _ in counts), sum(each for _, each in counts)


def count_with_slides(links: int) -> list[int]:
    """How many chains there are in which one and two joints slide."""
    return [len(planar.chains(links, slides=slides)) for slides in (1, 2)]


def lines(most: int) -> Iterator[str]:
    """A line for each number of links."""
    len(planar.chains(4))  # what is loaded once
    heads = ["chains", "in s", "inversions", "mechanisms", "in s", "1 slide", "2 slides", "in s"]
    heads += ["by graphs in s", "ratio"]
    yield f"{'links':>5}" + "".join(f"{head:>{max(11, len(head) + 2)}}" for head in heads)
    for links in range(4, most + 1, 2):
        found = planar.chains(links)
        count, listed = timed(partial(len, found))
        told = f"{links:5d}{count:11d}{listed:11.4f}"
        if links <= MOST_MECHANISMS:
            (inversions, mechanisms), seconds = timed(partial(count_mechanisms, found))
            told += f"{inversions:12d}{mechanisms:12d}{seconds:11.4f}"
        if links <= MOST_WITH_SLIDES:
            sliding, seconds = timed(partial(count_with_slides, links))
            told += f"{sliding[0]:11d}{sliding[1]:11d}{seconds:11.4f}"
        if links <= MOST_BY_GRAPHS:
            other, seconds = timed(partial(chains_by_graphs, links))
            assert other == count
            told += f"{seconds:16.4f}{seconds / listed:11.0f}"
        yield told


def main() -> None:
    """Print a line for each number of links."""
    for line in lines(int(sys.argv[1]) if len(sys.argv) > 1 else MOST):
        print(line, flush=True)


if __name__ == "__main__":
    main()
