"""A mechanism as graphs: links with pairs, and constraints with the coordinates that they hold."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import networkx as nx

from planar.mechanism import Mechanism, entries


@dataclass(frozen=True)
class Group:
    """Constraints and coordinates that are solved together: `rows` close them, given all earlier groups.

    More rows than columns: some are redundant or in conflict. Fewer: the group keeps freedom (`free`).
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    free: bool = False


def decompose(rows: Sequence[AbstractSet[int]], columns: int) -> tuple[Group, ...]:
    """Split constraints into groups that can be solved one after the other.

    `rows[i]` holds the columns (coordinates) on which constraint i depends. Dulmage-Mendelsohn: a maximum matching
    parts the whole into an over-, a well- and an under-determined part, and the strong components of the
    well-determined part are its smallest groups, in an order in which they can be solved (A. Pothen, C.-J. Fan,
    ACM Trans. Math. Softw. 16, 1990). A constraint left unmatched joins the last group that it touches, which
    then has more rows than columns. Cost: O(sqrt(V) E) for the matching, O(E) for the rest.
    """
    incidence = nx.Graph()
    incidence.add_nodes_from(range(len(rows)))
    incidence.add_nodes_from(range(-columns, 0))
    incidence.add_edges_from((row, ~column) for row, held in enumerate(rows) for column in sorted(held))
    matching = nx.bipartite.hopcroft_karp_matching(incidence, range(len(rows)))
    row_of = {~column: row for column, row in matching.items() if column < 0}

    needs = nx.DiGraph()
    needs.add_nodes_from(sorted(row_of))
    for column, row in sorted(row_of.items()):
        needs.add_edges_from((other, column) for other in sorted(rows[row]) if other != column and other in row_of)
    loose = [column for column in range(columns) if column not in row_of]
    free = _reached_from(loose, rows, row_of)

    blocks = nx.condensation(needs)
    order = list(nx.lexicographical_topological_sort(blocks, key=lambda block: min(blocks.nodes[block]["members"])))
    members = [sorted(blocks.nodes[block]["members"]) for block in order]
    place = {column: index for index, columns_of in enumerate(members) for column in columns_of}
    held_by: list[list[int]] = [[row_of[column] for column in columns_of] for columns_of in members]
    idle: list[int] = []
    matched = set(row_of.values())
    for row in range(len(rows)):
        if row not in matched:
            touched = [place[column] for column in rows[row] if column in place]
            (held_by[max(touched)] if touched else idle).append(row)
    groups = [
        Group(tuple(sorted(held)), tuple(columns_of), bool(free & set(columns_of)))
        for held, columns_of in zip(held_by, members, strict=True)
    ]
    if idle:
        groups.append(Group(tuple(idle), ()))
    if loose:
        groups.append(Group((), tuple(loose), True))
    return tuple(groups)


def _reached_from(loose: Sequence[int], rows: Sequence[AbstractSet[int]], row_of: dict[int, int]) -> set[int]:
    """The columns that stay free: the loose ones, and those whose constraints touch a free one."""
    touching: dict[int, list[int]] = {}
    column_of = {row: column for column, row in row_of.items()}
    for row, held in enumerate(rows):
        for column in held:
            touching.setdefault(column, []).append(row)
    free, waiting = set(loose), list(loose)
    while waiting:
        for row in touching.get(waiting.pop(), ()):
            column = column_of.get(row)
            if column is not None and column not in free:
                free.add(column)
                waiting.append(column)
    return free


def linkage(mechanism: Mechanism) -> nx.Graph:
    """Links and pairs, both as nodes ("link", name) and ("pair", name), so that two links may share two pairs.

    A pin of n links is one pair node with n edges.
    """
    graph = nx.Graph(name=mechanism.name)
    graph.add_nodes_from(("link", link.name) for link in mechanism.links)
    for group in entries(mechanism):
        node = ("pair", group[0].entry_name())
        for pair in group:
            graph.add_edges_from((node, ("link", link)) for link in pair.links)
    return graph


def detached(mechanism: Mechanism) -> tuple[str, ...]:
    """Links that no chain of pairs joins to the frame."""
    joined = nx.node_connected_component(linkage(mechanism), ("link", mechanism.frame))
    return tuple(link.name for link in mechanism.links if ("link", link.name) not in joined)
