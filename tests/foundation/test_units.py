"""Quantities of files: every spelling, its size, and what is refused."""

from __future__ import annotations

import subprocess
import sys
from math import isfinite, pi
from pathlib import Path

import numpy as np
import pint
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planar.foundation.units import (
    SI_UNITS,
    UNIT_TABLE,
    Unit,
    UnitError,
    example_quantity,
    parse_quantity,
    parse_unit,
    shortest_number,
)
from tests.watchdog import watched

STEADY = settings(deadline=None)
"""No example is timed: the first one may load a library."""

EPS = sys.float_info.epsilon
ULPS = 4 * EPS
"""Two chains of at most four multiplications of the same factors, in different orders, differ by no more."""


@pytest.fixture(scope="module")
def registry() -> pint.UnitRegistry:
    return pint.UnitRegistry(cache_folder=None)


def refused(text: str, kind: str) -> str:
    """The sentence in which a text is refused, which must be one short printable line."""
    with watched(), pytest.raises(UnitError) as caught:
        parse_quantity(text, kind)
    sentence = str(caught.value)
    assert sentence.isprintable()
    assert 10 < len(sentence) < 300
    return sentence


# the table against pint


def test_table_has_the_size_and_kind_that_pint_gives(registry: pint.UnitRegistry) -> None:
    for spelled, (kind, numerator, denominator) in UNIT_TABLE.items():
        theirs = registry.Quantity(1.0, spelled.replace("^", "**"))
        ours = registry.Quantity(1.0, SI_UNITS[kind].replace("^", "**"))
        assert theirs.to_root_units().units == ours.to_root_units().units, spelled
        assert numerator / denominator == pytest.approx(theirs.to(ours.units).magnitude, rel=ULPS), spelled


@STEADY
@given(value=st.floats(-1e9, 1e9).map(lambda x: float(f"{x:.9g}")))
def test_table_reads_numbers_as_pint_does(value: float, registry: pint.UnitRegistry) -> None:
    for spelled, (kind, *_) in UNIT_TABLE.items():
        theirs = registry.Quantity(value, spelled.replace("^", "**")).to(SI_UNITS[kind].replace("^", "**")).magnitude
        # absolute: denormal numbers have no relative accuracy
        assert parse_quantity(f"{value!r} {spelled}", kind) == pytest.approx(theirs, rel=ULPS, abs=1e-300), spelled


def test_every_si_unit_is_one_of_its_kind() -> None:
    for kind, spelled in SI_UNITS.items():
        assert parse_unit(spelled) == Unit(kind, 1.0, 1.0)


def test_every_example_is_a_quantity_of_its_kind() -> None:
    for kind in SI_UNITS:
        assert parse_quantity(example_quantity(kind), kind) > 0.0


def test_units_of_the_table_are_read_without_pint() -> None:
    program = (
        "import sys; from planar.foundation.units import UNIT_TABLE, parse_quantity\n"
        "for spelled, (kind, *_) in UNIT_TABLE.items(): parse_quantity(f'1 {spelled}', kind)\n"
        "parse_quantity('60 °', 'angle'); parse_quantity('1 m/s²', 'acceleration')\n"
        "sys.exit('pint' in sys.modules)"
    )
    root = Path(__file__).parents[2]
    assert subprocess.run([sys.executable, "-c", program], cwd=root, check=False).returncode == 0


# spellings


