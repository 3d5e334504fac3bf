"""How the vectors of a polygon are written: their symbols, letters, magnitudes, directions and senses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.analysis.polygons.polygon import (
    Factor,
    Meeting,
    PointImage,
    Polygon,
    PolygonVector,
    SimultaneousSolution,
    VectorPart,
)
from planar.analysis.rich_text import (
    Chord,
    Fraction,
    MeasuredValue,
    Name,
    Phrase,
    PhrasePiece,
    PolygonLetter,
    Power,
    Symbol,
    format_number,
    length_without_primes,
    with_double_primes,
)
from planar.foundation.arrays import Array
from planar.model.file_units import rate_unit
from planar.model.mechanism import named_points

NEGLIGIBLE_RATIO = 1e-12
"""A vector below this part of the polygon's greatest is zero."""
UNKNOWN_PHRASE: Phrase = ("—",)
PART_SUPERSCRIPTS = {
    VectorPart.CENTRIPETAL: "c",
    VectorPart.TANGENTIAL: "t",
    VectorPart.CORIOLIS: "cr",
    VectorPart.SLIDING: "s",
}


class VectorRow(NamedTuple):
    """A row of a vector table. `value` is the magnitude that is found in the end (m/s or m/s^2)."""

    symbol: Symbol
    chord: Chord
    value: float
    known: bool
    magnitude: Phrase
    direction: Phrase
    sense: Phrase


