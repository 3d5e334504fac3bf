"""The output link of a mechanism with its pair at the frame, of which a transmission angle is told."""

from __future__ import annotations

from planar.foundation.errors import BadInput, Unknown, suggest_name_of_kinds
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair


def find_output_pair(mechanism: Mechanism, output: str) -> tuple[str, Pair]:
    """The output link, and the pair at which it turns or slides on the frame. Raises Unknown, BadInput."""
    frame, named = mechanism.frame, relative_motions(mechanism)
    links = [link.name for link in mechanism.links]
    if output in named:
        candidates = [named[output]]
    elif output in links:
        candidates = [pair for pair in named.values() if output in pair.links]
    else:
        hint = suggest_name_of_kinds(output, {"pairs": named, "links": links})
        raise Unknown(f"there is no pair and no link {output!r}{hint}")
    for pair in candidates:
        others = [link for link in pair.links if link != frame]
        pinned = pair.input_kind is MeasureKind.ANGLE and bool(pair.coincident_points())
        if (
            len(others) == 1
            and pair.is_lower_pair
            and pair.prevented_motion_count() == 2
            and (pinned or pair.point_on_line() is not None)
        ):
            return others[0], pair
    told = "is told of a link that turns about a fixed pin or slides on the frame"
    raise BadInput(output, f"a transmission angle {told}, and {output!r} is no such link or pair")
