"""What is drawn of a mechanism's springs, dampers and masses: places in the own axes of links (m)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from planar.dynamics.load_attachment import attachments
from planar.dynamics.load_validation import check_loads
from planar.foundation.geometry import Vector
from planar.model.link_graph import link_numbers
from planar.model.link_shapes import LinkShape
from planar.model.loads import Mass, Spring
from planar.model.mechanism import Mechanism, named_points

SUBSCRIPTS = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")


class Coil(NamedTuple):
    """A spring or a damper between places of two links; `symbol` is a key of `symbols.SPRING_SYMBOLS`."""

    name: str
    links: tuple[str, str]
    at: tuple[Vector, Vector]
    symbol: str


class Spiral(NamedTuple):
    """A torsional spring or damper at a place of the link `pin`; `ways` go from there along both its links.

    `free` is the angle (rad) of the second link's axes against the first's without a couple.
    """

    name: str
    links: tuple[str, str]
    pin: str
    at: Vector
    ways: tuple[Vector, Vector]
    free: float
    symbol: str


class MassCentreMark(NamedTuple):
    """A centre of mass, with the letter that it has where no point of the link has its name there."""

    name: str
    link: str
    at: Vector
    letter: str


SpringMassMark = Coil | Spiral | MassCentreMark


def spring_mass_marks(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> Iterator[SpringMassMark]:
    """What is drawn of a mechanism's springs and masses. Raises BadInput where they are none of its own."""
    if not (mechanism.springs or mechanism.masses):
        return
    check_loads(mechanism)
    where = attachments(mechanism)
    for number, spring in enumerate(mechanism.springs, start=1):
        symbol = ("both" if spring.damping else "spring") if spring.stiffness or not spring.damping else "damper"
        if spring.is_torsional:
            yield _torsion_spring_mark(mechanism, shapes, spring, f"spring {number}", symbol)
        else:
            ends = [where[end] for end in spring.ends]
            first, second = (shapes[each.link].position(each.point) for each in ends)
            yield Coil(f"spring {number}", (ends[0].link, ends[1].link), (first, second), symbol)
    masses = [mass for mass in mechanism.masses if mass.mass]
    letters = _mass_centre_letters(mechanism, masses)
    for mass, letter in zip(masses, letters, strict=True):
        yield MassCentreMark(f"mass of {mass.link}", mass.link, shapes[mass.link].position(mass.at), letter)


def _torsion_spring_mark(
    mechanism: Mechanism, shapes: Mapping[str, LinkShape], spring: Spring, name: str, symbol: str
) -> Spiral:
    """Where the two links meet in a point, else at the first point of the second."""
    first, second = spring.ends
    met = [dict(each.members) for each in named_points(mechanism)]
    at = next((each for each in met if first in each and second in each), {})
    own = at.get(second) or next(iter(shapes[second].points), None)
    place = Vector(0.0, 0.0) if own is None else shapes[second].position(own)

    def way(link: str) -> Vector:
        """From the pin to another point of the link, else along its axis."""
        points, pin = shapes[link].points, at.get(link)
        other = next((point for point in points if point != pin), None)
        return Vector(1.0, 0.0) if pin is None or other is None else points[other] - points[pin]

    return Spiral(name, (first, second), second, place, (way(first), way(second)), spring.free, symbol)


def _mass_centre_letters(mechanism: Mechanism, masses: list[Mass]) -> list[str]:
    """G for a centre at no named point, with its link's number where there are several; primes on one link."""
    spots = [mass.link for mass in masses if not isinstance(mass.at, str)]
    plain = len(spots) == 1 and "G" not in {each.name for each in named_points(mechanism)}
    number, seen, found = link_numbers(mechanism), dict.fromkeys(spots, 0), []
    for mass in masses:
        if isinstance(mass.at, str):
            found.append("")
            continue
        found.append("G" if plain else f"G{number[mass.link].translate(SUBSCRIPTS)}{'′' * seen[mass.link]}")
        seen[mass.link] += 1
    return found