@pytest.mark.parametrize(
    ("text", "kind", "size"),
    [
        ("10.5 rad/s", "angular velocity", 10.5),
        ("-26 rad/s^2", "angular acceleration", -26.0),
        ("-26 rad/s²", "angular acceleration", -26.0),
        ("-26 rad/s**2", "angular acceleration", -26.0),
        ("-26 rad s^-2", "angular acceleration", -26.0),
        ("-26 rad s⁻²", "angular acceleration", -26.0),
        ("210 rpm", "angular velocity", 7.0 * pi),
        ("210rpm", "angular velocity", 7.0 * pi),
        ("180 deg/s", "angular velocity", pi),
        ("180°/s", "angular velocity", pi),
        ("180 °/s²", "angular acceleration", pi),
        ("1.6 m", "length", 1.6),
        ("50mm", "length", 0.05),
        ("50 mm", "length", 0.05),
        (" 50 mm ", "length", 0.05),
        ("+5 cm", "length", 0.05),
        (".5 m", "length", 0.5),
        ("5. m", "length", 5.0),
        ("2e-3 km", "length", 2.0),
        ("1E3mm", "length", 1.0),
        ("30 um", "length", 30e-6),
        ("30 µm", "length", 30e-6),
        ("30 μm", "length", 30e-6),
        ("2 in", "length", 0.0508),
        ("60°", "angle", pi / 3.0),
        ("60 °", "angle", pi / 3.0),
        ("60deg", "angle", pi / 3.0),
        ("-60 deg", "angle", -pi / 3.0),
        ("2 rad", "angle", 2.0),
        ("2 m s^-1", "velocity", 2.0),
        ("2 m s⁻¹", "velocity", 2.0),
        ("2 m·s⁻¹", "velocity", 2.0),
        ("2 m*s^-1", "velocity", 2.0),
        ("2 m / s", "velocity", 2.0),
        ("2 m/s/s", "acceleration", 2.0),
        ("2 m s^-2", "acceleration", 2.0),
        ("2 m/s²", "acceleration", 2.0),
        ("3 kN", "force", 3000.0),
        ("2 N m", "torque", 2.0),
        ("2 N·m", "torque", 2.0),
        ("2 N*m", "torque", 2.0),
        ("2 kN m", "torque", 2000.0),
    ],
)
def test_spellings_of_the_contract_are_understood(text: str, kind: str, size: float) -> None:
    assert parse_quantity(text, kind) == pytest.approx(size, rel=ULPS)


@pytest.mark.parametrize(
    ("text", "kind", "size"),
    [
        ("1 ft", "length", 0.3048),
        ("1 yd", "length", 0.9144),
        ("1 mile", "length", 1609.344),
        ("1 mile/h", "velocity", 0.44704),
        ("36 km/h", "velocity", 10.0),
        ("1 turn", "angle", 2.0 * pi),
        ("100 grad", "angle", pi / 2.0),
        ("60 arcmin", "angle", pi / 180.0),
        ("1 turn/s", "angular velocity", 2.0 * pi),
        ("60 revolution/min", "angular velocity", 2.0 * pi),
        ("60 rpm/s", "angular acceleration", 2.0 * pi),
        ("1 kgf", "force", 9.80665),
        ("1 lbf", "force", 4.4482216152605),
        ("1 lbf ft", "torque", 1.3558179483314004),
        ("1 J", "torque", 1.0),
    ],
)
def test_units_beyond_the_table_are_looked_up(text: str, kind: str, size: float) -> None:
    # pint multiplies up to six factors, each of them rounded
    assert parse_quantity(text, kind) == pytest.approx(size, rel=4 * ULPS)


def test_an_exponent_without_its_mark_is_not_taken_for_one() -> None:
    assert "not a unit" in refused("2 m s-1", "velocity")
    assert "not a unit" in refused("2 m/s2", "acceleration")


@pytest.mark.parametrize(
    ("text", "kind", "same"),
    [
        ("60 RPM", "angular velocity", "60 rpm"),
        ("60 Rpm", "angular velocity", "60 rpm"),
        ("60 rev/min", "angular velocity", "60 rpm"),
        ("60 r/min", "angular velocity", "60 rpm"),
        ("2 rev/s", "angular velocity", "120 rpm"),
        ("3 revolutions/min", "angular velocity", "3 rpm"),
        ("5 RAD/S^2", "angular acceleration", "5 rad/s^2"),
        ("50 MM", "length", "50 mm"),
        ("50 CM", "length", "50 cm"),
        ("2 IN", "length", "2 in"),
        ("50 Millimeters", "length", "50 mm"),
        ("50 mm.", "length", "50 mm"),
        ("60 Deg", "angle", "60 deg"),
        ("60 Degrees", "angle", "60 deg"),
        ("1 rev", "angle", "360 deg"),
        ("5 KN", "force", "5 kN"),
        ("5 Newton", "force", "5 N"),
        ("5 Nm", "torque", "5 N m"),
        ("5 N-m", "torque", "5 N m"),
        ("5 N.m", "torque", "5 N m"),
        ("5 Nmm", "torque", "0.005 N m"),
        ("5 kNm", "torque", "5000 N m"),
        ("5 Kg", "mass", "5 kg"),
        ("5 kgm^2", "moment of inertia", "5 kg m^2"),
        ("5 M/S", "velocity", "5 m/s"),
        ("5 N/MM", "stiffness", "5 N/mm"),
    ],
)
def test_units_are_read_as_people_spell_them(text: str, kind: str, same: str) -> None:
    assert parse_quantity(text, kind) == pytest.approx(parse_quantity(same, kind), rel=1e-15)


