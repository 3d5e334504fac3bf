"""Names that the field has for chains, and for six-bars by their fixed link."""

from __future__ import annotations

from functools import cache

from planar.structures.contraction import canonical_chain, ring_joints
from planar.structures.rigid_parts import Joint

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
_CHAINS = (("Watt chain", WATT), ("Stephenson chain", STEPHENSON))
_RINGS = {4: "four-bar chain", 5: "five-bar chain"}


def chain_name(joints: tuple[Joint, ...]) -> str:
    """The name of a chain in its own numbering, or nothing."""
    return _names().get(joints, "")


def inversion_names(joints: tuple[Joint, ...]) -> dict[int, str]:
    """The names of a chain's inversions, of one link of each orbit that has a name."""
    return _inversions().get(joints, {})


@cache
def _names() -> dict[tuple[Joint, ...], str]:
    named = {ring_joints(links): name for links, name in _RINGS.items()}
    for name, letters in (*_CHAINS, *((name, text) for name, text in EIGHT_BARS if max(map(len, text.split())) == 2)):
        named[_canonical(letters)[0]] = name
    return named


@cache
def _inversions() -> dict[tuple[Joint, ...], dict[int, str]]:
    found: dict[tuple[Joint, ...], dict[int, str]] = {}
    for name, letters, frame in SIX_BARS:
        joints, numbers = _canonical(letters)
        found.setdefault(joints, {})[numbers[frame]] = name
    return found


def _canonical(letters: str) -> tuple[tuple[Joint, ...], dict[str, int]]:
    """A chain written as the letters of the links that meet in each joint; the number of each letter."""
    links = sorted({*letters} - {" "})
    found = canonical_chain(len(links), [(links.index(pin[0]), links.index(pin[1])) for pin in letters.split()])
    return found.joints, dict(zip(links, found.numbers, strict=True))
