"""Quantities of files in SI, and SI numbers in the units of a file.

The spellings that mechanism files use most stand in a table, so that reading them loads no library;
every other unit is looked up in pint, and a test holds the table to pint's own answers.
"""

from __future__ import annotations

import re
from functools import cache
from math import isfinite, pi
from typing import TYPE_CHECKING, Any, NamedTuple, overload

if TYPE_CHECKING:
    import numpy as np
    from pint import UnitRegistry  # slow to load

SI_UNITS = {
    "length": "m",
    "angle": "rad",
    "angular velocity": "rad/s",
    "angular acceleration": "rad/s^2",
    "velocity": "m/s",
    "acceleration": "m/s^2",
    "jerk": "m/s^3",
    "angular jerk": "rad/s^3",
    "force": "N",
    "torque": "N m",
    "time": "s",
    "mass": "kg",
    "moment of inertia": "kg m^2",
    "stiffness": "N/m",
    "torsional stiffness": "N m/rad",
    "damping": "N s/m",
    "torsional damping": "N m s/rad",
    "power": "W",
    "stress": "Pa",
}
"""Every kind of quantity that units tell from others, and its SI unit."""

POUND = 0.45359237
"""kg of a pound, exactly."""
POUND_FORCE = POUND * 9.80665
"""N of the weight of a pound in standard gravity, exactly."""
UNIT_TABLE: dict[str, tuple[str, float, float]] = {
    "m": ("length", 1.0, 1.0),
    "mm": ("length", 1.0, 1e3),
    "cm": ("length", 1.0, 1e2),
    "km": ("length", 1e3, 1.0),
    "um": ("length", 1.0, 1e6),
    "in": ("length", 0.0254, 1.0),
    "ft": ("length", 0.3048, 1.0),
    "rad": ("angle", 1.0, 1.0),
    "deg": ("angle", pi, 180.0),
    "rad/s": ("angular velocity", 1.0, 1.0),
    "deg/s": ("angular velocity", pi, 180.0),
    "rpm": ("angular velocity", pi, 30.0),
    "rad/s^2": ("angular acceleration", 1.0, 1.0),
    "deg/s^2": ("angular acceleration", pi, 180.0),
    "m/s": ("velocity", 1.0, 1.0),
    "mm/s": ("velocity", 1.0, 1e3),
    "in/s": ("velocity", 0.0254, 1.0),
    "ft/s": ("velocity", 0.3048, 1.0),
    "m/s^2": ("acceleration", 1.0, 1.0),
    "mm/s^2": ("acceleration", 1.0, 1e3),
    "in/s^2": ("acceleration", 0.0254, 1.0),
    "ft/s^2": ("acceleration", 0.3048, 1.0),
    "N": ("force", 1.0, 1.0),
    "kN": ("force", 1e3, 1.0),
    "N m": ("torque", 1.0, 1.0),
    "s": ("time", 1.0, 1.0),
    "ms": ("time", 1.0, 1e3),
    "kg": ("mass", 1.0, 1.0),
    "g": ("mass", 1.0, 1e3),
    "kg m^2": ("moment of inertia", 1.0, 1.0),
    "N/m": ("stiffness", 1.0, 1.0),
    "N/mm": ("stiffness", 1e3, 1.0),
    "N/um": ("stiffness", 1e6, 1.0),
    "N m/rad": ("torsional stiffness", 1.0, 1.0),
    "N s/m": ("damping", 1.0, 1.0),
    "N m s/rad": ("torsional damping", 1.0, 1.0),
    "W": ("power", 1.0, 1.0),
    "kW": ("power", 1e3, 1.0),
    "lbf": ("force", POUND_FORCE, 1.0),
    "lbf in": ("torque", POUND_FORCE * 0.0254, 1.0),
    "lbf ft": ("torque", POUND_FORCE * 0.3048, 1.0),
    "in lbf": ("torque", POUND_FORCE * 0.0254, 1.0),
    "ft lbf": ("torque", POUND_FORCE * 0.3048, 1.0),
    "lb": ("mass", POUND, 1.0),
    "slug": ("mass", POUND_FORCE, 0.3048),
    "lb in^2": ("moment of inertia", POUND * 0.0254**2, 1.0),
    "lb ft^2": ("moment of inertia", POUND * 0.3048**2, 1.0),
    "slug ft^2": ("moment of inertia", POUND_FORCE * 0.3048, 1.0),
    "lbf in s^2": ("moment of inertia", POUND_FORCE * 0.0254, 1.0),
    "lbf/in": ("stiffness", POUND_FORCE, 0.0254),
    "lbf/ft": ("stiffness", POUND_FORCE, 0.3048),
    "lbf in/rad": ("torsional stiffness", POUND_FORCE * 0.0254, 1.0),
    "lbf ft/rad": ("torsional stiffness", POUND_FORCE * 0.3048, 1.0),
    "lbf s/in": ("damping", POUND_FORCE, 0.0254),
    "lbf s/ft": ("damping", POUND_FORCE, 0.3048),
    "lbf in s/rad": ("torsional damping", POUND_FORCE * 0.0254, 1.0),
    "lbf ft s/rad": ("torsional damping", POUND_FORCE * 0.3048, 1.0),
    "lbf in/s": ("power", POUND_FORCE * 0.0254, 1.0),
    "lbf ft/s": ("power", POUND_FORCE * 0.3048, 1.0),
    "ft lbf/s": ("power", POUND_FORCE * 0.3048, 1.0),
    "hp": ("power", 550.0 * POUND_FORCE * 0.3048, 1.0),
    "Pa": ("stress", 1.0, 1.0),
    "MPa": ("stress", 1e6, 1.0),
    "GPa": ("stress", 1e9, 1.0),
    "psi": ("stress", POUND_FORCE, 0.0254**2),
    "ksi": ("stress", 1e3 * POUND_FORCE, 0.0254**2),
}
"""unit: (kind, numerator, denominator) of its size in SI."""

