"""Loads, springs and masses in files: read in their units, written back, refused at their place; and how loads vary."""

from __future__ import annotations

from dataclasses import replace
from math import inf, nan, pi
from typing import Any

import numpy as np
import pytest

import planar
from planar.applied import Course, Load, Mass, Spring
from planar.dynamics.courses import factor
from planar.errors import BadInput
from planar.mechanism import Units

Value = dict[str, Any]


def arm(**more: Any) -> Value:
    """Two links and a block on the second, in mm and degrees."""
    return {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0], "W": [-300, 0]}},
            "upper": {"ends": ["O", "E"], "length": 400},
            "lower": {"ends": ["E", "H"], "length": 300, "points": {"G": [100, 20]}},
            "block": {"points": {"B": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "E"},
            {"sliding": "way", "links": ["lower", "block"], "line": {"through": "E", "to": "H"}, "point": "B"},
        ],
        "inputs": [
            {"pair": "O", "position": 20},
            {"pair": "E", "position": 50},
            {"pair": "way", "position": 120},
        ],
        **more,
    }


READ: list[tuple[str, Value, Any]] = [
    ("loads", {"point": "H", "force": [3, -4]}, Load("H", (3.0, -4.0))),
    ("loads", {"point": "lower.H", "force": ["2 kN", 0], "axes": "lower"}, Load("H", (2000.0, 0.0), axes="lower")),
    ("loads", {"link": "upper", "torque": 5}, Load(link="upper", torque=5.0)),
    ("loads", {"pair": "O", "torque": 6}, Load(pair="O", effort=6.0)),
    ("loads", {"pair": "way", "force": 7}, Load(pair="way", effort=7.0)),
    (
        "loads",
        {"link": "upper", "torque": 5, "varies": {"with": "O", "at": [0, 90, 90, 360], "factors": [1, 2, 0, 1]}},
        Load(link="upper", torque=5.0, varies=Course("O", (0.0, pi / 2, pi / 2, 2 * pi), (1.0, 2.0, 0.0, 1.0))),
    ),
    (
        "loads",
        {"link": "upper", "torque": 5, "varies": {"with": "way", "at": [0, 100], "factors": [1, 2]}},
        Load(link="upper", torque=5.0, varies=Course("way", (0.0, 0.1), (1.0, 2.0))),
    ),
    (
        "loads",
        {"link": "upper", "torque": 5, "varies": {"at": [0, 2], "factors": [0, 1]}},
        Load(link="upper", torque=5.0, varies=Course(None, (0.0, 2.0), (0.0, 1.0))),
    ),
    (
        "springs",
        {"points": ["W", "H"], "stiffness": 40, "free_length": 250, "damping": 3},
        Spring(("W", "H"), None, 40.0, 0.25, 3.0),
    ),
    ("springs", {"points": ["W", "H"], "damping": 3}, Spring(("W", "H"), None, 0.0, 0.0, 3.0)),
    (
        "springs",
        {"links": ["f", "upper"], "stiffness": 2, "free_angle": -90, "damping": 0.5},
        Spring(None, ("f", "upper"), 2.0, -pi / 2, 0.5),
    ),
    ("masses", {"link": "lower", "mass": 2, "at": "G", "inertia": 0.3}, Mass("lower", 2.0, "G", 0.3)),
    ("masses", {"link": "lower", "mass": 2, "at": [100, 20]}, Mass("lower", 2.0, (0.1, 0.02))),
]


def flat(found: tuple[Any, ...]) -> list[Any]:
    return [part for each in found for part in (flat(each) if isinstance(each, tuple) else [each])]


@pytest.mark.parametrize(("key", "entry", "wanted"), READ)
def test_what_acts_is_read_in_the_units_of_the_file_and_written_back(key, entry, wanted):
    mechanism = planar.from_dict(arm(**{key: [entry]}))
    (found,) = getattr(mechanism, key)
    assert type(found) is type(wanted)
    for each, other in zip(flat(found), flat(wanted), strict=True):
        assert each == (pytest.approx(other, rel=1e-15) if isinstance(other, float) else other)
    for units in (mechanism.units, Units("m", "rad"), Units("in", "deg")):
        written = planar.to_dict(replace(mechanism, units=units))
        again = planar.to_dict(planar.from_dict(written))
        assert again == written
        (back,) = getattr(planar.from_dict(written), key)
        state, other = (planar.solve(replace(mechanism, **{key: (each,)})) for each in (found, back))
        for name, effort in planar.forces(state).inputs.items():
            assert planar.forces(other).inputs[name] == pytest.approx(effort, rel=1e-12, abs=1e-12)


