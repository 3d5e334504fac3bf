"""Loads, springs and masses in files: read in their units, written back, refused at their place; and how loads vary."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, nan, pi
from typing import Any

import numpy as np
import pytest

import planar
from planar.dynamics.load_attachment import attachment_remarks, attachments
from planar.dynamics.load_variation import interpolate_factor
from planar.foundation.errors import BadInput
from planar.model.file_units import FileUnits
from planar.model.loads import Course, Load, Mass, Spring
from tests.command import run

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
    for units in (mechanism.units, FileUnits("m", "rad"), FileUnits("in", "deg")):
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
    for asked in (lambda: planar.forces(planar.solve(mechanism)), lambda: planar.simulate(mechanism, 1.0)):
        with pytest.raises(BadInput, match=sentence) as refused:
            asked()
        assert refused.value.place == f"{key}[0]"


# how a load varies


def test_a_load_is_straight_between_its_places_and_stays_beyond_them():
    course = Course(None, (1.0, 2.0, 4.0), (10.0, 20.0, 0.0))
    found = interpolate_factor(course, np.array([0.0, 1.0, 1.5, 3.0, 4.0, 9.0]), is_angle=False)
    assert list(found) == [10.0, 10.0, 15.0, 10.0, 0.0, 0.0]


def test_a_load_over_a_turn_comes_again_with_every_turn_either_way():
    course = Course("O", (-pi / 2, pi / 2, 3 * pi / 2), (0.0, 1.0, 0.0))
    angles = np.array([0.0, 0.3, 2.0])
    first = interpolate_factor(course, angles, is_angle=True)
    assert first == pytest.approx([0.5, 0.5 + 0.3 / pi, 0.5 + (pi - 2.0) / pi], rel=1e-12)
    for turns in (-4.0, 2.0, 20.0):
        assert interpolate_factor(course, angles + turns * pi, is_angle=True) == pytest.approx(first, rel=1e-12)
    # over the way of a slide the same numbers come once
    assert interpolate_factor(course, np.array([2 * pi]), is_angle=False) == pytest.approx([0.0])


def test_a_step_is_two_factors_at_one_place():
    course = Course(None, (0.0, 1.0, 1.0, 2.0), (3.0, 3.0, 0.0, 0.0))
    assert list(interpolate_factor(course, np.array([0.999, 1.001]), is_angle=False)) == [3.0, 0.0]


def test_a_load_at_a_pin_acts_on_the_link_that_is_named_with_it():
    """The same force on either side of a pin: the pin's own reaction differs by it, and nothing else does."""
    mechanism = planar.load("four-bar")
    name, links = next(
        (each.name, [link for link, _ in each.members])
        for each in planar.model.mechanism.named_points(mechanism)
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


def pinned_slider(*pairs, **more):
    """A crank, a rod and what slides at its end B; without a sliding block, a tool that is a link of its own."""
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0]}},
                "crank": {"ends": ["O", "A"], "length": 0.2},
                "rod": {"ends": ["A", "B"], "length": 0.7},
                **more,
            },
            "pairs": [{"turning": "O"}, {"turning": "A"}, *pairs],
            "inputs": [{"pair": "O", "position": 0.8, "velocity": 2.0}],
            "sketch": {"B": [0.82, 0.0]},
        }
    )


BLOCK = {"sliding": "stroke", "on": "f", "block": "B", "line": {"through": "O"}}
RAM = {"sliding": "stroke", "links": ["f", "ram"], "line": {"through": "O"}, "point": "T"}
GUIDE = {"sliding": "stroke", "links": ["ram", "f"], "line": {"through": "T"}, "point": "O"}


@pytest.mark.parametrize(
    ("mechanism", "link", "others"),
    [
        (pinned_slider(BLOCK), "block B", ("rod.B",)),
        # a ram that is a link of its own, wherever the point that slides is, and on whichever link the line is
        (pinned_slider({"turning": "B"}, RAM, ram={"points": {"T": [0.3, 0], "B": [0, 0]}}), "ram", ("rod.B",)),
        (pinned_slider({"turning": "B"}, GUIDE, ram={"points": {"T": [0.3, 0], "B": [0, 0]}}), "ram", ("rod.B",)),
    ],
)
def test_a_load_at_a_pin_acts_on_what_slides_there(mechanism, link, others):
    """A push along the slide goes through the pin as a whole; named on the rod it leaves the pin empty along it."""
    at = attachments(mechanism)
    assert at["B"] == (link, "B", others)
    assert at["A"] == ("crank", "A", ("rod.A",))  # nothing slides there: the first in the file
    assert at[f"{link}.B"] == (link, "B", ())
    push = Load("B", (-500.0, 0.0))
    found = [
        planar.forces(planar.solve(replace(mechanism, loads=(load,))), inertia=False)
        for load in (push, push._replace(point=others[0]))
    ]
    sense = [1.0 if each.reactions["B"].links[1] == link else -1.0 for each in found]
    on_slider, on_rod = (by * each.reactions["B"].force for by, each in zip(sense, found, strict=True))
    assert on_slider[0] == pytest.approx(500.0, rel=1e-12)
    assert on_rod[0] == pytest.approx(0.0, abs=1e-9)
    assert on_slider[1] == pytest.approx(on_rod[1], rel=1e-9)
    assert found[0].inputs["O"] == pytest.approx(found[1].inputs["O"], rel=1e-12)


