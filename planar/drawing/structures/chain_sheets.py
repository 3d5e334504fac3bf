"""Kinematic chains on sheets: twenty to each, with what they are beneath."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

from planar.drawing.output.grid_sheets import GRID_PICTURE_SIZE, draw_grid
from planar.drawing.structures.chain_pictures import DrawnChain, chain_picture, draw_chain, inversion_picture
from planar.foundation.errors import BadInput
from planar.structures.chain import Chain
from planar.structures.multiple_pins import extra_links, joint_kinds_phrase

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CHAIN_NOTE = (
    "Number: links with two joints, with three, and so on. Symmetry: in how many ways links can be exchanged. II, III, "
    "IV: mechanisms whose Assur groups are of this class at most; larger: that have one of more than four links."
)
SLIDE_NOTE = " Circles are pins, blocks slides."
INVERSION_NOTE = (
    "Hatched: the fixed link. Black: the joints that are driven, each told by its two links, with the highest class "
    "of the Assur groups; larger: of more than four links. What differs only by an exchange of links is left out."
)


def draw_chains(found: Any, progress: Callable[[int, int], None] | None = None) -> list[DrawnChain]:
    """Chains, or a single one, with places of their joints; `progress` is told after each how many are, of how many.

    Raises BadInput for anything else.
    """
    every = [found] if isinstance(found, Chain) else [*found] if isinstance(found, Sequence) else [found]
    if not every or not all(isinstance(each, Chain) for each in every):
        raise BadInput("found", f"a chain, or a sequence of chains, is wanted, not {found!r:.60}")
    drawn = []
    for done, chain in enumerate(every, start=1):
        drawn.append(draw_chain(chain))
        if progress is not None:
            progress(done, len(every))
    return drawn


def chain_sheets(drawn: Sequence[DrawnChain]) -> Iterator[Figure]:
    """Sheets of twenty chains each, in order, with their numbers. Raises BadInput without matplotlib."""
    pictures = [chain_picture(each, GRID_PICTURE_SIZE) for each in drawn]
    return draw_grid(pictures, _heading(drawn, "Kinematic chains"), CHAIN_NOTE + _slide_note(drawn))


def inversion_sheets(drawn: Sequence[DrawnChain]) -> Iterator[Figure]:
    """Sheets of twenty inversions each: every chain with each of its links fixed that gives other mechanisms."""
    pictures = []
    for each in drawn:
        mechanisms = each.chain.mechanisms()
        for frame in each.chain.inversions:
            own = [one for one in mechanisms if one.frame == frame]
            pictures.append(inversion_picture(each, frame, own, GRID_PICTURE_SIZE))
    return draw_grid(pictures, _heading(drawn, "Inversions of kinematic chains"), INVERSION_NOTE + _slide_note(drawn))


def _heading(drawn: Sequence[DrawnChain], what: str) -> str:
    chains = [each.chain for each in drawn]
    kinds = {(each.links, each.freedom, len(each.slides), extra_links(each.pins)) for each in chains}
    if len(kinds) > 1:
        return what
    links, freedom, slides, multiple_pins = next(iter(kinds))
    return f"{what} of {links} links{joint_kinds_phrase(slides, multiple_pins)}, freedom {freedom}"


def _slide_note(drawn: Sequence[DrawnChain]) -> str:
    return SLIDE_NOTE if any(each.chain.slides for each in drawn) else ""
