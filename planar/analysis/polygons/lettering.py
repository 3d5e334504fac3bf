"""The letters of a polygon: small ones for the points of the mechanism, with marks for points that only lie on them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from planar.analysis.rate_equations import RateEquations
from planar.analysis.vector_chains import COINCIDENT_TOLERANCE, LinkPoint
from planar.model.mechanism import NamedPoint

GUIDE_LETTERS = ("G", "H", "K", "S", "X")
"""What the fixed point below a slider is called; the first that is no point's own name."""
PRIME = "′"
PART_ENDS_NOTE = "other indices: ends of their parts"
"""Of accelerations."""


def small_letters(points: Iterable[str]) -> dict[str, str]:
    """The letter of each point's image: small, else the point's own, with stars where another has that too."""
    found: dict[str, str] = {}
    taken: set[str] = set()
    for point in points:
        letter = point if point.lower() in taken else point.lower()
        while letter in taken:
            letter += "*"
        taken.add(letter)
        found[point] = letter
    return found


def legend(order: int, below: Mapping[str, tuple[str, str]], frame: str, parts: bool) -> list[str]:
    """What letters of a polygon stand for that are not those of points in the space diagram, in sentences.

    `below` has for letters, as they are written, a link and the point that theirs lies at; `parts` whether heads of
    parts of accelerations (order 2) are lettered.
    """
    found = []
    if order == 2:
        found.append("index 1: accelerations of points" + (f"; {PART_ENDS_NOTE}" if parts else ""))
    links: dict[str, list[str]] = {}
    for letter, (link, _) in below.items():
        links.setdefault(link, []).append(letter)
    for link, letters in links.items():
        at = ", ".join(below[letter][1] for letter in letters)
        whose = "the frame" if link == frame else link
        found.append(f"{', '.join(letters)}: the point{'s' * (len(letters) > 1)} of {whose} at {at}")
    return found


class Lettering:
    """Letters as they are needed: velocity polygon `b`, acceleration polygon `b_1`, head of a part `b_a`.

    A point of a moving link that a slider B lies on is B′; a fixed one is G, G′, ... as the chapters have it.
    """

    def __init__(self, rates: RateEquations, named: Sequence[NamedPoint], frame: str, order: int, size: float):
        self.equations, self.frame, self.suffix = rates, frame, "" if order == 1 else "_1"
        self._same_place = COINCIDENT_TOLERANCE * size  # m
        self.members: Mapping[str, tuple[tuple[str, str], ...]] = {each.name: each.members for each in named}
        taken = {name.lower() for name in self.members}
        self.guide_letter = next((letter for letter in GUIDE_LETTERS if letter.lower() not in taken), "G*")
        self.points: dict[str, str] = {}
        "letter: the point of the space diagram"
        self.places: dict[str, list[LinkPoint]] = {}
        self._letters: dict[tuple[str, str], str] = {}
        self._heads: dict[tuple[tuple[str, str], tuple[str, str]], str] = {}
        self._named = small_letters(self.members)

    def letter(self, place: LinkPoint) -> str:
        """The letter of a place."""
        key = self._key(place)
        if key not in self._letters:
            point = self._point(place)
            letter = (self._free_letter(point) if key[0] else self._named[point]) + self.suffix
            self._letters[key] = letter
            self.points[letter] = point
            own = [
                LinkPoint(link, self.equations.local_point(link, name), place.over)
                for link, name in self.members[place.over]
            ]
            self.places[letter] = own if not key[0] else [place]
        return self._letters[key]

    def share_letter(self, place: LinkPoint, letter: str) -> None:
        """A place that lies where another is, and moves with it."""
        self._letters.setdefault(self._key(place), letter)

    def point_name(self, place: LinkPoint) -> str:
        """The name of a place's point in the space diagram."""
        return self.points[self.letter(place)]

    def points_underneath(self, letters: Iterable[str]) -> dict[str, tuple[str, str]]:
        """Of those letters whose points have no name in the mechanism the link, and the point that it lies at."""
        found = {letter: self.places[letter][0] for letter in letters if self.points[letter] not in self.members}
        return {letter: (place.link, place.over) for letter, place in found.items()}

    def velocity_letter(self, place: LinkPoint) -> str:
        """The letter of a place in the velocity polygon."""
        return self.letter(place).removesuffix(self.suffix)

    def part_letter(self, of: LinkPoint, against: LinkPoint) -> str:
        """The letter at the head of the first part of a relative acceleration: b_a."""
        key = self._key(of), self._key(against)
        if key not in self._heads:
            letter = f"{self.velocity_letter(of)}_{self.velocity_letter(against)}"
            while self._is_taken(letter):
                letter += "*"
            self._heads[key] = letter
        return self._heads[key]

    def drawn_points(self, link: str, drawn: Mapping[str, object]) -> list[tuple[str, LinkPoint]]:
        """The drawn letters of points of a link, each with its place on it; of points in one place the first."""
        found: list[tuple[str, LinkPoint]] = []
        for letter, places in self.places.items():
            for place in places:
                if (
                    letter in drawn
                    and place.link == link
                    and not any(self._is_near(place, other) for _, other in found)
                ):
                    found.append((letter, place))
        return found

    def _is_near(self, one: LinkPoint, other: LinkPoint) -> bool:
        apart = one.local - other.local
        return bool(max(abs(apart.x), abs(apart.y)) <= self._same_place)

    def _key(self, place: LinkPoint) -> tuple[str, str]:
        """("", point) of a named point, else the link and the point that it lies under."""
        named = any(
            link == place.link
            and self._is_near(place, LinkPoint(link, self.equations.local_point(link, name), place.over))
            for link, name in self.members[place.over]
        )
        return ("", place.over) if named else (place.link, place.over)

    def _point(self, place: LinkPoint) -> str:
        link, over = self._key(place)
        if not link:
            return over
        point = self.guide_letter if link == self.frame else over + PRIME
        while point in self.members or point in self.points.values():
            point += PRIME
        return point

    def _free_letter(self, point: str) -> str:
        """A small letter that no other point has."""
        letter = point if self._is_taken(point.lower() + self.suffix) else point.lower()
        while self._is_taken(letter + self.suffix):
            letter += "*"
        return letter

    def _is_taken(self, letter: str) -> bool:
        own = letter.endswith(self.suffix) and letter.removesuffix(self.suffix) in self._named.values()
        return own or letter in self.points or letter in self._heads.values()


def line_name(first: str, second: str) -> str:
    """The line between two points: AB, or B-crank.P where names are long."""
    return f"{first}{second}" if max(len(first), len(second)) <= 2 else f"{first}-{second}"
