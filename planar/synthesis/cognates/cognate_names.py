"""Names for the pins and links of cognates: as they were where they stay, new ones for what is elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from planar.model.mechanism import Mechanism
from planar.synthesis.cognates.posed_linkage import PosedLinkage, PosedPin

PIVOT_LETTERS = "GHKMNPQRSTUVWXYZABCDEFJLIO"
"""What new pins of links that stay are called, the first that is free."""


class NewPivot(NamedTuple):
    """A pin that a link, which stays, has in some of the cognates: its place on it in the first position."""

    link: str
    at: complex
    name: str


class CognateNames:
    """Gives names: those of the file to what stays, and one to what is at the same place in several cognates."""

    def __init__(self, mechanism: Mechanism, posed: PosedLinkage):
        self.original = posed
        self.taken = {pair.entry_name() for pair in mechanism.pairs}
        self.taken |= {name for link in mechanism.links for name in (link.name, *link.names)}
        self.pivots: list[NewPivot] = []

    def pin_names(self, posed: PosedLinkage, number: int) -> dict[PosedPin, str]:
        """The name of every pin of a cognate of this number."""
        places = {pin.name: pin.at for pin in self.original.pins}
        used, found = set[str](), {}
        for pin in posed.pins:
            stays = [link for link in pin.links if link not in posed.remade]
            if posed.is_same(pin.at, places[pin.name]) and pin.name not in used:
                name = pin.name
            elif stays:
                name = self._pivot_name(posed, stays[0], pin.at, used)
            else:
                name = self._free((_numbered(pin.name, number), *_primed(_numbered(pin.name, number))), used)
            used.add(name)
            found[pin] = name
        return found

    def _pivot_name(self, posed: PosedLinkage, link: str, at: complex, used: set[str]) -> str:
        known = (each.name for each in self.pivots if each.link == link and posed.is_same(each.at, at))
        name = next((each for each in known if each not in used), None)
        if name is None:
            name = self._free((*PIVOT_LETTERS, *_primed("G")), used | {each.name for each in self.pivots})
            self.pivots.append(NewPivot(link, at, name))
        return name

    def _free(self, names: tuple[str, ...] | Iterator[str], used: set[str]) -> str:
        return next(name for name in names if name not in self.taken and name not in used)


def link_name(old: str, renamed: dict[str, str], taken: set[str]) -> str:
    """The name of a link whose pins have other names: it follows them where it is made of them, as AB, or block B."""
    ends = [(one, other) for one in renamed for other in renamed if one != other and one + other == old]
    head, _, last = old.rpartition(" ")
    if ends:
        found = "".join(renamed[each] for each in ends[0])
    elif head and last in renamed:
        found = f"{head} {renamed[last]}"
    else:
        return old
    return found if found not in taken else old


def _numbered(name: str, number: int) -> str:
    return f"{name}-{number}" if name[-1:].isdigit() else f"{name}{number}"


def _primed(name: str) -> tuple[str, ...]:
    return tuple(f"{name}-{k}" for k in range(2, 100))
