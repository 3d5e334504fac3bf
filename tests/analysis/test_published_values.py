"""Published values, efforts, speed and words."""

import json
from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.analysis.worked.published import compare_published
from planar.model.mechanism import Drive, PublishedValue
from planar.model.wording import direction_sense, join_all_names, speed_trend, turning_sense
from tests.command import run


def compared(item: PublishedValue, model: str = "002-E3.1"):
    mechanism = replace(planar.load(model), published=(item,))
    (found,) = compare_published(planar.solve(mechanism))
    return found


def test_a_value_beyond_the_reading_error_differs():
    item = PublishedValue("v_C", "velocity", "C", value=0.4005, tolerance=0.01)
    assert compared(item).verdict == "agrees"
    assert compared(item._replace(value=0.41)).verdict == "differs"
    assert compared(item._replace(value=0.39, tolerance=0.03)).verdict == "agrees"
    assert compared(item._replace(value=0.41)).relative_difference == pytest.approx(0.41 / 0.400471 - 1, abs=1e-5)


def test_a_wrong_sense_is_said_though_the_magnitude_agrees():
    item = PublishedValue("alpha_BC", "angular acceleration", "BC", value=32.985, tolerance=0.01, sense="anticlockwise")
    assert compared(item).verdict == "agrees"
    assert compared(item._replace(sense="clockwise")).verdict == "sense differs"
    assert compared(PublishedValue("v_C", "velocity", "C", value=0.4, sense="to the left")).verdict == "agrees"
    assert compared(PublishedValue("v_C", "velocity", "C", value=0.4, sense="to the right")).verdict == "sense differs"


def test_a_component_is_compared_with_its_sign():
    item = PublishedValue("v_Cx", "velocity", "C", component="x", value=-0.394, tolerance=0.01)
    assert compared(item).verdict == "agrees"
    assert compared(item._replace(value=0.394)).verdict == "differs"


def test_what_is_not_printed_is_solved_all_the_same():
    found = compared(PublishedValue("omega", "angular velocity", "BC"))
    assert found.verdict == "not printed"
    assert found.solved == pytest.approx(-5.150229849261061, rel=1e-12)


def test_a_quantity_at_another_input_is_solved_there():
    at = (Drive("O", np.radians(90.0)),)
    found = compared(PublishedValue("S", "position", "B", value=0.1, inputs=at, start=(Drive("O", 0.0),)), "004-SC12")
    assert found.solved == pytest.approx(0.13 - np.sqrt(0.1**2 - 0.03**2), rel=1e-12)


