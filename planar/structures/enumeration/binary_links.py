"""How binary links stand on the edges of a contracted graph, once up to symmetry, so that no part is rigid."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from planar.foundation.arrays import Array
from planar.structures.contracted_graphs import ContractedGraph

CHUNK = 1 << 14
"""Rows that are looked at at a time, which bounds the memory."""
EXACT_FLOAT = 2**53
"""Whole numbers below it are exact as floats."""


def distribute_binary_links(graph: ContractedGraph, binary: int, freedom: int) -> Array:
    """Every way to put so many binary links on the edges of a graph, as rows (ways, edges), the greatest row first.

    Edges between the same two vertices stand side by side with falling numbers. Of rows that an automorphism takes to
    each other there is the greatest. No part of what they stand for has freedom 0 or less.
    """
    rows = _possible_rows(graph, binary, freedom)
    kept = [_keep_movable(graph, rows[at : at + CHUNK]) for at in range(0, len(rows), CHUNK)]
    return _greatest_of_orbits(graph, np.concatenate([rows[:0], *kept]))


def _possible_rows(graph: ContractedGraph, binary: int, freedom: int) -> Any:
    """Rows of the right sum, falling within a bundle, each bundle with its two vertices movable.

    What an edge holds beyond two binary links it adds to the freedom: of all edges together at most `freedom` - 1 where
    several vertices are left without them, else `freedom`. A loop has three, as fewer would be rigid.
    """
    spare = freedom - (len(graph.counts) > 1)
    bounds = [(3 if i == j else 0, place == 0) for i, j, count in graph.bundles for place in range(count)]
    ends = np.cumsum([count for _, _, count in graph.bundles])
    starts = {int(end): int(end) - count for end, (i, j, count) in zip(ends, graph.bundles, strict=True) if i != j}
    needed = np.cumsum([least for least, _ in bounds[::-1]])[::-1]
    rows = np.zeros((1, 0), dtype=np.int8)
    for edge, (least, is_first) in enumerate(bounds):
        used = rows.sum(axis=1)
        excess = np.maximum(rows - 2, 0).sum(axis=1)
        last = edge == len(bounds) - 1
        parts = []
        for value in range(least, spare + 3):
            fits = used + value == binary if last else used + value + needed[edge + 1] <= binary
            fits &= excess + max(value - 2, 0) <= spare
            if not is_first:
                fits &= rows[:, -1] >= value
            chosen = rows[fits]
            parts.append(np.column_stack([chosen, np.full(len(chosen), value, dtype=np.int8)]))
        rows = np.concatenate(parts) if parts else np.zeros((0, edge + 1), dtype=np.int8)
        if edge + 1 in starts:
            held = np.maximum(2 - rows[:, starts[edge + 1] :], 0).sum(axis=1)
            rows = rows[held <= 2]
    return rows


def _keep_movable(graph: ContractedGraph, rows: Array) -> Array:
    """The rows of which no part has freedom 0 or less.

    Of all parts with the multiple links S the one with every edge within S that holds more than it adds has the least
    freedom: an edge with c binary links adds c links and c + 1 joints, c - 2 to the freedom. So it is
    3(|S| - 1) less 2 - c of each edge with c < 2.
    """
    size = len(graph.counts)
    sets = [set(each) for count in range(3, size + 1) for each in combinations(range(size), count)]
    if not sets:
        return rows
    edges = [(i, j) for i, j, count in graph.bundles for _ in range(count)]
    within = np.array([[i in each and j in each for each in sets] for i, j in edges], dtype=np.int8)
    most = np.array([3 * len(each) - 4 for each in sets], dtype=np.int8)
    missing = np.maximum(2 - rows, 0).astype(np.int8)
    # A sum edge by edge: integers do not go through BLAS, whose padding may raise flags of numbers that are not there.
    held = np.zeros((len(rows), len(sets)), dtype=np.int8)
    for edge, row in enumerate(within):
        held += missing[:, edge, None] * row
    kept: Array = rows[(held <= most).all(axis=1)]
    return kept


def _greatest_of_orbits(graph: ContractedGraph, rows: Array) -> Array:
    """Of rows that automorphisms take to each other the greatest, and these by falling order."""
    if not len(rows):
        return rows
    base, width = int(rows.max()) + 1, rows.shape[1]
    kind: type = float if base**width < EXACT_FLOAT else object
    powers: Any = np.array([base**place for place in range(width - 1, -1, -1)], dtype=kind)
    columns = _edge_permutations(graph)
    weights: Any = np.zeros((width, len(columns)), dtype=kind)
    for index, column in enumerate(columns):
        weights[column, index] = powers
    own, greatest = [], []
    for at in range(0, len(rows), CHUNK):
        codes = rows[at : at + CHUNK].astype(kind) @ weights
        own.append(codes[:, 0])
        greatest.append(codes.max(axis=1))
    code = np.concatenate(own)
    chosen = np.flatnonzero(code == np.concatenate(greatest))
    ordered: Array = rows[chosen[np.argsort(-code[chosen], kind="stable")]]
    return ordered


def _edge_permutations(graph: ContractedGraph) -> list[list[int]]:
    """Of every automorphism, first of the identity, which edge it puts in the place of each."""
    firsts, first = {}, 0
    for i, j, count in graph.bundles:
        firsts[i, j] = first
        first += count
    return [
        [
            firsts[min(each[i], each[j]), max(each[i], each[j])] + place
            for i, j, count in graph.bundles
            for place in range(count)
        ]
        for each in graph.automorphisms
    ]