def test_of_two_that_slide_at_a_pin_the_one_on_the_frame_bears_a_load():
    """A pin with a block on the frame and one on a swinging lever."""
    swing = {"sliding": "swing", "links": ["lever", "shoe"], "line": {"through": "P"}, "point": "B"}
    mechanism = pinned_slider(
        swing,
        {"sliding": "stroke", "links": ["f", "piston"], "line": {"through": "O"}, "point": "B"},
        {"turning": "B"},
        {"turning": "P"},
        f={"points": {"O": [0, 0], "P": [0.8, -1.0]}},
        lever={"ends": ["P", "Q"], "length": 1.5},
        shoe={"points": {"B": [0, 0]}},
        piston={"points": {"B": [0, 0]}},
    )
    assert attachments(mechanism)["B"] == ("piston", "B", ("shoe.B", "rod.B"))


def test_the_gudgeon_of_the_engine_carries_gas_and_inertia_by_the_equilibrium_of_piston_and_rod():
    """Of the piston F_x = P + m a and F_y = -N; of the rod, about A, J e + s x (m_r a_G) = AB x (-F)."""
    engine = planar.load("two-stroke-engine")
    r, rod, s, speed = 0.03, 0.11, 0.035, 100.0 * np.pi
    piston, rod_mass, inertia = 0.32, 0.36, 0.00075
    for degrees, bar in ((40.0, 20.8), (135.0, 0.0), (300.0, 1.4)):
        state = planar.solve(engine, {"O": np.radians(degrees)})
        crank = r * np.exp(1j * np.radians(degrees))
        lean = -np.arcsin(crank.imag / rod)
        # the rates of sin(lean) = -r sin(t) / rod, twice
        swing = -speed * crank.real / (rod * np.cos(lean))
        bend = (speed**2 * crank.imag / rod + swing**2 * np.sin(lean)) / np.cos(lean)
        along = np.exp(1j * lean) * (1j * bend - swing**2)
        pin = -(speed**2) * crank
        push = 283.0 * bar + piston * (pin + rod * along).real
        turned = inertia * bend + (s * np.exp(-1j * lean) * rod_mass * (pin + s * along)).imag
        # AB x (-F) = -(AB_x F_y - AB_y F_x)
        thrust = (rod * np.sin(lean) * push - turned) / (rod * np.cos(lean))
        found = planar.forces(state)
        gudgeon = found.reactions["B"]
        assert gudgeon.links == ("rod", "block B")
        np.testing.assert_allclose(gudgeon.force, [push, thrust], rtol=1e-9, atol=1e-9 * abs(push))
        np.testing.assert_allclose(found.reactions["stroke"].force, [0.0, -thrust], atol=1e-9 * abs(push))
        if degrees == 40.0:
            assert np.hypot(*gudgeon.force) == pytest.approx(5177.13, abs=0.01)


def test_a_load_keeps_its_name_in_a_file_and_is_said_where_another_link_might_be_meant(tmp_path):
    engine = planar.load("two-stroke-engine")
    assert planar.to_dict(engine)["loads"][0]["point"] == "B"
    assert planar.from_dict(planar.to_dict(engine)) == engine
    sentence = "the load at 'B' acts on link 'block B', not on 'rod'; to have it there write 'rod.B'"
    for words in (("forces",), ("forces", "--cycle"), ("inspect",), ("explain",)):
        assert sentence in run(tmp_path, words[0], "two-stroke-engine", *words[1:]).done(), words
        if words[0] != "explain":
            told = json.loads(run(tmp_path, words[0], "two-stroke-engine", *words[1:], "--json").done())
            assert sentence in told["remarks"], words
    named = planar.from_dict(planar.to_dict(engine) | {"loads": [{"point": "rod.B", "force": [-283, 0]}]})
    assert attachment_remarks(named) == ()
    assert planar.inspect(named).remarks == ()


def test_inspect_lists_loads_springs_and_masses(tmp_path):
    lamp = json.loads(run(tmp_path, "inspect", "balanced-lamp", "--json").done())["actions"]
    assert [each["kind"] for each in lamp] == ["spring", "mass", "mass", "mass", "gravity"]
    assert lamp[0] == {
        "kind": "spring",
        "at": "S to R",
        "links": ["base", "arm"],
        "amount": "490.5 N/m, free length 0 mm",
    }
    assert lamp[1]["at"] == "(200, 0) mm" and lamp[1]["links"] == ["arm"]
    text = run(tmp_path, "inspect", "two-stroke-engine").done()
    assert " force  B           block B  283 N at 180 deg, varies with O" in text
    assert " mass   G           rod      0.36 kg, moment of inertia 0.00075 kg·m²" in text
    assert "Loads, springs" not in run(tmp_path, "inspect", "four-bar").done()