def test_efforts_need_no_speed_and_are_those_of_each_input():
    """An arm of two links under a force at its end: the torques are the lever arms' moments (statics)."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"A": [0, 0]}},
            "a": {"ends": ["A", "B"], "length": 2},
            "b": {"ends": ["B", "C"], "length": 1},
        },
        "pairs": [{"turning": "A"}, {"turning": "B"}],
        "inputs": [{"pair": "A", "position": 0.5}, {"pair": "B", "position": 0.7}],
        "loads": [{"point": "C", "force": [3, -4]}, {"link": "b", "torque": 1.5}],
    }
    found = planar.forces(planar.solve(planar.from_dict(value))).inputs
    upper = 1 * np.exp(1.2j)
    whole = 2 * np.exp(0.5j) + upper

    def moment(arm):
        return arm.real * -4 - arm.imag * 3 + 1.5

    assert found["A"] == pytest.approx(-moment(whole), rel=1e-12)
    assert found["B"] == pytest.approx(-moment(upper), rel=1e-12)


@pytest.mark.parametrize(
    ("vector", "words"),
    [
        ((1, 0), "to the right"),
        ((-2, 0), "to the left"),
        ((0, 3), "upwards"),
        ((0, -3), "downwards"),
        ((3, 1), "to the right, upwards"),
        ((-1, 3), "upwards, to the left"),
        ((-3, -1), "to the left, downwards"),
        ((0, 0), "at rest"),
        ((1, 1e-9), "to the right"),
    ],
)
def test_headings(vector, words):
    assert direction_sense(vector) == words


def test_senses_and_lists():
    assert (turning_sense(2.0), turning_sense(-2.0), turning_sense(0.0)) == (
        "anticlockwise",
        "clockwise",
        "does not turn",
    )
    assert (speed_trend(2.0), speed_trend(-2.0), speed_trend(0.0)) == ("speeding up", "slowing down", "steady")
    assert (join_all_names([]), join_all_names(["a"]), join_all_names(["a", "b"]), join_all_names(["a", "b", "c"])) == (
        "none",
        "a",
        "a and b",
        "a, b and c",
    )


def test_states_say_their_senses():
    state = planar.solve(planar.load("002-E3.1"))
    assert state.link("AB").sense == "anticlockwise, slowing down"
    assert state.link("BC").sense == "clockwise, slowing down"
    assert state.point("D").sense == "at rest"
    assert state.point("C").sense == "to the left, downwards, speeding up"


@pytest.mark.parametrize(("length", "rate"), [(1e-6, 1e-6), (1e-6, 1.0), (1.0, 1e-9), (1e3, 1e2), (1e3, 1e5)])
def test_senses_are_the_same_at_any_size_and_speed(length, rate):
    def solved(size: float, speed: float):
        links = {
            "f": {"points": {"A": [0, 0], "D": [0.1 * size, 0]}},
            "a": {"ends": ["A", "B"], "length": 0.05 * size},
            "b": {"ends": ["B", "C"], "length": 0.066 * size},
            "c": {"ends": ["D", "C"], "length": 0.056 * size},
        }
        given = {"pair": "A", "position": 1.0471975511965976, "velocity": speed, "acceleration": -0.2 * speed**2}
        value = {"planar": 1, "frame": "f", "links": links, "pairs": [{"turning": n} for n in "ABCD"]}
        return planar.solve(planar.from_dict(value | {"inputs": [given], "sketch": {"C": [0.09 * size, 0.05 * size]}}))

    here, there = solved(1.0, 1.0), solved(length, rate)
    assert {name: point.sense for name, point in here.points.items()} == {n: p.sense for n, p in there.points.items()}
    assert {name: link.sense for name, link in here.links.items()} == {n: k.sense for n, k in there.links.items()}
    assert here.point("B").sense == "to the left, upwards, slowing down"


@pytest.mark.parametrize("degrees", range(0, 360, 23))
def test_a_pin_at_constant_speed_is_steady_at_any_size(degrees):
    link = {"ends": ["O", "P"], "length": 2e3}
    value = {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "a": link},
        "pairs": [{"turning": "O"}],
    }
    given = {"pair": "O", "position": np.radians(degrees), "velocity": 100.0}
    state = planar.solve(planar.from_dict(value | {"inputs": [given]}))
    assert state.point("P").sense.endswith("steady")
    assert state.link("a").sense == "anticlockwise, steady"


def test_relative_motion_in_the_table_and_the_record(tmp_path):
    words = ("solve", "004-QR", "--relative", "A,C")
    table = run(tmp_path, *words).done()
    assert "A against C, in the axes of CD" in table
    assert "Coriolis" in table
    record = json.loads(run(tmp_path, *words, "--json").done())
    parts = record["relative"]["A,C"]
    whole = [
        sum(each)
        for each in zip(
            *(parts[n] for n in ("centripetal", "tangential", "coriolis", "sliding_acceleration")), strict=True
        )
    ]
    assert whole == pytest.approx(parts["acceleration"])
    assert np.hypot(*parts["coriolis"]) > 1.0


@pytest.mark.parametrize(("asked", "words"), [("A", "POINT,POINT"), ("A,Z", "no point 'Z'"), ("R,A", "name the link")])
def test_a_relative_motion_that_cannot_be_had_is_refused(asked, words, tmp_path):
    assert words in run(tmp_path, "solve", "004-QR", "--relative", asked).refused(2)
