"""Which of the instantaneous centres of a position are drawn."""

from __future__ import annotations

from collections.abc import Sequence

from planar.analysis.centres.centres import Centre, Centres, is_chosen
from planar.foundation.errors import BadInput

MAX_CENTRES, CROWDED_CENTRES = 28, 15
"""Of more centres than that only some are drawn; with more than the second the points' names are left out."""


def choose_centres(found: Centres, links: str | Sequence[str] | None = None) -> tuple[Centre, ...]:
    """The centres to be drawn, in the order in which they were found.

    Of one link: all its centres; of several: those between any two of them; always with the centres on whose lines
    they were found. Without `links` all of them, or of more than MANY those that pairs show and those against the
    frame. Raises BadInput for a link that there is not.
    """
    if links:
        links = [links] if isinstance(links, str) else links
        for link in links:
            if link not in found.numbers:
                raise BadInput(link, f"there is no link of this name; links are {', '.join(found.numbers)}")
        picked = [each for each in found if is_chosen(each.links, set(links))]
        names = {name for each in picked for name in (each.name, *(n for line in each.lines for n in line.centres))}
        return tuple(each for each in found if each.name in names)
    frame = found.state.mechanism.frame
    few = len(found) <= MAX_CENTRES
    return tuple(each for each in found if few or each.how == "pair" or frame in each.links)
