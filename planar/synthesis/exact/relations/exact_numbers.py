"""Numbers of a task as the decimals that its file has, in the units of a member: rationals, and multiples of pi."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from math import pi
from typing import NamedTuple

from planar.foundation.units import Unit, shortest_number
from planar.synthesis.exact.relations.unknowns import NumberKind


class ExactNumber(NamedTuple):
    """real + i imaginary + pi pi_multiple."""

    real: Fraction
    imaginary: Fraction
    pi_multiple: Fraction

    def minus(self, other: ExactNumber) -> ExactNumber:
        """The difference."""
        return ExactNumber(*(a - b for a, b in zip(self, other, strict=True)))


class ExactScale(NamedTuple):
    """How numbers of a task become those of a member: places from an origin (m), in units of a size (m); `lengths` and
    `angles` are the units that files may have."""

    lengths: tuple[Unit, ...]
    angles: tuple[Unit, ...]
    origin: complex
    size: float

    def scaled(self, kind: NumberKind, value: complex, reference: complex = 0.0) -> ExactNumber:
        """A number, from a reference, as a member has it; angles in rad."""
        units = self.angles if kind is NumberKind.TURN else self.lengths
        number = exact_number(value, units).minus(exact_number(reference, units))
        if kind is NumberKind.TURN:
            return number
        if kind is NumberKind.PLACE:
            number = number.minus(exact_number(self.origin, units))
        size = Fraction(self.size)
        return ExactNumber(number.real / size, number.imaginary / size, Fraction(0))


def exact_number(value: complex, units: Sequence[Unit]) -> ExactNumber:
    """The number whose parts are the shortest decimals, in one of these units, that read back as a value (SI)."""
    value = complex(value)
    real, imaginary = (_shortest(part, tuple(units)) for part in (value.real, value.imag))
    return ExactNumber(real[0], imaginary[0], real[1])


@lru_cache(maxsize=4096)
def _shortest(value: float, units: tuple[Unit, ...]) -> tuple[Fraction, Fraction]:
    """A rational and a multiple of pi."""
    found = [(shortest_number(value, unit), unit) for unit in units]
    decimals = [(number, unit) for number, unit in found if not isinstance(number, str)]
    if not decimals:
        return Fraction(repr(value)), Fraction(0)
    number, unit = min(decimals, key=lambda pair: len(repr(pair[0])))
    rational = Fraction(repr(number)) / Fraction(repr(unit.denominator))
    if unit.numerator == pi:
        return Fraction(0), rational
    return rational * Fraction(repr(unit.numerator)), Fraction(0)
