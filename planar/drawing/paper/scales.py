"""Scales of drawings: round ones that fit the paper, or given ones, and how they are said."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import floor, isfinite, log10

from planar.foundation.errors import BadInput
from planar.foundation.units import UnitError, format_unit, parse_quantity, parse_unit
from planar.model.file_units import FileUnits, coherent_unit, display_unit, is_customary, is_si

DRAWING_WIDTH, DRAWING_HEIGHT = 150.0, 110.0
"""mm on paper that one drawing takes at the most, unless its scale is given."""
ROUND_DIGITS = (1.0, 2.0, 5.0, 10.0)
"""First digits of a scale that a ruler reads easily."""
DECIMAL_STEPS = (1.0, 2.0, 5.0)
DEGREE_STEPS = (1.0, 2.0, 3.0, 4.5, 6.0, 9.0, 1.5)
"""First digits of the step between two numbers of an axis."""
SCREEN_DIGITS = (1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
"""First digits of a scale on a screen, where room is short and nobody lays a ruler on."""
ROUND_SLACK = 1e-9
"""A part by which something may be more than what fits: what fits exactly fits."""
LARGE_PREFIXES = (("G", 1e9), ("M", 1e6), ("k", 1e3))
PREFIX_THRESHOLD, MILLI_THRESHOLD = 10.0, 0.01
"""A force or a couple is said in the next larger unit from so many of these on, below so many in thousandths."""
SCALE_SYMBOLS = {"length": "μₗ", "velocity": "μᵥ", "acceleration": "μₐ"}
"""Of the calculating scales of a space diagram and its polygons."""
_NO_UNITS = FileUnits()
INCH = 25.4
"""mm."""


@dataclass(frozen=True)
class Scale:
    """So much of a quantity (SI) to a millimetre on paper; `unit` is the one in which it is said, such as mm or m/s.

    It is said by the centimetre of paper, of inches and the like by the inch.
    """

    kind: str
    per_mm: float
    unit: str

    def on_paper(self, value: float) -> float:
        """Millimetres on paper for a value (SI)."""
        return value / self.per_mm

    def __str__(self) -> str:
        """As chapters write it: 1 cm = 100 mm."""
        paper, length = paper_unit(self.unit)
        value, written = parse_unit(self.unit).from_si(length * self.per_mm), self.unit
        if written == "mm" and value >= 1000.0:
            value, written = value / 1000.0, "m"
        told = f"1 {paper} = {value:.6g} {format_unit(written)}"
        return f"{told} (1:1)" if self.kind == "length" and self.per_mm == 1e-3 else told

    @property
    def calculating_scale(self) -> str:
        """The calculating scale, in SI units to a millimetre, of inches in these to an inch: μₗ = 0.01 m/mm."""
        name, of = coherent_unit(self.unit)
        return format_calculating_scale(SCALE_SYMBOLS[self.kind], of.from_si(self.per_mm), name, FileUnits(length=name))

    def paper_text(self, value: float) -> str:
        """The length on paper of a value (SI): 40.0 mm, beside inches 1.57 in."""
        paper, length = paper_unit(self.unit)
        return f"{self.on_paper(value):.1f} mm" if paper == "cm" else f"{self.on_paper(value) / length:.2f} {paper}"


def paper_unit(unit_name: str) -> tuple[str, float]:
    """The length by which a scale of this unit is said, and its millimetres: a centimetre, or an inch."""
    return ("in", INCH) if is_customary(unit_name) else ("cm", 10.0)


def tick_spacing(unit_name: str) -> float:
    """mm between the ticks of an axis at a scale that is said in this unit: a centimetre, or half an inch."""
    return INCH / 2.0 if is_customary(unit_name) else 10.0


def paper_length(length: float, units: FileUnits) -> str:
    """A length on paper (mm): 150 mm, beside inches 5.91 in."""
    return f"{length / INCH:.2f} in" if is_customary(units.length) else f"{length:g} mm"


def format_calculating_scale(symbol: str, per_mm: float, unit_name: str, units: FileUnits) -> str:
    """A calculating scale, so much of a unit by the millimetre of paper, beside inches by the inch."""
    by, per = (INCH, "in") if is_customary(units.length) else (1.0, "mm")
    name = format_unit(unit_name)
    return f"{symbol} = {per_mm * by:.4g} {f'({name})' if '/' in name else name}/{per}"


def round_scale(
    kind: str, unit_name: str, width: float, height: float, room: tuple[float, float] = (DRAWING_WIDTH, DRAWING_HEIGHT)
) -> Scale:
    """The roundest largest scale at which `width` x `height` (SI) fits the room (mm); `written` is the unit said."""
    most = max(width / room[0], height / room[1])
    size, (_, length) = parse_unit(unit_name), paper_unit(unit_name)
    least = size.from_si(length * most)
    if not isfinite(least) or least <= 0.0:
        return Scale(kind, size.to_si(1.0) / length, unit_name)
    power = 10.0 ** floor(log10(least))
    first = next(digit for digit in ROUND_DIGITS if digit * power >= least * (1.0 - ROUND_SLACK))
    return Scale(kind, size.to_si(first * power) / length, unit_name)


def round_step(least: float, first_digits: Sequence[float] = DECIMAL_STEPS) -> float:
    """The smallest step of the form first * 10^k that is not below the least."""
    power = 10.0 ** (floor(log10(least)) - 1)
    steps = sorted(first * power * more for first in first_digits for more in (1.0, 10.0, 100.0))
    return next(step for step in steps if step >= least * (1.0 - ROUND_SLACK))


def round_values(first_digits: Sequence[float], powers: range) -> list[float]:
    """All values of the form first * 10^k with k among the powers, rising."""
    return sorted({float(f"{first:g}e{power}") for first in first_digits for power in powers})


def choose_prefix(value: float) -> tuple[str, float]:
    """The prefix of the unit in which so much force (N) or couple (N m) is said, and how many SI units that has."""
    small = ("m", 1e-3) if 0.0 < abs(value) < MILLI_THRESHOLD else ("", 1.0)
    return next((each for each in LARGE_PREFIXES if abs(value) >= PREFIX_THRESHOLD * each[1]), small)


def unit_for_size(kind: str, greatest: float, units: FileUnits) -> tuple[str, float]:
    """The unit in which so great a force (N) or couple (N m) is said, as it is printed, and how many SI units it has.

    In SI with a prefix, unless the file declares another unit for it.
    """
    name, of = display_unit(kind, units)
    if not is_si(kind, units):
        return name, of.to_si(1.0)
    prefix, per = choose_prefix(greatest)
    return prefix + name, per


def format_force(value: float, kind: str, units: FileUnits) -> str:
    """A force (N) or a couple (N m) with its unit: 46.65 kN."""
    name, per = unit_for_size(kind, value, units)
    return f"{value / per:.4g} {name}".replace("-", "−")


def parse_scale(text: str, units: FileUnits = _NO_UNITS) -> Scale:
    """A scale as a reader writes it: "1 cm = 0.1 m/s", of lengths also "1:5" or "2:1". Raises BadInput."""
    ratio = re.fullmatch(r"\s*([0-9.]+)\s*:\s*([0-9.]+)\s*", text)
    try:
        if ratio is not None:
            paper, real = (float(part) for part in ratio.groups())
            kind, per_mm, written = "length", 1e-3 * real / paper, units.length if is_customary(units.length) else "mm"
        else:
            left, equals, right = text.partition("=")
            if not equals:
                raise UnitError(f'{text!r} is not of the form "1 cm = 100 mm", "1 cm = 0.1 m/s" or "1:5"')
            written = re.sub(r"^[\s0-9.eE+-]+", "", right).strip()
            kind = parse_unit(written).kind
            per_mm = parse_quantity(right.strip(), kind) / (1e3 * parse_quantity(left.strip(), "length"))
    except (UnitError, ZeroDivisionError, ValueError) as problem:
        raise BadInput("scale", f"{problem}") from None
    if not 0.0 < per_mm < 1e12:
        raise BadInput("scale", f"{text!r} is no scale that could be drawn")
    return Scale(kind, per_mm, written)


def parse_scales(
    texts: str | Sequence[str] | None,
    kinds: Sequence[str] = tuple(SCALE_SYMBOLS),
    units: FileUnits = _NO_UNITS,
) -> dict[str, Scale]:
    """Scales as a reader writes them, by the kind of quantity that each measures. Raises BadInput for other kinds."""
    found: dict[str, Scale] = {}
    for text in [texts] if isinstance(texts, str) else texts or ():
        scale = parse_scale(text, units)
        if scale.kind not in kinds:
            raise BadInput("scale", f"this drawing has a scale of {' and of '.join(kinds)}, not of {scale.kind}")
        if scale.kind in found:
            raise BadInput("scale", f"two scales of {scale.kind} are given; one is wanted")
        found[scale.kind] = scale
    return found
