"""Positions of linkages by closed forms, from the numbers of their files: nothing here is planar's.

A linkage is a crank on the frame and what follows it: two circles that meet, a circle and a line, or a line of a moving
link through a pin. Numbers bear the names that they have in a file (SI).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np

from benchmarks.known_linkages.vectors import (
    Vector,
    circle_intersection,
    direction_between,
    line_displacement,
    real_root,
    unit_vector,
)

Numbers = Mapping[str, Any]
"""Of a file, by name: m or rad."""


class Position(NamedTuple):
    """Where the pins of a linkage are, the origins and directions of the axes of its moving links, the direction of the
    output and the displacement of the slide, where there are such."""

    pins: dict[str, Vector]
    origins: dict[str, Vector]
    directions: dict[str, Vector]
    output: Any
    "a direction (Vector), or a displacement"
    line: Vector | None = None
    "the direction of the line of a slide"

    def place(self, numbers: Numbers, link: str, point: str) -> Vector:
        """Where a point of a moving link is."""
        return self.origins[link] + drawn_point(numbers, link, point).turned(self.directions[link])


def drawn_point(numbers: Numbers, link: str, point: str) -> Vector:
    """A point of a link in its own axes; one that has no coordinates is an end of the link, the second at its
    length."""
    if f"{link}.{point}.x" in numbers:
        return Vector(numbers[f"{link}.{point}.x"], numbers[f"{link}.{point}.y"])
    return Vector(numbers[f"{link}.length"] if point == SECOND_ENDS[link] else 0.0, 0.0)


SECOND_ENDS = {"g": "D", "AB": "B", "BC": "C", "DC": "C", "EF": "F", "GF": "F", "c": "A", "rod": "B"}
"""The second of the ends of links that may be written by ends."""


Kinematics = Callable[[Numbers, Any, tuple[Any, ...]], Position]


class _Builder:
    """The position of a linkage as its parts are added."""

    def __init__(self, numbers: Numbers, frame: str):
        self.numbers, self.frame = numbers, frame
        self.pins: dict[str, Vector] = {}
        self.origins: dict[str, Vector] = {}
        self.directions: dict[str, Vector] = {}

    def drawn(self, link: str, point: str) -> Vector:
        return drawn_point(self.numbers, link, point)

    def between(self, link: str, first: str, second: str) -> Vector:
        return self.drawn(link, second) - self.drawn(link, first)

    def fix(self, *names: str) -> None:
        for name in names:
            self.pins[name] = self.drawn(self.frame, name)

    def stand(self, link: str, point: str, direction: Vector) -> None:
        """Place a link by one of its pins and its direction."""
        self.directions[link] = direction
        self.origins[link] = self.pins[point] - self.drawn(link, point).turned(direction)

    def carry(self, link: str, *points: str) -> None:
        """Add pins of a link that is placed."""
        for point in points:
            self.pins[point] = self.origins[link] + self.drawn(link, point).turned(self.directions[link])

    def crank(self, link: str, pivot: str, pin: str, angle: Any) -> None:
        self.fix(pivot)
        self.stand(link, pivot, unit_vector(angle))
        self.carry(link, pin)

    def dyad(self, first: tuple[str, str, str], second: tuple[str, str, str], sign: Any) -> None:
        """Two links (link, pin that is placed, pin that both share)."""
        drawn = [self.between(*part) for part in (first, second)]
        pin = circle_intersection(self.pins[first[1]], drawn[0].squared, self.pins[second[1]], drawn[1].squared, sign)
        for (link, placed, shared), vector in zip((first, second), drawn, strict=True):
            self.pins[shared] = pin
            self.stand(link, placed, direction_between(vector, pin - self.pins[placed]))

    def line_through(self, link: str, placed: str, pin: str, sign: Any) -> Vector:
        """Place a link by a pin of it and by its line "s", which goes through another pin; the line's direction."""
        way = unit_vector(self.numbers["s.line.angle"])
        height = way.cross(self.between(link, placed, "G"))
        off = self.pins[pin] - self.pins[placed]
        drawn = way.scaled(sign * real_root(off.squared - height * height)) + way.left.scaled(height)
        self.stand(link, placed, direction_between(drawn, off))
        return way.turned(self.directions[link])

    def position(self, output: Any, line: Vector | None = None) -> Position:
        return Position(self.pins, self.origins, self.directions, output, line)