MAX_QUANTITY_LENGTH = 64
"""Characters of a quantity; the longest that `shortest_number` writes takes 33."""

_QUANTITY_PATTERN = re.compile(r"\s*([+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)\s*(.*?)\s*", re.DOTALL)
# a word, with one small exponent at most, joined by a space, a dot, * or /: nothing that could be an expression
_UNIT_PATTERN = re.compile(
    r"[A-Za-zµμΩ]+(\^[+-]?[0-9])?((\s*/\s*|\s*\*\s*|\s*·\s*|\s+)[A-Za-zµμΩ]+(\^[+-]?[0-9])?){0,7}"
)
_SPELLINGS = str.maketrans({"−": "-", "°": "deg", "²": "^2", "³": "^3", "µ": "u", "μ": "u", "⁻": "^-", "¹": "1"})


_UNIT_WORDS = {
    "rev": "turn",
    "revs": "turn",
    "revolutions": "turn",
    "Nm": "N m",
    "Nmm": "N mm",
    "kNm": "kN m",
    "kgm": "kg m",
    "kgmm": "kg mm",
    "Ns": "N s",
    "lbs": "lb",
    "lbm": "lb",
}
"""Words that people write for units, each as it is looked up."""
_AMBIGUOUS_RATES = frozenset({"1/s", "/s", "s^-1", "1/sec", "/sec", "1/min", "/min", "min^-1"})
"""Rates of what they do not say."""
MIN_UNIT_NAME_LENGTH = 3
"""Letters from which on a word is a unit's name, whose capitals say nothing, and no symbol."""


class UnitError(ValueError):
    """A text is no quantity, or one of another kind; its text says which and what would do."""


class UnknownUnit(UnitError):
    """A text names no unit at all."""


class Unit(NamedTuple):
    """A unit of one kind, `numerator / denominator` of the SI unit."""

    kind: str
    numerator: float
    denominator: float

    @overload
    def to_si(self, value: float) -> float: ...

    @overload
    def to_si(self, value: np.ndarray) -> np.ndarray: ...

    def to_si(self, value: float | np.ndarray) -> float | np.ndarray:
        return value * self.numerator / self.denominator

    @overload
    def from_si(self, value: float) -> float: ...

    @overload
    def from_si(self, value: np.ndarray) -> np.ndarray: ...

    def from_si(self, value: float | np.ndarray) -> float | np.ndarray:
        return value * self.denominator / self.numerator


def parse_unit(text: str) -> Unit:
    """The unit that a text names. Raises UnitError."""
    if len(text) > MAX_QUANTITY_LENGTH:
        raise UnitError(f"a unit takes at most {MAX_QUANTITY_LENGTH} characters, not {len(text)}")
    spelled = spell_unit(text)
    if spelled in UNIT_TABLE:
        return Unit(*UNIT_TABLE[spelled])
    if not _UNIT_PATTERN.fullmatch(spelled):
        raise UnitError(f"{text!r} is not a unit")
    try:
        return _look_up_in_pint(spelled)
    except UnitError:
        meant = _unit_ignoring_case(spelled)
        if meant is None:
            raise
        return meant


def spell_unit(text: str) -> str:
    """A unit as it is looked up: lbf*in, lbf·in and lbf-in as `lbf in`, m/s² as `m/s^2`."""
    spelled = re.sub(r"\s+", " ", text.strip().translate(_SPELLINGS).replace("^-^", "^-").replace("**", "^"))
    spelled = re.sub(r"(?<=[A-Za-z])\^-(?=\^?[0-9])", "^-", spelled)
    if spelled in UNIT_TABLE:
        return spelled
    if spelled == "r/min":
        return "rpm"
    spelled = re.sub(r"(?<=[A-Za-z])[.-](?=[A-Za-z])", " ", spelled).rstrip(".")
    spelled = re.sub(r"[A-Za-z]+", lambda word: _UNIT_WORDS.get(word[0], word[0]), spelled)
    return re.sub(r"(?<=[A-Za-z0-9]) ?[*·] ?(?=[A-Za-z])", " ", spelled)


