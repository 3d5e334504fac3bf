"""Tolerances of a mechanism's
from planar.foundation.argument_types import checked_arguments
 numbers and clearances of its pins, as immutable data in SI units."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from planar.foundation.argument_types import checked_arguments

GENERAL = "ISO 2768-1 "
"""How a file begins to name a class of general tolerances."""


@checked_arguments
class Deviations(NamedTuple):
    """How far one number of the file may be from its value: between `lower` and `upper` (SI, signed)."""

    number: str
    kind: str
    lower: float
    upper: float


@checked_arguments
class Clearance(NamedTuple):
    """How far the centres of a pin and its hole may stand apart (m), or the fit that says so, as H7/g6."""

    pair: str
    value: float | None = None
    fit: str | None = None


@checked_arguments
class Tolerances(NamedTuple):
    """The tolerances of numbers, the class of general tolerances ("f", "m", "c" or "v" of ISO 2768-1) for the lengths
    and angles that have none of their own, the clearances of pins, and the lower and upper deviation (m) of all
    `lengths` of links and pairs that have none of their own."""

    numbers: tuple[Deviations, ...] = ()
    general: str | None = None
    clearances: tuple[Clearance, ...] = ()
    lengths: tuple[float, float] | None = None

    def write(self, quantity: Callable[[float, str], float | str]) -> dict[str, Any]:
        """What a file has of them."""
        found: dict[str, Any] = {}
        for each in self.numbers:
            found[each.number] = _write_deviations(each.lower, each.upper, each.kind, quantity)
        if self.lengths is not None:
            found["lengths"] = _write_deviations(*self.lengths, "length", quantity)
        if self.general is not None:
            found["general"] = f"{GENERAL}{self.general}"
        if self.clearances:
            found["clearance"] = {
                each.pair: each.fit if each.value is None else quantity(each.value, "length")
                for each in self.clearances
            }
        return found


def _write_deviations(lower: float, upper: float, kind: str, quantity: Callable[[float, str], float | str]) -> Any:
    """One value for plus and minus, else the lower and the upper deviation."""
    return quantity(upper, kind) if lower == -upper else [quantity(lower, kind), quantity(upper, kind)]
