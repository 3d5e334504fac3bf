"""The unit in which every kind of quantity is shown: what a file declares, and what follows from it."""

from __future__ import annotations

import sys

import pytest

import planar
from planar.foundation.units import SI_UNITS, format_unit, parse_quantity, parse_unit
from planar.model.file_units import RESULT_SI_UNITS, FileUnits, display_unit, rate_unit, unit_of_kind

ULPS = 8 * sys.float_info.epsilon
FILES = (
    FileUnits(),
    FileUnits("mm", "deg"),
    FileUnits("in", "deg"),
    FileUnits("ft", "deg", torque="lbf*in", power="hp", energy="ft-lbf"),
    FileUnits("in", "deg", velocity="ft/s", force="ozf", mass="slug"),
    FileUnits("mm", "deg", velocity="mm/s", force="kN", angular_velocity="rpm"),
    FileUnits("m", "rad", angular_velocity="deg/s", mass="g"),
)


def names(units: FileUnits, *kinds: str) -> list[str]:
    return [display_unit(kind, units)[0] for kind in kinds]


@pytest.mark.parametrize(
    ("length", "rates"),
    [("m", "m"), ("mm", "m"), ("cm", "m"), ("km", "m"), ("dm", "m"), ("in", "in"), ("ft", "ft"), ("yd", "yd")],
)
def test_rates_are_in_metres_beside_metric_lengths_and_else_in_the_files_own(length: str, rates: str) -> None:
    declared = FileUnits(length, "deg")
    size = 1.0 if rates == "m" else parse_quantity(f"1 {length}", "length")
    for kind, behind in (("velocity", "/s"), ("acceleration", "/s^2"), ("jerk", "/s^3")):
        name, of = unit_of_kind(kind, declared)
        assert (name, of.kind) == (rates + behind, kind)
        assert of.to_si(3.0) == pytest.approx(3.0 * size, rel=ULPS)
    assert unit_of_kind("length", declared) == (length, parse_unit(length))
    assert unit_of_kind("angle", declared) == ("deg", parse_unit("deg"))


@pytest.mark.parametrize("units", FILES, ids=str)
def test_every_name_is_that_of_its_unit(units: FileUnits) -> None:
    for kind in RESULT_SI_UNITS:
        name, of = unit_of_kind(kind, units)
        assert of.kind == kind
        if kind in SI_UNITS:
            assert parse_unit(name).to_si(1.0) == pytest.approx(of.to_si(1.0), rel=ULPS)


def test_metric_files_show_si_but_for_lengths_and_angles() -> None:
    for length in ("m", "mm", "cm"):
        shown = {kind: display_unit(kind, FileUnits(length, "deg"))[0] for kind in RESULT_SI_UNITS}
        assert shown == {kind: format_unit(si) for kind, si in RESULT_SI_UNITS.items()} | {
            "length": length,
            "angle": "deg",
            "area": f"{length}²",
            "stress": "MPa",
        }


def test_forces_and_masses_beside_inches_are_in_pounds_and_the_rest_is_made_of_them() -> None:
    kinds = ("force", "torque", "mass", "moment of inertia", "stiffness", "torsional stiffness", "damping", "power")
    assert names(FileUnits("in", "deg"), *kinds, "energy", "area") == [
        "lbf",
        "lbf·in",
        "lb",
        "lb·in²",
        "lbf/in",
        "lbf·in/rad",
        "lbf·s/in",
        "lbf·in/s",
        "lbf·in",
        "in²",
    ]
    assert names(FileUnits("ft", "deg"), *kinds[:4]) == ["lbf", "lbf·ft", "lb", "lb·ft²"]


def test_what_is_declared_is_shown_so_and_the_rest_follows() -> None:
    mixed = FileUnits("in", "deg", velocity="ft/s", force="ozf", mass="slug", angular_velocity="deg/s")
    kinds = ("velocity", "acceleration", "force", "torque", "mass", "moment of inertia", "angular acceleration")
    assert names(mixed, *kinds) == ["ft/s", "ft/s²", "ozf", "ozf·in", "slug", "slug·in²", "deg/s²"]
    metric = FileUnits("mm", "deg", velocity="mm/s", force="kN", torque="N*mm", angular_velocity="rpm")
    assert names(metric, *kinds) == ["mm/s", "mm/s²", "kN", "N·mm", "kg", "kg·m²", "rad/s²"]
    assert names(metric, "power", "energy", "stiffness") == ["W", "J", "kN/m"]


def test_formulas_are_in_one_length_and_seconds() -> None:
    """What is declared by the minute is shown so, but v²/r is worked in seconds."""
    assert rate_unit("velocity", FileUnits("in", "deg", velocity="ft/min"))[0] == "in/s"
    assert rate_unit("acceleration", FileUnits("in", "deg", velocity="ft/s"))[0] == "ft/s^2"


def test_file_units_are_public() -> None:
    assert planar.FileUnits("in", "deg", force="lbf").declares_more
    assert not planar.FileUnits("in", "deg").declares_more
