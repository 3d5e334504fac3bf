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
    Part,
    Polygon,
    Simultaneous,
    Triangle,
    Vector,
)
from planar.analysis.rich_text import (
    Chord,
    Fraction,
    Name,
    Phrase,
    Piece,
    Quantity,
    Raised,
    Spot,
    Symbol,
    bare,
    number,
    primed,
)
from planar.foundation.units import length_of_rates, own
from planar.model.mechanism import named_points

NONE = 1e-9
"""A vector below this part of the polygon's greatest is zero."""
UNKNOWN: Phrase = ("—",)
SUPERSCRIPTS = {Part.CENTRIPETAL: "c", Part.TANGENTIAL: "t", Part.CORIOLIS: "cr", Part.SLIDING: "s"}


class Row(NamedTuple):
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
        return own(self.polygon.kind, self.polygon.state.mechanism.units)[0]

    @cached_property
    def lengths(self) -> float:
        """How many of the lengths in which rates are told are one metre."""
        return length_of_rates(self.polygon.state.mechanism.units.length)[1].from_si(1.0)

    def number(self, value: float, kind: str) -> str:
        """A number (SI) of a kind of quantity, as it is told."""
        return number(value * self.lengths if kind in ("length", "velocity", "acceleration") else value)

    def quantity(self, value: float) -> Quantity:
        """A magnitude of this polygon's kind (SI) with its unit."""
        return Quantity(value, self.unit, by=self.lengths)

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

    def size(self, value: Sequence[float] | np.ndarray) -> float:
        """The magnitude of a vector, zero where it is round-off beside the greatest."""
        found = float(np.hypot(*value))
        return found if found > NONE * self.greatest else 0.0

    def spot(self, letter: str) -> Spot:
        """A letter with what stands below it told apart."""
        if letter in self.polygon.points:
            return Spot(primed(letter.removesuffix("_1")), "1") if self.order == 2 else Spot(primed(letter))
        plain = {each.removesuffix("_1") for each in self.polygon.points}
        parts = letter.split("_")
        for cut in range(1, len(parts)):
            base, mark = "_".join(parts[:cut]), "_".join(parts[cut:])
            if base in plain and mark in plain:
                return Spot(primed(base), primed(mark))
        return Spot(letter)

    def of_point(self, point: str) -> Phrase:
        """A point's letter."""
        return (self.spot(self.letters[point]),) if point in self.letters else (Name(point),)

    def chord(self, tail: str, head: str) -> Chord:
        """What lies between two letters."""
        return Chord(self.spot(tail), self.spot(head))

    def length(self, tail: str, head: str) -> float:
        """The distance of two letters (m/s or m/s^2)."""
        return self.size(self.polygon.letters[head] - self.polygon.letters[tail])

    def symbol(self, of: str, against: str, part: Part | None = None) -> Symbol:
        """f_cb^c, or v_cb of a velocity."""
        below = [
            self.letters.get(point, point).removesuffix("_1" if self.order == 2 else "") for point in (of, against)
        ]
        between = "/" if max(map(bare, below)) > 1 else ""
        above = SUPERSCRIPTS.get(part, "") if part is not None and self.order == 2 else ""
        return Symbol("v" if self.order == 1 else "f", primed(between.join(below)), above)

    def drawn(self, vector: Vector) -> Quantity:
        """A vector's magnitude, to be drawn."""
        return self.quantity(self.size(vector.value))._replace(kind=self.polygon.kind)

    def row(self, vector: Vector, alone: bool) -> Row:
        """A row of the vector table; `alone`: it is the whole of the relative acceleration along a line."""
        part = None if alone and vector.part is Part.SLIDING else vector.part
        symbol, chord = self.symbol(vector.of, vector.against, part), self.chord(vector.tail, vector.head)
        size = self.size(vector.value)
        magnitude = self.magnitude(vector, size) if vector.known else UNKNOWN
        return Row(symbol, chord, size, vector.known, magnitude, self.direction(vector), self.sense(vector))

    def magnitude(self, vector: Vector, size: float) -> Phrase:
        """The formula of a known magnitude with its numbers: (ab)²/AB = (0.525)²/0.05 = 5.51."""
        if vector.part is Part.SLIDING or not vector.factors:
            pair = vector.factors[0].symbol.partition(" at ")[2] if vector.factors else ""
            given = pair in self.polygon.state.inputs
            return (
                f"{'given' if given else 'by the pair'} at {pair}: " if pair else "",
                self.number(size, self.polygon.kind),
            )
        whole = (" = ", self.number(size, self.polygon.kind))
        if vector.part is Part.CENTRIPETAL:
            speed, length = vector.factors
            over: Phrase = (Raised(self._speed(vector), speed.power),)
            numbers: Phrase = (Raised((f"({self.number(speed.value, speed.kind)})",), speed.power),)
            return (
                Fraction(over, self._factor(length)),
                " = ",
                Fraction(numbers, (self.number(length.value, length.kind),)),
                *whole,
            )
        symbols: list[Piece] = []
        for factor in vector.factors:
            told = self._speed(vector) if factor.kind == "velocity" else self._factor(factor)
            symbols += [*([" × "] if symbols else []), *told]
        values = [
            self.number(factor.value if abs(factor.value) > NONE * self._rate(factor) else 0.0, factor.kind)
            for factor in vector.factors
        ]
        return (*symbols, " = ", " × ".join(values), *whole)

    def _rate(self, factor: Factor) -> float:
        """The greatest rate of a factor's kind, beside which it is none."""
        links = self.polygon.state.links.values()
        greatest = {
            "angular velocity": max((abs(link.angular_velocity) for link in links), default=0.0),
            "angular acceleration": max((abs(link.angular_acceleration) for link in links), default=0.0),
        }
        return greatest.get(factor.kind, 0.0)

    def _speed(self, vector: Vector) -> Phrase:
        """A relative velocity as it was drawn: (ab)."""
        return ("(", Chord(*(Spot(primed(self._small(point))) for point in (vector.against, vector.of))), ")")

    def _factor(self, factor: Factor) -> Phrase:
        if factor.kind == "pure":
            return (factor.symbol,)
        letter, mark, below = factor.symbol.partition("_")
        if mark and factor.kind.startswith("angular"):
            return (Symbol(letter, below),)
        return (Name(factor.symbol),)

    def direction(self, vector: Vector) -> Phrase:
        """∥ AB, ⊥ BC, ∥ line of motion of B."""
        return ("⊥ " if vector.square else "∥ ", *self.line(vector))

    def line(self, vector: Vector) -> Phrase:
        """What a vector is parallel or square to."""
        for words in ("line of motion of ", "line on "):
            if vector.line.startswith(words):
                return (words, Name(vector.line.removeprefix(words)))
        return (Name(vector.line),)

    def sense(self, vector: Vector) -> Phrase:
        """→ A, → a, or words."""
        if not vector.known or not vector.towards or not self.size(vector.value):
            return UNKNOWN
        if vector.part is Part.CENTRIPETAL:
            return ("→ ", Name(vector.towards))
        if vector.part is Part.TANGENTIAL and self._turned(vector):
            return ("→ ", Spot(vector.towards))
        return (vector.towards,)

    def _turned(self, vector: Vector) -> bool:
        """Whether its sense is told by a letter of the velocity polygon."""
        return vector.towards in {
            self.letters.get(point, "").removesuffix("_1") for point in (vector.of, vector.against)
        }

    def aimed(self, vector: Vector) -> Phrase:
        """The direction and sense of a known vector in a sentence: parallel to AB, towards A."""
        found: Phrase = ("square to " if vector.square else "parallel to ", *self._to(vector))
        if vector.part is Part.CENTRIPETAL:
            return (*found, ", towards ", Name(vector.towards))
        if vector.part is Part.TANGENTIAL and self._turned(vector):
            other = next(
                (letter for point in (vector.of, vector.against) if (letter := self._small(point)) != vector.towards),
                "",
            )
            return (*found, ", in the sense of ", Chord(Spot(other), Spot(vector.towards)), " in the velocity polygon")
        return (*found, ", ", vector.towards) if vector.towards else found

    def _small(self, point: str) -> str:
        return self.letters.get(point, point).removesuffix("_1")

    def _to(self, vector: Vector) -> Phrase:
        words = self.line(vector)
        return ("the ", *words) if isinstance(words[0], str) else words

    def ruled(self, vector: Vector) -> Phrase:
        """The line of a vector whose direction alone is known, in a sentence: a line square to BC."""
        return ("a line square to " if vector.square else "a line parallel to ", *self._to(vector))

    def root(self, letter: str) -> str:
        """The letter at the pole that belongs to the links by which a letter is found."""
        seen: set[str] = set()
        while letter not in self.poles and letter not in seen:
            seen.add(letter)
            sources = self._sources(letter)
            at_pole = [each for each in sources if each in self.poles]
            if at_pole or not sources:
                return at_pole[-1] if at_pole else (self.poles[0] if self.poles else letter)
            letter = sources[0]
        return letter if letter in self.poles else (self.poles[0] if self.poles else letter)

    def _sources(self, letter: str) -> list[str]:
        for stage in self.polygon.stages:
            if isinstance(stage, Meeting):
                if letter == stage.letter or any(letter == v.head for side in stage.sides for v in side.vectors):
                    # the side along one link last: that link's fixed point is what a chapter measures from
                    sides = sorted(stage.sides, key=lambda side: -len({(v.of, v.against) for v in side.vectors}))
                    return [side.start for side in sides if side.vectors and side.start != letter]
            elif isinstance(stage, Triangle):
                if self.letters.get(stage.point) == letter:
                    return [self.letters[point] for point in stage.base if point in self.letters]
            elif isinstance(stage, Simultaneous) and letter in stage.letters:
                return []
        return []
