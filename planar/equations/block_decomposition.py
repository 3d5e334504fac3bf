"""Constraints decomposed into the smallest blocks that can be solved one after the other."""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple


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
    separates an over-, a well- and an under-determined part, and the strong components of the matched columns are the
    smallest blocks (A. Pothen, C.-J. Fan, ACM Trans. Math. Softw. 16, 1990). All that an unmatched constraint reaches
    stays one block, with more rows than columns, and comes first; unmatched columns come last, and what rests on them
    is free.
    """
    row_of = _maximum_matching(rows)
    loose = tuple(column for column in range(columns) if column not in row_of)
    matched = set(row_of.values())
    surplus = [row for row in range(len(rows)) if row not in matched]
    free = _underdetermined_columns(loose, rows, row_of)
    groups = [
        BlockIndices(tuple(sorted(block_rows)), tuple(sorted(block)))
        for block_rows, block in _overdetermined_parts(surplus, rows, row_of)
    ]
    taken = {column for group in groups for column in group.columns}
    for block in _strong_components(rows, {column: row for column, row in row_of.items() if column not in taken}):
        block_rows = tuple(sorted(row_of[column] for column in block))
        groups.append(BlockIndices(block_rows, tuple(block), not free.isdisjoint(block)))
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
        part_rows, waiting = {row}, [row]
        reached: set[int] = set()
        while waiting:
            for column in rows[waiting.pop()] - reached:
                reached.add(column)
                part_rows.add(row_of[column])
                waiting.append(row_of[column])
        for other in [part for part in parts if not part[1].isdisjoint(reached)]:
            parts.remove(other)
            part_rows |= other[0]
            reached |= other[1]
        parts.append((part_rows, reached))
    return parts


def _maximum_matching(rows: Sequence[AbstractSet[int]]) -> dict[int, int]:
    """A maximum matching: the row of every matched column (I. S. Duff's MC21, ACM Trans. Math. Softw. 7, 1981)."""
    row_of: dict[int, int] = {}
    for first_row in range(len(rows)):
        visited: set[int] = set()
        path: list[tuple[int, int]] = []  # rows, and the columns that they take from the row after them
        row = first_row
        candidates = {first_row: iter(rows[first_row])}
        while True:
            free_column = next((column for column in rows[row] if column not in row_of), None)
            if free_column is not None:
                for matched_row, column in [*path, (row, free_column)]:
                    row_of[column] = matched_row
                break
            column = next((column for column in candidates[row] if column not in visited), -1)
            if column >= 0:
                visited.add(column)
                path.append((row, column))
                row = row_of[column]
                candidates[row] = iter(rows[row])
            elif path:
                row, _ = path.pop()
            else:
                break
    return row_of


def _strong_components(rows: Sequence[AbstractSet[int]], row_of: dict[int, int]) -> list[list[int]]:
    """The strong components of the matched columns, each after those whose values its rows need (R. Tarjan, 1972)."""
    components: list[list[int]] = []
    visit_order: dict[int, int] = {}
    lowest: dict[int, int] = {}  # the earliest column that can be reached and belongs to no component
    open_columns: list[int] = []
    assigned: set[int] = set()
    for root in sorted(row_of):
        if root in visit_order:
            continue
        visit_order[root] = lowest[root] = len(visit_order)
        open_columns.append(root)
        path = [(root, iter(rows[row_of[root]]))]
        while path:
            column, needs = path[-1]
            for other in needs:
                if other in assigned or other not in row_of:
                    continue
                if other in visit_order:
                    lowest[column] = min(lowest[column], visit_order[other])
                    continue
                visit_order[other] = lowest[other] = len(visit_order)
                open_columns.append(other)
                path.append((other, iter(rows[row_of[other]])))
                break
            else:
                path.pop()
                if path:
                    lowest[path[-1][0]] = min(lowest[path[-1][0]], lowest[column])
                if lowest[column] == visit_order[column]:
                    component = [open_columns.pop()]
                    while component[-1] != column:
                        component.append(open_columns.pop())
                    assigned.update(component)
                    components.append(sorted(component))
    return components


def _underdetermined_columns(
    unmatched_columns: Sequence[int], rows: Sequence[AbstractSet[int]], row_of: dict[int, int]
) -> set[int]:
    """The columns that stay free: the loose ones, and those whose constraints touch a free one."""
    if not unmatched_columns:
        return set()
    touching: dict[int, list[int]] = {}
    column_of = {row: column for column, row in row_of.items()}
    for row, columns in enumerate(rows):
        for column in columns:
            touching.setdefault(column, []).append(row)
    free, waiting = set(unmatched_columns), list(unmatched_columns)
    while waiting:
        for row in touching.get(waiting.pop(), ()):
            if row in column_of and column_of[row] not in free:
                free.add(column_of[row])
                waiting.append(column_of[row])
    return free
