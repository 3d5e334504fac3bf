"""A mechanism as a graph of links and pairs."""

from __future__ import annotations

import networkx as nx

from planar.mechanism import Mechanism, entries


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


def farthest_first(mechanism: Mechanism, name: str) -> tuple[str, ...]:
    """The other pairs, those first that are most links and pairs away from this one."""
    entry_of = {pair.name: pair.entry_name() for pair in mechanism.pairs}
    away = nx.single_source_shortest_path_length(linkage(mechanism), ("pair", entry_of[name]))
    others = [other for other in entry_of if other != name]
    return tuple(sorted(others, key=lambda other: -away.get(("pair", entry_of[other]), 0)))