def _unit_ignoring_case(spelled: str) -> Unit | None:
    """The one unit of the table that is written so but for capitals, or one whose name is; None where several are."""
    small = spelled.lower()
    alike = [key for key in UNIT_TABLE if key.lower() == small]
    if alike:
        return Unit(*UNIT_TABLE[alike[0]]) if len(alike) == 1 else None
    words = re.findall(r"[A-Za-z]+", spelled)
    if small == spelled or any(word != word.lower() and len(word) < MIN_UNIT_NAME_LENGTH for word in words):
        return None
    try:
        return _look_up_in_pint(small)
    except UnitError:
        return None


def _ambiguous_rate_error(spelled: str) -> UnitError:
    return UnitError(f"{spelled!r} leaves open whether turns or radians are meant; write rad/s, deg/s or rpm")


def format_unit(name: str) -> str:
    """A unit as it is printed: m/s², N·m."""
    return name.replace("^2", "²").replace("^3", "³").replace(" ", "·")


def parse_quantity(text: str, kind: str) -> float:
    """A text such as "10.5 rad/s" as an SI number of the kind asked for. Raises UnitError."""
    if len(text) > MAX_QUANTITY_LENGTH:
        raise UnitError(f"a number with a unit takes at most {MAX_QUANTITY_LENGTH} characters, not {len(text)}")
    match = _QUANTITY_PATTERN.fullmatch(text.replace("−", "-"))
    if match is None:
        raise UnitError(f"{text!r} is not a number with a unit, such as {example_quantity(kind)!r}")
    number, written = match.groups()
    if not written:
        raise UnitError(f"{text!r} has no unit; write a number, or a text such as {example_quantity(kind)!r}")
    if kind == "angular velocity" and written in _AMBIGUOUS_RATES:
        raise _ambiguous_rate_error(written)
    try:
        found = parse_unit(written)
    except UnknownUnit as problem:
        raise UnitError(f"{problem}{_offered(written, kind)}") from None
    if found.kind != kind:
        raise UnitError(
            f"{text!r} is {_kind_with_article(found.kind)}, but {_kind_with_article(kind)} is wanted, such as "
            f"{example_quantity(kind)!r}"
        )
    value = found.to_si(float(number))
    if not isfinite(value):
        raise UnitError("the number is too large")
    return value


def example_quantity(kind: str) -> str:
    """A text that is a quantity of this kind."""
    known = {"angular velocity": "10.5 rad/s", "length": "50 mm", "angle": "60 deg", "energy": "2.5 J"}
    return known.get(kind) or f"2.5 {SI_UNITS[kind]}"


def _offered(written: str, kind: str) -> str:
    """A clause that offers the unit of this kind that is written most like it, or a quantity as an example."""
    from difflib import get_close_matches

    near = get_close_matches(written, [name for name, (of, *_) in UNIT_TABLE.items() if of == kind], 1)
    return (
        f"; did you mean {near[0]!r}?" if near else f"; write {_kind_with_article(kind)} as {example_quantity(kind)!r}"
    )


def shortest_number(value: float, target_unit: Unit) -> float | str:
    """The shortest number in `written` that reads back as exactly `value` (SI), or failing that an SI text."""
    value = float(value)  # a number of numpy would write its type
    near = target_unit.from_si(value)
    for digits in range(1, 18):
        candidate = float(f"{near:.{digits}g}")
        if target_unit.to_si(candidate) == value:
            return int(candidate) if candidate.is_integer() and abs(candidate) < 1e15 else candidate
    return f"{value!r} {SI_UNITS[target_unit.kind]}"


def _kind_with_article(kind: str) -> str:
    return f"{'an' if kind[0] in 'aeiou' else 'a'} {kind}"


@cache
def _look_up_in_pint(spelled: str) -> Unit:
    import pint  # slow to load, so only for a unit beyond the table

    registry = _pint_registry()
    try:
        one = registry.Quantity(1.0, spelled.replace("^", "**").replace("·", "*"))
        if any(name.endswith(("hertz", "counts_per_second")) for name in one._units):
            raise _ambiguous_rate_error(spelled)
        # compared in root units, not by dimension: an angle is no dimension to pint, but the radian is a root unit
        root = one.to_root_units().units
        for kind, si in SI_UNITS.items():
            ours = registry.Quantity(1.0, si.replace("^", "**"))
            if root == ours.to_root_units().units:
                return _check_unit_size(spelled, kind, float(one.to(ours.units).magnitude))
    except UnitError:
        raise
    except (pint.PintError, ArithmeticError, AssertionError, LookupError, ValueError, TypeError, AttributeError):
        raise UnknownUnit(f"{spelled!r} is not a known unit") from None
    raise UnitError(
        f"{spelled!r} measures none of the kinds that a mechanism has, such as {', '.join(tuple(SI_UNITS)[:5])}"
    )


def _check_unit_size(spelled: str, kind: str, factor: float) -> Unit:
    if not 1e-100 < factor < 1e100:
        raise UnitError(f"{spelled!r} is too large or too small a unit")
    return Unit(kind, factor, 1.0)


@cache
def _pint_registry() -> UnitRegistry[Any]:
    import pint

    return pint.UnitRegistry(cache_folder=None)
