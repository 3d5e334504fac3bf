"""All kinematic chains of so many links, pins and slides, in a fixed order."""

from __future__ import annotations

from planar.foundation.errors import BadInput
from planar.structures.enumeration.chains_with_multiple_pins import ChainsWithMultiplePins
from planar.structures.enumeration.chains_with_slides import ChainsWithSlides
from planar.structures.enumeration.pin_chains import Chains


def chains(
    links: int, freedom: int = 1, *, slides: int = 0, multiple_pins: int = 0, fractionated: bool = True
) -> Chains:
    """All kinematic chains of so many links joined by pins, as a sequence that is made as it is read.

    A chain is closed: each link has two joints or more. By count it has this freedom, and none of its parts has
    freedom 0 or less. Chains that a single link parts into ones that move alone are among them, after the others;
    without `fractionated` they are left out. There are none of freedom 1.

    With `slides` so many of the joints are sliding pairs and not pins, in every way that leaves the chain its freedom
    and each of its joints a motion, wherever they stand but for special places; ways that an exchange of links takes to
    each other count once. There are none where slides are too many. With `multiple_pins` pins hold so many links beyond
    two each: a pin of three links counts once, one of four twice; its joints are one fewer than its links.

    Raises BadInput where by count no chain of so many links has this freedom.

    >>> import planar
    >>> len(planar.chains(8)), planar.chains(10)[17].assortment
    (16, (4, 6))
    >>> [len(planar.chains(6, slides=slides)) for slides in range(6)]
    [2, 6, 16, 19, 9, 0]
    >>> [len(planar.chains(8, multiple_pins=multiple)) for multiple in range(4)]
    [16, 20, 18, 4]
    """
    for name, value, least in (
        ("links", links, 4),
        ("freedom", freedom, 1),
        ("slides", slides, 0),
        ("multiple_pins", multiple_pins, 0),
    ):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise BadInput(name, f"a whole number from {least} on is wanted, not {value!r:.40}")
    if (links - freedom) % 2 == 0:
        wanted = "odd" if links % 2 == 0 else "even"
        raise BadInput(
            "freedom",
            f"a chain of {links} links has an {wanted} freedom, 3 (links - 1) less 2 for each pin; ask for "
            f"{freedom + 1 if freedom == 1 else freedom - 1}, or for another number of links",
        )
    if links < freedom + 3:
        raise BadInput(
            "links",
            f"a chain of freedom {freedom} has {freedom + 3} links at least, as a single loop does; not {links}",
        )
    if multiple_pins:
        pins: Chains = ChainsWithMultiplePins(links, freedom, fractionated, multiple_pins)
    else:
        pins = Chains(links, freedom, fractionated)
    return ChainsWithSlides(pins, slides) if slides else pins
