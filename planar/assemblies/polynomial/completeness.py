"""How complete a list of a block's assemblies is, as a result and in words."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from planar.foundation.arrays import Array, BoolArray


class Completeness(Enum):
    """How surely a list is the whole of it."""

    PROVED = "complete"
    NUMERICALLY = "numerically complete"
    NOT = "not known to be complete"


class BlockRoots(NamedTuple):
    """All assemblies of one block of links, those before it given.

    `real`: (roots, unknowns) as in z[block.unknowns] (rad, sizes), sorted, angles between -pi and pi or, if they count
    turns, the least; `double`: (roots,) where two meet, at a dead point; `certified`: (roots,) whether a box of its own
    is proved to hold each; `expected`: complex solutions at finite places that the structure has, None where no number
    is known; `found`: those that were found, as often as they count; `curve`: whether a whole curve of assemblies is
    there, or several, of each of which `real` has one place at least; `method`: how it was solved.
    """

    real: Array
    double: BoolArray
    certified: BoolArray
    expected: int | None
    found: int
    complete: Completeness
    has_curve: bool
    method: str
