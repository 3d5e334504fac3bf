"""What rubs at a pair: coefficients of friction, and the parts of a pair's force that friction follows."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from planar.foundation.argument_types import checked_arguments
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar, sqrt
from planar.foundation.short_repr import short_repr


@checked_arguments
class Friction(NamedTuple):
    """Coulomb's friction at a pair: its coefficient in motion, and at rest where that is another."""

    kinetic: float
    static: float | None = None

    def coefficient(self, at_rest: bool) -> Scalar:
        """The coefficient in motion, or at rest."""
        return self.static if at_rest and self.static is not None else self.kinetic

    def angle_sine(self, at_rest: bool) -> Scalar:
        """sin(arctan mu): what a pin's radius is multiplied by for that of its friction circle."""
        coefficient = self.coefficient(at_rest)
        return coefficient / sqrt(1.0 + coefficient * coefficient)


class LoadLaw(Enum):
    """What of its loads friction follows."""

    RESULTANT = "the length of the vector that they are"
    GREATEST = "the greatest of them, whatever its sense"
    SIGNED = "the one that there is, with its sign"


class ContactLoad(NamedTuple):
    """A part of what a pair's constraints exert on a link, along a way or about a place, times a factor.

    `opposed` is the factor where that part is against the rate of the pair's input position; None: the same. `sides`
    say in words where the pair bears with that part positive, and negative; with an `opposed` factor, which side drives
    it with that part along the rate, and against.
    """

    link: str
    factor: Scalar
    direction: Vector | None = None
    place: Vector | None = None
    opposed: Scalar | None = None
    sides: tuple[str, str] = ("", "")

    def __repr__(self) -> str:
        return short_repr(self)
