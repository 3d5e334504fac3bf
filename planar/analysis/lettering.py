"""The letters of a polygon: small ones for the points of the mechanism, with marks for points that only lie on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from planar.analysis.ties import Rates
from planar.analysis.walks import NEAR, Place
from planar.mechanism import NamedPoint

GUIDES = ("G", "H", "K", "S", "X")
"""What the fixed point below a slider is called; the first that is no point's own name."""
PRIME = "′"


class Lettering:
    """Letters as they are needed: velocity polygon `b`, acceleration polygon `b_1`, head of a part `b_a`.

    A point of a moving link that a slider B lies on is B′; a fixed one is G, G′, ... as the chapters have it.
    """

    def __init__(self, rates: Rates, named: Sequence[NamedPoint], frame: str, order: int):
        self.rates, self.frame, self.order = rates, frame, order
        self.members: Mapping[str, tuple[tuple[str, str], ...]] = {each.name: each.members for each in named}
        taken = {name.lower() for name in self.members}
        self.guide = next((letter for letter in GUIDES if letter.lower() not in taken), "G*")
        self.points: dict[str, str] = {}
        "letter: the point of the space diagram"
        self.places: dict[str, list[Place]] = {}
        self._letters: dict[tuple[str, str], str] = {}
        self._guides: dict[str, str] = {}

    def letter(self, place: Place) -> str:
        """The letter of a place."""
        key = self._key(place)
        if key not in self._letters:
            point = self._point(place)
            letter = self._free(point) + ("" if self.order == 1 else "_1")
            self._letters[key] = letter
            self.points[letter] = point
            own = [Place(link, self.rates.local(link, name), place.over) for link, name in self.members[place.over]]
            self.places[letter] = own if not key[0] else [place]
        return self._letters[key]

    def same(self, place: Place, letter: str) -> None:
        """A place that lies where another is, and moves with it."""
        self._letters.setdefault(self._key(place), letter)

    def shown(self, place: Place) -> str:
        """The name of a place's point in the space diagram."""
        return self.points[self.letter(place)]

    def plain(self, place: Place) -> str:
        """The letter of a place in the velocity polygon."""
        return self.letter(place).removesuffix("" if self.order == 1 else "_1")

    def between(self, of: Place, against: Place) -> str:
        """The letter at the head of the first part of a relative acceleration: b_a."""
        return f"{self.plain(of)}_{self.plain(against)}"

    def located(self, link: str, drawn: Mapping[str, object]) -> list[tuple[str, Place]]:
        """The drawn letters of points of a link, each with its place on it; of points in one place the first."""
        found: list[tuple[str, Place]] = []
        for letter, places in self.places.items():
            for place in places:
                if letter in drawn and place.link == link and not any(self._near(place, other) for _, other in found):
                    found.append((letter, place))
        return found

    def _near(self, one: Place, other: Place) -> bool:
        apart = one.local - other.local
        return max(abs(apart.x), abs(apart.y)) <= NEAR

    def _key(self, place: Place) -> tuple[str, str]:
        """("", point) of a named point, else the link and the point that it lies under."""
        named = any(
            link == place.link and self._near(place, Place(link, self.rates.local(link, name), place.over))
            for link, name in self.members[place.over]
        )
        return ("", place.over) if named else (place.link, place.over)

    def _point(self, place: Place) -> str:
        link, over = self._key(place)
        if not link:
            return over
        if link == self.frame:
            return self.guide + PRIME * sum(key[0] == self.frame for key in self._letters)
        return over + PRIME * (1 + sum(key[0] not in ("", self.frame) and key[1] == over for key in self._letters))

    def _free(self, point: str) -> str:
        """A small letter that no other point has."""
        letter, taken = point.lower(), {each.removesuffix("_1") for each in self.points}
        if letter in taken:
            letter = point
        while letter in taken:
            letter += "*"
        return letter


def joined(first: str, second: str) -> str:
    """The line between two points: AB, or B-crank.P where names are long."""
    return f"{first}{second}" if max(len(first), len(second)) <= 2 else f"{first}-{second}"
