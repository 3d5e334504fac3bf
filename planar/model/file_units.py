"""The units that a mechanism's file declares, and the one in which every kind of quantity is shown."""

from __future__ import annotations

import re
from functools import lru_cache
from math import log10
from typing import NamedTuple

from planar.foundation.units import SI_UNITS, Unit, UnitError, format_unit, parse_unit, spell_unit

RESULT_SI_UNITS = SI_UNITS | {"energy": "J", "area": "m^2", "number": "1"}
"""The SI unit of every kind of quantity that files or results have."""

_CUSTOMARY = re.compile(
    r"\b(in|inch|inches|ft|foot|feet|yd|yards?|mi|miles?|mil|thou|lb|lbs|pounds?|oz|ounces?|slugs?"
    r"|k?lbf|pounds?_force|force_pounds?|kips?|ozf|ounces?_force|hp|horsepower)\b",
    re.IGNORECASE,
)
"""Units of the inch and the pound, as they are spelled."""
_LENGTH_RATES = {"velocity": "/s", "acceleration": "/s^2", "jerk": "/s^3"}
_ANGLE_RATES = {f"angular {kind}": behind for kind, behind in _LENGTH_RATES.items()}
_MADE_OF: dict[str, tuple[tuple[str, ...], str, str]] = {
    **{kind: (("rate length",), behind, "") for kind, behind in _LENGTH_RATES.items()},
    **{kind: (("rate angle",), behind, "") for kind, behind in _ANGLE_RATES.items()},
    "area": (("length", "length"), "", ""),
    "torque": (("force", "arm"), "", ""),
    "moment of inertia": (("mass", "arm", "arm"), "", ""),
    "stiffness": (("force",), "/", "arm"),
    "damping": (("force",), " s/", "arm"),
    "torsional stiffness": (("torque",), "/rad", ""),
    "torsional damping": (("torque",), " s/rad", ""),
    "power": (("torque",), "/s", ""),
    "energy": (("torque",), "", ""),
}
"""Units whose product one is, what stands behind them, and the unit by which it is divided."""
_OF_THEIR_OWN = ("power", "energy")
"""Kinds whose SI unit is not written as what it is made of."""
_SAME_DIMENSION = {"energy": "torque"}
"""Kinds that units do not tell from another kind."""


class FileUnits(NamedTuple):
    """The units that a mechanism's file declares for its bare numbers and its results; empty where it declares none.

    Of every quantity one: `length`, `angle`; `velocity`, `acceleration`, `jerk`; `angular_velocity`,
    `angular_acceleration`, `angular_jerk`; `force`, `torque`, `power`, `energy`; `mass`, `moment_of_inertia`;
    `stiffness`, `damping`, `torsional_stiffness`, `torsional_damping`; `stress`.

    >>> FileUnits("in", "deg", force="lbf").force
    'lbf'
    """

    length: str = "m"
    angle: str = "rad"
    velocity: str = ""
    acceleration: str = ""
    jerk: str = ""
    angular_velocity: str = ""
    angular_acceleration: str = ""
    angular_jerk: str = ""
    force: str = ""
    torque: str = ""
    mass: str = ""
    moment_of_inertia: str = ""
    stiffness: str = ""
    torsional_stiffness: str = ""
    damping: str = ""
    torsional_damping: str = ""
    power: str = ""
    energy: str = ""
    stress: str = ""

    def declared(self, kind: str) -> str:
        """The unit that the file declares for a kind of quantity, as it is written there; else nothing."""
        name = kind.replace(" ", "_")
        return str(getattr(self, name)) if name in self._fields else ""

    @property
    def declares_more(self) -> bool:
        """Whether the file declares the unit of anything but lengths and angles."""
        return any(self[2:])


class OtherKind(UnitError):
    """A unit measures another kind of quantity; its text says which."""


def parse_declared_unit(kind: str, text: str) -> Unit:
    """The unit that a file declares for a kind of quantity. Raises UnitError, as OtherKind where it is of another."""
    found = parse_unit(text)
    if found.kind == _SAME_DIMENSION.get(kind, kind):
        return found._replace(kind=kind)
    raise OtherKind(f"it measures {found.kind}")


def display_unit(kind: str, units: FileUnits) -> tuple[str, Unit]:
    """The unit in which a kind of quantity is shown, and its name as it is printed (see `unit_of_kind`)."""
    name, of = unit_of_kind(kind, units)
    return format_unit(name), of


@lru_cache(maxsize=1024)
def unit_of_kind(kind: str, units: FileUnits) -> tuple[str, Unit]:
    """The unit in which a kind of quantity is shown beside the units that a file declares, and its name.

    What the file declares is shown so, and the rest follows from it. Rates of lengths are in metres where the length is
    metric, as textbooks have them beside millimetres, and else in the file's own length: in/s beside in. Beside a
    length in inches, feet and the like forces are in lbf and masses in lb; torques, stiffnesses and what else is made
    of forces and lengths is in these: lbf in, lbf/in, lb in^2. Angles by time are in radians. Kinds are those of
    `RESULT_SI_UNITS`.
    """
    written = units.declared(kind)
    if written:
        return written if kind in ("length", "angle") else spell_unit(written), parse_declared_unit(kind, written)
    if kind in _MADE_OF and not (kind in _OF_THEIR_OWN and is_metric(unit_of_kind("torque", units)[1])):
        factors, behind, divisor = _MADE_OF[kind]
        over = [_factor(each, kind, units) for each in factors]
        return _compose(kind, over, behind, _factor(divisor, kind, units) if divisor else None)
    name = {"force": "lbf", "mass": "lb", "stress": "psi"}.get(kind, "")
    if name and (is_customary(units.length) or is_customary(units.force)):
        return name, parse_unit(name)
    return ("MPa", parse_unit("MPa")) if kind == "stress" else (RESULT_SI_UNITS[kind], Unit(kind, 1.0, 1.0))


