"""What the simulator of Linkage makes of a file: which links an input turns, how it swings, where a slot is curved."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from math import fmod, hypot, sqrt

from planar.formats.drawn.drawn_linkage import Place


def turned_links(
    at: str, members: Sequence[str], connectors: Mapping[str, Sequence[str]], anchors: Collection[str]
) -> list[str]:
    """The links that the input at a connector turns, by the connectors of all links, in the order of the file.

    Each whose only held connector is the input is turned, with all others that are, unless one of its connectors is on
    another link that is held elsewhere: by an anchor, or by one that was turned before.
    """
    moved, result = set(anchors), list[str]()
    for link in members:
        own = set(connectors[link]) - {at}
        if own & moved:
            continue
        neighbours = (set(keys) - {at} - own for name, keys in connectors.items() if name != link and own & set(keys))
        if any(keys & moved for keys in neighbours):
            continue
        result.append(link)
        moved |= own
    return result


def swing_phase(stroke: float, offset: float) -> tuple[float, int]:
    """Where in its stroke an input starts that goes to and fro, and whether it goes on (1) or back (-1) from there."""
    within = fmod(abs(offset), 2.0 * stroke)
    return (within, 1) if within < stroke else (2.0 * stroke - within, -1)


def arc_centre(start: Place, end: Place, radius: float) -> Place:
    """The centre of a curved slot between two places that are apart: left of the way where the radius is above zero.

    An arc is at most a half circle: a radius that is too small is half the way.
    """
    (x, y), (u, v) = start, end
    apart = hypot(u - x, v - y)
    height = sqrt(max(max(abs(radius), apart / 2.0) ** 2 - apart**2 / 4.0, 0.0))
    side = (height if radius > 0.0 else -height) / apart
    return (x + u) / 2.0 - side * (v - y), (y + v) / 2.0 + side * (u - x)
