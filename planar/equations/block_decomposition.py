"""Constraints decomposed into the smallest blocks that can be solved one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple

import casadi as ca


class BlockIndices(NamedTuple):
    """Constraints and coordinates that are solved together: `rows` close them, given all earlier blocks.

    More rows than columns: some are redundant or in conflict. `free`: the constraints leave the columns free.
    """

    rows: tuple[int, ...]
    columns: tuple[int, ...]
    is_free: bool = False


def decompose_blocks(rows: Sequence[AbstractSet[int]], columns: int) -> tuple[BlockIndices, ...]:
    """Split constraints into blocks, in an order in which they can be solved.

    `rows[i]` holds the columns (coordinates) on which constraint i depends. Dulmage and Mendelsohn: a maximum matching
    parts the whole into an over-, a well- and an under-determined part, and the strong components of the matched
    columns are the smallest blocks (A. Pothen, C.-J. Fan, ACM Trans. Math. Softw. 16, 1990; both steps as in
    T. Davis' CSparse, which casadi carries). What a constraint left unmatched reaches stays one block, with more rows
    than columns, and comes first; columns left unmatched come last, and what rests on them is free.
    """
    row_of = _maximum_matching(rows, columns)
    loose = tuple(column for column in range(columns) if column not in row_of)
    matched = set(row_of.values())
    surplus = [row for row in range(len(rows)) if row not in matched]
    free = _underdetermined_columns(loose, rows, row_of)
    groups = [
        BlockIndices(tuple(sorted(held)), tuple(sorted(block)))
        for held, block in _overdetermined_parts(surplus, rows, row_of)
    ]
    taken = {column for group in groups for column in group.columns}
    for block in _strong_components(rows, {column: row for column, row in row_of.items() if column not in taken}):
        held = tuple(sorted(row_of[column] for column in block))
        groups.append(BlockIndices(held, tuple(block), not free.isdisjoint(block)))
    if loose:
        groups.append(BlockIndices((), loose, is_free=True))
    return tuple(groups)


def _overdetermined_parts(
    surplus: Sequence[int], rows: Sequence[AbstractSet[int]], row_of: dict[int, int]
) -> list[tuple[set[int], set[int]]]:
    """The parts that are held more than once: each (rows, columns) joined to some unmatched row.

    All that an unmatched row reaches has to be solved together with it: any of these rows may be the superfluous one.
    """
    parts: list[tuple[set[int], set[int]]] = []
    for row in surplus:
        held, waiting = {row}, [row]
        reached: set[int] = set()
        while waiting:
            for column in rows[waiting.pop()] - reached:
                reached.add(column)
                held.add(row_of[column])
                waiting.append(row_of[column])
        for other in [part for part in parts if not part[1].isdisjoint(reached)]:
            parts.remove(other)
            held |= other[0]
            reached |= other[1]
        parts.append((held, reached))
    return parts


def _maximum_matching(rows: Sequence[AbstractSet[int]], columns: int) -> dict[int, int]:
    """A maximum matching: the row of every matched column."""
    pattern = ca.Sparsity.triplet(
        len(rows), columns, [row for row, held in enumerate(rows) for _ in held], [c for held in rows for c in held]
    )
    _, p, q, _, _, coarse_rows, coarse_columns = pattern.btf()
    # unmatched rows come first, then three parts in which rows and columns stand in matched order, then loose columns
    return dict(zip(q[: coarse_columns[3]], p[coarse_rows[1] :], strict=True))


def _strong_components(rows: Sequence[AbstractSet[int]], row_of: dict[int, int]) -> list[list[int]]:
    """The strong components of the matched columns, each after those whose values its rows need."""
    order = sorted(row_of)
    index = {column: position for position, column in enumerate(order)}
    needs = [(index[column], index[other]) for column in order for other in rows[row_of[column]] if other in index]
    pattern = ca.Sparsity.triplet(len(order), len(order), [a for a, _ in needs], [b for _, b in needs])
    blocks, p, starts = pattern.scc()
    return [sorted(order[k] for k in p[starts[b] : starts[b + 1]]) for b in reversed(range(blocks))]


def _underdetermined_columns(
    unmatched_columns: Sequence[int], rows: Sequence[AbstractSet[int]], row_of: dict[int, int]
) -> set[int]:
    """The columns that stay free: the loose ones, and those whose constraints touch a free one."""
    touching: dict[int, list[int]] = {}
    column_of = {row: column for column, row in row_of.items()}
    for row, held in enumerate(rows):
        for column in held:
            touching.setdefault(column, []).append(row)
    free, waiting = set(unmatched_columns), list(unmatched_columns)
    while waiting:
        for row in touching.get(waiting.pop(), ()):
            if row in column_of and column_of[row] not in free:
                free.add(column_of[row])
                waiting.append(column_of[row])
    return free