def test_gravity_is_an_acceleration_in_any_unit():
    bare, said = (planar.from_dict(arm(gravity=each)) for each in ([0, -9.81], [0, "-9810 mm/s^2"]))
    assert said.gravity == pytest.approx((0.0, -9.81), rel=1e-15)
    assert bare.gravity == pytest.approx(said.gravity, rel=1e-15)
    assert "gravity" not in planar.to_dict(planar.from_dict(arm()))
    assert planar.from_dict(planar.to_dict(said)).gravity == pytest.approx(said.gravity, rel=1e-15)


VARIES = {"link": "upper", "torque": 5}


@pytest.mark.parametrize(
    ("key", "entry", "place", "sentence"),
    [
        ("loads", {"force": [1, 2]}, "$.loads[0]", "a load is a 'force' at a 'point'"),
        ("loads", {"point": "H", "link": "upper", "torque": 1}, "$.loads[0]", "a load is a 'force' at a 'point'"),
        ("loads", {"point": "X", "force": [1, 2]}, "$.loads[0].point", "no point 'X'"),
        ("loads", {"link": "X", "torque": 1}, "$.loads[0].link", "X"),
        ("loads", {"point": "H", "force": [1, 2], "axes": "X"}, "$.loads[0].axes", "X"),
        ("loads", {"pair": "X", "torque": 1}, "$.loads[0].pair", "no pair 'X'"),
        ("loads", {"pair": "way", "torque": 1}, "$.loads[0].torque", "of pair 'way' is a force"),
        ("loads", {"pair": "O", "force": 1}, "$.loads[0].force", "of pair 'O' is a torque"),
        (
            "loads",
            VARIES | {"varies": {"at": [0, 1, 2], "factors": [1, 2]}},
            "$.loads[0].varies.factors",
            "as many factors as places",
        ),
        ("loads", VARIES | {"varies": {"at": [1, 0], "factors": [1, 2]}}, "$.loads[0].varies.at[1]", "places rise"),
        ("loads", VARIES | {"varies": {"at": [1, 1], "factors": [1, 2]}}, "$.loads[0].varies.at", "do not differ"),
        ("springs", {"stiffness": 1}, "$.springs[0]", "between two 'points', or turns between two 'links'"),
        ("springs", {"points": ["W", "W"], "stiffness": 1}, "$.springs[0].points", "two different points"),
        ("springs", {"points": ["W", "H"]}, "$.springs[0]", "a 'stiffness', a 'damping', or both"),
        ("springs", {"points": ["W", "H"], "stiffness": -1}, "$.springs[0].stiffness", "from zero on"),
        ("springs", {"points": ["W", "H"], "stiffness": 1, "free_length": -1}, "$.springs[0].free_length", "zero on"),
        ("springs", {"points": ["W", "H"], "stiffness": 1, "free_angle": 1}, "$.springs[0].free_angle", "free_angle"),
        ("masses", {"link": "lower", "mass": -1, "at": "G"}, "$.masses[0].mass", "from zero on"),
        ("masses", {"link": "lower", "mass": 1, "at": "G", "inertia": -2}, "$.masses[0].inertia", "from zero on"),
        ("masses", {"link": "lower", "mass": 1, "at": "O"}, "$.masses[0].at", "O"),
        ("masses", {"link": "lower", "mass": "3 N", "at": "G"}, "$.masses[0].mass", "N"),
    ],
)
def test_what_is_wrong_in_a_file_is_said_at_its_place(key, entry, place, sentence):
    with pytest.raises(BadInput) as refused:
        planar.from_dict(arm(**{key: [entry]}))
    assert refused.value.place == place
    assert sentence in str(refused.value)


def test_a_load_varies_only_with_what_is_driven():
    value = arm(loads=[VARIES | {"varies": {"with": "way", "at": [0, 1], "factors": [1, 2]}}])
    value["inputs"].pop()
    with pytest.raises(BadInput, match="pair 'way' has no input; a load varies with an input, or with time"):
        planar.from_dict(value)


