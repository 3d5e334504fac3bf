"""Mechanism files read and written back: the contract's examples, its rules one by one, and what is refused."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from dataclasses import replace
from math import cos, inf, isfinite, nan, pi, sin
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import planar
from planar.document.files import load_models
from planar.document.schema import schema
from planar.foundation.errors import BadInput
from planar.foundation.geometry import GROUND, frame_at
from planar.model.link_shapes import link_shape
from planar.model.mechanism import (
    Along,
    At,
    Course,
    Distances,
    FileUnits,
    Input,
    Link,
    Load,
    Mass,
    Mechanism,
    Point,
    PublishedValue,
    Spring,
    named_points,
    relative_motions,
)
from planar.model.pairs import pair_types
from planar.model.pairs.guide_line import LinkLine
from tests.draws import draws

FOUR_BAR = """
{
  "planar": 1,
  "name": "Four-bar chain",
  "source": "Theory of Machines, acceleration analysis, Example 3.1",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "AD",
  "links": {
    "AD": {"points": {"A": [0, 0], "D": [100, 0]}},
    "AB": {"ends": ["A", "B"], "length": 50},
    "BC": {"ends": ["B", "C"], "length": 66,
           "points": {"E": {"along": ["B", "C"], "distance": 40},
                      "F": {"distances": {"B": 45, "C": 30}, "right_of": ["B", "C"]}}},
    "DC": {"ends": ["D", "C"], "length": 56,
           "points": {"G": {"distances": {"C": 24, "D": 44}, "left_of": ["C", "D"]}}}
  },
  "pairs": [
    {"turning": "A", "links": ["AD", "AB"], "pin_radius": 30},
    {"turning": "B", "links": ["AB", "BC"], "pin_radius": 40},
    {"turning": "C", "links": ["BC", "DC"], "pin_radius": 25},
    {"turning": "D", "links": ["AD", "DC"], "pin_radius": 35}
  ],
  "inputs": [{"pair": "A", "position": 60, "velocity": "10.5 rad/s", "acceleration": "-26 rad/s^2"}],
  "sketch": {"C": [80, 50]}
}
"""

SLIDER_CRANK = """
{
  "planar": 1,
  "name": "Slider-crank",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0]}},
    "crank": {"ends": ["O", "A"], "length": 480},
    "rod": {"ends": ["A", "B"], "length": 1600,
            "points": {"E": {"along": ["A", "B"], "distance": -450}}},
    "piston": {"points": {"B": [0, 0]}}
  },
  "pairs": [
    {"turning": "O"}, {"turning": "A"}, {"turning": "B"},
    {"sliding": "stroke", "links": ["frame", "piston"],
     "line": {"through": "O", "angle": 0}, "point": "B"}
  ],
  "inputs": [{"pair": "O", "position": 60, "velocity": "20 rad/s"}],
  "sketch": {"B": [1780, 0]}
}
"""

TWO_DYADS = """
{
  "planar": 1,
  "name": "A crank, two rods on one pin, a rocker and a block",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0], "Q": [300, 0], "X": [0, 10]}},
    "crank": {"ends": ["O", "A"], "length": 50},
    "rod": {"ends": ["A", "C"], "length": 250, "points": {"X": {"along": ["A", "C"], "distance": 40, "angle": 30}}},
    "rocker": {"points": {"Q": [0, 0], "C": [0, 200]}, "axis": ["Q", "C"]},
    "link": {"ends": ["C", "D"], "length": 400}
  },
  "pairs": [
    {"turning": "O"},
    {"turning": "A"},
    {"turning": "C", "pin_diameter": 30},
    {"turning": "Q"},
    {"sliding": "stroke", "on": "frame", "block": "D", "line": {"through": [0, 250]}}
  ],
  "inputs": [{"pair": "O", "position": 60, "velocity": "100 rpm"}],
  "loads": [{"point": "D", "force": [-3000, 0]}, {"link": "crank", "torque": 5}],
  "sketch": {"C": [280, 200], "D": [660, 250], "rod.X": [60, 40]},
  "published": [{"symbol": "v_D", "quantity": "velocity", "of": "D", "value": "0.5 m/s"}]
}
"""

WHEELS = """
{
  "planar": 1,
  "name": "A train of wheels, a rack and a slotted arm",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0], "Q": [80, 0], "R": [80, 200], "T": [200, 0], "S": [-90, 0]}},
    "sun": {"ends": ["O", "A"], "length": 40},
    "planet": {"ends": ["Q", "B"], "length": 20},
    "pulley": {"points": {"R": [0, 0], "E": [15, 5]}, "axis": ["R", "E"]},
    "sprocket": {"ends": ["T", "F"], "length": 10},
    "bar": {"points": {"G": [0, 0], "H": [100, 0]}},
    "arm": {"ends": ["S", "K"], "length": 200}
  },
  "pairs": [
    {"turning": "O"}, {"turning": "Q"}, {"turning": "R"}, {"turning": "T"}, {"turning": "S"},
    {"gear": "mesh", "links": ["sun", "planet"], "carrier": "frame", "radii": [50, "3 cm"]},
    {"belt": "loop", "links": ["planet", "pulley"], "radii": [20, 40], "crossed": true},
    {"chain": "drive", "links": ["pulley", "sprocket"], "teeth": [15, 45],
     "mesh": {"pulley": 10, "sprocket": "0.5 rad"}},
    {"gear": "back", "links": ["sun", "bar"], "carrier": "arm", "ratio": -1.5},
    {"sliding": "guide", "links": ["frame", "bar"], "line": {"through": [0, -50], "to": "T"},
     "point": "G", "turn": 180},
    {"rack": "roll", "links": ["bar", "sun"], "line": {"through": "G", "to": "H"}, "point": "O", "radius": -50,
     "mesh": {"displacement": 5, "angle": "30 deg"}},
    {"slot": "groove", "links": ["arm", "sun"], "line": {"through": "S", "angle": 0}, "point": "A"}
  ],
  "inputs": [{"pair": "mesh", "position": 700, "velocity": "100 rpm"},
             {"pair": "roll", "position": "1 cm", "velocity": 2}],
  "published": [{"symbol": "x", "quantity": "displacement", "of": "roll", "value": "1 cm", "tolerance": 0.01,
                 "from": {"mesh": {"position": 0}}}]
}
"""

LOADED = """
{
  "planar": 1,
  "name": "A slider-crank with everything that can act on it",
  "units": {"length": "mm", "angle": "deg"},
  "frame": "frame",
  "links": {
    "frame": {"points": {"O": [0, 0], "S": [50, 200]}},
    "crank": {"ends": ["O", "A"], "length": 80},
    "rod": {"ends": ["A", "B"], "length": 300, "points": {"G": {"along": ["A", "B"], "distance": 110}}}
  },
  "pairs": [
    {"turning": "O"}, {"turning": "A"},
    {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "O", "angle": 0}}
  ],
  "inputs": [{"pair": "O", "position": 40, "velocity": "60 rpm"}],
  "loads": [
    {"point": "B", "force": ["-2 kN", 0],
     "varies": {"with": "O", "at": [0, 90, 90, 360], "factors": [0, 1, 0.25, 0]}},
    {"point": "G", "force": [3, -4], "axes": "rod"},
    {"link": "crank", "torque": "500 N mm", "varies": {"at": [0, "200 ms", 1], "factors": [1, 0, 0.5]}},
    {"pair": "stroke", "force": 40},
    {"pair": "A", "torque": -0.5}
  ],
  "springs": [
    {"points": ["S", "A"], "stiffness": "2 N/mm", "free_length": 120, "damping": 3},
    {"points": ["O", "B"], "damping": "0.5 N s/mm"},
    {"links": ["crank", "rod"], "stiffness": "5 N m/rad", "free_angle": -30, "damping": 0.02},
    {"links": ["frame", "rod"], "stiffness": 1}
  ],
  "masses": [
    {"link": "crank", "mass": "900 g", "at": [20, -5], "inertia": 0.001},
    {"link": "rod", "mass": 1.5, "at": "G"},
    {"link": "rod", "mass": 0, "at": "A", "inertia": "2e4 g mm^2"},
    {"link": "block B", "mass": 0.8, "at": "B"}
  ],
  "gravity": [0, "-9.81 m/s^2"],
  "sketch": {"B": [360, 0]}
}
"""

EXAMPLES = {
    "four-bar": FOUR_BAR,
    "slider-crank": SLIDER_CRANK,
    "two dyads": TWO_DYADS,
    "wheels": WHEELS,
    "loaded": LOADED,
}

STEADY = settings(deadline=None)
"""No example is timed: the first one may load a library."""

EPS4 = 1e-15
"""Numbers of files are converted by two roundings, each of 1.1e-16."""


def base(name: str = "four-bar") -> Any:
    """A fresh JSON value of an example."""
    return json.loads(EXAMPLES[name])


def put(value: Any, path: list[Any], new: Any) -> Any:
    """The value with what stands at a path replaced."""
    place = value
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = new
    return value


def read(*changes: tuple[list[Any], Any], of: str = "four-bar") -> Mechanism:
    value = base(of)
    for path, new in changes:
        put(value, path, new)
    return planar.from_dict(value)


def refused(value: Any) -> BadInput:
    """How a value is refused: in one printable line of a readable length."""
    with pytest.raises(BadInput) as caught:
        planar.from_dict(value)
    assert str(caught.value).isprintable()
    assert 20 < len(str(caught.value)) < 500
    return caught.value


# the examples of the contract


def test_the_four_bar_of_the_contract_reads_as_it_is_written() -> None:
    m = planar.loads(FOUR_BAR)
    assert m.name == "Four-bar chain"
    assert m.source == "Theory of Machines, acceleration analysis, Example 3.1"
    assert m.units == FileUnits("mm", "deg")
    assert m.frame == "AD"
    assert m.links == (
        Link("AD", (Point("A", At(0.0, 0.0)), Point("D", At(0.1, 0.0)))),
        Link("AB", (), ("A", "B"), 0.05),
        Link(
            "BC",
            (Point("E", Along("B", "C", 0.04)), Point("F", Distances("B", "C", 0.045, 0.03, False))),
            ("B", "C"),
            0.066,
        ),
        Link("DC", (Point("G", Distances("C", "D", 0.024, 0.044, True)),), ("D", "C"), 0.056),
    )
    assert [(p.name, p.links, p.points, p.radius) for p in m.pairs] == [
        ("A", ("AD", "AB"), ("A", "A"), 0.03),
        ("B", ("AB", "BC"), ("B", "B"), 0.04),
        ("C", ("BC", "DC"), ("C", "C"), 0.025),
        ("D", ("AD", "DC"), ("D", "D"), 0.035),
    ]
    assert m.inputs == (Input("A", pytest.approx(pi / 3.0, rel=EPS4), 10.5, -26.0),)
    assert m.sketch == (("C", 0.08, 0.05),)
    assert m.remarks == ()
    assert [each.name for each in named_points(m)] == ["A", "D", "B", "C", "E", "F", "G"]


def test_the_slider_crank_of_the_contract_reads_as_it_is_written() -> None:
    m = planar.loads(SLIDER_CRANK)
    assert [(p.name, p.links) for p in m.pairs] == [
        ("O", ("frame", "crank")),
        ("A", ("crank", "rod")),
        ("B", ("rod", "piston")),
        ("stroke", ("frame", "piston")),
    ]
    slide = m.pairs[3]
    assert (slide.line, slide.point, slide.block_angle) == (LinkLine("O", None, 0.0), "B", 0.0)
    assert m.inputs == (Input("O", pytest.approx(pi / 3.0, rel=EPS4), 20.0, 0.0),)
    assert link_shape(m.links[2]).points["E"] == (-0.45, 0.0)
    assert m.sketch == (("B", 1.78, 0.0),)
    assert m.remarks == ()


@pytest.mark.parametrize("text", EXAMPLES.values(), ids=list(EXAMPLES))
def test_an_example_written_and_read_again_is_the_same_mechanism(text: str) -> None:
    m = planar.loads(text)
    assert planar.from_dict(planar.to_dict(m)) == m
    assert planar.loads(planar.dumps(m)) == m


def test_every_model_that_comes_along_written_and_read_again_is_the_same_mechanism() -> None:
    for file, m in load_models():
        assert planar.loads(planar.dumps(m)) == m, file.stem


def test_numbers_are_written_as_their_author_wrote_them() -> None:
    before, after = base(), planar.to_dict(planar.loads(FOUR_BAR))
    assert after["units"] == before["units"]
    assert after["frame"] == before["frame"]
    assert after["pairs"] == before["pairs"]
    assert after["sketch"] == before["sketch"]
    assert after["links"]["AB"] == before["links"]["AB"]
    assert after["links"]["AD"] == before["links"]["AD"]
    assert after["links"]["BC"]["points"]["F"] == before["links"]["BC"]["points"]["F"]
    assert after["inputs"][0]["position"] == 60


def test_what_acts_reads_as_it_is_written() -> None:
    m = planar.loads(LOADED)
    quarter = pi / 2
    assert m.loads == (
        Load(point="B", force=(-2000.0, 0.0), varies=Course("O", (0.0, quarter, quarter, 2 * pi), (0, 1, 0.25, 0))),
        Load(point="G", force=(3.0, -4.0), axes="rod"),
        Load(link="crank", torque=0.5, varies=Course(None, (0.0, 0.2, 1.0), (1, 0, 0.5))),
        Load(pair="stroke", effort=40.0),
        Load(pair="A", effort=-0.5),
    )
    assert m.springs == (
        Spring(("S", "A"), None, 2000.0, 0.12, 3.0),
        Spring(("O", "B"), None, 0.0, 0.0, 500.0),
        Spring(None, ("crank", "rod"), 5.0, pytest.approx(-pi / 6.0, rel=EPS4), 0.02),
        Spring(None, ("frame", "rod"), 1.0),
    )
    assert m.masses == (
        Mass("crank", 0.9, (0.02, -0.005), 0.001),
        Mass("rod", 1.5, "G"),
        Mass("rod", 0.0, "A", pytest.approx(2e-5, rel=EPS4)),
        Mass("block B", 0.8, "B"),
    )
    assert m.gravity == (0.0, -9.81)
    assert planar.to_dict(m)["loads"][0] == base("loaded")["loads"][0] | {"force": [-2000, 0]}
    assert {"springs", "masses", "gravity"} & set(planar.to_dict(planar.loads(FOUR_BAR))) == set()


def test_reading_leaves_the_value_as_it_was() -> None:
    for name in EXAMPLES:
        value = base(name)
        planar.from_dict(value)
        assert value == base(name)


# links


def test_a_bell_crank_turns_the_way_anticlockwise_about_the_first_point() -> None:
    bell = {"ends": ["B", "C"], "length": 66, "points": {"E": {"along": ["B", "C"], "distance": 40, "angle": 90}}}
    e = link_shape(read((["links", "BC"], bell)).links[2]).points["E"]
    assert (e.x, e.y) == pytest.approx((0.0, 0.04), abs=1e-17)


def test_the_frame_of_a_mechanism_need_not_be_its_first_link() -> None:
    assert read((["frame"], "DC")).frame == "DC"


def test_bare_numbers_are_metres_and_radians_where_no_units_are_declared() -> None:
    value = base()
    del value["units"]
    m = planar.from_dict(put(value, ["inputs", 0], {"pair": "A", "position": 1.5, "velocity": 2, "acceleration": -3}))
    assert m.units == FileUnits("m", "rad")
    assert m.links[1].length == 50.0
    assert m.pairs[0].radius == 30.0
    assert m.inputs == (Input("A", 1.5, 2.0, -3.0),)
    assert m.sketch == (("C", 80.0, 50.0),)


def test_any_number_may_be_a_text_with_its_own_unit() -> None:
    m = read(
        (["links", "AB", "length"], "5 cm"),
        (["links", "AD", "points", "D"], ["0.1 m", 0]),
        (["links", "BC", "points", "E"], {"along": ["B", "C"], "distance": "4cm", "angle": "0.5 rad"}),
        (["pairs", 0, "pin_radius"], "1 in"),
        (["inputs", 0], {"pair": "A", "position": "0.25 turn", "velocity": "210 rpm", "acceleration": "180 °/s²"}),
        (["sketch", "C"], ["8 cm", "0.05 m"]),
    )
    assert m.links[1].length == 0.05
    assert m.links[0].points[1].place == At(0.1, 0.0)
    assert m.links[2].points[0].place == Along("B", "C", 0.04, 0.5)
    assert m.pairs[0].radius == 0.0254
    given = (m.inputs[0].position, m.inputs[0].velocity, m.inputs[0].acceleration)
    assert given == pytest.approx((pi / 2.0, 7.0 * pi, pi), rel=EPS4)
    assert m.sketch == (("C", 0.08, 0.05),)


# turning pairs


def pins(m: Mechanism) -> list[tuple[str, tuple[str, str]]]:
    return [(pair.name, pair.links) for pair in m.pairs]


def test_links_left_out_are_all_that_carry_the_point_the_frame_first() -> None:
    m = read((["pairs", 3], {"turning": "D"}), (["frame"], "DC"))
    assert pins(m)[3] == ("D", ("DC", "AD"))
    assert pins(read((["pairs", 3], {"turning": "D"})))[3] == ("D", ("AD", "DC"))
    assert pins(read(of="two dyads"))[2:4] == [("C:rod,rocker", ("rod", "rocker")), ("C:rod,link", ("rod", "link"))]


def test_a_pin_of_n_links_is_n_minus_1_pairs_and_every_relative_motion_has_a_name() -> None:
    m = read((["pairs", 2, "links"], ["link", "rod", "rocker"]), of="two dyads")
    assert pins(m)[2:4] == [("C:link,rod", ("link", "rod")), ("C:link,rocker", ("link", "rocker"))]
    assert len(m.pairs) == 7
    about_c = [name for name in relative_motions(m) if name.startswith("C")]
    assert about_c == ["C:link,rod", "C:link,rocker", "C:rod,rocker"]
    assert relative_motions(m)["C:rod,rocker"].links == ("rod", "rocker")
    assert {pair.radius for pair in relative_motions(m).values() if pair.entry_name() == "C"} == {0.015}


def test_points_names_what_each_link_calls_the_pin() -> None:
    value = base()
    value["links"]["DC"] = {"ends": ["D", "K"], "length": 56}
    value["pairs"][2] = {"turning": "joint", "links": ["BC", "DC"], "points": ["C", "K"]}
    value["sketch"] = {"joint": [80, 50]}
    m = planar.from_dict(value)
    assert (m.pairs[2].name, m.pairs[2].points) == ("joint", ("C", "K"))
    named = {each.name: each.members for each in named_points(m)}
    assert named["joint"] == (("BC", "C"), ("DC", "K"))
    assert "C" not in named
    assert planar.to_dict(m)["pairs"][2] == {"turning": "joint", "links": ["BC", "DC"], "points": ["C", "K"]}
    assert m == planar.from_dict(put(value, ["sketch"], {"BC.C": [80, 50]}))


def test_pin_diameter_stands_for_twice_the_radius() -> None:
    assert read((["pairs", 0], {"turning": "A", "pin_diameter": 60})) == read((["pairs", 0, "pin_radius"], 30))
    assert read((["pairs", 0], {"turning": "A"})).pairs[0].radius is None


def test_the_same_point_written_as_two_pairs_is_refused_with_the_remedy() -> None:
    value = base("two dyads")
    value["pairs"][2:3] = [{"turning": "C", "links": ["rod", "rocker"]}, {"turning": "C", "links": ["rocker", "link"]}]
    problem = refused(value)
    assert problem.place == "$.pairs[3]"
    for words in ("'C'", "$.pairs[2]", "write one pair", "all links"):
        assert words in problem.sentence


def test_the_same_point_written_as_two_pairs_of_different_names_is_refused() -> None:
    value = base("two dyads")
    other = {"turning": "C2", "links": ["rocker", "link"], "points": ["C", "C"]}
    value["pairs"][2:3] = [{"turning": "C", "links": ["rod", "rocker"]}, other]
    problem = refused(value)
    assert problem.place == "$.pairs[3]"
    assert "write one pair" in problem.sentence


def test_a_link_that_carries_the_point_but_is_left_out_gets_a_note() -> None:
    m = read((["pairs", 2], {"turning": "C", "links": ["rod", "rocker"]}), of="two dyads")
    (remark,) = m.remarks
    for words in ("'link'", "'C'", "not on the pin"):
        assert words in remark
    assert "link.C" in [each.name for each in named_points(m)]


def test_two_links_may_carry_points_of_one_name_that_no_pair_joins() -> None:
    assert read(of="two dyads").remarks == ()


@pytest.mark.parametrize("joined", [["frame", "crank"], ["crank", "frame"]])
def test_an_input_at_a_pin_on_the_frame_is_the_angle_of_the_other_link(joined: list[str]) -> None:
    m = read((["pairs", 0], {"turning": "O", "links": joined}), of="slider-crank")
    frames = {"frame": GROUND, "crank": frame_at(0.0, 0.0, 0.7)}
    pair = m.pairs[0]
    assert pair.links == tuple(joined)
    assert pair.input_position([frames[link] for link in joined], (0.0,) * 4, ()) == pytest.approx(0.7, abs=0.0)
    # the rest of the way: the solved crank stands at the input's angle, and turns with it
    crank = planar.solve(m).link("crank")
    assert crank.angle == pytest.approx(pi / 3.0, abs=1e-12)
    assert crank.angular_velocity == pytest.approx(20.0, abs=1e-9)
    assert planar.solve(m).pair("O")["relative_angular_velocity"] == pytest.approx(20.0, abs=1e-9)


@pytest.mark.parametrize(("joined", "sign"), [(["crank", "rod"], 1.0), (["rod", "crank"], -1.0)])
def test_between_moving_links_a_motion_is_the_second_against_the_first(joined: list[str], sign: float) -> None:
    m = read((["pairs", 1], {"turning": "A", "links": joined}), of="slider-crank")
    state = planar.solve(m)
    apart = state.link("rod").angular_velocity - state.link("crank").angular_velocity
    assert state.pair("A")["relative_angular_velocity"] == pytest.approx(sign * apart, abs=1e-9)


def test_an_input_may_be_between_two_links_of_a_pin_of_several() -> None:
    for name in ("C:rod,rocker", "C:rocker,link", "C:rod,link"):
        m = read((["inputs"], [{"pair": name, "position": 90, "velocity": "1 rad/s"}]), of="two dyads")
        assert m.inputs == (Input(name, pytest.approx(pi / 2.0, rel=EPS4), 1.0),)


def test_a_plain_name_of_a_pin_of_several_links_is_refused_with_the_names_that_do() -> None:
    value = put(base("two dyads"), ["inputs", 0, "pair"], "C")
    problem = refused(value)
    assert problem.place == "$.inputs[0].pair"
    for words in ("several links", "'C:rod,rocker'", "'C:rod,link'", "'C:rocker,link'"):
        assert words in problem.sentence


def test_a_motion_named_against_the_order_of_the_list_is_refused_with_the_right_name() -> None:
    problem = refused(put(base("two dyads"), ["inputs", 0, "pair"], "C:link,rod"))
    assert problem.place == "$.inputs[0].pair"
    assert "'C:rod,link'" in problem.sentence
    assert "order" in problem.sentence


# sliding pairs


def sliding(m: Mechanism) -> Any:
    return next(pair for pair in m.pairs if pair.keyword == "sliding")


@pytest.mark.parametrize(
    ("line", "through", "to", "angle"),
    [
        ({"through": "O"}, "O", None, 0.0),
        ({"through": "O", "angle": 180}, "O", None, pi),
        ({"through": [5, "1 cm"], "angle": "0.5 rad"}, (0.005, 0.01), None, 0.5),
        ({"through": "O", "to": [10, 10]}, "O", (0.01, 0.01), pi / 4.0),
        ({"through": [10, 0], "to": "O"}, (0.01, 0.0), "O", pi),
    ],
)
def test_a_line_goes_through_a_place_at_an_angle_or_to_another(line: Any, through: Any, to: Any, angle: float) -> None:
    m = read((["pairs", 3, "line"], line), of="slider-crank")
    slide = sliding(m)
    assert (slide.line.through, slide.line.to) == (through, to)
    _, _, cosine, sine, *_, turned = slide.measure([link_shape(m.links[0]), link_shape(m.links[3])])
    assert (cosine, sine, turned) == pytest.approx((cos(angle), sin(angle), angle), rel=EPS4, abs=EPS4)


def test_turn_is_the_fixed_angle_from_the_line_to_the_second_link() -> None:
    assert sliding(read((["pairs", 3, "turn"], 180), of="slider-crank")).block_angle == pytest.approx(pi, rel=EPS4)


def test_a_block_is_a_link_of_its_own_pinned_to_the_links_that_carry_the_point() -> None:
    m = read(of="two dyads")
    assert [link.name for link in m.links][-1] == "block D"
    assert m.links[-1].points == (Point("D", At(0.0, 0.0)),)
    slide = sliding(m)
    assert (slide.name, slide.links, slide.point) == ("stroke", ("frame", "block D"), "D")
    assert ("D", ("link", "block D")) in pins(m)
    assert m.remarks == ()


@pytest.mark.parametrize("entry", [{"turning": "C"}, {"turning": "C", "links": ["rocker", "rod", "link"]}])
def test_a_block_joins_the_turning_pair_that_is_written_already(entry: Any) -> None:
    value = put(base("two dyads"), ["pairs", 2], entry)
    value["pairs"].append({"sliding": "guide", "on": "rocker", "block": "C", "line": {"through": "Q", "to": "C"}})
    m = planar.from_dict(value)
    about_c = [pair for pair in m.pairs if pair.entry_name() == "C"]
    assert len(about_c) == 3
    assert about_c[-1].links[1] == "block C"
    assert planar.from_dict(planar.to_dict(m)) == m


def test_a_block_joins_a_pin_whose_links_call_it_differently() -> None:
    value = base("two dyads")
    value["links"]["link"]["ends"] = ["K", "D"]
    value["pairs"][2] = {"turning": "C", "links": ["rocker", "rod", "link"], "points": ["C", "C", "K"]}
    value["pairs"].append({"sliding": "guide", "on": "rocker", "block": "C", "line": {"through": "Q", "to": "C"}})
    about_c = [pair for pair in planar.from_dict(value).pairs if pair.entry_name() == "C"]
    assert [pair.links for pair in about_c] == [("rocker", "rod"), ("rocker", "link"), ("rocker", "block C")]
    assert [pair.points for pair in about_c] == [("C", "C"), ("C", "K"), ("C", "C")]


def test_a_block_of_the_name_of_a_link_is_refused() -> None:
    value = put(base("two dyads"), ["links", "block D"], {"points": {"Z": [0, 0]}})
    problem = refused(value)
    assert problem.place == "$.pairs[4]"
    assert "'block D'" in problem.sentence


def test_a_file_without_a_sketch_inputs_or_a_name_reads() -> None:
    value = base()
    for key in ("sketch", "inputs", "name", "source"):
        del value[key]
    m = planar.from_dict(value)
    assert (m.sketch, m.inputs, m.source) == ((), (), None)
    assert planar.loads(planar.dumps(m)) == m


def test_an_input_at_a_sliding_pair_is_a_length() -> None:
    given = [{"pair": "stroke", "position": 1780, "velocity": "200 mm/s", "acceleration": "1 m/s^2"}]
    m = read((["inputs"], given), of="slider-crank")
    assert m.inputs == (Input("stroke", 1.78, 0.2, 1.0),)
    assert planar.to_dict(m)["inputs"] == [{"pair": "stroke", "position": 1780, "velocity": 0.2, "acceleration": 1}]


# rates


@pytest.mark.parametrize("key", ["velocity", "acceleration"])
def test_a_bare_angular_rate_in_a_file_of_degrees_is_refused_with_the_remedy(key: str) -> None:
    problem = refused(put(base(), ["inputs", 0, key], 10.5))
    assert problem.place == f"$.inputs[0].{key}"
    for words in ("10.5", "deg", "rad/s"):
        assert words in problem.sentence
    if key == "velocity":
        assert "rad/s, deg/s or rpm" in problem.sentence
        assert "'10.5 rad/s'" in problem.sentence


def test_a_rate_of_nothing_needs_no_unit() -> None:
    m = read((["inputs", 0, "velocity"], 0), (["inputs", 0, "acceleration"], 0.0))
    assert m.inputs[0].velocity == m.inputs[0].acceleration == 0.0


# names of points in results


def test_a_point_on_a_pin_stands_once_and_one_whose_name_is_not_unique_with_its_link() -> None:
    named = {each.name: each.members for each in named_points(read(of="two dyads"))}
    assert named["C"] == (("rod", "C"), ("rocker", "C"), ("link", "C"))
    assert named["D"] == (("link", "D"), ("block D", "D"))
    assert named["frame.X"] == (("frame", "X"),)
    assert named["rod.X"] == (("rod", "X"),)
    assert "X" not in named
    assert list(named) == ["O", "Q", "frame.X", "A", "C", "rod.X", "D"]


def test_a_sketch_may_name_a_point_of_a_link() -> None:
    assert read(of="two dyads").sketch[2] == ("rod.X", 0.06, 0.04)
    assert read((["sketch"], {"BC.C": [80, 50]})) == planar.loads(FOUR_BAR)
    assert read((["sketch"], {"BC.E": [8, 5]})).sketch == (("E", 0.008, 0.005),)


def test_a_point_sketched_under_two_names_is_refused() -> None:
    problem = refused(put(base(), ["sketch"], {"C": [80, 50], "BC.C": [81, 50]}))
    assert problem.place == "$.sketch['BC.C']"
    assert "'C'" in problem.sentence


def test_loads_name_points_and_links() -> None:
    assert read(of="two dyads").loads == (
        Load(point="D", force=(-3000.0, 0.0)),
        Load(link="crank", torque=5.0),
    )
    given = [{"point": "rod.C", "force": ["1 kN", 0]}]
    # at a pin the link that is named is the one that it acts on
    assert read((["loads"], given), of="two dyads").loads == (Load(point="rod.C", force=(1000.0, 0.0)),)
    given = [{"point": "C", "force": ["1 kN", 0]}]
    assert read((["loads"], given), of="two dyads").loads == (Load(point="C", force=(1000.0, 0.0)),)


def test_a_published_value_has_the_unit_of_its_quantity() -> None:
    (item,) = read(of="two dyads").published
    assert item == PublishedValue("v_D", "velocity", "D", 0.5)
    turning = {"symbol": "w", "quantity": "angular velocity", "of": "rod", "value": "60 rpm", "sense": "clockwise"}
    (item,) = read((["published"], [turning]), of="two dyads").published
    assert item.value == pytest.approx(2.0 * pi, rel=EPS4)


def test_a_published_value_may_be_of_one_point_against_another() -> None:
    relative = {"symbol": "v", "quantity": "velocity", "of": "rod.C", "relative_to": "rod.A", "value": 1}
    (item,) = read((["published"], [relative]), of="two dyads").published
    assert (item.of, item.relative_to) == ("C", "A")
    problem = refused(put(base("two dyads"), ["published"], [relative | {"relative_to": "rod.Z"}]))
    assert problem.place == "$.published[0].relative_to"
    assert "'rod.Z'" in problem.sentence


# numbers of numpy


def test_numbers_of_numpy_read_and_write_as_plain_numbers_do() -> None:
    plain = planar.loads(FOUR_BAR)
    value = base()
    for path in (["links", "AB", "length"], ["links", "BC", "length"], ["inputs", 0, "position"]):
        place = value
        for key in path[:-1]:
            place = place[key]
        place[path[-1]] = np.float64(place[path[-1]])
    assert planar.from_dict(value) == plain
    with_numpy = Mechanism(
        plain.name,
        plain.frame,
        plain.links,
        plain.pairs,
        inputs=tuple(Input(g.pair, *map(np.float64, (g.position, g.velocity, g.acceleration))) for g in plain.inputs),
        loads=(Load(point="C", force=(np.float64(1.5), np.float64(2.0))), Load(link="AB", torque=np.float64(0.1))),
        sketch=plain.sketch,
        units=plain.units,
        source=plain.source,
        published=(PublishedValue("v", "velocity", "C", np.float64(0.4), np.float64(0.01)),),
    )
    assert planar.loads(planar.dumps(with_numpy)) == with_numpy


# bad input, place by place

GONE = "no value at all"
"""In the place of a value: there is none."""


def mistake(path: str, new: Any, place: str, *words: str, of: str = "four-bar") -> Any:
    """A row of the table: what is written where ("links/AB/length"), the place to be named, words that must stand."""
    keys = [int(key) if key.isdigit() else key for key in path.split("/")] if path else []
    return pytest.param(of, keys, new, place, words, id=f"{path or 'whole'}={str(new)[:40]}".replace("\n", " "))


ALONG = "links/BC/points/E"
TRIANGLE = "links/BC/points/F"
SLIDE = {"sliding": "s", "on": "AD", "block": "E", "line": {"through": "A"}}
RIDE = {"sliding": "s", "links": ["AD", "BC"], "line": {"through": "A"}, "point": "E"}
PRINTED = {"symbol": "v", "quantity": "velocity", "of": "C", "value": 1}

MISTAKES = [
    # the whole
    mistake("", [], "$", "object", "a list"),
    mistake("", None, "$", "object", "null"),
    mistake("", "text", "$", "object", "'text'"),
    mistake("", 5, "$", "object", "number 5"),
    mistake("planar", GONE, "$", "'planar'", "missing"),
    mistake("planar", 2, "$.planar", "format is to be the number 1, not the number 2"),
    mistake("planar", "1", "$.planar", "format", "'1'"),
    mistake("planar", True, "$.planar", "format", "true"),
    mistake("link", {}, "$.link", "unknown key 'link'", "'links'"),
    mistake("Frame", "AD", "$.Frame", "unknown key 'Frame'", "'frame'"),
    mistake("name", 5, "$.name", "text", "number 5"),
    mistake("name", None, "$.name", "text", "null"),
    mistake("notes", "one", "$.notes", "list", "'one'"),
    mistake("notes", ["one", 2], "$.notes[1]", "text", "number 2"),
    mistake("ids", {}, "$.ids", "list", "an object"),
    mistake("geometry", "fit", "$.geometry", "'fit'", "fitted", "given"),
    # units
    mistake("units", "mm", "$.units", "object", "'mm'"),
    mistake("units", {"lenght": "mm"}, "$.units.lenght", "'lenght'", "'length'"),
    mistake("units/length", "deg", "$.units.length", "'deg'", "length", "'mm'"),
    mistake("units/length", "parsnip", "$.units.length", "'parsnip'", "length"),
    mistake("units/length", 5, "$.units.length", "text", "number 5"),
    mistake("units/angle", "mm", "$.units.angle", "'mm'", "angle", "'deg'"),
    mistake("units/angle", "percent", "$.units.angle", "'percent'"),
    mistake("units/length", "m^0", "$.units.length", "'m^0'"),
    mistake("units/length", "x" * 100_000, "$.units.length", "unit"),
    # frame
    mistake("frame", GONE, "$", "'frame'", "missing"),
    mistake("frame", "Ad", "$.frame", "no link 'Ad'", "'AD'"),
    mistake("frame", ["AD"], "$.frame", "text", "a list"),
    mistake("frame", "nothing like it", "$.frame", "no link 'nothing like it'"),
    # links
    mistake("links", GONE, "$", "'links'", "missing"),
    mistake("links", [], "$.links", "object", "a list"),
    mistake("links/AB", [0, 0], "$.links.AB", "object", "a list"),
    mistake("links/AB", {}, "$.links.AB", "points"),
    mistake("links/AB", {"points": {}}, "$.links.AB", "points"),
    mistake("links/AB/lenght", 5, "$.links.AB.lenght", "'lenght'", "'length'"),
    mistake("links/AB/length", GONE, "$.links.AB", "'length'", "missing"),
    mistake("links/AB/ends", GONE, "$.links.AB.length", "'ends'"),
    mistake("links/AB/ends", ["A"], "$.links.AB.ends", "2 names", "1"),
    mistake("links/AB/ends", ["A", "B", "C"], "$.links.AB.ends", "2 names", "3"),
    mistake("links/AB/ends", ["A", "A"], "$.links.AB.ends", "'A'", "different"),
    mistake("links/AB/ends", "AB", "$.links.AB.ends", "list", "'AB'"),
    mistake("links/AB/ends", ["A", 5], "$.links.AB.ends[1]", "text", "number 5"),
    mistake("links/AB/ends", ["A", ""], "$.links.AB.ends[1]", "empty"),
    mistake("links/AB/ends", ["A", "B.C"], "$.links.AB.ends[1]", "'B.C'", "'.'"),
    mistake("links/AB/length", 0, "$.links.AB.length", "above zero", "0"),
    mistake("links/AB/length", -50, "$.links.AB.length", "above zero", "-50"),
    mistake("links/AB/length", "-50 mm", "$.links.AB.length", "above zero", "-50 mm"),
    mistake("links/AB/length", "-50\nmm", "$.links.AB.length", "above zero"),
    mistake("links/AB/length", True, "$.links.AB.length", "number", "true"),
    mistake("links/AB/length", None, "$.links.AB.length", "number", "null"),
    mistake("links/AB/length", [50], "$.links.AB.length", "number", "a list"),
    mistake("links/AB/length", {"mm": 50}, "$.links.AB.length", "number", "an object"),
    mistake("links/AB/length", "50", "$.links.AB.length", "no unit", "'50 mm'"),
    mistake("links/AB/length", "fifty", "$.links.AB.length", "'fifty'", "'50 mm'"),
    mistake("links/AB/length", "50 deg", "$.links.AB.length", "angle", "length is wanted"),
    mistake("links/AB/length", "50 parsnips", "$.links.AB.length", "'parsnips'"),
    mistake("links/AB/length", "1e999 m", "$.links.AB.length", "too large"),
    mistake("links/AB/length", 1e-155, "$.links.AB.length", "above zero", "1e-100 m at least"),
    mistake("links/AB/length", inf, "$.links.AB.length", "too large"),
    mistake("links/AB/length", nan, "$.links.AB.length", "not a number"),
    mistake("links/AB/length", 10**400, "$.links.AB.length", "too large"),
    mistake("links/AB/length", "x" * 100_000, "$.links.AB.length", "number with a unit"),
    mistake("links/AB/length", "9**9**9 m", "$.links.AB.length", "unit"),
    mistake("links/A.B", {"points": {"A": [0, 0]}}, "$.links['A.B']", "'A.B'", "'.'"),
    mistake("links/A:B", {"points": {"A": [0, 0]}}, "$.links['A:B']", "'A:B'", "':'"),
    mistake("links/A,B", {"points": {"A": [0, 0]}}, "$.links['A,B']", "'A,B'", "','"),
    mistake("links/ ", {"points": {"A": [0, 0]}}, "$.links[' ']", "empty"),
    mistake("links/x[\nfoo", 5, r"$.links['x[\nfoo']", "name"),
    # points of links
    mistake("links/AD/points", [[0, 0]], "$.links.AD.points", "object", "a list"),
    mistake("links/AD/points/D", [100], "$.links.AD.points.D", "two numbers", "1"),
    mistake("links/AD/points/D", [100, 0, 0], "$.links.AD.points.D", "two numbers", "3"),
    mistake("links/AD/points/D", [100, "far"], "$.links.AD.points.D[1]", "'far'"),
    mistake("links/AD/points/D", 100, "$.links.AD.points.D", "object", "100"),
    mistake("links/AD/points/D", {"x": 100}, "$.links.AD.points.D.x", "unknown key 'x'"),
    mistake("links/AD/points/D", {}, "$.links.AD.points.D", "[x, y]", "'along'", "'distances'"),
    mistake("links/AD/points/", [1, 2], "$.links.AD.points['']", "empty"),
    mistake("links/AD/points/D,E", [1, 2], "$.links.AD.points['D,E']", "','"),
    mistake("links/AB/points", {"B": [1, 2]}, "$.links.AB.points.B", "'B'", "end"),
    mistake(ALONG, {"along": ["B", "C"]}, "$.links.BC.points.E", "'distance'", "missing"),
    mistake(ALONG, {"along": ["B"], "distance": 4}, "$.links.BC.points.E.along", "2 names"),
    mistake(ALONG, {"along": ["B", "B"], "distance": 4}, "$.links.BC.points.E.along", "different"),
    mistake(ALONG, {"along": ["B", "X"], "distance": 4}, "$.links.BC.points.E", "no point 'X'"),
    mistake(ALONG, {"along": ["B", "E"], "distance": 4}, "$.links.BC.points.E", "rests on itself"),
    mistake(f"{ALONG}/distance", "40 deg", "$.links.BC.points.E.distance", "length is wanted"),
    mistake(f"{ALONG}/angle", "40 mm", "$.links.BC.points.E.angle", "angle is wanted"),
    mistake(f"{ALONG}/left_of", ["B", "C"], "$.links.BC.points.E.left_of", "'left_of'"),
    mistake(f"{ALONG}/distances", {"B": 1, "C": 1}, "$.links.BC.points.E.distances", "'distances'"),
    mistake(f"{TRIANGLE}/distances", {"B": 5, "C": 5}, "$.links.BC.points.F", "does not close", "B-C-F"),
    mistake(f"{TRIANGLE}/distances", {"B": 5, "C": 1e99}, "$.links.BC.points.F", "does not close"),
    mistake(f"{TRIANGLE}/distances", {"B": 5, "C": 1e200}, "$.links.BC.points.F.distances.C", "too large"),
    mistake(f"{TRIANGLE}/distances", {"B": 45}, "$.links.BC.points.F.distances", "two points", "1"),
    mistake(f"{TRIANGLE}/distances", {"B": 45, "C": 0}, "$.links.BC.points.F.distances.C", "above zero"),
    mistake(f"{TRIANGLE}/distances", {"B": 45, "E": 30}, "$.links.BC.points.F.right_of", "B and E"),
    mistake(f"{TRIANGLE}/distances", {"B\nX": 45, "C": 30}, r"$.links.BC.points.F.distances['B\nX']", "name"),
    mistake(f"{TRIANGLE}/distances", [45, 30], "$.links.BC.points.F.distances", "object", "a list"),
    mistake(f"{TRIANGLE}/right_of", GONE, "$.links.BC.points.F", "'left_of'", "'right_of'"),
    mistake(f"{TRIANGLE}/left_of", ["B", "C"], "$.links.BC.points.F", "'left_of'", "'right_of'"),
    mistake(f"{TRIANGLE}/right_of", ["B", "X"], "$.links.BC.points.F.right_of", "B and C"),
    mistake(f"{TRIANGLE}/angle", 30, "$.links.BC.points.F.angle", "'angle'"),
    mistake("links/BC/points/P", {"along": ["Q", "B"], "distance": 1}, "$.links.BC.points.P", "no point 'Q'"),
    mistake("links/AB/axis", ["A", "B"], "$.links.AB.axis", "'ends'"),
    mistake("links/AD/axis", ["A"], "$.links.AD.axis", "2 names"),
    mistake("links/AD/axis", ["A", "A"], "$.links.AD.axis", "different"),
    mistake("links/AD/axis", ["A", "X"], "$.links.AD.axis", "no point 'X'"),
    mistake("links/AD", {"points": {"A": [1, 2], "D": [1, 2]}, "axis": ["A", "D"]}, "$.links.AD.axis", "coincide"),
    # pairs
    mistake("pairs", GONE, "$", "'pairs'", "missing"),
    mistake("pairs", {}, "$.pairs", "list", "an object"),
    mistake("pairs/0", "A", "$.pairs[0]", "object", "'A'"),
    mistake("pairs/0", {}, "$.pairs[0]", "'turning'", "'sliding'"),
    mistake("pairs/0", {"turnin": "A"}, "$.pairs[0]", "'turning'", "did you mean 'turning'"),
    mistake("pairs/0", {"links": ["AD", "AB"], "turnin": "A"}, "$.pairs[0]", "did you mean 'turning'"),
    mistake("pairs/0/sliding", "s", "$.pairs[0]", "more than one"),
    mistake("pairs/0/turning", 5, "$.pairs[0].turning", "text", "number 5"),
    mistake("pairs/0/turning", "", "$.pairs[0].turning", "empty"),
    mistake("pairs/0/turning", "A.B", "$.pairs[0].turning", "'A.B'", "'.'"),
    mistake("pairs/0/turning", "Z", "$.pairs[0].turning", "'AD'", "no point 'Z'"),
    mistake("pairs/0", {"turning": "Z"}, "$.pairs[0].turning", "no link", "'Z'"),
    mistake("pairs/0", {"turning": "E"}, "$.pairs[0].turning", "two links", "only link 'BC'", "'links'"),
    mistake("pairs/0/links", ["AD", "Ab"], "$.pairs[0].links[1]", "no link 'Ab'", "did you mean 'AB'"),
    mistake("pairs/0/links", ["AD"], "$.pairs[0].links", "two links"),
    mistake("pairs/0/links", ["AD", "AB", "AD"], "$.pairs[0].links", "'AD'", "twice"),
    mistake("pairs/0/links", "AD", "$.pairs[0].links", "list", "'AD'"),
    mistake("pairs/0/links", ["AD", 5], "$.pairs[0].links[1]", "text", "number 5"),
    mistake("pairs/0/links", ["AD", "BC"], "$.pairs[0].turning", "'BC'", "no point 'A'"),
    mistake("pairs/0/points", ["A"], "$.pairs[0].points", "2 names", "1"),
    mistake("pairs/0/points", ["A", "X"], "$.pairs[0].points[1]", "'AB'", "no point 'X'"),
    mistake("pairs/0/pin_radius", 0, "$.pairs[0].pin_radius", "above zero"),
    mistake("pairs/0/pin_radius", "30 deg", "$.pairs[0].pin_radius", "length is wanted"),
    mistake("pairs/0/pin_diameter", 30, "$.pairs[0].pin_diameter", "'pin_radius'", "not both"),
    mistake("pairs/0", {"turning": "A", "pin_diameter": -1}, "$.pairs[0].pin_diameter", "above zero"),
    mistake("pairs/0/radius", 30, "$.pairs[0].radius", "unknown key 'radius'", "'pin_radius'"),
    mistake("pairs/1", {"turning": "A"}, "$.pairs[1]", "'A'", "$.pairs[0]", "write one pair"),
    mistake("pairs/3", RIDE | {"sliding": "A"}, "$.pairs[3]", "'A'", "$.pairs[0]", "another name"),
    mistake("pairs/3", RIDE | {"links": ["AD", "AB", "BC"]}, "$.pairs[3].links", "two links", "3"),
    mistake("pairs/3", RIDE | {"line": "A"}, "$.pairs[3].line", "object", "'A'"),
    mistake("pairs/3", RIDE | {"line": {}}, "$.pairs[3].line", "'through'", "missing"),
    mistake("pairs/3", RIDE | {"line": {"through": "X"}}, "$.pairs[3].line.through", "'AD'", "no point 'X'"),
    mistake("pairs/3", RIDE | {"line": {"through": "A", "to": "D", "angle": 5}}, "$.pairs[3].line.angle", "not both"),
    mistake("pairs/3", RIDE | {"line": {"through": "A", "to": "A"}}, "$.pairs[3].line.to", "different"),
    mistake("pairs/3", RIDE | {"line": {"through": "A", "to": [0, 0]}}, "$.pairs[3].line.to", "coincide"),
    mistake("pairs/3", RIDE | {"line": {"through": [5, 5], "to": [5, 5]}}, "$.pairs[3].line.to", "different"),
    mistake("pairs/3", RIDE | {"point": "X"}, "$.pairs[3].point", "'BC'", "no point 'X'"),
    mistake("pairs/3", RIDE | {"point": [1, 2]}, "$.pairs[3].point", "text", "a list"),
    mistake("pairs/3", RIDE | {"turn": "5 mm"}, "$.pairs[3].turn", "angle is wanted"),
    mistake("pairs/3", RIDE | {"on": "AD"}, "$.pairs[3].on", "'block'"),
    mistake("pairs/3", SLIDE | {"block": 5}, "$.pairs[3].block", "text", "number 5"),
    mistake("pairs/3", SLIDE | {"block": ""}, "$.pairs[3].block", "empty"),
    mistake("pairs/3", SLIDE | {"block": "BC.E"}, "$.pairs[3].block", "'BC.E'", "'.'"),
    mistake("pairs/3", SLIDE | {"block": "Z"}, "$.pairs[3].block", "no link", "'Z'"),
    mistake("pairs/3", SLIDE | {"on": "Ad"}, "$.pairs[3].on", "no link 'Ad'", "'AD'"),
    mistake("pairs/3", SLIDE | {"on": ["AD"]}, "$.pairs[3].on", "text", "a list"),
    mistake("pairs/3", SLIDE | {"links": ["AD", "BC"]}, "$.pairs[3].links", "'links'"),
    mistake("pairs/3", SLIDE | {"point": "C"}, "$.pairs[3].point", "'point'"),
    mistake("pairs/3", {"sliding": "s", "block": "E", "line": {"through": "A"}}, "$.pairs[3]", "'on'", "missing"),
    # inputs
    mistake("inputs", {}, "$.inputs", "list", "an object"),
    mistake("inputs/0", "A", "$.inputs[0]", "object", "'A'"),
    mistake("inputs/0/pair", GONE, "$.inputs[0]", "'pair'", "missing"),
    mistake("inputs/0/pair", "AA", "$.inputs[0].pair", "no pair 'AA'", "'A'"),
    mistake("inputs/0/pair", "", "$.inputs[0].pair", "no pair ''"),
    mistake("inputs/0/pair", 5, "$.inputs[0].pair", "text", "number 5"),
    mistake("inputs/0/position", GONE, "$.inputs[0]", "'position'", "missing"),
    mistake("inputs/0/position", "60 mm", "$.inputs[0].position", "a length", "an angle is wanted"),
    mistake("inputs/0/position", None, "$.inputs[0].position", "number", "null"),
    mistake("inputs/0/velocity", "10.5 Hz", "$.inputs[0].velocity", "turns or radians", "rpm"),
    mistake("inputs/0/velocity", "10.5 m/s", "$.inputs[0].velocity", "an angular velocity is wanted"),
    mistake("inputs/0/acceleration", "10.5 rad/s", "$.inputs[0].acceleration", "an angular acceleration is wanted"),
    mistake("inputs/0/speed", 5, "$.inputs[0].speed", "unknown key 'speed'"),
    mistake("inputs", [{"pair": "A", "position": 1}] * 2, "$.inputs[1].pair", "'A'", "already"),
    mistake(
        "inputs/0",
        {"pair": "stroke", "position": 60, "velocity": "1 rad/s"},
        "$.inputs[0].velocity",
        "a velocity is wanted",
        of="two dyads",
    ),
    # sketch, loads, published
    mistake("sketch", [[80, 50]], "$.sketch", "object", "a list"),
    mistake("sketch/C", 80, "$.sketch.C", "list", "80"),
    mistake("sketch/C", [80], "$.sketch.C", "two numbers", "1"),
    mistake("sketch/C", ["80 mm", "50 deg"], "$.sketch.C[1]", "length is wanted"),
    mistake("sketch/Z", [1, 2], "$.sketch.Z", "no point 'Z'"),
    mistake("sketch/BC.Z", [1, 2], "$.sketch['BC.Z']", "no point 'BC.Z'", "did you mean 'BC."),
    mistake("sketch/X", [1, 2], "$.sketch.X", "several points", "'frame.X'", "'rod.X'", of="two dyads"),
    mistake("loads", {}, "$.loads", "list", "an object"),
    mistake("loads", [{}], "$.loads[0]", "'force'", "'torque'"),
    mistake("loads", [{"point": "Z", "force": [1, 2]}], "$.loads[0].point", "no point 'Z'"),
    mistake("loads", [{"point": "C", "force": 5}], "$.loads[0].force", "list", "5"),
    mistake("loads", [{"point": "C", "force": [1, "2 m"]}], "$.loads[0].force[1]", "force is wanted"),
    mistake("loads", [{"point": "C"}], "$.loads[0]", "'force'", "missing"),
    mistake("loads", [{"point": "C", "force": [1, 2], "torque": 3}], "$.loads[0].torque", "'torque'"),
    mistake("loads", [{"link": "AB", "torque": 3, "force": [1, 2]}], "$.loads[0].force", "'force'"),
    mistake("loads", [{"link": "BA", "torque": 3}], "$.loads[0].link", "no link 'BA'"),
    mistake("loads", [{"link": "AB", "torque": "3 N"}], "$.loads[0].torque", "torque is wanted"),
    mistake("loads/0", {"point": "B"}, "$.loads[0]", "'force'", "missing", of="loaded"),
    mistake("loads/0", {"force": [1, 2]}, "$.loads[0]", "a 'force' at a 'point'", "at a 'pair'", of="loaded"),
    mistake("loads/0", {"point": "B", "pair": "A", "force": [1, 2]}, "$.loads[0]", "a load is a", of="loaded"),
    mistake("loads/1/axes", "road", "$.loads[1].axes", "no link 'road'", of="loaded"),
    mistake("loads/2/axes", "rod", "$.loads[2].axes", "'axes'", of="loaded"),
    mistake("loads/3", {"pair": "stroke", "torque": 4}, "$.loads[3].torque", "is a force", of="loaded"),
    mistake("loads/4", {"pair": "A", "force": 4}, "$.loads[4].force", "is a torque", of="loaded"),
    mistake("loads/4", {"pair": "A"}, "$.loads[4]", "'torque'", "missing", of="loaded"),
    mistake("loads/4/pair", "Z", "$.loads[4].pair", "there is no pair 'Z'", of="loaded"),
    mistake("loads/0/varies/with", "stroke", "$.loads[0].varies.with", "'stroke' has no input", of="loaded"),
    mistake("loads/0/varies/with", "Z", "$.loads[0].varies.with", "there is no pair 'Z'", of="loaded"),
    mistake("loads/0/varies/at", [0, 1], "$.loads[0].varies.factors", "4 for 2", of="loaded"),
    mistake("loads/0/varies/at", [0, 90, 80, 360], "$.loads[0].varies.at[2]", "the places rise", of="loaded"),
    mistake("loads/0/varies/at", [5, 5, 5, 5], "$.loads[0].varies.at", "do not differ", of="loaded"),
    mistake("loads/0/varies/at/0", "1 s", "$.loads[0].varies.at[0]", "an angle is wanted", of="loaded"),
    mistake("loads/2/varies/at/0", "1 deg", "$.loads[2].varies.at[0]", "a time is wanted", of="loaded"),
    mistake("loads/0/varies/factors/1", "1", "$.loads[0].varies.factors[1]", "number", of="loaded"),
    mistake("loads/0/varies/by", 1, "$.loads[0].varies.by", "'by'", of="loaded"),
    mistake("springs/0", {"stiffness": 1}, "$.springs[0]", "between two 'points'", of="loaded"),
    mistake("springs/0/links", ["frame", "rod"], "$.springs[0]", "between two 'points'", of="loaded"),
    mistake("springs/0", {"points": ["S", "A"]}, "$.springs[0]", "a 'stiffness', a 'damping', or both", of="loaded"),
    mistake("springs/0/points", ["S", "Z"], "$.springs[0].points[1]", "no point 'Z'", of="loaded"),
    mistake("springs/0/points", ["S", "S"], "$.springs[0].points", "two different points", of="loaded"),
    mistake("springs/0/points", ["S", "A", "O"], "$.springs[0].points", "two different points", of="loaded"),
    mistake("springs/0/stiffness", -1, "$.springs[0].stiffness", "from zero on", "-1", of="loaded"),
    mistake("springs/0/damping", "-1 N s/m", "$.springs[0].damping", "from zero on", of="loaded"),
    mistake("springs/0/free_length", -1, "$.springs[0].free_length", "from zero on", of="loaded"),
    mistake("springs/0/free_angle", 1, "$.springs[0].free_angle", "'free_angle'", of="loaded"),
    mistake("springs/2/stiffness", "5 N/m", "$.springs[2].stiffness", "torsional stiffness is wanted", of="loaded"),
    mistake("springs/2/links", ["rod", "rod"], "$.springs[2].links", "'rod' stands here twice", of="loaded"),
    mistake("masses/0/mass", -1, "$.masses[0].mass", "mass from zero on", "-1", of="loaded"),
    mistake("masses/0/inertia", -1, "$.masses[0].inertia", "from zero on", of="loaded"),
    mistake("masses/0/link", "Z", "$.masses[0].link", "no link 'Z'", of="loaded"),
    mistake("masses/0/at", "G", "$.masses[0].at", "'G'", "'crank'", of="loaded"),
    mistake("masses/0/at", GONE, "$.masses[0]", "'at'", "missing", of="loaded"),
    mistake("masses/0/weight", 1, "$.masses[0].weight", "'weight'", of="loaded"),
    mistake("gravity", [0], "$.gravity", "two numbers", of="loaded"),
    mistake("gravity", [0, "9.81 m/s"], "$.gravity[1]", "acceleration is wanted", of="loaded"),
    mistake("published", [{}], "$.published[0]", "'quantity'", "missing"),
    mistake("published", [PRINTED | {"quantity": "speed"}], "$.published[0].quantity", "'speed'"),
    mistake("published", [PRINTED | {"of": "Z"}], "$.published[0].of", "no point 'Z'"),
    mistake("published", [PRINTED | {"value": "1 N"}], "$.published[0].value", "velocity is wanted"),
    mistake("published", [PRINTED | {"valu": 1}], "$.published[0].valu", "'value'"),
    mistake("published", [PRINTED | {"tolerance": "1"}], "$.published[0].tolerance", "number", "'1'"),
    mistake("published", [PRINTED | {"tolerance": inf}], "$.published[0].tolerance", "number"),
    mistake("published", [PRINTED | {"tolerance": -1}], "$.published[0].tolerance", "-1"),
    mistake("published", [PRINTED | {"sense": "left"}], "$.published[0].sense", "'left'", "to the left"),
    mistake("published", [PRINTED | {"inputs": {"B": {}}}], "$.published[0].inputs.B", "no input at 'B'"),
]


def mistaken(of: str, path: list[Any], new: Any) -> Any:
    """The value of an example with a mistake in it."""
    if not path:
        return new
    value = base(of)
    if new is not GONE:
        return put(value, path, new)
    holder = value
    for key in path[:-1]:
        holder = holder[key]
    del holder[path[-1]]
    return value


@pytest.mark.parametrize(("of", "path", "new", "place", "words"), MISTAKES)
def test_a_mistake_is_refused_at_its_place(of: str, path: list[Any], new: Any, place: str, words: tuple[str]) -> None:
    problem = refused(mistaken(of, path, new))
    assert problem.place == place
    for word in words:
        assert word in problem.sentence


def test_a_remedy_is_of_the_kind_that_is_wanted() -> None:
    assert "'deg'" not in refused(put(base(), ["units", "length"], "parsnip")).sentence
    assert "'mm'" not in refused(put(base(), ["units", "angle"], "parsnip")).sentence


@pytest.mark.parametrize("name", ["a\nb", "a\x1b[31mb", "a\x00b", "a\x7fb", "\ud800", "a\u2028b", "a\u202eb"])
def test_a_name_of_characters_that_no_screen_shows_is_refused(name: str) -> None:
    value = base()
    value["links"]["AD"]["points"][name] = [1, 2]
    assert refused(value).place == f"$.links.AD.points[{name!r}]"
    value = base()
    value["links"][name] = {"points": {"Q": [0, 0]}}
    assert refused(value).place == f"$.links[{name!r}]"


@pytest.mark.parametrize("text", ["a\nb", "a\tb", "a\u202eb", "a\u2028b", "a\u200bb"])
def test_a_text_that_stands_in_one_line_of_a_table_holds_nothing_that_breaks_or_turns_it(text: str) -> None:
    for path, place in ((["name"], "$.name"), (["ids"], "$.ids[0]")):
        value = put(base(), path, [text] if path == ["ids"] else text)
        assert refused(value).place == place
    published = [{"symbol": text, "quantity": "angular velocity", "of": "BC"}]
    assert refused(put(base(), ["published"], published)).place == "$.published[0].symbol"


@pytest.mark.parametrize("mark", ["\u202a", "\u202e", "\u2066", "\u2069"])
def test_no_text_turns_the_order_of_letters(mark: str) -> None:
    assert refused(put(base(), ["about"], f"a{mark}b")).place == "$.about"
    assert refused(put(base(), ["notes"], [f"a{mark}b"])).place == "$.notes[0]"


def test_what_is_made_in_python_has_names_that_can_be_shown_too() -> None:
    made = planar.from_dict(base())
    links = tuple(replace(link, name="A\nB") if link.name == "AB" else link for link in made.links)
    with pytest.raises(BadInput, match="cannot be shown"):
        planar.solve(replace(made, links=links))


def test_half_a_character_in_a_text_is_refused() -> None:
    for key in ("name", "source", "about"):
        assert refused(put(base(), [key], "half \ud800")).place == f"$.{key}"
    assert refused(put(base(), ["notes"], ["half \ud800"])).place == "$.notes[0]"


@pytest.mark.parametrize(
    "name",
    [
        *("连杆", "Träger 2", "l’axe", "[bold]x[/bold]", "a b", "x[0]", "a/b", "😀", "e\u0301"),
        "\u0645\u06cc\u200c\u0631\u0648\u062f",  # a Persian word, written with a joiner that itself has no width
    ],
)
def test_names_in_any_language_are_names(name: str) -> None:
    text = FOUR_BAR.replace('"AB"', json.dumps(name))
    m = planar.loads(text)
    assert m.links[1].name == name
    assert planar.loads(planar.dumps(m)) == m


@pytest.mark.parametrize(
    ("path", "new"),
    [
        (["frame"], ("AD",)),
        (["links"], {1, 2}),
        (["links", 5], {"points": {"Q": [0, 0]}}),
        (["links", "AB", 5], 1),
        (["links", "AB", None], 1),
        (["planar"], 10**5000),
        (["name"], 10**5000),
        (["links", "AB", "length"], 10**5000),
        (["links", "AB", "length"], 5j),
        (["links", "AB", "length"], np.array([1.0, 2.0])),
        (["links", "AB", "length"], object()),
        (["name"], b"bytes"),
        (["pairs", 0, "turning"], ("A",)),
        (["inputs", 0, "pair"], frozenset("A")),
    ],
    ids=range(14),
)
def test_what_no_json_holds_is_bad_input_too(path: list[Any], new: Any) -> None:
    refused(put(base(), path, new))


@pytest.mark.parametrize("size", [1e110, 1e160, 1e200, 1e300])
def test_lengths_beyond_all_reason_are_refused_or_placed_exactly(size: float) -> None:
    plates = (
        {"P": [0, 0], "Q": [size, size], "R": {"along": ["P", "Q"], "distance": 1}},
        {"P": [0, 0], "Q": [1, 0], "R": {"distances": {"P": size, "Q": size}, "left_of": ["P", "Q"]}},
        {"P": [0, 0], "Q": [1, 0], "R": {"along": ["P", "Q"], "distance": size, "angle": 1}},
        {"P": [size, 0], "Q": [1, 0], "R": [1, 1]},
    )
    for points in plates:
        for axis in ({}, {"axis": ["P", "Q"]}):
            try:
                m = planar.from_dict(put(base(), ["links", "extra"], {"points": points} | axis))
            except BadInput as problem:
                assert problem.place.startswith("$.links.extra.")
            else:
                assert finite(m)


# random mechanisms


def finite(m: Mechanism) -> bool:
    return all(isfinite(c) for link in m.links for point in link_shape(link).points.values() for c in point)


NAMES = st.text(st.characters(exclude_categories=("C", "Z"), exclude_characters=".:,"), min_size=1, max_size=6)
LENGTHS = st.floats(1e-3, 1e3)
SIGNED = st.floats(-1e3, 1e3).map(lambda x: x if abs(x) > 1e-90 else 0.0)  # no length is smaller, in any unit
SPELLED = {
    "length": st.one_of(
        SIGNED, st.integers(-99, 99), SIGNED.map(lambda x: f"{x!r} in"), SIGNED.map(lambda x: f"{x}mm")
    ),
    "angle": st.one_of(
        SIGNED, st.integers(-360, 360), SIGNED.map(lambda x: f"{x!r}°"), SIGNED.map(lambda x: f"{x} rad")
    ),
    "angular velocity": st.one_of(SIGNED.map(lambda x: f"{x!r} rpm"), SIGNED.map(lambda x: f"{x!r} deg/s"), st.just(0)),
    "angular acceleration": st.one_of(SIGNED.map(lambda x: f"{x!r} rad/s²"), SIGNED.map(lambda x: f"{x!r} deg/s^2")),
    "velocity": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} mm/s"), SIGNED.map(lambda x: f"{x!r} km/h")),
    "acceleration": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} m s^-2")),
    "force": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} kN"), SIGNED.map(lambda x: f"{x!r} lbf")),
    "torque": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} N m")),
    "time": st.one_of(SIGNED, SIGNED.map(lambda x: f"{x!r} ms")),
    "mass": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} g"), LENGTHS.map(lambda x: f"{x!r} lb")),
    "moment of inertia": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} g cm^2")),
    "stiffness": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N/mm")),
    "damping": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N s/mm")),
    "torsional stiffness": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N m/deg")),
    "torsional damping": st.one_of(LENGTHS, LENGTHS.map(lambda x: f"{x!r} N m s/rad")),
}
UNITS = st.fixed_dictionaries(
    {},
    optional={
        "length": st.sampled_from(["mm", "m", "in", "ft", "cm", "µm"]),
        "angle": st.sampled_from(["deg", "rad", "°", "turn", "grad"]),
    },
)


@st.composite
def a_link(draw: Any, points: list[str]) -> Any:
    """A link that carries the points, by ends or by coordinates, and one more point of any kind."""
    own: dict[str, Any] = {}
    if len(points) > 1 and draw(st.booleans()):
        first, second, *rest = points
        length = draw(LENGTHS)
        for name in rest:
            own[name] = {"along": [first, second], "distance": draw(SPELLED["length"]), "angle": draw(SPELLED["angle"])}
        side = draw(st.sampled_from(["left_of", "right_of"]))
        apex = length * draw(st.floats(0.6, 2.0))
        own["apex"] = {"distances": {second: apex, first: apex}, side: draw(st.permutations([first, second]))}
        return {"ends": [first, second], "length": length, "points": own}
    places = draw(st.lists(st.tuples(st.integers(-99, 99), SIGNED), min_size=len(points), max_size=len(points)))
    link = {"points": dict(zip(points, map(list, places), strict=True))}
    if len(points) > 1 and places[0] != places[1] and draw(st.booleans()):
        link["axis"] = points[:2]
    link["points"]["mark"] = [draw(SPELLED["length"]), draw(SPELLED["length"])]
    return link


@st.composite
def a_train(draw: Any, k: int) -> Any:
    """Links and pairs: an arm, two wheels that it carries, and what ties their turning."""
    arm, one, two = f"arm {k}", f"wheel {k}", f"wheel {k}'"
    r, s = draw(st.integers(30, 99)), draw(st.integers(1, 29))
    keyword, by = draw(st.sampled_from(["gear", "belt", "chain"])), draw(st.sampled_from(["radii", "teeth", "ratio"]))
    tie: dict[str, Any] = {keyword: f"W{k}", "links": [one, two], "carrier": arm, by: [r, s]}
    if by == "ratio":
        tie["ratio"] = draw(st.sampled_from([-1, 1])) * draw(LENGTHS)
    elif draw(st.booleans()):
        tie |= {by: [-r, s]} if keyword == "gear" else {"crossed": True}
    if draw(st.booleans()):
        tie["mesh"] = {one: draw(SPELLED["angle"]), two: draw(SPELLED["angle"])}
    apart = abs(sum(tie[by])) if keyword == "gear" and by != "ratio" else 200
    links = {arm: {"points": {f"U{k}": [0, 0], f"V{k}": [apart, 0]}}}
    links |= {wheel: {"points": {f"{pin}{k}": [0, 0]}} for wheel, pin in ((one, "U"), (two, "V"))}
    return links, [{"turning": f"U{k}"}, {"turning": f"V{k}"}, tie]


@st.composite
def a_course(draw: Any, driven: list[tuple[str, str]]) -> Any:
    """How a load varies, with an input or with time."""
    at = draw(st.lists(st.integers(-400, 400), min_size=2, max_size=5).map(sorted).filter(lambda at: at[0] < at[-1]))
    factors = draw(st.lists(SIGNED, min_size=len(at), max_size=len(at)))
    pair = draw(st.sampled_from([None, *(pair for pair, _ in driven)]))
    return {"at": at, "factors": factors} | ({} if pair is None else {"with": pair})


@st.composite
def applied(draw: Any, points: list[str], links: list[str], pairs: list[tuple[str, str]], driven: Any) -> Any:
    """Loads of every kind, springs and masses, beside points, links and relative motions with their kinds."""

    def some(*kinds: Any) -> Any:
        return draw(st.lists(st.one_of(*kinds), max_size=4))

    def spelled(**keys: str) -> dict[str, Any]:
        return {key: SPELLED[kind] for key, kind in keys.items()}

    varies, one = {"varies": a_course(driven)}, st.sampled_from(links)
    force = st.tuples(SPELLED["force"], SPELLED["force"]).map(list)
    kinds = [
        st.fixed_dictionaries({"point": st.sampled_from(points), "force": force}, optional=varies | {"axes": one}),
        st.fixed_dictionaries({"link": one} | spelled(torque="torque"), optional=varies),
    ]
    for pair, kind in pairs:
        effort = {"length": "force", "angle": "torque"}[kind]
        kinds.append(st.fixed_dictionaries({"pair": st.just(pair), effort: SPELLED[effort]}, optional=varies))
    two = st.lists(one, min_size=2, max_size=2, unique=True)
    springs = [
        st.fixed_dictionaries(
            {"links": two} | spelled(stiffness="torsional stiffness"),
            optional=spelled(damping="torsional damping", free_angle="angle"),
        )
    ]
    if len(points) > 1:
        ends = st.lists(st.sampled_from(points), min_size=2, max_size=2, unique=True)
        optional = spelled(stiffness="stiffness") | {"free_length": LENGTHS}
        springs.append(st.fixed_dictionaries({"points": ends} | spelled(damping="damping"), optional=optional))
    place = st.tuples(SPELLED["length"], SPELLED["length"]).map(list)
    mass = st.fixed_dictionaries(
        {"link": one, "at": place} | spelled(mass="mass"), optional=spelled(inertia="moment of inertia")
    )
    found = {"loads": some(*kinds), "springs": some(*springs), "masses": some(mass)}
    return found | ({"gravity": [0, draw(SPELLED["acceleration"])]} if draw(st.booleans()) else {})


@st.composite
def documents(draw: Any) -> Any:
    """The JSON value of some mechanism: a tree of links, with pins of several links, slides, blocks, slots, racks,
    trains of wheels, inputs, loads, springs, masses.
    """
    names = draw(st.lists(NAMES, min_size=2, max_size=6, unique=True))
    carried: dict[str, list[str]] = {name: [] for name in names}
    pairs: list[dict[str, Any]] = []
    motions_of: list[tuple[str, str]] = []
    for k, name in enumerate(names[1:], 1):
        pin = f"P{k}"
        joined = [names[draw(st.integers(0, k - 1))], name]
        if k > 1 and draw(st.booleans()):
            joined += [draw(st.sampled_from([other for other in names[:k] if other not in joined] or [None]))]
            joined = [link for link in joined if link is not None]
        told: dict[str, Any] = {"turning": pin}
        if draw(st.booleans()):
            joined = draw(st.permutations(joined))
            told["links"] = joined
            if draw(st.booleans()):
                points = [f"{pin}{letter}" for letter, _ in zip("abc", joined, strict=False)]
                told["points"] = points
        for link, point in zip(joined, told.get("points", [pin] * len(joined)), strict=True):
            carried[link].append(point)
        size = draw(st.sampled_from([None, "pin_radius", "pin_diameter"]))
        if size:
            told[size] = draw(LENGTHS)
        pairs.append(told)
        if "links" in told or len(joined) == 2:
            motions_of.append((pin if len(joined) == 2 else f"{pin}:{joined[0]},{joined[-1]}", "angle"))
    links = {name: draw(a_link(carried[name])) for name in names}
    for k in range(draw(st.integers(0, 2))):
        first, second = draw(st.permutations(names))[:2]
        angle = draw(st.sampled_from([{}, {"angle": draw(SPELLED["angle"])}]))
        through = draw(st.sampled_from([*links[first]["points"], [draw(SPELLED["length"]), draw(SPELLED["length"])]]))
        how = draw(st.sampled_from(["sliding", "block", "slot", "rack"]))
        told = {"sliding" if how == "block" else how: f"S{k}", "line": {"through": through} | angle}
        if how == "block":
            links[second]["points"][f"B{k}"] = [draw(SPELLED["length"]), 0]
            told |= {"on": first, "block": f"B{k}"}
        else:
            told |= {"links": [first, second], "point": draw(st.sampled_from(list(links[second]["points"])))}
        if how == "rack":
            told |= {"radius": draw(LENGTHS), "mesh": {"displacement": draw(SPELLED["length"]), "angle": 5}}
        elif how != "slot":
            told["turn"] = draw(SPELLED["angle"])
        pairs.append(told)
        motions_of.append((f"S{k}", "length"))
    for k in range(draw(st.integers(0, 2))):
        more, tied = draw(a_train(k))
        links |= more
        pairs += tied
        motions_of.append((f"W{k}", "angle"))
    driven = draw(st.lists(st.sampled_from(motions_of), unique=True, max_size=3)) if motions_of else []
    rates = {"angle": ("angular velocity", "angular acceleration"), "length": ("velocity", "acceleration")}
    value = {
        "planar": 1,
        "name": draw(st.sampled_from(["one", "Träger", "[b]bold[/b]"])),
        "units": draw(UNITS),
        "frame": draw(st.sampled_from(names)),
        "links": links,
        "pairs": pairs,
        "inputs": [
            {"pair": pair, "position": draw(SPELLED[kind])}
            | {"velocity": draw(SPELLED[rates[kind][0]]), "acceleration": draw(SPELLED[rates[kind][1]])}
            for pair, kind in driven
        ],
        **draw(applied([f"{name}.{carried[name][0]}" for name in names[:1]], names, motions_of, driven)),
        "sketch": {f"{names[0]}.{carried[names[0]][0]}": [draw(SPELLED["length"]), draw(SPELLED["length"])]},
        "published": [
            {"symbol": "v", "quantity": "velocity", "of": f"{names[1]}.{carried[names[1]][0]}", "value": None}
            | {"relative_to": f"{names[0]}.{carried[names[0]][0]}"},
            {"symbol": "w", "quantity": "angular velocity", "of": names[1], "value": draw(SPELLED["angular velocity"])}
            | {"inputs": {pair: {"position": draw(SPELLED[kind])} for pair, kind in driven}, "tolerance": 0.01},
        ],
        "notes": ["a note"],
    }
    if value["published"][1]["value"] == 0:
        del value["published"][1]
    return value


@settings(STEADY, max_examples=draws(50), suppress_health_check=[HealthCheck.too_slow])
@given(documents())
def test_any_mechanism_written_and_read_again_is_the_same_to_the_last_bit(value: Any) -> None:
    m = planar.from_dict(value)
    again = planar.loads(planar.dumps(m))
    assert again == m
    assert planar.to_dict(again) == planar.to_dict(m)
    assert len(m.links) == len(value["links"]) + sum("block" in entry for entry in value["pairs"])


# mutilated files


def keys_of(part: Any) -> set[str]:
    """Every key that a schema lets an object have."""
    if isinstance(part, list):
        return set().union(*map(keys_of, part))
    if not isinstance(part, dict):
        return set()
    return set(part.get("properties", ())).union(*map(keys_of, part.values()))


SAID = {word for text in EXAMPLES.values() for word in text.split('"')[1::2]}
WORDS = sorted(SAID | keys_of(schema()) | {*pair_types(), "B:a,b", "C:"})
SCRAPS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 200),
    st.sampled_from([10**400, -(10**400), 0, 1e200, -1e200, 1e-200, 1e308, inf, -inf, nan, -0.0]),
    st.floats(),
    st.sampled_from(WORDS),
    st.sampled_from(["5 mm", "-5 mm", "60°", "1e999 m", "3 percent", "5 m^0", "5", "", " ", "rpm", "2 Hz", "block D"]),
    st.text(max_size=4),
)
PIECES = st.recursive(
    SCRAPS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.dictionaries(st.one_of(st.sampled_from(WORDS), st.text(max_size=3)), inner, max_size=3),
    ),
    max_leaves=6,
)


def places(value: Any, above: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path of everything in a JSON value."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [above] * bool(above) + [path for key, each in inside for path in places(each, (*above, key))]


def mutilated(value: Any, draw: Callable[..., Any]) -> Any:
    """A JSON value with something deleted, replaced, renamed or doubled."""
    path = draw(st.sampled_from(places(value)))
    place = value
    for key in path[:-1]:
        place = place[key]
    how = draw(st.sampled_from(["delete", "replace", "replace", "rename", "move"]))
    if how == "delete":
        del place[path[-1]]
    elif how == "replace" or isinstance(place, list):
        place[path[-1]] = draw(PIECES)
    elif how == "rename":
        place[draw(st.one_of(st.sampled_from(WORDS), st.text(max_size=3)))] = place.pop(path[-1])
    else:
        other = draw(st.sampled_from(places(value)))
        for key in other:
            value = value[key]
        place[path[-1]] = copy.deepcopy(value)
    return place


@settings(STEADY, max_examples=draws(200), suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large])
@given(st.sampled_from(sorted(EXAMPLES)), st.integers(1, 3), st.data())
def test_a_mutilated_file_is_read_or_refused_and_nothing_else(name: str, times: int, data: st.DataObject) -> None:
    value = base(name)
    for _ in range(times):
        if places(value):
            mutilated(value, data.draw)
    try:
        m = planar.from_dict(value)
    except BadInput as problem:
        assert problem.place.startswith("$")
        assert str(problem).isprintable()
        assert len(str(problem)) < 1000
        return
    assert finite(m)
    assert planar.loads(planar.dumps(m)) == m


@settings(STEADY, max_examples=draws(80))
@given(PIECES)
def test_any_value_at_all_is_refused_and_nothing_else(value: Any) -> None:
    with pytest.raises(BadInput):
        planar.from_dict(value)
