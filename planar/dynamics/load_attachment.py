"""The link of a pin on which a load acts that a file applies at the pin by its name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs import MeasureKind
from planar.model.wording import join_all_names


class Attachment(NamedTuple):
    """The point of a link at which something acts, and `others`: the same place on the other links, as `rod.B`."""

    link: str
    point: str
    others: tuple[str, ...] = ()


def attachments(mechanism: Mechanism) -> Mapping[str, Attachment]:
    """Where acts what is applied at a point, for every name: as results have it, or `link.point`, of that link alone.

    At a pin that several links share it acts on the one that slides there (a block, a piston, a ram), one on the frame
    before one on a moving link; where none slides, on the first in the order of the file.
    """
    slides = _sliding_links(mechanism)
    found: dict[str, Attachment] = {}
    for each in named_points(mechanism):
        # a stable sort: links alike stay in the order of the file
        members = sorted(each.members, key=lambda member: slides.get(member[0], len(slides)))
        found |= {".".join(member): Attachment(*member) for member in members}
        found[each.name] = Attachment(*members[0], tuple(".".join(other) for other in members[1:]))
    return found


def _sliding_links(mechanism: Mechanism) -> dict[str, int]:
    """The links that slide, those on the frame first; in a pair of two moving links the second of them does."""
    slides = [pair.links for pair in mechanism.pairs if pair.is_lower_pair and pair.input_kind is MeasureKind.LENGTH]
    on_frame = [link for links in slides if mechanism.frame in links for link in links if link != mechanism.frame]
    others = [links[1] for links in slides if mechanism.frame not in links]
    return {link: rank for rank, link in enumerate(dict.fromkeys((*on_frame, *others)))}


def attachment_remarks(mechanism: Mechanism) -> tuple[str, ...]:
    """A sentence for every load and every end of a spring of which another link might have been meant."""
    where = attachments(mechanism)
    named = [("the load", load.point) for load in mechanism.loads if load.point is not None]
    named += [("the load", end) for load in mechanism.loads for end in load.points or ()]
    named += [("the spring's end", end) for spring in mechanism.springs for end in spring.points or ()]
    return tuple(
        _attachment_remark(what, name, where[name]) for what, name in dict.fromkeys(named) if where[name].others
    )


def _attachment_remark(what: str, name: str, at: Attachment) -> str:
    others = join_all_names([repr(other.rpartition(".")[0]) for other in at.others])
    written = " or ".join(repr(other) for other in at.others)
    return f"{what} at {name!r} acts on link {at.link!r}, not on {others}; to have it there write {written}"