def test_capitals_that_mean_another_unit_are_taken_at_their_word() -> None:
    """A megametre is no millimetre, and a nanometre no newton metre."""
    assert parse_quantity("1 Mm", "length") == pytest.approx(1e6)
    assert "is a length" in refused("5 nm", "torque")


# refusals


@pytest.mark.parametrize(
    ("text", "kind", "words"),
    [
        ("", "length", ["not a number with a unit", "'50 mm'"]),
        ("   ", "length", ["not a number with a unit"]),
        ("fast", "angular velocity", ["'fast'", "not a number with a unit", "'10.5 rad/s'"]),
        ("mm", "length", ["'mm'", "not a number with a unit"]),
        ("m 5", "length", ["'m 5'", "not a number with a unit"]),
        ("nan m", "length", ["not a number with a unit"]),
        ("inf m", "length", ["not a number with a unit"]),
        ("50", "length", ["'50'", "has no unit", "'50 mm'"]),
        ("60", "angle", ["has no unit", "'60 deg'"]),
        ("60 mm", "angle", ["'60 mm'", "is a length", "an angle is wanted", "'60 deg'"]),
        ("60 deg", "length", ["is an angle", "a length is wanted"]),
        ("2 m/s", "angular velocity", ["is a velocity", "an angular velocity is wanted"]),
        ("2 rad/s", "velocity", ["is an angular velocity", "a velocity is wanted"]),
        ("2 rad/s", "angular acceleration", ["an angular acceleration is wanted"]),
        ("2 N", "torque", ["is a force", "a torque is wanted", "'2.5 N m'"]),
        ("2 N m", "force", ["is a torque", "a force is wanted"]),
        ("5 Hz", "angular velocity", ["'Hz'", "turns or radians", "rad/s, deg/s or rpm"]),
        ("5 kHz", "angular velocity", ["turns or radians"]),
        ("5 s^-1", "angular velocity", ["'s^-1'", "turns or radians", "rad/s, deg/s or rpm"]),
        ("5 1/s", "angular velocity", ["turns or radians"]),
        ("5 NM", "torque", ["'NM'", "not a known unit"]),
        ("5 Nm", "force", ["is a torque"]),
        ("5 kg", "force", ["is a mass", "a force is wanted"]),
        ("5 K", "force", ["'K'", "measures none of"]),
        ("5 m^2", "length", ["measures none of"]),
        ("5 degC", "angle", ["measures none of"]),
        ("5 parsnips", "length", ["'parsnips'", "not a known unit", "write a length as '50 mm'"]),
        ("60 rmp", "angular velocity", ["'rmp'", "not a known unit", "did you mean 'rpm'?"]),
        ("1,5 m", "length", ["not a unit"]),
        ("1_000 m", "length", ["not a unit"]),
        ("5 m^0", "length", ["unit"]),
        ("5 m^", "length", ["not a unit"]),
        ("5 /s", "velocity", ["not a unit"]),
        ("5 m//s", "velocity", ["not a unit"]),
        ("1e999 m", "length", ["too large"]),
        ("-1e308 km", "length", ["too large"]),
    ],
)
def test_what_is_no_quantity_of_the_kind_is_refused_with_the_remedy(text: str, kind: str, words: list[str]) -> None:
    sentence = refused(text, kind)
    for word in words:
        assert word in sentence


@pytest.mark.parametrize("word", ["percent", "ppm", "pi", "dB", "count", "bit", "radian^2", "deg deg", "sr", "octave"])
def test_a_pure_number_is_no_angle(word: str) -> None:
    refused(f"5 {word}", "angle")
    refused(f"5 {word}/s", "angular velocity")


@pytest.mark.parametrize("size", ["ym^9 ym^9 / m^9 / m^8", "Ym^9 Ym^9 / m^9 / m^8", "Qm^9 Qm^9 / m^9 / m^8"])
def test_a_unit_of_no_size_that_a_number_can_hold_is_refused(size: str) -> None:
    refused(f"5 {size}", "length")


HOSTILE = [
    "9**9**9 m",
    "9^9^9 m",
    "1 m**9**9**9",
    "1 m^999999999",
    "__import__('os').mkdir('harm') m",
    "1 __import__('os').mkdir('harm')",
    "1 m if __import__('os').mkdir('harm') else m",
    "1 (m)",
    "1 m; import os",
    "1 {m}",
    "1 m\x00",
    "1 \x1b[31mm",
    "1 m\nm\nm\nlength",
    "0x10 m",
    "1 m.__class__",
    "1 None",
    "1 lambda",
    "1 m in m",
    "1 not m",
]