def _factor(name: str, kind: str, units: FileUnits) -> tuple[str, Unit]:
    """A unit that another kind's is made of."""
    if name == "rate length":
        return rate_length(units, kind)
    if name == "arm":
        return _coherent_length(units)
    return _rate_angle(units) if name == "rate angle" else unit_of_kind(name, units)


def rate_length(units: FileUnits, kind: str = "") -> tuple[str, Unit]:
    """The unit of length that stands in rates, and in the formulas of worked solutions.

    That of the rate of this kind, or of another one, where the file declares it as a length by the second, the metre
    where lengths are metric, and else the length's own unit.
    """
    for each in dict.fromkeys((*([kind] if kind in _LENGTH_RATES else []), *_LENGTH_RATES)):
        name = _base_of_rate(units.declared(each), _LENGTH_RATES[each])
        if name:
            return name, parse_unit(name)
    return _coherent_length(units)


def _coherent_length(units: FileUnits) -> tuple[str, Unit]:
    """The unit of length beside which forces and masses stand: the metre where lengths are metric, else their own."""
    name, of = coherent_unit(units.length)
    return spell_unit(name), of


def rate_unit(kind: str, units: FileUnits) -> tuple[str, Unit]:
    """The unit of a length's rate that goes with `rate_length` and seconds, as formulas ask for: v²/r in in/s²."""
    return _compose(kind, [rate_length(units, kind)], _LENGTH_RATES[kind])


def unit_by_input(lengths: bool, order: int, input_slides: bool, units: FileUnits) -> tuple[str, float]:
    """The unit, as it is printed, of a first or second derivative by an input's length or angle, and how many are SI.

    `lengths`: of a length, else of an angle: in/rad, in/rad², rad/in².
    """
    length, of = rate_length(units)
    (over, by), (under, per) = ((length, of.from_si(1.0)) if each else ("rad", 1.0) for each in (lengths, input_slides))
    return format_unit(f"{over}/{under}" + ("^2" if order == 2 else "")), by / per**order


def _rate_angle(units: FileUnits) -> tuple[str, Unit]:
    for kind, behind in _ANGLE_RATES.items():
        name = _base_of_rate(units.declared(kind), behind)
        if name:
            return name, parse_unit(name)
    return SI_UNITS["angle"], Unit("angle", 1.0, 1.0)


def _base_of_rate(text: str, behind: str) -> str:
    """The unit whose rate a text names: in of in/s; nothing where it is none by the second."""
    spelled = spell_unit(text)
    return spelled.removesuffix(behind) if re.fullmatch(r"[A-Za-z]+" + re.escape(behind), spelled) else ""


def _compose(
    kind: str, factors: list[tuple[str, Unit]], behind: str = "", divisor: tuple[str, Unit] | None = None
) -> tuple[str, Unit]:
    """A product of units, with what stands behind it, by another one."""
    numerator = denominator = 1.0
    for _, of in factors:
        numerator, denominator = numerator * of.numerator, denominator * of.denominator
    names = [name for name, _ in factors]
    if names[-2:] == names[-1:] * 2:
        names = [*names[:-2], f"{names[-1]}^2"]
    if divisor is None:
        return " ".join(names) + behind, Unit(kind, numerator, denominator)
    name, of = divisor
    return " ".join(names) + behind + name, Unit(kind, numerator * of.denominator, denominator * of.numerator)


def takes_bare_number(kind: str, units: FileUnits) -> bool:
    """Whether a number without a unit is clear: in the declared unit, or in SI where nothing else could be meant."""
    if units.declared(kind) or kind not in SI_UNITS:
        return True
    if kind in _ANGLE_RATES and parse_unit(units.angle).to_si(1.0) != 1.0:
        return False
    return not units.declares_more or unit_of_kind(kind, units)[0] == SI_UNITS[kind]


def is_customary(name: str) -> bool:
    """Whether a unit is one of inches, feet, pounds and the like."""
    return _CUSTOMARY.search(spell_unit(name)) is not None


def coherent_unit(text: str) -> tuple[str, Unit]:
    """The SI unit of what a unit measures where it is a tenth, a thousand, ... of that, else the unit itself."""
    own = parse_unit(text)
    return (SI_UNITS[own.kind], Unit(own.kind, 1.0, 1.0)) if is_metric(own) else (text, own)


def is_si(kind: str, units: FileUnits) -> bool:
    """Whether a kind of quantity is shown in its SI unit, without the file asking for one."""
    return not units.declared(kind) and unit_of_kind(kind, units)[0] == RESULT_SI_UNITS[kind]


def is_metric(unit: Unit) -> bool:
    """Whether a unit is a tenth, a thousand, ... of the SI unit."""
    power = log10(unit.numerator / unit.denominator)
    return abs(power - round(power)) < 1e-9
