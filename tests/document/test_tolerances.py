"""Tolerances in a file: read, written, kept, refused; the tables of ISO 286 and ISO 2768 as they are printed."""

from __future__ import annotations

from math import pi

import pytest

import planar
from planar.document.writer import write_mechanism
from planar.foundation.errors import BadInput
from planar.guide.keys_page import read_example
from planar.model.tolerances.iso_286 import (
    FitError,
    greatest_clearance,
    hole_deviations,
    parse_fit,
    shaft_deviations,
)
from planar.model.tolerances.iso_2768 import angle_deviation, length_deviation

EXAMPLE = read_example("tolerances")


def test_tolerances_are_read_in_the_units_of_the_file_written_back_and_kept():
    mechanism = planar.from_dict(EXAMPLE)
    told = mechanism.tolerances
    assert {each.number: (each.lower, each.upper) for each in told.numbers} == {
        "AB.length": pytest.approx((-5e-5, 5e-5)),
        "BC.length": pytest.approx((-2e-5, 5e-5)),
    }
    assert (told.general, told.clearances[1].fit) == ("f", "H7/g6")
    written = write_mechanism(mechanism)
    assert written["tolerances"]["BC.length"] == [-0.02, 0.05]
    assert planar.from_dict(written) == mechanism
    assert mechanism.with_values({"BC.length": "71 mm"}).tolerances == told


@pytest.mark.parametrize(
    ("told", "place", "sentence"),
    [
        ({"AB.lenght": 1}, "['AB.lenght']", "did you mean 'AB.length'"),
        ({"AB.length": -1}, "['AB.length']", "no number below 0"),
        ({"AB.length": [2, 1]}, "['AB.length']", "the lower first"),
        ({"AB.length": "3 deg"}, "['AB.length']", "a length is wanted"),
        ({"lengths": -1}, ".lengths", "no number below 0"),
        ({"lengths": "3 deg"}, ".lengths", "a length is wanted"),
        ({"sketch.C.x": 1}, "['sketch.C.x']", "has no tolerance"),
        ({"general": "ISO 2768 m"}, ".general", "'ISO 2768-1 m' \\(medium\\)"),
        ({"clearance": {"X": 1}}, ".clearance.X", "pairs are A, B, C and D"),
        ({"clearance": {"B": "H7/g6"}}, ".clearance.B", "give 'B' its 'pin_diameter'"),
        ({"clearance": {"C": "H7/s6"}}, ".clearance.C", "leaves no clearance at 8 mm"),
        ({"clearance": {"C": "Z7/g6"}}, ".clearance.C", "no 'Z'"),
        ({"clearance": {"C": "-1 mm"}}, ".clearance.C", "from 0 on"),
    ],
)
def test_what_cannot_be_is_refused_at_its_place(told, place, sentence):
    with pytest.raises(BadInput, match=sentence) as problem:
        planar.from_dict(EXAMPLE | {"tolerances": told})
    assert problem.value.place == f"$.tolerances{place}"


@pytest.mark.parametrize(
    ("letter", "grade", "diameter", "printed"),
    [
        ("H", 7, 20, (0, 21)),
        ("H", 8, 10, (0, 22)),
        ("H", 11, 50, (0, 160)),
        ("F", 8, 25, (20, 53)),
        ("G", 7, 30, (7, 28)),
        ("D", 10, 40, (80, 180)),
        ("E", 9, 6, (20, 50)),
        ("JS", 6, 25, (-6.5, 6.5)),
        ("g", 6, 20, (-20, -7)),
        ("h", 6, 18, (-11, 0)),
        ("f", 7, 50, (-50, -25)),
        ("e", 8, 100, (-126, -72)),
        ("d", 9, 3, (-45, -20)),
        ("c", 11, 45, (-290, -130)),
        ("k", 6, 20, (2, 15)),
        ("k", 9, 20, (0, 52)),
        ("m", 6, 12, (7, 18)),
        ("n", 6, 60, (20, 39)),
        ("p", 6, 40, (26, 42)),
        ("r", 6, 70, (43, 62)),
        ("s", 6, 90, (71, 93)),
    ],
)
def test_limits_of_fits_are_those_printed(letter, grade, diameter, printed):
    """Limit deviations in um, as the tables of limits that follow from ISO 286-1 have them."""
    told = (hole_deviations if letter.isupper() else shaft_deviations)(letter, grade, diameter / 1e3)
    assert tuple(1e6 * each for each in told) == pytest.approx(printed)


def test_a_fit_leaves_half_its_greatest_clearance_to_the_centres():
    assert greatest_clearance(parse_fit("H7/g6"), 0.02) == pytest.approx(20.5e-6)
    for text in ("H7", "H3/g6", "H7/z6", "7H/g6"):
        with pytest.raises(FitError):
            parse_fit(text)
    with pytest.raises(FitError, match="up to 500 mm"):
        greatest_clearance(parse_fit("H7/g6"), 0.6)


def test_general_tolerances_are_those_printed():
    printed = {
        "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3),
        "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8),
        "c": (0.2, 0.3, 0.5, 0.8, 1.2),
    }
    for grade, deviations in printed.items():
        for length, deviation in zip((3, 6, 30, 120, 400, 1000), deviations, strict=False):
            assert 1e3 * length_deviation(grade, length / 1e3) == pytest.approx(deviation)
    assert length_deviation("v", 0.002) is None
    assert length_deviation("m", 0.0) is None
    assert length_deviation("m", 5.0) is None
    assert 1e3 * length_deviation("m", 0.0301) == pytest.approx(0.3)
    assert angle_deviation("m", 0.03) == pytest.approx(0.5 * pi / 180.0)
    assert angle_deviation("v", 1.0) == pytest.approx(pi / 540.0)


def test_one_tolerance_of_all_lengths_is_read_and_written():
    mechanism = planar.from_dict(EXAMPLE | {"tolerances": {"AB.length": 0.01, "lengths": [-0.1, "0.2 mm"]}})
    assert mechanism.tolerances.lengths == pytest.approx((-1e-4, 2e-4))
    assert write_mechanism(mechanism)["tolerances"]["lengths"] == [-0.1, 0.2]
    assert planar.from_dict(write_mechanism(mechanism)) == mechanism
