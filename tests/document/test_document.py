"""Mechanism files read and written back: the contract's examples, its rules one by one, and what is refused."""

from __future__ import annotations

import json
from dataclasses import replace
from math import cos, isfinite, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import planar
from planar.foundation.errors import BadInput
from planar.foundation.geometry import GROUND, frame_at
from planar.model.file_units import FileUnits
from planar.model.link_shapes import Along, At, Distances, Link, Point, link_shape
from planar.model.loads import Course, Load, Mass, Spring
from planar.model.mechanism import Input, Mechanism, PublishedValue, check_mechanism, named_points, relative_motions
from planar.model.pairs.guide_line import LinkLine
from tests.command import run
from tests.documents import EXAMPLES, FOUR_BAR, LOADED, MISTAKES, SLIDER_CRANK, base, mistaken, put, read, refused
from tests.draws import draws
from tests.known import MODELS
from tests.random_documents import PIECES, documents, mutilated, places

STEADY = settings(deadline=None)
"""No example is timed: the first one may load a library."""

EPS4 = 1e-15
"""Numbers of files are converted by two roundings, each of 1.1e-16."""


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
    for stem, m in MODELS.items():
        assert planar.loads(planar.dumps(m)) == m, stem


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


def test_mistakes_are_refused_at_their_places() -> None:
    for case in MISTAKES:
        name, path, new, place, words = case.values
        problem = refused(mistaken(name, path, new))
        assert problem.place == place, case.id
        for word in words:
            assert word in problem.sentence, case.id


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


@settings(STEADY, max_examples=draws(50), suppress_health_check=[HealthCheck.too_slow])
@given(documents())
def test_any_mechanism_written_and_read_again_is_the_same_to_the_last_bit(value: Any) -> None:
    m = planar.from_dict(value)
    again = planar.loads(planar.dumps(m))
    assert again == m
    assert planar.to_dict(again) == planar.to_dict(m)
    assert len(m.links) == len(value["links"]) + sum("block" in entry for entry in value["pairs"])


# mutilated files


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


def test_the_frame_is_the_first_or_the_last_link_as_the_file_says(tmp_path: Path) -> None:
    value = planar.to_dict(planar.load("four-bar"))
    assert "frame_number" not in value
    first = planar.from_dict(value | {"frame_number": "first"})
    assert planar.to_dict(first)["frame_number"] == "first"
    assert planar.from_dict(planar.to_dict(first)) == first
    assert dict(planar.centres(first).numbers) == {"AD": "1", "AB": "2", "BC": "3", "DC": "4"}
    assert dict(planar.centres("four-bar").numbers) == {"AB": "1", "BC": "2", "DC": "3", "AD": "4"}
    # the same centres under other names
    one, other = planar.centres("four-bar"), planar.centres(first)
    assert (one["BC", "AD"].name, other["BC", "AD"].name) == ("I24", "I13")
    assert one["AB", "DC"].position == pytest.approx(other["AB", "DC"].position, rel=1e-12)
    text = run(tmp_path, "centres", "four-bar", "--frame-number", "first").done()
    assert "links: 1 AD, 2 AB, 3 BC and 4 DC" in text
    (tmp_path / "first.json").write_text(planar.dumps(first), encoding="utf-8")
    assert "links: 1 AD" in run(tmp_path, "centres", "first.json").done()
    assert "links: 1 AB" in run(tmp_path, "centres", "first.json", "--frame-number", "last").done()


def test_a_frame_that_cannot_be_the_first_link_is_refused(tmp_path: Path) -> None:
    """A link whose name is a number has that number, so that another one may come before the frame."""
    text = planar.dumps(planar.load("four-bar")).replace('"AB"', '"1"')
    (tmp_path / "numbered.json").write_text(text, encoding="utf-8")
    sentence = run(tmp_path, "centres", "numbered.json", "--frame-number", "first").refused(2)
    assert "--frame-number: the frame 'AD' cannot be the first link" in sentence
    with pytest.raises(BadInput, match=r"^\$.frame_number: the frame 'AD' cannot be the first link"):
        planar.loads(text.replace('"frame": "AD"', '"frame": "AD", "frame_number": "first"'))
    with pytest.raises(BadInput, match="none of first, last"):
        planar.loads(text.replace('"frame": "AD"', '"frame": "AD", "frame_number": "frist"'))


CURVED = {
    "planar": 1,
    "units": {"length": "mm", "angle": "deg"},
    "frame": "f",
    "links": {
        "f": {"points": {"A": [0, 0], "M": [100, 60]}},
        "crank": {"ends": ["A", "B"], "length": 30},
        "rod": {"ends": ["B", "C"], "length": 80},
        "arc": {"ends": ["M", "C"], "length": 50, "curved_slot": True},
    },
    "pairs": [*({"turning": name} for name in "ABC"), {"turning": "M", "stops": [-150, -20]}],
    "inputs": [{"pair": "A", "position": 40}],
    "sketch": {"C": [100, 10]},
}
"""A pin in a curved slot of the frame."""


def test_a_curved_slot_comes_back_and_moves_as_its_link() -> None:
    mechanism = planar.from_dict(CURVED)
    assert [link.name for link in mechanism.links if link.curved_slot] == ["arc"]
    assert planar.to_dict(mechanism)["links"]["arc"] == CURVED["links"]["arc"]
    bar = CURVED | {"links": CURVED["links"] | {"arc": {"ends": ["M", "C"], "length": 50}}}
    here, there = (planar.solve(planar.from_dict(value)).point("C").position for value in (CURVED, bar))
    np.testing.assert_array_equal(here, there)


@pytest.mark.parametrize(
    ("links", "pairs", "sentence"),
    [
        ({"arc": {"points": {"M": [0, 0], "C": [50, 0]}, "curved_slot": True}}, {}, "has two 'ends'"),
        ({"arc": CURVED["links"]["arc"] | {"points": {"T": [5, 5]}}}, {}, "no other points"),
        ({"arc": CURVED["links"]["arc"] | {"curved_slot": 1}}, {}, "true or false"),
        ({"arc": CURVED["links"]["arc"] | {"ends": ["N", "C"]}}, {3: None}, "its first end 'N' is the centre"),
        ({"other": {"ends": ["M", "T"], "length": 9}}, {3: {"turning": "M"}}, "and no other link"),
        ({"arc": CURVED["links"]["arc"] | {"ends": ["M", "T"]}}, {2: None}, "its second end 'T' is the pin"),
    ],
)
def test_a_link_that_cannot_stand_for_a_curved_slot_is_refused(links: Any, pairs: Any, sentence: str) -> None:
    kept = [pair for index, item in enumerate(CURVED["pairs"]) if (pair := pairs.get(index, item))]
    with pytest.raises(BadInput, match=sentence) as problem:
        planar.from_dict(CURVED | {"links": CURVED["links"] | links, "pairs": kept})
    assert problem.value.place == "$.links.arc.curved_slot"


def test_a_link_made_in_python_that_cannot_stand_for_a_curved_slot_is_refused() -> None:
    mechanism = planar.from_dict(CURVED)
    links = tuple(replace(link, curved_slot=link.name == "f") for link in mechanism.links)
    with pytest.raises(BadInput, match="f: a link that stands for a curved slot has two 'ends'"):
        check_mechanism(replace(mechanism, links=links))