def four_bar(numbers: Numbers, angle: Any, signs: tuple[Any, ...]) -> Position:
    """Frame g with A and D, crank AB, coupler BC, rocker DC."""
    made = _Builder(numbers, "g")
    made.crank("AB", "A", "B", angle)
    made.fix("D")
    made.dyad(("BC", "B", "C"), ("DC", "D", "C"), signs[0])
    return made.position(made.directions["DC"])


def watt_two(numbers: Numbers, angle: Any, signs: tuple[Any, ...]) -> Position:
    """A four-bar whose rocker DC has a pin E more, which drives a second one, EF and GF."""
    made = _Builder(numbers, "g")
    made.crank("AB", "A", "B", angle)
    made.fix("D", "G")
    made.dyad(("BC", "B", "C"), ("DC", "D", "C"), signs[0])
    made.carry("DC", "E")
    made.dyad(("EF", "E", "F"), ("GF", "G", "F"), signs[1])
    return made.position(made.directions["GF"])


def slider_crank(numbers: Numbers, angle: Any, signs: tuple[Any, ...]) -> Position:
    """Frame f with O, crank c, a rod with pin B on the line "s" of the frame."""
    made = _Builder(numbers, "f")
    made.crank("c", "O", "A", angle)
    through = Vector(numbers["s.line.x"], numbers["s.line.y"]) if "s.line.x" in numbers else made.drawn("f", "G")
    if "f.H.x" in numbers:
        between = made.between("f", "G", "H")
        line = between.scaled(1.0 / np.sqrt(between.squared))
    else:
        line = unit_vector(numbers["s.line.angle"])
    drawn = made.between("rod", "A", "B")
    displacement = line_displacement(through, line, made.pins["A"], drawn.squared, signs[0])
    made.pins["B"] = through + line.scaled(displacement)
    made.stand("rod", "A", direction_between(drawn, made.pins["B"] - made.pins["A"]))
    return made.position(displacement, line)


def inverted_slider(pin: str, other: str) -> Kinematics:
    """The closed form of a frame f with O and D, a crank c with A, and a link "rod" with a pin and a line "s" through
    the other one of A and D: a swinging block, whose output is the line, or a slotted lever."""

    def kinematics(numbers: Numbers, angle: Any, signs: tuple[Any, ...]) -> Position:
        builder = _Builder(numbers, "f")
        builder.crank("c", "O", "A", angle)
        builder.fix("D")
        line = builder.line_through("rod", pin, other, signs[0])
        return builder.position(line if other == "D" else builder.directions["rod"], line)

    return kinematics


class Structure(NamedTuple):
    """A kind of linkage: its closed form, how many signs tell its assemblies, its input and output pairs, the coupler,
    and whether its two cranks may change their names."""

    kinematics: Kinematics
    sign_count: int
    frame: str
    inputs: str
    output: str
    coupler: str | None
    dyads: tuple[tuple[str, str], ...] = ()
    "pins of parts of it that differ in their names alone"
    crank: tuple[str, str, str] = ("c", "O", "A")
    "the link of the input, its pivot and its pin"


STRUCTURES = {
    "four-bar": Structure(four_bar, 1, "g", "A", "D", "BC", (("A", "B"), ("D", "C")), ("AB", "A", "B")),
    "slider-crank": Structure(slider_crank, 1, "f", "O", "s", "rod"),
    "swinging block": Structure(inverted_slider("A", "D"), 1, "f", "O", "D", "rod"),
    "slotted lever": Structure(inverted_slider("D", "A"), 1, "f", "O", "D", None),
    "Watt II": Structure(watt_two, 2, "g", "A", "G", None, crank=("AB", "A", "B")),
}


def crank_angles(structure: Structure, numbers: Numbers, targets: Any, at_point: bool) -> Any:
    """Both positions of the input (2, targets) at which P, or the origin of the coupler's axes, is on the circle about
    its target (targets, 2) that its pin on the crank has."""
    assert structure.coupler is not None
    link, pivot, pin = structure.crank
    crank = drawn_point(numbers, link, pin) - drawn_point(numbers, link, pivot)
    point = drawn_point(numbers, structure.coupler, "P") if at_point else Vector(0.0, 0.0)
    radius_square = (drawn_point(numbers, structure.coupler, pin) - point).squared
    centre, place = drawn_point(numbers, structure.frame, pivot), Vector(targets[:, 0], targets[:, 1])
    found = []
    for sign in (1.0, -1.0):
        way = circle_intersection(centre, crank.squared, place, radius_square, sign) - centre
        turn = direction_between(crank, way)
        found.append(np.arctan2(turn.y, turn.x))
    return np.array(found)
