"""Names that the field has for chains, and for six-bars and four links with slides by their fixed link."""

from __future__ import annotations

from functools import cache

from planar.structures.contraction import automorphisms, canonical_chain, ring_joints
from planar.structures.rigid_parts import Joint
from planar.structures.symmetry import first_alike, joint_exchanges

WATT = "ab bc cd de ex xa ad"
"""Two ternary links, a and d, joined to one another: two loops of four."""
STEPHENSON = "ab bd ac cd ae ex xd"
"""Two ternary links, a and d, not joined to one another: a loop of four, abdc, and two of five."""
SIX_BARS = (
    ("Watt I six-bar", WATT, "b"),
    ("Watt II six-bar", WATT, "a"),
    ("Stephenson I six-bar", STEPHENSON, "b"),
    ("Stephenson II six-bar", STEPHENSON, "e"),
    ("Stephenson III six-bar", STEPHENSON, "a"),
)
"""The chains of six links and seven pairs by their fixed link: of Watt's a binary one or a ternary one; of Stephenson's
a binary one of the four-bar loop, one of the two binaries joined to each other, a ternary one.

L. Burmester, Lehrbuch der Kinematik, 1888; R. Norton, Design of Machinery, on linkage transformation and isomers;
J. M. McCarthy and G. Soh, Geometric Design of Linkages, on six-bars.
"""
EIGHT_BARS = (
    ("double butterfly linkage", "ab ai ae bc cd cg eg eh dh di"),
    ("single flier eight-bar", "ab ai aj bgh cd cg ci dh dj"),
    ("double flier eight-bar", "ab ad ae bc cg ch dg di ei eh"),
)
"""Eight-bars in which Kennedy's theorem stops short, whichever link is fixed; a joint of three letters is a pin of
three links. G. Pennock and A. Hasan, J. of Mechanical Design 124, 2002; D. Foster and G. Pennock, ASME DETC 2004;
G. Pennock and D. Raje, Mechanism and Machine Theory 39, 2004. Which of the two fliers is which is inferred from their
structure: see the models' notes."""
_RING = "ab bc cd ad"
FOUR_LINKS_WITH_SLIDES = (
    ("slider-crank", _RING, "ad", "a"),
    ("inverted slider-crank", _RING, "ad", "b"),
    ("elliptical trammel", _RING, "cd ad", "d"),
    ("Scotch yoke", _RING, "cd ad", "a"),
    ("Oldham coupling", _RING, "cd ad", "b"),
    ("Rapson's slide", _RING, "bc ad", "a"),
)
"""Four links in a ring, the joints that slide, and the fixed link: of one slide a link on it, or one of the two others;
of two at one link that link, one that slides on it, or the fourth; of two apart any. F. Reuleaux, The Kinematics of
Machinery, 1876, on the slider-crank chains; R. Norton, Design of Machinery, on inversion."""
_CHAINS = (("Watt chain", WATT), ("Stephenson chain", STEPHENSON))
_RINGS_WITH_SLIDES = (("slider-crank chain", "ad"), ("double slider-crank chain", "cd ad"))
_RINGS = {4: "four-bar chain", 5: "five-bar chain"}


Structure = tuple[tuple[Joint, ...], tuple[int, ...]]
"""The joints of a chain, and the numbers of those that slide."""


def chain_name(joints: tuple[Joint, ...], slides: tuple[int, ...] = ()) -> str:
    """The name of a chain in its own numbering, or nothing."""
    return _names().get((joints, slides), "")


def inversion_names(joints: tuple[Joint, ...], slides: tuple[int, ...] = ()) -> dict[int, str]:
    """The names of a chain's inversions, of one link of each orbit that has a name."""
    return _inversions().get((joints, slides), {})


@cache
def _names() -> dict[Structure, str]:
    named: dict[Structure, str] = {(ring_joints(links), ()): name for links, name in _RINGS.items()}
    for name, letters in (*_CHAINS, *((name, text) for name, text in EIGHT_BARS if max(map(len, text.split())) == 2)):
        named[_structure(letters)[0]] = name
    return named | {_structure(_RING, sliding)[0]: name for name, sliding in _RINGS_WITH_SLIDES}


@cache
def _inversions() -> dict[Structure, dict[int, str]]:
    found: dict[Structure, dict[int, str]] = {}
    for name, letters, sliding, frame in (*((*each[:2], "", each[2]) for each in SIX_BARS), *FOUR_LINKS_WITH_SLIDES):
        structure, numbers = _structure(letters, sliding)
        found.setdefault(structure, {})[numbers[frame]] = name
    return found


def _structure(letters: str, sliding: str = "") -> tuple[Structure, dict[str, int]]:
    """A chain written as the letters of the links that meet in each joint, and in those that slide; the number of each
    letter."""
    links = sorted({*letters} - {" "})
    found = canonical_chain(len(links), [(links.index(pin[0]), links.index(pin[1])) for pin in letters.split()])
    number = dict(zip(links, found.numbers, strict=True))
    place = {joint: index for index, joint in enumerate(found.joints)}
    slides = [place[min(own), max(own)] for own in ([number[link] for link in pin] for pin in sliding.split())]
    every = [*automorphisms(len(links), found.joints)]
    best, slides_there = first_alike(slides, joint_exchanges(every, found.joints))
    return (found.joints, slides_there), {link: every[best][index] for link, index in number.items()}