@pytest.mark.parametrize(
    ("key", "item", "sentence"),
    [
        ("loads", Load("X", (1.0, 0.0)), "there is no point 'X'"),
        ("loads", Load(pair="X", effort=1.0), "there is no pair 'X'"),
        ("loads", Load("H", (1.0, nan)), "finite"),
        ("loads", Load("H", (1.0, 0.0), axes="X"), "there is no link 'X'"),
        ("loads", Load("H", (1.0, 0.0), varies=Course("E", (1.0, 0.0), (1.0, 1.0))), "places or more that rise"),
        ("loads", Load("H", (1.0, 0.0), varies=Course("X", (0.0, 1.0), (1.0, 1.0))), "there is no input 'X'"),
        ("springs", Spring(), "between two points, or turns between two links"),
        ("springs", Spring(("W", "X"), None, 1.0), "there is no point 'X'"),
        ("springs", Spring(None, ("f", "X"), 1.0), "there is no link 'X'"),
        ("springs", Spring(("W", "H"), None, -1.0), "zero or more"),
        ("springs", Spring(("W", "H"), None, 1.0, inf), "finite"),
        ("masses", Mass("X", 1.0, (0.0, 0.0)), "there is no link 'X'"),
        ("masses", Mass("lower", 1.0, "O"), "link 'lower' has no point 'O'"),
        ("masses", Mass("lower", -1.0, "G"), "zero or more"),
        ("masses", Mass("lower", 1.0, (nan, 0.0)), "finite"),
    ],
)
def test_what_is_made_in_python_is_checked(key, item, sentence):
    mechanism = replace(planar.from_dict(arm()), **{key: (item,)})
    for run in (lambda: planar.forces(planar.solve(mechanism)), lambda: planar.simulate(mechanism, 1.0)):
        with pytest.raises(BadInput, match=sentence) as refused:
            run()
        assert refused.value.place == f"{key}[0]"


# how a load varies


def test_a_load_is_straight_between_its_places_and_stays_beyond_them():
    course = Course(None, (1.0, 2.0, 4.0), (10.0, 20.0, 0.0))
    found = factor(course, np.array([0.0, 1.0, 1.5, 3.0, 4.0, 9.0]), turns=False)
    assert list(found) == [10.0, 10.0, 15.0, 10.0, 0.0, 0.0]


def test_a_load_over_a_turn_comes_again_with_every_turn_either_way():
    course = Course("O", (-pi / 2, pi / 2, 3 * pi / 2), (0.0, 1.0, 0.0))
    angles = np.array([0.0, 0.3, 2.0])
    first = factor(course, angles, turns=True)
    assert first == pytest.approx([0.5, 0.5 + 0.3 / pi, 0.5 + (pi - 2.0) / pi], rel=1e-12)
    for turns in (-4.0, 2.0, 20.0):
        assert factor(course, angles + turns * pi, turns=True) == pytest.approx(first, rel=1e-12)
    # over the way of a slide the same numbers come once
    assert factor(course, np.array([2 * pi]), turns=False) == pytest.approx([0.0])


def test_a_step_is_two_factors_at_one_place():
    course = Course(None, (0.0, 1.0, 1.0, 2.0), (3.0, 3.0, 0.0, 0.0))
    assert list(factor(course, np.array([0.999, 1.001]), turns=False)) == [3.0, 0.0]


def test_a_load_at_a_pin_acts_on_the_link_that_is_named_with_it():
    """The same force on either side of a pin: the pin's own reaction differs by it, and nothing else does."""
    mechanism = planar.load("four-bar")
    name, links = next(
        (each.name, [link for link, _ in each.members])
        for each in planar.mechanism.named_points(mechanism)
        if len(each.members) == 2 and mechanism.frame not in [link for link, _ in each.members]
    )
    found = []
    for link in links:
        value = planar.to_dict(mechanism) | {"loads": [{"point": f"{link}.{name}", "force": [30, -40]}]}
        read = planar.from_dict(value)
        assert planar.from_dict(planar.to_dict(read)) == read
        found.append(planar.forces(planar.solve(read)))
    first, second = found
    apart = second.reactions[name].force - first.reactions[name].force
    np.testing.assert_allclose(np.abs(apart), [30.0, 40.0], rtol=1e-9)
    (given,) = mechanism.inputs
    assert first.inputs[given.pair] == pytest.approx(second.inputs[given.pair], rel=1e-9)