@dataclass(frozen=True)
class Notation:
    """The letters and symbols of one polygon."""

    polygon: Polygon

    @property
    def order(self) -> int:
        """1 for velocities, 2 for accelerations."""
        return 1 if self.polygon.kind == "velocity" else 2

    @cached_property
    def unit(self) -> str:
        """The unit in which its vectors are told: m/s."""
        return rate_unit(self.polygon.kind, self.polygon.state.mechanism.units)[0]

    @cached_property
    def lengths_per_metre(self) -> float:
        """How many of the lengths in which rates are told are one metre."""
        return rate_unit(self.polygon.kind, self.polygon.state.mechanism.units)[1].from_si(1.0)

    def format_number(self, value: float, kind: str) -> str:
        """A number (SI) of a kind of quantity, as it is told."""
        return format_number(
            value * self.lengths_per_metre if kind in ("length", "velocity", "acceleration") else value
        )

    def quantity(self, value: float) -> MeasuredValue:
        """A magnitude of this polygon's kind (SI) with its unit."""
        return MeasuredValue(value, self.unit, units_per_si=self.lengths_per_metre)

    @cached_property
    def letters(self) -> Mapping[str, str]:
        """The letter of every point of the space diagram."""
        return {point: letter for letter, point in reversed(self.polygon.points.items())}

    @cached_property
    def poles(self) -> tuple[str, ...]:
        """The letters of what is fixed, also of points that are reached from moving links first."""
        mechanism = self.polygon.state.mechanism
        members = {each.name: each.members for each in named_points(mechanism)}
        fixed = {name for name, each in members.items() if any(link == mechanism.frame for link, _ in each)}
        others = [letter for letter, point in self.polygon.points.items() if point in fixed]
        return tuple(dict.fromkeys((*self.polygon.pole, *others)))

    @cached_property
    def greatest(self) -> float:
        """The greatest vector of the polygon (m/s or m/s^2)."""
        return max((float(np.hypot(*value)) for value in self.polygon.letters.values()), default=0.0)

    def vector_length(self, value: Sequence[float] | Array) -> float:
        """The magnitude of a vector, zero where it is round-off beside the greatest."""
        found = float(np.hypot(*value))
        return found if found > NEGLIGIBLE_RATIO * self.greatest else 0.0

    def polygon_letter(self, letter: str) -> PolygonLetter:
        """A letter with what stands below it told apart."""
        if letter in self.polygon.points:
            return (
                PolygonLetter(with_double_primes(letter.removesuffix("_1")), "1")
                if self.order == 2
                else PolygonLetter(with_double_primes(letter))
            )
        plain = {each.removesuffix("_1") for each in self.polygon.points}
        parts = letter.split("_")
        for cut in range(1, len(parts)):
            base, mark = "_".join(parts[:cut]), "_".join(parts[cut:])
            if base in plain and mark in plain:
                return PolygonLetter(with_double_primes(base), with_double_primes(mark))
        return PolygonLetter(letter)

    def point_letter(self, point: str) -> Phrase:
        """A point's letter."""
        return (self.polygon_letter(self.letters[point]),) if point in self.letters else (Name(point),)

    def chord(self, tail: str, head: str) -> Chord:
        """What lies between two letters."""
        return Chord(self.polygon_letter(tail), self.polygon_letter(head))

    def letter_distance(self, tail: str, head: str) -> float:
        """The distance of two letters (m/s or m/s^2)."""
        return self.vector_length(self.polygon.letters[head] - self.polygon.letters[tail])

    def symbol(self, of: str, against: str, part: VectorPart | None = None) -> Symbol:
        """f_cb^c, or v_cb of a velocity."""
        below = [
            self.letters.get(point, point).removesuffix("_1" if self.order == 2 else "") for point in (of, against)
        ]
        between = "/" if max(map(length_without_primes, below)) > 1 else ""
        above = PART_SUPERSCRIPTS.get(part, "") if part is not None and self.order == 2 else ""
        return Symbol("v" if self.order == 1 else "f", with_double_primes(between.join(below)), above)

    def drawn_magnitude(self, vector: PolygonVector) -> MeasuredValue:
        """A vector's magnitude, to be drawn."""
        return self.quantity(self.vector_length(vector.value))._replace(kind=self.polygon.kind)

    def row(self, vector: PolygonVector, alone: bool) -> VectorRow:
        """A row of the vector table; `alone`: it is the whole of the relative acceleration along a line."""
        part = None if alone and vector.part is VectorPart.SLIDING else vector.part
        symbol, chord = self.symbol(vector.of, vector.against, part), self.chord(vector.tail, vector.head)
        size = self.vector_length(vector.value)
        magnitude = self.magnitude(vector, size) if vector.known else UNKNOWN_PHRASE
        return VectorRow(symbol, chord, size, vector.known, magnitude, self.direction(vector), self.sense(vector))

    def magnitude(self, vector: PolygonVector, size: float) -> Phrase:
        """The formula of a known magnitude with its numbers: (ab)²/AB = (0.525)²/0.05 = 5.51."""
        if vector.part is VectorPart.SLIDING or not vector.factors:
            pair = vector.factors[0].symbol.partition(" at ")[2] if vector.factors else ""
            given = pair in self.polygon.state.inputs
            return (
                f"{'given' if given else 'by the pair'} at {pair}: " if pair else "",
                self.format_number(size, self.polygon.kind),
            )
        whole = (" = ", self.format_number(size, self.polygon.kind))
        if vector.part is VectorPart.CENTRIPETAL:
            speed, length = vector.factors
            over: Phrase = (Power(self._speed(vector), speed.power),)
            numbers: Phrase = (Power((f"({self.format_number(speed.value, speed.kind)})",), speed.power),)
            return (
                Fraction(over, self._factor(length)),
                " = ",
                Fraction(numbers, (self.format_number(length.value, length.kind),)),
                *whole,
            )
        symbols: list[PhrasePiece] = []
        for factor in vector.factors:
            told = self._speed(vector) if factor.kind == "velocity" else self._factor(factor)
            symbols += [*([" × "] if symbols else []), *told]
        values = [
            self.format_number(
                factor.value if abs(factor.value) > NEGLIGIBLE_RATIO * self._greatest_rate(factor) else 0.0, factor.kind
            )
            for factor in vector.factors
        ]
        return (*symbols, " = ", " × ".join(values), *whole)

    def _greatest_rate(self, factor: Factor) -> float:
        """The greatest rate of a factor's kind, beside which it is none."""
        links = self.polygon.state.links.values()
        greatest = {
            "angular velocity": max((abs(link.angular_velocity) for link in links), default=0.0),
            "angular acceleration": max((abs(link.angular_acceleration) for link in links), default=0.0),
        }
        return greatest.get(factor.kind, 0.0)

    def _speed(self, vector: PolygonVector) -> Phrase:
        """A relative velocity as it was drawn: (ab)."""
        return (
            "(",
            Chord(
                *(
                    PolygonLetter(with_double_primes(self._velocity_letter(point)))
                    for point in (vector.against, vector.of)
                )
            ),
            ")",
        )

    def _factor(self, factor: Factor) -> Phrase:
        if factor.kind == "pure":
            return (factor.symbol,)
        letter, mark, below = factor.symbol.partition("_")
        if mark and factor.kind.startswith("angular"):
            return (Symbol(letter, below),)
        return (Name(factor.symbol),)

    def direction(self, vector: PolygonVector) -> Phrase:
        """∥ AB, ⊥ BC, ∥ line of motion of B."""
        return ("⊥ " if vector.is_perpendicular else "∥ ", *self.line(vector))

    def line(self, vector: PolygonVector) -> Phrase:
        """What a vector is parallel or square to."""
        for words in ("line of motion of ", "line on "):
            if vector.line.startswith(words):
                return (words, Name(vector.line.removeprefix(words)))
        return (Name(vector.line),)

    def sense(self, vector: PolygonVector) -> Phrase:
        """→ A, → a, or words."""
        if not vector.known or not vector.towards or not self.vector_length(vector.value):
            return UNKNOWN_PHRASE
        if vector.part is VectorPart.CENTRIPETAL:
            return ("→ ", Name(vector.towards))
        if vector.part is VectorPart.TANGENTIAL and self._is_towards_letter(vector):
            return ("→ ", PolygonLetter(vector.towards))
        return (vector.towards,)

    def _is_towards_letter(self, vector: PolygonVector) -> bool:
        """Whether its sense is told by a letter of the velocity polygon."""
        return vector.towards in {
            self.letters.get(point, "").removesuffix("_1") for point in (vector.of, vector.against)
        }

    def direction_and_sense(self, vector: PolygonVector) -> Phrase:
        """The direction and sense of a known vector in a sentence: parallel to AB, towards A."""
        found: Phrase = ("square to " if vector.is_perpendicular else "parallel to ", *self._line_with_article(vector))
        if vector.part is VectorPart.CENTRIPETAL:
            return (*found, ", towards ", Name(vector.towards))
        if vector.part is VectorPart.TANGENTIAL and self._is_towards_letter(vector):
            other = next(
                (
                    letter
                    for point in (vector.of, vector.against)
                    if (letter := self._velocity_letter(point)) != vector.towards
                ),
                "",
            )
            return (
                *found,
                ", in the sense of ",
                Chord(PolygonLetter(other), PolygonLetter(vector.towards)),
                " in the velocity polygon",
            )
        return (*found, ", ", vector.towards) if vector.towards else found

    def _velocity_letter(self, point: str) -> str:
        return self.letters.get(point, point).removesuffix("_1")

    def _line_with_article(self, vector: PolygonVector) -> Phrase:
        words = self.line(vector)
        return ("the ", *words) if isinstance(words[0], str) else words

    def line_to_draw(self, vector: PolygonVector) -> Phrase:
        """The line of a vector whose direction alone is known, in a sentence: a line square to BC."""
        return (
            "a line square to " if vector.is_perpendicular else "a line parallel to ",
            *self._line_with_article(vector),
        )

    def pole_letter(self, letter: str) -> str:
        """The letter at the pole that belongs to the links by which a letter is found."""
        seen: set[str] = set()
        while letter not in self.poles and letter not in seen:
            seen.add(letter)
            sources = self._source_letters(letter)
            at_pole = [each for each in sources if each in self.poles]
            if at_pole or not sources:
                return at_pole[-1] if at_pole else (self.poles[0] if self.poles else letter)
            letter = sources[0]
        return letter if letter in self.poles else (self.poles[0] if self.poles else letter)

    def _source_letters(self, letter: str) -> list[str]:
        for stage in self.polygon.stages:
            if isinstance(stage, Meeting):
                if letter == stage.letter or any(letter == v.head for side in stage.sides for v in side.vectors):
                    # the side along one link last: that link's fixed point is what a chapter measures from
                    sides = sorted(stage.sides, key=lambda side: -len({(v.of, v.against) for v in side.vectors}))
                    return [side.start for side in sides if side.vectors and side.start != letter]
            elif isinstance(stage, PointImage):
                if self.letters.get(stage.point) == letter:
                    return [self.letters[point] for point in stage.base if point in self.letters]
            elif isinstance(stage, SimultaneousSolution) and letter in stage.letters:
                return []
        return []
