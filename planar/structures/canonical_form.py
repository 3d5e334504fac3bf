"""The greatest word of a small graph whose edges are counted: equal for graphs that are the same but for names."""

from __future__ import annotations

from collections.abc import Sequence

from planar.foundation.errors import BadInput

Counts = tuple[tuple[int, ...], ...]
"""Between each two vertices how many edges there are, symmetric; on the diagonal how many begin and end there."""
Numbering = tuple[int, ...]
"""The vertices in the order in which they are numbered."""

MAX_NUMBERINGS = 20_000
"""So many beginnings of a numbering are followed side by side."""


def greatest_numberings(counts: Counts, ranks: Sequence[int]) -> tuple[tuple[int, ...], list[Numbering]]:
    """The greatest word of a graph, and every numbering of its vertices that gives it.

    The vertices stand by falling rank. The word is the upper triangle of `counts`, row by row with the diagonal, and
    words compare as those of a dictionary. Any two of the numberings differ by an automorphism that keeps the ranks,
    and every such automorphism is had so. A row fixes the next vertex and parts the others by their edges with it:
    only what begins with the greatest rows is followed.

    Raises BadInput where that are very many, as in graphs of dozens of vertices that are alike.
    """
    cells = tuple(tuple(v for v, own in enumerate(ranks) if own == rank) for rank in sorted({*ranks}, reverse=True))
    states: list[tuple[Numbering, tuple[Numbering, ...]]] = [((), cells)]
    word: list[int] = []
    for _ in ranks:
        best: tuple[int, ...] = ()
        following: list[tuple[Numbering, tuple[Numbering, ...]]] = []
        for done, left in states:
            for vertex in left[0]:
                row, parted = _split_cells(counts[vertex], vertex, left)
                if row > best:
                    best, following = row, []
                if row == best:
                    following.append(((*done, vertex), parted))
        if len(following) > MAX_NUMBERINGS:
            raise BadInput("links", "the chain has too many links that can stand for one another to be numbered")
        states = following
        word += best
    return tuple(word), [done for done, _ in states]


def _split_cells(
    row: Sequence[int], vertex: int, cells: tuple[Numbering, ...]
) -> tuple[tuple[int, ...], tuple[Numbering, ...]]:
    """The row of the word that a vertex gives as the next one, and the cells of the others, parted by it."""
    word = [row[vertex]]
    parted: list[Numbering] = []
    for cell in cells:
        by_count: dict[int, list[int]] = {}
        for other in cell:
            if other != vertex:
                by_count.setdefault(row[other], []).append(other)
        for count in sorted(by_count, reverse=True):
            word += [count] * len(by_count[count])
            parted.append(tuple(by_count[count]))
    return tuple(word), tuple(parted)