@pytest.mark.parametrize("text", HOSTILE)
def test_nothing_that_a_text_says_is_executed(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    refused(text, "length")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "text",
    [
        "x" * 100_000,
        "1 " + "x" * 100_000,
        "1 " + "m " * 100_000,
        "1 m" + "^2" * 100_000,
        "1 m" + " " * 300_000 + "m",
        "1" + "(" * 100_000,
        "1 " + "m/" * 100_000,
        " " * 300_000,
        "1e" + "9" * 100_000 + " parsnips",
        "1 " + "²" * 100_000,
    ],
    ids=["word", "unit", "units", "powers", "spaces", "brackets", "slashes", "blank", "exponent", "squares"],
)
def test_a_very_long_text_is_refused_in_a_short_sentence(text: str) -> None:
    refused(text, "length")
    with watched(), pytest.raises(UnitError) as caught:
        parse_unit(text)
    assert len(str(caught.value)) < 300


@STEADY
@given(st.text(max_size=30))
def test_any_text_is_a_finite_quantity_or_is_refused(text: str) -> None:
    try:
        assert isfinite(parse_quantity(text, "length"))
    except UnitError as problem:
        assert str(problem).isprintable()


WORDS = st.sampled_from(
    [*"mNgsJKhAVWCFTHdaycukMGn", "rad", "deg", "Ym", "qs", "in", "is", "not", "and", "if", "dB", "nan", "pi"]
)
POWERS = st.sampled_from(["", "", "^2", "^-1", "^0", "^-9", "^9"])
JOINTS = st.sampled_from([" ", "/", "*", " / ", "·"])


@STEADY
@given(st.lists(st.tuples(JOINTS, WORDS, POWERS), min_size=1, max_size=8))
def test_any_product_of_units_has_a_size_or_is_refused(parts: list[tuple[str, str, str]]) -> None:
    spelled = "".join("".join(part) for part in parts)[len(parts[0][0]) :]
    try:
        found = parse_unit(spelled)
    except UnitError:
        return
    assert 0.0 < found.to_si(1.0) < float("inf")
    assert 0.0 < found.from_si(1.0) < float("inf")


# writing

SIMPLE = st.floats(-1e6, 1e6).map(lambda x: float(f"{x:.6g}"))


def again(written: float | str, of: Unit) -> float:
    """What a written number or text reads as."""
    return parse_quantity(written, of.kind) if isinstance(written, str) else of.to_si(written)


@STEADY
@given(value=st.floats(allow_nan=False, allow_infinity=False))
def test_shortest_reads_back_to_the_last_bit(value: float) -> None:
    for spelled in UNIT_TABLE:
        unit = parse_unit(spelled)
        assert again(shortest_number(value, unit), unit) == value, spelled


@STEADY
@given(value=SIMPLE)
def test_shortest_is_no_longer_than_what_an_author_wrote(value: float) -> None:
    for spelled in (*UNIT_TABLE, "ft", "grad", "mile/h"):
        unit = parse_unit(spelled)
        written = shortest_number(unit.to_si(value), unit)
        assert not isinstance(written, str), spelled
        assert len(f"{written:g}") <= len(f"{value:g}"), spelled
        assert unit.to_si(written) == unit.to_si(value), spelled


def test_shortest_writes_whole_numbers_as_such() -> None:
    written = shortest_number(parse_unit("mm").to_si(50), parse_unit("mm"))
    assert written == 50
    assert isinstance(written, int)
    assert shortest_number(parse_unit("deg").to_si(60.0), parse_unit("deg")) == 60
    assert shortest_number(parse_unit("mm").to_si(0.1), parse_unit("mm")) == 0.1


def test_shortest_writes_numbers_of_numpy_as_numbers() -> None:
    for value in (0.1, 1.0 / 3.0, 1e-320):
        for spelled in UNIT_TABLE:
            of = parse_unit(spelled)
            assert repr(shortest_number(np.float64(value), of)) == repr(shortest_number(value, of))


@STEADY
@given(value=SIMPLE)
def test_from_si_undoes_to_si(value: float) -> None:
    for spelled in (*UNIT_TABLE, "ft", "grad"):
        unit = parse_unit(spelled)
        assert unit.from_si(unit.to_si(value)) == pytest.approx(value, rel=ULPS), spelled
