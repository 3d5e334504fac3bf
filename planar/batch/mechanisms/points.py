"""Where the points of linkages are, from the poses of their links: one formula for all."""

from __future__ import annotations

from functools import lru_cache

from planar.batch.mechanisms.block_type import COS, SIN, TURN1, TURN2, X1, X2, Y1, Y2, X, Y
from planar.codegen.block_formula import BlockFormula, FormulaInput, KernelLayout
from planar.foundation.instruction_list import InstructionList


@lru_cache
def point_formula(rates: bool) -> tuple[BlockFormula, KernelLayout]:
    """x and y of a point, then of its first and second rates, from its link's pose and rates.

    Numbers: the point in its link (m), then what the link's own lengths are multiplied by.
    """
    listing: InstructionList[FormulaInput] = InstructionList()
    leaves: dict[int, FormulaInput] = {}

    def leaf(what: str, first: int, second: int = 0) -> int:
        key = FormulaInput(what, first, second)
        number = listing.add_input(key)
        leaves[number] = key
        return number

    def times(a: int, b: int) -> int:
        return listing.add("mul", a, b)

    px, py, unit = (leaf("p", k) for k in range(3))
    c, s = leaf("row", 0, COS), leaf("row", 0, SIN)
    rx = listing.add("sub", times(c, px), times(s, py))
    ry = listing.add("add", times(s, px), times(c, py))
    wanted = [listing.add("add", times(leaf("row", 0, row), unit), r) for row, r in ((X, rx), (Y, ry))]
    if rates:
        turn1, turn2 = leaf("row", 0, TURN1), leaf("row", 0, TURN2)
        square = times(turn1, turn1)
        wanted.append(listing.add("sub", times(leaf("row", 0, X1), unit), times(turn1, ry)))
        wanted.append(listing.add("add", times(leaf("row", 0, Y1), unit), times(turn1, rx)))
        along = listing.add("add", times(turn2, ry), times(square, rx))
        across = listing.add("sub", times(turn2, rx), times(square, ry))
        wanted.append(listing.add("sub", times(leaf("row", 0, X2), unit), along))
        wanted.append(listing.add("add", times(leaf("row", 0, Y2), unit), across))
    return BlockFormula(listing, tuple(wanted), leaves), KernelLayout((), 3, 1, len(wanted))
